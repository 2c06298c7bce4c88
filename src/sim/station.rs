//! A virtual controller, its socket, and the network between it and the host.

use std::collections::VecDeque;
use std::io;
use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::time::Duration;

use super::link::{DatagramFate, FaultyLink};
use super::log::Logs;
use super::outcome::Outcome;
use super::{Action, Controller, Counts, Options, Setup};
use crate::time::MonoTime;
use crate::wire::MAX_LEN;

/// Longer datagrams are cut; no message is that long.
const MAX_DATAGRAM: usize = 2048;
/// What sets the chances of reports apart from those of answers.
const REPORTS: usize = 1 << 20;

/// A controller at its address.
#[derive(Debug)]
pub(super) struct VirtualStation {
    pub(super) address: SocketAddrV4,
    pub(super) socket: UdpSocket,
    controller: Controller,
    link: FaultyLink,
    report_link: FaultyLink,
    delay: Duration,
    /// What waits for its time, soonest first.
    delayed: VecDeque<Parcel>,
    /// What the socket and the link add to the controller's own counts.
    extra: Counts,
}

/// A datagram that leaves later.
#[derive(Debug)]
struct Parcel {
    due: MonoTime,
    to: SocketAddrV4,
    copies: u8,
    len: usize,
    bytes: [u8; MAX_LEN],
}

impl VirtualStation {
    /// A controller that listens on `socket`, the `index`th of its farm.
    pub(super) fn new(
        options: &Options,
        index: usize,
        setup: &Setup,
        (socket, address): (UdpSocket, SocketAddrV4),
        start: MonoTime,
    ) -> Self {
        let mut controller = Controller::new(setup, address, start);
        if options.moves.is_some() {
            controller.keep_record();
        }
        Self {
            address,
            socket,
            controller,
            link: FaultyLink::new(&options.faults, options.seed, index),
            report_link: FaultyLink::new(&options.faults, options.seed, REPORTS + index),
            delay: options.faults.delay,
            delayed: VecDeque::new(),
            extra: Counts::default(),
        }
    }

    /// When it does something unasked next.
    pub(super) fn due(&self) -> Option<MonoTime> {
        let parcel = self.delayed.front().map(|parcel| parcel.due);
        match (parcel, self.controller.report_due()) {
            (Some(parcel), Some(report)) => Some(parcel.min(report)),
            (parcel, report) => parcel.or(report),
        }
    }

    /// Takes one datagram, if there is one. `now` is asked once it is there; `room` is for parcels of all stations.
    pub(super) fn serve(
        &mut self,
        now: impl FnOnce() -> MonoTime,
        logs: &mut Logs,
        room: &mut usize,
    ) -> bool {
        let mut datagram = [0; MAX_DATAGRAM];
        let Ok((len, SocketAddr::V4(from))) = self.socket.recv_from(&mut datagram) else { return false };
        let at = now();
        let fate = self.link.fate();
        if fate == DatagramFate::LostOnTheWay {
            self.extra.received += 1;
            self.extra.lost_frames += 1;
            return true;
        }
        let mut buf = [0; MAX_LEN];
        let handled = self.controller.on_datagram(from, &datagram[..len], at, &mut buf);
        let answer = handled.reply.map(<[u8]>::len);
        if let (true, Some(seen)) = (logs.want_frames(), &handled.motion) {
            let executed = self.controller.shaken_positions(at);
            logs.frame(at, self.address, seen, answer.is_some(), &executed);
        }
        self.log_moves(logs);
        if let Some(len) = answer {
            self.post(fate, from, &buf[..len], at, room);
        }
        true
    }

    /// Sends what is due: parcels, then reports.
    pub(super) fn run_due(&mut self, at: MonoTime, room: &mut usize) {
        while let Some(parcel) = self.delayed.pop_front_if(|parcel| parcel.due <= at) {
            *room += 1;
            self.send(parcel.to, parcel.copies, &parcel.bytes[..parcel.len]);
        }
        let mut buf = [0; MAX_LEN];
        if let Some((to, bytes)) = self.controller.report(at, &mut buf) {
            let len = bytes.len();
            let fate = self.report_link.fate();
            self.post(fate, to, &buf[..len], at, room);
        }
    }

    /// Has something happen to the controller or the network.
    pub(super) fn act(&mut self, action: &Action, at: MonoTime) {
        match *action {
            Action::Loss(chance) => {
                self.link.set_loss(chance);
                self.report_link.set_loss(chance);
            }
            Action::Duplicate(chance) => {
                self.link.set_duplicate(chance);
                self.report_link.set_duplicate(chance);
            }
            Action::Delay(delay) => self.delay = delay,
            _ => self.controller.act(action, at),
        }
    }

    /// Sends a datagram, now or when it is due, unless the link loses it. Parcels never overtake each other.
    fn post(&mut self, fate: DatagramFate, to: SocketAddrV4, bytes: &[u8], at: MonoTime, room: &mut usize) {
        let copies = match fate {
            DatagramFate::LostOnTheWay | DatagramFate::AnswerLost => {
                self.extra.lost_replies += 1;
                return;
            }
            DatagramFate::Answered => 1,
            DatagramFate::AnsweredTwice => {
                self.extra.duplicated += 1;
                2
            }
        };
        if self.delay.is_zero() && self.delayed.is_empty() {
            return self.send(to, copies, bytes);
        }
        if *room == 0 {
            self.extra.send_failed += 1;
            return;
        }
        *room -= 1;
        let before = self.delayed.back().map_or(at, |last| last.due);
        let mut parcel =
            Parcel { due: before.max(at + self.delay), to, copies, len: bytes.len(), bytes: [0; MAX_LEN] };
        parcel.bytes[..bytes.len()].copy_from_slice(bytes);
        self.delayed.push_back(parcel);
    }

    fn send(&mut self, to: SocketAddrV4, copies: u8, bytes: &[u8]) {
        for _ in 0..copies {
            self.extra.send_failed += u64::from(self.socket.send_to(bytes, to).is_err());
        }
    }

    /// What became of it, `since` the start.
    pub(super) fn end(&mut self, at: MonoTime, logs: &mut Logs) -> Outcome {
        let positions = self.controller.positions(at);
        self.controller.close_record(at);
        self.log_moves(logs);
        let positions = positions.iter().map(|position| position.0).collect();
        let (outputs, extend) = (self.controller.outputs(), self.controller.extend());
        let end = Outcome { address: self.address, counts: self.counts(), positions, outputs, extend };
        logs.rest(at, &end);
        end
    }

    fn log_moves(&mut self, logs: &mut Logs) {
        let (address, axes) = (self.address, self.controller.axes());
        self.controller.take_record().for_each(|executed| logs.executed(address, axes, &executed));
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

/// A socket at `wanted`, and where it is.
pub(super) fn listen(wanted: SocketAddrV4) -> io::Result<(UdpSocket, SocketAddrV4)> {
    let socket = UdpSocket::bind(wanted)?;
    socket.set_nonblocking(true)?;
    match socket.local_addr()? {
        SocketAddr::V4(address) => Ok((socket, address)),
        SocketAddr::V6(_) => Ok((socket, wanted)),
    }
}
