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
        if !is_time(cells.get(0)) && is_time(cells.get(1)) {
            faults.add(place(0), Some(cells.get(0)), Problem::BeforeTheTime);
            return header;
        }
        for index in 0..filled(cells) {
            let name = cells.get(index);
            match header.column(index, &name.to_ascii_lowercase()) {
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

    /// What a column carries whose name is that, in small letters.
    fn column(&mut self, index: usize, name: &str) -> Result<Column, Problem> {
        match (index, name) {
            (0, "time_ms") => self.time_unit_ns = 1e6,
            (0, "time_s") => self.time_unit_ns = 1e9,
            (0, _) => return Err(Problem::UnknownColumn("the first column is time_ms or time_s")),
            (_, "io") => return Ok(Column::Word),
            (_, "") => return Err(Problem::NoName),
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

/// The cells of a header up to the last with a name: behind it a spreadsheet leaves empty ones.
fn filled(cells: Cells<'_>) -> usize {
    let named: Vec<bool> = cells.iter().map(|name| !name.is_empty()).collect();
    let last = named.iter().rposition(|is_named| *is_named);
    // Of more cells than there is room for, nobody knows.
    if named.len() < cells.count() { cells.count() } else { last.map_or(0, |last| last + 1) }
}

fn is_time(name: &str) -> bool {
    ["time_ms", "time_s"].iter().any(|time| name.eq_ignore_ascii_case(time))
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
        let told = faults("time,a1,a3,v1_hz,v2_amp,v2_hz,wind,a13,fx_a-r,a1");
        let starts: Vec<_> = told.iter().map(|f| f.split(';').next().unwrap_or("")).collect();
        assert_eq!(
            starts,
            [
                "f:1:1: time: unknown column",
                "f:1:31: wind: unknown column",
                "f:1:36: a13: unknown column",
                "f:1:40: fx_a-r: an effect's name may only have a to z, 0 to 9 and _",
                "f:1:47: a1: the column occurs twice",
                "f:1:1: v1_amp: the column is missing",
                "f:1:1: a2: the column is missing",
            ]
        );
    }

    #[test]
    fn columns_may_be_named_in_capitals_and_empty_ones_may_stand_behind_them() {
        for header in
            ["Time_ms,A1,V1_Hz,V1_Amp,FX_Air", "TIME_S,a1,IO", "time_ms,a1,,", "time_ms,a1,\"\",\" \""]
        {
            assert_eq!(faults(header), [""; 0], "{header}");
        }
        assert_eq!(faults("time_ms,a1,A1"), ["f:1:12: A1: the column occurs twice"]);
        let unnamed = faults("time_ms,a1,,a2");
        assert!(
            unnamed.len() == 1 && unnamed[0].starts_with("f:1:12: a column without a name"),
            "{unnamed:?}"
        );
    }

    #[test]
    fn an_index_before_the_time_is_one_fault_that_names_the_ways_to_leave_it_out() {
        for header in [",time_ms,a1,fx_air", "\"\",time_ms,a1", "Unnamed: 0,time_ms,a1", "index,Time_s,a1"] {
            let told = faults(header);
            assert!(told.len() == 1 && told[0].contains("index=False"), "{header}: {told:?}");
        }
    }

    #[test]
    fn what_nobody_sees_in_the_name_of_a_column_is_shown() {
        for (name, shown) in
            [("\u{a0}a2", "\\u{a0}a2"), ("a\u{200b}2", "a\\u{200b}2"), ("\u{feff}a2", "\\u{feff}a2")]
        {
            let told = faults(&format!("time_ms,a1,{name}"));
            assert!(told[0].starts_with(&format!("f:1:12: {shown}: unknown column")), "{told:?}");
        }
    }

    #[test]
    fn the_word_and_effects_exclude_each_other() {
        assert_eq!(
            faults("time_ms,a1,io,fx_air"),
            ["f:1:1: io: the raw output word and named effects exclude each other"]
        );
    }
}
