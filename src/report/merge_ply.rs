//! The merged cloud as PLY.

use crate::geometry::LengthUnit;
use crate::io::{Numbers, write_ply_points};
use crate::run::RunContext;
use crate::stitch::Merged;
use crate::stitch::wear::Wear;
use std::io::{self, Write};

/// Writes the points, world frame, in their unit: `x y z` as double, each metric as a float column (NaN where the point's view does not know
/// it) and the int property `view`: the view's place in the order of names, -1 for a mean over several. Compared with an earlier cloud, also `difference` and `difference_u`, NaN where not measured.
///
/// # Errors
/// What `out` says, or that the job was stopped.
pub fn merge_ply(
    out: &mut impl Write,
    merged: &Merged,
    wear: Option<&Wear>,
    unit: LengthUnit,
    run: &RunContext,
) -> io::Result<()> {
    let columns = merged.columns.iter().map(|(metric, values)| (metric.key(), Numbers::Float(values.as_slice())));
    let differences = wear.into_iter().flat_map(|wear| {
        [("difference", Numbers::Float(&wear.difference)), ("difference_u", Numbers::Float(&wear.difference_u))]
    });
    let properties: Vec<(&str, Numbers)> =
        columns.chain(differences).chain([("view", Numbers::Int(&merged.view))]).collect();
    write_ply_points(&mut Stoppable { out, run }, &merged.positions, unit, &properties)
}

/// Takes bytes until the job is stopped.
struct Stoppable<'a, W> {
    out: &'a mut W,
    run: &'a RunContext<'a>,
}

impl<W: Write> Write for Stoppable<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.run.check().map_err(io::Error::other)?;
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
