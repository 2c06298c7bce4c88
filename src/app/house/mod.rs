//! A hall that lives on between shows: the sockets, the tick thread's loop and its helpers, opened once for a configuration.
//! The main thread is the tick thread; whoever leads the hall holds the [`Reins`].

mod ask;
mod boot;

pub use ask::{Finding, Inquiry, inquire};

use std::net::SocketAddrV4;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Builder};
use std::time::Duration;
use std::{collections::BTreeMap, io};

use rtrb::{Consumer, Producer, RingBuffer};

use super::run::Run;
use crate::config::Config;
use crate::fanout::Lane;
use crate::health::{Groups, Health};
use crate::net::{DrainGrid, NetError};
use crate::observe::Watched;
use crate::plan::PlanError;
use crate::rt::{
    AckLoop, Command, Conductor, Desk, Line, Live, MailEnds, News, Order, PlanLoop, Planning, Spinning,
    Standby, TickLoop, Watch, line, mailboxes,
};
use crate::sys::clock::Monotonic;
use crate::sys::realtime::{self, RealTime};
use crate::time::{Clock as _, Rate, TickGrid};
use crate::wire::FrameNo;

/// From the start of the threads to tick 0.
const RUN_UP: Duration = Duration::from_millis(20);
/// Orders to the ack thread that wait at the most.
const ORDERS: usize = 4096;

/// Why a hall does not open. Nothing has moved then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HouseError {
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
pub struct House {
    config: Arc<Config>,
    desk: Arc<Desk>,
    live: Arc<Live>,
    leave: Arc<AtomicBool>,
    opened: boot::Opened,
    ends: MailEnds,
    mail: crate::rt::Mail,
    line: Line,
    standby: Standby,
    orders: Producer<Order>,
}

/// What a hall is led with and watched by.
#[derive(Debug)]
pub struct Reins {
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
    pub news: Consumer<News>,
    /// What the ack thread is told.
    pub orders: Producer<Order>,
    /// What the system granted the tick thread.
    pub granted: RealTime,
}

/// What a hall came to when it closed.
#[derive(Debug)]
pub struct Closed {
    /// What its threads came back with.
    pub run: Run,
    /// From where frame numbers go on.
    pub numbers: Numbers,
}

impl House {
    /// Opens the frame port for a configuration; `crashed` says whether the mark of a crash was there.
    ///
    /// # Errors
    /// Why not.
    pub fn open(config: Arc<Config>, crashed: bool, numbers: &Numbers) -> Result<Self, HouseError> {
        // Refused, the ports may still open; if not, their error says what to do.
        let _ = realtime::raise_open_files();
        let rate = Rate::from_hz(config.show.rate_hz);
        let opened = boot::open(&config, numbers)?;
        let desk = Arc::new(opened.desk());
        let live = Arc::new(Live::with_clamps(config.controllers.len()));
        let (mail, ends) = mailboxes(config.controllers.len(), rate, Arc::clone(&live));
        let (line, line_end) = line(opened.sender.clone(), config.controllers.len());
        let (orders, orders_end) = RingBuffer::new(ORDERS);
        let standby = Standby::new(
            &config.controllers,
            &opened.lanes,
            line_end,
            Arc::clone(&desk),
            orders_end,
            crashed,
        );
        let leave = Arc::default();
        Ok(Self { config, desk, live, leave, opened, ends, mail, line, standby, orders })
    }

    /// Where levels and the stop are set.
    #[must_use]
    pub fn desk(&self) -> Arc<Desk> {
        Arc::clone(&self.desk)
    }

    /// Runs it on the calling thread, which becomes the tick thread, until it is told to leave. Before the first tick `lead`
    /// gets the reins.
    ///
    /// # Errors
    /// [`HouseError::Thread`]; nothing was sent then.
    ///
    /// # Panics
    /// Where one of its threads panicked.
    pub fn run(self, lead: impl FnOnce(Reins, Line)) -> Result<Closed, HouseError> {
        let Self { config, desk, live, leave, opened, ends, mut mail, line, standby, orders } = self;
        let MailEnds { sent, ticks, tasks, answers, commands, alarms, news } = ends;
        let boot::Opened { engine, lanes, planner, timeline, sender, receiver } = opened;
        let rate = Rate::from_hz(config.show.rate_hz);
        let ack_every = config.show.ack_every;
        let watched = config.controllers.iter().map(Watched::of).collect();
        let firsts: Vec<FrameNo> = lanes.iter().map(|lane| lane.last_frame().next()).collect();
        let mut acks = AckLoop::going_on(receiver, watched, &firsts, ack_every, sent, ticks);
        acks.tell(Arc::clone(&live));
        let groups = Groups::of(&config.controllers);
        let health = Health::new(groups, config.show.loss_policy, ack_every, rate.period()).of_a_hall();
        let watch =
            Watch::new(health, &config.controllers, &lanes, sender.clone(), alarms, Arc::clone(&live));
        acks.watched_by(watch.of_a_hall(standby));
        let mut plans = PlanLoop { planning: Box::new(Planning { planner, timeline }), tasks, answers };
        let granted = realtime::request();
        let (over, done) = (AtomicBool::new(false), AtomicBool::new(false));
        thread::scope(|scope| {
            let origin = Monotonic.now() + RUN_UP;
            let drains = DrainGrid::new(origin, rate.period());
            let over = &over;
            let ack_thread = Builder::new().name("acks".to_owned()).spawn_scoped(scope, move || {
                let _ = realtime::normal_priority();
                acks.run(&Monotonic, drains, || over.load(Ordering::Acquire))
            });
            let ack_thread = ack_thread.map_err(HouseError::Thread)?;
            let planner = Builder::new().name("planner".to_owned()).spawn_scoped(scope, || {
                let _ = realtime::normal_priority();
                plans.run(&done)
            });
            let planner = planner.inspect_err(|_| over.store(true, Ordering::Release));
            let planner = planner.map_err(HouseError::Thread)?;
            mail.wakes(planner.thread().clone());
            let clock = Spinning::new(
                &Monotonic,
                Duration::from_micros(u64::from(config.show.spin_us)),
                rate.period(),
            );
            let mut ticks = TickLoop {
                clock: &clock,
                grid: TickGrid::new(origin, rate),
                engine,
                conductor: Conductor::of_a_hall(origin),
                lanes,
                sink: sender,
                mail,
                desk: &desk,
                leave: &leave,
            };
            let reins = Reins {
                config: Arc::clone(&config),
                desk: Arc::clone(&desk),
                live: Arc::clone(&live),
                leave: Arc::clone(&leave),
                commands,
                news,
                orders,
                granted: granted.clone(),
            };
            lead(reins, line);
            let ended = ticks.run();
            live.close();
            over.store(true, Ordering::Release);
            done.store(true, Ordering::Release);
            planner.thread().unpark();
            let refusals = planner.join().expect("the planner does not panic");
            let mut accounts = ack_thread.join().expect("the ack thread does not panic");
            let closed_at = Monotonic.now();
            accounts.close(ticks.lanes.iter().map(Lane::last_frame), closed_at);
            let next = |lane: &Lane| lane.last_frame().next();
            let addresses = config.controllers.iter().map(|one| one.address);
            let numbers = addresses.zip(ticks.lanes.iter().map(next)).collect();
            let clamps = (0..ticks.lanes.len()).map(|lane| *ticks.engine.clamps(lane)).collect();
            let spun = clock.spun();
            Ok(Closed {
                run: Run { ended, accounts, granted, spun, refusals, clamps, origin, closed_at },
                numbers,
            })
        })
    }
}
