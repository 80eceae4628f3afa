//! Tests that use the library from outside, one binary, one module a theme.

#![allow(clippy::print_stdout, reason = "sweeps tell their figures to whoever runs them")]

mod accuracy;
mod axis_reading;
mod best_fit_alignment;
mod cad_as_scan;
mod cad_sides;
mod cli;
mod common_errors;
mod flange_on_belt;
mod flat_plate;
mod foretold;
mod forged_cache;
#[cfg(feature = "gui")]
mod gui;
mod invariance;
mod layers;
mod measure_accuracy;
mod measure_hostile;
mod measure_rims;
mod merge;
mod merge_cad;
mod merge_doubts;
mod merge_files;
mod merge_names;
mod merge_parts;
mod nist_fits;
mod pose_sweep;
mod project;
mod readers;
mod region_fit;
mod registration;
mod stacked_leaves;
mod study;
mod support;
mod surface_methods;
mod things_in_view;
mod watch;
mod wear;
