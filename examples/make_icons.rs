//! Draws the pictures of the packages into `packaging/icons/`. `cargo run --release --example make_icons`.

use std::error::Error;
use std::fs;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new("packaging/icons");
    fs::create_dir_all(folder)?;
    fs::write(folder.join("shapeline.svg"), shapeline::gui::mark_svg())?;
    for side in [16, 48, 128, 256] {
        fs::write(folder.join(format!("{side}.png")), shapeline::gui::mark_png(side)?)?;
    }
    Ok(())
}
