//! The clock of a unit against ours: which of its ticks is when.

use crate::drive::TICK_NS;
use crate::time::MonoTime;

/// How much of what a reading is off counts for the tick, and for the rate. Readings are whole ticks, and what the line adds; the
/// pair settles within some ten of them without swinging.
const PLACE: f64 = 0.4;
const RATE: f64 = 0.1;
/// How far a crystal is off at most.
const CRYSTAL: f64 = 0.001;
/// A reading that is farther off is none of this segment, in ticks.
const FARTHEST: f64 = 100.0;

/// Ticks of a unit since its queue began to run.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnitClock {
    at: MonoTime,
    ticks: f64,
    /// Of its ticks to ours.
    pub(super) rate: f64,
    readings: u32,
}

impl UnitClock {
    /// Of a crystal of which nothing is known.
    pub(super) const fn new() -> Self {
        Self { at: MonoTime::from_nanos(0), ticks: 0.0, rate: 1.0, readings: 0 }
    }

    /// Its queue begins to run; what is known of its rate stays.
    pub(super) const fn start(&mut self, at: MonoTime) {
        (self.at, self.ticks, self.readings) = (at, 0.0, 0);
    }

    /// The tick at an instant.
    pub(super) fn ticks(&self, at: MonoTime) -> f64 {
        self.ticks + seconds(at, self.at) * self.per_second()
    }

    /// The instant of a tick.
    pub(super) fn when(&self, ticks: f64) -> MonoTime {
        after(self.at, (ticks - self.ticks) / self.per_second())
    }

    /// It was at a tick at an instant; false where that cannot be.
    pub(super) fn see(&mut self, at: MonoTime, ticks: f64) -> bool {
        let off = ticks - self.ticks(at);
        if off.abs() > FARTHEST {
            return false;
        }
        let since = seconds(at, self.at);
        // The first tells how long the request took that started it.
        let place = if self.readings == 0 { 1.0 } else { PLACE };
        if self.readings > 0 && since > 0.0 {
            let own = RATE * off / (since * PER_SECOND);
            self.rate = (self.rate + own).clamp(1.0 - CRYSTAL, 1.0 + CRYSTAL);
        }
        (self.ticks, self.at) = (ticks - (1.0 - place) * off, at);
        self.readings += 1;
        true
    }

    fn per_second(&self) -> f64 {
        PER_SECOND * self.rate
    }
}

/// Ticks a second of a crystal that is right.
const PER_SECOND: f64 = 1e9 / TICK_NS as f64;

/// From one instant to a later one, seconds; negative where it is earlier.
#[expect(clippy::cast_precision_loss, reason = "spans of hours to the nanosecond")]
pub(super) fn seconds(at: MonoTime, from: MonoTime) -> f64 {
    at.as_nanos().wrapping_sub(from.as_nanos()).cast_signed() as f64 * 1e-9
}

/// So many seconds after an instant, or before it.
#[expect(clippy::cast_possible_truncation, reason = "spans of hours")]
pub(super) fn after(at: MonoTime, seconds: f64) -> MonoTime {
    MonoTime::from_nanos(at.as_nanos().saturating_add_signed((seconds * 1e9).round() as i64))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn it_finds_a_crystal_that_is_off_and_keeps_to_its_ticks() {
        for ppm in [-200.0, 0.0, 200.0] {
            let begin = MonoTime::from_nanos(5_000_000_000);
            let mut clock = UnitClock::new();
            clock.start(begin);
            let truth = |at| (seconds(at, begin) * PER_SECOND * (1.0 + ppm * 1e-6)).floor();
            let mut worst = 0.0_f64;
            for reading in 1..60_u32 {
                let at = begin + Duration::from_millis(500) * reading;
                assert!(clock.see(at, truth(at)));
                let later = at + Duration::from_millis(400);
                worst = worst.max((clock.ticks(later) - truth(later)).abs());
            }
            assert!((clock.rate - 1.0 - ppm * 1e-6).abs() < 3e-5 && worst < 3.0, "{ppm}: {clock:?} {worst}");
            let at = begin + Duration::from_secs(31);
            assert!(seconds(clock.when(clock.ticks(at)), at).abs() < 1e-6);
            assert!(!clock.see(at, truth(at) + 300.0), "half a segment off is another segment");
        }
    }
}
