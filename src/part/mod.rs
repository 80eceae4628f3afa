//! The CAD prepared once: welded, oriented, both faces of the sheet with their search trees, resting poses, and the cache.
//!
//! ```text
//! triangles --weld--> shared vertices --orient--> one winding --skin--> two faces --> tree, edges, samples; hull --> resting poses
//! ```
//!
//! Everything is in the CAD frame, mm. Nothing here depends on a scan.

mod cache;
mod face;
mod load;
mod model;
mod prepare;
pub mod propose;
mod resting;
mod rims;
mod samples;
mod skin;
mod solid;

pub use cache::cache_path;
pub use face::{Face, FaceHit, FaceSample};
pub use load::{CacheUse, load_or_prepare};
pub use model::{Part, PartSettings};
pub use resting::RestingPose;
pub(crate) use rims::{Rim, rims};

#[cfg(test)]
mod shapes;
#[cfg(test)]
mod tests;
