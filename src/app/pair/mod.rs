//! This machine as one of the two show machines of its hall. It stands by until it leads (`stand_by`); from then on it serves the hall, for
//! as long as it leads. What leads to that is decided by `pair::Claim`; here is what carries its messages: heartbeats between the machines
//! (`beats`), the lease by the link to the engine (`lease`), and what people have set (`settings`). The link reads this machine's journal
//! (`journal`). All on ordinary threads, none of which the show waits for.

mod beats;
mod journal;
mod lease;
mod links;
mod settings;
mod stand_by;

use std::fs;
use std::io;
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::thread::Builder;

use sha2::{Digest as _, Sha256};

pub(crate) use stand_by::{PairPlaces, StoodBy, forget_pair, stand_by};

use super::runtime::Numbers;
use crate::api::ApiError;
use crate::config::MAX_FILE_LEN;
use crate::config::{Config, Pair as PairConfig};
use crate::log::{Line, Log, Priority};
use crate::net::Lead;
use crate::pair::{Carried, Claim, LONGEST, PairKey, PairMisfit, Role};
use crate::rt::Live;
use crate::sd::WatchdogThread;
use crate::sys::clock::Monotonic;
use crate::sys::file::{random, read, secret};
use crate::sys::listen;
use crate::sys::lock::lock;
use crate::time::{Clock as _, MonoTime};
use crate::wire::FrameNo;
use beats::Ways;
use settings::PairSettings;

/// How the program ends once it has lost the lead: it is to be started again, and stands by then.
const LOST: i32 = 75;
/// The frame numbers of whoever takes over are so far above those that were heard last.
const ABOVE: u32 = 100_000;
/// That this machine leads: beside the control socket for whoever moves the address of the hall, beside the fleet socket for the link, which
/// sees no other folder.
const LEAD_FILE: &str = "lead";
/// The longest file of a key.
const LONGEST_KEY: u64 = 1_024;

/// Why a machine cannot be one of a pair. Nothing has moved then.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PairError {
    /// The key.
    #[error("{0}")]
    Key(String),
    /// This machine is none of the two.
    #[error(
        "no machine of [pair] has its addresses here ({0}); check the addresses of this machine, and whether the program runs already"
    )]
    NoMachine(#[source] io::Error),
    /// The socket of the lease.
    #[error(transparent)]
    Socket(#[from] ApiError),
    /// The address by which controllers know the hall has not come.
    #[error(
        "this machine leads, but has not got the address {address} of [show] bind; have it moved here as the file {} says (docs/pair.md)",
        lead.display()
    )]
    Address {
        /// The address.
        address: std::net::SocketAddrV4,
        /// The file.
        lead: PathBuf,
        /// Why not.
        #[source]
        cause: io::Error,
    },
    /// No file can be written, or the system has no thread.
    #[error("the system refused a file, a number by chance or a thread for [pair]: {0}")]
    System(#[source] io::Error),
}

/// What was heard of the machine that led.
#[derive(Debug, Clone)]
struct Heard {
    session: u64,
    carried: Carried,
    at: MonoTime,
}

impl Heard {
    /// Which settings were the newest there.
    const fn settings_of(&self) -> (u64, u32) {
        (self.session, self.carried.revision)
    }
}

/// What the threads of a pair share.
#[derive(Debug)]
struct PairShared {
    claim: Mutex<Claim>,
    lead: Arc<Lead>,
    key: PairKey,
    /// Held while a beat is sent.
    ways: Mutex<Ways>,
    /// The other machine, as people call it.
    other: String,
    /// The show of this machine, and the number of its first frame.
    show: Mutex<Option<(Arc<Live>, u32)>>,
    heard: Mutex<Option<Heard>>,
    settings: Mutex<PairSettings>,
    beats: AtomicU64,
    lead_files: [PathBuf; 2],
    log: Log,
}

/// What was taken over from the machine that led.
#[derive(Debug, Clone)]
pub(crate) struct TookOver {
    /// What a person should know of it.
    pub(crate) words: String,
    /// The show that was under way there, where that is known well enough for it to go on here.
    pub(crate) ride: Option<Ride>,
}

/// A show that was under way at the other machine, at the place that the settings have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Ride {
    /// Since when its film runs on from there; `None` if it was paused.
    pub(crate) runs_since: Option<MonoTime>,
}

/// This machine while it leads. Dropped, it goes on until the program ends.
#[derive(Debug)]
pub(crate) struct Pair {
    shared: Arc<PairShared>,
    /// `None` if nobody was heard.
    took_over: Option<TookOver>,
    feeder: Option<WatchdogThread>,
}

/// What is to be told of the pair.
#[derive(Debug, Clone)]
pub(crate) struct PairWatch(Arc<PairShared>);

impl PairShared {
    /// Does one thing with the claim, now, and passes on what comes of it.
    fn act<T>(&self, act: impl FnOnce(&mut Claim, MonoTime) -> T) -> T {
        let mut claim = lock(&self.claim);
        let now = Monotonic.now();
        let done = act(&mut claim, now);
        match claim.role(now) {
            Role::Leads { until } => self.lead.extend(until),
            Role::Lost => self.end(),
            Role::Follows | Role::Claims { .. } => {}
        }
        done
    }

    /// The lead is lost: nothing leaves any more, whatever this program does. So it ends, and stands by when it is started again.
    fn end(&self) {
        self.lead_files.iter().for_each(|file| drop(fs::remove_file(file))); // whoever moves the address looks at the service as well
        let text = format!(
            "this machine leads the hall no more: neither {} nor the engine was heard for a second, or it stood still for that long",
            self.other
        );
        self.log.say(Line::new(Priority::Error, "pair", text));
        self.log.close();
        std::process::exit(LOST);
    }

    fn say(&self, priority: Priority, text: String) {
        self.log.say(Line::new(priority, "pair", text));
    }
}

impl Pair {
    /// Until when it leads.
    pub(crate) fn lead(&self) -> Arc<Lead> {
        Arc::clone(&self.shared.lead)
    }

    /// What feeds the watchdog of the service manager until the hall does.
    pub(crate) fn take_feeder(&mut self) -> Option<WatchdogThread> {
        self.feeder.take()
    }

    /// The show that runs here from now on, whose frames go on from those numbers.
    pub(crate) fn shows(&self, live: &Arc<Live>, numbers: &Numbers) {
        let first = numbers.values().map(|number| number.0).max().unwrap_or_default();
        *lock(&self.shared.show) = Some((Arc::clone(live), first));
    }

    /// From where frame numbers go on: far above those of the machine that led.
    pub(crate) fn numbers(&self, config: &Config) -> Numbers {
        let heard = lock(&self.shared.heard);
        let next = heard.iter().map(|heard| FrameNo(heard.carried.frame.wrapping_add(ABOVE)));
        let of_each = |next| config.controllers.iter().map(move |one| (one.address(), next));
        next.flat_map(of_each).collect()
    }

    /// What was taken over; `None` if nobody was heard.
    pub(crate) fn took_over(&self) -> Option<TookOver> {
        self.took_over.clone()
    }

    /// The hall has another configuration from now on.
    ///
    /// # Errors
    /// Where it cannot be read any more: then no other machine takes over.
    pub(crate) fn set_config(&self, path: &Path) -> io::Result<()> {
        let print = print_of(path);
        let told = print.as_ref().copied().unwrap_or(1); // that of no file
        self.shared.act(|claim, _| claim.set_print(told));
        print.map(drop)
    }

    /// What is to be told of it.
    pub(crate) fn watch(&self) -> PairWatch {
        PairWatch(Arc::clone(&self.shared))
    }
}

impl PairWatch {
    /// People have set something: it has left for the other machine when this returns, so that whoever is told that it is done may rely on
    /// it.
    pub(crate) fn set(&self, text: String) {
        lock(&self.0.settings).set(text);
        beats::beat(&self.0);
    }

    /// What is wrong with it, each with what to do.
    pub(crate) fn troubles(&self) -> Vec<String> {
        let shared = &self.0;
        let now = Monotonic.now();
        let (hears, has_lease, misfit) = {
            let claim = lock(&shared.claim);
            (claim.hears(now), claim.has_lease(now), claim.misfit(now))
        };
        let other = &shared.other;
        let mut troubles = Vec::new();
        if !hears {
            troubles.push(format!(
                "{other} is not heard: it takes over only once it is; look at it, and at the networks between"
            ));
        }
        if !has_lease {
            troubles.push(format!(
                "the engine does not answer: {other} does not take over; look at kinocue-link and at the engine"
            ));
        }
        if misfit == Some(PairMisfit::Other) {
            troubles.push(format!(
                "{other} has another configuration: it does not take over; give both the same, and restart or reload them"
            ));
        }
        if let Some(length) =
            lock(&shared.settings).text.as_ref().map(String::len).filter(|length| *length > LONGEST)
        {
            troubles.push(format!(
                "what people have set takes {length} bytes, more than {LONGEST}: {other} does not get it; shorten the reasons why seats are out"
            ));
        }
        troubles
    }
}

/// The key of a file that nobody else may read.
fn key(path: &Path) -> Result<PairKey, PairError> {
    let name = path.display();
    let unread = |error| PairError::Key(format!("cannot read {name}: {error}"));
    let Some(text) = secret(path, LONGEST_KEY).map_err(unread)? else {
        return Err(PairError::Key(format!("others may read {name}: `chmod 600` it, and make a new key")));
    };
    let none =
        || format!("{name} has no key of 64 hexadecimal digits; make one: openssl rand -hex 32 > {name}");
    PairKey::parse(&text).ok_or_else(|| PairError::Key(none()))
}

/// Which machine of the pair this is, by its addresses, of which one has to be here: the sockets of that one, and the other one.
fn find_machine(pair: &PairConfig) -> Result<(usize, Vec<UdpSocket>), PairError> {
    let bind = |machine: usize| -> io::Result<Vec<UdpSocket>> {
        let addresses = &pair.machines[machine].addresses;
        let is_missing = |error: &io::Error| error.kind() == io::ErrorKind::AddrNotAvailable;
        let here: Vec<_> = addresses.iter().map(UdpSocket::bind).collect();
        let none_is = here.iter().all(|bound| bound.as_ref().is_err_and(is_missing));
        let bound = here.into_iter().zip(addresses).map(|(bound, address)| match bound {
            // That of another network comes later.
            Err(error) if is_missing(&error) && !none_is => {
                let socket = listen::udp((*address).into())?;
                socket.set_nonblocking(false).map(|()| socket)
            }
            bound => bound,
        });
        bound.collect()
    };
    match (bind(0), bind(1)) {
        (Ok(sockets), Err(_)) => Ok((0, sockets)),
        (Err(_), Ok(sockets)) => Ok((1, sockets)),
        (Ok(_), Ok(_)) => Err(PairError::NoMachine(io::Error::other("the addresses of both are here"))),
        (Err(cause), Err(_)) => Err(PairError::NoMachine(cause)),
    }
}

/// A number that nobody else has.
fn session() -> io::Result<u64> {
    Ok(u64::from_be_bytes(random()?).max(1))
}

/// What tells the configuration of a file from another one; never 0.
fn print_of(path: &Path) -> io::Result<u64> {
    let [.., a, b, c, d, e, f, g, h] = <[u8; 32]>::from(Sha256::digest(read(path, MAX_FILE_LEN)?));
    Ok(u64::from_be_bytes([a, b, c, d, e, f, g, h]).max(1))
}

fn thread(name: &str, run: impl FnOnce() + Send + 'static) -> Result<(), PairError> {
    Builder::new().name(name.to_owned()).spawn(run).map(drop).map_err(PairError::System)
}
