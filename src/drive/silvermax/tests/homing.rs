//! How seats find their zero.

use std::collections::BTreeSet;
use std::time::Duration;

use super::bench::*;
use crate::config::drive::SeatDrive;
use crate::config::drive::homing::{HomeWay, Side};
use crate::drive::link::{HomedAs, LinkFault, LinkPort, LinkTalk as _, Step, TalkTerms};
use crate::drive::silvermax::*;
use crate::drive::sixpack2;
use crate::motion::SeatType;
use crate::sim::serial::{LineFaults, SerialLine};
use crate::sim::silvermax::{Action, SilverBus, Unit, UnitSetup};
use crate::time::MonoTime;

fn three() -> Vec<UnitSetup> {
    [(16, 63_200), (17, 400), (18, 120_000)]
        .map(|(unit, place)| UnitSetup { place, ..UnitSetup::new(unit) })
        .into()
}

fn act(talk: &mut Talk<VirtualPort>, action: Action) {
    let now = talk.now();
    talk.port().line.bus_mut().act(None, action, now);
}

#[test]
fn a_seat_is_homed_by_the_edge_of_its_switch_to_a_count_and_stands_at_park() {
    let mut talk = talk_to(&three());
    let (homed, steps) = home_as(&mut talk, &drive(SWITCH), &[16, 17, 18]);
    assert_eq!(homed, Ok(()));
    assert!(steps.contains(&Step::OffSwitch(1)) && !steps.contains(&Step::OffSwitch(0)), "{steps:?}");
    for index in 0..3 {
        let (place, position) = (unit(&mut talk, index).place(), unit(&mut talk, index).position());
        // The edge is at 1,600 counts from the stop and -2 mm: 0 mm are at 3,200.
        assert!((place - ZERO).abs() <= 1.0 && position == 0, "{index}: {place} {position}");
        let (executed, tally) = (unit(&mut talk, index).executed().clone(), unit(&mut talk, index).tally());
        assert_eq!((executed.jumps, tally.forbidden, tally.kills), (0, 0, 0));
        let facts = look(&mut talk, 16 + index as u8).unwrap();
        assert_eq!(
            (facts.canary >> 17, facts.position),
            (CANARY >> 17, 0),
            "its upper half is the number given"
        );
        assert_eq!(facts.soft_limits, [-800, 120_800]);
        assert_eq!((facts.torque, facts.dry_brake), ([12_000 << 16 | 20_000; 2], 2_319_282));
    }
}

#[test]
fn a_seat_whose_settings_were_edited_after_it_was_homed_is_not_home() {
    let (homed, silvermax) = (drive(SWITCH), drive(SWITCH).silvermax.unwrap());
    let of = |drive: &SeatDrive, seat: &SeatType| {
        let silvermax = drive.silvermax.clone().unwrap_or(silvermax.clone());
        SeatUnits { name: "A1", twins: &[], seat, drive, silvermax: &silvermax, units: &[16, 17, 18] }
            .own_canary()
    };
    let edits: [fn(&mut SeatDrive); 6] = [
        |drive| drive.reverse[1] = true,
        |drive| drive.homing.zero_mm = -12.0,
        |drive| drive.homing.toward = Side::Up,
        |drive| drive.margin_mm = 2.0,
        |drive| drive.silvermax.as_mut().unwrap().max_error_mm = 4.0,
        |drive| drive.silvermax.as_mut().unwrap().torque.hold = 0.5,
    ];
    let all: BTreeSet<i32> = edits
        .into_iter()
        .map(|edit| {
            let mut edited = homed.clone();
            edit(&mut edited);
            of(&edited, &seat())
        })
        .chain([of(&homed, &seat()), of(&homed, &seat().with_each(|axis| axis.lead = 4.0))])
        .collect();
    assert_eq!(all.len(), 8, "each has a number of its own");
    // Who plays with one of them says so.
    let mut play = Play::with_ppm([0; 3]);
    let mut edited = drive(SWITCH);
    edited.homing.zero_mm = -12.0;
    let (seat, silvermax) = (seat(), edited.silvermax.clone().unwrap());
    let seat = SeatUnits {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &edited,
        silvermax: &silvermax,
        units: &[16, 17, 18],
    };
    let facts = look(&mut play.stream.talk, 16).unwrap();
    assert!(facts.canary != 0 && !seat.is_own(facts.canary));
}

#[test]
fn a_seat_is_homed_again_from_anywhere_although_its_soft_limits_lie_before_the_switch() {
    let mut talk = talk_to(&three());
    assert_eq!(home_as(&mut talk, &drive(SWITCH), &[16, 17, 18]).0, Ok(()));
    let again = home_as(&mut talk, &drive(SWITCH), &[16, 17, 18]).0;
    assert_eq!(again, Ok(()));
    assert!((unit(&mut talk, 2).place() - ZERO).abs() <= 1.0);
}

#[test]
fn a_search_runs_past_its_switch_by_no_more_than_there_is_room_for_however_fast_it_is() {
    let mut drive = drive(SWITCH);
    for speed_mm_s in [10.0, 40.0] {
        drive.homing.speed_mm_s = speed_mm_s;
        let mut talk = talk_to(&three()[..1]);
        assert_eq!(home_as(&mut talk, &drive, &[16]).0, Ok(()));
        let lowest = unit(&mut talk, 0).executed().lowest;
        // The edge is at 1,600 counts, and half a tick and more goes by until the unit has seen it.
        assert!(lowest >= 1_600.0 - 0.6 * MM, "{speed_mm_s} mm/s: {lowest}");
    }
}

#[test]
fn a_reversed_axis_finds_the_same_edge() {
    let mut drive = drive(SWITCH);
    drive.reverse[0] = true;
    // The virtual axis has its switch where its counts are low: up, for a reversed one.
    drive.homing.toward = Side::Up;
    drive.homing.zero_mm = 152.0;
    let mut talk = talk_to(&[UnitSetup::new(16)]);
    assert_eq!(home_as(&mut talk, &drive, &[16]).0, Ok(()));
    // 152 mm at the edge, and 0 mm as far above it.
    let place = unit(&mut talk, 0).place();
    assert!((place - (1_600.0 + 152.0 * MM)).abs() <= 1.0, "{place}");
}

#[test]
fn a_switch_that_is_not_there_is_told_in_words_and_the_seat_is_not_home() {
    let mut talk = talk_to(&[UnitSetup { switch: None, ..UnitSetup::new(16) }]);
    act(&mut talk, Action::Input { input: 1, is_high: false });
    let mut drive = drive(SWITCH);
    drive.homing.travel_mm = 60.0;
    let (homed, _) = home_as(&mut talk, &drive, &[16]);
    let words = homed.unwrap_err().to_string();
    assert_eq!(
        words,
        "unit 16: the switch on input 1 not found within 60 mm; check it, its wiring, and `toward`"
    );
    assert_eq!(look(&mut talk, 16).unwrap().canary, 0);
    let lowest = unit(&mut talk, 0).executed().lowest;
    assert!((63_200.0 - lowest - 60.0 * MM).abs() <= 1.0, "never farther than the travel: {lowest}");
}

#[test]
fn a_switch_that_stays_on_is_told() {
    let mut talk = talk_to(&[UnitSetup { switch: None, ..UnitSetup::new(16) }]);
    let words = home_as(&mut talk, &drive(SWITCH), &[16]).0.unwrap_err().to_string();
    assert!(words.starts_with("unit 16: input 1 is still on after moving 10 mm away"), "{words}");
}

#[test]
fn a_hard_stop_is_found_by_the_error_and_a_person_says_here() {
    let mut stop = drive(HomeWay::HardStop);
    stop.homing.zero_mm = -4.0;
    let mut talk = talk_to(&[UnitSetup { switch: None, ..UnitSetup::new(16) }]);
    assert_eq!(home_as(&mut talk, &stop, &[16]).0, Ok(()));
    assert!((unit(&mut talk, 0).place() - ZERO).abs() <= 2.0, "{}", unit(&mut talk, 0).place());
    let mut here = drive(HomeWay::Here);
    here.homing.zero_mm = 75.0;
    let mut talk = talk_to(&[UnitSetup { switch: None, ..UnitSetup::new(16) }]);
    assert_eq!(home_as(&mut talk, &here, &[16]).0, Ok(()));
    assert!((unit(&mut talk, 0).place() - (63_200.0 - 75.0 * MM)).abs() <= 1.0);
}

#[test]
fn an_axis_that_something_holds_up_while_it_looks_for_its_zero_is_let_go_and_never_makes_up_for_it() {
    let index = HomeWay::Index { input: Some(1), active_high: true };
    for (way, held_ms) in [(SWITCH, 200), (SWITCH, 1_000), (SWITCH, 3_000), (index, 1_000)] {
        let mut talk = talk_to(&[UnitSetup::new(16)]);
        let of = |way| {
            let mut of = drive(way);
            // A virtual index lasts for one count, which a fast axis passes between two ticks.
            of.homing.speed_mm_s = if way == SWITCH { 40.0 } else { 10.0 };
            of
        };
        let then = talk.now() + Duration::from_millis(900);
        talk.port().script = Some((then, |line, now| line.bus_mut().act(None, Action::Blocked(true), now)));
        let homed = home_as(&mut talk, &of(way), &[16]).0;
        let words = homed.unwrap_err().to_string();
        assert!(words.contains("moving error"), "{words}");
        let until = then + Duration::from_millis(held_ms);
        talk.port().sleep_until(until);
        talk.port().line.bus_mut().units_mut().iter_mut().for_each(Unit::forget_executed);
        act(&mut talk, Action::Blocked(false));
        let until = talk.now() + Duration::from_secs(3);
        talk.port().sleep_until(until);
        assert_eq!(unit(&mut talk, 0).executed().velocity, 0.0, "{way:?} {held_ms}");
        assert_eq!(home_as(&mut talk, &of(way), &[16]).0, Ok(()), "once it is free it is homed as ever");
        assert!(unit(&mut talk, 0).executed().velocity < 45.0 * MM, "{way:?} {held_ms}");
    }
}

#[test]
fn the_index_is_looked_for_behind_the_edge() {
    let mut drive = drive(HomeWay::Index { input: Some(1), active_high: true });
    drive.homing.zero_mm = -0.5;
    let mut talk = talk_to(&[UnitSetup::new(16)]);
    assert_eq!(home_as(&mut talk, &drive, &[16]).0, Ok(()));
    // The virtual index is where it counts whole turns from where it was switched on: 63,200 - 15 x 4,000.
    let index = unit(&mut talk, 0).place() - 0.5 * MM;
    assert!((index - 3_200.0).abs() <= 1.0, "{index}");
}

#[test]
fn a_seat_is_not_homed_over_a_line_that_leads_to_another_one_until_its_units_were_off() {
    let mut talk = talk_to(&three());
    let (seat, drive, twins) = (seat(), drive(SWITCH), ["A1".to_owned(), "B1".to_owned()]);
    let silvermax = drive.silvermax.clone().unwrap();
    let (units, seat, drive, silvermax) = (&[16, 17, 18][..], &seat, &drive, &silvermax);
    let home_as = |talk: &mut Talk<VirtualPort>, name| {
        let around = Homing { canary: CANARY, goes_on: &|| true, told: &mut |_| {} };
        home(talk, SeatUnits { name, twins: &twins, seat, drive, silvermax, units }, around)
    };
    let canary = home_as(&mut talk, "B1").unwrap();
    talk.port().line.bus_mut().units_mut().iter_mut().for_each(Unit::forget_executed);
    let refused = home_as(&mut talk, "A1").unwrap_err();
    assert_eq!(refused, HomeError::Another(HomedAs("B1".to_owned())));
    assert_eq!(look(&mut talk, 17).unwrap().canary, canary, "it is home as it was");
    assert_eq!(unit(&mut talk, 1).executed().velocity, 0.0);
    assert_eq!(home_as(&mut talk, "B1"), Ok(canary), "itself it is homed again");
    act(&mut talk, Action::Reset);
    let up = talk.now() + Duration::from_secs(1);
    talk.port().sleep_until(up);
    assert_ne!(home_as(&mut talk, "A1").unwrap(), canary);
}

#[test]
fn a_homing_is_stopped_between_two_looks() {
    use std::sync::atomic::{AtomicBool, Ordering};
    let mut talk = talk_to(&[UnitSetup::new(16)]);
    let (seat, drive) = (SeatType { axes: 1, ..seat() }, drive(SWITCH));
    let silvermax = drive.silvermax.clone().unwrap();
    let of =
        SeatUnits { name: "A1", twins: &[], seat: &seat, drive: &drive, silvermax: &silvermax, units: &[16] };
    let abort = AtomicBool::new(false);
    let mut told = |step| abort.store(matches!(step, Step::Searching(_)), Ordering::Relaxed);
    let homed = home(
        &mut talk,
        of,
        Homing { canary: CANARY, goes_on: &|| !abort.load(Ordering::Relaxed), told: &mut told },
    );
    assert_eq!(homed, Err(HomeError::Aborted));
    let sent: Vec<_> = talk.port().sent.iter().rev().map(|(_, octets)| octets.as_slice()).collect();
    assert_eq!(sent[..2], [&b"@16 11 40 0\r"[..], b"@16 3 2319282\r"]);
    assert!(unit(&mut talk, 0).place() > 63_000.0, "it had hardly begun to move");
}

/// Units that forget where they are do not say so: they are at 0 wherever they stand.
#[test]
fn a_unit_that_is_restarted_at_any_instant_of_a_homing_is_never_home() {
    const PARTS: u32 = 24;
    let ways = [(SWITCH, false), (SWITCH, true), (HomeWay::HardStop, false), (HomeWay::Here, false)];
    let mut told = 0;
    for (way, together) in ways {
        let mut drive = drive(way);
        (drive.homing.speed_mm_s, drive.homing.together) = (40.0, together);
        let lasts = {
            let mut talk = talk_to(&three());
            let begun = talk.now();
            assert_eq!(home_as(&mut talk, &drive, &[16, 17, 18]).0, Ok(()));
            talk.now().since(begun)
        };
        for part in 1..PARTS {
            let mut talk = talk_to(&three());
            let then = talk.now() + lasts * part / PARTS;
            talk.port().script = Some((then, |line, now| line.bus_mut().act(Some(16), Action::Reset, now)));
            let homed = home_as(&mut talk, &drive, &[16, 17, 18]).0;
            let up_again = talk.now() + Duration::from_secs(2);
            talk.port().sleep_until(up_again);
            told += u32::from(matches!(homed, Err(HomeError::Restarted { unit: 16 })));
            // One that was the first to be sealed, and is restarted before the last is, will say so itself.
            assert_eq!(look(&mut talk, 16).unwrap().canary, 0, "{way:?} {together} {part}: {homed:?}");
        }
    }
    assert!(told > 10, "{told}");
}

#[test]
fn a_unit_that_is_not_there_too_hot_or_of_another_count_is_told_with_its_remedy() {
    let mut talk = talk_to(&[UnitSetup::new(16)]);
    let words = home_as(&mut talk, &drive(SWITCH), &[33]).0.unwrap_err().to_string();
    assert!(words.starts_with("unit 33 does not answer; check its number"), "{words}");
    act(&mut talk, Action::Hot(true));
    let words = home_as(&mut talk, &drive(SWITCH), &[16]).0.unwrap_err().to_string();
    assert!(words.starts_with("unit 16 is too hot"), "{words}");
}

#[test]
fn a_homing_over_a_bad_line_ends_at_the_edge_or_says_what_is_wrong() {
    let mut homes = 0;
    for seed in 0..12_u64 {
        let mut talk = talk_to(&[UnitSetup { place: 20_000 + 700 * seed as i32, ..UnitSetup::new(16) }]);
        talk.port().line.faults = LineFaults { lost: 0.002, answer_lost: 0.02, ..LineFaults::default() };
        let (homed, _) = home_as(&mut talk, &drive(SWITCH), &[16]);
        talk.port().line.faults = LineFaults::default();
        match homed {
            Ok(()) => {
                homes += 1;
                assert!((unit(&mut talk, 0).place() - ZERO).abs() <= 1.0, "{seed}");
            }
            Err(fault) => assert!(look(&mut talk, 16).unwrap().canary == 0, "{seed}: {fault}"),
        }
    }
    assert!(homes >= 6, "{homes}");
}

#[test]
fn two_units_with_one_number_are_told_before_either_moves() {
    for place in [63_200, 63_201, 20_000] {
        let twin = UnitSetup { place, ppm: 40, ..UnitSetup::new(16) };
        let mut talk = talk_to(&[UnitSetup::new(16), twin]);
        let words = home_as(&mut talk, &drive(SWITCH), &[16]).0.unwrap_err().to_string();
        assert!(
            words.starts_with("unit 16 does not answer") && words.contains("that no other has it"),
            "{words}"
        );
        assert!([0, 1].iter().all(|index| unit(&mut talk, *index).executed().velocity == 0.0), "{place}");
    }
}

#[test]
fn a_line_at_another_rate_is_told_by_its_baud_and_nothing_moves() {
    for baud in [9_600, 19_200, 38_400, 115_200] {
        let now = MonoTime::from_nanos(3_000_000_000);
        let mut line =
            SerialLine::new(SilverBus::new(&[UnitSetup::new(16)], baud, now), 11, LineFaults::default(), 7);
        line.set_host_baud(Some(BAUD));
        let terms =
            TalkTerms { baud: BAUD, octet_bits: 11, has_echo: false, is_two_wires: false, is_bus: false };
        let mut talk = Talk::new(VirtualPort::new(line, now), terms);
        let words = home_as(&mut talk, &drive(SWITCH), &[16]).0.unwrap_err().to_string();
        assert!(words.starts_with("unit 16 does not answer") && words.contains("baud"), "{words}");
        assert!(look(&mut talk, 16).is_err() && unit(&mut talk, 0).executed().velocity == 0.0, "{baud}");
    }
}

/// Frames of nine octets are what it makes of requests: none of them is an order to move, whatever its number.
#[test]
fn a_sixpack_where_a_silvermax_was_is_told_and_moves_by_nothing_that_is_said_there() {
    use crate::sim::sixpack2::{MOTORS, ShaftSetup, SixpackBus, SixpackSetup};
    let now = MonoTime::from_nanos(3_000_000_000);
    let shafts = [ShaftSetup::default(); MOTORS];
    let setups =
        (1..=254).map(|unit| SixpackSetup { unit, serial: 9, shafts, is_two_wires: false, can_baud: None });
    let line = SerialLine::new(SixpackBus::waking(setups, now), 11, LineFaults::default(), 7);
    let terms = TalkTerms { baud: BAUD, octet_bits: 11, has_echo: false, is_two_wires: false, is_bus: false };
    let mut talk = Talk::new(crate::drive::link::VirtualPort::new(line, now), terms);
    let (drive, seat) = (drive(SWITCH), seat());
    let silvermax = drive.silvermax.clone().unwrap();
    let of = SeatUnits {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &drive,
        silvermax: &silvermax,
        units: &[16, 17, 18],
    };
    let homed = home(&mut talk, of, Homing { canary: CANARY, goes_on: &|| true, told: &mut |_| {} });
    assert!(homed.unwrap_err().to_string().starts_with("unit 16 does not answer"));
    assert!(look(&mut talk, 16).is_err());
    let motors = talk.port().line.bus().units().iter().flat_map(|unit| &unit.motors);
    assert!(motors.into_iter().all(|motor| motor.shaft.executed().velocity == 0.0));
}

/// A port from which octets come without an end.
#[derive(Debug)]
struct Babble(MonoTime, usize);

impl LinkPort for Babble {
    fn now(&self) -> MonoTime {
        self.0
    }

    fn send(&mut self, _: &[u8]) -> Result<(), LinkFault> {
        Ok(())
    }

    fn receive(&mut self, buf: &mut [u8], _: MonoTime) -> Result<usize, LinkFault> {
        (self.0, self.1) = (self.0 + Duration::from_micros(1), self.1 + 1);
        assert!(self.1 < 1_000_000, "it is listened to for ever");
        buf[0] = b"*# 10\r"[self.1 % 6];
        Ok(1)
    }

    fn flush(&mut self) -> usize {
        0
    }

    fn send_break(&mut self, _: Duration) -> Result<(), LinkFault> {
        Ok(())
    }

    fn set_baud(&mut self, _: u32) -> Result<(), LinkFault> {
        Ok(())
    }

    fn sleep_until(&mut self, at: MonoTime) {
        self.0 = self.0.max(at);
    }
}

#[test]
fn a_line_that_babbles_without_an_end_holds_up_neither_family() {
    let terms = TalkTerms { baud: BAUD, octet_bits: 11, has_echo: false, is_two_wires: false, is_bus: false };
    let port = || Babble(MonoTime::from_nanos(3_000_000_000), 0);
    assert!(look(&mut Talk::new(port(), terms), 16).is_err());
    assert!(sixpack2::find(&mut sixpack2::Talk::new(port(), terms), &[1]).is_err());
}
