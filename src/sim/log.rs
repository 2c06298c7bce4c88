//! The log of virtual controllers: a CSV row for each motion frame, with where the motors were when it came.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::net::SocketAddrV4;
use std::time::Duration;

use super::MotionSeen;
use crate::motion::{MAX_AXES, Pulses};

/// Writes the rows. After the first failure it writes no more, and says so when it is closed.
#[derive(Debug)]
pub(super) struct Log {
    out: BufWriter<File>,
    row: String,
    failed: Option<io::Error>,
}

impl Log {
    /// A log that begins with its header row; what was in the file is gone.
    pub(super) fn new(file: File) -> Self {
        let _ = file.set_len(0); // a pipe has nothing to cut
        let mut log = Self { out: BufWriter::new(file), row: String::with_capacity(512), failed: None };
        log.row.push_str("time_s,controller,frame,function,time_ms,reply,outputs");
        for kind in ["commanded", "executed"] {
            for axis in 1..=MAX_AXES {
                let _ = write!(log.row, ",{kind}_{axis}"); // writing to a String cannot fail
            }
        }
        log.end_row();
        log
    }

    /// A motion frame, `answered` with its x or not, and where the motors were. `since` is the time since the start.
    pub(super) fn frame(
        &mut self,
        since: Duration,
        controller: SocketAddrV4,
        seen: &MotionSeen,
        answered: bool,
        executed: &[Pulses],
    ) {
        let request = &seen.request;
        self.start_row(since, controller);
        let (frame, function, time_ms) = (request.frame, request.function(), request.time_ms);
        let _ = write!(self.row, ",{frame},0x{function:04x},{time_ms},");
        if answered {
            let _ = write!(self.row, "{}", seen.code as u8);
        }
        let _ = write!(self.row, ",0x{:04x}", request.outputs);
        self.positions(&request.positions);
        self.positions(executed);
        self.end_row();
    }

    /// Where the motors of a controller are at the end, and its outputs.
    pub(super) fn rest(
        &mut self,
        since: Duration,
        controller: SocketAddrV4,
        outputs: u16,
        executed: &[Pulses],
    ) {
        self.start_row(since, controller);
        let _ = write!(self.row, ",,,,,0x{outputs:04x}");
        self.positions(&[]);
        self.positions(executed);
        self.end_row();
    }

    /// Writes what is still held back.
    ///
    /// # Errors
    /// The first failure there was.
    pub(super) fn close(mut self) -> io::Result<()> {
        match self.failed.take() {
            Some(error) => Err(error),
            None => self.out.flush(),
        }
    }

    fn start_row(&mut self, since: Duration, controller: SocketAddrV4) {
        let _ = write!(self.row, "{}.{:06},{controller}", since.as_secs(), since.subsec_micros());
    }

    fn positions(&mut self, positions: &[Pulses]) {
        for axis in 0..MAX_AXES {
            self.row.push(',');
            if let Some(position) = positions.get(axis) {
                let _ = write!(self.row, "{}", position.0);
            }
        }
    }

    fn end_row(&mut self) {
        self.row.push('\n');
        if self.failed.is_none() {
            self.failed = self.out.write_all(self.row.as_bytes()).err();
        }
        self.row.clear();
    }
}
