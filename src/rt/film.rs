//! The film that a show chases: read once a tick, and what seats may do by it. Tick thread.

use std::sync::Arc;
use std::time::Duration;

use crate::film::chase::{Chase, ChaseInput, ChaseRules, ChaseState, ChaseVerdict, FilmLeave, HoldCause};
use crate::film::point::{ChasedFilm, FilmPoint, FilmState, PublishedPoint};
use crate::state::Event;
use crate::time::{MonoTime, ShowTime, Tick};

/// How a show follows the film.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FilmStart {
    /// Where the film is when the cue begins.
    pub(crate) begin: ShowTime,
    pub(crate) rules: ChaseRules,
}

/// A film that leads shows.
#[derive(Debug)]
pub struct FilmLead {
    clock: ChasedFilm,
    chase: Chase,
    begin: ShowTime,
    followed: Followed,
    /// How often seats have joined it.
    joins: u64,
    /// Where it was in this tick, from the cue's beginning on.
    point: Option<FilmPoint>,
}

/// Who follows the film.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Followed {
    /// The one show of a play.
    Always,
    /// The shows of a hall that say so; whether the one that is loaded does.
    ByShow(bool),
}

impl FilmLead {
    /// Chases whatever is published there, from `now` on.
    #[must_use]
    pub const fn new(source: Arc<PublishedPoint>, rules: ChaseRules, now: MonoTime) -> Self {
        Self {
            clock: ChasedFilm::new(source),
            chase: Chase::new(rules, now),
            begin: ShowTime::ZERO,
            followed: Followed::Always,
            joins: 0,
            point: None,
        }
    }

    /// The film of a hall in which no show follows it yet.
    pub(crate) fn of_a_hall(source: Arc<PublishedPoint>, now: MonoTime) -> Self {
        Self {
            followed: Followed::ByShow(false),
            ..Self::new(source, ChaseRules::until(ShowTime::ZERO), now)
        }
    }

    /// Another show is loaded, which follows the film so, or not at all.
    pub(super) fn load(&mut self, start: Option<FilmStart>, now: MonoTime) {
        let Followed::ByShow(does) = &mut self.followed else { return };
        *does = start.is_some();
        if let Some(FilmStart { begin, rules }) = start {
            (self.begin, self.chase) = (begin, Chase::new(rules, now));
        }
    }

    /// True if the show that is loaded follows it.
    pub(super) const fn is_followed(&self) -> bool {
        !matches!(self.followed, Followed::ByShow(false))
    }

    /// A person lets seats join that hold until one does.
    pub(super) fn let_join(&mut self, now: MonoTime) {
        if self.chase.state() == ChaseState::Holding {
            self.chase.let_join(now);
        }
    }

    /// Whether seats may follow it.
    pub(super) fn leads(&self) -> bool {
        self.chase.state() == ChaseState::Following
    }

    /// Whether seats may follow it again in a moment.
    pub(super) fn is_lost_briefly(&self) -> bool {
        self.chase.is_held_briefly()
    }

    /// How often seats have joined it, in all shows.
    pub(super) const fn joins(&self) -> u64 {
        self.joins
    }

    /// How far ahead of the film, less the trim, seats are that reach `pose` of the cue at `at`, nanoseconds.
    pub(super) fn error_ns(&self, pose: ShowTime, at: MonoTime, trim_ms: i32) -> Option<i64> {
        let film = self.point?.media_at(at).as_nanos();
        Some(pose.as_nanos().saturating_sub(film.saturating_sub(i64::from(trim_ms) * 1_000_000)))
    }

    /// What this tick makes of the film, for the hall, and where in the cue its frame is to lead, if anywhere.
    pub(super) fn tick(
        &mut self,
        tick: &Tick,
        frame: Duration,
        trim_ms: i32,
        leave: FilmLeave,
    ) -> (Event, Option<ShowTime>) {
        let begin = self.begin;
        let point = self.clock.at(tick).map(|point| FilmPoint { media: point.media.since(begin), ..point });
        self.point = point;
        let state = point.map_or(FilmState::Absent, |point| point.state);
        let led = self.leads();
        let verdict = self.chase.tick(&ChaseInput { tick, frame, point, trim_ms, leave });
        self.joins += u64::from(!led && self.leads());
        match verdict {
            ChaseVerdict::Wait => (Event::FilmAwaited(HoldCause::Film(state)), None),
            ChaseVerdict::Hold(cause) => (Event::FilmAwaited(cause), None),
            ChaseVerdict::Follow { playhead, .. } => (Event::FilmLeads, Some(playhead)),
            ChaseVerdict::Park(cause) => (Event::FilmOver(cause), None),
        }
    }
}
