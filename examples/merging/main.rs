//! Makes `docs/merging.md`: the endoscope paper's table on simulated views whose truth is known.
//!
//! `cargo run --release --example merging` looks at 20 seeds; `-- SEEDS FILE` at fewer and writes elsewhere. The same count gives the same bytes.

mod page;
mod trial;

use std::error::Error;
use std::path::PathBuf;

/// Seeds of the demand.
const SEEDS: u64 = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let seeds = arguments.next().map_or(Ok(SEEDS), |n| n.parse())?.max(2);
    let file = arguments.next().map_or_else(|| PathBuf::from("docs/merging.md"), PathBuf::from);
    let trials: Result<Vec<_>, _> = (1..=seeds).map(trial::cylinder).collect();
    let plain: Result<Vec<_>, _> = (1..=seeds).map(trial::masking).collect();
    std::fs::write(&file, page::page(&trials?, &plain?))?;
    Ok(())
}
