//! Where the part lies: global pose, robust best fit, datum alignment.

pub mod best_fit;
mod candidates;
mod common;
pub mod datum;
mod datum_values;
mod evidence;
mod faces;
mod fit_uncertainty;
mod height_map;
mod icp;
pub mod in_view;
pub mod plan_alignment;
pub mod pose;
mod pose_search;
mod refuse;
mod region_fit;
mod region_places;
mod region_sums;
mod rim;
mod rounds;
mod sampling;
pub mod second_look;
mod template;
mod view;

pub use best_fit::{BEST_FIT_POINTS, best_fit};
pub use common::Common;
pub use datum_values::{DatumErrors, Datums, expected_pose_uncertainty};
pub use fit_uncertainty::expected_best_fit;
pub use in_view::{InView, find_part};
pub use plan_alignment::{AlignmentInput, align_on_plan};
pub use pose::*;
pub use region_fit::{REGION_LEAST_POINTS, REGION_POINTS};
pub use region_places::{RegionPlaces, expected_region_fit, move_region_fit, region_hold, region_places};
pub use second_look::{SecondLook, second_look};
