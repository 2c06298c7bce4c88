//! The report of some days: every show that began on them, and what came of it.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};

use jiff::civil::Date;
use jiff::{Timestamp, ToSpan as _};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use super::chain::{Chain, ChainFindings, JournalKeys};
use super::files::FileKind;
use super::record::{Action, Line, ShowRecord, day_of};
use super::{files, read, seal};
use crate::control::model::{Ending, FrameCounts, words};
use crate::control::{Code, Problem};
use crate::sys::folder::Folder;

/// How long after its day the end of a show is looked for, days.
const LONGEST_SHOW: i32 = 2;
/// Notes that are told; of a file that is no journal there would be one for each line.
pub(super) const MOST_NOTES: usize = 20;

/// How much of some days is taken into a report; of more the newest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ReportBounds {
    /// Shows.
    pub(crate) shows: usize,
    /// What was asked.
    pub(crate) actions: usize,
}

impl ReportBounds {
    /// All that there is.
    pub(crate) const ALL: Self = Self { shows: usize::MAX, actions: usize::MAX };
}

/// The journal cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot read the journal in {}; --dir names its folder, or [log] in the configuration", path.display())]
pub(crate) struct JournalError {
    /// Its folder.
    pub(crate) path: PathBuf,
    /// What the system said.
    pub(crate) source: io::Error,
}

impl JournalReport {
    /// All that a reader should know beside the shows, in words.
    pub(crate) fn remarks(&self) -> impl Iterator<Item = String> {
        let unsealed = (self.unsealed > 0)
            .then(|| format!("{} lines were written without a seal: nothing proves by whom", self.unsealed));
        self.notes.iter().cloned().chain(unsealed).chain(self.faults.iter().cloned())
    }
}

impl From<JournalError> for Problem {
    fn from(error: JournalError) -> Self {
        Self::new(Code::File, error.to_string(), "check the folder of the journal and its disk")
    }
}

/// What was played, and what was asked, on some days.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(crate) struct JournalReport {
    /// The first day, YYYY-MM-DD.
    pub(crate) from: String,
    /// The last day, YYYY-MM-DD.
    pub(crate) to: String,
    /// The shows that began on these days, in their order.
    pub(crate) shows: Vec<ReportShown>,
    /// All of them together.
    pub(crate) totals: Totals,
    /// What was asked on these days, in its order.
    pub(crate) actions: Vec<Action>,
    /// What a reader should know of the journal itself: lines that were cut short or lost.
    pub(crate) notes: Vec<String>,
    /// Lines that are missing, and such as nobody of the hall wrote, which do not count. Where there are none, what is reported is what was
    /// written.
    pub(crate) faults: Vec<String>,
    /// Lines that were written before there were seals, and count: nothing proves by whom they were.
    pub(crate) unsealed: u64,
    /// The public keys that have sealed the lines which count.
    pub(crate) keys: Vec<String>,
}

/// One show.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(crate) struct ReportShown {
    /// What came of it.
    pub(crate) result: ShowResult,
    /// How long it took from begin to end, s; null if it has no end.
    pub(crate) took_s: Option<f64>,
    /// Its record.
    #[serde(flatten)]
    pub(crate) record: ShowRecord,
}

words! {
    /// What came of a show.
    pub(crate) ShowResult {
        /// It was played to its end.
        Completed = "completed",
        /// A person ended it.
        Stopped = "stopped",
        /// A fault ended it.
        Fault = "fault",
        /// The program or the machine ended before it did.
        Interrupted = "interrupted",
        /// It goes on.
        Running = "running",
    }
}

/// All shows together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, ToSchema)]
pub(crate) struct Totals {
    /// How many began.
    pub(crate) shows: usize,
    /// Of these: played to their end.
    pub(crate) completed: usize,
    /// Ended by a person.
    pub(crate) stopped: usize,
    /// Ended by a fault.
    pub(crate) faults: usize,
    /// Ended with the program or the machine.
    pub(crate) interrupted: usize,
    /// Going on.
    pub(crate) running: usize,
    /// From begin to end, of those that ended, s.
    pub(crate) took_s: f64,
    /// Frames of those that ended.
    #[serde(flatten)]
    pub(crate) frames: FrameCounts,
}

/// Reads the journal in `dir` for the days `from` to `to`, both included, and keeps no more of them than `most`. A show belongs to the day on which it began, by
/// the clock and the zone of the hall. One without an end was interrupted, unless it is the last and the program still runs.
///
/// # Errors
/// [`JournalError`] where the folder or a file of it cannot be read. No records are no error.
pub(crate) fn report(
    dir: &Path,
    from: Date,
    to: Date,
    most: ReportBounds,
) -> Result<JournalReport, JournalError> {
    report_by(dir, (from, to), most, JournalKeys::default())
}

/// The same of lines that one of these keys has sealed.
///
/// # Errors
/// As [`report`].
pub(crate) fn report_by(
    dir: &Path,
    (from, to): (Date, Date),
    most: ReportBounds,
    mut keys: JournalKeys,
) -> Result<JournalReport, JournalError> {
    let mut days = Days::new(from, to, most);
    let mut gather = || -> io::Result<bool> {
        let folder = Folder::open(dir)?;
        // The clock may have been set back over midnight during a show.
        let first = from.yesterday().unwrap_or(from);
        let until = to.checked_add(LONGEST_SHOW.days()).unwrap_or(Date::MAX);
        let mut notes = Vec::new();
        let all = files::all(&folder)?;
        for kind in FileKind::ALL {
            let files = || all.iter().filter(|file| file.kind == kind);
            let before = files().rfind(|file| file.day < first);
            let before = before.map(|file| seal::last_of(&folder, *file)).transpose()?.flatten();
            let mut chain = Chain::new(kind, keys.clone(), before);
            for file in files().filter(|file| (first..=until).contains(&file.day)) {
                read::each(&folder, *file, &mut notes, |json, line, place| {
                    let counts = chain.take(json, line.as_ref(), place);
                    line.filter(|_| counts).into_iter().for_each(|line| days.take(line));
                })?;
            }
            let findings = chain.close();
            // Only what is about shows says that there is a new key.
            keys.learn(&findings.keys);
            days.find(findings);
        }
        days.note(notes);
        Ok(folder.is_claimed())
    };
    let runs = gather().map_err(|source| JournalError { path: dir.to_owned(), source })?;
    Ok(days.report(runs))
}

/// The same of what the journals of a hall told elsewhere, each in its order, and of what was found of their chains: where it has two show
/// machines, the start of one ends what the other one played. What is no line is noted.
pub(crate) fn report_of(
    journals: impl IntoIterator<Item = Vec<Value>>,
    found: ChainFindings,
    from: Date,
    to: Date,
) -> JournalReport {
    let mut days = Days::new(from, to, ReportBounds::ALL);
    days.find(found);
    let mut read = |line| match serde_json::from_value(line) {
        Ok(line) => Some(line),
        Err(error) => {
            days.notes.push(format!("a record is of another version, skipped: {error}"));
            None
        }
    };
    let mut journals: Vec<VecDeque<Line>> =
        journals.into_iter().map(|lines| lines.into_iter().filter_map(&mut read).collect()).collect();
    let next_at = |lines: &VecDeque<Line>| lines.front()?.at().parse::<Timestamp>().ok();
    while let Some(journal) =
        journals.iter_mut().filter(|lines| !lines.is_empty()).min_by_key(|lines| next_at(lines))
    {
        journal.pop_front().into_iter().for_each(|line| days.take(line));
    }
    days.report(true)
}

/// What has been read so far.
pub(super) struct Days {
    from: Date,
    to: Date,
    most: ReportBounds,
    shows: VecDeque<Open>,
    actions: VecDeque<Action>,
    /// What was left out: shows, and what was asked.
    more: (usize, usize),
    notes: Vec<String>,
    found: ChainFindings,
}

/// A show, and whether its begin was followed by a start of the program.
struct Open {
    record: ShowRecord,
    outlived: bool,
}

impl Days {
    pub(super) fn new(from: Date, to: Date, most: ReportBounds) -> Self {
        let (shows, actions) = (VecDeque::new(), VecDeque::new());
        let (notes, found) = (Vec::new(), ChainFindings::default());
        Self { from, to, most, shows, actions, more: (0, 0), notes, found }
    }

    /// What became of a chain.
    pub(super) fn find(&mut self, findings: ChainFindings) {
        self.found.add(findings);
    }

    /// What a reader should know of the journal itself.
    pub(super) fn note(&mut self, mut notes: Vec<String>) {
        self.notes.append(&mut notes);
    }

    pub(super) fn take(&mut self, line: Line) {
        let (from, to) = (self.from, self.to);
        let within = |at: &str| day_of(at).is_some_and(|day| (from..=to).contains(&day));
        match line {
            Line::Start { .. } => self.shows.iter_mut().for_each(|open| open.outlived = true),
            Line::Action(action) if within(&action.at) => {
                // What older versions wrote has no bound of its own.
                self.actions.push_back(action.shortened());
                self.more.1 += keep(&mut self.actions, self.most.actions);
            }
            Line::Begin(record) | Line::Show(record) if within(&record.start) => self.show(*record),
            Line::Lost { at, lines } if within(&at) => {
                self.notes.push(format!("at {at}: {lines} lines had been lost since the program started"));
            }
            _ => {}
        }
    }

    /// The end of a show that has begun, or another show.
    fn show(&mut self, record: ShowRecord) {
        let record = record.shortened();
        let same = |open: &&mut Open| open.record.start == record.start && open.record.hall == record.hall;
        match self.shows.iter_mut().rev().find(same) {
            Some(open) => open.record = record,
            None => {
                self.shows.push_back(Open { record, outlived: false });
                self.more.0 += keep(&mut self.shows, self.most.shows);
            }
        }
    }

    pub(super) fn report(self, runs: bool) -> JournalReport {
        let Self { from, to, shows, actions, more: left_out, mut notes, found, .. } = self;
        let last = shows.len();
        let shows: Vec<_> = shows
            .into_iter()
            .enumerate()
            .map(|(index, open)| open.shown(runs && index + 1 == last))
            .collect();
        bound(&mut notes);
        for (more, what) in [(left_out.0, "shows"), (left_out.1, "commands")] {
            let words = format!("{more} earlier {what} are left out; `kinocue report` has them");
            notes.extend((more > 0).then_some(words));
        }
        let (totals, actions) = (Totals::of(&shows), actions.into());
        let (mut faults, unsealed) = (found.faults, found.unsealed);
        bound(&mut faults);
        let keys = found.keys.into_iter().collect();
        JournalReport {
            from: from.to_string(),
            to: to.to_string(),
            shows,
            totals,
            actions,
            notes,
            faults,
            unsealed,
            keys,
        }
    }
}

/// Leaves as many notes as a person reads.
fn bound(notes: &mut Vec<String>) {
    let more = notes.len().saturating_sub(MOST_NOTES);
    notes.truncate(MOST_NOTES);
    notes.extend((more > 0).then(|| format!("and {more} more")));
}

/// Leaves the newest of them; says how many went.
fn keep<T>(all: &mut VecDeque<T>, most: usize) -> usize {
    all.drain(..all.len().saturating_sub(most)).count()
}

impl Open {
    fn shown(self, may_run: bool) -> ReportShown {
        let Self { record, outlived } = self;
        let result = match &record.outcome {
            Some(outcome) => match outcome.result {
                Ending::Completed => ShowResult::Completed,
                // No show of a hall ends so: its loss policy ends it before.
                Ending::Stopped | Ending::Lost => ShowResult::Stopped,
                Ending::Fault => ShowResult::Fault,
            },
            None if may_run && !outlived => ShowResult::Running,
            None => ShowResult::Interrupted,
        };
        let took_s = record.outcome.as_ref().and_then(|outcome| {
            let (start, end): (Timestamp, Timestamp) =
                (record.start.parse().ok()?, outcome.end.parse().ok()?);
            Some(end.duration_since(start).as_secs_f64())
        });
        ReportShown { result, took_s, record }
    }
}

impl Totals {
    fn of(shows: &[ReportShown]) -> Self {
        let outcomes = shows.iter().filter_map(|show| show.record.outcome.as_ref());
        let frames = outcomes.map(|outcome| outcome.frames).sum();
        let mut totals = Self { shows: shows.len(), frames, ..Self::default() };
        for show in shows {
            let count = match show.result {
                ShowResult::Completed => &mut totals.completed,
                ShowResult::Stopped => &mut totals.stopped,
                ShowResult::Fault => &mut totals.faults,
                ShowResult::Interrupted => &mut totals.interrupted,
                ShowResult::Running => &mut totals.running,
            };
            *count += 1;
            totals.took_s += show.took_s.unwrap_or(0.0);
        }
        totals
    }
}
