//! What an axis does at most, stretch by stretch of show time and however the frames fall: what changes of pace and level,
//! and vibration, are put on top of.

use super::pieces::{AxisPieces, seconds};
use super::stencil::{Stencil, Stencils};
use super::sweep::{StencilSweep, SumSink};
use crate::motion::{Limits, Slot};
use crate::time::Rate;
use crate::timeline::{Cubic, Timeline};

/// How much the greatest size in a stretch may be overstated.
const TOLERANCE: f64 = 0.02;
/// The greatest sizes in stretches of equal length, in strokes and seconds; never less than they are.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Loads {
    /// Distance over Time.
    pub(crate) velocity: Box<[f32]>,
    /// Acceleration; change of velocity from frame to frame counts as the part of its own limit that it is.
    pub(crate) acceleration: Box<[f32]>,
    /// Jerk.
    pub(crate) jerk: Box<[f32]>,
}

impl Loads {
    /// Those of an axis of a cue on a slot that carries it, at the slot's level and in frames of `rate`, for stretches of
    /// `span` nanoseconds. What is below `light` of a limit may be told as anything up to that. Takes time in proportion to the
    /// cue's rows, next to none where those are below `light`.
    #[must_use]
    pub(crate) fn of(
        timeline: &Timeline,
        axis: usize,
        slot: &Slot,
        rate: Rate,
        span: i64,
        light: f64,
    ) -> Self {
        let stencils = Stencils::at(rate);
        Self::over(&AxisPieces::new(timeline, axis, slot), slot.limits, &stencils, rate, span, light)
    }

    pub(super) fn over(
        pieces: &AxisPieces,
        limits: Limits,
        stencils: &Stencils,
        rate: Rate,
        span: i64,
        light: f64,
    ) -> Self {
        let Limits { velocity, acceleration, jerk } = limits;
        let step = super::stencil::step_limit(acceleration, rate);
        let fill =
            |stencils: &[Stencil], order, limit: f64| fill(pieces, stencils, order, light * limit, span);
        // As a part of a limit of its own, so that one row says of both how near they come.
        let steps = fill(&stencils.step, 2, step);
        let mut accelerations = fill(&stencils.acceleration, 2, acceleration);
        for (most, step_met) in accelerations.iter_mut().zip(steps) {
            *most = most.max(up(f64::from(step_met) / step * acceleration));
        }
        Self {
            velocity: fill(&stencils.velocity, 1, velocity).into(),
            acceleration: accelerations.into(),
            jerk: fill(&stencils.jerk, 3, jerk).into(),
        }
    }
}

/// The greatest size of each stretch of `span` nanoseconds over all stencils; what is below `light` may be told as anything up to that.
pub(super) fn fill(
    pieces: &AxisPieces,
    stencils: &[Stencil],
    order: usize,
    light: f64,
    span: i64,
) -> Vec<f32> {
    let stretches = usize::try_from(pieces.end() / span).unwrap_or(0) + 1;
    let mut peaks = Peaks { span, most: vec![0.0; stretches] };
    let mut passed_over = vec![0.0_f32; stretches];
    for stencil in stencils {
        let middle = stencil.middle;
        let mut sweep = StencilSweep { pieces, stencil, sink: &mut peaks };
        let Some(last) = sweep.last() else { continue };
        for run in sweep.runs(order, last) {
            let (from, until) = (run.from + middle, run.until + middle);
            // By the stretch of it that is met with least, so that none is told as more (docs/limiter.md, section 5).
            if run.bound > light.max(sweep.sink.ignores(from, until) * (1.0 + TOLERANCE)) {
                sweep.cells(&run);
            } else {
                let touched = sweep.sink.touched(from, until);
                passed_over[touched].iter_mut().for_each(|most| *most = most.max(up(run.bound)));
            }
        }
        sweep.at_the_end(last);
    }
    peaks.most.iter().zip(passed_over).map(|(met, passed_over)| met.max(passed_over)).collect()
}

/// The greatest size in each stretch.
struct Peaks {
    span: i64,
    most: Vec<f32>,
}

impl Peaks {
    /// The stretches that lie between two show times, or have one of them in them.
    fn touched(&self, from: i64, until: i64) -> std::ops::RangeInclusive<usize> {
        let last = self.most.len() - 1;
        let [from, until] = [from, until].map(|at| usize::try_from(at / self.span).unwrap_or(0).min(last));
        from..=until
    }
}

impl SumSink for Peaks {
    fn ignores(&self, from: i64, until: i64) -> f64 {
        self.most[self.touched(from, until)]
            .iter()
            .fold(f64::INFINITY, |least, most| least.min(f64::from(*most)))
    }

    fn take(&mut self, from: i64, until: i64, cubic: Cubic) {
        let whole = seconds(until - from);
        // A cell may lie over several stretches; each is told the most of its own part alone.
        for stretch in self.touched(from, until) {
            let begins = self.span * i64::try_from(stretch).expect("under a day");
            let (begin, end) = (begins.max(from), (begins + self.span).min(until));
            let part = if whole > 0.0 {
                cubic.from(seconds(begin - from) / whole).scaled(seconds(end - begin) / whole)
            } else {
                cubic
            };
            let met = [0.0, 1.0].into_iter().chain(part.still()).map(|u| part.at(u).abs());
            let most = &mut self.most[stretch];
            *most = most.max(up(met.fold(0.0, f64::max)));
        }
    }
}

/// In single precision, and no less.
#[expect(clippy::cast_possible_truncation, reason = "it is rounded upwards")]
fn up(value: f64) -> f32 {
    (value as f32).next_up()
}
