//! The names that a running service knows, for completions of shells.

use std::time::Duration;

use http_body_util::Full;
use hyper::Method;
use hyper::body::Bytes;
use serde::Deserialize;
use serde_json::Value;

use super::server::ServerArgs;
use super::{http, reply};
use crate::cli::{Exit, Failure, OrExit as _, print};

/// Whoever presses Tab waits no longer.
const PATIENCE: Duration = Duration::from_secs(1);

/// Prints the names of a kind that the running service knows, one on a line; none where no service answers.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct KnownArgs {
    /// What.
    #[arg(value_enum)]
    kind: KnownKind,
    #[command(flatten)]
    server: ServerArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum KnownKind {
    Cues,
    Playlists,
    Seats,
    Presets,
    Effects,
}

/// What has an id.
#[derive(Debug, Deserialize)]
struct WithId {
    id: String,
}

pub(in crate::cli) fn known(args: &KnownArgs) -> Result<Exit, Failure> {
    // A shell has nothing to do with why there are none.
    let names = names(args.kind, &args.server).unwrap_or_default();
    let lines = names.into_iter().filter(|name| is_plain(name)).map(|name| name + "\n");
    print::data(&lines.collect::<String>())?;
    Ok(Exit::Done)
}

pub(super) fn names(kind: KnownKind, server: &ServerArgs) -> Result<Vec<String>, Failure> {
    let ids = |text: &str| -> Result<Vec<String>, Failure> {
        let all: Vec<WithId> = serde_json::from_str(text).or_exit(Exit::Internal)?;
        Ok(all.into_iter().map(|one| one.id).collect())
    };
    let status = || -> Result<Value, Failure> {
        Ok(serde_json::from_str(&get(server, "/api/v1/status")?).unwrap_or_default())
    };
    let texts = |values: Option<&Vec<Value>>| {
        values.into_iter().flatten().filter_map(|value| value.as_str().map(str::to_owned)).collect()
    };
    match kind {
        KnownKind::Cues => ids(&get(server, "/api/v1/cues")?),
        KnownKind::Playlists => ids(&get(server, "/api/v1/playlists")?),
        KnownKind::Presets => Ok(texts(status()?["presets"].as_array())),
        KnownKind::Seats => {
            let status = status()?;
            let seats = status["controllers"].as_array().into_iter().flatten();
            Ok(seats.filter_map(|seat| seat["name"].as_str().map(str::to_owned)).collect())
        }
        KnownKind::Effects => {
            let status = status()?;
            Ok(status["levels"]["effects"]
                .as_object()
                .into_iter()
                .flat_map(|all| all.keys().cloned())
                .collect())
        }
    }
}

fn get(server: &ServerArgs, path: &str) -> Result<String, Failure> {
    let request = http::request(Method::GET, path, None, Full::<Bytes>::default())?;
    let reply = http::block_on(http::exchange(&server.socket()?, request, PATIENCE))?;
    reply::done(&reply)?;
    Ok(reply.text)
}

/// A shell takes a name for more than a name where it may be more: such a one is typed by hand.
fn is_plain(name: &str) -> bool {
    !name.is_empty()
        && !name.starts_with('-')
        && name.chars().all(|one| one.is_alphanumeric() || "-_.".contains(one))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_shell_gets_a_name_that_it_could_take_for_a_command() {
        assert!(["F4", "bench-ride", "reihe_ä", "a.b"].into_iter().all(is_plain));
        let not = [
            "",
            "-x",
            "$(reboot)",
            "a b",
            "a;b",
            "`x`",
            "a\nb",
            "~",
            "*",
            "a|b",
            "a>b",
            "a'b",
            "a\"b",
            "\\x",
        ];
        assert!(!not.into_iter().any(is_plain));
    }
}
