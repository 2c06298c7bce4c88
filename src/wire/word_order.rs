//! Which of the two words of a position is the high one: asked of what they tell, since the manuals disagree and a wrong
//! order makes another place of the same bytes.

use super::{Dialect, position};
use crate::motion::{PulseRange, Pulses, in_stroke};

/// How far a report and a reading of a seat at rest may be apart, in strokes. The two orders differ by at least 65,535
/// pulses wherever they differ at all.
const AGREE: f64 = 0.02;

/// Which order of words the positions of a controller fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WordOrder {
    /// That of its dialect alone.
    Configured,
    /// The other one alone: the dialect is wrong, or this firmware goes by the other manual.
    Other,
    /// Both, and both tell the same places, as at zero: the order is not known, and does not matter here.
    Same,
    /// Both, and they tell different places: nothing says which is true.
    Both,
    /// None: no order makes of them what is inside the stroke, and what the report tells.
    Neither,
}

/// Which order of words fits the position registers of axis 1 and on, two `words` each, of a controller of `dialect`
/// whose motors stand within `ranges`. `reported` are the positions of a report of the same rest, where there is one; to a
/// seat that moves a report from another instant says nothing, and must not be given.
///
/// One axis that tells settles it for all, since a controller has one order; axes that tell different ones fit neither.
#[must_use]
pub(crate) fn word_order(
    words: &[[u16; 2]],
    dialect: Dialect,
    ranges: &[PulseRange],
    reported: Option<&[Pulses]>,
) -> WordOrder {
    let fits = |place: Pulses, range: PulseRange, report: Option<&Pulses>| {
        in_stroke(place, range) && report.is_none_or(|it| near(*it, place, range.span()))
    };
    let (mut configured, mut swapped, mut same) = (true, true, true);
    for (axis, (words, range)) in words.iter().zip(ranges).enumerate() {
        let one = position(*words, dialect);
        let two = in_other_order(one);
        let report = reported.and_then(|all| all.get(axis));
        configured &= fits(one, *range, report);
        swapped &= fits(two, *range, report);
        same &= one == two;
    }
    match (configured, swapped) {
        (true, false) => WordOrder::Configured,
        (false, true) => WordOrder::Other,
        (true, true) if same => WordOrder::Same,
        (true, true) => WordOrder::Both,
        (false, false) => WordOrder::Neither,
    }
}

/// The position that the same two words tell in the other order.
#[must_use]
pub(crate) const fn in_other_order(position: Pulses) -> Pulses {
    Pulses(position.0.cast_unsigned().rotate_left(16).cast_signed())
}

fn near(one: Pulses, other: Pulses, stroke: f64) -> bool {
    f64::from(one.0.abs_diff(other.0)) <= (AGREE * stroke).max(1.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::wire::position_words;

    const STROKE: [PulseRange; 12] = [PulseRange { low: 0.0, high: 300_000.0 }; 12];

    /// What a controller that goes by `dialect` tells of these places.
    fn told(places: &[i32], dialect: Dialect) -> Vec<[u16; 2]> {
        places.iter().map(|place| position_words(Pulses(*place), dialect)).collect()
    }

    fn order(places: &[i32], reported: Option<&[i32]>) -> WordOrder {
        let reported: Option<Vec<_>> = reported.map(|all| all.iter().map(|place| Pulses(*place)).collect());
        word_order(&told(places, Dialect::Smc), Dialect::Smc, &STROKE, reported.as_deref())
    }

    #[test]
    fn one_axis_whose_other_reading_is_past_the_stroke_settles_the_order() {
        assert_eq!(order(&[150_000, 0, 0], None), WordOrder::Configured);
        let swapped = told(&[150_000, 0, 0], Dialect::Mbox);
        assert_eq!(word_order(&swapped, Dialect::Smc, &STROKE, None), WordOrder::Other);
        assert_eq!(word_order(&swapped, Dialect::Mbox, &STROKE, None), WordOrder::Configured);
    }

    #[test]
    fn at_zero_the_order_does_not_matter_and_at_one_pulse_it_does() {
        assert_eq!(order(&[0, 0, 0], None), WordOrder::Same);
        assert_eq!(order(&[], None), WordOrder::Same);
        assert_eq!(order(&[1, 0, 0], None), WordOrder::Both, "or 65,536");
        assert_eq!(order(&[1, 0, 5], None), WordOrder::Configured, "or 327,680 of the third");
    }

    #[test]
    fn a_report_tells_two_places_inside_the_stroke_apart() {
        assert_eq!(order(&[1, 0, 0], Some(&[3, 0, 0])), WordOrder::Configured);
        assert_eq!(order(&[1, 0, 0], Some(&[65_530, 0, 0])), WordOrder::Other);
        assert_eq!(order(&[1, 0, 0], Some(&[0])), WordOrder::Configured, "a report of fewer axes");
        assert_eq!(order(&[150_000, 0, 0], Some(&[20_000, 0, 0])), WordOrder::Neither);
    }

    #[test]
    fn a_place_outside_the_stroke_by_more_than_rounding_fits_no_order() {
        assert_eq!(order(&[-1, 40_000, 0], None), WordOrder::Configured);
        assert_eq!(order(&[-20_000, 0, 0], None), WordOrder::Neither);
        assert_eq!(order(&[320_000, 0, 0], None), WordOrder::Neither);
        let mixed = [told(&[150_000], Dialect::Smc), told(&[150_000], Dialect::Mbox)].concat();
        assert_eq!(word_order(&mixed, Dialect::Smc, &STROKE, None), WordOrder::Neither, "axes that disagree");
    }

    #[test]
    fn a_place_below_the_zero_in_the_middle_settles_the_order_of_a_signed_axis() {
        let words = told(&[-100], Dialect::Smc);
        let signed = &[PulseRange { low: -250_000.0, high: 250_000.0 }];
        assert_eq!(word_order(&words, Dialect::Smc, signed, None), WordOrder::Configured);
        assert_eq!(word_order(&words, Dialect::Mbox, signed, None), WordOrder::Other);
        assert_eq!(word_order(&words, Dialect::Smc, signed, Some(&[Pulses(100)])), WordOrder::Configured);
    }

    proptest! {
        #[test]
        fn what_a_controller_of_the_dialect_tells_never_fits_the_other_alone(
            places in proptest::collection::vec(0..=300_000_i32, 1..7),
            mbox in any::<bool>(),
        ) {
            let dialect = if mbox { Dialect::Mbox } else { Dialect::Smc };
            let words = told(&places, dialect);
            let reported: Vec<_> = places.iter().map(|place| Pulses(*place)).collect();
            for reported in [None, Some(&reported[..])] {
                let found = word_order(&words, dialect, &STROKE, reported);
                prop_assert!(!matches!(found, WordOrder::Other | WordOrder::Neither), "{found:?}");
            }
        }
    }
}
