//! Tests that use the library from outside, one binary, one module a theme.

mod layers;
mod pose_sweep;
mod readers;
