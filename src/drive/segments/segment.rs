//! One segment of the timed queue of a SilverMax (command reference, IMW, page 95), in the drive's units.

/// Full scale of a drive's velocity and position.
const FULL_SCALE: i32 = i32::MAX;

/// The least acceleration that a drive takes (register 21).
pub(super) const LEAST_ACCELERATION: u32 = 2;

/// The greatest acceleration that a drive takes.
pub(super) const MOST_ACCELERATION: u32 = 0x3fff_ffff;

/// What a drive does for so many of its ticks: it ramps at the acceleration to the velocity, then holds that.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Segment {
    /// How long it lasts, ticks of 120 µs; 0 for the last, which runs on to its position as an ordinary move.
    pub(crate) ticks: u32,
    /// Full scale, its sign that of the velocity at the end; where it ends at rest, the place, counts.
    pub(crate) position: i32,
    /// Velocity units a tick, at least 2.
    pub(crate) acceleration: u32,
    /// The velocity at the end, without its sign; where it ends at rest the greatest on the way. Never below 0.
    pub(crate) velocity: i32,
}

/// How a segment ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// In motion: at this velocity, positive upwards; never 0.
    Moving(i32),
    /// At rest, at this place in counts.
    AtRest(i32),
}

impl Segment {
    /// One that ends in motion. A drive tells the direction by the position, so that 0 has none: there the velocity is 1.
    #[must_use]
    pub(crate) fn moving(ticks: u32, acceleration: u32, velocity: i32) -> Self {
        let position = if velocity < 0 { i32::MIN } else { FULL_SCALE };
        let velocity = velocity.saturating_abs().max(1);
        Self { ticks, position, acceleration: acceleration.max(LEAST_ACCELERATION), velocity }
    }

    /// One that ends at rest at `position`, no faster than `velocity` on the way: 0 only where it is there already.
    #[must_use]
    pub(crate) fn to_rest(ticks: u32, position: i32, acceleration: u32, velocity: i32) -> Self {
        // Full scale would be read as motion.
        let position = position.clamp(i32::MIN + 1, FULL_SCALE - 1);
        let acceleration = acceleration.max(LEAST_ACCELERATION);
        Self { ticks, position, acceleration, velocity: velocity.saturating_abs() }
    }

    /// One that stays where it is.
    #[must_use]
    pub(crate) fn resting(ticks: u32, position: i32) -> Self {
        Self::to_rest(ticks, position, LEAST_ACCELERATION, 0)
    }

    /// True if it ends at rest.
    #[must_use]
    pub(crate) const fn is_at_rest(&self) -> bool {
        matches!(self.end(), End::AtRest(_))
    }

    /// How it ends.
    #[must_use]
    pub(crate) const fn end(&self) -> End {
        match self.position {
            FULL_SCALE => End::Moving(self.velocity),
            i32::MIN => End::Moving(-self.velocity),
            position => End::AtRest(position),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_position_of_a_moving_end_is_full_scale_by_its_direction() {
        let (up, down) = (Segment::moving(833, 64_450, 53_686_850), Segment::moving(333, 2, -7));
        assert_eq!((up.position, up.velocity), (2_147_483_647, 53_686_850));
        assert_eq!((down.position, down.velocity), (-2_147_483_648, 7));
        assert_eq!((up.end(), down.end()), (End::Moving(53_686_850), End::Moving(-7)));
    }

    #[test]
    fn standing_still_in_mid_course_is_velocity_1_as_0_has_no_direction() {
        assert_eq!(Segment::moving(10, 5, 0).end(), End::Moving(1));
    }

    #[test]
    fn whatever_it_is_told_it_is_something_that_a_drive_takes() {
        assert_eq!(Segment::moving(1, 0, i32::MIN).end(), End::Moving(-i32::MAX));
        assert_eq!(Segment::moving(1, 0, 5).acceleration, 2);
        assert_eq!(Segment::to_rest(1, i32::MAX, 3, 4).end(), End::AtRest(i32::MAX - 1));
        assert_eq!(Segment::resting(250, 20_000), Segment::to_rest(250, 20_000, 2, 0));
    }
}
