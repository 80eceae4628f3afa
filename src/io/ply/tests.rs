//! Properties of the PLY reader.

use super::read_mesh;
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::{LengthUnit, Point3, PointCloud};
use crate::io::columns::Lengths;
use crate::io::write_ply_cloud;
use crate::run::{CancelToken, RunContext};

const RUN: RunContext = RunContext::silent();

fn read_cloud(bytes: &[u8], mm_per_unit: f64, run: &RunContext) -> Result<PointCloud, ReadError> {
    super::read_cloud(bytes, Lengths::in_mm(mm_per_unit), run)
}

fn said<T: std::fmt::Debug>(result: Result<T, ReadError>) -> Diagnostic {
    match result {
        Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic)) => *diagnostic,
        other => panic!("expected a refusal, got {other:?}"),
    }
}

/// A square with every number type, in text and both byte orders, faces first or last.
fn square(encoding: &str, faces_first: bool) -> Vec<u8> {
    let vertex = "element vertex 4\nproperty double x\nproperty float y\nproperty short z\nproperty ushort Quality\n\
                  property list uchar int around\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";
    let face = "element face 1\nproperty char kind\nproperty list ushort uint vertex_index\n";
    let elements = if faces_first { format!("{face}{vertex}") } else { format!("{vertex}{face}") };
    let mut file = format!("ply\r\nformat {encoding} 1.0\ncomment x\nobj_info y\n{elements}end_header\n").into_bytes();
    let text = encoding == "ascii";
    let big = encoding == "binary_big_endian";
    let put = |out: &mut Vec<u8>, value: f64, bytes: Vec<u8>| {
        if text {
            out.extend(format!("{value} ").bytes());
        } else if big {
            out.extend(bytes.iter().rev());
        } else {
            out.extend(bytes);
        }
    };
    let mut vertices = Vec::new();
    for (x, y) in [(0.0, 0.0), (2.0, 0.0), (2.0, 3.0), (0.0, 3.0_f32)] {
        put(&mut vertices, x, x.to_le_bytes().to_vec());
        put(&mut vertices, y.into(), y.to_le_bytes().to_vec());
        put(&mut vertices, -7.0, (-7_i16).to_le_bytes().to_vec());
        put(&mut vertices, 60_000.0, 60_000_u16.to_le_bytes().to_vec());
        put(&mut vertices, 2.0, vec![2]);
        put(&mut vertices, 5.0, 5_i32.to_le_bytes().to_vec());
        put(&mut vertices, -6.0, (-6_i32).to_le_bytes().to_vec());
        for colour in [1, 128, 255] {
            put(&mut vertices, colour.into(), vec![colour]);
        }
        if text {
            vertices.push(b'\n');
        }
    }
    let mut faces = Vec::new();
    put(&mut faces, -1.0, vec![0xff]);
    put(&mut faces, 4.0, 4_u16.to_le_bytes().to_vec());
    for corner in 0..4_u32 {
        put(&mut faces, corner.into(), corner.to_le_bytes().to_vec());
    }
    if text {
        faces.push(b'\n');
    }
    file.extend(if faces_first { [faces, vertices].concat() } else { [vertices, faces].concat() });
    file
}

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

#[test]
fn all_encodings_and_orders_give_the_same_cloud_and_mesh() {
    for encoding in ENCODINGS {
        for faces_first in [false, true] {
            let bytes = square(encoding, faces_first);
            let cloud = read_cloud(&bytes, 10.0, &RUN).unwrap();
            let place = |x, y| Point3::new(x, y, -70.0);
            assert_eq!(cloud.positions, [place(0.0, 0.0), place(20.0, 0.0), place(20.0, 30.0), place(0.0, 30.0)]);
            assert_eq!(cloud.colours, Some(vec![[1, 128, 255]; 4]));
            assert_eq!(cloud.scalars, [("Quality".to_owned(), vec![60_000.0; 4])]);
            let mesh = read_mesh(&bytes, 10.0, &RUN).unwrap();
            assert_eq!(mesh.vertices, cloud.positions);
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        }
    }
}

#[test]
fn every_cut_is_refused() {
    for encoding in ENCODINGS {
        for faces_first in [false, true] {
            let bytes = square(encoding, faces_first);
            // The last line's end and the blank before it can be missing where another digit would not fit the type:
            // colours end in 255, and a corner 3 of 4 vertices cannot become 30.
            let needed = bytes.len() - if encoding == "ascii" { 2 } else { 0 };
            for cut in 0..needed {
                assert!(read_cloud(&bytes[..cut], 1.0, &RUN).is_err(), "{encoding} {cut}");
                assert!(read_mesh(&bytes[..cut], 1.0, &RUN).is_err(), "{encoding} {cut}");
            }
        }
    }
}

#[test]
fn a_cut_binary_body_is_told_from_a_bad_one() {
    let bytes = square("binary_little_endian", false);
    assert!(matches!(read_cloud(&bytes[..bytes.len() - 1], 1.0, &RUN), Err(ReadError::CutOff(_))));
    let longer = [&bytes[..], b"x"].concat();
    let surplus = said(read_cloud(&longer, 1.0, &RUN));
    assert!(surplus.message.contains("1 bytes more"), "{surplus}");
    assert!(matches!(read_cloud(&longer, 1.0, &RUN), Err(ReadError::Bad(_))));
}

#[test]
fn huge_claims_are_refused_without_memory_for_them() {
    for encoding in ENCODINGS {
        for count in ["4000000000", "18446744073709551615"] {
            let text = format!(
                "ply\nformat {encoding} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n1 2 3\n4 5 6\n"
            );
            let refused = said(read_cloud(text.as_bytes(), 1.0, &RUN));
            assert!(refused.message.contains(count), "{refused}");
        }
    }
    let header = "element vertex 3\nproperty char x\nproperty char y\nproperty char z\nelement face 1\n\
                  property list uint int vertex_indices\nend_header\n";
    let mut bytes = format!("ply\nformat binary_little_endian 1.0\n{header}").into_bytes();
    bytes.extend([0, 0, 0, 1, 0, 0, 0, 1, 0]);
    bytes.extend(4_000_000_000_u32.to_le_bytes());
    bytes.extend([0; 12]);
    let refused = said(read_mesh(&bytes, 1.0, &RUN));
    assert!(refused.message.contains("4000000000") && refused.message.contains("face 0"), "{refused}");
    let text = format!("ply\nformat ascii 1.0\n{header}0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n");
    assert_eq!(said(read_mesh(text.as_bytes(), 1.0, &RUN)).line, Some(13));
    assert_eq!(said(read_mesh(text.replace("4000000000 ", "-3 ").as_bytes(), 1.0, &RUN)).line, Some(13));
}

fn text_cloud(rows: &str) -> Result<PointCloud, ReadError> {
    let count = rows.trim().lines().count();
    let header = "property float x\nproperty float y\nproperty float z\nend_header\n";
    read_cloud(format!("ply\nformat ascii 1.0\nelement vertex {count}\n{header}{rows}").as_bytes(), 1.0, &RUN)
}

#[test]
fn empty_pixels_are_skipped_and_counted() {
    let cloud = text_cloud("1 2 3\nnan nan nan\n4 5 -inf\n6 7 8\n").unwrap();
    assert_eq!(cloud.positions, [Point3::new(1.0, 2.0, 3.0), Point3::new(6.0, 7.0, 8.0)]);
    assert_eq!(cloud.skipped_invalid, 2);
}

#[test]
fn text_faults_carry_their_line() {
    for rows in
        ["1 2 3\n1 x 3\n", "1 2 3\n1 2\n", "1 2 3\n1 2 3 4\n", "1 2 3\n1,5 2 3\n", "1 2 3\n1 2 1e9\n", "1 2 3\n1 2 3"]
    {
        assert_eq!(said(text_cloud(rows)).line, Some(9), "{rows}");
    }
    assert_eq!(text_cloud("1 2 3.25\n1 2 3.50").unwrap().len(), 2);
}

#[test]
fn colours_of_all_types_become_bytes() {
    for (kind, white) in [("uchar", "255"), ("ushort", "65535"), ("float", "1"), ("float", "255"), ("double", "1.0")] {
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
             property {kind} diffuse_red\nproperty {kind} diffuse_green\nproperty {kind} diffuse_blue\nend_header\n\
             1 2 3 0 {white} 0\n"
        );
        assert_eq!(read_cloud(text.as_bytes(), 1.0, &RUN).unwrap().colours, Some(vec![[0, 255, 0]]), "{kind}");
    }
}

#[test]
fn a_corner_that_is_not_there_is_refused_with_its_place() {
    let header = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                  property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    for face in ["3 0 1 3", "3 0 1 -1"] {
        let text = format!("ply\nformat ascii 1.0\n{header}{face}\n");
        assert_eq!(said(read_mesh(text.as_bytes(), 1.0, &RUN)).line, Some(13), "{face}");
    }
}

#[test]
fn many_chunks_keep_the_order_and_lose_nothing() {
    // More than one chunk of records, with an empty pixel in each.
    let count = 200_000;
    let points: Vec<Point3> = (0..count)
        .map(|i| {
            if i % 50_000 == 7 { Point3::new(f64::NAN, 0.0, 0.0) } else { Point3::new(f64::from(i) / 128.0, 1.0, 2.0) }
        })
        .collect();
    let index: Vec<f32> = (0..count as u32).map(|i| i as f32).collect();
    let mut bytes = Vec::new();
    write_ply_cloud(&mut bytes, &points, LengthUnit::Mm, None, None, &[("index", &index)]).unwrap();
    let cloud = read_cloud(&bytes, 1.0, &RUN).unwrap();
    assert_eq!((cloud.len(), cloud.skipped_invalid), (count as usize - 4, 4));
    for (point, index) in cloud.positions.iter().zip(&cloud.scalars[0].1) {
        assert_eq!(point.x * 128.0, f64::from(*index));
    }
}

/// A scan in map coordinates, 4 m of it 900 m away: double keeps what was measured, float32 has steps of 0.06 mm there.
#[test]
fn a_scan_far_away_is_read_from_doubles_and_refused_from_floats() {
    let file = |kind: &str, put: fn(f64) -> Vec<u8>| {
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty {kind} x\nproperty {kind} y\nproperty {kind} z\n\
             end_header\n"
        )
        .into_bytes();
        (0..9).for_each(|k| bytes.extend([f64::from(k) * 500.01, 900_000.37, 1.0].map(put).concat()));
        read_cloud(&bytes, 1.0, &RUN)
    };
    let doubles = file("double", |x| x.to_le_bytes().to_vec()).unwrap();
    assert_eq!(doubles.positions[1], Point3::new(500.01, 900_000.37, 1.0));
    let told = said(file("float", |x| (x as f32).to_le_bytes().to_vec()));
    assert!(told.message.contains("y is about 900000 mm") && told.message.contains("steps of 0.062 mm"), "{told}");
    assert!(told.help.unwrap().contains("as double"));
}

/// A spiral wall of two turns: only at its tip can an ear be cut, so that each one takes a look at nearly all corners.
#[test]
fn a_job_over_costly_polygons_can_be_stopped() {
    let corner = |k: u32, off: f64| {
        let angle = 4.0 * std::f64::consts::PI * f64::from(k) / 256.0;
        let radius = 10.0 + f64::from(k) / 64.0 - off;
        format!("{} {} 0\n", radius * angle.cos(), radius * angle.sin())
    };
    let wall: String = (0..256).map(|k| corner(k, 0.0)).chain((0..256).rev().map(|k| corner(k, 0.005))).collect();
    let face: String = std::iter::once(512).chain(0..512).map(|index| format!("{index} ")).collect();
    let file = format!(
        "ply\nformat ascii 1.0\nelement vertex 512\nproperty double x\nproperty double y\nproperty double z\n\
         element face 2000\nproperty list uint int vertex_indices\nend_header\n{wall}{}",
        format!("{face}\n").repeat(2000)
    );
    let cancel = CancelToken::default();
    let observe = |_| ();
    let run = RunContext::new(&cancel, &observe);
    let result = std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(std::time::Duration::from_millis(300));
            cancel.cancel();
        });
        read_mesh(file.as_bytes(), 1.0, &run)
    });
    assert!(matches!(result, Err(ReadError::Cancelled(_))), "cut 2000 spirals before the flag was up, or did not look");
}
