//! Seats on serial links: where the tick thread's poses go, the threads that make of them what drives are sent, and what these tell the
//! ack thread.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rtrb::{Consumer, Producer};

use super::{FrameSink, Live};
use crate::drive::link::{
    LaneWants, LedPose, LinkPort, LinkPose, RECORD_LEN, StreamEvent, lane_number as number,
};
use crate::drive::silvermax::Stream;
use crate::net::{Delivery, SendFault, Sender};
use crate::state::State;
use crate::time::MonoTime;

/// After a port was gone it is tried again so much later.
const GONE: Duration = Duration::from_millis(100);
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
        Self { sender, stations, poses, led }
    }
}

impl Outlets {
    /// What asks those on the network beside their frames.
    pub(crate) const fn sender(&self) -> &Sender {
        &self.sender
    }
}

impl FrameSink for Outlets {
    fn send(&mut self, lane: usize, datagram: &[u8], at: MonoTime) -> Delivery {
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

/// The loop of a link's thread.
pub(crate) struct LinkLoop {
    stream: Stream<Port>,
    lanes: Vec<LaneOfLink>,
    live: Arc<Live>,
    /// The hall stops, or has: its seats were told to brake.
    stopped: bool,
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
    pub(crate) fn new(stream: Stream<Port>, wants: Vec<Arc<LaneWants>>, live: Arc<Live>) -> Self {
        let lane = |wants| LaneOfLink { wants, located: 0, looks: 0 };
        let mut link = Self { stream, lanes: wants.into_iter().map(lane).collect(), live, stopped: false };
        // Those that are home are made ready at once.
        (0..link.lanes.len()).for_each(|lane| link.stream.look(number(lane)));
        link
    }

    /// Does what is due next: one exchange with one drive at the most. A stop comes before all else.
    pub(crate) fn step(&mut self) {
        let stops = matches!(self.live.state(), State::Stopping | State::Stopped | State::Fault);
        let is_new = stops && !self.stopped;
        self.stopped = stops;
        // Where the port is gone there is nobody to be told; the drives brake by themselves.
        let told = if is_new { self.stream.stop(None) } else { Ok(()) };
        for (index, lane) in self.lanes.iter_mut().enumerate() {
            let (located, looks) = (lane.wants.located(), lane.wants.looks());
            if std::mem::replace(&mut lane.located, located) != located {
                self.stream.locate(number(index));
            }
            if std::mem::replace(&mut lane.looks, looks) != looks {
                self.stream.look(number(index));
            }
        }
        if told.and_then(|()| self.stream.round()).is_err() {
            let port = self.stream.port();
            port.sleep_until(port.now() + GONE);
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
                if !self.stream.is_busy() || now >= until {
                    return;
                }
            }
        }
    }
}
