//! What the journal holds: one line of JSON each.

use jiff::Zoned;
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::files::FileKind;
use crate::control::model::{Ending, FrameCounts, Percentiles};

/// Events of a show that are kept, and characters of each.
const MOST_EVENTS: usize = 100;
const MOST_CHARACTERS: usize = 500;
/// Characters of what was asked, and of what came of it.
const MOST_ASKED: usize = 300;

/// One thing that somebody asked.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Action {
    /// When, RFC 3339 ([`stamp`]).
    pub at: String,
    /// Who.
    pub who: String,
    /// What, in the words of the surface.
    pub what: String,
    /// What came of it: `done`, or why not.
    pub result: String,
    /// The state of the hall that it led to.
    pub state: String,
    /// How often it was asked in a row; where that is not once, all else is of the last time.
    #[serde(default = "once", skip_serializing_if = "is_once")]
    pub times: u32,
}

const fn once() -> u32 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde wants it so")]
const fn is_once(times: &u32) -> bool {
    *times == 1
}

impl Action {
    /// True if it was done.
    #[must_use]
    pub(crate) fn is_done(&self) -> bool {
        self.result == "done"
    }

    /// The same with texts no longer than are kept.
    #[must_use]
    pub(crate) fn shortened(self) -> Self {
        let Self { at, who, what, result, state, times } = self;
        let [who, what, result] = [who, what, result].map(|text| shortened(text, MOST_ASKED));
        Self { at, who, what, result, state, times }
    }
}

/// A text of at most so many characters, of which the last says that there were more.
fn shortened(text: String, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text,
        Some(_) => text.chars().take(most - 1).chain(['…']).collect(),
    }
}

/// One show: what was played, how, and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ShowRecord {
    /// When it began, RFC 3339 with milliseconds and the offset of its zone ([`stamp`]). Tells one show of a hall from the
    /// others: the record of the end has the same as that of the begin.
    pub start: String,
    /// The hall.
    pub hall: String,
    /// The id of the cue.
    pub cue: String,
    /// SHA-256 of its file, hexadecimal.
    pub sha256: String,
    /// Its title.
    pub title: Option<String>,
    /// Where it stands in the playlist; null if it was loaded by itself.
    pub playlist: Option<PlaylistPlace>,
    /// Level of the motion at the start, 0 to 1.
    pub level: f64,
    /// Level of the vibration at the start, 0 to 1.
    pub vibration: f64,
    /// Trim at the start, ms.
    pub trim_ms: i32,
    /// The effects that were not allowed at the start.
    pub effects_off: Vec<String>,
    /// Seats of the hall.
    pub seats_total: usize,
    /// Of these: enabled and answering at the start.
    pub seats_available: usize,
    /// Who started it.
    pub operator: String,
    /// True if the playlist started it: at its time, or because the entry before came to its end.
    pub scheduled: bool,
    /// True if that was outside the hours of the house.
    pub out_of_hours: bool,
    /// How it ended; null if it has not.
    pub outcome: Option<Outcome>,
}

/// The place of an entry.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct PlaylistPlace {
    /// The id of the playlist.
    pub(crate) id: String,
    /// The entry, counted from 0.
    pub(crate) entry: usize,
}

/// How a show ended, and its figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Outcome {
    /// When, RFC 3339.
    pub end: String,
    /// How.
    pub result: Ending,
    /// Faults, seats that fell out and other events, in words, in order, each with its time of the day; seats of one second and one cause are
    /// one event; at most 100 are kept.
    pub events: Vec<String>,
    /// The seats that did not take part all the time although they were enabled.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub seats_out: Vec<SeatOut>,
    /// Ticks that sent.
    pub ticks: u64,
    /// Ticks slept through.
    pub missed_ticks: u64,
    /// Its frames.
    #[serde(flatten)]
    pub frames: FrameCounts,
    /// Frames that the kernel did not take.
    pub send_failed: u64,
    /// How late ticks were.
    pub lateness: Percentiles,
    /// How long acks took.
    pub ack: Percentiles,
    /// The film that led it; null where the show was its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub film: Option<FilmProof>,
}

/// A controller that fell out of a show.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SeatOut {
    /// Its name.
    pub seat: String,
    /// How often it fell out.
    pub times: u32,
    /// How long it was out, all together, s.
    pub out_s: f64,
}

/// By which clock the seats followed a film, and how well.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FilmProof {
    /// The sources that led, in the order in which they first did.
    pub sources: Vec<String>,
    /// How often the film was led by another source than before.
    pub switches: u64,
    /// The farthest that the seats were from the film while they followed it, less the trim, ms; null if they never did.
    pub greatest_error_ms: Option<f64>,
}

/// One line of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub(super) enum Line {
    /// The program started.
    Start { at: String, version: String },
    /// Somebody asked something.
    Action(Action),
    /// A show began.
    Begin(Box<ShowRecord>),
    /// A show ended.
    Show(Box<ShowRecord>),
    /// So many lines could not be written before this one, since the program started.
    Lost { at: String, lines: u64 },
    /// Lines are sealed with another key from here on, whose public half this is.
    Key { at: String, new: String },
}

impl Line {
    /// In which files it belongs.
    pub(super) const fn kind(&self) -> FileKind {
        match self {
            Self::Action(_) => FileKind::Asked,
            _ => FileKind::Shows,
        }
    }

    /// When it happened.
    pub(super) fn at(&self) -> &str {
        match self {
            Self::Start { at, .. } | Self::Lost { at, .. } | Self::Key { at, .. } => at,
            Self::Action(action) => &action.at,
            Self::Begin(show) | Self::Show(show) => {
                show.outcome.as_ref().map_or(&show.start, |outcome| &outcome.end)
            }
        }
    }
}

impl ShowRecord {
    /// The same with no more events than are kept.
    pub(super) fn shortened(&self) -> Self {
        let mut show = self.clone();
        if let Some(Outcome { events, .. }) = &mut show.outcome {
            let more = events.len().saturating_sub(MOST_EVENTS);
            events.truncate(MOST_EVENTS);
            for event in events.iter_mut() {
                *event = shortened(std::mem::take(event), MOST_CHARACTERS);
            }
            if more > 0 {
                events.push(format!("and {more} more"));
            }
        }
        show
    }
}

/// A time as the records have it: RFC 3339 with milliseconds and the offset of its zone, as
/// `2026-11-21T19:00:03.250+01:00`.
#[must_use]
pub(crate) fn stamp(at: &Zoned) -> String {
    at.strftime("%Y-%m-%dT%H:%M:%S%.3f%:z").to_string()
}

/// The day of a time as the records have it.
pub(super) fn day_of(stamp: &str) -> Option<Date> {
    stamp.get(..10)?.parse().ok()
}
