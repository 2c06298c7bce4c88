//! One axis of a cue as it is sent: cubics between the rows, on a slot's stroke, at its level, held inside its ends.

use std::ops::Range;

use crate::cue::Unit;
use crate::motion::{AxisState, Halt, Slot};
use crate::timeline::{AxisExtremes, Cubic, Extreme, Timeline};

// Few enough that bounds stay close, many enough that most of a cue costs a sixteenth.
/// So many cubics share one set of bounds.
const BLOCK: usize = 16;

/// A cubic of the seconds since its start, in strokes.
#[derive(Debug, Clone, Copy)]
pub(super) struct CubicPiece {
    /// Show time, nanoseconds.
    pub(super) start: i64,
    pub(super) cubic: Cubic,
}

/// What a run of cubics does at most.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Block {
    /// Its first cubic, and the one after its last.
    pub(super) pieces: (usize, usize),
    /// The show times at which these begin, nanoseconds.
    pub(super) times: (i64, i64),
    /// Greatest sizes of the first, second and third derivative.
    pub(super) derivatives: [f64; 3],
    /// Sums of the jumps of position, slope and second derivative where its cubics begin.
    pub(super) jumps: [f64; 3],
    /// How long each of its cubics lasts, nanoseconds; 0 if none lasts, -1 where they differ.
    pub(super) span: i64,
}

impl Block {
    /// What this run and a later one do at most; the place is that of this one.
    pub(super) fn and(self, other: &Self) -> Self {
        // A difference over both is a mean of what they do, plus their jumps (docs/limiter.md, section 2).
        Self {
            span: common(self.span, other.span),
            pieces: self.pieces,
            times: self.times,
            derivatives: std::array::from_fn(|i| self.derivatives[i].max(other.derivatives[i])),
            jumps: std::array::from_fn(|i| self.jumps[i] + other.jumps[i]),
        }
    }
}

/// A value and where it is taken.
#[derive(Debug, Clone, Copy)]
pub(super) struct At {
    pub(super) value: f64,
    /// Show time, nanoseconds.
    pub(super) at: i64,
}

/// Where a slot stands at a value of its axis, before it is held inside its ends.
fn place(slot: &Slot, value: f64) -> f64 {
    let (scale, shift) = slot.scale();
    value * scale + shift
}

/// The lowest and highest position of the whole axis.
pub(super) fn extremes(timeline: &Timeline, axis: usize, slot: &Slot) -> (At, At) {
    let ends = ends(timeline.unit(axis), slot);
    let extreme = |extreme: Extreme| At {
        value: place(slot, extreme.value).clamp(ends.0, ends.1),
        at: extreme.at.as_nanos(),
    };
    let AxisExtremes { min, max } = timeline.extremes()[axis];
    (extreme(min), extreme(max))
}

/// The whole axis; its last piece begins at the end of the cue, and has no length.
#[derive(Debug)]
pub(super) struct AxisPieces {
    list: Vec<CubicPiece>,
    blocks: Vec<Block>,
    /// What the last piece comes to at its end, while they are added.
    reached: Option<Cubic>,
}

impl AxisPieces {
    /// Where `slot` stands while it follows its axis of the cue.
    pub(super) fn new(timeline: &Timeline, axis: usize, slot: &Slot) -> Self {
        let (ends, (scale, shift)) = (ends(timeline.unit(axis), slot), slot.scale());
        let (cue, times) = (timeline.cue(), timeline.cue().times());
        let extremes = &timeline.extremes()[axis];
        // One look at the whole axis: most stay inside, and need not be cut where they are held.
        let leaves = place(slot, extremes.min.value) < ends.0 || place(slot, extremes.max.value) > ends.1;
        let mut pieces = Self::with_capacity(cue.rows());
        let (mut usual, mut per_second) = (0, 0.0);
        for row in 0..cue.rows() - 1 {
            let (start, end) = (times[row].as_nanos(), times[row + 1].as_nanos());
            if end - start != usual {
                // A division for each row would be a tenth of the proof.
                (usual, per_second) = (end - start, seconds(end - start).recip());
            }
            let Cubic([c0, c1, c2, c3]) = timeline.cubic(row, axis);
            let cubic = Cubic([c0 * scale + shift, c1 * scale, c2 * scale, c3 * scale]);
            if leaves {
                pieces.push_held(start, end, cubic, ends);
            } else {
                pieces.push(start, end, cubic.scaled(per_second));
            }
        }
        let last = place(slot, cue.row(cue.rows() - 1)[axis]).clamp(ends.0, ends.1);
        let end = timeline.duration().as_nanos();
        pieces.push(end, end, Cubic([last, 0.0, 0.0, 0.0]));
        pieces
    }

    fn with_capacity(count: usize) -> Self {
        let blocks = Vec::with_capacity(count.div_ceil(BLOCK));
        Self { list: Vec::with_capacity(count), blocks, reached: None }
    }

    /// Adds a cubic of the seconds since `start`.
    fn push(&mut self, start: i64, end: i64, cubic: Cubic) {
        let index = self.list.len();
        if index.is_multiple_of(BLOCK) {
            let block = Block { pieces: (index, index), times: (start, start), ..Block::default() };
            self.blocks.push(block);
        }
        let block = self.blocks.last_mut().expect("one was begun with the first piece");
        (block.pieces.1, block.times.1) = (index + 1, end);
        self.reached = Some(block.take(cubic, end - start, self.reached.unwrap_or(cubic)));
        self.list.push(CubicPiece { start, cubic });
    }

    /// Adds a cubic over 0 to 1 with what leaves the ends replaced by the end.
    fn push_held(&mut self, start: i64, end: i64, cubic: Cubic, ends: (f64, f64)) {
        let (low, high) = cubic.bounds();
        let per_second = seconds(end - start).recip();
        if low >= ends.0 && high <= ends.1 {
            return self.push(start, end, cubic.scaled(per_second));
        }
        // Between two cuts it lies on one side of each end, so that its middle speaks for all of it.
        for pair in cuts(cubic, ends).windows(2) {
            let (begin, until) = (between(start, end, pair[0]), between(start, end, pair[1]));
            if begin >= until {
                continue;
            }
            let middle = cubic.at(f64::midpoint(pair[0], pair[1]));
            let held = middle.clamp(ends.0, ends.1);
            let part = if held == middle {
                cubic.from(seconds(begin - start) * per_second).scaled(per_second)
            } else {
                Cubic([held, 0.0, 0.0, 0.0])
            };
            self.push(begin, until, part);
        }
    }

    /// The cubics, in order of time.
    pub(super) fn list(&self) -> &[CubicPiece] {
        &self.list
    }

    /// Show time of the end, nanoseconds.
    pub(super) fn end(&self) -> i64 {
        self.list[self.list.len() - 1].start
    }

    /// How the axis moves as it comes to the last pose.
    pub(super) fn last_motion(&self) -> AxisState {
        let last = &self.list[self.list.len() - 1];
        let Some(before) = self.list.len().checked_sub(2).map(|index| &self.list[index]) else {
            return AxisState::at_rest(last.cubic.0[0]);
        };
        let Cubic([_, velocity, bend, _]) = before.cubic.from(seconds(last.start - before.start));
        AxisState { position: last.cubic.0[0], velocity, acceleration: 2.0 * bend }
    }

    /// What the axis does in the last `reach` nanoseconds, `level` times as far from `neutral`.
    pub(super) fn ending(&self, reach: i64, level: f64, neutral: f64) -> Self {
        self.copied(self.index(self.end() - reach)..self.list.len(), |Cubic([c0, c1, c2, c3])| {
            Cubic([neutral + level * (c0 - neutral), level * c1, level * c2, level * c3])
        })
    }

    /// The same axis, which takes a way to rest after its last pose and stays there for so many nanoseconds.
    pub(super) fn then(&self, way: &Halt, rest: i64) -> Self {
        let mut then = self.copied(0..self.list.len() - 1, |cubic| cubic);
        let (mut start, mut since) = (self.end(), 0.0);
        for (from, jerk, lasts) in way.stretches() {
            // From the sum: were each span rounded, those behind would be moved by all of it.
            since += lasts;
            let end = self.end() + nanos(since);
            let AxisState { position, velocity, acceleration } = from;
            then.push(start, end, Cubic([position, velocity, acceleration / 2.0, jerk / 6.0]));
            start = end;
        }
        let stays = Cubic([way.rest(), 0.0, 0.0, 0.0]);
        then.push(start, start + rest, stays);
        // As every axis ends: with a piece that begins at the end and has no length.
        then.push(start + rest, start + rest, stays);
        then
    }

    fn copied(&self, pieces: Range<usize>, change: impl Fn(Cubic) -> Cubic) -> Self {
        let mut copied = Self::with_capacity(pieces.len());
        for index in pieces {
            let piece = self.list[index];
            let end = self.list.get(index + 1).map_or(piece.start, |next| next.start);
            copied.push(piece.start, end, change(piece.cubic));
        }
        copied
    }

    /// The bounds of each run of cubics, in order of time.
    pub(super) fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The piece that holds at a show time.
    pub(super) fn index(&self, at: i64) -> usize {
        self.list.partition_point(|piece| piece.start <= at).saturating_sub(1)
    }

    /// The least and greatest position from one show time to another, which is not before it.
    pub(super) fn range(&self, from: i64, until: i64) -> (At, At) {
        let (from, until) = (from.clamp(0, self.end()), until.clamp(0, self.end()));
        let start = self.list[self.index(from)];
        let first = At { value: start.cubic.at(seconds(from - start.start)), at: from };
        let (mut low, mut high) = (first, first);
        let mut index = self.index(from);
        while index < self.list.len() && self.list[index].start <= until {
            let piece = self.list[index];
            let begin = piece.start.max(from);
            let end = self.list.get(index + 1).map_or(until, |next| next.start.min(until));
            let part = piece.cubic.from(seconds(begin - piece.start)).scaled(seconds(end - begin));
            // Bezier points enclose it: only where these pass what was met are its extremes looked for.
            let (least, most) = part.bounds();
            if least < low.value || most > high.value {
                for u in [0.0, 1.0].into_iter().chain(part.still()) {
                    let met = At { value: part.at(u), at: between(begin, end, u) };
                    low = if met.value < low.value { met } else { low };
                    high = if met.value > high.value { met } else { high };
                }
            }
            index += 1;
        }
        (low, high)
    }
}

/// What two spans have in common: 0 goes with all, others with themselves alone.
fn common(a: i64, b: i64) -> i64 {
    match (a, b) {
        (0, other) | (other, 0) => other,
        (a, b) if a == b => a,
        _ => -1,
    }
}

/// Between which positions the slot is held, fractions of the stroke.
fn ends(unit: Unit, slot: &Slot) -> (f64, f64) {
    let (scale, shift) = slot.scale();
    match unit {
        // Held at full level, and then scaled.
        Unit::Fraction => (shift.max(0.0), (shift + scale).min(1.0)),
        Unit::Millimetre | Unit::Degree | Unit::Pulse => (0.0, 1.0),
    }
}

/// Where a cubic over 0 to 1 turns or crosses an end, and 0 and 1, in order.
fn cuts(cubic: Cubic, ends: (f64, f64)) -> Vec<f64> {
    let mut turns: Vec<f64> = cubic.still().chain([0.0, 1.0]).collect();
    turns.sort_by(f64::total_cmp);
    let mut cuts = turns.clone();
    for pair in turns.windows(2) {
        cuts.extend(
            [ends.0, ends.1].into_iter().filter_map(|level| crossing(cubic, pair[0], pair[1], level)),
        );
    }
    cuts.sort_by(f64::total_cmp);
    cuts
}

/// Where a cubic that only rises or only falls between two arguments takes a value there.
fn crossing(cubic: Cubic, mut from: f64, mut to: f64, level: f64) -> Option<f64> {
    let rises = cubic.at(to) > cubic.at(from);
    let is_past = |u: f64| (cubic.at(u) > level) == rises;
    if is_past(from) || !is_past(to) {
        return None;
    }
    // More halvings than an argument from 0 to 1 has bits.
    for _ in 0..60 {
        let middle = f64::midpoint(from, to);
        if is_past(middle) { to = middle } else { from = middle }
    }
    Some(to)
}

impl Block {
    /// Notes a cubic that lasts `span` nanoseconds after one that had come to `before`; gives what it comes to itself.
    fn take(&mut self, cubic: Cubic, span: i64, before: Cubic) -> Cubic {
        let [c0, c1, c2, c3] = cubic.0;
        self.span = common(self.span, span);
        let end = cubic.from(seconds(span));
        let [_, slope, bend, _] = end.0;
        // The slope is a parabola; its third Bezier point is the first two ends' tangents' crossing.
        let slopes = larger(larger(c1.abs(), slope.abs()), (c1 + c2 * seconds(span)).abs());
        let sizes = [slopes, 2.0 * larger(c2.abs(), bend.abs()), 6.0 * c3.abs()];
        let jumps = [c0 - before.0[0], c1 - before.0[1], 2.0 * (c2 - before.0[2])];
        for i in 0..3 {
            self.derivatives[i] = larger(self.derivatives[i], sizes[i]);
            self.jumps[i] += jumps[i].abs();
        }
        end
    }
}

/// The larger of two numbers; unlike `f64::max` a single instruction.
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The instant a part of the way from one to another.
#[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "spans under a day")]
pub(super) fn between(from: i64, to: i64, part: f64) -> i64 {
    from + ((to - from) as f64 * part).round() as i64
}

#[expect(clippy::cast_possible_truncation, reason = "some seconds")]
fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[expect(clippy::cast_precision_loss, reason = "spans under a day are exact")]
pub(super) fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
