//! One play in the foreground: from a cue and a configuration to the report.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use super::prepare::{Preparation, Prepared};
use super::report::{ControllerReport, LatencyReport, RealTimeReport, Report};
use crate::config::{Config, Controller};
use crate::cue::CueFaults;
use crate::engine::{Ending, Engine, Headroom, Show, TickGrid};
use crate::fanout::{FanOutFault, Lane, Manner, lanes};
use crate::net::{DrainGrid, NetError, Ports, Sender};
use crate::plan::{Course, Curve, From, PlanError, Planner, Request, To};
use crate::rt::{Accounts, AckLoop, Ended, Live, MailEnds, PlanLoop, TickLoop, mailboxes};
use crate::sys::clock::Monotonic;
use crate::sys::realtime::{self, RealTime};
use crate::time::Clock;
use crate::timeline::{Hint, Timeline};

/// From the end of preparing to tick 0: time to start the threads.
const RUN_UP: Duration = Duration::from_millis(20);

/// Why nothing was played. Nothing has moved then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlayError {
    /// The cue and the controllers do not fit.
    #[error("{}", list(.0))]
    FanOut(Vec<FanOutFault>),
    /// The cue leaves the stroke of a seat.
    #[error(transparent)]
    Stroke(CueFaults),
    /// No move leads onto the cue.
    #[error(transparent)]
    Plan(PlanError),
    /// The frame port cannot be had.
    #[error(transparent)]
    Net(NetError),
}

fn list(faults: &[FanOutFault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// A play that fits: cue, controllers and the first move are proved; nothing is open yet.
#[derive(Debug)]
pub struct Play {
    config: Config,
    timeline: Arc<Timeline>,
    show: Show,
    manner: Manner,
    lanes: Vec<Lane>,
    headroom: Headroom,
    planner: Planner,
    course: Box<Course>,
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
    /// Proves that the cue fits the controllers and that a move leads onto it.
    ///
    /// # Errors
    /// Everything that [`PlayError`] names but the network.
    pub fn new(config: Config, timeline: Timeline, show: Show, manner: Manner) -> Result<Self, PlayError> {
        let lanes = lanes(&config, timeline.cue(), manner).map_err(PlayError::FanOut)?;
        fit_strokes(&config, &timeline)?;
        let windows: Vec<_> = lanes.iter().map(|lane| lane.window.clone()).collect();
        let pose = |at| timeline.sample(at, &mut Hint::default());
        let curve = Curve { pose: &pose, end: timeline.duration() };
        let mut planner = Planner::new(windows.clone(), show.rate.hz());
        let request = Request { from: From::Park, to: To::Cue, start: show.start, serial: 1 };
        let course = Box::new(planner.plan(request, &curve).map_err(PlayError::Plan)?);
        let headroom = Headroom::measure(&windows, &curve, show.rate);
        Ok(Self { config, timeline: Arc::new(timeline), show, manner, lanes, headroom, planner, course })
    }

    /// How long the first move onto the cue takes.
    #[must_use]
    pub fn join(&self) -> Duration {
        let span = self.course.settled().as_nanos() - self.course.start.as_nanos();
        Duration::from_nanos(span.unsigned_abs())
    }

    /// Plays, on the calling thread, until the end or until `stop` is set.
    ///
    /// # Errors
    /// [`PlayError::Net`] where the frame port cannot be had.
    ///
    /// # Panics
    /// Where one of its threads panicked.
    pub fn run(mut self, stop: &AtomicBool, live: Arc<Live>) -> Result<Played, PlayError> {
        let peers: Vec<_> = self.config.controllers.iter().map(|one| one.address).collect();
        let (sender, receiver) = Ports::open(self.config.show.bind, &peers).map_err(PlayError::Net)?.split();
        let (mail, ends) = mailboxes(self.lanes.len(), self.show.rate, live);
        let MailEnds { sent, ticks, requests, answers, retired } = ends;
        let mut acks = AckLoop::new(receiver, sent, ticks);
        let prepared = Preparation {
            clock: &Monotonic,
            sender: &sender,
            acks: &mut acks,
            controllers: &self.config.controllers,
            lanes: &mut self.lanes,
            stop,
        }
        .run(!self.manner.silent);
        let plans = PlanLoop {
            planner: self.planner,
            timeline: Arc::clone(&self.timeline),
            requests,
            answers,
            retired,
        };
        let stage = Stage {
            silent: self.manner.silent,
            show: self.show.clone(),
            timeline: self.timeline,
            headroom: self.headroom,
            lanes: self.lanes,
            course: self.course,
            sender,
        };
        let run = stage.run(acks, plans, mail, stop);
        Ok(sum_up(&self.config.controllers, &self.show, self.manner.silent, &prepared, run))
    }
}

/// Each controller's own axes have to stay within its seat's stroke.
fn fit_strokes(config: &Config, timeline: &Timeline) -> Result<(), PlayError> {
    for controller in &config.controllers {
        let first = controller.axis_offset;
        let last = (first + controller.seat.axes).min(timeline.cue().axes());
        if let Some(faults) = timeline.fits_stroke(first.min(last)..last, Some(&controller.seat)).faults {
            return Err(PlayError::Stroke(faults));
        }
    }
    Ok(())
}

/// What the threads of a play share out among themselves.
struct Stage {
    /// Whether no replies are to come.
    silent: bool,
    show: Show,
    timeline: Arc<Timeline>,
    headroom: Headroom,
    lanes: Vec<Lane>,
    course: Box<Course>,
    sender: Sender,
}

/// What the threads of a play came back with.
struct Run {
    ended: Ended,
    accounts: Accounts,
    granted: RealTime,
    refusals: Vec<PlanError>,
    cue: String,
}

impl Stage {
    /// The calling thread becomes the tick thread; the others are started before it asks for real-time service, which
    /// they would inherit.
    fn run(self, acks: AckLoop, mut plans: PlanLoop, mut mail: crate::rt::Mail, stop: &AtomicBool) -> Run {
        let cue = self.timeline.cue().path().display().to_string();
        let (sent_all, done) = (AtomicBool::new(false), AtomicBool::new(false));
        thread::scope(|scope| {
            let origin = Monotonic.now() + RUN_UP;
            let period = self.show.rate.period();
            let drains =
                if self.silent { DrainGrid::rare(origin, period) } else { DrainGrid::new(origin, period) };
            let sent_all = &sent_all;
            let ack_thread = scope.spawn(move || {
                let _ = realtime::normal_priority();
                acks.run(&Monotonic, drains, || sent_all.load(Ordering::Acquire))
            });
            let plan_thread = scope.spawn(|| {
                let _ = realtime::normal_priority();
                plans.run(&done)
            });
            mail.wakes(plan_thread.thread().clone());
            let granted = realtime::request();
            let windows = self.lanes.iter().map(|lane| lane.window.clone()).collect();
            let grid = TickGrid::new(origin.max(Monotonic.now()), self.show.rate);
            let engine = Engine::new(self.show, self.timeline, self.headroom, windows, self.course);
            let ended = TickLoop {
                clock: &Monotonic,
                grid,
                engine,
                lanes: self.lanes,
                sink: self.sender,
                mail,
                stop,
            }
            .run();
            sent_all.store(true, Ordering::Release);
            done.store(true, Ordering::Release);
            plan_thread.thread().unpark();
            let refusals = plan_thread.join().expect("the planner does not panic");
            let accounts = ack_thread.join().expect("the ack thread does not panic");
            Run { ended, accounts, granted, refusals, cue }
        })
    }
}

fn sum_up(controllers: &[Controller], show: &Show, silent: bool, prepared: &Prepared, run: Run) -> Played {
    let tracker = run.accounts.books.tracker();
    let entries = controllers.iter().enumerate().map(|(index, controller)| {
        let counts = tracker.counts(index);
        ControllerReport {
            name: controller.name.clone(),
            address: controller.address.to_string(),
            sent: counts.sent,
            asked: counts.asked,
            acked: counts.acked,
            refused: counts.refused(),
            lost: counts.lost,
            homing: prepared.homing[index],
            duplicate: counts.duplicate,
            stale: counts.stale,
            stray: counts.stray,
            send_failed: counts.send_failed,
            port_closed: counts.port_closed,
            ack_us: LatencyReport::of(tracker.latency(index)),
        }
    });
    let report = Report {
        cue: run.cue,
        result: match run.ended.ending {
            Ending::Completed => "completed",
            Ending::Stopped => "stopped",
            Ending::Fault => "fault",
        },
        ticks: run.ended.ticks,
        missed_ticks: run.ended.missed,
        rate_hz: show.rate.hz(),
        lateness_us: LatencyReport::of(&run.accounts.lateness),
        realtime: RealTimeReport::from(&run.granted),
        strangers: run.accounts.strangers,
        controllers: entries.collect(),
    };
    let mut notes: Vec<String> = run.refusals.iter().map(ToString::to_string).collect();
    notes.extend(prepared.hurried.iter().map(|&index| {
        let seat = &controllers[index].seat;
        format!(
            "{}: its stroke of {} mm was crossed in 3 s at the most (PA0b), so its way to park may have been faster \
             than 50 mm/s",
            controllers[index].name, seat.stroke_mm
        )
    }));
    if run.ended.unposted > 0 {
        notes.push(format!(
            "{} records found no room and were inferred from frame numbers",
            run.ended.unposted
        ));
    }
    let lost = (0..controllers.len()).filter(|&index| !silent && tracker.lost_at_end(index));
    let silent = lost.map(|index| controllers[index].name.clone()).collect();
    Played { report, refusals: run.granted.refusals, notes, silent }
}
