//! What can be wrong with a cue, in words.

use super::limits::{
    MAX_EFFECTS, MAX_FILE, MAX_LINE, MAX_MARKER_NAME, MAX_MARKERS, MAX_ROWS, MAX_TIME, MAX_VIBRATION_HZ,
    MIN_VIBRATION_HZ,
};
use crate::motion::MAX_AXES;
use crate::time::ShowTime;

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
    /// Something else than a cue.
    #[error("is {0}; a cue is a CSV or MCAP file")]
    OtherKind(&'static str),
    /// The file may not be read.
    #[error("may not be read: change its owner or its mode")]
    Denied,
    /// The system would not let the file be opened.
    #[error("cannot be opened: {0}")]
    Unopened(String),
    /// Reading failed midway.
    #[error("reading failed: {0}")]
    Unread(String),
    /// The file, or what it unpacks to, is too large.
    #[error("has more than {MAX_FILE} bytes, the limit of a cue file")]
    FileTooLarge,
    /// A line, or a message, is too long.
    #[error("longer than {MAX_LINE} bytes, the limit")]
    TooLong,
    /// There are too many rows.
    #[error("more than {MAX_ROWS} rows, the limit of a cue")]
    TooManyRows,
    /// There is nothing in the file.
    #[error("is empty; a cue needs at least two rows")]
    Empty,
    /// There are too few rows to play.
    #[error("number of rows: {0}; a cue needs at least two")]
    TooFewRows(usize),
    /// Bytes that are no text.
    #[error("not UTF-8 text; save it as UTF-8")]
    NotUtf8,
    /// A carriage return that ends no line.
    #[error("a carriage return within a line; lines end in LF or CRLF")]
    CarriageReturn,
    /// A quote was opened in a line and not closed.
    #[error("a quote that is not closed in its line")]
    OpenQuote,
    /// A comment line after the header.
    #[error("a comment among the rows; put comments before the header row")]
    CommentAmongRows,
    /// A declaration with a value that it cannot have.
    #[error("{value:?} is not known; {allowed}")]
    Declaration {
        /// What the file says.
        value: String,
        /// What it could say.
        allowed: String,
    },
    /// A comment that looks like a declaration and is none.
    #[error("{comment:?} declares nothing; write {write}")]
    NearlyDeclared {
        /// The comment.
        comment: String,
        /// What it could be.
        write: String,
    },
    /// A key of the metadata that is nearly one that is known.
    #[error("unknown key; write {0}")]
    NearKey(&'static str),
    /// A declaration that was made before.
    #[error("declared twice")]
    DeclaredTwice,
    /// A column or field that means nothing to us.
    #[error("unknown column; {0}")]
    UnknownColumn(&'static str),
    /// A column before that of the time.
    #[error(
        "the first column is time_ms or time_s; leave the one before it out, as with index=False in pandas or row.names = FALSE in R"
    )]
    BeforeTheTime,
    /// A column that has no name, and others behind it.
    #[error("a column without a name; give it one, or leave it out")]
    NoName,
    /// Columns that something else than commas separates.
    #[error(
        "the columns are separated by {0}, not by commas; `kinocue convert --from csv {1} OUT.csv` makes a cue of it"
    )]
    Separator(String, String),
    /// A number whose only mark may part thousands.
    #[error(
        "{0:?} may be a whole number or a broken one, and no other number of the file shows which; save it without marks between thousands, or \
         with another number of decimals"
    )]
    MaybeThousands(String),
    /// A number with a comma and a point.
    #[error("{0:?} has a mark between thousands; save it without")]
    Thousands(String),
    /// Numbers with commas beside such with points.
    #[error(
        "{here:?} beside {there:?} on line {line}: one has a comma and one a point; save it with one of the two, and without marks between thousands"
    )]
    TwoMarks {
        /// The number met.
        here: String,
        /// One before it.
        there: String,
        /// The line of that.
        line: u64,
    },
    /// A column that was there before.
    #[error("the column occurs twice")]
    ColumnTwice,
    /// A column that must be there is not.
    #[error("the column is missing")]
    MissingColumn,
    /// More effects than are kept.
    #[error("more than {MAX_EFFECTS} effects, the limit of a cue")]
    TooManyEffects,
    /// An effect's name with other characters than it may have.
    #[error("an effect's name may only have a to z, 0 to 9 and _")]
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
    #[error("is empty, with no value before it to hold")]
    NothingToHold,
    /// An empty cell where each row needs its own value.
    #[error("is empty; every row needs one")]
    EmptyCell,
    /// Text where a number belongs.
    #[error("{0:?} is not a number{more}", more = with_point(.0))]
    NotANumber(String),
    /// NaN, infinity, or a number too large for one.
    #[error("{0} is not a finite number")]
    NotFinite(String),
    /// The cue does not begin at its beginning.
    #[error("the first time is {0} and must be 0")]
    TimeNotZero(String),
    /// Time that stands still or goes back.
    #[error("{time} is not after {before}, the time before it")]
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
    #[error("{0} is after {MAX_TIME}, the latest time of a cue")]
    TimeTooLate(String),
    /// A duration that is none.
    #[error("a row's duration of {0} is not above 0")]
    NoDuration(String),
    /// A position outside the stroke.
    #[error("{value} is outside the stroke, {low} to {high}{unit}{}", in_what(*value, *high, unit))]
    OutsideStroke {
        /// The position as the file has it.
        value: f64,
        /// The lower end, in the same unit.
        low: f64,
        /// The upper end, in the same unit.
        high: f64,
        /// The unit's name with a space before it; nothing for fractions.
        unit: &'static str,
    },
    /// A unit that the axis is not measured in.
    #[error(
        "is in {unit}, and this axis of seat {seat} is measured in {wanted}; give it in {wanted}, fraction or percent"
    )]
    OtherUnit {
        /// The unit of the file.
        unit: &'static str,
        /// The seat type.
        seat: String,
        /// The unit of the axis.
        wanted: &'static str,
    },
    /// A position that no seat could take, whatever its stroke.
    #[error("{value} is outside {low} to {high}{unit}, where no seat can go")]
    NoPosition {
        /// The position as the file has it.
        value: f64,
        /// The least one that is taken, in the same unit.
        low: f64,
        /// The greatest one that is taken, in the same unit.
        high: f64,
        /// The unit's name with a space before it.
        unit: &'static str,
    },
    /// The curve between two points leaves the stroke by more than may be held back.
    #[error(
        "the curve reaches {value:.4} at {at}, outside the stroke, {low} to {high}{unit}, by more than 0.001 of it; \
         add points there, or write \"# interpolation: monotone\" above the header"
    )]
    CurveOutsideStroke {
        /// The worst value of the curve there.
        value: f64,
        /// When it is reached.
        at: ShowTime,
        /// The lower end, in the same unit.
        low: f64,
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
    /// A level of an output that is none.
    #[error("a level of {0} is outside 0 to 1, the full range of the output")]
    Level(f64),
    /// Values that must not stand together.
    #[error("{0}")]
    Refused(&'static str),
    /// An effect that is neither on nor off.
    #[error("{0:?} is neither 0 nor 1")]
    Switch(String),
    /// A raw output word that is none.
    #[error("{0:?} is not an output word; 0 to 4095, or 0x0 to 0xfff, for Y01 to Y12")]
    Word(String),
    /// Bytes that do not fill whole rows.
    #[error("{bytes} bytes are not whole rows of {axes} axes")]
    PartOfARow {
        /// Bytes in the file.
        bytes: usize,
        /// Bytes of a row.
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
    #[error("unknown topic {name:?}; a cue has {known}")]
    UnknownTopic {
        /// What the file calls it.
        name: String,
        /// Those that there are.
        known: String,
    },
    /// A message that is not what its topic carries.
    #[error("not the JSON of its topic: {0}")]
    Message(String),
    /// A message with another number of axes than the first.
    #[error("{here} axes, but the first message has {first}")]
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
    #[error("more than {MAX_MARKERS} markers, the limit of a cue")]
    TooManyMarkers,
    /// A marker that no instant of the cue has.
    #[error("a marker at {0} is outside the cue, which is {1} long")]
    MarkerOutside(ShowTime, ShowTime),
    /// A marker's name that is too long.
    #[error("a marker's name of {0} bytes; the limit is {MAX_MARKER_NAME}")]
    MarkerName(usize),
}

/// What to write instead of a number with a comma.
fn with_point(text: &str) -> String {
    let (point, whole) = (text.replace(',', "."), text.replace(',', ""));
    match (point.parse::<f64>(), whole.parse::<f64>()) {
        _ if point == text => String::new(),
        (Ok(_), Ok(_)) if may_part_thousands(text, ',') => {
            format!("; write {point}, or {whole} if the comma parts thousands")
        }
        (Ok(_), _) => format!("; write {point}"),
        (Err(_), Ok(_)) if may_part_thousands(text, ',') => format!("; write {whole}"),
        _ => String::new(),
    }
}

/// True if that mark may part the thousands of a number: up to three digits, the first above 0, then three behind each mark.
pub(super) fn may_part_thousands(text: &str, mark: char) -> bool {
    let mut groups = text.trim_start_matches(['-', '+']).split(mark);
    let are_digits = |group: &str| group.bytes().all(|byte| byte.is_ascii_digit());
    let is_first =
        |group: &str| (1..=3).contains(&group.len()) && !group.starts_with('0') && are_digits(group);
    let first = groups.next().is_some_and(is_first);
    first && text.contains(mark) && groups.all(|group| group.len() == 3 && are_digits(group))
}

/// What a file has to say whose numbers can be no fractions.
fn in_what(value: f64, high: f64, unit: &str) -> &'static str {
    if unit.is_empty() && value > 5.0 * high {
        "; if it is in percent or mm, write \"# units: percent\" or \"# units: mm\" above the header"
    } else {
        ""
    }
}
