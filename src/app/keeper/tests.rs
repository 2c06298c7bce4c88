//! What must not happen when things come at the same time.

use std::sync::atomic::Ordering;
use std::sync::mpsc::channel;

use super::errand::Done;
use super::testing::Rig;
use super::*;
use crate::engine::Unplanned;
use crate::hall::{Ask, Code, Role, Surface, Who};
use crate::rt::News;
use crate::settings::Out;
use crate::state::{Event, Next, Trouble};
use crate::time::ShowTime;

const ARM: Ask = Ask::Arm { seats_empty: false };

fn anna() -> Who {
    Who { role: Role::Engineer, surface: Surface::Socket, name: "anna".to_owned() }
}

fn out(name: &str) -> Ask {
    Ask::Disable { name: name.to_owned(), why: None }
}

#[test]
fn an_answer_that_came_too_late_is_not_taken_for_that_of_the_next_command() {
    let mut known = Known::new(MonoTime::default());
    known.expect();
    known.expect();
    known.hear(News::NotLoaded(State::Paused));
    assert!(known.take_answer().is_none());
    known.hear(News::Taken);
    assert_eq!(known.take_answer(), Some(Ok(())));
}

#[test]
fn a_hall_that_was_latched_is_so_with_another_configuration_too() {
    let mut before = Rig::parked();
    before.ask(Ask::Stop).unwrap();
    let memory = before.keeper.remember();
    let mut rig = Rig::starting(memory);
    rig.wait_until(|keeper| keeper.known.state == State::Stopped);
    assert!(
        rig.keeper.notes.iter().any(|note| note.contains("stopped by the operator")),
        "{:?}",
        rig.keeper.notes
    );
    let parked = Rig::starting(Rig::parked().keeper.remember());
    assert_eq!(parked.state(), State::Boot);
}

#[test]
fn a_seat_that_is_out_is_out_from_the_first_tick_of_the_next_hall_on() {
    let mut before = Rig::parked();
    before.ask(out("B1")).unwrap();
    let rig = Rig::starting(before.keeper.remember());
    assert_eq!([0, 1].map(|lane| rig.keeper.reins.desk.mix(lane).on), [true, false]);
}

#[test]
fn a_configuration_is_read_anew_once_nobody_speaks_with_the_controllers_any_more() {
    let mut rig = Rig::parked();
    let (go_on, held) = channel::<()>();
    rig.keeper.send("preflight", None, move || {
        let _ = held.recv();
        Done::Listed(Err(Problem::new(Code::Check, "no list", "none")))
    });
    assert_eq!(rig.ask(Ask::Reload).unwrap_err().code, Code::Busy);
    rig.keeper.ends.signals.reload.store(true, Ordering::Release);
    rig.keeper.look_after();
    assert!(!rig.keeper.reins.leave.load(Ordering::Acquire), "the port is in use");
    drop(go_on);
    rig.wait_until(|keeper| keeper.reins.leave.load(Ordering::Acquire));
    assert!(rig.keeper.reload.is_some());
}

#[test]
fn nothing_long_begins_in_a_hall_that_closes() {
    let mut rig = Rig::parked();
    rig.keeper.reins.leave.store(true, Ordering::Release);
    for ask in [Ask::Preflight, Ask::Home, Ask::Load { cue: "two".to_owned() }] {
        assert_eq!(rig.ask(ask).unwrap_err().code, Code::Busy);
    }
}

#[test]
fn a_clear_that_was_asked_before_a_stop_clears_it_not() {
    let mut rig = Rig::parked();
    rig.tell(Event::Trouble(Trouble::Gate));
    let clear = rig.post(Ask::Clear);
    rig.keeper.reins.desk.stop();
    rig.hear_of(State::Stopped);
    rig.hear();
    assert_eq!(clear.join().unwrap().unwrap_err().code, Code::Late);
    assert_eq!(rig.state(), State::Stopped);
    rig.ask(Ask::Clear).unwrap();
}

#[test]
fn arming_homes_no_seat_unless_somebody_says_that_they_are_empty() {
    let mut rig = Rig::parked();
    rig.tell(Event::Rebooted(1));
    assert!(rig.keeper.status().arm_homes);
    assert!(rig.ask(ARM).unwrap_err().detail.contains("home first"));
    assert_eq!(rig.state(), State::Parked);
    rig.ask(Ask::Arm { seats_empty: true }).unwrap();
    assert_eq!(rig.state(), State::Homing);
}

#[test]
fn what_cannot_be_set_is_not_set_on_the_desk_either() {
    let mut rig = Rig::playing();
    // As where the keeper has not heard yet that the seats move.
    rig.keeper.known.state = State::Parked;
    let problem = rig.keeper.set(|board| {
        board.enable("B1", Some(Out::now(&anna(), None)));
        Ok(())
    });
    assert_eq!(problem.unwrap_err().code, Code::State);
    assert!(rig.keeper.board.is_on(1) && rig.keeper.reins.desk.mix(1).on);
}

#[test]
fn a_seat_whose_preflight_has_not_passed_does_not_join_a_show() {
    let mut rig = Rig::parked();
    rig.ask(out("B1")).unwrap();
    rig.keeper.preflighted = Some(ready::Preflighted::failing_at(1, 2));
    rig.ask(ARM).unwrap();
    rig.ask(Ask::Go).unwrap();
    assert_eq!(rig.ask(Ask::Enable("B1".to_owned())).unwrap_err().code, Code::State);
    assert!(!rig.keeper.reins.desk.mix(1).on);
    rig.ask(out("A1")).unwrap();
    rig.ask(Ask::Enable("A1".to_owned())).unwrap();
    assert!(rig.keeper.reins.desk.mix(0).on);
}

#[test]
fn an_armed_hall_is_not_asked_for_registers() {
    let mut rig = Rig::armed();
    assert_eq!(rig.ask(Ask::Preflight).unwrap_err().code, Code::State);
    assert_eq!((rig.state(), rig.keeper.known.next), (State::Armed, Next::Go));
}

#[test]
fn a_park_between_shows_leaves_the_next_show_where_it_is_to_begin() {
    let mut rig = Rig::parked();
    let start = ShowTime::from_millis(2_000);
    rig.ask(Ask::Seek(start)).unwrap();
    rig.tell(Event::Astray(true));
    rig.ask(Ask::Park).unwrap();
    assert_eq!(rig.state(), State::Parking);
    rig.tell(Event::Parked);
    assert_eq!((rig.state(), rig.keeper.cued.as_ref().map(|cued| cued.start)), (State::Parked, Some(start)));
}

#[test]
fn a_move_that_was_not_found_is_a_warning_with_the_name_of_the_seat_and_what_to_do() {
    let mut rig = Rig::playing();
    rig.keeper.hear(News::Unplanned(Unplanned::Lane(1)));
    let warnings = rig.keeper.status().warnings;
    let told =
        warnings.iter().find(|one| one.text.starts_with("B1: it stays where it is")).expect("it is told");
    assert!(told.text.ends_with("seek elsewhere in the cue, or park"), "{}", told.text);
}

#[test]
fn a_test_that_is_made_while_the_hall_is_disarmed_is_forgotten() {
    for held_by in [Ask::Disarm, Ask::Stop, Ask::Go] {
        let mut rig = Rig::armed();
        let test = rig.post(Ask::Test { rows: vec!["A".to_owned()] });
        rig.hear();
        let other = rig.post(held_by.clone());
        rig.hear();
        rig.settle();
        rig.wait_until(|_| test.is_finished() && other.is_finished());
        assert_eq!(test.join().unwrap().unwrap_err().code, Code::State);
        let cued = rig.keeper.cued.as_ref().map(|cued| cued.id.clone());
        assert_eq!((cued.as_deref(), rig.keeper.sweep.is_none()), (Some("one"), true), "{held_by:?}");
        assert!(rig.keeper.reins.desk.mix(1).on, "the other row is as it was");
    }
}

#[test]
fn a_homing_that_is_stopped_tells_no_further_seat_to_home() {
    let mut rig = Rig::parked();
    rig.post(Ask::Home);
    rig.hear();
    rig.keeper.take_news();
    let Some(homing::Homing::UnderWay(called_off)) = &rig.keeper.homing else { panic!("it homes") };
    let called_off = Arc::clone(called_off);
    assert!(!called_off.load(Ordering::Acquire));
    rig.ask(Ask::Stop).unwrap();
    assert!(called_off.load(Ordering::Acquire));
    assert_eq!(rig.state(), State::Stopped);
    assert!(rig.keeper.homing.is_none());
}
