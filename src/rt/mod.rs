//! The tick loop, and the mailboxes that lead to it and away from it.
//!
//! The loop never allocates, locks, logs, formats or waits for anything but its deadline. Whatever can fail or grow
//! happened before it or happens on another thread; values cross in bounded single-producer mailboxes.

mod acks;
mod desk;
mod live;
mod mail;
mod planning;
mod spin;

pub use acks::{Accounts, AckLoop};
pub use desk::Desk;
pub use live::{Live, Phase};
pub use mail::{Answer, Mail, MailEnds, Order, Sent, TickReport, mailboxes};
pub use planning::PlanLoop;
pub use spin::Spinning;

use std::sync::atomic::{AtomicBool, Ordering};

use crate::engine::{Beat, Ending, Engine, Step, Tick, TickGrid};
use crate::fanout::Lane;
use crate::net::{Delivery, Sender};
use crate::time::{Clock, nanos};
use crate::wire::MAX_LEN;

/// Where the frames of a tick go.
pub trait FrameSink {
    /// Hands one lane's datagram to the kernel; never blocks.
    fn send(&mut self, lane: usize, datagram: &[u8]) -> Delivery;
}

impl FrameSink for Sender {
    fn send(&mut self, lane: usize, datagram: &[u8]) -> Delivery {
        Sender::send(self, lane, datagram)
    }
}

/// Orders obeyed in one tick; more wait for the next.
const ORDERS_PER_TICK: usize = 8;

/// What the loop did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ended {
    /// Ticks that sent.
    pub ticks: u64,
    /// Ticks slept through.
    pub missed: u64,
    /// Records that found no room in a mailbox.
    pub unposted: u64,
    /// How the play ended.
    pub ending: Ending,
}

/// The tick loop of one play: everything it touches, made before it starts.
pub struct TickLoop<'a, C, S> {
    /// The clock that its deadlines are on.
    pub clock: &'a C,
    /// Its deadlines.
    pub grid: TickGrid,
    /// What the lanes do.
    pub engine: Engine,
    /// The lanes, in the order of the sink's.
    pub lanes: Vec<Lane>,
    /// Where frames go.
    pub sink: S,
    /// Its ends of the mailboxes.
    pub mail: Mail,
    /// What operators set, and the stop; read every tick.
    pub desk: &'a Desk,
    /// Read every tick: somebody wants the seats parked and the play to end.
    pub leave: &'a AtomicBool,
}

impl<C: Clock, S: FrameSink> TickLoop<'_, C, S> {
    /// Runs until the play has ended.
    pub fn run(&mut self) -> Ended {
        let (mut ticks, mut missed) = (0, 0);
        loop {
            self.clock.sleep_until(self.grid.next_deadline());
            let tick = self.grid.take(self.clock.now());
            self.take_mail();
            match self.engine.tick(tick.missed) {
                Step::Send(beat) => {
                    missed += tick.missed;
                    ticks += 1;
                    self.send(tick, &beat);
                }
                Step::Quiet => self.mail.look(&self.engine),
                Step::Over => break,
            }
            self.hand_on();
        }
        let ending = self.engine.ending().unwrap_or(Ending::Fault);
        Ended { ticks, missed, unposted: self.mail.unposted(), ending }
    }

    /// Bounded: so many orders a tick, and the planner answers one request at a time. The stop waits for none of them.
    fn take_mail(&mut self) {
        for lane in 0..self.lanes.len() {
            self.engine.mix(lane, self.desk.mix(lane));
        }
        self.engine.trim(self.desk.trim_ms());
        for _ in 0..ORDERS_PER_TICK {
            let Some(order) = self.mail.order() else { break };
            self.obey(order);
        }
        if self.leave.load(Ordering::Relaxed) {
            self.engine.leave_now();
        }
        if self.desk.take_stop() {
            self.engine.stop();
        }
        while let Some(answer) = self.mail.answer() {
            match answer {
                Answer::Course(course, scene) => self.engine.offer(course, scene),
                Answer::Refused(serial, scene) => self.engine.refuse(serial, scene),
            }
        }
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::Pause => self.engine.pause(),
            Order::Resume => self.engine.resume(),
            Order::Seek(film) => self.engine.seek(film),
            Order::Park => self.engine.park(),
            Order::Leave(lane) => self.engine.leave(usize::from(lane)),
            Order::Cut(lane) => self.engine.cut(usize::from(lane)),
            Order::ComeBack(lane, pose) => self.engine.come_back(usize::from(lane), pose),
        }
    }

    fn send(&mut self, tick: Tick, beat: &Beat) {
        let mut buf = [0; MAX_LEN];
        let mut first = None;
        for (index, lane) in self.lanes.iter_mut().enumerate() {
            let Some((pose, mix)) = self.engine.frame(index) else { continue };
            let (stamped, datagram) = lane.encode(beat, pose, mix, &mut buf);
            let at = self.clock.now();
            first.get_or_insert(at);
            let of = u16::try_from(index).expect("fewer controllers than ports");
            // Posted before it is sent: a reply can overtake what is posted after.
            self.mail.post(Sent::Posted { lane: of, frame: stamped.frame, asked: stamped.asked, at });
            if let Delivery::Failed(_) = self.sink.send(index, datagram) {
                self.mail.post(Sent::Failed { lane: of, frame: stamped.frame });
            }
        }
        let late_ns = nanos(first.unwrap_or(tick.deadline).since(tick.deadline));
        let report = TickReport { late_ns, missed: tick.missed, show: self.engine.playhead() };
        self.mail.report(report);
        self.mail.look(&self.engine);
    }

    fn hand_on(&mut self) {
        if let Some(request) = self.engine.take_request() {
            self.mail.ask(request);
        }
        while let Some(course) = self.engine.take_retired() {
            self.mail.retire(course);
        }
    }
}
