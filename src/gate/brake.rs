//! A way to rest: from a position, a velocity and an acceleration, in closed form.

/// What a way to rest may end outside the stroke, in strokes; it is held at the end there.
const STROKE_SLACK: f64 = 1e-7;
/// How far an acceleration may be from what the poses show, as a share of the limit.
const FURTHEST: f64 = 0.5;
/// Halvings that find how far.
const HALVINGS: u32 = 20;

/// What an axis does at an instant, in strokes and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    pub(super) position: f64,
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
}

impl Motion {
    /// The same with another acceleration.
    pub(super) fn nudged_by(self, change: f64, jerk: f64, begun: Begun) -> Self {
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
pub(super) enum Begun {
    /// At the newest pose: the acceleration jumps there.
    Now,
    /// Before it: the velocity has changed already.
    Earlier,
}

/// A stretch of constant jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    from: Motion,
    jerk: f64,
    seconds: f64,
}

/// A way to rest within an acceleration and a jerk, in stretches of constant jerk: pull for a while, then build up
/// deceleration, hold it, let go of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Brake {
    stretches: [Stretch; 5],
    rest: f64,
}

/// What a way to rest may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Means {
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
}

impl Brake {
    /// The shortest way to rest from `from`. An acceleration beyond the limit is let go of first.
    pub(super) fn new(from: Motion, means: Means) -> Self {
        Self::pulling(from, means, 0.0, 0.0)
    }

    /// The same after pulling with all means, up or down, for so many seconds.
    fn pulling(from: Motion, means: Means, sign: f64, seconds: f64) -> Self {
        let Means { acceleration, jerk, .. } = means;
        let rise = ((acceleration - sign * from.acceleration).max(0.0) / jerk).min(seconds);
        let mut at = from;
        let mut stretch = |jerk: f64, seconds: f64| {
            let stretch = Stretch { from: at, jerk, seconds };
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

    /// Whether it stays inside the stroke, and at no time is faster than its means.
    fn fits(&self, means: Means) -> bool {
        let stroke = -STROKE_SLACK..=1.0 + STROKE_SLACK;
        stroke.contains(&self.rest)
            && self.stretches.iter().all(|stretch| {
                let turns = stretch.turns().map(|after| stretch.from.under(stretch.jerk, after).position);
                stroke.contains(&stretch.from.position)
                    && turns.iter().all(|position| stroke.contains(position))
                    && stretch.fastest() <= means.velocity
            })
    }

    /// A way that first pulls away from what [`Self::new`] would run into, just long enough to fit: where the stroke is
    /// nearly over there may be room to turn back, though none to come to rest. None where the shortest way fits, and
    /// where none does.
    pub(super) fn turned(from: Motion, means: Means) -> Option<Self> {
        let plain = Self::new(from, means);
        if plain.fits(means) {
            return None;
        }
        let sign = plain.away(from);
        let most = 2.0 * means.velocity / means.acceleration;
        least(most, |seconds| Self::pulling(from, means, sign, seconds), means)
    }

    /// The shortest way from an acceleration that differs from that of `from` just as much as is needed to fit: between
    /// two poses a jerk can have begun that does not show in them yet. None as with [`Self::turned`].
    pub(super) fn nudged(from: Motion, means: Means, begun: Begun) -> Option<Self> {
        let plain = Self::new(from, means);
        if plain.fits(means) {
            return None;
        }
        let sign = plain.away(from);
        let with = |change: f64| from.nudged_by(sign * change, means.jerk, begun);
        least(FURTHEST * means.acceleration, |change| Self::new(with(change), means), means)
    }

    /// The direction away from where it does not fit.
    fn away(&self, from: Motion) -> f64 {
        let onward = if self.rest > 1.0 {
            1.0
        } else if self.rest < 0.0 {
            -1.0
        } else {
            from.velocity.signum()
        };
        -onward
    }

    /// Seconds until rest.
    pub(super) fn seconds(&self) -> f64 {
        self.stretches.iter().map(|stretch| stretch.seconds).sum()
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

impl Brake {
    /// Whether it comes to rest beyond the other end than `other`.
    fn overdone(&self, other: &Self) -> bool {
        (self.rest < 0.0 && other.rest >= 0.0) || (self.rest > 1.0 && other.rest <= 1.0)
    }
}

impl Stretch {
    /// When its velocity is zero, as seconds from its beginning; its beginning where it is not.
    fn turns(&self) -> [f64; 2] {
        let Motion { velocity, acceleration, .. } = self.from;
        let roots = if self.jerk == 0.0 {
            [-velocity / acceleration, 0.0]
        } else {
            let root = (acceleration * acceleration - 2.0 * self.jerk * velocity).sqrt();
            [(-acceleration - root) / self.jerk, (-acceleration + root) / self.jerk]
        };
        roots.map(|after| if (0.0..self.seconds).contains(&after) { after } else { 0.0 })
    }

    /// Its greatest speed.
    fn fastest(&self) -> f64 {
        let gone = -self.from.acceleration / self.jerk;
        let middle = if (0.0..self.seconds).contains(&gone) { gone } else { 0.0 };
        [0.0, middle, self.seconds]
            .map(|after| self.from.under(self.jerk, after).velocity.abs())
            .into_iter()
            .fold(0.0, f64::max)
    }
}

/// The way with the least of something, up to `most`, that fits.
fn least(most: f64, way: impl Fn(f64) -> Brake, means: Means) -> Option<Brake> {
    let (mut short, mut far) = (0.0, most);
    // What is too much may fit no better than what is too little: come from far above.
    let mut found = None;
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(short, far);
        let brake = way(middle);
        if brake.fits(means) {
            found = Some(brake);
            far = middle;
        } else if found.is_none() && brake.overdone(&way(0.0)) {
            far = middle;
        } else {
            short = middle;
        }
    }
    found
}
