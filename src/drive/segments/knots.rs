//! The grid of a link: slices of equal length in show time, whose ends are whole ticks of a drive.

use std::time::Duration;

use super::model::TICK_NS;

/// Counts the ends of slices in ticks of one drive. Each is rounded by itself, so that nothing is lost over a film.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Knots {
    /// Ticks a slice by our clock.
    slice: f64,
    /// How fast the drive's clock runs against ours.
    clock: f64,
    /// Ticks at the knot from which the clock is as it is, and how many slices ago that was.
    since: (f64, u32),
    /// Whole ticks up to the last knot.
    last: i64,
}

/// The end of a slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knot {
    /// Ticks from the one before.
    pub(crate) ticks: u32,
    /// How much later than the exact end the tick is, in slices; -0.5 to 0.5 ticks.
    pub(crate) late: f64,
}

impl Knots {
    /// How far the drive's clock may be off ours: a tenth of a percent for its crystal, and one for a grid that is stretched.
    const CLOCK: (f64, f64) = (0.989, 1.011);

    /// Slices of a period, at least 4 ticks, from knot 0 at tick 0.
    #[must_use]
    pub(crate) fn new(period: Duration) -> Self {
        let slice = (period.as_secs_f64() * 1e9 / f64::from(TICK_NS)).clamp(4.0, 1e6);
        Self { slice, clock: 1.0, since: (0.0, 0), last: 0 }
    }

    /// From the next knot on the drive's clock runs so fast against ours, held within 1.1 %.
    pub(crate) fn set_clock(&mut self, clock: f64) {
        if clock.is_finite() {
            self.since = (self.exact(), 0);
            self.clock = clock.clamp(Self::CLOCK.0, Self::CLOCK.1);
        }
    }

    /// So many ticks were put in behind the last knot: the next comes no later for that.
    pub(crate) fn put_in(&mut self, ticks: u32) {
        self.last += i64::from(ticks);
    }

    /// Ticks of the drive that an exact slice takes.
    #[must_use]
    pub(crate) fn slice(&self) -> f64 {
        self.slice * self.clock
    }

    fn exact(&self) -> f64 {
        self.since.0 + f64::from(self.since.1) * self.slice()
    }

    /// The end of the next slice.
    #[expect(clippy::cast_possible_truncation, reason = "a film is some 1e8 ticks")]
    #[expect(clippy::cast_sign_loss, reason = "knots are at least 3 ticks apart")]
    #[expect(clippy::cast_precision_loss, reason = "a film is some 1e8 ticks")]
    pub(crate) fn next(&mut self) -> Knot {
        self.since.1 += 1;
        let exact = self.exact();
        let whole = exact.round() as i64;
        // What was put in may be longer than a slice.
        let whole = whole.max(self.last + 1);
        let ticks = (whole - self.last) as u32;
        self.last = whole;
        Knot { ticks, late: (whole as f64 - exact) / self.slice() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(knots: &mut Knots, slices: usize) -> u32 {
        (0..slices).map(|_| knots.next().ticks).sum()
    }

    #[test]
    fn ten_milliseconds_are_83_ticks_and_a_third_and_none_is_lost_in_two_hours() {
        let mut knots = Knots::new(Duration::from_millis(10));
        assert_eq!([0; 3].map(|_| knots.next().ticks), [83, 84, 83]);
        assert_eq!(250 + ticks(&mut knots, 720_000 - 3), 60_000_000);
    }

    #[test]
    fn a_drive_whose_clock_is_fast_is_given_more_ticks_from_then_on() {
        let mut knots = Knots::new(Duration::from_millis(12));
        assert_eq!(ticks(&mut knots, 1_000), 100_000);
        knots.set_clock(1.000_1);
        assert_eq!(ticks(&mut knots, 1_000), 100_010);
        knots.set_clock(f64::NAN);
        assert_eq!(ticks(&mut knots, 1_000), 100_010);
        knots.set_clock(7.0);
        assert_eq!(ticks(&mut knots, 1_000), 101_100);
    }
}
