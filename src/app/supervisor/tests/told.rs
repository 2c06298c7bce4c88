//! What a person is told, and what nobody is alerted of.

use super::*;
use crate::control::{Coded, Severity};
use crate::health::Why;

/// The warnings of a hall whose controllers stand so.
fn warned(rig: &Rig, table: &[Row]) -> Vec<crate::control::Warning> {
    let Supervisor { hall, features, notes, ports, .. } = &rig.supervisor;
    let record = hall.recorder.status_at(hall.now);
    let parts = StatusParts { hall, features, record: &record, began: ports.began };
    parts.warnings(table, notes, None)
}

#[test]
fn seats_that_home_and_those_that_have_just_come_home_are_nobodys_error() {
    let mut rig = Rig::parked();
    let now = rig.supervisor.hall.now;
    let table = [HealthState::Excluded, HealthState::Lost].map(|standing| Row {
        standing,
        why: Why::NotSeenYet,
        ..row(now)
    });
    let wrong = |rig: &Rig| -> Vec<_> {
        let errors = warned(rig, &table).into_iter().filter(|one| one.severity == Severity::Error);
        errors.map(|one| one.id).collect()
    };
    rig.supervisor.hall.mirror.since = MonoTime::default();
    assert_eq!(wrong(&rig), ["controller-excluded", "controller-lost", "no-seat"], "parked is nobody");
    rig.supervisor.hall.mirror.state = State::Homing;
    assert_eq!(wrong(&rig), ["controller-excluded"], "which goes once it is home");
    for state in [State::Boot, State::Recovering, State::Stopping, State::Stopped, State::Fault] {
        rig.supervisor.hall.mirror.state = state;
        assert_eq!(wrong(&rig), ["controller-excluded", "controller-lost"], "{state} says nothing of seats");
    }
}

#[test]
fn a_fault_of_one_controller_of_a_rigid_seat_is_told_of_the_others_by_its_name() {
    let rig = Rig::parked();
    let now = rig.supervisor.hall.now;
    let why = Why::Killed { controller: 0, axis: 2, cause: 0x0100 };
    let table = [0, 1].map(|_| Row { standing: HealthState::Error, why, ..row(now) });
    let texts: Vec<_> = warned(&rig, &table).into_iter().filter(|one| one.controller.is_some()).collect();
    let text = "the drive of its axis 2 was killed by moving error (register 211)";
    assert_eq!(texts[0].text, format!("error: {text}"));
    assert_eq!(texts[1].text, format!("error: A1: {text}"));
    let coded = texts[1].coded.clone().unwrap();
    assert_eq!(coded, Coded::new("beside", ["A1".to_owned()]));
}

#[test]
fn what_is_said_of_a_configuration_that_was_not_taken_is_over_once_another_one_is() {
    let mut carryover = Rig::parked().supervisor.remember();
    carryover.refuse("no port");
    let mut rig = Rig::starting(carryover);
    let says = |rig: &Rig| {
        rig.supervisor.notes.iter().filter(|note| note.contains("has the old one: no port")).count()
    };
    assert_eq!(says(&rig), 1);
    let mut carryover = rig.supervisor.remember();
    carryover.forget_refusals();
    rig = Rig::starting(carryover);
    assert_eq!(says(&rig), 0);
}

#[test]
fn parked_is_not_said_of_a_seat_that_stands_up_and_what_is_next_brings_it_down() {
    let mut rig = Rig::parked();
    let now = rig.supervisor.hall.now;
    rig.supervisor.hall.mirror.since = MonoTime::default();
    let stands = |pulses: i32| {
        let mut row = row(now);
        row.state.measured = Some(Heard { value: PerAxis::new(&[Pulses(pulses); 3]), at: now });
        row
    };
    let said = |rig: &Rig, table: &[Row]| {
        let Supervisor { hall, features, ports, .. } = &rig.supervisor;
        let record = hall.recorder.status_at(hall.now);
        let status = StatusParts { hall, features, record: &record, began: ports.began };
        let warnings = warned(rig, table).into_iter().filter(|one| one.id == "not-at-park");
        let warnings: Vec<_> =
            warnings.map(|one| (one.controller.unwrap(), one.remedy_code.unwrap())).collect();
        (status.status(table, Vec::new()).next_coded.code, warnings)
    };
    let home = said(&rig, &[stands(0), stands(0)]);
    assert_eq!(home.1, []);
    let up = said(&rig, &[stands(0), stands(180_000)]);
    assert_eq!(up, ("park-first".to_owned(), vec![("B1".to_owned(), "park-it".to_owned())]));
    rig.ask(out("B1")).unwrap();
    let out = said(&rig, &[stands(0), stands(180_000)]);
    assert_eq!(
        out,
        ("enable-first".to_owned(), vec![("B1".to_owned(), "enable-it".to_owned())]),
        "whoever sits there sits high"
    );
    rig.supervisor.hall.mirror.state = State::Playing(PlayMode::Following);
    assert_eq!(said(&rig, &[stands(0), stands(180_000)]).1, []);
}
