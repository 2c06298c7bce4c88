//! A cue of the library out to a desk of the fleet that may have it, a piece at a time, while the hall is parked and unarmed.

use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Deserialize;

use super::shared::Shared;
use crate::config::{FleetWord, Role};
use crate::control::{Code, Problem, Who};
use crate::fleet::{CHUNK, CuePiece};
use crate::library::CueId;
use crate::state::State;

/// Which piece of which cue is asked for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PullArgs {
    pub(super) cue: String,
    /// From 0.
    pub(super) n: u64,
}

/// That piece, for whom it is asked.
pub(super) async fn piece(shared: &Arc<Shared>, who: &Who, id: CueId, n: u64) -> Result<CuePiece, Problem> {
    if who.role < Role::Operate {
        return Err(Problem::role("to fetch cues", Role::Operate, who));
    }
    shared.fleet.check_allowed(&[FleetWord::Pull])?;
    let state = shared.handle.status().state.clone();
    if state != State::Parked {
        let detail = format!("the hall is {state}, and gives nothing out until it is parked");
        return Err(Problem::new(Code::State, detail, "try again then"));
    }
    let library = shared.library.clone();
    let part = shared.blocking(move || library.part(&id, n, CHUNK)).await?;
    let data = STANDARD.encode(&part.bytes);
    Ok(CuePiece { sha256: part.sha256, bytes: part.whole, mcap: part.mcap, data })
}
