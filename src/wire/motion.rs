//! Motion of all axes: 0x1301 absolute and 0x1401 relative time, 0x1801 and 0x1901 the same with vibration, and the
//! replies of each (SMC manual 2.2.2.5 to 2.2.2.12).

use super::bytes::{i32_at, put_i32, put_u16, put_u32, u16_at, u32_at};
use super::header::{self, Header, reply_function, request_function};
use super::{
    Analogue, Code, FrameNo, MAX_LEN, PerAxis, ReplyCode, Vibration, VibrationPort, WireError, vibration,
};
use crate::motion::{MAX_AXES, Pulses};

mod field {
    pub(super) const FRAME: usize = 12; // u32
    pub(super) const TIME: usize = 16; // u32, ms to reach the position
    pub(super) const POSITIONS: usize = 20; // n x i32; then Port u16, then Extend u32 or n x vibration
    pub(super) const PORT_LEN: usize = 2; // with vibration as VibrationPort says
    pub(super) const EXTEND_LEN: usize = 4;
}

const ABSOLUTE: u8 = 0x13;
const RELATIVE: u8 = 0x14;
const VIBRATING_ABSOLUTE: u8 = 0x18;
const VIBRATING_RELATIVE: u8 = 0x19;

/// What the Time of a frame counts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Timing {
    /// From the start of the play: the move takes the difference to the frame before.
    Absolute,
    /// From the end of the move before: the move takes the Time itself.
    #[default]
    Relative,
}

/// The object channel and the number of positions for a controller of `axes` axes: padded to 3, 6 or 10, and 12.
#[must_use]
pub(crate) const fn motion_channel_and_slots(axes: usize) -> (u16, usize) {
    match axes {
        0..=3 => (0, 3),
        4..=6 => (1, 6),
        7..=10 => (2, 10),
        _ => (2, MAX_AXES),
    }
}

/// A motion frame to send, host to controller: 38 bytes for three axes, 50 for six, 66 for ten, 74 for twelve, with
/// vibration 46 for three and 70 for six, or two more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Motion<'a> {
    /// What `time_ms` counts from.
    pub timing: Timing,
    /// Object channel: 0 three axes, 1 six, 2 more; see [`motion_channel_and_slots`].
    pub channel: u16,
    /// Who shall obey.
    pub accept: Code,
    /// Who shall answer.
    pub reply: Code,
    /// Its number.
    pub frame: FrameNo,
    /// Time to reach the positions, ms.
    pub time_ms: u32,
    /// Where each axis shall be, axis 1 first; 3, 6, 10 or 12 of them, those past the twelfth are not sent.
    pub positions: &'a [Pulses],
    /// Switched outputs, bit 0 = Y01 to bit 11 = Y12.
    pub outputs: u16,
    /// Analogue outputs, for which frames with vibration have no place.
    pub analogue: Analogue,
    /// Vibration of each axis, which makes it 0x1801 or 0x1901; axes past the end of the slice get none.
    pub vibration: Option<&'a [Vibration]>,
}

impl Motion<'_> {
    /// Writes the message to the front of `buf` and returns it; nothing of what was there is kept.
    pub fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        self.emit_as(VibrationPort::Two, buf)
    }

    /// The same for a controller that has Port Out so in vibration frames.
    pub fn emit_as<'b>(&self, port: VibrationPort, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let function = request_function(family(self.timing, self.vibration.is_some()));
        let header = Header { function, slot: self.channel, accept: self.accept, reply: self.reply };
        let body = MotionBody {
            frame: self.frame,
            time_ms: self.time_ms,
            positions: self.positions,
            port: self.outputs,
            extend: self.analogue.meant().extend(),
            vibration: self.vibration,
        };
        body.emit(header, port, buf)
    }
}

/// A motion frame as a controller receives it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionRequest {
    /// What `time_ms` counts from.
    pub timing: Timing,
    /// Object channel: 0 three axes, 1 six, 2 as many as fit, 3 to 12 that many.
    pub channel: u16,
    /// Who shall obey.
    pub accept: Code,
    /// Who shall answer.
    pub reply: Code,
    /// Its number.
    pub frame: FrameNo,
    /// Time to reach the positions, ms.
    pub time_ms: u32,
    /// Where each axis shall be, axis 1 first.
    pub positions: PerAxis<Pulses>,
    /// Switched outputs, bit 0 = Y01 to bit 11 = Y12; the upper four bits mean nothing.
    pub outputs: u16,
    /// Extend, or two analogue outputs; 0 with vibration.
    pub extend: u32,
    /// Vibration of each axis (0x1801, 0x1901).
    pub vibration: Option<PerAxis<Vibration>>,
}

impl MotionRequest {
    /// Reads a frame; bytes after its layout are let pass, as controllers do.
    ///
    /// # Errors
    /// [`WireError::Axes`] for a channel that means no number of axes, [`WireError::Length`] where it is shorter
    /// than its axes need, and those of a broken header or another function.
    pub fn parse(bytes: &[u8]) -> Result<Self, WireError> {
        Self::parse_as(VibrationPort::Two, bytes)
    }

    /// The same, of a host that has Port Out so in vibration frames.
    ///
    /// # Errors
    /// As [`MotionRequest::parse`].
    pub(crate) fn parse_as(port: VibrationPort, bytes: &[u8]) -> Result<Self, WireError> {
        let header = Header::parse(bytes)?;
        let (timing, vibrating) = layout(header.family()).ok_or(header.foreign())?;
        let vibrating = vibrating.then_some(port);
        if !header.is_request() {
            return Err(header.foreign());
        }
        let axes = axes_of_request(header.slot, bytes.len(), vibrating)?;
        let body = read(bytes, axes, vibrating)?;
        Ok(Self {
            timing,
            channel: header.slot,
            accept: header.accept,
            reply: header.reply,
            frame: body.frame,
            time_ms: body.time_ms,
            positions: body.positions,
            outputs: body.port,
            extend: body.extend,
            vibration: body.vibration,
        })
    }

    /// Writes the frame to the front of `buf` and returns it, Extend as it is.
    pub(crate) fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        self.emit_as(VibrationPort::Two, buf)
    }

    /// The same for a controller that has Port Out so in vibration frames.
    pub fn emit_as<'b>(&self, port: VibrationPort, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let function = self.function();
        let header = Header { function, slot: self.channel, accept: self.accept, reply: self.reply };
        let body = MotionBody {
            frame: self.frame,
            time_ms: self.time_ms,
            positions: &self.positions,
            port: self.outputs,
            extend: self.extend,
            vibration: self.vibration.as_deref(),
        };
        body.emit(header, port, buf)
    }

    /// Its function code.
    #[must_use]
    pub(crate) const fn function(&self) -> u16 {
        request_function(family(self.timing, self.vibration.is_some()))
    }

    /// Bytes of its layout; what a datagram has beyond them is surplus.
    #[must_use]
    pub fn layout_len(&self, port: VibrationPort) -> usize {
        motion_len(self.positions.len(), self.vibration.map(|_| port))
    }
}

/// A controller's answer to a motion frame: the frame again, with its inputs where the outputs stood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionReply {
    /// The timing of the frame that it answers.
    pub timing: Timing,
    /// What became of the frame.
    pub code: ReplyCode,
    /// The object channel (x = 2 only, else 0).
    pub channel: u16,
    /// The error number (x over 2 only, else 0); MBOX controllers leave the object channel there.
    pub error: u16,
    /// The number of the frame that it answers.
    pub frame: FrameNo,
    /// The Time of that frame, ms.
    pub time_ms: u32,
    /// The positions of that frame.
    pub positions: PerAxis<Pulses>,
    /// Inputs, bit 0 = X01.
    pub inputs: u16,
    /// Extend of that frame; 0 with vibration.
    pub extend: u32,
    /// Vibration of that frame (0x180x, 0x190x).
    pub vibration: Option<PerAxis<Vibration>>,
}

impl MotionReply {
    /// Reads a reply, x = 2 to 5; the number of axes is taken from its length. Copies at most 12 axes and borrows
    /// nothing.
    ///
    /// # Errors
    /// [`WireError::Function`] for requests and any other function, [`WireError::Axes`] or [`WireError::Length`]
    /// where not even one axis fits, and those of a broken header.
    pub fn parse(bytes: &[u8]) -> Result<Self, WireError> {
        Self::parse_as(VibrationPort::Two, bytes)
    }

    /// The same, of a controller that has the inputs so in its answers to vibration frames.
    ///
    /// # Errors
    /// As [`MotionReply::parse`].
    pub fn parse_as(port: VibrationPort, bytes: &[u8]) -> Result<Self, WireError> {
        let header = Header::parse(bytes)?;
        let (timing, vibrating) = layout(header.family()).ok_or(header.foreign())?;
        let code = header.reply_code().ok_or(header.foreign())?;
        let vibrating = vibrating.then_some(port);
        let body = read(bytes, axes_that_fit(bytes.len(), vibrating), vibrating)?;
        let running = code == ReplyCode::Running;
        Ok(Self {
            timing,
            code,
            channel: if running { header.slot } else { 0 },
            error: if running { 0 } else { header.slot },
            frame: body.frame,
            time_ms: body.time_ms,
            positions: body.positions,
            inputs: body.port,
            extend: body.extend,
            vibration: body.vibration,
        })
    }

    /// The answer to a frame that is broken, but not before its Time ends: its number, and zeros for positions. None
    /// for anything else.
    #[must_use]
    pub(crate) fn to_broken(bytes: &[u8], code: ReplyCode, error: u16) -> Option<Self> {
        let header = Header::parse(bytes).ok().filter(|header| header.is_request())?;
        let (timing, vibrating) = layout(header.family())?;
        if bytes.len() < field::POSITIONS {
            return None;
        }
        let axes = if header.slot == 0 { 3 } else { 6 };
        Some(Self {
            timing,
            code,
            channel: 0,
            error,
            frame: FrameNo(u32_at(bytes, field::FRAME)),
            time_ms: u32_at(bytes, field::TIME),
            positions: PerAxis::from_fn(axes, |_| Pulses(0)),
            inputs: 0,
            extend: 0,
            vibration: vibrating.then(|| PerAxis::from_fn(axes, |_| Vibration::NONE)),
        })
    }

    /// Writes the reply to the front of `buf` and returns it; nothing of what was there is kept.
    pub fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        self.emit_as(VibrationPort::Two, buf)
    }

    /// The same of a controller that has the inputs so in its answers to vibration frames.
    pub fn emit_as<'b>(&self, port: VibrationPort, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let function = reply_function(family(self.timing, self.vibration.is_some()), self.code);
        let slot = if self.code == ReplyCode::Running { self.channel } else { self.error };
        let body = MotionBody {
            frame: self.frame,
            time_ms: self.time_ms,
            positions: &self.positions,
            port: self.inputs,
            extend: self.extend,
            vibration: self.vibration.as_deref(),
        };
        body.emit(Header { function, slot, accept: Code::NONE, reply: Code::NONE }, port, buf)
    }

    /// Bytes of its layout; what a datagram has beyond them is surplus.
    #[must_use]
    pub fn layout_len(&self, port: VibrationPort) -> usize {
        motion_len(self.positions.len(), self.vibration.map(|_| port))
    }
}

/// Bytes of a motion frame, or of its reply, with so many positions, and with vibration where `vibrating` says how wide its
/// port is.
#[must_use]
pub(crate) const fn motion_len(axes: usize, vibrating: Option<VibrationPort>) -> usize {
    let tail = if vibrating.is_some() { vibration::LEN * axes } else { field::EXTEND_LEN };
    field::POSITIONS + 4 * axes + port_len(vibrating) + tail
}

const fn port_len(vibrating: Option<VibrationPort>) -> usize {
    match vibrating {
        Some(port) => port.len(),
        None => field::PORT_LEN,
    }
}

const fn family(timing: Timing, vibrating: bool) -> u8 {
    match (timing, vibrating) {
        (Timing::Absolute, false) => ABSOLUTE,
        (Timing::Relative, false) => RELATIVE,
        (Timing::Absolute, true) => VIBRATING_ABSOLUTE,
        (Timing::Relative, true) => VIBRATING_RELATIVE,
    }
}

/// Timing and whether there is vibration, of a motion function.
const fn layout(family: u8) -> Option<(Timing, bool)> {
    match family {
        ABSOLUTE => Some((Timing::Absolute, false)),
        RELATIVE => Some((Timing::Relative, false)),
        VIBRATING_ABSOLUTE => Some((Timing::Absolute, true)),
        VIBRATING_RELATIVE => Some((Timing::Relative, true)),
        _ => None,
    }
}

/// True if a function belongs here.
pub(super) const fn is_motion(family: u8) -> bool {
    layout(family).is_some()
}

/// The most axes that fit into `bytes` bytes.
const fn axes_that_fit(bytes: usize, vibrating: Option<VibrationPort>) -> usize {
    let per_axis = if vibrating.is_some() { 4 + vibration::LEN } else { 4 };
    let axes = bytes.saturating_sub(motion_len(0, vibrating)) / per_axis;
    if axes > MAX_AXES { MAX_AXES } else { axes }
}

/// Manuals and programs disagree on channel 2 and above: 2 is taken from the length, 3 to 12 at their word.
fn axes_of_request(channel: u16, bytes: usize, vibrating: Option<VibrationPort>) -> Result<usize, WireError> {
    match channel {
        0 => Ok(3),
        1 => Ok(6),
        2 => Ok(axes_that_fit(bytes, vibrating)),
        3..=12 => Ok(usize::from(channel)),
        found => Err(WireError::Axes { at: header::SLOT, found }),
    }
}

/// What follows the header, to write.
struct MotionBody<'a> {
    frame: FrameNo,
    time_ms: u32,
    positions: &'a [Pulses],
    port: u16,
    extend: u32,
    vibration: Option<&'a [Vibration]>,
}

impl MotionBody<'_> {
    fn emit<'b>(&self, header: Header, port: VibrationPort, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let vibrating = self.vibration.map(|_| port);
        header.emit(buf);
        put_u32(buf, field::FRAME, self.frame.0);
        put_u32(buf, field::TIME, self.time_ms);
        let axes = self.positions.len().min(MAX_AXES);
        let fields = buf[field::POSITIONS..].chunks_exact_mut(4);
        for (bytes, position) in fields.zip(&self.positions[..axes]) {
            put_i32(bytes, 0, position.0);
        }
        let port = field::POSITIONS + 4 * axes;
        let tail = port + port_len(vibrating);
        buf[port..tail].fill(0);
        put_u16(buf, tail - 2, self.port);
        if let Some(vibration) = self.vibration {
            for axis in 0..axes {
                let shake = vibration.get(axis).copied().unwrap_or(Vibration::NONE);
                shake.put(buf, tail + vibration::LEN * axis);
            }
        } else {
            put_u32(buf, tail, self.extend);
        }
        &buf[..motion_len(axes, vibrating)]
    }
}

/// What follows the header, as read.
struct ReadBody {
    frame: FrameNo,
    time_ms: u32,
    positions: PerAxis<Pulses>,
    port: u16,
    extend: u32,
    vibration: Option<PerAxis<Vibration>>,
}

fn read(bytes: &[u8], axes: usize, vibrating: Option<VibrationPort>) -> Result<ReadBody, WireError> {
    let need = motion_len(axes.max(1), vibrating);
    if bytes.len() < need {
        return Err(WireError::Length { len: bytes.len(), need });
    }
    let tail = field::POSITIONS + 4 * axes + port_len(vibrating);
    Ok(ReadBody {
        frame: FrameNo(u32_at(bytes, field::FRAME)),
        time_ms: u32_at(bytes, field::TIME),
        positions: PerAxis::from_fn(axes, |axis| Pulses(i32_at(bytes, field::POSITIONS + 4 * axis))),
        port: u16_at(bytes, tail - 2),
        extend: if vibrating.is_some() { 0 } else { u32_at(bytes, tail) },
        vibration: vibrating
            .map(|_| PerAxis::from_fn(axes, |axis| Vibration::at(bytes, tail + vibration::LEN * axis))),
    })
}
