//! The seat of a lane: from what was asked and from the octets that left to where its axes were to be; and as it stands in the
//! metadata of a file, from which all of that can be told again.

use serde::{Deserialize, Serialize};

use super::chunk::{Asked, SentFrame, longest_frame};
use crate::drive::link::{LinkPose, RECORD_LEN};
use crate::motion::{AxisUnit, MAX_AXES, Pulses, Window};
use crate::wire::{FrameNo, MotionRequest, PerAxis, Timing, VibrationPort, motion_len};

/// What the frames of a lane are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "u8", try_from = "u8")]
pub enum FrameKind {
    /// Motion frames with Port Out so in those with vibration.
    Datagram(VibrationPort),
    /// Poses for the thread of a serial link.
    Pose,
}

/// As octets of Port Out; 0 where frames have none.
impl From<FrameKind> for u8 {
    fn from(kind: FrameKind) -> Self {
        match kind {
            FrameKind::Datagram(VibrationPort::Two) => 2,
            FrameKind::Datagram(VibrationPort::Four) => 4,
            FrameKind::Pose => 0,
        }
    }
}

impl TryFrom<u8> for FrameKind {
    type Error = String;

    fn try_from(octets: u8) -> Result<Self, String> {
        match (octets, VibrationPort::of_bytes(octets)) {
            (0, _) => Ok(Self::Pose),
            (_, Some(port)) => Ok(Self::Datagram(port)),
            _ => Err(format!("frames with {octets} octets of outputs; there are 0, 2 or 4")),
        }
    }
}

/// A seat that is recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordedSeat {
    /// Its controller's name.
    pub(crate) name: String,
    /// Where its controller hears: address and port; none of a link, or where addresses were left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) address: Option<String>,
    /// Octets of outputs in frames with vibration; 0 where frames are poses for a link.
    #[serde(rename = "port_octets")]
    pub(crate) frames: FrameKind,
    slots: usize,
    axes: Vec<RecordedAxis>,
}

/// A frame with what it says, found out once for all who look at it.
#[derive(Debug)]
pub(crate) struct ReadFrame<'a> {
    pub(super) frame: SentFrame<'a>,
    /// Where its axes were asked to be, millimetres or degrees; none where no tick asked.
    pub(super) asked: PerAxis<f64>,
    /// What its octets say; none where that is no frame of its kind.
    pub(super) motion: Option<FrameMotion>,
}

impl ReadFrame<'_> {
    /// Where its axes were sent, millimetres or degrees; none where that is no frame of its kind.
    pub(super) fn sent(&self) -> PerAxis<f64> {
        self.motion.as_ref().map(|motion| motion.places).unwrap_or_default()
    }
}

/// What the octets of a frame say.
#[derive(Debug)]
pub(super) struct FrameMotion {
    /// Where its axes are sent, millimetres or degrees.
    pub(super) places: PerAxis<f64>,
    /// What its Time counts from, and that Time in ms.
    pub(super) timing: Timing,
    pub(super) time_ms: u32,
    /// All of it; none of a pose for a link.
    pub(super) request: Option<MotionRequest>,
}

/// One of its axes; lengths in its unit, speeds in that a second, and so on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct RecordedAxis {
    slot: usize,
    /// The lower end of its range, and how long that is.
    pub(crate) low: f64,
    pub(crate) stroke: f64,
    /// How long a pulse is.
    pub(crate) pulse: f64,
    pub(crate) unit: AxisUnit,
    pub(crate) max_velocity: f64,
    pub(crate) max_acceleration: f64,
    pub(crate) max_jerk: f64,
}

impl RecordedAxis {
    /// The limits of speed, acceleration and jerk.
    pub(crate) const fn limits(&self) -> [f64; 3] {
        [self.max_velocity, self.max_acceleration, self.max_jerk]
    }

    /// To whole pulses.
    #[expect(clippy::cast_possible_truncation, reason = "a saturating cast is what is wanted")]
    pub(super) fn pulses(&self, place: f64) -> i64 {
        // Rounding by a cast: the function for it is a call to the C library on plain x86-64.
        let pulses = place / self.pulse;
        (pulses + 0.5_f64.copysign(pulses)) as i64
    }
}

impl RecordedSeat {
    /// The seat of a lane with that window.
    #[must_use]
    pub fn new(name: &str, window: &Window, frames: FrameKind) -> Self {
        let own = window.slots().iter().enumerate().filter(|(_, slot)| slot.is_own);
        let axis = |(slot, own): (usize, &crate::motion::Slot)| {
            let pulse = own.stroke / own.stroke_pulses;
            RecordedAxis {
                slot,
                low: own.low_pulses * pulse,
                stroke: own.stroke,
                pulse,
                unit: own.unit,
                max_velocity: own.limits.velocity * own.stroke,
                max_acceleration: own.limits.acceleration * own.stroke,
                max_jerk: own.limits.jerk * own.stroke,
            }
        };
        let (slots, axes) = (window.slots().len(), own.map(axis).collect());
        Self { name: name.to_owned(), address: None, frames, slots, axes }
    }

    /// The same, of a controller that hears there.
    pub(crate) fn at(self, address: String) -> Self {
        Self { address: Some(address), ..self }
    }

    /// The same without name and address, which nobody knows again.
    pub(super) fn without_names(&self, index: usize) -> Self {
        Self { name: format!("S{}", index + 1), address: None, ..self.clone() }
    }

    /// Its axes, in their order.
    pub(crate) fn axes(&self) -> &[RecordedAxis] {
        &self.axes
    }

    /// What of it cannot be so, where it was read from a file.
    pub(super) fn fault(&self) -> Option<&'static str> {
        let is_length = |length: f64| length.is_finite() && length > 0.0;
        let is_sound = |axis: &RecordedAxis| {
            let lengths = axis.limits().into_iter().chain([axis.stroke, axis.pulse]);
            axis.slot < self.slots && axis.low.is_finite() && lengths.into_iter().all(is_length)
        };
        if self.slots > MAX_AXES || self.axes.len() > self.slots {
            Some("more axes than a seat can have")
        } else if !self.axes.iter().all(is_sound) {
            Some("an axis that no seat can have")
        } else {
            None
        }
    }

    /// Octets of its longest frame in a chunk.
    pub(super) fn longest_frame(&self) -> usize {
        let datagram = match self.frames {
            FrameKind::Datagram(port) => motion_len(self.slots, Some(port)),
            FrameKind::Pose => RECORD_LEN,
        };
        longest_frame(self.slots, datagram)
    }

    /// Octets of the positions of one of its frames in columns.
    pub(super) const fn in_columns(&self) -> usize {
        match self.frames {
            FrameKind::Datagram(_) => self.slots,
            FrameKind::Pose => RECORD_LEN,
        }
    }

    /// Where its axes were asked to be, millimetres or degrees; none where no tick asked.
    pub(crate) fn asked(&self, asked: &Asked) -> PerAxis<f64> {
        let axes = self.axes.iter().take_while(|axis| axis.slot < asked.slots).count();
        PerAxis::from_fn(axes, |axis| {
            let RecordedAxis { slot, low, stroke, .. } = self.axes[axis];
            low + asked.pose[slot] * stroke
        })
    }

    /// What has to be asked for so that [`Self::asked`] tells these places.
    pub(super) fn pose(&self, places: &[f64]) -> [f64; MAX_AXES] {
        let mut pose = [0.0; MAX_AXES];
        for (axis, place) in self.axes.iter().zip(places) {
            pose[axis.slot] = (place - axis.low) / axis.stroke;
        }
        pose
    }

    /// Where its axes are that stand at these places, millimetres or degrees.
    pub(super) fn measured(&self, pulses: &[Pulses]) -> PerAxis<f64> {
        let axes = self.axes.iter().take_while(|axis| axis.slot < pulses.len()).count();
        PerAxis::from_fn(axes, |axis| f64::from(pulses[self.axes[axis].slot].0) * self.axes[axis].pulse)
    }

    /// The number of a frame; `None` where that is no frame of its kind.
    pub(crate) fn frame_no(&self, datagram: &[u8]) -> Option<FrameNo> {
        match self.frames {
            FrameKind::Datagram(port) => {
                MotionRequest::parse_as(port, datagram).ok().map(|request| request.frame)
            }
            FrameKind::Pose => datagram.try_into().ok().map(|record| LinkPose::parse(record).frame),
        }
    }

    /// Where its axes were sent, millimetres or degrees; none where that is no frame of its kind.
    pub(crate) fn sent(&self, frame: &SentFrame<'_>) -> PerAxis<f64> {
        self.motion(frame).map(|motion| motion.places).unwrap_or_default()
    }

    /// One of its frames, with what it says.
    pub(super) fn read<'a>(&self, frame: SentFrame<'a>) -> ReadFrame<'a> {
        ReadFrame { asked: self.asked(&frame.asked), motion: self.motion(&frame), frame }
    }

    fn motion(&self, frame: &SentFrame<'_>) -> Option<FrameMotion> {
        self.motion_of(frame.datagram)
    }

    /// What the octets of one of its frames say.
    pub(super) fn motion_of(&self, datagram: &[u8]) -> Option<FrameMotion> {
        match self.frames {
            FrameKind::Datagram(port) => {
                let request = MotionRequest::parse_as(port, datagram).ok()?;
                let places = self.measured(&request.positions);
                let MotionRequest { timing, time_ms, .. } = request;
                Some(FrameMotion { places, timing, time_ms, request: Some(request) })
            }
            FrameKind::Pose => {
                let pose = LinkPose::parse(datagram.try_into().ok()?);
                let place = |axis: usize| {
                    let RecordedAxis { slot, low, stroke, .. } = self.axes[axis];
                    low + pose.axes[slot] * stroke
                };
                let places = PerAxis::from_fn(self.axes.len(), place);
                Some(FrameMotion { places, timing: Timing::Relative, time_ms: pose.lasts_ms, request: None })
            }
        }
    }
}
