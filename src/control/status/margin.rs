//! What a cue leaves of the limits.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::super::model::words;

words! {
    /// What has a limit.
    #[derive(Default)]
    pub(crate) MarginOf {
        /// The stroke.
        #[default]
        Stroke = "stroke",
        /// Velocity.
        Velocity = "velocity",
        /// Change of velocity from one frame to the next.
        Step = "step",
        /// Acceleration.
        Acceleration = "acceleration",
        /// Jerk.
        Jerk = "jerk",
    }
}

/// What a cue leaves of a limit where it leaves least.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct MarginStatus {
    /// `stroke`, `velocity`, `step` (from frame to frame), `acceleration` or `jerk`.
    pub(crate) of: MarginOf,
    /// The axis of the cue, from 1.
    pub(crate) axis: usize,
    /// What is left, a part of the limit, of the stroke a part of that; 0 to 1.
    pub(crate) part: f64,
    /// Where in the cue, s.
    pub(crate) at_s: f64,
}
