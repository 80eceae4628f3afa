//! Properties of the reader of text clouds.

use super::read;
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::{Point3, PointCloud};
use crate::io::columns::Lengths;
use crate::run::RunContext;

fn cloud(text: &str) -> Result<PointCloud, ReadError> {
    read(text.as_bytes(), Lengths::in_mm(1.0), &RunContext::silent())
}

fn said(text: &str) -> Diagnostic {
    match cloud(text) {
        Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic)) => *diagnostic,
        other => panic!("expected a refusal, got {other:?}"),
    }
}

#[test]
fn all_delimiters_and_heads_give_the_same_points() {
    let expected = [Point3::new(1.5, -2.0, 3.0), Point3::new(40.0, 5.0, 0.06)];
    for text in [
        "1.5 -2 3\n40 5 6e-2\n",
        "  1.5\t-2\t3  \r\n\r\n40\t5\t0.06\r\n",
        "1.5,-2,3\n40,5,.06\n",
        "1.5, -2, 3,\n40, 5, 0.06,\n",
        "1.5;-2;3\n40;5;0.06\n",
        "\u{feff}x;y;z\n1.5;-2;3\n40;5;0.06\n",
        "\"X [mm]\",\"Y [mm]\",\"Z [mm]\"\n1.5,-2,3\n40,5,0.06\n",
        "z x y\n3 1.5 -2\n0.06 40 5\n",
        "# made by a scanner\n// X Y Z\n1.5 -2 3\n# pause\n40 5 0.06\n",
        "2\n1.5 -2 3\n40 5 0.06\n",
    ] {
        let found = cloud(text).unwrap();
        assert_eq!(found.positions, expected, "{text}");
        assert!(found.colours.is_none() && found.normals.is_none() && found.scalars.is_empty(), "{text}");
    }
}

#[test]
fn columns_without_names_are_told_by_their_values() {
    let found = cloud("1.5 2 3 10 20 255 0 0.6 0.8 7.5\n1 2 3 0 0 0 1 0 0 -1\n").unwrap();
    assert_eq!(found.colours, Some(vec![[10, 20, 255], [0, 0, 0]]));
    assert_eq!(found.normals, Some(vec![[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]]));
    assert_eq!(found.scalars, [("column_10".to_owned(), vec![7.5, -1.0])]);
    // Above 255 it is no colour.
    let found = cloud("1 2 3 10 20 256\n").unwrap();
    assert_eq!((found.colours, found.scalars.len()), (None, 3));
}

#[test]
fn pts_has_the_intensity_before_the_colour() {
    let found = cloud("2\n1 2 3 90 10 20 30\n4 5 6 80 11 21 31\n").unwrap();
    assert_eq!(found.colours, Some(vec![[10, 20, 30], [11, 21, 31]]));
    assert_eq!(found.scalars, [("column_4".to_owned(), vec![90.0, 80.0])]);
}

#[test]
fn names_tell_colours_as_bytes_and_as_parts_of_one() {
    let names = "x,y,z,r,g,b,Quality\n";
    let bytes = cloud(&format!("{names}1.5,2,3,0,1,255,9\n")).unwrap();
    assert_eq!(bytes.colours, Some(vec![[0, 1, 255]]));
    assert_eq!(bytes.scalar("Quality"), Some(&[9.0_f32][..]));
    let parts = cloud(&format!("{names}1.5,2,3,0.0,0.5,1.0,9\n")).unwrap();
    assert_eq!(parts.colours, Some(vec![[0, 128, 255]]));
}

#[test]
fn empty_pixels_are_skipped_and_counted() {
    let found = cloud("1 2 3 0.5\nnan nan nan nan\n1.#QNAN 0 0 0\n4 5 6 nan\n").unwrap();
    assert_eq!((found.len(), found.skipped_invalid), (2, 2));
    assert!(found.scalars[0].1[1].is_nan());
}

#[test]
fn faults_carry_their_line() {
    for (text, line, word) in [
        ("1 2 3\n4 5\n", 2, "2 columns found, expected 3"),
        ("1 2 3\n\n4 5 6 7\n", 3, "4 columns found, expected 3"),
        ("1 2 3\n4 five 6\n", 2, "\"five\""),
        ("1,5 2,5 3,5\n", 1, "decimal comma"),
        ("1,5;2,5;3,5\n", 1, "decimal comma"),
        ("1 2 3\n4 5 1e8\n", 2, "not a plausible part"),
        ("1 2\n3 4\n", 1, "expected x, y and z"),
        ("x y\n3 4\n", 2, "expected x, y and z"),
        ("x y q\n3 4 5\n", 1, "expected x, y and z"),
        ("3\n1 2 3\n4 5 6\n", 3, "2 points found, expected 3"),
        ("1\n1 2 3\n4 5 6\n", 3, "2 points found, expected 1"),
    ] {
        let diagnostic = said(text);
        assert_eq!(diagnostic.line, Some(line), "{text}: {diagnostic}");
        assert!(diagnostic.to_string().contains(word), "{text}: {diagnostic}");
        assert!(diagnostic.help.is_some(), "{text}");
    }
}

#[test]
fn no_cut_shortens_a_number_silently() {
    // With fixed decimals a cut right behind a last number leaves a whole row, which is read; every other cut in a row
    // is refused. With other numbers every cut in a row is refused.
    for (text, fixed) in
        [("1.25 2.50 -3.75\n4.00 5.00 6.25\n7.5 8.5 9.25\n", true), ("1 2 33\n4 5 66\n7 8 99\n", false)]
    {
        let whole = cloud(text).unwrap().positions;
        for cut in 1..text.len() {
            let cut_text = &text[..cut];
            let rows = cut_text.matches('\n').count();
            let ends_row = cut_text.ends_with('\n') || (fixed && text[cut..].starts_with('\n') && rows > 0);
            match cloud(cut_text) {
                Ok(found) => {
                    assert!(ends_row, "{cut_text:?}");
                    assert_eq!(found.positions[..], whole[..found.len()], "{cut_text:?}");
                }
                Err(error) => {
                    assert!(!ends_row, "{cut_text:?}: {error}");
                    assert!(matches!(error, ReadError::CutOff(_)), "{cut_text:?}: {error}");
                }
            }
        }
    }
}

#[test]
fn many_chunks_keep_the_order() {
    let text: String = (0..50_000).map(|i| format!("{i} 1 2\n")).collect();
    let found = cloud(&text).unwrap();
    assert!(found.positions.iter().enumerate().all(|(i, p)| p.x == i as f64));
    let broken = text.replacen("40000 1 2\n", "40000 1\n", 1);
    assert_eq!(said(&broken).line, Some(40_001));
}

#[test]
fn an_empty_text_has_no_points() {
    for text in ["\n", "# only words\n", "x y z\n"] {
        assert!(cloud(text).unwrap().is_empty(), "{text:?}");
    }
}
