//! Every word about the standing of groups, once.

use std::fmt;

use super::{Change, Standing, Why};

/// What has to be said, loudly, where acks are off.
pub const ACKS_OFF: &str = "acks are off: a controller that is lost, refuses frames or has an emergency stop is noticed by \
                            its own reports at best";

impl fmt::Display for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ok => "ok",
            Self::Degraded => "degraded",
            Self::Lost => "lost",
            Self::Rejoining => "rejoining",
            Self::Stopped => "stopped",
            Self::Error => "error",
            Self::Excluded => "excluded",
            Self::Unwatched => "unwatched",
        })
    }
}

impl Standing {
    /// What a person does about it.
    #[must_use]
    pub const fn next(self) -> &'static str {
        match self {
            Self::Ok => "nothing",
            Self::Rejoining => "park, or start a show: it joins slowly",
            Self::Degraded => "look at the network",
            Self::Lost => "look at its power and network; it joins again by itself if it did not reboot",
            Self::Stopped => "release the emergency stop at its place, then clear",
            Self::Error => "put the error right at the controller; with the seats parked or stopped, clear",
            Self::Excluded => "park, then home it with nobody on the seat",
            Self::Unwatched => "watch the seat",
        }
    }
}

impl Why {
    /// What a person does about it before all else; none where the standing says enough.
    #[must_use]
    pub const fn next(self) -> Option<&'static str> {
        match self {
            Self::Moved(_) => {
                Some("find out what moved it; then park, or start a show: it joins slowly from where it is")
            }
            Self::Crowded(_) => {
                Some("stop the other machine; then park, and home it with nobody on the seat")
            }
            _ => None,
        }
    }
}

impl fmt::Display for Why {
    /// The reason, without the name of the controller.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Acked => "it answers",
            Self::AcksOff => "acks are off",
            Self::AcksMissing(_) => "acks are missing or late",
            Self::Silent(_) => "no ack and no report for too long",
            Self::NotSeenYet => "no answer yet",
            Self::SeenAgain => "back as it was",
            Self::Moved(_) => "it was moved while no frame was sent to it from here",
            Self::EmergencyStop(_) => "emergency stop",
            Self::HeldUntilReset(_) => "its emergency stop was released, and holds until a reset (PA91 = 2)",
            Self::Error { error, .. } => return write!(f, "{}", crate::wire::DeviceError(*error)),
            Self::Drive { axis, error, .. } => return write!(f, "drive of axis {axis}: error {error}"),
            Self::Refuses(_) => "it refuses frames",
            Self::Rebooted(_) => "it has rebooted: its packet counter (DP34) does not go on",
            Self::Crowded(_) => {
                "it got more datagrams (DP34) than were sent from here: another machine sends to it"
            }
            Self::NotHome(_) => "it was reset: it is not home (DPF0)",
            Self::Other(_) => "another controller or another work mode (PA00) than before",
            Self::Unproved(_) => "whether it has rebooted cannot be told",
        })
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.to, self.why)
    }
}
