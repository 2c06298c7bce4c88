//! What people have set, on both machines: whoever leads tells it with the heartbeats, at once where it is another, the other one keeps it
//! where it will look for it once it leads.

use std::path::Path;
use std::time::Duration;

use super::{Heard, PairShared, Ride};
use crate::pair::Carried;
use crate::settings::{self, Settings};
use crate::sys::lock::lock;
use crate::time::MonoTime;

/// So many beats carry what has just been set: one may be lost.
const AT_ONCE: u8 = 3;
/// And each so-manieth after that.
const AGAIN: u64 = 25;

/// What people have set: here while this machine leads, else there, as it was told last.
#[derive(Debug, Default)]
pub(super) struct PairSettings {
    /// The text of the file; `None` if nothing was told.
    pub(super) text: Option<String>,
    /// In which session it was set, and the how-manieth time.
    pub(super) of: (u64, u32),
    /// So many of the next beats carry it.
    due: u8,
}

impl PairSettings {
    /// What the other machine has told.
    pub(super) const fn told(text: String, of: (u64, u32)) -> Self {
        Self { text: Some(text), of, due: 0 }
    }

    /// People have set something here.
    pub(super) fn set(&mut self, text: String) {
        *self = Self { text: Some(text), of: (self.of.0, self.of.1.wrapping_add(1)), due: AT_ONCE };
    }

    /// What the beat of that number carries.
    pub(super) fn carried(&mut self, number: u64) -> Option<String> {
        let is_due = self.due > 0;
        self.due = self.due.saturating_sub(1);
        self.text.clone().filter(|_| is_due || number.is_multiple_of(AGAIN))
    }
}

/// Whoever was heard last so long ago may have been stopped since, or its seats taken out: its show does not go on here. As long as it takes
/// to lead, and to spare.
const FRESH: Duration = Duration::from_secs(3);

/// Keeps what the machine that led has told last, with where its show is by now. Says to people what is there of it, and what may not be;
/// and gives the show that was under way there, where all of that came.
pub(super) fn keep(
    shared: &PairShared,
    heard: &Heard,
    now: MonoTime,
    state: &Path,
) -> (String, Option<Ride>) {
    let told = lock(&shared.settings);
    let other = &shared.other;
    let Some(text) = &told.text else {
        let words = format!(
            "{other} told nothing of what was set there, and all is as it was here: check levels, trim and seats"
        );
        return (words, None);
    };
    let kept = Settings::parse(text).and_then(|mut settings| {
        if let Some(show) = settings.show.as_mut().filter(|_| heard.carried.is_on_cue) {
            let since = if heard.carried.runs { now.since(heard.at).as_millis() } else { 0 };
            show.film_ms = Some(heard.carried.film_ms + i64::try_from(since).unwrap_or_default());
        }
        settings::keep(state, &settings).map_err(|error| error.to_string())
    });
    let age = now.since(heard.at);
    let age_ms = age.as_millis();
    match kept {
        Err(why) => (
            format!(
                "what was set at {other} is not taken over ({why}), and all is as it was here: check levels, trim and seats"
            ),
            None,
        ),
        Ok(()) if told.of != heard.settings_of() => (
            format!(
                "{other} had set something else that did not come here, {age_ms} ms before this machine led: check levels, trim and seats"
            ),
            None,
        ),
        Ok(()) => {
            let Carried { is_on_cue, runs, .. } = heard.carried;
            let ride = Ride { runs_since: runs.then_some(now) };
            (
                format!(
                    "levels, trim, seats that are out and the place in the film are as {other} told them last, {age_ms} ms before this machine led"
                ),
                Some(ride).filter(|_| is_on_cue && age <= FRESH),
            )
        }
    }
}
