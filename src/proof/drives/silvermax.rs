//! What a SilverMax executes: the very segments that a play would send, run by the model of the drive.

use super::super::violation::DriveBreach;
use super::course::{WantedCourse, signed};
use super::{Driven, Found, MostExecuted, Roughness, Worst, below};
use crate::drive::{DriveCourse, DriveUnits, Knots, Segment, SegmentFit, TICK_NS};

/// How far outside its stroke an axis may be: counts that rounding makes.
const ROUNDING: f64 = 2.0;

/// Runs the course; none where no such drive counts as the seat does.
pub(super) fn execute(
    driven: &Driven<'_>,
    course: &WantedCourse,
    found: &mut Vec<Found>,
) -> Option<MostExecuted> {
    let geometry = driven.subject.geometry();
    let Some(units) = DriveUnits::of(geometry.pulses_per_rev) else {
        let breach = DriveBreach::Counts { seat: driven.subject.seat(), counts: geometry.pulses_per_rev };
        driven.of_seat(breach, found);
        return None;
    };
    let mut run = DriveRun::new(driven, course, units);
    let slot = &driven.subject.slot;
    let at_first = slot.pulses(course.places[0]).0;
    let mut fit = SegmentFit::at_rest(units, Knots::new(driven.link.period), driven.ends(), at_first);
    driven.middles(course, std::convert::identity, |middle| {
        if let Some(segment) = fit.push(slot.low_pulses + middle.position * slot.stroke_pulses) {
            run.take(segment);
        }
    });
    run.outside(found);
    Some(run.most)
}

/// A drive on its way through a cue.
struct DriveRun<'a> {
    driven: &'a Driven<'a>,
    course: &'a WantedCourse,
    at_knot: DriveCourse,
    /// Since the first sample.
    ticks: i64,
    /// The next sample to be compared.
    next: usize,
    /// Of the segment before, in the axis's unit.
    acceleration: f64,
    most: MostExecuted,
    /// The farthest outside that it would stop, where its link died, and its speed there.
    stop: Worst,
    speed: f64,
    /// The axis's unit in a count.
    per_count: f64,
    per_unit: f64,
}

impl<'a> DriveRun<'a> {
    fn new(driven: &'a Driven<'a>, course: &'a WantedCourse, units: DriveUnits) -> Self {
        let (axis, slot) = (driven.subject.geometry(), &driven.subject.slot);
        let shaken = driven.is_shaken();
        let velocity = if shaken { axis.shaken_velocity() } else { axis.max_velocity };
        let acceleration = if shaken { axis.shaken_acceleration() } else { axis.max_acceleration };
        // Nothing but the drive makes the vibration, so both are in what is measured, and the sum has its own limits.
        let roughness = Roughness::Segments { acceleration: below(acceleration), jerk: below(axis.max_jerk) };
        let most = MostExecuted::at_rest(driven, axis.place(course.places[0]), velocity, roughness);
        let per_count = axis.stroke() / slot.stroke_pulses;
        let at_knot = DriveCourse::at_rest(units, slot.pulses(course.places[0]).0);
        let per_unit = per_count / units.per_count() / (f64::from(TICK_NS) * 1e-9);
        Self {
            driven,
            course,
            at_knot,
            ticks: 0,
            next: 0,
            acceleration: 0.0,
            most,
            stop: below(0.0),
            speed: 0.0,
            per_count,
            per_unit,
        }
    }

    /// Show time at so many ticks, nanoseconds.
    fn at(&self, ticks: i64) -> i64 {
        self.course.from + ticks * i64::from(TICK_NS)
    }

    fn take(&mut self, segment: Segment) {
        let (until, begun) = (self.ticks + i64::from(segment.ticks), self.at_knot);
        while self.next < self.course.places.len() && self.course.at(self.next) < self.at(until) {
            self.compare(segment);
            self.next += 1;
        }
        self.at_knot = begun.after(segment);
        self.ticks = until;
        self.rough(begun.velocity(), segment.ticks);
        self.brake();
    }

    /// Where the drive is at a sample, and how far beside it.
    #[expect(clippy::cast_precision_loss, reason = "within a segment")]
    fn compare(&mut self, segment: Segment) {
        let at = self.course.at(self.next);
        let since = at - self.at(self.ticks);
        let whole = u32::try_from(since / i64::from(TICK_NS)).unwrap_or(0);
        let part = (since % i64::from(TICK_NS)) as f64 / f64::from(TICK_NS);
        // At 240 mm/s a tick is 0.03 mm, so between ticks, too.
        let (here, then) = (self.at_knot.within(segment, whole), self.at_knot.within(segment, whole + 1));
        let counts = here.position() + part * (then.position() - here.position());
        let wanted = (0..=self.course.end).contains(&at).then_some(self.course.places[self.next]);
        self.most.be_at(self.driven, at, self.place(counts), wanted);
    }

    fn place(&self, counts: f64) -> f64 {
        let slot = &self.driven.subject.slot;
        self.driven.subject.geometry().low + (counts - slot.low_pulses) * self.per_count
    }

    // A third difference over slices is a mean of the steps, so the steps alone are as strict.
    /// Velocity at the knot, acceleration of the segment, step from the one before.
    #[expect(clippy::cast_precision_loss, reason = "velocities are within full scale")]
    fn rough(&mut self, before: i64, ticks: u32) {
        let (at, driven) = (self.at(self.ticks), self.driven);
        let velocity = self.at_knot.velocity() as f64 * self.per_unit;
        driven.larger(&mut self.most.velocity, velocity.abs(), at);
        let span = f64::from(ticks) * f64::from(TICK_NS) * 1e-9;
        let now = (velocity - before as f64 * self.per_unit) / span;
        let step = (now - self.acceleration).abs();
        self.acceleration = now;
        if let Roughness::Segments { acceleration, jerk } = &mut self.most.roughness {
            driven.larger(acceleration, now.abs(), at);
            driven.larger(jerk, step / driven.link.period.as_secs_f64(), at - signed(driven.link.period));
        }
    }

    /// Where the axis would stop if nothing came after this knot: the drive ramps by the greatest acceleration then.
    #[expect(clippy::cast_precision_loss, reason = "velocities are within full scale")]
    fn brake(&mut self) {
        let axis = self.driven.subject.geometry();
        let velocity = self.at_knot.velocity() as f64 * self.per_unit;
        // In the middle of a slice it would stop between where it stops from its ends: the brake is the harder.
        let rest =
            self.place(self.at_knot.position()) + velocity * velocity.abs() / (2.0 * axis.max_acceleration);
        let past = (rest - axis.high).max(axis.low - rest);
        let (before, at) = (self.stop.value, self.at(self.ticks));
        self.driven.larger(&mut self.stop, past, at);
        if self.stop.value > before {
            self.speed = velocity.abs();
        }
    }

    /// Whether it leaves the stroke, or would.
    fn outside(&self, found: &mut Vec<Found>) {
        let (driven, axis) = (self.driven, self.driven.subject.geometry());
        let (low, high, slack) = (axis.low, axis.high, ROUNDING * self.per_count);
        let met = [self.most.lowest, self.most.highest];
        // Soft limits lie a margin outside and are no matter of the cue.
        let past = met.iter().find(|met| met.value < low - slack || met.value > high + slack);
        if let Some(&Worst { value: place, at, .. }) = past {
            let breach = DriveBreach::PastStroke { on: driven.on(at), place, low, high };
            found.push(driven.found(at, breach));
        } else if self.stop.value > slack {
            let (missing, at, speed) = (self.stop.value, self.stop.at, self.speed);
            let breach = DriveBreach::NoRoomToBrake { on: driven.on(at), speed, missing };
            found.push(driven.found(at, breach));
        }
    }
}
