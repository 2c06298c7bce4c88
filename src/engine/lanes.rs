//! All lanes of a show, and what somebody who watches their controllers has for one of them.

use std::time::Duration;

use super::cue_ahead::CueAhead;
use super::events::{EngineEvent, EngineEvents, Unplanned};
use super::headroom::Headroom;
use super::lane::{LaneMode, LaneMotion};
use crate::belief::Fall;
use crate::motion::{Pose, Window};
use crate::plan::{Course, Scene};
use crate::time::{Rate, ShowTime};

/// What is to become of a lane, whatever the hall wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LaneOrder {
    /// It comes to rest; after its hold frames nothing goes to it.
    Leave,
    /// Nothing goes to it from now on.
    Cut,
    /// The same, and it is to be looked at.
    FallOut(Fall),
    /// Nobody knows which frames reach it: it is brought to rest by frames that are slow enough from wherever it may be
    /// ([`super::Engine::slow_down`]), and then it is away, until it is found.
    GoBlind,
    /// Nobody knows any more where its seat is: nothing goes to it until it is found.
    LoseSight,
}

/// The lanes.
#[derive(Debug)]
pub(super) struct Lanes {
    pub(super) all: Box<[LaneMotion]>,
    /// No level goes beyond it: the cue was proved at no higher one.
    greatest_level: f64,
    pub(super) events: EngineEvents,
}

impl Lanes {
    /// Lanes of which nobody has told where they stand, at the levels of their windows.
    pub(super) fn unseen(windows: Vec<Window>, proved_level: f64, rate: Rate) -> Self {
        // Levels that the cue was proved at are kept, though no room for a change may be left at them.
        let greatest_level = windows.iter().map(Window::level).fold(proved_level, f64::max);
        let events = EngineEvents::of(windows.len());
        let all = windows.into_iter().map(|window| LaneMotion::unseen(window, rate)).collect();
        Self { all, greatest_level, events }
    }

    /// Nothing goes to a lane from now on, and it is to be looked at.
    pub(super) fn fall_out(&mut self, lane: usize, why: Fall) {
        self.all[lane].step_out();
        self.events.push(EngineEvent::FellOut(lane, why));
    }

    /// Nobody knows any more where the seat of a lane is.
    pub(super) fn lose_sight(&mut self, lane: usize) {
        if self.all[lane].lose_sight() {
            self.events.push(EngineEvent::FellOut(lane, Fall::Gap));
        }
    }

    /// Those of which nobody knows which frames reach them fall out.
    pub(super) fn drop_blind(&mut self) {
        for lane in 0..self.all.len() {
            if self.all[lane].is_blind() {
                self.fall_out(lane, Fall::Gap);
            }
        }
    }

    /// The controllers reached the last poses and stand there.
    pub(super) fn halt(&mut self) {
        for (lane, motion) in self.all.iter_mut().enumerate() {
            if motion.halt() {
                self.events.push(EngineEvent::FellOut(lane, Fall::Gap));
            }
        }
    }

    /// Moves those on that frames lead by one frame, of that number from 0 and that Time.
    pub(super) fn advance(
        &mut self,
        frame: (u64, Duration),
        mut course: Option<&mut Course>,
        at: ShowTime,
        cues: &[CueAhead],
    ) {
        // The frames of one that is blind are made as they leave, from what is known by then.
        let is_led = |motion: &LaneMotion| motion.is_there() && !motion.is_blind();
        let led = self.all.iter_mut().enumerate().filter(|(_, motion)| is_led(motion));
        for (lane, motion) in led {
            let cue = &CueAhead::of(cues, motion.window.lead()).pose;
            if !motion.advance(frame, course.as_deref_mut().map(|course| (course, lane)), at, cue) {
                self.events.push(EngineEvent::LimiterFault);
            }
            if motion.mode == LaneMode::Away {
                self.events.push(EngineEvent::FellOut(lane, Fall::Gap));
            }
        }
    }

    /// Moves the levels on of those that follow the cue; they come to stand if they are not `free` to change. True if one changes.
    pub(super) fn fade(
        &mut self,
        time: Duration,
        free: bool,
        (course, at): (&Course, ShowTime),
        headroom: &Headroom,
    ) -> bool {
        let dt = time.as_secs_f64();
        let mut moved = false;
        for (lane, motion) in self.all.iter_mut().enumerate() {
            let follows = motion.is_on_cue(course, lane, at);
            let target = motion.wanted.motion.min(self.greatest_level);
            if !follows || (motion.fader.is_still() && (!free || motion.fader.is_at(target))) {
                continue;
            }
            if free {
                motion.fade(dt, target, headroom.fade(at, motion.fader.level(), motion.may_shake()));
            } else {
                motion.settle(dt, target);
            }
            moved |= !motion.fader.is_still();
        }
        moved
    }

    /// Describes the lanes for the planner. Those that do not follow the cue take their level at once.
    pub(super) fn describe(&mut self, scene: &mut Scene) {
        for (motion, scene) in self.all.iter_mut().zip(&mut scene.lanes) {
            // Nothing of how they move now hangs on it: they are out, at rest, or nothing goes to them.
            if motion.out || !motion.is_there() || motion.mode == LaneMode::Still {
                motion.set_level(motion.wanted.motion.min(self.greatest_level));
            }
            *scene = motion.scene();
        }
    }

    /// Takes up the course that was made for that scene.
    pub(super) fn take_up(&mut self, scene: &Scene) {
        self.all.iter_mut().zip(&scene.lanes).for_each(|(motion, scene)| motion.take_up(scene));
    }

    /// Hears that there is no way for those that need a course of their own.
    pub(super) fn refuse(&mut self) {
        for (lane, motion) in self.all.iter_mut().enumerate() {
            if motion.refuse() {
                self.events.push(EngineEvent::Unplanned(Unplanned::Lane(lane)));
            }
        }
    }

    /// Notices which lanes that were away are where the others are again.
    pub(super) fn note_arrivals(&mut self, mut course: Option<&mut Course>, at: ShowTime) {
        for (lane, motion) in self.all.iter_mut().enumerate() {
            let is_settled = course.as_deref_mut().is_none_or(|course| course.is_settled(lane, at));
            if motion.arrives(is_settled) {
                self.events.push(EngineEvent::Joined(lane));
            }
        }
    }

    /// Whether any of them is on the cue: none may be though the show goes on, where all are out or away.
    pub(super) fn is_any_on_cue(&self, course: &Course, at: ShowTime) -> bool {
        self.all.iter().enumerate().any(|(lane, motion)| motion.is_on_cue(course, lane, at))
    }

    /// The greatest level there is.
    pub(super) fn level(&self) -> f64 {
        self.all.iter().map(|motion| motion.fader.level()).fold(0.0, f64::max)
    }

    /// Whether any of them may vibrate.
    pub(super) fn may_shake(&self) -> bool {
        self.all.iter().any(LaneMotion::may_shake)
    }

    /// Whether one that frames may go to is farther than that from park.
    pub(super) fn is_any_off_park(&self, near: &Pose) -> bool {
        let is_off = |motion: &LaneMotion| !is_at(&motion.window, motion.pose(), &motion.window.park(), near);
        self.all.iter().any(|motion| motion.is_there() && is_off(motion))
    }
}

/// Whether two poses are the same as far as the window moves, to so many strokes of each slot.
pub(super) fn is_at(window: &Window, pose: &Pose, other: &Pose, near: &Pose) -> bool {
    window.moving().all(|(slot, _)| (pose[slot] - other[slot]).abs() <= near[slot])
}
