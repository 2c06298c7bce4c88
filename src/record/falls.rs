//! When a seat fell out of a show and came back, as its samples tell.

use std::time::Duration;

use super::ack_record::standing_of;
use super::sampled::SeatSum;
use crate::health::HealthState;
use crate::time::MonoTime;

/// An instant, and its show time, s.
pub(crate) type FilmInstant = (MonoTime, f64);

/// A fall of one seat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SeatFall {
    /// The last sample before it in which the seat was sent somewhere: from then on it stood still, and that it is out was found later.
    /// `None` where it was not sent anywhere before.
    pub(crate) still: Option<FilmInstant>,
    /// When its group was found to stand so that it may not move.
    pub(crate) out: FilmInstant,
    /// How it stood then.
    pub(crate) standing: HealthState,
    /// When it could move again.
    pub(crate) back: Option<FilmInstant>,
    /// The first sample after that in which it was sent somewhere.
    pub(crate) moved: Option<FilmInstant>,
}

/// The falls of one seat.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Falls {
    /// How often it fell out.
    pub(crate) count: u64,
    /// The first time.
    pub(crate) first: Option<SeatFall>,
    /// When it fell out last.
    last: MonoTime,
    /// The last sample in which it was sent somewhere.
    sent: Option<FilmInstant>,
    /// Whether it could move last; none before it is known.
    may_move: Option<bool>,
}

impl Falls {
    /// Takes the next sample.
    pub(crate) fn take(&mut self, at: MonoTime, sample: &SeatSum) {
        let now = (at, sample.film_s);
        if sample.is_sent {
            self.sent = Some(now);
        }
        if let Some(standing) = sample.standing.and_then(standing_of) {
            let before = self.may_move.replace(standing.may_move());
            match (before, standing.may_move()) {
                (Some(true), false) => {
                    self.count += 1;
                    self.last = at;
                    let (still, back, moved) = (self.sent, None, None);
                    self.first.get_or_insert(SeatFall { still, out: now, standing, back, moved });
                }
                (Some(false), true) if self.count == 1 => {
                    self.first.iter_mut().for_each(|fall| fall.back = Some(now));
                }
                _ => {}
            }
        }
        if let Some(fall) = self.first.as_mut().filter(|fall| sample.is_sent && fall.back.is_some()) {
            fall.moved.get_or_insert(now);
        }
    }

    /// How far from an instant the nearer of its first and its last fall is; `None` where it did not fall.
    pub(crate) fn distance(&self, at: MonoTime) -> Option<Duration> {
        let (first, last) = (self.first?.out.0, self.last);
        Some([first, last].map(|one| one.since(at).max(at.since(one))).into_iter().min().unwrap_or_default())
    }

    /// True while it cannot move that could.
    pub(crate) fn is_out(&self) -> bool {
        self.count > 0 && self.may_move == Some(false)
    }
}
