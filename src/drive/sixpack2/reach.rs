//! How far a motor goes by an order that was damaged on its way to its unit.
//!
//! Any nine octets are an order, and none carries a sum: by one octet that is another, or is there twice, a motor is led far away or turns
//! without end. It does at most its full speed (the unit's manual, page 28), which the divider of its clock decides; that the speed of `$14` held for
//! targets as well is nowhere said. It does so until the next order to it has arrived and its unit takes that up in its loop. Where
//! that is a target it comes back from there; a stop brakes it by the ramp of `$14`.

use std::time::Duration;

use super::scale::MotorScale;
use super::talk::{BREAK, LONGEST_DELAY, NINE, patience};
use crate::drive::LOOP;
use crate::motion::AxisGeometry;

/// From one order to a motor to the next, as long as the port is open and its thread runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OrderGap {
    /// From one slice to the next, where no question makes that late.
    pub(crate) period: Duration,
    /// How long an octet takes, at the rate of the link, and at that with which a question is asked.
    pub(crate) octets: [Duration; 2],
    /// Motors that are told something in a slice.
    pub(crate) motors: u32,
    /// What 99 of 100 answers take to begin.
    pub(crate) delay: Duration,
}

impl OrderGap {
    /// What answers take to begin at the most: later ones are not waited for.
    pub(crate) const LONGEST_DELAY: Duration = LONGEST_DELAY;

    /// At the most: a period, or all that is told in a slice where that is longer, and a question that is not answered.
    pub(crate) fn longest(self) -> Duration {
        let [octet, asked] = self.octets;
        // The end of a search goes with them.
        let slice = octet * (BREAK + (self.motors + 1) * NINE);
        self.period.max(slice) + asked * (BREAK + NINE) + patience(asked, self.delay)
    }
}

/// What an axis does by an order that was damaged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// The greatest speed of its motor, mm/s.
    full_mm_s: f64,
    /// The ramp of its stop, mm/s².
    ramp_mm_s2: f64,
}

impl Reach {
    /// Of an axis, by the divider of its unit's clock.
    pub(crate) fn of(axis: &AxisGeometry, clock_divider: u8) -> Self {
        let scale = MotorScale::of(axis, false, clock_divider);
        let ramp_mm_s2 = scale.ramp_mm_s2(scale.acceleration(axis.max_acceleration));
        Self { full_mm_s: scale.full_mm_s(), ramp_mm_s2 }
    }

    /// How far it goes beside its way where the next order is a target, mm, while the seat does so many mm/s.
    pub(crate) fn led_mm(self, gap: Duration, seat_mm_s: f64) -> f64 {
        (self.full_mm_s + seat_mm_s) * (gap + LOOP).as_secs_f64()
    }

    /// How far where that is a stop, mm: until then, and while it brakes from the next loop on.
    pub(crate) fn stopped_mm(self, gap: Duration) -> f64 {
        self.full_mm_s * (gap + 2 * LOOP).as_secs_f64() + self.full_mm_s.powi(2) / (2.0 * self.ramp_mm_s2)
    }
}
