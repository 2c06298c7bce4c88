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
    passes: Vec<FilmPass>,
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
        let passes: Vec<FilmPass> = passes.iter().filter(|pass| pass.has_run()).filter_map(shown).collect();
        let stretches: Vec<_> = passes.iter().map(|pass| (pass.from_s, pass.until_s)).collect();
        (!passes.is_empty()).then(|| Self { time: TimeAxis::of_passes(&stretches, columns), passes })
    }

    /// All of the film between two show times, s, whatever ran.
    pub(crate) fn of_film(from_s: f64, until_s: f64, columns: usize) -> Self {
        let (begin, end) = (MonoTime::default(), MonoTime::from_nanos(u64::MAX));
        let pass = FilmPass { begin, end, from_s, until_s, before_s: 0.0, after_s: 0.0 };
        Self { time: TimeAxis::of_film(from_s, until_s, columns), passes: vec![pass] }
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

    /// Where an instant of that show time, s, is; `None` where it is not on the axis.
    pub(super) fn moment(&self, at: MonoTime, film_s: f64) -> Option<Moment> {
        let has = |index: &usize| {
            let FilmPass { from_s, until_s, before_s, after_s, .. } = self.passes[*index];
            from_s - before_s <= film_s && film_s <= until_s + after_s
        };
        let own = self.passes.partition_point(|pass| pass.begin < at).saturating_sub(1);
        // A tick of the sample in which the film went back may be of the pass before.
        let FilmPass { begin, before_s, .. } = self.passes[own];
        let may_be_before = at.since(begin).as_secs_f64() <= before_s;
        let before = own.checked_sub(1).filter(|_| may_be_before);
        let index = [Some(own), before].into_iter().flatten().find(has)?;
        let FilmPass { from_s, until_s, .. } = self.passes[index];
        let (begin_s, pass) =
            self.time.passes().get(index).map_or((from_s, 0), |pass| (pass.at_s, index + 1));
        let at_s = begin_s + film_s.clamp(from_s, until_s) - from_s;
        Some(Moment { film_s, at_s: at_s.clamp(self.time.from_s, self.time.until_s), pass })
    }
}
