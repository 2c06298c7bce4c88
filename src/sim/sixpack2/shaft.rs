//! What turns on a motor: where it really is, which its unit does not know, and what it was made to do.
//!
//! Places are microsteps, upwards, from wherever whoever sets it up begins to count; they have nothing to do with the unit's counter.

use std::time::Duration;

use crate::motion::{Measure, Spacing};
use crate::time::{MonoTime, ShowTime};

/// How often places are taken, Hz.
const LOOPS_A_SECOND: f64 = 500.0;

/// An axis on a motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShaftSetup {
    /// Where it is when everything begins.
    pub(crate) start: f64,
    /// The mechanical stops, lower and upper.
    pub(crate) stops: (f64, f64),
    /// Its switch is closed at and below this place; it has none.
    pub(crate) switch: Option<f64>,
    /// A closed switch gives a high level.
    pub(crate) is_high: bool,
    /// The motor counts upwards as the axis goes down.
    pub(crate) is_reversed: bool,
    /// Microsteps a second that it can take at once without losing steps.
    pub(crate) jump: f64,
}

impl Default for ShaftSetup {
    /// 165 mm at 640 microsteps a millimetre, 80 mm up, its switch 5 mm above the lower stop.
    fn default() -> Self {
        let mm = 640.0;
        Self {
            start: 80.0 * mm,
            stops: (-10.0 * mm, 155.0 * mm),
            switch: Some(-5.0 * mm),
            is_high: true,
            is_reversed: false,
            jump: f64::INFINITY,
        }
    }
}

/// The greatest that an axis was made to do, and where it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExecutedMotion {
    /// The lowest place.
    pub(crate) lowest: f64,
    /// The highest.
    pub(crate) highest: f64,
    /// Microsteps a second.
    pub(crate) velocity: f64,
    /// What its motor was asked to change of that at once.
    pub(crate) jump: f64,
    /// A second, by the measure of motion.
    pub(crate) acceleration: f64,
    /// A second, by the measure of motion.
    pub(crate) jerk: f64,
    /// Microsteps that its unit counted and it did not make.
    pub(crate) lost: f64,
}

/// A motor's shaft, and what it has been made to do.
#[derive(Debug, Clone)]
pub(crate) struct Shaft {
    setup: ShaftSetup,
    place: f64,
    /// Asked for, upwards.
    velocity: f64,
    /// Fell out of step, and stands until it is asked for no more than it can take at once.
    is_out_of_step: bool,
    is_blocked: bool,
    is_switch_broken: bool,
    measure: Measure,
    executed: ExecutedMotion,
}

impl Shaft {
    /// At rest.
    pub(crate) fn new(setup: ShaftSetup) -> Self {
        let place = setup.start;
        let executed = ExecutedMotion {
            lowest: place,
            highest: place,
            velocity: 0.0,
            jump: 0.0,
            acceleration: 0.0,
            jerk: 0.0,
            lost: 0.0,
        };
        Self {
            setup,
            place,
            velocity: 0.0,
            is_out_of_step: false,
            is_blocked: false,
            is_switch_broken: false,
            measure: Measure::new(Spacing::at_rate(LOOPS_A_SECOND)),
            executed,
        }
    }

    /// It was asked to turn for so long up to now, by microsteps of the counter a second.
    pub(super) fn turn(&mut self, velocity: f64, span: Duration, at: MonoTime) {
        let velocity = if self.setup.is_reversed { -velocity } else { velocity };
        let jump = (velocity - self.velocity).abs();
        self.velocity = velocity;
        if jump > self.setup.jump {
            self.is_out_of_step = true;
        } else if velocity.abs() <= self.setup.jump {
            self.is_out_of_step = false;
        }
        let asked = self.place + velocity * span.as_secs_f64();
        let stands = self.is_out_of_step || self.is_blocked;
        let place = if stands { self.place } else { asked.clamp(self.setup.stops.0, self.setup.stops.1) };
        self.executed.lost += (asked - place).abs();
        self.executed.jump = self.executed.jump.max(jump);
        self.go(place, at);
    }

    fn go(&mut self, place: f64, at: MonoTime) {
        self.place = place;
        let ns = i64::try_from(at.as_nanos()).unwrap_or(i64::MAX);
        let readings = self.measure.push(ShowTime::from_nanos(ns), place);
        let executed = &mut self.executed;
        (executed.lowest, executed.highest) = (executed.lowest.min(place), executed.highest.max(place));
        executed.velocity = executed.velocity.max(readings.velocity.value.abs());
        executed.acceleration = executed.acceleration.max(readings.acceleration.value.abs());
        executed.jerk = executed.jerk.max(readings.jerk.value.abs());
    }

    /// Its motor stands from now on, whatever it was asked for.
    pub(super) const fn let_go(&mut self) {
        (self.velocity, self.is_out_of_step) = (0.0, false);
    }

    /// The level of its switch; open without one.
    pub(super) fn level(&self) -> bool {
        let is_closed = self.setup.switch.is_some_and(|switch| self.place <= switch);
        (is_closed && !self.is_switch_broken) == self.setup.is_high
    }

    /// Something holds it, or lets go.
    pub(super) const fn block(&mut self, is_blocked: bool) {
        self.is_blocked = is_blocked;
    }

    /// Its switch does not close any more, or does.
    pub(super) const fn break_switch(&mut self, is_broken: bool) {
        self.is_switch_broken = is_broken;
    }

    /// It loses steps above another jump.
    pub(super) const fn set_jump(&mut self, jump: f64) {
        self.setup.jump = jump;
    }

    /// Where it really is.
    pub(crate) const fn place(&self) -> f64 {
        self.place
    }

    /// What it was made to do since the start, or since [`Self::forget`].
    pub(crate) const fn executed(&self) -> ExecutedMotion {
        self.executed
    }

    /// Judges from here on.
    pub(crate) fn forget(&mut self) {
        let kept = Self::new(ShaftSetup { start: self.place, ..self.setup });
        (self.measure, self.executed) = (kept.measure, kept.executed);
    }
}
