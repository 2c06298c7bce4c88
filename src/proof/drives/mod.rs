//! Proves what serial drives execute of a cue: what is fitted for them at the rate of their link, after rounding to their
//! ticks and units. Where [`super::prove`] judges the poses, this judges the course that the drive makes of them.

mod course;
mod silvermax;
mod sixpack;
#[cfg(test)]
mod tests;

use std::time::Duration;

use super::axis::Subject;
use super::violation::{DriveBreach, OnDrive, OverLimit};
use super::{Breach, Found, Quantity, SLACK, Terms, Violation, Worst, on_threads, placed, subjects};
use crate::config::drive::MAX_DEVIATION_MM;
use crate::cue::{FAULTS_TOLD, Vibration};
use crate::drive::{Lag, Middle, Middles, Shaker};
use crate::motion::SeatAxis;
use crate::time::ShowTime;
use crate::timeline::{Figure, Timeline};
use crate::wire::sixpack2::greatest_divider;
use course::{WantedCourse, edges, standing};

/// Slices fall on a cue as its play begins, and a trim moves them: the course is run with so many beginnings, evenly over a slice.
const PHASES: u32 = 4;

/// A way to play to serial drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveTerms {
    /// Which family, and what of its settings counts.
    pub(crate) family: DrivenBy,
    /// From one segment or target of an axis to the next.
    pub(crate) period: Duration,
    /// The farthest that a drive may be beside the cue, in the axis's unit.
    pub(crate) max_deviation: f64,
    /// Level of vibration, on top of that of the terms, 0 to 1.
    pub(crate) shake: f64,
}

impl DriveTerms {
    /// SilverMax units that are told a segment each `period`, with vibration.
    #[must_use]
    pub fn silvermax(period: Duration) -> Self {
        Self { family: DrivenBy::SilverMax, period, max_deviation: MAX_DEVIATION_MM, shake: 1.0 }
    }
}

/// A family of serial drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum DrivenBy {
    /// Segments.
    SilverMax,
    /// Targets, on the fly.
    SixPack {
        /// The divider of the clock.
        clock_divider: u8,
        /// How soft motors follow; `None` for the least that lets the seat's full speed jump no further than it may.
        propdiv: Option<u8>,
        /// The most that a motor's speed may change at once, in the axis's unit a second; what the acceleration of the seat makes in
        /// a period, where nobody says more.
        jump: Option<f64>,
    },
}

/// What a drive executes at most of one axis of a cue; all in the axis's unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DriveAxisProof {
    /// The axis of the cue, from 0.
    pub(crate) axis: usize,
    /// The axis of a seat that it was judged for.
    pub(crate) on: SeatAxis,
    /// How far it is beside the cue.
    pub(crate) deviation: Worst,
    /// The lowest position.
    pub(crate) lowest: Figure,
    /// The highest position.
    pub(crate) highest: Figure,
    /// Velocity.
    pub(crate) velocity: Worst,
    /// How rough it is.
    pub(crate) roughness: Roughness,
}

/// How rough the course of a drive is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Roughness {
    /// Of segments: exact for each, and steps of the acceleration over a period.
    Segments {
        /// Acceleration.
        acceleration: Worst,
        /// Jerk.
        jerk: Worst,
    },
    /// Of targets: the greatest change of speed at once.
    Jumps(Worst),
}

/// What drives execute of a cue, one entry for each axis on each different seat, and what of it may not be.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveProof {
    /// One entry for each axis on each different seat.
    pub(crate) axes: Vec<DriveAxisProof>,
    /// What is broken, in order of show time; the first [`FAULTS_TOLD`].
    pub(crate) violations: Vec<Violation>,
    /// How many there are beyond those.
    pub(crate) more: u64,
}

/// Proves a cue for serial drives. Takes time in proportion to its length.
///
/// What passes at a level passes at each below it: a fit is linear in the poses, and the level draws these towards one that is inside
/// the stroke, so places, speeds, accelerations, steps of them and the distance from the cue shrink with it. The way of a brake
/// shrinks by its square. What is rounded to counts and ticks stays as it is, and so does not grow. The ends of the stroke, where
/// a fit is held, draw away from it.
#[must_use]
pub fn prove_driven(timeline: &Timeline, terms: &Terms, link: &DriveTerms) -> DriveProof {
    let mut found = Vec::new();
    let prove = |subject: &Subject<'_>, found: &mut Vec<Found>| Driven { subject, terms, link }.prove(found);
    let axes = on_threads(&subjects(timeline, terms), &mut found, prove).into_iter().flatten().collect();
    // What no cue has a part in is told once, whichever axes it is met on.
    let mut told = Vec::new();
    found.retain(|one| {
        let is_new = one.axis.is_some() || !told.contains(&one.breach);
        told.extend((one.axis.is_none() && is_new).then(|| one.breach.clone()));
        is_new
    });
    found.sort_by_key(|one| one.at);
    let more = found.len().saturating_sub(FAULTS_TOLD) as u64;
    found.truncate(FAULTS_TOLD);
    let violations = found.into_iter().map(|one| placed(timeline, one)).collect();
    DriveProof { axes, violations, more }
}

/// The least rate of a link, in steps of a tenth and up to `most` Hz, at which a cue is not refused that `proof` refuses; none
/// where there is none, or where the rate is not what is wrong.
#[must_use]
pub(crate) fn rate_that_fits(
    proof: &DriveProof,
    timeline: &Timeline,
    terms: &Terms,
    link: &DriveTerms,
    most: f64,
) -> Option<f64> {
    // Proofs of a long film take a while: none is made that cannot pass.
    let is_of_rate = |one: &Violation| matches!(&one.breach, Breach::Drive(drive) if drive.is_of_rate());
    if !proof.violations.iter().all(is_of_rate) {
        return None;
    }
    let mut hz = link.period.as_secs_f64().recip();
    loop {
        // By tenths of itself: a few proofs up to any rate.
        hz = (11.0 * hz).ceil() / 10.0;
        if hz > most {
            return None;
        }
        let faster = DriveTerms { period: Duration::from_secs_f64(hz.recip()), ..*link };
        if prove_driven(timeline, terms, &faster).violations.is_empty() {
            return Some(hz);
        }
    }
}

/// Where a cue begins or ends in motion, for axes that are led ahead of it by slices of a `period`: those stand there, as they have
/// nothing else to be led to.
#[must_use]
pub(crate) fn in_motion(timeline: &Timeline, terms: &Terms, period: Duration) -> Vec<Violation> {
    let of_axis = |subject: &Subject<'_>| {
        let (first, last, end) = edges(subject);
        let (axis, moves) = (subject.axis, standing(subject.slot.limits, period));
        let found = |edge, row, at, velocity: f64| {
            let (hz, at) = (period.as_secs_f64().recip(), ShowTime::from_nanos(at));
            let on = OnDrive { unit: subject.geometry().unit, seat: subject.seat(), hz, at };
            let speed = velocity.abs() * subject.geometry().stroke();
            let breach = Breach::Drive(DriveBreach::InMotion { on, edge, row, speed });
            let found = Found { at, axis: Some(axis), column: format!("a{}", axis + 1), breach };
            (velocity.abs() > moves).then_some(found)
        };
        [found("begins", "first", 0, first.velocity), found("ends", "last", end, last.velocity)]
    };
    let found = subjects(timeline, terms).iter().flat_map(of_axis).flatten().collect::<Vec<_>>();
    found.into_iter().map(|one| placed(timeline, one)).collect()
}

/// One axis on its way to a drive.
struct Driven<'a> {
    subject: &'a Subject<'a>,
    terms: &'a Terms,
    link: &'a DriveTerms,
}

impl Driven<'_> {
    fn prove(&self, found: &mut Vec<Found>) -> Option<DriveAxisProof> {
        // An axis that never vibrates costs no swing.
        let shake = self.is_shaken().then_some(self.link.shake);
        let (mut most, begun): (Option<MostExecuted>, _) = (None, found.len());
        for phase in 0..PHASES {
            let sooner = self.link.period * phase / PHASES;
            let (tick, slice) = (self.terms.rate.period(), self.link.period);
            let executed =
                self.execute(&WantedCourse::of(self.subject, tick, slice, sooner, shake), found)?;
            // What leaves the stroke by one of them mostly does by all.
            found.truncate(begun + 1);
            most = Some(most.map_or(executed, |most| most.and(executed)));
        }
        let most = most?;
        self.judge(&most, found);
        self.too_quick(found);
        Some(self.executed(&most))
    }

    fn execute(&self, course: &WantedCourse, found: &mut Vec<Found>) -> Option<MostExecuted> {
        match self.link.family {
            DrivenBy::SilverMax => silvermax::execute(self, course, found),
            DrivenBy::SixPack { clock_divider, propdiv, jump } => {
                let axis = self.subject.geometry();
                let jump = jump.unwrap_or(axis.max_acceleration * self.link.period.as_secs_f64());
                Some(sixpack::execute(self, course, self.lag(clock_divider, propdiv, jump, found)?, jump))
            }
        }
    }

    /// What the axis does in the middle of each slice, of poses as a play would push them, each in the unit that `scale` makes of strokes.
    fn middles(&self, course: &WantedCourse, scale: impl Fn(f64) -> f64, mut take: impl FnMut(Middle)) {
        let first = scale(course.places[0]);
        let mut middles = Middles::at_rest(self.terms.rate.period(), self.link.period, first);
        for pose in course.poses() {
            middles.push(scale(pose));
            while let Some(middle) = middles.next() {
                take(middle);
            }
        }
    }

    /// The ends of the stroke in pulses, the lower first.
    fn ends(&self) -> (f64, f64) {
        let slot = &self.subject.slot;
        (slot.low_pulses, slot.low_pulses + slot.stroke_pulses)
    }

    /// How motors of the seat follow; none where none of their settings would do.
    fn lag(&self, divider: u8, propdiv: Option<u8>, jump: f64, found: &mut Vec<Found>) -> Option<Lag> {
        let (axis, period) = (self.subject.geometry(), self.link.period);
        let (velocity, on) = (axis.max_velocity, self.on(ShowTime::ZERO));
        let steps = velocity / axis.stroke() * axis.stroke_pulses();
        let fits = greatest_divider(steps);
        if fits.is_none_or(|fits| fits < divider) {
            let breach = DriveBreach::TooFast { on, velocity, divider, fits };
            self.of_seat(breach, found);
            return None;
        }
        let given = propdiv.map(|propdiv| Lag::new(divider, propdiv));
        let lag = given.or_else(|| Lag::gentlest(divider, period, velocity, jump));
        if lag.is_none() {
            let breach = DriveBreach::NoPropdiv { on, velocity, jump };
            self.of_seat(breach, found);
        }
        lag
    }

    fn hz(&self) -> f64 {
        self.link.period.as_secs_f64().recip()
    }

    /// What a breach is told of.
    fn on(&self, at: ShowTime) -> OnDrive {
        OnDrive { unit: self.subject.geometry().unit, seat: self.subject.seat(), hz: self.hz(), at }
    }

    /// True if the axis vibrates on the drive at all.
    fn is_shaken(&self) -> bool {
        self.link.shake > 0.0 && self.subject.timeline.vibrates(self.subject.axis)
    }

    fn executed(&self, most: &MostExecuted) -> DriveAxisProof {
        let figure = |worst: Worst| Figure { value: worst.value, at: worst.at, line: worst.line };
        DriveAxisProof {
            axis: self.subject.axis,
            on: self.subject.on.clone(),
            deviation: most.deviation,
            lowest: figure(most.lowest),
            highest: figure(most.highest),
            velocity: most.velocity,
            roughness: most.roughness,
        }
    }

    /// The first of what is met, in the axis's unit, that is larger than all before.
    fn larger(&self, worst: &mut Worst, value: f64, at: i64) {
        if value > worst.value {
            let line = self.subject.timeline.cue().line(self.subject.timeline.row_before(show(at)));
            *worst = Worst { value, at: show(at), line, ..*worst };
        }
    }

    fn judge(&self, most: &MostExecuted, found: &mut Vec<Found>) {
        let mut motion = vec![(Quantity::Velocity, most.velocity)];
        if let Roughness::Segments { acceleration, jerk } = most.roughness {
            motion.push((Quantity::Acceleration, acceleration));
            // Vibration is rougher than any motion may be, and is judged by its acceleration.
            motion.extend((!self.is_shaken()).then_some((Quantity::Jerk, jerk)));
        }
        let over = |worst: Worst| OverLimit { value: worst.value, limit: worst.limit };
        for (quantity, worst) in motion.into_iter().filter(|(_, worst)| worst.value > worst.limit * SLACK) {
            let breach = DriveBreach::Motion { on: self.on(worst.at), quantity, over: over(worst) };
            found.push(self.found(worst.at, breach));
        }
        let off = most.deviation;
        if off.value > off.limit {
            // What a spline misses is in proportion to what it follows, and that to the level.
            let level = self.terms.level * off.limit / off.value;
            let breach = DriveBreach::Deviates { on: self.on(off.at), over: over(off), level };
            found.push(self.found(off.at, breach));
        }
        if let Roughness::Jumps(jump) = most.roughness
            && jump.value > jump.limit * SLACK
        {
            let breach = DriveBreach::Jumps { on: self.on(jump.at), over: over(jump) };
            found.push(self.found(jump.at, breach));
        }
    }

    /// Vibrations that a link is too slow for, the first of each stretch of them.
    fn too_quick(&self, found: &mut Vec<Found>) {
        if !self.is_shaken() {
            return;
        }
        let (most, mut before) = (self.hz() / Shaker::SLICES, 0.0);
        for step in self.subject.timeline.cue().tracks().vibration(self.subject.axis).as_slice() {
            let Vibration { hz, amplitude } = step.value.into();
            let told = if amplitude > 0.0 && hz > most { hz } else { 0.0 };
            if told > before {
                let breach = DriveBreach::TooQuick { on: self.on(step.at), hz: told, most };
                let column = format!("v{}_hz", self.subject.axis + 1);
                found.push(Found { column, ..self.found(step.at, breach) });
            }
            before = told;
        }
    }

    /// Notes what no cue has a part in.
    fn of_seat(&self, breach: DriveBreach, found: &mut Vec<Found>) {
        found.push(Found {
            at: ShowTime::ZERO,
            axis: None,
            column: String::new(),
            breach: Breach::Drive(breach),
        });
    }

    fn found(&self, at: ShowTime, breach: DriveBreach) -> Found {
        let column = format!("a{}", self.subject.axis + 1);
        Found { at, axis: Some(self.subject.axis), column, breach: Breach::Drive(breach) }
    }
}

/// The most that was met of one axis, in its unit.
#[derive(Debug, Clone, Copy)]
struct MostExecuted {
    deviation: Worst,
    /// Places; the limit is the end of the stroke.
    lowest: Worst,
    highest: Worst,
    velocity: Worst,
    roughness: Roughness,
}

impl MostExecuted {
    /// At rest at `place`, before anything else was met; with the limits of velocity and roughness.
    fn at_rest(driven: &Driven<'_>, place: f64, velocity: f64, roughness: Roughness) -> Self {
        let axis = driven.subject.geometry();
        Self {
            deviation: below(driven.link.max_deviation),
            lowest: Worst { value: place, ..below(axis.low) },
            highest: Worst { value: place, ..below(axis.high) },
            velocity: below(velocity),
            roughness,
        }
    }

    /// What is the most of both.
    fn and(self, other: Self) -> Self {
        let larger = |one: Worst, other: Worst| if other.value > one.value { other } else { one };
        let roughness = match (self.roughness, other.roughness) {
            (
                Roughness::Segments { acceleration: a, jerk: j },
                Roughness::Segments { acceleration, jerk },
            ) => Roughness::Segments { acceleration: larger(a, acceleration), jerk: larger(j, jerk) },
            (Roughness::Jumps(one), Roughness::Jumps(other)) => Roughness::Jumps(larger(one, other)),
            (one, _) => one,
        };
        Self {
            deviation: larger(self.deviation, other.deviation),
            lowest: if other.lowest.value < self.lowest.value { other.lowest } else { self.lowest },
            highest: larger(self.highest, other.highest),
            velocity: larger(self.velocity, other.velocity),
            roughness,
        }
    }

    /// The axis is at `place` at a show time, and was to be at `wanted`, a fraction of the stroke, if that is of the cue.
    fn be_at(&mut self, driven: &Driven<'_>, at: i64, place: f64, wanted: Option<f64>) {
        driven.larger(&mut self.highest, place, at);
        // Turned round, so that the first of several equal ones is kept there as well.
        let mut lowest = Worst { value: -self.lowest.value, ..self.lowest };
        driven.larger(&mut lowest, -place, at);
        self.lowest = Worst { value: -lowest.value, ..lowest };
        if let Some(wanted) = wanted {
            let off = (place - driven.subject.geometry().place(wanted)).abs();
            driven.larger(&mut self.deviation, off, at);
        }
    }
}

/// Nothing yet of what may be no larger than that.
fn below(limit: f64) -> Worst {
    Worst { limit, ..Worst::default() }
}

/// A show time inside any cue.
fn show(at: i64) -> ShowTime {
    ShowTime::from_nanos(at.max(0))
}
