//! What a controller tells of where its axes are, from whichever register or report, put together into readings of the
//! seat. Ack thread; pure: told the time; allocates nothing.

use std::sync::Arc;
use std::time::Duration;

use super::pending::{ANSWERED_WITHIN, Claim, LATE};
use super::reads::PositionSource;
use crate::belief::{Reading, Source};
use crate::motion::{MAX_AXES, Pulses, SeatType, in_stroke};
use crate::time::MonoTime;
use crate::wire::{DP_POSITIONS, PerAxis, in_other_order};

/// How far apart two answers may see an axis at rest, in strokes.
const STILL: f64 = 0.001;
/// For how long an axis has to be seen in one place to be at rest there. What comes in one burst proves nothing.
const REST: Duration = Duration::from_millis(100);
/// So many answers of each source have to see it there. One may be an older one that the network repeats in place of another that it holds back.
const TIMES: u32 = 3;
/// As [`REST`] while the network repeats answers: one of them may be from before a move, and so may the next.
const REST_REPEATED: Duration = Duration::from_millis(500);
/// A repeated answer is hardly older than this.
const REPEATED: Duration = Duration::from_millis(300);
/// Answers further apart say nothing of what was between them.
const APART: Duration = Duration::from_millis(1_200);
/// How far outside its stroke an axis may be told and be at the end of it: rounding, and what a drive at rest swings by.
const OUTSIDE: f64 = 0.002;

/// For how long an axis has to be seen about one place to vibrate there and do nothing else, and how often it has to have turned round
/// meanwhile: whoever jogs an axis, or one that sinks, goes one way. As long, and by so many answers, it has to be seen in one place that
/// may vibrate: some of them may find it at the same place of each swing.
const SWAY: Duration = Duration::from_millis(500);
/// The same in two stretches, one after the other.
const STRETCH: Duration = Duration::from_millis(300);
const TURNS: u32 = 2;
/// And in each second, at the least: keys are not pressed as often.
const TURNS_S: f64 = 3.0;
const STILL_TIMES: u32 = 6;
/// How far apart the middles of two such stretches may be, as a share of the swing: an axis that goes elsewhere meanwhile has others.
const SAME_MIDDLE: f64 = 0.15;

/// What one axis told.
#[derive(Debug, Clone, Copy)]
struct Told {
    fraction: f64,
    /// When it was read at the earliest.
    at: MonoTime,
    /// Where it rests, if it does, and about where it vibrates.
    rest: Stay,
    sway: Sway,
    /// Whether it was elsewhere before, or something contradicted that.
    moved: bool,
}

/// Between which places an axis has swung, since when, at the latest, how often it has turned round, and how many answers of each source
/// are of that.
#[derive(Debug, Clone, Copy)]
struct Sway {
    low: f64,
    high: f64,
    since: MonoTime,
    turns: u32,
    /// Where it was seen to go last, and whether that was up.
    last: f64,
    rises: Option<bool>,
    seen: [u32; PositionSource::ALL.len()],
    /// The middle and the width of the stretch before, and whether that had the same middle as the one before it.
    before: Option<(f64, f64)>,
    is_steady: bool,
}

impl Sway {
    const fn begin(place: f64, since: MonoTime) -> Self {
        let seen = [0; PositionSource::ALL.len()];
        let (before, is_steady) = (None, false);
        Self { low: place, high: place, since, turns: 0, last: place, rises: None, seen, before, is_steady }
    }

    /// True if it was no farther from all that was seen of it than `within`.
    fn has(&self, fraction: f64, within: f64) -> bool {
        self.high.max(fraction) - self.low.min(fraction) <= within
    }

    /// The same with one more answer of these sources, which was made between `made` and `at`. It shows which way the axis goes only if it
    /// was not held back: of two that were on their way together nobody knows which is the older.
    fn go_on(mut self, fraction: f64, sources: &[PositionSource], made: MonoTime, at: MonoTime) -> Self {
        (self.low, self.high) = (self.low.min(fraction), self.high.max(fraction));
        sources.iter().for_each(|source| self.seen[*source as usize] += 1);
        if at.since(made) <= LATE && (fraction - self.last).abs() > STILL / 2.0 {
            let rises = fraction > self.last;
            self.turns += u32::from(self.rises.is_some_and(|before| before != rises));
            (self.last, self.rises) = (fraction, Some(rises));
        }
        if self.is_whole(at) { self.begin_next(fraction, at) } else { self }
    }

    /// True of a stretch that shows a vibration, if the next one shows the same.
    fn is_whole(&self, at: MonoTime) -> bool {
        let lasts = at.since(self.since);
        let turns = self.turns >= TURNS && f64::from(self.turns) >= TURNS_S * lasts.as_secs_f64();
        turns && lasts >= STRETCH && self.seen.iter().all(|times| *times >= TIMES)
    }

    fn begin_next(self, fraction: f64, at: MonoTime) -> Self {
        let (middle, width) = (f64::midpoint(self.low, self.high), self.high - self.low);
        let is_same =
            |(before, wide): &(f64, f64)| (before - middle).abs() <= SAME_MIDDLE * width.min(*wide) + STILL;
        let same = self.before.filter(is_same);
        // It swings as far as any of them shows.
        let widest = same.map_or(width, |(_, wide)| width.max(wide));
        Self { before: Some((middle, widest)), is_steady: same.is_some(), ..Self::begin(fraction, at) }
    }

    /// The middle of the swing, and its width.
    fn swing(&self) -> (f64, f64) {
        let now = (f64::midpoint(self.low, self.high), self.high - self.low);
        self.before.filter(|_| self.is_steady).unwrap_or(now)
    }
}

/// A place in which an axis has been, since when, at the latest, and how often each source has found it there.
#[derive(Debug, Clone, Copy)]
struct Stay {
    place: f64,
    since: MonoTime,
    seen: [Seen; PositionSource::ALL.len()],
}

/// How many answers of one source have found it there, and when the newest of them was made at the earliest.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    times: u32,
    at: MonoTime,
}

impl Stay {
    fn begin(place: f64, since: MonoTime) -> Self {
        Self { place, since, seen: [Seen::default(); PositionSource::ALL.len()] }
    }

    /// True if that is no farther away than `within`.
    fn has(&self, fraction: f64, within: f64) -> bool {
        (self.place - fraction).abs() <= within
    }

    /// The same with one more answer of these sources, which was made then.
    fn seen_by(mut self, sources: &[PositionSource], made: MonoTime) -> Self {
        for source in sources {
            let Seen { times, at } = &mut self.seen[*source as usize];
            (*times, *at) = (times.saturating_add(1), made.max(*at));
        }
        self
    }

    /// When the source saw it there last that has not for longest; none before all have.
    fn agreed(&self) -> Option<MonoTime> {
        let is_seen = self.seen.iter().all(|seen| seen.times > 0);
        self.seen.iter().map(|seen| seen.at).min().filter(|_| is_seen)
    }

    /// True if each source saw it there so often, and for as long.
    fn has_lasted(&self, (long, times): (Duration, u32)) -> bool {
        self.seen.iter().all(|seen| seen.times >= times && seen.at.since(self.since) >= long)
    }
}

/// The axes of one controller.
#[derive(Debug)]
pub(in crate::drive) struct Positions {
    seat: Arc<SeatType>,
    /// The place of the first of them in a frame.
    first_slot: usize,
    /// The axes that frames lead, of its seat type or not.
    led: usize,
    told: [Option<Told>; MAX_AXES],
    /// The axis, from 0, that told a position outside of its stroke, and which.
    outside: Option<(usize, Pulses)>,
    /// Whether something has told in which order the two words of a position come: the manuals differ, and both may make a
    /// place inside the stroke.
    ordered: bool,
    /// The axes whose last position would be another one inside the stroke in the other order, a bit each.
    ambiguous: u16,
    /// Whether it was homed, no frame went to it since, and none was found elsewhere: all its axes are at pulse 0.
    home: bool,
    by: Source,
    /// When the newest answer was made, at the earliest.
    answered: MonoTime,
    /// When the last frame went to it.
    sent: MonoTime,
    /// Until when answers may be repeated.
    repeats_until: MonoTime,
    /// The amplitude, strokes, with which it may vibrate though no frame goes to it.
    shakes: f64,
}

impl Positions {
    /// Those of a seat that may vibrate by so much, strokes.
    pub(super) fn new(seat: Arc<SeatType>, first_slot: usize, led: usize, shakes: f64) -> Self {
        let told = [None; MAX_AXES];
        Self {
            seat,
            first_slot,
            led,
            told,
            answered: MonoTime::default(),
            sent: MonoTime::default(),
            repeats_until: MonoTime::default(),
            shakes,
            outside: None,
            ordered: false,
            ambiguous: 0,
            home: false,
            by: Source::Registers,
        }
    }

    /// Hears an answer: where axes are, from `first` on. Gives what it tells by itself.
    pub(super) fn answer(
        &mut self,
        first: usize,
        positions: &[Pulses],
        source: PositionSource,
        claim: Claim,
        at: MonoTime,
    ) -> Reading {
        self.answered = self.answered.max(claim.oldest);
        self.hear(first, positions, &[source], claim.oldest, at, Source::Registers);
        // Whether a seat follows its frames is a question of now: it is looked at once more than needs be where this is an older answer.
        let made = if self.may_be_repeated(at) { claim.newest.before(REPEATED) } else { claim.newest };
        self.in_passing(first, positions, made)
    }

    /// What one answer tells of the axes from `first` on, of however many the seat has.
    fn in_passing(&self, first: usize, positions: &[Pulses], made: MonoTime) -> Reading {
        let own = self.seat.axes.min(MAX_AXES - self.first_slot);
        let mut reading = Reading {
            slots: 0,
            rests: false,
            by: Source::Passing,
            ..Reading::at_rest([0.0; MAX_AXES], made)
        };
        for (axis, pulses) in (first..own).zip(positions) {
            reading.pose[self.first_slot + axis] = self.seat.each[axis].fraction(*pulses);
            reading.slots |= 1 << (self.first_slot + axis);
        }
        reading
    }

    /// True while any answer may be an older one that the network repeats.
    fn may_be_repeated(&self, at: MonoTime) -> bool {
        at < self.repeats_until
    }

    /// The network repeats answers: for a while each may be from before a move. Of this one and of what was taken for the answer one is
    /// old, and where they differ nobody knows which: says whether they do.
    pub(super) fn on_repeated(&mut self, first: usize, positions: &[Pulses], at: MonoTime) -> bool {
        self.repeats_until = at + ANSWERED_WITHIN;
        self.is_contradicted(first, positions, at)
    }

    /// Hears a report. It comes unasked, past frames that are held back on their way: it makes a place of those axes alone that have no
    /// register, and of none where it contradicts what registers tell. What comes after an answer was made after it.
    pub(super) fn report(&mut self, positions: &[Pulses], at: MonoTime) {
        let of_registers = &positions[..positions.len().min(REGISTERS)];
        for (axis, pulses) in of_registers.iter().enumerate().take(self.seat.axes) {
            self.hold_against(axis, *pulses);
        }
        let is_contradicted = self.is_contradicted(0, of_registers, at);
        if let Some(others) = positions.get(REGISTERS..).filter(|_| !is_contradicted) {
            self.hear(REGISTERS, others, &PositionSource::ALL, self.answered, at, Source::Report);
        }
    }

    /// True if axes were told to be elsewhere. Then both places count, and none of all axes before the sources have agreed on it for
    /// long enough.
    fn is_contradicted(&mut self, first: usize, positions: &[Pulses], at: MonoTime) -> bool {
        // What swings is told elsewhere each time, and not farther than it swings.
        let within = self.sways();
        let (mut is_contradicted, mut is_beyond) = (false, false);
        for (axis, pulses) in (first..self.seat.axes.min(MAX_AXES)).zip(positions) {
            let fraction = self.seat.each[axis].fraction(*pulses).clamp(0.0, 1.0);
            if let Some(told) = &self.told[axis] {
                is_contradicted |= !told.rest.has(fraction, STILL);
                is_beyond |= !told.sway.has(fraction, within);
            }
        }
        for told in self.told.iter_mut().flatten().filter(|_| is_contradicted) {
            let sway = if is_beyond { Sway::begin(told.fraction, at) } else { told.sway };
            *told = Told { rest: Stay::begin(told.fraction, at), sway, moved: true, ..*told };
        }
        is_contradicted
    }

    /// Hears where axes were between `made` and `at`.
    fn hear(
        &mut self,
        first: usize,
        positions: &[Pulses],
        sources: &[PositionSource],
        made: MonoTime,
        at: MonoTime,
        by: Source,
    ) {
        for (axis, pulses) in (first..self.led).zip(positions) {
            let fraction = self.seat.each[axis].fraction(*pulses);
            let is_own = axis < self.seat.axes;
            // Frames would lead an axis that its seat type does not have to 0 at once: all of its stroke is there.
            let end = if is_own { 1.0 } else { 0.0 };
            let is_outside = !(-OUTSIDE..=end + OUTSIDE).contains(&fraction);
            let other = self.outside.filter(|(other, _)| *other != axis);
            self.outside = if is_outside { Some((axis, *pulses)) } else { other };
            // What may be from before the last frame says nothing of where it comes to rest.
            if !is_own || made < self.sent {
                continue;
            }
            self.by = by;
            if is_outside {
                self.told[axis] = None;
                continue;
            }
            if by == Source::Registers {
                self.mind_order(axis, *pulses);
            }
            let fraction = fraction.clamp(0.0, 1.0);
            self.home &= (fraction - self.zero(axis)).abs() <= STILL;
            let before = self.told[axis];
            let recent = before.filter(|told| made.since(told.at) <= APART);
            let rest = recent.map(|told| told.rest).filter(|rest| rest.has(fraction, STILL));
            // Old answers among new ones make a seat at rest swing from the one place to the other.
            let repeats = self.may_be_repeated(at);
            let swung = recent.filter(|_| !repeats).map(|told| told.sway);
            let sway = swung.filter(|sway| sway.has(fraction, self.sways()));
            let moved = before.is_some_and(|told| told.moved || rest.is_none());
            let rest = rest.unwrap_or_else(|| Stay::begin(fraction, at)).seen_by(sources, made);
            let sway = sway.unwrap_or(Sway::begin(fraction, at)).go_on(fraction, sources, made, at);
            self.told[axis] = Some(Told { fraction, at: made, rest, sway, moved });
        }
    }

    /// Where an axis is at pulse 0, fraction of its stroke.
    fn zero(&self, axis: usize) -> f64 {
        self.seat.each[axis].fraction(Pulses(0))
    }

    /// How far apart answers of an axis may be that vibrates, strokes.
    fn sways(&self) -> f64 {
        2.0 * self.shakes + STILL
    }

    /// It may vibrate by so much.
    pub(super) const fn may_shake(&mut self, shakes: f64) {
        self.shakes = shakes;
    }

    /// A position that only its own order puts inside the stroke settles the order for the whole controller; so does a seat that is
    /// known to be at 0.
    fn mind_order(&mut self, axis: usize, pulses: Pulses) {
        let other = in_other_order(pulses);
        let is_open = other != pulses && in_stroke(other, self.seat.each[axis].pulse_range());
        let bit = 1 << axis;
        self.ambiguous = if is_open { self.ambiguous | bit } else { self.ambiguous & !bit };
        let near_zero = self.home && pulses.0.unsigned_abs() < 1 << 15;
        self.ordered |= near_zero || (other != pulses && !is_open);
    }

    /// A report has no words: one that tells the place that the registers told, and not what they would tell in the other order,
    /// settles it as well.
    fn hold_against(&mut self, axis: usize, reported: Pulses) {
        let Some(told) = self.told[axis] else { return };
        let geometry = &self.seat.each[axis];
        let told = geometry.pulses(told.fraction);
        let apart = |one: Pulses| (geometry.fraction(one) - geometry.fraction(reported)).abs();
        self.ordered |= apart(told) <= STILL && apart(in_other_order(told)) > STILL;
    }

    /// Whether it tells two places for some axis, and nothing says which of them is true.
    pub(super) const fn is_ambiguous(&self) -> bool {
        self.ambiguous != 0 && !self.ordered
    }

    /// It says that it is home, as it was asked to be: what it said before was of another zero.
    pub(in crate::drive) fn on_homed(&mut self) {
        self.told = [None; MAX_AXES];
        self.home = true;
    }

    /// A frame went to it: where it stood before says nothing of whether it rests.
    pub(in crate::drive) const fn on_sent(&mut self, at: MonoTime) {
        (self.home, self.told, self.sent) = (false, [None; MAX_AXES], at);
    }

    /// The axis, from 0, that is not inside its stroke, and where it says that it is.
    pub(super) const fn outside(&self) -> Option<(usize, Pulses)> {
        self.outside
    }

    /// Its axes, from the first on, as far as it told them; none where it told nothing.
    pub(super) fn told(&self) -> Option<PerAxis<Pulses>> {
        let known = self.told.iter().take_while(|told| told.is_some()).count();
        let place = |axis: usize, told: Told| self.seat.each[axis].pulses(told.fraction);
        let pulses = |axis: usize| self.told[axis].map_or(Pulses(0), |told| place(axis, told));
        (known > 0).then(|| PerAxis::from_fn(known, pulses))
    }

    /// The seat as it was told last; none while an axis that tells its position has not.
    pub(super) fn reading(&self, now: MonoTime) -> Option<Reading> {
        let (pose, by) = ([0.0; MAX_AXES], self.by);
        let mut reading = Reading { pose, slots: 0, at: now, rests: true, moves: false, sways: 0.0, by };
        let (mut sways, mut widest) = (self.shakes > 0.0, 0.0_f64);
        let is_beyond = self.outside.is_some_and(|(axis, _)| axis >= self.seat.axes);
        if self.is_ambiguous() || is_beyond {
            return None;
        }
        let long = if self.may_be_repeated(now) { REST_REPEATED } else { REST };
        let rest = if sways { (long.max(SWAY), STILL_TIMES) } else { (long, TIMES) };
        for axis in 0..self.seat.axes.min(MAX_AXES - self.first_slot) {
            let slot = self.first_slot + axis;
            match self.told[axis] {
                Some(told) => {
                    // One source alone may be an old answer; that it is elsewhere than before is believed all the same.
                    let at = told.rest.agreed().or(told.moved.then_some(told.at))?;
                    reading.pose[slot] = told.fraction;
                    reading.at = reading.at.min(at);
                    let rests = told.rest.has_lasted(rest);
                    if !rests {
                        sways &= told.sway.is_steady;
                        widest = widest.max(told.sway.swing().1);
                    }
                    reading.rests &= rests;
                    reading.moves |= told.moved && !rests;
                }
                None if axis < REGISTERS => return None,
                // There is no register for it.
                None if !self.home => continue,
                None => (reading.by, reading.pose[slot]) = (Source::Homing, self.zero(axis)),
            }
            reading.slots |= 1 << slot;
        }
        if sways && !reading.rests {
            self.settle_on_middles(&mut reading, widest);
        }
        Some(reading)
    }

    /// One that vibrates is read where it does so about, and is elsewhere by no more than it swings.
    fn settle_on_middles(&self, reading: &mut Reading, widest: f64) {
        for axis in 0..self.seat.axes.min(MAX_AXES - self.first_slot) {
            if let Some(told) = self.told[axis] {
                reading.pose[self.first_slot + axis] = told.sway.swing().0;
            }
        }
        reading.sways = 2.0 * self.shakes.min(widest) + STILL;
    }
}

/// Axes that have position registers.
const REGISTERS: usize = DP_POSITIONS.len();

#[cfg(test)]
mod tests;
