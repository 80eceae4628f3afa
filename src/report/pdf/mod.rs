//! `NAME.pdf`: the report for a person. The first page answers "good or not, and where"; the others hold every number.
//!
//! The same result gives the same bytes: no clock, no random ids, no thread count. `page` and `document` are the only files
//! that know the PDF library.

mod document;
mod first;
mod flow;
mod map;
pub mod mask_study;
pub mod merge;
mod merge_summary;
#[cfg(test)]
mod merge_tests;
mod notes;
mod page;
mod plot;
mod rest;
mod signs;
mod sources;
mod table;
#[cfg(test)]
mod tests;
mod theme;
mod wear;
mod worst;

use super::json::json;
use super::raster::MapPicture;
use super::words::{PROGRAM, SCHEMA, clean};
use crate::inspect::{InspectionResult, Outcome};
use crate::run::{Cancelled, RunContext};
pub use map::MapScene;
use page::{Font, Fonts, Page, set};
use theme::{LEFT, QUIET, RIGHT, STRONG, TEXT};

/// The PDF report. Without a scene it has no map, and says so.
pub fn pdf(result: &InspectionResult, scene: Option<&MapScene<'_>>, run: &RunContext) -> Result<Vec<u8>, Cancelled> {
    let fonts = Fonts::new();
    let (pages, picture) = pages(&fonts, result, scene, run)?;
    run.check()?;
    let id = &result.identity;
    let title = clean(&format!("{}: {}, scan {}", first::part_word(result), id.part_name, id.scan_file));
    let pictures = picture.into_iter().map(document::Picture::from).collect();
    Ok(document::bytes(pages, &fonts, pictures, &title, json(result).as_bytes()))
}

/// All pages, and the picture to which the first refers.
fn pages<'a>(
    fonts: &'a Fonts,
    result: &InspectionResult,
    scene: Option<&MapScene<'_>>,
    run: &RunContext,
) -> Result<(Vec<Page<'a>>, Option<MapPicture>), Cancelled> {
    let mut first = Page::new(fonts);
    let picture = first::draw(&mut first, result, scene, run)?;
    let mut pages = vec![first];
    if let Outcome::Measured(inspection) = &result.outcome {
        pages.extend(rest::draw(fonts, result, inspection));
    }
    let count = pages.len();
    for (k, page) in pages.iter_mut().enumerate() {
        footer(page, SCHEMA, WORDS, k + 1, count);
    }
    Ok((pages, picture))
}

/// What holds for every number of the report.
const WORDS: &str = "All lengths in mm. Deviation is positive along the direction of the plan. U is expanded, k = 2.";

fn footer(page: &mut Page<'_>, schema: &str, words: &str, number: usize, count: usize) {
    let (small, bold, y) = (set(Font::Regular, 7.1), set(Font::SemiBold, 7.4), 287.8);
    page.rule(LEFT, RIGHT, 283.4, STRONG, 0.25);
    page.text(LEFT, y, small, QUIET, &format!("{PROGRAM}, {schema}"));
    page.text_centre(0.5 * (LEFT + RIGHT) + 12.0, y, small, QUIET, words);
    page.text_right(RIGHT, y, bold, TEXT, &format!("Page {number} of {count}"));
}
