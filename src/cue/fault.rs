//! What is wrong with a cue file, and where: the first twenty faults and how many more there are.

use std::fmt;
use std::path::{Path, PathBuf};

use super::limits::{MAX_EFFECTS, MAX_FILE, MAX_LINE, MAX_MARKERS, MAX_ROWS, MAX_TIME};
use super::limits::{MAX_VIBRATION_HZ, MIN_VIBRATION_HZ};
use crate::motion::MAX_AXES;
use crate::time::ShowTime;

/// How many faults of a file are told; the rest is counted.
pub const FAULTS_TOLD: usize = 20;

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
    /// An octet of a file without lines, counted from 0.
    Octet(u64),
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
            Self::Octet(octet) => write!(f, " octet {octet}: "),
        }
    }
}

/// One thing that is wrong with a cue.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// Where it stands.
    pub place: Place,
    /// The name of the column or field, where it is about one.
    pub column: Option<String>,
    /// What is wrong.
    pub problem: Problem,
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

/// What can be wrong with a cue: the value met, the limit, and what to do where that is not plain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// There is no such file.
    #[error("no such file")]
    Missing,
    /// A folder stands where a file belongs.
    #[error("is a folder, not a cue file")]
    Folder,
    /// The system would not let the file be opened.
    #[error("cannot be opened: {0}")]
    Unopened(String),
    /// Reading failed midway.
    #[error("reading failed: {0}")]
    Unread(String),
    /// The file, or what it unpacks to, is too large.
    #[error("holds over {MAX_FILE} octets, the most that is read")]
    FileTooLarge,
    /// A line, or a message, is too long.
    #[error("over {MAX_LINE} octets long, the most that is read")]
    TooLong,
    /// There are too many rows.
    #[error("over {MAX_ROWS} rows, the most that a cue may have")]
    TooManyRows,
    /// There is nothing in the file.
    #[error("is empty; a cue needs at least two rows")]
    Empty,
    /// There are too few rows to play.
    #[error("{0} of the two rows that a cue needs at least")]
    TooFewRows(usize),
    /// Octets that are no text.
    #[error("not UTF-8 text")]
    NotUtf8,
    /// A carriage return that ends no line.
    #[error("a carriage return within a line; lines end in LF or CRLF")]
    CarriageReturn,
    /// A quote was opened in a line and not closed.
    #[error("a quote that is not closed in its line")]
    OpenQuote,
    /// A comment line after the header.
    #[error("a comment among the rows; comments stand before the header row")]
    CommentAmongRows,
    /// A declaration with a value that it cannot have.
    #[error("{value:?} is not known; {allowed}")]
    Declaration {
        /// What the file says.
        value: String,
        /// What it could say.
        allowed: String,
    },
    /// A declaration that was made before.
    #[error("declared twice")]
    DeclaredTwice,
    /// A column or field that means nothing to us.
    #[error("unknown column; {0}")]
    UnknownColumn(&'static str),
    /// A column that was there before.
    #[error("the column stands twice")]
    ColumnTwice,
    /// A column that must be there is not.
    #[error("the column is missing")]
    MissingColumn,
    /// More effects than are kept.
    #[error("over {MAX_EFFECTS} effects, the most that a cue may name")]
    TooManyEffects,
    /// An effect's name with other characters than it may have.
    #[error("an effect's name is made of a to z, 0 to 9 and _")]
    EffectName,
    /// The raw output word beside named effects.
    #[error("the raw output word and named effects exclude each other")]
    WordAndEffects,
    /// A row with too few or too many cells.
    #[error("the row ends after {cells} of {columns} cells")]
    RowTooShort {
        /// Cells in the row.
        cells: usize,
        /// Columns in the header.
        columns: usize,
    },
    /// A row with too many cells.
    #[error("the row has {cells} cells, the header {columns}")]
    RowTooLong {
        /// Cells in the row.
        cells: usize,
        /// Columns in the header.
        columns: usize,
    },
    /// An empty cell that has nothing before it to hold.
    #[error("is empty, and there is no value before it to hold")]
    NothingToHold,
    /// An empty cell where each row needs its own value.
    #[error("is empty; every row needs one")]
    EmptyCell,
    /// Text where a number belongs.
    #[error("{0:?} is not a number")]
    NotANumber(String),
    /// NaN, infinity, or a number too large for one.
    #[error("{0} is not a finite number")]
    NotFinite(String),
    /// The cue does not begin at its beginning.
    #[error("the first time is {0} and must be 0")]
    TimeNotZero(String),
    /// Time that stands still or goes back.
    #[error("{time} does not come after {before}, the time before it")]
    TimeNotIncreasing {
        /// The time met, as written.
        time: String,
        /// The one before it.
        before: ShowTime,
    },
    /// A message with an earlier log time than the one before it in its topic.
    #[error("comes {early_ns} ns before the message before it")]
    TimeGoesBack {
        /// By how much.
        early_ns: u64,
    },
    /// A time beyond what a cue may last.
    #[error("{0} lies after {MAX_TIME}, the latest time of a cue")]
    TimeTooLate(String),
    /// A duration that is none.
    #[error("a row's duration of {0} is not above 0")]
    NoDuration(String),
    /// A position outside the stroke.
    #[error("{value} is outside the stroke, 0 to {high}{unit}")]
    OutsideStroke {
        /// The position as the file has it.
        value: f64,
        /// The upper end, in the same unit.
        high: f64,
        /// The unit's name with a space before it; nothing for fractions.
        unit: &'static str,
    },
    /// The curve between two points leaves the stroke by more than may be held back.
    #[error(
        "the curve reaches {value:.4} at {at}, outside the stroke, 0 to {high}{unit}, by more than 0.001 of it; \
         add points there, or take interpolation monotone"
    )]
    CurveOutsideStroke {
        /// The worst value of the curve there.
        value: f64,
        /// When it is reached.
        at: ShowTime,
        /// The upper end, in the same unit.
        high: f64,
        /// The unit's name with a space before it; nothing for fractions.
        unit: &'static str,
    },
    /// A vibration frequency that no frame can carry.
    #[error("{0} Hz is neither 0 nor within {MIN_VIBRATION_HZ} to {MAX_VIBRATION_HZ} Hz")]
    Frequency(f64),
    /// An amplitude that is negative or longer than the stroke.
    #[error("an amplitude of {value} is outside 0 to {high}{unit}")]
    Amplitude {
        /// The amplitude as the file has it.
        value: f64,
        /// The greatest one, in the same unit.
        high: f64,
        /// The unit's name with a space before it; nothing for fractions.
        unit: &'static str,
    },
    /// An effect that is neither on nor off.
    #[error("{0:?} is neither 0 nor 1")]
    Switch(String),
    /// A raw output word that is none.
    #[error("{0:?} is no output word; 0 to 65535, or 0x0 to 0xffff")]
    Word(String),
    /// Octets that do not fill whole rows.
    #[error("{octets} octets are no whole rows of {axes} axes")]
    PartOfARow {
        /// Octets in the file.
        octets: usize,
        /// Octets of a row.
        axes: usize,
    },
    /// A number of axes that no cue has.
    #[error("{0} axes; a cue has 1 to {MAX_AXES}")]
    Axes(usize),
    /// A rate that rows cannot have.
    #[error("a rate of {0} Hz; it must be above 0 and at most 1000000 Hz")]
    Rate(f64),
    /// A file that is no MCAP cue at all.
    #[error("not an MCAP cue: {0}")]
    Foreign(String),
    /// An MCAP file that ends too early.
    #[error("the file is cut short; `kinocue convert --recover` saves the complete messages before the cut")]
    CutShort,
    /// An MCAP file that is broken inside.
    #[error("damaged: {0}; `kinocue convert --recover` saves the complete messages before the damage")]
    Damaged(String),
    /// A topic below `/cue/` that we do not know.
    #[error("unknown topic {0:?}; a cue has /cue/axes, /cue/vibration, /cue/io and /cue/marker")]
    UnknownTopic(String),
    /// A message that is not what its topic carries.
    #[error("not the JSON of its topic: {0}")]
    Message(String),
    /// A message with another number of axes than the first.
    #[error("{here} axes where the first message has {first}")]
    AxesChange {
        /// Axes in this message.
        here: usize,
        /// Axes in the first message.
        first: usize,
    },
    /// A vibration of an axis that has no positions.
    #[error("the cue has no axis {axis}; its axes are 1 to {axes}")]
    NoSuchAxis {
        /// The axis, from 1.
        axis: usize,
        /// Axes of the cue.
        axes: usize,
    },
    /// More markers than are kept.
    #[error("over {MAX_MARKERS} markers, the most that a cue may have")]
    TooManyMarkers,
}

/// Which kind of trouble a file makes, for the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultClass {
    /// Missing, a folder, or not to be opened.
    NoInput,
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
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The first faults, [`FAULTS_TOLD`] at most, in the order they were met.
    #[must_use]
    pub fn told(&self) -> &[Fault] {
        &self.told
    }

    /// How many faults there are beyond those told.
    #[must_use]
    pub const fn more(&self) -> u64 {
        self.more
    }

    /// Whether there was no file to read, reading failed, or what was read is wrong.
    #[must_use]
    pub fn class(&self) -> FaultClass {
        match self.told.first().map(|fault| &fault.problem) {
            Some(Problem::Missing | Problem::Folder | Problem::Unopened(_)) => FaultClass::NoInput,
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
        for (i, fault) in self.told.iter().enumerate() {
            let line_end = if i == 0 { "" } else { "\n" };
            write!(f, "{line_end}{}:{fault}", self.path.display())?;
        }
        if self.more > 0 {
            write!(f, "\n{}: and {} more", self.path.display(), self.more)?;
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
            self.told.push(Fault { place, column: column.map(str::to_owned), problem });
        }
    }

    /// Whether further faults are only counted.
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

    /// `value` where no fault was met, else the faults of the file at `path`.
    pub(crate) fn finish<T>(self, path: &Path, value: T) -> Result<T, CueFaults> {
        match self.into_faults(path) {
            Some(faults) => Err(faults),
            None => Ok(value),
        }
    }

    pub(crate) fn into_faults(self, path: &Path) -> Option<CueFaults> {
        (!self.told.is_empty()).then(|| CueFaults { path: path.to_owned(), told: self.told, more: self.more })
    }
}
