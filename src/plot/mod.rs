//! Pictures of motion over time: a [`Picture`] into braille for a terminal, into SVG, and into a page. Control thread; pure.
//!
//! The picture knows neither cue nor recording: bands over columns of time, lanes of what is on, flags and marks. What is drawn of
//! a cue is made in `of_cue`, what is drawn of a recording in `of_recording`.

mod braille;
mod of_cue;
mod of_recording;
mod page;
mod path;
mod scale;
mod svg;
#[cfg(test)]
mod tests;
mod text;
mod theme;
mod time_axis;

pub(crate) use braille::{braille, cells, in_blocks};
pub(crate) use of_cue::{Columns, Subject, of_cue};
pub(crate) use of_recording::{FilmAxis, Gathered, Look, of_recording};
pub(crate) use page::page;
pub(crate) use svg::svg;
pub(crate) use theme::Theme;
pub(crate) use time_axis::TimeAxis;

use serde::Serialize;

/// What is drawn: everything on one time axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Picture {
    /// What it is of; from anywhere, and escaped by whoever draws it.
    pub(crate) title: String,
    /// What a person has to know first.
    pub(crate) sentence: String,
    /// What it holds for: digests, seat, rate, version.
    pub(crate) facts: Vec<String>,
    /// The time axis.
    pub(crate) time: TimeAxis,
    /// What has a scale, from the top down.
    pub(crate) panels: Vec<Panel>,
    /// What is on or off.
    pub(crate) lanes: Vec<Lane>,
    /// Named instants.
    pub(crate) flags: Vec<Flag>,
    /// How often what, as bars.
    pub(crate) histograms: Vec<Histogram>,
    /// The figures as words.
    pub(crate) table: Table,
}

/// Figures as words, a row each.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct Table {
    /// What they are of.
    pub(crate) name: &'static str,
    /// What stands in each column.
    pub(crate) head: [&'static str; 6],
    /// The rows.
    pub(crate) rows: Vec<[String; 6]>,
}

/// How often something was in each of some bins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Histogram {
    /// Of what.
    pub(crate) name: &'static str,
    /// The upper end of each bin in words, and how often it was met.
    pub(crate) bins: Vec<(String, u64)>,
}

impl Histogram {
    /// How high the bar of a bin is, 0 to 1: by the logarithm, so that what was met once shows beside what was met a million times.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a picture is no finer")]
    pub(crate) fn height(&self, count: u64) -> f64 {
        let most = self.bins.iter().map(|(_, count)| *count).max().unwrap_or(0);
        let log = |count: u64| (1.0 + count as f64).ln();
        if most == 0 { 0.0 } else { log(count) / log(most) }
    }
}

/// What a panel's scale means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Scale {
    /// Places in a range that is drawn whole.
    Range,
    /// Parts of a limit, % of it; 100 is a line, and what is over it is hatched.
    Limit,
}

/// Bands over one scale.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Panel {
    /// What it shows.
    pub(crate) name: String,
    /// What is worst in it, in words.
    pub(crate) note: String,
    /// When and where in the file that is; empty where nothing is worst.
    pub(crate) place: String,
    /// The unit of its scale.
    pub(crate) unit: &'static str,
    /// What the scale means.
    pub(crate) scale: Scale,
    /// The lower end.
    pub(crate) low: f64,
    /// The upper end, above the lower one.
    pub(crate) high: f64,
    /// What is drawn.
    pub(crate) bands: Vec<Band>,
    /// The worst instants.
    pub(crate) marks: Vec<Mark>,
}

impl Panel {
    /// Where a value is on the scale, 0 at its lower end and 1 at the upper one; held at the ends.
    #[must_use]
    pub(crate) fn part(&self, value: f64) -> f64 {
        ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }
}

/// One curve: what it is at least and at most in each column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Band {
    /// What stands at its end.
    pub(crate) name: String,
    /// How it is drawn: the colour of that number, dashed from the seventh on.
    pub(crate) style: usize,
    /// Least and greatest of each column, in the panel's unit; `None` where nothing is known.
    pub(crate) columns: Vec<Option<[f32; 2]>>,
}

impl Band {
    /// The last place that is known of it.
    #[must_use]
    pub(crate) fn last(&self) -> Option<[f32; 2]> {
        self.columns.iter().rev().find_map(|column| *column)
    }
}

/// An instant of a band that is to be seen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Mark {
    /// Where on the time axis, s.
    pub(crate) at_s: f64,
    /// Where, in the panel's unit.
    pub(crate) value: f64,
    /// The style of its band.
    pub(crate) style: usize,
    /// What it is, with its place in the file.
    pub(crate) words: String,
}

/// What is on over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Lane {
    /// What it is.
    pub(crate) name: String,
    /// How much of it there is, in words.
    pub(crate) note: String,
    /// The most of each column.
    pub(crate) columns: Vec<Shade>,
}

/// How much something is on in a column.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(crate) struct Shade {
    /// How high, 0 to 1; 0 is off.
    pub(crate) height: f32,
    /// How dark, 0 to 1.
    pub(crate) tone: f32,
}

/// A named instant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Flag {
    /// Where on the time axis, s.
    pub(crate) at_s: f64,
    /// Its name; from anywhere.
    pub(crate) name: String,
    /// Whether a person has marked it.
    pub(crate) is_mark: bool,
}
