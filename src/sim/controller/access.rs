//! Reading and writing registers of a virtual controller.

use super::monitor::dp;
use super::{Controller, NEVER, OUTPUTS};
use crate::device::Address;
use crate::sim::pa;
use crate::sim::registers::{TABLE, has, takes};
use crate::time::MonoTime;
use crate::wire::{
    Access, Dialect, MAX_LEN, ReadRequest, RegisterReply, ReplyCode, Space, Words, WriteRequest,
};

/// The object channel by which an MBOX controller keeps what is written over a power cycle.
const KEEPING_CHANNEL: u16 = 1;

/// Why registers were not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Refusal {
    /// A register or a value that there is not.
    Command,
    /// A reset during an emergency stop that is still asked for.
    EmergencyStop,
}

impl Controller {
    /// Writes the answer to the front of `buf` and returns it.
    pub(super) fn on_read<'b>(
        &mut self,
        read: &ReadRequest,
        at: MonoTime,
        buf: &'b mut [u8; MAX_LEN],
    ) -> &'b [u8] {
        let table = match Space::of_read(read.channel) {
            Some(Space::Monitor) => Some(self.monitored(at)),
            Some(Space::Parameter) => Some(self.parameters(at)),
            _ => None,
        };
        let first = usize::from(read.start);
        let range = first..first + usize::from(read.num);
        let words = table.as_ref().and_then(|table| table.get(range)).filter(|_| self.readable(read));
        let (code, error) = if words.is_some() {
            self.counts.accepted += 1;
            self.access_state()
        } else {
            self.counts.refused.command += 1;
            (self.command_error(), 0)
        };
        let reply = RegisterReply {
            access: Access::Read,
            code,
            channel: read.channel,
            error,
            start: read.start,
            num: read.num,
            data: Words::from(words.unwrap_or_default()),
        };
        self.emit(reply, buf)
    }

    /// True if all registers of a read are there; whether unused ones are, the manuals leave open.
    fn readable(&self, read: &ReadRequest) -> bool {
        let of = if read.channel == 0 { Address::Dp } else { Address::Pa };
        let mut numbers = read.start..read.start.saturating_add(read.num);
        self.invented.unused_read
            || numbers.all(|number| u8::try_from(number).is_ok_and(|number| has(of(number), self.dialect)))
    }

    /// All parameters as they read.
    fn parameters(&self, at: MonoTime) -> [u16; TABLE] {
        let mut table = *self.registers.all();
        table[usize::from(pa::RESET)] = u16::from(at < self.homing_until);
        table
    }

    /// Writes the answer to the front of `buf` and returns it.
    pub(super) fn on_write<'b>(
        &mut self,
        write: &WriteRequest<'_>,
        at: MonoTime,
        buf: &'b mut [u8; MAX_LEN],
    ) -> &'b [u8] {
        let space = Space::of_write(write.channel, self.dialect);
        let written = space.ok_or(Refusal::Command).and_then(|space| self.write(space, write, at));
        self.next_event = self.soonest_event(at);
        let (code, error) = match written {
            Ok(()) => {
                self.counts.accepted += 1;
                self.access_state()
            }
            Err(Refusal::EmergencyStop) => {
                self.counts.refused.emergency_stop += 1;
                self.state()
            }
            Err(Refusal::Command) => {
                self.counts.refused.command += 1;
                (self.command_error(), 0)
            }
        };
        let reply = RegisterReply {
            access: Access::Write,
            code,
            channel: write.channel,
            error,
            start: write.start,
            num: u16::try_from(write.data.len()).unwrap_or(u16::MAX),
            data: write.data,
        };
        self.emit(reply, buf)
    }

    /// Writes an answer as the dialect has it: SMC puts the error number of a refusal into slot 6 (2.2.2.2, 2.2.2.4),
    /// IMAX and MBOX keep the channel there and put the error where the data stood.
    fn emit<'b>(&self, reply: RegisterReply<'_>, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        if self.dialect == Dialect::Smc || reply.code == ReplyCode::Running {
            return reply.emit(buf);
        }
        let error = [reply.error];
        RegisterReply { error: reply.channel, data: Words::from(&error[..]), ..reply }.emit(buf)
    }

    /// What answers about registers say of its state. On MBOX they tell only of the request.
    pub(super) fn access_state(&self) -> (ReplyCode, u16) {
        match self.dialect {
            Dialect::Smc => self.state(),
            Dialect::Mbox => (ReplyCode::Running, 0),
        }
    }

    /// The x for commands that name what there is not; MBOX has none of its own.
    pub(super) const fn command_error(&self) -> ReplyCode {
        match self.dialect {
            Dialect::Smc => ReplyCode::Command,
            Dialect::Mbox => ReplyCode::Fault,
        }
    }

    /// What stands in slot 6 of a refusal of motion.
    pub(super) const fn error_slot(&self, channel: u16, error: u16) -> u16 {
        match self.dialect {
            Dialect::Smc => error,
            Dialect::Mbox => channel,
        }
    }

    /// Writes all words or none.
    fn write(&mut self, space: Space, write: &WriteRequest<'_>, at: MonoTime) -> Result<(), Refusal> {
        let base = if space == Space::Control { dp::CONTROL } else { 0 };
        let of = if space == Space::Parameter { Address::Pa } else { Address::Dp };
        let words = || (base + usize::from(write.start)..).zip(write.data.iter());
        let there = |(register, word): (usize, u16)| {
            u8::try_from(register).is_ok_and(|register| takes(of(register), word, self.dialect))
        };
        if !words().all(there) {
            return Err(Refusal::Command);
        }
        let resets = |(register, word): (usize, u16)| match space {
            Space::Parameter => register == usize::from(pa::RESET) && word == 1,
            Space::Monitor | Space::Control => register == dp::RESET && word == 0,
        };
        // A reset ends no emergency stop that is still asked for.
        if self.estop.asked() && words().any(resets) {
            return Err(Refusal::EmergencyStop);
        }
        let keep = write.channel == KEEPING_CHANNEL && self.dialect == Dialect::Mbox;
        for (register, word) in words() {
            match (space, u8::try_from(register)) {
                (Space::Parameter, _) if resets((register, word)) => self.reset(at),
                _ if resets((register, word)) => self.reset_by_dpf0(at),
                (Space::Parameter, Ok(register)) => self.set(register, word, keep, at),
                _ => self.control(register, word, at),
            }
        }
        Ok(())
    }

    /// Sets a parameter, and lets what hangs on it follow.
    pub(super) fn set(&mut self, register: u8, value: u16, keep: bool, at: MonoTime) {
        self.registers.set(register, value, keep);
        match register {
            pa::MANUAL_OUTPUTS => self.outputs = value & OUTPUTS,
            pa::AUTO_RESET if value == 0 => self.auto_reset_at = NEVER,
            pa::REPORT_INTERVAL | pa::REPORTS | pa::KEEP => self.schedule_reports(at),
            _ => {}
        }
        self.inputs.polarity(self.registers.get(pa::INPUT_POLARITY) == 1, at);
        self.run_functions(at);
    }

    /// Writes a monitor register. All but these are the controller's own: it overwrites them at once.
    fn control(&mut self, register: usize, word: u16, at: MonoTime) {
        match (register, word) {
            (dp::OUTPUTS, _) => self.outputs = word & OUTPUTS,
            (dp::REBOOT, 1) => self.reboot(at),
            _ => {}
        }
    }
}
