//! Answers to requests that are broken, but say enough to be answered.

use super::Controller;
use crate::wire::{Dialect, Header, MAX_LEN, MotionReply, RegisterReply, ReplyCode};

impl Controller {
    /// Refuses bytes that are no message; answers where it can tell what they answer to and who shall answer.
    pub(super) fn on_malformed<'b>(&mut self, bytes: &[u8], buf: &'b mut [u8; MAX_LEN]) -> Option<&'b [u8]> {
        let Ok(header) = Header::parse(bytes) else {
            self.counts.refused.malformed += 1;
            return None;
        };
        let slot = self.error_slot(header.slot, 0);
        // An MBOX says x = 4 to frames that are too short.
        let code = if self.dialect == Dialect::Mbox { ReplyCode::EmergencyStop } else { ReplyCode::Command };
        let motion = MotionReply::to_broken(bytes, code, slot);
        let access = RegisterReply::to_broken(bytes, self.command_error(), slot);
        if motion.is_none() && access.is_none() {
            self.counts.refused.malformed += 1;
            return None;
        }
        if !header.accept.matches(self.registers.station()) {
            self.counts.refused.not_addressed += 1;
            return None;
        }
        self.counts.refused.command += 1;
        if !self.answers(header.reply) {
            return None;
        }
        self.counts.replied += 1;
        match (motion, access) {
            (Some(answer), _) => Some(answer.emit_as(self.invented.vibration_port, buf)),
            (None, Some(answer)) => Some(answer.emit(buf)),
            (None, None) => None,
        }
    }
}
