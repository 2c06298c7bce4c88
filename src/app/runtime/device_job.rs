//! Requests to the controllers and drives of a hall while nothing moves: the same exchanges as `preflight` and `home` make, over the
//! hall's own frame port and links.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::links;
use crate::config::drive::homing::HomeWay;
use crate::config::{Config, Controller};
use crate::device::home::{TIMEOUT, home, unsearched};
use crate::device::survey::{Survey, survey};
use crate::device::{Link, Talk, Watch, peers};
use crate::net::{Origin, SendFault};
use crate::preflight::{LinkSurvey, wanted};
use crate::rt::{Line, LinkEnd, Live};
use crate::state::State;
use crate::sys::clock::Monotonic;
use crate::sys::serial::SerialError;
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
        /// Set once no more of them is to begin, even if its order has to be repeated. Controllers that have begun go on by
        /// themselves, and are watched until they are home; drives are braked.
        called_off: Arc<AtomicBool>,
    },
}

/// What came of it.
#[derive(Debug)]
pub(crate) enum Finding {
    /// What each controller told, and each link.
    Surveyed(Vec<Survey>, BTreeMap<String, LinkSurvey>),
    /// True if each of these controllers is home; where one would go there without a search, those alone that would, and
    /// no seat was moved.
    Homed(Vec<(usize, Result<(), String>)>),
}

/// The ways to all devices of a hall.
#[derive(Debug)]
pub(crate) struct Devices<'d> {
    /// To those on the network.
    pub(crate) line: &'d mut Line,
    /// To those on links.
    pub(crate) links: &'d [LinkEnd],
    /// Which they are.
    pub(crate) config: &'d Arc<Config>,
    /// What state the hall is in.
    pub(crate) live: &'d Arc<Live>,
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

impl Devices<'_> {
    /// Asks, and waits for what comes.
    pub(crate) fn run(self, job: DeviceJob) -> Finding {
        let Devices { line, links, config, live } = self;
        let controllers = config.stations();
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
        let over = OverLine { line, called_off: Arc::clone(&called_off) };
        let mut talk = Talk::over(over, Monotonic, &peers(&controllers));
        let finding = match job {
            DeviceJob::Survey => {
                let told = links::survey(links, config);
                let wanted: Vec<_> = controllers.iter().map(wanted).collect();
                let reports = || live.table().iter().map(|row| row.state.reports).collect::<Vec<_>>();
                let before = reports();
                let mut surveys = survey(&mut talk, &controllers, &wanted, &mut |_| {});
                count_reports(&mut surveys, &before, &reports());
                let mut told: BTreeMap<_, _> = told.iter().collect();
                for link in &config.links {
                    // The thread of a link that told nothing has ended.
                    let gone = || LinkSurvey::silent(SerialError::Vanished(link.port.clone()));
                    told.entry(link.name.clone()).or_insert_with(gone);
                }
                Finding::Surveyed(surveys, told)
            }
            DeviceJob::Home { lanes, .. } => {
                // A stop is heeded even where nobody calls it off.
                let live = Arc::clone(live);
                let goes_on: Arc<dyn Fn() -> bool + Send + Sync> =
                    Arc::new(move || !called_off.load(Ordering::Acquire) && live.state() == State::Homing);
                let on_links = || links::home(links, config, &lanes, &goes_on);
                Finding::Homed(home_all(&mut talk, config, &lanes, on_links))
            }
        };
        drop(talk);
        line.open(false);
        line.hush(false);
        finding
    }
}

/// The ack thread keeps what controllers report unasked: a survey counts what came meanwhile. Those on the network come first.
fn count_reports(surveys: &mut [Survey], before: &[u64], now: &[u64]) {
    for ((survey, before), now) in surveys.iter_mut().zip(before).zip(now) {
        survey.reported.reports += now - before;
    }
}

/// Homes these, unless one of them would go to zero without a search: a seat may have several controllers.
fn home_all(
    talk: &mut Talk<OverLine<'_>>,
    config: &Config,
    lanes: &[usize],
    on_links: impl FnOnce() -> links::Homed,
) -> Vec<(usize, Result<(), String>)> {
    let stations = config.stations();
    let (seats, others): (Vec<usize>, Vec<usize>) = lanes.iter().partition(|lane| **lane < stations.len());
    let seats: Vec<(usize, Dialect)> =
        seats.into_iter().map(|lane| (lane, stations[lane].connection.dialect)).collect();
    let would_not_search = unsearched(talk, &seats).into_iter().map(|(lane, why)| (lane, why.to_string()));
    let unsearched = others.iter().filter(|lane| is_unsearched(&config.controllers[**lane]));
    let here = || "its home is where it is; stop the service, and use `kinocue home --config`".to_owned();
    let refused: Vec<_> = would_not_search.chain(unsearched.map(|lane| (*lane, here()))).collect();
    if !refused.is_empty() {
        return refused.into_iter().map(|(lane, why)| (lane, Err(why))).collect();
    }
    let told = on_links();
    let results = home(talk, &seats, TIMEOUT, &mut |_, _| {});
    let results = results.into_iter().map(|one| one.map(drop).map_err(|error| error.to_string()));
    let told: BTreeMap<_, _> = told.iter().collect();
    let of_link = |lane: usize| {
        let gone = || Err("the thread of its link has ended; restart the service".to_owned());
        (lane, told.get(&lane).cloned().unwrap_or_else(gone))
    };
    let results = seats.iter().map(|(lane, _)| *lane).zip(results);
    results.chain(others.iter().map(|lane| of_link(*lane))).collect()
}

/// True if a seat takes the place where it stands for its zero.
fn is_unsearched(controller: &Controller) -> bool {
    controller.drives().is_some_and(|drives| drives.drive.homing.way == HomeWay::Here)
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;

    use super::*;
    use crate::net::Ports;
    use crate::rt;
    use crate::wire::{Code, MAX_LEN, ReadRequest};

    #[test]
    fn reports_that_came_to_the_ack_thread_while_controllers_were_asked_are_counted() {
        let mut surveys = vec![Survey::default(); 2];
        count_reports(&mut surveys, &[7, 9], &[10, 9]);
        assert_eq!([0, 1].map(|lane| surveys[lane].reported.reports), [3, 0]);
    }

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
