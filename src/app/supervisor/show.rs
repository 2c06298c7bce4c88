//! The cue that is loaded, and the show made of it for the tick thread.

use std::sync::Arc;

use super::Supervisor;
use super::hall_settings::HallSettings;
use super::job::JobResult;
use crate::app::StagedShow;
use crate::app::staged::headroom;
use crate::config::Config;
use crate::control::{Asked, Code, Problem, ShowStatus};
use crate::engine::{Headroom, Show};
use crate::library::{CueId, IdError, Library};
use crate::proof::{self, Digest, Terms};
use crate::rt::Command as TickCommand;
use crate::state::State;
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;

/// A cue that fits the hall and keeps its limits at full level.
#[derive(Debug)]
pub(super) struct ProvedShow {
    pub(super) id: String,
    pub(super) title: Option<String>,
    pub(super) sha256: String,
    pub(super) timeline: Arc<Timeline>,
    headroom: Headroom,
    /// Show time at which it begins.
    pub(super) start: ShowTime,
    /// Where the film was when its last show ended before the cue did; `None` if there is nothing to go on from.
    pub(super) left_at: Option<ShowTime>,
    /// How long the first move onto it takes, seconds.
    pub(super) join_s: f64,
}

impl ProvedShow {
    /// Proves a cue for a hall.
    ///
    /// # Errors
    /// Everything that does not fit.
    pub(super) fn prove(
        id: String,
        config: &Config,
        timeline: Timeline,
        sha256: String,
    ) -> Result<Self, Problem> {
        let refused = |faults: Vec<String>| {
            let detail = format!("the cue {id} does not fit this hall");
            Problem::new(Code::Check, detail, "correct it, or `kinocue fit` it, and load it again")
                .with(faults)
        };
        let rate = Rate::from_hz(config.show.rate_hz);
        let misfits = config.misfits(&timeline);
        if !misfits.is_empty() {
            let place = |misfit: &crate::config::Misfit| {
                format!("{}{misfit}", timeline.cue().column_place(&misfit.column(), misfit.at()))
            };
            return Err(refused(misfits.iter().map(place).collect()));
        }
        let strokes = config.fits_stroke(&timeline).faults;
        if !strokes.is_empty() {
            return Err(refused(strokes.iter().map(ToString::to_string).collect()));
        }
        let terms = Terms::of_hall(config, Digest::of(timeline.cue()), rate, 1.0);
        let proof = proof::prove(&timeline, terms);
        if !proof.passed() {
            let mut faults: Vec<String> = proof.violations.iter().map(ToString::to_string).collect();
            if proof.more > 0 {
                faults.push(format!("and {} more", proof.more));
            }
            return Err(refused(faults));
        }
        Ok(Self {
            title: timeline.cue().title().map(str::to_owned),
            headroom: headroom(config, &timeline, rate),
            timeline: Arc::new(timeline),
            id,
            sha256,
            start: ShowTime::ZERO,
            left_at: None,
            join_s: 0.0,
        })
    }

    /// As surfaces show it, the film being at `position`.
    pub(super) fn status(&self, position: ShowTime) -> ShowStatus {
        ShowStatus {
            cue: self.id.clone(),
            title: self.title.clone(),
            sha256: self.sha256.clone(),
            length_s: self.timeline.duration().as_secs_f64(),
            position_s: position.as_secs_f64(),
            join_s: self.join_s,
            resume_s: self.left_at.map(ShowTime::as_secs_f64),
            axes: self.timeline.axes(),
            effects: self.timeline.switch_names(),
        }
    }
}

impl Supervisor {
    /// Reads a cue of the library and proves it; whoever asked for it is answered then.
    pub(super) fn load(&mut self, id: &str, asked: Asked) {
        if let Err(problem) = self.may("load").and_then(|()| self.is_free()) {
            return self.answer(asked, Err(problem));
        }
        let id: CueId = match id.parse() {
            Ok(id) => id,
            Err(error) => return self.answer(asked, Err(no_cue(id, &error))),
        };
        self.fetch(id, Some(asked));
    }

    /// Has every cue of the library checked that nobody has checked for this hall, one after the other, by processes of the
    /// lowest priority.
    pub(super) fn examine_library(&self) {
        let library = self.library.clone();
        let thread = std::thread::Builder::new().name("library".to_owned());
        // Where there is no thread for it, each cue is checked when it is asked for.
        let _ = thread.spawn(move || {
            let _ = crate::sys::realtime::normal_priority();
            library.examine_all();
        });
    }

    /// Has a cue read and proved.
    fn fetch(&mut self, id: CueId, asked: Option<Asked>) {
        let (library, config) = (self.library.clone(), self.runtime.config.clone());
        self.send("loading", asked, move || JobResult::Loaded(read(&library, &config, &id)));
    }

    /// True if the hall is at rest, and nobody has made it ready to go, so that another cue may be loaded, or controllers asked.
    pub(super) fn may(&self, what: &str) -> Result<(), Problem> {
        let remedy = match self.mirror.state {
            State::Armed => "disarm first",
            state if state.may_send_motion() => "park first",
            _ => return Ok(()),
        };
        Err(Problem::new(Code::State, format!("cannot {what} while {}", self.mirror.state), remedy))
    }

    /// Takes up a cue that was proved.
    pub(super) fn take_up(&mut self, cued: ProvedShow) -> Result<(), Problem> {
        self.may("load")?;
        self.cued = Some(cued);
        self.stage().inspect_err(|_| self.cued = None)
    }

    /// Makes the show that the tick thread plays next, as everything is set now, and hands it over.
    pub(super) fn stage(&mut self) -> Result<(), Problem> {
        let Some(cued) = &mut self.cued else { return Ok(()) };
        let mixes = self.settings.mixes(cued.timeline.effect_names());
        let config = &self.runtime.config;
        let show = Show {
            rate: Rate::from_hz(config.show.rate_hz),
            timing: config.show.timing,
            start: motion_at(cued.start, self.settings.trim_ms),
            plays: 1,
        };
        let staged = StagedShow::mixed(config, &cued.timeline, cued.headroom.clone(), show, &mixes, false);
        let staged = staged.map_err(|error| {
            Problem::new(Code::Check, error.to_string(), "begin elsewhere in the cue, or lower its level")
        })?;
        let course = &staged.course;
        cued.join_s = course.settled().as_secs_f64() - course.start.as_secs_f64();
        let mut loaded = staged.loaded();
        loaded.engine.begin_trimmed(self.settings.trim_ms);
        self.set_desk();
        self.command(TickCommand::Load(loaded))
    }

    /// Sets something, and makes the show anew where its first frames hang on that; while the seats move the desk is enough.
    /// What no show can be made of is taken back.
    pub(super) fn set(
        &mut self,
        change: impl FnOnce(&mut HallSettings) -> Result<(), Problem>,
    ) -> Result<(), Problem> {
        let before = self.settings.clone();
        change(&mut self.settings)?;
        self.set_desk();
        let staged = if self.mirror.state.may_send_motion() { Ok(()) } else { self.stage() };
        staged.inspect_err(|_| {
            self.settings = before;
            self.set_desk();
        })
    }

    /// Sets the tick thread's desk as the board says.
    pub(super) fn set_desk(&self) {
        let effects = self.cued.as_ref().map_or(&[][..], |cued| cued.timeline.effect_names());
        self.settings.set(&self.runtime.desk, effects);
    }

    /// The show is over: the same begins at its beginning the next time.
    pub(super) fn rewind(&mut self) {
        if let Some(cued) = &mut self.cued {
            cued.start = ShowTime::ZERO;
        }
        self.stage_again();
    }

    /// Makes the show that is loaded anew; one that cannot be made any more is dropped.
    pub(super) fn stage_again(&mut self) {
        if let Err(problem) = self.stage() {
            self.note(problem.to_string());
            self.cued = None;
        }
    }
}

pub(super) fn no_cue(id: &str, error: &IdError) -> Problem {
    Problem::new(Code::Value, format!("{id:?}: {error}"), "GET /api/v1/cues lists them")
}

/// Where in the cue the motion is at a time of the film, with that trim.
const fn motion_at(film: ShowTime, trim_ms: i32) -> ShowTime {
    ShowTime::from_nanos(film.as_nanos() - trim_ms as i64 * 1_000_000)
}

pub(super) fn read(library: &Library, config: &Config, id: &CueId) -> Result<Box<ProvedShow>, Problem> {
    let (timeline, sha256) = library.read(id)?;
    ProvedShow::prove(id.to_string(), config, timeline, sha256).map(Box::new)
}
