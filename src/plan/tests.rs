//! Plans read as a whole: where values land, and the exact words for everything that can be wrong.

use super::*;
use std::path::Path;

const FULL: &str = include_str!("full_example.toml");

#[test]
fn the_full_example_has_no_problem() {
    let loaded = parse(FULL.as_bytes(), Path::new("plans/p.toml"));
    assert_eq!(loaded.problems, []);
    let plan = loaded.plan.unwrap();
    assert_eq!((plan.features.len(), plan.comparison.len()), (3, 3));
}
