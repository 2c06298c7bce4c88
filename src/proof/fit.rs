//! Makes a cue keep its limits: amplitude about the neutral pose, never time; a last stretch that comes to rest, where that
//! changes less; and vibration that is more than the seat stands on top of that.

use super::ease::eased;
use super::end::no_rest;
use super::pieces::AxisPieces;
use super::smooth::{Resampled, Smoothing};
use super::stencil::Stencils;
use super::{Breach, Digest, Proof, SLACK, Subject, Terms, prove, subjects};
use crate::cue::{Cue, Vibration};
use crate::motion::{MAX_AXES, Slot};
use crate::time::ShowTime;
use crate::timeline::{HELD_BACK, Timeline};

// Half of the measure's slack.
/// What is left below a limit that was met, so that no rounding on the way to a file takes it over.
const ROUNDING: f64 = 0.9995;
/// How often the amplitude is lowered again: where a curve is held at the stroke's end, what is broken does not shrink in
/// proportion.
const ROUNDS: usize = 8;
/// Halvings that find the amplitude at which an axis can come to rest.
const HALVINGS: usize = 12;

/// How a cue is made to fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct FitManner {
    /// True if each axis has its own amplitude; else all have the least of them, so that they keep their proportions.
    pub(crate) per_axis: bool,
    /// True if a low-pass may help.
    pub(crate) smooth: bool,
}

/// A change of position.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PositionChange {
    /// How far, in the unit of the axis.
    pub(crate) by: f64,
    /// The axis, from 0.
    pub(crate) axis: usize,
    /// When.
    pub(crate) at: ShowTime,
}

/// A cue that was made to fit, and what was done to it.
#[derive(Debug)]
pub(crate) struct Fitted {
    /// The new cue.
    pub(crate) timeline: Timeline,
    /// Amplitude of each axis about its neutral pose, 1 where it is as it was.
    pub(crate) factors: Vec<f64>,
    /// In how many of its last seconds it is brought to rest, where it ended in motion that has no way to rest.
    pub(crate) eased_s: Option<f64>,
    /// The low-pass, where one was used.
    pub(crate) smoothing: Option<Smoothing>,
    /// The largest change of a position.
    pub(crate) change: PositionChange,
    /// How many stretches of vibration swing less than they did.
    pub(crate) lowered: usize,
    /// Of the cue as it was.
    pub(crate) before: Proof,
    /// Of the new cue.
    pub(crate) after: Proof,
}

/// Why a cue cannot be made to fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum FitError {
    /// What is broken is not motion.
    #[error("{}", list(.0))]
    NotMotion(Vec<String>),
    /// Even next to no motion breaks limits.
    #[error(
        "no amplitude makes this cue keep its limits{}",
        if *smooth { "" } else { "; steps and corners need a low-pass: --smooth" }
    )]
    NoAmplitude {
        /// True if a low-pass was tried too.
        smooth: bool,
    },
}

fn list(broken: &[String]) -> String {
    format!(
        "{}\nonly motion and vibration can be fitted; change these in the cue or the hall",
        broken.join("\n")
    )
}

/// Makes a cue fit, changing it as little as it can be: not at all where it keeps its limits. Of a low-pass and a lower
/// amplitude, where both are allowed, it takes the pair whose largest change of position is the smallest.
///
/// # Errors
/// [`FitError`].
pub(crate) fn fit(timeline: Timeline, terms: &Terms, manner: FitManner) -> Result<Fitted, FitError> {
    let before = prove(&timeline, terms.clone());
    refuse_others(&before)?;
    let mut best = best_of(&timeline, timeline.cue().clone(), terms, manner);
    // Easing the end may move less than lowering the amplitude of all until it can rest, so both are tried.
    if !all_rest(&timeline, terms) {
        let rests = eased(&timeline).find(|(_, cue)| all_rest(&Timeline::new(cue.clone()), terms));
        let other = rests.and_then(|(seconds, cue)| {
            let candidate = best_of(&timeline, cue, terms, manner)?;
            Some(Candidate { eased_s: Some(seconds), ..candidate })
        });
        best = best.into_iter().chain(other).reduce(|a, b| if b.change.by < a.change.by { b } else { a });
    }
    let Some(Candidate { cue, factors, eased_s, smoothing, change }) = best else {
        return Err(FitError::NoAmplitude { smooth: manner.smooth });
    };
    let (cue, lowered) = lower_vibration(cue, terms);
    let fitted = Timeline::new(cue);
    let after = prove(&fitted, Terms { cue: Digest::of(fitted.cue()), ..terms.clone() });
    refuse_others(&after)?;
    Ok(Fitted { timeline: fitted, factors, eased_s, smoothing, change, lowered, before, after })
}

fn refuse_others(proof: &Proof) -> Result<(), FitError> {
    let movable = |breach: &Breach| {
        matches!(
            breach,
            Breach::Motion { .. }
                | Breach::NoRoomToRest { .. }
                | Breach::TooRoughToRest { .. }
                | Breach::VibrationPastStroke { .. }
                | Breach::Shaken { .. }
        ) || matches!(breach, Breach::TooShort { length, least } if length >= least)
    };
    let others = proof.violations.iter().filter(|violation| !movable(&violation.breach));
    let others: Vec<_> = others.map(|violation| violation.message()).collect();
    if others.is_empty() { Ok(()) } else { Err(FitError::NotMotion(others)) }
}

/// One way to make the cue fit, its vibration left aside.
struct Candidate {
    cue: Cue,
    factors: Vec<f64>,
    eased_s: Option<f64>,
    smoothing: Option<Smoothing>,
    change: PositionChange,
}

/// The way that changes `original` least of those that make `cue` fit.
fn best_of(original: &Timeline, cue: Cue, terms: &Terms, manner: FitManner) -> Option<Candidate> {
    let plain = amplitude(original, cue.clone(), terms, manner.per_axis);
    let needs_none = plain.as_ref().is_some_and(|plain| plain.factors.iter().all(|factor| *factor == 1.0));
    if needs_none || !manner.smooth {
        return plain;
    }
    smoothest(original, &Timeline::new(cue), terms, manner.per_axis, plain)
}

/// True if every axis can come to rest after its last pose.
fn all_rest(timeline: &Timeline, terms: &Terms) -> bool {
    let stencils = Stencils::at(terms.rate);
    subjects(timeline, terms).iter().all(|subject| able_to_rest(subject, terms, &stencils) >= 1.0)
}

/// Tries low-passes from mild to strong, and keeps the one whose largest change is the smallest.
fn smoothest(
    original: &Timeline,
    source: &Timeline,
    terms: &Terms,
    per_axis: bool,
    plain: Option<Candidate>,
) -> Option<Candidate> {
    let resampled = Resampled::new(source);
    let mut attempt = |strength: usize| {
        let (cue, smoothing) = resampled.smoothed(source, strength);
        let candidate = amplitude(original, cue, terms, per_axis)?;
        Some((strength, Candidate { smoothing: Some(smoothing), ..candidate }))
    };
    let least =
        |a: (usize, Candidate), b: (usize, Candidate)| if b.1.change.by < a.1.change.by { b } else { a };
    let ladder = resampled.strengths();
    let (best, candidate) = ladder.iter().filter_map(|strength| attempt(*strength)).reduce(least)?;
    // Between the rungs beside the best one.
    let place = ladder.iter().position(|strength| *strength == best).unwrap_or(0);
    let (low, high) = (place.checked_sub(1).map_or(0, |i| ladder[i]), ladder.get(place + 1).unwrap_or(&best));
    let step = ((high - low) / 8).max(1);
    let between = (low + 1..*high).step_by(step).filter(|strength| *strength != best);
    let (_, candidate) = between.filter_map(&mut attempt).fold((best, candidate), least);
    match plain {
        Some(plain) if plain.change.by <= candidate.change.by => Some(plain),
        _ => Some(candidate),
    }
}

/// Lowers the amplitude of `cue` until no limit of motion is broken; nothing where that would leave no motion.
fn amplitude(original: &Timeline, cue: Cue, terms: &Terms, per_axis: bool) -> Option<Candidate> {
    let neutral = neutral(&cue, terms);
    let source = Timeline::new(cue);
    let mut factors = vec![1.0; source.axes()];
    let mut scaled: Option<Timeline> = None;
    for _ in 0..ROUNDS {
        let now = scaled.as_ref().unwrap_or(&source);
        let needed = needed(now, terms);
        if needed.iter().all(|factor| *factor >= 1.0) {
            let cue = now.cue().clone();
            let change = largest_change(original, &cue, terms);
            return Some(Candidate { cue, factors, eased_s: None, smoothing: None, change });
        }
        let least = needed.iter().copied().fold(1.0, f64::min);
        for (factor, needed) in factors.iter_mut().zip(&needed) {
            *factor *= if per_axis { *needed } else { least };
        }
        // With a thousandth of its motion a cue is none: it is refused, with what may help.
        if factors.iter().any(|factor| *factor < 1e-3) {
            return None;
        }
        scaled = Some(Timeline::new(scale(source.cue(), &factors, &neutral)));
    }
    None
}

/// How much of its amplitude each axis may keep; 1 where it breaks no limit.
fn needed(timeline: &Timeline, terms: &Terms) -> Vec<f64> {
    let motion = Terms { effects: Vec::new(), ..terms.clone() };
    let mut factors = vec![1.0_f64; timeline.axes()];
    for subject in subjects(timeline, terms) {
        factors[subject.axis] = factors[subject.axis].min(within_stroke(&subject));
    }
    // What leaves the stroke is held at its end, with corners that it has no more once it stays inside: its figures say nothing yet.
    let is_held: Vec<bool> = factors.iter().map(|factor| *factor < 1.0).collect();
    for axis in prove(timeline, motion).axes.into_iter().filter(|axis| !is_held[axis.axis]) {
        let worst = axis.worst().into_iter().map(|(_, worst)| worst);
        let over = worst.filter(|worst| worst.value > worst.limit * SLACK);
        let factor = over.map(|worst| ROUNDING * worst.limit / worst.value).fold(1.0, f64::min);
        factors[axis.axis] = factors[axis.axis].min(factor);
    }
    let stencils = Stencils::at(terms.rate);
    for subject in subjects(timeline, terms).iter().filter(|subject| !is_held[subject.axis]) {
        factors[subject.axis] = factors[subject.axis].min(able_to_rest(subject, terms, &stencils));
    }
    factors
}

/// How much of its amplitude an axis may keep to stay inside the stroke, where its rows or its curve leave it.
fn within_stroke(subject: &Subject<'_>) -> f64 {
    let extremes = &subject.timeline.extremes()[subject.axis];
    let Slot { neutral, to_stroke, cue_zero, .. } = subject.slot;
    let reach = |value: f64| {
        let place = value * to_stroke + cue_zero;
        let room = if place < neutral { neutral } else { 1.0 - neutral };
        // What is no further outside is held at the end instead of being refused.
        let is_inside = (-HELD_BACK..=1.0 + HELD_BACK).contains(&place);
        if is_inside { 1.0 } else { ROUNDING * room / (place - neutral).abs() }
    };
    reach(extremes.min.value).min(reach(extremes.max.value))
}

/// How much of its amplitude an axis may keep to come to rest after its last pose.
fn able_to_rest(subject: &Subject<'_>, terms: &Terms, stencils: &Stencils) -> f64 {
    let pieces = AxisPieces::new(subject.timeline, subject.axis, &subject.slot);
    let allowed = subject.allowed(terms);
    let rests = |factor: f64| {
        no_rest(&pieces.ending(stencils.reach(), factor, subject.slot.neutral), &allowed, stencils).is_none()
    };
    if rests(1.0) {
        return 1.0;
    }
    // Without amplitude it stands in its neutral pose, and rests.
    let (mut fits, mut fails) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(fits, fails);
        if rests(middle) { fits = middle } else { fails = middle }
    }
    ROUNDING * fits
}

/// The neutral pose of the first seat that takes each axis, in the cue's unit.
fn neutral(cue: &Cue, terms: &Terms) -> [f64; MAX_AXES] {
    let mut pose = [0.0; MAX_AXES];
    // Backwards: where several seats take an axis the first has the last word.
    for part in terms.parts.iter().rev() {
        for axis in part.axes.clone().filter(|axis| *axis < MAX_AXES) {
            let geometry = &part.seat.each[axis - part.axes.start];
            let unit = cue.units().of(axis);
            pose[axis] = unit.ends(geometry).0 + geometry.neutral * unit.stroke(geometry);
        }
    }
    pose
}

fn scale(cue: &Cue, factors: &[f64], neutral: &[f64; MAX_AXES]) -> Cue {
    let axes = cue.axes();
    let place = |(index, value): (usize, &f64)| {
        let axis = index % axes;
        neutral[axis] + factors[axis] * (value - neutral[axis])
    };
    let positions = cue.positions().iter().enumerate().map(place).collect();
    cue.with_rows(cue.times().to_vec(), positions, cue.interpolation())
}

/// Where a cue stands farthest from where it stood, at its rows.
fn largest_change(original: &Timeline, cue: &Cue, terms: &Terms) -> PositionChange {
    let mut per_unit = [0.0; MAX_AXES];
    for part in &terms.parts {
        for (axis, geometry) in part.axes.clone().zip(&part.seat.each).filter(|(axis, _)| *axis < MAX_AXES) {
            per_unit[axis] = cue.units().of(axis).to_stroke(geometry) * geometry.stroke();
        }
    }
    let mut hint = crate::timeline::Hint::default();
    let mut most = PositionChange::default();
    for (row, &at) in cue.times().iter().enumerate() {
        let before = original.sample(at, &mut hint);
        for (axis, after) in cue.row(row).iter().enumerate() {
            let change = (after - before[axis]).abs() * per_unit[axis];
            if change > most.by {
                most = PositionChange { by: change, axis, at };
            }
        }
    }
    most
}

/// Lowers the vibration that is more than the seat stands to what there is room for; says how many stretches that were.
fn lower_vibration(cue: Cue, terms: &Terms) -> (Cue, usize) {
    if (0..cue.axes()).all(|axis| cue.tracks().vibration(axis).as_slice().is_empty()) {
        return (cue, 0);
    }
    let timeline = Timeline::new(cue);
    let stencils = Stencils::at(terms.rate);
    let mut lowered = 0;
    let steps = |axis| timeline.cue().tracks().vibration(axis).as_slice().iter();
    let mut tracks: Vec<Vec<Vibration>> =
        (0..timeline.axes()).map(|axis| steps(axis).map(|step| step.value.into()).collect()).collect();
    for subject in subjects(&timeline, terms) {
        let Some(track) = tracks.get_mut(subject.axis) else { continue };
        let pieces = AxisPieces::new(&timeline, subject.axis, &subject.slot);
        let Some(under) = subject.under(&pieces, terms, &stencils) else { continue };
        for (index, vibration) in track.iter_mut().enumerate() {
            if let Some(most) = subject.most_amplitude(&under, terms, index)
                && vibration.amplitude > most
            {
                vibration.amplitude = most;
                lowered += 1;
            }
        }
    }
    let cue = timeline.cue().clone();
    (cue.with_vibration(&tracks), lowered)
}
