use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;

use crate::app::film::{LtcSound, SAMPLES_PER_S, wav_header};
use crate::cli::{Exit, Failure, OrExit as _};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Makes timecode: into a file at once, or on stdout at the speed of a film.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// Linear timecode, as the sound of a WAV file.
    #[arg(long, required = true)]
    ltc: bool,
    /// Frames a second: 23.976, 24, 25, 29.97 or 30.
    #[arg(long, value_name = "N", default_value = "25")]
    film_fps: String,
    /// The first label; with a semicolon before the frames it drops.
    #[arg(long, value_name = "TIMECODE", default_value = "00:00:00:00")]
    tc_start: String,
    /// How long it lasts.
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: u32,
    /// The file [default: stdout].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// What is written at a time: 10 ms.
const BLOCK: u32 = SAMPLES_PER_S / 100;

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let mut sound = LtcSound::new(&args.film_fps, &args.tc_start).or_exit(Exit::Usage)?;
    let blocks = args.seconds * 100;
    if let Some(path) = &args.output {
        let header = wav_header(Some(blocks * BLOCK));
        let octets: Vec<u8> = header.into_iter().chain(octets(&mut sound, blocks * BLOCK)).collect();
        std::fs::write(path, octets).with_context(|| path.display().to_string()).or_exit(Exit::Io)?;
        return Ok(Exit::Done);
    }
    match stream(&mut sound, blocks) {
        // Whoever listened has heard enough.
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("stdout").or_exit(Exit::Io)
        }
        _ => Ok(Exit::Done),
    }
}

fn octets(sound: &mut LtcSound, samples: u32) -> Vec<u8> {
    sound.take(samples as usize).flat_map(i16::to_le_bytes).collect()
}

fn stream(sound: &mut LtcSound, blocks: u32) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(&wav_header(None))?;
    let begun = Monotonic.now();
    for block in 1..=blocks {
        Monotonic.sleep_until(begun + Duration::from_millis(10) * block);
        out.write_all(&octets(sound, BLOCK))?;
        out.flush()?;
    }
    Ok(())
}
