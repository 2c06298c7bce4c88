//! One play in the foreground: from a cue and a configuration to the report.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::thread::{self, Builder};
use std::time::Duration;

use super::recording::{self, PlayRecording};
use super::refused::PlayError;
use super::roll_call::RollCall;
use super::runtime::{Control, LeadingFilm, Numbers, Purpose, Runtime, RuntimeError};
use super::script::{PlayHandle, PlayScript, off_park};
use super::staged::{StagedShow, at_any_pace, chasing};
use super::sum_up::{Played, SumUp, sum_up};
use super::{broadcasts, links};
use crate::config::{Config, Misfit};
use crate::drive::{Lane, Manner};
use crate::engine::{Ending, Show};
use crate::film::chase::ChaseRules;
use crate::film::follower::PaceLimits;
use crate::film::point::PublishedPoint;
use crate::proof::{self, Digest, LinkPlay, Proof, Terms};
use crate::record::{About as Recorded, Mode};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::time::{Clock as _, Rate};
use crate::timeline::Timeline;

/// A play that fits: cue, controllers and the first move are proved, and the frame port is open; nothing was sent yet.
#[derive(Debug)]
pub struct Play {
    runtime: Runtime,
    staged: StagedShow,
    /// True if nothing may move.
    holds: bool,
    recording: Option<PlayRecording>,
    /// Who answered.
    roll: Arc<RollCall>,
    /// What was proved of its links.
    links: Vec<LinkPlay>,
}

impl Play {
    /// Proves that the cue fits the controllers, that it keeps all limits at its level, and that a move leads onto it.
    ///
    /// # Errors
    /// Everything that [`PlayError`] names but the network.
    pub fn new(config: Config, timeline: Timeline, show: Show, manner: Manner) -> Result<Self, PlayError> {
        fit(&config, &timeline)?;
        let links = keeps_limits(&config, None, &timeline, show.rate, manner.level)?;
        Ok(Self { links, ..Self::staged(config, timeline, show, manner, None)? })
    }

    /// A play that waits, parked, for a film, and follows that: proved at the greatest pace that the film may ask for.
    ///
    /// # Errors
    /// As [`Play::new`].
    pub(crate) fn chasing(
        config: Config,
        timeline: Timeline,
        show: Show,
        manner: Manner,
        source: Arc<PublishedPoint>,
    ) -> Result<Self, PlayError> {
        let rules = ChaseRules::until(timeline.duration());
        fit(&config, &timeline)?;
        let links = keeps_limits(&config, Some(rules.pace), &timeline, show.rate, manner.level)?;
        let film = LeadingFilm { source, rules: Some(rules) };
        Ok(Self { links, ..Self::staged(config, timeline, show, manner, Some(film))? })
    }

    /// A play of frames that hold every seat at its park pose, whatever the cue asks for, effects off. It does not begin
    /// unless every seat tells that it stands there, to a pulse.
    ///
    /// # Errors
    /// As [`Play::new`], but for what a cue may be.
    pub(crate) fn holding(
        config: Config,
        timeline: Timeline,
        show: Show,
        silent: bool,
    ) -> Result<Self, PlayError> {
        // At level 0 the cue has no part in the pose.
        let manner = Manner { level: 0.0, silent };
        let mut play = Self::staged(config, timeline, show, manner, None)?;
        play.staged.lanes.iter_mut().for_each(Lane::hold);
        Ok(Self { holds: true, ..play })
    }

    fn staged(
        mut config: Config,
        timeline: Timeline,
        show: Show,
        manner: Manner,
        film: Option<LeadingFilm>,
    ) -> Result<Self, PlayError> {
        // The runtime ticks by its configuration.
        (config.show.rate_hz, config.show.timing) = (show.rate.hz(), show.timing);
        let mut staged = StagedShow::new(&config, timeline, show, manner).map_err(PlayError::Plan)?;
        if let Some(rules) = film.as_ref().and_then(|film| film.rules) {
            staged.headroom = chasing(staged.headroom, &rules);
        }
        let purpose = Purpose::Play { silent: manner.silent, film };
        let runtime = Runtime::open(Arc::new(config), purpose, &Numbers::new(), &Default::default(), None)?;
        let desk = runtime.control().desk;
        staged.mixes.iter().enumerate().for_each(|(lane, mix)| desk.set(lane, *mix));
        Ok(Self { runtime, staged, holds: false, recording: None, roll: Arc::default(), links: Vec::new() })
    }

    /// What to do where frames take too much of the time between ticks.
    pub(crate) fn crowding(&self) -> Option<&str> {
        self.runtime.crowding()
    }

    /// The same play, recorded to a file that is not there yet.
    ///
    /// # Errors
    /// Where the file cannot be begun.
    pub(crate) fn recorded(mut self, path: &Path, mode: Mode) -> io::Result<Self> {
        let Self { runtime, staged, .. } = &mut self;
        let (config, cue) = (Arc::clone(runtime.config()), staged.timeline.cue());
        let about = Recorded {
            hall: config.show.name.clone(),
            cue: cue.path().display().to_string(),
            title: cue.title().unwrap_or_default().to_owned(),
            cue_sha256: Digest::of(cue).to_string(),
            rate_hz: staged.show.rate.hz(),
            mode,
            clocks: (Monotonic.now(), wall_now_ns()),
        };
        let seats = recording::seats(&config, &staged.lanes);
        let (taps, recording) =
            PlayRecording::start(path, &about, &runtime.judging(false), seats, staged.show.rate)?;
        runtime.record(taps);
        Ok(Self { recording: Some(recording), ..self })
    }

    /// The same play, which begins without controllers that do not answer as that says.
    pub(crate) fn called(self, roll: &Arc<RollCall>) -> Self {
        Self { roll: Arc::clone(roll), ..self }
    }

    /// What it is led and watched by.
    #[must_use]
    pub fn control(&self) -> Control {
        self.runtime.control()
    }

    /// How long the first move onto the cue takes.
    #[must_use]
    pub(crate) fn join(&self) -> Duration {
        let course = &self.staged.course;
        let span = course.settled().as_nanos() - course.start.as_nanos();
        Duration::from_nanos(span.unsigned_abs())
    }

    /// Plays, on the calling thread, until the end or until it is told to leave. As the show is let go `lead` gets what it is led
    /// with, and says whether it will do so; unattended, a play ends with a stop or a fault.
    ///
    /// # Errors
    /// Everything that [`PlayError`] names of seats and of others that lead them; but for a slow way to park nothing has moved then.
    ///
    /// # Panics
    /// If one of its threads panicked.
    pub fn run(mut self, lead: impl FnOnce(PlayHandle) -> bool + Send) -> Result<Played, PlayError> {
        let Some(recording) = self.recording.take() else { return self.run_through(lead) };
        let mut played = self.run_through(lead);
        let trouble = recording.finish(played.as_ref().ok().map(|played| &played.report)).err();
        if let Ok(played) = &mut played {
            played.notes.extend(trouble.clone());
            played.report.recording_trouble = trouble;
        }
        played
    }

    fn run_through(mut self, lead: impl FnOnce(PlayHandle) -> bool + Send) -> Result<Played, PlayError> {
        let silent = self.runtime.is_silent();
        if !silent {
            self.look_for_others()?;
        }
        let Self { runtime, staged, holds, roll, links, .. } = self;
        let (config, ends) = (Arc::clone(runtime.config()), runtime.links().to_vec());
        let (cue, rate) = (staged.timeline.cue().path().display().to_string(), staged.show.rate);
        let (lanes, live) = (staged.lanes.clone(), runtime.control().live);
        let (end, led) = thread::scope(|scope| {
            let mut script = None;
            let end = runtime.run(|handle, _| {
                let led = PlayScript::new(handle, &staged, Arc::clone(&roll));
                let thread = Builder::new().name("script".to_owned());
                // A script that does not begin ends the runtime, too.
                let thread =
                    thread.spawn_scoped(scope, move || led.run(staged, holds, !silent || holds, lead));
                script.insert(thread).as_ref().ok().map(|thread| thread.thread().clone())
            })?;
            let script = script.expect("whoever runs has somebody lead").map_err(RuntimeError::Thread)?;
            Ok::<_, PlayError>((end, script.join().expect("the script does not panic")?))
        })?;
        let mut run = end.run;
        let ending = match run.ended.ending {
            Ending::Completed if led.is_cut_short => Ending::Stopped,
            ending => ending,
        };
        run.origin = led.began.unwrap_or(run.origin);
        let about = SumUp { cue, rate, ending: ending.into(), silent };
        let mut played = sum_up(about, &config.controllers, &led.prepared, &run);
        played.report.links = links::status(&config, &ends, &links);
        played.report.broadcasts = broadcasts::status(&config.controllers, &live);
        played.notes.extend(broadcasts::troubles(&config.controllers, &live));
        played.miss(roll.silent());
        if ending == Ending::Completed {
            let off_park = off_park(&lanes, &live, run.closed_at).into_iter();
            played.off_park = off_park.map(|(lane, _)| config.controllers[lane].name.clone()).collect();
        }
        Ok(played)
    }

    /// Refuses to play where somebody else sends to the same controllers.
    fn look_for_others(&mut self) -> Result<(), PlayError> {
        let found = self.runtime.find_other_masters();
        if found.is_empty() {
            return Ok(());
        }
        let name = |(lane, more): (usize, u16)| (self.runtime.config().controllers[lane].name.clone(), more);
        Err(PlayError::OtherMaster(found.into_iter().map(name).collect()))
    }
}

fn fit(config: &Config, timeline: &Timeline) -> Result<(), PlayError> {
    let place = |misfit: Misfit| (timeline.cue().column_place(&misfit.column(), misfit.at()), misfit);
    let misfits: Vec<_> = config.misfits(timeline).into_iter().map(place).collect();
    let strokes = config.fits_stroke(timeline).faults;
    if !misfits.is_empty() {
        return Err(PlayError::Misfit { cue: timeline.cue().path().to_path_buf(), misfits });
    }
    if strokes.is_empty() { Ok(()) } else { Err(PlayError::Stroke(strokes)) }
}

/// What was proved of its links, where it keeps all limits, at those paces if there are any.
fn keeps_limits(
    config: &Config,
    pace: Option<PaceLimits>,
    timeline: &Timeline,
    rate: Rate,
    level: f64,
) -> Result<Vec<LinkPlay>, PlayError> {
    let paced = pace.map(|pace| at_any_pace(config, pace, rate));
    let config = paced.as_ref().unwrap_or(config);
    let terms = Terms::of_hall(config, Digest::of(timeline.cue()), rate, level);
    let proof = proof::prove_in(config, timeline, terms);
    if proof.passed() {
        return Ok(proof.links);
    }
    let Proof { violations, more, .. } = proof;
    Err(PlayError::Limits {
        cue: timeline.cue().path().to_path_buf(),
        violations,
        more,
        chases: pace.is_some(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::from_to_args;
    use crate::latency::cue;
    use crate::time::ShowTime;
    use crate::wire::Timing;

    #[test]
    fn a_play_ticks_as_its_show_says_whatever_its_configuration_had() {
        let mut config = from_to_args(&["127.0.0.1:9".to_owned()], &[], 1).unwrap();
        config.show.bind = "127.0.0.1:0".parse().unwrap();
        let (rate, start) = (Rate::from_hz(250.0), ShowTime::ZERO);
        let show = Show { rate, timing: Timing::Absolute, start, plays: 1 };
        let timeline = cue(&config.controllers, 1);
        let play = Play::new(config, timeline, show, Manner { level: 1.0, silent: false }).unwrap();
        let show = &play.runtime.config().show;
        assert_eq!((Rate::from_hz(show.rate_hz).period(), show.timing), (rate.period(), Timing::Absolute));
    }
}
