//! What a controller tells of where its axes are, from whichever register or report, put together into readings of the
//! seat. Ack thread; pure: told the time; allocates nothing.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use crate::belief::{Reading, Source};
use crate::motion::{MAX_AXES, Pulses, SeatType, in_stroke};
use crate::time::MonoTime;
use crate::wire::{AXES_PER_BLOCK, DP_POSITIONS, PerAxis, in_other_order};

/// How far apart two answers may see an axis at rest, in strokes.
const STILL: f64 = 0.001;
/// For how long an axis has to be seen in one place to be at rest there. What comes in one burst proves nothing.
const REST: Duration = Duration::from_millis(100);
/// So many answers have to see it there. One may be an older one that the network repeats in place of another that it holds back.
const TIMES: u32 = 3;
/// As [`REST`] while the network repeats answers: one of them may be from before a move, and so may the next.
const REST_REPEATED: Duration = Duration::from_millis(500);
/// An answer that comes later than this is none; so long after an answer was repeated others may be.
const ANSWERED_WITHIN: Duration = Duration::from_secs(1);
/// A repeated answer is hardly older than this.
const REPEATED: Duration = Duration::from_millis(300);
/// An answer is lost rather than late after this.
const LATE: Duration = Duration::from_millis(300);
/// Requests that may be open at a time; of more the older ones count.
const OPEN: usize = 8;
/// Answers further apart say nothing of what was between them.
const APART: Duration = Duration::from_millis(1_200);
/// How far outside its stroke an axis may be told and be at the end of it: rounding, and what a drive at rest swings by.
const OUTSIDE: f64 = 0.002;

/// What one axis told.
#[derive(Debug, Clone, Copy)]
struct Told {
    fraction: f64,
    /// When it was read at the earliest.
    at: MonoTime,
    /// In which place it has been, and when it was read there first, at the latest.
    since: (f64, MonoTime),
    /// Whether it was elsewhere before.
    moved: bool,
    /// How many answers have found it there.
    times: u32,
}

/// The axes of one controller.
#[derive(Debug)]
pub(super) struct Positions {
    seat: Arc<SeatType>,
    /// The place of the first of them in a frame.
    first_slot: usize,
    /// The axes that frames lead, of its seat type or not.
    led: usize,
    told: [Option<Told>; MAX_AXES],
    /// The axis, from 0, that told a position outside of its stroke, and which.
    outside: Option<(usize, Pulses)>,
    /// Whether something has told in which order the two words of a position come: the manuals differ, and both may make a
    /// place inside the stroke.
    ordered: bool,
    /// The axes whose last position would be another one inside the stroke in the other order, a bit each.
    ambiguous: u16,
    /// Whether it was homed, no frame went to it since, and none was found elsewhere: all its axes are at 0.
    home: bool,
    by: Source,
    /// When each block of axes was asked for that was not answered yet, oldest first. Answers do not say what they answer: each
    /// is taken for that to the oldest request, and can be no older than that.
    asked: [VecDeque<MonoTime>; BLOCKS],
    /// When the newest answer was made, at the earliest.
    answered: MonoTime,
    /// When the last frame went to it.
    sent: MonoTime,
    /// Until when answers may be repeated.
    repeats_until: MonoTime,
}

impl Positions {
    pub(super) fn new(seat: Arc<SeatType>, first_slot: usize, led: usize) -> Self {
        let told = [None; MAX_AXES];
        Self {
            seat,
            first_slot,
            led,
            told,
            asked: std::array::from_fn(|_| VecDeque::with_capacity(OPEN)),
            answered: MonoTime::default(),
            sent: MonoTime::default(),
            repeats_until: MonoTime::default(),
            outside: None,
            ordered: false,
            ambiguous: 0,
            home: false,
            by: Source::Registers,
        }
    }

    /// Notes that it is asked for the block of axes that begins with that register, if one does.
    pub(super) fn on_asked(&mut self, register: u16, at: MonoTime) {
        if let Some(first) = DP_POSITIONS.iter().position(|start| *start == register) {
            let asked = self.open(first, at);
            if asked.len() < OPEN {
                asked.push_back(at);
            }
        }
    }

    /// Notes that it is asked for all of them.
    pub(super) fn on_all_asked(&mut self, at: MonoTime) {
        for first in (0..self.led.min(REGISTERS)).step_by(AXES_PER_BLOCK) {
            self.on_asked(DP_POSITIONS[first], at);
        }
    }

    /// True if a request has been open for so long that its answer is lost rather than late. Another would be taken for the answer to
    /// it, and so would each after that: it is asked again once nothing is open any more.
    pub(super) fn is_behind(&mut self, now: MonoTime) -> bool {
        (0..REGISTERS)
            .step_by(AXES_PER_BLOCK)
            .any(|first| self.open(first, now).front().is_some_and(|asked| now.since(*asked) > LATE))
    }

    /// The requests for a block of axes to which an answer may still come.
    fn open(&mut self, first: usize, at: MonoTime) -> &mut VecDeque<MonoTime> {
        let asked = &mut self.asked[first / AXES_PER_BLOCK];
        while asked.front().is_some_and(|asked| at.since(*asked) > ANSWERED_WITHIN) {
            asked.pop_front();
        }
        asked
    }

    /// True if no further request finds a place, since answers are lost.
    pub(super) fn is_full(&mut self, now: MonoTime) -> bool {
        (0..REGISTERS).step_by(AXES_PER_BLOCK).any(|first| self.open(first, now).len() == OPEN)
    }

    /// Hears an answer: where axes are, from `first` on. One that nobody waits for tells of no place. Gives what it tells by itself.
    pub(super) fn answer(&mut self, first: usize, positions: &[Pulses], at: MonoTime) -> Option<Reading> {
        let asked = self.open(first, at);
        let newest = *asked.back()?;
        let made = asked.pop_front()?;
        self.answered = self.answered.max(made);
        self.hear(first, positions, made, at, Source::Registers);
        // Whether a seat follows its frames is a question of now: it is looked at once more than needs be where this is an older answer.
        let made = if self.may_be_repeated(at) { newest.before(REPEATED) } else { newest };
        Some(self.in_passing(first, positions, made))
    }

    /// What one answer tells of the axes from `first` on, of however many the seat has.
    fn in_passing(&self, first: usize, positions: &[Pulses], made: MonoTime) -> Reading {
        let own = self.seat.axes.min(MAX_AXES - self.first_slot);
        let mut reading = Reading {
            slots: 0,
            rests: false,
            by: Source::Passing,
            ..Reading::at_rest([0.0; MAX_AXES], made)
        };
        for (axis, pulses) in (first..own).zip(positions) {
            reading.pose[self.first_slot + axis] = self.seat.fraction(*pulses);
            reading.slots |= 1 << (self.first_slot + axis);
        }
        reading
    }

    /// True while any answer may be an older one that the network repeats.
    fn may_be_repeated(&self, at: MonoTime) -> bool {
        at < self.repeats_until
    }

    /// The network repeats answers: for a while each may be from before a move.
    pub(super) fn on_repeated(&mut self, at: MonoTime) {
        self.repeats_until = at + ANSWERED_WITHIN;
    }

    /// Hears a report: it tells of those axes alone that have no register, since it comes unasked, past frames that are held back on
    /// their way. What comes after an answer was made after it.
    pub(super) fn report(&mut self, positions: &[Pulses], at: MonoTime) {
        for (axis, pulses) in positions.iter().enumerate().take(self.seat.axes.min(REGISTERS)) {
            self.hold_against(axis, *pulses);
        }
        if let Some(others) = positions.get(REGISTERS..) {
            self.hear(REGISTERS, others, self.answered, at, Source::Report);
        }
    }

    /// Hears where axes were between `made` and `at`.
    fn hear(&mut self, first: usize, positions: &[Pulses], made: MonoTime, at: MonoTime, by: Source) {
        for (axis, pulses) in (first..self.led).zip(positions) {
            let fraction = self.seat.fraction(*pulses);
            let is_own = axis < self.seat.axes;
            // Frames would lead an axis that its seat type does not have to 0 at once: all of its stroke is there.
            let end = if is_own { 1.0 } else { 0.0 };
            let is_outside = !(-OUTSIDE..=end + OUTSIDE).contains(&fraction);
            let other = self.outside.filter(|(other, _)| *other != axis);
            self.outside = if is_outside { Some((axis, *pulses)) } else { other };
            // What may be from before the last frame says nothing of where it comes to rest.
            if !is_own || made < self.sent {
                continue;
            }
            self.by = by;
            if is_outside {
                self.told[axis] = None;
                continue;
            }
            if by == Source::Registers {
                self.mind_order(axis, *pulses);
            }
            let fraction = fraction.clamp(0.0, 1.0);
            self.home &= fraction <= STILL;
            let stays = |told: Told| made.since(told.at) <= APART && (told.since.0 - fraction).abs() <= STILL;
            let before = self.told[axis];
            let (since, moved, times) = match before {
                Some(told) if stays(told) => (told.since, told.moved, told.times.saturating_add(1)),
                _ => ((fraction, at), before.is_some(), 1),
            };
            self.told[axis] = Some(Told { fraction, at: made, since, moved, times });
        }
    }

    /// A position that only its own order puts inside the stroke settles the order for the whole controller; so does a seat that is
    /// known to be at 0.
    fn mind_order(&mut self, axis: usize, pulses: Pulses) {
        let other = in_other_order(pulses);
        let is_open = other != pulses && in_stroke(other, self.seat.stroke_pulses());
        let bit = 1 << axis;
        self.ambiguous = if is_open { self.ambiguous | bit } else { self.ambiguous & !bit };
        let near_zero = self.home && pulses.0.unsigned_abs() < 1 << 15;
        self.ordered |= near_zero || (other != pulses && !is_open);
    }

    /// A report has no words: one that tells the place that the registers told, and not what they would tell in the other order,
    /// settles it as well.
    fn hold_against(&mut self, axis: usize, reported: Pulses) {
        let Some(told) = self.told[axis] else { return };
        let told = self.seat.pulses(told.fraction);
        let apart = |one: Pulses| (self.seat.fraction(one) - self.seat.fraction(reported)).abs();
        self.ordered |= apart(told) <= STILL && apart(in_other_order(told)) > STILL;
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
    pub(super) const fn on_sent(&mut self, at: MonoTime) {
        (self.home, self.told, self.sent) = (false, [None; MAX_AXES], at);
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
        let (pose, by) = ([0.0; MAX_AXES], self.by);
        let mut reading = Reading { pose, slots: 0, at: now, rests: true, moves: false, by };
        let is_beyond = self.outside.is_some_and(|(axis, _)| axis >= self.seat.axes);
        if self.is_ambiguous() || is_beyond {
            return None;
        }
        let rest = if self.may_be_repeated(now) { REST_REPEATED } else { REST };
        for axis in 0..self.seat.axes.min(MAX_AXES - self.first_slot) {
            let slot = self.first_slot + axis;
            match self.told[axis] {
                Some(told) => {
                    reading.pose[slot] = told.fraction;
                    reading.at = reading.at.min(told.at);
                    let rests = told.times >= TIMES && told.at.since(told.since.1) >= rest;
                    reading.rests &= rests;
                    reading.moves |= told.moved && !rests;
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

/// Axes that have position registers, and how many blocks of them.
const REGISTERS: usize = DP_POSITIONS.len();
const BLOCKS: usize = REGISTERS.div_ceil(AXES_PER_BLOCK);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::motion_channel_and_slots;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    /// It is asked, and answers at once.
    fn look(positions: &mut Positions, first: usize, told: &[Pulses], at: u64) {
        for (index, block) in told.chunks(AXES_PER_BLOCK).enumerate() {
            positions.on_asked(DP_POSITIONS[first + index * AXES_PER_BLOCK], ms(at));
            positions.answer(first + index * AXES_PER_BLOCK, block, ms(at));
        }
    }

    fn seat(axes: usize) -> Positions {
        Positions::new(Arc::new(SeatType::bench3(axes)), 0, motion_channel_and_slots(axes).1)
    }

    #[test]
    fn a_seat_rests_where_three_answers_over_a_tenth_of_a_second_see_it() {
        let mut positions = seat(1);
        let looks = [
            (0, 30_000, false),   // the first
            (200, 32_000, false), // it moves
            (201, 32_000, false), // of the same burst
            (202, 32_000, false),
            (401, 32_000, true),
            (601, 32_100, true),
            (801, 35_000, false),
            (5_000, 35_000, false), // what was between nobody knows
            (5_200, 35_000, false), // one of the two may be an older one
            (5_400, 35_000, true),
        ];
        for (at, pulses, rests) in looks {
            look(&mut positions, 0, &[Pulses(pulses)], at);
            assert_eq!(positions.reading(ms(at)).map(|reading| reading.rests), Some(rests), "at {at} ms");
        }
    }

    #[test]
    fn a_seat_of_six_axes_is_read_once_both_halves_are_and_is_as_old_as_the_older() {
        let mut positions = seat(6);
        look(&mut positions, 3, &[Pulses(4), Pulses(5), Pulses(6)], 10);
        assert_eq!(positions.reading(ms(10)), None);
        look(&mut positions, 0, &[Pulses(1), Pulses(2), Pulses(3)], 260);
        let reading = positions.reading(ms(260)).unwrap();
        assert_eq!((reading.slots, reading.at), (0b11_1111, ms(10)));
        assert!((reading.pose[5] - 6.0 / 300_000.0).abs() < 1e-12);
    }

    #[test]
    fn axes_without_a_register_are_known_from_a_report_or_right_after_homing_alone() {
        let mut positions = seat(8);
        look(&mut positions, 0, &[Pulses(0); 6], 0);
        assert_eq!(positions.reading(ms(0)).unwrap().slots, 0b11_1111);
        positions.on_homed();
        look(&mut positions, 0, &[Pulses(0); 6], 100);
        let homed = positions.reading(ms(100)).unwrap();
        assert_eq!((homed.slots, homed.by), (0xff, Source::Homing));
        positions.on_sent(ms(100));
        assert_eq!(positions.reading(ms(100)), None, "frames have led them since");
        look(&mut positions, 0, &[Pulses(0); 6], 150);
        assert_eq!(positions.reading(ms(150)).unwrap().slots, 0b11_1111);
        positions.report(&[Pulses(9); 8], ms(200));
        assert_eq!(positions.reading(ms(200)).unwrap().slots, 0xff);
    }

    #[test]
    fn an_answer_is_no_older_than_the_oldest_request_that_is_open_whichever_it_answers() {
        let mut positions = seat(1);
        look(&mut positions, 0, &[Pulses(7)], 0);
        positions.on_asked(DP_POSITIONS[0], ms(250)); // held back on its way
        positions.on_asked(DP_POSITIONS[0], ms(500));
        positions.answer(0, &[Pulses(7)], ms(501));
        assert_eq!(positions.reading(ms(501)).unwrap().at, ms(250));
        positions.answer(0, &[Pulses(7)], ms(502));
        assert_eq!(positions.reading(ms(502)).unwrap().at, ms(500));
        // One is lost: after a second nobody waits for its answer.
        positions.on_asked(DP_POSITIONS[0], ms(600));
        positions.on_asked(DP_POSITIONS[0], ms(1_650));
        positions.answer(0, &[Pulses(7)], ms(1_651));
        assert_eq!(positions.reading(ms(1_651)).unwrap().at, ms(1_650));
    }

    #[test]
    fn after_an_outage_a_seat_is_asked_again_once_no_request_from_before_is_open() {
        let mut positions = seat(1);
        let asked: Vec<u64> = (0..20)
            .map(|round| 200 * round)
            .filter(|at| {
                let asks = !positions.is_behind(ms(*at));
                if asks {
                    positions.on_asked(DP_POSITIONS[0], ms(*at));
                }
                asks
            })
            .collect();
        assert_eq!(asked, [0, 200, 1_400, 1_600, 2_800, 3_000]);
    }

    #[test]
    fn an_answer_that_nobody_waits_for_tells_no_place_and_a_seat_is_looked_at_for_longer_then() {
        let mut positions = seat(1);
        look(&mut positions, 0, &[Pulses(7)], 0);
        assert_eq!(positions.answer(0, &[Pulses(90_000)], ms(90)), None);
        positions.on_repeated(ms(90));
        assert_eq!(positions.told().unwrap()[0], Pulses(7));
        for (at, rests) in [(200, false), (450, false), (501, true)] {
            look(&mut positions, 0, &[Pulses(7)], at);
            assert_eq!(positions.reading(ms(at)).unwrap().rests, rests, "at {at} ms");
        }
    }

    #[test]
    fn a_report_is_as_old_as_the_answer_before_it() {
        let mut positions = seat(8);
        look(&mut positions, 0, &[Pulses(0); 6], 100);
        positions.report(&[Pulses(0); 8], ms(900));
        assert_eq!(positions.reading(ms(900)).unwrap().at, ms(100));
    }

    #[test]
    fn a_position_outside_the_stroke_is_none_and_is_named() {
        let mut positions = seat(2);
        look(&mut positions, 0, &[Pulses(-20), Pulses(300_050)], 0);
        assert_eq!(positions.reading(ms(0)).unwrap().pose[..2], [0.0, 1.0], "rounding is not outside");
        look(&mut positions, 0, &[Pulses(-20_000), Pulses(7)], 1);
        assert_eq!((positions.reading(ms(1)), positions.outside()), (None, Some((0, Pulses(-20_000)))));
        look(&mut positions, 0, &[Pulses(0)], 2);
        assert_eq!(positions.outside(), None);
    }

    #[test]
    fn a_seat_with_an_axis_beyond_those_of_its_type_that_is_not_at_0_is_nowhere() {
        let mut positions = seat(2);
        look(&mut positions, 0, &[Pulses(7), Pulses(7), Pulses(90_000)], 0);
        assert_eq!((positions.reading(ms(0)), positions.outside()), (None, Some((2, Pulses(90_000)))));
        look(&mut positions, 0, &[Pulses(7), Pulses(7), Pulses(0)], 1);
        assert!(positions.reading(ms(1)).is_some());
        let mut many = seat(8);
        look(&mut many, 0, &[Pulses(0); 6], 0);
        many.report(
            &[
                Pulses(0),
                Pulses(0),
                Pulses(0),
                Pulses(0),
                Pulses(0),
                Pulses(0),
                Pulses(0),
                Pulses(0),
                Pulses(900),
            ],
            ms(1),
        );
        assert_eq!(many.outside(), Some((8, Pulses(900))));
    }

    #[test]
    fn a_position_that_either_order_of_words_puts_inside_the_stroke_is_none_before_something_tells_the_order()
    {
        // 1 pulse, or 32.8 mm.
        let ambiguous = || {
            let mut positions = seat(2);
            look(&mut positions, 0, &[Pulses(1), Pulses(0)], 0);
            assert!(positions.reading(ms(0)).is_none() && positions.is_ambiguous());
            positions
        };
        let mut told = ambiguous();
        look(&mut told, 0, &[Pulses(1), Pulses(45_000)], 1);
        look(&mut told, 0, &[Pulses(1), Pulses(0)], 2);
        assert!(told.reading(ms(2)).is_some(), "its other axis has told");
        let mut reported = ambiguous();
        reported.report(&[Pulses(1), Pulses(0)], ms(1));
        assert!(reported.reading(ms(1)).is_some());
        let mut reversed = ambiguous();
        reversed.report(&[Pulses(1 << 16), Pulses(0)], ms(1));
        look(&mut reversed, 0, &[Pulses(1), Pulses(0)], 2);
        assert!(
            reversed.reading(ms(2)).is_none(),
            "the report says that the registers come the other way round"
        );
        let mut homed = ambiguous();
        homed.on_homed();
        look(&mut homed, 0, &[Pulses(1), Pulses(0)], 1);
        assert!(homed.reading(ms(1)).is_some());
        let mut at_zero = seat(2);
        look(&mut at_zero, 0, &[Pulses(0), Pulses(0)], 0);
        assert!(at_zero.reading(ms(0)).is_some(), "both orders say the same");
    }
}
