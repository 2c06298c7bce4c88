//! A text file as lines and cells, read once from front to back; no more than a line of it is ever in memory.

use std::cmp::Ordering;
use std::io::{BufRead as _, BufReader, Read};
use std::ops::ControlFlow;

use super::fault::{Collector, Place};
use super::limits::{MAX_FILE, MAX_LINE};
use super::problem::Problem;

/// Room for more cells than any header can have; a line with more is wrong in any case.
const MAX_CELLS: usize = 128;
const BUFFER: usize = 256 * 1024;
const BOM: &[u8] = b"\xef\xbb\xbf";

/// What is wrong with a line, and whether reading can go on behind it.
#[derive(Debug)]
pub(super) struct LineFault {
    pub(super) place: Place,
    pub(super) problem: Problem,
    pub(super) fatal: bool,
}

/// The lines of a file.
pub(super) struct Lines<R> {
    input: BufReader<R>,
    line: Vec<u8>,
    number: u64,
    bytes: u64,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(input: R) -> Self {
        Self { input: BufReader::with_capacity(BUFFER, input), line: Vec::new(), number: 0, bytes: 0 }
    }

    /// The next line that is not blank, as a row of empty cells is too, and its number from 1; nothing at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<(u64, &str)>, LineFault> {
        while self.read()? {
            if !is_blank(&self.line) {
                let number = self.number;
                return self.checked().map(|text| Some((number, text)));
            }
        }
        Ok(None)
    }

    /// Hands every line to come to `take` until that breaks off or reading cannot go on; lines that are none go to
    /// `faults`.
    pub(super) fn each(
        &mut self,
        faults: &mut Collector,
        mut take: impl FnMut(u64, &str, &mut Collector) -> ControlFlow<()>,
    ) {
        loop {
            let flow = match self.next() {
                Ok(Some((number, line))) => take(number, line, faults),
                Ok(None) => ControlFlow::Break(()),
                Err(LineFault { place, problem, fatal }) => {
                    faults.add(place, None, problem);
                    if fatal { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                }
            };
            if flow.is_break() {
                return;
            }
        }
    }

    /// Reads one line and takes off its end; false at the end of the file.
    fn read(&mut self) -> Result<bool, LineFault> {
        self.line.clear();
        self.number += 1;
        let most = MAX_LINE as u64 + 2; // its LF and CR
        match self.input.by_ref().take(most).read_until(b'\n', &mut self.line) {
            Ok(0) => return Ok(false),
            Ok(bytes) => self.bytes += bytes as u64,
            Err(error) => return Err(self.fatal(Problem::Unread(error.to_string()))),
        }
        if self.bytes > MAX_FILE {
            return Err(self.fatal(Problem::FileTooLarge));
        }
        if self.line.last() == Some(&b'\n') {
            self.line.pop();
            if self.line.last() == Some(&b'\r') {
                self.line.pop();
            }
        }
        if self.number == 1 && self.line.starts_with(BOM) {
            self.line.drain(..BOM.len());
        }
        Ok(true)
    }

    fn checked(&self) -> Result<&str, LineFault> {
        if let Some(at) = memchr_cr(&self.line) {
            let column = characters(&self.line[..at]) + 1;
            let fatal = self.line.len() > MAX_LINE;
            return Err(LineFault { place: self.place(column), problem: Problem::CarriageReturn, fatal });
        }
        if self.line.len() > MAX_LINE {
            return Err(self.fatal(Problem::TooLong));
        }
        str::from_utf8(&self.line).map_err(|error| {
            let column = characters(&self.line[..error.valid_up_to()]) + 1;
            LineFault { place: self.place(column), problem: Problem::NotUtf8, fatal: false }
        })
    }

    fn fatal(&self, problem: Problem) -> LineFault {
        LineFault { place: self.place(1), problem, fatal: true }
    }

    const fn place(&self, column: u64) -> Place {
        Place::Text { line: self.number, column }
    }
}

/// True if a line has nothing in it, in any cell of it.
fn is_blank(line: &[u8]) -> bool {
    line.split(|byte| *byte == b',').all(|cell| matches!(cell.trim_ascii(), b"" | b"\"\""))
}

fn memchr_cr(line: &[u8]) -> Option<usize> {
    // `contains` is vectorised where `position` is not, and hardly any line has one.
    if line.contains(&b'\r') { line.iter().position(|byte| *byte == b'\r') } else { None }
}

fn characters(bytes: &[u8]) -> u64 {
    String::from_utf8_lossy(bytes).chars().count() as u64
}

/// Takes lines apart into cells; its memory is used again for each line.
pub(super) struct Splitter {
    reader: csv_core::Reader,
    text: Vec<u8>,
    ends: [usize; MAX_CELLS],
}

impl Splitter {
    pub(super) fn new() -> Self {
        Self { reader: csv_core::Reader::new(), text: vec![0; MAX_LINE], ends: [0; MAX_CELLS] }
    }

    /// The cells of a line; where a quote is not closed, its column.
    pub(super) fn split<'a>(&'a mut self, line: &'a str) -> Result<Cells<'a>, (u64, Problem)> {
        if line.contains('"') { self.split_quoted(line) } else { Ok(self.split_plain(line)) }
    }

    /// Lines without quotes, nearly all, need neither a copy nor a parser.
    fn split_plain<'a>(&'a mut self, line: &'a str) -> Cells<'a> {
        let commas = line.bytes().enumerate().filter(|(_, byte)| *byte == b',').map(|(at, _)| at);
        let mut count = 0;
        for end in commas.chain([line.len()]) {
            if let Some(slot) = self.ends.get_mut(count) {
                *slot = end;
            }
            count += 1;
        }
        Cells { text: line, gap: 1, ends: &self.ends[..count.min(MAX_CELLS)], count }
    }

    fn split_quoted(&mut self, line: &str) -> Result<Cells<'_>, (u64, Problem)> {
        if let Some(column) = open_quote(line) {
            return Err((column, Problem::OpenQuote));
        }
        self.reader.reset();
        let (_, _, bytes, cells) = self.reader.read_record(line.as_bytes(), &mut self.text, &mut self.ends);
        let (result, _, _, last) =
            self.reader.read_record(b"\n", &mut self.text[bytes..], &mut self.ends[cells..]);
        let count = match result {
            csv_core::ReadRecordResult::Record => cells + last,
            _ => raw_cells(line).count(), // more than there is room for
        };
        // The line was UTF-8, and what was taken out of it are quotes and commas.
        let text = str::from_utf8(&self.text[..bytes]).unwrap_or("");
        Ok(Cells { text, gap: 0, ends: &self.ends[..count.min(MAX_CELLS)], count })
    }

    /// The cells of a line that must have as many as the header has columns. Behind them a spreadsheet leaves empty ones.
    pub(super) fn split_row<'a>(
        &'a mut self,
        line: &'a str,
        columns: usize,
    ) -> Result<Cells<'a>, (u64, Problem)> {
        let cells = self.split(line)?;
        let count = cells.count;
        let problem = match count.cmp(&columns) {
            Ordering::Equal => return Ok(cells),
            Ordering::Greater if count <= MAX_CELLS && cells.iter().skip(columns).all(str::is_empty) => {
                return Ok(Cells { ends: &cells.ends[..columns], count: columns, ..cells });
            }
            Ordering::Less => Problem::RowTooShort { cells: count, columns },
            Ordering::Greater => Problem::RowTooLong { cells: count, columns },
        };
        Err((column_of(line, count.min(columns)), problem))
    }
}

/// The cells of one line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells<'a> {
    text: &'a str,
    /// Bytes between a cell and the next.
    gap: usize,
    ends: &'a [usize],
    count: usize,
}

impl<'a> Cells<'a> {
    /// How many cells the line has.
    pub(super) const fn count(&self) -> usize {
        self.count
    }

    /// The cells without the spaces around them.
    pub(super) fn iter(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let (text, gap, mut start) = (self.text, self.gap, 0);
        self.ends.iter().map(move |end| {
            let cell = text.get(start..*end).unwrap_or("");
            start = *end + gap;
            cell.trim_ascii()
        })
    }

    /// One cell without the spaces around it; empty if there is none.
    pub(super) fn get(&self, index: usize) -> &'a str {
        self.iter().nth(index).unwrap_or("")
    }
}

/// The column, in characters from 1, at which the text of a cell begins; of the line's end where it has no such cell.
pub(super) fn column_of(line: &str, index: usize) -> u64 {
    let start = raw_cells(line).nth(index).map_or(line.len(), |(start, _)| start);
    let spaces = line[start..].len() - line[start..].trim_start_matches([' ', '\t']).len();
    line[..start + spaces].chars().count() as u64 + 1
}

/// The column of the cell whose quote is not closed in the line.
fn open_quote(line: &str) -> Option<u64> {
    let last = raw_cells(line).enumerate().last()?;
    last.1.1.then(|| column_of(line, last.0))
}

/// Where each cell starts in the line, in bytes, and whether the line ends within its quotes.
fn raw_cells(line: &str) -> impl Iterator<Item = (usize, bool)> {
    let bytes = line.as_bytes();
    let mut next = Some(0);
    std::iter::from_fn(move || {
        let start = next?;
        let quoted = bytes.get(start) == Some(&b'"');
        let mut inside = quoted;
        let mut at = start + usize::from(quoted);
        next = loop {
            match bytes.get(at) {
                None => break None,
                Some(b',') if !inside => break Some(at + 1),
                Some(b'"') if quoted => inside = !inside,
                Some(_) => {}
            }
            at += 1;
        };
        Some((start, inside))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(line: &str) -> Vec<String> {
        Splitter::new().split(line).unwrap().iter().map(str::to_owned).collect()
    }

    #[test]
    fn cells_lose_quotes_and_the_spaces_around_them() {
        assert_eq!(cells("a, b ,\"c,d\",\"e\"\"f\","), ["a", "b", "c,d", "e\"f", ""]);
        assert_eq!(cells("x"), ["x"]);
    }

    #[test]
    fn a_column_is_counted_in_characters_up_to_the_cells_text() {
        assert_eq!(column_of("ä,  b,\"c,ö\",d", 0), 1);
        assert_eq!(column_of("ä,  b,\"c,ö\",d", 1), 5);
        assert_eq!(column_of("ä,  b,\"c,ö\",d", 3), 13);
        assert_eq!(column_of("ä,b", 2), 4);
    }

    #[test]
    fn an_open_quote_is_found_at_its_cell() {
        let fault = Splitter::new().split("0,\"1").unwrap_err();
        assert_eq!(fault, (3, Problem::OpenQuote));
    }

    #[test]
    fn lines_end_in_lf_or_crlf_and_blank_ones_are_passed_over() {
        let mut lines = Lines::new("\u{feff}a\r\n\r\n  \n,, ,\r\n\"\",\"\"\nb\n\",\"\n,,".as_bytes());
        assert_eq!(lines.next().unwrap(), Some((1, "a")));
        assert_eq!(lines.next().unwrap(), Some((6, "b")));
        assert_eq!(lines.next().unwrap(), Some((7, "\",\"")), "a cell with a comma is not empty");
        assert_eq!(lines.next().unwrap(), None);
    }

    #[test]
    fn a_long_line_is_refused_where_the_limit_is_met() {
        let mut endless = Lines::new(std::io::repeat(b'1'));
        let fault = endless.next().unwrap_err();
        assert!(fault.fatal && fault.problem == Problem::TooLong, "{fault:?}");
        assert!(endless.line.capacity() < 4 * MAX_LINE);
        let longest = "1".repeat(MAX_LINE) + "\r\n";
        assert_eq!(
            Lines::new(longest.as_bytes()).next().unwrap().map(|(_, text)| text.len()),
            Some(MAX_LINE)
        );
    }
}
