//! What becomes of a source of which nothing is heard, or nothing that fits.

use std::time::Duration;

use super::states::SourceSign;
use super::{
    ACQUIRE_FOR, DOUBT, MISSING, MISSING_PERIODS, SURE_COARSE_S, SURE_S, SourceTracker, WINDOW_PERIODS,
};
use crate::film::point::FilmState;
use crate::time::MonoTime;

impl SourceTracker {
    /// The same with an estimate that may run on for longer, or less long. What was told, as a stop is, counts at once all the same.
    pub(crate) fn freewheeling(self, freewheel: f64) -> Self {
        Self { freewheel, ..self }
    }

    /// Notes that time has passed. To be told some times a second, whatever is heard.
    pub(crate) fn poll(&mut self, now: MonoTime) {
        // From poll to poll, so that it never goes back: a sample that ends the gap is older than the poll before it.
        let passed = now.since(std::mem::replace(&mut self.polled, now));
        self.counts.freewheel += if self.state == FilmState::Freewheeling { passed } else { Duration::ZERO };
        if self.may_stop.is_some_and(|since| now.since(since) > MISSING) {
            self.on_stop(now);
        }
        let quiet = self.newest.map_or_else(|| now.since(self.since), |newest| now.since(newest.at));
        let is_sought = matches!(self.state, FilmState::Acquiring | FilmState::Unusable);
        let unplaced = self.unplaced.filter(|_| is_sought).map_or(Duration::MAX, |at| now.since(at));
        let quiet = quiet.min(unplaced);
        let period = self.newest.map_or(Duration::ZERO, |newest| newest.period);
        if quiet > MISSING.max(MISSING_PERIODS * period) {
            self.on_sign(SourceSign::Miss, now);
        }
        let patience = self.patience.mul_f64(self.freewheel);
        let patience =
            // One that tells every few seconds is silent only after several of its own periods.
            patience.max(if self.traits.coarse { WINDOW_PERIODS * period } else { Duration::ZERO });
        if quiet > patience {
            self.on_sign(SourceSign::TimeOut, now);
        } else if self.state.may_lead() && now.since(self.fitted_at) > patience {
            self.lose_the_place(now);
        }
        if now.since(self.since) > ACQUIRE_FOR {
            self.on_sign(SourceSign::GiveUp, now);
        }
        self.doubt(now);
    }

    /// Positions come, and none is where the film should be, nor do they agree on where it is instead: nobody knows any more that it
    /// runs there. What is known of its place and rate rests on what has turned out to be none.
    fn lose_the_place(&mut self, at: MonoTime) {
        self.estimate = None;
        self.is_known = false;
        self.begin_anew();
        self.on_sign(SourceSign::Doubt, at);
    }

    /// Timecode came that tells no place: somebody is there, and has to be found.
    pub(super) fn on_unplaced(&mut self, at: MonoTime) {
        self.unplaced = Some(at);
        // Of a film that nobody follows yet this is as good a sign that it runs as a place.
        self.may_stop = self.may_stop.filter(|_| self.state.may_lead());
        self.on_sign(SourceSign::Sample, at);
    }

    /// True unless it stands, or nobody knows that it does anything.
    pub(super) const fn runs(&self) -> bool {
        !matches!(self.state, FilmState::Stopped | FilmState::Ended | FilmState::Absent | FilmState::Lost)
    }

    pub(super) fn on_stop(&mut self, at: MonoTime) {
        self.may_stop = None;
        self.recent.clear();
        self.on_sign(SourceSign::Stop, at);
    }

    /// The line is there and carries no timecode.
    pub(super) fn on_quiet(&mut self, patience: Duration, at: MonoTime) {
        self.patience = patience;
        self.on_sign(SourceSign::Miss, at);
    }

    /// An estimate that nobody may follow any more.
    pub(super) fn doubt(&mut self, now: MonoTime) {
        let limit = DOUBT * if self.traits.coarse { SURE_COARSE_S } else { SURE_S };
        if self.estimate.as_ref().is_some_and(|estimate| 3.0 * estimate.sigma_s(now) > limit) {
            self.on_sign(SourceSign::Doubt, now);
        }
    }
}
