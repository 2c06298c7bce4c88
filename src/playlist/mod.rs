//! Playlists: the cues of a day in order, each with its levels, and when it starts. From TOML to checked entries, and from
//! the wall clock to what is due. Control plane; the schedule is pure; the time is an argument.
//!
//! A schedule starts nothing by itself: it only reports what is due. The supervisor starts it, and only while a person
//! has armed the hall.

mod brought;
mod check;
mod parse;
mod schedule;
mod shelf;
#[cfg(test)]
mod tests;

pub(crate) use brought::{WishedText, theirs};
pub(crate) use schedule::{Schedule, local, next_start, start_after};
pub(crate) use shelf::PlaylistInfo;
pub use shelf::Shelf;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use jiff::civil::{Time, Weekday};
use jiff::tz::TimeZone;

use crate::config::{Config, Preset};
use crate::control::LevelsChange;
pub(crate) use crate::control::Then;
use crate::film::timecode::Label;
use crate::library::{CueId, Id};
use crate::time::ShowTime;

/// The name of a playlist.
pub(crate) type PlaylistId = Id;

/// The cues of a day.
#[derive(Debug, Clone, PartialEq)]
pub struct Playlist {
    /// Its file.
    pub(crate) path: PathBuf,
    /// Its title.
    pub(crate) title: String,
    /// The zone of its times; none for that of the machine.
    pub(crate) timezone: Option<TimeZone>,
    /// Its entries, at least one.
    pub(crate) entries: Vec<Entry>,
}

/// One cue of a playlist, and how it is played. What it does not name stays as the hall has it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    /// The cue.
    pub(crate) cue: CueId,
    /// The preset that is set before all else.
    pub(crate) preset: Option<String>,
    /// Level of the motion, 0 to 1.
    pub(crate) level: Option<f64>,
    /// Level of the vibration, 0 to 1.
    pub(crate) vibration: Option<f64>,
    /// How much later than the film the motion is, ms, -500 to 500.
    pub(crate) trim_ms: Option<i32>,
    /// The film that it is played to.
    pub(crate) film: EntryFilm,
    /// True if an effect may be on, by its name.
    pub(crate) effects: BTreeMap<String, bool>,
    /// What follows its end.
    pub(crate) then: Then,
    /// When it starts by the wall clock; `None` if a person starts it, or the entry before goes on to it.
    pub(crate) at: Option<At>,
    /// What whoever runs the show is told of it.
    pub(crate) note: Option<String>,
    /// Where the file says what has to be looked up elsewhere.
    pub(crate) places: EntryPlaces,
}

/// The film of an entry.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct EntryFilm {
    /// Its timecode when the cue begins; `None` if the hall's configuration says it, or no film leads.
    pub(crate) begin: Option<Label>,
    /// Its file in the folder of films, where the hall's own player shows it.
    pub(crate) movie: Option<String>,
}

impl EntryFilm {
    /// Where the film that leads it is when the cue begins; `None` if none does.
    ///
    /// # Errors
    /// Why the hall has no such film, for a person.
    pub(crate) fn begins(&self, config: &Config) -> Result<Option<ShowTime>, String> {
        let Some(sync) = &config.sync else {
            let why = |label| format!("film = \"{label}\", but the configuration has no [sync]");
            return self.begin.map_or(Ok(None), |label| Err(why(label)));
        };
        if self.movie.is_some() && config.film.is_some() {
            return Ok(Some(sync.offset));
        }
        sync.begin(self.begin)
    }
}

/// A time of day, on some days of the week.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct At {
    /// The time of day.
    pub(crate) time: Time,
    /// On which days, as 0 for Monday to 6 for Sunday; at least one.
    pub(crate) days: BTreeSet<i8>,
}

/// Lines and columns of an entry, counted from 1.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct EntryPlaces {
    cue: (usize, usize),
    preset: (usize, usize),
    effects: (usize, usize),
    film: (usize, usize),
    movie: (usize, usize),
}

impl At {
    /// True if it is a time of that day.
    #[must_use]
    pub(crate) fn is_on(&self, day: Weekday) -> bool {
        self.days.contains(&day.to_monday_zero_offset())
    }
}

impl Playlist {
    /// Its cues, in order; one may be there more than once.
    pub(crate) fn cues(&self) -> impl Iterator<Item = &CueId> {
        self.entries.iter().map(|entry| &entry.cue)
    }
}

impl Entry {
    /// What it sets of levels and effects: its preset, and over that its own. A preset that the configuration has not counts
    /// for nothing; [`Playlist::check`] names it.
    #[must_use]
    pub(crate) fn levels(&self, config: &Config) -> LevelsChange {
        let preset: Option<&Preset> = self.preset.as_deref().and_then(|name| config.preset(name));
        let mut change = preset.map_or_else(LevelsChange::default, LevelsChange::from);
        change.motion = self.level.or(change.motion);
        change.vibration = self.vibration.or(change.vibration);
        change.effects.extend(self.effects.clone());
        change
    }
}
