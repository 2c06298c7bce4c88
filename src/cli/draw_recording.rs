//! `kinocue draw-recording`: the process that the service has recordings drawn by.

use std::path::PathBuf;

use super::bounds::{BoundsArgs, confine};
use super::plot::RECORDING_COLUMNS;
use super::plot_recording::{Asked, OpenRecording, picture};
use super::{Exit, Failure, print};
use crate::library::{RecordingPicture, Sketch};
use crate::plot::{self, Theme};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The recording.
    recording: PathBuf,
    /// The seat; without it the one that was held back farthest.
    #[arg(long, value_name = "NAME")]
    seat: Option<String>,
    #[command(flatten)]
    bounds: BoundsArgs,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    args.bounds.lower("the drawing")?;
    let opened = OpenRecording::open_ours(&args.recording);
    confine();
    let file = match opened {
        Ok(file) => file,
        Err(failure) => return print::json(&Sketch::Fault(failure.to_string())).map(|()| Exit::Done),
    };
    let asked = Asked {
        file: &file,
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
