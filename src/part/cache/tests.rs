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

/// One number of the part changed as no preparation would leave it, under a right checksum.
#[test]
fn a_forged_number_is_found_wherever_it_stands() {
    let (part, key) = example();
    let forge = |what: &str, change: &dyn Fn(&mut Part)| {
        let mut forged = part.clone();
        change(&mut forged);
        assert!(decode(&encode(&forged, &key), &key).is_none(), "{what}");
    };
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1e9] {
        let tell = |what: &str| format!("{what} = {value}");
        forge(&tell("centroid"), &|p| p.centroid.y = value);
        forge(&tell("thickness"), &|p| p.thickness_mm = value);
        forge(&tell("pose"), &|p| p.resting_poses[0].up_cad.as_mut_unchecked().x = value);
        forge(&tell("stability"), &|p| p.resting_poses[0].stability = value);
        forge(&tell("height"), &|p| p.resting_poses[0].height_mm = value);
        for face in 0..2 {
            forge(&tell("face vertex"), &|p| p.faces[face].mesh.vertices[5].z = value);
            forge(&tell("vertex normal"), &|p| p.faces[face].vertex_normals[3].z = value);
            forge(&tell("sample"), &|p| p.faces[face].samples[7].point.x = value);
            forge(&tell("sample's normal"), &|p| p.faces[face].samples[7].normal.as_mut_unchecked().y = value);
        }
        // A part that is large all over is none of this kind; the key knows the CAD's bytes.
        if value != 1e9 {
            forge(&tell("vertex"), &|p| p.mesh.vertices[4].y = value);
        }
    }
    let beyond = part.mesh.vertices.len() as u32;
    forge("index of the mesh", &|p| p.mesh.triangles[2][1] = beyond);
    forge("index of a face", &|p| p.faces[1].mesh.triangles[2][1] = u32::MAX);
    forge("fewer vertices", &|p| p.faces[0].mesh.vertices.truncate(3));
    forge("fewer normals", &|p| p.faces[0].vertex_normals.truncate(3));
    forge("no triangles", &|p| p.mesh.triangles.clear());
    forge("no samples", &|p| p.faces[0].samples.clear());
    forge("fewer triangles in the file", &|p| p.triangles_in_file = 3);
}

/// The plate as the CAD of a folder of its own.
fn plate_file() -> (tempfile::TempDir, CadSettings) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plate.stl");
    let mut stl = Vec::new();
    crate::io::write_stl(&mut stl, &plate()).unwrap();
    std::fs::write(&path, &stl).unwrap();
    (folder, CadSettings { file: "plate.stl".into(), path, unit: LengthUnit::Mm })
}

#[test]
fn a_forged_file_is_rebuilt_silently() {
    let (_folder, cad) = plate_file();
    let (cache, settings) = (cache_path(&cad.path), settings(CadSide::Top, 1.0));
    let load = || load_or_prepare(&cad, &settings, Some(&cache), &RunContext::silent()).unwrap();
    let (built, _) = load();
    let key = key(&built.cad_sha256, LengthUnit::Mm, &settings);
    let forgeries: [&dyn Fn(&mut Part); 4] = [
        &|p| p.faces[0].mesh.vertices[5].z = f64::NAN,
        &|p| p.thickness_mm = 1.1,
        &|p| p.cad_side = CadSide::Bottom,
        &|p| p.cad_sha256 = "00".into(),
    ];
    for (k, forgery) in forgeries.iter().enumerate() {
        let mut forged = built.clone();
        forgery(&mut forged);
        std::fs::write(&cache, encode(&forged, &key)).unwrap();
        assert!(load() == (built.clone(), CacheUse::Built), "forgery {k}");
        assert!(load() == (built.clone(), CacheUse::Loaded), "forgery {k}");
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
    let (folder, cad) = plate_file();
    let cache = cache_path(&cad.path);
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
    std::fs::write(&cad.path, std::fs::read(&cad.path).unwrap()).unwrap();
    assert_eq!(load(&thin).1, CacheUse::Loaded, "the same bytes written again");
    // A place that cannot be written is no error.
    let nowhere = folder.path().join("missing").join("x");
    let (part, used) = load_or_prepare(&cad, &thin, Some(&nowhere), &RunContext::silent()).unwrap();
    assert!(part == built && matches!(used, CacheUse::NotStored(_)), "{used:?}");
    assert_eq!(load_or_prepare(&cad, &thin, None, &RunContext::silent()).unwrap().1, CacheUse::NotWanted);
    let absent = CadSettings { path: folder.path().join("none.stl"), ..cad };
    assert!(load_or_prepare(&absent, &thin, None, &RunContext::silent()).is_err());
}
