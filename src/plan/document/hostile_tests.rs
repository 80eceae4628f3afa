//! Plans that are broken in any way: every edit is made or refused, and what was TOML stays TOML.

use super::tests::{DEMO, FULL, POINTS, surface};
use super::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// A plan with bytes and lines moved, lost, repeated, replaced.
fn broken(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let text = if rng.random_bool(0.5) { FULL } else { DEMO };
    let mut lines: Vec<&str> = text.lines().collect();
    for _ in 0..rng.random_range(0..4) {
        let (from, to) = (rng.random_range(0..lines.len()), rng.random_range(0..lines.len()));
        match rng.random_range(0..3) {
            0 => lines.insert(to, lines[from]),
            1 => lines.swap(from, to),
            _ => drop(lines.remove(from)),
        }
    }
    let mut bytes = lines.join(if rng.random_bool(0.3) { "\r\n" } else { "\n" }).into_bytes();
    for _ in 0..rng.random_range(0..4) {
        let at = rng.random_range(0..bytes.len());
        match rng.random_range(0..3) {
            0 => bytes[at] = b"[]{}=\"'#,.-0\n\\eE "[rng.random_range(0..17)],
            1 => bytes[at] = rng.next_u32() as u8,
            _ => drop(bytes.remove(at)),
        }
    }
    bytes
}

fn edit(document: &mut Document, rng: &mut ChaCha8Rng) -> Result<(), EditError> {
    let list = if rng.random_bool(0.4) { List::Feature } else { POINTS };
    let index = rng.random_range(0..4);
    let (table, keys) = SETTINGS[rng.random_range(0..SETTINGS.len())];
    let key = keys[rng.random_range(0..keys.len())];
    match rng.random_range(0..13) {
        0 => document.set_setting(table, key, &FieldValue::Number(1.5)),
        1 => document.remove_setting(table, key),
        2 => document.remove_table(table),
        3 => document.add(list, &[PointSpec::point("", surface(1.0), -1.0, 1.0)]).map(drop),
        4 => document.remove(list, &[index]),
        5 => document.reorder(list, index, 0),
        6 => document.rename(list, index, "Z1"),
        7 => document.reshape(list, index, &surface(2.0)),
        8 => document.set_tolerances(&[index], Some(-0.1), Some(0.1)),
        9 => document.mirror(MirrorPlane { across: Axis::X, at_mm: 1.0 }, &MirrorNames::Keep),
        10 => document.revise("Q", "2026-01-01", "because").map(drop),
        11 => document.hold_by_regions(&[]),
        _ => document.hold_by_features("H1", "S1", "A1"),
    }
}

#[test]
fn no_text_makes_an_edit_fall_over() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut made, mut refused) = (0, 0);
    for _ in 0..600 {
        let bytes = broken(&mut rng);
        let Ok(mut document) = Document::from_bytes(&bytes, Path::new("p.toml")) else { continue };
        let was_toml = document.structure().is_ok();
        let first = document.text().to_owned();
        for _ in 0..6 {
            match edit(&mut document, &mut rng) {
                Ok(()) => made += 1,
                Err(fault) => {
                    refused += 1;
                    assert!(!fault.help().is_empty());
                }
            }
            assert_eq!(document.structure().is_ok(), was_toml, "{}", document.text());
        }
        document.problems();
        document.changes();
        document.revisions();
        while document.undo().is_some() {}
        assert_eq!(document.text(), first);
    }
    assert!(made > 500 && refused > 500, "{made} {refused}");
}
