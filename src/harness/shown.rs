//! Films and their sources in virtual time: what is true, and what is told of it.

use std::time::Duration;

use crate::film::follower::PaceLimits;
use crate::film::observation::{FilmWord, Observation};
use crate::film::point::PublishedPoint;
use crate::film::tracker::{SourceKind, SourceTracker};
use crate::harness::asked::Chance;
use crate::time::{MonoTime, ShowTime};

/// Chance, with what films and their sources ask of it.
pub(crate) struct Luck(Chance);

impl Luck {
    pub(crate) const fn new(seed: u64) -> Self {
        Self(Chance::new(seed ^ 0x5851_f42d_4c95_7f2d))
    }

    #[cfg(test)]
    pub(crate) fn bits(&mut self) -> u64 {
        self.0.next()
    }

    /// Uniform in 0..1.
    pub(crate) fn share(&mut self) -> f64 {
        self.0.between(0.0, 1.0)
    }

    /// Uniform in from..to.
    #[cfg(test)]
    pub(crate) fn between(&mut self, from: f64, to: f64) -> f64 {
        self.0.between(from, to)
    }

    pub(crate) fn is(&mut self, chance: f64) -> bool {
        self.share() < chance
    }

    #[cfg(test)]
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// About normal, of deviation 1: the sum of twelve.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.share()).sum::<f64>() - 6.0
    }
}

/// Seconds on the virtual clock, which did not start at zero.
pub(crate) fn mono(seconds: f64) -> MonoTime {
    MonoTime::from_nanos(1_000_000_000) + Duration::from_secs_f64(seconds.max(0.0))
}

/// A film as it truly runs: from each time on, from a place, at a rate.
#[derive(Debug, Clone)]
pub struct TrueFilm(Vec<(f64, f64, f64)>);

impl TrueFilm {
    pub fn new(media_s: f64, rate: f64) -> Self {
        Self(vec![(0.0, media_s, rate)])
    }

    pub fn media_s(&self, t: f64) -> f64 {
        let (since, media, rate) = *self.0.iter().rev().find(|leg| leg.0 <= t).unwrap_or(&self.0[0]);
        media + rate * (t - since)
    }

    /// Runs at another rate from then on.
    pub fn rate_from(mut self, t: f64, rate: f64) -> Self {
        self.0.push((t, self.media_s(t), rate));
        self
    }

    /// Is that much further on from then on.
    pub fn step_at(mut self, t: f64, seconds: f64) -> Self {
        let rate = self.0[self.0.len() - 1].2;
        self.0.push((t, self.media_s(t) + seconds, rate));
        self
    }
}

/// What a source makes of a film.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Told {
    pub(crate) kind: SourceKind,
    /// Positions a second.
    pub(crate) hz: f64,
    /// Deviation of what is normal about them, and the longest that they may be late, seconds.
    pub(crate) noise_s: f64,
    pub(crate) late_s: f64,
    /// The share that is lost.
    pub(crate) lost: f64,
}

/// Each kind of source as it was measured.
pub(crate) const SOURCES: [(&str, Told); 6] = {
    const fn told(kind: SourceKind, hz: f64, noise_ms: f64, late_ms: f64) -> Told {
        Told { kind, hz, noise_s: noise_ms * 1e-3, late_s: late_ms * 1e-3, lost: 0.0 }
    }
    [
        ("LTC", told(SourceKind::Ltc, 24.0, 0.02, 0.0)),
        ("mpv sound", told(SourceKind::Mpv, 20.0, 0.05, 0.0)),
        ("mpv picture", told(SourceKind::Mpv, 24.0, 0.5, 0.0)),
        ("MTC", told(SourceKind::Mtc, 96.0, 0.05, 1.0)),
        ("Art-Net", told(SourceKind::ArtNet, 24.0, 0.0, 10.0)),
        ("HTTP", told(SourceKind::Message, 1.0, 3.0, 0.0)),
    ]
};

impl Told {
    /// What is told from one time to another; nothing in the gaps.
    pub(crate) fn of(
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

/// For so long the source of a film tells of it.
const TOLD_S: f64 = 120.0;

/// A film that is shown beside a hall in virtual time.
#[derive(Debug, Clone)]
pub struct ShownFilm {
    told: Told,
    pub truth: TrueFilm,
    words: Vec<(f64, FilmWord)>,
    gaps: Vec<(f64, f64)>,
    seed: u64,
}

impl ShownFilm {
    /// One of which the source of that number tells, of [`SOURCES`].
    pub fn told_by(source: usize, truth: TrueFilm, seed: u64) -> Self {
        Self { told: SOURCES[source].1, truth, words: Vec::new(), gaps: Vec::new(), seed }
    }

    /// The name of a source.
    pub fn name(source: usize) -> &'static str {
        SOURCES[source].0
    }

    /// The same of another film.
    pub fn changed(mut self, change: impl FnOnce(TrueFilm) -> TrueFilm) -> Self {
        self.truth = change(self.truth);
        self
    }

    /// Is stopped, and started again, by whoever says so.
    pub fn paused(mut self, from: f64, to: f64) -> Self {
        self.truth = self.truth.rate_from(from, 0.0).rate_from(to, 1.0);
        self.words.extend([(from, FilmWord::Stop), (to, FilmWord::Play)]);
        self
    }

    /// Nothing is heard of it for a while.
    pub fn unheard(mut self, from: f64, to: f64) -> Self {
        self.gaps.push((from, to));
        self
    }

    /// What comes of it for a while cannot be read.
    pub fn unreadable(mut self, from: f64, to: f64) -> Self {
        self.words.push((from, FilmWord::Dirt));
        self.unheard(from, to)
    }

    /// Somebody winds it, and says so, to so many seconds further on, by a player that takes so long for it.
    pub fn sought(mut self, at: f64, seconds: f64, takes_s: f64) -> Self {
        self.truth = self.truth.step_at(at, seconds);
        self.words.extend([(at - 0.01, FilmWord::Seek), (at + takes_s, FilmWord::Landed)]);
        self
    }

    /// From then on it runs at another rate, of which the source tells.
    pub fn sped(mut self, at: f64, rate: f64) -> Self {
        self.truth = self.truth.rate_from(at, rate);
        self.words.push((at, FilmWord::Speed(rate)));
        self
    }

    /// What is told of it in the first so many seconds.
    fn told(&self, seconds: f64) -> Vec<Observation> {
        let mut all = self.told.of(&self.truth, (0.0, seconds), &self.gaps, &mut Luck::new(self.seed));
        all.extend(self.words.iter().map(|(t, word)| Observation::new(mono(*t), *word)));
        // What is latest comes last: each is heard when it is there.
        all.sort_by_key(|told| told.at);
        all
    }
}

/// A film that runs, and whoever tracks it.
pub(crate) struct Showing {
    told: std::iter::Peekable<std::vec::IntoIter<Observation>>,
    tracker: SourceTracker,
}

impl Showing {
    pub(crate) fn new(film: &ShownFilm) -> Self {
        let tracker = SourceTracker::new(film.told.kind, PaceLimits::default().band, mono(0.0));
        Self { told: film.told(TOLD_S).into_iter().peekable(), tracker }
    }

    /// Hears what there is by now, and publishes where the film is.
    pub(crate) fn hear(&mut self, now: MonoTime, point: &PublishedPoint) {
        while let Some(told) = self.told.next_if(|told| told.at <= now) {
            self.tracker.hear(&told);
        }
        self.tracker.poll(now);
        point.publish(&self.tracker.point(now));
    }
}
