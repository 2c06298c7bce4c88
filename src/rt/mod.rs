//! The tick loop, and the mailboxes that lead to it and away from it.
//!
//! The loop never allocates, locks, logs, formats or waits for anything but its deadline. Whatever can fail or grow
//! happened before it or happens on another thread; values cross in bounded single-producer mailboxes.

mod acks;
mod live;
mod mail;
mod planning;
mod spin;

pub use acks::{Accounts, AckLoop};
pub use live::{Live, Phase, Times};
pub use mail::{Answer, Mail, MailEnds, Sent, TickReport, mailboxes};
pub use planning::PlanLoop;
pub use spin::{Spinning, Spun};

use std::sync::atomic::{AtomicBool, Ordering};

use crate::engine::{Beat, Ending, Engine, Tick, TickGrid};
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
    /// Read every tick: somebody wants the show to stop.
    pub stop: &'a AtomicBool,
}

impl<C: Clock, S: FrameSink> TickLoop<'_, C, S> {
    /// Runs until the play has ended.
    pub fn run(&mut self) -> Ended {
        let (mut ticks, mut missed) = (0, 0);
        loop {
            self.clock.sleep_until(self.grid.next_deadline());
            let tick = self.grid.take(self.clock.now());
            self.take_mail();
            let Some(beat) = self.engine.tick(tick.missed) else { break };
            missed += tick.missed;
            ticks += 1;
            self.send(tick, &beat);
            self.hand_on();
        }
        let ending = self.engine.ending().unwrap_or(Ending::Fault);
        Ended { ticks, missed, unposted: self.mail.unposted(), ending }
    }

    /// Bounded: the planner answers one request at a time.
    fn take_mail(&mut self) {
        if self.stop.load(Ordering::Relaxed) {
            self.engine.stop();
        }
        while let Some(answer) = self.mail.answer() {
            match answer {
                Answer::Course(course) => self.engine.offer(course),
                Answer::Refused(serial) => self.engine.refuse(serial),
            }
        }
    }

    fn send(&mut self, tick: Tick, beat: &Beat) {
        let mut buf = [0; MAX_LEN];
        let mut first = None;
        for (index, (lane, pose)) in self.lanes.iter_mut().zip(self.engine.poses()).enumerate() {
            let (stamped, datagram) = lane.encode(beat, pose, &mut buf);
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
        self.mail.report(report, Phase::of(&self.engine));
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
