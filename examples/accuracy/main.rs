//! Makes `docs/accuracy.md`: what the whole pipeline and its estimators are worth, against parts whose truth is known.
//!
//! `cargo run --release --example accuracy` looks at 1,000 parts and takes 55 minutes of processor time; `-- SCANS FILE` looks at
//! fewer of them and writes elsewhere. The same count gives the same bytes.

mod page;
mod parts;
mod record;
mod simple;
mod tables;

use parts::{Case, Scene};
use std::error::Error;
use std::path::PathBuf;

/// Parts of the main table.
const PARTS: usize = 1000;
/// The other tables take one for so many of the main table's.
const OTHERS: usize = 10;
/// At least so many, or a standard deviation says nothing.
const FEWEST: usize = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let count: usize = arguments.next().map_or(Ok(PARTS), |n| n.parse())?;
    let file = arguments.next().map_or_else(|| PathBuf::from("docs/accuracy.md"), PathBuf::from);
    // Perfect and bent, top and bottom: whole groups of four.
    let [count, others] = [count, count / OTHERS].map(|n| n.max(FEWEST).next_multiple_of(4));
    let scene = Scene::new();
    let dense = scene.records(&Case::dense(), count);
    let rounded = Case::rounded();
    let calibration = tables::edge_offset(&scene.records(&rounded.another_series(), others));
    let rounded = scene.records(&rounded.calibrated(&calibration), others);
    let sparse = scene.records(&Case::sparse(), others);
    std::fs::write(&file, page::page(&scene, &dense, &rounded, &calibration, &sparse))?;
    Ok(())
}
