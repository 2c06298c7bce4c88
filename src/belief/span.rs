//! Where an axis may have been left: the places that frames of a few milliseconds each led through, the oldest first.

use std::time::Duration;

use crate::motion::{MAX_AXES, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// The ticks whose frames are kept together at the least. Where those led that were acked within a span is told apart from the rest of it only
/// once the next span is: shorter ones would tell more precisely, and cost more.
pub(super) const SPAN: Duration = Duration::from_millis(10);
/// Once they are used up the last one takes all that follows.
const SPANS: usize = 8;

/// The frames of one span, and where they lead.
#[derive(Debug, Clone, Copy)]
struct Span {
    first: FrameNo,
    /// When its first frame was sent.
    at: MonoTime,
    /// When its first frame was sent that asks for an ack, and the number of the last such.
    asked: Option<(MonoTime, FrameNo)>,
    reach: Reach,
}

/// Between which places each slot has been led.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    pub(super) low: Pose,
    pub(super) high: Pose,
}

impl Reach {
    pub(super) const fn at(pose: Pose) -> Self {
        Self { low: pose, high: pose }
    }

    /// Between two poses and nowhere else.
    #[inline]
    fn put_between(&mut self, one: &Pose, other: &Pose) {
        let places = self.low.iter_mut().zip(&mut self.high).zip(one.iter().zip(other));
        for ((low, high), (one, other)) in places {
            (*low, *high) = if *one < *other { (*one, *other) } else { (*other, *one) };
        }
    }

    /// Makes room for a pose as well. Poses are numbers: a comparison that asks for no more is half the work of `min` and `max`. By itself
    /// it becomes vectors; taken apart into what calls it, it did not.
    #[inline(never)]
    pub(super) fn widen(&mut self, pose: &Pose) {
        for ((low, high), place) in self.low.iter_mut().zip(&mut self.high).zip(pose) {
            *low = if *place < *low { *place } else { *low };
            *high = if *place > *high { *place } else { *high };
        }
    }
}

/// The frames since the one that was acked last, at most so many spans of them.
#[derive(Debug, Clone)]
pub(super) struct Spans {
    spans: [Span; SPANS],
    /// How long each is.
    length: Duration,
    /// How many hold frames; the first also holds the place that they began at.
    count: usize,
    last: Pose,
    newest: FrameNo,
    newest_at: MonoTime,
}

impl Spans {
    /// No frame yet; spans that are long enough for frames that are open for so long.
    #[expect(clippy::cast_possible_truncation, reason = "a handful")]
    pub(super) fn over(open: Duration) -> Self {
        let (at, last) = (MonoTime::from_nanos(0), [0.0; MAX_AXES]);
        let empty = Span { first: FrameNo::FIRST, at, asked: None, reach: Reach::at(last) };
        // The one that is being filled may have just begun.
        let length = SPAN.max(open / (SPANS as u32 - 1));
        Self { spans: [empty; SPANS], length, count: 0, last, newest: FrameNo::FIRST, newest_at: at }
    }

    /// No frame since the axes were there.
    pub(super) const fn restart_at(&mut self, pose: Pose) {
        (self.count, self.last) = (0, pose);
    }

    /// Where the newest frame leads.
    pub(super) const fn last(&self) -> &Pose {
        &self.last
    }

    /// Whether no frame is open.
    pub(super) const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// A frame was sent at `at`, or was to be sent since then.
    #[inline]
    pub(super) fn push(&mut self, frame: FrameNo, asked: bool, pose: &Pose, at: MonoTime) {
        let is_full = self.count == SPANS;
        if self.count == 0 || (!is_full && at.since(self.spans[self.count - 1].at) >= self.length) {
            let span = &mut self.spans[self.count];
            (span.first, span.at, span.asked) = (frame, at, None);
            // What is on its way to the first frame's pose is still between that and the one before.
            span.reach.put_between(&self.last, pose);
            self.count += 1;
        } else {
            self.spans[self.count - 1].reach.widen(pose);
        }
        let span = &mut self.spans[self.count - 1];
        if asked {
            span.asked = Some((span.asked.map_or(at, |(since, _)| since), frame));
        }
        (self.last, self.newest, self.newest_at) = (*pose, frame, at);
    }

    /// A frame was acked: those before its span say nothing any more.
    pub(super) fn confirm(&mut self, acked: FrameNo) {
        let over =
            self.spans[..self.count].iter().skip(1).take_while(|next| acked.since(next.first) >= 0).count();
        if over > 0 {
            self.spans.copy_within(over..self.count, 0);
            self.count -= over;
        }
    }

    /// Whether the newest frame of all was acked.
    pub(super) fn are_confirmed(&self, acked: FrameNo) -> bool {
        acked.since(self.newest) >= 0
    }

    /// All frames were taken: the axes are where the last one leads.
    pub(super) fn end_at_last(&mut self) {
        self.count = 0;
    }

    /// Since when an ack is waited for, where frames are a `period` apart at the least: about when the frame behind `acked` left, and no later than
    /// its span was over. Numbers may be left out, and would tell of a time to come.
    pub(super) fn waiting_since(&self, acked: Option<FrameNo>, period: Duration) -> Option<MonoTime> {
        let open = |last: FrameNo| acked.is_none_or(|acked| last.since(acked) > 0);
        let spans = &self.spans[..self.count];
        let over = spans.iter().skip(1).map(|next| next.at).chain([self.newest_at]);
        spans.iter().zip(over).find_map(|(span, over)| {
            let (since, _) = span.asked.filter(|(_, last)| open(*last))?;
            let taken = acked.map_or(0, |acked| acked.since(span.first).saturating_add(1));
            let left = span.at + period * u32::try_from(taken).unwrap_or(0);
            Some(since.max(left.min(over)))
        })
    }

    /// Between which places a slot may be.
    pub(super) fn reach(&self, slot: usize) -> (f64, f64) {
        let place = self.last[slot];
        let spans = self.spans[..self.count].iter();
        spans
            .map(|span| &span.reach)
            .fold((place, place), |(low, high), reach| (low.min(reach.low[slot]), high.max(reach.high[slot])))
    }

    /// Whether all frames lead to one place.
    pub(super) fn is_a_point(&self) -> bool {
        let mut reaches = self.spans[..self.count].iter().map(|span| &span.reach);
        reaches.all(|reach| reach.low == self.last && reach.high == self.last)
    }
}
