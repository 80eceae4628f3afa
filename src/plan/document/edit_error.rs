//! Why an edit was not made, with what to do.

use std::path::PathBuf;

/// Why an edit was not made; the document is as before.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The text cannot be read as TOML.
    #[error("line {line} cannot be read, so that nothing can be changed key by key: {message}")]
    NotToml {
        /// From 1.
        line: usize,
        /// What is wrong there.
        message: String,
    },
    /// There is no such table or key in plans.
    #[error("found no setting [{table}] {key} in plans")]
    UnknownKey {
        /// The table.
        table: String,
        /// The key.
        key: String,
    },
    /// A key does not hold what it should, so that nothing can be put into it.
    #[error("{place} holds something else than {expected}")]
    WrongShape {
        /// The key.
        place: String,
        /// What it should hold.
        expected: &'static str,
    },
    /// A number that no plan can hold.
    #[error("found {0}, expected a number of ordinary size")]
    NotFinite(f64),
    /// There are fewer rows.
    #[error("found no {what} number {number}")]
    NoSuchRow {
        /// `comparison point` or `feature`.
        what: &'static str,
        /// From 1.
        number: usize,
    },
    /// Another row has the name.
    #[error("the name \"{0}\" is taken")]
    NameTaken(String),
    /// Nobody could read such a name.
    #[error("found \"{0}\", expected a name of at most 120 characters without blanks at its ends")]
    BadName(String),
    /// A slot is no comparison point.
    #[error("a slot cannot be compared as one point")]
    SlotCompared,
    /// The points stand in a file of their own.
    #[error("the comparison points stand in the file {}, not in the plan", file.display())]
    PointsInFile {
        /// As the plan names it.
        file: PathBuf,
    },
    /// That file has faults.
    #[error("{faults} faults in the comparison file {}", file.display())]
    BadPointsFile {
        /// Where it is.
        file: PathBuf,
        /// How many.
        faults: usize,
    },
    /// A table to be imported has faults.
    #[error("{0} faults in the table, nothing was imported")]
    FaultyTable(usize),
}

impl EditError {
    /// What to do.
    pub fn help(&self) -> &'static str {
        match self {
            EditError::NotToml { .. } => "mend this line in the text of the plan",
            EditError::UnknownKey { .. } => "choose one of the settings that docs/plan.md lists",
            EditError::WrongShape { .. } => "remove it in the text of the plan, or mend it there",
            EditError::NotFinite(_) => "check the number",
            EditError::NoSuchRow { .. } => "choose one that is there",
            EditError::NameTaken(_) => "choose another name",
            EditError::BadName(_) => "give it a name such as P01, without tabs and line breaks",
            EditError::SlotCompared => "compare a slot by edge points on its rim; as a datum it is a feature",
            EditError::PointsInFile { .. } => "take the points into the plan first, or edit that file",
            EditError::FaultyTable(_) => "mend the lines that are told, then import again",
            EditError::BadPointsFile { .. } => "mend what check tells of that file",
        }
    }
}
