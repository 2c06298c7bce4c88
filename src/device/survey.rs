//! Asks many controllers for all that preflight judges, side by side, and notes how they answer: how fast, how often,
//! with what state, and whether anybody else seems to be at their address or to speak to them.
//!
//! Dead controllers cost their three unanswered tries once; the time for all is bounded whatever the network does.

use std::time::Duration;

use super::settings::Values;
use super::talk::Link;
use super::{
    Address, Fault, Odds, Patience, RegisterAnswer, Request, RequestOutcome, Talk, places, reads, table,
};
use crate::config::{Controller, Station};
use crate::net::Origin;
use crate::observe::{ControllerState, Observer, Watched};
use crate::time::{Clock, MonoTime};
use crate::wire::{DeviceError, Dialect, FromController, ReplyCode};

/// Reads whose round trip is measured.
pub(crate) const ROUNDS: usize = 20;
/// How long each of these waits for its answer.
pub(crate) const ROUND_TIMEOUT: Duration = Duration::from_millis(100);
/// How long a survey listens for reports at the least.
pub(crate) const LISTEN: Duration = Duration::from_millis(300);
/// No round begins this long after the survey began.
const LAST_ROUND: Duration = Duration::from_secs(7);

const ROUND: Patience = Patience { timeout: ROUND_TIMEOUT, tries: 1 };
const FIRST: Patience = Patience { timeout: Duration::from_millis(300), tries: 3 };
const REGISTERS: Patience = Patience { timeout: Duration::from_millis(200), tries: 3 };
const LAST: Patience = Patience { timeout: Duration::from_millis(200), tries: 2 };

/// The controller's own addresses, PA10 to PA1b: read first and last.
const IDENTITY: Request = Request::Read { first: Address::Pa(0x10), count: 12 };
/// Datagrams that the controller received; SMC alone.
const PACKETS: Address = Address::Dp(0x34);

/// What one controller told.
#[derive(Debug, Clone, Default)]
pub(crate) struct Survey {
    /// What its registers hold.
    pub(crate) values: Values,
    /// Why the first question had no answer; `None` if it had one.
    pub(crate) silent: Option<Fault>,
    /// Why later questions had none.
    pub(crate) unread: Vec<Fault>,
    /// Its state, where an answer told of another than the normal one; the last of these.
    pub(crate) state: Option<(ReplyCode, DeviceError)>,
    /// How long the answers to the measured reads took.
    pub(crate) round_trips: Vec<Duration>,
    /// Measured reads that were sent.
    pub(crate) rounds: usize,
    /// What came from its address and was no answer.
    pub(crate) odds: Odds,
    /// Registers that told two values, though nobody here wrote them.
    pub(crate) changed: Vec<Address>,
    /// Where its axes stood the second time, by the position registers.
    pub(crate) again: Values,
    /// Datagrams that it received beyond those sent from here; `None` if that is not known.
    pub(crate) foreign_packets: Option<u16>,
    /// What it reported unasked.
    pub(crate) reported: ControllerState,
    /// The dialect in which it reported; `None` if it did not.
    pub(crate) speaks: Option<Dialect>,
}

impl Survey {
    /// True if it answered at all.
    #[must_use]
    pub(crate) const fn answered(&self) -> bool {
        self.silent.is_none()
    }
}

/// Asks all controllers of a conversation for the registers `wanted` of each, and measures; gives what each told, in the
/// order of `controllers`. Tells `on` what it is about to do.
///
/// # Panics
/// If `controllers` or `wanted` are fewer than the conversation was opened with.
pub(crate) fn survey<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    controllers: &[Controller<Station>],
    wanted: &[Vec<Address>],
    on: &mut dyn FnMut(&str),
) -> Vec<Survey> {
    let mut asking = Asking::new(talk, controllers);
    on("who answers");
    asking.first();
    on("reading registers");
    asking.registers(wanted);
    on("measuring round trips");
    asking.rounds();
    on("reading again");
    asking.last();
    on("listening for reports");
    asking.listen();
    asking.finish()
}

/// A survey under way.
struct Asking<'t, L, C> {
    talk: &'t mut Talk<L, C>,
    controllers: &'t [Controller<Station>],
    observer: Observer,
    begun: MonoTime,
    found: Vec<Survey>,
    packets: Vec<Packets>,
    speaks: Vec<Option<Dialect>>,
}

/// What a controller should have counted.
#[derive(Debug, Clone, Copy, Default)]
struct Packets {
    /// What it had counted at first.
    first: Option<u16>,
    /// Sent from here since then, at most.
    sent: u32,
}

impl Packets {
    fn count(&mut self, request: &Request, result: &Result<RegisterAnswer, Fault>) {
        match result {
            Ok(answer) if self.first.is_none() && *request == Request::read(PACKETS) => {
                // What answers an earlier try has not counted the later ones.
                *self = Self { first: answer.words.first().copied(), sent: answer.tries - 1 };
            }
            Ok(answer) => self.sent += answer.tries,
            Err(Fault::Silent { tries, .. }) => self.sent += tries,
            Err(_) => self.sent += 1,
        }
    }
}

impl<'t, L: Link, C: Clock> Asking<'t, L, C> {
    fn new(talk: &'t mut Talk<L, C>, controllers: &'t [Controller<Station>]) -> Self {
        Self {
            begun: talk.now(),
            talk,
            observer: Observer::new(controllers.iter().map(Watched::of).collect()),
            found: vec![Survey::default(); controllers.len()],
            packets: vec![Packets::default(); controllers.len()],
            speaks: vec![None; controllers.len()],
            controllers,
        }
    }

    fn first(&mut self) {
        let requests = (0..self.controllers.len()).map(|lane| (lane, IDENTITY)).collect();
        for RequestOutcome { lane, result, .. } in self.ask(requests, FIRST) {
            match result {
                Ok(answer) => self.found[lane].values.extend(told(&IDENTITY, &answer)),
                Err(fault) if fault.refused() => self.found[lane].unread.push(fault),
                Err(fault) => self.found[lane].silent = Some(fault),
            }
        }
    }

    fn registers(&mut self, wanted: &[Vec<Address>]) {
        let mut requests = self.each_smc(Request::read(PACKETS));
        for lane in self.live() {
            let missing = wanted[lane].iter().copied();
            let missing: Vec<_> = missing.filter(|it| !self.found[lane].values.contains_key(it)).collect();
            requests.extend(reads(&missing).into_iter().map(|read| (lane, read)));
        }
        for RequestOutcome { lane, request, result } in self.ask(requests, REGISTERS) {
            match result {
                Ok(answer) => self.found[lane].values.extend(told(&request, &answer)),
                Err(fault) => self.found[lane].unread.push(fault),
            }
        }
    }

    /// Reads one register of each controller, then the next: an answer that comes late is then never taken for that of
    /// a later read, nor has one to be waited for.
    fn rounds(&mut self) {
        for (smc, mbox) in monitors(Dialect::Smc).into_iter().zip(monitors(Dialect::Mbox)) {
            if self.talk.now().since(self.begun) >= LAST_ROUND {
                return;
            }
            let of = |lane: usize| match self.controllers[lane].connection.dialect {
                Dialect::Smc => smc,
                Dialect::Mbox => mbox,
            };
            let requests = self.live().into_iter().map(|lane| (lane, Request::read(of(lane)))).collect();
            for RequestOutcome { lane, result, .. } in self.ask(requests, ROUND) {
                let found = &mut self.found[lane];
                match result {
                    // A refusal is an answer too, but one whose time nobody took.
                    Err(fault) if fault.refused() => continue,
                    Ok(answer) => found.round_trips.push(answer.took),
                    Err(_) => {}
                }
                found.rounds += 1;
            }
        }
    }

    fn last(&mut self) {
        let mut requests: Vec<_> = self.live().into_iter().map(|lane| (lane, IDENTITY)).collect();
        for lane in self.live() {
            let known = places(self.controllers[lane].seat.axes);
            let known: Vec<_> = known.filter(|it| self.found[lane].values.contains_key(it)).collect();
            requests.extend(reads(&known).into_iter().map(|read| (lane, read)));
        }
        requests.extend(self.each_smc(Request::read(PACKETS)));
        for RequestOutcome { lane, request, result } in self.ask(requests, LAST) {
            let Ok(answer) = result else { continue };
            if request == IDENTITY {
                let before = &self.found[lane].values;
                let differs =
                    |(address, word): &(Address, u16)| before.get(address).is_some_and(|it| it != word);
                self.found[lane].changed =
                    told(&request, &answer).filter(differs).map(|(address, _)| address).collect();
            } else if request == Request::read(PACKETS) {
                self.count_packets(lane, answer.words.first().copied());
            } else {
                self.found[lane].again.extend(told(&request, &answer));
            }
        }
    }

    fn count_packets(&mut self, lane: usize, now: Option<u16>) {
        let Packets { first, sent } = self.packets[lane];
        let grown = first.zip(now).map(|(first, now)| now.wrapping_sub(first));
        let sent = u16::try_from(sent).unwrap_or(u16::MAX);
        self.found[lane].foreign_packets = grown.map(|grown| grown.saturating_sub(sent));
    }

    fn listen(&mut self) {
        self.talk.wait(self.begun + LISTEN, &mut hearing(&mut self.observer, &mut self.speaks));
    }

    fn finish(self) -> Vec<Survey> {
        let Self { talk, observer, mut found, speaks, .. } = self;
        for (lane, survey) in found.iter_mut().enumerate() {
            survey.speaks = speaks[lane];
            survey.odds = talk.odds(lane);
            survey.reported = observer.states()[lane];
        }
        found
    }

    /// Asks, notes states, and counts what is sent; hears what comes meanwhile.
    fn ask(&mut self, requests: Vec<(usize, Request)>, patience: Patience) -> Vec<RequestOutcome> {
        let Self { talk, observer, speaks, .. } = self;
        let outcomes = talk.ask_watching(requests, patience, &mut hearing(observer, speaks));
        for RequestOutcome { lane, request, result } in &outcomes {
            self.packets[*lane].count(request, result);
            let state = result.as_ref().ok().map(|answer| (answer.code, answer.error));
            if let Some(state) = state.filter(|(code, _)| *code != ReplyCode::Running) {
                self.found[*lane].state = Some(state);
            }
        }
        outcomes
    }

    fn live(&self) -> Vec<usize> {
        (0..self.found.len()).filter(|lane| self.found[*lane].answered()).collect()
    }

    fn each_smc(&self, request: Request) -> Vec<(usize, Request)> {
        let smc = |lane: &usize| self.controllers[*lane].connection.dialect == Dialect::Smc;
        self.live().into_iter().filter(smc).map(|lane| (lane, request.clone())).collect()
    }
}

/// Takes what is no answer for a report, of which each dialect has its own.
fn hearing(observer: &mut Observer, speaks: &mut [Option<Dialect>]) -> impl FnMut(Origin, &[u8], MonoTime) {
    |origin, bytes, at| {
        let _ = match origin {
            Origin::Controller(lane) => {
                let read = observer.read(lane, bytes);
                match read {
                    FromController::Status(_) => speaks[lane] = Some(Dialect::Smc),
                    FromController::Report(_) => speaks[lane] = Some(Dialect::Mbox),
                    _ => {}
                }
                observer.hear(lane, &read, at)
            }
            Origin::Stranger(from) => observer.hear_elsewhere(from, bytes, at),
        };
    }
}

/// The registers of a read, and what they hold.
pub(super) fn told(request: &Request, answer: &RegisterAnswer) -> impl Iterator<Item = (Address, u16)> {
    let first = request.first();
    let addresses = (0..).map_while(move |step| first.after(step));
    addresses.zip(answer.words.clone())
}

/// The monitor registers that are read to measure; no other question of the survey is like theirs.
fn monitors(dialect: Dialect) -> Vec<Address> {
    let addresses = table().of(dialect).map(|register| register.address);
    addresses.filter(|it| matches!(it, Address::Dp(_)) && *it != PACKETS).take(ROUNDS).collect()
}

#[cfg(test)]
mod tests;
