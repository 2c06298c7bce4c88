//! What is known of where each axis of a seat is, and from which evidence. The one place that holds it, and the one that makes
//! the pose from which a motion may begin ([`KnownPose`]): nobody else can seed planner and limiter, and nothing in here
//! makes a pose of what nobody measured or confirmed.
//!
//! An axis is somewhere between the places that it may have been left in: where the newest acked frame led it from, and where every
//! frame since then would have it (`span`). Each frame is held against all of these before it is sent
//! ([`Belief::allows`]). Tick thread; told the time; allocates nothing.

mod check;
mod evidence;
mod history;
mod kinds;
mod loss;
mod open;
mod shaking;
mod span;
#[cfg(test)]
mod tests;

use std::time::Duration;

pub(crate) use evidence::Source;
pub use evidence::{EvidenceTable, LaneEvidence, Reading};
use history::History;
pub use kinds::Taken;
pub(crate) use kinds::{Fall, Found, Known, Tally};
use loss::HeldBack;
pub(crate) use loss::{Lead, Wish};
use open::OpenFrames;
use shaking::Shaking;
use span::Spans;

use crate::motion::{MAX_AXES, Pose, Window};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// So long without an ack, or without a frame that the kernel takes, is a gap: from then on nobody knows which frames arrive.
pub(crate) const GAP: Duration = Duration::from_millis(50);
/// So long without one it is, even if the ack thread has not told meanwhile of what arrived.
const GAP_UNTOLD: Duration = Duration::from_millis(100);
/// LaneEvidence of a seat to which no frames go is too old for a motion to begin after this: beats come four times a second,
/// three axes each, and one of them may be lost.
pub(crate) const FRESH: Duration = Duration::from_millis(1_500);
/// The first frame of a motion leaves so long after its seat was read, and two periods, at the most: an answer may be held back on its
/// way, and meanwhile the seat is moved by hand.
const BEGINS: Duration = Duration::from_millis(100);
/// Frames further apart are not one motion: what comes after begins anew, from evidence. Hold frames are 100 ms apart.
const QUIET: Duration = Duration::from_millis(500);
/// What a seat may take to come to rest after the Time of its last frame is over; a reading before that is of a motion.
const SETTLE: Duration = Duration::from_millis(50);
/// So long after its frames a seat may be where they have led it: on their way, in the controller's queue, in its filters. Three
/// periods come to it: more frames than that in its queue it goes through in haste, or lags behind the film for good.
const FOLLOWS: Duration = Duration::from_millis(100);
/// A reading from before this says nothing of a seat that frames lead: where they led it then is not kept.
const STALE: Duration = Duration::from_millis(400);
/// How far from wherever frames have led it a seat may be found that follows them, strokes: 1.5 mm of 150.
pub(crate) const ASTRAY: f64 = 0.01;
/// Rounding to pulses, and the step from one whole millisecond to the next, may take a frame past the greatest speed by this.
const ROUNDING: f64 = 1.01;
/// How far from where it was left a seat at rest has to be found to have been moved, in strokes: 0.075 mm of 150.
const NEAR: f64 = 0.000_5;
/// The same as a share of the distance of one frame at the greatest speed, where that is less.
const NEAR_SHARE: f64 = 0.25;
/// Positions come in whole pulses.
const NEAR_PULSES: f64 = 1.5;

/// A pose, as fractions of each slot's stroke, in which a seat is known to be at rest. Only evidence makes one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownPose(Pose);

impl KnownPose {
    /// What a reading makes known of the seat of a lane with that window; none where it does not tell of every axis, or the seat was
    /// not at rest.
    #[must_use]
    pub(crate) fn of(reading: &Reading, window: &Window) -> Option<Self> {
        let whole = reading.rests && reading.slots & window.own() == window.own();
        whole.then_some(Self(reading.pose))
    }

    /// The pose.
    #[must_use]
    pub(crate) const fn pose(&self) -> &Pose {
        &self.0
    }
}

/// What is known of one lane.
#[derive(Debug, Clone)]
pub(crate) struct Belief {
    /// Strokes that each slot may move in a millisecond; without bound where the seat has no such axis.
    speed: Pose,
    /// Its greatest acceleration, strokes per second squared.
    acceleration: Pose,
    /// How far apart two places are the same, strokes.
    near: Pose,
    /// The slots that the seat has, a bit each.
    own: u16,
    /// Those of them that are known to be within the spans.
    within: u16,
    /// Its controller answers in another layout than that of our frames: none may go there.
    foreign: bool,
    known: Known,
    spans: Spans,
    open: OpenFrames,
    held_back: HeldBack,
    /// All that arrived before then was told.
    told: MonoTime,
    /// How long before it was looked at that was.
    untold: Duration,
    history: History,
    acked: Option<FrameNo>,
    shaking: Shaking,
    /// How far from where its spans say a seat may be that was read while it vibrated, strokes.
    sways: f64,
    /// The version of the reading that was taken last.
    reading: u32,
    /// Until when the controller is busy with what it was sent.
    busy_until: MonoTime,
    /// Until when it is at the most, were all that it got since its seat was last seen to follow overtaken on the way.
    busy_at_most: MonoTime,
    /// When the kernel first refused a frame since it last took one, and whether one of those was to ask for an ack.
    refused: Option<(MonoTime, bool)>,
    /// One of so many frames asks for an ack; 0 where none does: then what the kernel takes is all that can be known.
    ack_every: u32,
    gap: bool,
    period: Duration,
    /// How long before the seat executes them its frames are made, and how much later they may be confirmed.
    lead: Duration,
    acked_after: Duration,
    tally: Tally,
}

impl Belief {
    /// Nothing is known of a lane with that window, which gets a frame in each `period`; one of `ack_every` asks for an ack, none where
    /// that is 0.
    #[must_use]
    pub(crate) fn new(window: &Window, period: Duration, ack_every: u32) -> Self {
        let [mut speed, mut near, mut acceleration] = [[f64::INFINITY; MAX_AXES]; 3];
        for (index, slot) in window.slots().iter().enumerate().filter(|(_, slot)| slot.is_own) {
            speed[index] = ROUNDING * slot.limits.velocity * 1e-3;
            acceleration[index] = slot.limits.acceleration;
            let of_a_frame = NEAR_SHARE * slot.limits.velocity * period.as_secs_f64();
            near[index] = NEAR.min(of_a_frame).max(NEAR_PULSES / slot.stroke_pulses);
        }
        Self {
            speed,
            acceleration,
            near,
            own: window.own(),
            within: 0,
            foreign: false,
            known: Known::Nothing,
            spans: Spans::over(GAP + window.acked_after()),
            open: OpenFrames::none(),
            held_back: HeldBack::not(),
            told: MonoTime::default(),
            untold: Duration::ZERO,
            history: History::at([0.0; MAX_AXES]),
            acked: None,
            shaking: Shaking::default(),
            sways: 0.0,
            reading: 0,
            busy_until: MonoTime::default(),
            busy_at_most: MonoTime::default(),
            refused: None,
            ack_every,
            gap: false,
            period,
            lead: window.lead(),
            acked_after: window.acked_after(),
            tally: Tally::default(),
        }
    }

    /// What is known, and from which evidence.
    #[must_use]
    pub(crate) const fn known(&self) -> Known {
        self.known
    }

    /// What the check has done so far.
    #[must_use]
    pub(crate) const fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Whether it is not known which frames arrive; until the seat was read at rest.
    #[must_use]
    #[cfg(test)]
    pub(crate) const fn is_in_a_gap(&self) -> bool {
        self.gap
    }

    /// Takes up what the ack thread has seen so far; all that arrived before `told` is in it.
    pub(crate) fn look(&mut self, evidence: LaneEvidence<'_>, told: MonoTime, now: MonoTime) -> Found {
        self.foreign = evidence.is_foreign();
        (self.told, self.untold) = (told, now.since(told));
        if let Some(acked) = evidence.acked()
            && self.acked.is_none_or(|before| acked.since(before) > 0)
        {
            self.acked = Some(acked);
            self.time_ack(now);
            self.spans.confirm(acked);
            self.shaking.on_ack(acked);
        }
        if !self.spans.is_empty() {
            self.settle(now);
        }
        if evidence.version() != self.reading
            && let Some((version, reading)) = evidence.reading()
        {
            self.reading = version;
            if self.measure(&reading, now) == Found::Astray {
                return Found::Astray;
            }
        }
        if self.gap || !self.has_gap(told, now) {
            return Found::Nothing;
        }
        self.gap = true;
        self.tally.gaps += 1;
        Found::Gap
    }

    /// Where the seat has been led once all frames are confirmed and their Time is over. Where no acks are asked for, what
    /// the kernel took counts as confirmed then, and README says what that costs.
    fn settle(&mut self, now: MonoTime) {
        let confirmed = !self.asks() || self.acked.is_some_and(|acked| self.spans.are_confirmed(acked));
        if !confirmed || now + self.period / 2 < self.executed_until() {
            return;
        }
        self.spans.end_at_last();
        self.shaking.on_all_taken();
        (self.within, self.sways) = (self.own, 0.0);
        // Since then it may have been moved.
        let over = self.executed_until().min(now);
        self.known = if self.asks() { Known::Confirmed(over) } else { Known::Commanded(over) };
        self.gap &= self.asks();
    }

    /// Takes a reading of where the seat is. One from before the last frame was over tells only whether the seat follows. One that
    /// finds it where it was left confirms that; else it has to have found the seat at rest, or nobody knows any more where it
    /// is. Axes that a reading does not tell are where they were if those that it tells are.
    fn measure(&mut self, reading: &Reading, now: MonoTime) -> Found {
        let is_led = self.busy_until > MonoTime::default() && reading.at < self.executed_until() + SETTLE;
        if is_led || reading.by == Source::Passing {
            return self.hold_against(reading, now);
        }
        let told = reading.slots & self.own;
        let agrees = self.is_a_point()
            && !reading.moves
            && told & !self.within == 0
            && !self.is_elsewhere(told, &reading.pose);
        let sways = !reading.rests && reading.sways > 0.0 && told == self.own;
        if !agrees && !reading.rests && !sways {
            self.within &= !told;
            self.known = Known::Contradicted(now);
            return Found::Nothing;
        }
        // What was refused before has led it nowhere: a gap that this was is over with it.
        self.refused.take_if(|_| self.gap);
        let mut pose = *self.spans.last();
        slots_in(told).for_each(|slot| pose[slot] = reading.pose[slot]);
        self.within = told | if agrees { self.within } else { 0 };
        self.restart_at(pose);
        self.sways = if sways { reading.sways } else { 0.0 };
        self.known = Known::Measured(reading.at, reading.by);
        self.gap &= self.within != self.own || sways;
        Found::Nothing
    }

    /// Holds a reading of a seat that frames lead against where they have led it since shortly before: a controller may ack frames
    /// and not execute them, while it homes by itself or somebody jogs its seat.
    fn hold_against(&mut self, reading: &Reading, now: MonoTime) -> Found {
        if now.since(reading.at) > STALE {
            return Found::Nothing;
        }
        let since = reading.at.before(FOLLOWS + self.lead + 3 * self.period);
        let is_astray = |slot: usize| {
            let (low, high) = self.spans.reach(slot);
            let led = self.history.reach(slot, since);
            let (low, high, shakes) =
                led.map_or((low, high, 0.0), |led| (low.min(led.0), high.max(led.1), led.2));
            !(low - shakes - ASTRAY..=high + shakes + ASTRAY).contains(&reading.pose[slot])
        };
        if !slots_in(reading.slots & self.within).any(is_astray) {
            if reading.slots & self.own == self.own {
                self.busy_at_most = self.busy_until;
            }
            return Found::Nothing;
        }
        (self.within, self.known) = (0, Known::Contradicted(now));
        // However many acks come yet, it is not where they say; nor at rest where it stands between two frames of its queue.
        self.restart_at(*self.spans.last());
        self.busy_until = self.busy_until.max(self.busy_at_most);
        Found::Astray
    }

    /// The pose in which the seat is known to be at rest at `now`; none where an axis of it may be elsewhere, or where that was
    /// known too long ago.
    #[must_use]
    pub(crate) fn pose(&self, now: MonoTime) -> Option<KnownPose> {
        let is_known = self.within == self.own && self.is_a_point() && self.is_fresh(now);
        is_known.then(|| KnownPose(*self.spans.last()))
    }

    /// The same where a frame is to go there next: it was known only just now, whichever way the answer took.
    #[must_use]
    pub(crate) fn start(&self, now: MonoTime) -> Option<KnownPose> {
        // Where no acks are asked for nobody reads either.
        let within = if self.asks() { BEGINS + self.period + self.acked_after } else { FRESH };
        self.pose(now).filter(|_| self.is_recent(now, within))
    }

    const fn asks(&self) -> bool {
        self.ack_every > 0
    }

    fn is_a_point(&self) -> bool {
        self.sways == 0.0 && self.spans.is_a_point()
    }

    /// The pose about which a seat vibrates on that was cut off; none where it is not known to be there and to do nothing else.
    #[must_use]
    pub(crate) fn vibrates_about(&self, now: MonoTime) -> Option<&Pose> {
        let is_known = self.within == self.own && self.sways > 0.0 && self.is_fresh(now);
        is_known.then(|| self.spans.last())
    }

    /// The amplitude, strokes, with which a seat may vibrate by the frames that it was sent; 0 once one without is known to have arrived.
    #[must_use]
    pub(crate) const fn shakes(&self) -> f64 {
        self.shaking.amplitude()
    }

    /// Whether a motion that was asked for at `since` may begin: the seat was read since then, and only just now, and is known to be at
    /// rest; where no acks are asked for, whether it is known at all.
    #[must_use]
    pub(crate) fn may_begin(&self, since: MonoTime, now: MonoTime) -> bool {
        self.was_read(since) && self.start(now).is_some()
    }

    /// Whether a reading from `since` or later is the latest that is known of the seat; true where no acks are asked for.
    #[must_use]
    pub(crate) fn was_read(&self, since: MonoTime) -> bool {
        !self.asks() || matches!(self.known, Known::Measured(at, _) if at >= since)
    }

    /// Whether a reading told where some axes are, and of others nothing is known.
    #[must_use]
    pub(crate) const fn is_measured_in_part(&self) -> bool {
        matches!(self.known, Known::Measured(..)) && self.within != self.own
    }

    /// Whether something that is known puts the seat elsewhere than in `pose`, by more than is noise.
    #[must_use]
    pub(crate) fn contradicts(&self, pose: &Pose) -> bool {
        self.is_elsewhere(self.within, pose)
    }

    fn is_elsewhere(&self, slots: u16, pose: &Pose) -> bool {
        slots_in(slots).any(|slot| {
            let (low, high) = self.spans.reach(slot);
            (high - pose[slot]).abs().max((low - pose[slot]).abs()) > self.near[slot].max(self.sways)
        })
    }

    /// The distances within which two places are the same, strokes.
    #[must_use]
    pub(crate) const fn near(&self) -> &Pose {
        &self.near
    }

    fn is_fresh(&self, now: MonoTime) -> bool {
        self.is_recent(now, FRESH)
    }

    fn is_recent(&self, now: MonoTime, within: Duration) -> bool {
        match self.known {
            Known::Measured(at, _) | Known::Confirmed(at) => now.since(at) <= within,
            Known::Commanded(_) => !self.asks(),
            Known::Nothing | Known::Contradicted(_) => false,
        }
    }

    /// Whether its frames are made a while before the seat executes them.
    #[must_use]
    pub(crate) fn is_led_ahead(&self) -> bool {
        !self.lead.is_zero()
    }

    /// The seat may have been moved unseen: what was known of it is known no more.
    pub(crate) fn forget(&mut self) {
        (self.known, self.within, self.sways) = (Known::Nothing, 0, 0.0);
        self.restart_at(*self.spans.last());
    }
}

/// The slots of a set, a bit each.
#[inline]
fn slots_in(set: u16) -> impl Iterator<Item = usize> {
    (0..MAX_AXES).take_while(move |slot| set >> slot != 0).filter(move |slot| set >> slot & 1 == 1)
}
