//! Random loss, repeats and forgeries.

use proptest::prelude::*;

use super::*;

/// Minutes of a show at 100 Hz that are played with random loss. The promise is a day: 1,440.
const MINUTES: u32 = 3;

/// A number in 0..1 from a seed that goes on.
fn chance(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    f64::from(u32::try_from(*seed >> 32).expect("the high half")) / f64::from(u32::MAX)
}

#[test]
fn one_lost_ack_in_a_hundred_never_loses_a_controller() {
    let mut hall = Hall::new(LossPolicy::Park);
    let mut seed = 7;
    for _ in 0..MINUTES * 6_000 {
        for controller in 0..4 {
            hall.ack_after[controller] = (chance(&mut seed) >= 0.01).then_some(Duration::from_millis(1));
        }
        hall.tick();
    }
    assert!(hall.changes().iter().all(|(to, _)| matches!(to, HealthState::Ok | HealthState::Degraded)));
    assert_eq!(hall.told_hall(), []);
}

/// What may reach the ack thread beside the acks that are due.
#[derive(Debug, Clone, Copy)]
enum Junk {
    /// An ack to a frame so far behind the newest, or ahead of it.
    Ack(i64),
    /// A sighting without a read, with that count.
    Sighting(u16),
}

fn junk() -> impl Strategy<Value = (usize, Junk)> {
    let what = prop_oneof![(-50..3_000_i64).prop_map(Junk::Ack), any::<u16>().prop_map(Junk::Sighting)];
    (0..4_usize, what)
}

impl Hall {
    fn throw(&mut self, controller: usize, junk: Junk) {
        match junk {
            Junk::Ack(behind) => {
                let frame = u32::try_from(i64::from(self.frame) - behind).unwrap_or(u32::MAX);
                // To frames of the time since it fell silent the forger has no answer: he repeats what he saw.
                if !(0..200).contains(&behind) {
                    self.health.on_ack(controller, FrameNo(frame), self.now);
                }
            }
            Junk::Sighting(packets) => {
                let sighting =
                    Sighting { continuity: Continuity::Packets(packets), ..self.sighting(controller) };
                self.health.on_sighting(controller, &sighting, self.now);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn repeated_old_and_forged_acks_and_sightings_keep_nobody_alive_and_revive_nobody(
        junk in proptest::collection::vec(junk(), 50..300), silent in 0..4_usize,
    ) {
        let mut hall = Hall::new(LossPolicy::Continue);
        hall.run(300);
        hall.silence(&[silent]);
        let group = hall.health.groups().group_of(silent);
        let mut since = 0;
        for (controller, junk) in junk {
            // Once it is read, only the packet counter tells a forged sighting.
            if since < 20 || matches!(junk, Junk::Ack(_)) {
                hall.throw(controller, junk);
            }
            hall.tick();
            since += 1;
            prop_assert_eq!(hall.health.standing(group) == HealthState::Lost, since > 25, "{} ticks", since);
        }
    }

    #[test]
    fn a_group_stands_as_its_worst_member_and_moves_only_when_none_is_out(
        outages in proptest::collection::vec((0..4_usize, 0..60_u32, any::<bool>()), 1..40),
    ) {
        let mut hall = Hall::new(LossPolicy::Continue);
        hall.run(100);
        for (controller, ticks, rebooted) in outages {
            hall.silence(&[controller]);
            let before = hall.standings();
            hall.run(ticks);
            let group = hall.health.groups().group_of(controller);
            prop_assert!(ticks < 26 || !hall.health.standing(group).may_move());
            hall.ack_after[controller] = Some(Duration::from_millis(1));
            if rebooted && hall.health.standing(group) == HealthState::Lost {
                hall.packets[controller] = hall.packets[controller].wrapping_add(20_000);
                hall.run(42);
                prop_assert_eq!(hall.health.standing(group), HealthState::Excluded);
                hall.health.on_homed(controller);
            }
            hall.run(42);
            (0..3).for_each(|group| hall.health.on_joined(group));
            hall.run(1);
            for other in (0..3).filter(|other| *other != group) {
                prop_assert_eq!(hall.health.standing(other).may_move(), before[other].may_move());
            }
        }
    }
}
