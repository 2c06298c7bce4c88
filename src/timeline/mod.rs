//! A cue as a function of show time: solved once from a [`Cue`], then only read. Built on a control thread; sampled on
//! the tick thread, where nothing here allocates, blocks or panics.

mod cubic;
mod curve;
mod envelope;
mod extremes;
mod figures;
mod fit;
mod spline;

pub(crate) use cubic::Cubic;
pub(crate) use envelope::Stretches;
pub(crate) use extremes::{AxisExtremes, Extreme};
pub(crate) use figures::{EffectUse, Figure, LevelUse};
pub(crate) use fit::{HELD_BACK, Held};

use crate::channel::{self, Sample, Samples, TRACKS, TrackId};
use crate::cue::{Cue, Effects, Unit, Vibration};
use crate::motion::{MAX_AXES, Pose};
use crate::time::ShowTime;

/// Where the last answers were found, so that the next ones, a little later in time, are found at once.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hint {
    row: usize,
    tracks: [usize; TRACKS],
    effects: usize,
}

/// What is switched on at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EffectSet {
    /// Bit i says whether effect i of [`Timeline::effect_names`] is on.
    Named(u32),
    /// The raw output word; only its low 12 bits have outputs.
    Word(u16),
}

/// A cue's motion, vibration and effects at any show time. Immutable.
#[derive(Debug)]
pub struct Timeline {
    cue: Cue,
    /// Second derivatives `[row][axis]` of a spline, per second squared; empty for the other curves. Single precision
    /// is some 1e-7 of the curve's own bend, and halves the memory.
    bends: Vec<f32>,
    extremes: Vec<AxisExtremes>,
    /// The tracks that the cue has.
    tracks: Vec<TrackId>,
}

impl Timeline {
    /// Solves the cue's curve. Takes time and memory in proportion to its rows.
    #[must_use]
    pub fn new(cue: Cue) -> Self {
        let bends = spline::solve(&cue);
        let tracks = cue.tracks().used().map(|(track, _)| track).collect();
        let mut timeline = Self { cue, bends, extremes: Vec::new(), tracks };
        timeline.extremes = extremes::find(&timeline);
        timeline
    }

    /// The cue it was made from.
    #[must_use]
    pub const fn cue(&self) -> &Cue {
        &self.cue
    }

    /// The same, where the curve is no longer needed.
    #[must_use]
    pub(crate) fn into_cue(self) -> Cue {
        self.cue
    }

    /// Axes, 1 to 12.
    #[must_use]
    pub const fn axes(&self) -> usize {
        self.cue.axes()
    }

    /// The unit of poses and amplitudes.
    #[must_use]
    pub(crate) const fn unit(&self, axis: usize) -> Unit {
        self.cue.units().of(axis)
    }

    /// The time of the last row.
    #[must_use]
    pub fn duration(&self) -> ShowTime {
        self.cue.duration()
    }

    /// The pose at a show time, in the cue's unit; before the first row its pose, after the last row that row's. Where
    /// the curve of a cue in fractions leaves the stroke, it is held at the stroke's end; curves in other units are
    /// not, as their stroke is the seat's. Asked onwards in time this takes constant time, after a seek the logarithm
    /// of the number of rows.
    #[must_use]
    pub fn sample(&self, at: ShowTime, hint: &mut Hint) -> Pose {
        let mut pose = [0.0; MAX_AXES];
        let row = self.row_at(at, &mut hint.row);
        if row + 1 < self.cue.rows() && at > ShowTime::ZERO {
            let (start, end) = (self.cue.times()[row].as_nanos(), self.cue.times()[row + 1].as_nanos());
            let part = ratio(at.as_nanos() - start, end - start);
            for (axis, position) in pose.iter_mut().enumerate().take(self.axes()) {
                *position = self.cubic(row, axis).at(part);
            }
        } else {
            pose[..self.axes()].copy_from_slice(self.cue.row(row));
        }
        let units = self.cue.units();
        for (axis, position) in pose.iter_mut().enumerate() {
            if units.of(axis) == Unit::Fraction {
                *position = position.clamp(0.0, 1.0);
            }
        }
        pose
    }

    /// The last row at or before a show time; the first one before it.
    fn row_at(&self, at: ShowTime, hint: &mut usize) -> usize {
        let times = self.cue.times();
        let holds = |row: usize| {
            times.get(row).is_some_and(|start| *start <= at) && times.get(row + 1).is_none_or(|end| at < *end)
        };
        if !holds(*hint) {
            *hint = if holds(*hint + 1) {
                *hint + 1
            } else {
                times.partition_point(|start| *start <= at).saturating_sub(1)
            };
        }
        *hint
    }

    /// The row at or before a show time; the first one before it.
    #[must_use]
    pub(crate) fn row_before(&self, at: ShowTime) -> usize {
        self.cue.times().partition_point(|time| *time <= at).saturating_sub(1)
    }

    /// What each track of the table holds at a show time; off where the cue has none.
    #[must_use]
    pub(crate) fn samples(&self, at: ShowTime, hint: &mut Hint) -> Samples {
        let mut all = Samples::REST;
        for track in &self.tracks {
            all.set(*track, self.cue.tracks().of(*track).at(at, &mut hint.tracks[track.index()]));
        }
        all
    }

    /// True if anything ever vibrates.
    #[must_use]
    pub fn has_vibration(&self) -> bool {
        (0..self.axes()).any(|axis| self.vibrates(axis))
    }

    /// True if an axis, counted from 0, ever vibrates.
    #[must_use]
    pub(crate) fn vibrates(&self, axis: usize) -> bool {
        self.cue.tracks().vibration(axis).as_slice().iter().any(|step| moves(step.value))
    }

    /// The highest level of a part of a channel, and the first show time at which it is asked for; `None` if it is always off.
    #[must_use]
    pub(crate) fn greatest_level(&self, track: TrackId, part: usize) -> Option<(ShowTime, f64)> {
        let on = self.cue.tracks().of(track).as_slice().iter().map(|step| (step.at, step.value.0[part]));
        on.filter(|(_, level)| *level > 0.0).reduce(|most, step| if step.1 > most.1 { step } else { most })
    }

    /// The farthest swing of an axis, counted from 0, and the first show time from which it holds; `None` if the axis
    /// never vibrates.
    #[must_use]
    pub(crate) fn strongest_vibration(&self, axis: usize) -> Option<(ShowTime, Vibration)> {
        let steps = self.cue.tracks().vibration(axis).as_slice().iter().filter(|step| moves(step.value));
        let vibrations = steps.map(|step| (step.at, Vibration::from(step.value)));
        vibrations.reduce(|most, step| if step.1.amplitude > most.1.amplitude { step } else { most })
    }

    /// The effects that are on at a show time.
    #[must_use]
    pub fn effects(&self, at: ShowTime, hint: &mut Hint) -> EffectSet {
        match self.cue.effects() {
            Effects::Named { steps, .. } => EffectSet::Named(steps.at(at, &mut hint.effects)),
            Effects::Words(steps) => EffectSet::Word(steps.at(at, &mut hint.effects)),
        }
    }

    /// The names of the effects, in the order of their bits; `None` if the cue carries raw output words.
    #[must_use]
    pub(crate) fn effect_names(&self) -> &[String] {
        match self.cue.effects() {
            Effects::Named { names, .. } => names,
            Effects::Words(_) => &[],
        }
    }

    /// What an operator may switch of it: its effects, and outputs of the table that it uses.
    #[must_use]
    pub(crate) fn switch_names(&self) -> Vec<String> {
        let levels =
            channel::switches().filter(|(track, part, _)| self.greatest_level(*track, *part).is_some());
        let levels = levels.map(|(_, _, name)| name.to_owned());
        self.effect_names().iter().cloned().chain(levels).collect()
    }

    /// The least and greatest value of each axis's curve, exact also between rows, and before anything is held at
    /// the stroke's ends.
    #[must_use]
    pub(crate) fn extremes(&self) -> &[AxisExtremes] {
        &self.extremes
    }
}

fn moves(sample: Sample) -> bool {
    let vibration = Vibration::from(sample);
    vibration.hz > 0.0 && vibration.amplitude > 0.0
}

#[expect(clippy::cast_precision_loss, reason = "spans under a day are exact")]
fn ratio(part: i64, whole: i64) -> f64 {
    part as f64 / whole as f64
}

#[cfg(test)]
mod tests;
