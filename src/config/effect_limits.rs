//! `[effect_limits]`: how long, and how much of the time, the things behind the outputs may be on.

use std::time::Duration;

use super::Effect;
use super::fault::Faults;
use super::section::{Entry, Section, did_you_mean};

/// A day: more than any show.
const MOST_MS: u32 = 86_400_000;
/// Over how long duty is counted where nothing is said.
const DUTY_WINDOW_S: f64 = 60.0;

/// What an effect stands.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EffectLimit {
    /// The effect's name in `[effects]`.
    pub(crate) name: String,
    /// The shortest time that it may be on; zero where any will do.
    pub(crate) min_on: Duration,
    /// The longest time that it may be on at a stretch.
    pub(crate) max_on: Option<Duration>,
    /// The greatest part, above 0 to 1, of any window of time that it may be on.
    pub(crate) max_duty: Option<f64>,
    /// How long that window is, 1 s or more.
    pub(crate) duty_window: Duration,
}

/// Reads the table; every name has to be one of the effects.
pub(super) fn effect_limits(
    entry: Entry<'_>,
    effects: &[Effect],
    faults: &mut Faults<'_>,
) -> Vec<EffectLimit> {
    let Some(table) = entry.table(faults) else { return Vec::new() };
    let mut limits = Vec::new();
    for (name, value) in table {
        let name = name.get_ref();
        let entry = Entry::new(name, value);
        if !effects.iter().any(|effect| effect.name == **name) {
            let hint = did_you_mean(name, effects.iter().map(|effect| effect.name.as_str()));
            faults.note(entry.at, format!("{name} is not in [effects]{hint}"));
        }
        limits.extend(limit(entry, faults));
    }
    limits
}

fn limit(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<EffectLimit> {
    let table = entry.table(faults)?;
    let mut section = Section::new(format!("[effect_limits.{}]", entry.key), entry.at, table, faults);
    let min_on = section.whole_in("min_on_ms", 0..=MOST_MS);
    let max_on = section.whole_in("max_on_ms", 1..=MOST_MS);
    let max_duty = section.number_in("max_duty", 0.001..=1.0);
    let window = section.number_in("duty_window_s", 1.0..=86_400.0).unwrap_or(DUTY_WINDOW_S);
    section.finish();
    if let (Some(least), Some(most)) = (min_on, max_on)
        && least > most
    {
        entry.fault(faults, &format!("min_on_ms {least} is over max_on_ms {most}"));
    }
    let millis = |ms: u32| Duration::from_millis(u64::from(ms));
    Some(EffectLimit {
        name: entry.key.to_owned(),
        min_on: millis(min_on.unwrap_or(0)),
        max_on: max_on.map(millis),
        max_duty,
        duty_window: Duration::from_secs_f64(window),
    })
}
