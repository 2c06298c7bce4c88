//! The one generator of every motion: from tick to tick a velocity that changes by an acceleration at most.
//!
//! In each tick the target moves by the mean of the velocities at its ends; distances are kept as twice the sum of
//! velocities, since half of one is no whole number.

/// What a motion is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TrajectoryGoal {
    /// A velocity, positive upwards, by an acceleration.
    Velocity { to: i64, acceleration: i64 },
    /// Rest at a place, as [`Trajectory::twice`] has it, no faster than a velocity.
    Place { twice: i64, acceleration: i64, velocity: i64 },
}

/// Where the generator is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Trajectory {
    /// Velocity units, positive upwards.
    pub(super) velocity: i64,
    /// Twice the sum of the velocity over all ticks.
    pub(super) twice: i64,
}

impl Trajectory {
    /// At rest.
    pub(super) const fn at_rest(twice: i64) -> Self {
        Self { velocity: 0, twice }
    }

    /// One tick; says how far it moved, and whether the goal is reached.
    pub(super) fn tick(&mut self, goal: TrajectoryGoal) -> (i64, bool) {
        let before = self.twice;
        let is_there = match goal {
            TrajectoryGoal::Velocity { to, acceleration } => {
                let next = self.velocity + (to - self.velocity).clamp(-acceleration, acceleration);
                self.step(next);
                next == to
            }
            TrajectoryGoal::Place { twice, acceleration, velocity } => {
                self.approach(twice, acceleration, velocity)
            }
        };
        (self.twice - before, is_there)
    }

    fn step(&mut self, next: i64) {
        self.twice = self.twice.saturating_add(self.velocity + next);
        self.velocity = next;
    }

    /// A tick towards a place: as fast as lets it still come to rest there.
    fn approach(&mut self, place: i64, acceleration: i64, most: i64) -> bool {
        let sign = if place < self.twice { -1 } else { 1 };
        let (left, speed) = ((place - self.twice) * sign, self.velocity * sign);
        if left <= acceleration && (0..=acceleration).contains(&speed) {
            *self = Self::at_rest(place);
            return true;
        }
        // From v1 on v1²/a is left (in twice the distance) after this tick's v0 + v1: v1² + a v1 <= a (left - v0).
        let a = i128::from(acceleration);
        let root = (a * a + 4 * a * i128::from(left - speed).max(0)).isqrt();
        let stoppable = i64::try_from((root - a) / 2).unwrap_or(i64::MAX);
        let next = stoppable.min(most).clamp(speed - acceleration, speed + acceleration);
        self.step(next * sign);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks to a place, with the greatest velocity and change of velocity on the way.
    fn run(mut from: Trajectory, place: i64, acceleration: i64, velocity: i64) -> (u32, i64, i64) {
        let goal = TrajectoryGoal::Place { twice: place, acceleration, velocity };
        let (mut ticks, mut fastest, mut hardest) = (0, 0, 0);
        loop {
            let before = from.velocity;
            let (_, is_there) = from.tick(goal);
            hardest = hardest.max((from.velocity - before).abs());
            fastest = fastest.max(from.velocity.abs());
            ticks += 1;
            assert!(ticks < 100_000, "{from:?}");
            if is_there {
                assert_eq!(from, Trajectory::at_rest(place));
                return (ticks, fastest, hardest);
            }
        }
    }

    #[test]
    fn a_move_ends_at_its_place_within_velocity_and_acceleration_whichever_way_it_goes() {
        for place in [1, 1_000, 20_000 << 27, -(20_000 << 27), 3 << 20] {
            let (_, fastest, hardest) = run(Trajectory::at_rest(0), place, 77_309, 64_424_509);
            assert!(fastest <= 64_424_509 && hardest <= 77_309, "{place}: {fastest} {hardest}");
        }
        // Ramp up and down of 833 ticks each, and what lies between.
        let (ticks, fastest, _) = run(Trajectory::at_rest(0), 20_000 << 27, 77_309, 64_424_509);
        assert_eq!(fastest, 64_424_509);
        assert!((21_660..21_680).contains(&ticks), "{ticks}");
    }

    #[test]
    fn one_that_moves_away_or_too_fast_turns_and_comes_back() {
        for velocity in [40_000_000, -40_000_000, 2_000_000_000] {
            let moving = Trajectory { velocity, twice: 0 };
            let (_, _, hardest) = run(moving, 1 << 27, 2_319_282, 64_424_509);
            assert!(hardest <= 2_319_282, "{velocity}: {hardest}");
        }
    }
}
