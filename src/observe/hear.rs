//! Reports as they come from the sockets.

use std::net::SocketAddrV4;

use super::Observer;
use crate::time::MonoTime;
use crate::wire::{Access, DP_INPUTS, FromController, RegisterReply, VibrationPort};

impl Observer {
    /// Hears a report that a controller sent unasked (0x3101, 0x1001); says whether it was one. What a register tells of the
    /// inputs is heard too, whoever asked for it: where no frames go, nothing else may tell that an emergency stop is over.
    pub(crate) fn hear(&mut self, controller: usize, message: &FromController<'_>, at: MonoTime) -> bool {
        match message {
            FromController::Status(status) => self.on_status(controller, status, at),
            FromController::Report(report) => {
                self.on_report(controller, report, at);
                true
            }
            FromController::Registers(reply) => {
                self.on_register(controller, reply, at);
                false
            }
            FromController::Reply(_) | FromController::PrintedImax | FromController::Other => false,
        }
    }

    fn on_register(&mut self, controller: usize, reply: &RegisterReply<'_>, at: MonoTime) {
        let dialect = self.watched[controller].dialect;
        let of_inputs = (reply.access, reply.channel, reply.start) == (Access::Read, 0, DP_INPUTS);
        if let Some(inputs) = reply.values(dialect).get(0).filter(|_| of_inputs) {
            self.note_inputs(controller, inputs, at);
        }
    }

    /// Hears a report that came from a port that is no controller's frame port; says whether it was one.
    pub(crate) fn hear_elsewhere(&mut self, from: SocketAddrV4, bytes: &[u8], at: MonoTime) -> bool {
        // No report has a port of outputs that may be of two widths.
        let message = FromController::parse(VibrationPort::Two, bytes);
        let station = if let FromController::Status(status) = message { Some(status.station) } else { None };
        let controller = self.sender_of_report(*from.ip(), station);
        controller.is_some_and(|controller| self.hear(controller, &message, at))
    }
}
