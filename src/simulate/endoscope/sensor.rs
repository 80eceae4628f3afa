//! What the sensor is like.

/// A sensor of camera and projector. Lengths are in the unit of its views.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorModel {
    /// Pixels a row, and rows.
    pub pixels: u32,
    /// Distance of neighbouring pixels on a surface at the working distance.
    pub pitch: f64,
    /// From the camera to the middle of the measuring volume.
    pub working_distance: f64,
    /// Angle between the axes of camera and projector.
    pub triangulation_rad: f64,
    /// Radius of the round image at the working distance.
    pub field_radius: f64,
    /// Out of focus by so much the fringes' contrast is 1/e of its best.
    pub depth_of_field: f64,
    /// At the rim of the image the sharpest distance is nearer by so much.
    pub field_curvature: f64,
    /// Background a of a facing surface in the middle, of full scale 1.
    pub background: f64,
    /// Best contrast b / a.
    pub contrast: f64,
    /// Standard deviation of a camera pixel's intensity.
    pub intensity_noise: f64,
    /// Pixels of less sigma_I give no point.
    pub least_sigma_i: f64,
    /// Standard deviation along the ray where the signal is good.
    pub noise_plateau: f64,
    /// The same that is added (in squares) at sigma_I = 0.002; it falls as 1 / sigma_I.
    pub noise_at_0002: f64,
    /// A pixel has a wrong phase with the chance exp(-sigma_I / this) / 2.
    pub wrong_phase_sigma_i: f64,
    /// Wrong phases put a point up to so far off, along the ray.
    pub wrong_phase_spread: f64,
    /// Standard deviation of the smooth error, along the ray, at `bias_reach` from the nearest feature of the camera; it grows with the square
    /// of that distance, as a model does that is drawn out beyond the places it was fitted to.
    pub bias: f64,
    /// See `bias`.
    pub bias_reach: f64,
    /// `l` in the smooth error's correlation exp(-r² / 2 l²).
    pub bias_length: f64,
    /// Distance of neighbouring marks on the calibration board.
    pub board_pitch: f64,
    /// How many times the board was seen.
    pub boards: u32,
    /// Marks lie so near to the camera's axis.
    pub calibrated_radius: f64,
    /// Boards stood up to so far before and behind the working distance.
    pub calibrated_depth: f64,
}

impl SensorModel {
    /// The paper's sensor, µm. From the paper: working distance 10 mm, 30 degrees, noise of 5 to 6 µm where points are masked, 8 µm where not, thresholds of 0.002 and 150 µm, some 10 µm between points (61 to 241 of them within 50 µm). Ours: how light, sharpness
    /// and marks are spread. `bias` is what makes 8 µm of 5.5 on the plane (20 seeds); it was fixed before anything was merged.
    pub fn paper() -> Self {
        Self {
            pixels: 216,
            pitch: 9.25,
            working_distance: 10_000.0,
            triangulation_rad: 30f64.to_radians(),
            field_radius: 990.0,
            depth_of_field: 300.0,
            field_curvature: 250.0,
            background: 0.3,
            contrast: 0.4,
            intensity_noise: 0.0005,
            least_sigma_i: 0.0008,
            noise_plateau: 5.5,
            noise_at_0002: 10.0,
            wrong_phase_sigma_i: 0.0004,
            wrong_phase_spread: 150.0,
            bias: 10.0,
            bias_reach: 150.0,
            bias_length: 500.0,
            board_pitch: 150.0,
            boards: 12,
            calibrated_radius: 800.0,
            calibrated_depth: 450.0,
        }
    }

    /// The same sensor 24 times as large, mm: views of 47 mm, noise of 0.13 mm, for parts.
    pub fn large() -> Self {
        Self::paper().scaled(0.024)
    }

    /// All its lengths so many times as long.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            pitch: self.pitch * factor,
            working_distance: self.working_distance * factor,
            field_radius: self.field_radius * factor,
            depth_of_field: self.depth_of_field * factor,
            field_curvature: self.field_curvature * factor,
            noise_plateau: self.noise_plateau * factor,
            noise_at_0002: self.noise_at_0002 * factor,
            wrong_phase_spread: self.wrong_phase_spread * factor,
            bias: self.bias * factor,
            bias_reach: self.bias_reach * factor,
            bias_length: self.bias_length * factor,
            board_pitch: self.board_pitch * factor,
            calibrated_radius: self.calibrated_radius * factor,
            calibrated_depth: self.calibrated_depth * factor,
            ..self
        }
    }

    /// The same sensor without any error of its points; the signal is as it was.
    #[must_use]
    pub fn without_errors(self) -> Self {
        Self { noise_plateau: 0.0, noise_at_0002: 0.0, wrong_phase_spread: 0.0, bias: 0.0, ..self }
    }

    /// Standard deviation of the random error along the ray at that (noiseless) sigma_I.
    pub fn noise(&self, sigma_i: f64) -> f64 {
        self.noise_plateau.hypot(self.noise_at_0002 * 0.002 / sigma_i)
    }

    /// Standard deviation of the smooth error along the ray so far from the nearest feature.
    pub fn smooth_error(&self, distance: f64) -> f64 {
        self.bias * (distance / self.bias_reach).powi(2)
    }
}
