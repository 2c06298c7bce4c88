//! A playlist that is loaded.

use std::time::Duration;

use jiff::Zoned;

use crate::config::{Config, FilmSync};
use crate::control::{Code, EntryStatus, PlaylistStatus, Problem};
use crate::film::chase::PRE_ROLL;
use crate::journal::{PlaylistPlace, stamp};
use crate::library::{IdError, Library};
use crate::playlist::{Entry, Playlist, PlaylistId, Schedule, Shelf, local, next_start, start_after};
use crate::time::ShowTime;

/// The id of a playlist as somebody asks for it.
pub(super) fn list_id(text: &str) -> Result<PlaylistId, Problem> {
    text.parse().map_err(|error: IdError| {
        let remedy = "`kinocue playlist`, the page and GET /api/v1/playlists list them";
        Problem::new(Code::Value, error.to_string(), remedy)
    })
}

/// The playlist that is loaded.
#[derive(Debug)]
pub(super) struct List {
    pub(super) id: String,
    pub(super) playlist: Playlist,
    /// Title and length of each entry's cue.
    pub(super) cues: Vec<(Option<String>, f64)>,
    pub(super) current: usize,
    pub(super) schedule: Schedule,
    /// What cannot be shown of its films now.
    pub(super) missing: Vec<String>,
}

impl List {
    /// Reads a playlist and checks all of it.
    pub(super) fn read(
        shelf: &Shelf,
        library: &Library,
        config: &Config,
        id: &PlaylistId,
    ) -> Result<Self, Problem> {
        let playlist = shelf.read(id)?;
        let faults = playlist.check(library, config);
        if !faults.is_empty() {
            let faults = faults.iter().map(ToString::to_string).collect();
            let detail = format!("the playlist {id} cannot be played");
            return Err(
                Problem::new(Code::Check, detail, "correct these faults, and load it again").with(faults)
            );
        }
        let about = |entry: &Entry| {
            library.get(&entry.cue).map_or((None, 0.0), |info| (info.title, info.length_s.unwrap_or(0.0)))
        };
        let cues = playlist.entries.iter().map(about).collect();
        let missing = playlist.missing(config);
        Ok(Self { id: id.to_string(), playlist, cues, current: 0, schedule: Schedule::default(), missing })
    }

    /// Reads the one that was loaded before, at the entry where it was.
    pub(super) fn again(
        shelf: &Shelf,
        library: &Library,
        config: &Config,
        place: &PlaylistPlace,
        cue: &str,
    ) -> Result<Self, Problem> {
        let id = list_id(&place.id)?;
        let mut list = Self::read(shelf, library, config, &id)?;
        list.current = list.nearest(place.entry, cue);
        Ok(list)
    }

    /// That entry where it is of the cue, else one that is: somebody may have changed the playlist meanwhile.
    pub(super) fn nearest(&self, entry: usize, cue: &str) -> usize {
        let entries = &self.playlist.entries;
        let is_of = |entry: &Entry| entry.cue.to_string() == cue;
        let there = entries.get(entry).is_some_and(is_of).then_some(entry);
        there.or_else(|| entries.iter().position(is_of)).unwrap_or_else(|| entry.min(entries.len() - 1))
    }

    /// Where it is, for the record of a show.
    pub(super) fn place(&self) -> PlaylistPlace {
        PlaylistPlace { id: self.id.clone(), entry: self.current }
    }

    /// The entry that is next, or plays.
    pub(super) fn entry(&self) -> &Entry {
        &self.playlist.entries[self.current]
    }

    /// The entry that names a timecode from which on its cue covers that place of the film; else the one before whose beginning it
    /// is by no more than seats join ahead.
    pub(super) fn entry_at(&self, sync: &FilmSync, media: ShowTime) -> Option<usize> {
        let parts: Vec<_> = (0..)
            .zip(self.playlist.entries.iter().zip(&self.cues))
            .filter_map(|(entry, (of, (_, length_s)))| {
                let begin = sync.begin(Some(of.film.begin?)).ok()??;
                Some((entry, media.since(begin), ShowTime::from_secs_f64(*length_s)))
            })
            .collect();
        let within = |from: ShowTime| {
            let covers = |(entry, at, length): &(usize, ShowTime, ShowTime)| {
                (from..*length).contains(at).then_some(*entry)
            };
            parts.iter().find_map(covers)
        };
        within(ShowTime::ZERO).or_else(|| within(PRE_ROLL))
    }

    /// As surfaces show it.
    pub(super) fn status(&self, now: &Zoned) -> PlaylistStatus {
        let wait = |place: usize| {
            start_after(&self.playlist, place, now).map(|start| until(&start, now).as_secs_f64())
        };
        let entry =
            |(place, (entry, (title, length_s))): (usize, (&Entry, &(Option<String>, f64)))| EntryStatus {
                cue: entry.cue.to_string(),
                title: title.clone(),
                length_s: *length_s,
                preset: entry.preset.clone(),
                level: entry.level,
                trim_ms: entry.trim_ms,
                movie: entry.film.movie.clone(),
                then: entry.then,
                at: entry.at.as_ref().map(|at| at.time.to_string()),
                starts_in_s: wait(place),
                note: entry.note.clone(),
            };
        PlaylistStatus {
            id: self.id.clone(),
            title: self.playlist.title.clone(),
            entries: self.playlist.entries.iter().zip(&self.cues).enumerate().map(entry).collect(),
            current: self.current,
            next_start: next_start(&self.playlist, now).map(|(_, start)| stamp(&start)),
        }
    }

    /// How long it is until an entry starts by its time.
    pub(super) fn starts_in(&self, wall: &Zoned) -> Option<Duration> {
        let (_, start) = next_start(&self.playlist, wall)?;
        Some(until(&start, wall))
    }

    /// An instant in the zone of the playlist.
    pub(super) fn local(&self, at: &Zoned) -> Zoned {
        local(&self.playlist, at)
    }
}

fn until(start: &Zoned, now: &Zoned) -> Duration {
    start.timestamp().duration_since(now.timestamp()).unsigned_abs()
}
