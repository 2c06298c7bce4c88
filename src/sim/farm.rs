//! Virtual controllers on sockets: one thread that waits for all of them.

use std::collections::VecDeque;
use std::io;
use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use rustix::buffer::spare_capacity;
use rustix::event::{EventfdFlags, Timespec, epoll, eventfd};
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;

use super::link::{Fate, Link};
use super::log::Log;
use super::{Controller, Counts, Options, Setup};
use crate::time::MonoTime;
use crate::wire::MAX_LEN;

/// Longer datagrams are cut; no message is that long.
const MAX_DATAGRAM: usize = 2048;
/// Sockets that one wait names at most.
const EVENTS: usize = 128;
/// Answers that wait for their time at most; what comes on top is not sent.
const DELAYED: usize = 65_536;
/// Datagrams of a socket that are still taken when the end is asked for.
const BACKLOG: usize = 4_096;
/// Names the end in place of a controller.
const STOP: u64 = u64::MAX;

/// Why virtual controllers cannot start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FarmError {
    /// The ports run past the last one.
    #[error("{count} controllers from port {first} on run past port 65535; take a lower first port")]
    Ports {
        /// The first port.
        first: u16,
        /// How many controllers.
        count: usize,
    },
    /// An address is taken, or none of this machine's.
    #[error("cannot listen on {address}")]
    Listen {
        /// The address.
        address: SocketAddrV4,
        /// What the system said.
        #[source]
        source: io::Error,
    },
    /// The system refused something else.
    #[error("cannot wait for {count} sockets")]
    System {
        /// How many controllers.
        count: usize,
        /// What the system said.
        #[source]
        source: io::Error,
    },
}

/// What became of one virtual controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// Where it listened.
    pub address: SocketAddrV4,
    /// What became of its datagrams and moves.
    #[serde(flatten)]
    pub counts: Counts,
    /// Where its working axes ended, pulses.
    pub positions: Vec<i32>,
    /// Its outputs at the end, bit 0 = Y01.
    pub outputs: u16,
}

/// Virtual controllers at work on a thread of their own, until they are stopped or dropped.
#[derive(Debug)]
pub struct Farm {
    addresses: Vec<SocketAddrV4>,
    stop: Arc<OwnedFd>,
    thread: Option<JoinHandle<io::Result<Vec<Outcome>>>>,
}

impl Farm {
    /// Binds all sockets and starts the thread. What is sent to them from now on is answered.
    ///
    /// # Errors
    /// [`FarmError`] where a socket cannot be had; then none is kept.
    pub fn start(options: Options) -> Result<Self, FarmError> {
        let start = now();
        let count = options.controllers.len();
        let stations = stations(&options, start)?;
        let addresses = stations.iter().map(|station| station.address).collect();
        let system = |source: io::Error| FarmError::System { count, source };
        let (epoll, stop) = wait_for(&stations).map_err(|error| system(error.into()))?;
        let stop = Arc::new(stop);
        let keeper = Keeper {
            start,
            stations,
            epoll,
            _stop: Arc::clone(&stop),
            delay: options.faults.delay,
            delayed: VecDeque::new(),
            log: options.log.map(Log::new),
        };
        let thread = std::thread::Builder::new().name("kinocue-sim".to_owned());
        let thread = thread.spawn(move || keeper.run()).map_err(system)?;
        Ok(Self { addresses, stop, thread: Some(thread) })
    }

    /// Where the controllers listen, in the order of their setups.
    #[must_use]
    pub fn addresses(&self) -> Vec<SocketAddrV4> {
        self.addresses.clone()
    }

    /// Takes what has come, ends the thread and says what became of each controller.
    ///
    /// # Errors
    /// A log that could not be written, or a wait that failed.
    pub fn stop(mut self) -> io::Result<Vec<Outcome>> {
        self.end()
    }

    fn end(&mut self) -> io::Result<Vec<Outcome>> {
        let Some(thread) = self.thread.take() else { return Ok(Vec::new()) };
        rustix::io::write(&*self.stop, &1_u64.to_ne_bytes())?;
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl Drop for Farm {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = self.end(); // nobody is left to be told
        }
    }
}

/// A controller and its socket.
#[derive(Debug)]
struct Station {
    address: SocketAddrV4,
    socket: UdpSocket,
    controller: Controller,
    link: Link,
    /// What the socket and the link add to the controller's own counts.
    extra: Counts,
}

fn stations(options: &Options, start: MonoTime) -> Result<Vec<Station>, FarmError> {
    let first = options.listen;
    let station = |(index, setup): (usize, &Setup)| {
        let outside = FarmError::Ports { first: first.port(), count: options.controllers.len() };
        let port = match first.port() {
            0 => 0,
            port => u16::try_from(usize::from(port) + index).map_err(|_| outside)?,
        };
        let wanted = SocketAddrV4::new(*first.ip(), port);
        let (socket, address) =
            listen(wanted).map_err(|source| FarmError::Listen { address: wanted, source })?;
        Ok(Station {
            address,
            socket,
            controller: Controller::new(setup, address, start),
            link: Link::new(&options.faults, options.seed, index),
            extra: Counts::default(),
        })
    };
    options.controllers.iter().enumerate().map(station).collect()
}

fn listen(wanted: SocketAddrV4) -> io::Result<(UdpSocket, SocketAddrV4)> {
    let socket = UdpSocket::bind(wanted)?;
    socket.set_nonblocking(true)?;
    match socket.local_addr()? {
        SocketAddr::V4(address) => Ok((socket, address)),
        SocketAddr::V6(_) => Ok((socket, wanted)),
    }
}

/// An epoll over all sockets and the event that ends the thread.
fn wait_for(stations: &[Station]) -> rustix::io::Result<(OwnedFd, OwnedFd)> {
    let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
    for (index, station) in (0..).zip(stations) {
        epoll::add(&epoll, &station.socket, epoll::EventData::new_u64(index), epoll::EventFlags::IN)?;
    }
    let stop = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?;
    epoll::add(&epoll, &stop, epoll::EventData::new_u64(STOP), epoll::EventFlags::IN)?;
    Ok((epoll, stop))
}

/// An answer, and when it leaves.
#[derive(Debug)]
struct Answer {
    due: MonoTime,
    station: usize,
    to: SocketAddrV4,
    copies: u8,
    len: usize,
    octets: [u8; MAX_LEN],
}

/// All that the thread owns.
#[derive(Debug)]
struct Keeper {
    start: MonoTime,
    stations: Vec<Station>,
    epoll: OwnedFd,
    /// Keeps the event open as long as the wait knows it.
    _stop: Arc<OwnedFd>,
    delay: Duration,
    delayed: VecDeque<Answer>,
    log: Option<Log>,
}

impl Keeper {
    fn run(mut self) -> io::Result<Vec<Outcome>> {
        let mut events = Vec::with_capacity(EVENTS);
        loop {
            let timeout = self.delayed.front().map(|answer| timespec(answer.due.since(now())));
            match epoll::wait(&self.epoll, spare_capacity(&mut events), timeout.as_ref()) {
                Ok(_) | Err(rustix::io::Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
            for event in events.drain(..) {
                match event.data.u64() {
                    STOP => return self.end(),
                    index => {
                        self.serve(usize::try_from(index).expect("made from a place in a Vec"));
                    }
                }
            }
            self.send_due();
        }
    }

    /// Takes one datagram, if there is one; where more are there, the wait names the socket again.
    fn serve(&mut self, index: usize) -> bool {
        let mut datagram = [0; MAX_DATAGRAM];
        let station = &mut self.stations[index];
        let Ok((len, SocketAddr::V4(from))) = station.socket.recv_from(&mut datagram) else { return false };
        let at = now();
        let fate = station.link.fate();
        if fate == Fate::LostOnTheWay {
            station.extra.received += 1;
            station.extra.lost_frames += 1;
            return true;
        }
        let mut buf = [0; MAX_LEN];
        let handled = station.controller.on_datagram(from, &datagram[..len], at, &mut buf);
        let answer = handled.reply.map(<[u8]>::len);
        if let (Some(log), Some(seen)) = (&mut self.log, &handled.motion) {
            let executed = station.controller.positions(at);
            log.frame(at.since(self.start), station.address, seen, answer.is_some(), &executed);
        }
        if let Some(len) = answer {
            let due = at + self.delay;
            self.answer(fate, Answer { due, station: index, to: from, copies: 1, len, octets: buf });
        }
        true
    }

    /// Sends an answer, now or when it is due, unless the link loses it.
    fn answer(&mut self, fate: Fate, mut answer: Answer) {
        let station = &mut self.stations[answer.station];
        if fate == Fate::AnswerLost {
            station.extra.lost_replies += 1;
            return;
        }
        if fate == Fate::AnsweredTwice {
            station.extra.duplicated += 1;
            answer.copies = 2;
        }
        if self.delay.is_zero() {
            station.send(&answer);
        } else if self.delayed.len() == DELAYED {
            station.extra.send_failed += 1;
        } else {
            self.delayed.push_back(answer);
        }
    }

    fn send_due(&mut self) {
        while let Some(answer) = self.delayed.pop_front_if(|answer| answer.due <= now()) {
            self.stations[answer.station].send(&answer);
        }
    }

    fn end(mut self) -> io::Result<Vec<Outcome>> {
        for index in 0..self.stations.len() {
            let mut left = BACKLOG;
            while left > 0 && self.serve(index) {
                left -= 1;
            }
        }
        let at = now();
        let mut outcomes = Vec::with_capacity(self.stations.len());
        for station in &mut self.stations {
            let positions = station.controller.positions(at);
            let outputs = station.controller.outputs();
            if let Some(log) = &mut self.log {
                log.rest(at.since(self.start), station.address, outputs, &positions);
            }
            let positions = positions.iter().map(|position| position.0).collect();
            outcomes.push(Outcome { address: station.address, counts: station.counts(), positions, outputs });
        }
        self.log.map_or(Ok(()), Log::close).map(|()| outcomes)
    }
}

impl Station {
    fn send(&mut self, answer: &Answer) {
        let octets = &answer.octets[..answer.len];
        for _ in 0..answer.copies {
            self.extra.send_failed += u64::from(self.socket.send_to(octets, answer.to).is_err());
        }
    }

    fn counts(&self) -> Counts {
        let own = self.controller.counts();
        Counts {
            received: own.received + self.extra.received,
            lost_frames: self.extra.lost_frames,
            lost_replies: self.extra.lost_replies,
            duplicated: self.extra.duplicated,
            send_failed: self.extra.send_failed,
            ..own
        }
    }
}

/// The monotonic clock.
fn now() -> MonoTime {
    let time = clock_gettime(ClockId::Monotonic);
    let (seconds, nanos) = (time.tv_sec.cast_unsigned(), time.tv_nsec.cast_unsigned());
    MonoTime::from_nanos(seconds * 1_000_000_000 + nanos)
}

/// How long to wait, a millisecond up, since that is how fine the wait may be.
fn timespec(span: Duration) -> Timespec {
    let span = span + Duration::from_millis(1);
    let seconds = i64::try_from(span.as_secs()).unwrap_or(i64::MAX);
    Timespec { tv_sec: seconds, tv_nsec: i64::from(span.subsec_nanos()) }
}
