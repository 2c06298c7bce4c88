//! The thread of virtual controllers: waits for all their sockets, for their reports, for the script and for orders.

use std::collections::VecDeque;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender};
use std::time::Duration;

use rustix::buffer::spare_capacity;
use rustix::event::{EventfdFlags, Timespec, epoll, eventfd};

use super::log::Logs;
use super::outcome::Outcome;
use super::station::VirtualStation;
use super::{Command, CommandError};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// Sockets that one wait names at most.
const EVENTS: usize = 128;
/// Answers that wait for their time at most; what comes on top is not sent.
pub(super) const DELAYED: usize = 65_536;
/// Datagrams of a socket that are still taken when the end is asked for.
const BACKLOG: usize = 4_096;
/// Names the bell in place of a controller.
const BELL: u64 = u64::MAX;
const NEVER: MonoTime = MonoTime::from_nanos(u64::MAX);

/// What the thread is told from outside.
#[derive(Debug)]
pub(super) enum LoopOrder {
    /// Have this happen, and say what came of it.
    Do(Command, SyncSender<Result<(), CommandError>>),
    /// Take what has come, and end.
    Stop,
}

/// All that the thread owns.
#[derive(Debug)]
pub(super) struct EventLoop {
    pub(super) stations: Vec<VirtualStation>,
    pub(super) epoll: OwnedFd,
    /// Rings when there are orders.
    pub(super) bell: Arc<OwnedFd>,
    pub(super) orders: Receiver<LoopOrder>,
    /// What happens when, soonest first.
    pub(super) script: VecDeque<(MonoTime, Command)>,
    /// Answers for which there is still room to wait.
    pub(super) room: usize,
    pub(super) logs: Logs,
    /// When anything is due at the earliest, if nothing comes before.
    pub(super) due: MonoTime,
}

impl EventLoop {
    pub(super) fn run(mut self) -> io::Result<Vec<Outcome>> {
        let mut events = Vec::with_capacity(EVENTS);
        self.run_due(Monotonic.now());
        loop {
            let timeout = (self.due != NEVER).then(|| timespec(self.due.since(Monotonic.now())));
            match epoll::wait(&self.epoll, spare_capacity(&mut events), timeout.as_ref()) {
                Ok(_) | Err(rustix::io::Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
            for event in events.drain(..) {
                match event.data.u64() {
                    BELL if self.obey() => return self.end(),
                    BELL => {}
                    index => {
                        self.serve(usize::try_from(index).expect("made from a place in a Vec"));
                    }
                }
            }
            if self.due != NEVER {
                self.run_due(Monotonic.now());
            }
        }
    }

    /// Takes one datagram, if there is one; where more are there, the wait names the socket again.
    fn serve(&mut self, index: usize) -> bool {
        let station = &mut self.stations[index];
        let served = station.serve(|| Monotonic.now(), &mut self.logs, &mut self.room);
        self.due = self.due.min(station.due().unwrap_or(NEVER));
        served
    }

    /// Does what is due.
    fn run_due(&mut self, at: MonoTime) {
        if self.due > at {
            return;
        }
        while let Some((_, command)) = self.script.pop_front_if(|(due, _)| *due <= at) {
            self.carry_out(&command, at);
        }
        let mut due = self.script.front().map_or(NEVER, |(due, _)| *due);
        for station in &mut self.stations {
            station.run_due(at, &mut self.room);
            due = due.min(station.due().unwrap_or(NEVER));
        }
        self.due = due;
    }

    /// Obeys all orders that have come; says whether it is time to end.
    fn obey(&mut self) -> bool {
        let _ = rustix::io::read(&*self.bell, &mut [0; 8]); // empty where another ring was answered already
        while let Ok(order) = self.orders.try_recv() {
            let LoopOrder::Do(command, told) = order else { return true };
            let count = self.stations.len();
            let answer = match command.controller {
                Some(index) if index >= count => Err(CommandError::Controller { index, count }),
                _ => {
                    self.carry_out(&command, Monotonic.now());
                    Ok(())
                }
            };
            let _ = told.send(answer); // whoever asked may be gone
        }
        false
    }

    fn carry_out(&mut self, command: &Command, at: MonoTime) {
        for (index, station) in self.stations.iter_mut().enumerate() {
            if command.controller.is_none_or(|one| one == index) {
                station.act(&command.action, at);
                self.due = self.due.min(station.due().unwrap_or(NEVER));
            }
        }
    }

    fn end(mut self) -> io::Result<Vec<Outcome>> {
        for index in 0..self.stations.len() {
            let mut left = BACKLOG;
            while left > 0 && self.serve(index) {
                left -= 1;
            }
        }
        let at = Monotonic.now();
        let mut outcomes = Vec::with_capacity(self.stations.len());
        for station in &mut self.stations {
            outcomes.push(station.end(at, &mut self.logs));
        }
        self.logs.close().map(|()| outcomes)
    }
}

/// An epoll over all sockets and the bell.
pub(super) fn wait_for(stations: &[VirtualStation]) -> rustix::io::Result<(OwnedFd, OwnedFd)> {
    let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
    for (index, station) in (0..).zip(stations) {
        epoll::add(&epoll, &station.socket, epoll::EventData::new_u64(index), epoll::EventFlags::IN)?;
    }
    let bell = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?;
    epoll::add(&epoll, &bell, epoll::EventData::new_u64(BELL), epoll::EventFlags::IN)?;
    Ok((epoll, bell))
}

/// How long to wait, a millisecond up, since that is how fine the wait may be.
fn timespec(span: Duration) -> Timespec {
    let span = span + Duration::from_millis(1);
    let seconds = i64::try_from(span.as_secs()).unwrap_or(i64::MAX);
    Timespec { tv_sec: seconds, tv_nsec: i64::from(span.subsec_nanos()) }
}
