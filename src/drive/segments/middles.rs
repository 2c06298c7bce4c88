//! From the poses of the tick thread to what an axis does in the middle of each slice of a link's grid.
//!
//! Poses come tick by tick, as they come to controllers, since the limiter, the last that may change one, knows ticks
//! alone; so parks, joins and brakes go the same road as cues. The grid of a link need not divide the show's rate: between
//! ticks a cubic through the four around is exact to a thousandth of a millimetre.

use std::time::Duration;

/// What an axis does in the middle of a slice.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Middle {
    /// The place, in the unit of the poses.
    pub(crate) position: f64,
    /// The same a second.
    pub(crate) velocity: f64,
}

impl Middle {
    /// By the cubic through four poses a `tick` apart, seconds: what the axis does `part` of a tick behind the second of them.
    #[must_use]
    pub(crate) fn between([a, b, c, d]: [f64; 4], part: f64, tick: f64) -> Self {
        // By its differences about the second pose: what stands still stays so to the last bit.
        let (before, first, after) = (b - a, c - b, d - c);
        let (second, third) = (first - before, (after - first) - (first - before));
        let slope = first - second / 2.0 - third / 6.0;
        let (bend, twist) = (second / 2.0, third / 6.0);
        let position = b + part * (slope + part * (bend + part * twist));
        Self { position, velocity: (slope + part * (2.0 * bend + 3.0 * part * twist)) / tick }
    }
}

/// Makes middles of poses, one axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Middles {
    /// Between poses, ns.
    tick: i64,
    /// Between middles, ns.
    slice: i64,
    /// The newest pose last.
    poses: [f64; 4],
    /// The next middle, from the second of the poses on, ns.
    next: i64,
}

impl Middles {
    /// At rest at `position` up to the first slice. The first pose that is pushed is that at its beginning, the others
    /// follow it a `tick` apart.
    #[must_use]
    pub(crate) fn at_rest(tick: Duration, slice: Duration, position: f64) -> Self {
        let ns = |span: Duration| i64::try_from(span.as_nanos()).unwrap_or(i64::MAX / 8).max(1);
        let (tick, slice) = (ns(tick), ns(slice));
        // The pose at 0 comes to stand second with the third push.
        Self { tick, slice, poses: [position; 4], next: slice / 2 + 3 * tick }
    }

    /// Takes the next pose; one that is no number is as the one before. To be followed by [`Self::next`] until there is none.
    pub(crate) fn push(&mut self, pose: f64) {
        let pose = if pose.is_finite() { pose } else { self.poses[3] };
        self.poses = [self.poses[1], self.poses[2], self.poses[3], pose];
        self.next -= self.tick;
    }

    /// The next middle that the poses reach beyond.
    #[expect(clippy::cast_precision_loss, reason = "spans of some milliseconds")]
    pub(crate) fn next(&mut self) -> Option<Middle> {
        if self.next >= self.tick {
            return None;
        }
        let part = self.next as f64 / self.tick as f64;
        self.next += self.slice;
        Some(Middle::between(self.poses, part, self.tick as f64 * 1e-9))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: fn(u64) -> Duration = Duration::from_millis;

    fn all(tick: Duration, slice: Duration, pushed: u32, pose: impl Fn(f64) -> f64) -> Vec<Middle> {
        let mut middles = Middles::at_rest(tick, slice, pose(0.0));
        let mut all = Vec::new();
        for index in 0..pushed {
            middles.push(pose(f64::from(index) * tick.as_secs_f64()));
            while let Some(middle) = middles.next() {
                all.push(middle);
            }
        }
        all
    }

    #[test]
    fn a_cubic_is_met_in_place_and_speed_however_the_grids_fall() {
        let cubic = |t: f64| 3.0 + t * t * (2.0 - t);
        for (tick, slice) in [(MS(10), MS(33)), (MS(10), MS(10)), (MS(10), MS(2)), (MS(1), MS(67))] {
            let all = all(tick, slice, 1_000, cubic);
            assert!(all.len() >= 14, "{}", all.len());
            let (slice, tick) = (slice.as_secs_f64(), tick.as_secs_f64());
            for (k, middle) in (0_u32..).zip(all) {
                let t = (f64::from(k) + 0.5) * slice;
                if t > tick {
                    assert!((middle.position - cubic(t)).abs() < 1e-6, "{k} {middle:?} {}", cubic(t));
                    assert!((middle.velocity - t * (4.0 - 3.0 * t)).abs() < 1e-5, "{k} {middle:?}");
                }
            }
        }
    }

    #[test]
    fn what_stands_still_stands_still_to_the_last_bit_and_nonsense_changes_nothing() {
        let still = Middle { position: 0.123_456_789, velocity: 0.0 };
        let all = all(MS(10), MS(33), 100, |t| if t > 0.3 { f64::NAN } else { 0.123_456_789 });
        assert!(all.len() > 25 && all.iter().all(|middle| *middle == still), "{all:?}");
    }
}
