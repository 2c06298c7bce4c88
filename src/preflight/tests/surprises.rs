//! What a site is surprised by: the seat's mechanics, delays, belts.

use super::*;

#[test]
fn what_a_site_will_be_surprised_by_of_an_imax_is_told() {
    let mbox = |parameters: &[(u8, u16)]| only(&Case::new(Dialect::Mbox).with(parameters)).unwrap();
    let time = mbox(&[(0x0a, 1)]);
    assert_eq!((time.check, time.fails()), (Check::TimeIgnored, true));
    assert_eq!(mbox(&[(0x0e, 1)]).check, Check::HomesUnsearched);
    let late = mbox(&[(0x51, 4)]);
    assert_eq!((late.check, late.fails()), (Check::MotionLate, false));
    let words = "PA51 = 4 (and PA50 = 100): with this filter motion comes 30 to 70 ms later than the film";
    assert_eq!(late.found, words);
    assert_eq!(check(&Case::new(Dialect::Mbox).with(&[(0x51, 1)])), None, "1 smooths nothing");
    assert!(Case::new(Dialect::Mbox).with(&[(0x51, 65_535)]).told().len() == 1, "whatever it holds");
}

#[test]
fn delays_of_the_controller_are_told_in_ms() {
    let found = only(&Case::smc().with(&[(0x4c, 20), (0x4d, 40)])).unwrap().found;
    let words = "PA4c = 20 and PA4d = 40: if these are ms, motion comes 40 to 60 ms later than the film";
    assert_eq!(found, words);
}

#[test]
fn the_stroke_register_is_a_rise_where_the_smc_manual_says_so() {
    let case = Case::smc().with(&[(0x42, 100), (0x40, 0)]);
    assert_eq!(check(&case), None);
    assert_eq!(check(&case.with(&[(0x40, 1)])), Some(Check::Stroke));
}

#[test]
fn a_rise_is_judged_by_what_is_in_force_and_to_the_unit_of_its_register() {
    for dialect in [Dialect::Smc, Dialect::Mbox] {
        let found = |parameters: &[(u8, u16)]| check(&Case::new(dialect).with(parameters));
        assert_eq!(found(&[(0x40, 500), (0x42, 2_000)]), None);
        assert_eq!(found(&[(0x40, 501), (0x42, 2_000)]), Some(Check::Rise));
        // Those of the axes count only where the one of all is 0; of axes that the seat has.
        assert_eq!(found(&[(0x40, 100), (0x42, 2_000), (0x43, 900)]), None);
        assert_eq!(found(&[(0x40, 0), (0x42, 2_000), (0x45, 900)]), Some(Check::Rise));
        assert_eq!(found(&[(0x40, 0), (0x42, 2_000), (0x46, 900), (0x48, 900)]), None);
        assert_eq!(found(&[(0x40, 900), (0x42, 0)]), None, "how long the cylinder is nobody knows");
    }
}

#[test]
fn pulses_that_no_count_of_the_encoder_makes_are_refused() {
    let mut case = Case::smc();
    let odd = crate::motion::SeatType::bench3(3).with_each(|axis| axis.pulses_per_rev = 7_500.0);
    case.controller.seat = std::sync::Arc::new(odd);
    let found = only(&case).unwrap();
    assert_eq!(found.check, Check::Encoder);
    assert!(
        found.found.ends_with("7500 pulses per turn, neither two nor four for each line"),
        "{}",
        found.found
    );
}

#[test]
fn seats_of_one_type_with_different_encoders_are_told() {
    let mut cases = [Case::smc(), Case::smc(), Case::smc().with(&[(0x54, 1)])];
    for (case, host) in cases.iter_mut().zip(201..) {
        case.controller.connection.address.set_ip(std::net::Ipv4Addr::new(192, 168, 15, host));
        case.survey.values.insert(Address::Pa(0x13), u16::from(host));
    }
    let subjects: Vec<_> = cases.iter().map(Case::subject).collect();
    let all = judge(&subjects, &cases[0].terms, &[]);
    let differs = |findings: &Vec<Finding>| findings.iter().any(|one| one.check == Check::EncoderDiffers);
    assert_eq!(all.iter().map(differs).collect::<Vec<_>>(), [false, false, true]);
}

#[test]
fn belts_in_place_of_an_emergency_stop_are_named_as_such() {
    let belts = [(0x04, 0), (0x91, 1), (0x92, 3)];
    let mut case = Case::smc().with(&belts);
    let undeclared: Vec<_> = case.told().into_iter().map(|finding| finding.check).collect();
    assert_eq!(undeclared, [Check::EstopAnd, Check::EstopReturns]);
    case.controller.belt_inputs = 0b11;
    let finding = only(&case).unwrap();
    assert_eq!((finding.check, finding.fails()), (Check::EstopIsBelts, true));
    assert!(finding.found.contains("X01 and X02 are belts") && finding.found.contains("moves to zero"));
    case.survey.state = Some((ReplyCode::EmergencyStop, DeviceError(0)));
    assert!(case.told().iter().any(|finding| finding.check == Check::BeltsOpen));
    assert!(case.told().iter().all(|finding| finding.check != Check::EmergencyStopActive));
}
