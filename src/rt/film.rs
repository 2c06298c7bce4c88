//! The film that a show chases: read once a tick, and what seats may do by it. Tick thread.

use std::sync::Arc;
use std::time::Duration;

use crate::film::chase::{Chase, ChaseInput, ChaseRules, ChaseState, ChaseVerdict, HoldCause};
use crate::film::point::{ChasedFilm, FilmState, PublishedPoint};
use crate::state::Event;
use crate::time::{MonoTime, ShowTime, Tick};

/// A film that leads a show.
#[derive(Debug)]
pub struct FilmLead {
    clock: ChasedFilm,
    chase: Chase,
}

impl FilmLead {
    /// Chases whatever is published there, from `now` on.
    #[must_use]
    pub const fn new(source: Arc<PublishedPoint>, rules: ChaseRules, now: MonoTime) -> Self {
        Self { clock: ChasedFilm::new(source), chase: Chase::new(rules, now) }
    }

    /// Whether seats may follow it.
    pub(super) fn leads(&self) -> bool {
        self.chase.state() == ChaseState::Following
    }

    /// What this tick makes of the film, for the hall, and where in the cue its frame is to lead, if anywhere.
    pub(super) fn tick(
        &mut self,
        tick: &Tick,
        frame: Duration,
        trim_ms: i32,
        may_lead: bool,
    ) -> (Event, Option<ShowTime>) {
        let point = self.clock.at(tick);
        let state = point.map_or(FilmState::Absent, |point| point.state);
        match self.chase.tick(&ChaseInput { tick, frame, point, trim_ms, may_lead }) {
            ChaseVerdict::Wait => (Event::FilmAwaited(HoldCause::Film(state)), None),
            ChaseVerdict::Hold(cause) => (Event::FilmAwaited(cause), None),
            ChaseVerdict::Follow { playhead, .. } => (Event::FilmLeads, Some(playhead)),
            ChaseVerdict::Park(cause) => (Event::FilmOver(cause), None),
        }
    }
}
