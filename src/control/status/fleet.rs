//! What a hall says of starts by the fleet.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::control::model::words;

/// What the fleet may start here, and how far its clock may be off.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct FleetStatus {
    /// How far the wall clock of this machine may be off; null if nobody knows.
    pub(crate) clock: Option<ClockStatus>,
    /// What a person here has armed the hall for; null if for nothing.
    pub(crate) armed_for: Option<ArmedForStatus>,
    /// The start that waits for its instant, or the last one; null if there was none.
    pub(crate) start: Option<StartStatus>,
}

/// How far the wall clock of this machine may be off a time server's.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct ClockStatus {
    /// The time server, as the link was told to ask it.
    pub(crate) server: String,
    /// How far it was found ahead of the server, µs.
    pub(crate) offset_us: f64,
    /// It is off by no more than that now, µs: what was measured, and what may have come on top of it since.
    pub(crate) bound_us: f64,
    /// The most with which it takes part in a start, µs.
    pub(crate) start_bound_us: f64,
    /// How long ago that was measured, s.
    pub(crate) age_s: f64,
}

/// A group of halls that a person has armed this one for.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct ArmedForStatus {
    /// The group.
    pub(crate) group: String,
    /// The cue that was loaded then.
    pub(crate) cue: String,
    /// SHA-256 of its file, hexadecimal.
    pub(crate) sha256: String,
    /// Seconds until it lapses.
    pub(crate) lapses_s: f64,
}

words! {
    /// How far a start is.
    #[derive(Default)]
    pub(crate) StartPhase {
        /// It was asked, and comes only if the desk is heard once more.
        #[default]
        Asked = "asked",
        /// It comes at its instant.
        Committed = "committed",
        /// It has come.
        Started = "started",
        /// It has not, and will not.
        CalledOff = "called-off",
    }
}

/// A start of several halls.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct StartStatus {
    /// Its ticket.
    pub(crate) ticket: String,
    /// The group of halls.
    pub(crate) group: String,
    /// Who asked.
    pub(crate) who: String,
    /// When the film is at its beginning, RFC 3339.
    pub(crate) at: String,
    /// `asked`, `committed`, `started` or `called-off`.
    #[schema(value_type = String)]
    pub(crate) phase: StartPhase,
    /// Why it was called off; empty if it was not.
    pub(crate) why: String,
    /// How far the wall clock of this machine may have been off when the instant was taken over, µs; null before that.
    pub(crate) bound_us: Option<f64>,
}
