//! One play in the foreground: from a cue and a configuration to the report.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use super::prepare::Preparation;
use super::report::Report;
use super::stage::Stage;
use super::staged::Staged;
use super::sum_up::sum_up;
use crate::config::{Config, Misfit};
use crate::cue::{CueFaults, Place};
use crate::engine::{Rate, Show};
use crate::fanout::Manner;
use crate::net::{NetError, Ports};
use crate::observe::Watched;
use crate::plan::PlanError;
use crate::proof::{self, Digest, Proof, Terms, Violation};
use crate::rt::{AckLoop, Live, MailEnds, PlanLoop, mailboxes};
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
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
    /// The system starts no further thread.
    #[error("no thread could be started; allow more with `ulimit -u` or TasksMax=")]
    Thread(#[source] io::Error),
    /// The frame port cannot be had.
    #[error(transparent)]
    Net(NetError),
}

fn list(cue: &Path, misfits: &[(Place, Misfit)]) -> String {
    let line = |(place, misfit): &(Place, Misfit)| format!("{}:{place}{misfit}", cue.display());
    misfits.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn broken(cue: &Path, violations: &[Violation], more: u64) -> String {
    let cue = cue.display();
    let mut text: String = violations.iter().map(|violation| format!("{cue}:{violation}\n")).collect();
    if more > 0 {
        text += &format!("{cue}: and {more} more\n");
    }
    text + &format!(
        "the limits proof failed, so nothing is played; `kinocue fit {cue} -o OUT` makes a cue that keeps the limits"
    )
}

/// A play that fits: cue, controllers and the first move are proved; nothing is open yet.
#[derive(Debug)]
pub struct Play {
    config: Config,
    manner: Manner,
    staged: Staged,
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
    /// Controllers that acked nothing, or were lost at the end; none where no replies were asked for.
    pub silent: Vec<String>,
}

impl Play {
    /// Proves that the cue fits the controllers, that it keeps all limits at its level, and that a move leads onto it.
    ///
    /// # Errors
    /// Everything that [`PlayError`] names but the network.
    pub fn new(config: Config, timeline: Timeline, show: Show, manner: Manner) -> Result<Self, PlayError> {
        fit(&config, &timeline)?;
        keeps_limits(&config, &timeline, show.rate, manner.level)?;
        let staged = Staged::new(&config, timeline, show, manner).map_err(PlayError::Plan)?;
        Ok(Self { config, manner, staged })
    }

    /// How long the first move onto the cue takes.
    #[must_use]
    pub fn join(&self) -> Duration {
        let course = &self.staged.course;
        let span = course.settled().as_nanos() - course.start.as_nanos();
        Duration::from_nanos(span.unsigned_abs())
    }

    /// Plays, on the calling thread, until the end or until `stop` is set.
    ///
    /// # Errors
    /// [`PlayError::Net`] where the frame port cannot be had, [`PlayError::Thread`] where there are too many threads.
    ///
    /// # Panics
    /// Where one of its threads panicked.
    pub fn run(mut self, stop: &AtomicBool, live: Arc<Live>) -> Result<Played, PlayError> {
        // Refused, the ports may still open; if not, their error says what to do.
        let _ = realtime::raise_open_files();
        let peers: Vec<_> = self.config.controllers.iter().map(|one| one.address).collect();
        let (sender, receiver) = Ports::open(self.config.show.bind, &peers).map_err(PlayError::Net)?.split();
        let show = self.staged.show.clone();
        let (mail, ends) = mailboxes(self.staged.lanes.len(), show.rate, Arc::clone(&live));
        let MailEnds { sent, ticks, requests, answers, retired } = ends;
        let watched = self.config.controllers.iter().map(Watched::of).collect();
        let mut acks = AckLoop::new(receiver, watched, self.manner.ack_every(&self.config), sent, ticks);
        let prepared = Preparation {
            clock: &Monotonic,
            sender: &sender,
            acks: &mut acks,
            controllers: &self.config.controllers,
            lanes: &mut self.staged.lanes,
            stop,
            live: &live,
        }
        .run(!self.manner.silent);
        let (engine, lanes, planner, timeline) = self.staged.split();
        let cue = timeline.cue().path().display().to_string();
        let plans = PlanLoop { planner, timeline, requests, answers, retired };
        let spin = Duration::from_micros(u64::from(self.config.show.spin_us));
        let stage = Stage { silent: self.manner.silent, rate: show.rate, spin, engine, lanes, sender, mail };
        let run = stage.run(acks, plans, stop).map_err(PlayError::Thread)?;
        Ok(sum_up(cue, &self.config.controllers, &show, self.manner.silent, &prepared, &run))
    }
}

fn fit(config: &Config, timeline: &Timeline) -> Result<(), PlayError> {
    let place = |misfit: Misfit| (timeline.cue().column_place(&misfit.column()), misfit);
    let misfits: Vec<_> = config.misfits(timeline).into_iter().map(place).collect();
    let strokes = config.fits_stroke(timeline).faults;
    if !misfits.is_empty() {
        return Err(PlayError::Misfit { cue: timeline.cue().path().to_path_buf(), misfits });
    }
    if strokes.is_empty() { Ok(()) } else { Err(PlayError::Stroke(strokes)) }
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
