//! Writes the bundled demo project again: `cargo run --release --example make_demo [FOLDER]` (default: here).

use shapeline::run::RunContext;
use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("."), PathBuf::from);
    shapeline::simulate::demo::write_assets(&folder, &RunContext::silent())
}
