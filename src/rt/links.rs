//! Seats on serial links: where the tick thread's poses go, the threads that make of them what drives are sent, and what these tell the
//! ack thread.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender as Tell};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rtrb::{Consumer, Producer};

use super::{FrameSink, Live};
use crate::config::drive::DriveFamily;
use crate::drive::LinkStream;
use crate::drive::link::{
    AxisFigures, LaneWants, LedPose, LinkFigures, LinkPort, LinkPose, RECORD_LEN, StreamEvent, StreamTerms,
    lane_number as number,
};
use crate::net::{Delivery, SendFault, Sender};
use crate::record::{Asked, Tap, TickHead};
use crate::state::State;
use crate::sys::serial::SerialError;
use crate::time::MonoTime;

/// After a port was gone it is tried again so much later.
const GONE: Duration = Duration::from_millis(100);
/// How often it is told how a link stands.
const TELL: Duration = Duration::from_millis(100);
/// How long a link may take to bring its seats to rest once the play is over.
const ENDS_WITHIN: Duration = Duration::from_secs(3);

/// A serial line, or what takes its place.
pub(crate) type Port = Box<dyn LinkPort + Send>;

/// Where the frames of all lanes go: datagrams to the sockets of those on the network, poses to the threads of links.
#[derive(Debug)]
pub struct Outlets {
    sender: Sender,
    /// Lanes below have a socket.
    stations: usize,
    poses: Vec<Producer<LedPose>>,
    led: Vec<LinkLane>,
    tap: Option<Tap>,
}

/// Where the poses of a lane go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinkLane {
    /// The ring.
    pub(crate) link: usize,
    /// The lane of that link.
    pub(crate) lane: u16,
    /// How long after the tick the seat is to be there.
    pub(crate) lead: Duration,
}

impl Outlets {
    /// The first `stations` lanes have sockets, those behind them are `led`.
    pub(crate) const fn new(
        sender: Sender,
        stations: usize,
        poses: Vec<Producer<LedPose>>,
        led: Vec<LinkLane>,
    ) -> Self {
        Self { sender, stations, poses, led, tap: None }
    }
}

impl Outlets {
    /// What asks those on the network beside their frames.
    pub(crate) const fn sender(&self) -> &Sender {
        &self.sender
    }

    /// Has whatever leaves copied to `tap`.
    pub(crate) fn record(&mut self, tap: Tap) {
        self.tap = Some(tap);
    }

    fn hand_over(&mut self, lane: usize, datagram: &[u8], at: MonoTime) -> Delivery {
        let Some(led) = lane.checked_sub(self.stations) else { return self.sender.send(lane, datagram) };
        let failed = Delivery::Failed(SendFault::of(libc::EAGAIN));
        let Some(LinkLane { link, lane, lead }) = self.led.get(led).copied() else { return failed };
        let record: Option<&[u8; RECORD_LEN]> = datagram.try_into().ok();
        let pose = record.map(|record| {
            let pose = LinkPose::parse(record);
            // As any frame, it is reached after its Time.
            LedPose { lane, at: at + Duration::from_millis(pose.lasts_ms.into()) + lead, pose }
        });
        let is_taken = pose.is_some_and(|pose| self.poses[link].push(pose).is_ok());
        if is_taken { Delivery::Sent } else { failed }
    }
}

impl FrameSink for Outlets {
    fn send(&mut self, lane: usize, datagram: &[u8], at: MonoTime) -> Delivery {
        let delivery = self.hand_over(lane, datagram, at);
        if let Some(tap) = &mut self.tap {
            tap.frame(lane, datagram, at, delivery);
        }
        delivery
    }

    fn send_to_all(&mut self, datagram: &[u8]) -> Delivery {
        self.sender.send_to_all(datagram)
    }

    fn went_along(&mut self, lane: usize, datagram: &[u8], at: MonoTime, delivery: Delivery) {
        if let Some(tap) = &mut self.tap {
            tap.frame(lane, datagram, at, delivery);
        }
    }

    fn asked(&mut self, asked: Asked) {
        if let Some(tap) = &mut self.tap {
            tap.asked(asked);
        }
    }

    fn tick_over(&mut self, head: &TickHead) {
        if let Some(tap) = &mut self.tap {
            tap.tick(head);
        }
    }
}

/// What a link tells the ack thread.
#[derive(Debug)]
pub(crate) struct LinkNews {
    /// What happened.
    pub(crate) events: Consumer<StreamEvent>,
    /// The controllers of its lanes.
    pub(crate) controllers: Vec<usize>,
}

impl LinkNews {
    /// What came since it was asked last, each with its controller.
    pub(super) fn take(&mut self) -> impl Iterator<Item = (usize, StreamEvent)> {
        let Self { events, controllers } = self;
        let controller = |event: &StreamEvent| controllers.get(usize::from(event.lane())).copied();
        std::iter::from_fn(|| events.pop().ok()).filter_map(move |event| Some((controller(&event)?, event)))
    }
}

/// What the control plane has the thread of a link do with its drives while their seats rest.
pub(crate) type Errand = Box<dyn FnOnce(&mut LinkStream<Port>) + Send>;

/// How a link stands.
#[derive(Debug, Clone, Default)]
pub(crate) struct LinkStanding {
    /// Its exchanges.
    pub(crate) figures: LinkFigures,
    /// Why its port cannot be had, with what to do; none where it is open.
    pub(crate) fault: Option<SerialError>,
    /// The axes of each of its lanes.
    pub(crate) lanes: Vec<Vec<AxisFigures>>,
}

/// The control plane's end of a link.
#[derive(Debug, Clone)]
pub(crate) struct LinkEnd {
    /// Its name.
    pub(crate) name: String,
    /// What its drives are.
    pub(crate) family: DriveFamily,
    /// How it plays.
    pub(crate) terms: StreamTerms,
    /// The controllers of its lanes.
    pub(crate) controllers: Vec<usize>,
    errands: Tell<Errand>,
    standing: Arc<Mutex<LinkStanding>>,
}

impl LinkEnd {
    /// One, and what its thread has of it.
    pub(crate) fn new(
        name: String,
        (family, terms): (DriveFamily, StreamTerms),
        controllers: Vec<usize>,
    ) -> (Self, LinkTold) {
        let (errands, asked) = std::sync::mpsc::channel();
        let standing = Arc::<Mutex<LinkStanding>>::default();
        let told = LinkTold { errands: asked, standing: Arc::clone(&standing) };
        (Self { name, family, terms, controllers, errands, standing }, told)
    }

    /// Has its thread do that once no lane moves. Where that thread is gone it is dropped.
    pub(crate) fn ask(&self, errand: Errand) {
        drop(self.errands.send(errand));
    }

    /// How it stood a tenth of a second ago at the most.
    pub(crate) fn standing(&self) -> LinkStanding {
        self.standing.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// What the thread of a link is asked, and where it tells how it stands.
#[derive(Debug)]
pub(crate) struct LinkTold {
    errands: Receiver<Errand>,
    standing: Arc<Mutex<LinkStanding>>,
}

/// The loop of a link's thread.
pub(crate) struct LinkLoop {
    stream: LinkStream<Port>,
    lanes: Vec<LaneOfLink>,
    live: Arc<Live>,
    /// The hall stops, or has: its seats were told to brake.
    stopped: bool,
    told: LinkTold,
    tell_at: MonoTime,
}

/// What was wanted of a lane, and done.
#[derive(Debug)]
struct LaneOfLink {
    wants: Arc<LaneWants>,
    located: u64,
    looks: u32,
}

impl fmt::Debug for LinkLoop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LinkLoop").field("lanes", &self.lanes).finish_non_exhaustive()
    }
}

impl LinkLoop {
    pub(crate) fn new(
        stream: LinkStream<Port>,
        wants: Vec<Arc<LaneWants>>,
        live: Arc<Live>,
        told: LinkTold,
    ) -> Self {
        let lane = |wants| LaneOfLink { wants, located: 0, looks: 0 };
        let lanes = wants.into_iter().map(lane).collect();
        let mut link = Self { stream, lanes, live, stopped: false, told, tell_at: MonoTime::default() };
        // Those that are home are made ready at once.
        (0..link.lanes.len()).for_each(|lane| link.stream.play().look(number(lane)));
        link
    }

    /// Does what is due next: one exchange with one drive at the most. A stop comes before all else.
    pub(crate) fn step(&mut self) {
        let stops = matches!(self.live.state(), State::Stopping | State::Stopped | State::Fault);
        let is_new = stops && !self.stopped;
        self.stopped = stops;
        // Where the port is gone there is nobody to be told; the drives brake by themselves.
        let told = if is_new { self.stream.play().stop() } else { Ok(()) };
        for (index, lane) in self.lanes.iter_mut().enumerate() {
            let (located, looks) = (lane.wants.located(), lane.wants.looks());
            if std::mem::replace(&mut lane.located, located) != located {
                self.stream.play().locate(number(index));
            }
            if std::mem::replace(&mut lane.looks, looks) != looks {
                self.stream.play().look(number(index));
            }
        }
        // Nothing moves, and nothing is about to.
        if !self.live.is_moving()
            && !self.stream.play().is_busy()
            && let Ok(errand) = self.told.errands.try_recv()
        {
            // Where the port is gone the errand tells.
            let _ = self.stream.play().settle();
            errand(&mut self.stream);
        }
        let is_gone = told.and_then(|()| self.stream.play().round()).is_err();
        let fault = if is_gone {
            let port = self.stream.port();
            port.mend(port.now() + GONE).err()
        } else {
            None
        };
        self.tell(fault);
    }

    /// Tells how it stands where it is time to.
    fn tell(&mut self, fault: Option<SerialError>) {
        let now = self.now();
        if now < self.tell_at {
            return;
        }
        // Whoever looks is an ordinary thread: it is never waited for.
        let Ok(mut standing) = self.told.standing.try_lock() else { return };
        self.tell_at = now + TELL;
        let Self { stream, lanes, .. } = self;
        standing.figures = stream.play().figures();
        standing.fault = fault;
        standing.lanes.resize_with(lanes.len(), Vec::new);
        for (lane, axes) in standing.lanes.iter_mut().enumerate() {
            axes.clear();
            axes.extend((0..).map_while(|axis| stream.play().axis(number(lane), axis)));
        }
    }

    /// The present instant of its port.
    pub(crate) fn now(&mut self) -> MonoTime {
        self.stream.port().now()
    }

    /// Runs until it is over and its seats rest.
    pub(crate) fn run(mut self, over: &AtomicBool) {
        let mut until = None;
        loop {
            self.step();
            if over.load(Ordering::Acquire) {
                let now = self.now();
                let until = *until.get_or_insert(now + ENDS_WITHIN);
                if !self.stream.play().is_busy() || now >= until {
                    // Where the port is gone nobody can be told.
                    let _ = self.stream.play().settle();
                    return;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::{SocketAddrV4, UdpSocket};

    use super::*;
    use crate::motion::{SeatType, Slot, Window};
    use crate::net::Ports;
    use crate::record::{Chunk, FrameKind, RecordedSeat, tap};
    use crate::time::{Rate, ShowTime};
    use crate::wire::VibrationPort;

    #[test]
    fn what_is_recorded_is_what_the_controller_received_octet_by_octet() {
        let peer = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address: SocketAddrV4 = peer.local_addr().unwrap().to_string().parse().unwrap();
        let (sender, _receiver) = Ports::open("127.0.0.1:0".parse().unwrap(), &[address]).unwrap().split();
        let window = Window::new(vec![Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0); 6]);
        let seat = RecordedSeat::new("A1", &window, FrameKind::Datagram(VibrationPort::Two));
        let (tap, mut ring) = tap(&[seat], Rate::from_hz(100.0));
        let mut outlets = Outlets::new(sender, 1, Vec::new(), Vec::new());
        outlets.record(tap);
        let (mut received, mut recorded) = (Vec::new(), Vec::new());
        for (tick, octets) in [[1_u8; 38].as_slice(), &[2; 50], &[3; 70]].into_iter().enumerate() {
            let (at, index) = (MonoTime::from_nanos(5), tick as u64);
            assert_eq!(outlets.send(0, octets, at), Delivery::Sent);
            let (film, state) = (ShowTime::ZERO, State::Parked);
            outlets.tick_over(&TickHead { index, deadline: at, late_ns: 0, missed: 0, film, state });
            let mut buf = [0; 100];
            let len = peer.recv(&mut buf).unwrap();
            received.push(buf[..len].to_vec());
        }
        let mut octets = vec![0; ring.slots()];
        ring.pop_entire_slice(&mut octets).unwrap();
        let mut rest = octets.as_slice();
        while let Some((chunk, behind)) = Chunk::parse(rest) {
            recorded.extend(chunk.frames().map(|frame| frame.datagram.to_vec()));
            rest = behind;
        }
        assert_eq!(recorded, received);
    }
}
