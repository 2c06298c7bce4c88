//! Coming to rest and resting: brakes that need no planner, hold frames, and what may be set at once meanwhile.

use std::time::Duration;

use super::Engine;
use super::lane::LaneMotion;
use super::phase::{Following, Holding, Phase, Rest, hold_frames};
use crate::plan::Curve;
use crate::timeline::Hint;

/// Before the end of the cue levels stand, so that there is time to plan what follows.
const FADE_CLEAR: Duration = Duration::from_millis(1_000);

impl Engine {
    /// Brings all lanes to rest as quickly as is gentle, from however they move.
    pub(super) fn come_down(&mut self, why: Rest) {
        if matches!(self.phase, Phase::Holding(_)) {
            self.give_up_replans();
            // Lanes that have been told so are left alone.
            let (is_told, frames) = (self.sends_nothing(), self.hold_frames());
            if let Phase::Holding(holding) = &mut self.phase {
                holding.frames = if is_told { holding.frames } else { frames };
                holding.why = why;
            }
            return;
        }
        // Nothing was set in motion: a frame that says so would be the first.
        if why == Rest::Stopped
            && self.playhead.frames() == 0
            && !self.lanes.all.iter().any(LaneMotion::is_blind)
        {
            return self.rest_untold();
        }
        (0..self.lanes.all.len()).for_each(|lane| self.brake(lane));
        if matches!(self.phase, Phase::Following(_) | Phase::Settling(_)) {
            // What leads on from rest is a join, and that meets the film where it is.
            self.playhead.catch_up();
        }
        self.seek_at_rest();
        self.enter(Phase::Braking(why));
    }

    /// Brings one lane to rest from however it moves.
    pub(super) fn brake(&mut self, lane: usize) {
        let Self { phase, timeline, lanes, playhead, .. } = self;
        // Where there is none, no lane is on it.
        let Some(course) = phase.course() else { return };
        let pose = |at| timeline.sample(at, &mut Hint::default());
        let curve = Curve { pose: &pose, end: timeline.duration() };
        let (reached, pace) = (playhead.reached(), playhead.pace());
        lanes.all[lane].brake(|window| {
            let states = curve.ahead(window.lead(), |cue| course.states_by_slot(lane, reached, window, cue));
            // A course moves by show time, a seat by the clock.
            states.map(|state| state.at_pace(pace))
        });
    }

    /// The controllers reached the last poses and stand there.
    pub(super) fn halt(&mut self, why: Rest) {
        self.stamps.break_off();
        self.lanes.halt();
        self.seek_at_rest();
        self.rest(why, self.hold_frames());
    }

    /// At rest, and no frame says so: the seats have not moved.
    pub(super) fn rest_untold(&mut self) {
        self.lanes.halt();
        self.rest(Rest::Stopped, 0);
    }

    /// Hold frames that end a motion of all lanes: by the last of them a seat that is led ahead is where its poses lead.
    pub(super) fn hold_frames(&self) -> u16 {
        let lead = self.lanes.all.iter().map(|lane| lane.window.lead()).max().unwrap_or_default();
        // A seat that is led ahead executes its last pose so much later; by then it has to be told still.
        let ahead = lead.as_nanos().div_ceil(self.show.rate.period().as_nanos().max(1));
        u16::from(hold_frames(self.show.rate)).saturating_add(u16::try_from(ahead).unwrap_or(u16::MAX))
    }

    fn rest(&mut self, why: Rest, frames: u16) {
        self.enter(Phase::Holding(Holding { why, next: None, frames }));
    }

    /// The cue is over before it is known how to go on: the lanes come to rest meanwhile.
    pub(super) fn end_the_cue(&mut self) {
        if let Phase::Following(following) = &self.phase
            && self.playhead.at() > self.end_of_cue(following)
        {
            self.come_down(Rest::Ended);
        }
    }

    /// Notices that the last lane rests.
    pub(super) fn come_to_rest(&mut self) {
        if let Phase::Braking(why) = self.phase
            && !self.lanes.all.iter().any(LaneMotion::is_braking)
        {
            self.rest(why, self.hold_frames());
        }
    }

    /// Another frame tells lanes at rest to stay there. One whose seat is to be read first gets none yet: what its last frame before a
    /// sleep has switched on is on until it does.
    pub(super) fn count_hold(&mut self) {
        let is_told = !self.lanes.all.iter().any(LaneMotion::is_unseen);
        if let Phase::Holding(Holding { why, frames, .. }) = &mut self.phase {
            *frames = frames.saturating_sub(u16::from(is_told));
            if matches!(why, Rest::Paused | Rest::Stopped) {
                self.stamps.hold();
            }
        }
    }

    /// True if no frame tells a lane that it is to rest: lanes in a lasting rest were told so, or so often that it is known which of
    /// them have not heard of it.
    pub(crate) fn sends_nothing(&self) -> bool {
        match &self.phase {
            Phase::Waiting(_) | Phase::Done => true,
            Phase::Holding(Holding { why: Rest::Paused | Rest::Stopped, frames, .. }) => {
                *frames == 0 && !self.lanes.all.iter().any(LaneMotion::is_blind)
            }
            _ => false,
        }
    }

    /// Moves the levels on while the lanes follow the cue.
    pub(super) fn fade(&mut self, time: Duration) {
        let may_fade = self.may_fade();
        let Phase::Following(Following { course, next, .. }) = &self.phase else { return };
        let of = (&**course, self.playhead.reached());
        let moved = self.lanes.fade(time, may_fade, of, &self.headroom);
        if moved && next.as_ref().is_some_and(|next| next.goal.is_after_the_end()) {
            self.give_up_replans(); // it was planned for other levels
        }
    }

    /// Whether levels may change: no other course is to begin soon.
    fn may_fade(&self) -> bool {
        let Phase::Following(following) = &self.phase else { return false };
        !self.is_wanted_elsewhere()
            && !self.phase.is_to_change()
            && self.playhead.at() + FADE_CLEAR < self.end_of_cue(following)
    }
}
