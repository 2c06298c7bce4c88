//! The playlist: which cue is next, how it is played, and what follows its end. It starts nothing that no person has armed
//! the hall for: at the time of an entry only a hall that is armed goes, and an entry goes on to the next only where the one
//! before was let go by a person, or by its time, and came to its end.

use jiff::Zoned;

use super::Supervisor;
use super::job::JobResult;
use super::record::Before;
use super::show::{ProvedShow, read};
use crate::config::Config;
use crate::control::{Asked, Code, Command, EntryStatus, PlaylistStatus, Problem, Surface};
use crate::journal::{PlaylistPlace, stamp};
use crate::library::{IdError, Library};
use crate::playlist::{Entry, Playlist, PlaylistId, Schedule, Shelf, Then, next_start};
use crate::rt::Command as TickCommand;
use crate::state::{Cause, State, Transition};

/// The playlist that is loaded.
#[derive(Debug)]
pub(super) struct List {
    id: String,
    playlist: Playlist,
    /// Title and length of each entry's cue.
    cues: Vec<(Option<String>, f64)>,
    current: usize,
    schedule: Schedule,
}

/// What lets an entry start by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Start {
    /// The entry before goes on to it: the hall is armed for it once more.
    GoOn,
    /// Its time has come, and a person has armed the hall.
    Time,
}

/// What starts by itself, which is what every person can hold back.
#[derive(Debug, Default)]
pub(super) struct Onward {
    /// The entry that is being loaded starts then. Taken back where the hall leaves the state that it was in, or somebody wants
    /// it to stay there.
    start: Option<Start>,
    /// Somebody wanted the hall to stay at rest since the show began.
    held: bool,
}

impl List {
    /// Reads a playlist and checks all of it.
    fn read(shelf: &Shelf, library: &Library, config: &Config, id: &PlaylistId) -> Result<Self, Problem> {
        let playlist = shelf.read(id)?;
        let faults = playlist.check(library, config);
        if !faults.is_empty() {
            let faults = faults.iter().map(ToString::to_string).collect();
            let detail = format!("the playlist {id} cannot be played");
            return Err(
                Problem::new(Code::Check, detail, "put right what is named, and load it again").with(faults)
            );
        }
        let about = |entry: &Entry| {
            library.get(&entry.cue).map_or((None, 0.0), |info| (info.title, info.length_s.unwrap_or(0.0)))
        };
        let cues = playlist.entries.iter().map(about).collect();
        Ok(Self { id: id.to_string(), playlist, cues, current: 0, schedule: Schedule::default() })
    }

    /// Reads the one that was loaded before, at the entry where it was.
    pub(super) fn again(
        shelf: &Shelf,
        library: &Library,
        config: &Config,
        place: &PlaylistPlace,
        cue: &str,
    ) -> Result<Self, Problem> {
        let id = place.id.parse().map_err(|error: IdError| {
            Problem::new(Code::Value, error.to_string(), "GET /api/v1/playlists lists them")
        })?;
        let mut list = Self::read(shelf, library, config, &id)?;
        list.current = list.nearest(place.entry, cue);
        Ok(list)
    }

    /// That entry where it is of the cue, else one that is: somebody may have changed the playlist meanwhile.
    fn nearest(&self, entry: usize, cue: &str) -> usize {
        let entries = &self.playlist.entries;
        let is_of = |entry: &Entry| entry.cue.to_string() == cue;
        let there = entries.get(entry).is_some_and(is_of).then_some(entry);
        there.or_else(|| entries.iter().position(is_of)).unwrap_or_else(|| entry.min(entries.len() - 1))
    }

    /// Where it is, for the record of a show.
    pub(super) fn place(&self) -> PlaylistPlace {
        PlaylistPlace { id: self.id.clone(), entry: self.current }
    }

    fn entry(&self) -> &Entry {
        &self.playlist.entries[self.current]
    }

    /// As surfaces show it.
    pub(super) fn status(&self, now: &Zoned) -> PlaylistStatus {
        let entry = |(entry, (title, length_s)): (&Entry, &(Option<String>, f64))| EntryStatus {
            cue: entry.cue.to_string(),
            title: title.clone(),
            length_s: *length_s,
            preset: entry.preset.clone(),
            level: entry.level,
            trim_ms: entry.trim_ms,
            then: entry.then,
            at: entry.at.as_ref().map(|at| at.time.to_string()),
        };
        PlaylistStatus {
            id: self.id.clone(),
            title: self.playlist.title.clone(),
            entries: self.playlist.entries.iter().zip(&self.cues).map(entry).collect(),
            current: self.current,
            next_start: next_start(&self.playlist, now).map(|(_, start)| stamp(&start)),
        }
    }
}

impl Supervisor {
    /// Loads a playlist, with the cue of its first entry, or drops the one that is loaded.
    pub(super) fn playlist(&mut self, id: Option<&str>, asked: Asked) {
        let free = self.may("load").and_then(|()| self.is_free());
        let id = match (free, id.map(str::parse::<PlaylistId>)) {
            (Err(problem), _) => return self.answer(asked, Err(problem)),
            (Ok(()), None) => {
                self.list = None;
                return self.answer(asked, Ok(()));
            }
            (Ok(()), Some(Err(error))) => {
                let problem =
                    Problem::new(Code::Value, error.to_string(), "GET /api/v1/playlists lists them");
                return self.answer(asked, Err(problem));
            }
            (Ok(()), Some(Ok(id))) => id,
        };
        let (library, config) = (self.library.clone(), self.runtime.config.clone());
        let shelf = Shelf::new(&config.playlists());
        self.send("playlist", Some(asked), move || {
            let list = List::read(&shelf, &library, &config, &id);
            JobResult::Listed(list.and_then(|list| {
                let cued = read(&library, &config, &list.entry().cue)?;
                Ok((Box::new(list), cued))
            }))
        });
    }

    /// Takes up a playlist that was checked.
    pub(super) fn take_up_list(&mut self, list: List, cued: ProvedShow) -> Result<(), Problem> {
        self.may("load")?;
        self.list = Some(list);
        self.set_entry()?;
        self.take_up(cued)
    }

    /// Makes an entry the next to be played.
    pub(super) fn select(&mut self, entry: usize, asked: Asked) {
        let count = self.list.as_ref().map_or(0, |list| list.playlist.entries.len());
        if entry >= count {
            let problem = Problem::new(
                Code::Unknown,
                format!("there is no entry {} in a playlist of {count}", entry.saturating_add(1)),
                "choose one that there is; the API counts them from 0",
            );
            return self.answer(asked, Err(problem));
        }
        if let Err(problem) = self.may("load").and_then(|()| self.is_free()) {
            return self.answer(asked, Err(problem));
        }
        self.fetch_entry(entry, None, Some(asked));
    }

    /// Has the cue of an entry read, which starts then where that is due.
    fn fetch_entry(&mut self, entry: usize, start: Option<Start>, asked: Option<Asked>) {
        let Some(list) = &self.list else { return };
        let cue = list.playlist.entries[entry].cue.clone();
        let (library, config) = (self.library.clone(), self.runtime.config.clone());
        self.onward.start = start;
        self.send("loading", asked, move || JobResult::Entry(entry, read(&library, &config, &cue)));
    }

    /// Takes up the cue of an entry, and starts it where that is still due.
    pub(super) fn take_up_entry(&mut self, entry: usize, cued: ProvedShow) -> Result<(), Problem> {
        let start = self.onward.start.take();
        if start.is_none() {
            self.may("load")?;
        }
        let Some(list) = &mut self.list else { return Ok(()) };
        list.current = entry;
        self.set_entry()?;
        self.cued = Some(cued);
        self.stage().inspect_err(|_| self.cued = None)?;
        start.map_or(Ok(()), |start| self.start_entry(start))
    }

    /// Sets what the current entry says of levels, effects and trim.
    fn set_entry(&mut self) -> Result<(), Problem> {
        let Some(list) = &self.list else { return Ok(()) };
        let entry = list.entry();
        let (change, trim_ms) = (entry.levels(&self.runtime.config), entry.trim_ms);
        self.settings.change(&change)?;
        self.settings.trim_ms = trim_ms.unwrap_or(self.settings.trim_ms);
        Ok(())
    }

    /// Lets the current entry go, arming the hall first where the entry before went on to it. That homes no seat: people sit
    /// there.
    fn start_entry(&mut self, start: Start) -> Result<(), Problem> {
        self.tell_readiness();
        self.are_buckled()?;
        if start == Start::GoOn {
            self.command(TickCommand::Request(Transition::Arm))?;
        }
        let before = self.count_before();
        self.command(TickCommand::Request(Transition::Go))?;
        self.begin_show("the playlist", Surface::Schedule, before);
        Ok(())
    }

    /// A show has begun: who let it go, and that nobody has held the hall back since.
    pub(super) fn begin_show(&mut self, who: &str, surface: Surface, before: Before) {
        self.onward = Onward::default();
        self.forget_before();
        self.begin_record(who, surface, before);
    }

    /// True if what is loaded is that entry of the playlist.
    pub(super) fn is_entry(&self, entry: usize) -> bool {
        let cue = self.cued.as_ref().map(|cued| cued.id.as_str());
        self.list
            .as_ref()
            .is_some_and(|list| list.current == entry && cue == Some(&*list.entry().cue.to_string()))
    }

    /// Where the playlist is, where what is loaded is of it.
    pub(super) fn place(&self) -> Option<PlaylistPlace> {
        let list = self.list.as_ref().filter(|list| self.is_entry(list.current));
        list.map(List::place)
    }

    /// Whoever wants the hall to be at rest wants nothing to start by itself either, also where it is at rest already.
    pub(super) fn heed(&mut self, ask: &Command) {
        let rests = !matches!(self.mirror.state, State::Playing(_) | State::Paused);
        if matches!(ask, Command::Stop | Command::Park | Command::Disarm) || (rests && *ask == Command::Pause)
        {
            self.hold_back();
        }
    }

    /// Nothing starts by itself before a person lets a show go.
    pub(super) fn hold_back(&mut self) {
        self.onward = Onward { start: None, held: true };
    }

    /// The hall is in another state: what was to start by itself was for the one before.
    pub(super) fn forget_start(&mut self) {
        self.onward.start = None;
    }

    /// A show is over: the next entry is loaded, and starts where the one before says so and came to its end.
    pub(super) fn on_show_over(&mut self, ended: Cause) {
        let Some(list) = &self.list else { return self.rewind() };
        let completed = ended == Cause::CueEnded;
        let (played, next) = (list.current, list.current + 1);
        // A cue that a person loaded beside the playlist leads nowhere.
        if !completed || !self.is_entry(played) || next >= list.playlist.entries.len() {
            return self.rewind();
        }
        let goes = list.entry().then == Then::Go && self.mirror.state == State::Parked && !self.onward.held;
        let start = goes.then_some(Start::GoOn);
        // The engine that is done makes way for one that waits, whatever becomes of the next cue.
        self.rewind();
        if self.is_free().is_ok() {
            self.fetch_entry(next, start, None);
        }
    }

    /// Starts an entry whose time has come, where a person has armed the hall.
    pub(super) fn heed_schedule(&mut self) {
        let Some(list) = &mut self.list else { return };
        let Some(entry) = list.schedule.due(&list.playlist, &Zoned::now()) else { return };
        let cue = list.playlist.entries[entry].cue.to_string();
        if self.mirror.state != State::Armed {
            let state = self.mirror.state;
            self.note(format!("{cue} was to start now, but nobody had armed the hall: it was {state}"));
            return;
        }
        let result = if let Err(problem) = self.is_free() {
            Err(problem)
        } else if self.is_entry(entry) {
            self.start_entry(Start::Time)
        } else {
            self.fetch_entry(entry, Some(Start::Time), None);
            Ok(())
        };
        if let Err(problem) = result {
            self.note(format!("{cue} was to start now: {problem}"));
        }
    }
}

#[cfg(test)]
mod tests;
