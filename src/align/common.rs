//! Errors that everything in a scan has in common: of the sheet's thickness and of the scale. They displace every datum at once,
//! and so the part, by which most of what they do to a point may cancel.

use super::datum_values::DatumValue;
use super::icp::Sums;
use super::pose::PoseUncertainty;
use crate::geometry::{Isometry3, Point3, Vector3, decompose};
use crate::measure::Reading;
use crate::part::{Face, FaceSample, Part};
use crate::plan::{Feature, UncertaintySettings};
use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector6};

/// What is stated of them, for a part of which one face was seen.
#[derive(Clone, Copy)]
pub struct Common<'a> {
    /// The CAD.
    pub part: &'a Part,
    /// Its face that is seen.
    pub face: &'a Face,
    /// What is stated.
    pub settings: &'a UncertaintySettings,
}

/// A motion that the face holds this much more weakly than the best held one is held by its rims: such errors leave it alone.
const HELD_BY_RIMS: f64 = 1e-4;

impl Common<'_> {
    /// Tells each datum how far these errors displace it, k = 1.
    pub(super) fn displace(&self, values: &mut [DatumValue], features: &[Feature]) {
        let UncertaintySettings { thickness_mm, scale_ppm, .. } = *self.settings;
        let about = self.part.bounds.centre();
        for value in values {
            let geometry = &features[value.index].geometry;
            let reading = Reading::of(self.part, self.face, geometry);
            let scaled = (geometry.position() - about) * (scale_ppm * 1e-6);
            value.errors.thickness = reading.of_displacement(&reading.of_thickness(thickness_mm));
            value.errors.scale = reading.of_displacement(&scaled);
        }
    }

    /// What they do to a part that is held by a best fit to its face: the motion that fits the displaced face best. Reckoned with the
    /// whole face, whatever of it the camera saw.
    pub fn move_best_fit(&self, known: &mut PoseUncertainty) {
        let UncertaintySettings { thickness_mm, scale_ppm, .. } = *self.settings;
        let about = self.part.bounds.centre();
        let thicker = self.part.cad_side.face_offset_mm(self.face.side, thickness_mm) * self.face.side.sign();
        if thicker != 0.0 {
            known.set_thickness(self.fitted(|sample| sample.normal.into_inner() * thicker));
        }
        if scale_ppm != 0.0 {
            known.set_scale(self.fitted(|sample| (sample.point - about) * (scale_ppm * 1e-6)));
        }
    }

    /// The motion that brings a displaced face back as well as a motion can: least squares of the distances along its normals.
    fn fitted(&self, displacement: impl Fn(&FaceSample) -> Vector3) -> Isometry3 {
        let samples = &self.face.samples;
        let count = samples.len().max(1) as f64;
        let centre = Point3::from(samples.iter().fold(Vector3::zeros(), |sum, s| sum + s.point.coords) / count);
        let mut sums = Sums::zero();
        for sample in samples {
            sums.add(&(sample.point - centre), &sample.normal, displacement(sample).dot(&sample.normal), 1.0 / count);
        }
        // Turns are told by what they move at the part's half.
        let lever = 2.0 / self.part.diagonal_mm().max(1e-6);
        let scale = Matrix6::from_diagonal(&Vector6::new(lever, lever, lever, 1.0, 1.0, 1.0));
        let Some(eigen) = decompose::symmetric_eigen(scale * sums.h * scale) else { return Isometry3::identity() };
        let right = scale * sums.g;
        let strongest = eigen.eigenvalues.max();
        let held = (0..6).filter(|&k| eigen.eigenvalues[k] > HELD_BY_RIMS * strongest);
        let part_of = |k: usize| {
            let axis = eigen.eigenvectors.column(k);
            axis * (-axis.dot(&right) / eigen.eigenvalues[k])
        };
        let step: Vector6<f64> = scale * held.fold(Vector6::zeros(), |sum, k| sum + part_of(k));
        let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        let shift = Translation3::from(centre.coords + step.fixed_rows::<3>(3));
        Isometry3::from_parts(shift, turn) * Translation3::from(-centre.coords)
    }
}
