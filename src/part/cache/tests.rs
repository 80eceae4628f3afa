use super::*;
use crate::part::shapes::{folded, plate, prepared, settings, soup, thick};
use crate::part::{CacheUse, load_or_prepare};
use crate::plan::CadSettings;
use crate::run::RunContext;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn example() -> (Part, Key) {
    let settings = settings(CadSide::Top, 1.2);
    (prepared(&soup(&folded(0.4)), &settings), key("00", LengthUnit::Mm, &settings))
}

#[test]
fn what_was_written_is_read_back_bit_by_bit() {
    for (mesh, side) in [(plate(), CadSide::Middle), (thick(&plate(), 1.5), CadSide::Solid)] {
        let settings = settings(side, 1.5);
        let part = prepared(&mesh, &settings);
        let key = key("00", LengthUnit::Mm, &settings);
        let bytes = encode(&part, &key);
        let back = decode(&bytes, &key).unwrap();
        assert_eq!(encode(&back, &key), bytes);
        assert!(back == part);
    }
}

#[test]
fn no_changed_bit_and_no_missing_byte_is_trusted() {
    let (part, key) = example();
    let bytes = encode(&part, &key);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let header_and_tail = (0..120).chain(bytes.len() - 40..bytes.len());
    let sampled: Vec<usize> = (0..300).map(|_| rng.random_range(0..bytes.len())).collect();
    for k in header_and_tail.chain(sampled) {
        let mut broken = bytes.clone();
        broken[k] ^= 1 << (k % 8);
        assert!(decode(&broken, &key).is_none(), "byte {k}");
    }
    for length in (0..200).chain((200..bytes.len()).step_by(997)) {
        assert!(decode(&bytes[..length], &key).is_none(), "cut to {length}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(decode(&longer, &key).is_none());
}

#[test]
fn even_forged_files_do_no_harm() {
    // Damage behind a valid checksum: decoding may succeed or not, but neither it nor a query panics or asks for absurd memory.
    let (part, key) = example();
    let bytes = encode(&part, &key);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for round in 0..400 {
        let mut forged = bytes[..bytes.len() - HASH].to_vec();
        for _ in 0..1 + round % 3 {
            let k = rng.random_range(HEADER..forged.len());
            let value = [0u8, 0xff, 0x7f, rng.random()][round % 4];
            let reach = (k + 1 + round % 8).min(forged.len());
            forged[k..reach].fill(value);
        }
        let checksum = checksum(&forged);
        forged.extend(checksum);
        if let Some(part) = decode(&forged, &key) {
            part.face(Side::Top).closest(&Point3::new(1.0, 2.0, 3.0), f64::INFINITY);
            part.face(Side::Bottom).closest_seeded(&Point3::new(1.0, 2.0, 3.0), 5.0, 7);
        }
    }
}

#[test]
fn the_key_holds_everything_the_part_is_made_of() {
    let base = settings(CadSide::Solid, 1.0);
    let mut others = vec![base.clone(), settings(CadSide::Top, 1.0), settings(CadSide::Solid, 1.1)];
    others.push(PartSettings {
        plan_directions: vec![(Point3::origin(), crate::geometry::Vector3::z())],
        ..base.clone()
    });
    let mut keys: Vec<Key> = others.iter().map(|s| key("00", LengthUnit::Mm, s)).collect();
    keys.push(key("01", LengthUnit::Mm, &base));
    keys.push(key("00", LengthUnit::Cm, &base));
    for (i, a) in keys.iter().enumerate() {
        assert!(keys[..i].iter().all(|b| a != b));
    }
    let sheet = settings(CadSide::Top, 1.0);
    let with_directions =
        PartSettings { plan_directions: vec![(Point3::origin(), crate::geometry::Vector3::z())], ..sheet.clone() };
    assert_eq!(
        key("00", LengthUnit::Mm, &sheet),
        key("00", LengthUnit::Mm, &with_directions),
        "a sheet does not need them"
    );
}

#[test]
fn a_damaged_or_stale_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plate.stl");
    let mut stl = Vec::new();
    crate::io::write_stl(&mut stl, &plate()).unwrap();
    std::fs::write(&path, &stl).unwrap();
    let cad = CadSettings { file: "plate.stl".into(), path: path.clone(), unit: LengthUnit::Mm };
    let cache = cache_path(&path);
    assert_eq!(cache.file_name().unwrap(), "plate.stl.shapeline-cache");
    let load = |settings: &PartSettings| load_or_prepare(&cad, settings, Some(&cache), &RunContext::silent()).unwrap();
    let thin = settings(CadSide::Top, 1.0);
    let (built, first) = load(&thin);
    assert_eq!((first, built.triangles_in_file), (CacheUse::Built, 2 * (20 * 12 - 4)));
    assert!(load(&thin) == (built.clone(), CacheUse::Loaded));
    let mut bytes = std::fs::read(&cache).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&cache, &bytes).unwrap();
    assert_eq!(load(&thin).1, CacheUse::Built);
    assert_eq!(load(&thin).1, CacheUse::Loaded);
    assert_eq!(load(&settings(CadSide::Top, 1.1)).1, CacheUse::Built, "another thickness");
    std::fs::write(&cache, b"").unwrap();
    assert!(load(&thin) == (built.clone(), CacheUse::Built));
    std::fs::write(&path, &stl).unwrap();
    assert_eq!(load(&thin).1, CacheUse::Loaded, "the same bytes written again");
    // A place that cannot be written is no error.
    let nowhere = folder.path().join("missing").join("x");
    let (part, used) = load_or_prepare(&cad, &thin, Some(&nowhere), &RunContext::silent()).unwrap();
    assert!((part, used) == (built, CacheUse::Built));
    assert!(load_or_prepare(&cad, &thin, None, &RunContext::silent()).is_ok());
    let absent = CadSettings { path: folder.path().join("none.stl"), ..cad };
    assert!(load_or_prepare(&absent, &thin, None, &RunContext::silent()).is_err());
}
