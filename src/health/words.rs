//! Every word about the standing of groups, once.

use std::fmt;

use super::{Change, HealthState, Why};
use crate::plain;
use crate::wire::DPFE;
use crate::wire::silvermax::conditions;

/// In place of the words of what is worded with its figures.
const ITSELF: &str = "it reports this itself";
/// What has to be said, loudly, where acks are off.
pub(crate) const ACKS_OFF: &str = "acks are off: a controller that is lost, refuses frames or has an emergency stop is noticed by \
                            its own reports at best";

plain::displayed!(HealthState {
    Self::Ok => "ok",
    Self::Degraded => "degraded",
    Self::Lost => "lost",
    Self::Rejoining => "rejoining",
    Self::Stopped => "stopped",
    Self::Error => "error",
    Self::Excluded => "excluded",
    Self::Unwatched => "unwatched",
});

impl HealthState {
    /// What a person does about it.
    #[must_use]
    pub(crate) const fn next(self) -> &'static str {
        match self {
            Self::Ok => "nothing",
            Self::Rejoining => "park, or start a show: it joins slowly",
            Self::Degraded => "check the network",
            Self::Lost => {
                "check its power and its cable, network or serial line; it rejoins by itself unless it rebooted"
            }
            Self::Stopped => "release its emergency-stop button, then clear",
            Self::Error => {
                "clear the error at the controller; then, with the seats parked or stopped, clear the hall"
            }
            Self::Excluded => "home it with nobody on the seat, while the hall is parked or recovering",
            Self::Unwatched => "watch the seat",
        }
    }
}

impl Why {
    /// What a person does about it before all else; `None` if the standing says enough.
    #[must_use]
    pub(crate) const fn next(self) -> Option<&'static str> {
        match self {
            Self::Moved(_) => {
                Some("find out what moved it; then park, or start a show: it joins slowly from where it is")
            }
            Self::Outside { .. } => Some(
                "correct its word order or PA02, turn a turntable back by hand that was turned too far, or home it with nobody on the \
                 seat (`kinocue home --config`, with the service stopped); it rejoins by itself once it is inside",
            ),
            Self::Pushed { .. } => Some(
                "free it, or find out why its motor does not hold it; it rejoins by itself once it stands where it is held",
            ),
            Self::Ambiguous(_) => {
                Some("home it with nobody on the seat (`kinocue home --config`, with the service stopped)")
            }
            Self::OtherMaster(_) => {
                Some("stop the other machine; then clear, and home it with nobody on the seat")
            }
            Self::Wide(_) => Some(
                "this IMAX answers as its manual says, which no other known one does: disable it, and send a capture \
                 (`kinocue decode --dialect imax`) to the maintainers of this program",
            ),
            Self::Refuses(_) => Some(
                "clear the error at the controller; or correct its dialect (smc, mbox): a controller refuses frames of the other; \
                 then, with the seats parked or stopped, clear the hall",
            ),
            Self::Unsteady(_) => Some(
                "mend what keeps frames, acks or the seat; then, with the seats parked or stopped, clear the hall",
            ),
            Self::Killed { .. } => {
                Some("find out what blocks or heats it; then home it with nobody on the seat")
            }
            Self::CutShort(_) => Some("wait until its position has been read"),
            Self::OtherAxes { .. } => Some(
                "set PA02 to the axes of the seat, or give the seat a type with as many; with the seats parked or stopped, clear",
            ),
            _ => None,
        }
    }
}

impl fmt::Display for Why {
    /// The reason, without the name of the controller.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outside { axis, pulses, .. } => write!(
                f,
                "its axis {} reports {} pulses, outside its stroke (frames hold an axis that its seat type does not have at 0): \
                 wrong word order (dialect), other axes (PA02), or not home",
                axis + 1,
                pulses.0
            ),
            Self::Pushed { pushed, .. } => {
                let ([at, held], axis) = (pushed.places(), pushed.axis + 1);
                write!(
                    f,
                    "its axis {axis} stands at {at} mm, and its drive holds it at {held} mm: something pushes it, or its load is \
                     too much for the motor"
                )
            }
            Self::Error { error, .. } => write!(f, "{}", crate::wire::DeviceError(*error)),
            Self::Drive { axis, error, .. } => write!(f, "drive of axis {axis}: error {error}"),
            Self::Killed { axis, cause, .. } => {
                write!(f, "the drive of its axis {axis} was killed by {} (register 211)", conditions(*cause))
            }
            Self::Alarm { register: DPFE, value, .. } => {
                write!(f, "alarm of the servo drives, kind {value} (DPFE)")
            }
            Self::Alarm { register, value, .. } => {
                write!(f, "it reports a fault (0x1001): DP{register:02x} is {value}")
            }
            Self::OtherAxes { drives, .. } => write!(
                f,
                "it works with {drives} axes (PA02), its seat type with others: those that it has beyond would be moved to 0, those \
                 that it lacks would not move"
            ),
            _ => f.write_str(self.row().1),
        }
    }
}

impl Why {
    /// Its stable code, and the reason where no figure belongs to it.
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::Acked => ("acked", "it answers"),
            Self::AcksOff => ("acks-off", "acks are off"),
            Self::AcksMissing(_) => ("acks-missing", "acks are missing or late"),
            Self::Silent(_) => ("silent", "no ack and no report for too long"),
            Self::NotSeenYet => ("not-seen-yet", "no answer yet"),
            Self::SeenAgain => ("seen-again", "back as it was"),
            Self::Moved(_) => ("moved", "it was moved while no frame was sent to it from here"),
            Self::Unsure(_) => (
                "unsure",
                "frames to it, or its acks, were missing for over 50 ms: its position has to be read",
            ),
            Self::CutShort(_) => ("cut-short", "its drives were stopped: its position is being read"),
            Self::Astray(_) => (
                "astray",
                "it acks frames but is not where they took it: it homes by itself or is jogged (PA96 to PA98), or its \
                 filters delay it too much",
            ),
            Self::Unsteady(_) => (
                "unsteady",
                "three times within a minute frames to it or its acks were missing for over 50 ms, or it was not where \
                 they took it: check the network, and whether it is jogged",
            ),
            Self::Ambiguous(_) => (
                "ambiguous",
                "its positions are inside the stroke in both word orders, and nothing tells which is true: home it",
            ),
            Self::Unread(_) => (
                "unread",
                "not all of its axes report their positions: those past the sixth have no register",
            ),
            Self::EmergencyStop(_) => ("emergency-stop", "emergency stop"),
            Self::HeldUntilReset(_) => {
                ("held-until-reset", "its emergency stop was released, and holds until a reset (PA91 = 2)")
            }
            Self::Refuses(_) => ("refuses", "it refuses frames"),
            Self::Wide(_) => {
                ("wide", "it answers with registers of 32 bits, but only those of 16 can be read")
            }
            Self::Rebooted(_) => ("rebooted", "it has rebooted: its packet counter (DP34) started again"),
            Self::OtherMaster(_) => (
                "other-master",
                "it got more datagrams (DP34) than were sent from here: another machine sends to it",
            ),
            Self::NotHome(_) => ("not-home", "it is not home: it was reset, or was never homed"),
            Self::Other(_) => ("other", "another controller or another work mode (PA00) than before"),
            Self::Gap(_) => (
                "gap",
                "it was silent for so long that it may have rebooted, and it has no packet counter (DP34) to show it",
            ),
            Self::Unproved(_) => ("unproved", "it is unknown whether it has rebooted"),
            Self::Outside { .. } => ("outside", ITSELF),
            Self::Pushed { .. } => ("pushed", ITSELF),
            Self::Error { .. } => ("error", ITSELF),
            Self::Drive { .. } => ("drive", ITSELF),
            Self::Killed { .. } => ("killed", ITSELF),
            Self::Alarm { register: DPFE, .. } => ("drive-alarm", ITSELF),
            Self::Alarm { .. } => ("alarm", ITSELF),
            Self::OtherAxes { .. } => ("other-axes", ITSELF),
        }
    }

    /// Its stable code, for programs.
    pub(crate) const fn code(self) -> &'static str {
        self.row().0
    }

    /// The figures that belong to it, in the order of its words.
    pub(crate) fn figures(self) -> Vec<String> {
        match self {
            Self::Outside { axis, pulses, .. } => vec![(axis + 1).to_string(), pulses.0.to_string()],
            Self::Pushed { pushed, .. } => {
                let [at, held] = pushed.places();
                vec![(pushed.axis + 1).to_string(), at, held]
            }
            Self::Error { error, .. } => vec![crate::wire::DeviceError(error).to_string()],
            Self::Drive { axis, error, .. } => vec![axis.to_string(), error.to_string()],
            Self::Killed { axis, cause, .. } => vec![axis.to_string(), conditions(cause)],
            Self::Alarm { register: DPFE, value, .. } => vec![value.to_string()],
            Self::Alarm { register, value, .. } => vec![format!("DP{register:02x}"), value.to_string()],
            Self::OtherAxes { drives, .. } => vec![drives.to_string()],
            _ => Vec::new(),
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.to, self.why)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Pulses;

    #[test]
    fn a_remedy_can_be_done_where_it_is_told() {
        let next = HealthState::Excluded.next();
        assert!(!next.contains("park,"), "a hall without its zero cannot park: {next}");
        assert!(Why::Refuses(0).next().is_some_and(|next| next.contains("dialect")));
        // Its controller has no error.
        assert!(Why::Unsteady(0).next().is_some_and(|next| !next.contains("at the controller")));
    }

    #[test]
    fn a_seat_that_says_it_is_where_it_cannot_be_is_homed_and_nobody_is_sent_to_its_cables() {
        let outside = Why::Outside { controller: 0, axis: 1, pulses: Pulses(-92_000) };
        for why in [outside, Why::Ambiguous(0)] {
            let next = why.next().expect("it is no matter of the network");
            assert!(next.contains("kinocue home --config") && !next.contains("network"), "{next}");
        }
        // Homed where it stands, a turntable that was turned too far would turn as far again.
        assert!(outside.next().is_some_and(|next| next.contains("turn a turntable back by hand")));
    }
}
