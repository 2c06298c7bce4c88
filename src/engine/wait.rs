//! Between shows: an engine that is loaded waits until somebody lets it go, and the next takes over what the last one knows
//! of the lanes. Nothing is sent meanwhile.

use super::{Engine, Phase, Rest, Rider};
use crate::engine::Mix;
use crate::motion::{MAX_AXES, Pose, Window};
use crate::time::TRIM_MS;

/// A seat this near its park pose is there, strokes: 0.1 mm of 150.
const AT_PARK: Pose = [0.000_7; MAX_AXES];

/// About a pulse of a bench seat: nearer no frame leads.
const A_PULSE: Pose = [0.000_004; MAX_AXES];

impl Engine {
    /// The same, waiting to be let go ([`super::Directive::Play`]).
    #[must_use]
    pub fn waiting(mut self) -> Self {
        self.phase = Phase::Waiting;
        self
    }

    /// The same with nothing known of any lane, and at rest: nothing goes to a lane before it is said to be found.
    #[must_use]
    pub fn unknown(mut self) -> Self {
        self.riders.iter_mut().for_each(Rider::cut);
        self.rest_untold();
        self
    }

    /// The same with what operators want of each lane from the first frame on.
    #[must_use]
    pub fn mixed(mut self, mixes: &[Mix]) -> Self {
        for (rider, mix) in self.riders.iter_mut().zip(mixes) {
            rider.wanted = *mix;
            rider.out = !mix.on;
        }
        self
    }

    /// It was made for that trim: its show starts where the motion then is in the cue, so that nothing has to be slewed in. What
    /// it is told of any other trim counts from there.
    pub fn begin_trimmed(&mut self, ms: i32) {
        self.trim_ms = ms.clamp(-TRIM_MS, TRIM_MS);
    }

    /// Takes over from the engine that is done: lanes to which nothing goes stay so, and the others are to be found.
    pub fn take_over(&mut self, before: &Self) {
        for (rider, old) in self.riders.iter_mut().zip(&before.riders) {
            rider.go_on_from(old);
        }
    }

    /// Whether a lane that frames may go to is elsewhere than at park.
    #[must_use]
    pub fn is_astray(&self) -> bool {
        self.is_any_off_park(&AT_PARK)
    }

    /// Whether a lane that frames may go to is farther than that from park.
    fn is_any_off_park(&self, near: &Pose) -> bool {
        let is_off = |rider: &Rider| !is_at(&rider.window, rider.pose(), &rider.window.park(), near);
        self.riders.iter().any(|rider| rider.is_there() && is_off(rider))
    }

    /// Whether lanes that are to park rest there already, and nobody is waited for.
    pub(super) fn is_parked_untold(&self) -> bool {
        let is_awaited = self.riders.iter().any(Rider::is_awaited);
        self.is_to_park() && self.sends_nothing() && !is_awaited && !self.is_any_off_park(&A_PULSE)
    }

    /// At rest, and no frame says so: the seats have not moved.
    pub(super) fn rest_untold(&mut self) {
        self.riders.iter_mut().for_each(Rider::halt);
        self.holds.skip();
        self.phase = Phase::Resting(Rest::Stopped);
    }

    /// True if lanes at rest have been told so, or so often that it is known which of them have not heard of it.
    pub(super) fn is_told(&self) -> bool {
        self.holds.are_over() && !self.riders.iter().any(Rider::is_blind)
    }

    /// Whether no frame tells a lane that it is to rest.
    pub(super) fn sends_nothing(&self) -> bool {
        match self.phase {
            Phase::Waiting | Phase::Done => true,
            Phase::Resting(Rest::Paused | Rest::Stopped) => self.is_told(),
            _ => false,
        }
    }
}

/// Whether two poses are the same as far as the window moves, to so many strokes of each slot.
pub(super) fn is_at(window: &Window, pose: &Pose, other: &Pose, near: &Pose) -> bool {
    window.moving().all(|(slot, _)| (pose[slot] - other[slot]).abs() <= near[slot])
}
