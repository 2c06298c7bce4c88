//! The playlist: which cue is next, how it is played, and what follows its end. It starts nothing that no person has armed
//! the hall for: at the time of an entry only a hall that is armed goes, and an entry goes on to the next only where the one
//! before was let go by a person, or by its time, and came to its end.

use jiff::Zoned;

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::{HallContext, ShowChange};
use super::hall_settings::HallSettings;
use super::job::{Job, JobResult};
use super::list::{List, list_id};
use super::show::ProvedShow;
use crate::control::{Code, Command, Problem, Surface};
use crate::journal::PlaylistPlace;
use crate::playlist::Then;
use crate::rt::Command as TickCommand;
use crate::state::{State, Transition};

/// What lets an entry start by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Start {
    /// The entry before goes on to it: the hall is armed for it once more.
    GoOn,
    /// Its time has come, and a person has armed the hall.
    Time,
}

/// The playlist that is loaded, and what starts by itself of it, which is what every person can hold back.
#[derive(Debug, Default)]
pub(super) struct Onward {
    pub(super) list: Option<List>,
    /// The entry that is being loaded starts then. Taken back where the hall leaves the state that it was in, or somebody wants
    /// it to stay there.
    start: Option<Start>,
    /// Somebody wanted the hall to stay at rest since the show began.
    held: bool,
    /// The entry that is being loaded follows one that is over.
    follows: bool,
    /// It came while the seats moved once more: it is taken up when they rest.
    waits: Option<(usize, Box<ProvedShow>)>,
    /// Why an entry is not loaded that was to follow or to start by itself, until something is loaded or starts.
    pub(super) failed: Option<String>,
    /// The entry in whose part of the reel the film was when that was heeded last: it is entered once.
    reel: Option<usize>,
}

impl Onward {
    /// Loads a playlist, with the cue of its first entry, or drops the one that is loaded.
    ///
    /// # Errors
    /// Where it may not be loaded.
    pub(super) fn load(&mut self, id: Option<&str>, hall: &HallContext) -> Result<Vec<Act>, Problem> {
        hall.may("load")?;
        hall.is_free()?;
        let Some(id) = id else {
            self.list = None;
            return Ok(Vec::new());
        };
        Ok(vec![Act::Start(Job::List(list_id(id)?))])
    }

    /// Makes an entry the next to be played.
    ///
    /// # Errors
    /// Where there is none, or it may not be.
    pub(super) fn select(&mut self, entry: usize, hall: &HallContext) -> Result<Vec<Act>, Problem> {
        let count = self.list.as_ref().map_or(0, |list| list.playlist.entries.len());
        if entry >= count {
            let detail = format!("there is no entry {} in a playlist of {count}", entry.saturating_add(1));
            let remedy = match count {
                0 => "load a playlist first".to_owned(),
                _ => format!("select one of 1 to {count}; the API counts them from 0"),
            };
            return Err(Problem::new(Code::Unknown, detail, remedy));
        }
        hall.may("load")?;
        hall.is_free()?;
        Ok(self.fetch(entry, None))
    }

    /// Has the cue of an entry read, which starts then where that is due.
    pub(super) fn fetch(&mut self, entry: usize, start: Option<Start>) -> Vec<Act> {
        (self.start, self.follows, self.waits) = (start, false, None);
        let of_list = self.list.as_ref().map(|list| &list.playlist.entries[entry]);
        of_list.map(|of| Act::Start(Job::Entry(entry, of.cue.clone(), of.film.clone()))).into_iter().collect()
    }

    /// Takes up a playlist that was checked.
    ///
    /// # Errors
    /// Where it may not be, or its first entry asks for levels that are none.
    pub(super) fn take_list(
        &mut self,
        (list, cued): (Box<List>, Box<ProvedShow>),
        hall: &HallContext,
    ) -> Result<Vec<Act>, Problem> {
        hall.may("load")?;
        let list = self.list.insert(*list);
        let settings = entry_settings(list, hall)?;
        let missing = list.missing.iter().cloned().map(Act::Note);
        Ok(missing.chain([Act::Stage(ShowChange::Cue(cued, Some(settings)))]).collect())
    }

    /// Takes up the cue of an entry, and starts it where that is still due. That homes no seat: people sit there.
    ///
    /// # Errors
    /// As [`Self::take_list`].
    pub(super) fn take_entry(
        &mut self,
        entry: usize,
        cued: Result<Box<ProvedShow>, Problem>,
        hall: &HallContext,
    ) -> Result<Vec<Act>, Problem> {
        let start = self.start.take();
        let cued = match cued {
            Ok(cued) => cued,
            Err(problem) if start.is_none() && !self.follows => return Err(problem),
            Err(problem) => return Ok(self.fail(entry, start, &problem, hall)),
        };
        if start.is_none()
            && let Err(problem) = hall.may("load")
        {
            if !self.follows {
                return Err(problem);
            }
            self.waits = Some((entry, cued));
            return Ok(Vec::new());
        }
        let Some(list) = &mut self.list else { return Ok(Vec::new()) };
        list.current = entry;
        let mut acts = vec![Act::Stage(ShowChange::Cue(cued, Some(entry_settings(list, hall)?)))];
        acts.extend(start.into_iter().flat_map(starting));
        Ok(acts)
    }

    /// An entry that nobody selected has no cue: what played before it is not to be played again in its place.
    fn fail(
        &mut self,
        entry: usize,
        start: Option<Start>,
        problem: &Problem,
        hall: &HallContext,
    ) -> Vec<Act> {
        let Some(list) = &mut self.list else { return Vec::new() };
        let what = if start.is_some() { "did not start" } else { "is not loaded" };
        self.failed = Some(format!("entry {} of {} {what}: {problem}", entry + 1, list.id));
        if hall.may("load").is_err() {
            return Vec::new();
        }
        list.current = entry;
        vec![Act::Unload]
    }

    /// True if what is loaded is that entry of the playlist.
    fn is_entry(&self, entry: usize, hall: &HallContext) -> bool {
        let cue = hall.cued.as_ref().map(|cued| cued.id.as_str());
        self.list
            .as_ref()
            .is_some_and(|list| list.current == entry && cue == Some(&*list.entry().cue.to_string()))
    }

    /// The wall clock in the zone of the hall: that of its playlist, else that of the server.
    pub(super) fn local_now(&self) -> Zoned {
        let now = Zoned::now();
        self.list.as_ref().map_or_else(|| now.clone(), |list| list.local(&now))
    }

    /// Where the playlist is, where what is loaded is of it.
    pub(super) fn place(&self, hall: &HallContext) -> Option<PlaylistPlace> {
        let list = self.list.as_ref().filter(|list| self.is_entry(list.current, hall));
        list.map(List::place)
    }

    /// A show is over: the next entry is loaded, and starts where the one before says so and came to its end.
    pub(super) fn on_show_over(&mut self, hall: &HallContext) -> Vec<Act> {
        // The engine that is done makes way for one that waits, whatever becomes of the next cue.
        let mut acts = vec![Act::Stage(ShowChange::Rewind)];
        let Some(list) = &self.list else { return acts };
        let (played, next) = (list.current, list.current + 1);
        // A cue that a person loaded beside the playlist leads nowhere.
        if !hall.ended.completes() || !self.is_entry(played, hall) || next >= list.playlist.entries.len() {
            return acts;
        }
        let goes = list.entry().then == Then::Go && hall.mirror.state == State::Parked && !self.held;
        if hall.is_free().is_ok() {
            acts.extend(self.fetch(next, goes.then_some(Start::GoOn)));
            self.follows = true;
        }
        acts
    }

    /// Loads the entry into whose part of the reel the film has come, where all is parked: so one reel of timecode leads a day. A person
    /// arms and lets go as ever, and whoever has loaded another cue, or selects an entry meanwhile, keeps that.
    fn heed_reel(&mut self, hall: &HallContext) -> Vec<Act> {
        let (Some(list), Some(sync), Some(table)) = (&self.list, &hall.config.sync, &hall.film) else {
            return Vec::new();
        };
        let entered = table.read().locked_at().and_then(|media| list.entry_at(sync, media));
        if entered.is_none() {
            self.reel = None;
        }
        let entry = entered.filter(|entry| self.reel != Some(*entry) && self.may_enter(hall));
        entry.map(|entry| Act::Take(JobResult::Reached(entry))).into_iter().collect()
    }

    /// True if a film may have another entry loaded: while all is parked, what is loaded is of the list, and nothing else is to come.
    fn may_enter(&self, hall: &HallContext) -> bool {
        let is_of_list = self.list.as_ref().is_some_and(|list| self.is_entry(list.current, hall));
        let rests = hall.mirror.state == State::Parked && hall.is_free().is_ok();
        rests && is_of_list && self.start.is_none() && self.waits.is_none()
    }

    /// Has the entry loaded to which the film has come, where that may still be once all before it is done: what goes on by itself
    /// goes before.
    pub(super) fn enter(&mut self, entry: usize, hall: &HallContext) -> Vec<Act> {
        if self.reel == Some(entry) || !self.may_enter(hall) {
            return Vec::new();
        }
        self.reel = Some(entry);
        let Some(list) = self.list.as_ref().filter(|list| list.current != entry) else { return Vec::new() };
        let name = format!("the film has come to entry {}, {}", entry + 1, list.playlist.entries[entry].cue);
        let mut acts = vec![Act::Name(name)];
        acts.extend(self.fetch(entry, None));
        acts
    }

    /// Starts an entry whose time has come, where a person has armed the hall.
    fn heed_schedule(&mut self, wall: &Zoned, hall: &HallContext) -> Vec<Act> {
        let Some(list) = &mut self.list else { return Vec::new() };
        let Some(entry) = list.schedule.due(&list.playlist, wall) else { return Vec::new() };
        let cue = list.playlist.entries[entry].cue.to_string();
        if hall.mirror.state != State::Armed {
            let state = hall.mirror.state;
            let note = format!("{cue} was due to start, but nobody had armed the hall: it was {state}");
            return vec![Act::Passing(note)];
        }
        let mut acts = vec![Act::Name(format!("{cue} was due to start"))];
        match hall.is_free() {
            Err(problem) => acts.push(Act::Fail(problem)),
            Ok(()) if self.is_entry(entry, hall) => acts.extend(starting(Start::Time)),
            Ok(()) => acts.extend(self.fetch(entry, Some(Start::Time))),
        }
        acts
    }
}

impl Feature for Onward {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, out: &mut Vec<Act>) {
        let rests = !hall.is_on_cue();
        match event {
            // Whoever wants the hall to be at rest wants nothing to start by itself either, also where it is at rest already.
            SupervisorEvent::Asked(desired) => match desired.ask {
                Command::Stop | Command::Park | Command::Disarm => (self.start, self.held) = (None, true),
                Command::Pause if rests => (self.start, self.held) = (None, true),
                _ => {}
            },
            SupervisorEvent::Leaving => (self.start, self.held) = (None, true),
            // What was to start by itself was for the state before.
            SupervisorEvent::Entered(_) => {
                self.start = None;
                let ready = self.waits.take_if(|_| hall.may("load").is_ok());
                out.extend(ready.map(|(entry, cued)| Act::Take(JobResult::Entry(entry, Ok(cued)))));
            }
            SupervisorEvent::Begun(_) => {
                (self.start, self.held, self.waits, self.failed) = (None, false, None, None);
            }
            SupervisorEvent::Clock(wall) => out.extend(self.heed_schedule(wall, hall)),
            SupervisorEvent::Round(_) => out.extend(self.heed_reel(hall)),
            SupervisorEvent::Done(desired) => {
                let loads = matches!(
                    desired.ask,
                    Command::Load { .. } | Command::Playlist { .. } | Command::Select { .. }
                );
                self.failed.take_if(|_| loads);
            }
        }
    }
}

/// What is set, with what the current entry of a playlist says of it.
fn entry_settings(list: &List, hall: &HallContext) -> Result<Box<HallSettings>, Problem> {
    let entry = list.entry();
    let mut settings = hall.settings.clone();
    settings.change(&entry.levels(&hall.config))?;
    settings.trim_ms = entry.trim_ms.unwrap_or(settings.trim_ms);
    Ok(Box::new(settings))
}

/// Lets the current entry go, arming the hall first where the entry before went on to it.
fn starting(start: Start) -> Vec<Act> {
    let mut acts = vec![Act::TellReadiness, Act::CheckBelts];
    if start == Start::GoOn {
        acts.push(Act::Tick(TickCommand::Request(Transition::Arm)));
    }
    acts.push(Act::Go { by: Transition::Go, who: "the playlist".to_owned(), surface: Surface::Schedule });
    acts
}

#[cfg(test)]
mod tests;
