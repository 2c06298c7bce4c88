//! A CSV file that is written row by row.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::net::SocketAddrV4;
use std::time::Duration;

use crate::motion::{MAX_AXES, Pulses};

/// Writes the rows. After the first failure it writes no more, and says so when it is closed.
#[derive(Debug)]
pub(super) struct Sheet {
    out: BufWriter<File>,
    /// The row at work.
    pub(super) row: String,
    failed: Option<io::Error>,
}

impl Sheet {
    /// A sheet that begins with a header row: these columns, and one for each axis of each kind of position. What was in
    /// the file is gone.
    pub(super) fn new(file: File, columns: &str, positions: [&str; 2]) -> Self {
        let _ = file.set_len(0); // a pipe has nothing to cut
        let row = String::with_capacity(512);
        let mut sheet = Self { out: BufWriter::new(file), row, failed: None };
        sheet.row.push_str(columns);
        for kind in positions {
            for axis in 1..=MAX_AXES {
                let _ = write!(sheet.row, ",{kind}_{axis}"); // writing to a String cannot fail
            }
        }
        sheet.end_row();
        sheet
    }

    /// Begins a row with an instant, counted from the start, and a controller.
    pub(super) fn start_row(&mut self, since: Duration, controller: SocketAddrV4) {
        let _ = write!(self.row, "{}.{:06},{controller}", since.as_secs(), since.subsec_micros());
    }

    /// Appends a cell for each axis that there could be, empty for those that are not.
    pub(super) fn positions(&mut self, positions: &[Pulses]) {
        for axis in 0..MAX_AXES {
            self.row.push(',');
            if let Some(position) = positions.get(axis) {
                let _ = write!(self.row, "{}", position.0);
            }
        }
    }

    /// Writes the row.
    pub(super) fn end_row(&mut self) {
        self.row.push('\n');
        if self.failed.is_none() {
            self.failed = self.out.write_all(self.row.as_bytes()).err();
        }
        self.row.clear();
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
}
