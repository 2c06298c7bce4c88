//! `/api/v1/show/…`: what an operator does with what is loaded.

use serde::Deserialize;
use utoipa::ToSchema;

use super::asker::{Asker, StatusReply};
use super::input::{Json, Nothing, OrNothing, id};
use super::problem::bad_value;
use crate::config;
use crate::control::{Command, Problem, Status};
use crate::time::ShowTime;

/// Where a stop is asked: nothing that comes with it, and is not as it should be, is a reason not to stop.
pub(super) const STOP: &str = "/api/v1/show/stop";

type Reply = Result<StatusReply, Problem>;

/// Which cue.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Load {
    /// Its id.
    pub(super) cue: String,
}

/// Under which condition.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Arm {
    /// Nobody sits on the seats and nothing lies on or under them. Where a position is unknown arming homes the seats first,
    /// and is refused without this; for engineers.
    seats_empty: bool,
    /// A group of halls: the fleet may start what is loaded, once, together with those. Only where `[fleet] start = true`, and not with
    /// `seats_empty`.
    fleet: Option<String>,
}

/// From where on.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Go {
    /// Seconds from the beginning of the cue, 0 or more; the seats join the cue there. `show.resume_s` of the status is where
    /// the last show was left. From where a seek has set it, or the beginning, where this is left out.
    from_s: Option<f64>,
}

/// Where to.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Seek {
    /// Seconds from the beginning of the cue, 0 or more.
    position_s: f64,
}

/// Homes all controllers, with nobody on the seats.
#[utoipa::path(post, path = "/api/v1/show/home", tag = "show", responses((status = 200, body = Status)))]
pub(super) async fn home(asker: Asker, _: Nothing) -> Reply {
    asker.ask(Command::Home).await
}

/// Loads a cue of the library.
#[utoipa::path(
    post, path = "/api/v1/show/load", tag = "show", request_body = Load, responses((status = 200, body = Status))
)]
pub(super) async fn load(asker: Asker, Json(load): Json<Load>) -> Reply {
    let cue = id(&load.cue)?.to_string();
    asker.ask(Command::Load { cue }).await
}

/// Gets ready to go. Over TCP for engineers. Where `arm_homes` of the status is true the seats home first.
#[utoipa::path(
    post, path = "/api/v1/show/arm", tag = "show", request_body = Option<Arm>, responses((status = 200, body = Status))
)]
pub(super) async fn arm(asker: Asker, OrNothing(Arm { seats_empty, fleet }): OrNothing<Arm>) -> Reply {
    let Some(group) = fleet else { return asker.ask(Command::Arm { seats_empty }).await };
    if !config::is_fleet_id(&group) {
        let detail = format!("fleet: {group:?} is no group of halls");
        return Err(bad_value(detail, "write a to z, 0 to 9, - and _, at most 32 of them"));
    }
    if seats_empty {
        let detail = "seats that home first are not armed for a start of the fleet";
        return Err(bad_value(detail.to_owned(), "home them, then arm for the group"));
    }
    asker.ask(Command::ArmFor(group)).await
}

/// Stands down.
#[utoipa::path(post, path = "/api/v1/show/disarm", tag = "show", responses((status = 200, body = Status)))]
pub(super) async fn disarm(asker: Asker, _: Nothing) -> Reply {
    asker.ask(Command::Disarm).await
}

/// Starts what is loaded and armed. Over TCP X-Kinocue-Sent has to say when it was asked; one that is older than 2 s is refused.
#[utoipa::path(
    post, path = "/api/v1/show/go", tag = "show", request_body = Option<Go>, responses((status = 200, body = Status))
)]
pub(super) async fn go(asker: Asker, OrNothing(Go { from_s }): OrNothing<Go>) -> Reply {
    match from_s {
        None => asker.ask(Command::Go).await,
        Some(from_s) => asker.ask(Command::GoFrom(film("from_s", from_s)?)).await,
    }
}

/// Holds; the film waits.
#[utoipa::path(post, path = "/api/v1/show/pause", tag = "show", responses((status = 200, body = Status)))]
pub(super) async fn pause(asker: Asker, _: Nothing) -> Reply {
    asker.ask(Command::Pause).await
}

/// Goes on.
#[utoipa::path(post, path = "/api/v1/show/resume", tag = "show", responses((status = 200, body = Status)))]
pub(super) async fn resume(asker: Asker, _: Nothing) -> Reply {
    asker.ask(Command::Resume).await
}

/// Jumps to another position in the cue.
#[utoipa::path(
    post, path = "/api/v1/show/seek", tag = "show", request_body = Seek, responses((status = 200, body = Status))
)]
pub(super) async fn seek(asker: Asker, Json(Seek { position_s }): Json<Seek>) -> Reply {
    asker.ask(Command::Seek(film("position_s", position_s)?)).await
}

/// A time of the film.
fn film(key: &str, seconds: f64) -> Result<ShowTime, Problem> {
    if seconds < 0.0 {
        let detail = format!("{key}: {seconds} is before the beginning");
        return Err(bad_value(detail, "give seconds from the beginning of the cue"));
    }
    Ok(ShowTime::from_secs_f64(seconds))
}

/// Brings the seats to rest at once. Not a safety device: the emergency stop is hard-wired.
#[utoipa::path(post, path = "/api/v1/show/stop", tag = "show", responses((status = 200, body = Status)))]
pub(super) async fn stop(asker: Asker) -> Reply {
    asker.ask(Command::Stop).await // whatever its body is
}

/// Brings the seats to their park poses.
#[utoipa::path(post, path = "/api/v1/show/park", tag = "show", responses((status = 200, body = Status)))]
pub(super) async fn park(asker: Asker, _: Nothing) -> Reply {
    asker.ask(Command::Park).await
}

/// Leaves a stop or a fault.
#[utoipa::path(post, path = "/api/v1/show/clear", tag = "show", responses((status = 200, body = Status)))]
pub(super) async fn clear(asker: Asker, _: Nothing) -> Reply {
    asker.ask(Command::Clear).await
}
