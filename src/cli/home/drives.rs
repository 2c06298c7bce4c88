//! Seats on serial links find their zero: the drives know no search of their own, so this program leads them, a seat after the other
//! on each link, all links at once. Ctrl-C has their axes braked.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use super::super::play::leave_on_signals;
use super::super::targets::{DrivenTargets, PortRefused, Troubles, open_link};
use super::super::{Exit, Failure, OrExit as _, print};
use crate::config::drive::DriveFamily;
use crate::config::drive::homing::{DriveHoming, HomeWay, Side};
use crate::config::drive_controller::Motors;
use crate::config::{Controller, Link};
use crate::drive::link::canary;
use crate::drive::link::{LinkLine, Step, TalkTerms};
use crate::drive::{motors_of, silvermax, sixpack2, units_of};

/// How the homing of a seat went: how long it took, or why it is not home.
pub(super) type HomingResult = Result<Duration, String>;

/// What the thread of a link tells of a seat, which it names by its place.
enum HomingTold {
    Step(usize, Step),
    Over(usize, Result<Duration, HomingFault>),
}

/// Why a seat is not home.
enum HomingFault {
    /// It did not answer, or its line is gone.
    Silent(String),
    /// It did, and is not home.
    Refused(String),
}

/// Says what the seats will do; an error for each that cannot be homed, of which it has told.
pub(super) fn explain(driven: &DrivenTargets, troubles: &mut Troubles) -> Vec<HomingResult> {
    let one = |controller: &Controller| {
        let drives = controller.drives().ok_or("it is on no link")?;
        let list = |numbers: &[u8]| numbers.iter().map(u8::to_string).collect::<Vec<_>>().join(", ");
        let who = match &drives.motors {
            Motors::SilverMax(units) => format!("units {}", list(units)),
            Motors::Sixpack2 { unit, motors } => format!("motors {} of unit {unit}", list(motors)),
        };
        let (link, way) = (&drives.link, way(&drives.drive.homing));
        print::tell(&format!("{}: {who} on link {link} {way}", controller.name));
        Ok(Duration::ZERO)
    };
    let tell = |(controller, result): (&Controller, Result<Duration, &str>)| {
        result.map_err(|why| {
            troubles.refuse(&controller.name, why);
            why.to_owned()
        })
    };
    driven.controllers.iter().zip(driven.controllers.iter().map(one)).map(tell).collect()
}

fn way(homing: &DriveHoming) -> String {
    let toward = if homing.toward == Side::Down { "down" } else { "up" };
    let (speed, travel) = (homing.speed_mm_s, homing.travel_mm);
    let by = match homing.way {
        HomeWay::Switch { .. } => "look for their switch",
        HomeWay::Index { .. } => "look for their switch and the index behind it",
        HomeWay::HardStop => "run gently into the stop",
        HomeWay::Here => return "take their present position for their zero, and go to park".to_owned(),
    };
    format!("{by}, {toward}, at {speed} mm/s over at most {travel} mm, and go to park")
}

/// Opens the links of those seats that can be homed; an error for each whose link cannot be had, of which it has told. 75 where another
/// program has one of them.
pub(super) fn open_all(
    driven: &DrivenTargets,
    results: &mut [HomingResult],
    troubles: &mut Troubles,
) -> Result<Vec<Option<LinkLine>>, Failure> {
    let mut lines = Vec::new();
    for link in &driven.links {
        let seats = ready_on(link, driven, results);
        let line = (!seats.is_empty()).then(|| open_link(link)).transpose();
        lines.push(match line {
            Ok(line) => line,
            Err(PortRefused::Taken(error)) => return Err(error).or_exit(Exit::TryAgain),
            Err(PortRefused::Other(why)) => {
                for index in seats {
                    troubles.miss(&driven.controllers[index].name, &why);
                    results[index] = Err(why.clone());
                }
                None
            }
        });
    }
    Ok(lines)
}

/// The seats of a link that can be homed, each by its place.
fn ready_on(link: &Link, driven: &DrivenTargets, results: &[HomingResult]) -> Vec<usize> {
    let is_on = |index: &usize| driven.controllers[*index].drives().is_some_and(|it| it.link == link.name);
    (0..results.len()).filter(|index| results[*index].is_ok()).filter(is_on).collect()
}

/// Homes those of the seats that can be, over links that are open; the results take the place of theirs. Says whether somebody
/// ended it.
pub(super) fn home_all(
    (driven, lines): (&DrivenTargets, Vec<Option<LinkLine>>),
    results: &mut [HomingResult],
    troubles: &mut Troubles,
) -> Result<bool, Failure> {
    let abort = Arc::new(AtomicBool::new(false));
    leave_on_signals(&abort).or_system()?;
    thread::scope(|scope| {
        let (tell, told) = channel();
        for ((link, period), line) in driven.links.iter().zip(&driven.periods).zip(lines) {
            let (seats, tell, abort) = (ready_on(link, driven, results), tell.clone(), &*abort);
            if let Some(line) = line {
                let talk = LinkTalk::over(line, link, *period);
                scope.spawn(move || home_link(talk, driven, &seats, abort, &tell));
            }
        }
        drop(tell);
        show(driven, &told, results, troubles);
    });
    Ok(abort.load(Ordering::Relaxed))
}

fn show(
    driven: &DrivenTargets,
    told: &Receiver<HomingTold>,
    results: &mut [HomingResult],
    troubles: &mut Troubles,
) {
    for told in told {
        let (index, result) = match told {
            HomingTold::Step(index, step) => {
                print::tell(&format!("{}: {}", driven.controllers[index].name, words(step)));
                continue;
            }
            HomingTold::Over(index, result) => (index, result),
        };
        let name = &driven.controllers[index].name;
        results[index] = match result {
            Ok(took) => {
                print::tell(&format!("{name}: home after {:.1} s", took.as_secs_f64()));
                Ok(took)
            }
            Err(HomingFault::Silent(why)) => {
                troubles.miss(name, &why);
                Err(why)
            }
            Err(HomingFault::Refused(why)) => {
                troubles.refuse(name, &why);
                Err(why)
            }
        };
    }
}

fn words(step: Step) -> String {
    match step {
        Step::Held(axis) => format!("axis {} is held, and will home", axis + 1),
        Step::OffSwitch(axis) => format!("axis {} moves off its switch", axis + 1),
        Step::Searching(axis) => format!("axis {} searches for its zero", axis + 1),
        Step::Found(axis) => format!("axis {} has found its zero", axis + 1),
        Step::Parking => "goes to park".to_owned(),
        Step::Set(axis) => format!("axis {} is set up for shows", axis + 1),
    }
}

/// Homes the seats of a link.
fn home_link(
    mut talk: LinkTalk,
    driven: &DrivenTargets,
    seats: &[usize],
    abort: &AtomicBool,
    tell: &Sender<HomingTold>,
) {
    // Whoever shows it listens until all have told.
    let over = |index, result| drop(tell.send(HomingTold::Over(index, result)));
    for &index in seats {
        let step = &mut |step| drop(tell.send(HomingTold::Step(index, step)));
        over(index, talk.home(&driven.controllers[index], abort, step));
    }
}

/// The conversation with the drives of a link.
enum LinkTalk {
    SilverMax(silvermax::Talk<LinkLine>),
    Sixpack2(sixpack2::Talk<LinkLine>, Duration),
}

impl LinkTalk {
    fn over(line: LinkLine, link: &Link, period: Duration) -> Self {
        let terms = TalkTerms::of(link);
        match link.family {
            Some(DriveFamily::Sixpack2) => Self::Sixpack2(sixpack2::Talk::new(line, terms), period),
            Some(DriveFamily::SilverMax) | None => Self::SilverMax(silvermax::Talk::new(line, terms)),
        }
    }

    /// Homes a seat; how long that took.
    #[expect(clippy::disallowed_methods, reason = "it is people who wait for a homing")]
    fn home(
        &mut self,
        controller: &Controller,
        abort: &AtomicBool,
        told: &mut dyn FnMut(Step),
    ) -> Result<Duration, HomingFault> {
        if abort.load(Ordering::Relaxed) {
            return Err(HomingFault::Refused("not begun, as Ctrl-C was pressed".to_owned()));
        }
        let none = || HomingFault::Refused("it has no drives of that link".to_owned());
        let (begun, goes_on) = (Instant::now(), &|| !abort.load(Ordering::Relaxed));
        match self {
            Self::SilverMax(talk) => {
                let canary =
                    canary().map_err(|error| HomingFault::Refused(format!("no random number: {error}")))?;
                let seat = units_of(controller).ok_or_else(none)?;
                silvermax::home(talk, seat, silvermax::Homing { canary, goes_on, told })?;
            }
            Self::Sixpack2(talk, period) => {
                let seat = motors_of(controller, *period).ok_or_else(none)?;
                sixpack2::home(talk, seat, sixpack2::Homing { goes_on, told })?;
            }
        }
        Ok(begun.elapsed())
    }
}

impl From<silvermax::HomeError> for HomingFault {
    fn from(error: silvermax::HomeError) -> Self {
        use silvermax::{HomeError, TalkFault};
        match error {
            HomeError::Talk(TalkFault::Silent { .. } | TalkFault::Link(_)) => Self::Silent(error.to_string()),
            _ => Self::Refused(error.to_string()),
        }
    }
}

impl From<sixpack2::HomeError> for HomingFault {
    fn from(error: sixpack2::HomeError) -> Self {
        use sixpack2::{FindError, HomeError};
        match error {
            HomeError::Find(FindError::Stays { .. }) => Self::Refused(error.to_string()),
            HomeError::Talk(_) | HomeError::Find(_) => Self::Silent(error.to_string()),
            _ => Self::Refused(error.to_string()),
        }
    }
}
