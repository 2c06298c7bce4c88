//! The seat of a lane: from what was asked and from the octets that left to where its axes were to be.

use std::sync::Arc;

use super::chunk::{Asked, SentFrame, longest_frame};
use crate::drive::link::{LinkPose, RECORD_LEN};
use crate::motion::{AxisUnit, Pulses, Window};
use crate::wire::{MotionRequest, VibrationPort, motion_len};

/// What the frames of a lane are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameKind {
    /// Motion frames with Port Out so in those with vibration.
    Datagram(VibrationPort),
    /// Poses for the thread of a serial link.
    Pose,
}

/// A seat that is recorded.
#[derive(Debug, Clone)]
pub struct RecordedSeat {
    /// Its controller's name.
    pub(crate) name: Arc<str>,
    frames: FrameKind,
    slots: usize,
    axes: Vec<RecordedAxis>,
}

/// One of its axes.
#[derive(Debug, Clone, Copy)]
struct RecordedAxis {
    slot: usize,
    /// The lower end of its range, and how long that is, millimetres or degrees.
    low: f64,
    stroke: f64,
    /// Millimetres or degrees of a pulse.
    pulse: f64,
    unit: AxisUnit,
}

impl RecordedSeat {
    /// The seat of a lane with that window.
    #[must_use]
    pub fn new(name: &str, window: &Window, frames: FrameKind) -> Self {
        let own = window.slots().iter().enumerate().filter(|(_, slot)| slot.is_own);
        let axis = |(slot, own): (usize, &crate::motion::Slot)| {
            let pulse = own.stroke / own.stroke_pulses;
            RecordedAxis { slot, low: own.low_pulses * pulse, stroke: own.stroke, pulse, unit: own.unit }
        };
        Self { name: name.into(), frames, slots: window.slots().len(), axes: own.map(axis).collect() }
    }

    /// What each axis is measured in.
    pub(crate) fn units(&self) -> impl Iterator<Item = AxisUnit> {
        self.axes.iter().map(|axis| axis.unit)
    }

    /// Octets of its longest frame in a chunk.
    pub(super) fn longest_frame(&self) -> usize {
        let datagram = match self.frames {
            FrameKind::Datagram(port) => motion_len(self.slots, Some(port)),
            FrameKind::Pose => RECORD_LEN,
        };
        longest_frame(self.slots, datagram)
    }

    /// Where its axes were asked to be, millimetres or degrees; none where no tick asked.
    pub(super) fn asked(&self, asked: &Asked) -> Vec<f64> {
        let axes = self.axes.iter().take_while(|axis| axis.slot < asked.slots);
        axes.map(|axis| axis.low + asked.pose[axis.slot] * axis.stroke).collect()
    }

    /// Where its axes are that stand at these places, millimetres or degrees.
    pub(super) fn measured(&self, pulses: &[Pulses]) -> Vec<f64> {
        let place = |axis: &RecordedAxis| pulses.get(axis.slot).map(|at| f64::from(at.0) * axis.pulse);
        self.axes.iter().map_while(place).collect()
    }

    /// Where its axes were sent, millimetres or degrees; none where that is no frame of its kind.
    pub(super) fn sent(&self, frame: &SentFrame<'_>) -> Vec<f64> {
        match self.frames {
            FrameKind::Datagram(port) => {
                let request = MotionRequest::parse_as(port, frame.datagram).ok();
                let place = |request: &MotionRequest, axis: &RecordedAxis| {
                    request.positions.get(axis.slot).map(|at| f64::from(at.0) * axis.pulse)
                };
                let places =
                    |request| self.axes.iter().map_while(move |axis| place(&request, axis)).collect();
                request.map(places).unwrap_or_default()
            }
            FrameKind::Pose => {
                let pose = frame.datagram.try_into().map(LinkPose::parse);
                let place =
                    |pose: &LinkPose, axis: &RecordedAxis| axis.low + pose.axes[axis.slot] * axis.stroke;
                pose.map(|pose| self.axes.iter().map(|axis| place(&pose, axis)).collect()).unwrap_or_default()
            }
        }
    }
}
