//! The playlist: which cue is next, how it is played, and what follows its end. It starts nothing that no person has armed
//! the hall for: at the time of an entry only a hall that is armed goes, and an entry goes on to the next only where the one
//! before was let go by a person, or by its time, and came to its end.

use jiff::Zoned;

use super::Keeper;
use super::errand::Done;
use super::show::{Cued, read};
use crate::config::Config;
use crate::hall::{Asked, Code, EntryStatus, PlaylistStatus, Problem, Surface};
use crate::journal::{PlaylistPlace, stamp};
use crate::library::Library;
use crate::playlist::{Entry, Playlist, PlaylistId, Schedule, Shelf, Then, next_start};
use crate::rt::Command;
use crate::state::{Cause, Request, State};

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

/// What is to happen once a cue of the playlist is loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Onward {
    /// Nothing.
    Wait,
    /// It starts: the entry before goes on to it, or its time has come.
    Start,
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
            then: entry.then.word(),
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

impl Keeper {
    /// Loads a playlist, with the cue of its first entry, or drops the one that is loaded.
    pub(super) fn playlist(&mut self, id: Option<&str>, asked: Asked) {
        let free = self.may_load().and_then(|()| self.is_free());
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
        let (library, config) = (self.library.clone(), self.reins.config.clone());
        let shelf = Shelf::new(&config.playlists());
        self.send("playlist", Some(asked), move || {
            let list = List::read(&shelf, &library, &config, &id);
            Done::Listed(list.and_then(|list| {
                let cued = read(&library, &config, &list.entry().cue)?;
                Ok((Box::new(list), cued))
            }))
        });
    }

    /// Takes up a playlist that was checked.
    pub(super) fn take_up_list(&mut self, list: List, cued: Cued) -> Result<(), Problem> {
        self.may_load()?;
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
        if let Err(problem) = self.may_load().and_then(|()| self.is_free()) {
            return self.answer(asked, Err(problem));
        }
        self.fetch_entry(entry, Onward::Wait, Some(asked));
    }

    /// Has the cue of an entry read.
    fn fetch_entry(&mut self, entry: usize, onward: Onward, asked: Option<Asked>) {
        let Some(list) = &self.list else { return };
        let cue = list.playlist.entries[entry].cue.clone();
        let (library, config) = (self.library.clone(), self.reins.config.clone());
        self.send("loading", asked, move || Done::Entry(entry, onward, read(&library, &config, &cue)));
    }

    /// Takes up the cue of an entry, and starts it where that is due.
    pub(super) fn take_up_entry(&mut self, entry: usize, onward: Onward, cued: Cued) -> Result<(), Problem> {
        let Some(list) = &mut self.list else { return Ok(()) };
        list.current = entry;
        self.set_entry()?;
        self.cued = Some(cued);
        self.stage().inspect_err(|_| self.cued = None)?;
        if onward == Onward::Start { self.start_entry() } else { Ok(()) }
    }

    /// Sets what the current entry says of levels, effects and trim.
    fn set_entry(&mut self) -> Result<(), Problem> {
        let Some(list) = &self.list else { return Ok(()) };
        let entry = list.entry();
        let (change, trim_ms) = (entry.levels(&self.reins.config), entry.trim_ms);
        self.board.change(&change)?;
        self.board.trim_ms = trim_ms.unwrap_or(self.board.trim_ms);
        Ok(())
    }

    /// Lets the current entry go, arming the hall first where the entry before went on to it.
    fn start_entry(&mut self) -> Result<(), Problem> {
        self.tell_readiness();
        if self.known.state == State::Parked {
            self.command(Command::Request(Request::Arm))?;
        }
        if self.known.state == State::Homing {
            return Err(Problem::new(Code::State, "the seats have to be homed first", "arm, and go"));
        }
        self.command(Command::Request(Request::Go))
            .inspect(|()| self.begin_record("the playlist", Surface::Schedule))
    }

    /// A show is over: the next entry is loaded, and starts where the one before says so and came to its end.
    pub(super) fn on_show_over(&mut self, ended: Cause) {
        let Some(list) = &self.list else { return self.rewind() };
        let completed = ended == Cause::CueEnded;
        let next = list.current + 1;
        if !completed || next >= list.playlist.entries.len() {
            return self.rewind();
        }
        let goes = list.entry().then == Then::Go && self.known.state == State::Parked;
        let onward = if goes { Onward::Start } else { Onward::Wait };
        // The engine that is done makes way for one that waits, whatever becomes of the next cue.
        self.rewind();
        if self.is_free().is_ok() {
            self.fetch_entry(next, onward, None);
        }
    }

    /// Starts an entry whose time has come, where a person has armed the hall.
    pub(super) fn heed_schedule(&mut self) {
        let Some(list) = &mut self.list else { return };
        let Some(entry) = list.schedule.due(&list.playlist, &Zoned::now()) else { return };
        let cue = list.playlist.entries[entry].cue.to_string();
        if self.known.state != State::Armed || self.is_free().is_err() {
            let state = self.known.state;
            self.note(format!("{cue} was to start now, but nobody had armed the hall: it was {state}"));
            return;
        }
        let result = if self.list.as_ref().is_some_and(|list| list.current == entry) {
            self.start_entry()
        } else {
            self.fetch_entry(entry, Onward::Start, None);
            Ok(())
        };
        if let Err(problem) = result {
            self.note(format!("{cue} was to start now: {problem}"));
        }
    }
}
