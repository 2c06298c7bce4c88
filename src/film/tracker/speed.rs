//! How fast a film runs, by its newest positions and by the filter: whether seats may follow it.

use super::recent::Speed;
use super::states::SourceSign;
use super::{Estimate, SAMPLES, SPEED_HELD, SourceTracker};
use crate::time::MonoTime;

impl SourceTracker {
    /// The speed of the newest positions. Half a window is soon of one speed; a whole one tells smaller differences.
    fn speeds(&self) -> [Option<Speed>; 2] {
        // What comes by the block of sound is late now more, now less, in rows that look like another speed.
        let bound_s = if self.traits.late_only { self.bound.as_secs_f64() } else { 0.0 };
        let least = self.traits.sigma_s.max(bound_s);
        let sigma = self.estimate.as_ref().map_or(least, Estimate::noise_s);
        let (short, span) = (self.window() / 2, self.span());
        [short, self.window()].map(|window| self.recent.speed(window, span, sigma, least))
    }

    /// Beyond the band by more than it may be off: noise alone must not stop seats.
    fn is_off(&self, rate: f64, by: f64) -> bool {
        (rate - 1.0).abs() > self.band + by
    }

    /// True as long as positions, or whoever tells them, say that it is not at its speed.
    pub(super) fn is_wound(&self) -> bool {
        let speeds = self.speeds();
        let mut known = speeds.iter().flatten();
        speeds == [None; 2]
            || known.any(|speed| self.is_off(speed.rate, speed.off))
            || self.is_off(self.told_rate, 0.0)
    }

    /// Whether it runs forward, at a speed that seats may follow, for as long as it takes to say so.
    pub(super) fn watch_speed(&mut self, at: MonoTime) {
        let speeds = self.speeds();
        if speeds == [None; 2] {
            return;
        }
        let is_backward = speeds.iter().flatten().any(|speed| speed.rate < -speed.off);
        // The filter knows the rate best, once it knows it.
        let fine = self.estimate.as_ref().filter(|_| !self.anew && self.fitted > SAMPLES);
        let is_off = speeds.iter().flatten().any(|speed| self.is_off(speed.rate, speed.off))
            || fine.is_some_and(|estimate| self.is_off(estimate.rate(), 3.0 * estimate.rate_sigma()));
        // What is to lead again has to be known to be at its speed: one beside it would lead and be stopped by turns.
        let is_known =
            fine.is_some_and(|estimate| !self.is_off(estimate.rate(), -2.0 * estimate.rate_sigma()));
        if is_off || is_backward {
            self.held.on_speed = None;
            let since = *self.held.off_speed.get_or_insert(at);
            // What runs backwards is no noise, and no pull-down: it is believed at once.
            if is_backward {
                self.on_sign(SourceSign::Backward, at);
            } else if at.since(since) >= SPEED_HELD {
                self.on_sign(SourceSign::OutOfBand, at);
            }
            return;
        }
        self.held.off_speed = None;
        let since = *self.held.on_speed.get_or_insert(at);
        if is_known && at.since(since) >= SPEED_HELD {
            self.on_sign(SourceSign::InBand, at);
        }
    }
}
