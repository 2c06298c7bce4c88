//! Whether a source is good enough to lead seats.

use super::{DOUBT, SURE_S, SourceTracker};
use crate::time::MonoTime;

/// What a source has proved.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SourceGrade {
    is_fine: bool,
}

impl SourceGrade {
    /// True if a source may lead: if it is as good as it has to be, or nobody minds that it is not. A kind that is coarse has to prove
    /// itself; what was proved is lost at twice the error, so that none goes to and fro.
    pub(crate) fn may_lead(&mut self, tracker: &SourceTracker, allows_coarse: bool, now: MonoTime) -> bool {
        let is_within = |limit_s: f64| tracker.sigma_s(now).is_some_and(|sigma| 3.0 * sigma < limit_s);
        // One that tells once a second may have been stopped for that long.
        let is_slow = tracker.newest.is_some_and(|newest| newest.period > super::WINDOW);
        // What was locked is within the wider limit by the rule of the lock, so that fine kinds lead as soon as they lock.
        let needed = if tracker.traits.coarse && !self.is_fine { SURE_S } else { DOUBT * SURE_S };
        self.is_fine = is_within(needed) && !(tracker.traits.coarse && is_slow);
        self.is_fine || allows_coarse
    }
}
