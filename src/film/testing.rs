//! Films and their sources in virtual time, for the tests of this room: what is true, and what is told of it.

use std::time::Duration;

use super::observation::{FilmWord, Observation};
use super::tracker::SourceKind;
use crate::time::{MonoTime, ShowTime};

/// Chance that a seed repeats: SplitMix64.
#[derive(Debug, Clone)]
pub(super) struct Luck(u64);

impl Luck {
    pub(super) const fn new(seed: u64) -> Self {
        Self(seed ^ 0x5851_f42d_4c95_7f2d)
    }

    pub(super) const fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1.
    #[expect(clippy::cast_precision_loss, reason = "53 bits")]
    pub(super) const fn share(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in from..to.
    pub(super) const fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.share()
    }

    pub(super) const fn is(&mut self, chance: f64) -> bool {
        self.share() < chance
    }

    pub(super) const fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// About normal, of deviation 1: the sum of twelve.
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.share()).sum::<f64>() - 6.0
    }
}

/// Seconds on the virtual clock, which did not start at zero.
pub(super) fn mono(seconds: f64) -> MonoTime {
    MonoTime::from_nanos(1_000_000_000) + Duration::from_secs_f64(seconds.max(0.0))
}

/// A film as it truly runs: from each time on, from a place, at a rate.
#[derive(Debug, Clone)]
pub(super) struct TrueFilm(Vec<(f64, f64, f64)>);

impl TrueFilm {
    pub(super) fn new(media_s: f64, rate: f64) -> Self {
        Self(vec![(0.0, media_s, rate)])
    }

    pub(super) fn media_s(&self, t: f64) -> f64 {
        let (since, media, rate) = *self.0.iter().rev().find(|leg| leg.0 <= t).unwrap_or(&self.0[0]);
        media + rate * (t - since)
    }

    /// Runs at another rate from then on.
    pub(super) fn rate_from(mut self, t: f64, rate: f64) -> Self {
        self.0.push((t, self.media_s(t), rate));
        self
    }

    /// Is that much further on from then on.
    pub(super) fn step_at(mut self, t: f64, seconds: f64) -> Self {
        let rate = self.0[self.0.len() - 1].2;
        self.0.push((t, self.media_s(t) + seconds, rate));
        self
    }
}

/// What a source makes of a film.
#[derive(Debug, Clone, Copy)]
pub(super) struct Told {
    pub(super) kind: SourceKind,
    /// Positions a second.
    pub(super) hz: f64,
    /// Deviation of what is normal about them, and the longest that they may be late, seconds.
    pub(super) noise_s: f64,
    pub(super) late_s: f64,
    /// The share that is lost.
    pub(super) lost: f64,
}

/// Each kind of source as it was measured.
pub(super) const SOURCES: [(&str, Told); 6] = {
    const fn told(kind: SourceKind, hz: f64, noise_ms: f64, late_ms: f64) -> Told {
        Told { kind, hz, noise_s: noise_ms * 1e-3, late_s: late_ms * 1e-3, lost: 0.0 }
    }
    [
        ("LTC", told(SourceKind::Ltc, 24.0, 0.02, 0.0)),
        ("mpv sound", told(SourceKind::MpvSound, 20.0, 0.05, 0.0)),
        ("mpv picture", told(SourceKind::MpvPicture, 24.0, 0.5, 0.0)),
        ("MTC", told(SourceKind::Mtc, 96.0, 0.05, 1.0)),
        ("Art-Net", told(SourceKind::ArtNet, 24.0, 0.0, 10.0)),
        ("HTTP", told(SourceKind::Message, 1.0, 3.0, 0.0)),
    ]
};

impl Told {
    /// What is told from one time to another; nothing in the gaps.
    pub(super) fn of(
        &self,
        film: &TrueFilm,
        span: (f64, f64),
        gaps: &[(f64, f64)],
        luck: &mut Luck,
    ) -> Vec<Observation> {
        let mut all = Vec::new();
        let mut t = span.0;
        while t < span.1 {
            t += 1.0 / self.hz;
            let mut late = self.noise_s * luck.normal() + self.late_s * luck.share();
            if self.late_s > 5e-3 && luck.is(0.01) {
                late += 0.05;
            }
            let is_heard = !luck.is(self.lost) && !gaps.iter().any(|gap| (gap.0..gap.1).contains(&t));
            if is_heard {
                let media = ShowTime::from_secs_f64(film.media_s(t));
                all.push(Observation::new(mono(t + late), FilmWord::Position(media)));
            }
        }
        all
    }
}
