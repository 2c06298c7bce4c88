mod chance;
mod every_hall;
mod remedies;
mod table;

use super::*;
use crate::film::chase::{HoldCause, ParkCause};
use crate::film::point::FilmState;
use crate::state::rules::{Step, take};

const fn s(seconds: u64) -> MonoTime {
    MonoTime::from_nanos(seconds * 1_000_000_000)
}

const PARKED: Finding = Finding { homed: true, at_park: true, before: LedBefore::Ended };
const MASTER: Trouble = Trouble::OtherMaster(3);

/// What leads from the start of the program to a state.
fn way_to(state: State) -> (Vec<Step>, State) {
    use Transition::{Arm, Clear, Go, Home, Park, Pause, Stop};
    let found = [Step::Tell(Event::Identified(PARKED)), Step::Tell(Event::Readiness(Readiness::Ready))];
    let then = |steps: &[Step]| found.iter().chain(steps).copied().collect::<Vec<_>>();
    let go = [Step::Command(Arm), Step::Command(Go)];
    let going = |steps: &[Step]| then(&[&go, steps].concat());
    let way = match state {
        State::Boot => vec![],
        State::Recovering => {
            then(&[Step::Command(Stop), Step::Command(Clear), Step::Tell(Event::PositionsRead)])
        }
        State::Parked => then(&[]),
        State::Homing => then(&[Step::Command(Home)]),
        State::Armed => then(&[Step::Command(Arm)]),
        State::Playing(PlayMode::Waiting) => going(&[Step::Tell(Event::FilmAwaited(HoldCause::Apart))]),
        State::Playing(PlayMode::Joining) => going(&[]),
        State::Playing(PlayMode::Following) => going(&[Step::Tell(Event::Joined)]),
        State::Playing(PlayMode::Holding) => going(&[Step::Tell(Event::Late)]),
        State::Paused => going(&[Step::Command(Pause)]),
        State::Parking => going(&[Step::Command(Park)]),
        State::Stopping => going(&[Step::Command(Stop)]),
        State::Stopped => then(&[Step::Command(Stop)]),
        State::Fault => then(&[Step::Tell(Event::Trouble(Trouble::Limiter))]),
    };
    (way, state)
}

/// A hall in a state, since second 0.
#[track_caller]
fn hall(state: State) -> Machine {
    let mut hall = Machine::new(s(0));
    for step in way_to(state).0 {
        take(&mut hall, step, s(0)).unwrap();
    }
    assert_eq!(hall.state(), state);
    hall
}

/// The hall in `from` after a request that it has to take.
#[track_caller]
fn asked(from: State, request: Transition) -> Machine {
    let mut hall = hall(from);
    hall.request(request, s(1)).unwrap();
    hall
}

/// The hall in `from` after an event.
#[track_caller]
fn told(from: State, event: Event) -> Machine {
    let mut hall = hall(from);
    hall.event(event, s(1));
    hall
}

#[track_caller]
fn why(from: State, request: Transition) -> Why {
    let mut hall = hall(from);
    let refusal = hall.request(request, s(1)).unwrap_err();
    assert_eq!((hall.state(), hall.since()), (from, s(0)), "a refused request changes nothing");
    assert_eq!((refusal.state, refusal.asked), (from, request));
    refusal.why
}

fn riding() -> [State; 4] {
    [PlayMode::Waiting, PlayMode::Joining, PlayMode::Following, PlayMode::Holding].map(State::Playing)
}

#[test]
fn a_start_leads_to_parked_only_where_the_seats_are_found_so_after_an_orderly_end() {
    let found = |finding| {
        Some(told(State::Boot, Event::Identified(finding))).map(|hall| (hall.state(), hall.cause()))
    };
    assert_eq!(found(PARKED), Some((State::Parked, Cause::FoundParked)));
    assert_eq!(found(Finding { at_park: false, ..PARKED }), Some((State::Recovering, Cause::AwayFromPark)));
    let after = |before| found(Finding { before, ..PARKED });
    assert_eq!(after(LedBefore::Crashed), Some((State::Recovering, Cause::Crashed)));
    assert_eq!(after(LedBefore::OnCue), Some((State::Recovering, Cause::TookOver)));
}

/// A hall whose seats were found elsewhere than at park, after the other machine died with a show under way.
fn taken_over(readiness: Readiness) -> Machine {
    let mut hall = hall(State::Boot);
    hall.event(Event::Identified(Finding { at_park: false, before: LedBefore::OnCue, ..PARKED }), s(0));
    hall.event(Event::Readiness(readiness), s(0));
    hall
}

#[test]
fn a_show_that_was_taken_over_is_resumed_by_a_person_within_five_minutes_and_only_with_all_known() {
    let resumed = |mut hall: Machine, at| {
        let before = hall.next();
        (
            before,
            hall.request(Transition::Resume, s(at)).map(|()| hall.state()).map_err(|refusal| refusal.why),
        )
    };
    let joins = (Next::Resume, Ok(State::Playing(PlayMode::Joining)));
    assert_eq!(resumed(taken_over(Readiness::Ready), 299), joins);

    let mut late = taken_over(Readiness::Ready);
    late.tick(s(300));
    assert_eq!(
        (late.state(), late.cause()),
        (State::Recovering, Cause::PausedTooLong),
        "nothing moves by itself"
    );
    assert_eq!(resumed(late, 301), (Next::ParkOrHome, Err(Why::SeatsAnywhere)));

    for (readiness, why) in [
        (Readiness::NoCue, Why::SeatsAnywhere),
        (Readiness::NotProved, Why::SeatsAnywhere),
        (Readiness::NotPreflighted, Why::NotPreflighted),
    ] {
        assert_eq!(resumed(taken_over(readiness), 1), (Next::ParkOrHome, Err(why)));
    }
    let mut rebooted = taken_over(Readiness::Ready);
    rebooted.event(Event::Rebooted(1), s(1));
    assert_eq!(resumed(rebooted, 1), (Next::Home, Err(Why::PositionUnknown)));
    let mut stopped = taken_over(Readiness::Ready);
    for request in [Transition::Stop, Transition::Clear] {
        stopped.request(request, s(1)).unwrap();
    }
    stopped.event(Event::PositionsRead, s(1));
    assert_eq!(resumed(stopped, 1), (Next::ParkOrHome, Err(Why::SeatsAnywhere)), "what was stopped stays so");
    // The error of one controller is cleared without losing the show of all.
    let mut held = taken_over(Readiness::Ready);
    held.event(Event::Latched(Latch::Over), s(1));
    assert_eq!(held.next(), Next::Clear);
    held.request(Transition::Clear, s(1)).unwrap();
    held.event(Event::Latched(Latch::Free), s(1));
    assert_eq!(held.next(), Next::AwaitPositions);
    held.event(Event::PositionsRead, s(1));
    assert_eq!(resumed(held, 1), joins);
    assert_eq!(resumed(hall(State::Recovering), 1).1, Err(Why::SeatsAnywhere));
}

#[test]
fn a_show_goes_from_arm_to_go_to_the_cue_to_its_end_to_park() {
    let mut hall = hall(State::Parked);
    hall.request(Transition::Arm, s(1)).unwrap();
    assert_eq!((hall.state(), hall.cause()), (State::Armed, Cause::Asked(Transition::Arm)));
    hall.request(Transition::Go, s(2)).unwrap();
    assert_eq!((hall.state(), hall.since()), (State::Playing(PlayMode::Joining), s(2)));
    hall.event(Event::Joined, s(4));
    assert_eq!((hall.state(), hall.cause()), (State::Playing(PlayMode::Following), Cause::Joined));
    hall.event(Event::CueEnded, s(90));
    assert_eq!((hall.state(), hall.cause()), (State::Parking, Cause::CueEnded));
    hall.event(Event::Parked, s(93));
    assert_eq!((hall.state(), hall.cause()), (State::Parked, Cause::ArrivedAtPark));
}

#[test]
fn a_second_go_is_refused() {
    assert_eq!(riding().map(|state| why(state, Transition::Go)), [Why::PlaysAlready; 4]);
    assert_eq!(why(State::Paused, Transition::Go), Why::PausedNow);
    assert_eq!(why(State::Parked, Transition::Go), Why::NotArmed);
}

#[test]
fn a_cue_is_armed_only_when_all_is_ready() {
    for (readiness, expected) in [
        (Readiness::NoCue, Why::NoCue),
        (Readiness::NotProved, Why::NotProved),
        (Readiness::NotPreflighted, Why::NotPreflighted),
    ] {
        let mut hall = told(State::Parked, Event::Readiness(readiness));
        assert_eq!(hall.request(Transition::Arm, s(2)).unwrap_err().why, expected);
        assert_eq!(told(State::Armed, Event::Readiness(readiness)).state(), State::Parked);
    }
}

#[test]
fn arming_homes_first_where_a_position_is_unknown_and_the_seats_are_empty_and_not_otherwise() {
    let mut hall = told(State::Parked, Event::Rebooted(2));
    assert_eq!(hall.request(Transition::Arm, s(2)).unwrap_err().why, Why::HomesFirst);
    assert_eq!(hall.state(), State::Parked, "somebody may sit there");
    hall.request(Transition::HomeAndArm, s(2)).unwrap();
    assert_eq!(hall.state(), State::Homing);
    hall.event(Event::Homed, s(20));
    assert_eq!((hall.state(), hall.cause()), (State::Armed, Cause::Homed));
    for request in [Transition::Arm, Transition::HomeAndArm] {
        assert_eq!(asked(State::Parked, request).state(), State::Armed);
    }
}

#[test]
fn homing_by_itself_ends_in_parked_and_so_does_arming_that_is_taken_back() {
    assert_eq!(told(State::Homing, Event::Homed).state(), State::Parked);
    let mut hall = told(State::Parked, Event::Rebooted(2));
    hall.request(Transition::HomeAndArm, s(2)).unwrap();
    hall.request(Transition::Disarm, s(3)).unwrap();
    hall.event(Event::Homed, s(20));
    assert_eq!(hall.state(), State::Parked);
}

#[test]
fn a_reboot_disarms() {
    let hall = told(State::Armed, Event::Rebooted(7));
    assert_eq!((hall.state(), hall.cause().whose()), (State::Parked, Some(Whose::Controller(7))));
    assert!(!hall.is_homed());
    assert_eq!(hall.next(), Next::ArmAndHome);
}

#[test]
fn arming_lapses_after_ten_minutes_and_arming_again_begins_them_anew() {
    let mut hall = hall(State::Armed);
    hall.tick(s(599));
    assert_eq!(hall.state(), State::Armed);
    hall.request(Transition::Arm, s(599)).unwrap();
    hall.tick(s(1_198));
    assert_eq!(hall.state(), State::Armed);
    hall.tick(s(1_199));
    assert_eq!((hall.state(), hall.cause()), (State::Parked, Cause::ArmLapsed));
}

#[test]
fn a_pause_of_five_minutes_parks() {
    let mut hall = hall(State::Paused);
    hall.request(Transition::Seek, s(100)).unwrap();
    hall.tick(s(299));
    assert_eq!(hall.state(), State::Paused);
    hall.tick(s(300));
    assert_eq!((hall.state(), hall.cause()), (State::Parking, Cause::PausedTooLong));
}

#[test]
fn a_clock_that_goes_back_ends_nothing() {
    for state in State::ALL {
        let mut hall = Machine { since: s(1_000), ..hall(state) };
        hall.tick(s(0));
        assert_eq!(hall.state(), state);
    }
}

#[test]
fn resume_and_seek_join() {
    assert_eq!(asked(State::Paused, Transition::Resume).state(), State::Playing(PlayMode::Joining));
    for state in riding() {
        assert_eq!(asked(state, Transition::Seek).state(), State::Playing(PlayMode::Joining));
        assert_eq!(asked(state, Transition::Resume).state(), state, "it plays");
    }
}

#[test]
fn a_late_frame_holds_and_joins_again_by_itself() {
    let mut hall = told(State::Playing(PlayMode::Following), Event::Late);
    assert_eq!((hall.state(), hall.cause()), (State::Playing(PlayMode::Holding), Cause::Late));
    hall.event(Event::JoinBegun, s(2));
    assert_eq!((hall.state(), hall.cause()), (State::Playing(PlayMode::Joining), Cause::GapOver));
    hall.event(Event::Joined, s(4));
    assert_eq!(hall.state(), State::Playing(PlayMode::Following));
    for state in [State::Paused, State::Parking, State::Stopping, State::Armed] {
        assert_eq!(told(state, Event::Late).state(), state);
    }
}

#[test]
fn a_stop_decelerates_what_moves_and_is_stopped_at_once_where_nothing_does() {
    for state in State::ALL {
        let stopped = asked(state, Transition::Stop);
        let expected = if state.may_send_motion() { State::Stopping } else { State::Stopped };
        assert_eq!(stopped.state(), expected, "from {state}");
    }
    let mut hall = asked(State::Playing(PlayMode::Following), Transition::Stop);
    hall.event(Event::AtRest, s(2));
    assert_eq!((hall.state(), hall.cause()), (State::Stopped, Cause::Asked(Transition::Stop)));
}

#[test]
fn seats_that_never_tell_of_rest_are_sent_no_more_after_five_seconds() {
    let mut hall = hall(State::Stopping);
    hall.tick(s(4));
    assert!(hall.may_send_motion());
    hall.tick(s(5));
    assert_eq!(hall.state(), State::Stopped);
}

#[test]
fn a_stop_while_homing_says_that_no_frame_can_end_homing() {
    let hall = asked(State::Homing, Transition::Stop);
    assert_eq!(hall.cause(), Cause::StoppedHoming);
    assert!(hall.cause().words().contains("hard-wired"));
    assert!(!hall.is_homed());
}

#[test]
fn an_emergency_stop_stops_the_hall_from_every_state_and_seats_that_move_slow_down_first() {
    for state in State::ALL {
        let mut hall = told(state, Event::EmergencyStop(4));
        let stops = if state.may_send_motion() { State::Stopping } else { State::Stopped };
        assert_eq!((hall.state(), hall.cause()), (stops, Cause::EmergencyStop(4)), "from {state}");
        hall.event(Event::AtRest, s(2));
        assert_eq!((hall.state(), hall.cause()), (State::Stopped, Cause::EmergencyStop(4)), "from {state}");
        assert!(!hall.may_send_motion());
    }
}

#[test]
fn an_emergency_stop_during_a_stop_gives_the_seats_no_more_time() {
    let mut hall = hall(State::Stopping);
    let since = hall.since();
    hall.event(Event::EmergencyStop(4), s(3));
    assert_eq!((hall.state(), hall.since()), (State::Stopping, since));
}

#[test]
fn only_a_person_clears_and_only_when_every_emergency_stop_is_released() {
    let mut hall = told(State::Playing(PlayMode::Following), Event::EmergencyStop(4));
    hall.event(Event::AtRest, s(1));
    assert_eq!(hall.next(), Next::Release);
    assert_eq!(hall.request(Transition::Clear, s(2)).unwrap_err().why, Why::StillPressed);
    hall.event(Event::AllReleased, s(3));
    hall.tick(s(30_000));
    assert_eq!(hall.state(), State::Stopped);
    hall.request(Transition::Clear, s(30_000)).unwrap();
    assert_eq!((hall.state(), hall.cause()), (State::Recovering, Cause::Cleared));
}

#[test]
fn after_clearing_the_positions_are_read_anew_before_the_seats_park() {
    let mut hall = asked(State::Stopped, Transition::Clear);
    assert_eq!(hall.request(Transition::Park, s(2)).unwrap_err().why, Why::PositionsNotRead);
    assert_eq!(hall.next(), Next::AwaitPositions);
    hall.event(Event::PositionsRead, s(3));
    hall.request(Transition::Park, s(4)).unwrap();
    assert_eq!(hall.state(), State::Parking);
}

#[test]
fn nothing_goes_on_by_itself_after_a_sleep() {
    let slept = |state, seconds| {
        let hall = told(state, Event::Slept(Duration::from_secs(seconds)));
        (hall.state(), hall.cause())
    };
    for state in riding().into_iter().chain([State::Paused]) {
        assert_eq!(slept(state, 2).0, state);
        assert_eq!(slept(state, 3), (State::Paused, Cause::Slept), "from {state}");
        assert_eq!(slept(state, 301), (State::Stopped, Cause::Slept), "from {state}");
    }
    for seconds in [3, 301] {
        assert_eq!(slept(State::Parking, seconds), (State::Stopped, Cause::Slept));
        assert_eq!(slept(State::Stopping, seconds).0, State::Stopped);
    }
    assert_eq!((slept(State::Armed, 3).0, slept(State::Armed, 301).0), (State::Armed, State::Parked));
    for state in [State::Boot, State::Recovering, State::Parked, State::Homing, State::Stopped, State::Fault]
    {
        assert_eq!(slept(state, 40_000).0, state);
    }
}

#[test]
fn a_pause_that_was_slept_through_begins_anew() {
    let mut hall = hall(State::Paused);
    hall.event(Event::Slept(Duration::from_secs(299)), s(299));
    hall.tick(s(400));
    assert_eq!((hall.state(), hall.next()), (State::Paused, Next::Resume));
}

#[test]
fn controllers_that_were_held_while_nothing_moved_are_cleared_once_that_is_over() {
    for state in [State::Parked, State::Recovering] {
        assert_eq!(why(state, Transition::Clear), Why::NothingToClear);
        let mut hall = told(state, Event::Latched(Latch::Held));
        assert_eq!(hall.request(Transition::Clear, s(2)).unwrap_err().why, Why::StillWrong);
        hall.event(Event::Latched(Latch::Over), s(2));
        assert_eq!(hall.next(), Next::Clear);
        hall.request(Transition::Clear, s(3)).unwrap();
        assert_eq!((hall.state(), hall.cause()), (State::Recovering, Cause::Cleared));
        assert!(!hall.is_measured() && hall.clears() > 0);
    }
}

#[test]
fn what_is_stopped_is_not_cleared_before_every_controller_has_told() {
    let mut hall = asked(State::Boot, Transition::Stop);
    assert_eq!(hall.request(Transition::Clear, s(2)).unwrap_err().why, Why::NotIdentified);
    hall.event(Event::Identified(PARKED), s(3));
    hall.request(Transition::Clear, s(4)).unwrap();
}

#[test]
fn a_hall_whose_unknown_seat_is_taken_out_knows_its_positions_again() {
    let mut hall = told(State::Recovering, Event::Rebooted(1));
    assert_eq!(hall.next(), Next::Home);
    hall.event(Event::ZerosKnown, s(2));
    hall.request(Transition::Park, s(3)).unwrap();
    let mut unknown = told(State::Boot, Event::ZerosKnown);
    assert!(!unknown.is_homed(), "nobody has told");
    unknown.event(Event::Identified(Finding { homed: false, ..PARKED }), s(2));
    assert!(!unknown.is_homed());
}

#[test]
fn a_seat_of_unknown_position_is_homed_and_not_parked() {
    let mut hall = told(State::Recovering, Event::Rebooted(1));
    assert_eq!(hall.request(Transition::Park, s(2)).unwrap_err().why, Why::PositionUnknown);
    assert_eq!(hall.next(), Next::Home);
    hall.request(Transition::Home, s(2)).unwrap();
    hall.event(Event::Homed, s(9));
    assert_eq!(hall.state(), State::Parked);
}

#[test]
fn a_fault_while_the_seats_move_decelerates_them_first() {
    for state in State::ALL.into_iter().filter(|state| state.may_send_motion() && *state != State::Stopping) {
        let mut hall = told(state, Event::Trouble(MASTER));
        assert_eq!((hall.state(), hall.fault()), (State::Stopping, Some(MASTER)), "from {state}");
        hall.event(Event::AtRest, s(2));
        assert_eq!((hall.state(), hall.cause()), (State::Fault, Cause::Trouble(MASTER)));
    }
    for state in [State::Boot, State::Recovering, State::Parked, State::Homing, State::Armed] {
        assert_eq!(told(state, Event::Trouble(Trouble::Planner)).state(), State::Fault, "from {state}");
    }
}

#[test]
fn stopped_goes_before_fault_and_keeps_it_known() {
    let mut hall = told(State::Playing(PlayMode::Following), Event::Trouble(MASTER));
    hall.request(Transition::Stop, s(2)).unwrap();
    hall.event(Event::AtRest, s(2));
    assert_eq!((hall.state(), hall.cause()), (State::Stopped, Cause::Asked(Transition::Stop)));
    assert_eq!(hall.fault(), Some(MASTER));
    hall.request(Transition::Clear, s(5)).unwrap();
    assert_eq!(hall.fault(), None);
    assert_eq!(asked(State::Fault, Transition::Stop).state(), State::Stopped);
}

#[test]
fn the_first_thing_that_went_wrong_is_the_one_named() {
    let mut hall = told(State::Parked, Event::Trouble(MASTER));
    hall.event(Event::Trouble(Trouble::Limiter), s(2));
    assert_eq!((hall.cause(), hall.since()), (Cause::Trouble(MASTER), s(1)));
}

#[test]
fn homing_and_parking_that_take_too_long_are_faults() {
    let mut homing = hall(State::Homing);
    homing.tick(s(900));
    assert_eq!((homing.state(), homing.cause()), (State::Fault, Cause::Trouble(Trouble::HomingTime)));
    let mut parking = hall(State::Parking);
    parking.tick(s(120));
    assert_eq!((parking.state(), parking.fault()), (State::Stopping, Some(Trouble::ParkingTime)));
}

#[test]
fn the_policy_of_the_hall_leads_down_a_show_that_runs_and_moves_nothing_out_of_a_pause() {
    for state in riding() {
        assert_eq!(told(state, Event::Policy(Demand::Pause, 0)).state(), State::Paused);
        assert_eq!(told(state, Event::Policy(Demand::Park, 0)).state(), State::Parking);
    }
    for state in State::ALL.into_iter().filter(|state| !matches!(state, State::Playing(_))) {
        for demand in [Demand::Pause, Demand::Park] {
            assert_eq!(told(state, Event::Policy(demand, 0)).state(), state);
        }
    }
}

#[test]
fn parking_an_armed_hall_only_disarms_it() {
    assert_eq!(asked(State::Armed, Transition::Park).state(), State::Parked);
}

#[test]
fn parking_a_parked_hall_brings_down_a_seat_that_is_up_and_reads_once_more_where_none_seems_to_be() {
    let mut hall = told(State::Parked, Event::Astray(true));
    assert_eq!((hall.state(), hall.next()), (State::Parked, Next::ParkOrStart), "nothing moves by itself");
    hall.request(Transition::Park, s(2)).unwrap();
    assert_eq!((hall.state(), hall.cause()), (State::Parking, Cause::Asked(Transition::Park)));
    hall.event(Event::Parked, s(5));
    hall.event(Event::Astray(false), s(5));
    assert_eq!((hall.state(), hall.next()), (State::Parked, Next::Arm));
    hall.request(Transition::Park, s(6)).unwrap();
    assert_eq!(hall.state(), State::Parking);
    hall.event(Event::Parked, s(7));
    assert_eq!((hall.state(), hall.next()), (State::Parked, Next::Arm));
}

#[test]
fn a_refusal_says_what_was_asked_in_which_state_why_not_and_what_to_do() {
    let mut hall = hall(State::Stopped);
    assert_eq!(
        hall.request(Transition::Arm, s(1)).unwrap_err().to_string(),
        "cannot arm while stopped: it is latched; clear it first"
    );
}

#[test]
fn every_state_says_what_comes_next() {
    let next = State::ALL.map(|state| hall(state).next().to_string());
    assert!(next.iter().all(|words| !words.is_empty()));
    assert_eq!(hall(State::Fault).next(), Next::CheckCue);
    assert_eq!(
        told(State::Parked, Event::Readiness(Readiness::NoCue)).next().to_string(),
        "load a cue, then arm"
    );
    assert_eq!(told(State::Armed, Event::Trouble(MASTER)).next(), Next::StopOtherMaster);
    assert_eq!(asked(State::Homing, Transition::Stop).next(), Next::AwaitStandstill);
}

#[test]
fn a_show_waits_while_its_film_cannot_be_followed_and_says_why_and_parks_when_it_is_over() {
    let waiting = |why| (State::Playing(PlayMode::Waiting), Cause::FilmAwaited(why));
    let absent = HoldCause::Film(FilmState::Absent);
    for from in riding() {
        let mut hall = told(from, Event::FilmAwaited(absent));
        assert_eq!(
            (hall.state(), hall.cause(), hall.next()),
            (waiting(absent).0, waiting(absent).1, Next::AwaitFilm)
        );
        hall.event(Event::FilmAwaited(HoldCause::Unstable), s(2));
        assert_eq!((hall.state(), hall.cause()), waiting(HoldCause::Unstable), "another cause is told");
        assert_eq!(hall.next(), Next::LetJoin, "nobody joins by themselves any more");
        hall.event(Event::FilmAwaited(HoldCause::Unstable), s(3));
        assert_eq!(hall.since(), s(2), "the same is not");
        hall.event(Event::FilmLeads, s(4));
        assert_eq!((hall.state(), hall.cause()), (State::Playing(PlayMode::Joining), Cause::FilmLeads));
        let over = told(from, Event::FilmOver(ParkCause::FilmEnded));
        assert_eq!((over.state(), over.cause()), (State::Parking, Cause::FilmOver(ParkCause::FilmEnded)));
    }
    let others = State::ALL.into_iter().filter(|state| !riding().contains(state));
    for from in others {
        for event in [Event::FilmLeads, Event::FilmAwaited(absent), Event::FilmOver(ParkCause::CueLeft)] {
            assert_eq!(told(from, event).state(), from, "a film moves nobody out of {from}");
        }
    }
}
