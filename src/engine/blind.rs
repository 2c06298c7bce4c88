//! How a lane comes to rest of which nobody knows which frames arrive: by few frames of long Times, each a straight line that
//! is a step slower than the one before. Pure arithmetic; allocates nothing.
//!
//! A seat that hears all of them is to slow down within its limits, and one that heard none since any place of the gap is
//! not to be pulled after it. Let `h` be the distance from the pose sent last back to the farthest place where the axis may
//! be, and `s` the speed of the next line, which takes `T`. It ends `h + s T` from that place at the most, and so much
//! may be gone at the greatest speed `V` in `T`: `h + s T <= V T`, so `T >= h / (V - s)`. All axes of a frame share the
//! longest of their Times; a longer one than it needs leaves an axis more room, as `s < V`.
//!
//! A line meets the next in a step of speed. The measure (`motion::Spacing`) takes acceleration from poses 20 ms apart, so a
//! step `d` alone within its sight is `d / 20 ms`: one of `a` x 20 ms is just what the limit `a` allows, as long as no two of
//! them fall within 20 ms. That is why no line is shorter.
//!
//! What is gone is not known to be gone: after the line `h` is `h + s T = h V / (V - s)`, and near `V` that grows quickly.
//! Where all of the way to rest at the gentlest steps fits neither the stroke, nor the Times of the controller, nor a
//! second, the steps are as much larger as it takes. Speed comes first, the stroke second, acceleration third.
//!
//! The limiter works on the regular grid of frames, and these leave it: they are bounded by this arithmetic, and each by
//! `Belief::allows` before it is sent. The limiter is restarted from a reading before the lane moves again.

use crate::motion::{Limits, MAX_AXES, Pose, Spacing};
use crate::time::Rate;

/// What of the greatest speed is used: the rest is for roundings to pulses and milliseconds.
const SPEED_SHARE: f64 = 0.98;
/// What of the greatest acceleration a step uses: the seam with what the axis did before is seen by the measure as well.
const STEP_SHARE: f64 = 0.9;
/// How long the whole way may take, ms: it is gone without knowing where the seat is, and a stop waits for it.
pub(super) const LONGEST_WAY_MS: u32 = 1_000;
/// How long a line takes that leads nowhere, seconds, and until when they go out: nobody exchanges two cables or jogs far in that time.
const STILL_S: f64 = 0.1;
const STILL_FOR_MS: u32 = 200;
/// From one size of steps to the next that is tried, and how many are: the largest is 800 times the gentlest.
const HARDER: f64 = 1.12;
const TRIES: usize = 60;

/// One axis on its way; strokes and seconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlindAxis {
    place: f64,
    /// How fast it went there; signed.
    speed: f64,
    /// How far from there it may be at the most.
    farthest: f64,
    /// The greatest speed.
    velocity: f64,
    /// What one step takes from its speed.
    step: f64,
}

/// The grid of frames, from the next one on, and what it asks of lines.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) rate: Rate,
    /// The frame that comes next, counted from 0.
    pub(super) index: u64,
    /// The longest Time of one frame, ms.
    pub(super) longest_ms: u32,
    /// What is left of [`LONGEST_WAY_MS`].
    pub(super) left_ms: u32,
}

/// The next line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BlindLeg {
    /// Where each axis goes.
    pub(super) to: Pose,
    /// Its Time, and the ticks that it takes, the one in which it is sent included.
    pub(super) lasts_ms: u32,
    pub(super) ticks: u32,
}

/// The shortest line, and how far back speed is looked at, seconds: the distance of the measure.
pub(super) fn sight_s(rate: Rate) -> f64 {
    f64::from(sight_ticks(rate)) / rate.hz()
}

fn sight_ticks(rate: Rate) -> u32 {
    u32::try_from(Spacing::at_rate(rate.hz()).n).unwrap_or(u32::MAX)
}

impl BlindAxis {
    /// A slot of which the seat has no axis: it moves nothing.
    pub(super) const PADDING: Self =
        Self { place: 0.0, speed: 0.0, farthest: 0.0, velocity: f64::INFINITY, step: 0.0 };

    /// An axis at `place` that came there with `speed`, and may be `farthest` from there.
    pub(super) fn new(place: f64, speed: f64, farthest: f64, limits: &Limits, rate: Rate) -> Self {
        Self {
            place,
            speed,
            farthest,
            velocity: SPEED_SHARE * limits.velocity,
            step: STEP_SHARE * limits.acceleration * sight_s(rate),
        }
    }

    fn slow(&mut self, harder: f64) {
        // Down to 0 and not through it: the last step is only as large as the speed that is left.
        let speed = (self.speed.abs() - harder * self.step).max(0.0);
        self.speed = speed.copysign(self.speed);
    }

    /// How long a line at its speed has to be.
    fn needs_s(&self) -> f64 {
        let spare = self.velocity - self.speed.abs();
        // At all of its speed no Time lets a seat that heard nothing keep up with the line.
        if spare > 0.0 { self.farthest / spare } else { f64::INFINITY }
    }

    fn go(&mut self, seconds: f64) {
        self.place += self.speed * seconds;
        self.farthest += self.speed.abs() * seconds;
    }
}

impl Grid {
    /// The shortest line of at least so many seconds: its ticks, and its Time; none where that is longer than may be.
    fn line(&self, seconds: f64) -> Option<(u32, u32)> {
        if seconds * 1e3 > f64::from(self.longest_ms) {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a Time in ticks fits")]
        let ticks = (seconds * self.rate.hz()).ceil() as u32;
        let mut ticks = ticks.max(sight_ticks(self.rate));
        while f64::from(self.rate.span_ms(self.index, ticks)) < seconds * 1e3 {
            ticks += 1; // whole milliseconds may fall short by one
        }
        let lasts_ms = self.rate.span_ms(self.index, ticks);
        (lasts_ms <= self.longest_ms).then_some((ticks, lasts_ms))
    }
}

/// The next line of that way to rest, or at rest for [`STILL_FOR_MS`] in all; none once that is over, or where no frame can bring the
/// axes there.
pub(super) fn next_leg(axes: &[BlindAxis; MAX_AXES], grid: Grid) -> Option<BlindLeg> {
    let mut axes = *axes;
    // Each axis as gently as it can alone: one that is short of room is not to brake the others.
    for axis in &mut axes {
        axis.step *= gentlest(std::slice::from_ref(axis), grid)?;
    }
    let harder = gentlest(&axes, grid)?;
    slow(&mut axes, harder);
    if rest(&axes) {
        // Vibration and effects end with the first of them that arrives.
        let is_told = grid.left_ms <= LONGEST_WAY_MS - STILL_FOR_MS;
        let still = line(&mut axes, grid, STILL_S).filter(|leg| leg.lasts_ms <= grid.left_ms);
        return if is_told { None } else { still };
    }
    go(&mut axes, grid)
}

/// How many times as large as they are the steps have to be.
fn gentlest(axes: &[BlindAxis], grid: Grid) -> Option<f64> {
    let sizes = std::iter::successors(Some(1.0), |size| Some(size * HARDER));
    sizes.take(TRIES).find(|size| fits(axes, grid, *size))
}

/// Whether the whole way fits with steps so many times as large.
fn fits(axes: &[BlindAxis], mut grid: Grid, harder: f64) -> bool {
    let mut kept = [BlindAxis::PADDING; MAX_AXES];
    kept[..axes.len()].copy_from_slice(axes);
    let axes = &mut kept[..axes.len()];
    // It ends: each line takes 13 ms and more of what is left of a second.
    loop {
        slow(axes, harder);
        if rest(axes) {
            return true;
        }
        let Some(leg) = go(axes, grid) else { return false };
        let Some(left_ms) = grid.left_ms.checked_sub(leg.lasts_ms) else { return false };
        (grid.index, grid.left_ms) = (grid.index + u64::from(leg.ticks), left_ms);
    }
}

fn slow(axes: &mut [BlindAxis], harder: f64) {
    axes.iter_mut().for_each(|axis| axis.slow(harder));
}

fn rest(axes: &[BlindAxis]) -> bool {
    axes.iter().all(|axis| axis.speed == 0.0)
}

/// Goes one line on at the present speeds; none where that leads out of a stroke, or takes too long.
fn go(axes: &mut [BlindAxis], grid: Grid) -> Option<BlindLeg> {
    line(axes, grid, 0.0)
}

/// The same with a line that takes `least_s` at the least.
fn line(axes: &mut [BlindAxis], grid: Grid, least_s: f64) -> Option<BlindLeg> {
    let needs_s = axes.iter().map(BlindAxis::needs_s).fold(least_s, f64::max);
    let (ticks, lasts_ms) = grid.line(needs_s)?;
    let mut to = [0.0; MAX_AXES];
    for (axis, to) in axes.iter_mut().zip(&mut to) {
        axis.go(f64::from(lasts_ms) * 1e-3);
        *to = axis.place;
    }
    // One that stands cannot leave the stroke, though its place may be off by a last bit.
    let inside = axes.iter().all(|axis| axis.speed == 0.0 || (0.0..=1.0).contains(&axis.place));
    inside.then_some(BlindLeg { to, lasts_ms, ticks })
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use proptest::prelude::*;

    use super::*;
    use crate::belief::{Belief, EvidenceTable, Reading, Taken};
    use crate::motion::{Measure, SeatType, Slot, Window};
    use crate::time::{MonoTime, ShowTime};
    use crate::wire::FrameNo;

    const LIMITS: Limits = Limits { velocity: 240.0 / 150.0, acceleration: 3_000.0 / 150.0, jerk: 400.0 };

    fn grid(hz: f64, longest_ms: u32) -> Grid {
        Grid { rate: Rate::from_hz(hz), index: 0, longest_ms, left_ms: LONGEST_WAY_MS }
    }

    /// An axis of a bench seat: where it is, mm, how fast, mm/s, and how far away it may be, mm.
    fn axis(place: f64, speed: f64, farthest: f64, rate: Rate) -> BlindAxis {
        BlindAxis::new(place / 150.0, speed / 150.0, farthest / 150.0, &LIMITS, rate)
    }

    fn one(axis: BlindAxis) -> [BlindAxis; MAX_AXES] {
        let mut axes = [BlindAxis::PADDING; MAX_AXES];
        axes[0] = axis;
        axes
    }

    /// All lines to rest, each planned from the end of the one before, as it is in a show.
    fn way(mut axes: [BlindAxis; MAX_AXES], mut grid: Grid) -> Vec<BlindLeg> {
        let mut legs = Vec::new();
        while let Some(leg) = next_leg(&axes, grid) {
            for (axis, to) in axes.iter_mut().zip(leg.to) {
                axis.speed = (to - axis.place) / (f64::from(leg.lasts_ms) * 1e-3);
                axis.farthest += (to - axis.place).abs();
                axis.place = to;
            }
            (grid.index, grid.left_ms) = (grid.index + u64::from(leg.ticks), grid.left_ms - leg.lasts_ms);
            legs.push(leg);
            assert!(legs.len() < 100, "{legs:?}");
        }
        legs
    }

    /// The sharpest acceleration that the measure sees where a seat has come to `place` with `speed` and hears all of these, mm/s².
    fn sharpest(place: f64, speed: f64, legs: &[BlindLeg]) -> f64 {
        let mut lines = vec![(200, place)];
        lines.extend(legs.iter().map(|leg| (leg.lasts_ms, leg.to[0] * 150.0)));
        lines.push((200, lines[lines.len() - 1].1));
        let mut measure = Measure::new(Spacing::at_rate(1_000.0));
        let (mut from, mut ms, mut worst) = (place - speed * 0.2, 0, 0.0_f64);
        for (lasts_ms, to) in lines {
            for part in 1..=lasts_ms {
                ms += 1;
                let here = from + (to - from) * f64::from(part) / f64::from(lasts_ms);
                worst = worst.max(measure.push(ShowTime::from_millis(ms), here).acceleration.value.abs());
            }
            from = to;
        }
        worst
    }

    #[test]
    fn a_line_takes_just_as_long_as_the_greatest_speed_needs_from_the_farthest_place() {
        let grid = grid(1_000.0, 3_000);
        let leg = next_leg(&one(axis(75.0, 154.0, 12.0, grid.rate)), grid).expect("it moves");
        // At 100 mm/s: 12 mm at what is left of 235.2 mm/s.
        assert_eq!((leg.lasts_ms, leg.ticks), (89, 89), "12 / 135.2 s");
        assert!((leg.to[0] * 150.0 - 83.9).abs() < 1e-9, "{}", leg.to[0] * 150.0);
    }

    #[test]
    fn a_lane_that_is_slower_than_one_step_rests_at_once_and_is_told_so_for_a_while() {
        let grid = grid(100.0, 3_000);
        let slow = one(axis(75.0, -50.0, 10.0, grid.rate));
        let leg = next_leg(&slow, grid).expect("it is told");
        assert!((leg.to[0] * 150.0 - 75.0).abs() < 1e-9 && leg.lasts_ms >= 100, "{leg:?}");
        assert_eq!(next_leg(&slow, Grid { left_ms: 800, ..grid }), None, "it has been told for long enough");
    }

    #[test]
    fn a_seat_that_hears_all_lines_slows_down_within_its_limits_where_there_is_room() {
        for (hz, speed) in [(100.0, 180.0), (100.0, -120.0), (1_000.0, 180.0), (60.0, 150.0)] {
            let grid = grid(hz, 3_000);
            let legs = way(one(axis(75.0, speed, speed.abs() * 0.07, grid.rate)), grid);
            let sharpest = sharpest(75.0, speed, &legs);
            assert!(!legs.is_empty() && sharpest <= 3_000.0, "{hz} Hz, {speed} mm/s: {sharpest} mm/s²");
        }
    }

    #[test]
    fn where_the_stroke_has_no_room_it_slows_down_harder_and_stays_inside() {
        let grid = grid(100.0, 3_000);
        for place in [75.0, 120.0, 140.0, 149.0] {
            let legs = way(one(axis(place, 220.0, 16.0, grid.rate)), grid);
            assert!(legs.iter().all(|leg| leg.to[0] <= 1.0), "{legs:?}");
        }
    }

    /// A belief of which the last ack is of a frame 70 ms back, and the axis led on from there at that speed, mm/s; and where it
    /// is led.
    fn in_a_gap(window: &Window, speed: f64) -> (Belief, Pose) {
        let mut belief = Belief::new(window, Duration::from_millis(10), 1);
        let table = EvidenceTable::of(1);
        let evidence = table.lane(0).unwrap();
        let mut pose = [0.0; MAX_AXES];
        pose[0] = 0.5;
        evidence.on_reading(&Reading::at_rest(pose, ms(0)));
        for tick in 0..9 {
            belief.look(evidence, ms(10 * tick), ms(10 * tick));
            pose[0] += speed / 150.0 * 0.010;
            belief.taken(&taken(tick, &pose, 10, 10 * tick));
            if tick == 0 {
                evidence.on_ack(FrameNo(0));
            }
        }
        assert!(belief.is_in_a_gap());
        (belief, pose)
    }

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(1_000_000_000 + ms * 1_000_000)
    }

    fn taken(frame: u64, pose: &Pose, lasts_ms: u32, at: u64) -> Taken<'_> {
        let frame = FrameNo(u32::try_from(frame).unwrap());
        Taken { frame, asked: true, pose, lasts_ms, at_most_ms: lasts_ms, shakes: 0.0, at: ms(at) }
    }

    proptest! {
        #[test]
        fn what_is_known_of_the_seat_lets_every_line_pass(speed in -240.0..240.0) {
            let window = Window::new(vec![Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0)]);
            let (mut belief, mut pose) = in_a_gap(&window, speed);
            let (mut grid, mut at, mut speed) = (grid(100.0, 3_000), 90, speed / 150.0);
            for frame in 9.. {
                let farthest = belief.farthest(&pose, ms(at));
                let axis = BlindAxis::new(pose[0], speed, farthest[0], &LIMITS, grid.rate);
                let Some(leg) = next_leg(&one(axis), grid) else { break };
                prop_assert!(belief.allows(&leg.to, leg.lasts_ms, ms(at)), "{:?}", leg);
                belief.taken(&taken(frame, &leg.to, leg.lasts_ms, at));
                speed = (leg.to[0] - pose[0]) / (f64::from(leg.lasts_ms) * 1e-3);
                pose = leg.to;
                at += u64::from(leg.lasts_ms);
                grid.index += u64::from(leg.ticks);
                grid.left_ms -= leg.lasts_ms;
            }
        }

        #[test]
        fn no_line_is_too_fast_from_any_place_or_leaves_the_stroke_or_the_way_its_time(
            axes in prop::collection::vec((0.0..150.0, -240.0..240.0, 0.0..150.0), 3),
            hz in 1.0..1_000.0,
            longest_ms in 50_u32..3_000,
        ) {
            let mut grid = grid(hz, longest_ms);
            let mut kept = [BlindAxis::PADDING; MAX_AXES];
            for (kept, (place, speed, farthest)) in kept.iter_mut().zip(axes) {
                *kept = axis(place, speed, farthest, grid.rate);
            }
            let mut way_ms = 0;
            for leg in way(kept, grid) {
                let seconds = f64::from(leg.lasts_ms) * 1e-3;
                prop_assert!(leg.lasts_ms <= longest_ms);
                prop_assert_eq!(leg.lasts_ms, grid.rate.span_ms(grid.index, leg.ticks));
                for (axis, to) in kept.iter_mut().zip(leg.to).take(3) {
                    axis.farthest += (to - axis.place).abs();
                    prop_assert!(axis.farthest <= LIMITS.velocity * seconds + 1e-9);
                    prop_assert!((0.0..=1.0).contains(&to));
                    axis.place = to;
                }
                grid.index += u64::from(leg.ticks);
                way_ms += leg.lasts_ms;
            }
            prop_assert!(way_ms <= LONGEST_WAY_MS, "{} ms", way_ms);
        }
    }
}
