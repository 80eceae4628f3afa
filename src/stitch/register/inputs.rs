//! What registration can begin with.

use super::result::RegisterError;
use super::{Options, Prior};
use crate::stitch::View;

/// Whether views, priors and options can be used.
pub(super) fn check(views: &[View], priors: &[Option<Prior>], options: &Options) -> Result<(), RegisterError> {
    if views.is_empty() {
        return Err(RegisterError::NoViews);
    }
    if priors.len() != views.len() {
        return Err(RegisterError::Priors { priors: priors.len(), views: views.len() });
    }
    let above_zero = |v: f64| v > 0.0 && v.is_finite();
    for (name, value) in
        [("d_grid", options.d_grid), ("noise", options.noise), ("residual", Some(options.most_residual))]
    {
        if let Some(value) = value.filter(|v| !above_zero(*v)) {
            return Err(RegisterError::Option { what: format!("{name} is {value}, expected a number above 0") });
        }
    }
    if !(options.least_share > 0.0 && options.least_share <= 1.0) || options.most_neighbours == 0 {
        let (share, most) = (options.least_share, options.most_neighbours);
        let what =
            format!("least share {share} with {most} neighbours, expected a share above 0 up to 1 and a neighbour");
        return Err(RegisterError::Option { what });
    }
    for (view, prior) in views.iter().zip(priors) {
        let name = || view.name.clone();
        let Some(prior) = prior else { continue };
        let (pose, shift, turn) = (prior.world_from_view, prior.translation_sigma, prior.rotation_sigma_rad);
        let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        if !numbers.copied().all(f64::is_finite) {
            return Err(RegisterError::Prior { name: name(), what: "a number that is not finite".to_owned() });
        }
        if !above_zero(shift) || !above_zero(turn) {
            let what = format!("the standard uncertainties {shift} and {turn} rad");
            return Err(RegisterError::Prior { name: name(), what });
        }
    }
    Ok(())
}
