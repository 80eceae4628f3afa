//! A cache with a right checksum and wrong numbers: rebuilt, or harmless; never the end of the program.

use crate::support::{identity, inspect_scan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};
use shapeline::geometry::LengthUnit;
use shapeline::part::{CacheUse, PartSettings, cache_path, load_or_prepare};
use shapeline::plan::{CadSettings, CadSide, Side};
use shapeline::run::RunContext;
use shapeline::simulate::{PoseChoice, RigModel, Subject, rail, simulate_scan};

/// The checksum at the file's end: SHA-256 over the SHA-256 of each mebibyte before it.
fn with_checksum(mut content: Vec<u8>) -> Vec<u8> {
    let each: Vec<u8> = content.chunks(1 << 20).flat_map(|chunk| Sha256::digest(chunk).to_vec()).collect();
    content.extend(Sha256::digest(each));
    content
}

#[test]
fn no_forged_cache_stops_an_inspection() {
    let nominal = rail();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rail.stl");
    let mut stl = Vec::new();
    shapeline::io::write_stl(&mut stl, &nominal.mesh).expect("written");
    std::fs::write(&path, &stl).expect("written");
    let cad = CadSettings { file: "rail.stl".into(), path: path.clone(), unit: LengthUnit::Mm };
    let settings =
        PartSettings { cad_side: CadSide::Top, thickness_mm: nominal.thickness_mm, plan_directions: Vec::new() };
    let cache = cache_path(&path);
    let load = || load_or_prepare(&cad, &settings, Some(&cache), &RunContext::silent()).expect("a sound CAD");
    load();
    let whole = std::fs::read(&cache).expect("a cache");
    let content = &whole[..whole.len() - 32];
    assert_eq!(with_checksum(content.to_vec()), whole, "the checksum is made as the program makes it");

    let rig = RigModel { belt_margin_mm: 15.0, ..RigModel::default().with_density(0.5) };
    let subject = Subject::perfect(&nominal);
    let pose = PoseChoice::side(&subject, Side::Top);
    let scan = simulate_scan(&subject, &rig, &pose, 1, &RunContext::silent()).expect("not cancelled");
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let values = [f64::NAN, f64::INFINITY, -1e300, 1e9, -40.0, 0.0, f64::from_bits(1)];
    let (mut rebuilt, mut harmless) = (0, 0);
    for round in 0..140 {
        let mut forged = content.to_vec();
        // Behind magic, format and key. The second half of the rounds forges counts and indices.
        let at = rng.random_range(44..forged.len() - 8);
        if round % 2 == 0 {
            forged[at..at + 8].copy_from_slice(&values[round / 2 % values.len()].to_le_bytes());
        } else {
            forged[at..at + 4].copy_from_slice(&[0, 1, 7, 5_000, u32::MAX][round / 2 % 5].to_le_bytes());
        }
        std::fs::write(&cache, with_checksum(forged)).expect("written");
        let (part, cache_use) = load();
        if cache_use == CacheUse::Built {
            rebuilt += 1;
            continue;
        }
        // Indistinguishable from another part's numbers. A few of them are looked through to the end.
        harmless += 1;
        if harmless <= 6 {
            inspect_scan(&nominal.plan(), &part, scan.cloud.clone(), identity());
        }
    }
    println!("{rebuilt} rebuilt, {harmless} harmless");
    assert!(rebuilt > 30, "{rebuilt}");
}
