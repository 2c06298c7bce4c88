//! Virtual controllers on sockets: one thread that waits for all of them.

use std::collections::VecDeque;
use std::io;
use std::net::SocketAddrV4;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::sync::mpsc::{self, Sender};

use super::event_loop::{DELAYED, EventLoop, LoopOrder, wait_for};
use super::log::Logs;
use super::outcome::Outcome;
use super::station::{VirtualStation, listen};
use super::thread::SimThread;
use super::{Command, CommandError, Options, Setup};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// Why virtual controllers cannot start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FarmError {
    /// The ports run past the last one.
    #[error("{count} controllers from port {first} on run past port 65535; use a lower first port")]
    Ports {
        /// The first port.
        first: u16,
        /// How many controllers.
        count: usize,
    },
    /// An address is taken, or none of this machine's.
    #[error(
        "cannot listen on {address}; another program may have it, such as a simulator or a rehearsal: end that, or listen elsewhere"
    )]
    Listen {
        /// The address.
        address: SocketAddrV4,
        /// What the system said.
        #[source]
        source: io::Error,
    },
    /// The script has something happen that cannot.
    #[error("cannot follow the script")]
    Script(#[source] CommandError),
    /// The system refused something else.
    #[error("cannot wait for {count} sockets")]
    System {
        /// How many controllers.
        count: usize,
        /// What the system said.
        #[source]
        source: io::Error,
    },
}

/// Virtual controllers at work on a thread of their own, until they are stopped or dropped.
#[derive(Debug)]
pub struct Farm {
    addresses: Vec<SocketAddrV4>,
    remote: Remote,
    thread: SimThread<io::Result<Vec<Outcome>>>,
}

/// Has things happen to the virtual controllers of a farm, from any thread.
#[derive(Debug, Clone)]
pub struct Remote {
    orders: Sender<LoopOrder>,
    bell: Arc<OwnedFd>,
}

impl Farm {
    /// Binds all sockets and starts the thread. What is sent to them from now on is answered.
    ///
    /// # Errors
    /// [`FarmError`] where a socket cannot be had; then none is kept.
    pub fn start(options: Options) -> Result<Self, FarmError> {
        let start = Monotonic.now();
        let count = options.controllers.len();
        let script = script(&options, start).map_err(FarmError::Script)?;
        let stations = stations(&options, start)?;
        let addresses = stations.iter().map(|station| station.address).collect();
        let system = |source: io::Error| FarmError::System { count, source };
        let (epoll, bell) = wait_for(&stations).map_err(|error| system(error.into()))?;
        let bell = Arc::new(bell);
        let (sender, orders) = mpsc::channel();
        let event_loop = EventLoop {
            stations,
            epoll,
            bell: Arc::clone(&bell),
            orders,
            script,
            room: DELAYED,
            logs: Logs::new(start, options.log, options.moves),
            due: start,
        };
        let remote = Remote { orders: sender, bell };
        let ending = remote.clone();
        let stop = move || drop(ending.order(LoopOrder::Stop));
        let thread = SimThread::spawn(move || event_loop.run(), stop).map_err(system)?;
        Ok(Self { addresses, remote, thread })
    }

    /// Where the controllers listen, in the order of their setups.
    #[must_use]
    pub fn addresses(&self) -> Vec<SocketAddrV4> {
        self.addresses.clone()
    }

    /// What has things happen to these controllers.
    #[must_use]
    pub fn remote(&self) -> Remote {
        self.remote.clone()
    }

    /// Takes what has come, ends the thread and says what became of each controller.
    ///
    /// # Errors
    /// A log that could not be written, or a wait that failed.
    pub fn stop(self) -> io::Result<Vec<Outcome>> {
        self.thread.end()
    }
}

impl Remote {
    /// Has something happen, and returns once it has.
    ///
    /// # Errors
    /// [`CommandError`] where the command names what there is not, or the controllers have ended.
    pub fn tell(&self, command: Command) -> Result<(), CommandError> {
        command.action.check()?;
        let (told, answer) = mpsc::sync_channel(1);
        self.order(LoopOrder::Do(command, told))?;
        answer.recv().map_err(|_| CommandError::Ended)?
    }

    fn order(&self, order: LoopOrder) -> Result<(), CommandError> {
        self.orders.send(order).map_err(|_| CommandError::Ended)?;
        rustix::io::write(&*self.bell, &1_u64.to_ne_bytes()).map_err(|_| CommandError::Ended)?;
        Ok(())
    }
}

/// The script with its instants, soonest first.
fn script(options: &Options, start: MonoTime) -> Result<VecDeque<(MonoTime, Command)>, CommandError> {
    let count = options.controllers.len();
    for (_, command) in &options.script {
        command.action.check()?;
        if let Some(index) = command.controller.filter(|&index| index >= count) {
            return Err(CommandError::Controller { index, count });
        }
    }
    let mut script: Vec<_> =
        options.script.iter().map(|(after, command)| (start + *after, command.clone())).collect();
    script.sort_by_key(|(at, _)| *at);
    Ok(script.into())
}

fn stations(options: &Options, start: MonoTime) -> Result<Vec<VirtualStation>, FarmError> {
    let first = options.listen;
    let station = |(index, setup): (usize, &Setup)| {
        let outside = FarmError::Ports { first: first.port(), count: options.controllers.len() };
        let port = match first.port() {
            0 => 0,
            port => u16::try_from(usize::from(port) + index).map_err(|_| outside)?,
        };
        let wanted = SocketAddrV4::new(*first.ip(), port);
        let socket = listen(wanted).map_err(|source| FarmError::Listen { address: wanted, source })?;
        Ok(VirtualStation::new(options, index, setup, socket, start))
    };
    options.controllers.iter().enumerate().map(station).collect()
}
