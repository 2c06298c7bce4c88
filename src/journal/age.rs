//! Which days' files are too old. A clock may be years off after a start, so that age is counted in days on which files were begun.

use std::collections::BTreeSet;

use jiff::civil::Date;

/// A gap between two days with files that is longer than so many days counts as none: the clock has leapt, or nobody played.
const LEAP: i32 = 31;
/// Days whose files go by their age on one day, at the most.
const AT_ONCE: usize = 2;

/// The days, of those with files, whose files go by their age on `today`; the oldest first. None where `today` itself is such a leap. A later
/// day is neither too old nor makes others so.
pub(crate) fn too_old(days: impl IntoIterator<Item = Date>, today: Date, max_age_days: u32) -> Vec<Date> {
    let days: BTreeSet<Date> = days.into_iter().filter(|day| *day < today).collect();
    if days.last().is_none_or(|newest| (today - *newest).get_days() > LEAP) {
        return Vec::new();
    }
    let (mut later, mut age) = (today, 0);
    let mut old = Vec::new();
    for day in days.into_iter().rev() {
        let gap = (later - day).get_days();
        age += if gap > LEAP { 0 } else { gap };
        if i64::from(age) > i64::from(max_age_days) {
            old.push(day);
        }
        later = day;
    }
    old.reverse();
    old.truncate(AT_ONCE);
    old
}

#[cfg(test)]
mod tests {
    use jiff::ToSpan as _;
    use proptest::prelude::*;

    use super::*;

    fn day(number: i32) -> Date {
        Date::constant(2026, 1, 1).checked_add(number.days()).unwrap()
    }

    /// Days of files, each day one, and what is left of them after a day.
    fn pass(days: &mut Vec<Date>, today: Date, max_age_days: u32) -> usize {
        let old = too_old(days.iter().copied(), today, max_age_days);
        days.retain(|day| !old.contains(day));
        days.push(today);
        old.len()
    }

    #[test]
    fn a_clock_that_has_leapt_makes_nothing_too_old_however_full_the_folder_is() {
        let mut days: Vec<Date> = Vec::new();
        let gone: usize = (0..60).map(|number| pass(&mut days, day(number), 10)).sum();
        assert_eq!((days.len(), gone), (11, 49), "one day goes for each that comes");
        for ahead in ["2035-01-01", "2061-07-01", "2199-12-31"] {
            assert_eq!(pass(&mut days, ahead.parse().unwrap(), 10), 0, "{ahead}");
        }
        // The clock is right again, and then far behind.
        assert_eq!(pass(&mut days, day(60), 10), 1);
        assert_eq!(pass(&mut days, "1970-01-01".parse().unwrap(), 10), 0);
        assert_eq!(days.len(), 15);
    }

    #[test]
    fn a_shorter_age_is_reached_bit_by_bit() {
        let mut days: Vec<Date> = (0..400).map(day).collect();
        let gone: Vec<usize> = (400..410).map(|number| pass(&mut days, day(number), 4)).collect();
        assert_eq!(gone, [AT_ONCE; 10]);
        assert_eq!(days[0], day(20), "the oldest go first");
    }

    proptest! {
        #[test]
        fn whatever_a_clock_does_no_day_costs_more_than_two_and_none_goes_before_its_time(
            steps in proptest::collection::vec((0_i32..60_000, any::<bool>()), 1..120),
            max_age_days in 1_u32..40,
        ) {
            let (mut days, mut true_day) = (Vec::new(), 0_i32);
            for (wrong, is_wrong) in steps {
                true_day += 1;
                let today = if is_wrong { day(wrong) } else { day(true_day) };
                let before = days.clone();
                let gone = pass(&mut days, today, max_age_days);
                prop_assert!(gone <= AT_ONCE);
                for lost in before.iter().filter(|day| !days.contains(day)) {
                    // By the calendar of the clock it is older than it may be as well.
                    prop_assert!((today - *lost).get_days() > i32::try_from(max_age_days).unwrap());
                }
            }
        }
    }
}
