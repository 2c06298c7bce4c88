//! What numbers of the protocol are called.

use crate::wire::{Code, Dialect, ReplyCode, Space, Timing};

/// A motion message.
pub(super) const fn motion_name(timing: Timing, vibrating: bool) -> &'static str {
    match (timing, vibrating) {
        (Timing::Absolute, false) => "motion, absolute time",
        (Timing::Relative, false) => "motion, relative time",
        (Timing::Absolute, true) => "motion with vibration, absolute time",
        (Timing::Relative, true) => "motion with vibration, relative time",
    }
}

/// What a reply says of the request.
pub(super) const fn answer_name(code: ReplyCode, dialect: Dialect) -> &'static str {
    match (code, dialect) {
        (ReplyCode::Running, _) => "received, running normally",
        (ReplyCode::Fault, Dialect::Smc) => "running with an error",
        (ReplyCode::Fault, Dialect::Mbox) => "refused: buffer full or wrong",
        (ReplyCode::EmergencyStop, Dialect::Smc) => "emergency stop in effect",
        (ReplyCode::EmergencyStop, Dialect::Mbox) => "refused: the frame was too short",
        (ReplyCode::Command, _) => "command error, or the controller is abnormal",
    }
}

/// A table of registers.
pub(super) const fn space_name(space: Option<Space>) -> &'static str {
    match space {
        Some(Space::Monitor) => "DP, monitor registers",
        Some(Space::Parameter) => "PA, parameters",
        Some(Space::Control) => "DPF, control registers",
        None => "not in the manual",
    }
}

/// A register, as the manuals spell it.
pub(super) fn register_name(space: Option<Space>, number: u32) -> String {
    match space {
        Some(Space::Monitor) => format!("DP{number:02X}"),
        Some(Space::Parameter) => format!("PA{number:02X}"),
        Some(Space::Control) => format!("DPF{number:X}"),
        None => number.to_string(),
    }
}

/// A code, and whom it means.
pub(super) fn station(code: Code) -> String {
    let [column, row] = code.0.to_be_bytes();
    let meaning = match (column, row) {
        (0xff, 0xff) => "every station".to_owned(),
        (0, 0) => "nobody".to_owned(),
        (column, 0xff) => format!("the stations x.x.{column}.*"),
        (0xff, row) => format!("the stations x.x.*.{row}"),
        (column, row) => format!("the station x.x.{column}.{row}"),
    };
    format!("{code}: {meaning}")
}
