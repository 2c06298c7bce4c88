//! `/api/v1/controllers`: the controllers of the hall, and taking one in or out.

use std::sync::Arc;

use axum::Json as JsonReply;
use axum::extract::State;
use serde::Deserialize;
use utoipa::ToSchema;

use super::asker::{Asker, StatusReply};
use super::input::{Name, Nothing, OrNothing};
use super::shared::Shared;
use crate::control::{Command, ControllerStatus, Problem, Status};

/// Why it is taken out.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Disable {
    /// In a line, for whoever comes next.
    why: Option<String>,
}

/// All controllers, in the order of the configuration.
#[utoipa::path(
    get, path = "/api/v1/controllers", tag = "controllers", responses((status = 200, body = [ControllerStatus]))
)]
pub(super) async fn all(State(shared): State<Arc<Shared>>) -> JsonReply<Vec<ControllerStatus>> {
    JsonReply(shared.handle.status().controllers.clone())
}

/// One controller.
#[utoipa::path(
    get, path = "/api/v1/controllers/{name}", tag = "controllers",
    params(("name" = String, Path, description = "Its name")), responses((status = 200, body = ControllerStatus))
)]
pub(super) async fn one(
    State(shared): State<Arc<Shared>>,
    Name(name): Name,
) -> Result<JsonReply<ControllerStatus>, Problem> {
    let status = shared.handle.status();
    let found = status.controllers.iter().find(|controller| controller.name == name);
    found.cloned().map(JsonReply).ok_or_else(|| {
        let known = status.controllers.iter().map(|one| one.name.as_str());
        Problem::unknown("controller", &name, known, "the status lists them")
    })
}

/// Takes the group of a controller in: its seat joins what plays.
#[utoipa::path(
    post, path = "/api/v1/controllers/{name}/enable", tag = "controllers",
    params(("name" = String, Path, description = "Its name")), responses((status = 200, body = Status))
)]
pub(super) async fn enable(asker: Asker, Name(name): Name, _: Nothing) -> Result<StatusReply, Problem> {
    asker.ask(Command::Enable(name)).await
}

/// Takes the group of a controller out: its seat parks. It stays out over a restart, until somebody takes it in.
#[utoipa::path(
    post, path = "/api/v1/controllers/{name}/disable", tag = "controllers", request_body = Option<Disable>,
    params(("name" = String, Path, description = "Its name")), responses((status = 200, body = Status))
)]
pub(super) async fn disable(
    asker: Asker,
    Name(name): Name,
    OrNothing(Disable { why }): OrNothing<Disable>,
) -> Result<StatusReply, Problem> {
    asker.ask(Command::Disable { name, why }).await
}
