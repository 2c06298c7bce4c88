//! The daemon: a hall that is opened, kept and closed, as often as its configuration is read anew, and the surfaces that
//! outlive it.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::channel;
use std::thread::Builder;
use std::time::Duration;

use jiff::Zoned;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

use super::house::{Closed, House, HouseError, Numbers, Reins};
use super::keeper::{Ends, Keeper, Left, Memory, Signals, Voice};
use super::play::Played;
use super::prepare::Prepared;
use super::sum_up::{About, sum_up};
use super::surfaces::{Sockets, SurfaceError, Surfaces};
use crate::api::Pages;
use crate::config::Config;
use crate::engine::Ending;
use crate::hall::{Handle, Status, handle};
use crate::health::Why;
use crate::journal::{self, Journal, Limits};
use crate::library::{self, Library, LibraryError};
use crate::log::Log;
use crate::sd::{self, Feeder};
use crate::settings::SettingsFile;
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
use crate::time::{Clock as _, Rate};

/// How long the keeper has to end once its hall has closed; all that it waits for is a disk.
const KEEPER_ENDS: Duration = Duration::from_secs(10);

/// Where the daemon has its files.
#[derive(Debug, Clone)]
pub struct Places {
    /// The configuration.
    pub config: PathBuf,
    /// The folder of what it keeps from one start to the next.
    pub state: PathBuf,
    /// The sockets of this machine.
    pub sockets: Sockets,
}

/// Why the daemon does not run. Nothing has moved then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// The hall cannot be opened.
    #[error(transparent)]
    House(#[from] HouseError),
    /// A surface does not open.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The library cannot be opened.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// A file of its own cannot be written or removed.
    #[error("{}: {cause}; give the service a folder it may write to (StateDirectory= in the unit, or --state)", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        #[source]
        cause: io::Error,
    },
    /// The keeper does not end: what it had to write down may be lost.
    #[error(
        "the keeper hangs, and the program ends without it: the seats are parked or at rest; what it had to write down may be lost"
    )]
    Keeper,
    /// The system gives no signals, or no thread.
    #[error("the system refused: {0}")]
    System(#[source] io::Error),
}

/// The mark that a daemon leaves before its first tick, and an orderly end takes away.
#[derive(Debug)]
struct Mark(PathBuf);

impl Mark {
    /// The one in that folder, which is made where it is missing.
    fn of(folder: &Path) -> Result<Self, ServeError> {
        let mark = Self(folder.join("running"));
        fs::create_dir_all(folder).map_err(|cause| mark.failed(cause))?;
        Ok(mark)
    }

    /// Whether the daemon before left it and did not take it away.
    fn is_there(&self) -> Result<bool, ServeError> {
        self.0.try_exists().map_err(|cause| self.failed(cause))
    }

    fn leave(&self) -> Result<(), ServeError> {
        // Without a word in it, so that a full disk keeps no hall shut.
        fs::File::create(&self.0).map_err(|cause| self.failed(cause))?;
        Ok(())
    }

    /// Takes it away, where it was left.
    fn take_away(&self) -> Result<(), ServeError> {
        match fs::remove_file(&self.0) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(self.failed(cause)),
            _ => Ok(()),
        }
    }

    fn failed(&self, cause: io::Error) -> ServeError {
        ServeError::File { path: self.0.clone(), cause }
    }
}

/// What a daemon is made of.
#[derive(Debug)]
pub struct Parts {
    /// Its first configuration.
    pub config: Config,
    /// Where it has its files.
    pub places: Places,
    /// The console.
    pub pages: Pages,
    /// What tells it to end, and to read its configuration anew.
    pub signals: Signals,
    /// Where it says what happens.
    pub log: Log,
}

/// What a daemon came to.
#[derive(Debug)]
pub struct Served {
    config: Arc<Config>,
    closed: Box<Closed>,
    ended: journal::Ending,
}

impl Served {
    /// Sums it up as a play of `cue`: all that was sent since the configuration was last read, with the end of the last show.
    #[must_use]
    pub fn sum_up(self, cue: String) -> Played {
        let Self { config, mut closed, ended } = self;
        // That a group is there when the hall opens is no change worth telling.
        let mut seen = BTreeSet::new();
        closed.run.accounts.changes.retain(|one| !seen.insert(one.group) || one.why != Why::SeenAgain);
        let ending = match ended {
            journal::Ending::Completed => Ending::Completed,
            journal::Ending::Stopped => Ending::Stopped,
            journal::Ending::Fault => Ending::Fault,
        };
        let about = About { cue, rate: Rate::from_hz(config.show.rate_hz), ending, silent: false };
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
/// Where one of its threads panicked.
pub fn serve(parts: Parts, up: impl FnOnce(Handle, &[SocketAddr])) -> Result<Served, ServeError> {
    let mark = Mark::of(&parts.places.state)?;
    let crashed = mark.is_there()?;
    let served = serve_halls(parts, &mark, crashed, up);
    // An end with an error is none in the middle of a motion; what crashed before still has.
    if served.is_ok() || !crashed {
        mark.take_away()?;
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
    let Parts { config, places, pages, signals, log } = parts;
    let began = Monotonic.now();
    let mut config = Arc::new(config);
    let library = Library::open(&config.show.library, library::Hall::new(&places.config, &config.store))?;
    let mut numbers = Numbers::new();
    let mut house = House::open(Arc::clone(&config), crashed, &numbers, &signals.leave)?;
    let (handle, inbox, source) = handle(house.desk(), Status::starting(&config.show.name));
    let voice = Voice::new(log.clone());
    let (settings_file, kept) = SettingsFile::open(&places.state);
    let memory = Memory::of(kept);
    let mut ends =
        Ends { inbox, source, config: places.config, began, signals, voice, memory, settings_file };
    let surfaces = Surfaces::open(&config, &places.sockets, &handle, library.clone(), pages, &log)?;
    let mut journal = Journal::open(&config.log.dir, Limits::from(&config.log), &Zoned::now());
    // Not sooner: a start that is refused has moved nothing, and is no crash.
    mark.leave()?;
    up(handle, surfaces.addresses());
    let mut feeder = None;
    let served = loop {
        let left = keep(house, ends, library.clone(), journal, &mut feeder)?;
        (ends, journal) = (left.ends, left.journal);
        let Some(next) = left.reload else {
            break Served { config, closed: left.closed, ended: left.ended };
        };
        // Also of controllers that come back with a later configuration.
        numbers.extend(&left.closed.numbers);
        (house, config) = reopen(next, config, &numbers, &mut ends.memory, &ends.signals.leave)?;
    };
    surfaces.close();
    log.close();
    Ok(served)
}

/// Opens the hall with another configuration; where it does not open so, with the one before, which did.
fn reopen(
    next: Arc<Config>,
    before: Arc<Config>,
    numbers: &Numbers,
    memory: &mut Memory,
    leave: &Arc<AtomicBool>,
) -> Result<(House, Arc<Config>), HouseError> {
    // The seats are parked or at rest, so nothing tells of a crash.
    match House::open(Arc::clone(&next), false, numbers, leave) {
        Ok(house) => Ok((house, next)),
        Err(error) => {
            memory.note(format!(
                "the hall does not open with the new configuration, and has the old one: {error}"
            ));
            Ok((House::open(Arc::clone(&before), false, numbers, leave)?, before))
        }
    }
}

/// Runs one hall on this thread, with a keeper beside it.
fn keep(
    house: House,
    ends: Ends,
    library: Library,
    journal: Journal,
    feeder: &mut Option<Feeder>,
) -> Result<Left, ServeError> {
    let (tell, closed) = channel();
    let mut failed = None;
    ends.memory.set_desk(house.config(), &house.desk());
    let (leaves, left) = channel();
    let run = house.run(|reins, line| {
        let leave = Arc::clone(&reins.leave);
        // The one before it has fed until now, so that nobody takes the time between two halls for a hang.
        *feeder = feed_watchdog(&reins);
        let kept = Keeper::new(ends, reins, line, library, journal);
        let thread = Builder::new().name("keeper".to_owned()).spawn(move || {
            let _ = realtime::normal_priority();
            // Where nobody waits any more, it hung.
            drop(leaves.send(kept.run(&closed)));
        });
        if let Err(cause) = thread {
            failed = Some(cause);
            leave.store(true, std::sync::atomic::Ordering::Release);
        }
    })?;
    if let Some(cause) = failed {
        return Err(ServeError::System(cause));
    }
    drop(tell.send(Box::new(run)));
    left.recv_timeout(KEEPER_ENDS).map_err(|_| ServeError::Keeper)
}

/// Feeds the watchdog of the service manager, where it has one, while the tick thread of this hall ticks.
fn feed_watchdog(reins: &Reins) -> Option<Feeder> {
    let live = Arc::clone(&reins.live);
    let period = Rate::from_hz(reins.config.show.rate_hz).period();
    // Where there is no thread for it, the service manager starts the program anew.
    sd::watchdog().and_then(|interval| Feeder::start(interval, period, move || live.pulse()).ok())
}

/// The signals of a service: SIGTERM and SIGINT end it, SIGHUP has it read its configuration anew.
///
/// # Errors
/// [`ServeError::System`] where they cannot be handled.
pub fn signals() -> Result<Signals, ServeError> {
    let signals = Signals::default();
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
        let mut memory = Memory::default();
        let (_house, config) =
            reopen(next, Arc::clone(&before), &Numbers::new(), &mut memory, &Arc::default()).unwrap();
        assert!(Arc::ptr_eq(&config, &before));
        assert!(format!("{memory:?}").contains("does not open with the new configuration"), "{memory:?}");
        let next = hall("127.0.0.1:0");
        let (_house, config) =
            reopen(Arc::clone(&next), before, &Numbers::new(), &mut memory, &Arc::default()).unwrap();
        assert!(Arc::ptr_eq(&config, &next));
    }
}
