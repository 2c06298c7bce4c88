//! Asking the controllers of a hall for registers while nothing moves: the same conversations as `preflight` and `home` hold,
//! over the hall's own frame port.

use crate::config::Controller;
use crate::device::home::{HomeError, Progress, TIMEOUT, home};
use crate::device::survey::{Survey, survey};
use crate::device::{Link, Talk, Watch, peers};
use crate::net::{Origin, SendFault};
use crate::preflight::wanted;
use crate::rt::Line;
use crate::sys::clock::Monotonic;
use crate::wire::Dialect;

/// What is asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Inquiry {
    /// All that preflight judges, of all controllers.
    Survey,
    /// These controllers, counted from 0, are to home.
    Home(Vec<usize>),
}

/// What came of it.
#[derive(Debug)]
pub enum Finding {
    /// What each controller told.
    Surveyed(Vec<Survey>),
    /// Whether each of these controllers is home.
    Homed(Vec<(usize, Result<(), HomeError>)>),
}

struct OverLine<'l>(&'l mut Line);

impl Link for OverLine<'_> {
    fn send(&mut self, lane: usize, datagram: &[u8]) -> Result<(), SendFault> {
        self.0.send(lane, datagram)
    }

    fn drain(&mut self, on: &mut Watch<'_>) {
        self.0.drain(&mut |controller, octets, at| on(Origin::Controller(controller), octets, at));
    }

    fn port_closed(&self, lane: usize) -> u64 {
        self.0.port_closed(lane)
    }
}

/// Asks, and waits for what comes; `tell` hears in words how far it is.
pub fn inquire(
    line: &mut Line,
    controllers: &[Controller],
    inquiry: Inquiry,
    tell: &mut dyn FnMut(&str),
) -> Finding {
    line.open(true);
    let mut talk = Talk::over(OverLine(line), Monotonic, &peers(controllers));
    let finding = match inquiry {
        Inquiry::Survey => {
            let wanted: Vec<_> = controllers.iter().map(|one| wanted(one.dialect)).collect();
            Finding::Surveyed(survey(&mut talk, controllers, &wanted, tell))
        }
        Inquiry::Home(lanes) => {
            let seats: Vec<(usize, Dialect)> =
                lanes.iter().map(|lane| (*lane, controllers[*lane].dialect)).collect();
            let results = home(&mut talk, &seats, TIMEOUT, &mut |lane, step| {
                if matches!(step, Progress::Home { .. }) {
                    tell(&format!("{} is home", controllers[lane].name));
                }
            });
            Finding::Homed(lanes.into_iter().zip(results.into_iter().map(|one| one.map(drop))).collect())
        }
    };
    drop(talk);
    line.open(false);
    finding
}
