//! Virtual controllers on a virtual network in virtual time, for the tests of this room.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;
use std::time::Duration;

use super::talk::{Link, Watch};
use super::{Endpoint, Talk};
use crate::net::{Origin, SendFault};
use crate::sim::{Controller, Setup};
use crate::time::{Clock, MonoTime};
use crate::wire::{Code, MAX_LEN};

const HOST: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 8410);
/// From a request to its reply.
const ROUND_TRIP: Duration = Duration::from_micros(700);
/// Where virtual time begins: away from 0, so that nothing takes an unset instant for the present.
const BEGIN: MonoTime = MonoTime::from_nanos(1_000_000_000);

pub(super) const fn millis(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// What the network makes of the nth reply.
type Filter = dyn FnMut(usize, Vec<u8>) -> Vec<Vec<u8>>;

struct Net {
    controllers: Vec<Controller>,
    peers: Vec<Endpoint>,
    inbox: VecDeque<(MonoTime, Origin, Vec<u8>)>,
    filter: Box<Filter>,
    replies: usize,
    received: usize,
}

/// The network, and the clock that all share.
#[derive(Clone)]
pub(super) struct Rig {
    net: Rc<RefCell<Net>>,
    now: Rc<Cell<MonoTime>>,
}

impl Rig {
    pub(super) fn of(setups: Vec<Setup>) -> Self {
        let address =
            |lane: usize| SocketAddrV4::new(Ipv4Addr::LOCALHOST, 7408 + u16::try_from(lane).unwrap());
        let controllers = setups.iter().enumerate();
        let net = Net {
            controllers: controllers.map(|(n, setup)| Controller::new(setup, address(n), BEGIN)).collect(),
            peers: setups.iter().map(|setup| Endpoint { dialect: setup.dialect, code: Code::ALL }).collect(),
            inbox: VecDeque::new(),
            filter: Box::new(|_, reply| vec![reply]),
            replies: 0,
            received: 0,
        };
        Self { net: Rc::new(RefCell::new(net)), now: Rc::new(Cell::new(BEGIN)) }
    }

    /// From now on replies come as `filter` makes them of what was sent and its number, from 0.
    pub(super) fn filter(&self, filter: impl FnMut(usize, Vec<u8>) -> Vec<Vec<u8>> + 'static) {
        self.net.borrow_mut().filter = Box::new(filter);
    }

    pub(super) fn talk(&self) -> Talk<Self, Self> {
        let peers = self.net.borrow().peers.clone();
        Talk::over(self.clone(), self.clone(), &peers)
    }

    /// Has a datagram come from somewhere.
    pub(super) fn inject(&self, origin: Origin, bytes: Vec<u8>) {
        self.net.borrow_mut().inbox.push_back((self.now.get(), origin, bytes));
    }

    pub(super) fn lanes(&self) -> usize {
        self.net.borrow().controllers.len()
    }

    pub(super) fn elapsed(&self) -> Duration {
        self.now.get().since(BEGIN)
    }

    /// Datagrams that all controllers got so far.
    pub(super) fn received(&self) -> usize {
        self.net.borrow().received
    }
}

impl Clock for Rig {
    fn now(&self) -> MonoTime {
        self.now.get()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        self.now.set(self.now.get().max(deadline));
    }
}

impl Link for Rig {
    fn send(&mut self, lane: usize, datagram: &[u8]) -> Result<(), SendFault> {
        let at = self.now.get();
        let net = &mut *self.net.borrow_mut();
        let mut buf = [0; MAX_LEN];
        net.received += 1;
        if let Some(reply) = net.controllers[lane].on_datagram(HOST, datagram, at, &mut buf).reply {
            let nth = net.replies;
            net.replies += 1;
            for reply in (net.filter)(nth, reply.to_vec()) {
                net.inbox.push_back((at + ROUND_TRIP, Origin::Controller(lane), reply));
            }
        }
        Ok(())
    }

    fn drain(&mut self, on: &mut Watch<'_>) {
        let now = self.now.get();
        let mut net = self.net.borrow_mut();
        let (come, waiting) = net.inbox.drain(..).partition(|(at, ..)| *at <= now);
        net.inbox = waiting;
        drop(net);
        let come: VecDeque<_> = come;
        for (at, origin, bytes) in come {
            on(origin, &bytes, at);
        }
    }

    fn port_closed(&self, _lane: usize) -> u64 {
        0
    }
}
