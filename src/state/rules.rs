//! What may never happen to a hall, whoever asks and whatever comes: kept apart from the machine, which is held against it in tests and
//! fuzzing.

use super::{Cause, Event, Latch, Machine, Readiness, Refusal, State, Transition};
use crate::time::MonoTime;

/// A request or an event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Step {
    Command(Transition),
    Tell(Event),
}

pub(crate) fn take(hall: &mut Machine, step: Step, now: MonoTime) -> Result<(), Refusal> {
    match step {
        Step::Command(request) => hall.request(request, now),
        Step::Tell(event) => {
            hall.event(event, now);
            Ok(())
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Turn {
    Step(Step),
    /// The clock goes on, or back, by that many milliseconds, and the hall is told.
    Clock(i64),
}

/// How much a hall does in a state; only a person may make it do more.
pub(crate) const fn height(state: State) -> u8 {
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

/// What the requests so far allow.
#[derive(Debug, Default)]
pub(crate) struct HallRules {
    pressed: bool,
    /// The last taken request to home was one to arm, and it was not taken back.
    homes_to_arm: bool,
    astray: bool,
    latch: Latch,
}

impl HallRules {
    /// Has a hall take a turn, which may move the clock, and holds what comes of it against them.
    pub(crate) fn follow(&mut self, hall: &mut Machine, turn: Turn, now: &mut MonoTime) {
        let before = hall.clone();
        let taken = match turn {
            Turn::Step(step) => take(hall, step, *now).is_ok(),
            Turn::Clock(ms) => {
                *now = MonoTime::from_nanos(now.as_nanos().saturating_add_signed(ms * 1_000_000));
                hall.tick(*now);
                true
            }
        };
        self.check(&before, turn, taken, hall);
    }

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
            let takes_up =
                way == (State::Recovering, Transition::Resume) && before.cause() == Cause::TookOver;
            assert!(
                way == (State::Armed, Transition::Go) || (parks && request == Transition::Park) || takes_up,
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
