//! Decides if an axis can still come to rest: ways to brake, tried against the measure over the frames to come.

use super::fast_path::LEVEL;
use super::history::{PoseHistory, Reciprocals};
use super::limits::AxisLimits;
use super::times::FrameTimes;
use crate::motion::{AxisState, Begun, Halt, Means, Spacing};

// 3 x 27 periods at 1,000 Hz, and the end of that.
/// Poses that a difference can span, without the newest.
const PAST: usize = 82;
// Half a second at 1,000 Hz; a longer way is judged again on each of its frames (docs/limiter.md, section 4).
/// Frames that are looked ahead at the most.
const AHEAD: usize = 512;

/// Shares of the acceleration and of the jerk that a way to rest may take. Beyond 1: a short jerk is seen as less than it
/// is.
const SHARES: [(f64, f64); 7] =
    [LEVEL, (0.95, 0.95), (1.0, 1.0), (0.8, 0.8), (0.6, 0.6), (1.0, 1.15), (1.0, 1.4)];
/// Over which part of the shorter distance velocity and acceleration are taken, as its divisor; 0 is one frame.
const PARTS: [usize; 4] = [0, 4, 2, 1];
/// Ways to brake of one kind: each with the acceleration of a cubic and of a parabola.
const OF_A_KIND: usize = SHARES.len() * PARTS.len() * 2;
/// Ways to brake in all: shortest, nudged in either way, turned.
const WAYS: usize = 4 * OF_A_KIND;
/// What a way to rest is planned within; less than what is allowed, for the sake of rounding.
const PLANNED: f64 = 1.0009;

/// The past of one axis, and room for what may follow.
pub(super) struct StopPath<'a> {
    limits: &'a AxisLimits,
    spacing: Spacing,
    period: f64,
    /// Seconds, 0 at the newest pose that is certain; as many of the past as of `positions`.
    at: [f64; PAST + AHEAD],
    positions: [f64; PAST + AHEAD],
    /// The differences, where all frames have the same Time.
    even: Option<[Reciprocals; 2]>,
}

impl<'a> StopPath<'a> {
    /// Before a frame of `time_ms` is sent; or after, if it carries `sent`. `times` is past that frame.
    pub(super) fn new(
        history: &PoseHistory,
        axis: usize,
        limits: &'a AxisLimits,
        times: FrameTimes,
        time_ms: u32,
        sent: Option<f64>,
    ) -> Self {
        let (mut at, mut positions) = ([0.0; PAST + AHEAD], [0.0; PAST + AHEAD]);
        // Without a pose that is sent the way begins at the last that was, one frame ago.
        let skip = usize::from(sent.is_none());
        let now = history.seconds_since(skip, time_ms);
        for back in 0..PAST {
            let place = PAST - 1 - back;
            at[place] = now - history.seconds_since(back + skip, time_ms);
            positions[place] = history.before(back + skip)[axis];
        }
        if let Some(position) = sent {
            positions[PAST - 1] = position;
        }
        let mut outlook =
            Self { limits, spacing: history.spacing(), period: times.period(), at, positions, even: None };
        outlook.look_ahead(times, sent.is_none().then_some(time_ms));
        outlook
    }

    /// When the frames ahead are reached, `first` being the Time of the first if it is known already.
    fn look_ahead(&mut self, mut times: FrameTimes, first: Option<u32>) {
        let mut first = first;
        // By the Times that these very frames will have: a way judged
        // with even ones could fail with those that alternate.
        let mut sum = 0.0;
        for at in &mut self.at[PAST..] {
            sum += f64::from(first.take().unwrap_or_else(|| times.next())) * 1e-3;
            *at = sum;
        }
        // One set of reciprocals for all places is right only if no difference reaches back to another Time.
        let reach = 3 * self.spacing.m;
        let past = &self.at[PAST - 1 - reach.min(PAST - 1)..=PAST];
        if times.are_even() && past.windows(2).all(|pair| (pair[1] - pair[0] - self.period).abs() < 1e-9) {
            self.even = Some([self.spacing.n, self.spacing.m].map(|apart| self.difference(PAST, apart)));
        }
    }

    fn difference(&self, place: usize, apart: usize) -> Reciprocals {
        Reciprocals::new(apart, [0, 1, 2, 3].map(|count| self.at[place.saturating_sub(count * apart)]))
    }

    fn nodes(&self, place: usize, apart: usize) -> [f64; 4] {
        [0, 1, 2, 3].map(|count| self.positions[place.saturating_sub(count * apart)])
    }

    /// A way to rest within the limits, and its place among the ways; `first` is tried before all others.
    pub(super) fn way(&mut self, first: usize) -> Option<(Halt, usize)> {
        // A guess is judged by the measure alone, so a bad one costs time and no limit (docs/limiter.md, section 4).
        let order = std::iter::once(first).chain((0..WAYS).filter(|&way| way != first));
        for way in order {
            if let Some(brake) = self.brake(way)
                && self.worst(&brake, PLANNED) <= PLANNED
            {
                return Some((brake, way));
            }
        }
        None
    }

    /// The way to rest that exceeds the limits least.
    pub(super) fn least(&mut self) -> Halt {
        // One that turns out worse than the best so far is left there, so most cost a few frames.
        let mut least: Option<(Halt, f64)> = None;
        for way in 0..WAYS {
            let Some(brake) = self.brake(way) else { continue };
            let worst = self.worst(&brake, least.map_or(f64::INFINITY, |(_, worst)| worst));
            if least.is_none_or(|(_, least)| worst < least) {
                least = Some((brake, worst));
            }
        }
        least.expect("ways that are not aimed are always there").0
    }

    fn brake(&self, way: usize) -> Option<Halt> {
        // Way 0 is the brake that the fast path has already proved from a pose that is calm.
        let share = SHARES[way % SHARES.len()];
        let (kind, rest) = (way / OF_A_KIND, way % OF_A_KIND / SHARES.len());
        let (part, cubic) = (PARTS[rest % PARTS.len()], rest < PARTS.len());
        // 0 divides nothing: frame to frame, as the fast path looks, so that its brake is among the ways.
        let apart = self.spacing.n.checked_div(part).unwrap_or(1).max(1);
        let difference = self.difference(PAST - 1, apart);
        let mut shown = difference.show(self.nodes(PAST - 1, apart));
        if !cubic {
            shown.jerk = 0.0;
        }
        let (velocity, acceleration) = difference.newest(shown);
        let limits = self.limits;
        // Taken on to the newest pose, both may come out beyond limits that the motion itself keeps.
        let velocity = velocity.clamp(-limits.velocity, limits.velocity);
        let most = PLANNED * limits.acceleration;
        // What is cut off was let go of before that pose, so the speed has changed by as much already.
        let excess = acceleration.clamp(-most, most) - acceleration;
        let from = AxisState { position: self.positions[PAST - 1], velocity, acceleration }.nudged_by(
            excess,
            limits.jerk,
            Begun::Earlier,
        );
        let means = Means {
            velocity: PLANNED * limits.velocity,
            acceleration: share.0 * limits.acceleration,
            jerk: share.1 * limits.jerk,
        };
        match kind {
            0 => Some(Halt::new(from, means)),
            1 => Halt::nudged(from, means, Begun::Now),
            2 => Halt::nudged(from, means, Begun::Earlier),
            _ => Halt::turned(from, means),
        }
    }

    /// The greatest share of a limit that the brake takes; at least `enough` where it stops looking.
    fn worst(&mut self, brake: &Halt, enough: f64) -> f64 {
        let frames_ahead = self.frames_ahead(brake);
        // No test of the stroke: a way that would leave it is held at
        // its end, and so sudden a stop shows as acceleration and jerk.
        let mut worst = 0.0_f64;
        for place in PAST..PAST + frames_ahead {
            self.positions[place] = brake.position(self.at[place]);
            worst = worst.max(self.share_at(place));
            if worst > enough {
                break;
            }
        }
        worst
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "held inside the room")]
    fn frames_ahead(&self, brake: &Halt) -> usize {
        let until_rest = (brake.seconds() / self.period).ceil().min(frames(AHEAD)) as usize;
        // Until no difference has a pose from before the rest in it.
        (until_rest + 3 * self.spacing.m + 1).min(AHEAD)
    }

    fn share_at(&self, place: usize) -> f64 {
        let [now, before, earlier] =
            [place, place - 1, place - 2].map(|place| (self.at[place], self.positions[place]));
        let velocity = (now.1 - before.1) / (now.0 - before.0);
        let step = velocity - (before.1 - earlier.1) / (before.0 - earlier.0);
        let limits = self.limits;
        // The step as well: a way that trembles from frame to frame could pass both distances.
        let mut worst = (velocity.abs() / limits.velocity).max(step.abs() / limits.step);
        for (count, apart) in [self.spacing.n, self.spacing.m].into_iter().enumerate() {
            let difference = self.even.map_or_else(|| self.difference(place, apart), |even| even[count]);
            let shown = difference.show(self.nodes(place, apart));
            worst =
                worst.max(shown.acceleration.abs() / limits.acceleration).max(shown.jerk.abs() / limits.jerk);
        }
        worst
    }
}

#[expect(clippy::cast_precision_loss, reason = "some hundreds")]
fn frames(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::time::Duration;

    use proptest::prelude::*;

    use super::super::{Limiter, Provenance};
    use super::*;
    use crate::motion::{MAX_AXES, SeatType, Slot, Window};
    use crate::time::Rate;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn after_a_pose_that_is_calm_the_first_of_all_ways_to_rest_keeps_the_limits(
            hz in prop::sample::select(vec![25.0, 50.0, 72.0, 100.0, 144.0, 333.0, 600.0, 666.667, 999.0, 1000.0]),
            waves in [(0.1..6.0_f64, 0.0..1.0_f64, 0.0..1.0_f64), (0.1..15.0, 0.0..1.0, 0.0..0.3)],
            share in 0.4..1.3_f64, edge in 0.5..1.0_f64,
        ) {
            let rate = Rate::from_hz(hz);
            let window = Window::new(vec![Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0)]);
            let limits = window.slots()[0].limits;
            // The waves together are to need that share of the limits, and swing up to the end of the stroke.
            let power = |order: i32| -> f64 { waves.iter().map(|(hz, _, part)| part * (TAU * hz).powi(order)).sum() };
            let scale = (limits.velocity / power(1)).min(limits.acceleration / power(2)).min(limits.jerk / power(3));
            let scale = (share * scale).min(0.5 / power(0));
            let wave = |at: f64| -> f64 { waves.iter().map(|(hz, turn, part)| part * (TAU * (hz * at + turn)).sin()).sum() };
            let middle = (edge - scale * power(0)).max(scale * power(0));
            let place = |at: f64| middle + scale * wave(at);

            let mut limiter = Limiter::new(&window, rate);
            let (mut pose, mut times, mut at) = ([0.0; MAX_AXES], FrameTimes::new(rate), 0.0);
            pose[0] = place(0.0);
            limiter.is_seeded = true;
            limiter.rest_in(pose);
            let mut calm = 0;
            for frame in (0..).take_while(|frame| rate.offset(*frame) < Duration::from_secs(4)) {
                at += f64::from(times.of(frame)) * 1e-3;
                pose[0] = place(at);
                limiter.fast_path.begin(f64::from(rate.time_ms(frame)) * 1e-3);
                let is_calm = limiter.following && limiter.fast_path.clone().admit_calm(&pose);
                limiter.admit(&mut pose, frame, Provenance::Anyhow);
                if is_calm {
                    calm += 1;
                    let (history, limits) = (&limiter.history, &limiter.axes[0].limits);
                    let mut outlook = StopPath::new(history, 0, limits, times, rate.time_ms(frame + 1), None);
                    let way = outlook.brake(0).expect("a way that is not aimed is always there");
                    let worst = outlook.worst(&way, f64::INFINITY);
                    prop_assert!(worst <= PLANNED, "frame {frame}: {worst}");
                }
            }
            prop_assert!(calm > 0 || share > 0.8, "no pose was calm");
        }
    }
}
