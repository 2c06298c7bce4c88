//! How a SIXpack 2 counts speed and time: what its settings and its own loop have in common.

/// Its greatest speed, in its own units.
pub(crate) const MOST_SPEED: i32 = 511;
/// The greatest divider of its clock (CMD $12).
pub(crate) const GREATEST_DIVIDER: u8 = 31;
/// Microsteps a second that it makes at most, whatever its clock (its manual, page 28).
pub(crate) const MOST_STEPS: f64 = 200_000.0;
/// Its baud rate is this divided by a whole number (CMD $40).
pub(crate) const BAUD_CLOCK: u32 = 1_250_000;
/// That number at power-up: 19,231 baud, for 19,200.
pub(crate) const WAKING_DIVISOR: u16 = 65;
/// The clock that speeds are counted in, Hz.
const CLOCK_HZ: f64 = 20e6;

/// Microsteps a second of one unit of speed, with a divider of the clock (CMD $12, $13: the other divider is 0).
#[must_use]
pub(crate) fn steps_of_a_unit(divider: u8) -> f64 {
    CLOCK_HZ / (f64::from(divider) + 1.0) / f64::from(1_u32 << 14)
}

/// The greatest divider that lets a motor make so many microsteps a second; none where no divider does.
#[must_use]
pub(crate) fn greatest_divider(steps: f64) -> Option<u8> {
    let makes = |divider: &u8| steps <= (f64::from(MOST_SPEED) * steps_of_a_unit(*divider)).min(MOST_STEPS);
    (0..=GREATEST_DIVIDER).rev().find(makes)
}

/// Bits a second by a divisor (CMD $40), halves up; none by 0.
#[must_use]
pub(crate) fn baud_of(divisor: u16) -> Option<u32> {
    let divisor = u32::from(divisor);
    (BAUD_CLOCK + divisor / 2).checked_div(divisor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_divider_ends_at_162_mm_a_second_and_none_goes_beyond_200_000_microsteps() {
        let steps = |speed: f64| speed / 5.0 * 3_200.0;
        assert_eq!(
            [162.0, 163.0, 240.0].map(|speed| greatest_divider(steps(speed))),
            [Some(5), Some(4), Some(3)]
        );
        assert_eq!([200_000.0, 200_001.0].map(greatest_divider), [Some(2), None]);
    }

    #[test]
    fn baud_rates_are_a_clock_by_a_whole_number() {
        let rates = [WAKING_DIVISOR, 22, 11, 10, 5].map(baud_of);
        assert_eq!(rates, [19_231, 56_818, 113_636, 125_000, 250_000].map(Some));
        assert_eq!(baud_of(0), None);
    }
}
