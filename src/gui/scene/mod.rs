//! The part and its points in three dimensions.
//!
//! `content` computes what is shown, away from the window's thread; `renderer` says what a view asks for, `gl` draws it; `camera`, `pick`
//! and `map_values` are plain functions.

pub mod builder;
pub mod camera;
pub mod canvas;
pub mod content;
pub mod distance;
pub mod gl;
pub mod legend;
pub mod linked;
pub mod map_values;
pub mod overlay;
mod permutation;
pub mod pick;
pub mod points;
pub mod renderer;
pub mod shape;
pub mod standard;
pub mod tones;
