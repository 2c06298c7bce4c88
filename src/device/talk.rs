//! Requests over the frame port: sends what is due, reads what comes, waits in between. Control thread.

use std::collections::BTreeMap;
use std::net::SocketAddrV4;
use std::time::Duration;

use super::{Endpoint, Exchange, Odds, Patience, Request, RequestOutcome};
use crate::config::{Controller, Station};
use crate::net::{Delivery, NetError, Origin, Ports, Receiver, SendFault, Sender};
use crate::sys::clock::Monotonic;
use crate::time::{Clock, MonoTime};
use crate::wire::Code;

/// How often replies are looked for. Waiting costs a few system calls for each controller, so not more often.
const LOOK: Duration = Duration::from_millis(1);
/// Strangers that are remembered by their address.
const STRANGERS: usize = 64;

/// Takes a datagram that was no reply about registers: who sent it, what, and when it came.
pub(crate) type Watch<'w> = dyn FnMut(Origin, &[u8], MonoTime) + 'w;

/// The way to the controllers: the frame port in the program, virtual controllers in tests.
pub trait Link {
    /// Sends a datagram to a controller, counted from 0.
    ///
    /// # Errors
    /// Why the kernel did not take it.
    fn send(&mut self, lane: usize, datagram: &[u8]) -> Result<(), SendFault>;

    /// Gives all that came since the last look.
    fn drain(&mut self, on: &mut Watch<'_>);

    /// How often a controller's port was reported closed so far.
    fn port_closed(&self, lane: usize) -> u64;
}

impl Link for (Sender, Receiver) {
    fn send(&mut self, lane: usize, datagram: &[u8]) -> Result<(), SendFault> {
        match self.0.send(lane, datagram) {
            Delivery::Sent | Delivery::SentAfterRefusal => Ok(()),
            Delivery::Failed(fault) => Err(fault),
        }
    }

    fn drain(&mut self, on: &mut Watch<'_>) {
        self.1.drain(on);
    }

    fn port_closed(&self, lane: usize) -> u64 {
        self.1.port_closed(lane)
    }
}

/// A conversation with controllers, each known by its place in the list it was opened with.
#[derive(Debug)]
pub struct Talk<L = (Sender, Receiver), C = Monotonic> {
    link: L,
    clock: C,
    exchange: Exchange,
    closed: Vec<u64>,
    strangers: BTreeMap<SocketAddrV4, u64>,
}

/// How the controllers of a configuration are spoken to.
#[must_use]
pub(crate) fn peers(controllers: &[Controller<Station>]) -> Vec<Endpoint> {
    let peer = |one: &Controller<Station>| Endpoint {
        dialect: one.connection.dialect,
        code: Code(one.connection.accept.code(one.connection.address)),
    };
    controllers.iter().map(peer).collect()
}

impl Talk {
    /// Takes the frame port for a conversation with `controllers`.
    ///
    /// # Errors
    /// [`NetError`] where it cannot be had, even if another kinocue holds it.
    pub fn open(bind: SocketAddrV4, controllers: &[Controller<Station>]) -> Result<Self, NetError> {
        let addresses: Vec<_> = controllers.iter().map(|one| one.connection.address).collect();
        Ok(Self::over(Ports::open(bind, &addresses)?.split(), Monotonic, &peers(controllers)))
    }
}

impl<L: Link, C: Clock> Talk<L, C> {
    /// A conversation over a link of one's own.
    #[must_use]
    pub(crate) fn over(link: L, clock: C, peers: &[Endpoint]) -> Self {
        let exchange = Exchange::new(peers);
        Self { link, clock, closed: vec![0; exchange.lanes()], exchange, strangers: BTreeMap::new() }
    }

    /// Asks all controllers side by side, each its requests in order; returns when every request has its outcome, in
    /// the order of the requests. A controller that does not answer one request is not asked the rest.
    ///
    /// # Panics
    /// If a request is for a lane that there is not.
    pub fn ask(&mut self, requests: Vec<(usize, Request)>, patience: Patience) -> Vec<RequestOutcome> {
        self.ask_watching(requests, patience, &mut |_, _, _| {})
    }

    /// The same, and gives whatever else comes meanwhile to `watch`: reports, status, strangers.
    ///
    /// # Panics
    /// If a request is for a lane that there is not.
    pub(crate) fn ask_watching(
        &mut self,
        requests: Vec<(usize, Request)>,
        patience: Patience,
        watch: &mut Watch<'_>,
    ) -> Vec<RequestOutcome> {
        self.exchange.begin(requests, patience);
        loop {
            self.send_due();
            let Some(wake) = self.exchange.wake() else { return self.exchange.take() };
            self.clock.sleep_until(wake.min(self.clock.now() + LOOK));
            self.look(watch);
        }
    }

    /// Waits until an instant, and gives what comes meanwhile to `watch`.
    pub(crate) fn wait(&mut self, until: MonoTime, watch: &mut Watch<'_>) {
        while self.clock.now() < until {
            self.clock.sleep_until(until.min(self.clock.now() + LOOK));
            self.look(watch);
        }
    }

    /// The present instant of the conversation's clock.
    pub(crate) fn now(&self) -> MonoTime {
        self.clock.now()
    }

    /// What came from a controller's address and was no answer.
    #[must_use]
    pub(crate) fn odds(&self, lane: usize) -> Odds {
        self.exchange.odds(lane)
    }

    /// Who else wrote to the frame port, and how often; the first 64.
    #[must_use]
    #[cfg(test)]
    pub(crate) const fn strangers(&self) -> &BTreeMap<SocketAddrV4, u64> {
        &self.strangers
    }

    fn send_due(&mut self) {
        let Self { link, exchange, clock, .. } = self;
        for lane in 0..exchange.lanes() {
            while let Some(datagram) = exchange.due(lane, clock.now()) {
                if let Err(fault) = link.send(lane, datagram) {
                    exchange.on_unsent(lane, fault);
                }
            }
        }
    }

    fn look(&mut self, watch: &mut Watch<'_>) {
        let Self { link, exchange, strangers, closed, .. } = self;
        link.drain(&mut |origin, bytes, at| {
            let done = match origin {
                Origin::Controller(lane) => exchange.on_datagram(lane, bytes, at),
                Origin::Stranger(address) => {
                    if strangers.len() < STRANGERS || strangers.contains_key(&address) {
                        *strangers.entry(address).or_insert(0) += 1;
                    }
                    false
                }
            };
            if !done {
                watch(origin, bytes, at);
            }
        });
        for (lane, before) in closed.iter_mut().enumerate() {
            let now = link.port_closed(lane);
            if now > *before {
                exchange.on_closed(lane);
            }
            *before = now;
        }
    }
}

#[cfg(test)]
mod tests;
