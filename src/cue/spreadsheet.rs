//! A CSV cue as a spreadsheet of any language saves it: semicolons or tabs between the columns, commas in the numbers. Made a CSV of our own
//! octet for octet, so that whatever is wrong with it keeps its place. A number that may be read in two ways is refused.

use std::io::Read;
use std::path::Path;

use super::fault::{Collector, CueFaults, Place};
use super::limits::MAX_FILE;
use super::other_kind::refuse_other_kind;
use super::problem::{Problem, may_part_thousands};
use super::{Cue, csv, value};

const BOM: &[u8] = b"\xef\xbb\xbf";

/// Reads a spreadsheet's CSV; `path` names it in faults.
pub(super) fn read(path: &Path, input: impl Read) -> Result<Cue, CueFaults> {
    let mut octets = Vec::new();
    if let Err(error) = input.take(MAX_FILE + 1).read_to_end(&mut octets) {
        return Err(CueFaults::one(path, Problem::Unread(error.to_string())));
    }
    if octets.len() as u64 > MAX_FILE {
        return Err(CueFaults::one(path, Problem::FileTooLarge));
    }
    refuse_other_kind(path, &octets)?;
    let mut faults = Collector::default();
    if let Err((place, problem)) = SheetReading::default().translate(&mut octets) {
        faults.add(place, None, problem);
    }
    faults.into_faults(path).map_or_else(|| csv::read(path, octets.as_slice()), Err)
}

/// What is known of a file while its lines are gone through.
#[derive(Debug, Default)]
struct SheetReading {
    /// Once it is known, from the header at the latest.
    separator: Option<u8>,
    in_rows: bool,
    /// The first number with a comma, and the first with a point.
    marked: [Option<MarkedNumber>; 2],
    /// True if one of them shows that its mark parts no thousands.
    is_sure: bool,
}

#[derive(Debug)]
struct MarkedNumber {
    text: String,
    line: u64,
    column: u64,
}

const MARKS: [u8; 2] = [b',', b'.'];

impl SheetReading {
    fn translate(mut self, octets: &mut [u8]) -> Result<(), (Place, Problem)> {
        let begin = if octets.starts_with(BOM) { BOM.len() } else { 0 };
        for (number, line) in (1..).zip(octets[begin..].split_mut(|octet| *octet == b'\n')) {
            let end = line.len() - usize::from(line.ends_with(b"\r"));
            let line = &mut line[..end];
            if self.in_rows {
                self.row(number, line)?;
            } else {
                self.before_rows(line);
            }
        }
        let sure = self.is_sure;
        // Between commas a point has always been that of a number.
        let is_point = |mark: u8| mark == b'.' && self.separator == Some(b',');
        let is_open = |mark: u8| !sure && !is_point(mark);
        let doubt =
            MARKS.into_iter().zip(self.marked).find_map(|(mark, number)| number.filter(|_| is_open(mark)));
        doubt.map_or(Ok(()), |MarkedNumber { text, line, column }| {
            Err((Place::Text { line, column }, Problem::MaybeThousands(text)))
        })
    }

    /// Comments keep their commas, and lose the separators behind them; the header says what those are.
    fn before_rows(&mut self, line: &mut [u8]) {
        let is_filling = |octet: &u8| octet.is_ascii_whitespace() || b",;|".contains(octet);
        let filled = line.iter().rposition(|octet| !is_filling(octet)).map_or(0, |last| last + 1);
        let told = line.trim_ascii_start();
        let told = told.strip_prefix(b"\"").unwrap_or(told).trim_ascii_start();
        if let Some((b"sep=", [separator, ..])) = told.to_ascii_lowercase().split_at_checked(4) {
            self.separator = Some(*separator);
            line.fill(b' ');
        } else if told.starts_with(b"#") || filled == 0 {
            line[filled..].fill(b' ');
        } else {
            let separator = *self.separator.get_or_insert_with(|| separator_of(line));
            map(line, separator);
            self.in_rows = true;
        }
    }

    fn row(&mut self, number: u64, line: &mut [u8]) -> Result<(), (Place, Problem)> {
        let separator = self.separator.unwrap_or(b',');
        let (mut inside, mut start) = (false, 0);
        for at in 0..=line.len() {
            match line.get(at) {
                Some(b'"') => inside = !inside,
                Some(octet) if inside || *octet != separator => {}
                _ => {
                    self.cell(number, line, start..at)?;
                    start = at + 1;
                }
            }
        }
        map(line, separator);
        Ok(())
    }

    /// Notes which mark a number has.
    fn cell(&mut self, line: u64, text: &[u8], cell: std::ops::Range<usize>) -> Result<(), (Place, Problem)> {
        let octets = &text[cell.clone()];
        if !octets.iter().any(|octet| MARKS.contains(octet)) || octets.len() > 64 {
            return Ok(());
        }
        let number = String::from_utf8_lossy(octets);
        let number = number.trim_matches(|c: char| c == '"' || c.is_whitespace());
        let column = String::from_utf8_lossy(&text[..cell.start]).chars().count() as u64 + 1;
        if MARKS.iter().all(|mark| number.contains(char::from(*mark))) {
            return Err((Place::Text { line, column }, Problem::Thousands(value::shortened(number))));
        }
        for (at, mark) in MARKS.into_iter().enumerate().filter(|(_, mark)| number.contains(char::from(*mark)))
        {
            let text = value::shortened(number);
            if let Some(MarkedNumber { text: there, line: before, .. }) = &self.marked[1 - at] {
                let problem = Problem::TwoMarks { here: text, there: there.clone(), line: *before };
                return Err((Place::Text { line, column }, problem));
            }
            self.is_sure |= !may_part_thousands(number, char::from(mark));
            self.marked[at].get_or_insert(MarkedNumber { text, line, column });
        }
        Ok(())
    }
}

/// What separates the cells of a header that nothing else was said of.
fn separator_of(header: &[u8]) -> u8 {
    let mut inside = false;
    let outside: Vec<u8> = header
        .iter()
        .copied()
        .filter(|octet| {
            inside ^= *octet == b'"';
            !inside
        })
        .collect();
    let others = csv::SEPARATORS.into_iter().filter_map(|separator| u8::try_from(separator).ok());
    [b','].into_iter().chain(others).find(|separator| outside.contains(separator)).unwrap_or(b',')
}

/// Commas between the cells, and points in the numbers.
fn map(line: &mut [u8], separator: u8) {
    let mut inside = false;
    for octet in line {
        match *octet {
            b'"' => inside = !inside,
            other if other == separator && !inside => *octet = b',',
            b',' => *octet = b'.',
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMMENTS: &str =
        "# kinocue-csv: 1\n# title: A nod, then 1.5 bows; twice\n# units: fraction, fraction\n";

    fn cue(text: &str) -> Cue {
        read(Path::new("t.csv"), text.as_bytes()).unwrap_or_else(|faults| panic!("{text}\n{faults}"))
    }

    fn fault(text: &str) -> String {
        read(Path::new("t.csv"), text.as_bytes())
            .expect_err("it is refused")
            .to_string()
            .replace("t.csv:", "")
    }

    #[test]
    fn a_cue_is_the_same_whatever_a_spreadsheet_puts_between_its_columns_and_into_its_numbers() {
        let rows = "time_ms,a1,a2,fx_air\n0,0,0,0\n1000,0.5,0.25,1\n2500,0.75,1,\n";
        let ours = csv::read(Path::new("t.csv"), format!("{COMMENTS}{rows}").as_bytes()).unwrap();
        let between = |separator: &str| rows.replace(',', separator).replace('.', ",");
        let german = between(";");
        let quoted: String =
            german.lines().map(|line| format!("\"{}\"\r\n", line.replace(';', "\";\""))).collect();
        let filled = COMMENTS.replace('\n', ";;;\n");
        let saved: String = COMMENTS.lines().map(|line| format!("\"{line}\";;;\r\n")).collect();
        let in_quotes =
            rows.replace("0.5", "\"0,5\"").replace("0.25", "\"0,25\"").replace("0.75", "\"0,75\"");
        for text in [
            format!("{COMMENTS}{rows}"),
            format!("{COMMENTS}{german}"),
            format!("\u{feff}{filled};;;\n{german};;;\n;;;\n"),
            format!("{saved}{quoted}"),
            format!("sep=;\r\n{COMMENTS}{german}"),
            format!("{COMMENTS}{}", between("\t")),
            format!("{COMMENTS}{}", rows.replace(',', "|")),
            format!("{COMMENTS}{}", rows.replace(',', ";")),
            format!("{COMMENTS}{in_quotes}"),
        ] {
            let read = cue(&text);
            assert_eq!(
                (read.times(), read.positions(), read.effects()),
                (ours.times(), ours.positions(), ours.effects())
            );
            assert_eq!((read.title(), read.units()), (ours.title(), ours.units()), "{text}");
        }
    }

    #[test]
    fn a_number_that_may_be_read_in_two_ways_is_refused_where_it_stands() {
        let of = |rows: &str| fault(&format!("# units: percent\ntime_ms;a1\n{rows}"));
        for (rows, says) in [
            ("0;0\n1.000;50\n2.000;0\n", "4:1: \"1.000\" may be a whole number or a broken one"),
            ("0;0\n1,000;50\n", "4:1: \"1,000\" may be a whole number"),
            ("0;0,5\n1.000;50\n", "4:1: \"1.000\" beside \"0,5\" on line 3: "),
            ("0;0.5\n1000;1,5\n", "4:6: \"1,5\" beside \"0.5\" on line 3: "),
            ("0;0\n1.000,5;50\n", "4:1: \"1.000,5\" has a mark between thousands"),
        ] {
            let told = of(rows);
            assert!(told.starts_with(says) && told.lines().count() == 1, "{rows}: {told}");
        }
        let quoted = fault("# units: percent\ntime_ms,a1\n0,0\n\"1,000\",50\n");
        assert!(quoted.starts_with("4:1: \"1,000\" may be"), "{quoted}");
        // One that can be read in one way shows what all the others are.
        assert_eq!(cue("time_ms;a1\n0;0\n1,000;0,5\n").times()[1].as_nanos(), 1_000_000);
        assert_eq!(cue("time_ms;a1\n0;0.000\n1.000;1.000\n").times()[1].as_nanos(), 1_000_000);
        assert_eq!(
            cue("time_ms,a1\n0,0\n1.000,1.000\n").times()[1].as_nanos(),
            1_000_000,
            "as without --from"
        );
    }

    #[test]
    fn what_is_wrong_with_a_converted_cue_keeps_its_place() {
        assert_eq!(
            fault("# units: mm, deg;;\nTime_ms;A1;A2\n0;0,5;x\n10;;0;;7\n0;0,5;0\n"),
            "3:7: A2: \"x\" is not a number\n4:7: the row has 5 cells, the header 3\n\
             5:1: Time_ms: 0 is not after 00:00.000, the time before it"
        );
        assert!(fault("# units = mm;;\ntime_ms;a1\n0;0\n1;0,5\n").contains("write \"# units: mm\""));
        assert!(fault("PK\u{3}\u{4}").contains("a spreadsheet or an archive"));
    }
}
