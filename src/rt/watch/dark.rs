//! Who gets no frames is made dark and still, and read to be so, whoever switched something on there. Unknown counts as on.

use std::time::Duration;

use super::Watch;
use crate::drive::{LeftOn, Need};
use crate::health::HealthInput;
use crate::time::MonoTime;

/// From one request to the next while something may be on. They are uneven: a vibration is not to be read at the same place of each swing.
const APART_MS: [u64; 6] = [67, 41, 83, 53, 97, 59];
/// The same while nothing is, or nobody answers.
const SELDOM: Duration = Duration::from_secs(1);
/// So many requests without an answer are enough of a hurry.
const HURRIES: u32 = 30;
/// Who has answered nothing for so long is waited for by nobody.
const ANSWERS: Duration = Duration::from_secs(1);
/// Frames of a lane that is led are no farther apart than this.
const FLOWS: Duration = Duration::from_millis(1_200);

/// What is known of one controller beside what may be on there.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tended {
    /// When the last frame went to it.
    pub(super) posted: MonoTime,
    /// When it answered last.
    pub(super) answered: MonoTime,
    /// When it is asked next, and how often it was since it answered.
    next: MonoTime,
    asked: u32,
    turn: usize,
    /// Since when something may be on that nobody asks for.
    since: Option<MonoTime>,
}

impl Watch {
    /// Has all that get no frames made dark and still, and says of how many that answer this is not known.
    pub(super) fn tend(&mut self, now: MonoTime) {
        if self.silent {
            return;
        }
        // Preflight counts every datagram, and whoever homes seats has answers of his own.
        let may_ask = !self.is_hushed() && !self.is_asked_otherwise();
        let mut waits = 0;
        for controller in 0..self.peers.len() {
            let is_any = self.is_ours(controller) && self.peers[controller].left_on().is_any();
            let is_led = self.is_led(controller, now);
            let tended = &mut self.tended[controller];
            tended.since = if is_any && !is_led { Some(tended.since.unwrap_or(now)) } else { None };
            let is_due = may_ask && !is_led && now >= tended.next;
            waits += u32::from(is_any && tended.answers(now));
            if is_due && self.is_ours(controller) {
                self.darken(controller, is_any, now);
            }
        }
        self.live.on_left_on(waits);
    }

    fn darken(&mut self, controller: usize, is_any: bool, now: MonoTime) {
        let tended = &mut self.tended[controller];
        tended.turn = (tended.turn + 1) % APART_MS.len();
        tended.asked = if tended.answers(now) { 0 } else { tended.asked.saturating_add(1) };
        let hurries = is_any && tended.asked < HURRIES;
        tended.next = now + if hurries { Duration::from_millis(APART_MS[tended.turn]) } else { SELDOM };
        // What the kernel does not take is asked for again.
        let sent = self.ask(controller, Need::Dark, now);
        self.judge(HealthInput::OtherSent(controller, sent));
    }

    /// A play answers for what it has sent to alone: before that somebody else may lead these seats.
    fn is_ours(&self, controller: usize) -> bool {
        self.standby.is_some() || self.tended[controller].posted > MonoTime::default()
    }

    /// Whether frames say what is on there.
    fn is_led(&self, controller: usize, now: MonoTime) -> bool {
        let flows = now.since(self.tended[controller].posted) < FLOWS;
        flows && self.live.is_moving() && self.stands(controller).may_move()
    }

    /// What may be on at a controller though nobody asks for it, and since when.
    pub(super) fn left_on(&self, controller: usize) -> (LeftOn, Option<MonoTime>) {
        let Tended { since, .. } = self.tended[controller];
        let left = self.peers[controller].left_on();
        // Of one that never answered nothing is known that would be worth a word beside that.
        let is_told = left.is_known || self.tended[controller].answers(self.looked);
        (left, since.filter(|_| is_told))
    }
}

impl Tended {
    /// One of many, that are not all asked at once.
    pub(super) fn of(turn: usize) -> Self {
        Self { turn, ..Self::default() }
    }

    fn answers(&self, now: MonoTime) -> bool {
        self.answered > MonoTime::default() && now.since(self.answered) < ANSWERS
    }
}
