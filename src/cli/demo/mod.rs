//! `kinocue demo`: the main job with nothing to set up: the daemon with its console, over virtual controllers.

use std::env;
use std::io::{IsTerminal as _, stderr, stdin};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::path::PathBuf;

use anyhow::Context as _;

use super::play;
use super::token::Token;
use super::{Exit, Failure, OrExit as _, print};
use crate::app::serve::{Parts, Places, serve};
use crate::app::supervisor::SystemSignals;
use crate::control::Role;
use crate::log::Log;
use crate::sim::{Farm, Options};
use crate::sys::own_folder::OwnFolder;
use crate::{config, console};

mod film;
mod screen;
mod script;
mod seats;

use film::DemoFilm;
use screen::Screen;
use script::Script;
use seats::SEATS;

/// The cue as the report names it.
const CUE_NAME: &str = "cues/bench-ride.csv";
/// Its id in the library.
const CUE_ID: &str = "bench-ride";
const CUE: &[u8] = include_bytes!("../../../cues/bench-ride.csv");

/// Plays the bench ride to four virtual controllers, with nothing to set up.
///
/// It is the daemon itself, with its web console, whose address is printed at once. On a terminal the console stays up after the
/// ride until Ctrl-C, to arm and go again there. Two of the controllers are a pair that shares one frame (PA95). Everything
/// stays on this machine, in a folder that is gone at the end.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kinocue demo\n  kinocue demo --rate 1000 --json > report.json\n  kinocue demo --film film.mkv"
)]
pub(super) struct Args {
    /// Ticks per second, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = super::load::parse_rate, default_value = "100")]
    rate: f64,
    /// Show this film with mpv, and play a gentle cue of its length to it. mpv has to be installed.
    #[arg(long, value_name = "FILE")]
    film: Option<PathBuf>,
    /// Print the report as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let film = args.film.as_deref().map(DemoFilm::find).transpose()?;
    let signals = SystemSignals::default();
    play::leave_on_signals(&signals.leave).context("signals cannot be handled").or_exit(Exit::System)?;
    let temporary = env::temp_dir();
    let no_folder = || format!("cannot make a folder in {}; set TMPDIR to another", temporary.display());
    let folder = OwnFolder::make(&temporary).with_context(no_folder).or_exit(Exit::Io)?;
    let port = FreePort::find().context("no port for the frames").or_exit(Exit::System)?;
    let host = SocketAddrV4::new(Ipv4Addr::LOCALHOST, port.number);
    let setups = SEATS.iter().map(|seat| seat.setup(host)).collect();
    let farm = Farm::start(Options::loopback(setups)).or_exit(Exit::System)?;
    let token = Token::new("visitor", Role::Engineer).or_exit(Exit::System)?;
    let mut hall = seats::hall(args.rate, host, &farm.addresses(), &token.config, &folder);
    hall.extend(film.iter().map(DemoFilm::tables));
    let places = furnish(&folder, &hall, film.as_ref())?;
    let (load, cue_name) = film.as_ref().map_or_else(DemoFilm::none, DemoFilm::load);
    let config = config::load(&places.config).or_exit(Exit::Internal)?;
    let on_terminal = stdin().is_terminal() && stderr().is_terminal();
    let screen = Screen::new();
    let lines = screen.clone();
    let log = Log::start(move |line| lines.tell(line)).or_exit(Exit::System)?;
    let parts = Parts { config, places, pages: console::page, signals: signals.clone(), log };
    drop(port);
    let mut script = None;
    let served = serve(parts, |handle, addresses| {
        let console = addresses.first().map(|address| link(*address, &token.token)).unwrap_or_default();
        welcome(&farm.addresses(), &console, cue_name);
        script = Some(Script::start(handle, signals, screen, on_terminal.then_some(console), load));
    });
    // Over by now, as nothing of the hall is left.
    let guided = script.transpose().or_exit(Exit::System)?.map_or(Ok(()), Script::finish);
    let reported = play::tell(&served?.sum_up(cue_name.to_owned()), args.json);
    farm.stop().or_exit(Exit::Io)?;
    folder.remove().context("the folder of the demo is left").or_exit(Exit::Io)?;
    guided.or_exit(Exit::Internal)?;
    reported
}

/// The console with the token in the fragment, which no browser sends anywhere.
fn link(address: SocketAddr, token: &str) -> String {
    format!("http://{address}/#token={token}")
}

fn welcome(controllers: &[SocketAddrV4], console: &str, cue_name: &str) {
    let names = SEATS.iter().zip(controllers).map(|(seat, address)| format!("{} {address}", seat.name));
    let controllers: Vec<String> = names.collect();
    print::tell(&format!("the console: {console}"));
    print::tell(&format!(
        "playing {cue_name} to virtual controllers {}; nothing leaves this machine",
        controllers.join(", ")
    ));
}

/// Puts everything that the daemon reads where it reads it.
fn furnish(folder: &OwnFolder, hall: &str, film: Option<&DemoFilm>) -> Result<Places, Failure> {
    let put = |name: &str, bytes: &[u8]| {
        folder
            .write(name, bytes)
            .with_context(|| format!("cannot write {name} of the demo"))
            .or_exit(Exit::Io)
    };
    put(&format!("cues/{CUE_ID}.csv"), CUE)?;
    for (name, text) in film.map(DemoFilm::files).into_iter().flatten() {
        put(&name, text.as_bytes())?;
    }
    let config = put("demo.toml", hall.as_bytes())?;
    let sockets = crate::app::surfaces::Sockets {
        control: folder.path("control.sock"),
        stop: folder.path("stop.sock"),
    };
    Ok(Places { config, state: folder.path("state"), sockets })
}

/// A port for the frames, kept from others while the controllers are told of it.
struct FreePort {
    number: u16,
    _held: UdpSocket,
}

impl FreePort {
    fn find() -> std::io::Result<Self> {
        let held = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        Ok(Self { number: held.local_addr()?.port(), _held: held })
    }
}
