//! The hall under random requests, events and clock jumps, beside rules that remember only who asked for what.

use std::time::Duration;

use proptest::prelude::*;
use proptest::sample::select;

use super::*;
use crate::state::rules::{HallRules, Turn};

fn trouble() -> impl Strategy<Value = Trouble> {
    select(vec![Trouble::Limiter, Trouble::Planner, Trouble::Homing(2), Trouble::OtherMaster(0)])
}

fn event() -> impl Strategy<Value = Event> {
    use Event::{
        AllReleased, AtRest, CueEnded, EmergencyStop, Homed, Identified, JoinBegun, Joined, Late, Parked,
        Policy, PositionsRead, Rebooted,
    };
    let readiness = [Readiness::NoCue, Readiness::NotProved, Readiness::NotPreflighted];
    prop_oneof![
        8 => select(vec![PositionsRead, Homed, JoinBegun, Joined, Late, CueEnded, AtRest, Parked]),
        4 => select(vec![AllReleased, Event::Readiness(Readiness::Ready)]),
        2 => (any::<[bool; 2]>(), select(vec![LedBefore::Ended, LedBefore::Crashed, LedBefore::OnCue]))
            .prop_map(|([homed, at_park], before)| Identified(Finding { homed, at_park, before })),
        1 => Just(Identified(PARKED)),
        1 => any::<bool>().prop_map(Event::Astray),
        1 => (0..3_usize).prop_map(Rebooted),
        1 => select(readiness.to_vec()).prop_map(Event::Readiness),
        1 => (select(vec![Demand::Pause, Demand::Park]), 0..3_usize).prop_map(|(demand, group)| Policy(demand, group)),
        1 => (0..3_usize).prop_map(EmergencyStop),
        1 => trouble().prop_map(Event::Trouble),
        1 => select(vec![Latch::Free, Latch::Held, Latch::Over]).prop_map(Event::Latched),
        1 => Just(Event::ZerosKnown),
        1 => (0..400_u64).prop_map(|seconds| Event::Slept(Duration::from_secs(seconds))),
    ]
}

fn turn() -> impl Strategy<Value = Turn> {
    use Transition::{Clear, Go, HomeAndArm, Park, Resume};
    prop_oneof![
        4 => select(Transition::ALL.to_vec()).prop_map(|request| Turn::Step(Step::Command(request))),
        4 => select(vec![HomeAndArm, Go, Resume, Park, Clear]).prop_map(|request| Turn::Step(Step::Command(request))),
        8 => event().prop_map(|event| Turn::Step(Step::Tell(event))),
        4 => (0..1_000_i64).prop_map(Turn::Clock),
        1 => (-4_000_000..4_000_000_i64).prop_map(Turn::Clock),
    ]
}

/// What a patient operator and sound controllers do, until the hall plays.
fn to_the_show(hall: &mut Machine, mut now: MonoTime) {
    let tell = [Event::AllReleased, Event::Identified(PARKED), Event::Readiness(Readiness::Ready)];
    tell.into_iter().for_each(|event| hall.event(event, now));
    for _ in 0..10 {
        now = now + Duration::from_secs(1);
        match hall.state() {
            State::Playing(_) => return,
            State::Boot => hall.event(Event::Identified(PARKED), now),
            State::Homing => hall.event(Event::Homed, now),
            State::Stopping => hall.event(Event::AtRest, now),
            State::Parking => hall.event(Event::Parked, now),
            State::Recovering => {
                hall.event(Event::PositionsRead, now);
                hall.request(Transition::Park, now).or_else(|_| hall.request(Transition::Home, now)).unwrap();
            }
            State::Parked => hall.request(Transition::HomeAndArm, now).unwrap(),
            State::Armed => hall.request(Transition::Go, now).unwrap(),
            State::Paused => hall.request(Transition::Resume, now).unwrap(),
            State::Stopped | State::Fault => hall.request(Transition::Clear, now).unwrap(),
        }
    }
    panic!("no way out of {}", hall.state());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn whatever_happens_nothing_leads_up_but_a_person_and_every_state_has_a_way_out(
        // From anywhere: chance alone hardly ever gets as far as a cue.
        start in select(State::ALL.to_vec()),
        turns in proptest::collection::vec(turn(), 1..150),
    ) {
        let mut now = s(10_000);
        let mut hall = Machine { since: now, ..hall(start) };
        let mut rules = HallRules::default();
        for turn in turns {
            rules.follow(&mut hall, turn, &mut now);
            to_the_show(&mut hall.clone(), now);
            super::remedies::follow_to_the_show(&mut hall.clone(), now);
        }
    }

    #[test]
    fn a_stop_ends_all_frames_within_its_time_whatever_else_comes(
        start in select(State::ALL.to_vec()),
        turns in proptest::collection::vec(turn(), 0..10),
        more in proptest::collection::vec(event(), 0..20),
    ) {
        let mut hall = hall(start);
        for turn in turns {
            if let Turn::Step(step) = turn {
                let _ = take(&mut hall, step, s(1));
            }
        }
        hall.request(Transition::Stop, s(2)).unwrap();
        for event in more {
            hall.event(event, s(3));
            prop_assert!(matches!(hall.state(), State::Stopping | State::Stopped));
        }
        hall.tick(s(2) + STOPPING_FOR);
        prop_assert_eq!(hall.state(), State::Stopped);
    }
}
