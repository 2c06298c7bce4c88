//! The samples of the last moments, whether they fitted or not: from them a jump is told from an outlier, and winding from noise.

use std::time::Duration;

use crate::time::{MonoTime, ShowTime};

/// Samples that are kept: half a second of 120 a second, and 0.32 s of a player that is asked every 5 ms. All outliers have to be
/// among them: of a source with 100 samples a second the last four span 30 ms, and would never be old enough to be believed.
const KEPT: usize = 64;
/// Samples that have to agree on where the film is now.
const AGREEING: usize = 4;
/// How far apart two samples that agree may be, seconds, or three deviations.
const AGREE_WITHIN_S: f64 = 0.004;
/// How far the samples may be from the line through them that is to be a speed, in deviations.
const STRAIGHT: f64 = 3.0;
/// The deviations by which a speed has to differ.
const SPEED_SIGMAS: f64 = 4.0;

#[derive(Debug, Clone, Copy, Default)]
struct SeenPlace {
    at: MonoTime,
    media: ShowTime,
}

/// The last samples, oldest first.
#[derive(Debug, Clone)]
pub(super) struct Recent {
    places: [SeenPlace; KEPT],
    count: usize,
}

/// A speed, and how far off it may be at the most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Speed {
    pub(super) rate: f64,
    pub(super) off: f64,
}

impl Recent {
    pub(super) fn new() -> Self {
        Self { places: [SeenPlace::default(); KEPT], count: 0 }
    }

    pub(super) const fn clear(&mut self) {
        self.count = 0;
    }

    pub(super) const fn push(&mut self, at: MonoTime, media: ShowTime) {
        self.places[self.count % KEPT] = SeenPlace { at, media };
        self.count += 1;
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count.min(KEPT)
    }

    /// The newest first, seconds from the newest: when, and where.
    fn since_newest(&self, window: Duration) -> impl Iterator<Item = (f64, f64)> {
        let newest = self.places[(self.count + KEPT - 1) % KEPT];
        let from_newest = move |back: usize| {
            let place = self.places[(self.count - 1 - back) % KEPT];
            let span = newest.at.since(place.at);
            // From the newest on: squares of seconds since midnight would lose the microseconds.
            let media = place.media.since(newest.media).as_nanos();
            (span, (-span.as_secs_f64(), ShowTime::from_nanos(media).as_secs_f64()))
        };
        let within = move |place: &(Duration, (f64, f64))| place.0 <= window;
        (0..self.len()).map(from_newest).take_while(within).map(|(_, place)| place)
    }

    /// Where the newest samples agree that the film is, as seconds ahead of the newest: those of the window that are on one line of
    /// that rate are the majority since the oldest of them, and span so long.
    pub(super) fn agreed(&self, window: Duration, span: Duration, rate: f64, sigma_s: f64) -> Option<f64> {
        // At the known rate: what agrees at another one alone is a film that is wound, and was not cut.
        let near = AGREE_WITHIN_S.max(3.0 * sigma_s);
        let (mut agreeing, mut ahead, mut oldest, mut seen_by_then, mut seen) = (0, 0.0, 0.0, 0, 0);
        for (when, place) in self.since_newest(window) {
            seen += 1;
            let off = place - rate * when;
            if off.abs() <= near {
                agreeing += 1;
                ahead += off;
                (oldest, seen_by_then) = (-when, seen);
            }
        }
        // Of those since the oldest: what came before a jump agrees as well, on where the film was.
        let is_agreed = agreeing >= AGREEING && 2 * agreeing > seen_by_then && oldest >= span.as_secs_f64();
        is_agreed.then(|| ahead / f64::from(u32::try_from(agreeing).unwrap_or(1)))
    }

    /// The speed of the line through the samples of the window; `None` if they are not on one, or too few. A sample may be
    /// `sigma_s` from it, and is so by `least_s` at least, however well it happens to lie.
    pub(super) fn speed(
        &self,
        window: Duration,
        span: Duration,
        sigma_s: f64,
        least_s: f64,
    ) -> Option<Speed> {
        let (mut n, mut t, mut m, mut tt, mut tm, mut mm, mut oldest) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (when, place) in self.since_newest(window) {
            n += 1.0;
            (t, m) = (t + when, m + place);
            (tt, tm, mm) = (tt + when * when, tm + when * place, mm + place * place);
            oldest = -when;
        }
        // Through two any line goes, and what three leave beside it says next to nothing of their noise.
        if n < 4.0 || oldest < span.as_secs_f64() {
            return None;
        }
        // Least squares: slope, and what is left beside the line.
        let (stt, stm, smm) = (tt - t * t / n, tm - t * m / n, mm - m * m / n);
        let rate = stm / stt;
        let left = ((smm - rate * stm) / (n - 2.0)).max(0.0).sqrt();
        let is_straight = left <= STRAIGHT * sigma_s + AGREE_WITHIN_S * rate.abs().min(1.0);
        is_straight.then(|| Speed { rate, off: SPEED_SIGMAS * left.max(least_s) / stt.sqrt() })
    }
}
