use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Context as _, anyhow};

use crate::app::film::{LtcFound, look_for_ltc};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::sys;

/// Checks the timecode in a WAV file: its labels, gaps, jumps and level.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kinocue sync check reel.wav")]
pub(in crate::cli) struct Args {
    /// The file: 16 bits, as WAV, RF64 or W64. Of its channels the first that has timecode is read.
    file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// The longest recording that is read: some hours of sound.
const LONGEST: u64 = 4 << 30;

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let path = args.file.display();
    let octets =
        sys::file::read(&args.file, LONGEST).with_context(|| path.to_string()).or_exit(Exit::NoInput)?;
    let found = look_for_ltc(&octets).with_context(|| path.to_string()).or_exit(Exit::BadCue)?;
    if args.json {
        print::json(&found)?;
    } else {
        print::out(&text(&found))?;
    }
    if found.frames == 0 {
        let place = if found.channels == 1 {
            "it".to_owned()
        } else {
            format!("any of its {} channels", found.channels)
        };
        return Err(anyhow!("{path}: no timecode in {place}")).or_exit(Exit::BadCue);
    }
    Ok(Exit::Done)
}

fn text(found: &LtcFound) -> String {
    let LtcFound { frames, first, last, fps, level_db, jumps, backwards, seconds, channel, channels } = found;
    let mut text = format!("{seconds:.1} s of sound, {frames} frames of timecode");
    if let (Some(first), Some(last)) = (first, last) {
        let fps = fps.map_or("?".to_owned(), |fps| format!("{fps:.3}"));
        let _ = write!(text, " from {first} to {last}, {fps} a second, {level_db:.0} dBFS"); // a String takes it
        let _ = write!(text, "\n{jumps} jumps or gaps, {backwards} frames backwards");
        if *channel > 1 {
            let _ = write!(
                text,
                "\nin channel {channel} of {channels}, and none before it: set channel = {channel} in [sync.ltc]"
            );
        }
    }
    text + "\n"
}
