//! One result, many printers: JSON, ASCII, CSV, PLY and PDF of the same `InspectionResult`; nothing is measured here.
//!
//! Every printer is a plain function of the result, without clock, thread count or folder: the same result gives the same
//! bytes. [`atomic`] puts them on the disk, [`sequence`] and [`manifest`] tell of all scans of a folder.

pub mod ascii;
pub mod atomic;
pub mod csv;
pub mod differences;
#[cfg(test)]
pub mod example;
pub mod flags;
mod foretold;
pub mod json;
mod json_layout;
mod json_why;
pub mod manifest;
pub mod mask_study;
mod merge_json;
mod merge_pages;
mod merge_ply;
pub mod palette;
pub mod pdf;
pub mod ply;
pub mod raster;
pub mod sequence;
pub mod stored;
pub mod uncertain;
pub mod view_colours;
pub mod words;

pub use ascii::ascii;
pub use csv::csv;
pub use foretold::foretold;
pub use json::json;
pub use merge_json::{MERGE_SCHEMA, merge_json};
pub use merge_pages::{MergeExtras, merge_pages};
pub use merge_ply::{merge_ply, merged_unit};
pub use pdf::{MapScene, pdf};
pub use ply::ply;
