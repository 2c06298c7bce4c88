//! The greatest size of a divided difference over all phases of the grid: between the rows, shifted by the distances of
//! the stencil, it is a cubic of the phase, whose extremes are known in closed form.

use super::pieces::{Block, Pieces, between, seconds};
use super::stencil::Stencil;
use crate::timeline::Cubic;

/// Stretches over a limit with less than this between them are one, nanoseconds.
const ONE_STRETCH: i64 = 100_000_000;

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

/// Sweeps stencils of the differences of an order (1 to 3) over an axis.
pub(super) fn sweep(pieces: &Pieces, stencils: &[Stencil], order: usize, threshold: f64) -> Swept {
    let mut swept = Swept::default();
    for stencil in stencils {
        let mut one = Sweep { pieces, stencil, threshold, swept: &mut swept };
        one.run(order);
    }
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

struct Sweep<'a> {
    pieces: &'a Pieces,
    stencil: &'a Stencil,
    threshold: f64,
    swept: &'a mut Swept,
}

impl Sweep<'_> {
    fn run(&mut self, order: usize) {
        let last = self.pieces.end() - self.stencil.reach();
        if last < 0 {
            return;
        }
        let bounds = self.bounds(order, last);
        // The most promising first: what it gives rules most others out.
        if let Some(&(from, until, _)) = bounds.iter().max_by(|a, b| a.2.total_cmp(&b.2)) {
            let over = self.swept.over.len();
            self.cells(from, until);
            self.swept.over.truncate(over); // it is met again in its turn
        }
        for (from, until, bound) in bounds {
            if bound > self.swept.worst.min(self.threshold) {
                self.cells(from, until);
            }
        }
        self.at_the_end(last);
    }

    /// For each run of cubics the show times of the first pose, and what the sum cannot be above.
    fn bounds(&self, order: usize, last: i64) -> Vec<(i64, i64, f64)> {
        let blocks: Vec<(i64, i64, &Block)> = self.pieces.blocks().collect();
        let mut bounds = Vec::with_capacity(blocks.len());
        for (index, &(from, until, block)) in blocks.iter().enumerate() {
            let until = until.min(last);
            if from >= until {
                break;
            }
            let reached =
                blocks[index + 1..].iter().take_while(|next| next.0 <= until + self.stencil.reach());
            let all = reached.fold(*block, |all, next| all.and(next.2));
            bounds.push((from, until, self.stencil.bound(all.derivatives[order - 1], all.jumps)));
        }
        bounds
    }

    /// Looks at every cell with its first pose between two show times.
    fn cells(&mut self, from: i64, until: i64) {
        let list = self.pieces.list();
        let nodes = self.stencil.offsets.len();
        let mut cursors = [0; 4];
        for (cursor, offset) in cursors.iter_mut().zip(&self.stencil.offsets) {
            *cursor = self.pieces.index(from + offset);
        }
        let mut at = from;
        while at < until {
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
        let (low, high) = cubic.bounds();
        let bound = high.max(-low);
        if bound > self.swept.worst.min(self.threshold) {
            let met = [0.0, 1.0].into_iter().chain(cubic.still()).map(|u| (cubic.at(u).abs(), u));
            let (worst, u) = met.fold((0.0, 0.0), |most, one| if one.0 > most.0 { one } else { most });
            self.note(at, next, worst, between(at, next, u));
        }
    }

    /// The last pose on the last row: where the curve jumps, as one that holds does, no cell has that.
    fn at_the_end(&mut self, last: i64) {
        let mut cursors = [0; 4];
        let nodes = self.stencil.offsets.len();
        for (cursor, offset) in cursors.iter_mut().zip(&self.stencil.offsets) {
            *cursor = self.pieces.index(last + offset);
        }
        self.cell(last, last, &cursors[..nodes]);
    }

    fn note(&mut self, from: i64, until: i64, worst: f64, at: i64) {
        let middle = self.stencil.middle;
        if worst > self.swept.worst {
            (self.swept.worst, self.swept.at) = (worst, at + middle);
        }
        if worst > self.threshold {
            let next = Stretch { from: from + middle, until: until + middle, worst, at: at + middle };
            let last = self.swept.over.last_mut();
            match last.filter(|last| (0..=ONE_STRETCH).contains(&(next.from - last.until))) {
                Some(last) => last.join(next),
                None => self.swept.over.push(next),
            }
        }
    }
}
