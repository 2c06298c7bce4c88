//! From a pose to the datagram of one controller: the frame number, whether a reply is asked for, and the bytes as its family has
//! them. Tick thread; allocates nothing.

use super::link::LinkPose;
use super::mbox::MotionCodec;
use crate::engine::{Beat, Mix};
use crate::motion::{Pose, Window};
use crate::wire::{Code, FrameNo, MAX_LEN, Timing};

/// Axes at the most for which a frame has places of vibration (SMC manual 2.2.2.9).
const SHAKEN: usize = 6;

/// Our state for one controller, as far as sending goes.
#[derive(Debug, Clone)]
pub struct Lane {
    /// The axes of its frames.
    pub(crate) window: Window,
    /// Asks for a reply in each Nth frame; 0 never asks.
    pub(crate) ack_every: u32,
    /// The longest Time that its controller executes as it is, ms (PA0b).
    pub(crate) longest_ms: u32,
    pub(super) codec: Codec,
    pub(super) next_frame: FrameNo,
}

/// How the frames of a family are written.
#[derive(Debug, Clone)]
pub(super) enum Codec {
    /// SMC, IMAX and MBOX controllers.
    Mbox(MotionCodec),
    /// The thread of a serial link, which makes its own of poses.
    Link {
        /// Level of vibration on its drives, 0 to 1, on top of the mix.
        shake: f64,
    },
}

/// A frame that was written: its number, and whether it asks for a reply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamped {
    /// Its number.
    pub frame: FrameNo,
    /// True if it asks for a reply.
    pub(crate) asked: bool,
    /// True if it switches outputs on.
    pub(crate) lights: bool,
    /// The greatest amplitude of vibration that it asks of any slot, strokes.
    pub shakes: f64,
}

impl Lane {
    /// Writes the frame of this tick to `buf`, and takes a frame number for it.
    pub fn encode<'b>(
        &mut self,
        beat: &Beat,
        pose: &Pose,
        mix: Mix,
        buf: &'b mut [u8; MAX_LEN],
    ) -> (Stamped, &'b [u8]) {
        let mut stamped = self.stamp();
        let octets = match &self.codec {
            Codec::Mbox(codec) => codec.write(&self.window, (beat, pose), mix, codec.code, &mut stamped, buf),
            Codec::Link { shake } => {
                let mix = Mix { vibration: shake * mix.vibration, ..mix };
                LinkPose::of(&self.window, beat, pose, mix, &mut stamped).emit(buf)
            }
        };
        (stamped, octets)
    }

    /// Writes the frame of this tick as it would be under that number, for whoever that code means, and takes no number for it; none
    /// where its family has no such code.
    pub(crate) fn draft<'b>(
        &self,
        frame: FrameNo,
        code: Code,
        beat: &Beat,
        pose: &Pose,
        mix: Mix,
        buf: &'b mut [u8; MAX_LEN],
    ) -> Option<(Stamped, &'b [u8])> {
        let Codec::Mbox(codec) = &self.codec else { return None };
        let mut stamped = Stamped { frame, asked: frame.asks(self.ack_every), lights: false, shakes: 0.0 };
        let octets = codec.write(&self.window, (beat, pose), mix, code, &mut stamped, buf);
        Some((stamped, octets))
    }

    /// The number of its next frame.
    pub(crate) const fn next_frame(&self) -> FrameNo {
        self.next_frame
    }

    /// Takes that number, which is no earlier than its next, for a frame that was drafted; says whether others before it are left out.
    pub(crate) fn take(&mut self, frame: FrameNo) -> bool {
        let skips = frame != self.next_frame;
        self.next_frame = frame.next();
        skips
    }

    /// Writes the one slow frame that brings the lane to its park pose in `time_ms`, plain, effects and outputs off.
    pub(crate) fn encode_slow_park<'b>(
        &mut self,
        time_ms: u32,
        buf: &'b mut [u8; MAX_LEN],
    ) -> (Stamped, &'b [u8]) {
        self.encode_slow(&self.window.park(), false, time_ms, buf)
    }

    /// Writes the one slow frame that holds a seat which vibrates about that pose: it says that each axis is not to, outputs off.
    pub(crate) fn encode_still<'b>(
        &mut self,
        pose: &Pose,
        time_ms: u32,
        buf: &'b mut [u8; MAX_LEN],
    ) -> (Stamped, &'b [u8]) {
        let has_room = self.window.slots().len() <= SHAKEN;
        self.encode_slow(pose, has_room, time_ms, buf)
    }

    fn encode_slow<'b>(
        &mut self,
        pose: &Pose,
        vibrates: bool,
        time_ms: u32,
        buf: &'b mut [u8; MAX_LEN],
    ) -> (Stamped, &'b [u8]) {
        let set_vibrates = |lane: &mut Self, vibrates| match &mut lane.codec {
            Codec::Mbox(codec) => std::mem::replace(&mut codec.vibrates, vibrates),
            Codec::Link { .. } => vibrates,
        };
        let before = set_vibrates(self, vibrates);
        let (stamped, octets) =
            self.encode(&Beat::still(Timing::Relative, time_ms), pose, Mix::STILL, &mut *buf);
        let len = octets.len();
        set_vibrates(self, before);
        (stamped, &buf[..len])
    }

    /// Makes every frame from now on hold the lane at its park pose, whatever it is asked for, vibration, effects and outputs off.
    pub(crate) fn hold(&mut self) {
        self.window.hold();
        match &mut self.codec {
            Codec::Mbox(codec) => codec.hold(),
            Codec::Link { .. } => {}
        }
    }

    /// The lane with the number of its next frame.
    #[must_use]
    pub fn starting_at(self, next_frame: FrameNo) -> Self {
        Self { next_frame, ..self }
    }

    /// Goes on counting where another left off: a frame number never comes twice.
    pub(crate) const fn go_on_from(&mut self, before: &Self) {
        self.next_frame = before.next_frame;
    }

    /// The number of the frame written last; one less than the first where there was none.
    #[must_use]
    pub const fn last_frame(&self) -> FrameNo {
        FrameNo(self.next_frame.0.wrapping_sub(1))
    }

    fn stamp(&mut self) -> Stamped {
        let frame = self.next_frame;
        self.next_frame = frame.next();
        let asked = frame.asks(self.ack_every);
        Stamped { frame, asked, lights: false, shakes: 0.0 }
    }
}

#[cfg(test)]
mod tests;
