//! Small valid files with random bytes changed, cut out or put in: every reader gives a result or a message, and never
//! panics. Arithmetic is checked for overflow in all builds, so that counts as well.

use super::{read_cloud, read_mesh};
use crate::diagnostic::ReadError;
use crate::geometry::LengthUnit;
use crate::run::RunContext;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// Changed files for each of the formats.
const MUTATIONS: usize = 1500;

fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let mut stl = vec![b' '; 80];
    stl.extend(2_u32.to_le_bytes());
    stl.extend((0..100_u8).map(|k| if k % 50 % 4 == 3 { 0x40 } else { k }));
    let body = "element face 1\nproperty list uchar int vertex_indices\nelement vertex 4\nproperty float x\n\
                property float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
                property list short double extra\nend_header\n";
    let mut binary = format!("ply\nformat binary_little_endian 1.0\n{body}").into_bytes();
    binary.extend([4, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);
    for vertex in 0..4_u8 {
        binary.extend([
            0, 0, vertex, 0x40, 0, 0, 0x80, 0x3f, 0, vertex, 0, 0x40, 1, 2, 3, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0x40,
        ]);
    }
    let rows = "1.5 2 3 10 20 30 1 0.5\n2 3 4.5 1 2 3 0\n0 0 1 1 1 1 2 1 2\n3 3 3 9 9 9 0\n";
    vec![
        ("text.stl", format!("solid x\n{facet}{facet}endsolid x\n").into_bytes()),
        ("binary.stl", stl),
        (
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 1 1 0 1 0 0\nv 0 1 0\nv .4 .5 0\nf 1/1 2/2 3//3 -2 5\nf -1 \\\n -2 -3\n".to_vec(),
        ),
        ("binary.ply", binary),
        ("text.ply", format!("ply\nformat ascii 1.0\n{body}4 0 1 2 3\n{rows}").into_bytes()),
        ("a.pts", b"3\n1.5 2 3 -5 10 20 30\n2 3 4 6 40 50 60\nnan 3 4 6 40 50 60\n".to_vec()),
        ("a.csv", b"// c\nx;y;z;nx;ny;nz;r;g;b\n1,;2;3;0;0;1;1;2;3\n1;2;3;0;0;1;.1;.2;.3\n".to_vec()),
    ]
}

fn mutate(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    const TELLING: &[u8] = b"0123456789-+.,;eEnN \n\r\t/\\#\0\xff\x7f\x80";
    for _ in 0..rng.random_range(1..4) {
        if bytes.is_empty() {
            return;
        }
        let at = rng.random_range(0..bytes.len());
        match rng.random_range(0..6) {
            0 => bytes[at] = rng.random(),
            1 => bytes[at] = TELLING[rng.random_range(0..TELLING.len())],
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..(at + rng.random_range(1..20)).min(bytes.len()))),
            4 => bytes.insert(at, TELLING[rng.random_range(0..TELLING.len())]),
            _ => {
                let piece = bytes[at..(at + rng.random_range(1..40)).min(bytes.len())].to_vec();
                let to = rng.random_range(0..=bytes.len());
                bytes.splice(to..to, piece);
            }
        }
    }
}

#[test]
fn no_changed_byte_makes_a_reader_panic() {
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    let (mut read, mut refused) = (0_usize, 0_usize);
    for (name, seed) in seeds() {
        let file = Path::new(name);
        let run = RunContext::silent();
        let mesh = read_mesh(&seed, file, LengthUnit::Mm, &run).is_ok();
        let cloud = read_cloud(&seed, file, LengthUnit::Mm, &run).is_ok();
        assert!(mesh || cloud || name == "a.csv", "{name}");
        for _ in 0..MUTATIONS {
            let mut bytes = seed.clone();
            mutate(&mut bytes, &mut rng);
            let mesh = read_mesh(&bytes, file, LengthUnit::Inch, &run).map(|mesh| {
                assert!(mesh.triangles.iter().flatten().all(|v| (*v as usize) < mesh.vertices.len()));
            });
            let cloud = read_cloud(&bytes, file, LengthUnit::Inch, &run).map(|cloud| {
                assert!(cloud.positions.iter().all(|p| p.coords.iter().all(|x| x.is_finite())));
                assert!(cloud.scalars.iter().all(|(_, values)| values.len() == cloud.len()));
            });
            for result in [mesh, cloud] {
                match result {
                    Ok(()) => read += 1,
                    Err(ReadError::Bad(said) | ReadError::CutOff(said)) => {
                        assert!(!said.message.is_empty() && said.help.is_some(), "{said}");
                        assert!(said.file.is_some());
                        refused += 1;
                    }
                    Err(ReadError::Cancelled(_)) => panic!("cancelled by nobody"),
                }
            }
        }
    }
    // The changes are small enough that some files stay readable, and large enough that most do not.
    assert!(read > 500 && refused > 5000, "{read} read, {refused} refused");
}

#[test]
fn a_cancelled_job_stops_reading() {
    let cancel = crate::run::CancelToken::default();
    cancel.cancel();
    let run = RunContext::new(&cancel, &|_| ());
    for (name, seed) in seeds() {
        let file = Path::new(name);
        // Files smaller than one chunk are looked at once at least, where there is a loop at all.
        if matches!(name, "binary.stl" | "binary.ply" | "text.ply") {
            assert!(matches!(read_mesh(&seed, file, LengthUnit::Mm, &run), Err(ReadError::Cancelled(_))), "{name}");
        }
        if name == "a.pts" {
            assert!(matches!(read_cloud(&seed, file, LengthUnit::Mm, &run), Err(ReadError::Cancelled(_))), "{name}");
        }
    }
}
