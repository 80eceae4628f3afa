//! What a rig of cameras can tell: the two formulas of the SIVPRO paper (Bergström et al., "Automatic in-line inspection of shape
//! based on photogrammetry", section 3.6), in one place for the simulator, the expected uncertainty and the study.
//!
//! * (1) `GP = (d / f) p`: the ground pixel, that is what one pixel sees, from the distance `d`, the focal length `f` and the size `p` of
//!   a pixel; times the image accuracy in pixels this is the planar accuracy `alpha`;
//! * (2) `sigma = (d / b) alpha`: the depth accuracy, from the base `b` between two cameras.
//!
//! For its own rig the paper prints GP = 0.084 mm, alpha = 0.025 mm and sigma = 0.061 mm at full resolution. The first two come out of
//! (1); (2) gives 0.075 mm with the base of 200 mm that the paper names (0.061 mm would need one of 247 mm). The formulas hold
//! here, not the printed figure.
//!
//! The paper does not say how often an error stays below these accuracies. They are read as standard deviations (k = 1), since image
//! accuracies are told as the root mean square of residuals; so a point errs by `alpha` along each axis across the line of sight and by
//! `sigma` along it. Neither do the formulas say how errors go together: patches of the images that are matched overlap, so that
//! neighbours share a part of their depth error. [`SHARED_DEPTH_VARIANCE`] and [`Rig::correlation_length_mm`] assume how much and how far.

use super::model::Rig;

/// Share of the variance of a point's depth that it has in common with its neighbours: an assumption.
pub const SHARED_DEPTH_VARIANCE: f64 = 0.2;
/// How far that reaches, in ground pixels: `l` of exp(-r² / 2 l²) for windows of about five pixels. An assumption as well.
const MATCHING_REACH_PX: f64 = 3.0;

impl Rig {
    /// The rig of the paper, at the resolution of its clouds: half of the pixels in each direction.
    pub const PAPER: Rig = Rig {
        distance_mm: 600.0,
        base_mm: 200.0,
        focal_mm: 35.0,
        pixel_um: 4.88,
        image_accuracy_px: 0.3,
        resolution_level: 2,
        point_spacing_mm: None,
    };

    /// What one pixel sees of a part that faces the cameras, mm: equation (1), doubled by each level of resolution after the first (the
    /// paper's second level has a quarter of the pixels).
    pub fn ground_pixel_mm(&self) -> f64 {
        let halvings = self.resolution_level.saturating_sub(1).min(30);
        self.distance_mm / self.focal_mm * self.pixel_um * 1e-3 * f64::from(1_u32 << halvings)
    }

    /// Spacing of the points on a part that faces the cameras, mm: a depth map has one point a pixel, unless the system delivers fewer.
    pub fn spacing_mm(&self) -> f64 {
        self.point_spacing_mm.unwrap_or_else(|| self.ground_pixel_mm())
    }

    /// Standard deviation in mm of a point along each axis across the line of sight: the image accuracy on the part.
    pub fn planar_accuracy_mm(&self) -> f64 {
        self.image_accuracy_px * self.ground_pixel_mm()
    }

    /// Standard deviation in mm of a point along the line of sight: equation (2).
    pub fn depth_accuracy_mm(&self) -> f64 {
        self.distance_mm / self.base_mm * self.planar_accuracy_mm()
    }

    /// How far the shared part of depth errors reaches: `l` in mm of their covariance exp(-r² / 2 l²).
    pub fn correlation_length_mm(&self) -> f64 {
        MATCHING_REACH_PX * self.ground_pixel_mm()
    }

    /// The figures in words, for people.
    pub fn figures(&self) -> String {
        let thinned = self.point_spacing_mm.map_or(String::new(), |mm| format!(", points {mm:.3} mm apart"));
        format!(
            "ground pixel {:.3} mm{thinned}, accuracy {:.3} mm in the plane and {:.3} mm in depth (standard deviations of a point)",
            self.ground_pixel_mm(),
            self.planar_accuracy_mm(),
            self.depth_accuracy_mm()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 600 / 35 x 0.00488 mm = 0.083657 mm, times 0.3 = 0.025097 mm, times 600 / 200 = 0.075291 mm.
    #[test]
    fn the_figures_of_the_paper_come_out_of_its_formulas() {
        let full = Rig { resolution_level: 1, ..Rig::PAPER };
        assert!((full.ground_pixel_mm() - 0.083_657_142_857).abs() < 1e-12);
        assert!((full.planar_accuracy_mm() - 0.025_097_142_857).abs() < 1e-12);
        assert!((full.depth_accuracy_mm() - 0.075_291_428_571).abs() < 1e-12);
        // As printed: 0.084, 0.025; 0.168 and 0.05 at its second level. Its depth accuracy of 0.061 is not what (2) gives.
        assert_eq!(format!("{:.3} {:.3}", full.ground_pixel_mm(), full.planar_accuracy_mm()), "0.084 0.025");
        assert!(
            (Rig::PAPER.ground_pixel_mm() - 0.168).abs() < 1e-3
                && (Rig::PAPER.planar_accuracy_mm() - 0.05).abs() < 1e-3
        );
        assert_eq!(format!("{:.3}", full.depth_accuracy_mm()), "0.075");
        let told = "ground pixel 0.167 mm, accuracy 0.050 mm in the plane and 0.151 mm in depth (standard deviations of a point)";
        assert_eq!(Rig::PAPER.figures(), told);
    }

    #[test]
    fn each_level_doubles_what_a_pixel_sees_and_a_longer_base_sees_depth_better() {
        let at = |resolution_level| Rig { resolution_level, ..Rig::PAPER };
        for level in 1..16 {
            assert_eq!(at(level + 1).ground_pixel_mm(), 2.0 * at(level).ground_pixel_mm());
            assert_eq!(at(level + 1).depth_accuracy_mm(), 2.0 * at(level).depth_accuracy_mm());
        }
        let wide = Rig { base_mm: 400.0, ..Rig::PAPER };
        assert_eq!(wide.depth_accuracy_mm(), 0.5 * Rig::PAPER.depth_accuracy_mm());
        assert_eq!(wide.planar_accuracy_mm(), Rig::PAPER.planar_accuracy_mm());
    }
}
