//! Seats on serial links: one that passes, spoilt in one way after the other.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::super::{Check, DriveSubject, LinkSurvey, judge_driven};
use crate::config::{self, Acceptance, Config, Connection, Link};
use crate::drive::link::TalkCounts;
use crate::drive::rates::LinkLoad;
use crate::drive::silvermax::{TalkFault, UnitFacts};
use crate::drive::sixpack2::{self, MotorFacts};
use crate::drive::{motors_of, units_of};
use crate::sys::serial::{CanError, SerialError};
use crate::wire::silvermax::{Internal, Io, Poll, StatusWord as _};
use crate::wire::sixpack2::action;

const COUNTS: TalkCounts = TalkCounts {
    asked: 51,
    answered: 51,
    late: 0,
    doubled: 0,
    malformed: 0,
    foreign: 0,
    echo_differs: 0,
    echoed: 0,
};

/// A seat that was homed, on units 16 to 18.
struct Case {
    hall: Config,
    survey: LinkSurvey,
}

impl Case {
    fn new() -> Self {
        let hall = config::load(Path::new("tests/data/config/drives.toml")).unwrap();
        let controller = &hall.controllers[0];
        let of = units_of(controller).expect("the first is one");
        let facts = of.settings().unwrap().into_iter().map(|set| UnitFacts {
            unit: set.unit,
            revision: None,
            poll: Poll(0),
            internal: Internal(Io::COOL),
            io: Io(Io::COOL),
            kill_cause: 0,
            canary: of.own_canary(),
            position: 0,
            target: 0,
            torque: [set.torque; 2],
            error_limits: set.error_limits,
            dry_brake: set.dry_brake,
            soft_limits: set.soft_limits,
        });
        let units = facts.map(|facts| (facts.unit, Ok(facts))).collect();
        Self {
            survey: LinkSurvey {
                delay: Some(Duration::from_micros(300)),
                counts: COUNTS,
                units,
                ..LinkSurvey::default()
            },
            hall,
        }
    }

    /// The same with something else about unit 17.
    fn with(mut self, change: impl FnOnce(&mut UnitFacts)) -> Self {
        change(self.survey.units.get_mut(&17).unwrap().as_mut().unwrap());
        self
    }

    fn all(mut self, change: impl Fn(&mut UnitFacts)) -> Self {
        self.survey.units.values_mut().for_each(|facts| change(facts.as_mut().unwrap()));
        self
    }

    fn link(&self) -> &Link {
        let name = &self.hall.controllers[0].drives().unwrap().link;
        self.hall.links.iter().find(|link| link.name == *name).unwrap()
    }

    fn found(&self) -> Vec<(Check, String)> {
        let link = self.link();
        let load = LinkLoad::of(link, &self.hall);
        let subject =
            DriveSubject { controller: &self.hall.controllers[0], link, load, survey: &self.survey };
        let found = judge_driven(&[subject], &self.hall.show.accept_findings).remove(0);
        found
            .into_iter()
            .inspect(|one| assert!(!one.remedy.is_empty() && !one.remedy.contains(", or no "), "{one:?}"))
            .map(|one| (one.check, one.found))
            .collect()
    }

    /// Holds that just this is found, in these words.
    fn assert_found(&self, check: Check, words: &str) {
        let found = self.found();
        let [(met, said)] = &found[..] else { panic!("{check}: {found:?}") };
        assert!(*met == check && said.contains(words), "{check}: {found:?}");
    }
}

#[test]
fn a_seat_that_was_homed_passes() {
    assert_eq!(Case::new().found(), []);
}

#[test]
fn each_trouble_of_a_unit_is_told_by_its_number() {
    let kill = |facts: &mut UnitFacts| {
        (facts.poll, facts.kill_cause) = (Poll(Poll::KILLED), i32::from(Io::MOVING_ERROR) << 16);
        facts.internal = Internal(Io::COOL | Io::MOVING_ERROR);
    };
    Case::new().with(kill).assert_found(Check::Killed, "unit 17 was killed by moving error");
    let status = |word: u16| Case::new().with(|facts| facts.internal = Internal(word));
    status(0).assert_found(Check::DriveHot, "unit 17 is too hot");
    status(Io::COOL | Io::HOLDING_ERROR).assert_found(Check::DriveError, "unit 17 has had a holding error");
    status(Io::COOL | 1 << 13).assert_found(Check::Supply, "unit 17 has had high voltage");
    status(Io::COOL | 1 << 14).assert_found(Check::Supply, "unit 17 has had low voltage");
}

#[test]
fn a_seat_that_is_not_home_and_one_of_whose_units_one_was_off_are_told_apart_and_cannot_be_accepted() {
    let mut off = Case::new().all(|facts| (facts.canary, facts.soft_limits) = (0, [0, 0]));
    off.assert_found(Check::NotHome, "units 16, 17, 18 were not homed");
    Case::new().with(|facts| facts.canary = 0).assert_found(Check::Restarted, "units 17 were switched off");
    Case::new().with(|facts| facts.canary += 1 << 16).assert_found(Check::Restarted, "at different times");
    off.hall.show.accept_findings = vec![Acceptance { check: Check::NotHome, why: "so".to_owned() }];
    assert_eq!(off.found().len(), 1);
    assert!(!Check::NotHome.can_be_accepted() && Check::SoftLimits.can_be_accepted());
}

#[test]
fn a_line_that_leads_to_a_seat_with_the_same_numbers_is_told_with_its_name() {
    let mut case = Case::new();
    let mut other = case.hall.controllers[0].clone();
    other.name = "B1".to_owned();
    let canary = units_of(&other).unwrap().own_canary();
    case = case.all(|facts| facts.canary = canary);
    case.assert_found(Check::NotHome, "homed with other settings, or by another name, than it has now");
    let Connection::Link(drives) = &mut case.hall.controllers[0].connection else { panic!("it is on one") };
    drives.twins = vec!["C1".to_owned(), "B1".to_owned()];
    case.assert_found(Check::NotHome, "its drives were homed as B1: adapters or plugs have changed places");
}

#[test]
fn registers_that_homing_wrote_and_that_differ_are_told_with_both_values() {
    Case::new().with(|facts| facts.soft_limits[1] += 1).assert_found(
        Check::SoftLimits,
        "unit 17: registers 38 and 39 hold -120800 and 801, homing writes -120800 and 800",
    );
    Case::new().with(|facts| facts.error_limits += 1).assert_found(Check::ErrorLimits, "register 208 holds");
    Case::new()
        .with(|facts| facts.torque[1] = 1)
        .assert_found(Check::DriveTorque, "registers 206 and 207 hold");
    Case::new()
        .with(|facts| facts.dry_brake = 5)
        .assert_found(Check::BrakeRate, "register 19 holds 5, homing");
}

#[test]
fn who_does_not_answer_and_who_answers_for_another_is_told() {
    let mut case = Case::new();
    case.survey.units.insert(17, Err(TalkFault::Silent { unit: 17 }));
    case.assert_found(Check::NoAnswer, "unit 17 does not answer");
    case.survey.units.insert(17, Err(TalkFault::Foreign { unit: 17, by: 18 }));
    case.assert_found(Check::DuplicateUnit, "unit 18 answered a request to unit 17");
    let mut case = Case::new();
    case.survey.counts.doubled = 3;
    case.assert_found(Check::DuplicateUnit, "3 more answers than requests");
}

#[test]
fn an_adapter_that_repeats_what_is_sent_has_to_be_known_for_it() {
    let mut case = Case::new();
    (case.survey.counts.malformed, case.survey.counts.echoed) = (51, 51);
    case.assert_found(Check::EchoDiffers, "51 of 51 requests came back besides 51 answers");
    let mut case = Case::new();
    case.hall.links.iter_mut().for_each(|link| link.has_echo = true);
    assert_eq!(case.found(), []);
    case.survey.counts.echo_differs = 40;
    case.assert_found(Check::EchoDiffers, "40 of 51 requests were not echoed");
}

#[test]
fn noise_is_told_as_noise_and_not_as_an_echo_or_as_two_units_with_one_number() {
    let mut case = Case::new();
    case.survey.counts.malformed = 2;
    assert_eq!(case.found(), [], "a chance");
    case.survey.counts.malformed = 60;
    case.assert_found(Check::LineNoise, "what nobody sent came 60 times while 51 requests were sent");
}

#[test]
fn a_seat_that_does_not_stand_at_park_is_told_with_where_it_stands_and_where_it_is_held() {
    let at = |position: i32, target: i32| {
        Case::new().with(move |facts| (facts.position, facts.target) = (position, target))
    };
    // The second axis counts downwards, 800 a millimetre.
    assert_eq!(at(-160, 0).found(), [], "a loaded motor");
    at(-33_040, -33_040).assert_found(Check::OffPark, "axis 2 stands at 41.3 mm, its park place is 0.0 mm");
    at(-640, 0).assert_found(
        Check::OffPark,
        "stands at 0.8 mm, its park place is 0.0 mm, and its drive holds it at 0.0 mm",
    );
    let not_home = at(-640, 0).all(|facts| facts.canary = 0).found();
    assert!(not_home.iter().all(|(check, _)| *check != Check::OffPark), "{not_home:?}");
}

#[test]
fn late_answers_are_told_with_the_rate_that_they_leave() {
    let late = |us| {
        let mut case = Case::new();
        case.survey.delay = Some(Duration::from_micros(us));
        case
    };
    assert_eq!(late(310).found(), []);
    late(2_000)
        .assert_found(Check::SlowReplies, "take 2.0 ms instead of the assumed 0.3 ms: 29.98 Hz become 25.");
    let found = late(16_000).found();
    let checks: Vec<_> = found.iter().map(|(check, _)| *check).collect();
    assert_eq!(checks, [Check::LinkTooSlow, Check::AdapterSlow], "{found:?}");
    let mut asked = Case::new();
    asked.hall.links.iter_mut().for_each(|link| link.rate_hz = Some(50.0));
    asked.assert_found(Check::LinkTooSlow, "3 axes play at 29.98 Hz at 57600 baud, not at 50");
}

#[test]
fn a_port_that_cannot_be_had_is_told_by_what_is_wrong_with_it() {
    let port = || PathBuf::from("/dev/ttyUSB0");
    for (error, check, words) in [
        (SerialError::Missing(port()), Check::PortMissing, "there is no such port"),
        (SerialError::Taken(port()), Check::PortTaken, "another program has it"),
        (SerialError::Forbidden(port()), Check::PortForbidden, "not allowed to open it"),
        (SerialError::NoLine(port()), Check::PortUnfit, "it is not a serial line"),
        (CanError::Missing(port()).into(), Check::PortMissing, "there is no such interface"),
        (CanError::Taken(port()).into(), Check::PortTaken, "another kinocue has it"),
        (CanError::Off(port()).into(), Check::PortUnfit, "its controller has left the bus"),
    ] {
        let mut case = Case::new();
        case.survey = LinkSurvey::silent(error);
        case.assert_found(check, words);
    }
}

/// A seat that was homed, on a SIXpack 2.
fn sixpack() -> Case {
    let mut case = Case::new();
    case.hall.controllers.swap(0, 1);
    let load = LinkLoad::of(case.link(), &case.hall).unwrap();
    let period = load.period_for(case.link().rate_hz).unwrap();
    let counters = motors_of(&case.hall.controllers[0], period).unwrap().at_low();
    let motors: Vec<_> = (0..3)
        .zip(counters)
        .map(|(motor, position)| MotorFacts { motor, position, action: action::PI, was_stopped: false })
        .collect();
    let facts = sixpack2::UnitFacts {
        unit: 1,
        firmware: 0x94,
        was_reset: false,
        celsius: 30,
        serial: 1_001,
        volts: 24.0,
        motors,
    };
    case.survey.units.clear();
    case.survey.sixpacks.insert(1, Ok(Some(facts)));
    case
}

#[test]
fn a_sixpack_is_home_where_each_of_its_motors_counts_a_place_of_the_seat() {
    assert_eq!(sixpack().found(), []);
    let with = |change: fn(&mut sixpack2::UnitFacts)| {
        let mut case = sixpack();
        let facts = case.survey.sixpacks.get_mut(&1).unwrap();
        change(facts.as_mut().unwrap().as_mut().unwrap());
        case
    };
    with(|unit| unit.was_reset = true).assert_found(Check::NotHome, "unit 1 was reset since");
    with(|unit| unit.motors[1].position = 0)
        .assert_found(Check::NotHome, "motors 1 of unit 1 count no position");
    with(|unit| unit.motors[2].action = action::SEARCH)
        .assert_found(Check::DriveError, "motor 2 of unit 1 searches for its zero");
    let mut woke = sixpack();
    woke.survey.sixpacks.insert(1, Ok(None));
    woke.assert_found(Check::NotHome, "unit 1 has its power-on settings");
    let silent = sixpack2::TalkFault::Silent { unit: 1, baud: 56_818 };
    woke.survey.sixpacks.insert(1, Err(silent));
    woke.assert_found(Check::NoAnswer, "unit 1 does not answer at 56818 baud");
    woke.survey.sixpacks.clear();
    woke.assert_found(Check::NoAnswer, "unit 1 was not read");
}
