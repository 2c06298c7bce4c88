//! The same seats and the same network on real sockets and in real time, for real processes.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use kinocue::harness::sys::batch::{Batch, stamp_arrivals};
use kinocue::harness::sys::clock::{Monotonic, wall_now_ns};
use kinocue::harness::time::{Clock as _, MonoTime, nanos};

use super::ether::{BEGIN, Ether};
use super::seat::Settings;

/// How long a seat's thread waits for a datagram until it looks after what else there is.
const LOOK: Duration = Duration::from_millis(1);
/// How late a thread may notice what came.
const JITTER_MS: f64 = 40.0;

/// Seats at addresses of this machine.
pub(crate) struct Town {
    pub(crate) ether: Ether,
    pub(crate) addresses: Vec<SocketAddr>,
    began: MonoTime,
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Town {
    pub(crate) fn open(seats: &[Settings], seed: u64) -> Self {
        let bind = |index: usize| {
            UdpSocket::bind(SocketAddr::from(([127, 0, 1, index as u8 + 1], 0)))
                .expect("there is a free port")
        };
        let sockets: Vec<UdpSocket> = (0..seats.len()).map(bind).collect();
        let addresses: Vec<SocketAddr> =
            sockets.iter().map(|socket| socket.local_addr().expect("it is bound")).collect();
        let settled = |(seat, address): (&Settings, &SocketAddr)| Settings {
            jitter_ms: JITTER_MS,
            address: (seat.address.0, address.port()),
            ..*seat
        };
        let seats: Vec<Settings> = seats.iter().zip(&addresses).map(settled).collect();
        let ether = Ether::new(&seats, seed);
        ether.world().asked = true;
        let (over, began) = (Arc::<AtomicBool>::default(), Monotonic.now());
        let live = |(index, socket): (usize, UdpSocket)| {
            let (ether, over) = (ether.clone(), Arc::clone(&over));
            thread::spawn(move || live(&ether, began, index, &socket, &over))
        };
        let threads = sockets.into_iter().enumerate().map(live).collect();
        Self { ether, addresses, began, over, threads }
    }

    /// From now on nobody asks for motion; what is on its way was asked for.
    pub(crate) fn nobody_asks(&self) {
        let now = since(self.began);
        let world = &mut *self.ether.world();
        (world.asked, world.asked_until) = (false, now);
    }
}

impl Drop for Town {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Release);
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}

/// The seats' time, that of the machine since the town was opened.
fn since(began: MonoTime) -> u64 {
    BEGIN + nanos(Monotonic.now().since(began))
}

/// One seat, until all is over. What the kernel stamped tells when a datagram was sent, however late this thread is.
fn live(ether: &Ether, began: MonoTime, index: usize, socket: &UdpSocket, over: &AtomicBool) {
    let now = || since(began);
    socket.set_read_timeout(Some(LOOK)).expect("it is longer than nothing");
    stamp_arrivals(socket).expect("the kernel stamps");
    let (mut batch, mut host) = (Batch::new(), None);
    while !over.load(Ordering::Acquire) {
        // Nothing came, or who is gone is gone.
        if socket.peek_from(&mut [0]).is_ok() && batch.receive(socket).is_ok() {
            for datagram in batch.datagrams() {
                let ago = datagram.stamp_ns.map_or(0, |stamp| wall_now_ns().saturating_sub(stamp));
                host = Some(datagram.from);
                ether.pass_to(now());
                let _ = ether.take_in(index, datagram.bytes, now().saturating_sub(ago));
            }
        }
        ether.pass_to(now());
        while let Some(reply) = ether.take_back(index) {
            if let Some(host) = host {
                let _ = socket.send_to(&reply, host);
            }
        }
    }
}
