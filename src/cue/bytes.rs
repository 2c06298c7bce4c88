//! Raw bytes at a declared rate, as old ride players hold them: one byte an axis, 0 to 255 over the stroke.

use std::io::Read;
use std::path::Path;

use super::fault::CueFaults;
use super::limits::{MAX_ROWS, MAX_TIME};
use super::problem::Problem;
use super::{Cue, DeclaredUnit, Interpolation, Origin};
use crate::motion::MAX_AXES;
use crate::time::ShowTime;

/// Reads bytes, axis 1 first, the first row at time 0; `path` names the file in faults.
pub(super) fn read(path: &Path, input: impl Read, axes: usize, rate_hz: f64) -> Result<Cue, CueFaults> {
    if !(1..=MAX_AXES).contains(&axes) {
        return Err(CueFaults::one(path, Problem::Axes(axes)));
    }
    if !(rate_hz > 0.0 && rate_hz <= 1e6) {
        return Err(CueFaults::one(path, Problem::Rate(rate_hz)));
    }
    let mut cue =
        Cue { interpolation: Interpolation::Monotone, axes, origin: Origin::Bytes(axes), ..Cue::blank(path) };
    match fill(&mut cue, input, rate_hz) {
        Ok(()) => Ok(cue),
        Err(problem) => Err(CueFaults::one(path, problem)),
    }
}

fn fill(cue: &mut Cue, input: impl Read, rate_hz: f64) -> Result<(), Problem> {
    let mut bytes = Vec::new();
    let most = (MAX_ROWS * cue.axes) as u64;
    input.take(most + 1).read_to_end(&mut bytes).map_err(|error| Problem::Unread(error.to_string()))?;
    let rows = bytes.chunks_exact(cue.axes);
    if bytes.len() as u64 > most {
        return Err(Problem::TooManyRows);
    }
    if !rows.remainder().is_empty() {
        return Err(Problem::PartOfARow { bytes: bytes.len(), axes: cue.axes });
    }
    if rows.len() < 2 {
        return Err(if bytes.is_empty() { Problem::Empty } else { Problem::TooFewRows(1) });
    }
    for row in 0..rows.len() {
        cue.times.push(time_of(row, rate_hz)?);
    }
    cue.positions.extend(bytes.iter().map(|byte| DeclaredUnit::U8.in_memory(f64::from(*byte))));
    Ok(())
}

#[expect(clippy::cast_precision_loss, reason = "rows are few enough to be exact")]
fn time_of(row: usize, rate_hz: f64) -> Result<ShowTime, Problem> {
    let time = ShowTime::from_secs_f64(row as f64 / rate_hz);
    if time > MAX_TIME { Err(Problem::TimeTooLate(time.to_string())) } else { Ok(time) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(bytes: &[u8], axes: usize, rate_hz: f64) -> String {
        read(Path::new("t.u8"), bytes, axes, rate_hz).expect_err("no fault was found").to_string()
    }

    #[test]
    fn bytes_become_fractions_at_their_rate() {
        let cue = read(Path::new("t.u8"), [0, 255, 51, 102, 0, 1].as_slice(), 2, 20.0).unwrap();
        assert_eq!(cue.positions(), [0.0, 1.0, 0.2, 0.4, 0.0, 1.0 / 255.0]);
        assert_eq!(cue.times(), [0, 50, 100].map(ShowTime::from_millis));
        assert_eq!((cue.interpolation(), cue.axes()), (Interpolation::Monotone, 2));
    }

    #[test]
    fn what_is_no_whole_rows_is_refused() {
        assert_eq!(faults(&[0; 7], 3, 20.0), "t.u8: 7 bytes are not whole rows of 3 axes");
        assert_eq!(faults(&[], 3, 20.0), "t.u8: is empty; a cue needs at least two rows");
        assert_eq!(faults(&[0; 3], 3, 20.0), "t.u8: number of rows: 1; a cue needs at least two");
        assert_eq!(faults(&[0; 3], 13, 20.0), "t.u8: 13 axes; a cue has 1 to 12");
        assert_eq!(
            faults(&[0; 3], 1, 0.0),
            "t.u8: a rate of 0 Hz; it must be above 0 and at most 1000000 Hz"
        );
        assert_eq!(
            faults(&[0; 3], 1, 1e-5),
            "t.u8: 27:46:40.000 is after 24:00:00.000, the latest time of a cue"
        );
    }
}
