//! `kinocue draw-recording`: the process that the service has recordings drawn by.

use std::path::PathBuf;

use anyhow::Context as _;

use super::plot::RECORDING_COLUMNS;
use super::plot_recording::{Asked, picture};
use super::{Exit, Failure, OrExit as _, print};
use crate::library::{RecordingPicture, Sketch};
use crate::plot::{self, Theme};
use crate::sys::humble::{self, ProcessBounds};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The recording.
    recording: PathBuf,
    /// The seat; without it the one that was held back farthest.
    #[arg(long, value_name = "NAME")]
    seat: Option<String>,
    /// The most memory that it may take, MiB.
    #[arg(long, value_name = "N", default_value_t = 4096)]
    memory_mib: u64,
    /// The most processor time that it may take, s.
    #[arg(long, value_name = "N", default_value_t = 300)]
    seconds: u64,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let bounds =
        ProcessBounds { memory: args.memory_mib.saturating_mul(1 << 20), cpu_s: args.seconds.max(1) };
    humble::lower(bounds).context("cannot bound the drawing").or_exit(Exit::System)?;
    let asked = Asked {
        file: &args.recording,
        other: None,
        seat: args.seat.as_deref(),
        from: None,
        until: None,
        columns: RECORDING_COLUMNS,
        is_detailed: true,
    };
    let sketch = match picture(&asked) {
        Ok((picture, seat, seats)) => Sketch::Picture(Box::new(RecordingPicture {
            title: picture.title.clone(),
            sentence: picture.sentence.clone(),
            seat,
            seats,
            svg: plot::svg(&picture, Theme::Dark),
        })),
        Err(failure) => Sketch::Fault(failure.to_string()),
    };
    print::json(&sketch).map(|()| Exit::Done)
}
