//! Reports as they come from the sockets.

use std::net::SocketAddrV4;

use super::Observer;
use crate::time::MonoTime;
use crate::wire::{Access, DP_INPUTS, RegisterReply, Report, Status};

impl Observer {
    /// Hears a report that a controller sent unasked (0x3101, 0x1001); says whether it was one. What a register tells of the
    /// inputs is heard too, whoever asked for it: where no frames go, nothing else may tell that an emergency stop is over.
    pub fn hear(&mut self, controller: usize, bytes: &[u8], at: MonoTime) -> bool {
        if let Ok(status) = Status::parse(bytes) {
            return self.on_status(controller, &status, at);
        }
        if let Ok(reply) = RegisterReply::parse(bytes) {
            self.on_register(controller, &reply, at);
            return false;
        }
        let report = Report::parse(bytes);
        report.is_ok_and(|report| {
            self.on_report(controller, &report, at);
            true
        })
    }

    fn on_register(&mut self, controller: usize, reply: &RegisterReply<'_>, at: MonoTime) {
        let dialect = self.watched[controller].dialect;
        let of_inputs = (reply.access, reply.channel, reply.start) == (Access::Read, 0, DP_INPUTS);
        if let Some(inputs) = reply.values(dialect).get(0).filter(|_| of_inputs) {
            self.note_inputs(controller, inputs, at);
        }
    }

    /// Hears a report that came from a port that is no controller's frame port; says whether it was one.
    pub fn hear_elsewhere(&mut self, from: SocketAddrV4, bytes: &[u8], at: MonoTime) -> bool {
        let station = Status::parse(bytes).ok().map(|status| status.station);
        let controller = self.sender_of_report(*from.ip(), station);
        controller.is_some_and(|controller| self.hear(controller, bytes, at))
    }
}
