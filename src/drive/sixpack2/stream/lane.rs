//! The axes of one seat: they share a unit, follow one track, and stop together.

use std::time::Duration;

use super::Sixpack2;
use super::axis::Axis;
use super::track::Track;
use crate::drive::link::{LedLane, LedPose, Stage};
use crate::motion::{Limits, MAX_AXES};
use crate::time::MonoTime;
use crate::wire::FrameNo;
use crate::wire::sixpack2::{AbortSearch, PiTarget, SixpackFrame, SixpackOrder};

/// The axes of one seat on a SIXpack 2: they share a unit, and follow one track.
pub(super) type SixpackLane = LedLane<Sixpack2>;

/// What such a lane is beside its axes and stage.
#[derive(Debug)]
pub(crate) struct LaneState {
    pub(super) unit: u8,
    pub(super) track: Track,
    /// Its units were seen to be home, and have been since.
    pub(super) is_home: bool,
    /// It answered at the rate of the link, so it hears what is said there.
    pub(super) was_heard: bool,
    /// Its seat takes no part: its motors are told to stand, and nothing is asked of it.
    pub(super) is_absent: bool,
    /// Slices since its motors were led, all of them.
    pub(super) stops: u32,
    /// Times that its unit was looked for.
    pub(super) probes: u32,
    /// The axis that is asked next.
    pub(super) next_axis: usize,
    /// Its last question was not answered.
    pub(super) is_failing: bool,
    /// Until then nothing is asked of it that is not urgent.
    pub(super) not_before: MonoTime,
    /// Who it is was its last question.
    pub(super) asked_who: bool,
    /// Who it is was asked last; none where that is to be found out.
    pub(super) known: Option<MonoTime>,
    /// The serial number of its unit, once that told it twice, and what it told last.
    pub(super) serial: [Option<u16>; 2],
}

impl LaneState {
    pub(super) fn new(unit: u8, tick: Duration, now: MonoTime) -> Self {
        Self {
            unit,
            track: Track::at_rest(tick, [0.0; MAX_AXES], now),
            is_home: false,
            was_heard: false,
            is_absent: false,
            stops: 0,
            probes: 0,
            next_axis: 0,
            is_failing: false,
            not_before: now,
            asked_who: false,
            known: Some(now),
            serial: [None; 2],
        }
    }

    /// True if another unit answers than before: its counters may read as if they knew the seat. What is told once may be damaged.
    pub(super) fn is_another(&mut self, serial: u16) -> bool {
        let [known, last] = &mut self.serial;
        last.replace(serial) == Some(serial) && *known.get_or_insert(serial) != serial
    }
}

impl SixpackLane {
    /// Is looked at again before it follows anything.
    pub(super) fn make_ready(&mut self, now: MonoTime) {
        let was_led = matches!(self.stage, Stage::Ready | Stage::Ends);
        let holds = was_led && !self.axes.iter().any(Axis::moves);
        self.stage = Stage::Readying;
        self.own.known = None;
        for axis in &mut self.axes {
            (axis.rests, axis.holds, axis.stood_at, axis.strayed) = (false, holds, None, 0);
            axis.skip(now);
        }
    }

    /// True if its motors are told something in each slice.
    pub(super) const fn is_told(&self) -> bool {
        self.own.was_heard || self.own.is_absent
    }

    /// True if its motors are told where to be; any others are told to stop.
    pub(super) fn is_led(&self) -> bool {
        self.axes.iter().all(|axis| self.leads(axis))
    }

    /// The same of one of them.
    pub(super) const fn leads(&self, axis: &Axis) -> bool {
        match self.stage {
            Stage::Ready | Stage::Runs | Stage::Ends => true,
            Stage::Readying => axis.holds,
            Stage::Lost | Stage::Out => false,
        }
    }

    /// Stops all of its motors, and then ends what they search for: one that searches takes the stop once that is over.
    pub(super) fn stops(&self) -> Vec<SixpackFrame> {
        let stop = |axis: &Axis| SixpackOrder::RampedStop { motor: axis.motor };
        let end = |axis: &Axis| SixpackOrder::AbortSearch(AbortSearch { motor: axis.motor });
        let orders = self.axes.iter().map(stop).chain(self.axes.iter().map(end));
        orders.map(|order| order.frame(self.own.unit)).collect()
    }

    /// What each of its motors is told in a slice. `at` is when the first of that has arrived, and `frame_time` later the next;
    /// the slice is over as much later again as `half`.
    pub(super) fn orders(&mut self, at: MonoTime, frame_time: Duration, half: Duration) -> Vec<SixpackFrame> {
        let (is_led, follows) = (self.is_led(), self.stage != Stage::Readying);
        self.own.stops = if is_led { 0 } else { self.own.stops.saturating_add(1) };
        let led: Vec<bool> = self.axes.iter().map(|axis| self.leads(axis)).collect();
        let mut at = at;
        let order = |(index, (axis, is_led)): (usize, (&mut Axis, bool))| {
            let motor = axis.motor;
            let order = if is_led {
                let middle = if follows { self.own.track.at(index, at + half) } else { None };
                SixpackOrder::Target(PiTarget { motor, target: axis.aim(middle, at) })
            } else {
                SixpackOrder::RampedStop { motor }
            };
            at = at + frame_time;
            order.frame(self.own.unit)
        };
        self.axes.iter_mut().zip(led).enumerate().map(order).collect()
    }

    /// Takes the next pose.
    pub(super) fn push(&mut self, led: &LedPose) {
        let mut places = led.pose.axes;
        for ((place, axis), swing) in places.iter_mut().zip(&mut self.axes).zip(led.pose.vibration) {
            *place += axis.shaker.after(self.terms.tick, swing.hz, swing.amplitude);
        }
        self.own.track.push(led, places);
    }

    /// True if its poses do not reach as far as what is sent next.
    pub(super) fn is_behind(&self, now: MonoTime) -> bool {
        self.own.track.at(0, now + 2 * self.terms.period).is_none()
    }

    /// True if its last poses differ.
    pub(super) fn ends_moving(&self) -> bool {
        self.own.track.ends_moving(self.axes.len())
    }

    /// Whether a motor that was read where it is led at an instant confirms frames that nothing did before: the first and the last.
    pub(super) fn confirm(&mut self, at: MonoTime) -> Option<(FrameNo, FrameNo)> {
        let last = self.own.track.frame(at).filter(|last| last.since(self.unconfirmed) >= 0)?;
        Some((std::mem::replace(&mut self.unconfirmed, last.next()), last))
    }

    /// Brakes from where it is by now.
    pub(super) fn brake(&mut self, now: MonoTime) {
        let limits: Vec<Limits> = self.axes.iter().map(|axis| axis.limits).collect();
        self.own.track.brake(&limits, now);
    }

    /// True once all of its motors are where they were led.
    pub(super) fn has_come_to_rest(&self, now: MonoTime) -> bool {
        self.own.track.has_ended(now) && !self.axes.iter().any(Axis::moves)
    }
}
