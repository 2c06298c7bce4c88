//! The sockets, the tick thread's loop and its helpers, opened once for a configuration: for a hall that lives on between shows
//! as for one play. The main thread is the tick thread; whoever leads the hall holds the [`RuntimeHandle`].

mod boot;
mod device_job;
mod links;

pub(crate) use device_job::{DeviceJob, Devices, Finding};

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::{self, Thread};
use std::time::Duration;

use rtrb::{Producer, RingBuffer};

use super::company::Company;
use super::helpers::Helpers;
use super::run::Run;
use crate::config::{Config, Controller};
use crate::drive::{Lane, Manner};
use crate::engine::{Engine, Mix};
use crate::film::chase::ChaseRules;
use crate::film::point::PublishedPoint;
use crate::health::{Groups, HealthTable};
use crate::net::{DrainGrid, Lead, NetError, Receiver, Sender};
use crate::observe::Watched;
use crate::plan::PlanError;
use crate::record::{Judging, Taps};
use crate::rt::{
    AckLoop, Broadcast, Calls, Command, Conductor, Desk, FilmLead, Line, LinkEnd, LinkLoop, Live, Mail,
    MailEnds, NewsIn, Order, Outlets, Places, PlanLoop, Planning, Port, Spinning, Standby, TickLoop, Watch,
    line, mailboxes,
};
use crate::state::LedBefore;
use crate::sys::clock::Monotonic;
use crate::sys::realtime::{self, RealTime};
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
    #[error("no thread could be started; allow more with `ulimit -u`, or TasksMax= in the unit")]
    Thread(#[source] io::Error),
    /// A serial link.
    #[error("{0}")]
    Link(String),
    /// Another program has its port.
    #[error("{0}")]
    PortTaken(String),
}

/// The number of each controller's next frame, by its address: a number never comes twice within one process.
pub type Numbers = BTreeMap<String, FrameNo>;

/// What a runtime is for.
#[derive(Debug)]
pub enum Purpose {
    /// A hall that lives on between shows. It finds out by itself what its controllers are and where their seats stand, and what
    /// does not know its zero is out.
    Hall {
        /// How it ended before.
        before: LedBefore,
        /// True if addresses and networks of this machine may come after it has opened.
        may_come: bool,
    },
    /// One show. All axes are taken to be homed, and a script finds out where they are.
    Play {
        /// True if no frame asks for a reply.
        silent: bool,
        /// The film that it chases.
        film: Option<LeadingFilm>,
    },
}

/// A film that a play chases, or that the shows of a hall may follow.
#[derive(Debug)]
pub struct LeadingFilm {
    /// Where its source says where it is.
    pub(super) source: Arc<PublishedPoint>,
    /// How a play follows it; `None` where each show says so.
    pub(super) rules: Option<ChaseRules>,
}

impl Purpose {
    const fn is_silent(&self) -> bool {
        matches!(self, Self::Play { silent: true, .. })
    }

    const fn may_come(&self) -> bool {
        matches!(self, Self::Hall { may_come: true, .. })
    }
}

/// A hall whose threads are about to start.
#[derive(Debug)]
pub struct Runtime {
    handle: RuntimeHandle,
    line: Line,
    silent: bool,
    acks: AckLoop,
    watch: Watch,
    plans: PlanLoop,
    links: Vec<LinkLoop>,
    ticks: Ticks,
}

/// What a hall or a play is led and watched by.
#[derive(Debug, Clone)]
pub struct Control {
    /// Where levels, effects, seats, trim and the stop are set.
    pub desk: Arc<Desk>,
    /// How far the show is, and how the controllers stand.
    pub live: Arc<Live>,
    /// Set to have the seats parked and the runtime end.
    pub leave: Arc<AtomicBool>,
}

/// What a hall is led with and watched by.
#[derive(Debug)]
pub struct RuntimeHandle {
    /// Whose hall it is.
    pub(crate) config: Arc<Config>,
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
    /// The serial links that have seats.
    pub(crate) links: Vec<LinkEnd>,
    /// When ticks are due.
    pub(crate) grid: TickGrid,
    /// What the system granted the tick thread.
    pub(crate) granted: RealTime,
    /// What to do where frames take too much of the time between ticks, as was measured when it opened.
    pub(crate) crowding: Option<String>,
}

/// What a hall came to when it closed.
#[derive(Debug)]
pub(crate) struct RuntimeEnd {
    /// What its threads came back with.
    pub(crate) run: Run,
    /// From where frame numbers go on.
    pub(crate) numbers: Numbers,
}

impl Runtime {
    /// Opens the frame port for a configuration. Where `calls` ask for the end, the seats park and the hall closes, even if
    /// whoever leads it does not hear them. Where there is a `lead`, nothing leaves once that is over.
    ///
    /// # Errors
    /// Why not.
    pub(crate) fn open(
        config: Arc<Config>,
        purpose: Purpose,
        numbers: &Numbers,
        calls: &Calls,
        lead: Option<Arc<Lead>>,
    ) -> Result<Self, RuntimeError> {
        // Refused, the ports may still open; if not, their error says what to do.
        let _ = realtime::raise_open_files();
        let ports = links::open(&config, &purpose)?;
        let (sender, receiver) = boot::bind(&config, purpose.may_come())?;
        let halves = (sender.led_by(lead), receiver);
        let crowding = boot::crowding(&config);
        let mut runtime = Self::over_all(config, purpose, numbers, calls, halves, ports)?;
        runtime.handle.crowding = crowding;
        Ok(runtime)
    }

    /// The same of a hall without links, by sockets, or another network, that are open.
    ///
    /// # Errors
    /// As [`Runtime::open`].
    pub fn over(
        config: Arc<Config>,
        purpose: Purpose,
        numbers: &Numbers,
        calls: &Calls,
        halves: (Sender, Receiver),
    ) -> Result<Self, RuntimeError> {
        Self::over_all(config, purpose, numbers, calls, halves, Vec::new())
    }

    /// The same with its links, by ports that are open.
    ///
    /// # Errors
    /// As [`Runtime::open`].
    pub(crate) fn over_all(
        config: Arc<Config>,
        purpose: Purpose,
        numbers: &Numbers,
        calls: &Calls,
        (sender, receiver): (Sender, Receiver),
        ports: Vec<Port>,
    ) -> Result<Self, RuntimeError> {
        let manner = Manner { level: 0.0, silent: purpose.is_silent() };
        let (engine, lanes, planner, timeline) = boot::open(&config, numbers, manner)?.split();
        let desk = Arc::new(Desk::new(lanes.iter().map(|_| Mix::FULL)).called_by(calls.clone()));
        let broadcast = Broadcast::of(&config, purpose.is_silent());
        let live = Arc::new(Live::new(lanes.len()).with_broadcast(broadcast));
        let rate = Rate::from_hz(config.show.rate_hz);
        let (mail, ends) = mailboxes(lanes.len(), rate, Arc::clone(&live));
        let MailEnds { sent, ticks, tasks, answers, commands, alarms, news } = ends;
        let (line, line_end) = line(sender.clone(), lanes.len());
        let (orders, orders_end) = RingBuffer::new(ORDERS);
        let groups = Groups::of(&config.controllers);
        let ack_every = manner.ack_every(&config);
        let health = HealthTable::new(groups, config.show.loss_policy, ack_every, rate.period())
            .led_ahead(lanes.iter().map(|lane| lane.window.acked_after()));
        let live_end = Arc::clone(&live);
        let watch =
            |health| Watch::new(health, &config.controllers, &lanes, sender.clone(), alarms, live_end);
        let (engine, watch, film) = match purpose {
            Purpose::Hall { before, .. } => {
                let desk = Arc::clone(&desk);
                let standby = Standby::new(&config.controllers, line_end, desk, orders_end, before);
                (engine.unknown(), watch(health.of_a_hall()).of_a_hall(standby), None)
            }
            Purpose::Play { film, .. } => (engine.waiting(), watch(health), film),
        };
        let links = links::Links::over(&config, &lanes, &watch, ports, &live)?;
        let lead = sender.lead();
        let watched: Vec<_> = config.stations().iter().map(Watched::of).collect();
        let sink = Outlets::new(sender, watched.len(), links.poses, links.led);
        let firsts: Vec<FrameNo> = lanes.iter().map(|lane| lane.last_frame().next()).collect();
        let links::Links { loops, ends: links, news: heard, .. } = links;
        let acks = AckLoop::new(receiver, watched, ack_every, sent, ticks)
            .going_on(&firsts, ack_every)
            .hearing(heard);
        let plans = PlanLoop { planning: Box::new(Planning { planner, timeline }), tasks, answers };
        let (leave, granted) = (Arc::default(), RealTime::NOTHING);
        let handle = RuntimeHandle {
            config,
            desk,
            live,
            leave,
            commands,
            news,
            orders,
            links,
            grid: TickGrid::new(MonoTime::default(), rate),
            granted,
            crowding: None,
        };
        let silent = manner.silent;
        let ticks = Ticks { engine, lanes, film, lead, sink, mail };
        Ok(Self { handle, line, silent, acks, watch, plans, links: loops, ticks })
    }

    /// The same with a film that shows may follow.
    pub(super) fn with_film(mut self, film: Option<Arc<PublishedPoint>>) -> Self {
        self.ticks.film = film.map(|source| LeadingFilm { source, rules: None });
        self
    }

    /// Has whatever leaves, and whatever is heard, copied.
    pub(crate) fn record(&mut self, taps: Taps) {
        let Taps { ticks, mut acks } = taps;
        acks.begin(&self.ticks.lanes.iter().map(|lane| lane.last_frame().next()).collect::<Vec<_>>());
        self.ticks.sink.record(ticks);
        self.acks.record(acks);
    }

    /// What whoever judges its acks again has to know of it.
    pub(crate) fn judging(&self, is_hall: bool) -> Judging {
        let config = self.config();
        let ack_every = if self.silent { 0 } else { config.show.ack_every };
        Judging::of(config, self.lanes(), ack_every, is_hall)
    }

    /// How its seats are sent to at first.
    pub(crate) fn lanes(&self) -> &[Lane] {
        &self.ticks.lanes
    }

    /// What it is led and watched by.
    #[must_use]
    pub(crate) fn control(&self) -> Control {
        let RuntimeHandle { desk, live, leave, .. } = &self.handle;
        Control { desk: Arc::clone(desk), live: Arc::clone(live), leave: Arc::clone(leave) }
    }

    /// Whose hall it is.
    #[must_use]
    pub(crate) const fn config(&self) -> &Arc<Config> {
        &self.handle.config
    }

    /// What to do where frames take too much of the time between ticks.
    pub(crate) fn crowding(&self) -> Option<&str> {
        self.handle.crowding.as_deref()
    }

    /// The control plane's ends of its serial links.
    pub(super) fn links(&self) -> &[LinkEnd] {
        &self.handle.links
    }

    /// True if no frame asks for a reply.
    pub(super) const fn is_silent(&self) -> bool {
        self.silent
    }

    /// The controllers that somebody else sends to, and how many datagrams they got that were not sent from here. Takes about a
    /// second, in which it sends nothing else.
    pub(super) fn find_other_masters(&mut self) -> Vec<(usize, u16)> {
        let Self { handle: RuntimeHandle { config, leave: stop, .. }, acks, ticks, .. } = self;
        let Ticks { sink, lanes, .. } = ticks;
        Company { sender: sink.sender(), acks, controllers: &config.controllers, lanes, stop }.look()
    }

    /// Runs it on the calling thread, which becomes the tick thread, until it is told to leave. Before the first tick `lead`
    /// gets the runtime, and says which thread is woken by news of it.
    ///
    /// # Errors
    /// [`RuntimeError::Thread`]; nothing was sent then.
    ///
    /// # Panics
    /// If one of its threads panicked.
    pub(crate) fn run(
        mut self,
        lead: impl FnOnce(RuntimeHandle, Line) -> Option<Thread>,
    ) -> Result<RuntimeEnd, RuntimeError> {
        let granted = realtime::request();
        self.handle.granted = granted.clone();
        let (config, control, silent) = (Arc::clone(self.config()), self.control(), self.silent);
        let (mut runtime, line, Parts { acks, plans, links, mut ticks }) = self.part();
        let rate = Rate::from_hz(config.show.rate_hz);
        let spin = Duration::from_micros(u64::from(config.show.spin_us));
        let over = AtomicBool::new(false);
        thread::scope(|scope| {
            let origin = Monotonic.now() + RUN_UP;
            let grid_of_drains = if silent { DrainGrid::rare } else { DrainGrid::new };
            let drains = grid_of_drains(origin, rate.period());
            let helpers = Helpers::start(scope, &over, &granted, (acks, drains), plans, links)
                .map_err(RuntimeError::Thread)?;
            ticks.mail.wakes(helpers.planner());
            let clock = Spinning::new(&Monotonic, spin, rate.period());
            runtime.grid = TickGrid::new(origin, rate);
            let mut ticks = ticks.on(&clock, runtime.grid.clone(), &control);
            ticks.mail.wakes_leader(lead(runtime, line));
            let ended = ticks.run();
            control.live.close();
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
        let (config, control) = (Arc::clone(self.config()), self.control());
        let (mut runtime, line, Parts { acks, plans, links, ticks }) = self.part();
        runtime.grid = TickGrid::new(origin, Rate::from_hz(config.show.rate_hz));
        let ticks = ticks.on(clock, runtime.grid.clone(), &control);
        let mut loops = Loops { ticks, acks, plans, links };
        let outcome = drive(runtime, line, &mut loops);
        (outcome, next_numbers(&config, &loops.ticks.lanes))
    }

    fn part(self) -> (RuntimeHandle, Line, Parts) {
        let Self { handle, line, mut acks, watch, plans, links, ticks, .. } = self;
        acks.tell(Arc::clone(&handle.live));
        acks.watched_by(watch);
        (handle, line, Parts { acks, plans, links, ticks })
    }
}

/// The loops of a hall that somebody steps.
pub struct Loops<'a, C> {
    /// The tick thread's.
    pub ticks: TickLoop<'a, C, Outlets>,
    /// The ack thread's.
    pub acks: AckLoop,
    /// The planner's.
    pub plans: PlanLoop,
    /// Those of links.
    #[cfg_attr(not(test), expect(dead_code, reason = "virtual halls of other programs have none"))]
    pub(crate) links: Vec<LinkLoop>,
}

/// What becomes the loops of a hall.
struct Parts {
    acks: AckLoop,
    plans: PlanLoop,
    links: Vec<LinkLoop>,
    ticks: Ticks,
}

/// What becomes the tick thread's.
#[derive(Debug)]
struct Ticks {
    engine: Engine,
    lanes: Vec<Lane>,
    film: Option<LeadingFilm>,
    lead: Option<Arc<Lead>>,
    sink: Outlets,
    mail: Mail,
}

impl Ticks {
    /// The loop on that clock, from the grid's first tick on.
    fn on<'a, C: Clock>(
        self,
        clock: &'a C,
        grid: TickGrid,
        control: &'a Control,
    ) -> TickLoop<'a, C, Outlets> {
        let Self { engine, lanes, film, lead, sink, mail } = self;
        let now = grid.next_deadline();
        let film = film.map(|LeadingFilm { source, rules }| match rules {
            Some(rules) => FilmLead::new(source, rules, now),
            None => FilmLead::of_a_hall(source, now),
        });
        let conductor = Conductor::of_a_hall(now).chasing(film).led_by(lead);
        let places = Places::new(&lanes, grid.rate());
        let Control { desk, leave, .. } = control;
        TickLoop { clock, grid, engine, conductor, lanes, places, sink, mail, desk, leave }
    }
}

/// From where the frame numbers of each controller go on.
fn next_numbers(config: &Config, lanes: &[Lane]) -> Numbers {
    let next = lanes.iter().map(|lane| lane.last_frame().next());
    config.controllers.iter().map(Controller::address).zip(next).collect()
}
