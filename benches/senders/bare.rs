//! The same loop without kinocue: sleep to the absolute deadline, send an unchanging frame on each connected socket.
//!
//! It reads the clock before its first send, as any loop does that knows its lateness, and once more before one other
//! send of each tick, a different one every time: that is how its ack latency is known without a clock reading for each
//! frame. Its acks are read by a timer between the ticks, with the kernel's stamps.

use std::net::{SocketAddrV4, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use kinocue::harness::motion::Pulses;
use kinocue::harness::net::DrainGrid;
use kinocue::harness::sys::batch::{Batch, SLOTS, stamp_arrivals};
use kinocue::harness::sys::clock::{Monotonic, thread_cpu_time, wall_now_ns};
use kinocue::harness::sys::realtime::{normal_priority, request};
use kinocue::harness::time::{Clock as _, MonoTime, nanos};
use kinocue::harness::tracker::{ACK_TIMEOUT, Histogram, histogram};
use kinocue::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, MotionReply, Timing};

use super::outcome::{Outcome, Quantiles, each};

const PERIOD_NS: u64 = 1_000_000;
const RUN_UP: Duration = Duration::from_millis(20);
/// Where a frame's number stands (SMC manual 2.2.2.5).
const FRAME_NO: std::ops::Range<usize> = 12..16;

/// The sockets, and when the sampled frame of each tick was sent: in nanoseconds, by tick.
struct Link {
    sockets: Vec<UdpSocket>,
    sampled: Vec<AtomicU64>,
    origin: MonoTime,
    sent_all: AtomicBool,
}

#[derive(Default)]
struct Sent {
    ticks: u64,
    missed: u64,
    frames: u64,
    time: Duration,
}

struct Received {
    acked: u64,
    latency: Histogram,
    time: Duration,
}

/// Sends for that many seconds.
pub(crate) fn run(seconds: u32, to: &[SocketAddrV4]) -> Outcome {
    let sockets = to.iter().map(connect).collect();
    let sampled = (0..1_000 * seconds).map(|_| AtomicU64::new(0)).collect();
    let origin = Monotonic.now() + RUN_UP;
    let link = Link { sockets, sampled, origin, sent_all: AtomicBool::new(false) };
    let mut lateness = histogram();
    let (granted, sent, received) = thread::scope(|scope| {
        let receiver = scope.spawn(|| {
            let _ = normal_priority();
            link.receive()
        });
        let granted = request();
        let sent = link.send(&mut lateness);
        link.sent_all.store(true, Ordering::Release);
        (granted, sent, receiver.join().expect("the receiver does not panic"))
    });
    Outcome {
        lateness: Quantiles::of(&lateness),
        ack: Quantiles::of(&received.latency),
        ticks: sent.ticks,
        missed: sent.missed,
        sent: sent.frames,
        acked: received.acked,
        send_us: each(sent.time, sent.frames),
        receive_us: each(received.time, received.acked),
        policy: granted.policy.to_string(),
        locked: granted.memory_locked,
    }
}

fn connect(to: &SocketAddrV4) -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("loopback has a free port");
    socket.connect(to).expect("loopback can be reached");
    socket.set_nonblocking(true).expect("any socket can be");
    stamp_arrivals(&socket).expect("the kernel stamps");
    socket
}

/// A frame of six axes that asks for a reply.
fn frame() -> Vec<u8> {
    let motion = Motion {
        timing: Timing::Relative,
        channel: 1,
        accept: Code::ALL,
        reply: Code::ALL,
        frame: FrameNo::FIRST,
        time_ms: 1,
        positions: &[Pulses(0); 6],
        outputs: 0,
        analogue: Analogue::OFF,
        vibration: None,
    };
    motion.emit(&mut [0; MAX_LEN]).to_vec()
}

impl Link {
    fn send(&self, lateness: &mut Histogram) -> Sent {
        let (mut sent, mut frame) = (Sent::default(), frame());
        let (mut tick, before) = (0_usize, thread_cpu_time());
        while tick < self.sampled.len() {
            Monotonic.sleep_until(self.deadline(tick));
            let now = Monotonic.now();
            // The newest tick due; those slept through are not caught up.
            let due = self.tick_at(now);
            sent.missed += u64::try_from(due - tick).expect("fewer ticks than that");
            tick = due;
            let Some(sampled) = self.sampled.get(tick) else { break };
            let number = u32::try_from(tick + 1).expect("fewer ticks than that");
            frame[FRAME_NO].copy_from_slice(&number.to_be_bytes());
            for (index, socket) in self.sockets.iter().enumerate() {
                if index == tick % self.sockets.len() {
                    sampled.store(Monotonic.now().as_nanos(), Ordering::Release);
                }
                sent.frames += u64::from(socket.send(&frame).is_ok());
            }
            lateness.saturating_record(nanos(now.since(self.deadline(tick))));
            sent.ticks += 1;
            tick += 1;
        }
        sent.time = thread_cpu_time().saturating_sub(before);
        sent
    }

    fn deadline(&self, tick: usize) -> MonoTime {
        self.origin + Duration::from_nanos(PERIOD_NS * u64::try_from(tick).expect("fewer ticks than that"))
    }

    fn tick_at(&self, now: MonoTime) -> usize {
        usize::try_from(nanos(now.since(self.origin)) / PERIOD_NS).expect("fewer ticks than that")
    }

    fn receive(&self) -> Received {
        let mut received = Received { acked: 0, latency: histogram(), time: Duration::ZERO };
        let (mut batch, drains) =
            (Batch::new(), DrainGrid::new(self.origin, Duration::from_nanos(PERIOD_NS)));
        let end = self.deadline(self.sampled.len()) + ACK_TIMEOUT;
        while !self.sent_all.load(Ordering::Acquire) || Monotonic.now() < end {
            for (index, socket) in self.sockets.iter().enumerate() {
                while self.take(index, socket, &mut batch, &mut received) == SLOTS {}
            }
            Monotonic.sleep_until(drains.next_after(Monotonic.now()));
        }
        received.time = thread_cpu_time();
        received
    }

    /// Reads what waits in one socket; gives how many there were.
    fn take(&self, index: usize, socket: &UdpSocket, batch: &mut Batch, received: &mut Received) -> usize {
        let Ok(count) = batch.receive(socket) else { return 0 };
        let (wall_ns, now) = (wall_now_ns(), Monotonic.now());
        for datagram in batch.datagrams() {
            let Ok(reply) = MotionReply::parse(datagram.bytes) else { continue };
            received.acked += 1;
            let tick = usize::try_from(reply.frame.0.saturating_sub(1)).expect("an index");
            if index == tick % self.sockets.len() {
                let age = Duration::from_nanos(wall_ns.saturating_sub(datagram.stamp_ns.unwrap_or(wall_ns)));
                let sent = MonoTime::from_nanos(self.sampled[tick].load(Ordering::Acquire));
                received.latency.saturating_record(nanos(now.before(age).since(sent)));
            }
        }
        count
    }
}
