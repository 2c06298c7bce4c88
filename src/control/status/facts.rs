//! How the hall is, in short.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Status;
use crate::control::model::Word;
use crate::state::State;

/// How the hall is, in short.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct HallFacts {
    /// The state, one word.
    #[schema(value_type = String)]
    pub(crate) state: Word<State>,
    /// Why it is in that state.
    pub(crate) cause: String,
    /// What a person does next.
    pub(crate) next: String,
    /// Where in the cue the film is, s; null if none is loaded.
    pub(crate) position_s: Option<f64>,
}

impl From<&Status> for HallFacts {
    fn from(status: &Status) -> Self {
        Self {
            state: status.state.clone(),
            cause: status.cause.clone(),
            next: status.next.clone(),
            position_s: status.show.as_ref().map(|show| show.position_s),
        }
    }
}
