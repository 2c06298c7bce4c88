//! Heartbeats: one each 20 ms over every network between the machines, and what comes from the other one.

use std::net::{SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{Heard, PairError, PairShared, thread};
use crate::log::Priority;
use crate::pair::{BEAT, Carried, Message};
use crate::sys::clock::Monotonic;
use crate::sys::lock::lock;
use crate::time::{Clock as _, ShowTime};

/// What people have set goes with each so-manieth beat.
const WITH_SETTINGS: u64 = 25;
/// The longest datagram there is.
const DATAGRAM: usize = 1 << 16;

/// Starts the threads: one that sends, one that hears for each network.
pub(super) fn start(
    shared: &Arc<PairShared>,
    sockets: Vec<UdpSocket>,
    others: Vec<SocketAddrV4>,
) -> Result<(), PairError> {
    for socket in &sockets {
        let (shared, socket) = (Arc::clone(shared), socket.try_clone().map_err(PairError::System)?);
        thread("pair-hears", move || hear(&shared, &socket))?;
    }
    let shared = Arc::clone(shared);
    let ways: Vec<_> = sockets.into_iter().zip(others).collect();
    thread("pair-beats", move || beat(&shared, &ways))
}

fn beat(shared: &PairShared, ways: &[(UdpSocket, SocketAddrV4)]) {
    let mut next = Monotonic.now();
    loop {
        Monotonic.sleep_until(next);
        // None is made up for that was slept through.
        next = (next + BEAT).max(Monotonic.now());
        let beat = shared.act(|claim, now| claim.beat(now));
        let carried = carried(shared, beat.number);
        let octets = Message { beat, carried }.emit(&shared.key);
        for (socket, other) in ways {
            let _ = socket.send_to(&octets, other); // where a network is down there is another, or the next
        }
        shared.beats.fetch_add(1, Ordering::Relaxed);
    }
}

/// How the show of this machine is, for the other one.
fn carried(shared: &PairShared, number: u64) -> Carried {
    let mut carried = Carried { digest: shared.digest, ..Carried::default() };
    if let Some((live, first)) = &*lock(&shared.show) {
        // No lane sends more than a frame a tick.
        let ticks = u32::try_from(live.beats()).unwrap_or(u32::MAX);
        carried.frame = first.saturating_add(ticks).saturating_add(1);
        carried.film_ms = whole_ms(live.show());
        carried.moves = live.is_moving();
        if number.is_multiple_of(WITH_SETTINGS) {
            carried.settings = lock(&shared.settings).clone();
        }
    }
    carried
}

#[expect(clippy::cast_possible_truncation, reason = "a show is no longer than i64 has milliseconds")]
fn whole_ms(at: ShowTime) -> i64 {
    (at.as_secs_f64() * 1e3) as i64
}

fn hear(shared: &PairShared, socket: &UdpSocket) {
    let mut buf = vec![0; DATAGRAM];
    loop {
        let Ok(len) = socket.recv(&mut buf) else {
            // Where the system is out of something it may be so for a while.
            Monotonic.sleep_until(Monotonic.now() + BEAT);
            continue;
        };
        let Some(Message { beat, carried }) = Message::parse(&buf[..len], &shared.key) else { continue };
        let differs = carried.digest != shared.digest;
        let is_new = shared.act(|claim, now| {
            let is_new = claim.hear(&beat, now);
            if is_new {
                claim.set_fit(!differs);
            }
            is_new
        });
        if !is_new {
            continue;
        }
        if differs != shared.differs.swap(differs, Ordering::Relaxed) && differs {
            let text = format!("{} has another configuration; nothing is taken over", shared.other);
            shared.say(Priority::Warning, text);
        }
        if beat.leads {
            note(shared, carried);
        }
    }
}

/// Keeps what the machine that leads has told.
fn note(shared: &PairShared, mut carried: Carried) {
    if let Some(settings) = carried.settings.take() {
        *lock(&shared.settings) = Some(settings);
    }
    *lock(&shared.heard) = Some(Heard { carried, at: Monotonic.now() });
}
