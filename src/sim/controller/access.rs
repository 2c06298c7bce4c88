//! Reading and writing registers of a virtual controller.

use super::{Controller, OUTPUTS};
use crate::motion::MAX_AXES;
use crate::sim::registers::{TABLE, pa};
use crate::time::MonoTime;
use crate::wire::{
    Access, DP_POSITIONS, Dialect, MAX_LEN, ReadRequest, RegisterReply, ReplyCode, ServoReply, Space, Words,
    WriteRequest, position_words,
};

/// Monitor registers (SMC manual 2.3.3).
mod dp {
    pub(super) const PACKET_LEN: usize = 0x33;
    pub(super) const PACKETS: usize = 0x34;
    pub(super) const QUEUE_WRITE: usize = 0x48;
    pub(super) const QUEUE_READ: usize = 0x49;
    pub(super) const REMAINING: usize = 0x50; // of axes 1 to 6, ms
    pub(super) const INPUTS: usize = 0x5e;
    pub(super) const ACTIVE_OUTPUTS: usize = 0x66;
    pub(super) const CONTROL: usize = 0xf0; // DPF0
    pub(super) const RESET: usize = 0xf0;
    pub(super) const OUTPUTS: usize = 0xf1;
    pub(super) const REBOOT: usize = 0xf2;
    pub(super) const AXES: usize = 0xf5;
    pub(super) const VERSION: usize = 0xff;
}

/// What DPF0 reads while a reset runs, and when it is done.
const RESETTING: u16 = 1;
const RESET_DONE: u16 = 2;
const VERSION: u16 = 1;

impl Controller {
    /// Writes the answer to the front of `buf` and returns it.
    pub(super) fn on_read<'b>(
        &mut self,
        read: &ReadRequest,
        at: MonoTime,
        buf: &'b mut [u8; MAX_LEN],
    ) -> &'b [u8] {
        let first = usize::from(read.start);
        let range = first..first + usize::from(read.num);
        let monitored;
        let table = match Space::of_read(read.channel) {
            Some(Space::Monitor) => {
                monitored = self.monitored(at);
                Some(&monitored)
            }
            Some(Space::Parameter) => Some(self.registers.all()),
            _ => None,
        };
        let (mut code, mut error) = self.state();
        let words = match table.and_then(|table| table.get(range)) {
            Some(words) => {
                self.counts.accepted += 1;
                words
            }
            None => {
                self.counts.refused.command += 1;
                (code, error) = (self.command_error(), 0);
                &[]
            }
        };
        let answer = RegisterReply {
            access: Access::Read,
            code,
            channel: read.channel,
            error: self.error_slot(read.channel, error),
            start: read.start,
            num: read.num,
            data: Words::from(words),
        };
        answer.emit(buf)
    }

    pub(super) fn on_write<'a>(&mut self, write: &WriteRequest<'a>, at: MonoTime) -> RegisterReply<'a> {
        let space = Space::of_write(write.channel, self.dialect);
        let (code, error) = match space.and_then(|space| self.write(space, write, at)) {
            Some(true) => {
                self.counts.accepted += 1;
                self.state()
            }
            Some(false) => {
                self.counts.refused.emergency_stop += 1;
                self.state()
            }
            None => {
                self.counts.refused.command += 1;
                (self.command_error(), 0)
            }
        };
        RegisterReply {
            access: Access::Write,
            code,
            channel: write.channel,
            error: self.error_slot(write.channel, error),
            start: write.start,
            num: u16::try_from(write.data.len()).unwrap_or(u16::MAX),
            data: write.data,
        }
    }

    /// A controller without drives to ask.
    pub(super) const fn refuse_servo(&mut self, access: Access, start: u16, num: u16) -> ServoReply<'static> {
        self.counts.refused.command += 1;
        ServoReply { access, code: self.command_error(), servo: 0, error: 0, start, num, data: Words::EMPTY }
    }

    /// The x for commands that name what there is not; MBOX has none of its own.
    pub(super) const fn command_error(&self) -> ReplyCode {
        match self.dialect {
            Dialect::Smc => ReplyCode::Command,
            Dialect::Mbox => ReplyCode::Fault,
        }
    }

    /// What stands in slot 6 of a refusal.
    pub(super) const fn error_slot(&self, channel: u16, error: u16) -> u16 {
        match self.dialect {
            Dialect::Smc => error,
            Dialect::Mbox => channel,
        }
    }

    /// Writes all words or none: `None` where a register or value does not exist, `Some(false)` where an emergency
    /// stop forbids it.
    fn write(&mut self, space: Space, write: &WriteRequest<'_>, at: MonoTime) -> Option<bool> {
        let first = usize::from(write.start) + if space == Space::Control { dp::CONTROL } else { 0 };
        let words = || (first..).zip(write.data.iter());
        let parameters = space == Space::Parameter;
        let bad_axes = |word: u16| word == 0 || usize::from(word) > MAX_AXES;
        if words().any(|(register, word)| {
            register >= TABLE || parameters && register == usize::from(pa::AXES) && bad_axes(word)
        }) {
            return None;
        }
        let resets = |register: usize, word: u16| {
            if parameters {
                register == usize::from(pa::RESET) && word == 1
            } else {
                register == dp::RESET && word == 0
            }
        };
        if self.estop_asked(at) && words().any(|(register, word)| resets(register, word)) {
            return Some(false);
        }
        for (register, word) in words() {
            if resets(register, word) {
                self.reset(at);
            } else if parameters {
                self.registers.set(u8::try_from(register).expect("checked above"), word);
            } else if register == dp::OUTPUTS {
                self.outputs = word & OUTPUTS;
            } else if register == dp::REBOOT && word == 1 {
                self.reboot(at);
            } // The other monitor registers are the controller's own.
        }
        self.watch_inputs(at);
        Some(true)
    }

    /// Whether an emergency stop is asked for right now, so that no reset can end it.
    fn estop_asked(&self, at: MonoTime) -> bool {
        [self.estop.forced, self.estop.inputs].into_iter().flatten().any(|since| since <= at)
    }

    /// All monitor registers as they stand.
    fn monitored(&self, at: MonoTime) -> [u16; TABLE] {
        let mut table = [0; TABLE];
        let positions = self.player.positions(at);
        let remaining_ms = u16::try_from(self.player.end().since(at).as_millis()).unwrap_or(u16::MAX);
        for (axis, register) in DP_POSITIONS.into_iter().enumerate().take(self.registers.axes()) {
            let [first, second] = position_words(positions[axis], self.dialect);
            table[usize::from(register)] = first;
            table[usize::from(register) + 1] = second;
            table[dp::REMAINING + axis] = remaining_ms;
        }
        table[dp::PACKET_LEN] = self.last_len;
        table[dp::PACKETS] = self.packets;
        [table[dp::QUEUE_WRITE], table[dp::QUEUE_READ]] = self.player.pointers();
        table[dp::INPUTS] = self.inputs;
        table[dp::ACTIVE_OUTPUTS] = self.outputs;
        table[dp::RESET] = if at < self.homing_until { RESETTING } else { RESET_DONE };
        table[dp::OUTPUTS] = self.outputs;
        table[dp::AXES] = self.registers.get(pa::AXES);
        table[dp::VERSION] = VERSION;
        table
    }
}
