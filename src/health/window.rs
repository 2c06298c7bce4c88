//! The frames of the last second that asked for an ack, and how many of them were answered in time.

use std::collections::VecDeque;
use std::time::Duration;

use crate::time::{MonoTime, nanos};
use crate::wire::FrameNo;

/// An ack later than this counts as missing.
const DUE: Duration = Duration::from_millis(100);
/// Over how long missing acks are counted.
const SPAN: Duration = Duration::from_secs(1);
/// So many missing in a row are too many.
const RUN: u32 = 5;
/// More than one missing in so many is too much.
const SHARE: usize = 10;

#[derive(Debug, Clone, Copy)]
struct AskedFrame {
    frame: FrameNo,
    at: MonoTime,
    answered: bool,
    /// Counted as missing.
    missing: bool,
}

/// Frames that asked, oldest first.
#[derive(Debug, Clone)]
pub(super) struct Window {
    asked: VecDeque<AskedFrame>,
    /// Of these, the ones whose acks are due.
    due: usize,
    missing: usize,
    /// Missing in a row up to the newest that is due.
    run: u32,
    /// An ack later than this counts as missing.
    limit: Duration,
    newest_answered: Option<FrameNo>,
}

impl Window {
    /// Room for a span of frames of which one asks in each `interval`, and is acked `lead` later than by a controller that is not led ahead.
    pub(super) fn new(interval: Duration, lead: Duration) -> Self {
        let fit = nanos(SPAN + DUE + lead).div_ceil(nanos(interval).max(1));
        let room = usize::try_from(fit).unwrap_or(usize::MAX).min(1 << 11) + 16;
        Self {
            asked: VecDeque::with_capacity(room),
            due: 0,
            missing: 0,
            run: 0,
            limit: DUE + lead,
            newest_answered: None,
        }
    }

    pub(super) fn on_asked(&mut self, frame: FrameNo, at: MonoTime) {
        if self.asked.len() == self.asked.capacity() {
            self.forget_oldest();
        }
        self.asked.push_back(AskedFrame { frame, at, answered: false, missing: false });
    }

    /// An ack that came at `at`: the first to a frame that asked and is remembered, else none. Says whether it is a sign
    /// of life: to a newer frame than any acked before.
    pub(super) fn on_ack(&mut self, frame: FrameNo, at: MonoTime) -> Option<bool> {
        let index = self.asked.partition_point(|asked| frame.since(asked.frame) > 0);
        let asked = self.asked.get_mut(index).filter(|asked| asked.frame == frame && !asked.answered)?;
        asked.answered = true;
        if at.since(asked.at) > self.limit {
            self.count_missing(index);
        } else if std::mem::take(&mut asked.missing) {
            // It came in time, and was only read late.
            self.missing -= 1;
        }
        let newer = self.newest_answered.is_none_or(|newest| frame.since(newest) > 0);
        if newer {
            self.newest_answered = Some(frame);
        }
        Some(newer)
    }

    /// Moves on to `now`: every ack that came up to then has been told.
    pub(super) fn tick(&mut self, now: MonoTime) {
        while let Some(asked) = self.asked.get(self.due).filter(|asked| now.since(asked.at) > self.limit) {
            let good = asked.answered && !asked.missing;
            self.run = if good { 0 } else { self.run.saturating_add(1) };
            if !good {
                self.count_missing(self.due);
            }
            self.due += 1;
        }
        while self.asked.front().is_some_and(|asked| now.since(asked.at) > SPAN + self.limit) {
            self.forget_oldest();
        }
    }

    /// True if so many are missing that it is worth showing.
    pub(super) const fn is_poor(&self) -> bool {
        let many = self.due >= SHARE && self.missing * SHARE > self.due;
        self.run >= RUN || many
    }

    /// Forgets what was asked, and not which frame was answered last.
    pub(super) fn clear(&mut self) {
        self.asked.clear();
        (self.due, self.missing, self.run) = (0, 0, 0);
    }

    fn count_missing(&mut self, index: usize) {
        if let Some(asked) = self.asked.get_mut(index).filter(|asked| !asked.missing) {
            asked.missing = true;
            self.missing += 1;
        }
    }

    fn forget_oldest(&mut self) {
        let Some(oldest) = self.asked.pop_front() else { return };
        self.missing -= usize::from(oldest.missing);
        self.due = self.due.saturating_sub(1);
        if self.asked.is_empty() {
            self.run = 0;
        }
    }
}
