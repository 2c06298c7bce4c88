//! Poses of seats into targets of their motors, as long as poses come.
//!
//! ```text
//!  poses --ring--> Lane: Track --Axis: TargetMaker--> frames behind one break, each slice
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

use rtrb::{Consumer, Producer};

use self::axis::Axis;
use self::lane::Lane;
use self::track::Track;
use super::find::waking_baud;
use super::set_up::{HomeError, SeatMotors};
use super::talk::Talk;
use crate::drive::link::{
    AxisFigures, BrakeReason, LedPose, LinkFault, LinkFigures, LinkPort, Stage, StreamEvent, StreamTerms,
    axis_number, lane_number as number,
};
use crate::drive::terms::Lead;
use crate::time::MonoTime;
use crate::wire::sixpack2::{PiTarget, SixpackFrame, SixpackOrder};

/// How far a first pose may be from where the seat stands, mm.
const NEAR_MM: f64 = 0.5;
/// How long nothing is done where nothing is due.
const IDLE: Duration = Duration::from_millis(1);
/// A question is asked for so many targets.
const TARGETS: u32 = 10;
/// How far from the rate with which a unit wakes a line is no longer understood by one, in parts of a hundred.
const UNDERSTOOD: u32 = 5;

/// How long before the seat is to be there its poses have to come: a slice and a half until the last of what is sent in one, a
/// tick until it can be interpolated, a question that makes a slice late; the rest is for ticks that are missed.
pub(crate) const LEAD: Lead = Lead { periods: 4, ticks: 4 };

/// The longest from one reading of a seat until the next, where so many seats with so many axes in all are on a link: each has its turn
/// once for each of them, and who it is may be asked in one.
#[must_use]
pub(crate) fn read_every(period: Duration, seats: u32, axes: u32) -> Duration {
    period * (TARGETS.div_ceil(axes.max(1)) + 1) * 2 * seats
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
    next_slice: MonoTime,
    /// Targets since the last question, and the lane that is asked next.
    targets: u32,
    next_asked: usize,
}

impl<P: LinkPort> Stream<P> {
    /// With lanes that are out until somebody has them [looked at](Self::look).
    ///
    /// # Errors
    /// [`HomeError::WakingRate`] at a rate at which a unit that was restarted goes on following targets; what else the settings of
    /// a seat are refused for.
    pub(crate) fn new(
        talk: Talk<P>,
        terms: StreamTerms,
        lanes: &[SeatMotors<'_>],
        poses: Consumer<LedPose>,
        events: Producer<StreamEvent>,
    ) -> Result<Self, HomeError> {
        let (baud, waking) = (talk.baud(), waking_baud());
        if baud.abs_diff(waking) * 100 <= UNDERSTOOD * waking {
            return Err(HomeError::WakingRate { baud });
        }
        let now = talk.now();
        let lane = |seat: &SeatMotors<'_>| {
            let axes = seat.axes()?.iter().map(|axis| Axis::new(axis, now)).collect();
            Ok(Lane::new(seat.unit, axes, terms, now))
        };
        let lanes = lanes.iter().map(lane).collect::<Result<_, HomeError>>()?;
        let figures = LinkFigures::default();
        Ok(Self { talk, terms, lanes, poses, events, figures, next_slice: now, targets: 0, next_asked: 0 })
    }

    /// Takes what poses came, and does what is due next: the targets of a slice, or one question. Nothing due: waits a millisecond.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone: all lanes are lost by then. It may be called again.
    pub(crate) fn round(&mut self) -> Result<(), LinkFault> {
        self.take_poses();
        let now = self.talk.now();
        (0..self.lanes.len()).for_each(|lane| self.mind(lane, now));
        let done = if now >= self.next_slice {
            self.send_targets()
        } else if self.has_time() && self.ask_next(now)? {
            Ok(())
        } else {
            let until = self.next_slice.min(now + IDLE);
            self.talk.port().sleep_until(until);
            Ok(())
        };
        if done.is_err() {
            (0..self.lanes.len()).for_each(|lane| self.lose(lane));
        }
        done
    }

    /// Brakes a lane, or all of them: by the targets of the next slice where it is known how they move, else each motor by its ramp.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    pub(crate) fn stop(&mut self, lane: Option<u16>) -> Result<(), LinkFault> {
        let lanes = match lane {
            Some(lane) => usize::from(lane)..self.lanes.len().min(usize::from(lane) + 1),
            None => 0..self.lanes.len(),
        };
        for index in lanes {
            if matches!(self.lanes[index].stage, Stage::Lost | Stage::Out) {
                self.stop_motors(index)?;
            }
            self.brake(index, BrakeReason::Stopped);
        }
        Ok(())
    }

    /// A lane that was out was homed again.
    pub(crate) fn rejoin(&mut self, lane: u16) {
        if let Some(lane) = self.lanes.get_mut(usize::from(lane)) {
            lane.is_failing = false;
            lane.make_ready();
        }
    }

    /// Has a lane's axes read as soon as there is time.
    pub(crate) fn locate(&mut self, lane: u16) {
        (self.next_asked, self.targets) = (usize::from(lane), TARGETS);
    }

    /// Has it looked whether the unit of a lane is home; one that is out comes back then.
    pub(crate) fn look(&mut self, lane: u16) {
        if let Some(lane) = self.lanes.get_mut(usize::from(lane)) {
            lane.known = None;
        }
    }

    /// True if a lane moves, or may.
    #[must_use]
    pub(crate) fn is_busy(&self) -> bool {
        self.lanes.iter().any(|lane| matches!(lane.stage, Stage::Runs | Stage::Ends | Stage::Readying))
    }

    /// How an axis of a lane stands.
    #[must_use]
    pub(crate) fn axis(&self, lane: u16, axis: usize) -> Option<AxisFigures> {
        Some(self.lanes.get(usize::from(lane))?.axes.get(axis)?.figures)
    }

    /// The port.
    pub(crate) fn port(&mut self) -> &mut P {
        self.talk.port()
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

    /// The conversation, for other procedures while no lane runs.
    pub(crate) const fn talk(&mut self) -> &mut Talk<P> {
        &mut self.talk
    }

    fn take_poses(&mut self) {
        while let Ok(pose) = self.poses.pop() {
            let now = self.talk.now();
            let index = usize::from(pose.lane);
            match self.lanes.get(index).map(|lane| lane.stage) {
                Some(Stage::Runs) => self.lanes[index].push(&pose, now),
                Some(Stage::Ready) if self.lanes[index].may_begin(now) => self.begin(index, &pose, now),
                _ => self.skip(index, &pose, now),
            }
        }
    }

    /// The first pose of a lane that stands.
    fn begin(&mut self, index: usize, pose: &LedPose, now: MonoTime) {
        if let Some((axis, by_mm)) = self.lanes[index].off(&pose.pose, NEAR_MM) {
            // Told once while it stands, not at each tick.
            if !std::mem::replace(&mut self.lanes[index].moves, true) {
                self.tell(StreamEvent::Elsewhere { lane: number(index), axis: axis_number(axis), by_mm });
            }
            self.skip(index, pose, now);
            return;
        }
        let lane = &mut self.lanes[index];
        (lane.moves, lane.unconfirmed) = (false, pose.pose.frame);
        lane.track.begin(pose.at.max(now + self.terms.period));
        lane.push(pose, now);
        lane.stage = Stage::Runs;
    }

    /// A pose that is not followed.
    fn skip(&mut self, index: usize, pose: &LedPose, now: MonoTime) {
        self.figures.poses_skipped += 1;
        if let Some(lane) = self.lanes.get_mut(index) {
            lane.hear(pose, now);
        }
    }

    /// What a lane does by itself as time goes on.
    fn mind(&mut self, index: usize, now: MonoTime) {
        let lane = &mut self.lanes[index];
        lane.track.forget(now);
        match lane.stage {
            Stage::Runs if lane.is_left_alone(now) && !lane.ends_moving() => {
                lane.track.end();
                lane.stage = Stage::Ends;
            }
            Stage::Runs if lane.is_left_alone(now) => self.brake(index, BrakeReason::PosesEnded),
            Stage::Runs if lane.is_behind(now) && lane.ends_moving() => {
                self.brake(index, BrakeReason::Behind);
            }
            Stage::Ends if lane.has_come_to_rest(now) => lane.make_ready(),
            _ => {}
        }
    }

    /// Sends the targets of a slice, each for when it arrives.
    fn send_targets(&mut self) -> Result<(), LinkFault> {
        let now = self.talk.now();
        self.next_slice = self.next_slice + self.terms.period;
        if self.next_slice <= now {
            self.next_slice = now + self.terms.period;
        }
        let led: usize = self.lanes.iter().filter(|lane| lane.is_led()).map(|lane| lane.axes.len()).sum();
        let (mut at, frame_time) = self.talk.arrival();
        self.targets += u32::try_from(led).unwrap_or(u32::MAX);
        // A target is followed until the next, which comes later where a question comes before it.
        let asked = if self.targets >= TARGETS { self.talk.question() } else { Duration::ZERO };
        let sent = at + frame_time * u32::try_from(led).unwrap_or(u32::MAX);
        let half = self.next_slice.max(sent + asked).since(now) / 2;
        let mut frames: Vec<SixpackFrame> = Vec::with_capacity(led);
        for lane in self.lanes.iter_mut().filter(|lane| lane.is_led()) {
            for (index, axis) in lane.axes.iter_mut().enumerate() {
                let target = axis.aim(lane.track.at(index, at + half), at);
                let order = SixpackOrder::Target(PiTarget { motor: axis.motor, target });
                frames.push(order.frame(lane.unit));
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

    /// Ends what a lane does, and brakes it.
    fn brake(&mut self, index: usize, why: BrakeReason) {
        let now = self.talk.now();
        let Some(lane) = self.lanes.get_mut(index) else { return };
        match lane.stage {
            Stage::Runs => {
                lane.brake(now);
                lane.stage = Stage::Ends;
            }
            Stage::Ready => lane.make_ready(),
            Stage::Readying | Stage::Ends | Stage::Lost | Stage::Out => {}
        }
        self.tell(StreamEvent::Braked { lane: number(index), why });
    }

    fn tell(&mut self, event: StreamEvent) {
        self.figures.events_lost += u64::from(self.events.push(event).is_err());
    }
}
