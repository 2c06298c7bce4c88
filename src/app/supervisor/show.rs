//! A cue that is loaded, and the show made of it for the tick thread.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use super::hall_settings::HallSettings;
use super::margins;
use crate::app::StagedShow;
use crate::app::staged::{at_any_pace, chasing, headroom};
use crate::config::{Config, Misfit};
use crate::control::{Code, MarginStatus, Problem, ShowStatus};
use crate::engine::{Headroom, Show};
use crate::film::chase::ChaseRules;
use crate::library::{CueId, IdError, Library};
use crate::playlist::EntryFilm;
use crate::proof::{self, Digest, LinkPlay, Terms};
use crate::rt::{FilmStart, Loaded};
use crate::time::{MonoTime, Rate, ShowTime};
use crate::timeline::Timeline;

/// A film that is shown from here.
#[derive(Debug)]
pub(super) struct Movie {
    /// As the playlist names it.
    pub(super) name: String,
    /// Where it is, or why it cannot be shown.
    pub(super) file: Result<PathBuf, String>,
}

/// Where the film was when a show was left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LeftAt {
    pub(super) film: ShowTime,
    /// Since when it runs on from there, as nobody has stopped it; `None` where it waits.
    pub(super) runs_since: Option<MonoTime>,
}

impl LeftAt {
    /// A film that waits there.
    pub(super) const fn waits(film: ShowTime) -> Self {
        Self { film, runs_since: None }
    }

    /// True if nobody has stopped it.
    pub(super) const fn runs(self) -> bool {
        self.runs_since.is_some()
    }

    /// Where it is by now.
    pub(super) fn at(self, now: MonoTime) -> ShowTime {
        self.film + self.runs_since.map_or(Duration::ZERO, |since| now.since(since))
    }
}

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
    /// Where its last show ended before the cue did; `None` if there is nothing to go on from.
    pub(super) left_at: Option<LeftAt>,
    /// How long the first move onto it takes, seconds.
    pub(super) join_s: f64,
    /// How long before its film the first frame leaves: as long as the seat that is led furthest ahead needs.
    pub(super) lead: Duration,
    /// How it follows the film of the hall, if it does.
    pub(super) film: Option<FilmStart>,
    /// The film that is shown with it from here.
    pub(super) movie: Option<Movie>,
    /// What the links of the hall execute of it.
    pub(super) links: Vec<LinkPlay>,
    /// What it leaves of the limits.
    margins: Vec<MarginStatus>,
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
        Self::prove_for(id, config, timeline, sha256, None)
    }

    /// Proves a cue at any pace that the film which leads it may ask for.
    fn prove_for(
        id: String,
        config: &Config,
        timeline: Timeline,
        sha256: String,
        film: Option<FilmStart>,
    ) -> Result<Self, Problem> {
        let refused = |code, faults: Vec<String>| {
            let when = if film.is_some() { " at every pace that its film may ask for" } else { "" };
            let detail = format!("the cue {id} does not fit this hall{when}");
            Problem::new(code, detail, "correct it, or `kinocue fit` it, and load it again").with(faults)
        };
        let rate = Rate::from_hz(config.show.rate_hz);
        let faults = faults_of_seats(config, &timeline);
        if !faults.is_empty() {
            return Err(refused(Code::Cue, faults));
        }
        let paced = film.map(|film| at_any_pace(config, film.rules.pace, rate));
        let paced = paced.as_ref().unwrap_or(config);
        let terms = Terms::of_hall(paced, Digest::of(timeline.cue()), rate, 1.0);
        let proof = proof::prove_in(paced, &timeline, terms);
        if !proof.passed() {
            let mut faults: Vec<String> = proof.violations.iter().map(ToString::to_string).collect();
            if proof.more > 0 {
                faults.push(format!("and {} more", proof.more));
            }
            return Err(refused(Code::Check, faults));
        }
        let room = headroom(config, &timeline, rate);
        Ok(Self {
            title: timeline.cue().title().map(str::to_owned),
            headroom: match &film {
                Some(film) => chasing(room, &film.rules),
                None => room,
            },
            timeline: Arc::new(timeline),
            id,
            sha256,
            start: ShowTime::ZERO,
            left_at: None,
            join_s: 0.0,
            lead: Duration::ZERO,
            film,
            movie: None,
            margins: margins::least(&proof),
            links: proof.links,
        })
    }

    /// Where in a film that leads it the cue begins, ms, and which film is shown with it: an entry of a playlist says that.
    pub(super) fn led_by(&self) -> (Option<i64>, Option<String>) {
        let begins_ms = self.film.map(|film| film.begin.as_nanos() / 1_000_000);
        (begins_ms, self.movie.as_ref().map(|movie| movie.name.clone()))
    }

    /// True if others show the film that leads it: it says by itself where a show goes on.
    pub(super) fn is_led_elsewhere(&self) -> bool {
        self.film.is_some() && self.movie.is_none()
    }

    /// From where it can go on; `None` if there is nothing to go on from, or its film has run past its end since, or says that by itself.
    pub(super) fn left(&self, now: MonoTime) -> Option<ShowTime> {
        let left = self.left_at.filter(|_| !self.is_led_elsewhere());
        left.map(|left| left.at(now)).filter(|film| *film < self.timeline.duration())
    }

    /// As surfaces show it, the film being at `position`.
    pub(super) fn status(&self, position: ShowTime, now: MonoTime) -> ShowStatus {
        ShowStatus {
            cue: self.id.clone(),
            title: self.title.clone(),
            sha256: self.sha256.clone(),
            length_s: self.timeline.duration().as_secs_f64(),
            position_s: position.as_secs_f64(),
            join_s: self.join_s,
            resume_s: self.left(now).map(ShowTime::as_secs_f64),
            axes: self.timeline.axes(),
            effects: self.timeline.switch_names(),
            margins: self.margins.clone(),
        }
    }

    /// The show that the tick thread plays next, of this cue as everything is set.
    ///
    /// # Errors
    /// Where no join leads onto the cue.
    pub(super) fn staged(
        &mut self,
        config: &Config,
        settings: &HallSettings,
    ) -> Result<Box<Loaded>, Problem> {
        let mixes = settings.mixes(self.timeline.effect_names());
        let show = Show {
            rate: Rate::from_hz(config.show.rate_hz),
            timing: config.show.timing,
            start: motion_at(self.start, settings.trim_ms),
            plays: 1,
        };
        let staged = StagedShow::mixed(config, &self.timeline, self.headroom.clone(), show, &mixes, false);
        let staged = staged.map_err(|error| {
            Problem::new(Code::Check, error.to_string(), "start elsewhere in the cue, or lower its level")
        })?;
        let course = &staged.course;
        self.join_s = course.settled().as_secs_f64() - course.start.as_secs_f64();
        let mut loaded = staged.loaded();
        loaded.engine.begin_trimmed(settings.trim_ms);
        let first = loaded.engine.playhead().film();
        self.lead = Duration::from_nanos(self.start.since(first).as_nanos().unsigned_abs());
        loaded.film = self.film;
        Ok(loaded)
    }
}

pub(super) fn no_cue(id: &str, error: &IdError) -> Problem {
    Problem::new(
        Code::Value,
        format!("{id:?}: {error}"),
        "`kinocue cues`, the page and GET /api/v1/cues list them",
    )
}

/// Where in the cue the motion is at a time of the film, with that trim.
const fn motion_at(film: ShowTime, trim_ms: i32) -> ShowTime {
    ShowTime::from_nanos(film.as_nanos() - trim_ms as i64 * 1_000_000)
}

/// Why a cue does not fit the seats before anything is reckoned: columns that they do not have, places beyond their strokes.
fn faults_of_seats(config: &Config, timeline: &Timeline) -> Vec<String> {
    let place =
        |misfit: &Misfit| format!("{}{misfit}", timeline.cue().column_place(&misfit.column(), misfit.at()));
    let misfits: Vec<String> = config.misfits(timeline).iter().map(place).collect();
    if !misfits.is_empty() {
        return misfits;
    }
    config.fits_stroke(timeline).faults.iter().map(ToString::to_string).collect()
}

/// How a cue that ends there follows the film of a hall, if one leads; an entry of a playlist may name the timecode of its beginning.
fn film_of(config: &Config, of: &EntryFilm, end: ShowTime) -> Result<Option<FilmStart>, Problem> {
    let refused =
        |why: String| Problem::new(Code::Check, why, "correct the playlist, or [sync], and load it again");
    let begin = of.begins(config).map_err(refused)?;
    Ok(begin.zip(config.sync.as_ref()).map(|(begin, sync)| {
        let (pace, join_above, rejoin) = (sync.pace, sync.join_above, sync.rejoin);
        FilmStart { begin, rules: ChaseRules { pace, join_above, rejoin, ..ChaseRules::until(end) } }
    }))
}

pub(super) fn read(
    library: &Library,
    config: &Config,
    id: &CueId,
    of: &EntryFilm,
) -> Result<Box<ProvedShow>, Problem> {
    let (timeline, sha256) = library.read(id)?;
    let film = film_of(config, of, timeline.duration())?;
    let mut proved = ProvedShow::prove_for(id.to_string(), config, timeline, sha256, film)?;
    proved.movie = of
        .movie
        .as_ref()
        .zip(config.film.as_ref())
        .map(|(name, player)| Movie { name: name.clone(), file: player.find(name) });
    Ok(Box::new(proved))
}
