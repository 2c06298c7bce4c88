//! `kinocue serve`: the daemon.

use std::path::PathBuf;

use super::{Exit, Failure, OrExit as _, print};
use crate::app::runtime::RuntimeError;
use crate::app::serve::{Parts, Places, ServeError, serve, signals};
use crate::app::surfaces::Sockets;
use crate::log::{Line, Log, Priority};
use crate::net::NetError;
use crate::{config, console};

/// Runs the service of a hall.
///
/// Keeps its seats parked, its controllers monitored and its shows ready, until it is terminated.
///
/// Nothing moves without a command from a client, the web console or another surface. SIGTERM parks the seats and ends with 0;
/// SIGHUP reloads the configuration if nothing is armed.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue serve --config hall.toml
  kinocue serve --config hall.toml --socket ./control.sock --state ./state

Exit codes:
  0   ended by a signal, with the seats parked
  71  the system refused a socket, a thread or a folder
  75  another program holds the frame port
  78  the configuration is bad")]
pub(super) struct Args {
    /// The configuration of the hall.
    #[arg(long, value_name = "FILE", env = "KINOCUE_CONFIG")]
    config: PathBuf,
    /// The control socket.
    #[arg(long, value_name = "PATH", default_value = "/run/kinocue/control.sock")]
    socket: PathBuf,
    /// The stop socket, which takes only a stop [default: stop.sock beside the control socket].
    #[arg(long, value_name = "PATH")]
    stop_socket: Option<PathBuf>,
    /// The folder for settings that outlast a restart.
    #[arg(long, value_name = "DIR", default_value = "/var/lib/kinocue")]
    state: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let config = config::load(&args.config).or_exit(Exit::Config)?;
    let beside = || args.socket.with_file_name("stop.sock");
    let sockets =
        Sockets { control: args.socket.clone(), stop: args.stop_socket.clone().unwrap_or_else(beside) };
    let places = Places { config: args.config.clone(), state: args.state.clone(), sockets };
    let log = Log::start(print::tell).or_exit(Exit::System)?;
    let parts = Parts { config, places, pages: console::page, signals: signals()?, log: log.clone() };
    serve(parts, |_, addresses| {
        for address in addresses {
            let text = format!("the API and the console: http://{address}/");
            log.say(Line::new(Priority::Info, "listening", text));
        }
    })?;
    Ok(Exit::Done)
}

impl From<ServeError> for Failure {
    fn from(error: ServeError) -> Self {
        let exit = match &error {
            ServeError::Runtime(RuntimeError::Net(NetError::Refused { cause, .. }))
                if cause.kind() == std::io::ErrorKind::AddrInUse =>
            {
                Exit::TryAgain
            }
            _ => Exit::System,
        };
        Self { exit, error: error.into() }
    }
}
