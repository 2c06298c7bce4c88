//! Our own CSV cues: declarations in comments, a header row, rows. Streamed; nothing but the rows' values is kept.

use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;

use super::declared::{Declared, HeadLine, comment, is_remark};
use super::fault::{Collector, CueFaults, Place};
use super::header::{Column, Header};
use super::limits::MAX_ROWS;
use super::problem::Problem;
use super::table::{Lines, Splitter, column_of};
use super::unit::DeclaredUnits;
use super::{Cue, Effects, Origin, Steps, value};
use crate::channel::{Samples, TrackId};
use crate::motion::MAX_AXES;
use crate::plain;
use crate::time::ShowTime;

/// What spreadsheets have between the columns where commas are taken.
pub(super) const SEPARATORS: [char; 3] = [';', '\t', '|'];

/// Reads a CSV cue; `path` names it in faults.
pub(super) fn read(path: &Path, input: impl Read) -> Result<Cue, CueFaults> {
    read_at_most(MAX_ROWS, path, input)
}

/// The lines before the header of a CSV that declare nothing: what a person noted there. None of a file that is no CSV, or cannot be read.
pub(crate) fn comments(path: &Path) -> Vec<String> {
    let Ok(file) = super::open(path) else { return Vec::new() };
    let (mut lines, mut comments) = (Lines::new(file), Vec::new());
    while let Ok(Some((_, line))) = lines.next() {
        match HeadLine::of(line) {
            HeadLine::Comment(comment) if is_remark(&comment) => comments.push(format!("#{comment}")),
            HeadLine::Comment(_) | HeadLine::Separator(_) => {}
            HeadLine::Header => break,
        }
    }
    comments
}

fn read_at_most(rows_at_most: usize, path: &Path, input: impl Read) -> Result<Cue, CueFaults> {
    let mut lines = Lines::new(input);
    let mut faults = Collector::default();
    let Some((declared, header)) = read_head(path, &mut lines, &mut faults) else {
        return Err(faults.or(path, Problem::Empty));
    };
    let mut rows = CsvRows::new(path, &declared, header);
    lines.each(&mut faults, |number, line, faults| {
        if rows.cue.rows() == rows_at_most {
            faults.add(Place::Text { line: number, column: 1 }, None, Problem::TooManyRows);
            return ControlFlow::Break(());
        }
        rows.take(number, line, faults);
        ControlFlow::Continue(())
    });
    let cue = rows.cue;
    if faults.is_empty() && cue.rows() >= 2 {
        Ok(cue)
    } else {
        Err(faults.or(path, Problem::TooFewRows(cue.rows())))
    }
}

/// Reads up to the header row; nothing where there is none, or rows cannot be understood after what was found.
fn read_head<R: Read>(
    path: &Path,
    lines: &mut Lines<R>,
    faults: &mut Collector,
) -> Option<(Declared, Header)> {
    let mut declared = Declared::default();
    let mut header = None;
    lines.each(faults, |number, line, faults| {
        let separator = match HeadLine::of(line) {
            HeadLine::Comment(comment) => {
                declared.take(number, line, &comment, faults);
                return ControlFlow::Continue(());
            }
            HeadLine::Separator(',') => return ControlFlow::Continue(()),
            HeadLine::Separator(other) => Some(other),
            HeadLine::Header => other_separator(line),
        };
        if let Some(separator) = separator {
            let problem = Problem::Separator(separator_name(separator), plain::shell(path));
            faults.add(Place::Text { line: number, column: 1 }, None, problem);
            return ControlFlow::Break(());
        }
        match Splitter::new().split(line) {
            Ok(cells) => header = Some((cells.count(), Header::read(line, number, cells, faults))),
            Err((column, problem)) => faults.add(Place::Text { line: number, column }, None, problem),
        }
        ControlFlow::Break(())
    });
    declared.refuse_near(faults);
    let (cells, header) = header?;
    declared.close(cells, header.axes, faults);
    faults.is_empty().then_some((declared, header))
}

/// What separates the columns of a header without a comma.
fn other_separator(line: &str) -> Option<char> {
    if line.contains(',') { None } else { SEPARATORS.into_iter().find(|separator| line.contains(*separator)) }
}

fn separator_name(separator: char) -> String {
    match separator {
        ';' => "semicolons".to_owned(),
        '\t' => "tabs".to_owned(),
        '|' => "bars".to_owned(),
        other => format!("{other:?}"),
    }
}

/// The rows while they are read, and the cue so far.
struct CsvRows {
    header: Header,
    /// The tracks of the table that the file has, and the first column of each.
    tracks: Vec<(TrackId, usize)>,
    splitter: Splitter,
    row: CsvRow,
    cue: Cue,
}

impl CsvRows {
    fn new(path: &Path, declared: &Declared, header: Header) -> Self {
        let mut axis_cells = [0; MAX_AXES];
        let mut tracks: Vec<(TrackId, usize)> = Vec::new();
        for (cell, column) in header.columns.iter().enumerate() {
            match *column {
                Column::Position(axis) => axis_cells[axis] = cell,
                Column::Part(track, _) if !tracks.iter().any(|(known, _)| *known == track) => {
                    tracks.push((track, cell));
                }
                _ => {}
            }
        }
        let effects = if header.columns.contains(&Column::Word) {
            Effects::Words(Steps::default())
        } else {
            Effects::Named { names: header.effects.clone(), steps: Steps::default() }
        };
        let cue = Cue {
            title: declared.title.clone(),
            units: declared.units.units(),
            interpolation: declared.interpolation,
            axes: header.axes,
            origin: Origin::Text { jumps: Vec::new(), cells: axis_cells },
            effects,
            ..Cue::blank(path)
        };
        let row = CsvRow::before_all(declared.units, header.time_unit_ns);
        Self { header, tracks, splitter: Splitter::new(), row, cue }
    }

    /// Takes one line as a row; what is wrong with it goes to `faults`, and the next may follow.
    fn take(&mut self, number: u64, line: &str, faults: &mut Collector) {
        let place = |column| Place::Text { line: number, column };
        if comment(line).is_some() {
            return faults.add(place(1), None, Problem::CommentAmongRows);
        }
        let cells = match self.splitter.split_row(line, self.header.columns.len()) {
            Ok(cells) => cells,
            Err((column, problem)) => return faults.add(place(column), None, problem),
        };
        let mut whole = true;
        for (index, (text, column)) in cells.iter().zip(&self.header.columns).enumerate() {
            if let Err(problem) = self.row.take(*column, text) {
                let name = self.header.names.get(index).map(String::as_str);
                faults.add(place(column_of(line, index)), name, problem);
                whole = false;
            }
        }
        self.row.begun = true;
        if whole && self.may_stand(number, line, faults) {
            self.keep(number);
        }
    }

    /// True if the values of each track may stand together, which no cell alone shows.
    fn may_stand(&self, number: u64, line: &str, faults: &mut Collector) -> bool {
        self.tracks.iter().all(|(track, index)| {
            let checked = (track.channel.row().check)(self.row.samples.of(*track));
            checked
                .map_err(|problem| {
                    let place = Place::Text { line: number, column: column_of(line, *index) };
                    let name = self.header.names.get(*index).map(String::as_str);
                    faults.add(place, name, Problem::Refused(problem));
                })
                .is_ok()
        })
    }

    fn keep(&mut self, line: u64) {
        let (cue, row) = (&mut self.cue, &self.row);
        cue.origin.push_line(cue.times.len(), line);
        cue.times.push(row.time);
        cue.positions.extend_from_slice(&row.positions[..cue.axes]);
        for (track, _) in &self.tracks {
            cue.tracks.of_mut(*track).push(row.time, row.samples.of(*track));
        }
        match &mut cue.effects {
            Effects::Named { steps, names } if !names.is_empty() => steps.push(row.time, row.effects),
            Effects::Named { .. } => {}
            Effects::Words(steps) => steps.push(row.time, row.word),
        }
    }
}

/// The row being read; before that the one before it, which an empty cell holds.
#[derive(Debug, Clone, Copy)]
struct CsvRow {
    units: DeclaredUnits,
    time_unit_ns: f64,
    /// True if a row was read, so that an empty cell has something to hold.
    begun: bool,
    latest: Option<ShowTime>,
    time: ShowTime,
    positions: [f64; MAX_AXES],
    samples: Samples,
    effects: u32,
    word: u16,
}

impl CsvRow {
    const fn before_all(units: DeclaredUnits, time_unit_ns: f64) -> Self {
        Self {
            units,
            time_unit_ns,
            begun: false,
            latest: None,
            time: ShowTime::ZERO,
            positions: [0.0; MAX_AXES],
            samples: Samples::REST,
            effects: 0,
            word: 0,
        }
    }

    /// Takes the cell of a column.
    fn take(&mut self, column: Column, text: &str) -> Result<(), Problem> {
        if text.is_empty() {
            return match column {
                Column::Time => Err(Problem::EmptyCell),
                _ if self.begun => Ok(()),
                _ => Err(Problem::NothingToHold),
            };
        }
        match column {
            Column::Time => self.time = checked_time(text, self.time_unit_ns, &mut self.latest)?,
            Column::Position(axis) => {
                self.positions[axis] = value::position(value::number(text)?, self.units.of(axis))?;
            }
            Column::Part(track, part) => {
                let mut sample = self.samples.of(track);
                sample.0[part] = value::part(value::number(text)?, track, part, self.units.of(track.axis))?;
                self.samples.set(track, sample);
            }
            Column::Effect(effect) => {
                self.effects = self.effects & !(1 << effect) | u32::from(value::switch(text)?) << effect;
            }
            Column::Word => self.word = value::word(text)?,
        }
        Ok(())
    }
}

/// The time of a row: 0 in the first, after the one before in the others.
fn checked_time(text: &str, unit_ns: f64, latest: &mut Option<ShowTime>) -> Result<ShowTime, Problem> {
    let time = value::time(text, unit_ns)?;
    let before = *latest;
    *latest = before.max(Some(time));
    match before {
        None if time != ShowTime::ZERO => Err(Problem::TimeNotZero(value::shortened(text))),
        Some(before) if time <= before => {
            Err(Problem::TimeNotIncreasing { time: value::shortened(text), before })
        }
        _ => Ok(time),
    }
}

#[cfg(test)]
mod tests;
