//! One play in the foreground: from a cue and a configuration to the report.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use rtrb::Producer;

use super::company::Company;
use super::prepare::{Preparation, Unready};
use super::report::Report;
use super::stage::Stage;
use super::staged::StagedShow;
use super::sum_up::{About, sum_up};
use crate::belief::{FRESH, LaneEvidence, Reading};
use crate::config::{Config, Misfit};
use crate::cue::{CueFaults, Place};
use crate::drive::{Lane, Manner};
use crate::engine::{Ending, Show};
use crate::film::chase::ChaseRules;
use crate::film::follower::PaceLimits;
use crate::film::point::PublishedPoint;
use crate::health::{Groups, HealthTable};
use crate::motion::Window;
use crate::net::{NetError, Ports, Sender};
use crate::observe::Watched;
use crate::plain;
use crate::plan::PlanError;
use crate::proof::{self, Digest, Proof, Terms, Violation};
use crate::rt::{
    AckLoop, Alarm, Command, Desk, Live, Mail, MailEnds, NewsIn, Places, PlanLoop, Planning, Watch, mailboxes,
};
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
use crate::time::{MonoTime, Rate};
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

/// A play that fits: cue, controllers and the first move are proved; nothing is open yet.
#[derive(Debug)]
pub struct Play {
    config: Config,
    manner: Manner,
    staged: StagedShow,
    mail: Mail,
    ends: MailEnds,
    control: Control,
    /// True if nothing may move.
    holds: bool,
    chased: Option<Chased>,
}

/// A film that a play chases.
#[derive(Debug, Clone)]
pub(super) struct Chased {
    /// Where its source says where it is.
    pub(super) source: Arc<PublishedPoint>,
    /// How it is followed.
    pub(super) rules: ChaseRules,
}

/// What a play is led and watched by while it runs.
#[derive(Debug, Clone)]
pub struct Control {
    /// Where levels, effects, seats, trim and the stop are set.
    pub desk: Arc<Desk>,
    /// How far the play is.
    pub live: Arc<Live>,
    /// Set to have the seats parked and the play end.
    pub leave: Arc<AtomicBool>,
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
        let staged = StagedShow::new(&config, timeline, show, manner).map_err(PlayError::Plan)?;
        Ok(Self::of(config, staged, manner))
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
        let staged = StagedShow::new(&config, timeline, show, manner).map_err(PlayError::Plan)?;
        Ok(Self { chased: Some(Chased { source, rules }), ..Self::of(config, staged, manner) })
    }

    /// A play of frames that hold every seat at its park pose, whatever the cue asks for, effects off. It does not begin
    /// unless every seat tells that it stands there, to a pulse.
    ///
    /// # Errors
    /// [`PlayError::Plan`] where no course leads along the cue.
    pub fn holding(config: Config, timeline: Timeline, show: Show, silent: bool) -> Result<Self, PlayError> {
        // At level 0 the cue has no part in the pose.
        let manner = Manner { level: 0.0, silent };
        let mut staged = StagedShow::new(&config, timeline, show, manner).map_err(PlayError::Plan)?;
        staged.lanes.iter_mut().for_each(Lane::hold);
        Ok(Self { holds: true, ..Self::of(config, staged, manner) })
    }

    fn of(config: Config, staged: StagedShow, manner: Manner) -> Self {
        let live = Arc::new(Live::new(staged.lanes.len()));
        let (mail, ends) = mailboxes(staged.lanes.len(), staged.show.rate, Arc::clone(&live));
        let control = Control { desk: Arc::new(staged.desk()), live, leave: Arc::default() };
        Self { config, manner, staged, mail, ends, control, holds: false, chased: None }
    }

    /// What it is led and watched by.
    #[must_use]
    pub const fn control(&self) -> &Control {
        &self.control
    }

    /// How long the first move onto the cue takes.
    #[must_use]
    pub fn join(&self) -> Duration {
        let course = &self.staged.course;
        let span = course.settled().as_nanos() - course.start.as_nanos();
        Duration::from_nanos(span.unsigned_abs())
    }

    /// Plays, on the calling thread, until the end or until it is told to leave. Before the first tick `lead` gets what it
    /// is led with, and says whether it will do so; unattended, a play ends with a stop or a fault.
    ///
    /// # Errors
    /// [`PlayError::Net`] where the frame port cannot be had, [`PlayError::Thread`] where there are too many threads,
    /// [`PlayError::Unsure`] where a seat to be held may not stand where it should.
    ///
    /// # Panics
    /// If one of its threads panicked.
    pub fn run(mut self, lead: impl FnOnce(PlayHandle) -> bool) -> Result<Played, PlayError> {
        let (sender, receiver) = open(&self.config)?.split();
        let show = self.staged.show.clone();
        let MailEnds { sent, ticks, tasks, answers, commands, alarms, news } = self.ends;
        let watched = self.config.controllers.iter().map(Watched::of).collect();
        let mut acks = AckLoop::new(receiver, watched, self.manner.ack_every(&self.config), sent, ticks);
        let Control { live, leave, .. } = &self.control;
        if !self.manner.silent {
            look_for_others(&self.config, &self.staged.lanes, &sender, &mut acks, leave)?;
        }
        // Not sooner: what it reads would be counted.
        acks.tell(Arc::clone(live));
        acks.watched_by(watch(&self.config, self.manner, &self.staged, &sender, alarms, live));
        let mut places = Places::new(&self.staged.lanes, show.rate);
        let mut preparation = Preparation {
            clock: &Monotonic,
            sender: &sender,
            acks: &mut acks,
            controllers: &self.config.controllers,
            lanes: &mut self.staged.lanes,
            places: &mut places,
            stop: leave,
            live,
        };
        let prepared = if self.holds {
            preparation.make_sure().map_err(PlayError::Unsure)?
        } else {
            preparation.run(!self.manner.silent).map_err(PlayError::of)?
        };
        let (engine, lanes, planner, timeline) = self.staged.split();
        let cue = timeline.cue().path().display().to_string();
        let plans = PlanLoop { planning: Box::new(Planning { planner, timeline }), tasks, answers };
        let stage = Stage {
            silent: self.manner.silent,
            rate: show.rate,
            spin: Duration::from_micros(u64::from(self.config.show.spin_us)),
            engine,
            lanes,
            places,
            sender,
            mail: self.mail,
            chased: self.chased,
        };
        let attended = lead(PlayHandle { commands, news });
        let parks: Vec<Window> = stage.lanes.iter().map(|lane| lane.window.clone()).collect();
        let run = stage.run(acks, plans, attended, &self.control).map_err(PlayError::Thread)?;
        let about =
            About { cue, rate: show.rate, ending: run.ended.ending.into(), silent: self.manner.silent };
        let mut played = sum_up(about, &self.config.controllers, &prepared, &run);
        if run.ended.ending == Ending::Completed {
            played.off_park = off_park(&self.config, &parks, &self.control.live, run.closed_at);
        }
        Ok(played)
    }
}

/// Refuses to play where somebody else sends to the same controllers.
fn look_for_others(
    config: &Config,
    lanes: &[Lane],
    sender: &Sender,
    acks: &mut AckLoop,
    stop: &AtomicBool,
) -> Result<(), PlayError> {
    let controllers = &*config.controllers;
    let found = Company { clock: &Monotonic, sender, acks, controllers, lanes, stop }.look();
    if found.is_empty() {
        return Ok(());
    }
    let name = |(lane, more): (usize, u16)| (controllers[lane].name.clone(), more);
    Err(PlayError::OtherMaster(found.into_iter().map(name).collect()))
}

/// The seats that told, after the last frame, that they are not at park.
fn off_park(config: &Config, windows: &[Window], live: &Live, now: MonoTime) -> Vec<String> {
    let is_up = |lane: &usize| {
        let window = &windows[*lane];
        let reading = live.evidence(*lane).and_then(LaneEvidence::reading);
        reading.is_some_and(|(_, Reading { pose, slots, at, .. })| {
            if now.since(at) > FRESH {
                return false; // what it told before the show says nothing of its end
            }
            let told = window.moving().filter(|(slot, _)| slots >> slot & 1 == 1);
            told.into_iter().any(|(slot, axis)| (pose[slot] - axis.park).abs() > PARKED)
        })
    };
    (0..windows.len()).filter(is_up).map(|lane| config.controllers[lane].name.clone()).collect()
}

/// How far from park a seat may be read that was brought there, in strokes: 0.3 mm of 150.
const PARKED: f64 = 0.002;

impl PlayError {
    fn of(unready: Unready) -> Self {
        let Unready { moving, unsure } = unready;
        if moving.is_empty() { Self::Unplaced(unsure) } else { Self::Moving(moving) }
    }
}

/// Binds the frame port.
fn open(config: &Config) -> Result<Ports, PlayError> {
    // Refused, the ports may still open; if not, their error says what to do.
    let _ = realtime::raise_open_files();
    let peers: Vec<_> = config.controllers.iter().map(|one| one.address).collect();
    Ports::open(config.show.bind, &peers).map_err(PlayError::Net)
}

/// Who judges how the controllers of a play stand.
fn watch(
    config: &Config,
    manner: Manner,
    staged: &StagedShow,
    sender: &Sender,
    alarms: Producer<Alarm>,
    live: &Arc<Live>,
) -> Watch {
    let groups = Groups::of(&config.controllers);
    let (policy, ack_every) = (config.show.loss_policy, manner.ack_every(config));
    let health = HealthTable::new(groups, policy, ack_every, staged.show.rate.period());
    Watch::new(health, &config.controllers, &staged.lanes, sender.clone(), alarms, Arc::clone(live))
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
