//! The way to ask controllers for registers while a hall lives: the control plane sends over the frame port, and the ack
//! thread hands it the answers, which it reads anyway.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};

use crate::net::{Delivery, SendFault, Sender};
use crate::time::MonoTime;
use crate::wire::MAX_LEN;

/// Answers that wait at the most; the rest is asked for again.
const ANSWERS: usize = 1024;

/// What both ends share.
#[derive(Debug)]
struct LineEnds {
    open: AtomicBool,
    /// Nobody else is to ask the controllers anything.
    hushed: AtomicBool,
    /// Datagrams sent by the line, and how often its port was found closed; by controller.
    sent: Box<[AtomicU64]>,
    closed: Box<[AtomicU64]>,
}

/// A datagram of a controller.
#[derive(Debug)]
struct Answer {
    controller: u16,
    at: MonoTime,
    length: u16,
    octets: [u8; MAX_LEN],
}

/// The control plane's end.
#[derive(Debug)]
pub struct Line {
    sender: Sender,
    answers: Consumer<Answer>,
    shared: Arc<LineEnds>,
}

/// The ack thread's end.
#[derive(Debug)]
pub(crate) struct LineEnd {
    answers: Producer<Answer>,
    shared: Arc<LineEnds>,
    /// What of the line's datagrams was counted already.
    counted: Box<[u64]>,
}

/// A line to that many controllers; it takes nothing before it is opened.
#[must_use]
pub(crate) fn line(sender: Sender, controllers: usize) -> (Line, LineEnd) {
    let zeros = || (0..controllers).map(|_| AtomicU64::new(0)).collect();
    let shared = Arc::new(LineEnds {
        open: AtomicBool::new(false),
        hushed: AtomicBool::new(false),
        sent: zeros(),
        closed: zeros(),
    });
    let (producer, answers) = RingBuffer::new(ANSWERS);
    let end =
        LineEnd { answers: producer, shared: Arc::clone(&shared), counted: vec![0; controllers].into() };
    (Line { sender, answers, shared }, end)
}

impl Line {
    /// Has answers come in, or stops it; what is left of an earlier conversation is dropped.
    pub fn open(&mut self, open: bool) {
        while self.answers.pop().is_ok() {}
        self.shared.open.store(open, Ordering::Release);
    }

    /// Has the ack thread ask nothing by itself while nothing moves, or lets it.
    pub(crate) fn hush(&self, hushed: bool) {
        self.shared.hushed.store(hushed, Ordering::Release);
    }

    /// Sends a datagram to a controller, counted from 0.
    ///
    /// # Errors
    /// Why the kernel did not take it.
    pub fn send(&self, lane: usize, datagram: &[u8]) -> Result<(), SendFault> {
        // Counted first: the packet counter that the answer tells has grown by it.
        self.shared.sent[lane].fetch_add(1, Ordering::AcqRel);
        match self.sender.send(lane, datagram) {
            Delivery::Sent | Delivery::SentAfterRefusal => Ok(()),
            Delivery::Failed(fault) => Err(fault),
        }
    }

    /// Gives all that came since this was asked last: from which controller, what, and when.
    pub(crate) fn drain(&mut self, on: &mut dyn FnMut(usize, &[u8], MonoTime)) {
        while let Ok(answer) = self.answers.pop() {
            let octets = &answer.octets[..usize::from(answer.length)];
            on(usize::from(answer.controller), octets, answer.at);
        }
    }

    /// How often a controller's port was found closed so far.
    #[must_use]
    pub(crate) fn port_closed(&self, lane: usize) -> u64 {
        self.shared.closed[lane].load(Ordering::Relaxed)
    }
}

impl LineEnd {
    /// Hands a datagram over, where somebody waits for one; says whether somebody does.
    pub(super) fn hear(&mut self, controller: usize, octets: &[u8], at: MonoTime) -> bool {
        if !self.shared.open.load(Ordering::Acquire) || octets.len() > MAX_LEN {
            return false;
        }
        let mut answer = Answer {
            controller: u16::try_from(controller).expect("fewer controllers than ports"),
            at,
            length: u16::try_from(octets.len()).expect("a message is shorter than 65,536 octets"),
            octets: [0; MAX_LEN],
        };
        answer.octets[..octets.len()].copy_from_slice(octets);
        drop(self.answers.push(answer)); // what finds no room is asked for again
        true
    }

    /// Whether a conversation is under way.
    pub(super) fn is_open(&self) -> bool {
        self.shared.open.load(Ordering::Acquire)
    }

    /// Whether nobody else is to ask.
    pub(super) fn is_hushed(&self) -> bool {
        self.shared.hushed.load(Ordering::Acquire)
    }

    /// Notes how often a controller's port was found closed so far.
    pub(super) fn on_closed(&self, controller: usize, times: u64) {
        self.shared.closed[controller].store(times, Ordering::Relaxed);
    }

    /// Datagrams that the line has sent to a controller since this was asked last.
    pub(super) fn take_sent(&mut self, controller: usize) -> u64 {
        let sent = self.shared.sent[controller].load(Ordering::Acquire);
        sent - std::mem::replace(&mut self.counted[controller], sent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::Ports;

    #[test]
    fn the_longest_answer_is_handed_over_whole() {
        let to = "127.0.0.1:9".parse().unwrap();
        let (sender, _) = Ports::open("127.0.0.1:0".parse().unwrap(), &[to]).unwrap().split();
        let (mut line, mut end) = line(sender, 1);
        line.open(true);
        let octets: Vec<u8> = (0..=u8::MAX).cycle().take(MAX_LEN).collect();
        assert!(end.hear(0, &octets, MonoTime::default()));
        let mut heard = Vec::new();
        line.drain(&mut |_, octets, _| heard.push(octets.to_vec()));
        assert_eq!(heard, [octets]);
    }
}
