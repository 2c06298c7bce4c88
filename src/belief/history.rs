//! Where the frames of the last half second have led a seat: a reading that was made while frames flow is held against that.

use std::time::Duration;

use super::span::Reach;
use crate::motion::Pose;
use crate::time::MonoTime;

/// Frames so far apart are kept together; one that takes longer is alone.
const BUCKET: Duration = Duration::from_millis(40);
/// What is looked back to at the most ([`super::FOLLOWS`] and three periods of 50 ms, the longest lead, and [`super::STALE`]), and one
/// bucket for what only a part of is that old.
const BUCKETS: usize = 26;

/// The places that some frames lead through.
#[derive(Debug, Clone, Copy)]
struct PlaceBucket {
    from: MonoTime,
    /// When the last of them is over.
    until: MonoTime,
    reach: Reach,
    /// The greatest amplitude of vibration on any slot, strokes.
    shakes: f64,
}

/// The places of the last half second, bucket by bucket, the newest at `newest`.
#[derive(Debug, Clone)]
pub(super) struct History {
    buckets: [PlaceBucket; BUCKETS],
    newest: usize,
}

impl History {
    /// The seat is there, and no frame led it elsewhere.
    pub(super) const fn at(pose: Pose) -> Self {
        let zero = MonoTime::from_nanos(0);
        let empty = PlaceBucket { from: zero, until: zero, reach: Reach::at(pose), shakes: 0.0 };
        Self { buckets: [empty; BUCKETS], newest: 0 }
    }

    /// A frame was sent at `at` that leads from `last` to `pose` until `until`.
    pub(super) fn push(&mut self, last: &Pose, pose: &Pose, shakes: f64, (at, until): (MonoTime, MonoTime)) {
        if at.since(self.buckets[self.newest].from) >= BUCKET {
            self.newest = (self.newest + 1) % BUCKETS;
            self.buckets[self.newest] = PlaceBucket { from: at, until, reach: Reach::at(*last), shakes };
        }
        let bucket = &mut self.buckets[self.newest];
        (bucket.until, bucket.shakes) = (bucket.until.max(until), bucket.shakes.max(shakes));
        bucket.reach.widen(pose);
    }

    /// Between which places frames have led a slot since then, and with what vibration; none where none was under way.
    pub(super) fn reach(&self, slot: usize, since: MonoTime) -> Option<(f64, f64, f64)> {
        let open = self.buckets.iter().filter(|bucket| bucket.until >= since);
        open.map(|bucket| (bucket.reach.low[slot], bucket.reach.high[slot], bucket.shakes))
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1), a.2.max(b.2)))
    }
}
