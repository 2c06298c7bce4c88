//! The hall under random requests, events and clock jumps, beside a model that remembers only who asked for what.

use std::time::Duration;

use proptest::prelude::*;
use proptest::sample::select;

use super::*;

#[derive(Debug, Clone, Copy)]
enum Turn {
    Step(Step),
    /// The clock goes on, or back, by that many milliseconds, and the hall is told.
    Clock(i64),
}

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
        2 => any::<[bool; 3]>().prop_map(|[homed, at_park, crashed]| Identified(Finding { homed, at_park, crashed })),
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

/// How much a hall does in a state; only a person may make it do more.
pub(super) const fn height(state: State) -> u8 {
    match state {
        State::Stopped => 0,
        State::Fault => 1,
        State::Boot | State::Recovering => 2,
        State::Parked => 3,
        State::Homing => 4,
        State::Armed => 5,
        State::Stopping => 6,
        State::Parking => 7,
        State::Paused => 8,
        State::Playing(_) => 9,
    }
}

/// What the requests so far allow, kept apart from the machine.
#[derive(Debug, Default)]
struct Model {
    pressed: bool,
    /// The last taken request to home was one to arm, and it was not taken back.
    homes_to_arm: bool,
    astray: bool,
    latch: Latch,
}

impl Model {
    fn check(&mut self, before: &Machine, turn: Turn, taken: bool, after: &Machine) {
        let (from, to) = (before.state(), after.state());
        match turn {
            Turn::Step(Step::Command(request)) => self.on_request(before, request, taken, after),
            Turn::Step(Step::Tell(event)) => self.on_event(from, event, to),
            Turn::Clock(_) => assert!(height(to) <= height(from), "time alone led from {from} to {to}"),
        }
        let five = matches!(to, State::Playing(_) | State::Paused | State::Stopping | State::Parking);
        assert_eq!(after.may_send_motion(), five);
        let stops = matches!(to, State::Stopping | State::Stopped);
        assert!(!self.pressed || stops, "{to} under an emergency stop");
    }

    fn on_request(&mut self, before: &Machine, request: Transition, taken: bool, after: &Machine) {
        let (from, to) = (before.state(), after.state());
        if !taken {
            assert_eq!((from, before.cause(), before.since()), (to, after.cause(), after.since()));
        }
        match request {
            Transition::Stop => {
                assert!(taken, "a stop was refused while {from}");
                let rest = if from.may_send_motion() { State::Stopping } else { State::Stopped };
                assert_eq!(to, rest, "stopped while {from}");
            }
            Transition::Clear if taken => {
                let held = matches!(from, State::Parked | State::Recovering) && self.latch == Latch::Over;
                assert!((from.is_latched() || held) && to == State::Recovering, "cleared while {from}");
            }
            Transition::Arm | Transition::HomeAndArm if taken => self.homes_to_arm = to == State::Homing,
            Transition::Home | Transition::Disarm if taken => {
                self.homes_to_arm &= request == Transition::Home
            }
            _ => {}
        }
        let homes = (from, to) != (State::Homing, State::Homing) && to == State::Homing;
        assert!(
            !homes || matches!(request, Transition::Home | Transition::HomeAndArm),
            "{request} homed the seats"
        );
        let stays = from.is_latched() && request != Transition::Clear;
        assert!(!stays || to.is_latched(), "{request} led from {from} to {to}");
        if !from.may_send_motion() && to.may_send_motion() {
            let way = (from, request);
            let parks =
                from == State::Recovering || (from == State::Parked && (self.astray || before.is_homed()));
            assert!(
                way == (State::Armed, Transition::Go) || (parks && request == Transition::Park),
                "{way:?}"
            );
        }
    }

    fn on_event(&mut self, from: State, event: Event, to: State) {
        match event {
            Event::EmergencyStop(_) => self.pressed = true,
            Event::AllReleased => self.pressed = false,
            Event::Astray(astray) => self.astray = astray,
            Event::Latched(latch) => self.latch = latch,
            Event::Readiness(readiness) => self.homes_to_arm &= readiness == Readiness::Ready,
            _ => {}
        }
        let up = height(to) > height(from);
        let arrives =
            (from, to) == (State::Homing, State::Armed) && event == Event::Homed && self.homes_to_arm;
        let found = (from, to) == (State::Boot, State::Parked) && matches!(event, Event::Identified(_));
        assert!(!up || arrives || found, "{event:?} led from {from} to {to}");
        assert!(!from.is_latched() || to.is_latched(), "{event:?} led out of {from}");
    }
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
        let mut model = Model::default();
        for turn in turns {
            let before = hall.clone();
            let taken = match turn {
                Turn::Step(step) => take(&mut hall, step, now).is_ok(),
                Turn::Clock(ms) => {
                    now = MonoTime::from_nanos(now.as_nanos().saturating_add_signed(ms * 1_000_000));
                    hall.tick(now);
                    true
                }
            };
            model.check(&before, turn, taken, &hall);
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
