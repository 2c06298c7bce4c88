//! One virtual controller: takes datagrams, obeys, answers, and reports unasked.

use std::collections::BTreeMap;
use std::net::SocketAddrV4;

use super::errors::{self, Errors, UdpMemory};
use super::inputs::Inputs;
use super::player::{Executed, Pace, Player};
use super::registers::Registers;
use super::{Action, Commands, Counts, Invented, Setup, pa};
use crate::motion::{MAX_AXES, Pulses};
use crate::time::MonoTime;
use crate::wire::{Code, Dialect, MAX_LEN, Message, MotionRequest, PerAxis, ReplyCode};

mod access;
mod functions;
mod malformed;
mod monitor;
mod motion;
mod report;
mod reset;
mod servo;

use functions::{EmergencyStop, Jog};
use monitor::ReceivedSoFar;

const NEVER: MonoTime = MonoTime::from_nanos(u64::MAX);
/// Outputs that there are.
const OUTPUTS: u16 = 0x0fff;

/// A virtual controller. Told the time; touches neither socket nor clock, and once it is made allocates nothing for
/// motion.
#[derive(Debug)]
pub struct Controller {
    dialect: Dialect,
    invented: Invented,
    mute: bool,
    registers: Registers,
    /// What was written to registers of drives.
    servos: BTreeMap<(u16, u16), u16>,
    player: Player,
    outputs: u16,
    extend: u32,
    inputs: Inputs,
    /// Time of the last motion in absolute time; `None` if the next one is a first one.
    last_absolute: Option<u32>,
    errors: Errors,
    memory: UdpMemory,
    /// Until when too many datagrams are an error.
    memory_full_until: MonoTime,
    homing_until: MonoTime,
    silent_until: MonoTime,
    auto_reset_at: MonoTime,
    report_at: MonoTime,
    estop: EmergencyStop,
    /// Moves that had been executed when an emergency stop was released, as long as what follows is slow.
    released: Option<u64>,
    jog: Option<Jog>,
    /// True if the inputs ask for an emergency reset.
    reset_asked: bool,
    /// When something happens by itself next.
    next_event: MonoTime,
    seen: ReceivedSoFar,
    counts: Counts,
}

/// What a controller did with a datagram.
#[derive(Debug, Clone, Copy)]
pub struct Handled<'b> {
    /// The answer, where it gives one.
    pub reply: Option<&'b [u8]>,
    /// The motion frame, where it was a whole one that was meant for it.
    pub(crate) motion: Option<MotionSeen>,
}

/// A motion frame that reached a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MotionSeen {
    /// The frame.
    pub(crate) request: MotionRequest,
    /// The x that the controller answers it with, whether it may answer or not.
    pub(crate) code: ReplyCode,
}

impl Controller {
    /// A controller at rest in zero, homed, at `address`.
    #[must_use]
    pub fn new(setup: &Setup, address: SocketAddrV4, at: MonoTime) -> Self {
        let registers = Registers::new(setup, address);
        let mut controller = Self {
            dialect: setup.dialect,
            mute: setup.mute,
            outputs: registers.get(pa::START_OUTPUTS) & OUTPUTS,
            extend: 0,
            inputs: Inputs::new(registers.get(pa::INPUT_POLARITY) == 1),
            registers,
            servos: BTreeMap::new(),
            player: Player::new(setup.invented.queue_depth, at),
            last_absolute: None,
            errors: Errors::default(),
            memory: UdpMemory::new(setup.invented.udp_memory),
            memory_full_until: NEVER,
            homing_until: at,
            silent_until: at,
            auto_reset_at: NEVER,
            report_at: NEVER,
            estop: EmergencyStop::new(setup.estop_at.map(|after| at + after)),
            released: None,
            jog: None,
            reset_asked: false,
            next_event: at,
            seen: ReceivedSoFar::default(),
            counts: Counts::default(),
            invented: setup.invented.clone(),
        };
        controller.schedule_reports(at);
        controller
    }

    /// Takes a datagram and writes the answer, where there is one, to the front of `buf`.
    pub fn on_datagram<'b>(
        &mut self,
        from: SocketAddrV4,
        bytes: &[u8],
        at: MonoTime,
        buf: &'b mut [u8; MAX_LEN],
    ) -> Handled<'b> {
        self.advance(at);
        self.counts.received += 1;
        let ignored = Handled { reply: None, motion: None };
        if at < self.silent_until {
            self.counts.refused.rebooting += 1;
            return ignored;
        }
        self.seen.datagram(bytes.len(), at);
        if self.memory.overflows(at) {
            self.memory_full_until = at + UdpMemory::WINDOW;
            self.next_event = self.next_event.min(self.memory_full_until);
            self.fail(errors::UDP_MEMORY, at);
        }
        let host_port = self.registers.get(pa::HOST_PORT);
        if host_port != 0 && from.port() != host_port {
            self.counts.refused.source_port += 1;
            return ignored;
        }
        match Message::parse_as(self.invented.vibration_port, bytes) {
            Ok(message) => self.on_message(&message, at, buf),
            Err(_) => Handled { reply: self.on_malformed(bytes, buf), motion: None },
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
        if self.invented.auto_reset == Commands::Any && self.auto_reset_at != NEVER {
            self.put_off_auto_reset(at);
        }
        let mut motion = None;
        let bytes: &[u8] = match message {
            Message::Motion(request) => {
                let answer = self.on_motion(request, at);
                motion = Some(MotionSeen { request: *request, code: answer.code });
                answer.emit_as(self.invented.vibration_port, buf)
            }
            Message::Read(read) => self.on_read(read, at, buf),
            Message::Write(write) => self.on_write(write, at, buf),
            Message::ServoRead(read) => self.on_servo_read(read, buf),
            Message::ServoWrite(write) => self.on_servo_write(write, buf),
            _ => return nothing,
        };
        let answers = answers && !bytes.is_empty();
        self.counts.replied += u64::from(answers);
        Handled { reply: answers.then_some(bytes), motion }
    }

    /// True if it answers a request with this reply code.
    fn answers(&self, reply: Code) -> bool {
        !self.mute && self.registers.get(pa::ANSWERS) != 0 && reply.matches(self.registers.station())
    }

    /// What its answers to motion say of its state, and the error number that goes with it. MBOX controllers have no x
    /// for an emergency stop.
    fn state(&self) -> (ReplyCode, u16) {
        match (self.estop.in_effect(), self.errors.shown(), self.dialect) {
            (true, error, Dialect::Smc) => (ReplyCode::EmergencyStop, error),
            (true, error, Dialect::Mbox) => (ReplyCode::Fault, error),
            (false, 0, _) => (ReplyCode::Running, 0),
            (false, error, _) => (ReplyCode::Fault, error),
        }
    }

    /// An error comes: all but a full memory stops the play where it is.
    fn fail(&mut self, number: u16, at: MonoTime) {
        if !self.errors.insert(number) {
            return;
        }
        if self.errors.stop_play() {
            let pace = *self.pace();
            self.player.hold(at, &pace);
            self.last_absolute = None;
            self.spoil_homing(at);
        }
        self.report_fault(at);
    }

    /// How moves run now.
    const fn pace(&self) -> &Pace {
        if self.released.is_some() { self.registers.release_pace() } else { self.registers.pace() }
    }

    /// Lets time pass: moves go on, and what happens by itself happens in its order.
    fn advance(&mut self, at: MonoTime) {
        while self.next_event <= at {
            let due = self.next_event;
            self.run_events(due);
            self.next_event = self.soonest_event(due);
        }
        let pace = *self.pace();
        self.player.advance(at, &pace);
        if self.released.is_some_and(|executed| self.player.idle() && self.player.executed > executed) {
            self.released = None;
        }
    }

    fn run_events(&mut self, at: MonoTime) {
        if self.memory_full_until <= at {
            self.memory_full_until = NEVER;
            self.errors.remove(errors::UDP_MEMORY);
        }
        self.run_functions(at);
        if self.auto_reset_at <= at {
            self.auto_reset_at = NEVER;
            self.auto_reset(at);
        }
    }

    /// When something happens by itself next, after what happened at `at`.
    fn soonest_event(&self, at: MonoTime) -> MonoTime {
        let input = self.inputs.next_change(self.registers.millis(pa::INPUT_FILTER)).unwrap_or(NEVER);
        debug_assert!(input > at, "what was due has happened");
        input.min(self.estop.forced_at()).min(self.auto_reset_at).min(self.memory_full_until)
    }

    /// What somebody or something does to it; those of the network mean nothing to it.
    pub fn act(&mut self, action: &Action, at: MonoTime) {
        self.advance(at);
        match *action {
            Action::Switch { input, closed } => {
                let mask = 1_u16.checked_shl(u32::from(input).wrapping_sub(1)).unwrap_or(0);
                let others = self.inputs.closed() & !mask;
                self.switch(if closed { others | mask } else { others }, at);
            }
            Action::Error(0) => self.errors.clear(),
            Action::Error(number) => self.fail(number, at),
            Action::Reboot => self.reboot(at),
            Action::EmergencyStop(on) => {
                self.estop.force(on);
                self.run_functions(at);
            }
            Action::Mute(mute) => self.mute = mute,
            Action::Parameter(pa::RESET, 1) => self.reset(at),
            Action::Parameter(register, value) => self.set(register, value, true, at),
            Action::Loss(_) | Action::Duplicate(_) | Action::Delay(_) => {}
        }
        self.next_event = self.soonest_event(at);
    }

    /// Closes these switches, bit 0 for X01, and opens the others. A closed switch pulls its input low, which is
    /// active with PA04 = 1. What follows, PA90 to PA98 say.
    pub fn set_switches(&mut self, closed: u16, at: MonoTime) {
        self.advance(at);
        self.switch(closed, at);
        self.next_event = self.soonest_event(at);
    }

    /// Where the axes that work are.
    pub(crate) fn positions(&mut self, at: MonoTime) -> PerAxis<Pulses> {
        self.advance(at);
        PerAxis::new(&self.player.positions(at)[..self.axes()])
    }

    /// Where the axes that work are, with what shakes them.
    pub(crate) fn shaken_positions(&mut self, at: MonoTime) -> PerAxis<Pulses> {
        self.advance(at);
        PerAxis::new(&self.player.shaken(at)[..self.axes()])
    }

    /// How many axes work.
    pub(super) fn axes(&self) -> usize {
        self.registers.axes().min(MAX_AXES)
    }

    /// Keeps a record of the moves that end from now on; what is kept grows until it is taken.
    pub(super) fn keep_record(&mut self) {
        self.player.keep_record();
    }

    /// Ends the move that still runs at the end of it all, so that the record has that, too.
    pub(super) fn close_record(&mut self, at: MonoTime) {
        self.advance(at);
        self.player.halt(at);
    }

    /// The moves that ended since they were last asked for.
    pub(super) fn take_record(&mut self) -> impl Iterator<Item = Executed> {
        self.player.take_record()
    }

    /// The outputs that are on, bit 0 = Y01.
    #[must_use]
    pub(crate) const fn outputs(&self) -> u16 {
        self.outputs
    }

    /// Its analogue outputs, as Extend has them.
    #[must_use]
    pub(crate) const fn extend(&self) -> u32 {
        self.extend
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
