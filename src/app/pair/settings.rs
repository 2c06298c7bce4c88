//! What people have set, on both machines: whoever leads tells it with the heartbeats, at once where it is another, the other one keeps it
//! where it will look for it once it leads.

use std::path::Path;
use std::time::Duration;

use super::{Heard, Ride};
use crate::pair::Carried;
use crate::settings::{self, Settings};
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
    other: &str,
    told: &PairSettings,
    heard: &Heard,
    now: MonoTime,
    state: &Path,
) -> (String, Option<Ride>) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{LoadedShow, SettingsFile};

    const TOLD_AT: MonoTime = MonoTime::from_nanos(100_000_000_000);

    /// What a machine leads that is at 10 s of a cue, and has told twice what is set there.
    fn led(is_on_cue: bool, runs: bool) -> Heard {
        let carried = Carried { film_ms: 10_000, is_on_cue, runs, revision: 2, ..Carried::default() };
        Heard { session: 9, carried, at: TOLD_AT }
    }

    /// The place in the film that is kept so long after that was heard, where what is set was told in the revision `told`, and the show that
    /// goes on.
    fn kept(heard: &Heard, told: u32, later: Duration) -> (Option<i64>, Option<Ride>) {
        let folder = tempfile::tempdir().unwrap();
        let (cue, sha256) = ("two".to_owned(), "0".repeat(64));
        let show = Some(LoadedShow {
            cue,
            sha256,
            playlist: None,
            film_ms: Some(4_000),
            begins_ms: None,
            movie: None,
        });
        let told = PairSettings::told(Settings { show, ..Settings::default() }.text(), (heard.session, told));
        let (_, ride) = keep("kino-b", &told, heard, heard.at + later, folder.path());
        let (_file, found) = SettingsFile::open(folder.path());
        (found.settings.unwrap().show.unwrap().film_ms, ride)
    }

    #[test]
    fn a_show_that_ran_goes_on_where_its_film_is_by_now_and_one_that_was_paused_where_it_stood() {
        let later = Duration::from_millis(1_700);
        let since = |runs_since| Some(Ride { runs_since });
        assert_eq!(kept(&led(true, true), 2, later), (Some(11_700), since(Some(TOLD_AT + later))));
        assert_eq!(kept(&led(true, false), 2, later), (Some(10_000), since(None)));
        // Where none was under way, the place is the one at which people were left.
        assert_eq!(kept(&led(false, false), 2, later), (Some(4_000), None));
    }

    #[test]
    fn no_show_goes_on_of_a_machine_that_was_heard_more_than_three_seconds_ago_or_has_set_something_else_since()
     {
        let rides = |told, ms| kept(&led(true, true), told, Duration::from_millis(ms)).1.is_some();
        assert!(rides(2, 3_000) && !rides(2, 3_001), "it may have been stopped since");
        assert!(!rides(1, 1_000), "a seat may have been taken out since");
    }

    #[test]
    fn nothing_goes_on_where_nothing_was_told_or_what_was_told_cannot_be_read() {
        let folder = tempfile::tempdir().unwrap();
        let heard = led(true, true);
        for told in
            [PairSettings::default(), PairSettings::told("no settings".to_owned(), heard.settings_of())]
        {
            let (words, ride) = keep("kino-b", &told, &heard, TOLD_AT, folder.path());
            assert!(ride.is_none() && words.ends_with("check levels, trim and seats"), "{words}");
        }
    }
}
