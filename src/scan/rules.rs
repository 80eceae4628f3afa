//! The rules by which a point is belt or part: how far the plane and the colour of the belt can be trusted.

use super::background::LEAST_BODY;
use super::colour::{BeltColours, luminance};
use super::conditioned::{BeltPlane, PointClass};
use super::hints::ScanHints;
use super::neighbourhood::{Texture, stratified};
use crate::diagnostic::Refusal;
use crate::geometry::{Point3, PointCloud};
use crate::plan::model::BackgroundSettings;

/// Where colour decides.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum ColourUse {
    Off,
    /// Up to this height above the belt in mm.
    Below(f64),
    Everywhere,
}

/// The rules by which each point gets its class.
pub(super) struct Rules<'a> {
    luminance_min: Option<f64>,
    colours: &'a BeltColours,
    pub(super) colour_use: ColourUse,
    pub(super) belt: Option<BeltPlane>,
    pub(super) clearance_mm: f64,
    highest_mm: f64,
}

impl Rules<'_> {
    /// The class of one point.
    pub(super) fn class(&self, point: &Point3, colour: Option<[u8; 3]>) -> PointClass {
        let too_dark = |c| self.luminance_min.is_some_and(|least| luminance(c) < least);
        if colour.is_some_and(too_dark) {
            return PointClass::Dark;
        }
        let height_mm = self.belt.map(|belt| belt.height_mm(point));
        let colour_decides = match self.colour_use {
            ColourUse::Off => false,
            ColourUse::Everywhere => true,
            ColourUse::Below(limit_mm) => height_mm.is_some_and(|h| h <= limit_mm),
        };
        if colour_decides && colour.is_some_and(|c| self.colours.matches(c)) {
            return PointClass::Colour;
        }
        match height_mm {
            Some(h) if h <= self.clearance_mm => PointClass::Belt,
            Some(h) if h > self.highest_mm => PointClass::Stray,
            _ => PointClass::Kept,
        }
    }
}

/// Height in mm above the belt that is still the belt: 3.5 standard deviations, but no more than 0.6 of the thickness, so
/// that a flat part on the belt stays; never less than 2.5 standard deviations, or the belt's own noise would be kept.
fn default_clearance_mm(belt: &BeltPlane, thickness_mm: f64) -> f64 {
    let wanted_mm = 3.5 * belt.sigma_mm;
    if thickness_mm > 0.0 { wanted_mm.min(0.6 * thickness_mm).max(2.5 * belt.sigma_mm) } else { wanted_mm }
}

#[allow(clippy::too_many_arguments, reason = "a straight step of the pipeline; a struct would only rename its inputs")]
pub(super) fn rules<'a>(
    cloud: &PointCloud,
    bright: &[u32],
    belt: Option<BeltPlane>,
    luminance_min: Option<f64>,
    colours: &'a BeltColours,
    texture: Texture,
    settings: &BackgroundSettings,
    hints: &ScanHints,
    warnings: &mut Vec<String>,
) -> Result<Rules<'a>, Refusal> {
    let clearance_mm = match (&belt, settings.belt_clearance_mm) {
        (_, Some(given)) => given,
        (Some(belt), None) => default_clearance_mm(belt, hints.thickness_mm),
        (None, None) => 0.0,
    };
    let tallest_mm = hints.part_extents_mm.iter().copied().fold(0.0, f64::max) + hints.thickness_mm;
    let highest_mm = if hints.has_size() { clearance_mm + 1.2 * tallest_mm } else { f64::INFINITY };
    let mut rules = Rules { luminance_min, colours, colour_use: ColourUse::Off, belt, clearance_mm, highest_mm };
    if let (Some(all), false) = (&cloud.colours, settings.belt_colours.is_empty()) {
        let sample: Vec<(Point3, [u8; 3])> = stratified(bright.len(), 50_000, 5)
            .into_iter()
            .map(|k| bright[k as usize] as usize)
            .map(|index| (cloud.positions[index], all[index]))
            .collect();
        rules.colour_use = match belt {
            Some(_) => colour_near_belt(&rules, &sample, hints, warnings),
            None => colour_alone(&rules, &sample, bright.len(), texture, hints, warnings)?,
        };
    }
    Ok(rules)
}

/// With a belt: colour decides up to twice the thickness above it (the noisy rim of the belt), if it can tell belt from part.
fn colour_near_belt(
    rules: &Rules,
    sample: &[(Point3, [u8; 3])],
    hints: &ScanHints,
    warnings: &mut Vec<String>,
) -> ColourUse {
    let Some(belt) = rules.belt else { return ColourUse::Off };
    let limit_mm = rules.clearance_mm + 2.0 * hints.thickness_mm.max(2.0 * belt.sigma_mm);
    let above = |least_mm: f64| {
        let part = sample.iter().filter(move |(p, _)| belt.height_mm(p) > least_mm);
        part.fold((0usize, 0usize), |(all, belt_coloured), (_, colour)| {
            (all + 1, belt_coloured + usize::from(rules.colours.matches(*colour)))
        })
    };
    // Points above the limit are surely not belt; a flat part has none, so all that is kept is judged as well.
    let (high, high_coloured) = above(limit_mm);
    let (kept, kept_coloured) = above(rules.clearance_mm);
    let part_has_colour = high >= 100 && high_coloured as f64 > 0.05 * high as f64;
    if part_has_colour || kept_coloured as f64 > 0.2 * kept as f64 {
        if rules.clearance_mm < limit_mm && kept_coloured > 0 {
            warnings.push("the part has the belt's colour too: colour was not used to remove points".into());
        }
        return ColourUse::Off;
    }
    ColourUse::Below(limit_mm)
}

/// Without a belt plane: colour decides everywhere, unless it would take the part as well.
fn colour_alone(
    rules: &Rules,
    sample: &[(Point3, [u8; 3])],
    points: usize,
    texture: Texture,
    hints: &ScanHints,
    warnings: &mut Vec<String>,
) -> Result<ColourUse, Refusal> {
    let left = sample.iter().filter(|(_, colour)| !rules.colours.matches(*colour)).count();
    let left_share = left as f64 / sample.len().max(1) as f64;
    let spacing_sq = texture.spacing_mm * texture.spacing_mm;
    let all_mm2 = points as f64 * spacing_sq;
    let left_mm2 = left_share * all_mm2;
    let too_little =
        if hints.has_size() { left_mm2 < 0.1 * hints.part_area_mm2.min(all_mm2) } else { left_share < 0.01 };
    if !too_little {
        return Ok(ColourUse::Everywhere);
    }
    let more_than_a_part = hints.has_size() && all_mm2 > 1.3 * hints.part_area_mm2;
    if more_than_a_part && left_mm2 < LEAST_BODY * hints.part_area_mm2 {
        return Err(Refusal::new(
            format!(
                "{:.1} % of the points have the belt's colour, nothing else is in view",
                100.0 * (1.0 - left_share)
            ),
            "see whether a part lies on the belt, and whether background.belt_colours and colour_tolerance leave out its colour",
        ));
    }
    if more_than_a_part {
        return Ok(ColourUse::Everywhere);
    }
    warnings.push("nearly all points have the belt's colour: colour was not used to remove points".into());
    Ok(ColourUse::Off)
}
