//! Poses of seats into segments of their units, as long as poses come.
//!
//! ```text
//!  poses --ring--> SilverLane --Axis: Middles, SegmentFit--> outbox --Talk--> unit: four wait, one runs
//!  events <--ring-- confirmed, rests, moves, lost, ...  <---- acks, polls
//! ```
//!
//! Of what is due stops go first, then what the units need soonest, then what makes a lane ready, then polls.

mod axis;
mod clock;
mod lane;
mod polls;
mod queue;
mod ready;
mod watch;

use std::time::Duration;

use self::axis::{Axis, AxisTerms, Doubt};
use self::lane::{LaneState, SilverLane};
use self::polls::Question;
use super::set_up::{HomeError, SeatUnits};
use super::talk::{Talk, TalkFault};
use crate::drive::link::{
    BrakeReason, Family, IDLE, Lead, LedPose, LinkFault, LinkPort, LinkTalk as _, Stage, Stream, StreamEvent,
    StreamTerms, lane_number as number,
};
use crate::time::MonoTime;
use crate::wire::silvermax::Request;

/// Octets of a segment and its ack at most.
const EXCHANGE: u32 = 52;
/// A unit that does not answer for so long is lost, or for ten periods.
const LOST: Duration = Duration::from_millis(250);
/// How often a unit that is lost is asked.
const PROBES: Duration = Duration::from_millis(250);

/// What is to be done next of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Work {
    Stop,
    Settle,
    Segment,
    Probe,
    Ready,
    Ask(Question),
}

/// SilverMax units: poses become segments in their timed queues.
#[derive(Debug)]
pub(crate) struct SilverMax;

impl Family for SilverMax {
    /// Two slices and a half and two ticks until a segment is made of poses, two segments and a half that wait, and a round of exchanges,
    /// which is less than a period. With half a segment less that waits, what is in doubt is not found out in time.
    const LEAD: Lead = Lead { periods: 6, ticks: 2 };
    type Talk<P: LinkPort> = Talk<P>;
    type Seat<'a> = SeatUnits<'a>;
    type Error = HomeError;
    type Axis = Axis;
    type LaneState = LaneState;

    fn at(_: u32, _: MonoTime) -> Result<Self, HomeError> {
        Ok(Self)
    }

    fn lane(seat: &SeatUnits<'_>, terms: StreamTerms, now: MonoTime) -> Result<SilverLane, HomeError> {
        let StreamTerms { period, tick } = terms;
        let axes = seat.axes()?.into_iter().map(|axis| {
            let terms = AxisTerms { unit: axis.unit, scale: axis.scale, brake: axis.brake(), period, tick };
            Axis::new(terms, now)
        });
        Ok(SilverLane::new(axes.collect(), terms, LaneState::new(seat.sum()?, now), now))
    }

    fn begin<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize, at: MonoTime) {
        let axes: usize = stream.lanes.iter().map(|lane| lane.axes.len()).sum();
        let exchange = stream.talk.octets(EXCHANGE) + stream.talk.delay_p99() + IDLE;
        let soonest = stream.talk.now() + exchange * u32::try_from(axes).unwrap_or(u32::MAX);
        stream.lanes[lane].rest_until(at.max(soonest));
    }

    fn push(lane: &mut SilverLane, led: &LedPose) {
        lane.push(led);
    }

    fn stands_at(lane: &SilverLane, led: &LedPose) -> bool {
        lane.stands_at(&led.pose)
    }

    fn mind<P: LinkPort>(stream: &mut Stream<Self, P>, index: usize, now: MonoTime) {
        let lane = &mut stream.lanes[index];
        match lane.stage {
            Stage::Runs | Stage::Ends if lane.is_dry(now) => {
                lane.axes.iter_mut().filter(|axis| axis.ends() < now).for_each(|axis| axis.figures.dry += 1);
                stream.brake(index, BrakeReason::Dry);
            }
            Stage::Runs | Stage::Ends if lane.is_late(now) || lane.axes.iter().any(Axis::is_crammed) => {
                stream.brake(index, BrakeReason::Behind);
            }
            Stage::Runs if lane.is_left_alone(now) => {
                let ends_at_rest = lane.end();
                if !ends_at_rest {
                    stream.brake(index, BrakeReason::PosesEnded);
                }
            }
            Stage::Ends if lane.axes.iter().all(|axis| axis.has_ended() && axis.ends() < now) => {
                lane.make_ready(false);
            }
            Stage::Readying if lane.axes.iter().all(Axis::is_made_ready) => {
                lane.stage = Stage::Ready;
                lane.moves = false;
                let event = StreamEvent::Rests { lane: number(index), axes: lane.places(), at: now };
                stream.tell(event);
            }
            _ => {}
        }
    }

    fn work<P: LinkPort>(stream: &mut Stream<Self, P>, now: MonoTime) -> Result<Option<MonoTime>, LinkFault> {
        let Some((lane, axis, work)) = stream.next_work(now) else { return Ok(Some(now + IDLE)) };
        stream.work(lane, axis, work).map(|()| None)
    }

    fn brake(lane: &mut SilverLane, _: MonoTime) -> bool {
        let is_led = !matches!(lane.stage, Stage::Lost | Stage::Out);
        if is_led {
            lane.make_ready(true);
        } else {
            lane.axes.iter_mut().for_each(|axis| axis.owes_stop = true);
        }
        is_led
    }

    /// All at once where they brake alike; then each, which has to answer, in the next rounds.
    fn stop<P: LinkPort>(stream: &mut Stream<Self, P>) -> Result<(), LinkFault> {
        let common = stream.common_brake();
        common.map_or(Ok(()), |deceleration| stream.talk.tell_all(Request::Stop { deceleration }))
    }

    fn let_go(lane: &mut SilverLane, _: MonoTime) {
        lane.own.returns = false;
        lane.let_go(true);
    }

    fn locate<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize) {
        stream.hurry(lane, Question::Position);
    }

    fn look<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize) {
        stream.hurry(lane, Question::Canary);
        if let Some(lane) = stream.lanes.get_mut(lane) {
            lane.own.returns = true;
            lane.axes.iter_mut().for_each(|axis| axis.canary = None);
        }
    }
}

impl<P: LinkPort> Stream<SilverMax, P> {
    /// A lane that was out was homed again.
    pub(crate) fn rejoin(&mut self, lane: u16, canary: i32) {
        if let Some(lane) = self.lanes.get_mut(usize::from(lane)) {
            lane.own.canary = Some(canary);
            lane.make_ready(true);
        }
    }

    fn hurry(&mut self, lane: usize, question: Question) {
        let now = self.talk.now();
        let axes = self.lanes.get_mut(lane).map(|lane| &mut lane.axes);
        axes.into_iter().flatten().for_each(|axis| axis.polls.hurry(question, now));
    }

    fn next_work(&self, now: MonoTime) -> Option<(usize, usize, Work)> {
        let axes = self.lanes.iter().enumerate().flat_map(|(l, lane)| {
            lane.axes.iter().enumerate().filter_map(move |(a, axis)| {
                let (due, work) = lane.work(axis, now)?;
                Some((work.rank(), due, l, a, work))
            })
        });
        let (.., lane, axis, work) = axes.min_by_key(|(rank, due, ..)| (*rank, *due))?;
        Some((lane, axis, work))
    }

    fn work(&mut self, lane: usize, axis: usize, work: Work) -> Result<(), LinkFault> {
        let done = match work {
            Work::Stop => self.stop_axis(lane, axis),
            Work::Settle => self.settle(lane, axis),
            Work::Segment => self.send_segment(lane, axis),
            Work::Probe => self.probe(lane, axis),
            Work::Ready => self.make_ready(lane, axis),
            Work::Ask(question) => self.ask(lane, axis, question),
        };
        match done {
            Err(TalkFault::Link(fault)) => Err(fault),
            Err(TalkFault::Foreign { by, .. }) if work == Work::Segment => {
                self.doubt_other(by);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// The one deceleration of all lanes.
    fn common_brake(&self) -> Option<u32> {
        let mut brakes = self.lanes.iter().flat_map(|lane| &lane.axes).map(|axis| axis.terms.brake);
        let first = brakes.next()?;
        brakes.all(|brake| brake == first).then_some(first)
    }
}

impl Work {
    /// What comes first: stops, then what holds up an axis, then what units wait for, by when they need it.
    const fn rank(self) -> u8 {
        match self {
            Self::Stop => 0,
            Self::Settle => 1,
            Self::Segment => 2,
            Self::Ready => 3,
            Self::Ask(_) | Self::Probe => 4,
        }
    }
}

impl SilverLane {
    /// Brakes if it has to, and is made ready.
    fn make_ready(&mut self, brakes: bool) {
        self.stage = Stage::Readying;
        self.let_go(brakes);
    }

    /// Nothing more goes to its units of what was made.
    fn let_go(&mut self, brakes: bool) {
        for axis in &mut self.axes {
            axis.skip_all();
            (axis.step, axis.stood_at) = (0, None);
            axis.owes_stop |= brakes;
            axis.doubt = axis.doubt.filter(|doubt| matches!(doubt, Doubt::Unanswered(_)));
            axis.polls.forget_untold();
        }
    }

    /// What is to be done of an axis, and by when.
    fn work(&self, axis: &Axis, now: MonoTime) -> Option<(MonoTime, Work)> {
        let is_due = axis.not_before <= now;
        if self.stage == Stage::Lost {
            return is_due.then_some((axis.not_before, Work::Probe));
        }
        if axis.owes_stop {
            return Some((now, Work::Stop));
        }
        let needs = if axis.has_started() { axis.ends() } else { self.own.origin };
        match (self.stage, axis.doubt) {
            _ if !is_due => None,
            (_, Some(_)) => Some((needs, Work::Settle)),
            (Stage::Readying, _) if !axis.is_made_ready() => Some((now, Work::Ready)),
            (Stage::Runs | Stage::Ends, _) if axis.can_take(now) => Some((needs, Work::Segment)),
            _ => {
                let runs = self.stage == Stage::Runs && axis.has_started();
                let (due, question) = axis.polls.next(now, runs)?;
                Some((due, Work::Ask(question)))
            }
        }
    }
}
