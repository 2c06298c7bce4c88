//! Poses of seats into targets of their motors, as long as poses come.
//!
//! ```text
//!  poses --ring--> SixpackLane: Track --Axis: TargetMaker--> frames behind one break, each slice: to be there, or to stop
//!  events <--ring-- confirmed, rests, moves, lost, ...  <---- a question in ten targets
//! ```
//!
//! Each target is that of the instant at which it arrives: axes need not wait for each other, and a slice that a question made late is
//! late in its targets, too. A unit confirms nothing: frames count as confirmed once one of its motors was read where they lead it,
//! the motors by turns.
//!
//! Any order may be damaged on the way, into one that leads a motor far away at its full speed; and none says when. So each motor of a unit
//! that ever answered is told something in each slice, whatever its lane does and whether it still answers: where to be, or to stop, which brakes
//! and never begins a motion. No order is in force for longer than a slice, and no slice waits for more than one question.

mod axis;
mod lane;
mod track;
mod watch;

use std::time::Duration;

use self::axis::Axis;
use self::lane::{LaneState, SixpackLane};
use self::track::Track;
use super::home::{Homing, home};
use super::set_up::{HomeError, SeatMotors};
use super::talk::{Talk, waking_baud};
use crate::drive::link::{
    BrakeReason, Family, IDLE, Lead, LedPose, LinkFault, LinkPort, LinkTalk as _, Stage, Stream, StreamEvent,
    StreamTerms, lane_number as number,
};
use crate::time::MonoTime;
use crate::wire::FrameNo;
use crate::wire::sixpack2::{AbortSearch, SixpackFrame, SixpackOrder};

/// A question is asked for so many targets.
const TARGETS: u32 = 10;
/// How far from the rate with which a unit wakes a line is no longer understood by one, in parts of a hundred.
const UNDERSTOOD: u32 = 5;
/// A slice that is so many periods late is not made up for.
const HELD_UP: u32 = 4;
/// How often a unit that is lost is looked for, at its rate and at that with which it wakes by turns.
const PROBES: Duration = Duration::from_millis(125);

/// The longest from one reading of a seat until the next, where so many seats with so many axes in all are on a link: each has its turn
/// once for each of them, and who it is may be asked in one.
#[must_use]
pub(crate) fn read_every(period: Duration, seats: u32, axes: u32) -> Duration {
    period * (TARGETS.div_ceil(axes.max(1)) + 1) * 2 * seats
}

/// SIXpack 2 units: poses become targets of their motors, all of a slice at once.
#[derive(Debug)]
pub(crate) struct Sixpack2 {
    next_slice: MonoTime,
    /// A slice was sent right now.
    is_fresh: bool,
    /// Targets since the last question, and the lane that is asked next.
    targets: u32,
    next_asked: usize,
    /// The axis whose question was not answered: by one bit it is the order to search.
    unanswered: Option<(usize, usize)>,
    slices: usize,
}

impl Family for Sixpack2 {
    /// A slice and a half until the last of what is sent in one, a tick until it can be interpolated, a question that makes a slice late; the
    /// rest is for ticks that are missed.
    const LEAD: Lead = Lead { periods: 4, ticks: 4 };
    type Talk<P: LinkPort> = Talk<P>;
    type Seat<'a> = SeatMotors<'a>;
    type Error = HomeError;
    type Axis = Axis;
    type LaneState = LaneState;

    /// Not at a rate at which a unit that was restarted goes on following targets.
    fn at(baud: u32, now: MonoTime) -> Result<Self, HomeError> {
        let waking = waking_baud();
        if baud.abs_diff(waking) * 100 <= UNDERSTOOD * waking {
            return Err(HomeError::WakingRate { baud });
        }
        Ok(Self { next_slice: now, is_fresh: false, targets: 0, next_asked: 0, unanswered: None, slices: 0 })
    }

    fn lane(seat: &SeatMotors<'_>, terms: StreamTerms, now: MonoTime) -> Result<SixpackLane, HomeError> {
        let axes = seat.axes()?.iter().map(|axis| Axis::new(axis, terms.period, now)).collect();
        Ok(SixpackLane::new(axes, terms, LaneState::new(seat.unit, terms.tick, now), now))
    }

    fn begin<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize, at: MonoTime) {
        let soonest = stream.talk.now() + stream.terms.period;
        stream.lanes[lane].own.track.begin(at.max(soonest));
    }

    fn push(lane: &mut SixpackLane, led: &LedPose) {
        lane.push(led);
    }

    fn mind<P: LinkPort>(stream: &mut Stream<Self, P>, index: usize, now: MonoTime) {
        let is_held_up = now.since(stream.own.next_slice) > HELD_UP * stream.terms.period;
        let lane = &mut stream.lanes[index];
        lane.own.track.forget(now);
        match lane.stage {
            // Its motors stand by now, and would make up at once for all that they were not told.
            Stage::Runs | Stage::Ends if is_held_up => {
                lane.make_ready(now);
                stream.tell(StreamEvent::Braked { lane: number(index), why: BrakeReason::Dry });
            }
            Stage::Runs if lane.is_left_alone(now) && !lane.ends_moving() => {
                lane.own.track.end();
                lane.stage = Stage::Ends;
            }
            Stage::Runs if lane.is_left_alone(now) => stream.brake(index, BrakeReason::PosesEnded),
            Stage::Runs if lane.is_behind(now) && lane.ends_moving() => {
                stream.brake(index, BrakeReason::Behind);
            }
            Stage::Ends if lane.has_come_to_rest(now) => lane.make_ready(now),
            _ => {}
        }
    }

    fn work<P: LinkPort>(stream: &mut Stream<Self, P>, now: MonoTime) -> Result<Option<MonoTime>, LinkFault> {
        // Where a slice takes longer than the period the next is due at once: a question comes before that all the same, one at the most.
        if stream.has_time() && stream.ask_next(now)? {
            return Ok(None);
        }
        if now < stream.own.next_slice {
            return Ok(Some(stream.own.next_slice.min(now + IDLE)));
        }
        stream.send_slice()?;
        Ok(None)
    }

    /// By the targets of the next slice.
    fn brake(lane: &mut SixpackLane, now: MonoTime) -> bool {
        match lane.stage {
            Stage::Runs => {
                lane.brake(now);
                lane.stage = Stage::Ends;
            }
            Stage::Ready => lane.make_ready(now),
            Stage::Readying | Stage::Ends | Stage::Lost | Stage::Out => {}
        }
        true
    }

    /// Behind what is executed by now: that is confirmed as ever.
    fn dropped(lane: &SixpackLane) -> FrameNo {
        lane.own.track.newest().map_or(lane.unconfirmed, FrameNo::next)
    }

    /// Those that are not led are told to in each slice.
    fn stop<P: LinkPort>(_: &mut Stream<Self, P>) -> Result<(), LinkFault> {
        Ok(())
    }

    fn settle<P: LinkPort>(stream: &mut Stream<Self, P>) -> Result<(), LinkFault> {
        stream.settle_lanes()
    }

    fn let_go(lane: &mut SixpackLane, now: MonoTime) {
        lane.own.track = Track::at_rest(lane.terms.tick, lane.places(), now);
        (lane.own.not_before, lane.own.known) = (now + PROBES, Some(now));
    }

    fn locate<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize) {
        (stream.own.next_asked, stream.own.targets) = (lane, TARGETS);
    }

    fn look<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize) {
        if let Some(lane) = stream.lanes.get_mut(lane) {
            lane.own.known = None;
        }
    }
}

impl<P: LinkPort> Stream<Sixpack2, P> {
    /// Homes the seat of a lane: whatever comes of it, nothing leads it to where it stood before.
    ///
    /// # Errors
    /// A [`HomeError`]; the lane is out then.
    pub(crate) fn home_seat(
        &mut self,
        lane: u16,
        seat: SeatMotors<'_>,
        around: Homing<'_>,
    ) -> Result<(), HomeError> {
        if let Some(lane) = self.lanes.get_mut(usize::from(lane)) {
            (lane.stage, lane.own.is_home) = (Stage::Out, false);
        }
        home(&mut self.talk, seat, around)?;
        self.rejoin(lane);
        Ok(())
    }

    /// Has the motors of seats that take no part told to stand: what is damaged on its way may be an order to them.
    pub(crate) fn stand_by<'a>(&mut self, absent: impl Iterator<Item = SeatMotors<'a>>) {
        let (terms, now) = (self.terms, self.talk.now());
        // Nobody can have homed one that cannot be set up.
        for mut lane in absent.filter_map(|seat| Sixpack2::lane(&seat, terms, now).ok()) {
            lane.own.is_absent = true;
            self.lanes.push(lane);
        }
    }

    /// A lane was homed again: its last target is nothing to hold.
    pub(crate) fn rejoin(&mut self, lane: u16) {
        let now = self.talk.now();
        if let Some(lane) = self.lanes.get_mut(usize::from(lane)) {
            lane.stage = Stage::Out;
            (lane.own.is_failing, lane.own.serial) = (false, [None; 2]);
            lane.make_ready(now);
        }
    }

    /// Sends what each motor is told in a slice, targets each for when it arrives.
    fn send_slice(&mut self) -> Result<(), LinkFault> {
        let now = self.talk.now();
        self.own.next_slice = self.own.next_slice + self.terms.period;
        if self.own.next_slice <= now {
            self.own.next_slice = now + self.terms.period;
        }
        let told: usize = self.told().map(|lane| lane.axes.len()).sum();
        let told = u32::try_from(told).unwrap_or(u32::MAX);
        let (mut at, frame_time) = self.talk.arrival();
        (self.own.targets, self.own.is_fresh) = (self.own.targets.saturating_add(told), true);
        // A target is followed until the next, which comes later where a question comes before it.
        let asked = if self.own.targets >= TARGETS { self.talk.question() } else { Duration::ZERO };
        let half = self.own.next_slice.max(at + frame_time * told + asked).since(now) / 2;
        let mut frames = Vec::with_capacity(told as usize + 1);
        for lane in self.lanes.iter_mut().filter(|lane| lane.is_told()) {
            frames.extend(lane.orders(at, frame_time, half));
            at = at + frame_time * u32::try_from(lane.axes.len()).unwrap_or(u32::MAX);
        }
        let end_of_search = self.end_of_search();
        let last = if end_of_search.is_some() { at } else { at.before(frame_time) };
        frames.extend(end_of_search);
        if !frames.is_empty() {
            self.talk.send(&frames)?;
            // Between what was reckoned and what was sent this thread may have been held up.
            let late = self.talk.arrived().since(last);
            self.lanes.iter_mut().flat_map(|lane| &mut lane.axes).for_each(|axis| axis.come_late(late));
        }
        (0..self.lanes.len()).for_each(|lane| self.tell_motion(lane, at + half));
        Ok(())
    }

    /// Those whose units hear what is said at the rate of the link, and those that may.
    fn told(&self) -> impl Iterator<Item = &SixpackLane> {
        self.lanes.iter().filter(|lane| lane.is_told())
    }

    /// A motor that searches takes nothing but the end of that: the one whose question was not answered is told it, or else those that are
    /// told to stop by turns.
    fn end_of_search(&mut self) -> Option<SixpackFrame> {
        let asked = self.own.unanswered.take().map(|(lane, axis)| (&self.lanes[lane], axis));
        let stops = |lane: &&SixpackLane| !lane.is_led();
        let stopped =
            self.told().filter(stops).flat_map(|lane| (0..lane.axes.len()).map(move |axis| (lane, axis)));
        let stopped: Vec<_> = stopped.collect();
        let (lane, axis) = asked.or_else(|| stopped.get(self.own.slices % stopped.len().max(1)).copied())?;
        let end = AbortSearch { motor: lane.axes[axis].motor };
        let frame = SixpackOrder::AbortSearch(end).frame(lane.own.unit);
        self.own.slices = self.own.slices.wrapping_add(1);
        Some(frame)
    }

    /// Whether a lane that runs moves by what it has been sent.
    fn tell_motion(&mut self, index: usize, at: MonoTime) {
        let lane = &mut self.lanes[index];
        if lane.stage != Stage::Runs {
            return;
        }
        let moves = lane.axes.iter().any(Axis::moves);
        if std::mem::replace(&mut lane.moves, moves) != moves {
            let (axes, lane) = (lane.places(), number(index));
            self.tell(if moves {
                StreamEvent::Moves { lane, at }
            } else {
                StreamEvent::Rests { lane, axes, at }
            });
        }
    }
}
