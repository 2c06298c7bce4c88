//! Registers of the drives behind a virtual controller (SMC manual 2.2.2.13 and 2.2.2.14). They hold what is written to
//! them, and 0 before.

use super::Controller;
use crate::wire::{
    Access, Dialect, MAX_LEN, MAX_SERVO_READ, ReplyCode, ServoRead, ServoReply, ServoWrite, Words,
};

impl Controller {
    /// Writes the answer to the front of `buf` and returns it; nothing on MBOX, which has no such message.
    pub(super) fn on_servo_read<'b>(&mut self, read: &ServoRead, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let verdict = self.servo_verdict(read.channel, read.start, read.num);
        let mut words = [0; MAX_SERVO_READ as usize];
        let mut there = 0;
        if verdict.is_ok() {
            for (word, register) in words.iter_mut().zip(read.start..read.start + read.num) {
                *word = self.servos.get(&(read.channel, register)).copied().unwrap_or(0);
                there += 1;
            }
        }
        let data = Words::from(&words[..there]);
        self.emit_servo(verdict, Access::Read, (read.channel, read.start, read.num), data, buf)
    }

    /// Writes the answer to the front of `buf` and returns it; nothing on MBOX.
    pub(super) fn on_servo_write<'b>(
        &mut self,
        write: &ServoWrite<'_>,
        buf: &'b mut [u8; MAX_LEN],
    ) -> &'b [u8] {
        let num = u16::try_from(write.data.len()).unwrap_or(u16::MAX);
        let verdict = self.servo_verdict(write.channel, write.start, num);
        if verdict.is_ok() {
            self.servos
                .extend((write.start..).map(|register| (write.channel, register)).zip(write.data.iter()));
        }
        self.emit_servo(verdict, Access::Write, (write.channel, write.start, num), write.data, buf)
    }

    /// True if a drive is there, can be spoken to and has these registers; else x and the error of the refusal.
    fn servo_verdict(&self, servo: u16, start: u16, num: u16) -> Result<(), (ReplyCode, u16)> {
        let axis = usize::from(servo).wrapping_sub(1);
        let registers = u32::from(start) + u32::from(num) <= u32::from(self.invented.servo_registers);
        if axis >= self.registers.axes() || !(1..=MAX_SERVO_READ).contains(&num) || !registers {
            return Err((self.command_error(), 0));
        }
        // Errors 1 to 6 are those of the connections to drives 1 to 6.
        if self.errors.unreachable(axis) { Err((ReplyCode::Fault, servo)) } else { Ok(()) }
    }

    fn emit_servo<'b>(
        &mut self,
        verdict: Result<(), (ReplyCode, u16)>,
        access: Access,
        (servo, start, num): (u16, u16, u16),
        data: Words<'_>,
        buf: &'b mut [u8; MAX_LEN],
    ) -> &'b [u8] {
        if self.dialect == Dialect::Mbox {
            self.counts.refused.command += 1;
            return &buf[..0];
        }
        let (code, error) = match verdict {
            Ok(()) => {
                self.counts.accepted += 1;
                self.access_state()
            }
            Err((code, error)) => {
                let refused = &mut self.counts.refused;
                *(if code == ReplyCode::Fault { &mut refused.fault } else { &mut refused.command }) += 1;
                (code, error)
            }
        };
        let data = if verdict.is_ok() { data } else { Words::EMPTY };
        ServoReply { access, code, servo, error, start, num, data }.emit(buf)
    }
}
