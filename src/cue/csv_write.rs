//! From a cue to a CSV file.

use std::io::{self, Write};

use super::number::{push_millis, push_number};
use super::{Cue, Effects, Steps};
use crate::channel::{Channel, Sample, Scope, TrackId};
use crate::time::ShowTime;

/// Why a cue cannot be written as CSV.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CsvError {
    /// Writing failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Something changes where the cue has no row, which a CSV cannot say.
    #[error(
        "{what} changes at {at}, between two rows; CSV can only switch at a row, so keep the cue as MCAP"
    )]
    BetweenRows {
        /// What changes.
        what: String,
        /// When.
        at: ShowTime,
    },
}

/// Writes a cue as CSV, every value exactly; markers have no place there.
///
/// # Errors
/// Where writing fails, or what holds until it changes does so between rows.
pub fn write(cue: &Cue, out: impl Write) -> Result<(), CsvError> {
    write_with(cue, &[], out)
}

/// The same with comment lines before the header, each with its `#`.
///
/// # Errors
/// As [`write()`].
pub(crate) fn write_with(cue: &Cue, comments: &[String], mut out: impl Write) -> Result<(), CsvError> {
    check_changes(cue)?;
    out.write_all(head(cue, comments).as_bytes())?;
    let tracks: Vec<_> = cue.tracks().used().map(|(track, steps)| (columns(track, steps), steps)).collect();
    let mut found = vec![0; tracks.len()];
    let mut switched = 0;
    let mut line = String::new();
    for (row, time) in cue.times().iter().enumerate() {
        line.clear();
        push_millis(&mut line, *time);
        for value in cue.row(row) {
            line.push(',');
            push_number(&mut line, *value);
        }
        for ((parts, steps), found) in tracks.iter().zip(&mut found) {
            let Sample(values) = steps.at(*time, found);
            for part in parts {
                line.push(',');
                push_number(&mut line, values[*part]);
            }
        }
        match cue.effects() {
            Effects::Named { names, steps } => {
                let on = steps.at(*time, &mut switched);
                (0..names.len()).for_each(|bit| line.push_str(if on >> bit & 1 == 1 { ",1" } else { ",0" }));
            }
            Effects::Words(steps) => line.push_str(&format!(",{}", steps.at(*time, &mut switched))),
        }
        line.push('\n');
        out.write_all(line.as_bytes())?;
    }
    Ok(out.flush()?)
}

/// The parts of a track that have a column. Of outputs of the hall one may stand alone, so those that are never on have none.
fn columns(track: TrackId, steps: &Steps<Sample>) -> Vec<usize> {
    let Channel { scope, parts, .. } = track.channel.row();
    let is_on = |part: &usize| steps.as_slice().iter().any(|step| step.value.0[*part] != 0.0);
    let all: Vec<usize> = (0..parts.len()).collect();
    let on: Vec<usize> = all.iter().copied().filter(is_on).collect();
    if *scope == Scope::Axis || on.is_empty() { all } else { on }
}

/// The declarations, the comments and the header row.
fn head(cue: &Cue, comments: &[String]) -> String {
    let mut head = "# kinocue-csv: 1\n".to_owned();
    if let Some(title) = cue.title() {
        let one_line: String = title.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        head.push_str(&format!("# title: {one_line}\n"));
    }
    head.push_str(&format!("# units: {}\n", cue.unit_words()));
    head.push_str(&format!("# interpolation: {}\n", cue.interpolation().name()));
    comments.iter().for_each(|comment| head.push_str(&format!("{comment}\n")));
    head.push_str("time_ms");
    (1..=cue.axes()).for_each(|axis| head.push_str(&format!(",a{axis}")));
    for (track, steps) in cue.tracks().used() {
        columns(track, steps).into_iter().for_each(|part| head.push_str(&format!(",{}", track.column(part))));
    }
    match cue.effects() {
        Effects::Named { names, .. } => names.iter().for_each(|name| head.push_str(&format!(",fx_{name}"))),
        Effects::Words(_) => head.push_str(",io"),
    }
    head.push('\n');
    head
}

fn check_changes(cue: &Cue) -> Result<(), CsvError> {
    for (track, steps) in cue.tracks().used() {
        check_steps(cue, steps, || track.to_string())?;
    }
    match cue.effects() {
        Effects::Named { steps, .. } => check_steps(cue, steps, || "an effect".to_owned()),
        Effects::Words(steps) => check_steps(cue, steps, || "the output word".to_owned()),
    }
}

fn check_steps<T: Copy + PartialEq + Default>(
    cue: &Cue,
    steps: &Steps<T>,
    what: impl Fn() -> String,
) -> Result<(), CsvError> {
    let stray = steps.as_slice().iter().find(|step| cue.times().binary_search(&step.at).is_err());
    stray.map_or(Ok(()), |step| Err(CsvError::BetweenRows { what: what(), at: step.at }))
}
