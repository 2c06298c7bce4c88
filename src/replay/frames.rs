//! The frames of a recording, in the order in which they left, until the books take them.

use std::collections::VecDeque;

use crate::record::{Chunk, RecordedSeat};
use crate::time::{MonoTime, ShowTime};
use crate::wire::FrameNo;

/// A frame that left, or that the kernel did not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LeftFrame {
    pub(super) lane: usize,
    pub(super) frame: FrameNo,
    pub(super) at: MonoTime,
    /// Frames before it are not in the file.
    pub(super) is_behind_gap: bool,
}

/// What the books take of what was posted.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum PostedFrame {
    /// These frames.
    All(Vec<LeftFrame>),
    /// These and others that are not in the file, or some of them in an order that nobody knows.
    Some(Vec<LeftFrame>),
}

/// Frames that were not posted yet, and show times.
#[derive(Debug, Default)]
pub(super) struct Frames {
    frames: VecDeque<LeftFrame>,
    ticks: VecDeque<(MonoTime, ShowTime)>,
    is_behind_gap: bool,
}

impl Frames {
    /// Takes a tick.
    pub(super) fn take(&mut self, chunk: &Chunk<'_>, seats: &[RecordedSeat]) {
        self.is_behind_gap |= chunk.dropped > 0;
        self.ticks.push_back((chunk.head.deadline, chunk.head.film));
        for frame in chunk.frames() {
            let lane = frame.lane;
            let Some(number) = seats.get(lane).and_then(|seat| seat.frame_no(frame.datagram)) else {
                self.is_behind_gap = true;
                continue;
            };
            let is_behind_gap = std::mem::take(&mut self.is_behind_gap);
            // As the books have it: to the microsecond.
            let at = frame.at.whole_micros();
            self.frames.push_back(LeftFrame { lane, frame: number, at, is_behind_gap });
        }
    }

    /// Frames that were not posted yet.
    pub(super) fn there(&self) -> u64 {
        self.frames.len() as u64
    }

    /// Takes so many, of which the last is that one.
    pub(super) fn post(&mut self, count: u32, lane: usize, last: FrameNo) -> PostedFrame {
        let place = self.frames.iter().position(|one| (one.lane, one.frame) == (lane, last));
        let Some(place) = place else { return PostedFrame::Some(Vec::new()) };
        let frames: Vec<LeftFrame> = self.frames.drain(..=place).collect();
        let is_all = u32::try_from(frames.len()).is_ok_and(|taken| taken == count);
        if is_all { PostedFrame::All(frames) } else { PostedFrame::Some(frames) }
    }

    /// The show time at an instant, as the tick before it has it; instants are asked for in their order.
    pub(super) fn film(&mut self, at: MonoTime) -> ShowTime {
        while self.ticks.get(1).is_some_and(|(deadline, _)| *deadline <= at) {
            self.ticks.pop_front();
        }
        self.ticks.front().map_or(ShowTime::ZERO, |(_, film)| *film)
    }
}
