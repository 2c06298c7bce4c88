//! The instants of edges into bits: an edge begins each cell, and one more in its middle makes it a 1. Any speed, either way.

/// Edges of which the distances are kept, to learn the length of a cell from: more than the zeros of any frame in a row.
const KEPT: usize = 96;
/// Cells are that long at the least, samples: LTC of 30 frames a second at five times its speed, of 48,000 samples a second.
const SHORTEST: f64 = 4.0;
/// An interval up to so much of a cell is half a cell, beyond it a whole one.
const HALF_UP_TO: f64 = 0.75;
/// Below and above these an interval is neither: an edge was missed, or is none.
const LEAST: f64 = 0.3;
const MOST: f64 = 1.45;
/// How much each interval adds to what is known of the length: tapes and jog wheels change speed by 5 % in some bits.
const LEARNS: f64 = 0.1;
/// After so many intervals in a row that are neither, the length is learned anew.
const LOST: u32 = 4;

/// What an edge makes sure of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LtcCell {
    /// Half a 1 so far.
    Open,
    /// A whole bit.
    Bit(bool),
    /// No bit; what was read before does not belong to what comes.
    Broken,
}

/// Reads bits from the distances of edges.
#[derive(Debug, Clone)]
pub(super) struct LtcCells {
    edge: f64,
    /// The length of a cell, samples; 0 until it is known.
    length: f64,
    is_half: bool,
    odd: u32,
    kept: [f64; KEPT],
    count: usize,
}

impl LtcCells {
    pub(super) const fn new() -> Self {
        Self { edge: 0.0, length: 0.0, is_half: false, odd: 0, kept: [0.0; KEPT], count: 0 }
    }

    /// The length of a cell, samples; 0 if it is not known.
    pub(super) const fn length(&self) -> f64 {
        self.length
    }

    /// When the newest edge was, samples.
    pub(super) const fn edge(&self) -> f64 {
        self.edge
    }

    pub(super) fn push(&mut self, edge: f64) -> LtcCell {
        let interval = edge - self.edge;
        self.edge = edge;
        self.kept[self.count % KEPT] = interval;
        self.count += 1;
        let share = if self.length > 0.0 { interval / self.length } else { 0.0 };
        if !(LEAST..=MOST).contains(&share) {
            return self.on_odd();
        }
        self.odd = 0;
        let is_whole = share > HALF_UP_TO;
        // Halves count double, so that a frame of ones teaches as much as one of zeros.
        let seen = if is_whole { interval } else { 2.0 * interval };
        self.length += LEARNS * (seen - self.length);
        match (self.is_half, is_whole) {
            (false, true) => LtcCell::Bit(false),
            (false, false) => {
                self.is_half = true;
                LtcCell::Open
            }
            (true, false) => {
                self.is_half = false;
                LtcCell::Bit(true)
            }
            // The half before was the second of a 1 whose first was missed, or noise: this one begins a cell.
            (true, true) => {
                self.is_half = false;
                LtcCell::Broken
            }
        }
    }

    fn on_odd(&mut self) -> LtcCell {
        self.is_half = false;
        self.odd += 1;
        // One odd interval is a click; several in a row are another speed.
        if self.length == 0.0 || self.odd >= LOST {
            self.learn();
        }
        LtcCell::Broken
    }

    /// Learns the length of a cell from the intervals of late: they are of two lengths, one twice the other.
    fn learn(&mut self) {
        let count = self.count.min(KEPT);
        // The newest alone: the speed may have changed at once.
        let used = count.min(if self.length == 0.0 { KEPT } else { KEPT / 2 });
        if used < KEPT / 4 {
            return;
        }
        let mut sorted = [0.0; KEPT];
        (0..used).for_each(|back| sorted[back] = self.kept[(self.count - 1 - back) % KEPT]);
        let sorted = &mut sorted[..used];
        sorted.sort_unstable_by(f64::total_cmp);
        // A tenth at either end is noise: the quantiles, not the extremes.
        let (short, long) = (sorted[used / 10], sorted[used - 1 - used / 10]);
        let ratio = long / short;
        self.length = if (1.6..2.6).contains(&ratio) {
            (long + 2.0 * short) / 2.0
        } else if ratio < 1.3 {
            // All of one kind: zeros, of which labels have the most.
            long
        } else {
            self.length
        };
        if self.length < SHORTEST {
            self.length = 0.0;
        }
        self.odd = 0;
    }
}
