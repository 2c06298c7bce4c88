//! Heartbeats: one each 20 ms over every network between the machines, and what comes from the other one.

use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::settings::PairSettings;
use super::{Heard, PairError, PairShared, thread};
use crate::pair::{BEAT, Carried, Message};
use crate::state::State;
use crate::sys::clock::Monotonic;
use crate::sys::lock::lock;
use crate::time::{Clock as _, ShowTime};

/// The longest datagram there is.
const DATAGRAM: usize = 1 << 16;

/// The sockets of this machine, each with the address of the other one in that network.
pub(super) type Ways = Vec<(UdpSocket, SocketAddrV4)>;

/// Starts the threads: one that sends, one that hears for each network.
pub(super) fn start(shared: &Arc<PairShared>) -> Result<(), PairError> {
    for (socket, other) in &*lock(&shared.ways) {
        // Whoever sends waits for no network that takes nothing.
        socket.set_write_timeout(Some(BEAT)).map_err(PairError::System)?;
        let (shared, socket) = (Arc::clone(shared), socket.try_clone().map_err(PairError::System)?);
        let other = (*other).into();
        thread("pair-hears", move || hear(&shared, &socket, other))?;
    }
    let shared = Arc::clone(shared);
    thread("pair-beats", move || {
        let mut next = Monotonic.now();
        loop {
            Monotonic.sleep_until(next);
            // None is made up for that was slept through.
            next = (next + BEAT).max(Monotonic.now());
            beat(&shared);
            shared.beats.fetch_add(1, Ordering::Relaxed);
        }
    })
}

/// Sends a beat. One at a time: of two that overtake each other the first counts for nothing.
pub(super) fn beat(shared: &PairShared) {
    let ways = lock(&shared.ways);
    let beat = shared.act(|claim, now| claim.beat(now));
    let carried = carried(shared, beat.number);
    let octets = Message { beat, carried }.emit(&shared.key);
    for (socket, other) in &*ways {
        let _ = socket.send_to(&octets, other); // where a network is down there is another, or the next
    }
}

/// How the show of this machine is, for the other one.
fn carried(shared: &PairShared, number: u64) -> Carried {
    let mut carried = Carried::default();
    if let Some((live, first)) = &*lock(&shared.show) {
        // No lane sends more than a frame a tick.
        let ticks = u32::try_from(live.beats()).unwrap_or(u32::MAX);
        carried.frame = first.saturating_add(ticks).saturating_add(1);
        carried.film_ms = whole_ms(live.sought());
        carried.moves = live.is_moving();
        // A test of the seats goes on nowhere else.
        let state = if live.is_test() { State::Parked } else { live.state() };
        carried.runs = matches!(state, State::Playing(_));
        carried.is_on_cue = carried.runs || state == State::Paused;
        let mut settings = lock(&shared.settings);
        carried.revision = settings.of.1;
        carried.settings = settings.carried(number);
    }
    carried
}

#[expect(clippy::cast_possible_truncation, reason = "a show is no longer than i64 has milliseconds")]
fn whole_ms(at: ShowTime) -> i64 {
    (at.as_secs_f64() * 1e3) as i64
}

/// Takes what comes. Where this machine stood still, what waits then is from whenever: it echoes no beat of ours of just now, and counts
/// for nothing.
fn hear(shared: &PairShared, socket: &UdpSocket, other: SocketAddr) {
    let mut buf = vec![0; DATAGRAM];
    loop {
        let Ok((len, from)) = socket.recv_from(&mut buf) else {
            // Where the system is out of something it may be so for a while.
            Monotonic.sleep_until(Monotonic.now() + BEAT);
            continue;
        };
        if from != other {
            continue;
        }
        let Some(Message { beat, carried }) = Message::parse(&buf[..len], &shared.key) else { continue };
        if shared.act(|claim, now| claim.hear(&beat, now)) && beat.leads {
            note(shared, beat.from, carried);
        }
    }
}

/// Keeps what the machine that leads has told.
fn note(shared: &PairShared, session: u64, mut carried: Carried) {
    let of = (session, carried.revision);
    if let Some(text) = carried.settings.take() {
        *lock(&shared.settings) = PairSettings::told(text, of);
    }
    *lock(&shared.heard) = Some(Heard { session, carried, at: Monotonic.now() });
}
