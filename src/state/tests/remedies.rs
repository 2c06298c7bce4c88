//! Whatever is named as the next action can be done, and leads on: a person who does nothing else comes to a show.

use std::time::Duration;

use super::*;

/// All there are.
pub(super) const TROUBLES: [Trouble; 8] = [
    Trouble::Limiter,
    Trouble::Planner,
    Trouble::Deaf,
    Trouble::Alone,
    Trouble::Homing(2),
    Trouble::HomingTime,
    Trouble::ParkingTime,
    Trouble::OtherMaster(0),
];

/// Does what is named, by a request that has to be taken, or as somebody at the seats or the hall itself does it.
fn follow(hall: &mut Machine, now: MonoTime) {
    let next = hall.next();
    let mut ask = |request| hall.request(request, now).unwrap_or_else(|refusal| panic!("{next}: {refusal}"));
    match next {
        Next::ParkOrHome | Next::ParkOrStart => ask(Transition::Park),
        Next::Home => ask(Transition::Home),
        Next::Arm => ask(Transition::Arm),
        Next::ArmAndHome => ask(Transition::HomeAndArm),
        Next::Go => ask(Transition::Go),
        Next::Resume | Next::LetJoin => ask(Transition::Resume),
        Next::AwaitStandstill
        | Next::CheckCue
        | Next::LookAtSeat
        | Next::StopOtherMaster
        | Next::Clear
        | Next::Restart => {
            ask(Transition::Clear);
            hall.event(Event::Latched(Latch::Free), now);
        }
        Next::Release => hall.event(Event::AllReleased, now),
        Next::PutRight => hall.event(Event::Latched(Latch::Over), now),
        Next::Load | Next::Prove | Next::Preflight => hall.event(Event::Readiness(Readiness::Ready), now),
        Next::AwaitAnswers => hall.event(Event::Identified(PARKED), now),
        Next::AwaitPositions => hall.event(Event::PositionsRead, now),
        Next::AwaitHome => hall.event(Event::Homed, now),
        Next::AwaitRest => {
            hall.event(Event::AtRest, now);
            hall.event(Event::Parked, now);
            hall.event(Event::Astray(false), now);
        }
        Next::Watch | Next::AwaitJoin | Next::AwaitFilm => {}
    }
}

/// What a person does who only ever does what is named next, until the hall plays.
pub(super) fn follow_to_the_show(hall: &mut Machine, mut now: MonoTime) {
    let mut done = Vec::new();
    for _ in 0..16 {
        if matches!(hall.state(), State::Playing(_)) {
            return;
        }
        done.push((hall.state(), hall.cause(), hall.next()));
        now = now + Duration::from_millis(100);
        follow(hall, now);
    }
    panic!("no way out of {} by what is named: {done:?}", hall.state());
}

#[test]
fn whatever_goes_wrong_wherever_what_is_named_next_can_be_done_and_leads_to_a_show() {
    let events = TROUBLES.map(Event::Trouble).into_iter().chain([
        Event::EmergencyStop(1),
        Event::Rebooted(1),
        Event::Latched(Latch::Held),
        Event::Latched(Latch::Over),
        Event::Astray(true),
        Event::Late,
        Event::Readiness(Readiness::NoCue),
        Event::Policy(Demand::Pause, 0),
        Event::Policy(Demand::Park, 0),
        Event::Slept(Duration::from_secs(3)),
        Event::Slept(Duration::from_mins(6)),
        Event::Identified(Finding { homed: false, at_park: false, before: LedBefore::Crashed }),
    ]);
    for event in events {
        for state in State::ALL {
            follow_to_the_show(&mut told(state, event), s(2));
            let mut stopped = told(state, event);
            stopped.request(Transition::Stop, s(1)).unwrap();
            follow_to_the_show(&mut stopped, s(2));
        }
    }
}

#[test]
fn all_next_actions_are_in_the_list_once() {
    let words: std::collections::BTreeSet<String> = Next::ALL.iter().map(Next::to_string).collect();
    assert_eq!(words.len(), Next::ALL.len());
    assert_eq!(Next::ALL.last(), Some(&Next::Restart), "it is the last of them");
}
