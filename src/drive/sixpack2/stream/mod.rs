//! Poses of seats into targets of their motors, as long as poses come.
//!
//! ```text
//!  poses --ring--> SixpackLane: Track --Axis: TargetMaker--> frames behind one break, each slice
//!  events <--ring-- confirmed, rests, moves, lost, ...  <---- a question in ten targets
//! ```
//!
//! Each target is that of the instant at which it arrives: axes need not wait for each other, and a slice that a question made late is
//! late in its targets, too. Lanes that stand are sent theirs as well, so that a target that was damaged on the way is
//! followed for no longer than a slice. A unit confirms nothing: frames count as confirmed once one of its motors was read where they lead it,
//! the motors by turns.

mod axis;
mod lane;
mod track;
mod watch;

use std::time::Duration;

use self::axis::Axis;
use self::lane::{LaneState, SixpackLane};
use self::track::Track;
use super::ask::waking_baud;
use super::set_up::{HomeError, SeatMotors};
use super::talk::Talk;
use crate::drive::link::{
    BrakeReason, Family, IDLE, Lead, LedPose, LinkFault, LinkPort, LinkTalk as _, Stage, Stream, StreamEvent,
    StreamTerms, lane_number as number,
};
use crate::time::MonoTime;
use crate::wire::sixpack2::{PiTarget, SixpackFrame, SixpackOrder};

/// A question is asked for so many targets.
const TARGETS: u32 = 10;
/// How far from the rate with which a unit wakes a line is no longer understood by one, in parts of a hundred.
const UNDERSTOOD: u32 = 5;
/// A slice that is so many periods late is not made up for.
const HELD_UP: u32 = 4;
/// How often a unit that is lost is asked.
const PROBES: Duration = Duration::from_millis(250);

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
    /// Targets since the last question, and the lane that is asked next.
    targets: u32,
    next_asked: usize,
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
        Ok(Self { next_slice: now, targets: 0, next_asked: 0 })
    }

    fn lane(seat: &SeatMotors<'_>, terms: StreamTerms, now: MonoTime) -> Result<SixpackLane, HomeError> {
        let axes = seat.axes()?.iter().map(|axis| Axis::new(axis, now)).collect();
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
                lane.make_ready();
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
            Stage::Ends if lane.has_come_to_rest(now) => lane.make_ready(),
            _ => {}
        }
    }

    fn work<P: LinkPort>(stream: &mut Stream<Self, P>, now: MonoTime) -> Result<Option<MonoTime>, LinkFault> {
        if now >= stream.own.next_slice {
            stream.send_targets()?;
        } else if !(stream.has_time() && stream.ask_next(now)?) {
            return Ok(Some(stream.own.next_slice.min(now + IDLE)));
        }
        Ok(None)
    }

    /// By the targets of the next slice.
    fn brake(lane: &mut SixpackLane, now: MonoTime) -> bool {
        match lane.stage {
            Stage::Runs => {
                lane.brake(now);
                lane.stage = Stage::Ends;
            }
            Stage::Ready => lane.make_ready(),
            Stage::Readying | Stage::Ends | Stage::Lost | Stage::Out => {}
        }
        true
    }

    /// Each motor by its ramp where it is not known how it moves.
    fn stop<P: LinkPort>(stream: &mut Stream<Self, P>) -> Result<(), LinkFault> {
        for index in 0..stream.lanes.len() {
            if matches!(stream.lanes[index].stage, Stage::Lost | Stage::Out) {
                stream.stop_motors(index)?;
            }
        }
        Ok(())
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
    /// A lane that was out was homed again.
    pub(crate) fn rejoin(&mut self, lane: u16) {
        if let Some(lane) = self.lanes.get_mut(usize::from(lane)) {
            lane.own.is_failing = false;
            lane.make_ready();
        }
    }

    /// Sends the targets of a slice, each for when it arrives.
    fn send_targets(&mut self) -> Result<(), LinkFault> {
        let now = self.talk.now();
        self.own.next_slice = self.own.next_slice + self.terms.period;
        if self.own.next_slice <= now {
            self.own.next_slice = now + self.terms.period;
        }
        let led: usize = self.lanes.iter().filter(|lane| lane.is_led()).map(|lane| lane.axes.len()).sum();
        let (mut at, frame_time) = self.talk.arrival();
        self.own.targets += u32::try_from(led).unwrap_or(u32::MAX);
        // A target is followed until the next, which comes later where a question comes before it.
        let asked = if self.own.targets >= TARGETS { self.talk.question() } else { Duration::ZERO };
        let sent = at + frame_time * u32::try_from(led).unwrap_or(u32::MAX);
        let half = self.own.next_slice.max(sent + asked).since(now) / 2;
        let mut frames: Vec<SixpackFrame> = Vec::with_capacity(led);
        for lane in self.lanes.iter_mut().filter(|lane| lane.is_led()) {
            for (index, axis) in lane.axes.iter_mut().enumerate() {
                let target = axis.aim(lane.own.track.at(index, at + half), at);
                let order = SixpackOrder::Target(PiTarget { motor: axis.motor, target });
                frames.push(order.frame(lane.own.unit));
                at = at + frame_time;
            }
        }
        if !frames.is_empty() {
            self.talk.send(&frames)?;
        }
        (0..self.lanes.len()).for_each(|lane| self.tell_motion(lane, at + half));
        Ok(())
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
