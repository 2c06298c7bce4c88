//! Poses of seats into segments of their units, as long as poses come.
//!
//! ```text
//!  poses --ring--> Lane --Axis: Middles, SegmentFit--> outbox --Talk--> unit: four wait, one runs
//!  events <--ring-- confirmed, rests, moves, lost, ...  <---- acks, polls
//! ```
//!
//! All that is asked goes out one exchange at a time, in [`Stream::round`]: first stops, then what the units need soonest, then
//! what makes a lane ready, then polls. So a stop waits for one exchange at the most.

mod axis;
mod clock;
mod lane;
mod polls;
mod queue;
mod ready;
mod watch;

use std::time::Duration;

use rtrb::{Consumer, Producer};

use self::axis::{Axis, AxisTerms, Doubt};
use self::lane::Lane;
use self::polls::Question;
use super::set_up::{HomeError, SeatUnits};
use super::talk::{Talk, TalkFault};
use crate::drive::link::{
    AxisFigures, BrakeReason, LedPose, LinkFault, LinkFigures, LinkPort, Stage, StreamEvent, StreamTerms,
    axis_number, lane_number as number,
};
use crate::drive::terms::Lead;
use crate::time::MonoTime;
use crate::wire::silvermax::Request;

/// How far a first pose may be from where the seat stands, mm.
const NEAR_MM: f64 = 0.5;
/// Octets of a segment and its ack at most.
const EXCHANGE: u32 = 52;
/// How long nothing is done where nothing is due.
const IDLE: Duration = Duration::from_millis(1);
/// A unit that does not answer for so long is lost, or for ten periods.
const LOST: Duration = Duration::from_millis(250);
/// How often a unit that is lost is asked.
const PROBES: Duration = Duration::from_millis(250);

/// A lane: a seat that is home.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneUnits<'a> {
    /// The seat.
    pub(crate) seat: SeatUnits<'a>,
    /// What homing wrote into register 40 of its units; none where that is to be found out, and the lane is out meanwhile.
    pub(crate) canary: Option<i32>,
}

/// How long before the seat is to be there its poses have to come: two slices and a half and two ticks until a segment is made of
/// them, two segments and a half that wait, and a round of exchanges, which is less than a period. With half a segment less that
/// waits, what is in doubt is not found out in time.
pub(crate) const LEAD: Lead = Lead { periods: 6, ticks: 2 };

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

/// A play on one link.
#[derive(Debug)]
pub(crate) struct Stream<P> {
    talk: Talk<P>,
    terms: StreamTerms,
    lanes: Vec<Lane>,
    poses: Consumer<LedPose>,
    events: Producer<StreamEvent>,
    figures: LinkFigures,
}

impl<P: LinkPort> Stream<P> {
    /// With lanes that are home and at rest; the units are told to brake all the same, and made ready.
    ///
    /// # Errors
    /// [`HomeError::Counts`] where an axis counts as no such drive does.
    pub(crate) fn new(
        talk: Talk<P>,
        terms: StreamTerms,
        lanes: &[LaneUnits<'_>],
        poses: Consumer<LedPose>,
        events: Producer<StreamEvent>,
    ) -> Result<Self, HomeError> {
        let (now, StreamTerms { period, tick }) = (talk.now(), terms);
        let lane = |lane: &LaneUnits<'_>| {
            let axes = lane.seat.axes()?.into_iter().map(|axis| {
                let terms =
                    AxisTerms { unit: axis.unit, scale: axis.scale, brake: axis.brake(), period, tick };
                Axis::new(terms, now)
            });
            Ok(Lane::new(axes.collect(), lane.canary, period, tick, now))
        };
        let lanes = lanes.iter().map(lane).collect::<Result<_, HomeError>>()?;
        Ok(Self { talk, terms, lanes, poses, events, figures: LinkFigures::default() })
    }

    /// Takes what poses came, and does what is due next: one exchange at the most, with what follows from its answer. Nothing
    /// due: waits a millisecond.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone: all lanes are lost by then. It may be called again.
    pub(crate) fn round(&mut self) -> Result<(), LinkFault> {
        self.take_poses();
        let now = self.talk.now();
        (0..self.lanes.len()).for_each(|lane| self.mind(lane, now));
        let done = match self.next_work(now) {
            Some((lane, axis, work)) => self.work(lane, axis, work),
            None => {
                self.talk.port().sleep_until(now + IDLE);
                Ok(())
            }
        };
        if done.is_err() {
            (0..self.lanes.len()).for_each(|lane| self.lose(lane, 0));
        }
        done
    }

    /// Brakes a lane, or all of them: all at once where they brake alike, then each, which has to answer, in the next rounds.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    pub(crate) fn stop(&mut self, lane: Option<u16>) -> Result<(), LinkFault> {
        let lanes = match lane {
            Some(lane) => usize::from(lane)..usize::from(lane) + 1,
            None => 0..self.lanes.len(),
        };
        for index in lanes.clone() {
            self.brake(index, BrakeReason::Stopped);
        }
        if lanes.len() == self.lanes.len()
            && let Some(deceleration) = self.common_brake()
        {
            self.talk.tell_all(Request::Stop { deceleration })?;
        }
        Ok(())
    }

    /// A lane that was out was homed again.
    pub(crate) fn rejoin(&mut self, lane: u16, canary: i32) {
        if let Some(lane) = self.lanes.get_mut(usize::from(lane)) {
            lane.canary = Some(canary);
            lane.make_ready(true);
        }
    }

    /// Has a lane's axes read as soon as there is time.
    pub(crate) fn locate(&mut self, lane: u16) {
        self.hurry(lane, Question::Position);
    }

    /// Has it looked whether the units of a lane are home; one that is out comes back then.
    pub(crate) fn look(&mut self, lane: u16) {
        self.hurry(lane, Question::Canary);
        if let Some(lane) = self.lanes.get_mut(usize::from(lane)) {
            lane.returns = true;
            lane.axes.iter_mut().for_each(|axis| axis.canary = None);
        }
    }

    fn hurry(&mut self, lane: u16, question: Question) {
        let now = self.talk.now();
        let axes = self.lanes.get_mut(usize::from(lane)).map(|lane| &mut lane.axes);
        axes.into_iter().flatten().for_each(|axis| axis.polls.hurry(question, now));
    }

    /// True if a lane moves, or may.
    #[must_use]
    pub(crate) fn is_busy(&self) -> bool {
        self.lanes.iter().any(|lane| matches!(lane.stage, Stage::Runs | Stage::Ends | Stage::Readying))
    }

    /// How an axis of a lane stands.
    #[must_use]
    pub(crate) fn axis(&self, lane: u16, axis: usize) -> Option<AxisFigures> {
        let axis = self.lanes.get(usize::from(lane))?.axes.get(axis)?;
        Some(AxisFigures { queued: axis.waiting(self.talk.now()), ..axis.figures })
    }

    /// True if a lane stands and waits for poses.
    #[must_use]
    pub(crate) fn is_ready(&self, lane: u16) -> bool {
        self.lanes.get(usize::from(lane)).is_some_and(|lane| lane.stage == Stage::Ready)
    }

    /// How the link stands.
    #[must_use]
    pub(crate) fn figures(&self) -> LinkFigures {
        LinkFigures { talk: self.talk.counts(), delay_p99: self.talk.delay_p99(), ..self.figures }
    }

    /// The port.
    pub(crate) const fn port(&mut self) -> &mut P {
        self.talk.port()
    }

    /// The conversation, for other procedures while no lane runs.
    pub(crate) const fn talk(&mut self) -> &mut Talk<P> {
        &mut self.talk
    }

    fn take_poses(&mut self) {
        while let Ok(led) = self.poses.pop() {
            let (now, index) = (self.talk.now(), usize::from(led.lane));
            let Some(lane) = self.lanes.get_mut(index) else { continue };
            match lane.stage {
                Stage::Runs => lane.push(led, now),
                Stage::Ready if lane.stands_at(&led.pose) => {
                    lane.hear(led.pose, now);
                    let (lane, first) = (led.lane, led.pose.frame);
                    self.tell(StreamEvent::Confirmed { lane, first, last: first });
                }
                Stage::Ready if lane.may_begin(now) => self.begin(index, led, now),
                _ => {
                    lane.hear(led.pose, now);
                    self.figures.poses_skipped += 1;
                }
            }
        }
    }

    /// The first pose that leads a lane which stands elsewhere.
    fn begin(&mut self, index: usize, pose: LedPose, now: MonoTime) {
        if let Some((axis, by_mm)) = self.lanes[index].off(&pose.pose, NEAR_MM) {
            self.lanes[index].hear(pose.pose, now);
            // Told once while it stands, not at each tick.
            if !self.lanes[index].moves {
                self.lanes[index].moves = true;
                self.tell(StreamEvent::Elsewhere { lane: number(index), axis: axis_number(axis), by_mm });
            }
            self.figures.poses_skipped += 1;
            return;
        }
        let axes: usize = self.lanes.iter().map(|lane| lane.axes.len()).sum();
        let exchange = self.talk.octets(EXCHANGE) + self.talk.delay_p99() + IDLE;
        let soonest = now + exchange * u32::try_from(axes).unwrap_or(u32::MAX);
        let lane = &mut self.lanes[index];
        lane.begin(&pose, soonest);
        lane.push(pose, now);
    }

    /// What a lane does by itself as time goes on.
    fn mind(&mut self, index: usize, now: MonoTime) {
        let lane = &mut self.lanes[index];
        match lane.stage {
            Stage::Runs | Stage::Ends if lane.is_dry(now) => {
                lane.axes.iter_mut().filter(|axis| axis.ends() < now).for_each(|axis| axis.figures.dry += 1);
                self.brake(index, BrakeReason::Dry);
            }
            Stage::Runs | Stage::Ends if lane.is_late(now) || lane.axes.iter().any(Axis::is_crammed) => {
                self.brake(index, BrakeReason::Behind);
            }
            Stage::Runs if lane.is_left_alone(now) => {
                let ends_at_rest = lane.end();
                if !ends_at_rest {
                    self.brake(index, BrakeReason::PosesEnded);
                }
            }
            Stage::Ends if lane.axes.iter().all(|axis| axis.has_ended() && axis.ends() < now) => {
                lane.make_ready(false);
            }
            Stage::Readying if lane.axes.iter().all(Axis::is_made_ready) => {
                lane.stage = Stage::Ready;
                lane.moves = false;
                let event = StreamEvent::Rests { lane: number(index), axes: lane.places(), at: now };
                self.tell(event);
            }
            _ => {}
        }
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

    /// Ends what a lane does, and brakes it.
    fn brake(&mut self, index: usize, why: BrakeReason) {
        let Some(lane) = self.lanes.get_mut(index) else { return };
        if matches!(lane.stage, Stage::Lost | Stage::Out) {
            lane.axes.iter_mut().for_each(|axis| axis.owes_stop = true);
            return;
        }
        lane.make_ready(true);
        self.tell(StreamEvent::Braked { lane: number(index), why });
    }

    /// The one deceleration of all lanes.
    fn common_brake(&self) -> Option<u32> {
        let mut brakes = self.lanes.iter().flat_map(|lane| &lane.axes).map(|axis| axis.terms.brake);
        let first = brakes.next()?;
        brakes.all(|brake| brake == first).then_some(first)
    }

    fn tell(&mut self, event: StreamEvent) {
        self.figures.events_lost += u64::from(self.events.push(event).is_err());
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

impl Lane {
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
        let needs = if axis.has_started() { axis.ends() } else { self.origin };
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
