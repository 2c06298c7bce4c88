//! The newest frames, one by one: the next one moves a seat from where one of those led it that are not known to have arrived.

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
        let empty = OpenFrame { frame: FrameNo::FIRST, at: MonoTime::from_nanos(0), pose: [0.0; MAX_AXES] };
        Self { frames: [empty; KEPT], newest: 0, count: 0 }
    }

    /// The seat is at one place, wherever frames led it.
    pub(super) const fn clear(&mut self) {
        self.count = 0;
    }

    /// A frame was sent at `at` that leads from `from` to `pose`.
    #[inline]
    pub(super) fn push(&mut self, frame: FrameNo, at: MonoTime, from: &Pose, pose: &Pose) {
        if self.count == 0 {
            self.put(OpenFrame { frame: FrameNo(frame.0.wrapping_sub(1)), at, pose: *from });
        }
        self.put(OpenFrame { frame, at, pose: *pose });
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

    /// When the newest left; none since the seat was at one place.
    pub(super) fn newest_at(&self) -> Option<MonoTime> {
        self.back().next().map(|newest| newest.at)
    }

    /// When a frame left that is kept.
    pub(super) fn sent_at(&self, frame: FrameNo) -> Option<MonoTime> {
        self.back().find(|kept| kept.frame == frame).map(|kept| kept.at)
    }

    /// Between which places the next frame may begin; none where more frames are open than are kept.
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
}
