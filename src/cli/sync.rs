//! `kinocue sync`: timecode, and the sound of films, for technicians and tests.

use super::{Exit, Failure};

mod check;
mod index;
mod send;
mod watch;

const EXAMPLES: &str = "\
Examples:
  kinocue sync send --ltc --film-fps 25 --tc-start 01:00:00:00 --seconds 60 -o reel.wav
  kinocue sync check reel.wav
  kinocue sync send --artnet 10.0.0.255 --film-fps 24
  kinocue sync index film.mkv -o film.kidx
  kinocue sync watch sound:alsa:hw:2,0,index=film.kidx,index=trailer.kidx
  kinocue sync watch artnet:10.0.0.20 mtc:/dev/snd/midiC1D0
  kinocue sync send --ltc --seconds 60 | kinocue play cues/bench-ride.csv --to 127.0.0.1:7408 --chase ltc:-";

/// Makes timecode and indexes of films' sound, and says what is heard of a film, or is in a recording.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    Send(send::Args),
    Check(check::Args),
    Index(index::Args),
    Watch(watch::Args),
}

pub(super) fn run(Args { command }: &Args) -> Result<Exit, Failure> {
    match command {
        Command::Send(args) => send::run(args),
        Command::Check(args) => check::run(args),
        Command::Index(args) => index::run(args),
        Command::Watch(args) => watch::run(args),
    }
}
