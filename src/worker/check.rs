//! Everything that can be told of a plan before a scan is there: the plan, its CAD, its folders, what it can be expected to
//! measure. What is wrong in one place keeps nothing else from being looked at.

use super::examine::{prepare_cad, prepare_part, settings_for};
use super::results::ending_of;
use crate::diagnostic::{Diagnostic, ReadError};
use crate::inspect::{
    Foretold, Outlook, axis_reading_warning, check_draft, expected_warnings, foretell, region_warnings,
};
use crate::part::{Part, PartSettings};
use crate::plan::document::{Document, PlanProblem};
use crate::plan::{self, CadSettings, CadSide, Draft, Loaded, OutputFormat};
use crate::report::{atomic, sequence};
use crate::run::{Cancelled, RunContext};
use std::fs;
use std::path::Path;

/// Every problem of a plan: those of the plan file by line, then those of its comparison file, then those of the CAD. Where a
/// plan is sound the cache of its CAD is written.
pub fn check_plan(path: &Path, run: &RunContext) -> Result<Vec<Diagnostic>, Cancelled> {
    let loaded = plan::load(path);
    let (part, of_cad) = against_cad(&loaded, run)?;
    Ok(all_of(loaded, part.as_ref(), of_cad))
}

/// The same of a plan that is being edited, each problem with its field. `part` is its CAD as [`prepare_document`] made it; without it the
/// plan is not compared with the CAD.
pub fn check_document(document: &Document, part: Option<&Part>) -> Vec<PlanProblem> {
    let loaded = document.read();
    let of_cad = part.map_or_else(Vec::new, |part| of_part(&loaded.draft, part));
    document.locate(all_of(loaded, part, of_cad))
}

/// The CAD of a plan that is being edited, as far as the plan tells of it; `None` where it names none that is there. Nothing is cached.
pub fn prepare_document(document: &Document, run: &RunContext) -> Result<Option<Part>, ReadError> {
    let Loaded { draft, .. } = document.read();
    draft_part(&draft, run).transpose()
}

/// What of a plan that is being edited its prepared CAD depends on: where it is the same, the CAD need not be prepared again.
#[derive(Debug, Clone, PartialEq)]
pub struct CadAsked {
    cad: CadSettings,
    settings: Option<PartSettings>,
}

impl CadAsked {
    /// Of a plan; `None` where it names no CAD.
    pub fn of(document: &Document) -> Option<Self> {
        let Draft { cad, part, features, comparison, .. } = document.read().draft;
        let settings = part.map(|part| {
            let mut settings = settings_for(part.cad_side, part.thickness_mm, &features, &comparison);
            // Only of a solid do the plan's points decide what is made of it.
            if part.cad_side != CadSide::Solid {
                settings.plan_directions.clear();
            }
            settings
        });
        Some(Self { cad: cad?, settings })
    }
}

/// The plan's own problems and those found beside it, in the order in which they are told.
fn all_of(loaded: Loaded, part: Option<&Part>, of_cad: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let Loaded { draft, mut problems, .. } = loaded;
    problems.extend(of_cad);
    problems.extend(outlook(&draft, part));
    problems.extend(results_place(&draft));
    let rank = |d: &Diagnostic| match &d.file {
        Some(file) if *file == draft.path => 0,
        _ if d.line.is_some() => 1,
        _ => 2,
    };
    problems.sort_by_key(|d| (rank(d), d.line));
    problems
}

/// What can be expected of a plan's measurements before anything is measured; `None` where the plan does not tell how the part is held,
/// has no comparison points, or its datums (of a best fit: the surface alone) do not hold the part.
pub fn foretell_plan(path: &Path, run: &RunContext) -> Result<Option<Foretold>, Cancelled> {
    let Loaded { plan, draft, .. } = plan::load(path);
    let part = match plan.map(|plan| prepare_part(&plan, run)) {
        Some(Err(ReadError::Cancelled(cancelled))) => return Err(cancelled),
        Some(Ok((part, _))) => Some(part),
        Some(Err(_)) | None => None,
    };
    let part = part.as_ref();
    Ok(Outlook::of_draft(&draft).and_then(|outlook| foretell(&Outlook { part, ..outlook })))
}

/// The same of a plan that is being edited, with its CAD where that is at hand; for another choice of datums ask a copy with that choice.
pub fn foretell_document(document: &Document, part: Option<&Part>) -> Option<Foretold> {
    let Loaded { draft, .. } = document.read();
    Outlook::of_draft(&draft).and_then(|outlook| foretell(&Outlook { part, ..outlook }))
}

/// Warnings of an alignment that will hold the part poorly, of windows with too few points, and of tolerances that cannot be judged, with
/// their places. Without the CAD neither lean of the sheet nor thickness and scale are counted.
pub(super) fn outlook(draft: &Draft, part: Option<&Part>) -> Vec<Diagnostic> {
    let Some(outlook) = Outlook::of_draft(draft) else { return Vec::new() };
    let outlook = Outlook { part, ..outlook };
    let axis = axis_reading_warning(&outlook).map(|d| d.in_file(&draft.path).at_line(draft.alignment_line));
    axis.into_iter().chain(region_warnings(&outlook, &draft.path)).chain(expected_warnings(&outlook)).collect()
}

/// The CAD where it could be prepared; its problems, and those of the plan's sound points against it.
fn against_cad(loaded: &Loaded, run: &RunContext) -> Result<(Option<Part>, Vec<Diagnostic>), Cancelled> {
    let prepared = match &loaded.plan {
        // That there is no such file is the plan's problem, and told there.
        Some(plan) => Some(prepare_part(plan, run).map(|(part, _)| part)),
        None => draft_part(&loaded.draft, run),
    };
    match prepared {
        None => Ok((None, Vec::new())),
        Some(Ok(part)) => {
            let problems = of_part(&loaded.draft, &part);
            Ok((Some(part), problems))
        }
        Some(Err(ReadError::Cancelled(cancelled))) => Err(cancelled),
        Some(Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic))) => Ok((None, vec![*diagnostic])),
    }
}

/// The CAD of what is sound of a plan, if it is there.
fn draft_part(draft: &Draft, run: &RunContext) -> Option<Result<Part, ReadError>> {
    let cad = draft.cad.as_ref().filter(|cad| cad.path.is_file())?;
    // Places are compared with the CAD's own surface: where [part] does not tell, the sheet may be of any thickness.
    let prepared_as = |cad_side, thickness_mm| {
        let settings = settings_for(cad_side, thickness_mm, &draft.features, &draft.comparison);
        prepare_cad(cad, &settings, None, run)
    };
    let prepared = match &draft.part {
        Some(part) => prepared_as(part.cad_side, part.thickness_mm).map(|(part, _)| part),
        None => match prepared_as(CadSide::Top, 0.0) {
            Err(ReadError::Bad(fault)) => prepared_as(CadSide::Solid, 0.0).map_err(|_| ReadError::Bad(fault)),
            other => other,
        }
        .map(|(mut part, _)| {
            // What is odd about it may be right for another kind of CAD.
            part.warnings.clear();
            part
        }),
    };
    Some(prepared)
}

/// What is odd about the CAD, and the plan's sound points against it.
fn of_part(draft: &Draft, part: &Part) -> Vec<Diagnostic> {
    let file = draft.cad.as_ref().map_or(draft.path.as_path(), |cad| cad.path.as_path());
    let warnings = part.warnings.iter().map(|w| Diagnostic::warning(w).in_file(file));
    warnings.chain(check_draft(draft, part)).collect()
}

/// What would keep results from being written, or mix them up with scans.
fn results_place(draft: &Draft) -> Option<Diagnostic> {
    let results = draft.results.as_ref()?;
    let place = |d: Diagnostic| d.in_file(&draft.path).at_line(results.line);
    let path = results.path.as_path();
    let shown = path.display();
    if path.exists() && !path.is_dir() {
        let message = format!("[output] folder: found {shown}, which is a file, expected a folder");
        return Some(place(Diagnostic::error(message).with_help("name a folder; it is made when it is not there")));
    }
    // A folder that is not there yet is made in the nearest one that is.
    let there =
        path.ancestors().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p }).find(|p| p.exists());
    if let Some(there) = there
        && let Err(fault) = atomic::try_folder(there)
    {
        let message = format!("[output] folder: {} cannot be written ({fault})", there.display());
        return Some(place(Diagnostic::error(message).with_help("allow writing there, or name another folder")));
    }
    let (scans, output) = draft.scans.as_ref().zip(draft.output.as_ref())?;
    let same = match (fs::canonicalize(path), fs::canonicalize(&scans.path)) {
        (Ok(results), Ok(scans)) => results == scans,
        _ => path == scans.path,
    };
    if same && may_take_results(&scans.pattern, &output.formats) {
        let message = format!(
            "[output] folder: results would lie among the scans, and [scans] pattern \"{}\" takes names such as theirs",
            scans.pattern
        );
        let help = "name another folder, or a pattern that no result has: a result that is copied or renamed there would be \
                    inspected as a scan";
        return Some(place(Diagnostic::warning(message).with_help(help)));
    }
    None
}

/// Whether files with the endings of results can match a pattern.
fn may_take_results(pattern: &str, formats: &[OutputFormat]) -> bool {
    let sequence = glob::Pattern::new(pattern).is_ok_and(|pattern| pattern.matches(sequence::FILE));
    let ending = |ending: &str| {
        let tail = pattern.rsplit_once('.').map_or(pattern, |(_, tail)| tail);
        glob::Pattern::new(tail).is_ok_and(|tail| tail.matches(ending))
    };
    sequence || ending(ending_of(OutputFormat::Json)) || formats.iter().any(|format| ending(ending_of(*format)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_told_that_may_take_results_for_scans() {
        let formats = [OutputFormat::Ascii, OutputFormat::Ply];
        for (pattern, takes) in [
            ("*.ply", true),
            ("scan_??.txt", true),
            ("*", true),
            ("*.p*", true),
            ("*.xyz", false),
            ("*.pdf", false),
            ("*.js*", true),
        ] {
            assert_eq!(may_take_results(pattern, &formats), takes, "{pattern}");
        }
    }
}
