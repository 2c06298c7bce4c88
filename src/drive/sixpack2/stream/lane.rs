//! The axes of one seat: they share a unit, follow one track, and stop together.

use std::time::Duration;

use super::Sixpack2;
use super::axis::Axis;
use super::track::Track;
use crate::drive::link::{LedLane, LedPose, Stage};
use crate::motion::{Limits, MAX_AXES};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// The axes of one seat on a SIXpack 2: they share a unit, and follow one track.
pub(super) type SixpackLane = LedLane<Sixpack2>;

/// What such a lane is beside its axes and stage.
#[derive(Debug)]
pub(crate) struct LaneState {
    pub(super) unit: u8,
    pub(super) track: Track,
    /// Its units were seen to be home, and have been since.
    pub(super) is_home: bool,
    /// It is out, and not all of its motors were read at rest since.
    pub(super) moves_on: bool,
    /// While it is made ready: its motors are told on where they were led, as one target may have been damaged.
    pub(super) is_told: bool,
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
}

impl LaneState {
    pub(super) fn new(unit: u8, tick: Duration, now: MonoTime) -> Self {
        Self {
            unit,
            track: Track::at_rest(tick, [0.0; MAX_AXES], now),
            is_home: false,
            moves_on: false,
            is_told: false,
            next_axis: 0,
            is_failing: false,
            not_before: now,
            asked_who: false,
            known: Some(now),
        }
    }
}

impl SixpackLane {
    /// Is looked at again before it follows anything.
    pub(super) fn make_ready(&mut self) {
        let was_led = matches!(self.stage, Stage::Ready | Stage::Ends);
        self.own.is_told = was_led && !self.axes.iter().any(Axis::moves);
        self.stage = Stage::Readying;
        self.own.known = None;
        self.axes.iter_mut().for_each(|axis| (axis.rests, axis.stood_at, axis.strayed) = (false, None, 0));
    }

    /// True if its motors are told where to be.
    pub(super) const fn is_led(&self) -> bool {
        match self.stage {
            Stage::Ready | Stage::Runs | Stage::Ends => true,
            Stage::Readying => self.own.is_told,
            Stage::Lost | Stage::Out => false,
        }
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
