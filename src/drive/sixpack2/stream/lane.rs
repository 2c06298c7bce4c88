//! The axes of one seat: they share a unit, follow one track, and stop together.

use super::axis::Axis;
use super::track::Track;
use crate::drive::link::{LedPose, LinkPose, Stage, StreamTerms};
use crate::motion::{Limits, MAX_AXES, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// The axes of one seat.
#[derive(Debug)]
pub(super) struct Lane {
    pub(super) unit: u8,
    pub(super) axes: Vec<Axis>,
    pub(super) stage: Stage,
    pub(super) track: Track,
    terms: StreamTerms,
    /// Told last.
    pub(super) moves: bool,
    pub(super) sent: Option<FrameNo>,
    /// Whether it is where its first pose is was told.
    pub(super) is_elsewhere: bool,
    /// When the last pose came, and for how long.
    heard: MonoTime,
    lasts_ms: u32,
    pub(super) failing_since: Option<MonoTime>,
    /// Until then nothing is asked of it that is not urgent.
    pub(super) not_before: MonoTime,
    /// Who it is was asked last.
    pub(super) known: Option<MonoTime>,
}

impl Lane {
    pub(super) fn new(unit: u8, axes: Vec<Axis>, terms: StreamTerms, now: MonoTime) -> Self {
        Self {
            unit,
            axes,
            stage: Stage::Readying,
            track: Track::at_rest(terms.tick, [0.0; MAX_AXES], now),
            terms,
            moves: true,
            sent: None,
            is_elsewhere: false,
            heard: now,
            lasts_ms: 0,
            failing_since: None,
            not_before: now,
            known: None,
        }
    }

    /// Is looked at again before it follows anything.
    pub(super) fn make_ready(&mut self) {
        self.stage = Stage::Readying;
        self.known = None;
        self.axes.iter_mut().for_each(|axis| (axis.rests, axis.stood_at) = (false, None));
    }

    /// True if its motors are told where to be.
    pub(super) const fn is_led(&self) -> bool {
        matches!(self.stage, Stage::Ready | Stage::Runs | Stage::Ends)
    }

    /// The first axis that is farther from a pose than so many mm, and how far.
    pub(super) fn off(&self, pose: &LinkPose, most_mm: f64) -> Option<(usize, f64)> {
        let off = |axis: &Axis, place: f64| axis.scale.mm_of(axis.scale.way_of(place - axis.place())).abs();
        let all = self.axes.iter().zip(pose.axes).map(|(axis, place)| off(axis, place));
        // What is no number is nowhere near.
        all.enumerate().find(|(_, off)| off.is_nan() || *off > most_mm)
    }

    /// Takes the next pose.
    pub(super) fn push(&mut self, led: &LedPose, now: MonoTime) {
        let mut places = led.pose.axes;
        for ((place, axis), swing) in places.iter_mut().zip(&mut self.axes).zip(led.pose.vibration) {
            *place += axis.shaker.after(self.terms.tick, swing.hz, swing.amplitude);
        }
        self.track.push(led, places);
        (self.heard, self.lasts_ms) = (now, led.pose.lasts_ms);
    }

    /// True if no pose came for so long that none will.
    pub(super) fn is_left_alone(&self, now: MonoTime) -> bool {
        let lasts = std::time::Duration::from_millis(self.lasts_ms.into()).max(self.terms.tick);
        now.since(self.heard) > (3 * lasts).max(self.terms.period)
    }

    /// True if its poses do not reach as far as what is sent next.
    pub(super) fn is_behind(&self, now: MonoTime) -> bool {
        self.track.at(0, now + 2 * self.terms.period).is_none()
    }

    /// True if its last poses differ.
    pub(super) fn ends_moving(&self) -> bool {
        self.track.ends_moving(self.axes.len())
    }

    /// Brakes from where it is by now.
    pub(super) fn brake(&mut self, now: MonoTime) {
        let limits: Vec<Limits> = self.axes.iter().map(|axis| axis.limits).collect();
        self.track.brake(&limits, now);
    }

    /// True once all of its motors are where they were led.
    pub(super) fn has_come_to_rest(&self, now: MonoTime) -> bool {
        self.track.has_ended(now) && !self.axes.iter().any(Axis::moves)
    }

    /// Where it is, in strokes.
    pub(super) fn places(&self) -> Pose {
        let mut places = [0.0; MAX_AXES];
        places.iter_mut().zip(&self.axes).for_each(|(place, axis)| *place = axis.place());
        places
    }
}
