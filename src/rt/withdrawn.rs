//! Frames that seats on links do not execute, as they were told to stop: kept until the books have the records of them.

use crate::wire::FrameNo;

/// Runs of frames of a seat in a drain, at the most.
const RUNS: usize = 4;

/// Those that were told in a drain, in runs: a controller, the first and the last. All memory is taken at the start.
#[derive(Debug, Default)]
pub(super) struct Withdrawn(Vec<(usize, FrameNo, FrameNo)>);

impl Withdrawn {
    /// With room for those of so many seats.
    pub(super) fn of(seats: usize) -> Self {
        Self(Vec::with_capacity(RUNS * seats))
    }

    /// Takes what a link told. Where there is no room they will count as lost.
    pub(super) fn take(&mut self, controller: usize, first: FrameNo, last: FrameNo) {
        let follows =
            |(of, _, end): &&mut (usize, FrameNo, FrameNo)| *of == controller && end.next() == first;
        if let Some((_, _, end)) = self.0.iter_mut().find(follows) {
            *end = last;
        } else if self.0.len() < self.0.capacity() {
            self.0.push((controller, first, last));
        }
    }

    /// All of them, which it forgets.
    pub(super) fn drain(&mut self) -> impl Iterator<Item = (usize, FrameNo, FrameNo)> {
        self.0.drain(..)
    }
}
