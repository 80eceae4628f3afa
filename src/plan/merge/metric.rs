//! The words for what can be known of the quality of a measured point (endoscope paper, section 4).

/// A quality metric: of the signal, of the calibration nearby, of the cloud around.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Metric {
    /// Amplitude b of the fringes.
    Strength,
    /// Amplitude over background, b / a.
    Attenuation,
    /// Standard deviation of a pixel's intensity (0..1) over the phase shifts of the highest frequency.
    PhaseShiftVariation,
    /// Distance to the nearest calibrated feature of the camera.
    CalibrationDistance,
    /// The same of the projector.
    CalibrationDistanceProjector,
    /// Reprojection error of the nearest calibrated feature, pixels.
    Reprojection,
    /// How many calibrated features lie around the nearest one: equation (3).
    Density,
    /// How far the normal stands off the mean one around: equation (4).
    NonUniformity,
    /// The same as an angle, rad.
    NonUniformityAngle,
}

/// Which values of a metric are the better ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Better {
    /// Larger ones.
    Larger,
    /// Smaller ones.
    Smaller,
}

impl Metric {
    /// All of them.
    pub const ALL: [Metric; 9] = [
        Metric::Strength,
        Metric::Attenuation,
        Metric::PhaseShiftVariation,
        Metric::CalibrationDistance,
        Metric::CalibrationDistanceProjector,
        Metric::Reprojection,
        Metric::Density,
        Metric::NonUniformity,
        Metric::NonUniformityAngle,
    ];

    /// The word in `MERGE.toml`, and the name of the column in files.
    pub fn key(self) -> &'static str {
        match self {
            Metric::Strength => "b",
            Metric::Attenuation => "attenuation",
            Metric::PhaseShiftVariation => "sigma_i",
            Metric::CalibrationDistance => "d_cal",
            Metric::CalibrationDistanceProjector => "d_cal_projector",
            Metric::Reprojection => "reprojection",
            Metric::Density => "density",
            Metric::NonUniformity => "delta_n",
            Metric::NonUniformityAngle => "delta_n_angle",
        }
    }

    /// The metric of that word.
    pub fn of_key(key: &str) -> Option<Self> {
        Metric::ALL.into_iter().find(|metric| metric.key() == key)
    }

    /// Which values are the better ones.
    pub fn better(self) -> Better {
        match self {
            Metric::Strength | Metric::Attenuation | Metric::PhaseShiftVariation | Metric::Density => Better::Larger,
            Metric::CalibrationDistance
            | Metric::CalibrationDistanceProjector
            | Metric::Reprojection
            | Metric::NonUniformity
            | Metric::NonUniformityAngle => Better::Smaller,
        }
    }

    /// A value as a score, of which the larger is better.
    pub fn score(self, value: f64) -> f64 {
        match self.better() {
            Better::Larger => value,
            Better::Smaller => -value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_name_metrics_and_scores_rise_with_quality() {
        for metric in Metric::ALL {
            assert_eq!(Metric::of_key(metric.key()), Some(metric));
            let (worse, better) = if metric.better() == Better::Larger { (1.0, 2.0) } else { (2.0, 1.0) };
            assert!(metric.score(better) > metric.score(worse));
        }
        assert_eq!(Metric::of_key("mean"), None);
    }
}
