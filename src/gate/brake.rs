//! A way to rest: from a position, a velocity and an acceleration, in closed form.

/// What a way to rest may end outside the stroke, in strokes; it is held at the end there.
const STROKE_SLACK: f64 = 1e-7;
/// How far an acceleration may be from what the poses show, as a share of the limit.
const FURTHEST: f64 = 0.5;
/// Halvings that find it, to a hundred thousandth of the limit.
const HALVINGS: u32 = 16;

/// What an axis does at an instant, in strokes and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    pub(super) position: f64,
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
}

impl Motion {
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

/// A stretch of constant jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    from: Motion,
    jerk: f64,
    seconds: f64,
}

/// The shortest way to rest within an acceleration and a jerk: build up deceleration, hold it, let go of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Brake {
    stretches: [Stretch; 3],
    rest: f64,
}

impl Brake {
    /// The way to rest from `from`. An acceleration beyond the limit is let go of first.
    pub(super) fn new(from: Motion, acceleration: f64, jerk: f64) -> Self {
        // The speed that is left once the present acceleration is gone says which way to brake.
        let left = from.velocity + from.acceleration * from.acceleration.abs() / (2.0 * jerk);
        let sign = if left < 0.0 { -1.0 } else { 1.0 };
        let (speed, pull) = (sign * from.velocity, sign * from.acceleration);
        let reach = (jerk * speed + pull * pull / 2.0).max(0.0).sqrt();
        let peak = reach.min(acceleration).max(-pull);
        let build_up = (pull + peak) / jerk;
        let held = if peak > 0.0 { ((speed + pull * pull / (2.0 * jerk)) / peak - peak / jerk).max(0.0) } else { 0.0 };
        let mut at = from;
        let stretches = [(-sign * jerk, build_up), (0.0, held), (sign * jerk, peak / jerk)].map(|(jerk, seconds)| {
            let stretch = Stretch { from: at, jerk, seconds };
            at = at.under(jerk, seconds);
            stretch
        });
        Self { stretches, rest: at.position }
    }

    /// Seconds until rest.
    pub(super) fn seconds(&self) -> f64 {
        self.stretches.iter().map(|stretch| stretch.seconds).sum()
    }

    /// Whether it comes to rest inside the stroke, and is at no time faster than `velocity`, as far as it knows.
    fn fits(&self, velocity: f64) -> bool {
        let [build_up, held, _] = &self.stretches;
        // Fastest where the acceleration is gone, on the way to braking; or at the beginning.
        let gone = build_up.from.acceleration / -build_up.jerk;
        let peak = build_up.from.under(build_up.jerk, gone.clamp(0.0, build_up.seconds)).velocity.abs();
        (-STROKE_SLACK..=1.0 + STROKE_SLACK).contains(&self.rest)
            && peak.max(held.from.velocity.abs()) <= velocity
    }

    /// The same, but from an acceleration that is no further from that of `from` than needed to stay inside the stroke and
    /// under `velocity`: between two poses a jerk can have begun that their differences do not show yet. None where
    /// [`Self::new`] does as well.
    pub(super) fn aimed(from: Motion, acceleration: f64, jerk: f64, velocity: f64) -> Option<Self> {
        let plain = Self::new(from, acceleration, jerk);
        if plain.fits(velocity) {
            return None;
        }
        let push = if from.velocity + 0.5 * from.acceleration * from.acceleration.abs() / jerk < 0.0 { 1.0 } else { -1.0 };
        let with = |change: f64| {
            Self::new(Motion { acceleration: from.acceleration + push * change, ..from }, acceleration, jerk)
        };
        let (mut short, mut far) = (0.0, FURTHEST * acceleration);
        if !with(far).fits(velocity) {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(short, far);
            if with(middle).fits(velocity) {
                far = middle;
            } else {
                short = middle;
            }
        }
        Some(with(far))
    }

    /// Where it is after so many seconds, held inside the stroke.
    pub(super) fn position(&self, after: f64) -> f64 {
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
