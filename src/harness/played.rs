//! What a show made of its seats, judged by the measure of what is sent.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use super::Event;
use crate::limiter::Counts;
use crate::motion::{AxisGeometry, Measure, Spacing};
use crate::rt::{Ended, News};
use crate::time::{MonoTime, Rate, ShowTime};
use crate::timeline::Timeline;
use crate::wire::{MotionRequest, Timing};

/// A frame as it left.
#[derive(Debug, Clone)]
pub struct Frame {
    pub lane: usize,
    pub at: MonoTime,
    pub request: MotionRequest,
    pub bytes: Vec<u8>,
}

/// A show that was played.
pub struct Played {
    pub ended: Ended,
    pub frames: Vec<Frame>,
    /// How late each wake-up was told to be.
    pub late_ns: Vec<u64>,
    /// The events of the script, and when each came.
    pub happened: Vec<(MonoTime, Event)>,
    /// What the hall made known.
    pub news: Vec<News>,
    /// What the limiter had to do, lane by lane.
    pub clamps: Vec<Counts>,
    /// How long the first join takes.
    pub join: ShowTime,
    pub timeline: Arc<Timeline>,
    pub rate: Rate,
}

/// The worst that a seat was made to do, each over its limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Worst {
    pub velocity: f64,
    pub acceleration: f64,
    pub jerk: f64,
    pub step: f64,
}

impl Worst {
    /// The worse of the two, part by part.
    pub fn max(self, other: Self) -> Self {
        Self {
            velocity: self.velocity.max(other.velocity),
            acceleration: self.acceleration.max(other.acceleration),
            jerk: self.jerk.max(other.jerk),
            step: self.step.max(other.step),
        }
    }
}

impl Played {
    /// The frames of one lane.
    pub fn lane(&self, lane: usize) -> impl Iterator<Item = &Frame> {
        self.frames.iter().filter(move |frame| frame.lane == lane)
    }

    /// The positions of one axis of one lane, frame by frame, mm.
    pub fn positions_mm(&self, lane: usize, axis: usize) -> Vec<f64> {
        let per_pulse = 150.0 / AxisGeometry::BENCH.stroke_pulses();
        self.lane(lane).map(|frame| f64::from(frame.request.positions[axis].0) * per_pulse).collect()
    }

    /// What the frames make the first lane do from rest in its park pose.
    pub fn worst(&self) -> Worst {
        self.worst_of(0, 0..self.lane(0).count(), |_| 0.0)
    }

    /// What the frames before `end` make the first lane do from rest in its park pose.
    pub fn worst_until(&self, end: usize) -> Worst {
        self.worst_of(0, 0..end, |_| 0.0)
    }

    /// What the frames from `first` to before `end` make the first lane do, if it was at rest in the pose of the first.
    pub fn worst_from_rest(&self, first: usize, end: usize) -> Worst {
        self.worst_of(0, first..end, |mm| mm)
    }

    /// The same of its first axis, if that was at rest `mm` up.
    pub fn worst_from_rest_at(&self, mm: f64, first: usize, end: usize) -> Worst {
        self.worst_of_axis(0, 0, first..end, |_| mm)
    }

    /// What its frames of those numbers make a lane do, if it was at rest in the pose of the first.
    pub fn worst_of_lane(&self, lane: usize, frames: Range<usize>) -> Worst {
        self.worst_of(lane, frames, |mm| mm)
    }

    /// By the measure of what is sent, over the limits of the bench seat; before the first frame the seat rested where
    /// `before` puts it.
    fn worst_of(&self, lane: usize, frames: Range<usize>, before: impl Fn(f64) -> f64) -> Worst {
        let axes = 0..self.frames[0].request.positions.len();
        let worst = axes.map(|axis| self.worst_of_axis(lane, axis, frames.clone(), &before));
        worst.fold(Worst::default(), Worst::max)
    }

    fn worst_of_axis(
        &self,
        lane: usize,
        axis: usize,
        frames: Range<usize>,
        before: impl Fn(f64) -> f64,
    ) -> Worst {
        let sent: Vec<&Frame> = self.lane(lane).collect();
        let mm = self.positions_mm(lane, axis);
        let time = |frame: usize| Duration::from_millis(u64::from(self.time_ms(sent[frame], frame)));
        let lines = frames.clone().map(|frame| {
            let first = frame == frames.start;
            (if first { self.rate.period() } else { time(frame) }, mm[frame])
        });
        worst_of_lines(self.rate, before(mm[frames.start]), lines)
    }

    /// How long a frame gives its seat.
    fn time_ms(&self, frame: &Frame, index: usize) -> u32 {
        match frame.request.timing {
            Timing::Relative => frame.request.time_ms,
            Timing::Absolute => self.rate.time_ms(index as u64),
        }
    }
}

/// What straight lines make an axis of the bench seat do, from rest `before` mm up: each takes that long, and ends that
/// many mm up. By the measure of what is sent at that rate.
pub fn worst_of_lines(rate: Rate, before: f64, lines: impl IntoIterator<Item = (Duration, f64)>) -> Worst {
    let axis = AxisGeometry::BENCH;
    let step = 4.0 * axis.max_acceleration * (1.0 / rate.hz()).max(0.005);
    let mut worst = Worst::default();
    let mut measure = Measure::new(Spacing::at_rate(rate.hz()));
    let mut at = ShowTime::ZERO;
    measure.push(at, before);
    for _ in 1..100 {
        at += rate.period();
        measure.push(at, before);
    }
    for (span, mm) in lines {
        at += span;
        let seen = measure.push(at, mm);
        worst.velocity = worst.velocity.max(seen.velocity.value.abs() / axis.max_velocity);
        worst.acceleration = worst.acceleration.max(seen.acceleration.value.abs() / axis.max_acceleration);
        worst.jerk = worst.jerk.max(seen.jerk.value.abs() / axis.max_jerk);
        worst.step = worst.step.max(seen.step.value.abs() / step);
    }
    worst
}
