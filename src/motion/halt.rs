//! The way of one axis to rest: from a position, a velocity and an acceleration, in closed form.
//!
//! Whether an axis can stay inside its stroke is decided by one way alone: braking with all means, -jerk until the
//! acceleration is all there is against the motion. Whatever else it did with the same means, its acceleration, so its
//! velocity, so its position would be no lower at any instant until it turns: no way within the means peaks lower. That way
//! need not end in rest at its peak; [`Halt::turned`] goes beyond it, back into the stroke, and rests there.

use super::{AxisState, Limits};

/// What a way to rest may end outside the stroke, in strokes; it is held at the end there.
const STROKE_SLACK: f64 = 1e-7;
/// How far an acceleration may be from what the poses show, as a share of the limit.
const FURTHEST: f64 = 0.5;
/// Halvings that find how far.
const HALVINGS: u32 = 20;

impl AxisState {
    /// The same with another acceleration.
    pub(crate) fn nudged_by(self, change: f64, jerk: f64, begun: Begun) -> Self {
        let speed = if begun == Begun::Earlier { 0.5 * change * change.abs() / jerk } else { 0.0 };
        Self { velocity: self.velocity + speed, acceleration: self.acceleration + change, ..self }
    }

    /// What it does `after` seconds of constant jerk.
    fn under(self, jerk: f64, after: f64) -> Self {
        let Self { position, velocity, acceleration } = self;
        Self {
            position: position + after * (velocity + after * (acceleration / 2.0 + after * jerk / 6.0)),
            velocity: velocity + after * (acceleration + after * jerk / 2.0),
            acceleration: acceleration + after * jerk,
        }
    }
}

/// When a jerk that the poses do not show yet began.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Begun {
    /// At the newest pose: the acceleration jumps there.
    Now,
    /// Before it: the velocity has changed already.
    Earlier,
}

/// A stretch of constant jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
struct JerkStretch {
    from: AxisState,
    jerk: f64,
    seconds: f64,
}

/// A way to rest within an acceleration and a jerk, in stretches of constant jerk: pull for a while, then build up
/// deceleration, hold it, let go of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Halt {
    stretches: [JerkStretch; 5],
    rest: f64,
}

/// What a way to rest may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Means {
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
}

impl Means {
    /// A share of the acceleration and the jerk. The velocity is no matter of braking: what is faster already may stop too.
    fn of(limits: Limits, share: f64) -> Self {
        let Limits { velocity, acceleration, jerk } = limits;
        Self { velocity: 2.0 * velocity, acceleration: share * acceleration, jerk: share * jerk }
    }
}

impl Halt {
    /// The shortest way to rest from `from`. An acceleration beyond the limit is let go of first.
    pub(crate) fn new(from: AxisState, means: Means) -> Self {
        Self::pulling(from, means, 0.0, 0.0)
    }

    /// The same after pulling with all means, up or down, for so many seconds.
    fn pulling(from: AxisState, means: Means, sign: f64, seconds: f64) -> Self {
        let Means { acceleration, jerk, .. } = means;
        let rise = ((acceleration - sign * from.acceleration).max(0.0) / jerk).min(seconds);
        let mut at = from;
        let mut stretch = |jerk: f64, seconds: f64| {
            let stretch = JerkStretch { from: at, jerk, seconds };
            at = at.under(jerk, seconds);
            stretch
        };
        let (ramp, pull) = (stretch(sign * jerk, rise), stretch(0.0, seconds - rise));
        let pulled = pull.from.under(0.0, pull.seconds);
        // The speed that is left once the present acceleration is gone says which way to brake.
        let left = pulled.velocity + pulled.acceleration * pulled.acceleration.abs() / (2.0 * jerk);
        let sign = if left < 0.0 { -1.0 } else { 1.0 };
        let (speed, pull_now) = (sign * pulled.velocity, sign * pulled.acceleration);
        let reach = (jerk * speed + pull_now * pull_now / 2.0).max(0.0).sqrt();
        let peak = reach.min(acceleration).max(-pull_now);
        let to_lose = speed + pull_now * pull_now / (2.0 * jerk);
        let held = if peak > 0.0 { (to_lose / peak - peak / jerk).max(0.0) } else { 0.0 };
        let build_up = stretch(-sign * jerk, (pull_now + peak) / jerk);
        let stretches = [ramp, pull, build_up, stretch(0.0, held), stretch(sign * jerk, peak / jerk)];
        Self { stretches, rest: at.position }
    }

    /// True if it stays inside the stroke, and at no time is faster than its means.
    fn fits(&self, means: Means) -> bool {
        !self.runs_past(1.0, means) && !self.runs_past(-1.0, means)
    }

    /// True if it passes that end of the stroke, 1 or -1 for upper and lower, or is too fast on its way there.
    fn runs_past(&self, onward: f64, means: Means) -> bool {
        let past = |position: f64| onward * (position - 0.5) > 0.5 + STROKE_SLACK;
        past(self.rest)
            || self.stretches.iter().any(|stretch| {
                let turns = stretch.turns().map(|after| stretch.from.under(stretch.jerk, after).position);
                turns.into_iter().any(past) || stretch.fastest(onward) > means.velocity
            })
    }

    /// A way that first pulls away from what [`Self::new`] would run into, just long enough to fit: where the stroke is
    /// nearly over there may be room to turn back, though none to come to rest. None where the shortest way fits, and
    /// where none does.
    pub(crate) fn turned(from: AxisState, means: Means) -> Option<Self> {
        let plain = Self::new(from, means);
        if plain.fits(means) {
            return None;
        }
        let onward = plain.onward(means);
        let pulled = |seconds: f64| Self::pulling(from, means, -onward, seconds);
        // All speed that there may be is gone by then.
        let most = means.velocity / means.acceleration + means.acceleration / means.jerk;
        least(most, pulled, onward, means)
    }

    /// The shortest way from an acceleration that differs from that of `from` just as much as is needed to fit: between
    /// two poses a jerk can have begun that does not show in them yet. None as with [`Self::turned`].
    pub(crate) fn nudged(from: AxisState, means: Means, begun: Begun) -> Option<Self> {
        let plain = Self::new(from, means);
        if plain.fits(means) {
            return None;
        }
        let onward = plain.onward(means);
        let nudged = |change: f64| Self::new(from.nudged_by(-onward * change, means.jerk, begun), means);
        least(FURTHEST * means.acceleration, nudged, onward, means)
    }

    /// The gentlest of a few ways to rest that stay inside the stroke: with each of these shares of acceleration and jerk,
    /// and where the last of them does not fit either, with all of that one, turning back. None where no way fits.
    pub(crate) fn inside(from: AxisState, limits: Limits, shares: &[f64]) -> Option<Self> {
        let means = |share: f64| Means::of(limits, share);
        let plain = shares.iter().map(|&share| Self::new(from, means(share)));
        let most = means(shares.iter().copied().fold(0.0, f64::max));
        plain.into_iter().find(|halt| halt.past() <= STROKE_SLACK).or_else(|| Self::turned(from, most))
    }

    /// The shortest with all of the limits, wherever that ends.
    pub(crate) fn full(from: AxisState, limits: Limits) -> Self {
        Self::new(from, Means::of(limits, 1.0))
    }

    /// How far it leaves the stroke at the most, in strokes; below 0 where it stays inside.
    pub(crate) fn past(&self) -> f64 {
        let turns = self.stretches.iter().flat_map(|stretch| {
            stretch.turns().map(|after| stretch.from.under(stretch.jerk, after).position)
        });
        turns
            .chain([self.rest])
            .fold(f64::NEG_INFINITY, |past, position| past.max(-position).max(position - 1.0))
    }

    /// How far an axis leaves its stroke at the least, with a share of its acceleration and jerk, in strokes; below 0 where
    /// there is room to turn.
    pub(crate) fn least_past(from: AxisState, limits: Limits, share: f64) -> f64 {
        let means = Means::of(limits, share);
        let most = means.velocity / means.acceleration + means.acceleration / means.jerk;
        let past = |onward: f64| {
            let away = Self::pulling(from, means, -onward, most);
            let ends = away.stretches[..2].iter().flat_map(|stretch| {
                stretch.turns().map(|after| stretch.from.under(stretch.jerk, after).position)
            });
            ends.map(|position| onward * (position - 0.5) - 0.5).fold(f64::NEG_INFINITY, f64::max)
        };
        past(1.0).max(past(-1.0))
    }

    /// True if it is plain that an axis can turn inside its stroke, without the roots of [`Self::least_past`]: the acceleration that
    /// it has is enough, or the way to rest that lets go of it first.
    pub(crate) fn plainly_turns(from: AxisState, limits: Limits) -> bool {
        let Limits { acceleration, jerk, .. } = limits;
        let turns = |room: f64, speed: f64, pull: f64| {
            // With a pull that goes on as it is it turns after v² / 2a; both ways keep the limits, so that the least peaks no farther.
            if pull <= 0.0 && (speed <= 0.0 || speed * speed <= -2.0 * pull * room) {
                return true;
            }
            let pull = pull.max(0.0);
            let speed = speed.max(0.0) + 0.5 * pull * pull / jerk;
            speed * (pull / jerk + 0.5 * (speed / acceleration + acceleration / jerk)) <= room
        };
        turns(1.0 - from.position, from.velocity, from.acceleration)
            && turns(from.position, -from.velocity, -from.acceleration)
    }

    /// Its stretches of constant jerk that last: how it moves at the beginning of each, the jerk, and the seconds.
    pub(crate) fn stretches(&self) -> impl Iterator<Item = (AxisState, f64, f64)> {
        let lasting = self.stretches.iter().filter(|stretch| stretch.seconds > 0.0);
        lasting.map(|stretch| (stretch.from, stretch.jerk, stretch.seconds))
    }

    /// Where it ends.
    pub(crate) const fn rest(&self) -> f64 {
        self.rest
    }

    /// Towards which end it runs too far or too fast.
    fn onward(&self, means: Means) -> f64 {
        if self.runs_past(1.0, means) { 1.0 } else { -1.0 }
    }

    /// Seconds until rest.
    pub(crate) fn seconds(&self) -> f64 {
        self.stretches.iter().map(|stretch| stretch.seconds).sum()
    }

    /// Where it is after so many seconds, held inside the stroke.
    pub(crate) fn position(&self, after: f64) -> f64 {
        let mut left = after;
        for stretch in &self.stretches {
            if left < stretch.seconds {
                return stretch.from.under(stretch.jerk, left).position.clamp(0.0, 1.0);
            }
            left -= stretch.seconds;
        }
        self.rest.clamp(0.0, 1.0)
    }
}

impl JerkStretch {
    /// When its velocity is zero, as seconds from its beginning; its beginning where it is not.
    fn turns(&self) -> [f64; 2] {
        let AxisState { velocity, acceleration, .. } = self.from;
        let roots = if self.jerk == 0.0 {
            [-velocity / acceleration, 0.0]
        } else {
            let root = (acceleration * acceleration - 2.0 * self.jerk * velocity).sqrt();
            [(-acceleration - root) / self.jerk, (-acceleration + root) / self.jerk]
        };
        roots.map(|after| if (0.0..self.seconds).contains(&after) { after } else { 0.0 })
    }

    /// Its greatest speed in one direction.
    fn fastest(&self, onward: f64) -> f64 {
        let gone = -self.from.acceleration / self.jerk;
        let middle = if (0.0..self.seconds).contains(&gone) { gone } else { 0.0 };
        let speeds =
            [0.0, middle, self.seconds].map(|after| onward * self.from.under(self.jerk, after).velocity);
        speeds.into_iter().fold(0.0, f64::max)
    }
}

/// The way with the least of something, up to `most`, that no longer runs past the end that lies `onward`; `None` if it
/// does not fit elsewhere.
fn least(most: f64, way: impl Fn(f64) -> Halt, onward: f64, means: Means) -> Option<Halt> {
    let (mut short, mut far) = (0.0, most);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(short, far);
        if way(middle).runs_past(onward, means) {
            short = middle;
        } else {
            far = middle;
        }
    }
    Some(way(far)).filter(|way| way.fits(means))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MEANS: Means = Means { velocity: 1.6, acceleration: 20.0, jerk: 400.0 };

    fn moving(position: f64, velocity: f64, acceleration: f64) -> AxisState {
        AxisState { position, velocity, acceleration }
    }

    #[test]
    fn it_comes_to_rest_within_its_means_from_any_motion() {
        for from in
            [moving(0.5, 1.5, 0.0), moving(0.5, -0.3, 18.0), moving(0.5, 0.2, -20.0), moving(0.5, 0.0, 0.0)]
        {
            let brake = Halt::new(from, MEANS);
            let at = |step: i32| brake.position(f64::from(step) * 1e-4);
            let steps = 3_000;
            assert!(brake.seconds() < 0.2 && at(steps) == at(steps + 1), "{from:?} rests");
            for step in 3..steps {
                let jerk = (at(step) - 3.0 * at(step - 1) + 3.0 * at(step - 2) - at(step - 3)) * 1e12;
                let acceleration = (at(step) - 2.0 * at(step - 1) + at(step - 2)) * 1e8;
                assert!(jerk.abs() < 401.0 && acceleration.abs() < 20.01, "{from:?}, step {step}: {jerk}");
            }
        }
    }

    #[test]
    fn where_there_is_no_room_to_rest_it_turns_back() {
        let from = moving(0.9970, 0.27, -11.0);
        assert!(Halt::new(from, MEANS).rest > 1.0);
        let brake = Halt::turned(from, MEANS).expect("there is room to turn");
        assert!(brake.fits(MEANS) && brake.rest < 1.0, "{brake:?}");
        assert_eq!(Halt::turned(moving(0.9, 1.5, 0.0), MEANS), None, "there is no room at all");
        assert_eq!(Halt::turned(moving(0.5, 0.3, 0.0), MEANS), None, "there is no need");
    }

    proptest! {
        #[test]
        fn every_way_ends_at_rest_within_its_means_without_a_step_and_inside_where_one_is_said_to_be(
            position in 0.0..1.0_f64, velocity in -1.6..1.6_f64, acceleration in -20.0..20.0_f64, share in 0.3..1.0_f64,
        ) {
            let from = moving(position, velocity, acceleration);
            let limits = Limits { velocity: 1.6, acceleration: 20.0, jerk: 400.0 };
            let greatest = (share * 20.0).max(acceleration.abs()) * 1.000_001;
            let (plain, inside) = (Halt::new(from, Means::of(limits, share)), Halt::inside(from, limits, &[share]));
            prop_assert!(inside.is_none_or(|halt| halt.past() <= STROKE_SLACK), "{inside:?}");
            for halt in [Some(plain), inside].into_iter().flatten() {
                let mut at = from;
                for (begin, jerk, seconds) in halt.stretches() {
                    prop_assert!((begin.position - at.position).abs() < 1e-12, "{halt:?}");
                    prop_assert!((begin.acceleration - at.acceleration).abs() < 1e-9, "{halt:?}");
                    at = begin.under(jerk, seconds);
                    prop_assert!(jerk.abs() <= share * 400.000_001 && at.acceleration.abs() <= greatest, "{halt:?}");
                }
                prop_assert!(at.velocity.abs() < 1e-9 && at.acceleration.abs() < 1e-6, "{halt:?}");
                prop_assert!((at.position - halt.rest()).abs() < 1e-12, "{halt:?}");
            }
        }

        #[test]
        fn where_it_is_plain_that_there_is_room_braking_with_all_means_stays_inside(
            to_end in 0.0..0.03_f64, velocity in -1.6..1.6_f64, acceleration in -20.0..20.0_f64, lower: bool,
        ) {
            let position = if lower { to_end } else { 1.0 - to_end };
            let limits = Limits { velocity: 1.6, acceleration: 20.0, jerk: 400.0 };
            // Slow ones as well: near an end nearly all that are quick have no room.
            for slower in [1.0, 0.1, 0.01] {
                let from = moving(position, slower * velocity, slower * acceleration);
                let past = Halt::least_past(from, limits, 1.0);
                prop_assert!(!Halt::plainly_turns(from, limits) || past < 1e-12, "{from:?}: {past}");
            }
        }

        #[test]
        fn where_no_way_inside_is_found_braking_with_all_means_leaves_the_stroke(
            position in 0.9..1.0_f64, velocity in 0.0..1.6_f64, acceleration in -20.0..20.0_f64,
        ) {
            let from = moving(position, velocity, acceleration);
            let limits = Limits { velocity: 1.6, acceleration: 20.0, jerk: 400.0 };
            // -jerk until the acceleration is all there is, and on until it turns, in steps.
            let (mut at, mut peak) = (from, position);
            for _ in 0..40_000 {
                let jerk = if at.acceleration > -20.0 { -400.0 } else { 0.0 };
                at = at.under(jerk, 1e-5);
                peak = peak.max(at.position);
                if at.velocity < 0.0 {
                    break;
                }
            }
            let past = Halt::least_past(from, limits, 1.0);
            // A step of those at the greatest velocity leads 1.6e-5 strokes on.
            prop_assert!((past - (peak - 1.0).max(-position)).abs() < 1.6e-5, "{past} {peak}");
            let found = Halt::inside(from, limits, &[1.0]);
            prop_assert!(found.is_some() == (peak <= 1.0) || (peak - 1.0).abs() < 1.6e-5, "{peak} {found:?}");
        }
    }
}
