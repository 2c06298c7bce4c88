//! Reported positions of the axes.

use super::*;

/// Axes 1 to 3 stand there, by the words of `dialect`, both times they are asked; and so a report says, where there is one.
fn standing(places: [i32; 3], dialect: Dialect, reported: Option<[i32; 3]>) -> Case {
    let mut case = Case::smc();
    for (place, first) in places.into_iter().zip([0x06, 0x08, 0x0a]) {
        let words = crate::wire::position_words(Pulses(place), dialect);
        for (word, step) in words.into_iter().zip(0..) {
            case.survey.values.insert(Address::Dp(first + step), word);
        }
    }
    case.survey.again = case.survey.values.clone();
    let reported = reported.map(|places| PerAxis::from_fn(3, |axis| Pulses(places[axis])));
    case.survey.reported.measured = reported.map(|value| Heard { value, at: MonoTime::default() });
    case
}

#[test]
fn a_word_order_that_the_stroke_or_a_report_refutes_is_refused() {
    let finding = only(&standing([20_000, 0, 0], Dialect::Mbox, None)).unwrap();
    assert_eq!((finding.check, finding.fails()), (Check::WordOrder, true));
    let words = "axis 1 is at 1310720000 pulses in the word order of smc, at 20000 in that of mbox; its stroke is \
                 0..=300000";
    assert_eq!(finding.found, words);
    let reported = standing([1, 0, 0], Dialect::Mbox, Some([1, 0, 0]));
    assert_eq!(check(&reported), Some(Check::WordOrder), "65536 is inside the stroke, but the report says 1");
    assert_eq!(check(&standing([20_000, 0, 0], Dialect::Smc, Some([20_000, 0, 0]))), None);
}

#[test]
fn a_word_order_that_nothing_tells_is_a_warning() {
    let case = standing([1, 0, 0], Dialect::Smc, None);
    assert_eq!(check(&case), Some(Check::WordOrderOpen));
    assert_eq!(check(&standing([1, 0, 0], Dialect::Smc, Some([1, 0, 0]))), None);
    assert_eq!(check(&standing([0, 0, 0], Dialect::Smc, None)), None, "zero is zero in both");
}

#[test]
fn a_position_outside_the_stroke_is_no_position() {
    let finding = only(&standing([0, -20_000, 0], Dialect::Smc, None)).unwrap();
    assert_eq!((finding.check, finding.fails()), (Check::Position, true));
    assert_eq!(finding.found, "axis 2 is at -20000 pulses, outside its stroke of 0..=300000");
    assert!(!Check::Position.can_be_accepted());
    assert_eq!(check(&standing([-30, 300_030, 0], Dialect::Smc, None)), None, "rounding");
    let mut case = standing([0, -20_000, 0], Dialect::Smc, None);
    case.survey.values.insert(crate::device::home::DPF0, 0);
    assert_eq!(check(&case), None, "before it is homed it tells of no place");
}

#[test]
fn a_report_of_the_same_rest_contradicts_and_one_of_a_seat_that_moves_does_not() {
    let mut case = standing([150_000, 0, 0], Dialect::Smc, Some([60_000, 0, 0]));
    let found = only(&case).unwrap().found;
    assert_eq!(found, "axis 1 is at 150000 pulses by its registers, at 60000 by its reports");
    case.survey.again.insert(Address::Dp(0x06), 7);
    assert_eq!(check(&case), None);
}
