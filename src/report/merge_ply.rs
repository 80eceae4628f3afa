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

/// The unit of a cloud that [`merge_ply`] has written, by the first bytes of its file; nothing of any other file.
pub fn merged_unit(start: &[u8]) -> Option<LengthUnit> {
    let start = &start[..start.len().min(MOST_HEADER)];
    let end = start.windows(END.len()).position(|bytes| bytes == END)?;
    let header = std::str::from_utf8(&start[..end]).ok()?;
    let mut lines = header.lines();
    let is_ply = lines.next() == Some("ply") && lines.next() == Some("format binary_little_endian 1.0");
    let key = lines.next()?.strip_prefix("comment lengths in ")?;
    let is_merged =
        lines.clone().any(|line| line == "property double x") && lines.next_back() == Some("property int view");
    const UNITS: [LengthUnit; 5] = [LengthUnit::Mm, LengthUnit::Cm, LengthUnit::M, LengthUnit::Inch, LengthUnit::Um];
    UNITS.into_iter().find(|unit| unit.key() == key).filter(|_| is_ply && is_merged)
}

const END: &[u8] = b"end_header\n";
/// A header of ours with every metric is about a tenth of it.
const MOST_HEADER: usize = 4096;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use crate::stitch::Metric;
    use std::collections::BTreeMap;

    #[test]
    fn a_merged_cloud_is_known_by_its_header() {
        let merged = Merged {
            positions: vec![Point3::origin()],
            columns: BTreeMap::from([(Metric::CalibrationDistance, vec![1.0])]),
            view: vec![3],
            d_s: 1.0,
            points_in: 1,
            warnings: Vec::new(),
        };
        let mut bytes = Vec::new();
        merge_ply(&mut bytes, &merged, None, LengthUnit::Inch, &RunContext::silent()).unwrap();
        assert_eq!(merged_unit(&bytes), Some(LengthUnit::Inch));
        assert_eq!(merged_unit(&bytes[..60]), None);
        // A view of this program's: nothing of where its points come from.
        let mut view = Vec::new();
        write_ply_points(&mut view, &merged.positions, LengthUnit::Inch, &[("d_cal", Numbers::Float(&[1.0]))]).unwrap();
        assert_eq!(merged_unit(&view), None);
    }
}
