//! One source: its observations in, its state and where the film is by it out. The place is an estimate, which may jump; the
//! seats' place is the [`super::follower`]'s, which may not.

mod grade;
mod kind;
mod quiet;
mod recent;
mod speed;
mod states;
#[cfg(test)]
mod tests;

use std::time::Duration;

pub(crate) use grade::SourceGrade;
pub(crate) use kind::SourceKind;

use super::estimate::{Estimate, RATE_SIGMA};
use super::late::LateBias;
use super::observation::{FilmWord, Observation};
use super::point::{FILM_FRAME, FilmPoint, FilmState};
use crate::time::{MonoTime, ShowTime};
use kind::Traits;
use recent::Recent;
use states::{SourceSign, next};

/// Three deviations of an estimate that seats may follow are less, seconds: a quarter of a film frame.
const SURE_S: f64 = 0.010;
/// The same of a source that is coarse.
const SURE_COARSE_S: f64 = 0.030;
/// An estimate that was good is too bad to be followed from here on, as a multiple: half a frame.
const DOUBT: f64 = 2.0;
/// Samples before a lock, and after a jump or a stop, when rate and noise are known.
const SAMPLES: u32 = 8;
const SAMPLES_AGAIN: u32 = 4;
/// For so long the lock rule has to hold. Noise makes it true by chance, but not for that long.
const SURE_FOR: Duration = Duration::from_millis(250);
/// Without a lock for so long the source is no use.
const ACQUIRE_FOR: Duration = Duration::from_secs(5);
/// Rates are told within that of what they are: the crystal's error.
const TOLD_RATE_SIGMA: f64 = 1e-4;
/// Samples that agree on another place have to span so long: a burst that a network held up agrees as well.
const JUMP_SPAN: Duration = Duration::from_millis(120);
/// What came longer ago says nothing of where the film is now.
const WINDOW: Duration = Duration::from_millis(500);
/// For a source that is slower than that, so many of its periods.
const WINDOW_PERIODS: u32 = 6;
/// One in so many positions makes up the share of those that do not fit; beyond this share the gate is too narrow.
const MISFITS_SHARE: f64 = 1.0 / 16.0;
const MISFITS_MOST: f64 = 0.25;
/// A speed has to be held so long: to be wound, or to have been.
const SPEED_HELD: Duration = Duration::from_millis(300);
/// Samples are missing after this, or after [`MISSING_PERIODS`]: a player that does not answer for that long hangs.
const MISSING: Duration = Duration::from_millis(250);
const MISSING_PERIODS: u32 = 4;
/// A line without edges is a machine that was stopped, or a plug that was pulled: nobody can tell them apart.
const SILENT_FOR: Duration = Duration::from_millis(500);
/// A line that carries what cannot be read carries a film that runs.
const DIRTY_FOR: Duration = Duration::from_secs(5);
/// So many times the same place in a row is a film that stands: 125 ms of timecode.
const FROZEN: u32 = 3;
/// One that is asked more often has to be the same for so long: the clock of a player moves by the periods of its sound, 21 ms.
const FROZEN_FOR: Duration = Duration::from_millis(100);
/// No film is longer; a player that says so lies.
const LONGEST: Duration = Duration::from_hours(100);

/// What became of the observations of a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct TrackerCounts {
    /// Positions that were used.
    pub(crate) used: u64,
    /// Positions that were left out: off the estimate, out of order, or of no film.
    pub(crate) rejected: u64,
    /// How often the film jumped, or was wound.
    pub(crate) jumps: u64,
    /// How often samples were missing.
    pub(crate) dropouts: u64,
    /// For how long the estimate has run on without them, in all.
    pub(crate) freewheel: Duration,
}

/// The tracker of one source. Any thread; allocates nothing.
#[derive(Debug, Clone)]
pub(crate) struct SourceTracker {
    estimate: Option<Estimate>,
    traits: Traits,
    /// How far the rate may be from 1.
    band: f64,
    state: FilmState,
    since: MonoTime,
    epoch: u32,
    late: LateBias,
    recent: Recent,
    newest: Option<Newest>,
    /// The next position begins the estimate anew.
    anew: bool,
    /// How fast it was said to run.
    told_rate: f64,
    winding: bool,
    /// The share of positions that did not fit, and whether the last one did not.
    misfits: f64,
    was_misfit: bool,
    /// When the last one did that fitted.
    fitted_at: MonoTime,
    /// Positions that fitted since the estimate began, or jumped.
    fitted: u32,
    /// Whether rate and noise are known from before that.
    is_known: bool,
    held: HeldSince,
    /// For how long after the newest position the estimate may run on.
    patience: Duration,
    /// And that as a multiple of it.
    freewheel: f64,
    polled: MonoTime,
    /// How far off the instant of the newest position may be.
    bound: Duration,
    /// When timecode came last that could not be placed.
    unplaced: Option<MonoTime>,
    /// Since when it may have been stopped, with no position from then on.
    may_stop: Option<MonoTime>,
    counts: TrackerCounts,
}

/// Since when something has been so that has to last.
#[derive(Debug, Clone, Copy, Default)]
struct HeldSince {
    /// The lock rule holds.
    sure: Option<MonoTime>,
    /// The film runs at a speed that seats may not follow, or at one that they may.
    off_speed: Option<MonoTime>,
    on_speed: Option<MonoTime>,
}

/// The newest position.
#[derive(Debug, Clone, Copy)]
struct Newest {
    at: MonoTime,
    media: ShowTime,
    /// When it last differed from the one before.
    moved: MonoTime,
    /// So often it was the same since then, which is not before it was last said to run.
    repeats: u32,
    same_since: MonoTime,
    /// From one to the next, on the whole.
    period: Duration,
}

impl SourceTracker {
    /// A source of which nothing was heard; `band` is how far from 1 its rate may be for seats to follow it.
    pub(crate) fn new(kind: SourceKind, band: f64, now: MonoTime) -> Self {
        let traits = kind.traits();
        Self {
            traits,
            band,
            state: FilmState::Absent,
            since: now,
            epoch: 0,
            estimate: None,
            late: LateBias::new(),
            recent: Recent::new(),
            newest: None,
            anew: true,
            told_rate: 1.0,
            winding: false,
            misfits: 0.0,
            was_misfit: false,
            fitted_at: now,
            fitted: 0,
            is_known: false,
            held: HeldSince::default(),
            patience: traits.silent_for,
            freewheel: 1.0,
            polled: now,
            bound: Duration::ZERO,
            unplaced: None,
            may_stop: None,
            counts: TrackerCounts::default(),
        }
    }

    pub(crate) const fn state(&self) -> FilmState {
        self.state
    }

    pub(crate) const fn counts(&self) -> TrackerCounts {
        self.counts
    }

    /// Deviation of the estimate, seconds; `None` before the first position.
    pub(crate) fn sigma_s(&self, now: MonoTime) -> Option<f64> {
        self.estimate.as_ref().map(|estimate| estimate.sigma_s(now))
    }

    /// Where the film is by this source.
    pub(crate) fn point(&self, now: MonoTime) -> FilmPoint {
        let stands = matches!(self.state, FilmState::Stopped | FilmState::Ended);
        let newest = self.newest.map_or(ShowTime::ZERO, |newest| newest.media);
        let (media, rate) = match &self.estimate {
            Some(estimate) if !stands && !self.anew => {
                let media_s = estimate.media_s(now) + self.bias_s();
                (ShowTime::from_secs_f64(media_s), estimate.rate())
            }
            _ => (newest, if stands { 0.0 } else { 1.0 }),
        };
        FilmPoint { at: now, media, rate, epoch: self.epoch, state: self.state }
    }

    fn bias_s(&self) -> f64 {
        if self.traits.late_only { self.late.bias_s() } else { 0.0 }
    }

    /// Takes up what the source told.
    pub(crate) fn hear(&mut self, told: &Observation) {
        let at = told.at;
        match told.word {
            FilmWord::Position(media) => self.on_position(told, media),
            FilmWord::Unplaced => self.on_unplaced(at),
            FilmWord::MayStop if self.runs() => {
                self.may_stop.get_or_insert(at);
            }
            FilmWord::Stop | FilmWord::MayStop => self.on_stop(at),
            // Said of a film that seats follow it is nothing new, and its place is not to be found again.
            FilmWord::Play if self.state.may_lead() => {}
            FilmWord::Play => {
                self.begin_anew();
                // It may have stood where it begins.
                if let Some(newest) = &mut self.newest {
                    (newest.repeats, newest.same_since) = (0, at);
                }
                self.on_sign(SourceSign::Play, at);
            }
            FilmWord::Seek => {
                self.winding = true;
                self.begin_anew();
                self.on_sign(SourceSign::Seek, at);
            }
            FilmWord::Landed => self.winding = false,
            FilmWord::Speed(rate) => self.on_told_speed(rate, at),
            FilmWord::End => {
                self.recent.clear();
                self.on_sign(SourceSign::End, at);
            }
            FilmWord::Silence => self.on_quiet(SILENT_FOR, at),
            FilmWord::Dirt => self.on_quiet(DIRTY_FOR, at),
            FilmWord::Gone => {
                (self.winding, self.told_rate) = (false, 1.0);
                self.begin_anew();
                self.on_sign(SourceSign::Gone, at);
            }
        }
    }

    fn on_sign(&mut self, sign: SourceSign, at: MonoTime) {
        let to = next(self.state, sign);
        if to == self.state {
            return;
        }
        self.counts.dropouts += u64::from(to == FilmState::Freewheeling);
        self.counts.jumps += u64::from(to == FilmState::Jumped);
        // Of a source that was lost nobody knows what was done to it meanwhile.
        self.anew |= to == FilmState::Lost;
        self.state = to;
        self.since = at;
        self.held.sure = None;
    }

    fn begin_anew(&mut self) {
        self.anew = true;
        self.recent.clear();
        (self.held.off_speed, self.held.on_speed) = (None, None);
    }

    fn on_told_speed(&mut self, rate: f64, at: MonoTime) {
        if !rate.is_finite() {
            return;
        }
        // Up to here it ran at the old speed, from here on at the new: no sample has to show that first. Its clock is off by as much.
        if let Some(estimate) = &mut self.estimate {
            estimate.predict(at);
            estimate.set_rate(rate * (estimate.rate() / self.told_rate).clamp(0.999, 1.001), TOLD_RATE_SIGMA);
        }
        self.told_rate = if rate == 0.0 { 1.0 } else { rate };
        if rate < 0.0 {
            self.on_sign(SourceSign::Backward, at);
        } else if (rate - 1.0).abs() > self.band {
            self.on_sign(SourceSign::OutOfBand, at);
        } else if matches!(self.state, FilmState::Reverse | FilmState::Shuttle) {
            self.begin_anew();
            self.on_sign(SourceSign::InBand, at);
        }
    }

    fn on_position(&mut self, told: &Observation, media: ShowTime) {
        let at = told.at;
        let is_of_a_film = media.as_nanos().unsigned_abs() <= crate::time::nanos(LONGEST);
        // In order alone: what was learned since an older one cannot be taken out of the estimate for it.
        if self.winding || !is_of_a_film || self.newest.is_some_and(|newest| at <= newest.at) {
            self.counts.rejected += 1;
            return;
        }
        (self.may_stop, self.bound) = (None, told.bound);
        if self.is_repeated(at, media) {
            return;
        }
        self.recent.push(at, media);
        self.patience = self.traits.silent_for;
        self.on_sign(SourceSign::Sample, at);
        match self.state {
            FilmState::Stopped | FilmState::Ended => self.watch_for_play(at),
            FilmState::Reverse | FilmState::Shuttle if self.is_wound() => {
                self.anew = true;
                self.watch_speed(at);
            }
            // Of a film that was wound, too: nobody is let go by a rate of before.
            _ if self.anew => self.begin(at, media),
            _ => self.fit(told, media),
        }
    }

    /// Notes the newest position. One that was told before says nothing new of a film that runs; several say that it stands.
    fn is_repeated(&mut self, at: MonoTime, media: ShowTime) -> bool {
        let Some(newest) = &mut self.newest else {
            let period = Duration::ZERO;
            self.newest = Some(Newest { at, media, moved: at, repeats: 0, same_since: at, period });
            return false;
        };
        newest.at = at;
        if newest.media == media {
            newest.repeats += 1;
            if newest.repeats >= FROZEN && at.since(newest.same_since) >= FROZEN_FOR {
                self.recent.clear();
                self.on_sign(SourceSign::Stop, at);
            }
            return true;
        }
        // By eighths, so that one gap does not make the source a slow one.
        let passed = at.since(newest.moved);
        newest.period =
            if newest.period.is_zero() { passed } else { (7 * newest.period + passed.min(WINDOW * 4)) / 8 };
        (newest.media, newest.moved) = (media, at);
        (newest.repeats, newest.same_since) = (0, at);
        false
    }

    /// The first position, or the first after a stop or a jump.
    fn begin(&mut self, at: MonoTime, media: ShowTime) {
        self.anew = false;
        (self.fitted, self.fitted_at) = (1, at);
        match &mut self.estimate {
            None => self.estimate = Some(Estimate::new(at, media.as_secs_f64(), self.traits.sigma_s)),
            Some(estimate) => {
                // It was wound, and that is over.
                if (estimate.rate() - 1.0).abs() > self.band {
                    estimate.set_rate(1.0, RATE_SIGMA);
                }
                estimate.move_to(at, media.as_secs_f64());
                self.epoch = self.epoch.wrapping_add(1);
                self.is_known = true;
            }
        }
    }

    /// Holds a position against the estimate.
    fn fit(&mut self, told: &Observation, media: ShowTime) {
        let at = told.at;
        let Some(estimate) = &mut self.estimate else { return };
        estimate.predict(at);
        // Without the late bias: that moves what is told, and in here would be learned a second time.
        let missed = media.as_secs_f64() - estimate.media_s(at);
        let fits = missed.abs() <= estimate.gate_s(told.bound);
        self.misfits += (if fits { 0.0 } else { 1.0 } - self.misfits) * MISFITS_SHARE;
        if fits {
            estimate.take_up(missed, told.bound);
            self.late.push(missed);
            (self.fitted, self.fitted_at) = (self.fitted.saturating_add(1), at);
            self.counts.used += 1;
            self.on_sign(SourceSign::Fit, at);
        } else {
            self.counts.rejected += 1;
            self.on_outlier(missed, at, media);
        }
        if !fits && self.was_misfit {
            self.held.sure = None; // one may be an outlier
        }
        self.was_misfit = !fits;
        self.watch_speed(at);
        self.settle(at);
        self.doubt(at);
    }

    /// A position that fits nowhere: the film may have jumped, or be noisier than it was.
    fn on_outlier(&mut self, missed: f64, at: MonoTime, media: ShowTime) {
        let (window, span) = (self.window(), self.span());
        let Some(estimate) = &mut self.estimate else { return };
        if let Some(ahead) = self.recent.agreed(window, span, estimate.rate(), estimate.noise_s()) {
            estimate.move_to(at, media.as_secs_f64() + ahead);
            self.fitted_at = at;
            // What has agreed once is not to move it again with the next sample.
            self.recent.clear();
            self.epoch = self.epoch.wrapping_add(1);
            // A cut of a frame is slewed: the noise is known, so nobody has to hold until the new place is.
            if (missed + ahead).abs() > FILM_FRAME.as_secs_f64() {
                (self.fitted, self.is_known) = (1, true);
                self.on_sign(SourceSign::Jump, at);
            } else {
                self.counts.jumps += 1;
            }
        } else if self.misfits > MISFITS_MOST && !self.was_misfit {
            // Such as come between others that fit; after a jump none fits any more, and the noise is what it was.
            estimate.widen(missed);
        }
    }

    fn window(&self) -> Duration {
        WINDOW.max(WINDOW_PERIODS * self.newest.map_or(Duration::ZERO, |newest| newest.period))
    }

    /// How long what is to be believed against the estimate has to last.
    fn span(&self) -> Duration {
        JUMP_SPAN.max(3 * self.newest.map_or(Duration::ZERO, |newest| newest.period) / 2)
    }

    /// A film that stands runs again if its positions advance. A single one that still comes from before a told stop does not.
    fn watch_for_play(&mut self, at: MonoTime) {
        let speed = self.recent.speed(self.window(), self.span(), self.traits.sigma_s, self.traits.sigma_s);
        // At half speed and more: a place that creeps in its noise is a film that stands.
        if speed.is_some_and(|speed| speed.rate > speed.off.max(0.5)) {
            self.begin_anew();
            self.on_sign(SourceSign::Play, at);
        }
    }

    /// The lock rule.
    fn settle(&mut self, at: MonoTime) {
        let Some(estimate) = &self.estimate else { return };
        let limit = if self.traits.coarse { SURE_COARSE_S } else { SURE_S };
        let is_in_band = (estimate.rate() - 1.0).abs() <= self.band + 2.0 * estimate.rate_sigma();
        let needed = if self.is_known { SAMPLES_AGAIN } else { self.traits.samples() };
        if 3.0 * estimate.sigma_s(at) >= limit || self.fitted < needed || !is_in_band {
            self.held.sure = None;
            return;
        }
        let since = *self.held.sure.get_or_insert(at);
        // Not where the noise is known from before, nor of what tells less often than that: its samples have taken longer.
        let is_slow = self.newest.is_some_and(|newest| newest.period >= SURE_FOR);
        if self.is_known || is_slow || at.since(since) >= SURE_FOR {
            self.on_sign(SourceSign::Sure, at);
        }
    }
}
