//! `kinocue sync`: the film that a running hall follows; timecode and the sound of films, for technicians and tests.

use super::client::{ServerArgs, UseArgs, choose_film_source, show_film};
use super::{Exit, Failure, OrExit as _};
use crate::film::source::{FilmArgs, FilmSource};

mod calibrate;
mod check;
mod index;
mod relay;
mod send;
mod watch;

const EXAMPLES: &str = "\
Examples:
  kinocue sync
  kinocue sync --json | jq .error_ms
  kinocue sync use artnet
  kinocue sync use auto
  kinocue sync send --ltc --film-fps 25 --tc-start 01:00:00:00 --seconds 60 -o reel.wav
  kinocue sync check reel.wav
  kinocue sync send --artnet 127.0.0.1 --film-fps 24
  kinocue sync index film.mkv -o film.kidx
  kinocue sync watch sound:alsa:hw:2,0,index=film.kidx,index=trailer.kidx
  kinocue sync watch artnet:127.0.0.1 mtc:/dev/snd/midiC1D0
  kinocue sync relay ltc:alsa:hw:2,0 --folder /tmp
  kinocue sync calibrate ltc:alsa:hw:2,0 --against mpv:/run/user/1000/film.sock
  kinocue sync send --ltc --seconds 60 | kinocue play cues/bench-ride.csv --to 127.0.0.1:7408 --chase ltc:-";

/// Shows and tests film sync; makes timecode and indexes of sound.
///
/// Without a command it shows the film of the running service: each source with its position and quality, which source leads, and
/// how far the seats are from the film. On a terminal it runs until Ctrl-C, elsewhere it prints once.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
pub(super) struct Args {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    command: Option<SyncCommand>,
}

#[derive(Debug, clap::Subcommand)]
enum SyncCommand {
    Use(UseArgs),
    Send(send::Args),
    Check(check::Args),
    Index(index::Args),
    Watch(watch::Args),
    Relay(relay::Args),
    Calibrate(calibrate::Args),
}

/// How a film is labelled.
#[derive(Debug, clap::Args)]
struct LabelArgs {
    /// Frame rate of the film: 23.976, 24, 25, 29.97 or 30 [default: as received].
    #[arg(long, value_name = "N")]
    film_fps: Option<String>,
    /// The timecode at which the cue, or the test reel, begins, HH:MM:SS:FF [default: 00:00:00:00].
    #[arg(long, value_name = "TIMECODE")]
    tc_start: Option<String>,
}

impl LabelArgs {
    /// A source whose film is labelled so.
    fn of(&self, source: &FilmSource) -> Result<FilmArgs, Failure> {
        FilmArgs::new(source.clone(), self.film_fps.as_deref(), self.tc_start.as_deref()).or_exit(Exit::Usage)
    }
}

pub(super) fn run(Args { server, command }: &Args) -> Result<Exit, Failure> {
    match command {
        None => show_film(server),
        Some(SyncCommand::Use(args)) => choose_film_source(args),
        Some(SyncCommand::Send(args)) => send::run(args),
        Some(SyncCommand::Check(args)) => check::run(args),
        Some(SyncCommand::Index(args)) => index::run(args),
        Some(SyncCommand::Watch(args)) => watch::run(args),
        Some(SyncCommand::Relay(args)) => relay::run(args),
        Some(SyncCommand::Calibrate(args)) => calibrate::run(args),
    }
}
