//! A supervisor under test, with a double of the tick thread: the state machine without an engine, which takes every show that is
//! loaded, and to which a test tells what an engine would.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle, Thread};
use std::time::Duration;

use jiff::Zoned;
use rtrb::{Consumer, RingBuffer};
use tempfile::TempDir;
use tokio::runtime::Builder;

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::HallContext;
use super::hall_settings::HallSettings;
use super::show::ProvedShow;
use super::{Carryover, ServiceLog, Supervisor, SupervisorPorts, SystemSignals};
use crate::app::notify::AlarmTeller;
use crate::app::runtime::RuntimeHandle;
use crate::config::{self, Config};
use crate::control::{
    Command, Desired, Handle, Inbox, Problem, Role, Status, StatusSource, Surface, Who, handle,
};
use crate::cue::{self, Source};
use crate::drive::LeftOn;
use crate::engine::Mix;
use crate::health::{HealthState, Why};
use crate::journal::{Journal, Limits};
use crate::library::{self, Library};
use crate::log::Log;
use crate::net::Ports;
use crate::observe::ControllerState;
use crate::rt::{self, Command as TickCommand, Desk, Live, News, NewsOut, Row, StartOff, Ticket, line};
use crate::settings::SettingsFile;
use crate::state::{Event, Finding, LedBefore, Machine, State};
use crate::sys::clock::Monotonic;
use crate::sys::realtime::RealTime;
use crate::time::{Clock as _, MonoTime, Rate, TickGrid};
use crate::timeline::Timeline;
use crate::tracker::Counts;

/// Nothing is waited for longer; where all is well it takes milliseconds.
const PATIENCE: Duration = Duration::from_secs(20);
/// How often the double looks.
const LOOK: Duration = Duration::from_micros(100);

const HALL: &str = "[show]\nbind = \"127.0.0.1:0\"\nlibrary = \"LIBRARY\"\n\
    [seat.s]\naxes = 1\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
    max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
    [[controller]]\nname = \"A1\"\nrow = \"A\"\nseat = \"s\"\naddress = \"127.0.0.1:9\"\n\
    [[controller]]\nname = \"B1\"\nrow = \"B\"\nseat = \"s\"\naddress = \"127.0.0.2:9\"\n";
const RIDE: &str = "time_ms,a1\n0,0.5\n1000,0.5\n2000,0.6\n4000,0.6\n";

/// The double, on a thread of its own.
struct Double {
    machine: Arc<Mutex<Machine>>,
    ports: Arc<AtomicBool>,
    rounds: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

/// What the double's thread has.
struct Ticks {
    machine: Arc<Mutex<Machine>>,
    ports: Arc<AtomicBool>,
    rounds: Arc<AtomicU64>,
    desk: Arc<Desk>,
    commands: Consumer<TickCommand>,
    taken: Ticket,
    news: NewsOut,
    told: Option<News>,
    /// What is to start by itself, and when.
    start: Option<MonoTime>,
    supervisor: Thread,
}

impl Ticks {
    fn run(mut self) {
        while !self.ports.load(Ordering::Acquire) {
            self.tick(Monotonic.now());
            self.rounds.fetch_add(1, Ordering::Release);
            Monotonic.sleep_until(Monotonic.now() + LOOK);
        }
    }

    fn tick(&mut self, now: MonoTime) {
        let machine = Arc::clone(&self.machine);
        let mut machine = machine.lock().unwrap();
        if self.desk.take_stop() {
            machine.request(crate::state::Transition::Stop, now).unwrap();
        }
        machine.tick(now);
        self.tell(&machine);
        if self.start.take_if(|film_zero| now >= *film_zero).is_some() {
            let went = machine.request(crate::state::Transition::Go, now);
            self.tell(&machine);
            let news = went.map_or(News::CalledOff(StartOff::NotArmed), |()| News::Started);
            self.news.push((None, news)).unwrap();
        }
        while let Ok(command) = self.commands.pop() {
            let ticket = Some(self.taken);
            self.taken += 1;
            let answer = match command {
                TickCommand::Request(request) => machine.request(request, now),
                TickCommand::Seek(_) => machine.request(crate::state::Transition::Seek, now),
                TickCommand::Event(event) => {
                    machine.event(event, now);
                    Ok(())
                }
                TickCommand::Load(_) if machine.may_send_motion() => {
                    self.news.push((ticket, News::NotLoaded(machine.state()))).unwrap();
                    continue;
                }
                TickCommand::Load(_) => Ok(()),
                TickCommand::StartAt(film_zero) => {
                    self.start = Some(film_zero);
                    Ok(())
                }
                TickCommand::CallOff => {
                    let off = self.start.take().map(|_| News::CalledOff(StartOff::Asked));
                    off.into_iter().for_each(|news| self.news.push((None, news)).unwrap());
                    Ok(())
                }
                TickCommand::ParkSlowly { .. } => panic!("a hall parks its seats by limiter and engine"),
            };
            self.tell(&machine);
            self.news.push((ticket, answer.map_or_else(News::Refused, |()| News::Taken))).unwrap();
        }
        self.supervisor.unpark();
    }

    fn tell(&mut self, machine: &Machine) {
        let (state, cause, next, at) = (machine.state(), machine.cause(), machine.next(), machine.since());
        let news = News::Entered { state, cause, next, at };
        if self.told.replace(news) != Some(news) {
            self.news.push((None, news)).unwrap();
        }
    }
}

impl Drop for Double {
    fn drop(&mut self) {
        self.ports.store(true, Ordering::Release);
        self.thread.take().map(JoinHandle::join).unwrap().unwrap();
    }
}

/// A supervisor, and what it is tested by.
pub(super) struct Rig {
    pub(super) supervisor: Supervisor,
    pub(super) folder: TempDir,
    pub(super) handle: Handle,
    pub(super) library: Library,
    double: Double,
}

/// A hall of two rows of one seat each, whose library has three cues.
pub(super) fn config(folder: &Path) -> Config {
    let path = folder.join("hall.toml");
    let library = folder.join("cues");
    fs::write(&path, HALL.replace("LIBRARY", library.to_str().unwrap())).unwrap();
    config::load(&path).unwrap()
}

/// The hall as features see it, in that state, with a cue of that name loaded; nobody leads it.
pub(super) fn hall(state: State, cue: &str) -> HallContext {
    let folder = tempfile::tempdir().unwrap();
    let config = Arc::new(config(folder.path()));
    let (runtime, ..) = runtime(&config);
    let settings = HallSettings::new(&config);
    let mut hall = HallContext::new(&runtime, settings, MonoTime::from_nanos(1_000_000_000));
    hall.mirror.state = state;
    hall.cued = Some(proved(cue, &config));
    hall
}

/// A cue of four seconds that was proved.
pub(super) fn proved(id: &str, config: &Config) -> ProvedShow {
    let cue = cue::read(Path::new(id), RIDE.as_bytes(), &Source::Native).unwrap();
    ProvedShow::prove(id.to_owned(), config, Timeline::new(cue), String::new()).unwrap()
}

/// A controller that is well, of which that was told then.
pub(super) fn row(at: MonoTime) -> Row {
    Row {
        counts: Counts::default(),
        ack_ns: None,
        standing: HealthState::Ok,
        why: Why::Acked,
        left_on: LeftOn::default(),
        left_since: None,
        state: ControllerState::default(),
        homed: Some(true),
        at,
    }
}

/// What a feature has done for that.
pub(super) fn told(feature: &mut dyn Feature, event: &SupervisorEvent<'_>, hall: &HallContext) -> Vec<Act> {
    let mut acts = Vec::new();
    feature.on(event, hall, &mut acts);
    acts
}

/// Somebody of that surface wants that.
pub(super) fn desired(surface: Surface, ask: Command) -> Desired {
    Desired { ask, who: Who { role: Role::Engineer, surface, name: "anna".to_owned() } }
}

/// The ways to a hall of two lanes, and what is at their ends.
fn runtime(config: &Arc<Config>) -> (RuntimeHandle, Consumer<TickCommand>, NewsOut) {
    let desk = Arc::new(Desk::new([Mix::FULL; 2].into_iter()));
    let (commands, commands_end) = RingBuffer::new(64);
    let (news, news_end) = rt::news(256);
    let runtime = RuntimeHandle {
        config: Arc::clone(config),
        desk,
        live: Arc::new(Live::new(2)),
        leave: Arc::default(),
        commands,
        news: news_end,
        orders: RingBuffer::new(16).0,
        links: Vec::new(),
        grid: TickGrid::new(MonoTime::default(), Rate::from_hz(config.show.rate_hz)),
        granted: RealTime::NOTHING,
        crowding: None,
    };
    (runtime, commands_end, news)
}

impl Rig {
    /// One of a hall that is parked and ready to be armed, with a cue loaded.
    pub(super) fn parked() -> Self {
        let mut rig = Self::starting(Carryover::default());
        for cue in ["one", "two", "three"] {
            fs::write(rig.folder.path().join("cues").join(format!("{cue}.csv")), RIDE).unwrap();
        }
        rig.tell(Event::Identified(Finding { homed: true, at_park: true, before: LedBefore::Ended }));
        rig.ask(Command::Load { cue: "one".to_owned() }).unwrap();
        rig.supervisor.features.readiness.preflighted = Some(super::preflighted::Preflighted::passing(2));
        rig.supervisor.procedures.add(Vec::new());
        rig.settle();
        assert!(rig.supervisor.features.readiness.is_told_ready());
        assert_eq!(rig.state(), State::Parked);
        rig
    }

    /// One that is armed.
    pub(super) fn armed() -> Self {
        let mut rig = Self::parked();
        rig.ask(Command::Arm { seats_empty: false }).unwrap();
        rig
    }

    /// One that plays.
    pub(super) fn playing() -> Self {
        let mut rig = Self::armed();
        rig.ask(Command::Go).unwrap();
        rig.tell(Event::Joined);
        rig
    }

    /// One that has just started, after a hall of which it knows that.
    pub(super) fn starting(carryover: Carryover) -> Self {
        Self::starting_in(|_| carryover)
    }

    /// The same in a folder that is made ready for it.
    pub(super) fn starting_in(ready: impl FnOnce(&Path) -> Carryover) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let carryover = ready(folder.path());
        let config = Arc::new(config(folder.path()));
        let (runtime, commands_end, news) = runtime(&config);
        let desk = Arc::clone(&runtime.desk);
        let peers: Vec<_> = config.stations().iter().map(|one| one.connection.address).collect();
        let (sender, _) = Ports::open(config.show.bind, &peers).unwrap().split();
        let (line, _) = line(sender, 2);
        let library = library::Hall::new(&folder.path().join("hall.toml"), &config.store);
        let library = Library::open(&config.show.library, library).unwrap();
        let limits = Limits { max_size: 1 << 20, max_total: 1 << 20, max_age_days: 1 };
        let journal = Journal::open(&folder.path().join("log"), limits, &Zoned::now());
        carryover.set_desk(&config, &desk);
        let (handle, ports) = ports(&desk, folder.path(), carryover);
        let supervisor = Supervisor::new(ports, runtime, line, library.clone(), journal);
        let double = Double::start(desk, commands_end, news);
        Self { supervisor, folder, handle, library, double }
    }

    /// Tells the state machine something, and waits until the supervisor knows.
    pub(super) fn tell(&mut self, event: Event) {
        self.double.machine.lock().unwrap().event(event, Monotonic.now());
        let rounds = self.double.rounds.load(Ordering::Acquire);
        while self.double.rounds.load(Ordering::Acquire) < rounds + 2 {
            thread::yield_now();
        }
        self.do_all();
    }

    /// Asks the supervisor something as a surface does, and waits for the answer.
    pub(super) fn ask(&mut self, ask: Command) -> Result<Arc<Status>, Problem> {
        self.ask_as(Surface::Socket, ask)
    }

    /// The same by another surface.
    pub(super) fn ask_as(&mut self, surface: Surface, ask: Command) -> Result<Arc<Status>, Problem> {
        let waits = self.post_as(surface, ask);
        self.hear();
        self.wait_until(|_| waits.is_finished());
        waits.join().unwrap()
    }

    /// Has something asked that waits for its turn.
    pub(super) fn post(&self, ask: Command) -> JoinHandle<Result<Arc<Status>, Problem>> {
        self.post_as(Surface::Socket, ask)
    }

    fn post_as(&self, surface: Surface, ask: Command) -> JoinHandle<Result<Arc<Status>, Problem>> {
        let Desired { ask, who } = desired(surface, ask);
        let posted = self.handle.post(who, ask).unwrap();
        let runtime = Builder::new_current_thread().enable_time().build().unwrap();
        thread::spawn(move || runtime.block_on(posted.answer()))
    }

    /// Has the supervisor hear what was asked, once it has done what it was about, and look after nothing else.
    pub(super) fn hear(&mut self) {
        self.do_begun();
        let asked = self.supervisor.ports.inbox.next(PATIENCE).expect("something was asked");
        self.supervisor.on_asked(asked);
    }

    /// Has the supervisor look after all until that is so.
    #[track_caller]
    pub(super) fn wait_until(&mut self, is_so: impl Fn(&Supervisor) -> bool) {
        let until = Monotonic.now() + PATIENCE;
        while !is_so(&self.supervisor) {
            assert!(Monotonic.now() < until, "it is {}: {:?}", self.state(), self.supervisor.notes);
            self.supervisor.turn();
            thread::yield_now();
        }
    }

    /// Has the supervisor look after all until it is free, and what came of that is done.
    #[track_caller]
    pub(super) fn settle(&mut self) {
        self.wait_until(|supervisor| supervisor.hall.job.is_none());
        self.do_all();
        self.wait_until(|supervisor| supervisor.hall.job.is_none() && supervisor.procedures.is_empty());
    }

    /// Has the supervisor do all that there is to do now.
    fn do_all(&mut self) {
        self.supervisor.turn();
        self.wait_until(|supervisor| supervisor.procedures.is_empty());
    }

    /// Has the supervisor do that.
    pub(super) fn does(&mut self, acts: Vec<Act>) {
        self.supervisor.procedures.add(acts);
        self.do_begun();
    }

    /// Has the supervisor do all that it is about, and look after nothing else.
    pub(super) fn do_begun(&mut self) {
        let until = Monotonic.now() + PATIENCE;
        while !self.supervisor.procedures.is_empty() {
            assert!(Monotonic.now() < until, "it is {}", self.state());
            self.supervisor.take_news();
            self.supervisor.go_on();
            thread::yield_now();
        }
    }

    /// Has the tick thread wait while that is done.
    pub(super) fn while_it_waits<T>(&mut self, act: impl FnOnce(&mut Self) -> T) -> T {
        let machine = Arc::clone(&self.double.machine);
        let _held = machine.lock().unwrap();
        act(self)
    }

    /// Has all of that happen at the state machine at once.
    pub(super) fn happens(&self, happen: impl FnOnce(&mut Machine, MonoTime)) {
        happen(&mut self.double.machine.lock().unwrap(), Monotonic.now());
    }

    /// Has the supervisor hear of a state, and look after nothing else.
    pub(super) fn hear_of(&mut self, state: State) {
        let until = Monotonic.now() + PATIENCE;
        while self.supervisor.hall.mirror.state != state {
            assert!(Monotonic.now() < until, "it is {}", self.state());
            self.supervisor.take_news();
            thread::yield_now();
        }
    }

    /// The state that the machine is in, even if the supervisor has not heard of it.
    pub(super) fn state(&self) -> State {
        self.double.machine.lock().unwrap().state()
    }
}

impl Double {
    fn start(desk: Arc<Desk>, commands: Consumer<TickCommand>, news: NewsOut) -> Self {
        let machine = Arc::new(Mutex::new(Machine::new(Monotonic.now())));
        let (ports, rounds) = (Arc::<AtomicBool>::default(), Arc::<AtomicU64>::default());
        let ticks = Ticks {
            machine: Arc::clone(&machine),
            ports: Arc::clone(&ports),
            rounds: Arc::clone(&rounds),
            desk,
            commands,
            taken: 0,
            news,
            told: None,
            start: None,
            supervisor: thread::current(),
        };
        let thread = Some(thread::spawn(|| ticks.run()));
        Self { machine, ports, rounds, thread }
    }
}

fn ports(desk: &Arc<Desk>, folder: &Path, carryover: Carryover) -> (Handle, SupervisorPorts) {
    let (handle, inbox, source): (Handle, Inbox, StatusSource) =
        handle(Arc::clone(desk), Status::starting("Hall 1"));
    let service_log = ServiceLog::new(Log::start(|_| {}).unwrap(), AlarmTeller::default());
    let config = folder.join("hall.toml");
    let (began, signals) = (Monotonic.now(), SystemSignals::default());
    let (settings_file, _) = SettingsFile::open(folder);
    (
        handle,
        SupervisorPorts {
            inbox,
            source,
            config,
            began,
            signals,
            service_log,
            carryover,
            settings_file,
            film: None,
            player: None,
            osc: None,
            awaited: crate::control::AwaitedPorts::default(),
            buttons: None,
            pair: None,
            recorder: crate::app::recorder::RecordLink::default(),
        },
    )
}
