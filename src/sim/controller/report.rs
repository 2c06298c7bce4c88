//! What a virtual controller says unasked: 0x3101 of SMC (2.2.2.15 and 5.11), 0x1001 of IMAX (2.2.2.1).

use std::net::SocketAddrV4;
use std::time::Duration;

use super::monitor::dp;
use super::{Controller, NEVER};
use crate::sim::pa;
use crate::time::MonoTime;
use crate::wire::{Code, Dialect, MAX_LEN, PerAxis, RegisterReport, Status, Words};

impl Controller {
    /// When it says something unasked next; `None` where it does not.
    #[must_use]
    pub(crate) fn report_due(&self) -> Option<MonoTime> {
        (self.report_at != NEVER).then_some(self.report_at)
    }

    /// What it says unasked, where that is due, written to the front of `buf`; and to whom.
    pub fn report<'b>(
        &mut self,
        at: MonoTime,
        buf: &'b mut [u8; MAX_LEN],
    ) -> Option<(SocketAddrV4, &'b [u8])> {
        self.advance(at);
        if self.report_at > at {
            return None;
        }
        let in_time = self.report_at + self.report_interval() > at;
        self.schedule_reports(if in_time { self.report_at } else { at });
        let to = self.registers.socket(match self.registers.get(pa::REPORTS) {
            2 => pa::SECOND_HOST,
            _ => pa::HOST,
        });
        let to = to.filter(|_| !self.mute)?;
        self.counts.reported += 1;
        Some((to, self.emit_report(at, buf)))
    }

    fn emit_report<'b>(&self, at: MonoTime, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        if self.dialect == Dialect::Mbox {
            let data = [self.servo_alarm_kind()];
            let start = u16::try_from(dp::MINOR_VERSION).expect("a register of the table");
            let data = Words::from(&data[..]);
            let report = RegisterReport { channel: 0, accept: Code::NONE, reply: Code::NONE, start, data };
            return report.emit(buf);
        }
        let axes = self.registers.axes();
        let positions = self.player.positions(at);
        let alarm = |axis| if self.errors.alarm(axis) { self.invented.servo_alarm } else { 0 };
        let status = Status {
            station: self.registers.station(),
            positions: PerAxis::from_fn(axes, |axis| positions[axis]),
            forces: PerAxis::from_fn(axes, |axis| self.torque(axis)),
            servo_errors: PerAxis::from_fn(axes, alarm),
            error: self.errors.shown(),
            outputs: self.outputs,
            inputs: self.inputs.active(),
        };
        status.emit(buf)
    }

    /// An error came: it is reported once, where reports do not come all the time.
    pub(super) fn report_fault(&mut self, at: MonoTime) {
        let reports = match self.dialect {
            Dialect::Smc => self.registers.get(pa::REPORTS) != 0 && self.report_interval().is_zero(),
            Dialect::Mbox => true,
        };
        if reports {
            self.report_at = at.max(self.silent_until);
        }
    }

    /// Sets when the next report comes, one interval after `from`.
    pub(super) fn schedule_reports(&mut self, from: MonoTime) {
        let interval = self.report_interval();
        let regular =
            self.dialect == Dialect::Smc && self.registers.get(pa::REPORTS) != 0 && !interval.is_zero();
        self.report_at = if regular { from + interval } else { NEVER };
    }

    fn report_interval(&self) -> Duration {
        self.registers.millis(pa::REPORT_INTERVAL)
    }
}
