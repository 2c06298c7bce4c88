//! The greatest size of a divided difference over all phases of the grid: between the rows, shifted by the distances of
//! the stencil, it is a cubic of the phase, whose extremes are known in closed form.

use super::pieces::{AxisPieces, Block, CubicPiece, between, larger, seconds};
use super::stencil::Stencil;
use crate::timeline::Cubic;

/// Stretches over a limit with less than this between them are one, nanoseconds.
const ONE_STRETCH: i64 = 100_000_000;

// Velocity's bound is close anyway (docs/limiter.md, section 5).
/// How much the greatest size may be overstated, by order: what is surely no worse than that is not looked at.
const TOLERANCE: [f64; 3] = [0.002, 0.02, 0.02];

/// A stretch of show time in which a limit is broken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    /// Show times, nanoseconds.
    pub(super) from: i64,
    pub(super) until: i64,
    /// The greatest size, and where.
    pub(super) worst: f64,
    pub(super) at: i64,
}

/// What was met on the way through an axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Swept {
    /// The greatest size.
    pub(super) worst: f64,
    /// Where, show time in nanoseconds.
    pub(super) at: i64,
    /// Where it is over the threshold, in order of time.
    pub(super) over: Vec<Stretch>,
}

/// Sweeps stencils of the differences of an order (1 to 3) over an axis. The greatest size is given as up to
/// [`TOLERANCE`] more than it is, never as less, and never as over the threshold where it is not.
pub(super) fn sweep(pieces: &AxisPieces, stencils: &[Stencil], order: usize, threshold: f64) -> Swept {
    let mut over = Over { threshold, swept: Swept::default() };
    let mut passed_over = 0.0_f64;
    for stencil in stencils {
        let mut one = StencilSweep { pieces, stencil, sink: &mut over };
        passed_over = passed_over.max(one.run(order));
    }
    let mut swept = over.swept;
    // Nobody has looked there, so its bound is told: too much by the tolerance at most, never too little.
    swept.worst = swept.worst.max(passed_over);
    swept.over.sort_by_key(|stretch| stretch.from);
    swept.over = merged(&swept.over);
    swept
}

fn merged(sorted: &[Stretch]) -> Vec<Stretch> {
    let mut merged: Vec<Stretch> = Vec::new();
    for &next in sorted {
        match merged.last_mut().filter(|last| next.from - last.until <= ONE_STRETCH) {
            Some(last) => last.join(next),
            None => merged.push(next),
        }
    }
    merged
}

impl Stretch {
    fn join(&mut self, next: Self) {
        self.until = self.until.max(next.until);
        if next.worst > self.worst {
            (self.worst, self.at) = (next.worst, next.at);
        }
    }
}

/// Show times of the first pose, and what holds for all of them.
pub(super) struct PhaseRun {
    pub(super) from: i64,
    pub(super) until: i64,
    /// The pieces that the first pose is on: the first, and the one after the last.
    pieces: (usize, usize),
    /// What the sum cannot be above.
    pub(super) bound: f64,
    /// How long each cubic that is met lasts; -1 where they differ.
    span: i64,
}

/// What is made of a sum, piece by piece.
pub(super) trait SumSink {
    /// The size up to which it need not be told what the sum is between two show times.
    fn ignores(&self, from: i64, until: i64) -> f64;

    /// Takes the sum between two show times, as a cubic over 0 to 1.
    fn take(&mut self, from: i64, until: i64, cubic: Cubic);
}

/// The greatest size, and where it is over a threshold.
struct Over {
    threshold: f64,
    swept: Swept,
}

impl SumSink for Over {
    fn ignores(&self, _: i64, _: i64) -> f64 {
        // What is below both changes neither the greatest size nor what is over.
        self.swept.worst.min(self.threshold)
    }

    fn take(&mut self, from: i64, until: i64, cubic: Cubic) {
        // Inside, a cubic is greatest where it stands still; else at an end.
        let met = [0.0, 1.0].into_iter().chain(cubic.still()).map(|u| (cubic.at(u).abs(), u));
        let (worst, u) = met.fold((0.0, 0.0), |most, one| if one.0 > most.0 { one } else { most });
        self.note(Stretch { from, until, worst, at: between(from, until, u) });
    }
}

impl Over {
    fn note(&mut self, next: Stretch) {
        let Stretch { from, worst, at, .. } = next;
        if worst > self.swept.worst {
            (self.swept.worst, self.swept.at) = (worst, at);
        }
        if worst > self.threshold {
            let last = self.swept.over.last_mut();
            match last.filter(|last| (0..=ONE_STRETCH).contains(&(from - last.until))) {
                Some(last) => last.join(next),
                None => self.swept.over.push(next),
            }
        }
    }
}

/// One stencil on its way over an axis.
pub(super) struct StencilSweep<'a, T> {
    pub(super) pieces: &'a AxisPieces,
    pub(super) stencil: &'a Stencil,
    pub(super) sink: &'a mut T,
}

impl StencilSweep<'_, Over> {
    /// Gives the greatest bound of what was passed over.
    fn run(&mut self, order: usize) -> f64 {
        let Some(last) = self.last() else { return 0.0 };
        let runs = self.runs(order, last);
        // The most promising first: what it gives rules most others out.
        if let Some(run) = runs.iter().max_by(|a, b| a.bound.total_cmp(&b.bound)) {
            let over = self.sink.swept.over.len();
            self.cells(run);
            self.sink.swept.over.truncate(over); // it is met again in its turn
        }
        let mut passed_over = 0.0_f64;
        for run in runs {
            // Never above the threshold unlooked at: over a limit is only what was met (docs/limiter.md, section 5).
            let passes = self.sink.swept.worst * (1.0 + TOLERANCE[order - 1]);
            if run.bound > self.sink.threshold.min(passes) {
                self.cells(&run);
            } else {
                passed_over = passed_over.max(run.bound);
            }
        }
        self.at_the_end(last);
        passed_over
    }
}

impl<T: SumSink> StencilSweep<'_, T> {
    /// The last show time of a first pose; `None` if the axis is too short for the stencil.
    pub(super) fn last(&self) -> Option<i64> {
        let last = self.pieces.end() - self.stencil.reach();
        (last >= self.pieces.list()[0].start).then_some(last)
    }

    pub(super) fn runs(&self, order: usize, last: i64) -> Vec<PhaseRun> {
        let blocks = self.pieces.blocks();
        let mut runs = Vec::with_capacity(blocks.len());
        for (index, block) in blocks.iter().enumerate() {
            let (from, mut until) = block.times;
            let mut pieces = block.pieces;
            if until >= last {
                (until, pieces.1) = (last, self.pieces.index(last));
            }
            if from >= until {
                break;
            }
            // A difference that begins in this block reaches into others, whose jumps count in full for it.
            let reached = until + self.stencil.reach();
            let reached = blocks[index + 1..].iter().take_while(|next| next.times.0 <= reached);
            let all = reached.fold(*block, Block::and);
            let mut run = PhaseRun { from, until, pieces, bound: 0.0, span: all.span };
            let derivative = all.derivatives[order - 1];
            // Of the third derivative its mean over a distance counts, not what it is on the way.
            let derivative = self.mean_jerk(order, &run).map_or(derivative, |mean| mean.min(derivative));
            run.bound = self.stencil.bound(derivative, all.jumps);
            runs.push(run);
        }
        runs
    }

    /// The greatest change of the second derivative over the distance of a third difference, per second: the difference is
    /// a mean of such means. Known where rows and distances are even.
    fn mean_jerk(&self, order: usize, run: &PhaseRun) -> Option<f64> {
        let apart = *self.stencil.offsets.get(1)?;
        if order < 3 || !self.is_aligned(run) || self.stencil.reach() != 3 * apart {
            return None;
        }
        let list = self.pieces.list();
        let ahead = usize::try_from(apart / run.span).ok()?;
        let (first, last) = run.pieces;
        // The piece at the end of the cue has no length, and no bend of its own.
        let bends = list[..list.len() - 1].get(first..=last + 3 * ahead)?;
        // The second derivative runs straight between the rows, so the change is greatest at one; where it jumps there, the
        // bound has the jumps on top.
        let change = |(here, there): (&CubicPiece, &CubicPiece)| (there.cubic.0[2] - here.cubic.0[2]).abs();
        let most = bends.iter().zip(&bends[ahead..]).map(change).fold(0.0, larger);
        Some(2.0 * most / seconds(apart))
    }

    fn is_aligned(&self, run: &PhaseRun) -> bool {
        // All poses of a difference pass their rows at the same instants then, and no cell is cut short.
        run.span > 0 && self.stencil.offsets.iter().all(|offset| offset % run.span == 0)
    }

    pub(super) fn cells(&mut self, run: &PhaseRun) {
        let aligned = self.is_aligned(run);
        match self.stencil.offsets.len() {
            2 if aligned => self.aligned::<2>(run),
            3 if aligned => self.aligned::<3>(run),
            4 if aligned => self.aligned::<4>(run),
            _ => self.cells_between(run.from, run.until),
        }
    }

    /// The same as [`Self::cells_between`] where all rows are equally far apart and the distances are multiples of that, so
    /// that each cell is as long as a row.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few seconds over a row")]
    fn aligned<const NODES: usize>(&mut self, run: &PhaseRun) {
        let list = self.pieces.list();
        let span = seconds(run.span);
        let ahead: [usize; NODES] =
            std::array::from_fn(|node| (self.stencil.offsets[node] / run.span) as usize);
        let weights: [f64; NODES] =
            std::array::from_fn(|node| self.stencil.weights[node] * self.stencil.scale);
        for index in run.pieces.0..run.pieces.1 {
            let mut sum = [0.0; 4];
            for (ahead, weight) in ahead.iter().zip(weights) {
                let Cubic(part) = list[index + ahead].cubic;
                for (sum, part) in sum.iter_mut().zip(part) {
                    *sum += weight * part;
                }
            }
            let cubic = Cubic(sum).scaled(span);
            let at = list[index].start + self.stencil.middle;
            if cubic.may_leave(self.sink.ignores(at, at + run.span)) {
                self.sink.take(at, at + run.span, cubic);
            }
        }
    }

    /// Looks at every cell with its first pose between two show times.
    fn cells_between(&mut self, from: i64, until: i64) {
        let list = self.pieces.list();
        let nodes = self.stencil.offsets.len();
        let mut cursors = [0; 4];
        for (cursor, offset) in cursors.iter_mut().zip(&self.stencil.offsets) {
            *cursor = self.pieces.index(from + offset);
        }
        let mut at = from;
        while at < until {
            // Up to where the first of the poses comes to its next row: so long each is on one cubic.
            let mut next = until;
            for (cursor, offset) in cursors[..nodes].iter().zip(&self.stencil.offsets) {
                next = next.min(list.get(cursor + 1).map_or(until, |piece| piece.start - offset));
            }
            self.cell(at, next, &cursors[..nodes]);
            for (cursor, offset) in cursors[..nodes].iter_mut().zip(&self.stencil.offsets) {
                *cursor +=
                    usize::from(list.get(*cursor + 1).is_some_and(|piece| piece.start - offset <= next));
            }
            at = next;
        }
    }

    /// The sum as a function of the first pose's show time, while each pose stays on its cubic.
    fn cell(&mut self, at: i64, next: i64, cursors: &[usize]) {
        let list = self.pieces.list();
        let mut sum = [0.0; 4];
        for ((cursor, offset), weight) in cursors.iter().zip(&self.stencil.offsets).zip(&self.stencil.weights)
        {
            let piece = &list[*cursor];
            let since = at + offset - piece.start;
            let Cubic(shifted) = if since == 0 { piece.cubic } else { piece.cubic.from(seconds(since)) };
            for (sum, part) in sum.iter_mut().zip(shifted) {
                *sum += weight * part;
            }
        }
        let cubic = Cubic(sum.map(|part| part * self.stencil.scale)).scaled(seconds(next - at));
        let (from, until) = (at + self.stencil.middle, next + self.stencil.middle);
        if cubic.may_leave(self.sink.ignores(from, until)) {
            self.sink.take(from, until, cubic);
        }
    }

    /// The last pose on the last row: where the curve jumps, as one that holds does, no cell has that.
    pub(super) fn at_the_end(&mut self, last: i64) {
        let mut cursors = [0; 4];
        let nodes = self.stencil.offsets.len();
        for (cursor, offset) in cursors.iter_mut().zip(&self.stencil.offsets) {
            *cursor = self.pieces.index(last + offset);
        }
        self.cell(last, last, &cursors[..nodes]);
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use proptest::prelude::*;

    use super::super::loads::Loads;
    use super::super::stencil::Stencils;
    use super::*;
    use crate::cue::{Source, read};
    use crate::motion::{Limits, SeatType, Slot};
    use crate::time::Rate;
    use crate::timeline::Timeline;

    /// The greatest size in each stretch of so many nanoseconds, every cell looked at in 128 places.
    struct All {
        span: i64,
        most: Vec<f64>,
    }

    impl SumSink for All {
        fn ignores(&self, _: i64, _: i64) -> f64 {
            -1.0
        }

        fn take(&mut self, from: i64, until: i64, cubic: Cubic) {
            for u in (0..=128).map(|part| f64::from(part) / 128.0) {
                let at = usize::try_from(between(from, until, u) / self.span).unwrap_or(0);
                let last = self.most.len() - 1;
                let most = &mut self.most[at.min(last)];
                *most = most.max(cubic.at(u).abs());
            }
        }
    }

    fn all(pieces: &AxisPieces, stencils: &[Stencil], span: i64) -> Vec<f64> {
        let stretches = usize::try_from(pieces.end() / span).unwrap_or(0) + 1;
        let mut all = All { span, most: vec![0.0; stretches] };
        for stencil in stencils {
            let mut sweep = StencilSweep { pieces, stencil, sink: &mut all };
            let Some(last) = sweep.last() else { continue };
            sweep.cells_between(pieces.list()[0].start, last);
            sweep.at_the_end(last);
        }
        all.most
    }

    fn timeline(interpolation: &str, rows: &[(u32, f64)]) -> Timeline {
        let mut text = format!("# interpolation: {interpolation}\ntime_ms,a1\n");
        let mut time = 0;
        for (wait, value) in rows {
            writeln!(text, "{time},{value}").expect("a String takes what is written to it");
            time += wait;
        }
        Timeline::new(
            read(Path::new("test.csv"), text.as_bytes(), &Source::Native).expect("the cue is sound"),
        )
    }

    /// Rows of a swell with something rough on top, evenly spaced or not: runs that are passed over and runs that are not.
    fn rows() -> impl Strategy<Value = Vec<(u32, f64)>> {
        let regular = prop::option::of(prop::sample::select(vec![2_u32, 5, 10, 20]));
        let rough = prop::collection::vec((2_u32..40, 0.0..1.0_f64), 40..160);
        (regular, rough, 0.0..0.2_f64, 0.02..0.4_f64).prop_map(|(regular, rough, roughness, turn)| {
            let swell = |row: f64| 0.5 + 0.3 * (row * turn).sin();
            let place = |(row, (wait, value)): (u32, (u32, f64))| {
                (
                    regular.unwrap_or(wait),
                    swell(f64::from(row)) * (1.0 - roughness) + roughness * value * value,
                )
            };
            (0..).zip(rough).map(place).collect()
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn what_is_passed_over_is_never_more_and_overstates_the_greatest_size_by_its_tolerance_at_the_most(
            interpolation in prop::sample::select(vec!["spline", "monotone", "linear", "hold"]),
            hz in prop::sample::select(vec![24.0, 50.0, 72.0, 100.0, 144.0, 600.0, 1000.0]),
            rows in rows(), over in 0.5..2.0_f64,
        ) {
            let timeline = timeline(interpolation, &rows);
            let slot = Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0);
            let pieces = AxisPieces::new(&timeline, 0, &slot);
            let stencils = Stencils::at(Rate::from_hz(hz));
            for (stencils, order) in
                [(&stencils.velocity, 1), (&stencils.step, 2), (&stencils.acceleration, 2), (&stencils.jerk, 3)]
            {
                let most = all(&pieces, stencils, i64::MAX)[0];
                let swept = sweep(&pieces, stencils, order, over * most);
                // 1e-3: the places between those that were looked at.
                let tolerance = 1.0 + TOLERANCE[order - 1] + 1e-3;
                prop_assert!(swept.worst >= most * (1.0 - 1e-9), "order {order}: {} under {most}", swept.worst);
                prop_assert!(swept.worst <= most * tolerance, "order {order}: {} over {most}", swept.worst);
                prop_assert_eq!(swept.over.is_empty(), over > 1.0 || most == 0.0, "order {}", order);
            }
        }

        #[test]
        fn the_load_of_each_stretch_is_never_less_than_what_is_met_there_and_hardly_more(
            interpolation in prop::sample::select(vec!["spline", "monotone", "linear"]),
            hz in prop::sample::select(vec![50.0, 100.0, 144.0, 1000.0]),
            rows in rows(),
        ) {
            const SPAN: i64 = 100_000_000;
            let timeline = timeline(interpolation, &rows);
            let slot = Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0);
            let (pieces, rate, light) = (AxisPieces::new(&timeline, 0, &slot), Rate::from_hz(hz), 0.2);
            let stencils = Stencils::at(rate);
            let loads = Loads::over(&pieces, slot.limits, &stencils, rate, SPAN, light);
            let Limits { velocity, jerk, .. } = slot.limits;
            for (stencils, met, limit) in
                [(&stencils.velocity, &loads.velocity, velocity), (&stencils.jerk, &loads.jerk, jerk)]
            {
                let all = all(&pieces, stencils, SPAN);
                let greatest = all.iter().copied().fold(0.0, f64::max);
                for (met, all) in met.iter().zip(all) {
                    let met = f64::from(*met);
                    prop_assert!(met >= all * (1.0 - 1e-9), "{met} under {all}");
                    prop_assert!(met <= (1.022 * greatest).max(light * limit), "{met} over {greatest}");
                }
            }
        }
    }
}
