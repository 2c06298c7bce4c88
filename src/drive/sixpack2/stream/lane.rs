//! The axes of one seat: they share a unit, follow one track, and stop together.

use std::time::Duration;

use super::axis::Axis;
use super::track::Track;
use crate::drive::link::{LedPose, LinkPose, Stage, StreamTerms};
use crate::motion::{Limits, MAX_AXES, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// A seat stands where it is led from so near, mm.
const STANDS_MM: f64 = 0.1;

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
    /// Its units were seen to be home, and have been since.
    pub(super) is_home: bool,
    /// The first frame of which it is not known that it is executed.
    pub(super) unconfirmed: FrameNo,
    /// The axis that is asked next.
    pub(super) next_axis: usize,
    /// The last pose, and when it came.
    last: Option<LinkPose>,
    heard: MonoTime,
    /// Its last question was not answered.
    pub(super) is_failing: bool,
    /// Until then nothing is asked of it that is not urgent.
    pub(super) not_before: MonoTime,
    /// Who it is was its last question.
    pub(super) asked_who: bool,
    /// Who it is was asked last; none where that is to be found out.
    pub(super) known: Option<MonoTime>,
}

impl Lane {
    pub(super) fn new(unit: u8, axes: Vec<Axis>, terms: StreamTerms, now: MonoTime) -> Self {
        Self {
            unit,
            axes,
            stage: Stage::Out,
            track: Track::at_rest(terms.tick, [0.0; MAX_AXES], now),
            terms,
            moves: true,
            is_home: false,
            unconfirmed: FrameNo::FIRST,
            next_axis: 0,
            last: None,
            heard: now,
            is_failing: false,
            not_before: now,
            asked_who: false,
            known: Some(now),
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
        self.hear(led, now);
    }

    /// Hears a pose, whether it leads it or not.
    pub(super) const fn hear(&mut self, led: &LedPose, now: MonoTime) {
        (self.last, self.heard) = (Some(led.pose), now);
    }

    /// True if a pose that comes now is the first of a motion: one that was cut off while it moved is over before another begins.
    pub(super) fn may_begin(&self, now: MonoTime) -> bool {
        self.is_left_alone(now) || self.last.is_some_and(|last| self.off(&last, STANDS_MM).is_none())
    }

    /// True if no pose came for so long that none will.
    pub(super) fn is_left_alone(&self, now: MonoTime) -> bool {
        let lasts = self.last.map_or(0, |pose| pose.lasts_ms);
        let lasts = Duration::from_millis(lasts.into()).max(self.terms.tick);
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

    /// Whether a motor that was read where it is led at an instant confirms frames that nothing did before: the first and the last.
    pub(super) fn confirm(&mut self, at: MonoTime) -> Option<(FrameNo, FrameNo)> {
        let last = self.track.frame(at).filter(|last| last.since(self.unconfirmed) >= 0)?;
        Some((std::mem::replace(&mut self.unconfirmed, last.next()), last))
    }

    /// Nothing leads it any more.
    pub(super) fn let_go(&mut self, stage: Stage, now: MonoTime) {
        self.stage = stage;
        self.track = Track::at_rest(self.terms.tick, self.places(), now);
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
