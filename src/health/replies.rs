//! Whether one controller answers what asks it: frames, beats, reads.

use std::time::Duration;

use super::window::Window;
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// A controller is lost when it was not heard for this long, and for ten frames that asked.
const SILENCE: Duration = Duration::from_millis(250);
const UNHEARD: u32 = 10;
/// Two beats without an answer, and the wait for a third, are as long as silence may be.
const BEAT_WEIGHT: u32 = UNHEARD.div_ceil(2);
/// Frames further apart belong to two streams, and what was unanswered of the first says nothing of the second.
const APART: Duration = Duration::from_secs(2);
/// A controller needs a second to start (PA3d), and may have begun to just before it was asked: where all that was asked of
/// it found an answer sooner, it has not rebooted.
const GAP: Duration = Duration::from_millis(600);

/// What one controller was asked, and when it answered.
#[derive(Debug, Clone)]
pub(super) struct Replies {
    window: Window,
    interval: Duration,
    /// So much later acks come than from a controller that executes what it has at once.
    lead: Duration,
    /// Since when an ack is waited for, and how many frames have asked since.
    waiting: Option<MonoTime>,
    unheard: u32,
    heard: MonoTime,
    asked: MonoTime,
    /// The first of what it was asked that it has not answered by anything yet; whether by a frame, a beat or a read.
    unanswered: Option<MonoTime>,
    /// It took long enough to answer to have rebooted, since it was believed last.
    gap: bool,
}

impl Replies {
    /// Nothing was asked yet; frames that ask go out once an `interval`.
    pub(super) fn new(interval: Duration) -> Self {
        Self {
            window: Window::new(interval, Duration::ZERO),
            interval,
            lead: Duration::ZERO,
            waiting: None,
            unheard: 0,
            heard: MonoTime::default(),
            asked: MonoTime::default(),
            unanswered: None,
            gap: false,
        }
    }

    /// The same for acks that come so much later.
    pub(super) fn led_ahead(self, lead: Duration) -> Self {
        Self { window: Window::new(self.interval, lead), lead, ..self }
    }

    pub(super) const fn interval(&self) -> Duration {
        self.interval
    }

    pub(super) const fn lead(&self) -> Duration {
        self.lead
    }

    pub(super) fn on_asked(&mut self, frame: FrameNo, at: MonoTime) {
        if at.since(self.asked) > APART.max(2 * self.interval) {
            self.rest();
        }
        self.asked = at;
        self.unanswered.get_or_insert(at);
        self.window.on_asked(frame, at);
        self.unheard = self.unheard.saturating_add(1);
        // After a time without frames, silence begins with the first of them.
        let flows = at.since(self.heard) <= 2 * self.interval;
        self.waiting.get_or_insert(if flows { self.heard } else { at });
    }

    /// Takes an ack: true if it is a sign of life, `None` if nobody waits for it.
    pub(super) fn on_ack(&mut self, frame: FrameNo, at: MonoTime) -> Option<bool> {
        self.window.on_ack(frame, at)
    }

    /// It has answered something.
    pub(super) fn on_answer(&mut self, at: MonoTime) {
        let late = GAP.max(2 * self.interval) + self.lead;
        self.gap |= self.unanswered.take().is_some_and(|since| at.since(since) > late);
    }

    /// A sign of life, told again at every look, is one only once.
    pub(super) fn on_life(&mut self, at: MonoTime) {
        if at <= self.heard {
            return;
        }
        self.on_answer(at);
        self.heard = at;
        self.waiting = None;
        self.unheard = 0;
    }

    pub(super) fn on_read_sent(&mut self, at: MonoTime) {
        self.unanswered.get_or_insert(at);
    }

    /// No frames go there, and the answer to this beat is the sign of life that is waited for.
    pub(super) fn on_beat_sent(&mut self, at: MonoTime) {
        self.unheard = self.unheard.saturating_add(BEAT_WEIGHT);
        self.waiting.get_or_insert(at);
        self.unanswered.get_or_insert(at);
    }

    /// It is believed anew: how long it took to answer before that does not count.
    pub(super) const fn forget_gap(&mut self) {
        self.gap = false;
    }

    pub(super) const fn on_homed(&mut self) {
        (self.unanswered, self.gap) = (None, false);
    }

    pub(super) fn tick(&mut self, now: MonoTime) {
        self.window.tick(now);
    }

    /// Nothing is expected of it until the next frame that asks.
    pub(super) fn rest(&mut self) {
        self.window.clear();
        self.waiting = None;
        self.unheard = 0;
    }

    /// When a frame last asked it.
    pub(super) const fn asked(&self) -> MonoTime {
        self.asked
    }

    /// True if it may have rebooted since it was believed last.
    pub(super) const fn has_gap(&self) -> bool {
        self.gap
    }

    pub(super) const fn is_poor(&self) -> bool {
        self.window.is_poor()
    }

    pub(super) fn is_silent(&self, now: MonoTime) -> bool {
        let limit = SILENCE.max(UNHEARD * self.interval) + self.lead;
        self.unheard >= UNHEARD && self.waiting.is_some_and(|since| now.since(since) >= limit)
    }
}
