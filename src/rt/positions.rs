//! What a controller tells of where its axes are, from whichever register or report, put together into readings of the
//! seat. Ack thread; pure: told the time; allocates nothing.

use std::sync::Arc;
use std::time::Duration;

use crate::belief::{Reading, Source};
use crate::motion::{MAX_AXES, Pulses, SeatType, in_stroke};
use crate::time::MonoTime;
use crate::wire::PerAxis;

/// How far apart two answers may see an axis at rest, in strokes.
const STILL: f64 = 0.001;
/// For how long an axis has to be seen in one place to be at rest there. What comes in one burst proves nothing.
const REST: Duration = Duration::from_millis(100);
/// Answers further apart say nothing of what was between them.
const APART: Duration = Duration::from_millis(1_200);
/// How far outside its stroke an axis may be told and be at the end of it: rounding, and what a drive at rest swings by.
const OUTSIDE: f64 = 0.002;

/// What one axis told.
#[derive(Debug, Clone, Copy)]
struct Told {
    fraction: f64,
    at: MonoTime,
    /// In which place it has been since when.
    since: (f64, MonoTime),
}

/// The axes of one controller.
#[derive(Debug)]
pub(super) struct Positions {
    seat: Arc<SeatType>,
    /// The place of the first of them in a frame.
    first_slot: usize,
    told: [Option<Told>; MAX_AXES],
    /// The axis, from 0, that told a position outside of its stroke, and which.
    outside: Option<(usize, Pulses)>,
    /// Whether something has told in which order the two words of a position come: the manuals differ, and both may make a
    /// place inside the stroke.
    ordered: bool,
    /// The axes whose last position would be another one inside the stroke in the other order, a bit each.
    ambiguous: u16,
    /// Whether it was homed, and no frame went to it since: all its axes are at 0.
    home: bool,
    by: Source,
}

impl Positions {
    pub(super) const fn new(seat: Arc<SeatType>, first_slot: usize) -> Self {
        let told = [None; MAX_AXES];
        Self {
            seat,
            first_slot,
            told,
            outside: None,
            ordered: false,
            ambiguous: 0,
            home: false,
            by: Source::Registers,
        }
    }

    /// Hears where axes are, from `first` on. A report tells of those alone that have no register: it comes unasked, past frames
    /// that are held back on their way, while an answer comes after all that was sent before what it answers.
    pub(super) fn hear(&mut self, first: usize, positions: &[Pulses], at: MonoTime, by: Source) {
        for (axis, pulses) in (first..self.seat.axes).zip(positions) {
            if by == Source::Report && axis < REGISTERS {
                self.mind_order(axis, *pulses, by);
                continue;
            }
            self.by = by;
            let fraction = self.seat.fraction(*pulses);
            let is_outside = !(-OUTSIDE..=1.0 + OUTSIDE).contains(&fraction);
            if is_outside {
                self.outside = Some((axis, *pulses));
                self.told[axis] = None;
                continue;
            }
            self.outside = self.outside.filter(|(other, _)| *other != axis);
            self.mind_order(axis, *pulses, by);
            let fraction = fraction.clamp(0.0, 1.0);
            let stays = |told: Told| at.since(told.at) <= APART && (told.since.0 - fraction).abs() <= STILL;
            let since = self.told[axis].filter(|told| stays(*told)).map_or((fraction, at), |told| told.since);
            self.told[axis] = Some(Told { fraction, at, since });
        }
    }

    /// A position that only its own order puts inside the stroke settles the order for the whole controller; so does a report,
    /// which has no words, and a seat that is known to be at 0.
    fn mind_order(&mut self, axis: usize, pulses: Pulses, by: Source) {
        let other = Pulses(pulses.0.cast_unsigned().rotate_left(16).cast_signed());
        let stroke = self.seat.stroke_pulses();
        let is_open = by == Source::Registers && other != pulses && in_stroke(other, stroke);
        let bit = 1 << axis;
        self.ambiguous = if is_open { self.ambiguous | bit } else { self.ambiguous & !bit };
        let near_zero = self.home && pulses.0.unsigned_abs() < 1 << 15;
        self.ordered |= by == Source::Report || near_zero || (other != pulses && !is_open);
    }

    /// Whether it tells two places for some axis, and nothing says which of them is true.
    pub(super) const fn is_ambiguous(&self) -> bool {
        self.ambiguous != 0 && !self.ordered
    }

    /// It says that it is home, as it was asked to be: what it said before was of another zero.
    pub(super) fn on_homed(&mut self) {
        self.told = [None; MAX_AXES];
        self.home = true;
    }

    /// A frame went to it: where it stood before says nothing of whether it rests.
    pub(super) const fn on_sent(&mut self) {
        (self.home, self.told) = (false, [None; MAX_AXES]);
    }

    /// The axis, from 0, that is not inside its stroke, and where it says that it is.
    pub(super) const fn outside(&self) -> Option<(usize, Pulses)> {
        self.outside
    }

    /// Its axes, from the first on, as far as it told them; none where it told nothing.
    pub(super) fn told(&self) -> Option<PerAxis<Pulses>> {
        let known = self.told.iter().take_while(|told| told.is_some()).count();
        let pulses = |axis: usize| self.told[axis].map_or(Pulses(0), |told| self.seat.pulses(told.fraction));
        (known > 0).then(|| PerAxis::from_fn(known, pulses))
    }

    /// The seat as it was told last; none while an axis that tells its position has not.
    pub(super) fn reading(&self, now: MonoTime) -> Option<Reading> {
        let mut reading = Reading { pose: [0.0; MAX_AXES], slots: 0, at: now, rests: true, by: self.by };
        if self.is_ambiguous() {
            return None;
        }
        for axis in 0..self.seat.axes.min(MAX_AXES - self.first_slot) {
            let slot = self.first_slot + axis;
            match self.told[axis] {
                Some(told) => {
                    reading.pose[slot] = told.fraction;
                    reading.at = reading.at.min(told.at);
                    reading.rests &= told.at.since(told.since.1) >= REST;
                }
                None if axis < REGISTERS => return None,
                // There is no register for it.
                None if !self.home => continue,
                None => reading.by = Source::Homing,
            }
            reading.slots |= 1 << slot;
        }
        Some(reading)
    }
}

/// Axes that have position registers.
const REGISTERS: usize = 6;

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    fn seat(axes: usize) -> Positions {
        Positions::new(Arc::new(SeatType::bench3(axes)), 0)
    }

    #[test]
    fn a_seat_rests_where_answers_over_a_tenth_of_a_second_see_it() {
        let mut positions = seat(1);
        let looks = [
            (0, 30_000, false),   // the first
            (200, 32_000, false), // it moves
            (201, 32_000, false), // of the same burst
            (401, 32_000, true),
            (601, 32_100, true),
            (801, 35_000, false),
            (5_000, 35_000, false), // what was between nobody knows
            (5_200, 35_000, true),
        ];
        for (at, pulses, rests) in looks {
            positions.hear(0, &[Pulses(pulses)], ms(at), Source::Registers);
            assert_eq!(positions.reading(ms(at)).map(|reading| reading.rests), Some(rests), "at {at} ms");
        }
    }

    #[test]
    fn a_seat_of_six_axes_is_read_once_both_halves_are_and_is_as_old_as_the_older() {
        let mut positions = seat(6);
        positions.hear(3, &[Pulses(4), Pulses(5), Pulses(6)], ms(10), Source::Registers);
        assert_eq!(positions.reading(ms(10)), None);
        positions.hear(0, &[Pulses(1), Pulses(2), Pulses(3)], ms(260), Source::Registers);
        let reading = positions.reading(ms(260)).unwrap();
        assert_eq!((reading.slots, reading.at), (0b11_1111, ms(10)));
        assert!((reading.pose[5] - 6.0 / 300_000.0).abs() < 1e-12);
    }

    #[test]
    fn axes_without_a_register_are_known_from_a_report_or_right_after_homing_alone() {
        let mut positions = seat(8);
        positions.hear(0, &[Pulses(0); 6], ms(0), Source::Registers);
        assert_eq!(positions.reading(ms(0)).unwrap().slots, 0b11_1111);
        positions.on_homed();
        positions.hear(0, &[Pulses(0); 6], ms(100), Source::Registers);
        let homed = positions.reading(ms(100)).unwrap();
        assert_eq!((homed.slots, homed.by), (0xff, Source::Homing));
        positions.on_sent();
        assert_eq!(positions.reading(ms(100)), None, "frames have led them since");
        positions.hear(0, &[Pulses(0); 6], ms(150), Source::Registers);
        assert_eq!(positions.reading(ms(150)).unwrap().slots, 0b11_1111);
        positions.hear(0, &[Pulses(9); 8], ms(200), Source::Report);
        assert_eq!(positions.reading(ms(200)).unwrap().slots, 0xff);
    }

    #[test]
    fn a_position_outside_the_stroke_is_none_and_is_named() {
        let mut positions = seat(2);
        positions.hear(0, &[Pulses(-20), Pulses(300_050)], ms(0), Source::Registers);
        assert_eq!(positions.reading(ms(0)).unwrap().pose[..2], [0.0, 1.0], "rounding is not outside");
        positions.hear(0, &[Pulses(-20_000), Pulses(7)], ms(1), Source::Registers);
        assert_eq!((positions.reading(ms(1)), positions.outside()), (None, Some((0, Pulses(-20_000)))));
        positions.hear(0, &[Pulses(0)], ms(2), Source::Registers);
        assert_eq!(positions.outside(), None);
    }

    #[test]
    fn a_position_that_either_order_of_words_puts_inside_the_stroke_is_none_before_something_tells_the_order()
    {
        // 1 pulse, or 32.8 mm.
        let ambiguous = || {
            let mut positions = seat(2);
            positions.hear(0, &[Pulses(1), Pulses(0)], ms(0), Source::Registers);
            assert!(positions.reading(ms(0)).is_none() && positions.is_ambiguous());
            positions
        };
        let mut told = ambiguous();
        told.hear(0, &[Pulses(1), Pulses(45_000)], ms(1), Source::Registers);
        told.hear(0, &[Pulses(1), Pulses(0)], ms(2), Source::Registers);
        assert!(told.reading(ms(2)).is_some(), "its other axis has told");
        let mut reported = ambiguous();
        reported.hear(0, &[Pulses(1), Pulses(0)], ms(1), Source::Report);
        assert!(reported.reading(ms(1)).is_some());
        let mut homed = ambiguous();
        homed.on_homed();
        homed.hear(0, &[Pulses(1), Pulses(0)], ms(1), Source::Registers);
        assert!(homed.reading(ms(1)).is_some());
        let mut at_zero = seat(2);
        at_zero.hear(0, &[Pulses(0), Pulses(0)], ms(0), Source::Registers);
        assert!(at_zero.reading(ms(0)).is_some(), "both orders say the same");
    }
}
