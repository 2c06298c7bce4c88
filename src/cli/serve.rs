//! `kinocue serve`: the daemon.

use std::fs;
use std::path::PathBuf;

use anyhow::Context as _;

use super::rehearsal::Rehearsal;
use super::token::link;
use super::{Exit, Failure, OrExit as _, exit, load, metres, places, print};
use crate::api::ApiError;
use crate::app::pair::{PairError, PairPlaces, StoodBy, stand_by};
use crate::app::serve::{Parts, Places, ServeError, serve, signals};
use crate::app::surfaces::{Sockets, SurfaceError};
use crate::console;
use crate::log::{Line, Log, Priority};

/// Runs the service of a hall.
///
/// Keeps its seats parked, its controllers monitored and its shows ready, until it is terminated.
///
/// Nothing moves without a command from a client, the web console or another surface. SIGTERM parks the seats and ends with 0;
/// SIGHUP reloads the configuration if nothing is armed.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("hall").required(true).multiple(true).args(["config", "rehearse"])))]
#[command(after_help = "\
Examples:
  kinocue serve --rehearse                                 two rows of simulated seats, to rehearse on a laptop
  kinocue serve --config examples/hall.toml --rehearse     the same with a configuration on 127.0.0.1
  kinocue serve --config /etc/kinocue/kinocue.toml         a hall, as its unit starts it

An ordinary user has settings, library, playlists, journal and recordings in ~/.local/state/kinocue ($XDG_STATE_HOME), and the
sockets in $XDG_RUNTIME_DIR/kinocue, where the commands look for them; --state moves all but the sockets. Folders that the
configuration names stay as they are.

Exit codes:
  0   ended by a signal, with the seats parked
  66  the configuration is missing
  71  the system refused a socket, a thread or a folder
  75  another program holds the frame port, a socket or a port of the API; or, with [pair], this machine has lost the lead
  78  the configuration is bad, or the key of [pair]
  79  another master sends to the seats")]
pub(super) struct Args {
    /// The configuration of the hall.
    #[arg(long, value_name = "FILE", env = "KINOCUE_CONFIG")]
    config: Option<PathBuf>,
    /// Simulate every controller in this program; nothing leaves the machine. Without --config: two rows of four seats, with two cues
    /// and a playlist.
    #[arg(long)]
    rehearse: bool,
    /// The control socket [default: /run/kinocue/control.sock, or of an ordinary user $XDG_RUNTIME_DIR/kinocue/control.sock].
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
    /// The stop socket, which takes only a stop [default: stop.sock beside the control socket].
    #[arg(long, value_name = "PATH")]
    stop_socket: Option<PathBuf>,
    /// The socket of `kinocue fleet link`, where the configuration has `[fleet]` [default: fleet.sock beside the control socket]; its
    /// stops have fleet-stop.sock beside it.
    #[arg(long, value_name = "PATH")]
    fleet_socket: Option<PathBuf>,
    /// The folder for settings, library, playlists, journal and recordings [default: /var/lib/kinocue, with the journal in
    /// /var/log/kinocue; of an ordinary user ~/.local/state/kinocue].
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let state = args.state.clone().unwrap_or_else(places::state);
    // Until the service has ended.
    let rehearsal = args.rehearse.then(|| Rehearsal::begin(args.config.as_deref(), &state)).transpose()?;
    let path = rehearsal.as_ref().map(|rehearsal| rehearsal.config.clone()).or_else(|| args.config.clone());
    let path = path.unwrap_or_default(); // clap requires one of both
    let config = load::config(&path)?.kept_in(&state);
    let control = args.socket.clone().unwrap_or_else(places::control_socket);
    if args.socket.is_none()
        && let Some(folder) = control.parent()
    {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string()).or_system()?;
    }
    let beside = || control.with_file_name("stop.sock");
    let fleet = args.fleet_socket.clone().unwrap_or_else(|| control.with_file_name("fleet.sock"));
    let sockets = Sockets { stop: args.stop_socket.clone().unwrap_or_else(beside), fleet, control };
    let places = Places { config: path, state, sockets };
    let log = Log::start(print::tell).or_system()?;
    for text in metres::of_hall(&config) {
        log.say(Line::new(Priority::Warning, "metres", text));
    }
    let signals = signals()?;
    let mut pair = None;
    if let Some(machines) = &config.pair {
        let Places { config: file, state, sockets } = &places;
        let of_pair = PairPlaces { config: file, state, control: &sockets.control, fleet: &sockets.fleet };
        match stand_by(&config, machines, &of_pair, &signals.leave, &log)? {
            StoodBy::Leads(leads) => pair = Some(leads),
            StoodBy::Ended => return Ok(Exit::Done),
        }
    }
    let parts = Parts { config, places, pages: console::page, signals, log: log.clone(), pair };
    serve(parts, |_, addresses| {
        for address in addresses {
            let text = format!("the API and the console: http://{address}/");
            log.say(Line::new(Priority::Info, "listening", text));
        }
        if let (Some(rehearsal), Some(address)) = (&rehearsal, addresses.first()) {
            print::tell(&format!("to rehearse, with all rights: {}", link(*address, &rehearsal.token)));
        }
    })?;
    Ok(Exit::Done)
}

impl From<ServeError> for Failure {
    fn from(error: ServeError) -> Self {
        let exit = match &error {
            ServeError::Surface(SurfaceError::Api(ApiError::Served { .. })) => Exit::TryAgain,
            ServeError::OtherMaster(_) => Exit::OtherMaster,
            ServeError::OneFolder(_) => Exit::Config,
            _ => exit::of_system(&error),
        };
        Self { exit, error: error.into() }
    }
}

impl From<PairError> for Failure {
    fn from(error: PairError) -> Self {
        let exit = match &error {
            PairError::Key(_) => Exit::Config,
            PairError::Socket(ApiError::Served { .. }) => Exit::TryAgain,
            _ => exit::of_system(&error),
        };
        Self { exit, error: error.into() }
    }
}
