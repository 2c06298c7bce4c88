//! The time axis of a picture: show time from one place to another; or, where the film ran over the same places more than once, each
//! of these passes beside the one before.

use serde::Serialize;

use super::scale;

/// Columns that are left empty between passes, and how many there have to be for each pass to have such room.
const GAP: usize = 2;
const ROOMY: usize = 16;

/// Columns of time, all equally long.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TimeAxis {
    /// Where the first column begins, s: a show time, or 0 where there are passes.
    pub(crate) from_s: f64,
    /// Where the last column ends, s.
    pub(crate) until_s: f64,
    /// How many there are, at least one.
    pub(crate) columns: usize,
    /// Stretches of the film that stand beside each other; none where the axis is show time itself.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    passes: Vec<AxisPass>,
}

/// A stretch of the film on an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct AxisPass {
    /// Where on the axis it begins, s.
    pub(crate) at_s: f64,
    /// The show time there, s.
    pub(crate) film_s: f64,
    /// The show time at its end, s.
    pub(crate) until_s: f64,
}

/// A tick of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimeTick {
    /// Where it is, as a part of the axis.
    pub(super) part: f64,
    /// The show time there, s.
    pub(super) film_s: f64,
}

impl TimeAxis {
    /// Show time from one place to another.
    pub(crate) const fn of_film(from_s: f64, until_s: f64, columns: usize) -> Self {
        Self { from_s, until_s, columns, passes: Vec::new() }
    }

    /// Stretches of the film, each from one show time to a later one, beside each other.
    #[expect(clippy::cast_precision_loss, reason = "some thousand columns")]
    pub(crate) fn of_passes(passes: &[(f64, f64)], columns: usize) -> Self {
        if let [(from_s, until_s)] = *passes {
            return Self::of_film(from_s, until_s, columns);
        }
        let gap = if columns >= ROOMY * passes.len() { GAP } else { 0 };
        let length: f64 = passes.iter().map(|(from, until)| until - from).sum();
        let gap_s = length * gap as f64 / (columns - gap * passes.len().saturating_sub(1)).max(1) as f64;
        let mut end_s = -gap_s;
        let placed = passes.iter().map(|&(film_s, until_s)| {
            let at_s = end_s + gap_s;
            end_s = at_s + until_s - film_s;
            AxisPass { at_s, film_s, until_s }
        });
        let passes = placed.collect();
        Self { from_s: 0.0, until_s: end_s, columns, passes }
    }

    /// The passes; none where the axis is show time itself.
    pub(crate) fn passes(&self) -> &[AxisPass] {
        &self.passes
    }

    /// Where a place is, as a part of the axis; `None` outside.
    #[must_use]
    pub(crate) fn part(&self, at_s: f64) -> Option<f64> {
        let part = (at_s - self.from_s) / (self.until_s - self.from_s);
        (0.0..=1.0).contains(&part).then_some(part)
    }

    /// The column of a place; `None` outside.
    #[must_use]
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to the number of columns"
    )]
    pub(crate) fn column(&self, at_s: f64) -> Option<usize> {
        self.part(at_s).map(|part| ((part * self.columns as f64) as usize).min(self.columns - 1))
    }

    /// Where a column begins, s; after the last, where that ends.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "some thousand columns")]
    pub(crate) fn place(&self, column: usize) -> f64 {
        self.from_s + (self.until_s - self.from_s) * column as f64 / self.columns as f64
    }

    /// The show time at a place, s.
    #[must_use]
    pub(crate) fn film_s(&self, at_s: f64) -> f64 {
        let pass = self.passes.iter().rev().find(|pass| pass.at_s <= at_s).or(self.passes.first());
        pass.map_or(at_s, |pass| (pass.film_s + at_s - pass.at_s).clamp(pass.film_s, pass.until_s))
    }

    /// At most so many ticks, and the step that is between them within a pass, s.
    pub(super) fn ticks(&self, most: f64) -> (f64, Vec<TimeTick>) {
        let length = self.until_s - self.from_s;
        let own = [AxisPass { at_s: self.from_s, film_s: self.from_s, until_s: self.until_s }];
        let passes = if self.passes.is_empty() { &own[..] } else { &self.passes };
        let longest = passes.iter().map(|pass| pass.until_s - pass.film_s).fold(0.0, f64::max);
        // Steps are at most 2.5 times apart, so that the longest pass has a tick.
        let least = if passes.len() > 1 { (length / most).min(longest / 2.5) } else { length / most };
        let step = scale::time_step(least);
        let (mut ticks, mut last): (Vec<TimeTick>, f64) = (Vec::new(), f64::NEG_INFINITY);
        for pass in passes {
            for film_s in scale::multiples(pass.film_s, pass.until_s, step) {
                let at_s = pass.at_s + film_s - pass.film_s;
                // Ticks of passes that follow each other may come too close.
                if at_s - last >= 0.8 * length / most {
                    last = at_s;
                    ticks.push(TimeTick { part: ((at_s - self.from_s) / length).clamp(0.0, 1.0), film_s });
                }
            }
        }
        (step, ticks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_stand_beside_each_other_and_each_place_has_the_show_time_of_its_own() {
        let axis = TimeAxis::of_passes(&[(0.0, 10.0), (4.0, 8.0), (2.0, 12.0)], 240);
        let [first, second, third] = axis.passes() else { panic!("{axis:?}") };
        assert!(second.at_s > 10.0 && third.at_s > second.at_s + 4.0, "{axis:?}");
        for (at_s, film_s) in [(0.0, 0.0), (9.5, 9.5), (second.at_s + 1.0, 5.0), (third.at_s + 9.0, 11.0)] {
            assert!((axis.film_s(at_s) - film_s).abs() < 1e-9, "{at_s}");
        }
        assert_eq!(first.at_s, 0.0);
        // What is between them is nobody's.
        let (end, begin) = (axis.column(9.999), axis.column(second.at_s + 1e-9));
        assert!(begin.zip(end).is_some_and(|(begin, end)| begin >= end + 2), "{axis:?}");
        let (step, ticks) = axis.ticks(12.0);
        assert_eq!(step, 5.0);
        let films: Vec<f64> = ticks.iter().map(|tick| tick.film_s).collect();
        assert_eq!(films, [0.0, 5.0, 10.0, 5.0, 10.0], "that of the second pass would be too near");
    }

    #[test]
    fn of_many_short_passes_no_two_ticks_come_close() {
        let axis = TimeAxis::of_passes(&[(3.0, 33.0); 240], 900);
        let (_, ticks) = axis.ticks(12.0);
        assert!((4..=15).contains(&ticks.len()), "{}", ticks.len());
        assert!(ticks.windows(2).all(|pair| pair[1].part - pair[0].part > 0.8 / 12.5));
        assert_eq!(TimeAxis::of_passes(&[(3.0, 33.0)], 900), TimeAxis::of_film(3.0, 33.0, 900));
    }
}
