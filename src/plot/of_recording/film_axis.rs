//! Where on the axis of a picture the instants of a recording are: by show time, and where the film ran over that more than once, by
//! the pass of that instant.

use std::fmt;

use crate::plot::TimeAxis;
use crate::record::FilmPass;
use crate::time::{MonoTime, ShowTime};

/// An axis, and what stands on it.
#[derive(Debug, Clone)]
pub(crate) struct FilmAxis {
    pub(crate) time: TimeAxis,
    /// What is on it.
    passes: Vec<FilmPass>,
    /// All passes of the recording, each with its place among these where it is on the axis: what was sent in another is nowhere on it.
    all: Vec<(FilmPass, Option<usize>)>,
}

/// An instant that is on an axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Moment {
    /// Show time, s.
    pub(super) film_s: f64,
    /// Where on the axis, s.
    pub(super) at_s: f64,
    /// The pass, from 1; 0 where there is one.
    pass: usize,
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = ShowTime::from_secs_f64(self.film_s);
        match self.pass {
            0 => write!(f, "{at}"),
            pass => write!(f, "{at} in pass {pass}"),
        }
    }
}

impl FilmAxis {
    /// What lies of these passes between two show times, s; `None` where that is nothing.
    pub(crate) fn over(passes: &[FilmPass], (from, until): (f64, f64), columns: usize) -> Option<Self> {
        let shown = |pass: &FilmPass| {
            let mut shown = *pass;
            if from > pass.from_s {
                (shown.from_s, shown.before_s) = (from, 0.0);
            }
            if until < pass.until_s {
                (shown.until_s, shown.after_s) = (until, 0.0);
            }
            shown.has_run().then_some(shown)
        };
        let (mut on_it, mut all) = (Vec::new(), Vec::new());
        for pass in passes {
            let part = Some(pass).filter(|pass| pass.has_run()).and_then(shown);
            all.push((*pass, part.map(|_| on_it.len())));
            on_it.extend(part);
        }
        let stretches: Vec<_> = on_it.iter().map(|pass| (pass.from_s, pass.until_s)).collect();
        (!on_it.is_empty()).then(|| Self {
            time: TimeAxis::of_passes(&stretches, columns),
            passes: on_it,
            all,
        })
    }

    /// All of the film between two show times, s, whatever ran.
    pub(crate) fn of_film(from_s: f64, until_s: f64, columns: usize) -> Self {
        let (begin, end) = (MonoTime::default(), MonoTime::from_nanos(u64::MAX));
        let pass = FilmPass { begin, end, from_s, until_s, before_s: 0.0, after_s: 0.0 };
        let all = vec![(pass, Some(0))];
        Self { time: TimeAxis::of_film(from_s, until_s, columns), passes: vec![pass], all }
    }

    /// Show time alone, as far as all that is on this axis, in columns as wide: for what is laid over each pass.
    pub(crate) fn plain(&self) -> Self {
        /// Columns at the most: a seek may lead far away.
        const MOST: f64 = 20_000.0;
        if self.time.passes().is_empty() {
            return self.clone();
        }
        let from_s = self.passes.iter().map(|pass| pass.from_s).fold(f64::INFINITY, f64::min);
        let until_s = self.passes.iter().map(|pass| pass.until_s).fold(f64::NEG_INFINITY, f64::max);
        let columns = ((until_s - from_s) / (self.time.place(1) - self.time.from_s)).ceil().clamp(1.0, MOST);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to MOST")]
        let columns = columns as usize;
        Self::of_film(from_s, until_s, columns)
    }

    /// False before the film first ran in what is shown, and after it last did.
    pub(super) fn runs(&self, at: MonoTime) -> bool {
        self.passes.first().is_some_and(|pass| at > pass.begin)
            && self.passes.last().is_some_and(|pass| at <= pass.end)
    }

    /// Where an instant of that show time, s, is; `None` where it is not on the axis. What is told of the last `length_s` may be of any pass
    /// that ran in it.
    pub(super) fn moment(&self, at: MonoTime, film_s: f64, length_s: f64) -> Option<Moment> {
        let own = self.all.partition_point(|(pass, _)| pass.begin < at).saturating_sub(1);
        let ended = |index: &usize| at.since(self.all[*index + 1].0.begin).as_secs_f64() <= length_s;
        let candidates = std::iter::once(own).chain((0..own).rev().take_while(ended));
        let has = |index: &usize| {
            let FilmPass { from_s, until_s, before_s, after_s, .. } = self.all[*index].0;
            from_s - before_s <= film_s && film_s <= until_s + after_s
        };
        let distance = |index: &usize| self.distance(*index, at, film_s, length_s);
        // Of those as near as each other the latest.
        let index = candidates.filter(has).min_by(|one, other| distance(one).total_cmp(&distance(other)))?;
        let index = self.all[index].1?;
        let FilmPass { from_s, until_s, before_s, after_s, .. } = self.passes[index];
        if film_s < from_s - before_s || film_s > until_s + after_s {
            return None;
        }
        let (begin_s, pass) =
            self.time.passes().get(index).map_or((from_s, 0), |pass| (pass.at_s, index + 1));
        let at_s = begin_s + film_s.clamp(from_s, until_s) - from_s;
        Some(Moment { film_s, at_s: at_s.clamp(self.time.from_s, self.time.until_s), pass })
    }

    /// How far a show time is from where the film was in that pass in the last `length_s`, s.
    fn distance(&self, index: usize, at: MonoTime, film_s: f64, length_s: f64) -> f64 {
        /// A film that is led may run faster than it was made.
        const HURRY: f64 = 2.0;
        let FilmPass { begin, from_s, until_s, before_s, after_s, .. } = self.all[index].0;
        let (mut low, mut high) = (from_s - before_s, until_s + after_s);
        let since_begin = at.since(begin).as_secs_f64();
        if since_begin <= length_s {
            high = high.min(from_s + HURRY * since_begin);
        }
        if index + 1 < self.all.len() {
            let next = self.all[index + 1].0.begin;
            if next < at {
                low = low.max(until_s - FilmPass::BACK_S - HURRY * length_s);
            }
        }
        (low - film_s).max(film_s - high).max(0.0)
    }
}
