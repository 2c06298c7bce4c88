use proptest::prelude::*;

use super::*;

/// What an axis at its greatest speed goes in a millisecond, strokes.
const FAR: f64 = 240.0 / 150.0 * 1e-3;
/// The bench seat's greatest acceleration, strokes per second squared.
const BRAKES: f64 = 3_000.0 / 150.0;
/// How much faster than its limit a seat may be that did not get some of its frames.
const FASTEST: f64 = 1.25;
/// A controller executes no longer Time than this.
const LONGEST_MS: u32 = 3_000;

/// A seat on a swing, whose greatest speed is such a share of its limit.
struct Swing {
    bench: Bench,
    period_ms: u32,
    share: f64,
    /// Radians a second.
    quick: f64,
    /// The tick up to which a frame leads it.
    free: u32,
}

impl Swing {
    fn new(period_ms: u32, share: f64, quick: f64) -> Self {
        let period = Duration::from_millis(u64::from(period_ms));
        let mut bench = Bench { belief: Belief::new(&window(), period, 1), ..Bench::new() };
        bench.read(0.5, 0, true);
        Self { bench, period_ms, share, quick, free: 0 }
    }

    fn seconds(&self, tick: u32) -> f64 {
        f64::from(tick * self.period_ms) * 1e-3
    }

    /// Where it is to be at the end of a tick; it begins at its greatest speed.
    fn place(&self, tick: u32) -> f64 {
        let most = self.share * FAR * 1e3;
        0.5 + most / self.quick * (self.quick * self.seconds(tick)).sin()
    }

    fn wish(&self, tick: u32) -> Wish {
        let (most, turn) = (self.share * FAR * 1e3, self.quick * self.seconds(tick + 1));
        Wish {
            before: at(self.place(tick)),
            pose: at(self.place(tick + 1)),
            velocity: at(most * turn.cos()),
            acceleration: at(-most * self.quick * turn.sin()),
        }
    }

    fn looks(&mut self, tick: u32) -> Found {
        self.bench.look(u64::from(tick * self.period_ms))
    }

    /// Sends the frame of a tick, if one is due: its number, where it leads, and its Time.
    fn sends(&mut self, tick: u32) -> Option<(u32, f64, u32)> {
        if tick < self.free {
            return None;
        }
        let (now, wish, period_ms) = (u64::from(tick * self.period_ms), self.wish(tick), self.period_ms);
        let (to, lasts_ms, ticks) = if self.bench.belief.is_sure() {
            (wish.pose[0], period_ms, 1)
        } else {
            let lead = self.bench.belief.lead(&wish, LONGEST_MS, |ticks| period_ms * ticks);
            let lead = lead.expect("a frame is slow enough");
            (lead.to[0], lead.lasts_ms, lead.ticks)
        };
        assert!(self.bench.allows(to, lasts_ms, now), "{to} at {now} ms");
        self.free = tick + ticks;
        self.bench.send(to, lasts_ms, now);
        Some((self.bench.next - 1, to, lasts_ms))
    }

    /// Goes through so many ticks whose acks come at once.
    fn goes(&mut self, ticks: std::ops::Range<u32>) {
        for tick in ticks {
            self.looks(tick);
            let sent = self.sends(tick);
            sent.into_iter().for_each(|(frame, ..)| self.bench.ack(frame));
        }
    }

    fn held_back(&self) -> u64 {
        self.bench.belief.tally().held_back
    }
}

#[test]
fn the_frame_after_one_without_an_ack_takes_longer_and_aims_at_where_the_seat_is_to_be_by_then() {
    let mut swing = Swing::new(10, 0.75, 4.0);
    swing.goes(0..5);
    swing.looks(5);
    let (_, lost, _) = swing.sends(5).expect("one is due");
    swing.looks(6);
    let (_, to, lasts_ms) = swing.sends(6).expect("one is due");
    assert_eq!(lasts_ms, 20);
    assert!((to - swing.place(8)).abs() < 1e-4, "{to}");
    // From wherever the seat may be.
    assert!(to - swing.place(5) <= FASTEST * 20.0 * FAR && to - lost <= 1.01 * 20.0 * FAR, "{to}");
}

#[test]
fn a_seat_at_half_its_speed_is_held_back_by_no_single_loss() {
    let mut swing = Swing::new(10, 0.5, 4.0);
    for tick in 0..40 {
        swing.looks(tick);
        let (frame, ..) = swing.sends(tick).expect("each tick has one");
        if tick % 2 == 1 {
            swing.bench.ack(frame);
        }
    }
    assert_eq!(swing.held_back(), 0);
}

#[test]
fn a_seat_that_is_not_heard_brakes_within_its_limit() {
    for (period_ms, share) in [(1, 1.0), (10, 1.0), (10, 0.8), (20, 1.0)] {
        let mut swing = Swing::new(period_ms, share, 4.0);
        swing.goes(0..10);
        let (mut place, mut last_ms) = (swing.place(10), period_ms);
        let begins = (place - swing.place(9)) / f64::from(period_ms) * 1e3;
        let mut speed = begins;
        for tick in 10..10 + 150 / period_ms {
            swing.bench.belief.told = ms(u64::from(tick * period_ms));
            let Some((_, to, lasts_ms)) = swing.sends(tick) else { continue };
            let next = (to - place) / f64::from(lasts_ms) * 1e3;
            let seconds = f64::from(last_ms.min(20) + lasts_ms.min(20)) / 2e3;
            assert!((next - speed).abs() <= 1.01 * BRAKES * seconds, "{period_ms} ms: {speed} to {next}");
            (place, speed, last_ms) = (to, next, lasts_ms);
        }
        assert!(speed < 0.4 * begins, "{period_ms} ms, {share}: {speed} of {begins}");
    }
}

#[test]
fn an_ack_thread_that_is_held_up_holds_no_seat_back() {
    let mut swing = Swing::new(10, 1.0, 4.0);
    swing.goes(0..5);
    for tick in 5..9 {
        let evidence = swing.bench.evidence.lane(0).expect("it has one");
        swing.bench.belief.look(evidence, ms(40), ms(u64::from(10 * tick)));
        swing.sends(tick);
    }
    assert_eq!(swing.held_back(), 0);
}

#[test]
fn where_acks_always_take_three_ticks_no_seat_is_held_back_once_that_is_known() {
    let mut swing = Swing::new(10, 0.7, 4.0);
    let mut acks = Vec::new();
    let mut known = 0;
    for tick in 0..200 {
        acks.iter().filter(|(when, _)| *when == tick).for_each(|(_, frame)| swing.bench.ack(*frame));
        swing.looks(tick);
        let sent = swing.sends(tick);
        acks.extend(sent.map(|(frame, ..)| (tick + 3, frame)));
        known = if tick == 80 { swing.held_back() } else { known };
    }
    assert_eq!(swing.held_back(), known);
}

#[test]
fn a_seat_that_braked_closes_up_gently_until_it_is_where_it_was_asked_to_be() {
    let mut swing = Swing::new(10, 0.9, 4.0);
    swing.goes(0..5);
    for tick in 5..12 {
        swing.looks(tick);
        swing.sends(tick);
    }
    assert!(swing.held_back() > 0 && !swing.bench.belief.is_sure());
    let newest = swing.bench.next - 1;
    swing.bench.ack(newest);
    swing.goes(12..200);
    assert!(swing.bench.belief.is_sure());
    let last = swing.bench.belief.spans.last()[0];
    assert_eq!(last.to_bits(), swing.place(200).to_bits());
}

#[test]
fn a_reading_ends_what_had_to_be_closed_up() {
    let mut swing = Swing::new(10, 1.0, 4.0);
    swing.goes(0..5);
    for tick in 5..9 {
        swing.looks(tick);
        swing.sends(tick);
    }
    assert!(!swing.bench.belief.is_sure());
    swing.bench.read(0.5, 700, true);
    assert!(swing.bench.belief.is_sure() && swing.bench.belief.pose(ms(700)).is_some());
}

proptest! {
    /// Until there is a gap: what comes then is the blind lane's.
    #[test]
    fn no_pattern_of_losses_makes_a_seat_faster_than_a_quarter_over_its_limit(
        fates in prop::collection::vec((prop::bool::weighted(0.3), prop::bool::weighted(0.3)), 10..120),
        period_ms in prop::sample::select(vec![1_u32, 3, 5, 10, 20]),
        share in 0.3_f64..1.0,
        quick in 4.0_f64..8.0,
    ) {
        let mut swing = Swing::new(period_ms, share, quick);
        let mut seat = 0.5;
        for (tick, (lost, mute)) in (0_u32..).zip(fates) {
            if swing.looks(tick) != Found::Nothing {
                break;
            }
            let Some((frame, to, lasts_ms)) = swing.sends(tick).filter(|_| !lost) else { continue };
            let most = FASTEST * FAR * f64::from(lasts_ms) + 1e-9;
            prop_assert!((to - seat).abs() <= most, "{} in {lasts_ms} ms", to - seat);
            seat = to;
            if !mute {
                swing.bench.ack(frame);
            }
        }
    }
}
