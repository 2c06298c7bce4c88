//! Checks if what a controller counts while frames go there is what was sent from here: once a second, so that another master is
//! known within two. How a controller is known again after a silence is of `proof`.

use std::time::Duration;

use super::late::Overdue;
use crate::time::MonoTime;

/// How often it is read.
const EVERY: Duration = Duration::from_secs(1);
/// Controllers are not asked all at once, but so long one after the other.
const APART: Duration = Duration::from_millis(20);
const TURNS: usize = 50;
/// What is compared begins anew after so long: a network that doubles a datagram now and then is no master.
const SPAN: Duration = Duration::from_secs(10);
/// After a longer time without a count nothing is compared.
const STALE: Duration = Duration::from_secs(30);
/// So many datagrams more than were sent, and one in so many of those, may be doubled ones.
const TOLERATED: u64 = 32;
const DOUBLED: u64 = 64;

/// The counter of one controller.
#[derive(Debug, Clone, Default)]
pub(super) struct PacketCounter {
    /// When it is to be read next.
    next: Option<MonoTime>,
    /// What had been sent when it was asked first for the count that is to come, or that came last.
    asked: u64,
    /// It has not told since.
    is_open: bool,
    /// What was told and not judged yet, what had been sent when that was asked for, and what had been acked when it came.
    told: Option<(u16, u64, u64)>,
    first: Option<PacketCount>,
    /// The next count says no more than what may still arrive.
    anew: bool,
}

#[derive(Debug, Clone, Copy)]
struct PacketCount {
    packets: u16,
    /// Sent before it was asked for, so in the count or late; what was sent since then may be in it or come later.
    sent: u64,
    acked: u64,
    at: MonoTime,
    /// What it has not counted of all that was sent before.
    late: Overdue,
}

/// What a count says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CountVerdict {
    /// It got more than was sent.
    Crowded,
    /// It began anew.
    Rebooted,
}

impl PacketCounter {
    /// The same that compares nothing with what was counted so far.
    pub(super) const fn anew(&self) -> Self {
        Self { next: None, told: None, anew: true, ..*self }
    }

    /// It is asked for its count, after so many datagrams.
    pub(super) const fn ask(&mut self, sent: u64) {
        if !self.is_open {
            (self.asked, self.is_open) = (sent, true);
        }
    }

    /// It tells its count, after so many acks.
    pub(super) const fn hear(&mut self, packets: u16, acked: u64) {
        (self.told, self.is_open) = (Some((packets, self.asked, acked)), false);
    }

    /// True if it is time to read it; if so, the next time is due a while later.
    pub(super) fn is_turn(&mut self, controller: usize, now: MonoTime) -> bool {
        let turn = u32::try_from(controller % TURNS).unwrap_or_default();
        let next = *self.next.get_or_insert(now + APART * turn);
        let due = now >= next;
        if due {
            self.next = Some(now + EVERY);
        }
        due
    }

    /// Judges what was told by all that was sent until now, which is a little more than it can have counted.
    pub(super) fn judge(&mut self, sent: u64, now: MonoTime) -> Option<CountVerdict> {
        let (packets, asked, acked_by_then) = self.told.take()?;
        let anew = std::mem::take(&mut self.anew);
        let count =
            PacketCount { packets, sent: asked, acked: acked_by_then, at: now, late: Overdue::default() };
        let Some(first) = self.first.filter(|first| now.since(first.at) < STALE) else {
            self.first = Some(count);
            return None;
        };
        let sent = sent - first.sent;
        // What is acked after it may be of frames that it has not counted.
        let acked = acked_by_then - first.acked;
        let grown = u64::from(packets.wrapping_sub(first.packets));
        let tolerated = TOLERATED + sent / DOUBLED;
        let fits = grown <= sent + first.late.most(now) + tolerated && grown + tolerated >= acked;
        if now.since(first.at) >= SPAN || !fits || anew {
            let due = asked.saturating_sub(first.sent);
            let late = if fits { first.late.after(due, grown, now) } else { Overdue::default() };
            self.first = Some(PacketCount { late, ..count });
        }
        if anew {
            return None;
        }
        if fits {
            return None;
        }
        Some(if u64::from(packets) <= sent { CountVerdict::Rebooted } else { CountVerdict::Crowded })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn s(seconds: u64) -> MonoTime {
        MonoTime::from_nanos(seconds * 1_000_000_000)
    }

    /// Counts once a second of a controller that is sent, and acks, 100 frames a second.
    fn judge(counts: &[u16]) -> Vec<Option<CountVerdict>> {
        let mut counter = PacketCounter::default();
        let mut second = 0;
        let mut one = |packets: &u16| {
            second += 1;
            counter.ask(100 * second);
            counter.hear(*packets, 100 * second);
            counter.judge(100 * second, s(second))
        };
        counts.iter().map(&mut one).collect()
    }

    #[test]
    fn a_counter_that_grows_as_was_sent_says_nothing_also_over_its_end() {
        let counts: Vec<u16> = (0..100_u16).map(|second| 60_000_u16.wrapping_add(101 * second)).collect();
        assert_eq!(judge(&counts), [None; 100], "one in a hundred is doubled");
    }

    #[test]
    fn another_master_is_known_by_the_second_count_after_it_began() {
        assert_eq!(judge(&[500, 600, 750])[2], Some(CountVerdict::Crowded));
        assert_eq!(judge(&[500, 620, 740])[2], Some(CountVerdict::Crowded), "twenty a second");
    }

    #[test]
    fn what_was_held_back_is_not_taken_for_another_masters_when_it_comes_and_more_than_that_is() {
        for (more, said) in [(0, None), (60, Some(CountVerdict::Crowded))] {
            let mut counter = PacketCounter::default();
            let mut after = |packets: u16, sent, at| {
                counter.ask(sent);
                counter.hear(packets, 0);
                counter.judge(sent, s(at))
            };
            assert_eq!((after(500, 0, 1), after(600, 400, 2)), (None, None), "300 of them are held back");
            counter = counter.anew();
            let mut after = |packets: u16, sent, at| {
                counter.ask(sent);
                counter.hear(packets, 0);
                counter.judge(sent, s(at))
            };
            assert_eq!((after(650, 450, 3), after(700, 500, 5)), (None, None));
            assert_eq!(after(1_050 + more, 550, 6), said);
        }
    }

    /// A switch, the controller or this machine stands still while its answer is on the way, and frames go out meanwhile.
    #[test]
    fn what_is_sent_while_the_first_count_is_on_its_way_may_come_after_it() {
        let mut counter = PacketCounter::default();
        let mut after = |packets: u16, [asked, sent]: [u64; 2], at| {
            counter.ask(asked);
            counter.hear(packets, 0);
            counter.judge(sent, s(at))
        };
        assert_eq!(after(500, [100, 400], 1), None, "300 frames are under way");
        assert_eq!(after(1_300, [900, 900], 2), None);
        assert_eq!(after(1_400, [1_000, 1_000], 12), None, "and are no more from then on");
        assert_eq!(after(1_700, [1_100, 1_100], 13), Some(CountVerdict::Crowded));
    }

    #[test]
    fn what_is_acked_behind_a_count_that_is_judged_only_then_need_not_be_in_it() {
        let mut counter = PacketCounter::default();
        for (packets, acked_by_then, acked, at) in
            [(500, 100, 100, 1), (600, 200, 900, 2), (1_400, 1_000, 1_000, 3)]
        {
            counter.ask(acked);
            counter.hear(packets, acked_by_then);
            assert_eq!(counter.judge(acked, s(at)), None, "{at}");
        }
    }

    #[test]
    fn a_counter_that_began_anew_is_a_reboot_and_the_next_is_measured_from_there() {
        assert_eq!(judge(&[40_000, 40_100, 60, 160]), [None, None, Some(CountVerdict::Rebooted), None]);
    }

    #[test]
    fn controllers_take_turns_and_each_is_read_once_a_second() {
        let ms = |ms: u64| MonoTime::from_nanos(ms * 1_000_000);
        let mut counter = PacketCounter::default();
        let times: Vec<u64> =
            (0..250).map(|tick| 10 * tick).filter(|at| counter.is_turn(3, ms(*at))).collect();
        assert_eq!(times, [60, 1_060, 2_060]);
    }
}
