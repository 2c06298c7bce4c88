//! Proves that a cue keeps the limits of the seats that play it, over its whole length and however the frames fall on it, by
//! the measure that the limiter enforces. From a [`Timeline`] and [`Terms`] to a [`Proof`]. Control thread; pure.
//!
//! A divided difference over fixed distances is, between the rows shifted by those distances, a cubic of the phase: its
//! extremes are found in closed form, so that no phase has to be tried.

mod axis;
mod digest;
mod drives;
mod ease;
mod effects;
mod end;
mod figures;
mod fit;
mod links;
mod loads;
mod pieces;
mod shake;
mod smooth;
mod stencil;
mod strain;
mod sweep;
mod terms;
#[cfg(test)]
mod tests;
mod violation;

pub(crate) use axis::AxisProof;
pub use digest::Digest;
pub(crate) use drives::DriveProof;
pub(crate) use drives::{DriveAxisProof, DrivenBy, rate_that_fits};
pub use drives::{DriveTerms, prove_driven};
pub(crate) use end::HURRY;
pub(crate) use figures::AxisFigures;
pub use figures::figures;
pub(crate) use fit::{FitManner, Fitted, fit};
pub(crate) use links::{LinkPlay, LinksProof, prove_in, prove_links};
pub(crate) use loads::Loads;
pub(crate) use shake::shakes;
pub(crate) use strain::{AxisStrain, strains};
pub(crate) use terms::LimitedEffect;
pub use terms::Terms;
pub(crate) use violation::{Breach, Quantity, Violation};

use std::num::NonZero;
use std::sync::Arc;
use std::{iter, thread};

use crate::cue::{FAULTS_TOLD, Place};
use crate::motion::{AxisGeometry, SeatAxis, SeatType};
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;
use axis::Subject;
use stencil::Stencils;

/// What may be over a limit: 0.1 % of it.
pub(crate) const SLACK: f64 = 1.001;

/// No ride is as short: a cue that is, and breaks a limit, may have its times in another unit than its header says.
const SHORT: ShowTime = ShowTime::from_millis(1000);

/// The greatest size of something that has a limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Worst {
    /// In the unit of the axis a second, or its square or cube.
    pub(crate) value: f64,
    /// The most that is allowed, in the same unit.
    pub(crate) limit: f64,
    /// Show time in the middle of the poses that gave it.
    pub(crate) at: ShowTime,
    /// The line of the row at or before that; the number of its message where the file has no lines.
    pub(crate) line: u64,
}

impl Worst {
    /// What is left of the limit, as a part of it; below 0 over it.
    #[must_use]
    pub(crate) fn margin(&self) -> f64 {
        1.0 - self.value / self.limit
    }
}

/// What a cue does at most on the seats that take it, and every limit that it breaks.
#[derive(Debug, Clone, PartialEq)]
pub struct Proof {
    /// What it was proved for.
    pub(crate) terms: Terms,
    /// One entry for each axis on each different seat that takes it.
    pub(crate) axes: Vec<AxisProof>,
    /// What the links of the hall execute of it, where they were looked at.
    pub(crate) links: Vec<LinkPlay>,
    /// What is broken, in order of show time; the first [`FAULTS_TOLD`].
    pub(crate) violations: Vec<Violation>,
    /// How many there are beyond those.
    pub(crate) more: u64,
}

impl Proof {
    /// True if no limit is broken.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.violations.is_empty()
    }

    /// True if a play on these terms is proved to keep all limits.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn covers(&self, terms: &Terms) -> bool {
        self.passed() && self.terms.cover(terms)
    }
}

/// Something that is broken, before its place in the file is looked up.
struct Found {
    at: ShowTime,
    /// The axis whose cell is to be named, from 0.
    axis: Option<usize>,
    column: String,
    breach: Breach,
}

/// Proves a cue. Takes time in proportion to its rows and to the different seats; reads the file again only to name the
/// columns of what is broken. That every row stays inside the stroke is not part of it:
/// [`crate::config::Config::fits_stroke`].
#[must_use]
pub fn prove(timeline: &Timeline, terms: Terms) -> Proof {
    let mut found = Vec::new();
    hall(&terms, &mut found);
    let stencils = Stencils::at(terms.rate);
    let subjects = subjects(timeline, &terms);
    let axes = on_threads(&subjects, &mut found, |subject, found| subject.prove(&terms, &stencils, found));
    effects::prove(timeline, &terms, &mut found);
    let is_broken = !found.is_empty();
    found.extend(too_short(timeline, &axes, &stencils, is_broken));
    // By time before any is left out: people mend a cue from its beginning.
    found.sort_by_key(|one| one.at);
    let more = found.len().saturating_sub(FAULTS_TOLD) as u64;
    found.truncate(FAULTS_TOLD);
    let violations = found.into_iter().map(|one| placed(timeline, one)).collect();
    Proof { terms, axes, links: Vec::new(), violations, more }
}

/// A cue that moves and is too short for differences to see how, or so short that its times may be meant in seconds.
fn too_short(timeline: &Timeline, axes: &[AxisProof], stencils: &Stencils, is_broken: bool) -> Option<Found> {
    let (length, least) = (timeline.duration(), ShowTime::from_nanos(stencils.reach()));
    let is_unseen = length < least && axes.iter().any(|axis| axis.lowest.value < axis.highest.value);
    let breach = Breach::TooShort { length, least };
    (is_unseen || is_broken && length < SHORT).then_some(Found {
        at: ShowTime::ZERO,
        axis: None,
        column: String::new(),
        breach,
    })
}

/// Proves each axis, on as many threads as there are processors.
fn on_threads<P: Send>(
    subjects: &[Subject<'_>],
    found: &mut Vec<Found>,
    prove: impl Fn(&Subject<'_>, &mut Vec<Found>) -> P + Sync,
) -> Vec<P> {
    let processors = thread::available_parallelism().map_or(1, NonZero::get);
    let share = subjects.len().div_ceil(processors).max(1);
    let prove_some = |some: &[Subject<'_>]| {
        let mut found = Vec::new();
        let proofs: Vec<_> = some.iter().map(|one| prove(one, &mut found)).collect();
        (proofs, found)
    };
    let mut all = Vec::with_capacity(subjects.len());
    thread::scope(|scope| {
        // This thread takes the first share: with one processor no other is started.
        let (own, others) = subjects.split_at(share.min(subjects.len()));
        let prove_some = &prove_some;
        let workers: Vec<_> =
            others.chunks(share).map(|some| scope.spawn(move || prove_some(some))).collect();
        let proved = iter::once(prove_some(own));
        let proved =
            proved.chain(workers.into_iter().map(|worker| worker.join().expect("a proof does not panic")));
        for (some, broken) in proved {
            all.extend(some);
            found.extend(broken);
        }
    });
    all
}

/// Each axis of the cue on each different seat that takes it.
fn subjects<'a>(timeline: &'a Timeline, terms: &'a Terms) -> Vec<Subject<'a>> {
    let mut subjects: Vec<Subject<'a>> = Vec::new();
    for part in &terms.parts {
        for axis in part.axes.clone().take_while(|axis| *axis < timeline.axes()) {
            let seat_axis = axis - part.axes.start;
            let slot = timeline.unit(axis).slot(&part.seat, seat_axis, Some(axis)).at_level(terms.level);
            let is_as = |one: &Subject<'_>| one.axis == axis && one.slot == slot;
            if !subjects.iter().any(|one| is_as(one) && one.on.seat.name == part.seat.name) {
                subjects.push(Subject { timeline, axis, on: SeatAxis::new(&part.seat, seat_axis), slot });
            }
        }
    }
    subjects.sort_by_key(|subject| subject.axis);
    subjects
}

/// What the seats ask of their controllers, whatever the cue.
fn hall(terms: &Terms, found: &mut Vec<Found>) {
    let mut judged: Vec<&Arc<SeatType>> = Vec::new();
    for part in &terms.parts {
        if !judged.contains(&&part.seat) {
            judged.push(&part.seat);
            let breaches = part.seat.different().filter_map(|(_, axis)| too_fast(&part.seat, axis));
            let at = ShowTime::ZERO;
            let whole = |breach| Found { at, axis: None, column: String::new(), breach };
            found.extend(breaches.chain(too_far_apart(&part.seat, terms.rate)).map(whole));
        }
    }
}

/// A limit on speed above the controller's own, where the configuration says what that is (PA07, IMAX manual 2.3.1).
fn too_fast(seat: &SeatType, axis: &AxisGeometry) -> Option<Breach> {
    let (rpm, ceiling) = (f64::from(axis.max_rpm?), axis.speed_ceiling());
    (axis.max_velocity > ceiling * SLACK).then(|| Breach::SpeedCeiling {
        unit: axis.unit,
        seat: seat.name.clone(),
        rpm,
        ceiling,
        lead: axis.lead,
        wanted: axis.max_velocity,
        needed: axis.needed_rpm().ceil(),
    })
}

/// Frames whose Time the controller cuts (PA0b, IMAX manual 2.3.1).
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 1,000")]
fn too_far_apart(seat: &SeatType, rate: Rate) -> Option<Breach> {
    // Of Times that take turns the longer one is cut first.
    let frame = (1000.0 / rate.hz()).ceil() as u32;
    let most = seat.max_interval_ms;
    (frame > most).then(|| Breach::Interval { seat: seat.name.clone(), most, frame })
}

fn placed(timeline: &Timeline, found: Found) -> Violation {
    let Found { at, axis, column, breach } = found;
    let cue = timeline.cue();
    let place = match axis {
        Some(axis) => cue.place(timeline.row_before(at), axis),
        None if column.is_empty() => Place::File,
        None => cue.place(timeline.row_before(at), 0),
    };
    Violation { place, column, breach }
}
