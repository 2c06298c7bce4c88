//! Where the rows of a cue came from, kept small: a line number is stored only where the count of lines jumps.

use std::fs::File;
use std::io::{self, Read};
use std::os::unix::fs::FileExt as _;
use std::path::PathBuf;
use std::sync::Arc;

use super::declared::HeadLine;
use super::fault::Place;
use super::table::{Lines, Splitter, column_of};
use crate::motion::MAX_AXES;
use crate::sys;
use crate::time::ShowTime;

/// Where the rows of a cue came from.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Origin {
    /// Lines of a text file.
    Text {
        /// A row and its line, wherever it is not the line after the row before.
        jumps: Vec<(usize, u64)>,
        /// The cell of each axis in its line, from 0.
        cells: [usize; MAX_AXES],
    },
    /// Messages of an MCAP file, one a row.
    Messages,
    /// Bytes, so many a row.
    Bytes(usize),
}

/// The file of a cue, which is read again where somebody asks for a place in it.
#[derive(Debug, Clone)]
pub(super) struct CueFile {
    pub(super) path: PathBuf,
    /// It as it was opened: for whoever may open nothing any more.
    pub(super) kept: Option<Arc<File>>,
}

impl PartialEq for CueFile {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

impl CueFile {
    /// Its text from the begin; what is kept of it stays where it was read to.
    fn lines(&self) -> Option<Lines<Box<dyn Read + '_>>> {
        let input: Box<dyn Read + '_> = match &self.kept {
            Some(file) => Box::new(FromStart { file, at: 0 }),
            None => Box::new(sys::file::open(&self.path).ok()?),
        };
        Some(Lines::new(input))
    }
}

/// An open file from its begin.
struct FromStart<'f> {
    file: &'f File,
    at: u64,
}

impl Read for FromStart<'_> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        let len = self.file.read_at(buf, self.at)?;
        self.at += len as u64;
        Ok(len)
    }
}

impl Default for Origin {
    fn default() -> Self {
        Self::Text { jumps: Vec::new(), cells: [0; MAX_AXES] }
    }
}

impl Origin {
    /// Notes the line of the next row, the `row`-th from 0.
    pub(super) fn push_line(&mut self, row: usize, line: u64) {
        let follows = row > 0 && self.line(row - 1) + 1 == line;
        if let Self::Text { jumps, .. } = self
            && !follows
        {
            jumps.push((row, line));
        }
    }

    /// The line of a row, or its number from 1 where the file has no lines.
    #[must_use]
    pub(super) fn line(&self, row: usize) -> u64 {
        match self {
            Self::Text { jumps, .. } => {
                let after = jumps.partition_point(|(first, _)| *first <= row);
                after.checked_sub(1).map_or(1, |i| jumps[i].1 + (row - jumps[i].0) as u64)
            }
            Self::Messages | Self::Bytes(_) => row as u64 + 1,
        }
    }

    pub(super) fn place(&self, file: &CueFile, row: usize, axis: usize, time: ShowTime) -> Place {
        match self {
            Self::Text { cells, .. } => {
                let line = self.line(row);
                let cell = cells.get(axis).copied().unwrap_or(0);
                Place::Text { line, column: column_in_file(file, line, cell).unwrap_or(1) }
            }
            Self::Messages => Place::Message {
                topic: "/cue/axes",
                number: self.line(row),
                log_time: time.as_nanos().unsigned_abs(),
            },
            Self::Bytes(axes) => Place::Byte((row * axes + axis) as u64),
        }
    }

    /// Where the header names a column, or its cell in a row; the file as a whole where there is no such header.
    pub(super) fn column_place(&self, file: &CueFile, column: &str, row: Option<usize>) -> Place {
        let Self::Text { .. } = self else { return Place::File };
        let Some((header, cell)) = column_in_header(file, column) else { return Place::File };
        let line = row.map_or(header, |row| self.line(row));
        column_in_file(file, line, cell).map_or(Place::File, |column| Place::Text { line, column })
    }
}

/// The line of the header, and which of its cells names a column.
fn column_in_header(file: &CueFile, column: &str) -> Option<(u64, usize)> {
    let mut lines = file.lines()?;
    loop {
        let (number, text) = lines.next().ok()??;
        if HeadLine::of(text) != HeadLine::Header {
            continue;
        }
        let mut splitter = Splitter::new();
        let cells = splitter.split(text).ok()?;
        return Some((
            number,
            (0..cells.count()).find(|&index| cells.get(index).eq_ignore_ascii_case(column))?,
        ));
    }
}

fn column_in_file(file: &CueFile, line: u64, cell: usize) -> Option<u64> {
    let mut lines = file.lines()?;
    loop {
        let (number, text) = lines.next().ok()??;
        if number >= line {
            return (number == line).then(|| column_of(text, cell));
        }
    }
}
