//! Register requests to the controllers of a hall while nothing moves: the same exchanges as `preflight` and `home` make,
//! over the hall's own frame port.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::config::{Controller, Station};
use crate::device::home::{HomeError, Progress, TIMEOUT, home, unsearched};
use crate::device::survey::{Survey, survey};
use crate::device::{Link, Talk, Watch, peers};
use crate::net::{Origin, SendFault};
use crate::preflight::wanted;
use crate::rt::Line;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;
use crate::wire::{Dialect, WriteRequest};

/// How long what is under way when a survey begins may still be answered.
const SETTLE: Duration = Duration::from_millis(100);

/// What is asked.
#[derive(Debug, Clone)]
pub(crate) enum DeviceJob {
    /// All that preflight judges, of all controllers.
    Survey,
    /// Controllers are to home.
    Home {
        /// Which, counted from 0.
        lanes: Vec<usize>,
        /// Set once no more of them is to begin, even if its order has to be repeated. Those that have begun go on by
        /// themselves, and are watched until they are home.
        called_off: Arc<AtomicBool>,
    },
}

/// What came of it.
#[derive(Debug)]
pub(crate) enum Finding {
    /// What each controller told.
    Surveyed(Vec<Survey>),
    /// True if each of these controllers is home; where one would go there without a search, those alone that would, and
    /// no seat was moved.
    Homed(Vec<(usize, Result<(), HomeError>)>),
}

/// The line as a conversation has it: once that is called off, no order goes out.
struct OverLine<'l> {
    line: &'l mut Line,
    called_off: Arc<AtomicBool>,
}

impl Link for OverLine<'_> {
    fn send(&mut self, lane: usize, datagram: &[u8]) -> Result<(), SendFault> {
        if self.called_off.load(Ordering::Acquire) && WriteRequest::parse(datagram).is_ok() {
            return Err(SendFault::CALLED_OFF);
        }
        self.line.send(lane, datagram)
    }

    fn drain(&mut self, on: &mut Watch<'_>) {
        self.line.drain(&mut |controller, bytes, at| on(Origin::Controller(controller), bytes, at));
    }

    fn port_closed(&self, lane: usize) -> u64 {
        self.line.port_closed(lane)
    }
}

/// Asks, and waits for what comes; `tell` hears in words how far it is.
pub(crate) fn run_on_devices(
    line: &mut Line,
    controllers: &[Controller<Station>],
    job: DeviceJob,
    tell: &mut dyn FnMut(&str),
) -> Finding {
    if matches!(job, DeviceJob::Survey) {
        // What the ack thread asks by itself is counted by the controllers too, and its answers are like those to preflight.
        line.hush(true);
        Monotonic.sleep_until(Monotonic.now() + SETTLE);
    }
    line.open(true);
    let called_off = match &job {
        DeviceJob::Survey => Arc::default(),
        DeviceJob::Home { called_off, .. } => Arc::clone(called_off),
    };
    let mut talk = Talk::over(OverLine { line, called_off }, Monotonic, &peers(controllers));
    let finding = match job {
        DeviceJob::Survey => {
            let wanted: Vec<_> = controllers.iter().map(wanted).collect();
            Finding::Surveyed(survey(&mut talk, controllers, &wanted, tell))
        }
        DeviceJob::Home { lanes, .. } => Finding::Homed(home_all(&mut talk, controllers, &lanes, tell)),
    };
    drop(talk);
    line.open(false);
    line.hush(false);
    finding
}

/// Homes these, unless one of them would go to zero without a search: a seat may have several controllers.
fn home_all(
    talk: &mut Talk<OverLine<'_>>,
    controllers: &[Controller<Station>],
    lanes: &[usize],
    tell: &mut dyn FnMut(&str),
) -> Vec<(usize, Result<(), HomeError>)> {
    let seats: Vec<(usize, Dialect)> =
        lanes.iter().map(|lane| (*lane, controllers[*lane].connection.dialect)).collect();
    let would_not_search = unsearched(talk, &seats);
    if !would_not_search.is_empty() {
        return would_not_search.into_iter().map(|(lane, error)| (lane, Err(error))).collect();
    }
    let results = home(talk, &seats, TIMEOUT, &mut |lane, step| {
        if matches!(step, Progress::Home { .. }) {
            tell(&format!("{} is home", controllers[lane].name));
        }
    });
    lanes.iter().copied().zip(results.into_iter().map(|one| one.map(drop))).collect()
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;

    use super::*;
    use crate::net::Ports;
    use crate::rt;
    use crate::wire::{Code, MAX_LEN, ReadRequest};

    #[test]
    fn once_a_homing_is_called_off_no_order_goes_out_and_its_seats_are_still_watched() {
        let controller = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = controller.local_addr().unwrap().to_string().parse().unwrap();
        let (sender, _) = Ports::open("127.0.0.1:0".parse().unwrap(), &[address]).unwrap().split();
        let (mut line, _) = rt::line(sender, 1);
        let called_off = Arc::<AtomicBool>::default();
        let mut link = OverLine { line: &mut line, called_off: Arc::clone(&called_off) };
        let (mut order, mut look, mut heard) = ([0; MAX_LEN], [0; MAX_LEN], [0; MAX_LEN]);
        let (accept, reply) = (Code(0xffff), Code(0xffff));
        let order = WriteRequest { channel: 0, accept, reply, start: 0xf0, data: [0].as_slice().into() }
            .emit(&mut order);
        let look = ReadRequest { channel: 0, accept, reply, start: 0xf0, num: 1 }.emit(&mut look);
        link.send(0, order).unwrap();
        assert_eq!(controller.recv(&mut heard).unwrap(), order.len());
        called_off.store(true, Ordering::Release);
        assert_eq!(link.send(0, order), Err(SendFault::CALLED_OFF));
        link.send(0, look).unwrap();
        let length = controller.recv(&mut heard).unwrap();
        assert_eq!(&heard[..length], look, "the order never came");
    }
}
