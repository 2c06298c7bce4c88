use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use crate::app::film::FilmReader;
use crate::cli::{Exit, Failure, exit, print};
use crate::film::source::{FilmArgs, FilmSource};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Reads timecode devices for services that may not open them.
///
/// Passes each line on at a socket of its own, ltc.sock or mtc.sock, to up to eight halls on this machine. Their source is
/// ltc:relay:SOCKET or mtc:relay:SOCKET. It waits for a device that is gone, and ends once every line has ended.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kinocue sync relay ltc:alsa:hw:2,0 --folder /tmp")]
pub(in crate::cli) struct Args {
    /// One line of LTC, one of MIDI timecode, or both, as for `play --chase`.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<FilmSource>,
    /// The folder of the sockets; everybody with access to it may read the timecode.
    #[arg(long, value_name = "DIR", default_value = "/run/kinocue-sync")]
    folder: PathBuf,
}

/// How often it is looked what is wrong.
const EVERY: Duration = Duration::from_millis(500);

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let sources: Vec<FilmArgs> = args.sources.iter().cloned().map(FilmArgs::of).collect();
    let reader = FilmReader::relay(&sources, &args.folder).map_err(exit::of_film)?;
    let (table, mut said) = (reader.table(), BTreeMap::new());
    let mut at = Monotonic.now();
    loop {
        let now = table.read();
        for row in now.sources {
            let words =
                row.notes.trouble.map_or_else(|| "read".to_owned(), |trouble| format!("not read: {trouble}"));
            if said.get(&row.source) != Some(&words) {
                print::tell(&format!("{}: {words}", row.source));
                said.insert(row.source, words);
            }
        }
        if now.over {
            print::tell("nothing left to relay: every line has ended");
            return Ok(Exit::Done);
        }
        at = at + EVERY;
        Monotonic.sleep_until(at);
    }
}
