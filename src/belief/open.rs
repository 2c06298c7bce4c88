//! The newest frames, one by one: the next one moves a seat from the end of the last one that arrived, whichever of them that was.

use std::time::Duration;

use super::span::Reach;
use crate::motion::{MAX_AXES, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// Frames kept: at 1,000 a second those of 15 ms. Of older ones the spans hold the places.
const KEPT: usize = 16;

#[derive(Debug, Clone, Copy)]
struct OpenFrame {
    frame: FrameNo,
    at: MonoTime,
    pose: Pose,
    lasts_ms: u32,
}

/// The newest frames, and the place before the first of them.
#[derive(Debug, Clone)]
pub(super) struct OpenFrames {
    frames: [OpenFrame; KEPT],
    newest: usize,
    /// Pushed since the seat was at one place; one more than [`KEPT`] stands for any more.
    count: usize,
}

impl OpenFrames {
    pub(super) const fn none() -> Self {
        let at = MonoTime::from_nanos(0);
        let empty = OpenFrame { frame: FrameNo::FIRST, at, pose: [0.0; MAX_AXES], lasts_ms: 0 };
        Self { frames: [empty; KEPT], newest: 0, count: 0 }
    }

    /// The seat is at one place, wherever frames led it.
    pub(super) const fn clear(&mut self) {
        self.count = 0;
    }

    /// A frame was sent at `at` that leads from `from` to `pose` in so many milliseconds.
    #[inline]
    pub(super) fn push(&mut self, frame: FrameNo, at: MonoTime, from: &Pose, (pose, lasts_ms): (&Pose, u32)) {
        if self.count == 0 {
            self.put(OpenFrame { frame: FrameNo(frame.0.wrapping_sub(1)), at, pose: *from, lasts_ms });
        }
        self.put(OpenFrame { frame, at, pose: *pose, lasts_ms });
    }

    #[inline]
    fn put(&mut self, frame: OpenFrame) {
        self.newest = (self.newest + 1) % KEPT;
        self.frames[self.newest] = frame;
        self.count = (self.count + 1).min(KEPT + 1);
    }

    /// The newest first.
    fn back(&self) -> impl Iterator<Item = &OpenFrame> {
        (0..self.count.min(KEPT)).map(|age| &self.frames[(self.newest + KEPT - age) % KEPT])
    }

    /// Those that are not acked, the newest first; the place before the first counts as acked.
    fn open(&self, acked: Option<FrameNo>) -> impl Iterator<Item = &OpenFrame> {
        let pushed = self.count.saturating_sub(1).min(KEPT);
        self.back().take(pushed).take_while(move |kept| acked.is_none_or(|acked| acked.since(kept.frame) < 0))
    }

    /// The time at which a frame left that is kept.
    pub(super) fn sent_at(&self, frame: FrameNo) -> Option<MonoTime> {
        self.back().find(|kept| kept.frame == frame).map(|kept| kept.at)
    }

    /// The time at which the oldest open frame left.
    pub(super) fn open_since(&self, acked: Option<FrameNo>) -> Option<MonoTime> {
        self.open(acked).last().map(|oldest| oldest.at)
    }

    /// The time by which open frames take longer than a `period` each, in all.
    pub(super) fn longer(&self, acked: Option<FrameNo>, period: Duration) -> Duration {
        let takes = |kept: &OpenFrame| Duration::from_millis(u64::from(kept.lasts_ms));
        self.open(acked).map(|kept| takes(kept).saturating_sub(period)).sum()
    }

    /// The places at which the next frame may begin; none if more frames are open than are kept.
    pub(super) fn reach(&self, acked: Option<FrameNo>) -> Option<Reach> {
        let mut reach: Option<Reach> = None;
        for kept in self.back() {
            reach.get_or_insert(Reach::at(kept.pose)).widen(&kept.pose);
            if acked.is_some_and(|acked| acked.since(kept.frame) >= 0) {
                return reach;
            }
        }
        reach.filter(|_| self.count <= KEPT)
    }

    /// The speed of the newest frame, strokes a second, and its Time in seconds.
    pub(super) fn last_move(&self) -> (Pose, f64) {
        let mut back = self.back();
        let (Some(newest), Some(before)) = (back.next(), back.next()) else { return ([0.0; MAX_AXES], 0.0) };
        let seconds = f64::from(newest.lasts_ms.max(1)) * 1e-3;
        (std::array::from_fn(|slot| (newest.pose[slot] - before.pose[slot]) / seconds), seconds)
    }
}
