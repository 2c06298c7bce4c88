//! When controllers are asked for a sign of life: four times a second while nothing moves, since no ack tells then that one lives,
//! and more often while frames flow, since an ack does not tell that a seat follows them.

use std::time::Duration;

use crate::time::MonoTime;

/// From one round to the next.
const EVERY: Duration = Duration::from_millis(250);
/// From one to the next of one controller while frames flow: each of at most three reads is made more often than eight times a
/// second.
pub(crate) const EVERY_LED: Duration = Duration::from_millis(40);

/// Who is asked next, and when.
#[derive(Debug)]
pub(crate) struct Rounds {
    controllers: usize,
    next: MonoTime,
    /// When the next one is asked while frames flow, and which.
    next_led: (MonoTime, usize),
}

impl Rounds {
    pub(crate) fn new(controllers: usize) -> Self {
        Self { controllers, next: MonoTime::default(), next_led: (MonoTime::default(), 0) }
    }

    /// Whether it is time to ask all; if so, the next round is due a while later.
    pub(crate) fn take(&mut self, now: MonoTime) -> bool {
        let due = now >= self.next;
        if due {
            self.next = now + EVERY;
        }
        due
    }

    /// Whom to ask next while frames flow, if it is time: one controller after the other, so that there is no heap of answers.
    pub(crate) fn take_led(&mut self, now: MonoTime) -> Option<usize> {
        let (at, controller) = self.next_led;
        if now < at || self.controllers == 0 {
            return None;
        }
        let others = u32::try_from(self.controllers).unwrap_or(u32::MAX);
        let next = at.max(now.before(EVERY_LED)) + EVERY_LED / others;
        self.next_led = (next, (controller + 1) % self.controllers);
        Some(controller)
    }
}
