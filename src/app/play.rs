//! One play in the foreground: from a cue and a configuration to the report.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{self, Builder};
use std::time::Duration;

use rtrb::Producer;

use super::report::Report;
use super::runtime::{ChasedFilm, Control, Numbers, Purpose, Runtime, RuntimeError};
use super::script::{Script, off_park};
use super::staged::StagedShow;
use super::sum_up::{About, sum_up};
use crate::config::{Config, Misfit};
use crate::cue::{CueFaults, Place};
use crate::drive::{Lane, Manner};
use crate::engine::{Ending, Show};
use crate::film::chase::ChaseRules;
use crate::film::follower::PaceLimits;
use crate::film::point::PublishedPoint;
use crate::plain;
use crate::plan::PlanError;
use crate::proof::{self, Digest, Proof, Terms, Violation};
use crate::rt::{Command, NewsIn};
use crate::time::Rate;
use crate::timeline::Timeline;

/// Why nothing was played. Nothing has moved then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlayError {
    /// The hall cannot do what the cue asks; each with its place in the file.
    #[error("{}", list(cue, misfits))]
    Misfit {
        /// The cue's file.
        cue: PathBuf,
        /// Where the file asks for what.
        misfits: Vec<(Place, Misfit)>,
    },
    /// The cue leaves the stroke of some seats.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Stroke(Vec<CueFaults>),
    /// The cue breaks limits of the seats, the effects or the controllers.
    #[error("{}", broken(cue, violations, *more))]
    Limits {
        /// The cue's file.
        cue: PathBuf,
        /// What is broken, each with its place in the file.
        violations: Vec<Violation>,
        /// How many more there are.
        more: u64,
    },
    /// No move leads onto the cue.
    #[error(transparent)]
    Plan(PlanError),
    /// The frame port cannot be had, or no thread.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// Somebody else sends to these controllers, so many datagrams within about a second.
    #[error("{}; end whatever else sends to them: another kinocue, player or tool", others(.0))]
    OtherMaster(Vec<(String, u16)>),
    /// Seats that were to be held did not all tell, just before the first frame, that they stand where they are held.
    #[error("{}: cannot be held, as the seat did not tell that it still stands where it stood; try again", .0.join(", "))]
    Unsure(Vec<String>),
    /// Seats that move though nothing was sent to them from here.
    #[error(
        "{}: moves, though nothing was sent to it from here: another machine drives it, or it is being homed; nothing was sent",
        .0.join(", ")
    )]
    Moving(Vec<String>),
    /// Seats that do not tell where all of their axes are, and cannot be known to have come to park.
    #[error(
        "{}: does not tell where all of its axes are, and cannot be brought to park for certain: it does not ack, or its longest \
         Time (PA0b, max_interval_ms) is too short for the stroke; home it, and try again",
        .0.join(", ")
    )]
    Unplaced(Vec<String>),
}

fn others(found: &[(String, u16)]) -> String {
    let one = |(name, more): &(String, u16)| {
        format!("{name} got {more} datagrams (DP34) that were not sent from here")
    };
    found.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn list(cue: &Path, misfits: &[(Place, Misfit)]) -> String {
    let line = |(place, misfit): &(Place, Misfit)| format!("{}:{place}{misfit}", plain::path(cue));
    misfits.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn broken(cue: &Path, violations: &[Violation], more: u64) -> String {
    let cue = plain::path(cue);
    let mut text: String = violations.iter().map(|violation| format!("{cue}:{violation}\n")).collect();
    if more > 0 {
        text += &format!("{cue}: and {more} more\n");
    }
    text + &format!(
        "the limits proof failed, so nothing is played; `kinocue fit {cue} -o OUT` makes a cue that keeps the limits"
    )
}

/// A play that fits: cue, controllers and the first move are proved, and the frame port is open; nothing was sent yet.
#[derive(Debug)]
pub struct Play {
    runtime: Runtime,
    staged: StagedShow,
    silent: bool,
    /// True if nothing may move.
    holds: bool,
}

/// What a play is led with.
#[derive(Debug)]
pub struct PlayHandle {
    /// What is asked of the hall.
    pub commands: Producer<Command>,
    /// What the hall does.
    pub news: NewsIn,
}

/// What came of a play.
#[derive(Debug)]
pub struct Played {
    /// Its report.
    pub report: Report,
    /// What the system refused, in words.
    pub refusals: Vec<String>,
    /// What else a person should know, in words.
    pub notes: Vec<String>,
    /// Controllers that acked nothing, or were lost at the end; `None` if no replies were asked for.
    pub silent: Vec<String>,
    /// Controllers whose seats were to park at the end, and tell that they are elsewhere.
    pub off_park: Vec<String>,
}

impl Play {
    /// Proves that the cue fits the controllers, that it keeps all limits at its level, and that a move leads onto it.
    ///
    /// # Errors
    /// Everything that [`PlayError`] names but the network.
    pub fn new(config: Config, timeline: Timeline, show: Show, manner: Manner) -> Result<Self, PlayError> {
        fit(&config, &timeline)?;
        keeps_limits(&config, &timeline, show.rate, manner.level)?;
        Self::staged(config, timeline, show, manner, None)
    }

    /// A play that waits, parked, for a film, and follows that: proved at the greatest pace that the film may ask for.
    ///
    /// # Errors
    /// As [`Play::new`].
    pub fn chasing(
        config: Config,
        timeline: Timeline,
        show: Show,
        manner: Manner,
        source: Arc<PublishedPoint>,
    ) -> Result<Self, PlayError> {
        let rules = ChaseRules::until(timeline.duration());
        fit(&config, &timeline)?;
        keeps_limits(&at_any_pace(&config, rules.pace), &timeline, show.rate, manner.level)?;
        Self::staged(config, timeline, show, manner, Some(ChasedFilm { source, rules }))
    }

    /// A play of frames that hold every seat at its park pose, whatever the cue asks for, effects off. It does not begin
    /// unless every seat tells that it stands there, to a pulse.
    ///
    /// # Errors
    /// As [`Play::new`], but for what a cue may be.
    pub fn holding(config: Config, timeline: Timeline, show: Show, silent: bool) -> Result<Self, PlayError> {
        // At level 0 the cue has no part in the pose.
        let manner = Manner { level: 0.0, silent };
        let mut play = Self::staged(config, timeline, show, manner, None)?;
        play.staged.lanes.iter_mut().for_each(Lane::hold);
        Ok(Self { holds: true, ..play })
    }

    fn staged(
        config: Config,
        timeline: Timeline,
        show: Show,
        manner: Manner,
        film: Option<ChasedFilm>,
    ) -> Result<Self, PlayError> {
        let staged = StagedShow::new(&config, timeline, show, manner).map_err(PlayError::Plan)?;
        let silent = manner.silent;
        let purpose = Purpose::Play { silent, film };
        let runtime = Runtime::open(Arc::new(config), purpose, &Numbers::new(), &Arc::default())?;
        for (lane, mix) in staged.mixes.iter().enumerate() {
            runtime.control().desk.set(lane, *mix);
        }
        Ok(Self { runtime, staged, silent, holds: false })
    }

    /// What it is led and watched by.
    #[must_use]
    pub const fn control(&self) -> &Control {
        self.runtime.control()
    }

    /// How long the first move onto the cue takes.
    #[must_use]
    pub fn join(&self) -> Duration {
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
        if !self.silent {
            self.look_for_others()?;
        }
        let Self { runtime, staged, silent, holds } = self;
        let config = Arc::clone(runtime.config());
        let (cue, rate) = (staged.timeline.cue().path().display().to_string(), staged.show.rate);
        let (lanes, live) = (staged.lanes.clone(), Arc::clone(&runtime.control().live));
        let (end, led) = thread::scope(|scope| {
            let mut script = None;
            let end = runtime.run(|handle, _| {
                let led = Script::new(handle, &staged);
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
        let about = About { cue, rate, ending: ending.into(), silent };
        let mut played = sum_up(about, &config.controllers, &led.prepared, &run);
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

/// The hall with what is left of its seats' limits at those paces.
fn at_any_pace(config: &Config, pace: PaceLimits) -> Config {
    let mut config = config.clone();
    for controller in &mut config.controllers {
        let seat = Arc::make_mut(&mut controller.seat);
        [seat.max_velocity_mm_s, seat.max_acceleration_mm_s2, seat.max_jerk_mm_s3] =
            pace.leave(seat.max_velocity_mm_s, seat.max_acceleration_mm_s2, seat.max_jerk_mm_s3);
    }
    config
}

fn keeps_limits(config: &Config, timeline: &Timeline, rate: Rate, level: f64) -> Result<(), PlayError> {
    let terms = Terms::of_hall(config, Digest::of(timeline.cue()), rate, level);
    let proof = proof::prove(timeline, terms);
    if proof.passed() {
        return Ok(());
    }
    let Proof { violations, more, .. } = proof;
    Err(PlayError::Limits { cue: timeline.cue().path().to_path_buf(), violations, more })
}
