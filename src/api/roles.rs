//! Who may ask what over HTTP: the least role of each route, held against who asks before anything of the body is read.

use axum::extract::{MatchedPath, Request};
use axum::http::Method;

use crate::control::{Command, LevelsChange, Problem, Role, Who};
use crate::time::ShowTime;

/// True if who asks has the role that the route needs.
pub(super) fn check(request: &Request, who: &Who) -> Result<(), Problem> {
    let route = request.extensions().get::<MatchedPath>();
    match route.and_then(|route| least(request.method(), route.as_str())) {
        Some((least, what)) if who.role < least => Err(Problem::role(what, least, who)),
        _ => Ok(()),
    }
}

/// The least role that a route needs, and what of it does, where that is more than to look: an engineer's for what no command does, else
/// that of the command.
fn least(method: &Method, route: &str) -> Option<(Role, &'static str)> {
    let engineer = |what| Some((Role::Engineer, what));
    match (method.as_str(), route) {
        ("PUT", "/api/v1/cues/{id}") => engineer("changing the library"),
        ("GET" | "HEAD", "/api/v1/recordings/{name}") => engineer("downloading recordings"),
        ("DELETE", "/api/v1/recordings/{name}") => engineer("deleting recordings"),
        ("GET" | "HEAD", _) => None,
        _ => commanded(method, route).map(|command| (command.least_role(), command.word())),
    }
}

/// The command that a route gives, whatever it is told besides.
fn commanded(method: &Method, route: &str) -> Option<Command> {
    let asked = route.strip_prefix("/api/v1/")?;
    Some(match (method.as_str(), asked) {
        ("POST", "show/home") => Command::Home,
        ("POST", "show/load") => Command::Load { cue: String::new() },
        ("POST", "show/arm") => Command::Arm { seats_empty: false },
        ("POST", "show/disarm") => Command::Disarm,
        ("POST", "show/go") => Command::Go,
        ("POST", "show/pause") => Command::Pause,
        ("POST", "show/resume") => Command::Resume,
        ("POST", "show/seek") => Command::Seek(ShowTime::ZERO),
        ("POST", "show/stop") => Command::Stop,
        ("POST", "show/park") => Command::Park,
        ("POST", "show/clear") => Command::Clear,
        ("PUT", "trim") => Command::Trim(0),
        ("PUT", "sync/source") => Command::Source(None),
        ("PUT", "levels") => Command::Levels(LevelsChange::default()),
        ("POST", "presets/{name}") => Command::Preset(String::new()),
        ("POST", "preflight") => Command::Preflight,
        ("POST", "test") => Command::Test { rows: Vec::new() },
        ("POST", "reload") => Command::Reload,
        ("POST", "controllers/{name}/enable") => Command::Enable(String::new()),
        ("POST", "controllers/{name}/disable") => Command::Disable { name: String::new(), why: None },
        ("PUT", "playlist") => Command::Playlist { id: None },
        ("POST", "playlist/select") => Command::Select { entry: 0 },
        ("POST", "record/mark") => Command::Mark { text: None },
        ("POST", "record/dump") => Command::Dump,
        _ => return None,
    })
}
