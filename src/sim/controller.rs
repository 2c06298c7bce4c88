//! One virtual controller: takes datagrams, obeys, answers.

use std::net::SocketAddrV4;
use std::time::Duration;

use super::player::{Overflow, Player, Positions};
use super::registers::{Registers, pa};
use super::{Counts, Setup};
use crate::motion::{MAX_AXES, Pulses};
use crate::time::MonoTime;
use crate::wire::{
    Access, Code, Dialect, MAX_LEN, Message, MotionReply, MotionRequest, PerAxis, ReplyCode, Timing,
};

mod access;
mod malformed;

/// How long a controller homes.
pub(super) const HOMING: Duration = Duration::from_millis(500);
/// The error of a queue that ran over; only a reset clears it.
const ERR_OVERFLOW: u16 = 21;
const NEVER: MonoTime = MonoTime::from_nanos(u64::MAX);
/// Outputs that there are.
const OUTPUTS: u16 = 0x0fff;

/// A virtual controller. Told the time; touches neither socket nor clock, and allocates nothing once it is made.
#[derive(Debug)]
pub struct Controller {
    dialect: Dialect,
    mute: bool,
    registers: Registers,
    player: Player,
    outputs: u16,
    inputs: u16,
    /// Time of the last motion in absolute time; none where the next one is a first one.
    last_absolute: Option<u32>,
    /// Error number; 0 for none.
    error: u16,
    homing_until: MonoTime,
    silent_until: MonoTime,
    estop: EmergencyStop,
    packets: u16,
    last_len: u16,
    counts: Counts,
}

/// What is known about the emergency stop.
#[derive(Debug, Clone, Copy, Default)]
struct EmergencyStop {
    /// From when on it is in effect by order of the setup.
    forced: Option<MonoTime>,
    /// From when on the inputs ask for it, their filter included.
    inputs: Option<MonoTime>,
    /// Whether what has to happen when it comes has happened.
    taken: bool,
    /// Whether only a reset ends it (PA91 = 2).
    latched: bool,
}

/// What a controller did with a datagram.
#[derive(Debug, Clone, Copy)]
pub struct Handled<'b> {
    /// The answer, where it gives one.
    pub reply: Option<&'b [u8]>,
    /// The motion frame, where it was a whole one that was meant for it.
    pub motion: Option<MotionSeen>,
}

/// A motion frame that reached a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionSeen {
    /// The frame.
    pub request: MotionRequest,
    /// The x that the controller answers it with, whether it may answer or not.
    pub code: ReplyCode,
}

impl Controller {
    /// A controller at rest in zero, homed, at `address`.
    #[must_use]
    pub fn new(setup: &Setup, address: SocketAddrV4, at: MonoTime) -> Self {
        let registers = Registers::new(setup, address);
        let estop =
            EmergencyStop { forced: setup.estop_at.map(|after| at + after), ..EmergencyStop::default() };
        Self {
            dialect: setup.dialect,
            mute: setup.mute,
            outputs: registers.get(pa::START_OUTPUTS) & OUTPUTS,
            registers,
            player: Player::new(at),
            inputs: 0,
            last_absolute: None,
            error: 0,
            homing_until: at,
            silent_until: at,
            estop,
            packets: 0,
            last_len: 0,
            counts: Counts::default(),
        }
    }

    /// Takes a datagram and writes the answer, where there is one, to the front of `buf`.
    pub fn on_datagram<'b>(
        &mut self,
        from: SocketAddrV4,
        octets: &[u8],
        at: MonoTime,
        buf: &'b mut [u8; MAX_LEN],
    ) -> Handled<'b> {
        self.advance(at);
        self.counts.received += 1;
        self.packets = self.packets.wrapping_add(1);
        self.last_len = u16::try_from(octets.len()).unwrap_or(u16::MAX);
        let ignored = Handled { reply: None, motion: None };
        if at < self.silent_until {
            self.counts.refused.rebooting += 1;
            return ignored;
        }
        let host_port = self.registers.get(pa::HOST_PORT);
        if host_port != 0 && from.port() != host_port {
            self.counts.refused.source_port += 1;
            return ignored;
        }
        match Message::parse(octets) {
            Ok(message) => self.on_message(&message, at, buf),
            Err(_) => Handled { reply: self.on_malformed(octets, buf), motion: None },
        }
    }

    fn on_message<'b>(
        &mut self,
        message: &Message<'_>,
        at: MonoTime,
        buf: &'b mut [u8; MAX_LEN],
    ) -> Handled<'b> {
        let nothing = Handled { reply: None, motion: None };
        let Some((accept, reply)) = codes(message) else {
            self.counts.refused.malformed += 1;
            return nothing;
        };
        if !accept.matches(self.registers.station()) {
            self.counts.refused.not_addressed += 1;
            return nothing;
        }
        let answers = self.answers(reply);
        let mut motion = None;
        let octets: &[u8] = match message {
            Message::Motion(request) => {
                let answer = self.on_motion(request, at);
                motion = Some(MotionSeen { request: *request, code: answer.code });
                answer.emit(buf)
            }
            Message::Read(read) => self.on_read(read, at, buf),
            Message::Write(write) => self.on_write(write, at).emit(buf),
            Message::ServoRead(read) => self.refuse_servo(Access::Read, read.start, read.num).emit(buf),
            Message::ServoWrite(write) => {
                let num = u16::try_from(write.data.len()).unwrap_or(u16::MAX);
                self.refuse_servo(Access::Write, write.start, num).emit(buf)
            }
            _ => return nothing,
        };
        Handled { reply: answers.then_some(octets), motion }
    }

    /// Whether it answers a request with this reply code, counted as an answer if so.
    fn answers(&mut self, reply: Code) -> bool {
        let answers =
            !self.mute && self.registers.get(pa::ANSWERS) != 0 && reply.matches(self.registers.station());
        self.counts.replied += u64::from(answers);
        answers
    }

    fn on_motion(&mut self, motion: &MotionRequest, at: MonoTime) -> MotionReply {
        let (mut code, mut error) = self.state();
        match code {
            ReplyCode::Running if motion.vibration.is_some() && self.dialect == Dialect::Mbox => {
                self.counts.refused.command += 1;
                code = self.command_error();
            }
            ReplyCode::Running if at < self.homing_until => self.counts.refused.homing += 1,
            ReplyCode::Running => {
                if self.move_to(motion, at) == Err(Overflow) {
                    (code, error) = self.state();
                }
            }
            ReplyCode::EmergencyStop => self.counts.refused.emergency_stop += 1,
            ReplyCode::Fault | ReplyCode::Command => self.counts.refused.fault += 1,
        }
        let running = code == ReplyCode::Running;
        MotionReply {
            timing: motion.timing,
            code,
            channel: if running { motion.channel } else { 0 },
            error: self.error_slot(motion.channel, error),
            frame: motion.frame,
            time_ms: motion.time_ms,
            positions: motion.positions,
            inputs: self.inputs,
            extend: motion.extend,
            vibration: motion.vibration,
        }
    }

    /// Obeys a motion frame.
    fn move_to(&mut self, motion: &MotionRequest, at: MonoTime) -> Result<(), Overflow> {
        let duration = self.duration(motion);
        let to = self.target(&motion.positions);
        let pace = self.registers.pace();
        if let Err(overflow) = self.player.push(to, duration, at, &pace) {
            self.player.hold(at, &pace);
            self.error = ERR_OVERFLOW;
            self.counts.queue_overflows += 1;
            self.counts.refused.fault += 1;
            return Err(overflow);
        }
        self.last_absolute = (motion.timing == Timing::Absolute).then_some(motion.time_ms);
        if self.registers.get(pa::KEEP_OUTPUTS) != 1 {
            self.outputs = motion.outputs & OUTPUTS;
        }
        self.counts.accepted += 1;
        self.counts.motion += 1;
        Ok(())
    }

    /// How long a frame's move takes: its Time, or what absolute time has gone on since the frame before; the fixed
    /// interval where that is none; cut to the longest there may be.
    fn duration(&self, motion: &MotionRequest) -> Duration {
        let interval = u32::from(self.registers.get(pa::INTERVAL));
        let asked = match (motion.timing, self.last_absolute) {
            (Timing::Relative, _) => motion.time_ms,
            (Timing::Absolute, Some(before)) => motion.time_ms.saturating_sub(before),
            (Timing::Absolute, None) => motion.time_ms.min(interval),
        };
        let ms = if asked == 0 { interval } else { asked };
        let longest = match u32::from(self.registers.get(pa::MAX_TIME)) {
            0 => u32::MAX,
            longest => longest,
        };
        Duration::from_millis(u64::from(ms.min(longest).max(1)))
    }

    /// Where the axes go: each takes its own axis of the command, past the axis offset; those that the command does
    /// not reach, and those that do not work, stay.
    fn target(&self, commanded: &[Pulses]) -> Positions {
        let mut to = *self.player.target();
        let offset = usize::from(self.registers.get(pa::OFFSET));
        let window = commanded.get(offset..).unwrap_or_default();
        for (own, position) in to.iter_mut().zip(window).take(self.registers.axes()) {
            *own = self.scaled(*position);
        }
        to
    }

    /// A position at the amplitude of PA55.
    #[expect(clippy::cast_possible_truncation, reason = "at most nine tenths of an i32")]
    fn scaled(&self, position: Pulses) -> Pulses {
        match self.registers.get(pa::AMPLITUDE) {
            tenths @ 1..=9 => Pulses((i64::from(position.0) * i64::from(tenths) / 10) as i32),
            _ => position,
        }
    }

    /// What its answers say of its state, and the error number that goes with it.
    const fn state(&self) -> (ReplyCode, u16) {
        match (self.estop.taken, self.error, self.dialect) {
            (true, _, Dialect::Smc) => (ReplyCode::EmergencyStop, 0),
            (true, _, Dialect::Mbox) => (ReplyCode::Fault, 0),
            (false, 0, _) => (ReplyCode::Running, 0),
            (false, error, _) => (ReplyCode::Fault, error),
        }
    }

    /// Lets time pass: moves go on, an emergency stop comes into effect or ends.
    fn advance(&mut self, at: MonoTime) {
        let pace = self.registers.pace();
        let due = [self.estop.forced, self.estop.inputs].into_iter().flatten().min();
        if let (Some(due), false) = (due.filter(|&due| due <= at), self.estop.taken) {
            self.estop.taken = true;
            self.last_absolute = None;
            if due < self.homing_until {
                self.homing_until = NEVER; // cut short, it is only done by another reset
            }
            match self.registers.get(pa::ESTOP_WAY) {
                1 => self.player.go_to_zero(Duration::ZERO, due, &pace),
                way => {
                    self.player.hold(due, &pace);
                    self.estop.latched = way == 2;
                }
            }
        } else if due.is_none() && !self.estop.latched {
            self.estop.taken = false;
        }
        self.player.advance(at, &pace);
    }

    /// Sets which inputs are active, bit 0 = X01. An emergency stop follows where PA90, PA92 and PA93 say so.
    pub fn set_inputs(&mut self, active: u16, at: MonoTime) {
        self.advance(at);
        self.inputs = active;
        self.watch_inputs(at);
        self.advance(at);
    }

    /// Notes since when the inputs ask for an emergency stop.
    fn watch_inputs(&mut self, at: MonoTime) {
        let mask = self.registers.get(pa::ESTOP_INPUTS);
        let enabled = self.registers.get(pa::INPUT_FUNCTIONS) & 1 == 1 && mask != 0;
        self.estop.inputs = if enabled && self.inputs & mask == mask {
            self.estop.inputs.or(Some(at + self.registers.millis(pa::INPUT_FILTER)))
        } else {
            None
        };
    }

    /// Resets: errors are cleared, then it homes, or goes to zero where PA0E says so.
    fn reset(&mut self, at: MonoTime) {
        self.error = 0;
        self.estop.latched = false;
        self.advance(at);
        self.last_absolute = None;
        let pace = self.registers.pace();
        let goes_to_zero = self.registers.get(pa::RESET_WAY) == 1;
        self.player.go_to_zero(if goes_to_zero { Duration::ZERO } else { HOMING }, at, &pace);
        self.homing_until = if goes_to_zero { self.player.end() } else { at + HOMING };
    }

    /// Starts again, as after a power cycle: silent for PA3D and while it homes.
    fn reboot(&mut self, at: MonoTime) {
        self.registers.restart();
        self.watch_inputs(at);
        self.outputs = self.registers.get(pa::START_OUTPUTS) & OUTPUTS;
        self.reset(at);
        self.silent_until = self.homing_until + self.registers.millis(pa::START_DELAY);
    }

    /// Where the axes that work are.
    pub fn positions(&mut self, at: MonoTime) -> PerAxis<Pulses> {
        self.advance(at);
        let positions = self.player.positions(at);
        PerAxis::new(&positions[..self.registers.axes().min(MAX_AXES)])
    }

    /// The outputs that are on, bit 0 = Y01.
    #[must_use]
    pub const fn outputs(&self) -> u16 {
        self.outputs
    }

    /// What became of the datagrams and moves so far.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        Counts { executed: self.player.executed, fast_forwarded: self.player.fast_forwarded, ..self.counts }
    }
}

/// Who shall obey a request and who shall answer; none for what controllers say, which is nothing to a controller.
const fn codes(message: &Message<'_>) -> Option<(Code, Code)> {
    match message {
        Message::Motion(motion) => Some((motion.accept, motion.reply)),
        Message::Read(read) => Some((read.accept, read.reply)),
        Message::Write(write) => Some((write.accept, write.reply)),
        Message::ServoRead(read) => Some((read.accept, read.reply)),
        Message::ServoWrite(write) => Some((write.accept, write.reply)),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
