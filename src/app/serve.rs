//! The daemon: a hall that is opened, kept and closed, as often as its configuration is read anew, and the surfaces that
//! outlive it.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread::Builder;
use std::time::Duration;

use jiff::Zoned;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

use super::film::HallFilm;
use super::notify::AlarmTeller;
use super::pair::{Pair, TookOver, forget_pair};
use super::recorder::{HallRecorder, RecordLink, RecordPlaces};
use super::runtime::{Numbers, Purpose, Runtime, RuntimeEnd, RuntimeError, RuntimeHandle};
use super::script::Prepared;
use super::sum_up::{Played, SumUp, sum_up};
use super::supervisor::{Carryover, ServiceLog, Supervisor, SupervisorEnd, SupervisorPorts, SystemSignals};
use super::surfaces::{Sockets, SurfaceError, Surfaces};
use crate::api::Pages;
use crate::config::{Config, ONE_FOLDER};
use crate::control::model::Ending;
use crate::control::{Handle, Status, handle};
use crate::health::Why;
use crate::journal::{Journal, Limits, Sealer};
use crate::library::{self, Library, LibraryError};
use crate::log::{Line, Log, Priority};
use crate::rt::Calls;
use crate::sd::{self, WatchdogThread};
use crate::settings::SettingsFile;
use crate::state::LedBefore;
use crate::sys::clock::Monotonic;
use crate::sys::file::create_ours;
use crate::sys::realtime;
use crate::time::{Clock as _, Rate};

/// How long the supervisor has to end once its hall has closed; all that it waits for is a disk.
const SUPERVISOR_ENDS: Duration = Duration::from_secs(10);

/// Where the daemon has its files.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    /// The configuration.
    pub(crate) config: PathBuf,
    /// The folder of what it keeps from one start to the next.
    pub(crate) state: PathBuf,
    /// The sockets of this machine.
    pub(crate) sockets: Sockets,
}

impl Places {
    /// Where the recorder of a hall of this configuration has its files.
    fn of_recordings(&self, config: &Config) -> RecordPlaces {
        RecordPlaces {
            runtime: self.sockets.control.parent().map(Path::to_owned).unwrap_or_default(),
            recordings: config.record.folder(&self.state),
            config: self.config.clone(),
        }
    }
}

/// Why the daemon does not run. Nothing has moved then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum ServeError {
    /// The hall cannot be opened.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// A surface does not open.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The library cannot be opened.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// Cues and playlists are in one folder.
    #[error("{}: {ONE_FOLDER}, by playlists of [library]", .0.display())]
    OneFolder(PathBuf),
    /// Somebody else sends to controllers, though this machine leads its hall.
    #[error("another master sends to {0}; end it, and start this service again")]
    OtherMaster(String),
    /// The supervisor does not end: what it had to write down may be lost.
    #[error(
        "the supervisor hangs, and the program ends without it: the seats are parked or at rest; its last journal lines may be lost"
    )]
    Supervisor,
    /// The system gives no signals, or no thread.
    #[error("the system refused a signal handler or a thread: {0}")]
    System(#[source] io::Error),
}

/// The mark that a daemon leaves before its first tick, and an orderly end takes away.
#[derive(Debug)]
struct Mark {
    folder: PathBuf,
    file: PathBuf,
}

impl Mark {
    /// The one in that folder, which is made where it is missing.
    fn of(folder: &Path) -> Self {
        let _ = fs::create_dir_all(folder); // where it cannot be, no mark can be left
        Self { folder: folder.to_owned(), file: folder.join("running") }
    }

    /// True if the daemon before left it and did not take it away, or may have wanted to in a folder that takes no file.
    fn is_there(&self) -> bool {
        let is_closed = rustix::fs::access(&self.folder, rustix::fs::Access::WRITE_OK).is_err();
        is_closed || self.file.try_exists().unwrap_or(true)
    }

    /// Leaves it; says what comes of it where it cannot be left.
    fn leave(&self) -> Option<String> {
        // Without a word in it, so that a full disk keeps no hall shut.
        let cause = create_ours(&self.file).err()?;
        Some(format!(
            "{} takes no file: {cause}; what is set and loaded is lost with a restart, which is taken for one after a crash: give the \
             service a folder it may write to (StateDirectory= in the unit, or --state)",
            self.folder.display()
        ))
    }

    /// Takes it away, where it was left. Where it stays, the next start is taken for one after a crash.
    fn take_away(&self) {
        let _ = fs::remove_file(&self.file);
    }
}

/// What a daemon is made of.
#[derive(Debug)]
pub(crate) struct Parts {
    /// Its first configuration.
    pub(crate) config: Config,
    /// Where it has its files.
    pub(crate) places: Places,
    /// The console.
    pub(crate) pages: Pages,
    /// What tells it to end, and to read its configuration anew.
    pub(crate) signals: SystemSignals,
    /// Where it says what happens.
    pub(crate) log: Log,
    /// What it leads by, where its hall has two show machines.
    pub(crate) pair: Option<Pair>,
}

/// What a daemon came to.
#[derive(Debug)]
pub(crate) struct Served {
    config: Arc<Config>,
    closed: Box<RuntimeEnd>,
    ended: Ending,
}

impl Served {
    /// Sums it up as a play of `cue`: all that was sent since the configuration was last read, with the end of the last show.
    #[must_use]
    pub(crate) fn sum_up(self, cue: String) -> Played {
        let Self { config, mut closed, ended } = self;
        // That a group is there when the hall opens is no change worth telling.
        let mut seen = BTreeSet::new();
        closed.run.accounts.changes.retain(|one| !seen.insert(one.group) || one.why != Why::SeenAgain);
        let about = SumUp { cue, rate: Rate::from_hz(config.show.rate_hz), ending: ended, silent: false };
        // A hall brings its seats to park by frames like any other.
        let prepared = Prepared::nothing(config.controllers.len());
        sum_up(about, &config.controllers, &prepared, &closed.run)
    }
}

/// Runs the daemon until it is told to end. Once all surfaces are open, and before the first tick, `up` gets the way to the
/// hall, and where the API listens over TCP.
///
/// # Errors
/// [`ServeError`]; nothing has moved then, or all of it is parked or at rest.
///
/// # Panics
/// If one of its threads panicked.
pub(crate) fn serve(parts: Parts, up: impl FnOnce(Handle, &[SocketAddr])) -> Result<Served, ServeError> {
    let mark = Mark::of(&parts.places.state);
    let crashed = mark.is_there();
    let served = serve_halls(parts, &mark, crashed, up);
    // An end with an error is none in the middle of a motion; what crashed before still has.
    if served.is_ok() || !crashed {
        mark.take_away();
    }
    served
}

/// Opens a hall, and keeps it; and again with each configuration that is read anew.
fn serve_halls(
    parts: Parts,
    mark: &Mark,
    crashed: bool,
    up: impl FnOnce(Handle, &[SocketAddr]),
) -> Result<Served, ServeError> {
    let Parts { config, places, pages, signals, log, mut pair } = parts;
    let began = Monotonic.now();
    let mut config = Arc::new(config);
    let library = open_library(&config, &places.config)?;
    let (mut numbers, took_over) = before(pair.as_ref(), &config);
    let mut film = HallFilm::default();
    let calls = Calls::ended_by(&signals.leave);
    let opening = Opening { config: &places.config, calls: &calls, pair: pair.as_ref() };
    let mut runtime = opening.first(&config, led_before(crashed, took_over.as_ref()), &numbers, &mut film)?;
    let (handle, inbox, source) = handle(runtime.control().desk, Status::starting(&config.show.name));
    let (settings_file, kept) = SettingsFile::open(&places.state);
    let record_places = places.of_recordings(&config);
    let surfaces =
        Surfaces::open(&config, &places.sockets, &handle, library.clone(), &record_places, pages, &log)?;
    forget_pair(pair.as_ref(), &places.sockets.fleet);
    let alarms = AlarmTeller::start(&config, &log).map_err(ServeError::System)?;
    let mut ports = SupervisorPorts {
        inbox,
        source,
        config: places.config,
        began,
        signals,
        service_log: ServiceLog::new(log.clone(), alarms),
        carryover: Carryover::of(kept, took_over),
        settings_file,
        film: None,
        player: None,
        osc: surfaces.osc_counts(),
        buttons: surfaces.pads(),
        awaited: surfaces.awaited(),
        recorder: RecordLink::default(),
        pair: pair.as_ref().map(Pair::watch),
    };
    // Not sooner: a start that is refused has moved nothing, and is no crash.
    ports.carryover.tell(mark.leave());
    let mut journal = open_journal(&config, &places.state, &library, &mut ports.carryover);
    up(handle, surfaces.addresses());
    let mut feeder = pair.as_mut().and_then(Pair::take_feeder);
    let served = loop {
        (ports.film, ports.player) = (film.table(), film.player());
        let recorder = HallRecorder::start(&mut runtime, &record_places);
        ports.recorder = recorder.link();
        let left = keep(runtime, ports, library.clone(), journal, &mut feeder)?;
        end_recording(recorder, &log);
        (ports, journal) = (left.ports, left.journal);
        let Some(next) = left.reload else {
            break Served { config, closed: left.closed, ended: left.ended };
        };
        // Also of controllers that come back with a later configuration.
        numbers.extend(left.closed.numbers.clone());
        let opening = Opening { config: &ports.config, calls: &calls, pair: pair.as_ref() };
        (runtime, config) = opening.reopen(next, config, &numbers, &mut ports.carryover, &mut film)?;
        surfaces.take_tokens(&config);
    };
    surfaces.close();
    log.close();
    Ok(served)
}

/// The journal of a hall, sealed with the key of its state folder. Where that, or the library, cannot be had, a person is told.
fn open_journal(config: &Config, state: &Path, library: &Library, carryover: &mut Carryover) -> Journal {
    carryover.tell(library.trouble());
    let unsealed = |why| {
        carryover.tell(Some(format!("what is played is written without seals, and proves nothing: {why}")))
    };
    let sealer = Sealer::of(state).map_err(unsealed).ok();
    Journal::open_with(&config.log.dir, Limits::from(&config.log), &Zoned::now(), sealer)
}

/// The library of a hall, and the folder of its playlists beside it, which is another one, by whatever way both are named.
fn open_library(config: &Config, path: &Path) -> Result<Library, ServeError> {
    let library = Library::open(&config.show.library, library::Hall::new(path, &config.store))?;
    // A person puts playlists there. Where it cannot be made, whoever loads one is told.
    let _ = fs::create_dir_all(config.playlists());
    match [config.show.library.clone(), config.playlists()].map(fs::canonicalize) {
        [Ok(cues), Ok(playlists)] if cues == playlists => Err(ServeError::OneFolder(config.playlists())),
        _ => Ok(library),
    }
}

/// Ends what is recorded; says where that could not be waited for.
fn end_recording(recorder: HallRecorder, log: &Log) {
    if let Err(waits) = recorder.end() {
        log.say(Line::new(Priority::Warning, "record-show", waits.to_string()));
    }
}

/// How the program ended that led the hall before.
const fn led_before(crashed: bool, took_over: Option<&TookOver>) -> LedBefore {
    match took_over {
        Some(TookOver { ride: Some(_), .. }) => LedBefore::OnCue,
        Some(_) => LedBefore::Crashed,
        None if crashed => LedBefore::Crashed,
        None => LedBefore::Ended,
    }
}

/// From where frame numbers go on, and what to tell of whoever led before.
fn before(pair: Option<&Pair>, config: &Config) -> (Numbers, Option<TookOver>) {
    pair.map_or_else(Default::default, |pair| (pair.numbers(config), pair.took_over()))
}

/// How halls are opened.
struct Opening<'a> {
    /// The file of the configuration.
    config: &'a Path,
    calls: &'a Calls,
    pair: Option<&'a Pair>,
}

impl Opening<'_> {
    /// Opens the first hall of this program. Whatever a second machine was promised, nothing may move where somebody else sends.
    fn first(
        &self,
        config: &Arc<Config>,
        ended: LedBefore,
        numbers: &Numbers,
        film: &mut HallFilm,
    ) -> Result<Runtime, ServeError> {
        let mut runtime = self.open(config, (ended, true), numbers, film)?;
        let others = if self.pair.is_some() { runtime.find_other_masters() } else { Vec::new() };
        let names: Vec<_> = others.iter().map(|(lane, _)| config.controllers[*lane].name.as_str()).collect();
        if names.is_empty() { Ok(runtime) } else { Err(ServeError::OtherMaster(names.join(", "))) }
    }

    /// Opens the hall, and reads what tells of its film; says how it ended before, and whether addresses may come later.
    fn open(
        &self,
        config: &Arc<Config>,
        (before, may_come): (LedBefore, bool),
        numbers: &Numbers,
        film: &mut HallFilm,
    ) -> Result<Runtime, RuntimeError> {
        let purpose = Purpose::Hall { before, may_come };
        let lead = self.pair.map(Pair::lead);
        let runtime = Runtime::open(Arc::clone(config), purpose, numbers, self.calls, lead)?;
        if let Some(pair) = self.pair {
            pair.shows(&runtime.control().live, numbers);
        }
        let point = film.follow(config).map_err(RuntimeError::Thread)?;
        Ok(runtime.with_film(point))
    }

    /// Opens the hall with another configuration; where it does not open so, with the one before, which did.
    fn reopen(
        &self,
        next: Arc<Config>,
        before: Arc<Config>,
        numbers: &Numbers,
        carryover: &mut Carryover,
        film: &mut HallFilm,
    ) -> Result<(Runtime, Arc<Config>), RuntimeError> {
        // The seats are parked or at rest, so nothing tells of a crash. An address that is new, and not here, is a mistake.
        let is_new = next.show.bind != before.show.bind;
        match self.open(&next, (LedBefore::Ended, !is_new), numbers, film) {
            Ok(runtime) => {
                carryover.forget_refusals();
                if let Some(Err(error)) = self.pair.map(|pair| pair.set_config(self.config)) {
                    let why = "the other machine takes this for another one, and does not take over";
                    carryover.tell(Some(format!("the configuration cannot be read again: {error}; {why}")));
                }
                Ok((runtime, next))
            }
            Err(error) => {
                carryover.refuse(&error.to_string());
                Ok((self.open(&before, (LedBefore::Ended, true), numbers, film)?, before))
            }
        }
    }
}

/// Runs one hall on this thread, with a supervisor beside it.
fn keep(
    runtime: Runtime,
    ports: SupervisorPorts,
    library: Library,
    journal: Journal,
    feeder: &mut Option<WatchdogThread>,
) -> Result<SupervisorEnd, ServeError> {
    let (tell, closed) = channel();
    let mut supervisor = Err(io::ErrorKind::NotFound.into());
    ports.carryover.set_desk(runtime.config(), &runtime.control().desk);
    let (leaves, left) = channel();
    let run = runtime.run(|handle, line| {
        let leave = Arc::clone(&handle.leave);
        // The one before it has fed until now, so that nobody takes the time between two halls for a hang.
        *feeder = feed_watchdog(&handle);
        let kept = Supervisor::new(ports, handle, line, library, journal);
        let thread = Builder::new().name("supervisor".to_owned()).spawn(move || {
            let _ = realtime::normal_priority();
            // Where nobody waits any more, it hung.
            drop(leaves.send(kept.run(&closed)));
        });
        match thread {
            Ok(thread) => supervisor = Ok(thread.thread().clone()),
            Err(cause) => {
                supervisor = Err(cause);
                leave.store(true, std::sync::atomic::Ordering::Release);
            }
        }
        supervisor.as_ref().ok().cloned()
    })?;
    let supervisor = supervisor.map_err(ServeError::System)?;
    drop(tell.send(Box::new(run)));
    supervisor.unpark();
    left.recv_timeout(SUPERVISOR_ENDS).map_err(|_| ServeError::Supervisor)
}

/// Feeds the watchdog of the service manager, where it has one, while the tick thread of this hall ticks.
fn feed_watchdog(handle: &RuntimeHandle) -> Option<WatchdogThread> {
    let live = Arc::clone(&handle.live);
    let period = Rate::from_hz(handle.config.show.rate_hz).period();
    // Where there is no thread for it, the service manager starts the program anew.
    sd::watchdog().and_then(|interval| WatchdogThread::start(interval, period, move || live.pulse()).ok())
}

/// The signals of a service: SIGTERM and SIGINT end it, SIGHUP has it read its configuration anew.
///
/// # Errors
/// [`ServeError::System`] where they cannot be handled.
pub(crate) fn signals() -> Result<SystemSignals, ServeError> {
    let signals = SystemSignals::default();
    let on = |signal, flag: &Arc<_>| flag::register(signal, Arc::clone(flag)).map_err(ServeError::System);
    on(SIGTERM, &signals.leave)?;
    on(SIGINT, &signals.leave)?;
    on(SIGHUP, &signals.reload)?;
    Ok(signals)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hall(bind: &str) -> Arc<Config> {
        let mut config = crate::config::from_to_args(&["127.0.0.1:9".to_owned()], &[], 1).unwrap();
        config.show.bind = bind.parse().unwrap();
        Arc::new(config)
    }

    #[test]
    fn a_hall_that_does_not_open_with_another_configuration_has_the_old_one_and_says_why() {
        // An address of documentation, which no machine has (RFC 5737).
        let (next, before) = (hall("192.0.2.1:0"), hall("127.0.0.1:0"));
        let mut carryover = Carryover::default();
        let mut film = HallFilm::default();
        let calls = Calls::default();
        let opening = Opening { config: Path::new("hall.toml"), calls: &calls, pair: None };
        let (_house, config) =
            opening.reopen(next, Arc::clone(&before), &Numbers::new(), &mut carryover, &mut film).unwrap();
        assert!(Arc::ptr_eq(&config, &before));
        assert!(
            format!("{carryover:?}").contains("does not open with the new configuration"),
            "{carryover:?}"
        );
        let next = hall("127.0.0.1:0");
        let (_house, config) =
            opening.reopen(Arc::clone(&next), before, &Numbers::new(), &mut carryover, &mut film).unwrap();
        assert!(Arc::ptr_eq(&config, &next));
    }
}
