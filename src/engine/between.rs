//! Between shows: an engine that is loaded waits until somebody lets it go, and the next takes over what the last one knows
//! of the lanes. Nothing is sent meanwhile.

use super::lane::LaneMotion;
use super::phase::Phase;
use super::{Engine, Mix};
use crate::motion::{MAX_AXES, Pose};

/// A seat this near its park pose is there, strokes: 0.1 mm of 150.
const AT_PARK: Pose = [0.000_7; MAX_AXES];

/// About a pulse of a bench seat: nearer no frame leads.
const A_PULSE: Pose = [0.000_004; MAX_AXES];

impl Engine {
    /// The same, waiting to be let go ([`super::Directive::Play`]).
    #[must_use]
    pub fn waiting(mut self) -> Self {
        self.phase.carry(Phase::Waiting);
        self
    }

    /// The same with nothing known of any lane, and at rest: nothing goes to a lane before it is said to be found.
    #[must_use]
    pub fn unknown(mut self) -> Self {
        self.lanes.all.iter_mut().for_each(LaneMotion::cut);
        self.rest_untold();
        self
    }

    /// The same with what operators want of each lane from the first frame on.
    #[must_use]
    pub(crate) fn mixed(mut self, mixes: &[Mix]) -> Self {
        for (motion, mix) in self.lanes.all.iter_mut().zip(mixes) {
            (motion.wanted, motion.out) = (*mix, !mix.on);
        }
        self
    }

    /// It was made for that trim: its show starts where the motion then is in the cue, so that nothing has to be slewed in. What
    /// it is told of any other trim counts from there.
    pub fn begin_trimmed(&mut self, ms: i32) {
        self.playhead.begin_trimmed(ms);
    }

    /// Takes over from the engine that is done: lanes to which nothing goes stay so, and the others are to be found.
    pub(crate) fn take_over(&mut self, before: &Self) {
        let lanes = self.lanes.all.iter_mut().zip(&before.lanes.all);
        lanes.for_each(|(motion, old)| motion.go_on_from(old));
    }

    /// Whether a lane that frames may go to is elsewhere than at park.
    #[must_use]
    pub(crate) fn is_astray(&self) -> bool {
        self.lanes.is_any_off_park(&AT_PARK)
    }

    /// Whether lanes that are to park rest there already, and nobody is waited for.
    pub(super) fn is_parked_untold(&self) -> bool {
        let is_awaited = self.lanes.all.iter().any(LaneMotion::is_awaited);
        self.is_to_park() && self.sends_nothing() && !is_awaited && !self.lanes.is_any_off_park(&A_PULSE)
    }
}
