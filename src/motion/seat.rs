//! A seat type: the axes of one controller, and where their motors may be found.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use super::{AxisGeometry, AxisUnit, MAX_AXES};

/// The longest Time that a controller executes as it leaves the factory, ms (PA0b, IMAX manual 2.3.1).
pub(crate) const FACTORY_INTERVAL_MS: u32 = 3_000;

/// A motor position as the controller counts it: whole pulses from where its zero is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Pulses(pub i32);

/// What the controllers of some seats drive.
#[derive(Debug, Clone, PartialEq)]
pub struct SeatType {
    /// The name it has in the configuration.
    pub(crate) name: String,
    /// Axes of one controller, 1 to 12.
    pub axes: usize,
    /// Range and limits of each axis; past the last one those of what pads a frame ([`AxisGeometry::padding`]).
    pub each: [AxisGeometry; MAX_AXES],
    /// The longest Time that the controller executes as it is, ms (PA0b).
    pub(crate) max_interval_ms: u32,
    /// Level of vibration on such seats, 0 to 1, on top of all that operators set. At 0 their frames carry none.
    pub(crate) vibration: f64,
}

impl SeatType {
    /// The axes of a cue, from 0, that such a seat takes from `first` on. It may have more: no cue has anything for those.
    #[must_use]
    pub(crate) fn axes_from(&self, first: usize) -> Range<usize> {
        first..MAX_AXES.min(first + self.axes)
    }

    /// The seat that `--to` means: the bench seat with that many axes.
    #[must_use]
    pub fn bench3(axes: usize) -> Self {
        Self {
            name: "bench3".to_owned(),
            axes,
            each: [AxisGeometry::BENCH; MAX_AXES],
            max_interval_ms: FACTORY_INTERVAL_MS,
            vibration: 1.0,
        }
    }

    /// The same seat with a change to each axis.
    #[must_use]
    pub fn with_each(mut self, change: impl FnMut(&mut AxisGeometry)) -> Self {
        self.each.iter_mut().for_each(change);
        self
    }

    /// The axes that it has.
    #[must_use]
    pub(crate) fn own(&self) -> &[AxisGeometry] {
        &self.each[..self.axes]
    }

    /// The axis that turns, from 0, where it has one: it has no stop at its ends and no search for its zero, which is where it
    /// stands when its controller starts or is homed (SMC manual 5.7).
    #[must_use]
    pub(crate) fn rotary_axis(&self) -> Option<usize> {
        self.own().iter().position(|axis| axis.unit == AxisUnit::Degree)
    }

    /// Between which pulses the motor of each axis stands, and of each place of a frame behind them.
    #[must_use]
    pub(crate) fn pulse_ranges(&self) -> [PulseRange; MAX_AXES] {
        self.each.each_ref().map(AxisGeometry::pulse_range)
    }

    /// Those of its axes that differ from the ones before, each with its place.
    pub(crate) fn different(&self) -> impl Iterator<Item = (usize, &AxisGeometry)> {
        let is_new = |(index, axis): &(usize, &AxisGeometry)| !self.each[..*index].contains(axis);
        self.own().iter().enumerate().filter(is_new)
    }
}

/// One axis of a seat type.
#[derive(Debug, Clone, PartialEq)]
pub struct SeatAxis {
    /// The seat type.
    pub(crate) seat: Arc<SeatType>,
    /// Which of its axes, from 0.
    pub(crate) index: usize,
}

impl SeatAxis {
    /// An axis of a seat, from 0.
    #[must_use]
    pub fn new(seat: &Arc<SeatType>, index: usize) -> Self {
        Self { seat: Arc::clone(seat), index }
    }

    /// Its range and limits.
    #[must_use]
    pub fn geometry(&self) -> &AxisGeometry {
        &self.seat.each[self.index]
    }

    /// True if the other is the same in all but its place on the seat.
    #[must_use]
    pub(crate) fn is_as(&self, other: &Self) -> bool {
        self.seat.name == other.seat.name && self.geometry() == other.geometry()
    }
}

/// Between which pulses the motor of an axis stands, the lower first; below 0 where its zero is inside the range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PulseRange {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl PulseRange {
    /// Pulses from one end to the other.
    #[must_use]
    pub(crate) fn span(self) -> f64 {
        self.high - self.low
    }

    /// True if `pulses` is inside the range, its ends included.
    #[must_use]
    pub(crate) fn contains(self, pulses: Pulses) -> bool {
        (self.low..=self.high).contains(&f64::from(pulses.0))
    }
}

impl fmt::Display for PulseRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.0}..={:.0}", self.low, self.high)
    }
}

/// How far outside its stroke a motor may be found that stands at its end, in strokes: 0.15 mm of 150. Drives hold a
/// place to some pulses.
const ROUNDING: f64 = 0.001;

/// True if a motor of that range can stand at `pulses`: inside it, or outside by no more than rounding. What is
/// farther out is no position, but a wrong word order, another seat type, or a zero that was lost.
#[must_use]
pub(crate) fn in_stroke(pulses: Pulses, range: PulseRange) -> bool {
    let slack = (ROUNDING * range.span()).max(1.0);
    (range.low - slack..=range.high + slack).contains(&f64::from(pulses.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_is_found_outside_its_stroke_by_rounding_alone() {
        let of = |low, high| PulseRange { low, high };
        for (pulses, inside) in [(-301, false), (-300, true), (0, true), (300_300, true), (300_301, false)] {
            assert_eq!(in_stroke(Pulses(pulses), of(0.0, 300_000.0)), inside, "{pulses}");
        }
        assert!(in_stroke(Pulses(-1), of(0.0, 100.0)) && !in_stroke(Pulses(-2), of(0.0, 100.0)));
    }

    #[test]
    fn a_range_with_its_zero_in_the_middle_has_the_same_room_at_both_ends() {
        let turntable = PulseRange { low: -250_000.0, high: 250_000.0 };
        for (pulses, inside) in [(-250_500, true), (-250_501, false), (250_500, true), (250_501, false)] {
            assert_eq!(in_stroke(Pulses(pulses), turntable), inside, "{pulses}");
        }
        assert!(turntable.contains(Pulses(-250_000)) && !turntable.contains(Pulses(-250_001)));
        assert_eq!(turntable.to_string(), "-250000..=250000");
    }
}
