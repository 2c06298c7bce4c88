use proptest::prelude::*;

use super::*;

/// What an axis at its greatest speed goes in a frame, strokes.
const STEP: f64 = 240.0 / 150.0 * 0.010;
/// How much faster than its limit a seat may be that did not get some of its frames.
const FASTEST: f64 = 1.25;

impl Bench {
    fn lead(&mut self, place: f64, when: u64) -> Option<Lead> {
        self.belief.lead(&at(place), ms(when), |ticks| 10 * ticks)
    }

    /// A tick that leads there: where its frame leads, if it is held back.
    fn tick(&mut self, place: f64, when: u64) -> Option<Lead> {
        self.look(when);
        if self.belief.is_sure() {
            assert!(self.allows(place, 10, when), "{place} at {when} ms");
            self.send(place, 10, when);
            return None;
        }
        let lead = self.lead(place, when).expect("a frame is slow enough");
        self.send(lead.to[0], lead.lasts_ms, when);
        Some(lead)
    }
}

#[test]
fn a_frame_after_one_without_an_ack_leads_no_farther_than_a_seat_may_go_that_did_not_get_it() {
    let mut bench = Bench::found(0.5);
    assert_eq!(bench.tick(0.5 + STEP, 0), None);
    let lead = bench.tick(0.5 + 2.0 * STEP, 10).expect("it is held back");
    assert!(lead.to[0] > 0.5 + STEP && lead.to[0] <= 0.5 + FASTEST * STEP, "{lead:?}");
    assert_eq!((lead.lasts_ms, lead.ticks), (10, 1));
    // It is not led away from the place where it is if nothing arrives.
    let next = bench.tick(0.5 + 3.0 * STEP, 20).expect("it is held back");
    assert!(next.to[0] <= 0.5 + FASTEST * STEP, "{next:?}");
}

#[test]
fn a_seat_at_half_its_speed_is_held_back_by_no_single_loss() {
    let mut bench = Bench::found(0.5);
    for tick in 0..6_u32 {
        // The ack of every other frame is lost.
        let place = 0.5 + 0.5 * STEP * f64::from(tick + 1);
        let lead = bench.tick(place, u64::from(10 * tick));
        assert!(lead.is_none_or(|lead| lead.to[0] == place && lead.ticks == 1), "{lead:?}");
        if tick % 2 == 1 {
            bench.ack(tick + 1);
        }
    }
    assert_eq!(bench.belief.tally().held_back, 0);
}

#[test]
fn a_seat_that_was_held_back_closes_up_within_its_limit_until_it_is_where_it_was_asked_to_be() {
    let mut bench = Bench::found(0.5);
    bench.tick(0.5 + STEP, 0);
    let mut place = bench.tick(0.5 + 2.0 * STEP, 10).expect("it is held back").to[0];
    let goal = 0.5 + 2.0 * STEP;
    let mut frames = 0;
    for tick in 2..60_u32 {
        bench.ack(tick);
        let Some(lead) = bench.tick(goal, u64::from(10 * tick)) else { break };
        assert!((lead.to[0] - place).abs() <= 1.01 * STEP && lead.to[0] <= goal, "{lead:?}");
        (place, frames) = (lead.to[0], frames + 1);
    }
    assert_eq!(place.to_bits(), goal.to_bits());
    assert!((4..50).contains(&frames), "{frames} frames");
}

#[test]
fn where_acks_take_three_ticks_a_fast_frame_takes_longer_and_a_slow_one_does_not() {
    for (share, longest) in [(0.25, 1), (0.9, 4)] {
        let mut bench = Bench::found(0.1);
        let (mut free, mut open, mut most) = (0, Vec::new(), 0);
        for tick in 0..40_u32 {
            while open.first().is_some_and(|(_, when)| *when <= tick) {
                let (frame, _) = open.remove(0);
                bench.ack(frame);
            }
            if tick < free {
                continue;
            }
            let lead = bench.tick(0.1 + share * STEP * f64::from(tick + 1), u64::from(10 * tick));
            let ticks = lead.map_or(1, |lead| lead.ticks);
            open.push((bench.next - 1, tick + 3));
            (free, most) = (tick + ticks, most.max(ticks));
        }
        assert!(most <= longest && (most > 1) == (longest > 1), "{share}: {most} ticks");
    }
}

#[test]
fn a_reading_ends_what_had_to_be_closed_up() {
    let mut bench = Bench::found(0.5);
    bench.tick(0.5 + STEP, 0);
    bench.tick(0.5 + 2.0 * STEP, 10);
    assert!(!bench.belief.is_sure());
    bench.read(0.5, 500, true);
    assert!(bench.belief.is_sure() && bench.belief.pose(ms(500)).is_some());
}

/// What befalls a frame: whether it is lost, whether its ack is, and how many ticks either takes.
type Fate = (bool, bool, u32, u32);

fn fates() -> impl Strategy<Value = Vec<Fate>> {
    let fate = (prop::bool::weighted(0.3), prop::bool::weighted(0.3), 0..5_u32, 0..5_u32);
    prop::collection::vec(fate, 10..120)
}

proptest! {
    /// Until there is a gap: what comes then is the blind lane's.
    #[test]
    fn no_pattern_of_loss_and_delay_makes_a_seat_faster_than_a_quarter_over_its_limit(
        fates in fates(),
        period_ms in prop::sample::select(vec![1_u32, 3, 5, 10, 20]),
        slow in any::<bool>(),
        turn in 5.0_f64..60.0,
    ) {
        let period = Duration::from_millis(u64::from(period_ms));
        let mut bench = Bench { belief: Belief::new(&window(), period, 1), ..Bench::new() };
        bench.read(0.5, 0, true);
        let step = STEP * f64::from(period_ms) / 10.0;
        // A swing whose greatest speed is the limit.
        let cue = |tick: u32| 0.5 + step * turn * f64::sin(f64::from(tick) / turn);
        let (mut seat, mut came, mut acks) = (0.5_f64, 0_u32, Vec::<(u32, u32)>::new());
        let (mut there, mut free) = (Vec::<(u32, f64, u32)>::new(), 0);
        for (tick, (lost, mute, late, back)) in (0_u32..).zip(fates) {
            let now = u64::from(tick * period_ms);
            acks.iter().filter(|(when, _)| *when <= tick).for_each(|(_, frame)| bench.ack(*frame));
            acks.retain(|(when, _)| *when > tick);
            if bench.look(now) != Found::Nothing {
                break;
            }
            if tick < free {
                continue;
            }
            let place = cue(tick + 1);
            let (to, lasts_ms, ticks) = if bench.belief.is_sure() {
                prop_assert!(bench.allows(place, period_ms, now));
                (place, period_ms, 1)
            } else {
                let lead = bench.belief.lead(&at(place), ms(now), |ticks| period_ms * ticks);
                let lead = lead.expect("a frame is slow enough");
                (lead.to[0], lead.lasts_ms, lead.ticks)
            };
            free = tick + ticks;
            let frame = bench.next;
            bench.send(to, lasts_ms, now);
            if !lost {
                // One way keeps its order; what a network brings late is executed in that order.
                came = came.max(tick + if slow { late } else { 0 });
                there.push((came, to, lasts_ms));
                if !mute {
                    acks.push((came + 1 + if slow { back } else { 0 }, frame));
                }
            }
        }
        for (_, to, lasts_ms) in there {
            let most = FASTEST * 1.6e-3 * f64::from(lasts_ms) + 1e-9;
            prop_assert!((to - seat).abs() <= most, "{} in {lasts_ms} ms", to - seat);
            seat = to;
        }
    }
}
