//! A lane of a link as its thread leads it: the axes of one seat, and the poses that it has heard of.

use std::fmt::Debug;
use std::time::Duration;

use super::{AxisFigures, Family, LedPose, LinkPose, Stage, StreamTerms};
use crate::motion::{MAX_AXES, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// A seat stands where it is led from so near, mm: as far as a loaded motor may be beside its target.
pub(crate) const STANDS_MM: f64 = 0.1;
/// Poses that differ by less, in strokes, stand still.
const STILL: f64 = 1e-7;

/// One axis of a lane, whatever drives it.
pub(crate) trait LinkAxis: Debug {
    /// Where it is led by now, in strokes.
    fn place(&self) -> f64;

    /// How far that is from a place in strokes, mm.
    fn off_mm(&self, place: f64) -> f64;

    /// How it stands.
    fn figures(&self, now: MonoTime) -> AxisFigures;
}

/// The axes of one seat: they are led together, and stop together.
#[derive(Debug)]
pub(crate) struct LedLane<F: Family> {
    pub(crate) axes: Vec<F::Axis>,
    pub(crate) stage: Stage,
    pub(crate) terms: StreamTerms,
    /// Told last.
    pub(crate) moves: bool,
    /// Told to stop since it followed poses.
    pub(super) was_stopped: bool,
    /// The first frame of which it is not known that its drives have it, or have executed it.
    pub(crate) unconfirmed: FrameNo,
    pub(crate) own: F::LaneState,
    /// The last pose since it began, and when it came.
    pub(crate) last: Option<LinkPose>,
    /// That differs from the one before it.
    was_led_on: bool,
    heard: MonoTime,
}

impl<F: Family> LedLane<F> {
    /// Out until somebody has it looked at.
    pub(crate) fn new(axes: Vec<F::Axis>, terms: StreamTerms, own: F::LaneState, now: MonoTime) -> Self {
        let (stage, unconfirmed) = (Stage::Out, FrameNo::FIRST);
        let (moves, was_stopped, was_led_on, last) = (true, false, false, None);
        Self { axes, stage, terms, moves, was_stopped, unconfirmed, own, last, was_led_on, heard: now }
    }

    /// Begins to follow poses; the first is that frame.
    pub(super) const fn start(&mut self, first: FrameNo) {
        (self.stage, self.moves, self.was_stopped) = (Stage::Runs, false, false);
        (self.unconfirmed, self.last) = (first, None);
    }

    /// Takes the next pose that it follows.
    pub(super) fn follow(&mut self, led: &LedPose, now: MonoTime) {
        F::push(self, led);
        self.hear(led.pose, now);
    }

    /// Hears a pose, whether it leads it or not.
    pub(super) fn hear(&mut self, pose: LinkPose, now: MonoTime) {
        self.was_led_on = self.leads_on(&pose);
        (self.last, self.heard) = (Some(pose), now);
    }

    /// True if a pose leads elsewhere than the one before it.
    pub(crate) fn leads_on(&self, pose: &LinkPose) -> bool {
        let differs = |last: LinkPose| {
            let pairs = last.axes.iter().zip(pose.axes).take(self.axes.len());
            pairs.into_iter().any(|(a, b)| (a - b).abs() > STILL)
        };
        self.last.is_some_and(differs)
    }

    /// The first axis that is farther from a pose than so many mm, and how far.
    pub(crate) fn off(&self, pose: &LinkPose, most_mm: f64) -> Option<(usize, f64)> {
        let off = self.axes.iter().zip(pose.axes).map(|(axis, place)| axis.off_mm(place));
        // What is no number is nowhere near.
        off.enumerate().find(|(_, off)| off.is_nan() || *off > most_mm)
    }

    /// True if a pose that comes now is the first of a motion: one that was cut off while it moved is over before another begins.
    pub(super) fn may_begin(&self, now: MonoTime) -> bool {
        let rested = |last: LinkPose| !self.was_led_on && self.off(&last, STANDS_MM).is_none();
        self.is_left_alone(now) || self.last.is_some_and(rested)
    }

    /// True if no pose came for so long that none will.
    pub(crate) fn is_left_alone(&self, now: MonoTime) -> bool {
        let lasts = self.last.map_or(0, |pose| pose.lasts_ms);
        let lasts = Duration::from_millis(lasts.into()).max(self.terms.tick);
        now.since(self.heard) > (3 * lasts).max(self.terms.period)
    }

    /// Where it is led by now, in strokes.
    pub(crate) fn places(&self) -> Pose {
        let mut places = [0.0; MAX_AXES];
        places.iter_mut().zip(&self.axes).for_each(|(place, axis)| *place = axis.place());
        places
    }
}
