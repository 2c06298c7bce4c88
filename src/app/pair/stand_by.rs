//! Standing by: nothing is sent to any controller, and no surface is open, until this machine leads.

use std::fs;
use std::net::{SocketAddrV4, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::{
    Pair, PairError, PairShared, TookOver, beats, find_machine, journal, key, lease, print_of, session,
    settings,
};
use crate::config::{Config, Pair as PairConfig};
use crate::log::{Log, Priority};
use crate::net::Lead;
use crate::pair::{BEAT, Claim, PairMisfit, Role};
use crate::sd::{self, Notifier, WatchdogThread};
use crate::sys::clock::Monotonic;
use crate::sys::file::write_ours;
use crate::sys::lock::lock;
use crate::time::{Clock as _, MonoTime};

/// How often it is looked whether this machine leads.
const LOOK: Duration = Duration::from_millis(20);
/// How long the address of the hall may take to come here.
const ADDRESS: Duration = Duration::from_secs(3);
/// By this file in the folder of the state a person says that the other machine is off.
const ALONE: &str = "alone";
/// The names of the sockets of the lease and of the journal, beside that of the fleet.
const LEASE: &str = "pair.sock";
const JOURNAL: &str = "pair-journal.sock";

/// Where the service has its files.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PairPlaces<'a> {
    /// The configuration.
    pub(crate) config: &'a Path,
    /// The folder of the state.
    pub(crate) state: &'a Path,
    /// The control socket.
    pub(crate) control: &'a Path,
    /// The socket of the link.
    pub(crate) fleet: &'a Path,
}

/// What standing by came to.
#[derive(Debug)]
pub(crate) enum StoodBy {
    /// This machine leads from now on.
    Leads(Pair),
    /// The program is to end.
    Ended,
}

/// Stands by until this machine leads and has the address of its hall, or the program is to end.
///
/// # Errors
/// Why it cannot be one of a pair.
pub(crate) fn stand_by(
    config: &Config,
    pair: &PairConfig,
    places: &PairPlaces<'_>,
    leave: &AtomicBool,
    log: &Log,
) -> Result<StoodBy, PairError> {
    let (shared, name) = start(pair, places, log)?;
    let _ = fs::create_dir_all(&config.log.dir); // what cannot be kept there is told once this machine leads
    journal::start(name.clone(), config.log.dir.clone(), &places.fleet.with_file_name(JOURNAL))?;
    let interval = sd::watchdog();
    let beats = Arc::clone(&shared);
    let pulse = move || {
        let beats = beats.beats.load(Ordering::Relaxed);
        Some([beats, beats])
    };
    let feeder = interval.and_then(|interval| WatchdogThread::start(interval, BEAT, pulse).ok());
    let mut notifier = Notifier::default();
    // Without a service manager there is nobody to be told.
    let _ = notifier.ready(&format!("{name} stands by"), Monotonic.now());
    shared.say(Priority::Info, format!("{name} stands by, and sends nothing to the seats"));
    let alone = places.state.join(ALONE);
    let mut misfit = None;
    loop {
        if leave.load(Ordering::Acquire) {
            return Ok(StoodBy::Ended);
        }
        if fs::remove_file(&alone).is_ok() {
            shared.say(Priority::Notice, format!("{} is off, as somebody says", shared.other));
            shared.act(|claim, now| claim.is_alone(now));
        }
        if matches!(shared.act(|claim, now| claim.role(now)), Role::Leads { .. }) {
            break;
        }
        let found = shared.act(|claim, now| claim.misfit(now));
        if found != std::mem::replace(&mut misfit, found)
            && let Some(found) = found
        {
            shared.say(Priority::Warning, misfit_words(found, &name, &shared.other, &alone));
        }
        let why = found.map_or("", |_| ", and does not lead: its configuration is another");
        notifier.status(&format!("{name} stands by{why}"), Monotonic.now());
        Monotonic.sleep_until(Monotonic.now() + LOOK);
    }
    shared.say(Priority::Notice, format!("{name} leads the hall"));
    let _ = fs::create_dir_all(places.state); // what cannot be kept there is told
    let took_over = takes_over(&shared, places.state);
    let write = |file: &PathBuf| write_ours(file, format!("{name}\n"));
    shared.lead_files.iter().try_for_each(write).map_err(PairError::System)?;
    await_address(config.show.bind, &shared.lead_files[0])?;
    Ok(StoodBy::Leads(Pair { shared, took_over, feeder }))
}

/// Removes what tells the link that this is one of two machines, where it was and is not any more: the sockets of a program that has ended.
pub(crate) fn forget_pair(pair: Option<&Pair>, fleet: &Path) {
    for name in [LEASE, JOURNAL].iter().filter(|_| pair.is_none()) {
        let _ = fs::remove_file(fleet.with_file_name(name)); // mostly there is none
    }
}

/// Keeps what the other machine has told, where it led.
fn takes_over(shared: &PairShared, state: &Path) -> Option<TookOver> {
    let heard = lock(&shared.heard).clone()?;
    let other = &shared.other;
    let (kept, ride) = settings::keep(other, &lock(&shared.settings), &heard, Monotonic.now(), state);
    let was = if heard.carried.moves { "its seats were moving" } else { "its seats did not move" };
    // What a person does next is said by the status, for as long as it can be done.
    Some(TookOver { words: format!("took over from {other}: {was}; {kept}; look at the seats"), ride })
}

/// Why this machine does not lead, and what to do.
fn misfit_words(misfit: PairMisfit, name: &str, other: &str, alone: &Path) -> String {
    match misfit {
        PairMisfit::Other => {
            format!(
                "{other} has another configuration; {name} takes nothing over; give both the same, and restart or reload them"
            )
        }
        PairMisfit::Leader => format!(
            "whoever led last had another configuration than {name} has now; it does not lead by that; start {other} with the same one, or, \
             where {other} is off and this one is meant: touch {}",
            alone.display()
        ),
    }
}

/// The threads of this machine, and what it is called.
fn start(
    pair: &PairConfig,
    places: &PairPlaces<'_>,
    log: &Log,
) -> Result<(Arc<PairShared>, String), PairError> {
    let key_file = places.config.parent().map_or_else(|| pair.key.clone(), |folder| folder.join(&pair.key));
    let key = key(&key_file)?;
    let (number, sockets) = find_machine(pair)?;
    let (own, other) = (&pair.machines[number], &pair.machines[1 - number]);
    let lead_files = [places.control, places.fleet].map(|socket| socket.with_file_name(super::LEAD_FILE));
    lead_files.iter().for_each(|file| drop(fs::remove_file(file))); // of a program that was killed while it led
    let session = session().map_err(PairError::System)?;
    let mut claim = Claim::new(session, number == 0, Monotonic.now());
    claim.set_print(print_of(places.config).map_err(PairError::System)?);
    let shared = Arc::new(PairShared {
        claim: claim.into(),
        lead: Arc::<Lead>::default(),
        key,
        ways: Mutex::new(sockets.into_iter().zip(other.addresses.clone()).collect()),
        other: other.name.clone(),
        show: None.into(),
        heard: None.into(),
        settings: Mutex::default(),
        beats: 0.into(),
        lead_files,
        log: log.clone(),
    });
    lease::start(&shared, &places.fleet.with_file_name(LEASE))?;
    beats::start(&shared)?;
    Ok((shared, own.name.clone()))
}

/// Waits for the address that controllers know.
fn await_address(bind: SocketAddrV4, lead: &Path) -> Result<(), PairError> {
    let until: MonoTime = Monotonic.now() + ADDRESS;
    loop {
        let address = SocketAddrV4::new(*bind.ip(), 0);
        let Err(cause) = UdpSocket::bind(address) else { return Ok(()) };
        if Monotonic.now() >= until {
            return Err(PairError::Address { address: bind, lead: PathBuf::from(lead), cause });
        }
        Monotonic.sleep_until(Monotonic.now() + LOOK);
    }
}
