//! A measured cloud as structure of arrays.

use super::Point3;

/// Points as measured, in mm in the scan frame, with whatever else the file gave for each of them.
///
/// Every array that is present has the length of `positions`; all positions are finite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// Positions in mm.
    pub positions: Vec<Point3>,
    /// 8-bit RGB.
    pub colours: Option<Vec<[u8; 3]>>,
    /// Unit normals as the file gave them.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Further properties by name, in the file's order.
    pub scalars: Vec<(String, Vec<f32>)>,
    /// Points skipped on reading because a coordinate was NaN or infinite (empty pixels of a scanner).
    pub skipped_invalid: usize,
}

impl PointCloud {
    /// How many points there are.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The further property of that name.
    pub fn scalar(&self, name: &str) -> Option<&[f32]> {
        self.scalars.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice())
    }
}
