//! The port at work: one task that reads datagrams, asks the hall without waiting for it, and sends feedback.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::io;
use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use rosc::{OscMessage, OscPacket, encoder};
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval};

use super::counts::{Count, Counts};
use super::feedback::warn;
use super::order::{OscFault, OscOrder, order};
use super::packet::{self, Timed};
use super::repeats::Repeats;
use super::subscribers::Subscribers;
use crate::config::OscPort;
use crate::control::{Command, Handle, LevelsChange, Problem, Role, Severity, Surface, Who};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::time::{Clock as _, MonoTime};

/// How often feedback is sent.
const FEEDBACK: Duration = Duration::from_millis(100);
/// Asks under way at the most, so that other surfaces find room in the hall's queue.
const MOST_ASKED: usize = 16;
/// Refusals told at the most in one round of feedback; the others are counted alone.
const MOST_TOLD: usize = 4;
/// Effects and rows that a change of levels names at the most.
const MOST_NAMED: usize = 64;

/// What became of something asked.
struct OscOutcome {
    from: SocketAddrV4,
    was_levels: bool,
    problem: Option<Problem>,
}

/// The port and what it remembers.
pub(super) struct OscPortState {
    /// For what is sent, which never waits.
    out: UdpSocket,
    config: OscPort,
    hall: Handle,
    counts: Arc<Counts>,
    repeats: Repeats,
    subscribers: Subscribers,
    asked: JoinSet<OscOutcome>,
    /// Levels are asked for one change at a time; faders that move meanwhile add up here.
    levels: LevelsChange,
    levels_asked: bool,
    /// Refusals told since the last round of feedback.
    told: usize,
}

impl OscPortState {
    pub(super) fn new(out: UdpSocket, config: OscPort, hall: Handle, counts: Arc<Counts>) -> Self {
        Self {
            out,
            config,
            hall,
            counts,
            repeats: Repeats::default(),
            subscribers: Subscribers::default(),
            asked: JoinSet::new(),
            levels: LevelsChange::default(),
            levels_asked: false,
            told: 0,
        }
    }

    pub(super) async fn serve(mut self, incoming: &tokio::net::UdpSocket) -> io::Result<Infallible> {
        let mut feedback = interval(FEEDBACK);
        feedback.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut bytes = [0; packet::MOST];
        loop {
            tokio::select! {
                received = incoming.recv_from(&mut bytes) => {
                    let (len, from) = received?;
                    self.take(&bytes[..len], from, Monotonic.now());
                }
                Some(outcome) = self.asked.join_next() => {
                    self.answered(&outcome.expect("what is asked neither panics nor is it given up"));
                }
                _ = feedback.tick() => self.feed(Monotonic.now()),
            }
        }
    }

    fn take(&mut self, datagram: &[u8], from: SocketAddr, now: MonoTime) {
        self.counts.add(Count::Received);
        let SocketAddr::V4(from) = from else { return self.counts.add(Count::Foreign) };
        if !self.config.sources.contains(from.ip()) {
            return self.counts.add(Count::Foreign);
        }
        let Some(messages) = packet::read(datagram, wall_now_ns()) else {
            return self.counts.add(Count::Malformed);
        };
        for timed in messages {
            if let Err(fault) = self.dispatch(&timed, from, now) {
                self.refuse(&fault, from);
            }
        }
    }

    fn dispatch(&mut self, timed: &Timed, from: SocketAddrV4, now: MonoTime) -> Result<(), OscFault> {
        let Timed { message, early } = timed;
        match order(message, &self.config.allow)? {
            OscOrder::Released => Ok(()),
            OscOrder::Subscribe { port, seconds } => {
                self.subscribers.subscribe(SocketAddrV4::new(*from.ip(), port), seconds, now)
            }
            // A stop waits for nothing, least of all for a clock that goes wrong.
            OscOrder::Command(ask) if *early && ask != Command::Stop => {
                Err(OscFault::Early(message.addr.clone()))
            }
            OscOrder::Command(ask) if self.repeats.is_repeat(&ask, now) => {
                self.counts.add(Count::Repeated);
                Ok(())
            }
            OscOrder::Command(Command::Levels(change)) => self.coalesce(change, from, &message.addr),
            OscOrder::Command(ask) => self.ask(ask, from, &message.addr),
        }
    }

    /// Asks the hall, in the order of the messages, without waiting for its answer.
    fn ask(&mut self, ask: Command, from: SocketAddrV4, address: &str) -> Result<(), OscFault> {
        let is_stop = ask == Command::Stop;
        if is_stop {
            self.hall.stop();
        }
        if self.asked.len() >= MOST_ASKED {
            // A stop is done by now; what would follow is its line in the journal.
            return if is_stop { Ok(()) } else { Err(OscFault::Busy(address.to_owned())) };
        }
        let was_levels = matches!(ask, Command::Levels(_));
        let who = Who { role: Role::Operate, surface: Surface::Osc, name: from.ip().to_string() };
        let posted = self.hall.post(who, ask);
        self.asked.spawn(async move {
            let answer = match posted {
                Ok(posted) => posted.answer().await,
                Err(problem) => Err(problem),
            };
            OscOutcome { from, was_levels, problem: answer.err() }
        });
        self.levels_asked |= was_levels;
        Ok(())
    }

    /// Changes levels, at once or as soon as the change before is through.
    fn coalesce(&mut self, change: LevelsChange, from: SocketAddrV4, address: &str) -> Result<(), OscFault> {
        if self.levels.effects.len() + self.levels.rows.len() >= MOST_NAMED {
            return Err(OscFault::Busy(address.to_owned()));
        }
        merge(&mut self.levels, change);
        if self.levels_asked { Ok(()) } else { self.ask_levels(from, address) }
    }

    fn ask_levels(&mut self, from: SocketAddrV4, address: &str) -> Result<(), OscFault> {
        let change = std::mem::take(&mut self.levels);
        if change == LevelsChange::default() {
            Ok(())
        } else {
            self.ask(Command::Levels(change), from, address)
        }
    }

    fn answered(&mut self, outcome: &OscOutcome) {
        let OscOutcome { from, was_levels, problem } = outcome;
        match problem {
            None => self.counts.add(Count::Done),
            Some(problem) => {
                self.counts.add(Count::NotDone);
                self.tell(&problem.to_string(), *from);
            }
        }
        if *was_levels {
            self.levels_asked = false;
            if let Err(fault) = self.ask_levels(*from, "/kinocue/level") {
                self.refuse(&fault, *from);
            }
        }
    }

    fn refuse(&mut self, fault: &OscFault, from: SocketAddrV4) {
        self.counts.add(match fault {
            OscFault::Forbidden(_) => Count::Forbidden,
            OscFault::Early(_) => Count::Early,
            _ => Count::Refused,
        });
        self.tell(&fault.to_string(), from);
    }

    /// Tells a sender what is wrong: where it has feedback sent to, or where it sends from.
    fn tell(&mut self, text: &str, from: SocketAddrV4) {
        if self.told == MOST_TOLD {
            return;
        }
        self.told += 1;
        let mut to = self.subscribers.of(*from.ip());
        if to.is_empty() {
            to.push(from);
        }
        let warning = warn(Severity::Error, text);
        to.into_iter().for_each(|to| send(&self.out, &self.counts, &warning, to));
    }

    fn feed(&mut self, now: MonoTime) {
        self.told = 0;
        let status = self.hall.status();
        for subscriber in self.subscribers.present(now) {
            for message in subscriber.said.news(&status) {
                send(&self.out, &self.counts, &message, subscriber.to);
            }
        }
    }
}

/// Sends a message where the system takes it now; what comes late is worth nothing.
fn send(out: &UdpSocket, counts: &Counts, message: &OscMessage, to: SocketAddrV4) {
    let bytes = encoder::encode(&OscPacket::Message(message.clone()));
    if bytes.is_ok_and(|bytes| out.send_to(&bytes, to).is_ok()) {
        return;
    }
    counts.add(Count::Unsent);
}

/// Adds a change to another; the later one counts.
fn merge(levels: &mut LevelsChange, change: LevelsChange) {
    let LevelsChange { motion, vibration, effects, rows } = change;
    levels.motion = motion.or(levels.motion);
    levels.vibration = vibration.or(levels.vibration);
    levels.effects.extend(effects);
    levels.rows.extend::<BTreeMap<_, _>>(rows);
}
