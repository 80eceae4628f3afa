//! Points, rigid motions, meshes and their closest-point search. Lengths mm, angles rad, numbers f64.

pub mod boundary;
pub mod bvh;
pub mod cloud;
pub mod decompose;
pub mod hull;
pub mod mesh;
pub mod transform;
pub mod triangle;
pub mod unit;
pub mod weld;

pub use bvh::{Bvh, Closest, Feature, RayHit};
pub use cloud::PointCloud;
pub use mesh::{Aabb, Mesh};
pub use transform::CadFromScan;
pub use unit::LengthUnit;

/// A position in mm.
pub type Point3 = nalgebra::Point3<f64>;
/// A displacement in mm, or a direction.
pub type Vector3 = nalgebra::Vector3<f64>;
/// A direction of length one.
pub type UnitVector3 = nalgebra::UnitVector3<f64>;
/// A rotation followed by a translation; its determinant is +1 by construction.
pub type Isometry3 = nalgebra::Isometry3<f64>;
