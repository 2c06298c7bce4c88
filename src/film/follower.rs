//! The playhead follows the film: never in a jump, a little faster or slower, and gently so. Tick thread; allocates nothing.
//!
//! The error is one: film minus trim minus playhead. How it is taken back keeps three limits: of the pace, of how quickly the pace
//! changes, and of how quickly that does, so that what the seats feel of it has no steps in speed, acceleration or jerk.

#[cfg(test)]
pub(in crate::film) mod tests;

use std::time::Duration;

use super::point::FilmPoint;
use crate::time::{MonoTime, ShowTime};

/// The time constant with which a small error goes, seconds: close to the goal nothing else limits the pace.
const CLOSES_IN_S: f64 = 0.5;
/// The share of the pace from which a gentle slowing down would just end at the goal: with less than all of it the lag of
/// the pace does not carry the playhead past.
const BRAKES_EARLY: f64 = 0.6;
/// How far the pace lags behind what is wanted, seconds; two ticks at least.
const PACE_LAGS_S: f64 = 0.12;
/// The change of the pace is reached, or left, in a tenth of a second.
const CHANGE_REACHED_S: f64 = 0.1;
/// How quickly the pace may change, as a multiple of the greatest slew, per second.
const CHANGE: f64 = 2.0;
/// Trim is slewed in while the error is less than this, seconds: from there on the pace that it needs is all that there is.
const TRIM_WAITS_S: f64 = 0.010;
/// Below these an error and a difference of pace are rounding, seconds and a share.
const NOTHING_S: f64 = 1e-9;
const NO_PACE: f64 = 4e-9;

/// How the pace of the playhead may differ from the clock's. The proof of a cue is made for the greatest that they allow together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PaceLimits {
    /// How far from 1 the film's own rate is followed. 0.15 % covers pull-downs and crystals.
    pub(crate) band: f64,
    /// How far from the film's rate the playhead's may be to take an error back.
    pub(crate) slew: f64,
}

impl Default for PaceLimits {
    /// With 1 % an error of a frame is gone in 4 s, and jerk grows by 3.5 % at the most.
    fn default() -> Self {
        Self { band: 0.0015, slew: 0.01 }
    }
}

impl PaceLimits {
    /// How far the pace may be from the clock's at the most: ends of cues and joins are made for no more.
    pub(crate) const MOST_OFF: f64 = 0.02;

    /// False if a film may ask for a pace that no seat is given. Rounding is no pace.
    pub(crate) fn is_kept_by_seats(&self) -> bool {
        self.band + self.slew <= Self::MOST_OFF + NO_PACE
    }

    /// The greatest pace that can be asked for.
    #[must_use]
    pub(crate) const fn most(&self) -> f64 {
        1.0 + self.band + self.slew
    }

    /// How quickly the pace changes at the most, per second.
    #[must_use]
    pub(crate) const fn change_per_s(&self) -> f64 {
        CHANGE * self.slew
    }
}

/// The playhead and its pace.
#[derive(Debug, Clone)]
pub(crate) struct Follower {
    limits: PaceLimits,
    playhead: ShowTime,
    pace: f64,
    /// How quickly the pace changes, per second.
    change: f64,
    /// What of the trim is slewed in, seconds.
    trim_s: f64,
}

impl Follower {
    /// A playhead that has followed nothing yet.
    #[must_use]
    pub(crate) const fn new(limits: PaceLimits) -> Self {
        Self { limits, playhead: ShowTime::ZERO, pace: 1.0, change: 0.0, trim_s: 0.0 }
    }

    /// Where in the cue the frame of this tick leads.
    #[must_use]
    pub(crate) const fn playhead(&self) -> ShowTime {
        self.playhead
    }

    /// How many times as fast as the clock it moves.
    #[must_use]
    pub(crate) const fn pace(&self) -> f64 {
        self.pace
    }

    /// The film's rate as far as it is followed.
    fn rate_of(&self, point: &FilmPoint) -> f64 {
        // Beyond the band the tracker says so and seats hold; until it does, they follow no further.
        let rate = if point.rate.is_finite() { point.rate } else { 1.0 };
        rate.clamp(1.0 - self.limits.band, 1.0 + self.limits.band)
    }

    /// How far the film, less the trim, is ahead of where the playhead would be at the end of a frame, seconds.
    #[must_use]
    pub(crate) fn error_s(&self, point: &FilmPoint, end: MonoTime, frame: Duration) -> f64 {
        // At the frame's end, less what the playhead moves by itself: the rest has to be slewed.
        let ahead = point.media_at(end).since(self.playhead).as_nanos();
        ShowTime::from_nanos(ahead).as_secs_f64() - self.trim_s - frame.as_secs_f64() * self.rate_of(point)
    }

    /// Puts the playhead where the film is at the end of a frame; seats get there by a join.
    pub(crate) fn join(&mut self, point: &FilmPoint, end: MonoTime, trim_ms: i32) {
        self.trim_s = f64::from(trim_ms) * 1e-3;
        let trim = ShowTime::from_secs_f64(self.trim_s).as_nanos();
        self.playhead = ShowTime::from_nanos(point.media_at(end).as_nanos().saturating_sub(trim));
        // It goes on as the film does: what was off is the matter of the join, and not of a slew.
        (self.pace, self.change) = (self.rate_of(point), 0.0);
    }

    /// Moves the playhead on by one frame that ends at `end`.
    pub(crate) fn follow(&mut self, point: &FilmPoint, end: MonoTime, frame: Duration, trim_ms: i32) {
        let dt = frame.as_secs_f64();
        if dt <= 0.0 {
            return;
        }
        self.slew_trim(point, (end, frame), trim_ms);
        let (error, rate) = (self.error_s(point, end, frame), self.rate_of(point));
        if error.abs() < NOTHING_S && (self.pace - rate).abs() < NO_PACE {
            // Exactly: else rounding would keep the pace, and what hangs on it, in motion for ever.
            (self.pace, self.change) = (rate, 0.0);
        } else {
            let most = self.limits.change_per_s();
            // From a slew c, changing by r, the playhead comes c²/2r further: so c may be √(2r e) at an error e.
            let braked = BRAKES_EARLY * (2.0 * most * error.abs()).sqrt();
            let extra = self.limits.slew.min(error.abs() / CLOSES_IN_S).min(braked) * error.signum();
            let wanted = ((rate + extra - self.pace) / PACE_LAGS_S.max(2.0 * dt)).clamp(-most, most);
            // The change itself has no steps, or the acceleration of a moving seat would have them.
            let step = most / CHANGE_REACHED_S * dt;
            self.change = wanted.clamp(self.change - step, self.change + step);
            let (least, most) = (2.0 - self.limits.most(), self.limits.most());
            self.pace = (self.pace + self.change * dt).clamp(least, most);
        }
        self.playhead += frame.mul_f64(self.pace);
    }

    /// Takes the trim in at the pace that a slew may have, and waits with it for the playhead.
    fn slew_trim(&mut self, point: &FilmPoint, (end, frame): (MonoTime, Duration), trim_ms: i32) {
        let left = f64::from(trim_ms) * 1e-3 - self.trim_s;
        if left != 0.0 && self.error_s(point, end, frame).abs() < TRIM_WAITS_S {
            let step = self.limits.slew * frame.as_secs_f64();
            self.trim_s = if left.abs() <= step {
                f64::from(trim_ms) * 1e-3
            } else {
                self.trim_s + step * left.signum()
            };
        }
    }
}
