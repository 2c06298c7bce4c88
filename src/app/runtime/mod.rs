//! A hall that lives on between shows: the sockets, the tick thread's loop and its helpers, opened once for a configuration.
//! The main thread is the tick thread; whoever leads the hall holds the [`RuntimeHandle`].

mod boot;
mod device_job;

pub use device_job::{DeviceJob, Finding, run_on_devices};

use std::collections::BTreeMap;
use std::io;
use std::net::SocketAddrV4;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::{self, Thread};
use std::time::Duration;

use rtrb::{Producer, RingBuffer};

use super::helpers::{EndFlags, Helpers};
use super::run::Run;
use crate::config::Config;
use crate::drive::Lane;
use crate::engine::Engine;
use crate::health::{Groups, HealthTable};
use crate::net::{DrainGrid, NetError, Receiver, Sender};
use crate::observe::Watched;
use crate::plan::PlanError;
use crate::rt::{
    AckLoop, Alarm, Command, Conductor, Desk, Line, Live, Mail, MailEnds, NewsIn, Order, Places, PlanLoop,
    Planning, Spinning, Standby, TickLoop, Watch, line, mailboxes,
};
use crate::sys::clock::Monotonic;
use crate::sys::realtime::{self, Policy, RealTime};
use crate::time::{Clock, MonoTime, Rate, TickGrid};
use crate::wire::FrameNo;

/// From the start of the threads to tick 0.
const RUN_UP: Duration = Duration::from_millis(20);
/// Orders to the ack thread that wait at the most.
const ORDERS: usize = 4096;

/// Why a hall does not open. Nothing has moved then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RuntimeError {
    /// The frame port cannot be had.
    #[error(transparent)]
    Net(NetError),
    /// No course leads to the park poses of these seats.
    #[error(transparent)]
    Plan(PlanError),
    /// The system starts no further thread.
    #[error("no thread could be started; allow more with TasksMax= in the unit, or `ulimit -u`")]
    Thread(#[source] io::Error),
}

/// The number of each controller's next frame, by its address: a number never comes twice within one process.
pub type Numbers = BTreeMap<SocketAddrV4, FrameNo>;

/// A hall whose threads are about to start.
#[derive(Debug)]
pub struct Runtime {
    config: Arc<Config>,
    desk: Arc<Desk>,
    live: Arc<Live>,
    leave: Arc<AtomicBool>,
    engine: Engine,
    lanes: Vec<Lane>,
    sender: Sender,
    mail: Mail,
    acks: AckLoop,
    plans: PlanLoop,
    line: Line,
    commands: Producer<Command>,
    news: NewsIn,
    orders: Producer<Order>,
}

/// What a hall is led with and watched by.
#[derive(Debug)]
pub struct RuntimeHandle {
    /// Whose hall it is.
    pub config: Arc<Config>,
    /// Where levels, effects, seats, trim and the stop are set.
    pub desk: Arc<Desk>,
    /// How far the show is, and how the controllers stand.
    pub live: Arc<Live>,
    /// Set to have the seats parked and the hall close.
    pub leave: Arc<AtomicBool>,
    /// What is asked of the hall.
    pub commands: Producer<Command>,
    /// What the hall does; every command is answered.
    pub news: NewsIn,
    /// What the ack thread is told.
    pub orders: Producer<Order>,
    /// What the system granted the tick thread.
    pub granted: RealTime,
}

/// What a hall came to when it closed.
#[derive(Debug)]
pub struct RuntimeEnd {
    /// What its threads came back with.
    pub run: Run,
    /// From where frame numbers go on.
    pub numbers: Numbers,
}

impl Runtime {
    /// Opens the frame port for a configuration; `crashed` says whether the mark of a crash was there. Where `signals` ask for
    /// the end, the seats park and the hall closes, even if whoever leads it does not hear them.
    ///
    /// # Errors
    /// Why not.
    pub fn open(
        config: Arc<Config>,
        crashed: bool,
        numbers: &Numbers,
        signals: &Arc<AtomicBool>,
    ) -> Result<Self, RuntimeError> {
        // Refused, the ports may still open; if not, their error says what to do.
        let _ = realtime::raise_open_files();
        let halves = boot::bind(&config)?;
        Self::over(config, crashed, numbers, signals, halves)
    }

    /// The same by sockets, or another network, that are open.
    ///
    /// # Errors
    /// As [`Runtime::open`].
    pub fn over(
        config: Arc<Config>,
        crashed: bool,
        numbers: &Numbers,
        signals: &Arc<AtomicBool>,
        halves: (Sender, Receiver),
    ) -> Result<Self, RuntimeError> {
        let rate = Rate::from_hz(config.show.rate_hz);
        let opened = boot::open(&config, numbers, halves)?;
        let desk = Arc::new(opened.desk().ended_by(Arc::clone(signals)));
        let boot::Opened { engine, lanes, planner, timeline, sender, receiver } = opened;
        let controllers = &config.controllers;
        let live = Arc::new(Live::new(controllers.len()));
        let (mail, ports) = mailboxes(controllers.len(), rate, Arc::clone(&live));
        let MailEnds { sent, ticks, tasks, answers, commands, alarms, news } = ports;
        let (line, line_end) = line(sender.clone(), controllers.len());
        let (orders, orders_end) = RingBuffer::new(ORDERS);
        let standby = Standby::new(controllers, line_end, Arc::clone(&desk), orders_end, crashed);
        let watch = watch(&config, &lanes, &sender, alarms, &live).of_a_hall(standby);
        let watched = controllers.iter().map(Watched::of).collect();
        let firsts: Vec<FrameNo> = lanes.iter().map(|lane| lane.last_frame().next()).collect();
        let mut acks = AckLoop::going_on(receiver, watched, &firsts, config.show.ack_every, sent, ticks);
        acks.tell(Arc::clone(&live));
        acks.watched_by(watch);
        let plans = PlanLoop { planning: Box::new(Planning { planner, timeline }), tasks, answers };
        let leave = Arc::default();
        Ok(Self {
            config,
            desk,
            live,
            leave,
            engine,
            lanes,
            sender,
            mail,
            acks,
            plans,
            line,
            commands,
            news,
            orders,
        })
    }

    /// Where levels and the stop are set.
    #[must_use]
    pub fn desk(&self) -> Arc<Desk> {
        Arc::clone(&self.desk)
    }

    /// Whose hall it is.
    #[must_use]
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Runs it on the calling thread, which becomes the tick thread, until it is told to leave. Before the first tick `lead`
    /// gets the runtime, and says which thread is woken by news of it.
    ///
    /// # Errors
    /// [`RuntimeError::Thread`]; nothing was sent then.
    ///
    /// # Panics
    /// If one of its threads panicked.
    pub fn run(
        self,
        lead: impl FnOnce(RuntimeHandle, Line) -> Option<Thread>,
    ) -> Result<RuntimeEnd, RuntimeError> {
        let granted = realtime::request();
        let (runtime, line, Parts { acks, plans, mut ticks }) = self.part(granted.clone());
        let (config, desk) = (Arc::clone(&runtime.config), Arc::clone(&runtime.desk));
        let (live, leave) = (Arc::clone(&runtime.live), Arc::clone(&runtime.leave));
        let rate = Rate::from_hz(config.show.rate_hz);
        let spin = Duration::from_micros(u64::from(config.show.spin_us));
        let over = EndFlags::default();
        thread::scope(|scope| {
            let origin = Monotonic.now() + RUN_UP;
            let drains = DrainGrid::new(origin, rate.period());
            let helpers =
                Helpers::start(scope, &over, &granted, acks, drains, plans).map_err(RuntimeError::Thread)?;
            ticks.mail.wakes(helpers.planner());
            let clock = Spinning::new(&Monotonic, spin, rate.period());
            let mut ticks = ticks.on(&clock, TickGrid::new(origin, rate), &desk, &leave);
            ticks.mail.wakes_leader(lead(runtime, line));
            let ended = ticks.run();
            live.close();
            let run = helpers.end(&ticks, ended, granted, origin);
            Ok(RuntimeEnd { run, numbers: next_numbers(&config, &ticks.lanes) })
        })
    }

    /// Hands its loops to `drive`, which takes every step of each by itself, instead of running them on threads; the first
    /// tick is due at `origin`. Gives what `drive` gives, and from where frame numbers go on.
    pub fn stepped<C: Clock, T>(
        self,
        clock: &C,
        origin: MonoTime,
        drive: impl FnOnce(RuntimeHandle, Line, &mut Loops<'_, C>) -> T,
    ) -> (T, Numbers) {
        let (policy, refusals) = (Policy::Other, Vec::new());
        let nothing = RealTime { policy, priority: 0, memory_locked: false, refusals };
        let (runtime, line, Parts { acks, plans, ticks }) = self.part(nothing);
        let (config, desk, leave) =
            (Arc::clone(&runtime.config), Arc::clone(&runtime.desk), Arc::clone(&runtime.leave));
        let grid = TickGrid::new(origin, Rate::from_hz(config.show.rate_hz));
        let mut loops = Loops { ticks: ticks.on(clock, grid, &desk, &leave), acks, plans };
        let outcome = drive(runtime, line, &mut loops);
        (outcome, next_numbers(&config, &loops.ticks.lanes))
    }

    fn part(self, granted: RealTime) -> (RuntimeHandle, Line, Parts) {
        let Self { config, desk, live, leave, engine, lanes, sender, mail, acks, plans, .. } = self;
        let (commands, news, orders) = (self.commands, self.news, self.orders);
        let runtime = RuntimeHandle { config, desk, live, leave, commands, news, orders, granted };
        let ticks = Ticks { engine, lanes, sender, mail };
        (runtime, self.line, Parts { acks, plans, ticks })
    }
}

/// The loops of a hall that somebody steps.
pub struct Loops<'a, C> {
    /// The tick thread's.
    pub ticks: TickLoop<'a, C, Sender>,
    /// The ack thread's.
    pub acks: AckLoop,
    /// The planner's.
    pub plans: PlanLoop,
}

/// What becomes the loops of a hall.
struct Parts {
    acks: AckLoop,
    plans: PlanLoop,
    ticks: Ticks,
}

/// What becomes the tick thread's.
struct Ticks {
    engine: Engine,
    lanes: Vec<Lane>,
    sender: Sender,
    mail: Mail,
}

impl Ticks {
    /// The loop on that clock, from the grid's first tick on.
    fn on<'a, C: Clock>(
        self,
        clock: &'a C,
        grid: TickGrid,
        desk: &'a Desk,
        leave: &'a AtomicBool,
    ) -> TickLoop<'a, C, Sender> {
        let Self { engine, lanes, sender, mail } = self;
        let conductor = Conductor::of_a_hall(grid.next_deadline());
        let places = Places::new(&lanes, grid.rate());
        TickLoop { clock, grid, engine, conductor, lanes, places, sink: sender, mail, desk, leave }
    }
}

/// Who judges how the controllers of a hall stand.
fn watch(
    config: &Config,
    lanes: &[Lane],
    sender: &Sender,
    alarms: Producer<Alarm>,
    live: &Arc<Live>,
) -> Watch {
    let groups = Groups::of(&config.controllers);
    let period = Rate::from_hz(config.show.rate_hz).period();
    let health = HealthTable::new(groups, config.show.loss_policy, config.show.ack_every, period).of_a_hall();
    Watch::new(health, &config.controllers, lanes, sender.clone(), alarms, Arc::clone(live))
}

/// From where the frame numbers of each controller go on.
fn next_numbers(config: &Config, lanes: &[Lane]) -> Numbers {
    let next = lanes.iter().map(|lane| lane.last_frame().next());
    config.controllers.iter().map(|one| one.address).zip(next).collect()
}
