//! How much stands beside each other on the screens that show points, by the width of the window.

/// How many things stand beside each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breadth {
    /// Two linked views with all that is told of them: all at once.
    Wide,
    /// One view; what stands below it shares a place.
    Middle,
    /// One thing at a time, behind tabs.
    Narrow,
}

/// Widths from which there is room for more, points.
pub const MIDDLE_FROM: f32 = 1200.0;
/// The same for two views.
pub const WIDE_FROM: f32 = 1600.0;
