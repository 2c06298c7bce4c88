//! Endpoints for other programs: health, readiness, metrics, description; and the console's page.

use std::sync::Arc;

use axum::Json as JsonReply;
use axum::extract::State;
use axum::http::header::{ACCEPT, CONTENT_TYPE};
use axum::http::{HeaderMap, HeaderValue, Method, Uri};
use axum::response::{IntoResponse as _, Response};
use serde::Serialize;
use utoipa::ToSchema;

use super::problem::nothing_there;
use super::shared::Shared;
use crate::control::model::Word;
use crate::control::{Code, Problem};
use crate::metrics;
use crate::state::State as HallState;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Where the description of the API is.
pub(super) const DOCUMENT: &str = "/api/v1/openapi.json";

/// That it is well, or ready.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Well {
    /// The state of the hall.
    #[schema(value_type = String)]
    state: Word<HallState>,
}

/// True if the process lives and its tick thread ticks; 503 if not.
#[utoipa::path(get, path = "/healthz", tag = "service", responses((status = 200, body = Well)))]
pub(super) async fn health(State(shared): State<Arc<Shared>>) -> Result<JsonReply<Well>, Problem> {
    if shared.pulse.beats(Monotonic.now()) {
        return Ok(well(&shared));
    }
    let remedy = "see the log; the watchdog of the service manager restarts it, if enabled";
    Err(Problem::new(Code::Timeout, "the tick counter stands still", remedy))
}

/// True if all controllers have been asked once, so that there is a hall to speak of; 503 if not.
#[utoipa::path(get, path = "/readyz", tag = "service", responses((status = 200, body = Well)))]
pub(super) async fn ready(State(shared): State<Arc<Shared>>) -> Result<JsonReply<Well>, Problem> {
    let status = shared.handle.status();
    if status.state == HallState::Boot {
        let problem = Problem::new(Code::State, "the hall has just started", status.next.clone());
        return Err(Problem { status: 503, ..problem });
    }
    Ok(well(&shared))
}

fn well(shared: &Shared) -> JsonReply<Well> {
    JsonReply(Well { state: shared.handle.status().state.clone() })
}

/// Figures for Prometheus: `OpenMetrics` where `Accept` prefers that, else its older text format.
#[utoipa::path(
    get, path = "/metrics", tag = "service",
    responses((status = 200, body = String, content_type = "text/plain"))
)]
pub(super) async fn figures(State(shared): State<Arc<Shared>>, headers: HeaderMap) -> Response {
    figures_as(&headers, metrics::render(&shared.handle.status()))
}

/// Figures in the format that whoever asks prefers.
pub(crate) fn figures_as(headers: &HeaderMap, page: String) -> Response {
    let accept =
        headers.get_all(ACCEPT).iter().filter_map(|value| value.to_str().ok()).collect::<Vec<_>>().join(",");
    let (kind, page) = metrics::negotiated(Some(&accept), page);
    ([(CONTENT_TYPE, HeaderValue::from_static(kind))], page).into_response()
}

/// The description of this API (OpenAPI 3.1).
#[utoipa::path(get, path = "/api/v1/openapi.json", tag = "service", responses((status = 200, body = Object)))]
pub(super) async fn document(State(shared): State<Arc<Shared>>) -> Response {
    let json = HeaderValue::from_static("application/json");
    ([(CONTENT_TYPE, json)], shared.document.clone()).into_response()
}

/// What no route takes: the page and what belongs to it, or nothing.
pub(super) async fn page(
    State(shared): State<Arc<Shared>>,
    method: Method,
    uri: Uri,
) -> Result<Response, Problem> {
    let page = (shared.pages)(uri.path()).filter(|_| method == Method::GET || method == Method::HEAD);
    let (content_type, bytes) = page.ok_or_else(|| nothing_there(uri.path()))?;
    Ok(([(CONTENT_TYPE, HeaderValue::from_static(content_type))], bytes).into_response())
}

/// What no route of the fleet socket takes.
pub(super) async fn nothing(uri: Uri) -> Problem {
    let remedy = "the fleet socket has what docs/fleet.md says; all else is on the control socket";
    Problem { remedy: remedy.to_owned(), ..nothing_there(uri.path()) }
}

/// A path that is there, asked by a method that it does not take.
pub(super) async fn wrong_method(method: Method, uri: Uri) -> Problem {
    let detail = format!("{} does not take {method}", uri.path());
    Problem::new(Code::Method, detail, "see the header Allow, or /api/v1/openapi.json")
}
