//! The inspection plan: as written, checked, all problems told together.
//!
//! ```text
//! bytes --syntax--> document with places --reader--> values --sections, shapes, alignment--> Plan, problems
//! ```
//!
//! `docs/plan.md` lists every key. Nothing after this layer asks again whether a direction has length one or a name exists.

mod alignment;
mod comparison_file;
pub mod document;
pub mod expected;
mod load;
pub mod merge;
pub mod model;
pub mod nominal;
mod notation;
mod problems;
mod reader;
mod regions;
pub mod rig;
mod sections;
mod shapes;
mod suggest;
mod syntax;
#[cfg(test)]
mod tests;
mod values;

pub use load::{Loaded, load, load_text, parse};
pub use model::*;
pub use nominal::*;
pub use regions::{FitRegion, Freedom, RegionFit, RegionShape};
pub use shapes::NARROWEST_MM;
pub use values::LARGEST_MM;
pub(crate) use values::short as short_number;
