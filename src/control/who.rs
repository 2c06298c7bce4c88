//! Who asks, and what they may ask.

use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Role;
use crate::plain;

/// Which way somebody came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Surface {
    /// The control socket of this machine.
    Socket,
    /// HTTP over TCP.
    Http,
    /// OSC over UDP.
    Osc,
    /// Lines of text over TCP.
    Text,
    /// A button of this machine: nobody sees who presses it.
    Buttons,
    /// A key of the fleet, over the fleet socket.
    Fleet,
    /// The schedule of the playlist, armed by a person.
    Schedule,
    /// A signal to the process.
    Signal,
    /// The program by itself, as it does in `kinocue demo`.
    Program,
}

/// Who asks: for the journal, and for what they may do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct Who {
    /// What they may do.
    #[schema(value_type = String)]
    pub role: Role,
    /// Which way they came.
    #[schema(value_type = String)]
    pub surface: Surface,
    /// Their name, as well as it is known: the user of the socket's peer, the name of a token, an address.
    pub name: String,
}

impl Surface {
    /// True if it is that of show-control gear, which is known by its address alone.
    #[must_use]
    pub(crate) const fn is_gear(self) -> bool {
        matches!(self, Self::Osc | Self::Text)
    }

    /// True if nobody who asks by it sees the seats: its levels stay below what people here have set.
    #[must_use]
    pub(crate) const fn is_remote(self) -> bool {
        self.is_gear() || matches!(self, Self::Fleet)
    }
}

plain::displayed!(Surface {
    Self::Socket => "socket",
    Self::Http => "http",
    Self::Osc => "osc",
    Self::Text => "text",
    Self::Buttons => "buttons",
    Self::Fleet => "fleet",
    Self::Schedule => "schedule",
    Self::Signal => "signal",
    Self::Program => "program",
});

impl fmt::Display for Who {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, surface, role } = self;
        write!(f, "{name} ({surface}, {role})")
    }
}
