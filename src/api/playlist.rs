//! `/api/v1/playlist`: the list that is loaded, and those there are.

use std::sync::Arc;

use axum::Json as JsonReply;
use axum::extract::State;
use serde::Deserialize;
use utoipa::ToSchema;

use super::asker::{Asker, StatusReply};
use super::input::{Json, id};
use super::shared::Shared;
use crate::control::{Command, Problem, Status};
use crate::playlist::PlaylistInfo;

/// Which playlist.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Choice {
    /// Its id; null for none.
    #[serde(deserialize_with = "Option::deserialize")] // null has to be written: an empty object drops nothing
    #[schema(required = true)]
    id: Option<String>,
}

impl Choice {
    pub(super) fn command(self) -> Result<Command, Problem> {
        let id = self.id.map(|text| id(&text)).transpose()?.map(|id| id.to_string());
        Ok(Command::Playlist { id })
    }
}

/// Which entry.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Select {
    /// Counted from 0.
    entry: usize,
}

/// The playlists of the hall, also those with faults.
#[utoipa::path(
    get, path = "/api/v1/playlists", tag = "playlist", responses((status = 200, body = [PlaylistInfo]))
)]
pub(super) async fn all(State(shared): State<Arc<Shared>>) -> Result<JsonReply<Vec<PlaylistInfo>>, Problem> {
    let shelf = shared.shelf.clone();
    shared.blocking(move || shelf.all()).await.map(JsonReply)
}

/// Loads a playlist, or drops the one that is loaded.
#[utoipa::path(
    put, path = "/api/v1/playlist", tag = "playlist", request_body = Choice, responses((status = 200, body = Status))
)]
pub(super) async fn choose(asker: Asker, Json(choice): Json<Choice>) -> Result<StatusReply, Problem> {
    asker.ask(choice.command()?).await
}

/// Selects the playlist entry to play next.
#[utoipa::path(
    post, path = "/api/v1/playlist/select", tag = "playlist", request_body = Select,
    responses((status = 200, body = Status))
)]
pub(super) async fn select(
    asker: Asker,
    Json(Select { entry }): Json<Select>,
) -> Result<StatusReply, Problem> {
    asker.ask(Command::Select { entry }).await
}
