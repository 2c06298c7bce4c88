//! A play that is recorded: the thread behind the tap, and the file that it leaves.

use std::error::Error as _;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::thread::{Builder, JoinHandle};

use mcap::{McapError, McapResult};

use super::PlayReport;
use crate::config::{Config, Connection, Controller};
use crate::drive::Lane;
use crate::record::{
    About, EntryMaker, FrameKind, Intake, Judging, Mode, Opening, RecordedSeat, Recorder, Recording,
    SAMPLE_HZ, Taps,
};
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
use crate::time::Rate;

type FileRecorder = Recorder<BufWriter<File>>;

/// What a play is recorded by.
#[derive(Debug)]
pub(super) struct PlayRecording {
    path: PathBuf,
    /// Its name until it is whole.
    part: PathBuf,
    thread: JoinHandle<McapResult<FileRecorder>>,
}

impl PlayRecording {
    /// Begins a file, and has a thread write to it what comes through the taps.
    ///
    /// # Errors
    /// Where there is such a file, or what an earlier recording to it left, and where the system refuses.
    pub(super) fn start(
        path: &Path,
        about: &About,
        judging: &Judging,
        seats: Vec<RecordedSeat>,
        rate: Rate,
    ) -> io::Result<(Taps, Self)> {
        if path.try_exists()? {
            return Err(taken("there is such a file; give another name".to_owned()));
        }
        let part = path.with_extension("part.mcap");
        if part.try_exists()? {
            let part = part.display();
            return Err(taken(format!(
                "{part} is left of an earlier one; save it with kinocue record recover, or remove it"
            )));
        }
        let out = BufWriter::new(File::create_new(&part)?);
        let opening = Opening::new(about, &seats).judged(judging);
        let file =
            Recording::open(out, &opening, EntryMaker::new(seats.len(), about.clocks)).map_err(in_io)?;
        let (taps, intake) = Intake::new(seats, rate, SAMPLE_HZ);
        let intake = if about.mode == Mode::Full { intake.in_full() } else { intake };
        let recorder = Recorder::new(intake, file);
        let thread = Builder::new().name("recorder".to_owned()).spawn(move || {
            realtime::stand_back();
            recorder.run(&Monotonic)
        })?;
        Ok((taps, Self { path: path.to_owned(), part, thread }))
    }

    /// Ends the file, the tick thread having ended, with the report if there is one.
    ///
    /// # Errors
    /// Why there is no whole file, in a sentence; what was written until then stays.
    pub(super) fn finish(self, report: Option<&PlayReport>) -> Result<(), String> {
        let Self { path, part, thread } = self;
        let finish = || {
            let recorder = thread.join().map_err(|_| io::Error::other("its thread panicked"))?;
            let report = report.map(serde_json::to_vec).transpose()?;
            let out = recorder.and_then(|recorder| recorder.finish(report.as_deref())).map_err(in_io)?;
            out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
            fs::rename(&part, &path)
        };
        finish().map_err(|error| {
            let part = part.display();
            format!("the recording ended early: {error}; {part} has what was recorded until then")
        })
    }
}

fn taken(why: String) -> io::Error {
    io::Error::new(io::ErrorKind::AlreadyExists, why)
}

pub(super) fn in_io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        // It words a write that failed inside a record as one that cannot be parsed; below it is what the system said.
        other => io::Error::other(other.source().map_or_else(|| other.to_string(), ToString::to_string)),
    }
}

/// The seats of lanes, in their order.
pub(crate) fn seats(config: &Config, lanes: &[Lane]) -> Vec<RecordedSeat> {
    let frames = |connection: &Connection| match connection {
        Connection::Udp(station) => FrameKind::Datagram(station.vibration_port),
        Connection::Link(_) => FrameKind::Pose,
    };
    let seat = |(one, lane): (&Controller, &Lane)| {
        let seat = RecordedSeat::new(&one.name, &lane.window, frames(&one.connection));
        match &one.connection {
            Connection::Udp(station) => seat.at(station.address.to_string()),
            Connection::Link(_) => seat,
        }
    };
    config.controllers.iter().zip(lanes).map(seat).collect()
}
