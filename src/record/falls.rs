//! When a seat fell out of a show and came back, as its samples tell.

use std::time::Duration;

use super::ack_record::standing_of;
use super::sampled::SeatSample;
use crate::health::HealthState;
use crate::time::MonoTime;

/// The falls of one seat.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Falls {
    /// How often it fell out.
    pub(crate) count: u64,
    /// The first time: the show time, s, and how its group stood then.
    pub(crate) first: Option<(f64, HealthState)>,
    /// When it fell out first, and last.
    pub(crate) at: Option<(MonoTime, MonoTime)>,
    /// Show time at which it could move again after the last time, s; none while it is out.
    pub(crate) back_s: Option<f64>,
    /// Whether it could move last; none before it is known.
    may_move: Option<bool>,
}

impl Falls {
    /// Takes the next sample.
    pub(crate) fn take(&mut self, at: MonoTime, sample: &SeatSample) {
        let Some(standing) = sample.standing.and_then(standing_of) else { return };
        let before = self.may_move.replace(standing.may_move());
        match (before, standing.may_move()) {
            (Some(true), false) => {
                self.count += 1;
                self.first.get_or_insert((sample.film_s, standing));
                self.at = Some((self.at.map_or(at, |(first, _)| first), at));
                self.back_s = None;
            }
            (Some(false), true) => self.back_s = Some(sample.film_s),
            _ => {}
        }
    }

    /// How far from an instant the nearer of its first and its last fall is; `None` where it did not fall.
    pub(crate) fn distance(&self, at: MonoTime) -> Option<Duration> {
        let (first, last) = self.at?;
        Some([first, last].map(|one| one.since(at).max(at.since(one))).into_iter().min().unwrap_or_default())
    }

    /// True while it cannot move that could.
    pub(crate) fn is_out(&self) -> bool {
        self.count > 0 && self.may_move == Some(false)
    }
}
