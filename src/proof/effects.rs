//! How long and how much of the time effects are on, as frames switch them.

use std::time::Duration;

use super::violation::Breach;
use super::{Found, LimitedEffect, Terms};
use crate::cue::{Effects, TrackStep};
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;

/// A time for which an effect is on.
#[derive(Debug, Clone, Copy)]
struct EffectRun {
    from: ShowTime,
    until: ShowTime,
}

impl EffectRun {
    fn length(&self) -> Duration {
        Duration::from_nanos(self.until.as_nanos().abs_diff(self.from.as_nanos()))
    }
}

/// Holds every limited effect against its limits.
pub(super) fn prove(timeline: &Timeline, terms: &Terms, found: &mut Vec<Found>) {
    for effect in &terms.effects {
        let runs = runs(timeline, effect);
        let column = match timeline.cue().effects() {
            Effects::Named { .. } => format!("fx_{}", effect.limit.name),
            Effects::Words(_) => "io".to_owned(),
        };
        let mut note = |at: ShowTime, breach| {
            found.push(Found { at, axis: None, column: column.clone(), breach });
        };
        for run in &runs {
            if let Some(breach) = wrong_length(run, effect, terms.rate) {
                note(run.from, breach);
            }
        }
        if let Some((from, breach)) = too_busy(&runs, effect) {
            note(from, breach);
        }
    }
}

/// When the effect is on, in order of time.
fn runs(timeline: &Timeline, effect: &LimitedEffect) -> Vec<EffectRun> {
    let end = timeline.duration();
    match timeline.cue().effects() {
        Effects::Named { names, steps } => match names.iter().position(|name| *name == effect.limit.name) {
            Some(bit) => on_while(steps.as_slice(), end, |on| on >> bit & 1 == 1),
            None => Vec::new(),
        },
        Effects::Words(steps) => on_while(steps.as_slice(), end, |word| word & effect.output != 0),
    }
}

fn on_while<T: Copy>(steps: &[TrackStep<T>], end: ShowTime, is_on: impl Fn(T) -> bool) -> Vec<EffectRun> {
    let mut runs: Vec<EffectRun> = Vec::new();
    for (index, step) in steps.iter().enumerate().filter(|(_, step)| is_on(step.value)) {
        let until = steps.get(index + 1).map_or(end, |next| next.at);
        // Steps of other effects lie between: for this one it is one time.
        match runs.last_mut().filter(|last| last.until == step.at) {
            Some(last) => last.until = until,
            None => runs.push(EffectRun { from: step.at, until }),
        }
    }
    runs
}

/// What is wrong with how long frames have it on, which may be a period more or less than the cue.
fn wrong_length(run: &EffectRun, effect: &LimitedEffect, rate: Rate) -> Option<Breach> {
    let (at, on, limit) = (run.from, run.length(), &effect.limit);
    // Frames can only switch every period, wherever they fall: a run is on in as many frames as there are
    // whole periods in it, or in one more.
    let frames = rate.periods_in(on);
    let shortest = rate.offset(frames);
    let longest = if shortest == on { on } else { rate.offset(frames + 1) };
    if shortest < limit.min_on {
        return Some(Breach::OnTooShort { at, on, sent: shortest, least: limit.min_on });
    }
    let most = limit.max_on.filter(|most| longest > *most)?;
    Some(Breach::OnTooLong { at, on, sent: longest, most })
}

/// The busiest window, where it is too busy: one that begins where a run begins, or ends where one ends.
fn too_busy(runs: &[EffectRun], effect: &LimitedEffect) -> Option<(ShowTime, Breach)> {
    let (most, window) = (effect.limit.max_duty?, effect.limit.duty_window);
    // What a window holds grows or shrinks in straight lines as it is moved; it turns from
    // growing to shrinking only where its begin meets one of a run, or its end one's end.
    let starts = runs.iter().flat_map(|run| [run.from, run.until - window]);
    let on = |from: ShowTime| -> f64 {
        let until = from + window;
        let first = runs.partition_point(|run| run.until <= from);
        let within = runs[first..].iter().take_while(|run| run.from < until);
        let parts =
            within.map(|run| EffectRun { from: run.from.max(from), until: run.until.min(until) }.length());
        parts.sum::<Duration>().as_secs_f64()
    };
    let busiest = starts.map(|from| (from, on(from) / window.as_secs_f64()));
    let (from, duty) = busiest.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let from = from.max(ShowTime::ZERO);
    (duty > most * (1.0 + 1e-9)).then_some((from, Breach::DutyTooHigh { from, window, duty, most }))
}
