//! How a lag behind the film is taken back: a little faster than the film, changing speed gently.

use std::time::Duration;

/// The most that show time runs faster than the clock.
pub const MAX_SPEED_UP: f64 = 0.02;
/// How quickly that may change, per second: 0.2 % per 10 ms.
pub(super) const CHANGE_PER_S: f64 = 0.2;

/// The lag of the show behind its grid, and how fast it is being taken back.
#[derive(Debug, Clone, Default)]
pub(super) struct Slew {
    lag_s: f64,
    speed_up: f64,
}

impl Slew {
    /// Show time falls behind by `span`.
    pub(super) fn fall_behind(&mut self, span: Duration) {
        self.lag_s += span.as_secs_f64();
    }

    /// How far the show is behind.
    #[must_use]
    pub(super) fn lag(&self) -> Duration {
        Duration::from_secs_f64(self.lag_s.max(0.0))
    }

    /// Forgets lag and speed: show time was set anew.
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }

    /// Show time was moved on by `span`, and runs no faster than the clock from here on.
    pub(super) fn skip(&mut self, span: Duration) {
        self.lag_s = (self.lag_s - span.as_secs_f64()).max(0.0);
        self.speed_up = 0.0;
    }

    /// How fast show time runs, as a multiple of the clock.
    pub(super) fn pace(&self) -> f64 {
        1.0 + self.speed_up
    }

    /// How much show time passes in a frame of that Time at the present pace.
    pub(super) fn coast(&mut self, time: Duration) -> Duration {
        self.lag_s -= self.speed_up * time.as_secs_f64();
        time.mul_f64(self.pace())
    }

    /// How much show time passes in a frame of that Time, at most `ceiling` (0 to [`MAX_SPEED_UP`]) faster than it.
    pub(super) fn advance(&mut self, time: Duration, ceiling: f64) -> Duration {
        let dt = time.as_secs_f64();
        let change = CHANGE_PER_S * dt;
        let wanted = self.closing_speed(dt).min(ceiling).min(MAX_SPEED_UP);
        self.speed_up = wanted.clamp(self.speed_up - change, self.speed_up + change).max(0.0);
        self.lag_s -= self.speed_up * dt;
        Duration::from_secs_f64(dt * (1.0 + self.speed_up))
    }

    /// The greatest speed from which the lag is just closed while slowing down gently.
    fn closing_speed(&self, dt: f64) -> f64 {
        if self.lag_s <= 0.0 {
            return 0.0;
        }
        let from_rest = (dt * dt / 4.0 + 2.0 * self.lag_s / CHANGE_PER_S).sqrt() - dt / 2.0;
        (CHANGE_PER_S * from_rest).min(self.lag_s / dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_is_closed_without_passing_the_speed_its_change_or_the_goal() {
        for (hz, lag_ms) in [(100, 10), (100, 30), (1000, 1), (1000, 45), (50, 40), (10, 50), (20, 50)] {
            let period = Duration::from_secs(1) / hz;
            let mut slew = Slew::default();
            slew.fall_behind(Duration::from_millis(lag_ms));
            let (mut gained, mut before) = (0.0, 0.0);
            for _ in 0..10 * hz {
                let speed = slew.advance(period, MAX_SPEED_UP).as_secs_f64() / period.as_secs_f64() - 1.0;
                let change = CHANGE_PER_S * period.as_secs_f64();
                assert!(speed <= MAX_SPEED_UP + 1e-6, "{hz} Hz: {speed}");
                assert!((speed - before).abs() <= change + 1e-6, "{hz} Hz: {before} to {speed}");
                gained += speed * period.as_secs_f64() * 1e3;
                before = speed;
            }
            #[expect(clippy::cast_precision_loss, reason = "a few milliseconds")]
            let lag = lag_ms as f64;
            assert!((gained - lag).abs() < 0.02, "{hz} Hz: {gained} of {lag} ms");
        }
    }

    #[test]
    fn without_head_room_the_lag_stays() {
        let mut slew = Slew::default();
        slew.fall_behind(Duration::from_millis(20));
        for _ in 0..1000 {
            assert_eq!(slew.advance(Duration::from_millis(10), 0.0), Duration::from_millis(10));
        }
        assert_eq!(slew.lag(), Duration::from_millis(20));
    }
}
