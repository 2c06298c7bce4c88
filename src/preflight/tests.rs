//! Each unsafe setting by itself, and what is found beside settings.

mod drives;
mod places;
mod surprises;

use std::time::Duration;

use proptest::prelude::*;

use super::testing::Case;
use super::*;
use crate::config::FanOut;
use crate::device::{Address, Fault, Request};
use crate::motion::Pulses;
use crate::observe::Heard;
use crate::time::MonoTime;
use crate::wire::{DeviceError, Dialect, PerAxis, ReplyCode};

/// A test for each setting that has to be refused: `name: [register = value, …] => check, words it is told in`.
macro_rules! refused {
    ($($name:ident: [$($register:literal = $value:literal),+] => $check:ident, $words:literal;)+) => {
        $(#[test]
        fn $name() {
            let told = Case::smc().with(&[$(($register, $value)),+]).told();
            let [finding] = told.as_slice() else { panic!("one finding, not {told:#?}") };
            assert_eq!(finding.check, Check::$check);
            assert!(finding.fails(), "{finding:?}");
            assert!(finding.found.contains($words), "{}", finding.found);
            assert!(!finding.remedy.is_empty());
        })+
    };
}

refused! {
    a_test_mode_is_refused: [0x00 = 12] => WorkMode, "PA00 = 12: test";
    the_effects_mode_is_refused: [0x00 = 11] => WorkMode, "effects";
    too_few_axes_are_refused: [0x02 = 2] => AxisCount, "PA02 = 2: works with 2 axes, but seat bench3 has 3";
    too_many_axes_are_refused: [0x02 = 6] => AxisCount, "works with 6 axes";
    an_unknown_fast_forward_is_refused: [0x06 = 2] => FastForwardUnknown, "PA06 = 2";
    no_speed_limit_is_refused: [0x07 = 0] => SpeedUnlimited, "PA07 = 0: no limit on speed";
    a_speed_limit_below_the_seats_is_refused: [0x07 = 2000] => SpeedTooLow, "2000 rpm (PA07), 166.7 mm/s";
    a_rotary_axis_is_refused: [0x03 = 3] => RotaryAxis, "PA03 = 3: axis 3 is a rotary axis";
    inverted_outputs_are_refused: [0x05 = 1] => OutputsInverted, "every effect is on while it should be off";
    a_reset_without_a_search_is_refused: [0x0e = 1] => HomesUnsearched, "goes to zero without a search";
    another_encoder_is_refused: [0x54 = 2] => Encoder, "PA54 = 2: no manual says which encoder";
    another_lead_is_refused: [0x41 = 100] => Lead, "PA41 = 100: a lead of 10 mm, but seat bench3 has 5 mm";
    no_lead_is_refused: [0x41 = 0] => Lead, "a lead of 0 mm";
    a_shorter_stroke_is_refused: [0x42 = 1400] => Stroke, "PA42 = 1400: a stroke of 140 mm, but seat bench3 has 150 mm";
    a_rise_that_leaves_no_room_for_the_stroke_is_refused: [0x40 = 800, 0x42 = 2000] => Rise, "PA40 = 800: axis 1 begins 80 mm above its zero and moves 150 mm from there, 30.0 mm past the 200 mm";
    a_rise_of_one_axis_that_leaves_no_room_is_refused: [0x40 = 0, 0x42 = 2000, 0x44 = 501] => Rise, "PA44 = 501: axis 2 begins 50.1 mm above its zero";
    a_bus_slower_than_the_show_is_refused: [0x59 = 11] => BusPeriod, "every 11 ms at most, but frames come every 10.0 ms";
    positions_of_analogue_inputs_are_refused: [0x60 = 1, 0x61 = 2, 0x62 = 3] => AnaloguePosition, "analogue inputs, times 2/3";
    a_cut_of_long_times_is_refused: [0x0b = 2999] => IntervalLimit, "PA0b = 2999: the frame that brings the seat to its park pose, of 3000 ms, is cut to 2999 ms";
    a_cut_of_the_shows_frames_is_refused: [0x0b = 5] => IntervalLimit, "become faster";
    a_reset_by_itself_is_refused: [0x0d = 500] => AutoReset, "PA0d = 500: resets by itself";
    switched_off_replies_are_refused: [0x15 = 0] => RepliesDisabled, "PA15 = 0";
    reports_on_alarm_alone_are_refused: [0x1e = 0] => StatusSlow, "PA1e = 0: reports only when an alarm begins";
    slow_reports_are_refused: [0x1e = 101] => StatusSlow, "every 101 ms";
    no_reports_are_refused: [0x1f = 0] => StatusOff, "PA1f = 0: no status reports";
    reports_to_nobody_known_are_refused: [0x1f = 3] => StatusOff, "no manual says";
    reports_to_another_host_are_refused: [0x1f = 2] => StatusElsewhere, "0.0.0.0:0 (PA25 to PA29), not to 192.168.15.101:8410";
    replies_to_another_host_are_refused: [0x23 = 100] => ReplyAddress, "192.168.15.100, but this machine's address is 192.168.15.101";
    replies_to_another_port_are_refused: [0x24 = 8411] => ReplyPort, "PA24 = 8411, but the frame port is 8410";
    a_scaled_amplitude_is_refused: [0x55 = 5] => Amplitude, "plays every position at 50 %";
    an_unknown_amplitude_is_refused: [0x55 = 10] => Amplitude, "no manual says";
    an_axis_without_a_speed_limit_is_refused: [0x81 = 0] => AxisSpeedUnlimited, "PA81 = 0";
    an_axis_limit_below_the_seats_is_refused: [0x82 = 1440] => SpeedTooLow, "axis 3 may turn 1440 rpm (PA82), 120.0 mm/s";
    an_acceleration_that_limits_speed_below_the_seats_is_refused: [0xb0 = 600] => SpeedTooLow, "1200 rpm (PAa0 times PAb0)";
    a_disabled_emergency_stop_is_refused: [0x90 = 0] => EstopDisabled, "bit 0 is clear, so the controller ignores";
    an_emergency_stop_that_goes_on_by_itself_is_refused: [0x91 = 0] => EstopResumes, "moves on by itself when it is released";
    an_emergency_stop_that_moves_the_seat_is_refused: [0x91 = 1] => EstopReturns, "moves to zero when the button is pressed";
    an_unknown_emergency_stop_is_refused: [0x91 = 3] => EstopAction, "PA91 = 3: no manual says";
    an_emergency_stop_without_an_input_is_refused: [0x92 = 0] => EstopNoInput, "pressing one does nothing";
    two_inputs_joined_by_and_are_refused: [0x92 = 5] => EstopAnd, "all of X01 and X03 must be active at once, so pressing one button does nothing";
    a_slow_input_filter_is_refused: [0x93 = 51] => EstopFilter, "moves on for 51 ms";
    an_unlimited_release_is_refused: [0x94 = 0] => EstopRelease, "PA94 = 0";
    an_axis_offset_of_a_sliced_controller_is_refused: [0x95 = 3] => AxisOffset, "takes axes from 4 on, but fan_out = slice means PA95 = 0";
    a_reset_by_the_stop_button_is_refused: [0x90 = 9, 0x98 = 1] => EstopResetShared, "share X01";
    another_address_of_its_own_is_refused: [0x13 = 202] => Address, "is set to 192.168.15.202:7408";
}

/// The one finding of a case, or none.
fn only(case: &Case) -> Option<Finding> {
    let mut told = case.told();
    assert!(told.len() <= 1, "{told:#?}");
    told.pop()
}

fn check(case: &Case) -> Option<Check> {
    only(case).map(|finding| finding.check)
}

#[test]
fn safe_settings_pass_in_both_dialects() {
    for dialect in [Dialect::Smc, Dialect::Mbox] {
        let case = Case::new(dialect);
        assert_eq!(case.told(), [], "{dialect:?}");
        assert!(case.findings().iter().any(|finding| finding.check == Check::Version));
    }
}

#[test]
fn what_a_manual_allows_passes() {
    for parameters in [
        [(0x0a, 1)],
        [(0x0b, 0)],
        [(0x0b, 3_000)],
        [(0x42, 1_600)],
        [(0x59, 10)],
        [(0x61, 2)],
        [(0x93, 50)],
        [(0x93, 0)],
        [(0x92, 0x0800)],
        [(0x85, 0)],
    ] {
        assert_eq!(Case::smc().with(&parameters).told(), [], "{parameters:x?}");
    }
    assert_eq!(check(&Case::new(Dialect::Mbox).with(&[(0x00, 10)])), None);
    assert_eq!(check(&Case::new(Dialect::Mbox).with(&[(0x00, 11)])), Some(Check::WorkMode));
    let here = [(0x1f, 2), (0x25, 192), (0x26, 168), (0x27, 15), (0x28, 101), (0x29, 8_410)];
    assert_eq!(check(&Case::smc().with(&here)), None);
}

#[test]
fn what_should_be_looked_at_is_a_warning_and_does_not_fail() {
    let warned = [
        (vec![(0x00, 0)], Check::WorkModeOpen),
        (vec![(0x54, 1)], Check::EncoderUnsure),
        (vec![(0x4c, 20)], Check::MotionLate),
        (vec![(0x9f, 5)], Check::PowerOnOutputs),
        (vec![(0x06, 1)], Check::FastForward),
        (vec![(0x04, 1)], Check::EstopWire),
        (vec![(0x94, 2_880)], Check::EstopReleaseFast),
        (vec![(0x90, 3)], Check::EstopJog),
        (vec![(0x90, 9), (0x98, 2)], Check::EstopResetInput),
        (vec![(0x9d, 1)], Check::OutputsIgnored),
    ];
    for (parameters, expected) in warned {
        let finding = only(&Case::smc().with(&parameters)).unwrap();
        assert_eq!((finding.check, finding.fails()), (expected, false), "{finding:?}");
    }
    let limits: Vec<_> = (0x80..=0x85).map(|number| (number, 0)).collect();
    let fast =
        Case::smc().with(&limits).with(&[(0x07, 3_300)]).with(&[(0xb0, 3_000), (0xb1, 3_000), (0xb2, 3_000)]);
    assert!(fast.told().iter().any(|finding| finding.check == Check::SpeedTooHigh));
}

#[test]
fn settings_of_the_factory_are_refused() {
    let mut case = Case::smc();
    for (address, value) in &mut case.survey.values {
        *value = crate::device::table().get(*address).and_then(|it| it.default(Dialect::Smc)).unwrap_or(0);
    }
    let failed: Vec<_> =
        case.findings().into_iter().filter(Finding::fails).map(|finding| finding.check).collect();
    let expected = [
        Check::AxisSpeedUnlimited,
        Check::EstopDisabled,
        Check::EstopNoInput,
        Check::EstopResumes,
        Check::EstopFilter,
        Check::EstopRelease,
        Check::StatusOff,
        Check::StatusSlow,
    ];
    assert_eq!(failed, expected);
}

#[test]
fn a_shared_frame_needs_its_offset_in_the_device() {
    let mut case = Case::smc();
    (case.controller.connection.fan_out, case.controller.axis_offset) = (FanOut::Shared, 6);
    assert_eq!(check(&case), Some(Check::AxisOffset));
    assert_eq!(check(&case.with(&[(0x95, 6)])), None);
}

#[test]
fn the_seat_is_not_judged_by_axes_that_nobody_gave() {
    let mut case = Case::smc().with(&[(0x02, 6)]);
    case.axes = None;
    assert_eq!(check(&case), None);
    assert!(case.findings().iter().any(|finding| finding.check == Check::AxisCountOpen));
}

#[test]
fn a_slow_show_needs_long_times() {
    let mut case = Case::smc().with(&[(0x0b, 900)]);
    let short = crate::motion::SeatType::bench3(3).with_each(|axis| axis.high = 40.0);
    case.controller.seat = std::sync::Arc::new(short);
    assert_eq!(check(&case), None);
    case.terms.rate_hz = 1.0;
    let found = only(&case).unwrap().found;
    assert_eq!(found, "PA0b = 900: frames of the show, of 1000 ms, are cut to 900 ms and become faster");
}

#[test]
fn an_unlimited_interval_is_unexplained_for_mbox_alone() {
    assert_eq!(check(&Case::new(Dialect::Mbox).with(&[(0x0b, 0)])), Some(Check::IntervalUnlimited));
}

#[test]
fn mbox_controllers_are_not_blamed_for_registers_that_they_lack() {
    let case = Case::new(Dialect::Mbox);
    assert!(case.subject().pa(0x0d).is_none());
    let told = case.findings();
    let not_asked = told.iter().find(|finding| finding.check == Check::NotAsked).unwrap();
    assert!(not_asked.found.contains("PA0d") && not_asked.found.contains("DP34"));
}

#[test]
fn a_stop_that_kinocue_cannot_see_is_told() {
    let mut case = Case::new(Dialect::Mbox);
    case.controller.estop_inputs = 0;
    assert_eq!(check(&case), Some(Check::EstopUnwatched));
    let mut case = Case::smc();
    case.controller.estop_inputs = 4;
    let finding = only(&case).unwrap();
    assert_eq!(finding.found, "estop_inputs watches X03, but PA92 = 1 stops at X01");
    assert_eq!(finding.remedy, "write estop_inputs = [1] for this controller");
}

#[test]
fn a_silent_controller_is_named_and_judged_no_further() {
    let mut case = Case::smc().with(&[(0x90, 0)]);
    let request = Request::read(Address::Pa(0x10));
    case.survey.silent =
        Some(Fault::Silent { request, tries: 3, timeout: Duration::from_millis(300), odd: None });
    let finding = only(&case).unwrap();
    assert_eq!(finding.check, Check::NoAnswer);
    assert_eq!(finding.found, "does not answer: 3 tries of 300 ms");
    assert!(finding.remedy.contains("PA15"));
}

#[test]
fn a_controller_that_answers_as_the_imax_manual_prints_is_named_as_such_and_not_as_silent() {
    for dialect in [Dialect::Smc, Dialect::Mbox] {
        let mut case = Case::new(dialect);
        case.survey.silent = Some(Fault::Foreign { request: Request::read(Address::Pa(0x10)) });
        let finding = only(&case).unwrap();
        assert_eq!(finding.check, Check::Dialect);
        assert!(finding.found.contains("registers of 32 bits"), "{}", finding.found);
    }
}

#[test]
fn a_register_that_could_not_be_read_is_no_safe_one() {
    let mut case = Case::smc();
    case.survey.values.retain(|address, _| !matches!(address, Address::Pa(0x90..=0x94)));
    case.survey.unread = vec![Fault::NoWay { request: Request::read(Address::Pa(0x90)) }];
    let finding = only(&case).unwrap();
    assert_eq!(finding.check, Check::RegisterUnread);
    assert!(
        finding.found.starts_with("PA90 to PA94 could not be read: cannot read PA90"),
        "{}",
        finding.found
    );
}

#[test]
fn slow_and_lost_answers_are_told_by_their_figures() {
    let mut case = Case::smc();
    case.survey.round_trips[3] = Duration::from_millis(21);
    assert_eq!(only(&case).unwrap().found, "the slowest answer took 21.0 ms, half of them over 0.3 ms");
    let mut case = Case::smc();
    case.survey.round_trips.truncate(18);
    assert_eq!(check(&case), Some(Check::RepliesMissed));
    case.survey.round_trips.truncate(17);
    let finding = only(&case).unwrap();
    assert_eq!((finding.check, finding.fails()), (Check::RepliesLost, true));
    assert_eq!(finding.found, "3 of 20 reads had no answer within 100 ms");
    case.survey.odds.late = 3;
    assert!(only(&case).unwrap().found.ends_with("within 100 ms; 3 answers came later"));
}

#[test]
fn signs_of_somebody_else_are_told() {
    let mut case = Case::smc();
    case.survey.foreign_packets = Some(12);
    assert_eq!(only(&case).unwrap().found, "got 12 more packets (DP34) than were sent from here");
    let mut case = Case::smc();
    case.survey.changed = vec![Address::Pa(0x1b)];
    assert_eq!(check(&case), Some(Check::Contradiction));
    let mut case = Case::smc();
    case.survey.odds.duplicate = 2;
    assert_eq!(check(&case), Some(Check::TwoAnswer));
    let mut case = Case::smc();
    case.survey.odds.malformed = 1;
    assert_eq!(check(&case), Some(Check::BrokenReplies));
    let mut case = Case::smc();
    case.survey.odds.foreign = 1;
    assert_eq!(check(&case), Some(Check::ForeignReplies));
}

#[test]
fn a_present_error_or_emergency_stop_is_told_in_words_and_once() {
    let mut case = Case::smc();
    case.survey.state = Some((ReplyCode::EmergencyStop, DeviceError(0)));
    assert_eq!(check(&case), Some(Check::EmergencyStopActive));
    let mut case = Case::smc();
    case.survey.state = Some((ReplyCode::Fault, DeviceError(12)));
    case.survey.reported.error = Some(Heard { value: 12, at: MonoTime::default() });
    assert_eq!(only(&case).unwrap().found, "Err12: alarm of the servo of axis 3");
    let mut case = Case::smc();
    let drives = PerAxis::from_fn(3, |axis| if axis == 1 { 0x21 } else { 0 });
    case.survey.reported.servo_errors = Some(Heard { value: drives, at: MonoTime::default() });
    assert_eq!(only(&case).unwrap().found, "the drive of axis 2 reports its error 33");
    let positions = PerAxis::from_fn(3, |_| Pulses(0));
    case.survey.reported.measured = Some(Heard { value: positions, at: MonoTime::default() });
    assert_eq!(case.told().len(), 1);
}

#[test]
fn reports_that_are_promised_and_do_not_come_are_told() {
    let mut case = Case::smc();
    case.survey.reported.reports = 0;
    let finding = only(&case).unwrap();
    assert_eq!((finding.check, finding.fails()), (Check::StatusUnheard, false));
    assert_eq!(finding.found, "reports should come every 100 ms (PA1e), but none came in 300 ms");
    case.terms.frame_port = 8_411;
    assert_eq!(check(&case), Some(Check::ReplyPort), "where they go elsewhere, that is the fault");
}

#[test]
fn a_way_that_is_none_or_too_narrow_is_told() {
    let mut case = Case::smc();
    case.route = Ok(crate::net::Route { local: super::testing::HOST, mtu: 68 });
    assert_eq!(only(&case).unwrap().found, "the interface takes packets of 68 bytes, but 108 are sent");
    let mut case = Case::smc();
    case.route = Err("network is unreachable".to_owned());
    assert_eq!(only(&case).unwrap().found, "no route to 192.168.15.201:7408: network is unreachable");
}

#[test]
fn the_frame_port_cannot_be_compared_where_it_is_another_each_time() {
    let mut case = Case::smc();
    case.terms.frame_port = 0;
    assert_eq!(check(&case), None);
    assert!(case.findings().iter().any(|finding| finding.check == Check::FramePortFree));
    case.survey.values.insert(Address::Pa(0x24), 0);
    let findings = case.findings();
    let free = findings.iter().find(|finding| finding.check == Check::FramePortFree).unwrap();
    assert_eq!(free.remedy, "set PA24 and the port of bind to the same number, such as 8410", "{free:?}");
}

#[test]
fn controllers_with_one_address_or_hardware_address_are_told_both() {
    let (one, mut two) = (Case::smc().with(&[(0x1b, 7)]), Case::smc().with(&[(0x1b, 7)]));
    two.controller.name = "A2".to_owned();
    let all = judge(&[one.subject(), two.subject()], &one.terms, &[]);
    for (findings, other) in all.iter().zip(["A2", "A1"]) {
        assert_eq!(findings[0].check, Check::DuplicateAddress);
        assert!(findings[0].found.ends_with(&format!("as {other}")), "{}", findings[0].found);
    }
}

#[test]
fn the_one_with_other_software_is_told() {
    let mut cases = [Case::smc(), Case::smc(), Case::smc()];
    for (case, host) in cases.iter_mut().zip(201..) {
        case.controller.connection.address.set_ip(std::net::Ipv4Addr::new(192, 168, 15, host));
        case.survey.values.insert(Address::Pa(0x13), u16::from(host));
        case.survey.values.insert(Address::Dp(0xff), 4);
    }
    cases[1].survey.values.insert(Address::Dp(0xfe), 2);
    let subjects: Vec<_> = cases.iter().map(Case::subject).collect();
    let all = judge(&subjects, &cases[0].terms, &[]);
    let differs = |findings: &Vec<Finding>| findings.iter().any(|one| one.check == Check::VersionDiffers);
    assert_eq!(all.iter().map(differs).collect::<Vec<_>>(), [false, true, false]);
    let told = all[1].iter().find(|one| one.check == Check::VersionDiffers).unwrap();
    assert_eq!(told.found, "software 4.2, but most have 4.0");
}

#[test]
fn an_accepted_finding_is_shown_with_its_reason_and_does_not_fail() {
    let acceptance = |check, why: &str| Acceptance { check, why: why.to_owned() };
    let mut case = Case::smc().with(&[(0x90, 0), (0x55, 5)]);
    case.controller.accept_findings = vec![acceptance(Check::EstopDisabled, "contactor K1")];
    let hall =
        [acceptance(Check::Amplitude, "small room"), acceptance(Check::EstopDisabled, "the hall's reason")];
    let findings = judge(&[case.subject()], &case.terms, &hall).remove(0);
    let why = |check| findings.iter().find(|one| one.check == check).unwrap().accepted.clone().unwrap();
    assert_eq!(why(Check::EstopDisabled), "contactor K1", "its own reason goes before the hall's");
    assert_eq!(why(Check::Amplitude), "small room");
    assert!(findings.iter().all(|finding| !finding.fails()));
}

#[test]
fn what_a_controller_does_not_tell_is_accepted_by_nobody() {
    let mut case = Case::smc();
    case.survey.values.remove(&Address::Pa(0x90));
    case.controller.accept_findings = vec![Acceptance { check: Check::RegisterUnread, why: "x".to_owned() }];
    assert!(case.findings()[0].fails());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn whatever_the_registers_hold_it_is_put_into_sentences(
        values in proptest::collection::vec(prop_oneof![0..4_u16, any::<u16>()], 90),
        mbox in any::<bool>(),
    ) {
        let mut case = Case::new(if mbox { Dialect::Mbox } else { Dialect::Smc });
        for (register, value) in case.survey.values.values_mut().zip(values) {
            *register = value;
        }
        for finding in case.findings() {
            prop_assert!(!finding.found.is_empty() && !finding.found.contains("  "), "{}", finding.found);
            prop_assert!(!finding.found.ends_with('.') && !finding.remedy.ends_with('.'), "{finding:?}");
        }
    }
}

/// A chair whose last axis turns, at a controller that takes axis `told` for a rotary one.
fn chair(dialect: Dialect, told: u16) -> Case {
    let mut case = Case::new(dialect).with(&[(0x03, told)]);
    let mut seat = crate::motion::SeatType::bench3(3);
    seat.each[2].unit = crate::motion::AxisUnit::Degree;
    (seat.each[2].low, seat.each[2].high) = (-75.0, 75.0);
    case.controller.seat = std::sync::Arc::new(seat);
    case
}

#[test]
fn the_axis_that_takes_its_place_for_zero_is_the_one_that_turns() {
    for (told, fails, words) in [
        (3, false, "PA03 = 3: axis 3 takes its position at a reset or start for zero"),
        (0, true, "PA03 = 0: the controller searches for the zero of axis 3, a rotary axis of seat bench3"),
        (2, true, "PA03 = 2: axis 2 is a rotary axis"),
    ] {
        let finding = only(&chair(Dialect::Smc, told)).expect("one finding");
        assert!(finding.found.contains(words) && finding.fails() == fails, "{finding:?}");
    }
    assert_eq!(check(&chair(Dialect::Smc, 3)), Some(Check::RotaryZero));
}

#[test]
fn limits_on_the_speed_of_an_axis_that_turns_are_told_for_it_alone() {
    let mut turns = chair(Dialect::Smc, 3);
    let mut seat = (*turns.controller.seat).clone();
    (seat.each[2].lead, seat.each[2].max_velocity) = (360.0, 400.0);
    turns.controller.seat = std::sync::Arc::new(seat);
    let remedy = |case: &Case, check: Check| {
        let told = case.told();
        told.into_iter().find(|finding| finding.check == check).map(|finding| finding.remedy)
    };
    let turns = turns.with(&[(0x07, 2_880), (0x80, 2_880), (0x81, 2_880), (0x82, 2_880)]);
    assert_eq!(remedy(&turns, Check::SpeedTooHigh).as_deref(), Some("set PA82 to 67"));
    let turns = turns.with(&[(0x80, 0), (0x82, 0)]);
    assert_eq!(remedy(&turns, Check::AxisSpeedUnlimited).as_deref(), Some("set PA80 to 2880, PA82 to 67"));
    let seat = Case::smc().with(&[(0x07, 3_500), (0x80, 0), (0x81, 3_500), (0x82, 3_500)]);
    let seat = seat.with(&[(0xb0, 3_500), (0xb1, 3_500), (0xb2, 3_500)]);
    assert_eq!(remedy(&seat, Check::AxisSpeedUnlimited).as_deref(), Some("set them to 2880"));
    assert_eq!(remedy(&seat, Check::SpeedTooHigh).as_deref(), Some("set PA07 or PA80 to PA85 to 2880"));
}

#[test]
fn an_imax_controller_does_not_filter_positions_that_go_below_0() {
    let checks = |depth: u16| {
        let told = chair(Dialect::Mbox, 3).with(&[(0x51, depth)]).told();
        told.iter().any(|finding| finding.check == Check::SignedFilter && finding.fails())
    };
    assert!(checks(1) && checks(4) && !checks(0));
    assert!(Case::new(Dialect::Mbox).with(&[(0x51, 1)]).told().is_empty(), "cylinders never go below 0");
}
