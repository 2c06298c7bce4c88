//! What the threads of a play or of a hall come back with.

use crate::belief::Tally;
use crate::limiter::Counts;
use crate::plan::PlanError;
use crate::rt::{Accounts, Ended, Spun};
use crate::sys::realtime::RealTime;
use crate::time::MonoTime;

/// What the threads of a play, or of a hall with all its shows, came back with.
#[derive(Debug)]
pub(crate) struct Run {
    /// What the tick loop did.
    pub(crate) ended: Ended,
    /// Everything that was counted.
    pub(crate) accounts: Accounts,
    /// What the system granted the tick thread.
    pub(crate) granted: RealTime,
    /// How long it spun before its deadlines.
    pub(crate) spun: Spun,
    /// Moves that the planner did not find.
    pub(crate) refusals: Vec<PlanError>,
    /// What the limiter had to do, lane by lane.
    pub(crate) clamps: Vec<Counts>,
    /// What the check of where seats may be had to do, lane by lane.
    pub(crate) tallies: Vec<Tally>,
    /// Lanes that ended where nobody knows.
    pub(crate) lost_sight_of: Vec<usize>,
    /// The instant of tick 0.
    pub(crate) origin: MonoTime,
    /// The instant at which the accounts were closed.
    pub(crate) closed_at: MonoTime,
}

impl Run {
    /// Seconds from tick 0, below zero before it.
    pub(super) fn seconds_from_origin(&self, at: MonoTime) -> f64 {
        at.since(self.origin).as_secs_f64() - self.origin.since(at).as_secs_f64()
    }
}
