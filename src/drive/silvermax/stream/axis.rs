//! One axis of a play: from its poses to segments, and what its unit has of them.

use std::collections::VecDeque;
use std::time::Duration;

use super::super::scale::DriveScale;
use super::clock::{UnitClock, seconds};
use super::polls::Polls;
use crate::cue::Vibration;
use crate::drive::link::{Account, AxisFigures, LinkAxis};
use crate::drive::{DriveCourse, Knots, Middles, Segment, SegmentFit, Shaker, TICK_NS};
use crate::time::MonoTime;
use crate::wire::silvermax::Request;

/// Segments of an axis that are kept in mind: those that wait, run, and ran a while ago.
const KEPT: usize = 16;
/// Segments that wait in a unit while all goes well, fillers apart. One place of its four stays free, so that a full queue is
/// news.
const WAITING: usize = 3;
/// Segments that wait in a unit at most (IMW, page 95), the running one apart.
pub(super) const QUEUE: usize = 4;
/// Ticks of a filler; no slice is as short.
const FILLER: u32 = 2;
/// Within how many slices a knot that is off its tick comes back: what a reading is off is no jolt.
const BACK_IN: f64 = 8.0;
/// What slices are stretched or shortened by at most.
const STRETCH: f64 = 0.01;

/// What a segment is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Rests up to the instant at which all axes begin.
    Start,
    /// Covers a slice, from 0.
    Slice(u32),
    /// Ends the queue where the axis rests.
    Last,
}

/// A segment on its way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Made {
    pub(super) segment: Segment,
    pub(super) kind: Kind,
}

/// A segment that its unit has.
#[derive(Debug, Clone, Copy)]
pub(super) struct Queued {
    pub(super) segment: Segment,
    /// Where it begins.
    begins: DriveCourse,
    /// At which tick.
    pub(super) from: i64,
}

/// What is not known of a unit.
#[derive(Debug, Clone, Copy)]
pub(super) enum Doubt {
    /// This was not answered, and the answer may still come.
    Unanswered(Request),
    /// Its queue has to be counted, by what still goes in.
    Queue {
        /// The first of the outbox may be in it; else one that was for another unit.
        is_own: bool,
        /// Fillers that went in.
        fillers: u32,
    },
}

/// What an axis is.
#[derive(Debug, Clone, Copy)]
pub(super) struct AxisTerms {
    pub(super) unit: u8,
    pub(super) scale: DriveScale,
    /// Deceleration of a stop.
    pub(super) brake: u32,
    pub(super) period: Duration,
    pub(super) tick: Duration,
}

/// One axis.
#[derive(Debug)]
pub(crate) struct Axis {
    pub(super) terms: AxisTerms,
    middles: Middles,
    shaker: Shaker,
    fit: SegmentFit,
    /// Middles that the fit has.
    pushed: u32,
    /// The knot behind the last slice, by ticks since the first.
    exact: f64,
    /// The tick of the first knot, once the queue runs.
    zero: Option<f64>,
    pub(super) clock: UnitClock,
    pub(super) outbox: VecDeque<Made>,
    pub(super) queued: VecDeque<Queued>,
    /// Ticks and course behind all that is queued.
    end: i64,
    pub(super) course: DriveCourse,
    /// Slices that the unit has.
    pub(super) confirmed: u32,
    /// Until then nothing is asked of it: its queue is full, or it still moves.
    pub(super) not_before: MonoTime,
    pub(super) doubt: Option<Doubt>,
    pub(super) failing_since: Option<MonoTime>,
    /// What register 40 held when it was read last, and what it is believed to hold.
    pub(super) read_canary: Option<i32>,
    pub(super) canary: Option<i32>,
    /// Targets that were wrong one after the other.
    pub(super) strayed: u8,
    /// It has to be told to brake.
    pub(super) owes_stop: bool,
    /// How far it is made ready.
    pub(super) step: usize,
    /// The target as it was read last while it is made ready.
    pub(super) stood_at: Option<i32>,
    pub(super) polls: Polls,
    pub(super) figures: AxisFigures,
}

impl LinkAxis for Axis {
    fn place(&self) -> f64 {
        self.terms.scale.fraction(self.course.position())
    }

    fn off_mm(&self, place: f64) -> f64 {
        let scale = self.terms.scale;
        scale.mm(scale.at(place) - self.course.position()).abs()
    }

    fn figures(&self, now: MonoTime) -> AxisFigures {
        AxisFigures { queued: self.waiting(now), ..self.figures }
    }
}

impl Axis {
    pub(super) fn new(terms: AxisTerms, now: MonoTime) -> Self {
        let knots = Knots::new(terms.period);
        Self {
            terms,
            middles: Middles::at_rest(terms.tick, terms.period, 0.0),
            shaker: Shaker::default(),
            fit: SegmentFit::at_rest(terms.scale.units(), knots, terms.scale.reach(0.0), 0),
            pushed: 0,
            exact: 0.0,
            zero: None,
            clock: UnitClock::new(),
            outbox: VecDeque::with_capacity(KEPT),
            queued: VecDeque::with_capacity(KEPT),
            end: 0,
            course: DriveCourse::at_rest(terms.scale.units(), 0),
            confirmed: 0,
            not_before: now,
            doubt: None,
            failing_since: None,
            read_canary: None,
            canary: None,
            strayed: 0,
            owes_stop: true,
            step: 0,
            stood_at: None,
            polls: Polls::new(now),
            figures: AxisFigures { clock: 1.0, ..AxisFigures::default() },
        }
    }

    pub(super) const fn account(&mut self) -> &mut Account {
        &mut self.figures.account
    }

    /// It rests at a place in counts, with an empty queue.
    pub(super) fn rest_at(&mut self, place: i32) {
        let AxisTerms { scale, period, tick, .. } = self.terms;
        self.course = DriveCourse::at_rest(scale.units(), place);
        self.middles = Middles::at_rest(tick, period, scale.fraction(f64::from(place)));
        self.fit = SegmentFit::at_rest(scale.units(), Knots::new(period), scale.reach(0.0), place);
        self.shaker = Shaker::default();
        (self.pushed, self.exact, self.zero, self.end, self.confirmed) = (0, 0.0, None, 0, 0);
        self.skip_all();
        self.queued.clear();
    }

    /// What is not sent any more.
    pub(super) fn skip_all(&mut self) {
        self.figures.account.skipped += self.outbox.len() as u64;
        self.outbox.clear();
    }

    /// The next pose, in strokes, and what vibrates on it. Slices end where `knot` says, the first at 1.
    pub(super) fn push(&mut self, pose: f64, swing: Vibration, knot: impl Fn(u32) -> MonoTime) {
        let swing = self.shaker.after(self.terms.tick, swing.hz, swing.amplitude);
        self.middles.push(pose + swing);
        while let Some(middle) = self.middles.next() {
            self.pushed += 1;
            let slice = self.pushed.checked_sub(3);
            if let Some(slice) = slice {
                self.keep_time(knot(slice + 1));
            }
            let made = self.fit.push(self.terms.scale.at(middle.position));
            if let (Some(segment), Some(slice)) = (made, slice) {
                self.make(segment, Kind::Slice(slice));
            }
        }
    }

    pub(super) fn make(&mut self, segment: Segment, kind: Kind) {
        self.figures.account.made += 1;
        self.outbox.push_back(Made { segment, kind });
    }

    /// Makes the next slice so long that it ends where it should by the unit's own clock.
    fn keep_time(&mut self, ends: MonoTime) {
        let slice = self.terms.period.as_secs_f64() * 1e9 / f64::from(TICK_NS);
        let rate = self.clock.rate;
        let off = self.zero.map_or(0.0, |zero| self.clock.ticks(ends) - zero - self.exact - slice * rate);
        let clock = rate + (off / (BACK_IN * slice)).clamp(-STRETCH, STRETCH);
        self.fit.set_clock(clock);
        self.exact += slice * clock;
    }

    /// True if what was fitted last is rest in its place.
    pub(super) fn fit_rests(&self) -> bool {
        self.fit.course().velocity() == 0
            && self.outbox.back().is_none_or(|made| made.kind == Kind::Start || made.segment.is_at_rest())
    }

    /// The segment that ends the queue.
    pub(super) fn last(&self) -> Segment {
        #[expect(clippy::cast_possible_truncation, reason = "a place in counts")]
        let place = self.fit.course().position().round() as i32;
        Segment::to_rest(0, place, self.terms.brake, self.terms.scale.velocity(1.0).cast_signed())
    }

    /// Its unit has taken a segment, and had it at an instant.
    pub(super) fn take(&mut self, made: Made, at: MonoTime) {
        if made.kind == Kind::Start {
            self.clock.start(at);
            self.zero = Some(f64::from(made.segment.ticks));
            self.polls.on_start(at);
        }
        if let Kind::Slice(slice) = made.kind {
            self.confirmed = slice + 1;
        }
        self.figures.account.acked += 1;
        self.enqueue(made.segment);
    }

    fn enqueue(&mut self, segment: Segment) {
        if self.queued.len() == KEPT {
            self.queued.pop_front();
        }
        self.queued.push_back(Queued { segment, begins: self.course, from: self.end });
        self.end += i64::from(segment.ticks);
        self.course = self.course.after(segment);
    }

    /// So many fillers are in the queue behind what is there; what is made by now comes after them.
    pub(super) fn put_in(&mut self, count: u32) {
        let filler = self.filler();
        (0..count).for_each(|_| self.enqueue(filler));
        let behind = self.outbox.iter().fold(self.course, |course, made| course.after(made.segment));
        self.fit.put_in(count * filler.ticks, behind);
    }

    /// Two ticks that change nothing: with so little acceleration the velocity stays as it is.
    #[expect(clippy::cast_possible_truncation, reason = "velocities are within full scale")]
    pub(super) fn filler(&self) -> Segment {
        Segment::moving(FILLER, 2, self.course.velocity() as i32)
    }

    /// True once its queue runs.
    pub(super) const fn has_started(&self) -> bool {
        self.zero.is_some()
    }

    /// True once its unit has the segment that ends the queue.
    pub(super) fn has_ended(&self) -> bool {
        self.queued.back().is_some_and(|queued| queued.segment.ticks == 0)
    }

    /// When what is queued is over.
    pub(super) fn ends(&self) -> MonoTime {
        self.clock.when(to_f64(self.end))
    }

    /// Segments that wait, the running one apart; all that it has before its queue runs.
    pub(super) fn waiting(&self, now: MonoTime) -> usize {
        self.queued.iter().filter(|queued| self.clock.when(to_f64(queued.from)) > now).count()
    }

    /// True if a segment waits to be sent, and there is room for it.
    pub(super) fn can_take(&self, now: MonoTime) -> bool {
        // Fillers are over in no time: what counts is what lasts.
        let brief =
            |queued: &&Queued| queued.segment.ticks <= FILLER && self.clock.when(to_f64(queued.from)) > now;
        let (waiting, fillers) = (self.waiting(now), self.queued.iter().filter(brief).count());
        self.outbox
            .front()
            .is_some_and(|made| made.kind == Kind::Start || waiting < QUEUE && waiting - fillers < WAITING)
    }

    /// How far the nearest beginning or end of a segment is from now.
    pub(super) fn to_knot(&self, now: MonoTime) -> Duration {
        let froms = self.queued.iter().map(|queued| queued.from).chain([self.end]);
        let off = |ticks| seconds(self.clock.when(to_f64(ticks)), now).abs();
        Duration::from_secs_f64(froms.map(off).fold(f64::from(u16::MAX), f64::min))
    }

    /// Where the unit is at an instant, by its segments.
    #[expect(clippy::cast_possible_truncation, reason = "a film is some 1e8 ticks")]
    pub(super) fn course_at(&self, at: MonoTime) -> DriveCourse {
        let now = self.clock.ticks(at).max(0.0) as i64;
        let running = self.queued.iter().find(|queued| now < queued.from + i64::from(queued.segment.ticks));
        running.map_or(self.course, |queued| {
            let since = u32::try_from(now - queued.from).unwrap_or(0);
            queued.begins.within(queued.segment, since)
        })
    }

    /// So many ticks were left in the running segment; false where none of them can be meant.
    pub(super) fn see_left(&mut self, at: MonoTime, left: i32) -> bool {
        let expected = self.clock.ticks(at);
        let ends = self.queued.iter().map(|queued| queued.from + i64::from(queued.segment.ticks));
        let ticks = ends.map(|end| to_f64(end - i64::from(left)));
        let nearest = ticks.min_by(|a, b| (a - expected).abs().total_cmp(&(b - expected).abs()));
        let fits = nearest.is_some_and(|ticks| self.clock.see(at, ticks));
        self.figures.clock = self.clock.rate;
        fits
    }

    /// A rest segment that ends at an instant, if it is received then.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some seconds of ticks")]
    pub(super) fn rest_until(&self, origin: MonoTime, received: MonoTime) -> Segment {
        let ticks = seconds(origin, received) * self.clock.rate * 1e9 / f64::from(TICK_NS);
        Segment::resting(ticks.round().max(1.0) as u32, self.course.position().round() as i32)
    }
}

#[expect(clippy::cast_precision_loss, reason = "a film is some 1e8 ticks")]
fn to_f64(ticks: i64) -> f64 {
    ticks as f64
}
