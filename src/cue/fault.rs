//! What is wrong with a cue file, and where: the first twenty faults and how many more there are.

use std::fmt;
use std::path::{Path, PathBuf};

use super::problem::Problem;
use crate::plain;

/// How many faults of a file are told; the rest is counted.
pub(crate) const FAULTS_TOLD: usize = 20;
/// How much of a column's name is told, bytes.
const NAME_TOLD: usize = 80;

/// Where in a cue something stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A character of a text file; both counted from 1, as an editor does.
    Text {
        /// The line.
        line: u64,
        /// The character in the line.
        column: u64,
    },
    /// A message of an MCAP file.
    Message {
        /// Its topic.
        topic: &'static str,
        /// Which one of its topic, from 1.
        number: u64,
        /// Its log time, ns.
        log_time: u64,
    },
    /// A byte of a file without lines, counted from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    /// To be put between the file's name with a colon, and what is said of the place.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => write!(f, " "),
            Self::Text { line, column } => write!(f, "{line}:{column}: "),
            Self::Message { topic, number, log_time } => {
                write!(f, " {topic} message {number}, log_time {log_time} ns: ")
            }
            Self::Byte(byte) => write!(f, " byte {byte}: "),
        }
    }
}

/// One thing that is wrong with a cue.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    /// Where it stands.
    pub(crate) place: Place,
    /// The name of the column or field, where it is about one.
    pub(crate) column: Option<String>,
    /// What is wrong.
    pub(crate) problem: Problem,
}

impl fmt::Display for Fault {
    /// The place and the problem, to be put behind the file's name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.column {
            Some(column) => write!(f, "{}{column}: {}", self.place, self.problem),
            None => write!(f, "{}{}", self.place, self.problem),
        }
    }
}

/// Which kind of trouble a file makes, for the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FaultClass {
    /// Missing, a folder, or not to be opened.
    NoInput,
    /// The system does not allow it to be read.
    Denied,
    /// Reading failed midway.
    Io,
    /// The content is wrong.
    BadCue,
}

/// Every fault of one cue file, of which the first [`FAULTS_TOLD`] are kept; there is at least one.
#[derive(Debug, Clone, PartialEq)]
pub struct CueFaults {
    path: PathBuf,
    told: Vec<Fault>,
    more: u64,
}

impl CueFaults {
    /// The file.
    #[must_use]
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The first faults, [`FAULTS_TOLD`] at most, in the order they were met.
    #[must_use]
    pub(crate) fn told(&self) -> &[Fault] {
        &self.told
    }

    /// How many faults there are beyond those told.
    #[must_use]
    pub(crate) const fn more(&self) -> u64 {
        self.more
    }

    /// True if there was no file to read, reading failed, or what was read is wrong.
    #[must_use]
    pub(crate) fn class(&self) -> FaultClass {
        match self.told.first().map(|fault| &fault.problem) {
            Some(Problem::Missing | Problem::Folder | Problem::Unopened(_)) => FaultClass::NoInput,
            Some(Problem::Denied) => FaultClass::Denied,
            Some(Problem::Unread(_)) => FaultClass::Io,
            _ => FaultClass::BadCue,
        }
    }

    pub(super) fn one(path: &Path, problem: Problem) -> Self {
        let fault = Fault { place: Place::File, column: None, problem };
        Self { path: path.to_owned(), told: vec![fault], more: 0 }
    }
}

impl fmt::Display for CueFaults {
    /// One fault a line, as `file:line:column: column name: value and limit`, and how many more there are.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = plain::path(&self.path);
        for (i, fault) in self.told.iter().enumerate() {
            let line_end = if i == 0 { "" } else { "\n" };
            write!(f, "{line_end}{path}:{fault}")?;
        }
        if self.more > 0 {
            write!(f, "\n{path}: and {} more", self.more)?;
        }
        Ok(())
    }
}

impl std::error::Error for CueFaults {}

/// Gathers faults while a file is read.
#[derive(Debug, Default)]
pub(crate) struct Collector {
    told: Vec<Fault>,
    more: u64,
}

impl Collector {
    pub(crate) fn add(&mut self, place: Place, column: Option<&str>, problem: Problem) {
        if self.is_full() {
            self.count();
        } else {
            let column = column
                .filter(|name| !name.is_empty())
                .map(|name| plain::escaped(&plain::seen(name), NAME_TOLD).into_owned());
            self.told.push(Fault { place, column, problem });
        }
    }

    /// True if further faults are only counted.
    pub(crate) fn is_full(&self) -> bool {
        self.told.len() == FAULTS_TOLD
    }

    /// Counts a fault that will not be told.
    pub(crate) fn count(&mut self) {
        self.more += 1;
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.told.is_empty()
    }

    /// The faults of the file at `path`; this one where none was met.
    pub(crate) fn or(self, path: &Path, problem: Problem) -> CueFaults {
        self.into_faults(path).unwrap_or_else(|| CueFaults::one(path, problem))
    }

    /// The faults of the file at `path`, where any were met.
    pub(crate) fn into_faults(self, path: &Path) -> Option<CueFaults> {
        (!self.told.is_empty()).then(|| CueFaults { path: path.to_owned(), told: self.told, more: self.more })
    }
}
