//! The median of several rounds, and how far apart they were.

use std::fmt;

/// A figure that was taken in several rounds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spread {
    /// The middle one.
    pub(crate) median: f64,
    least: f64,
    most: f64,
}

impl Spread {
    /// The spread of the figures of all rounds.
    ///
    /// # Panics
    /// Where there are none.
    pub(crate) fn of(figures: impl IntoIterator<Item = f64>) -> Self {
        let mut figures: Vec<f64> = figures.into_iter().collect();
        figures.sort_by(f64::total_cmp);
        let middle = figures.len() / 2;
        let median = if figures.len().is_multiple_of(2) {
            f64::midpoint(figures[middle - 1], figures[middle])
        } else {
            figures[middle]
        };
        Self { median, least: figures[0], most: figures[figures.len() - 1] }
    }
}

impl fmt::Display for Spread {
    /// `1.02 (0.98..1.10)`, or with another number of digits after the point: the median, the least and the greatest.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = f.precision().unwrap_or(2);
        let Self { median, least, most } = self;
        write!(f, "{median:.digits$} ({least:.digits$}..{most:.digits$})")
    }
}

/// Whether a goal of at most `limit` is met, in words.
pub(crate) fn verdict(figure: Spread, limit: f64) -> &'static str {
    if figure.median <= limit { "met" } else { "not met" }
}
