//! Poses of seats into motion of their drives, as long as poses come: what is the same for all families.
//!
//! ```text
//!  poses --ring--> Stream: LedLane, LedLane, ... --Family--> units
//!  events <--ring-- confirmed, rests, moves, lost, ...  <---- answers
//! ```
//!
//! All that is asked goes out one exchange at a time, in [`LinkPlay::round`], by what is due next; so a stop waits for one exchange at the most.

use std::fmt::Debug;
use std::time::Duration;

use rtrb::{Consumer, Producer};

use super::led_lane::{LedLane, LinkAxis};
use super::{
    AxisFigures, BrakeReason, Lead, LedPose, LinkFault, LinkFigures, LinkPort, LinkTalk, Stage, StreamEvent,
    StreamTerms, axis_number, lane_number,
};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// How far a first pose may be from where the seat stands, mm.
const NEAR_MM: f64 = 0.5;
/// How long nothing is done where nothing is due.
pub(crate) const IDLE: Duration = Duration::from_millis(1);

/// What a family of drives has of its own in a play, with what belongs to a link, not to a lane.
pub(crate) trait Family: Debug + Sized {
    /// How long before a seat is to be there its poses have to come.
    const LEAD: Lead;
    /// The conversation with its units.
    type Talk<P: LinkPort>: LinkTalk<Port = P>;
    /// A seat of it as it is configured.
    type Seat<'a>;
    /// Why one cannot be played to.
    type Error;
    /// An axis of a lane.
    type Axis: LinkAxis;
    /// What else a lane of it is.
    type LaneState: Debug;

    /// A play on a link at so many bits a second.
    ///
    /// # Errors
    /// Why there is none at that rate.
    fn at(baud: u32, now: MonoTime) -> Result<Self, Self::Error>;

    /// A lane, out until somebody has it looked at.
    ///
    /// # Errors
    /// What the settings of the seat are refused for.
    fn lane(seat: &Self::Seat<'_>, terms: StreamTerms, now: MonoTime) -> Result<LedLane<Self>, Self::Error>;

    /// A lane that stands begins to follow poses: the next is the first of them, and its seat is to be there at `at`.
    fn begin<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize, at: MonoTime);

    /// The next pose of a lane that follows them.
    fn push(lane: &mut LedLane<Self>, led: &LedPose);

    /// True if a lane that stands has nothing to do for a pose.
    fn stands_at(_: &LedLane<Self>, _: &LedPose) -> bool {
        false
    }

    /// What a lane does by itself as time goes on.
    fn mind<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize, now: MonoTime);

    /// Does what is due next. Where nothing is, how long it may wait.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn work<P: LinkPort>(stream: &mut Stream<Self, P>, now: MonoTime) -> Result<Option<MonoTime>, LinkFault>;

    /// Ends what a lane does, by a brake where it moves; false where nobody has to be told.
    fn brake(lane: &mut LedLane<Self>, now: MonoTime) -> bool;

    /// The first frame that a lane which brakes does not follow any more.
    fn dropped(lane: &LedLane<Self>) -> FrameNo {
        lane.unconfirmed
    }

    /// All lanes were asked to brake: what is sent at once.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn stop<P: LinkPort>(stream: &mut Stream<Self, P>) -> Result<(), LinkFault>;

    /// Nobody is told anything for a while, or any more: sees to it that the last that each motor was told is nothing to move by.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn settle<P: LinkPort>(_: &mut Stream<Self, P>) -> Result<(), LinkFault> {
        Ok(())
    }

    /// Nothing leads a lane any more.
    fn let_go(lane: &mut LedLane<Self>, now: MonoTime);

    /// Has a lane's axes read as soon as there is time.
    fn locate<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize);

    /// Has it looked whether the units of a lane are home; one that is out comes back then.
    fn look<P: LinkPort>(stream: &mut Stream<Self, P>, lane: usize);
}

/// A play on one link.
#[derive(Debug)]
pub(crate) struct Stream<F: Family, P: LinkPort> {
    pub(crate) talk: F::Talk<P>,
    pub(crate) terms: StreamTerms,
    pub(crate) lanes: Vec<LedLane<F>>,
    pub(crate) own: F,
    poses: Consumer<LedPose>,
    events: Producer<StreamEvent>,
    figures: LinkFigures,
}

/// What the thread of a link and the control plane ask of a play, whatever its drives.
pub(crate) trait LinkPlay {
    /// Takes what poses came, and does what is due next; nothing due: waits a millisecond at the most.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone: all lanes are lost by then. It may be called again.
    fn round(&mut self) -> Result<(), LinkFault>;

    /// Brakes all lanes.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn stop(&mut self) -> Result<(), LinkFault>;

    /// Before nothing is said to any lane for a while, or any more: sees to it that none moves by what it was told last.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn settle(&mut self) -> Result<(), LinkFault>;

    /// Has a lane's axes read as soon as there is time.
    fn locate(&mut self, lane: u16);

    /// Has it looked whether the units of a lane are home; one that is out comes back then.
    fn look(&mut self, lane: u16);

    /// True if a lane moves, or may.
    fn is_busy(&self) -> bool;

    /// How an axis of a lane stands.
    fn axis(&self, lane: u16, axis: usize) -> Option<AxisFigures>;

    /// How the link stands.
    fn figures(&self) -> LinkFigures;
}

impl<F: Family, P: LinkPort> LinkPlay for Stream<F, P> {
    fn round(&mut self) -> Result<(), LinkFault> {
        self.take_poses();
        let now = self.talk.now();
        (0..self.lanes.len()).for_each(|lane| F::mind(self, lane, now));
        let done = F::work(self, now);
        match done {
            Ok(Some(until)) => self.talk.port().sleep_until(until),
            Ok(None) => {}
            Err(_) => (0..self.lanes.len()).for_each(|lane| self.lose(lane, 0)),
        }
        done.map(drop)
    }

    fn stop(&mut self) -> Result<(), LinkFault> {
        for index in 0..self.lanes.len() {
            self.brake(index, BrakeReason::Stopped);
            let lane = &mut self.lanes[index];
            lane.was_stopped = true;
            if let Some(last) = lane.last {
                let first = F::dropped(lane);
                self.withdraw(index, first, last.frame);
            }
        }
        F::stop(self)
    }

    fn settle(&mut self) -> Result<(), LinkFault> {
        F::settle(self)
    }

    fn locate(&mut self, lane: u16) {
        F::locate(self, lane.into());
    }

    fn look(&mut self, lane: u16) {
        F::look(self, lane.into());
    }

    fn is_busy(&self) -> bool {
        self.lanes.iter().any(|lane| matches!(lane.stage, Stage::Runs | Stage::Ends | Stage::Readying))
    }

    fn axis(&self, lane: u16, axis: usize) -> Option<AxisFigures> {
        Some(self.lanes.get(usize::from(lane))?.axes.get(axis)?.figures(self.talk.now()))
    }

    fn figures(&self) -> LinkFigures {
        LinkFigures { talk: self.talk.counts(), delay_p99: self.talk.delay_p99(), ..self.figures }
    }
}

impl<F: Family, P: LinkPort> Stream<F, P> {
    /// With lanes that are out until somebody has them [looked at](LinkPlay::look).
    ///
    /// # Errors
    /// Why there is no play at that rate, or to one of the seats.
    pub(crate) fn new(
        talk: F::Talk<P>,
        terms: StreamTerms,
        seats: &[F::Seat<'_>],
        poses: Consumer<LedPose>,
        events: Producer<StreamEvent>,
    ) -> Result<Self, F::Error> {
        let now = talk.now();
        let own = F::at(talk.baud(), now)?;
        let lanes = seats.iter().map(|seat| F::lane(seat, terms, now)).collect::<Result<_, _>>()?;
        Ok(Self { talk, terms, lanes, own, poses, events, figures: LinkFigures::default() })
    }

    /// True if a lane stands and waits for poses.
    #[cfg(test)]
    pub(crate) fn is_ready(&self, lane: u16) -> bool {
        self.lanes.get(usize::from(lane)).is_some_and(|lane| lane.stage == Stage::Ready)
    }

    fn take_poses(&mut self) {
        while let Ok(led) = self.poses.pop() {
            let (now, index) = (self.talk.now(), usize::from(led.lane));
            let Some(lane) = self.lanes.get_mut(index) else { continue };
            match lane.stage {
                Stage::Runs => lane.follow(&led, now),
                Stage::Ready if F::stands_at(lane, &led) => {
                    lane.hear(led.pose, now);
                    let (lane, first) = (led.lane, led.pose.frame);
                    self.tell(StreamEvent::Confirmed { lane, first, last: first });
                }
                Stage::Ready if lane.may_begin(now) => self.begin(index, &led, now),
                _ => self.skip(index, &led, now),
            }
        }
    }

    /// The first pose that leads a lane which stands.
    fn begin(&mut self, index: usize, led: &LedPose, now: MonoTime) {
        let lane = &mut self.lanes[index];
        if let Some((axis, by_mm)) = lane.off(&led.pose, NEAR_MM) {
            // Told once while it stands, not at each tick.
            if !std::mem::replace(&mut lane.moves, true) {
                let (lane, axis) = (led.lane, axis_number(axis));
                self.tell(StreamEvent::Elsewhere { lane, axis, by_mm });
            }
            return self.skip(index, led, now);
        }
        lane.start(led.pose.frame);
        F::begin(self, index, led.at);
        self.lanes[index].follow(led, now);
    }

    /// A pose that is not followed.
    fn skip(&mut self, index: usize, led: &LedPose, now: MonoTime) {
        self.figures.poses_skipped += 1;
        self.lanes[index].hear(led.pose, now);
        if self.lanes[index].was_stopped {
            self.withdraw(index, led.pose.frame, led.pose.frame);
        }
    }

    /// A lane that was told to stop does not follow these, if there are any.
    fn withdraw(&mut self, index: usize, first: FrameNo, last: FrameNo) {
        if last.since(first) >= 0 {
            self.tell(StreamEvent::Withdrawn { lane: lane_number(index), first, last });
        }
    }

    /// Ends what a lane does, and brakes it.
    pub(crate) fn brake(&mut self, index: usize, why: BrakeReason) {
        if F::brake(&mut self.lanes[index], self.talk.now()) {
            self.tell(StreamEvent::Braked { lane: lane_number(index), why });
        }
    }

    /// An axis of a lane does not answer any more.
    pub(crate) fn lose(&mut self, index: usize, axis: usize) {
        let lane = &mut self.lanes[index];
        if !matches!(lane.stage, Stage::Lost | Stage::Out) {
            lane.stage = Stage::Lost;
            F::let_go(lane, self.talk.now());
            self.tell(StreamEvent::Lost { lane: lane_number(index), axis: axis_number(axis) });
        }
    }

    /// Out until a person has looked: led no more, and only watched.
    pub(crate) fn put_out(&mut self, index: usize, event: StreamEvent) {
        let lane = &mut self.lanes[index];
        if lane.stage != Stage::Out {
            lane.stage = Stage::Out;
            F::let_go(lane, self.talk.now());
            self.tell(event);
        }
    }

    pub(crate) fn tell(&mut self, event: StreamEvent) {
        self.figures.events_lost += u64::from(self.events.push(event).is_err());
    }
}
