//! What crosses between the tick thread and the others: bounded, single-producer, never waited for.

use std::sync::Arc;
use std::thread::Thread;

use rtrb::{Consumer, Producer, RingBuffer};

use super::live::{Live, Phase};
use crate::engine::{Engine, Rate};
use crate::motion::Pose;
use crate::plan::{Course, Request, Scene};
use crate::time::{MonoTime, ShowTime};
use crate::wire::FrameNo;

/// Seconds of ticks that the mailboxes to the ack thread hold.
const HELD_S: f64 = 2.0;
/// Places in the mailboxes to and from the planner.
const PLANS: usize = 8;

/// What the tick thread says about one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sent {
    /// It is about to be sent.
    Posted {
        /// The controller.
        lane: u16,
        /// Its number.
        frame: FrameNo,
        /// Whether it asks for a reply.
        asked: bool,
        /// The instant before it is sent.
        at: MonoTime,
    },
    /// The kernel did not take it.
    Failed {
        /// The controller.
        lane: u16,
        /// Its number.
        frame: FrameNo,
    },
}

/// What the tick thread says about one tick that sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TickReport {
    /// The instant before its first send, minus its deadline, nanoseconds.
    pub late_ns: u64,
    /// Ticks slept through before it.
    pub missed: u64,
    /// Show time after it.
    pub show: ShowTime,
}

/// The planner's answer.
#[derive(Debug)]
pub enum Answer {
    /// The course that was asked for, and the scene that came with the request.
    Course(Box<Course>, Box<Scene>),
    /// There is none for the request of that serial.
    Refused(u32, Box<Scene>),
}

/// What the tick thread is told to do, once; what lasts stands on the [`super::Desk`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Order {
    /// Come to rest and hold; the film waits.
    Pause,
    /// Go on from a pause.
    Resume,
    /// Go on elsewhere in the film.
    Seek(ShowTime),
    /// Park, and end the play.
    Park,
    /// A controller is lost: its lane comes to rest, and after three hold frames nothing goes to it.
    Leave(u16),
    /// Nothing goes to that lane from now on.
    Cut(u16),
    /// A controller is there again, its seat at rest in that pose.
    ComeBack(u16, Pose),
}

/// The tick thread's ends.
#[derive(Debug)]
pub struct Mail {
    sent: Producer<Sent>,
    ticks: Producer<TickReport>,
    requests: Producer<Request>,
    answers: Consumer<Answer>,
    retired: Producer<Box<Course>>,
    orders: Consumer<Order>,
    planner: Option<Thread>,
    live: Arc<Live>,
    unposted: u64,
}

/// The other threads' ends.
#[derive(Debug)]
pub struct MailEnds {
    /// To the ack thread: frames.
    pub sent: Consumer<Sent>,
    /// To the ack thread: ticks.
    pub ticks: Consumer<TickReport>,
    /// To the planner: requests.
    pub requests: Consumer<Request>,
    /// From the planner: answers.
    pub answers: Producer<Answer>,
    /// To the planner: courses to free.
    pub retired: Consumer<Box<Course>>,
    /// From whoever leads the show: orders.
    pub orders: Producer<Order>,
}

/// Mailboxes for a play of that many lanes.
#[must_use]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 2,000 ticks")]
pub fn mailboxes(lanes: usize, rate: Rate, live: Arc<Live>) -> (Mail, MailEnds) {
    let held = (HELD_S * rate.hz()).ceil() as usize;
    // Each frame may be followed by word of its failure.
    let (sent, sent_end) = RingBuffer::new((2 * lanes * held).max(1024));
    let (reports, reports_end) = RingBuffer::new(held.max(64));
    let (requests, requests_end) = RingBuffer::new(PLANS);
    let (answers_end, answers) = RingBuffer::new(PLANS);
    let (retired, retired_end) = RingBuffer::new(PLANS);
    // One for each lane at once, and some more.
    let (orders_end, orders) = RingBuffer::new(lanes + PLANS);
    let (ticks, planner, unposted) = (reports, None, 0);
    let mail = Mail { sent, ticks, requests, answers, retired, orders, planner, live, unposted };
    let ends = MailEnds {
        sent: sent_end,
        ticks: reports_end,
        requests: requests_end,
        answers: answers_end,
        retired: retired_end,
        orders: orders_end,
    };
    (mail, ends)
}

impl Mail {
    /// Names the planner's thread, which is woken when there is something for it.
    pub fn wakes(&mut self, planner: Thread) {
        self.planner = Some(planner);
    }

    /// Records that found no room so far.
    #[must_use]
    pub const fn unposted(&self) -> u64 {
        self.unposted
    }

    pub(super) fn post(&mut self, sent: Sent) {
        self.unposted += u64::from(self.sent.push(sent).is_err());
    }

    pub(super) fn report(&mut self, report: TickReport) {
        self.live.on_tick(&report);
        self.unposted += u64::from(self.ticks.push(report).is_err());
    }

    pub(super) fn answer(&mut self) -> Option<Answer> {
        self.answers.pop().ok()
    }

    /// Shows how far the play is.
    pub(super) fn look(&self, engine: &Engine) {
        self.live.enter(Phase::of(engine));
    }

    pub(super) fn order(&mut self) -> Option<Order> {
        self.orders.pop().ok()
    }

    pub(super) fn ask(&mut self, request: Request) {
        self.unposted += u64::from(self.requests.push(request).is_err());
        self.wake();
    }

    pub(super) fn retire(&mut self, course: Box<Course>) {
        // As many places as courses that can be under way: there is room.
        self.unposted += u64::from(self.retired.push(course).is_err());
        self.wake();
    }

    /// One system call where the planner sleeps, none where it works; it never waits.
    fn wake(&self) {
        if let Some(planner) = &self.planner {
            planner.unpark();
        }
    }
}
