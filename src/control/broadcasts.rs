//! Networks whose controllers may get one datagram together, in the status of the hall and in the report of a play.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// One network of `[broadcast]`, since its hall opened.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct BroadcastStatus {
    /// Its name.
    pub name: String,
    /// Its controllers that take part.
    pub controllers: usize,
    /// Ticks whose frames left as one datagram.
    pub together: u64,
    /// Ticks whose frames left as one datagram for each controller.
    pub apart: u64,
    /// Why one datagram may not go to all just now; null while it may.
    pub not_now: Option<String>,
    /// Why the frames of a tick left one by one the last time; null where they never did.
    pub last_apart: Option<String>,
}
