//! The header row of a cue: which column carries what.

use std::sync::LazyLock;

use super::fault::{Collector, Place};
use super::limits::MAX_EFFECTS;
use super::problem::Problem;
use super::table::{Cells, column_of};
use crate::channel::{self, CHANNELS, Scope, TrackId};
use crate::motion::MAX_AXES;

/// What a column carries; axes are counted from 0 here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Column {
    /// Show time; the first column.
    Time,
    /// Position of an axis.
    Position(usize),
    /// A part of a channel.
    Part(TrackId, usize),
    /// Switch of an effect.
    Effect(usize),
    /// Raw output word.
    Word,
}

/// A header row that has been understood.
#[derive(Debug, Default)]
pub(super) struct Header {
    pub(super) columns: Vec<Column>,
    /// The columns' names, as in the file.
    pub(super) names: Vec<String>,
    /// Nanoseconds in one unit of the time column.
    pub(super) time_unit_ns: f64,
    pub(super) axes: usize,
    pub(super) effects: Vec<String>,
}

static KNOWN: LazyLock<String> = LazyLock::new(|| {
    let columns = CHANNELS.iter().map(|channel| {
        let named = |axis: usize| {
            let track = channel.id.on(axis);
            let columns: Vec<_> = (0..channel.parts.len()).map(|part| track.column(part)).collect();
            columns.join(" and ")
        };
        match channel.scope {
            Scope::Axis => format!("{} to {}", named(0), named(MAX_AXES - 1)),
            Scope::Hall => named(0),
        }
    });
    let columns: Vec<_> = columns.collect();
    format!("a cue has time_ms or time_s, then a1 to a12, {}, fx_NAME, or io", columns.join(", "))
});

impl Header {
    /// Reads the header from its cells; what is wrong goes to `faults`.
    pub(super) fn read(line: &str, number: u64, cells: Cells<'_>, faults: &mut Collector) -> Self {
        let mut header = Self::default();
        let place = |index| Place::Text { line: number, column: column_of(line, index) };
        for index in 0..cells.count() {
            let name = cells.get(index);
            match header.column(index, name) {
                Ok(column) if header.columns.contains(&column) => {
                    faults.add(place(index), Some(name), Problem::ColumnTwice);
                }
                Ok(column) => header.columns.push(column),
                Err(problem) => faults.add(place(index), Some(name), problem),
            }
            header.names.push(name.to_owned());
        }
        header.axes = header.columns.iter().filter(|c| matches!(c, Column::Position(_))).count();
        header.check(number, faults);
        header
    }

    fn column(&mut self, index: usize, name: &str) -> Result<Column, Problem> {
        match (index, name) {
            (0, "time_ms") => self.time_unit_ns = 1e6,
            (0, "time_s") => self.time_unit_ns = 1e9,
            (0, _) => return Err(Problem::UnknownColumn("the first column is time_ms or time_s")),
            (_, "io") => return Ok(Column::Word),
            _ => return self.track(name).unwrap_or(Err(Problem::UnknownColumn(KNOWN.as_str()))),
        }
        Ok(Column::Time)
    }

    fn track(&mut self, name: &str) -> Option<Result<Column, Problem>> {
        if let Some(effect) = name.strip_prefix("fx_") {
            return Some(self.effect(effect));
        }
        if let Some(axis) = name.strip_prefix('a') {
            return axis_number(axis).map(|axis| Ok(Column::Position(axis)));
        }
        channel::of_column(name, axis_number).map(|(track, part)| Ok(Column::Part(track, part)))
    }

    fn effect(&mut self, name: &str) -> Result<Column, Problem> {
        if !is_effect_name(name) {
            return Err(Problem::EffectName);
        }
        if let Some(there) = self.effects.iter().position(|effect| effect == name) {
            return Ok(Column::Effect(there));
        }
        if self.effects.len() == MAX_EFFECTS {
            return Err(Problem::TooManyEffects);
        }
        self.effects.push(name.to_owned());
        Ok(Column::Effect(self.effects.len() - 1))
    }

    /// What only the whole row can tell: columns that are missing or exclude each other.
    fn check(&self, number: u64, faults: &mut Collector) {
        let place = || Place::Text { line: number, column: 1 };
        let has = |column| self.columns.contains(&column);
        let mut missing = |name: String| faults.add(place(), Some(&name), Problem::MissingColumn);
        if self.axes == 0 {
            missing("a1".to_owned());
        }
        let last = (0..MAX_AXES).rev().find(|axis| has(Column::Position(*axis)));
        for axis in 0..MAX_AXES {
            // What belongs to an axis needs that axis, and all of its channel; of outputs of the hall one may stand alone.
            let (mut begun, mut absent) = (last.is_some_and(|last| axis < last), Vec::new());
            for channel in CHANNELS.iter().filter(|channel| channel.scope == Scope::Axis) {
                let track = channel.id.on(axis);
                let (there, others): (Vec<_>, Vec<_>) =
                    (0..channel.parts.len()).partition(|part| has(Column::Part(track, *part)));
                begun |= !there.is_empty();
                absent
                    .extend(others.into_iter().filter(|_| !there.is_empty()).map(|part| track.column(part)));
            }
            if begun && !has(Column::Position(axis)) && !(axis == 0 && self.axes == 0) {
                missing(format!("a{}", axis + 1));
            }
            absent.into_iter().for_each(&mut missing);
        }
        if has(Column::Word) && !self.effects.is_empty() {
            faults.add(place(), Some("io"), Problem::WordAndEffects);
        }
    }
}

/// `1` to `12` as an index from 0.
fn axis_number(digits: &str) -> Option<usize> {
    let plain = digits.bytes().all(|b| b.is_ascii_digit()) && !digits.starts_with('0');
    let axis: usize = digits.parse().ok().filter(|_| plain)?;
    axis.checked_sub(1).filter(|axis| *axis < MAX_AXES)
}

/// True if an effect may have the name: a to z, 0 to 9 and `_`.
pub(super) fn is_effect_name(name: &str) -> bool {
    !name.is_empty() && name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cue::table::Splitter;

    fn faults(line: &str) -> Vec<String> {
        let mut faults = Collector::default();
        Header::read(line, 1, Splitter::new().split(line).unwrap(), &mut faults);
        faults
            .into_faults(std::path::Path::new("f"))
            .map_or_else(Vec::new, |f| f.to_string().lines().map(str::to_owned).collect())
    }

    #[test]
    fn a_whole_header_is_understood() {
        assert!(faults("time_s,a1,v1_hz,v1_amp,a2,fx_air,fx_water").is_empty());
        assert!(faults("time_ms,a1,io").is_empty());
        assert!(faults("time_ms,dac2,a1,dac1,fx_air").is_empty() && faults("time_ms,a1,dac2").is_empty());
    }

    #[test]
    fn every_fault_is_told_at_its_column() {
        let told = faults("time,a1,a3,v1_hz,v2_amp,v2_hz,wind,a13,fx_Air,a1");
        let starts: Vec<_> = told.iter().map(|f| f.split(';').next().unwrap_or("")).collect();
        assert_eq!(
            starts,
            [
                "f:1:1: time: unknown column",
                "f:1:31: wind: unknown column",
                "f:1:36: a13: unknown column",
                "f:1:40: fx_Air: an effect's name may only have a to z, 0 to 9 and _",
                "f:1:47: a1: the column occurs twice",
                "f:1:1: v1_amp: the column is missing",
                "f:1:1: a2: the column is missing",
            ]
        );
    }

    #[test]
    fn the_word_and_effects_exclude_each_other() {
        assert_eq!(
            faults("time_ms,a1,io,fx_air"),
            ["f:1:1: io: the raw output word and named effects exclude each other"]
        );
    }
}
