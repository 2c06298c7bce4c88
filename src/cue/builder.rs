//! A cue that is made here, row by row, and read from no file.

use std::path::Path;

use super::limits::MAX_EFFECTS;
use super::problem::Problem;
use super::{Cue, CueFaults, Effects, Interpolation, Origin, Steps};
use crate::time::ShowTime;

/// A cue in the making, in fractions of strokes.
#[derive(Debug)]
pub(crate) struct CueBuilder {
    cue: Cue,
    effects: Vec<String>,
    steps: Steps<u32>,
}

impl CueBuilder {
    /// A cue of so many axes, which reports and faults know by that name.
    #[must_use]
    pub(crate) fn new(name: &str, axes: usize) -> Self {
        let cue = Cue { axes, origin: Origin::Messages, ..Cue::blank(Path::new(name)) };
        Self { cue, effects: Vec::new(), steps: Steps::default() }
    }

    /// A cue of so many axes that asks for nothing, for so long.
    #[must_use]
    pub(crate) fn flat(name: &str, axes: usize, lasts: ShowTime) -> Cue {
        let mut flat = Self::new(name, axes);
        for at in [ShowTime::ZERO, lasts] {
            flat.row(at, std::iter::repeat_n(0.0, axes), None);
        }
        flat.cue // it has no effects
    }

    /// The same with a title, curved between its rows, with effects of those names.
    #[must_use]
    pub(crate) fn curved(mut self, title: &str, effects: Vec<String>) -> Self {
        self.cue.set_title(title.to_owned());
        self.cue.interpolation = Interpolation::Monotone;
        Self { effects, ..self }
    }

    /// Adds a row that is later than the one before; `on` is the effect, from 0, that is on from then.
    ///
    /// # Panics
    /// If there is not a position for each axis.
    pub(crate) fn row(&mut self, at: ShowTime, positions: impl IntoIterator<Item = f64>, on: Option<usize>) {
        self.cue.times.push(at);
        self.cue.positions.extend(positions);
        assert_eq!(
            self.cue.positions.len(),
            self.cue.times.len() * self.cue.axes,
            "each row has a position for each axis"
        );
        let bit = on.and_then(|effect| 1u32.checked_shl(u32::try_from(effect).ok()?));
        self.steps.push(at, bit.unwrap_or(0));
    }

    /// The cue.
    ///
    /// # Errors
    /// Where it has more effects than a cue may name.
    pub(crate) fn build(self) -> Result<Cue, CueFaults> {
        let Self { mut cue, effects: names, steps } = self;
        if names.len() > MAX_EFFECTS {
            return Err(CueFaults::one(cue.path(), Problem::TooManyEffects));
        }
        if !names.is_empty() {
            cue.effects = Effects::Named { names, steps };
        }
        Ok(cue)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cue::{Source, read};

    #[test]
    fn a_cue_that_is_made_is_the_one_that_would_be_read() {
        let text = "# title: two\n# interpolation: monotone\ntime_ms,a1,a2,fx_fog,fx_air\n0,0,0.5,0,0\n500,0.25,0.5,0,1\n1000,0,0.5,0,0\n";
        let read = read(Path::new("made"), text.as_bytes(), &Source::Native).unwrap();
        let names = ["fog", "air"].map(str::to_owned).to_vec();
        let mut made = CueBuilder::new("made", 2).curved("two", names);
        for (ms, first, on) in [(0, 0.0, None), (500, 0.25, Some(1)), (1_000, 0.0, None)] {
            made.row(ShowTime::from_millis(ms), [first, 0.5], on);
        }
        assert_eq!(made.build().unwrap(), Cue { origin: Origin::Messages, ..read });
    }

    #[test]
    fn a_hall_with_more_effects_than_a_cue_names_has_none_made() {
        let names = (0..33).map(|effect| format!("e{effect}")).collect();
        let mut made = CueBuilder::new("made", 1).curved("many", names);
        made.row(ShowTime::ZERO, [0.0], Some(40));
        assert!(made.build().unwrap_err().to_string().contains("more than 32 effects"));
    }
}
