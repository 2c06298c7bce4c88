//! Rows as motion editors of the field write them, `line,time_ms,x,y,z,u,v,w`: a row is reached at the sum of the
//! durations up to its own, and at time 0 the cue stands at the first row.

use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;

use super::fault::{Collector, CueFaults, Place};
use super::limits::{MAX_ROWS, MAX_TIME};
use super::problem::Problem;
use super::table::{Lines, Splitter, column_of};
use super::{Cue, DeclaredUnit, Interpolation, Origin, Units, value};
use crate::motion::MAX_AXES;
use crate::time::ShowTime;

const HEADER: [&str; 8] = ["line", "time_ms", "x", "y", "z", "u", "v", "w"];
const FIRST_AXIS: usize = 2;

/// Reads rows with durations; `path` names the file in faults.
pub(super) fn read(path: &Path, input: impl Read, unit: DeclaredUnit) -> Result<Cue, CueFaults> {
    let mut lines = Lines::new(input);
    let mut faults = Collector::default();
    let mut reading: Option<RowReading> = None;
    lines.each(&mut faults, |number, line, faults| {
        match &mut reading {
            Some(reading) if reading.cue.rows() > MAX_ROWS => {
                faults.add(Place::Text { line: number, column: 1 }, None, Problem::TooManyRows);
                return ControlFlow::Break(());
            }
            Some(reading) => reading.take(number, line, faults),
            None => match RowReading::new(path, unit, number, line, faults) {
                Some(begun) => reading = Some(begun),
                None => return ControlFlow::Break(()),
            },
        }
        ControlFlow::Continue(())
    });
    match reading.map(|reading| reading.cue) {
        Some(cue) if faults.is_empty() && cue.rows() > 0 => Ok(cue),
        _ => Err(faults.or(path, Problem::Empty)),
    }
}

struct RowReading {
    splitter: Splitter,
    unit: DeclaredUnit,
    cue: Cue,
    positions: [f64; MAX_AXES],
    begun: bool,
}

impl RowReading {
    /// Understands the header row.
    fn new(path: &Path, unit: DeclaredUnit, number: u64, line: &str, faults: &mut Collector) -> Option<Self> {
        let mut splitter = Splitter::new();
        let place = |column| Place::Text { line: number, column };
        let cells = match splitter.split(line) {
            Ok(cells) => cells,
            Err((column, problem)) => {
                faults.add(place(column), None, problem);
                return None;
            }
        };
        for index in 0..cells.count().max(FIRST_AXIS + 1) {
            let (name, expected) = (cells.get(index), HEADER.get(index));
            if index >= cells.count() {
                faults.add(place(column_of(line, index)), expected.copied(), Problem::MissingColumn);
            } else if expected != Some(&name) {
                let problem =
                    Problem::UnknownColumn("the header is line,time_ms,x,y,z,u,v,w, without unused axes");
                faults.add(place(column_of(line, index)), Some(name), problem);
            }
        }
        let axes = cells.count().saturating_sub(FIRST_AXIS);
        let mut origin_cells = [0; MAX_AXES];
        origin_cells.iter_mut().enumerate().for_each(|(axis, cell)| *cell = axis + FIRST_AXIS);
        let cue = Cue {
            units: Units::all(unit.unit()),
            interpolation: Interpolation::Linear,
            axes,
            origin: Origin::Text { jumps: Vec::new(), cells: origin_cells },
            ..Cue::blank(path)
        };
        faults.is_empty().then_some(Self { splitter, unit, cue, positions: [0.0; MAX_AXES], begun: false })
    }

    fn take(&mut self, number: u64, line: &str, faults: &mut Collector) {
        let place = |column| Place::Text { line: number, column };
        let cells = match self.splitter.split_row(line, self.cue.axes + FIRST_AXIS) {
            Ok(cells) => cells,
            Err((column, problem)) => return faults.add(place(column), None, problem),
        };
        let mut reached = Ok(ShowTime::ZERO);
        let mut whole = true;
        for (index, (text, name)) in cells.iter().zip(HEADER).enumerate() {
            let taken = match index {
                0 => value::number(text).map(drop),
                1 => {
                    reached = reached_after(self.cue.duration(), text);
                    reached.clone().map(drop)
                }
                _ => position(text, self.unit, self.begun).map(|new| {
                    let held = &mut self.positions[index - FIRST_AXIS];
                    *held = new.unwrap_or(*held);
                }),
            };
            if let Err(problem) = taken {
                faults.add(place(column_of(line, index)), Some(name), problem);
                whole = false;
            }
        }
        self.begun = true;
        if let (true, Ok(time)) = (whole, reached) {
            self.keep(number, time);
        }
    }

    fn keep(&mut self, line: u64, time: ShowTime) {
        let times: &[ShowTime] = if self.cue.rows() == 0 { &[ShowTime::ZERO, time] } else { &[time] };
        for time in times {
            self.cue.origin.push_line(self.cue.rows(), line);
            self.cue.times.push(*time);
            self.cue.positions.extend_from_slice(&self.positions[..self.cue.axes]);
        }
    }
}

/// When a row is reached: its duration after the row before.
fn reached_after(before: ShowTime, text: &str) -> Result<ShowTime, Problem> {
    if text.is_empty() {
        return Err(Problem::EmptyCell);
    }
    let duration = value::time(text, 1e6)?;
    if duration <= ShowTime::ZERO {
        return Err(Problem::NoDuration(value::shortened(text)));
    }
    let reached = ShowTime::from_nanos(before.as_nanos() + duration.as_nanos());
    if reached > MAX_TIME { Err(Problem::TimeTooLate(reached.to_string())) } else { Ok(reached) }
}

/// The position in a cell; `None` if an empty cell holds the one before it.
fn position(text: &str, unit: DeclaredUnit, begun: bool) -> Result<Option<f64>, Problem> {
    match (text.is_empty(), begun) {
        (true, true) => Ok(None),
        (true, false) => Err(Problem::NothingToHold),
        (false, _) => value::position(value::number(text)?, unit).map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(text: &str) -> String {
        read(Path::new("t.csv"), text.as_bytes(), DeclaredUnit::Millimetre)
            .expect_err("no fault was found")
            .to_string()
            .replace("t.csv:", "")
    }

    #[test]
    fn a_row_is_reached_at_the_sum_of_the_durations() {
        let text = "line,time_ms,x,y,z,u,v,w\n1,1000,1,2,3,4,5,6\n2,500,7,8,9,10,11,12\n";
        let cue = read(Path::new("t.csv"), text.as_bytes(), DeclaredUnit::Millimetre).unwrap();
        assert_eq!(cue.times(), [0, 1000, 1500].map(ShowTime::from_millis));
        assert_eq!(
            (cue.row(0), cue.row(1), cue.row(2)[5]),
            (cue.row(1), &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0][..], 12.0)
        );
        assert_eq!((cue.line(0), cue.line(1), cue.line(2)), (2, 2, 3));
        assert_eq!((cue.axes(), cue.interpolation()), (6, Interpolation::Linear));
    }

    #[test]
    fn fewer_axes_and_percent_are_accepted() {
        let cue =
            read(Path::new("t.csv"), "line,time_ms,x\n1,10,50\n".as_bytes(), DeclaredUnit::Percent).unwrap();
        assert_eq!((cue.axes(), cue.positions()), (1, &[0.5, 0.5][..]));
    }

    #[test]
    fn bad_rows_are_named_with_their_place() {
        assert_eq!(
            faults("line,time_ms,x,y\n1,0,0,0\n2,-5,0,0\n3,9,,0\n4,9,0\nx,9,0,-200000\n"),
            "2:3: time_ms: a row's duration of 0 is not above 0\n\
             3:3: time_ms: a row's duration of -5 is not above 0\n\
             5:6: the row ends after 3 of 4 cells\n\
             6:1: line: \"x\" is not a number\n\
             6:7: y: -200000 is outside -100000 to 100000 mm, where no seat can go"
        );
        assert_eq!(faults(""), " is empty; a cue needs at least two rows");
        assert_eq!(faults("line,time_ms\n1,2\n"), "1:13: x: the column is missing");
        assert!(
            faults("1,1000,0,0\n")
                .starts_with("1:1: 1: unknown column; the header is line,time_ms,x,y,z,u,v,w")
        );
    }
}
