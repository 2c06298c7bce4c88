//! `kinocue stop`: by the daemon's stop socket, which works while all else is stuck; by its API where that fails.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::json;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::time::timeout;

use super::http::{block_on, connect};
use super::server::ServerArgs;
use crate::cli::{Exit, Failure, print};

/// How long the stop socket may take: its thread does nothing else.
const PATIENCE: Duration = Duration::from_millis(500);
/// How long the control socket may take after that.
const LAST_PATIENCE: Duration = Duration::from_secs(3);
/// What this stop is not.
const NO_EMERGENCY: &str = "this is a soft stop; the emergency stop is hard-wired";

/// Brings the seats to rest at once, until `kinocue clear`.
///
/// Uses the daemon's stop socket, which has a thread of its own and works even if everything else hangs; the control
/// socket only if that fails. This is a soft stop: the emergency stop is hard-wired.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue stop
  kinocue stop --stop-socket /run/kinocue/stop.sock

Exit codes: 0 the seats are coming to rest, 69 no daemon confirmed it: use the hard-wired emergency stop")]
pub(in crate::cli) struct Args {
    /// The stop socket of the daemon [default: stop.sock beside the control socket].
    #[arg(long, value_name = "PATH")]
    stop_socket: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let beside = || args.server.first_socket().with_file_name("stop.sock");
    let socket = args.stop_socket.clone().unwrap_or_else(beside);
    let path = socket.display();
    match block_on(async { Ok(ask_stop(&socket, PATIENCE).await) })? {
        Ok(()) => {
            if args.server.json {
                print::json(&json!({ "state": "stopping", "by": "stop-socket" }))?;
            }
            print::tell(&format!("kinocue: stopping, via {path}; next: kinocue clear; {NO_EMERGENCY}"));
            Ok(Exit::Done)
        }
        Err(error) => {
            print::tell(&format!(
                "kinocue: {path} did not take the stop ({error}); trying the control socket"
            ));
            by_control_socket(&args.server)
        }
    }
}

/// Has whoever serves a stop socket stop, within so long.
///
/// # Errors
/// Those of the system, or that it said something else.
pub(in crate::cli) async fn ask_stop(socket: &Path, patience: Duration) -> io::Result<()> {
    let talk = async {
        let mut stream = connect(socket).await?;
        stream.write_all(b"stop\n").await?;
        let mut answer = Vec::new();
        while answer.len() < 64 && !answer.ends_with(b"\n") && stream.read_buf(&mut answer).await? > 0 {}
        if answer.starts_with(b"stopping") {
            return Ok(());
        }
        let said = String::from_utf8_lossy(&answer).trim_end().to_owned();
        Err(io::Error::new(ErrorKind::InvalidData, format!("it said {said:?}")))
    };
    timeout(patience, talk).await.unwrap_or_else(|_| Err(ErrorKind::TimedOut.into()))
}

fn by_control_socket(server: &ServerArgs) -> Result<Exit, Failure> {
    let server = ServerArgs { socket: Some(server.first_socket()), ..server.clone() };
    let stopped = server.post_within("/api/v1/show/stop", &json!({}), LAST_PATIENCE);
    let status = stopped.map_err(unconfirmed)?;
    let (line, socket) = (status.line(), server.first_socket());
    print::tell(&format!("kinocue: {line}; via {}; {NO_EMERGENCY}", socket.display()));
    Ok(Exit::Done)
}

/// Nobody tries a stop again as long as it takes: what would be told so elsewhere is as if no daemon were there.
fn unconfirmed(Failure { exit, error }: Failure) -> Failure {
    let error = error.context("THE STOP IS NOT CONFIRMED; use the hard-wired emergency stop");
    Failure { exit: if exit == Exit::TryAgain { Exit::Unavailable } else { exit }, error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_that_nobody_confirmed_ends_with_69_also_where_the_socket_lets_nobody_in() {
        let of = |exit| unconfirmed(Failure { exit, error: anyhow::anyhow!("no room") });
        assert_eq!(of(Exit::TryAgain).exit, Exit::Unavailable);
        assert_eq!(of(Exit::NotAllowed).exit, Exit::NotAllowed);
        assert!(of(Exit::TryAgain).to_string().starts_with("THE STOP IS NOT CONFIRMED"));
    }
}
