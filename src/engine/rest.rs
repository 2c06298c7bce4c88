//! Coming to rest and resting: brakes that need no planner, hold frames, and what may be set at once meanwhile.

use std::time::Duration;

use super::{Beat, Engine, HOLD_FRAMES, Part, Phase, Rest, Rider, Step};
use crate::plan::{Curve, Scene};
use crate::time::ShowTime;
use crate::timeline::Hint;

/// The hold frames of a rest so far. Where the show is to go on soon each tick sends one. Else there are three, and then none: one
/// that came later would take a seat back that somebody has moved by hand meanwhile.
#[derive(Debug, Clone, Default)]
pub(super) struct Holds(u8);

impl Holds {
    /// A rest begins.
    pub(super) const fn begin(&mut self) {
        self.0 = 0;
    }

    /// A rest of which no frame tells.
    pub(super) const fn skip(&mut self) {
        self.0 = HOLD_FRAMES;
    }

    /// True if a rest has been told often enough.
    pub(super) const fn are_over(&self) -> bool {
        self.0 >= HOLD_FRAMES
    }

    /// True if this tick sends one.
    const fn next(&mut self, rest: Rest) -> bool {
        let is_due = !self.are_over() || matches!(rest, Rest::Late | Rest::Ended);
        self.0 = self.0.saturating_add(1);
        is_due
    }
}

impl Engine {
    /// Brings all lanes to rest as quickly as is gentle, from however they move.
    pub(super) fn come_down(&mut self, rest: Rest) {
        self.drop_switch();
        if let Phase::Resting(_) = self.phase {
            // Lanes that have been told so are left alone.
            if !self.sends_nothing() {
                self.holds.begin();
            }
            self.phase = Phase::Resting(rest);
            return;
        }
        (0..self.riders.len()).for_each(|lane| self.brake(lane));
        if matches!(self.phase, Phase::Riding | Phase::Settling) {
            self.catch_up();
        }
        self.phase = Phase::Braking(rest);
    }

    /// Brings one lane to rest from however it moves.
    pub(super) fn brake(&mut self, lane: usize) {
        let Self { course, timeline, riders, reached, .. } = self;
        let pose = |at| timeline.sample(at, &mut Hint::default());
        let curve = Curve { pose: &pose, end: timeline.duration() };
        let pace = self.slew.pace();
        riders[lane].brake(|window| {
            course.states_by_slot(lane, *reached, window, &curve).map(|state| state.at_pace(pace))
        });
    }

    /// Show time goes on from where it should be: what was still to be slewed in is met by the next join.
    pub(super) fn catch_up(&mut self) {
        let owed = ShowTime::from_secs_f64(self.slew.owed_s());
        self.playhead = ShowTime::from_nanos(self.playhead.as_nanos() + owed.as_nanos());
        self.slew.reset();
    }

    /// The cue is over before it is known how to go on: the lanes come to rest meanwhile.
    pub(super) fn end_the_cue(&mut self) {
        if self.phase == Phase::Riding && self.playhead > self.end_of_cue() {
            self.come_down(Rest::Ended);
        }
    }

    /// Notices that the last lane rests.
    pub(super) fn come_to_rest(&mut self) {
        if let Phase::Braking(rest) = self.phase
            && !self.riders.iter().any(Rider::is_braking)
        {
            self.holds.begin();
            self.phase = Phase::Resting(rest);
        }
    }

    /// What a tick at rest sends.
    pub(super) fn hold(&mut self, rest: Rest, time_ms: u32) -> Step {
        if !self.holds.next(rest) {
            return Step::Quiet;
        }
        if matches!(rest, Rest::Paused | Rest::Stopped) {
            self.stamps.hold();
        }
        let (timing, stamp_ms) = self.stamps.next(time_ms);
        Step::Send(Beat::still(timing, stamp_ms).lasting(time_ms))
    }

    /// Moves the levels on while the lanes follow the cue.
    pub(super) fn fade(&mut self, time: Duration) {
        if self.phase != Phase::Riding {
            return;
        }
        let (dt, at) = (time.as_secs_f64(), self.reached);
        let free = self.may_fade();
        let mut moved = false;
        for (lane, rider) in self.riders.iter_mut().enumerate() {
            let follows = rider.part == Part::With && self.course.is_on_cue(lane, at);
            let target = rider.wanted.motion.min(self.greatest_level);
            if !follows || (rider.fader.is_still() && (!free || rider.fader.is_at(target))) {
                continue;
            }
            if free {
                rider.fade(dt, target, self.headroom.fade(at, rider.fader.level()));
            } else {
                rider.settle(dt);
            }
            moved |= !rider.fader.is_still();
        }
        if moved && self.switch.as_ref().is_some_and(|switch| switch.goal.is_after_the_end()) {
            self.drop_switch(); // it was planned for other levels
        }
    }

    /// Whether levels may change: no other course is to begin soon.
    fn may_fade(&self) -> bool {
        let asked = self.switch.as_ref().is_some_and(|switch| !switch.goal.is_after_the_end());
        !self.is_wanted_elsewhere() && !asked && self.playhead + FADE_CLEAR < self.end_of_cue()
    }

    pub(super) fn faders_are_still(&self) -> bool {
        self.riders.iter().all(|rider| rider.fader.is_still())
    }

    /// Once the cue is over the way to park waits for nobody: it leads those as well that are elsewhere.
    pub(super) fn lanes_need_a_course(&self) -> bool {
        self.playhead < self.timeline.duration() && self.riders.iter().any(Rider::needs_a_course)
    }

    /// Describes the lanes for the planner. The level of those that do not follow the cue is set at once: nothing of their
    /// present motion hangs on it.
    pub(super) fn describe(&mut self, scene: &mut Scene) {
        for (rider, scene) in self.riders.iter_mut().zip(&mut scene.lanes) {
            if rider.out || !rider.is_there() || rider.part == Part::Still {
                rider.set_level(rider.wanted.motion.min(self.greatest_level));
            }
            *scene = rider.scene();
        }
    }
}

/// Before the end of the cue levels stand, so that there is time to plan what follows.
const FADE_CLEAR: Duration = Duration::from_millis(1_000);
