//! A bad link in virtual time: whatever it loses, repeats, reorders, delays or forges, the tracker's books balance, and
//! where all records come they agree with a ledger that follows the rules to the letter.

use std::collections::{BTreeMap, HashMap};

use kinocue::harness::time::MonoTime;
use kinocue::harness::tracker::{Books, Counts, KEPT, Reply, Tracker};
use kinocue::wire::{FrameNo, ReplyCode};
use proptest::prelude::*;

const SECOND_US: u64 = 1_000_000;

/// Chances in percent, and what else a link is made of.
#[derive(Debug, Clone)]
struct Link {
    seed: u64,
    first: u32,
    frames: u32,
    period_us: u64,
    loss: u64,
    duplicate: u64,
    delayed: u64,
    unasked: u64,
    failed: u64,
    unrecorded: u64,
}

/// Chance with a seed (SplitMix64).
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }

    fn percent(&mut self, chance: u64) -> bool {
        self.below(100) < chance
    }
}

#[derive(Clone, Copy)]
struct Send {
    frame: FrameNo,
    at_us: u64,
    asked: bool,
    failed: bool,
    recorded: bool,
}

/// All that happens on the link: sends in their order, replies in the order in which they are received.
struct Traffic {
    sends: Vec<Send>,
    replies: Vec<(u64, FrameNo, ReplyCode)>,
}

impl Link {
    fn traffic(&self, dice: &mut Dice) -> Traffic {
        let (mut sends, mut replies) = (Vec::new(), Vec::new());
        let mut dropping = 0; // records are dropped in bursts
        for index in 0..self.frames {
            if dropping == 0 && self.unrecorded > 0 && dice.below(10_000) < self.unrecorded {
                dropping = 1 + dice.below(6_000);
            }
            let send = Send {
                frame: FrameNo(self.first.wrapping_add(index)),
                at_us: SECOND_US + u64::from(index) * self.period_us,
                asked: !dice.percent(self.unasked),
                failed: dice.percent(self.failed),
                recorded: dropping == 0,
            };
            dropping = dropping.saturating_sub(1);
            sends.push(send);
            if !send.failed && !dice.percent(self.loss) {
                replies.push(self.reply(dice, send));
                while dice.percent(self.duplicate) {
                    replies.push(self.reply(dice, send));
                }
            }
            if dice.percent(1) {
                // A number of the past, or one that is never used.
                let number =
                    send.frame.0.wrapping_sub(u32::try_from(dice.below(9_000)).expect("below 9,000"));
                let never = self.first.wrapping_add(1_000_000);
                replies.push((
                    send.at_us + 1,
                    FrameNo(if dice.percent(50) { number } else { never }),
                    ReplyCode::Running,
                ));
            }
        }
        replies.sort_by_key(|&(at_us, ..)| at_us);
        Traffic { sends, replies }
    }

    fn reply(&self, dice: &mut Dice, send: Send) -> (u64, FrameNo, ReplyCode) {
        let most_us = if dice.percent(self.delayed) { 6 * SECOND_US } else { SECOND_US / 50 };
        let code = match dice.below(50) {
            0 => ReplyCode::Fault,
            1 => ReplyCode::EmergencyStop,
            2 => ReplyCode::Command,
            _ => ReplyCode::Running,
        };
        (send.at_us + dice.below(most_us), send.frame, code)
    }
}

/// The rules, followed without a ring and without haste.
#[derive(Default)]
struct Ledger {
    counts: Counts,
    /// Index of every frame on record, by its number.
    indices: HashMap<u32, usize>,
    fates: Vec<Standing>,
    open: BTreeMap<usize, u64>,
}

#[derive(Clone, Copy, PartialEq)]
enum Standing {
    Unasked,
    Open,
    Answered,
    Lost,
}

impl Ledger {
    fn sent(&mut self, send: Send) {
        let index = self.fates.len();
        self.indices.insert(send.frame.0, index);
        let asked = send.asked && !send.failed;
        self.fates.push(if asked { Standing::Open } else { Standing::Unasked });
        self.counts.sent += u64::from(!send.failed);
        self.counts.send_failed += u64::from(send.failed);
        self.counts.asked += u64::from(asked);
        if asked {
            self.open.insert(index, send.at_us);
        }
        if let Some(forgotten) = index.checked_sub(KEPT as usize) {
            self.lose(forgotten);
        }
    }

    fn lose(&mut self, index: usize) {
        if self.open.remove(&index).is_some() {
            self.fates[index] = Standing::Lost;
            self.counts.lost += 1;
        }
    }

    fn replied(&mut self, at_us: u64, frame: FrameNo, code: ReplyCode) {
        let Some(&index) = self.indices.get(&frame.0) else { return self.counts.stray += 1 };
        if self.fates.len() - index > KEPT as usize {
            return self.counts.stale += 1;
        }
        if self.open.get(&index).is_some_and(|sent_us| at_us > sent_us + SECOND_US) {
            self.lose(index);
        }
        match (self.fates[index], code) {
            (Standing::Unasked, _) => self.counts.stray += 1,
            (Standing::Answered, _) => self.counts.duplicate += 1,
            (Standing::Lost, _) => self.counts.stale += 1,
            (Standing::Open, ReplyCode::Running) => self.counts.acked += 1,
            (Standing::Open, ReplyCode::Fault) => self.counts.fault += 1,
            (Standing::Open, ReplyCode::EmergencyStop) => self.counts.emergency_stop += 1,
            (Standing::Open, ReplyCode::Command) => self.counts.command += 1,
        }
        if self.open.remove(&index).is_some() {
            self.fates[index] = Standing::Answered;
        }
    }

    fn expire(&mut self, now_us: u64) {
        while let Some((&index, &sent_us)) = self.open.first_key_value()
            && now_us > sent_us + SECOND_US
        {
            self.lose(index);
        }
    }
}

const fn at(us: u64) -> MonoTime {
    MonoTime::from_nanos(us * 1_000)
}

/// Tells the tracker, and the ledger, of every send up to `until_us` of which it has not been told.
fn records(
    tracker: &mut Tracker,
    ledger: &mut Ledger,
    rest: &mut std::iter::Peekable<impl Iterator<Item = Send>>,
    until_us: u64,
) {
    while let Some(send) = rest.next_if(|send| send.at_us <= until_us) {
        if send.recorded {
            tracker.on_sent(0, send.frame, send.asked, at(send.at_us));
            if send.failed {
                tracker.on_send_failed(0, send.frame);
            }
        }
        ledger.sent(send);
    }
}

/// Plays the traffic through books that are drained now and then, until nothing more can come.
fn play(link: &Link) -> (Books, Ledger, Traffic) {
    let mut dice = Dice(link.seed);
    let traffic = link.traffic(&mut dice);
    let mut books = Books::new(Tracker::starting_at(&[FrameNo(link.first)], 1));
    let mut ledger = Ledger::default();
    let mut sends = traffic.sends.iter().copied().peekable();
    let mut replies = traffic.replies.iter().copied().peekable();
    let mut now_us = SECOND_US;
    while sends.peek().is_some() || replies.peek().is_some() {
        // A second of frames and their duplicates has room in the books.
        now_us += if dice.percent(1) { dice.below(SECOND_US) } else { 1 + dice.below(10_000) };
        let mut read = Vec::new();
        while let Some((at_us, frame, code)) = replies.next_if(|&(at_us, ..)| at_us < now_us) {
            read.push((at_us, frame, code));
            let reply = Reply { controller: 0, frame, code, error: 0, inputs: 0, at: at(at_us) };
            books.on_reply(reply, &mut |_: &mut Tracker| unreachable!("fewer than there is room for"));
        }
        // Frames are sent while the replies are read, too.
        let until_us = now_us + dice.below(500);
        books.settle(at(now_us), &mut |tracker: &mut Tracker| {
            records(tracker, &mut ledger, &mut sends, until_us)
        });
        for (at_us, frame, code) in read {
            ledger.replied(at_us, frame, code);
        }
        ledger.expire(now_us);
    }
    if let Some(last) = traffic.sends.last() {
        books.tracker_mut().on_last(0, last.frame, at(now_us));
    }
    books.finish(&mut |_: &mut Tracker| ());
    ledger.expire(u64::MAX);
    (books, ledger, traffic)
}

fn link(unrecorded: impl Strategy<Value = u64>) -> impl Strategy<Value = Link> {
    let first = prop_oneof![Just(1), (u32::MAX - 5_000)..=u32::MAX];
    let traffic = (any::<u64>(), first, 1..6_000_u32, 1_000..5_000_u64);
    let chances = (0..60_u64, 0..60_u64, 0..30_u64, 0..30_u64, 0..10_u64, unrecorded);
    (traffic, chances).prop_map(|((seed, first, frames, period_us), chances)| {
        let (loss, duplicate, delayed, unasked, failed, unrecorded) = chances;
        Link { seed, first, frames, period_us, loss, duplicate, delayed, unasked, failed, unrecorded }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_books_agree_with_the_ledger(link in link(Just(0))) {
        let (books, ledger, _) = play(&link);
        prop_assert_eq!(books.tracker().counts(0), ledger.counts);
        let latency = books.tracker().latency(0);
        prop_assert_eq!(latency.len(), ledger.counts.acked);
        prop_assert!(latency.max() <= 1_001_000_000);
    }

    #[test]
    fn every_frame_and_every_reply_ends_in_one_account_though_records_are_dropped(link in link(1..50_u64)) {
        let (books, _, traffic) = play(&link);
        let counts = books.tracker().counts(0);
        prop_assert_eq!(counts.asked, counts.acked + counts.refused() + counts.lost);
        prop_assert_eq!(counts.sent + counts.send_failed, traffic.sends.len() as u64);
        let replies = counts.acked + counts.refused() + counts.duplicate + counts.stale + counts.stray;
        prop_assert_eq!(replies, traffic.replies.len() as u64);
        prop_assert!(books.tracker().latency(0).len() <= counts.acked);
    }
}
