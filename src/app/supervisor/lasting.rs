//! What lasts over a restart of the program and over another configuration: what people have set, what is loaded, and where in
//! it they were left. None of it starts anything.

use jiff::Zoned;

use super::hall_settings::HallSettings;
use super::job::JobResult;
use super::list::List;
use super::show::{ProvedShow, read};
use super::{Carryover, Supervisor};
use crate::config::Config;
use crate::control::{Problem, Severity, Warning, Who};
use crate::journal::stamp;
use crate::playlist::Shelf;
use crate::rt::Desk;
use crate::settings::{Kept, LoadedShow, Out, Settings, SettingsFile, seats_out};
use crate::state::{Cause, State};
use crate::time::ShowTime;

/// A show that was left sooner after its beginning is begun anew, not gone on with.
const WORTH_IT: ShowTime = ShowTime::from_millis(1_000);
/// How exactly it is known after a crash where a show was.
const KEPT_EVERY_MS: i64 = 5_000;

/// What was loaded before: the playlist, where there was one, and the cue; each as it is now, or why it is not.
pub(super) type Again = (Option<Result<Box<List>, Problem>>, Result<Box<ProvedShow>, Problem>);

/// What is known of what lasts, beside the settings themselves.
#[derive(Debug, Default)]
pub(super) struct Lasting {
    /// What was loaded before, while it is loaded again.
    loading: Option<LoadedShow>,
    /// It is loaded, and the hall moves: it is taken up once it rests.
    ready: Option<Again>,
    /// What came back with the start of the program, in words; none once a show has begun.
    came_back: Option<String>,
    /// Nobody has armed the hall since the start of the program.
    unsaid: bool,
    /// Where the film was when the seats left the cue.
    left_at: Option<ShowTime>,
}

impl Lasting {
    /// The same for another hall, which loads anew what was loaded.
    pub(super) fn go_over(&mut self) -> Self {
        Self { loading: None, ready: None, ..std::mem::take(self) }
    }
}

impl Carryover {
    /// Of a program that has just started, and found that.
    #[must_use]
    pub fn of(kept: Kept) -> Self {
        let came_back = kept.settings.as_ref().and_then(Settings::words);
        let lasting = Lasting { came_back, unsaid: true, ..Lasting::default() };
        Self { settings: kept.settings, lasting, untold: kept.said, ..Self::default() }
    }

    /// What is set goes to the desk of a hall before its first look at the controllers: nobody waits for a seat that is out.
    pub fn set_desk(&self, config: &Config, desk: &Desk) {
        self.settings(config).set(desk, &[]);
    }

    pub(super) fn settings(&self, config: &Config) -> HallSettings {
        self.settings
            .as_ref()
            .map_or_else(|| HallSettings::new(config), |before| HallSettings::with(config, before))
    }
}

impl Supervisor {
    /// All that is to last.
    pub(super) fn settings(&self) -> Settings {
        Settings {
            levels: self.settings.levels.clone(),
            trim_ms: self.settings.trim_ms,
            out: self.settings.out.clone(),
            show: self.lasting.loading.clone().or_else(|| self.loaded()),
        }
    }

    /// Has it kept.
    pub(super) fn keep_settings(&mut self) {
        let settings = self.settings();
        self.ports.settings_file.put(settings);
    }

    /// What is loaded; while seats are tested, what was before.
    fn loaded(&self) -> Option<LoadedShow> {
        let tested = self.seat_test.as_ref().filter(|seat_test| seat_test.status.running);
        let cued = tested.map_or(self.cued.as_ref(), super::seat_test::SeatTest::before)?;
        let rides = matches!(self.mirror.state, State::Playing(_) | State::Paused);
        let film_ms = match (rides && tested.is_none()).then(|| self.runtime.live.show()) {
            Some(film) => Some(millis(film) / KEPT_EVERY_MS * KEPT_EVERY_MS).filter(|ms| *ms > 0),
            None => cued.left_at.map(millis),
        };
        let playlist = self.list.as_ref().map(List::place);
        Some(LoadedShow { cue: cued.id.clone(), sha256: cued.sha256.clone(), playlist, film_ms })
    }

    /// Loads what was loaded before.
    pub(super) fn load_again(&mut self, loaded: LoadedShow) {
        let (library, config) = (self.library.clone(), self.runtime.config.clone());
        let folder = self.ports.settings_file.folder().to_owned();
        let shelf = Shelf::new(&config.playlists());
        self.lasting.loading = Some(loaded.clone());
        self.send("loading", None, move || {
            let _loading = SettingsFile::loading(&folder);
            let cued = loaded.cue.parse().map_err(|error| super::show::no_cue(&loaded.cue, &error));
            let cued = cued.and_then(|id| read(&library, &config, &id));
            let list =
                loaded.playlist.map(|place| List::again(&shelf, &library, &config, &place, &loaded.cue));
            JobResult::Again((list.map(|list| list.map(Box::new)), cued))
        });
    }

    /// Takes up what was loaded before. A playlist that has gone leaves the cue.
    pub(super) fn take_up_again(&mut self, again: Again) -> Result<(), Problem> {
        if self.may("load").is_err() {
            self.lasting.ready = Some(again);
            return Ok(());
        }
        let (list, cued) = again;
        let before = self.lasting.loading.take();
        if self.cued.is_some() {
            return Ok(()); // a person has loaded another meanwhile
        }
        match list {
            Some(Ok(list)) => self.list = Some(*list),
            Some(Err(problem)) => self.note(problem.to_string()),
            None => {}
        }
        let mut cued = *cued?;
        let same = before.filter(|before| before.sha256 == cued.sha256);
        cued.left_at = same.and_then(|before| before.film_ms).map(ShowTime::from_millis);
        self.take_up(cued)
    }

    /// Takes it up where it waits for the hall to rest.
    pub(super) fn settle_again(&mut self) {
        if self.may("load").is_ok()
            && let Some(again) = self.lasting.ready.take()
            && let Err(problem) = self.take_up_again(again)
        {
            self.note(problem.to_string());
        }
    }

    /// The hall goes from one state to another: where the film is when the seats leave the cue is where a show may go on.
    pub(super) fn note_place(&mut self, from: State, to: State) {
        let rides = |state| matches!(state, State::Playing(_) | State::Paused);
        if rides(from) && !rides(to) && self.mirror.cause != Cause::CueEnded {
            self.lasting.left_at = Some(self.runtime.live.show());
        }
    }

    /// A show is over: where it was left is kept with its cue.
    pub(super) fn keep_place(&mut self) {
        let left_at = self.lasting.left_at.take();
        if let Some(cued) = &mut self.cued {
            let end = cued.timeline.duration();
            cued.left_at = left_at.filter(|film| (WORTH_IT..end).contains(film));
        }
    }

    /// A show begins: what was before is over.
    pub(super) fn forget_before(&mut self) {
        self.lasting.came_back = None;
        self.lasting.left_at = None;
        if let Some(cued) = &mut self.cued {
            cued.left_at = None;
        }
    }

    /// Says at the first arm after a start what came back with it.
    pub(super) fn say_what_lasts(&mut self) {
        if !std::mem::take(&mut self.lasting.unsaid) {
            return;
        }
        let now = Zoned::now();
        for (group, out) in &self.settings.out {
            let names: Vec<&str> = self.names_of(group).collect();
            if !names.is_empty() {
                self.say_kept(&seats_out(&names, out, &now));
            }
        }
        if let Some(words) = &self.lasting.came_back {
            self.say_kept(&format!("as it was before the start: {words}"));
        }
    }

    /// What is worth a word of it.
    pub(super) fn of_what_lasts(&self) -> Vec<Warning> {
        let now = Zoned::now();
        let note = |id: &str, controller, text, remedy: &str| Warning {
            id: id.to_owned(),
            severity: Severity::Info,
            controller,
            text,
            remedy: remedy.to_owned(),
        };
        let mut notes = Vec::new();
        for (group, out) in &self.settings.out {
            let remedy = "take it in once it is whole";
            notes.extend(
                self.names_of(group)
                    .map(|name| note("seat-out", Some(name.to_owned()), out.words(&now), remedy)),
            );
        }
        notes.extend(self.lasting.came_back.as_ref().map(|words| {
            let remedy = "set anew what is to be otherwise today";
            note("kept", None, format!("as it was before the start: {words}"), remedy)
        }));
        notes
    }

    /// The controllers of a group.
    fn names_of(&self, group: &str) -> impl Iterator<Item = &str> {
        let all = self.runtime.config.controllers.iter().filter(move |one| one.group == group);
        all.map(|one| one.name.as_str())
    }
}

impl Out {
    /// Taken out just now.
    pub(super) fn now(who: &Who, why: Option<String>) -> Self {
        let name = who.name.chars().filter(|c| !c.is_control()).collect();
        Self { who: name, surface: who.surface, at: stamp(&Zoned::now()), why }
    }
}

const fn millis(film: ShowTime) -> i64 {
    film.as_nanos() / 1_000_000
}
