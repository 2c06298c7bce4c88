//! `kinocue demo`: the main job with nothing to set up: the daemon with its console, over virtual controllers.

use std::env;
use std::io::{IsTerminal as _, stderr, stdin};
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::path::PathBuf;

use anyhow::Context as _;

use super::play;
use super::sim::SimFamily;
use super::token::{Token, link};
use super::{Exit, Failure, OrExit as _, print};
use crate::app::serve::{Parts, Places, serve};
use crate::app::supervisor::SystemSignals;
use crate::control::{Command, Role};
use crate::log::Log;
use crate::sys::own_folder::OwnFolder;
use crate::{config, console};

mod film;
mod screen;
mod script;
mod seats;
mod virtual_hall;

use film::DemoFilm;
use screen::Screen;
use script::{DemoShow, Script};
use virtual_hall::VirtualHall;

/// The cue as the report names it.
const CUE_NAME: &str = "cues/bench-ride.csv";
/// Its id in the library.
const CUE_ID: &str = "bench-ride";
const CUE: &str = include_str!("../../../cues/bench-ride.csv");

/// Plays the bench ride to virtual seats, with nothing to set up.
///
/// Runs the real daemon with its web console, and prints its address first. On a terminal the console stays up after the
/// ride until Ctrl-C, so that you can arm and go again. There are four controllers, two of which share one frame (PA95); or,
/// with --dialect, two seats on serial drives. The demo homes those first, as an operator homes real ones. Everything stays on
/// this machine, in a temporary folder that is removed at the end.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kinocue demo\n  kinocue demo --rate 1000 --json > report.json\n  kinocue demo --film film.mkv\n  \
                  kinocue demo --dialect silvermax"
)]
pub(super) struct Args {
    /// Ticks per second, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = super::load::parse_rate, default_value = "100")]
    rate: f64,
    /// What moves the seats: virtual controllers (smc, mbox), or virtual serial drives on pseudo-terminals.
    #[arg(long, value_enum, default_value_t = SimFamily::Smc)]
    dialect: SimFamily,
    /// Show this film with mpv, and play a gentle cue of the same length to it. Needs mpv.
    #[arg(long, value_name = "FILE")]
    film: Option<PathBuf>,
    /// Print the report as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let film = args.film.as_deref().map(DemoFilm::find).transpose()?;
    let signals = SystemSignals::default();
    play::leave_on_signals(&signals.leave).context("signals cannot be handled").or_system()?;
    let temporary = env::temp_dir();
    let no_folder = || format!("cannot make a folder in {}; set TMPDIR to another", temporary.display());
    let folder = OwnFolder::make(&temporary).with_context(no_folder).or_exit(Exit::Io)?;
    let port = FreePort::find().context("no port for the frames").or_system()?;
    let host = SocketAddrV4::new(Ipv4Addr::LOCALHOST, port.number);
    let seats = VirtualHall::start(args.dialect, host, &folder)?;
    let token = Token::new("visitor", Role::Engineer).or_system()?;
    let mut hall = seats::hall(args.rate, host, &seats.tables(&folder), &token.config, &folder);
    hall.extend(film.iter().map(DemoFilm::tables));
    let places = furnish(&folder, &hall, film.as_ref(), &seats)?;
    let (load, cue_name) = film.as_ref().map_or_else(|| bench_ride(&seats), DemoFilm::load);
    let config = config::load(&places.config).or_exit(Exit::Internal)?;
    let on_terminal = stdin().is_terminal() && stderr().is_terminal();
    let screen = Screen::new();
    let lines = screen.clone();
    let log = Log::start(move |line| lines.tell(line)).or_system()?;
    let parts = Parts { config, places, pages: console::page, signals: signals.clone(), log, pair: None };
    drop(port);
    let mut script = None;
    let served = serve(parts, |handle, addresses| {
        let console = addresses.first().map(|address| link(*address, &token.token)).unwrap_or_default();
        welcome(&seats, &console, cue_name);
        let show = DemoShow { needs_home: seats.needs_home(), load };
        script = Some(Script::start(handle, signals, screen, on_terminal.then_some(console), show));
    });
    // Over by now, as nothing of the hall is left.
    let guided = script.transpose().or_system()?.map_or(Ok(()), Script::finish);
    let reported = play::tell(&served?.sum_up(cue_name.to_owned()), args.json);
    seats.stop()?;
    folder.remove().context("the folder of the demo is left").or_exit(Exit::Io)?;
    guided.or_exit(Exit::Internal)?;
    reported
}

fn welcome(seats: &VirtualHall, console: &str, cue_name: &str) {
    print::tell(&format!("the console: {console}"));
    print::tell(&format!("playing {cue_name} to {}; nothing leaves this machine", seats.who()));
}

/// What loads the bench ride, and what is played then.
fn bench_ride(seats: &VirtualHall) -> (Command, &'static str) {
    let load = Command::Load { cue: CUE_ID.to_owned() };
    (load, if seats.vibrates() { CUE_NAME } else { "cues/bench-ride.csv without its vibration" })
}

/// A cue without the columns of vibration, which MBOX controllers do not have, and which is faster than what serial lines carry.
fn without_vibration(cue: &str) -> String {
    let is_row = |line: &&str| !line.starts_with('#');
    let header = cue.lines().find(is_row).unwrap_or_default();
    let kept: Vec<bool> = header.split(',').map(|name| !name.starts_with('v')).collect();
    let row = |line: &str| {
        let cells = line.split(',').zip(&kept).filter(|(_, kept)| **kept);
        cells.map(|(cell, _)| cell).collect::<Vec<_>>().join(",")
    };
    let lines = cue.lines().map(|line| if is_row(&line) { row(line) } else { line.to_owned() });
    lines.map(|line| line + "\n").collect()
}

/// Puts everything that the daemon reads where it reads it.
fn furnish(
    folder: &OwnFolder,
    hall: &str,
    film: Option<&DemoFilm>,
    seats: &VirtualHall,
) -> Result<Places, Failure> {
    let put = |name: &str, bytes: &[u8]| {
        folder
            .write(name, bytes)
            .with_context(|| format!("cannot write {name} of the demo"))
            .or_exit(Exit::Io)
    };
    let cue = if seats.vibrates() { CUE.to_owned() } else { without_vibration(CUE) };
    put(&format!("cues/{CUE_ID}.csv"), cue.as_bytes())?;
    for (name, text) in film.map(DemoFilm::files).into_iter().flatten() {
        put(&name, text.as_bytes())?;
    }
    let config = put("demo.toml", hall.as_bytes())?;
    let sockets = crate::app::surfaces::Sockets {
        control: folder.path("control.sock"),
        stop: folder.path("stop.sock"),
        fleet: folder.path("fleet.sock"),
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
