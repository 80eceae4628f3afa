//! The tables of `MERGE.toml` that say what makes a point good: masks, noise, density, the judge of the merge, features.

use super::model::*;
use super::sections::{LENGTH, Length, finish, optional};
use super::{Better, Metric};
use crate::plan::reader::{Entry, NumberRule, TableReader, quoted};
use crate::plan::suggest::{list_or, nearest};
use crate::plan::values::{name, short};

/// The word for the plain average.
const MEAN: &str = "mean";

/// `[mask]`.
pub(super) fn masks(table: TableReader<'_>) -> Option<Vec<Placed<Mask>>> {
    let mut masks = Vec::new();
    let mut all_sound = true;
    for metric in Metric::ALL {
        let Some(entry) = table.optional(metric.key()) else { continue };
        match mask(metric, entry) {
            Some(mask) => masks.push(mask),
            None => all_sound = false,
        }
    }
    if let Some(entry) = table.optional("a") {
        let help = "masks go by b, attenuation (b / a) or sigma_i; the background alone says nothing of quality";
        entry.wrong("found the background a, expected a metric", help);
        all_sound = false;
    }
    finish(table);
    all_sound.then_some(masks)
}

fn mask(metric: Metric, entry: Entry<'_>) -> Option<Placed<Mask>> {
    const BOUND: NumberRule = NumberRule { expected: "a number", accepts: |_| true };
    let example = match metric.better() {
        Better::Larger => format!("{} = {{ min = 0.002 }}", metric.key()),
        Better::Smaller => format!("{} = {{ max = 150.0 }}", metric.key()),
    };
    let table = entry.table("bounds in braces", &example)?;
    let min = optional(&table, "min", BOUND);
    let max = optional(&table, "max", BOUND);
    // A misspelt bound is told as that.
    if table.is_empty() {
        entry.wrong("found no bounds, expected min or max", format!("write it such as {example}"));
    }
    let is_without_bounds = table.optional("min").is_none() && table.optional("max").is_none();
    finish(table);
    if let (Some(Some(min)), Some(Some(max))) = (min, max)
        && min > max
    {
        entry.wrong(
            format!("found min {} above max {}, which keeps nothing", short(min), short(max)),
            "swap the two numbers",
        );
        return None;
    }
    if is_without_bounds {
        return None;
    }
    let mask = Mask { metric, min: min?.unwrap_or(f64::NEG_INFINITY), max: max?.unwrap_or(f64::INFINITY) };
    Some(Placed { value: mask, line: entry.line })
}

/// `[delta_n]`.
pub(super) fn non_uniformity(table: TableReader<'_>) -> Option<NonUniformitySettings> {
    let normal_radius = optional(&table, "normal_radius", LENGTH);
    let mean = table.optional("mean_radius");
    let mean_radius = mean.map_or(Some(None), |entry| entry.number(LENGTH).map(Some));
    tell_narrow_mean(mean, normal_radius, mean_radius);
    finish(table);
    Some(NonUniformitySettings { normal_radius: normal_radius?, mean_radius: mean_radius? })
}

/// A mean normal of fewer points than the normal itself says nothing.
fn tell_narrow_mean(mean: Option<Entry<'_>>, normal_radius: Option<Option<f64>>, mean_radius: Option<Option<f64>>) {
    if let (Some(entry), Some(Some(normal)), Some(Some(mean))) = (mean, normal_radius, mean_radius)
        && mean <= normal
    {
        entry.wrong(
            format!("found {}, expected a radius above normal_radius ({})", short(mean), short(normal)),
            "normals are averaged over many more points than one is laid through; two to three times the radius will do",
        );
    }
}

/// `[noise]`.
pub(super) fn noise(table: TableReader<'_>) -> Option<NoiseSettings> {
    const NEIGHBOURS: NumberRule = NumberRule {
        expected: "a whole number of neighbours from 3 to 100",
        accepts: |v| v.fract() == 0.0 && (3.0..=100.0).contains(&v),
    };
    const SIGMAS: NumberRule = NumberRule {
        expected: "a number of standard deviations above 0 and up to 100",
        accepts: |v| v > 0.0 && v <= 100.0,
    };
    let neighbours = table.optional("neighbours").map_or(Some(12.0), |entry| entry.number(NEIGHBOURS));
    let sigmas = table.optional("sigmas").map_or(Some(3.0), |entry| entry.number(SIGMAS));
    finish(table);
    Some(NoiseSettings { neighbours: neighbours? as usize, sigmas: sigmas? })
}

/// `[density]`.
pub(super) fn density(table: TableReader<'_>) -> Option<DensitySettings> {
    let entry = table.required("cell", "the side of a cell in the views' unit", "write cell = 40.0");
    let cell = entry.and_then(|entry| Some(Placed { value: entry.number(LENGTH)?, line: entry.line }));
    finish(table);
    Some(DensitySettings { cell: cell? })
}

/// `[merge]`, or what holds without it.
pub(super) fn merge(table: Option<TableReader<'_>>) -> Option<MergeSettings> {
    const MULTIPLE: NumberRule =
        NumberRule { expected: "a multiple of d_grid above 0 and up to 1000", accepts: |v| v > 0.0 && v <= 1000.0 };
    let default_judge = Judge::Metrics(vec![Metric::CalibrationDistance]);
    let default_radius = MergeRadius::Grid(2.0);
    let Some(table) = table else {
        let judge = Placed { value: default_judge, line: 1 };
        return Some(MergeSettings { judge, radius: Placed { value: default_radius, line: 1 } });
    };
    let line = table.line();
    let judge = match table.optional("metric") {
        Some(entry) => judge(entry).map(|value| Placed { value, line: entry.line }),
        None => Some(Placed { value: default_judge, line }),
    };
    let by_grid = table.optional("radius_grid");
    let by_length = table.optional("radius");
    let radius = match (by_grid, by_length) {
        (Some(_), Some(entry)) => {
            entry.wrong("found beside radius_grid, expected one of the two", "remove one of radius_grid and radius");
            None
        }
        (Some(e), None) => e.number(MULTIPLE).map(|v| Placed { value: MergeRadius::Grid(v), line: e.line }),
        (None, Some(e)) => e.number(LENGTH).map(|v| Placed { value: MergeRadius::Length(v), line: e.line }),
        (None, None) => Some(Placed { value: default_radius, line }),
    };
    finish(table);
    Some(MergeSettings { judge: judge?, radius: radius? })
}

fn judge(entry: Entry<'_>) -> Option<Judge> {
    let mut words: Vec<&str> = Metric::ALL.iter().map(|metric| metric.key()).collect();
    words.push(MEAN);
    let expected = format!("{}, or a list of metrics", list_or(&words, "\"").replace(" or ", ", "));
    let texts = entry.texts(&expected, "[\"d_cal\", \"sigma_i\"]")?;
    if texts == [MEAN] {
        return Some(Judge::Mean);
    }
    let mut metrics: Vec<Metric> = Vec::new();
    for text in texts {
        let Some(metric) = Metric::of_key(text) else {
            let (words, help) = match nearest(text, words.iter().copied()) {
                _ if text == MEAN => {
                    let help = "write metric = \"mean\" by itself, or remove it from the list";
                    (format!("found {} in a list of metrics", quoted(text)), help.to_owned())
                }
                Some((known, true)) => {
                    (format!("found {}, expected {expected}", quoted(text)), format!("did you mean \"{known}\"?"))
                }
                _ => (format!("found {}, expected {expected}", quoted(text)), "write one of these words".to_owned()),
            };
            entry.wrong(words, help);
            return None;
        };
        if metrics.contains(&metric) {
            entry.wrong(format!("found {} twice in the list", quoted(text)), "name each metric once");
            return None;
        }
        metrics.push(metric);
    }
    Some(Judge::Metrics(metrics))
}

/// `[[feature]]`, number `number` from 1.
pub(super) fn feature(table: TableReader<'_>, number: usize) -> Option<MergeFeature> {
    const UNCERTAINTY: NumberRule = NumberRule {
        expected: "a length in the views' unit, 0 or more",
        accepts: |v| (0.0..=Length::LARGEST).contains(&v),
    };
    const KINDS: [(&str, FeatureKind); 3] =
        [("plane", FeatureKind::Plane), ("sphere", FeatureKind::Sphere), ("cylinder", FeatureKind::Cylinder)];
    let line = table.line();
    let kind = table
        .required("kind", "the kind of feature", "write kind = \"cylinder\"")
        .and_then(|entry| entry.choice(&KINDS));
    let given = table.optional("name");
    let name = given.map_or(Some(None), |entry| name(entry).map(|text| Some(text.to_owned())));
    let radius = table.optional("radius");
    let radius_u = table.optional("radius_u").map_or(Some(0.0), |entry| entry.number(UNCERTAINTY));
    let is_plane = kind == Some(FeatureKind::Plane);
    let radius = match radius {
        Some(entry) if is_plane => {
            entry.wrong("found a radius, expected none for a plane", "remove it");
            None
        }
        Some(entry) => entry.number(LENGTH).map(Some),
        None => Some(None),
    };
    table.finish(|key, _| {
        key.starts_with("diam").then(|| (format!("unknown key \"{key}\""), "write radius, half of it".to_owned()))
    });
    let kind = kind?;
    let name = name?.unwrap_or_else(|| format!("{} {number}", kind.key()));
    Some(MergeFeature { name, kind, radius: radius?, radius_u: radius_u?, line })
}
