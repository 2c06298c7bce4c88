//! How the show is brought back onto the film: a little faster or slower than it, changing speed gently.

use std::time::Duration;

use crate::motion::Spacing;
use crate::time::Rate;

// Jerk grows by 6 %; a lag of 50 ms is gone in 2.6 s (docs/limiter.md, section 7).
/// The most that show time runs faster or slower than the clock.
pub(crate) const MAX_SPEED_UP: f64 = 0.02;

/// What it may take longer to come back to the pace of the clock: some frames, at 20 Hz one.
const ENDS_SURELY: Duration = Duration::from_millis(50);

/// How far the pace of show time may be from the clock's, and how quickly it may change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slewing {
    /// The greatest difference, as a share, up to [`MAX_SPEED_UP`].
    pub(crate) most: f64,
    /// Per second.
    pub(crate) change_per_s: f64,
}

impl Slewing {
    /// Of a show that nobody leads: what it missed is taken back as far as its cue leaves room, 0.2 % per 10 ms.
    pub(super) const OWN: Self = Self { most: MAX_SPEED_UP, change_per_s: 0.2 };

    /// In this time show time surely comes back to the pace of the clock.
    pub(super) fn ends_within(self) -> Duration {
        Duration::from_secs_f64(self.most / self.change_per_s) + ENDS_SURELY
    }
}

/// Sums of some hundred Times are off by less, seconds.
const ROUNDING_S: f64 = 1e-9;

/// How fast show time runs.
#[derive(Debug, Clone)]
pub(super) struct Slew {
    slewing: Slewing,
    speed_up: f64,
    /// For how long show time has run as the clock does, seconds.
    calm_s: f64,
    /// Further back than this the measure does not see, seconds.
    seen_s: f64,
}

impl Slew {
    /// Show time that runs as the clock does, and has for long.
    pub(super) fn new(rate: Rate, slewing: Slewing) -> Self {
        // The longest window of the measure: three of its longer distances, 81 ms at 1,000 Hz (docs/limiter.md, section 1).
        let periods = u32::try_from(3 * Spacing::at_rate(rate.hz()).m).unwrap_or(u32::MAX);
        let seen_s = f64::from(periods) / rate.hz() - ROUNDING_S;
        Self { slewing, speed_up: 0.0, calm_s: seen_s, seen_s }
    }

    /// Show time was set anew: it runs as the clock does, and has for long.
    pub(super) const fn reset(&mut self) {
        (self.speed_up, self.calm_s) = (0.0, self.seen_s);
    }

    /// Show time runs no faster than the clock from here on.
    pub(super) const fn end(&mut self) {
        // Not calm at once: the seam between both paces stays in what the measure sees.
        self.speed_up = 0.0;
    }

    /// Whether no change of pace is left in what the measure sees.
    pub(super) fn is_calm(&self) -> bool {
        self.calm_s >= self.seen_s
    }

    /// How fast show time runs, as a multiple of the clock.
    pub(super) fn pace(&self) -> f64 {
        1.0 + self.speed_up
    }

    /// How much show time passes in a frame of that Time at the present pace.
    pub(super) fn coast(&self, time: Duration) -> Duration {
        time.mul_f64(self.pace())
    }

    /// How much show time passes in a frame of that Time where it owes the film so many seconds, at most `ceiling` (0 to
    /// [`MAX_SPEED_UP`]) faster or slower than the clock; it is ahead of the film where it owes less than none. `film_s` of that are
    /// what the film itself goes further than the clock in this frame.
    pub(super) fn advance(&mut self, time: Duration, ceiling: f64, owed_s: f64, film_s: f64) -> Duration {
        let dt = time.as_secs_f64();
        let Slewing { most, change_per_s } = self.slewing;
        let (change, ceiling) = (change_per_s * dt, ceiling.min(most));
        // What is more than it may ask for is no pace, but ticks that were missed, or a trim that was set.
        let film_s = if film_s.abs() <= 2.0 * most * dt { film_s } else { 0.0 };
        // As the film runs, and by so much more or less that what is owed beside that is just closed.
        let left_s = owed_s - film_s;
        let closing = closing_speed(left_s.abs(), dt, change_per_s) * left_s.signum();
        let wanted = (film_s / dt + closing).min(ceiling).max(-ceiling);
        self.speed_up = wanted.clamp(self.speed_up - change, self.speed_up + change);
        // A pace that stands, and is another, is not calm: the change back from it is yet to come.
        self.calm_s = if self.speed_up == 0.0 { self.calm_s + dt } else { 0.0 };
        Duration::from_secs_f64(dt * (1.0 + self.speed_up))
    }
}

/// The greatest speed from which what is owed is just closed while slowing down gently.
fn closing_speed(owed: f64, dt: f64, change_per_s: f64) -> f64 {
    // Slowing by c dt a frame from k c dt covers c dt^2 k (k + 1) / 2; solved for k c dt (docs/limiter.md, section 6).
    let from_rest = (dt * dt / 4.0 + 2.0 * owed / change_per_s).sqrt() - dt / 2.0;
    // Where less is owed than a frame can close, that is up to twice of it: seats would pass the film.
    (change_per_s * from_rest).min(owed / dt)
}

#[cfg(test)]
mod tests {
    use super::super::playhead::{FramePace, Playhead};
    use super::*;
    use crate::time::ShowTime;

    #[test]
    fn a_lag_is_closed_without_passing_the_speed_its_change_or_the_goal() {
        for (hz, lag_ms) in [(100, 10), (100, 30), (1000, 1), (1000, 45), (50, 40), (10, 50), (20, 50)] {
            let period = Duration::from_secs(1) / hz;
            let mut slew = Slew::new(Rate::from_hz(f64::from(hz)), Slewing::OWN);
            let (mut owed_s, mut before) = (1e-3 * f64::from(lag_ms), 0.0);
            for _ in 0..10 * hz {
                let passed = slew.advance(period, MAX_SPEED_UP, owed_s, 0.0).as_secs_f64();
                let speed = passed / period.as_secs_f64() - 1.0;
                let change = Slewing::OWN.change_per_s * period.as_secs_f64();
                assert!(speed <= MAX_SPEED_UP + 1e-6, "{hz} Hz: {speed}");
                assert!((speed - before).abs() <= change + 1e-6, "{hz} Hz: {before} to {speed}");
                owed_s -= passed - period.as_secs_f64();
                before = speed;
            }
            assert!(owed_s.abs() < 2e-5, "{hz} Hz: {owed_s} of {lag_ms} ms are left");
        }
    }

    #[test]
    fn a_show_that_is_ahead_waits_for_the_film_as_gently() {
        let mut slew = Slew::new(Rate::from_hz(100.0), Slewing::OWN);
        let (mut owed_s, mut passed) = (-0.5, 0.0);
        for _ in 0..3_000 {
            let step = slew.advance(Duration::from_millis(10), MAX_SPEED_UP, owed_s, 0.0).as_secs_f64();
            assert!(step >= 0.010 * (1.0 - MAX_SPEED_UP) - 1e-9, "{step}");
            owed_s -= step - 0.010;
            passed += step;
        }
        assert!((passed - 29.5).abs() < 1e-4, "{passed}");
    }

    #[test]
    fn without_head_room_the_lag_stays() {
        let mut slew = Slew::new(Rate::from_hz(100.0), Slewing::OWN);
        for _ in 0..1000 {
            assert_eq!(slew.advance(Duration::from_millis(10), 0.0, 0.02, 0.0), Duration::from_millis(10));
        }
    }

    #[test]
    fn no_window_of_the_measure_has_a_change_of_pace_in_it_once_the_pace_is_calm() {
        for hz in [10.0, 24.0, 50.0, 60.0, 72.0, 100.0, 1000.0] {
            let rate = Rate::from_hz(hz);
            let mut playhead = Playhead::new(rate, ShowTime::ZERO, Slewing::OWN);
            playhead.trim(-1);
            let (mut frame, mut steady) = (0, 0);
            while frame == 0 || !playhead.is_calm() {
                playhead.pass(Duration::from_millis(rate.time_ms(frame).into()), || {
                    FramePace::Within(MAX_SPEED_UP)
                });
                frame += 1;
                steady = if playhead.pace() == 1.0 { steady + 1 } else { 0 };
            }
            let seen = 3 * Spacing::at_rate(hz).m;
            assert!((seen..=seen + 1).contains(&steady), "{hz} Hz: {steady} frames of {seen}");
        }
    }
}
