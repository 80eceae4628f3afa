//! One of the many measurements: its points and what is known of each.

use super::metric::Metric;
use crate::geometry::Point3;
use std::collections::BTreeMap;

/// One view as it was measured, in its own frame and its file's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Name of its file, by which it is told to people.
    pub name: String,
    /// Places of the points, view frame.
    pub positions: Vec<Point3>,
    /// Values of the metrics that are known, one for each point.
    pub columns: BTreeMap<Metric, Vec<f32>>,
    /// Row and column of each point in the camera's picture, where the file tells them.
    pub pixels: Option<Vec<[u32; 2]>>,
    /// Where it was seen from, view frame.
    pub sensor: Point3,
}
