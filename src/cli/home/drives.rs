//! Seats on serial links find their zero: the drives know no search of their own, so this program leads them, a seat after the other
//! on each link, all links at once. Ctrl-C has their axes braked.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use super::super::play::leave_on_signals;
use super::super::targets::{Driven, Troubles};
use super::super::token::chance;
use super::super::{Exit, Failure, OrExit as _, print};
use crate::config::drive::homing::{DriveHoming, HomeWay, Side};
use crate::config::drive_controller::Motors;
use crate::config::{Controller, Drives, Link};
use crate::drive::link::LinkLine;
use crate::drive::silvermax::{HomeError, Homing, SeatUnits, Step, Talk, TalkFault, TalkTerms, home};

/// How the homing of a seat went: how long it took, or why it is not home.
pub(super) type Homed = Result<Duration, String>;

/// What the thread of a link tells of a seat, which it names by its place.
enum Told {
    Step(usize, Step),
    Over(usize, Result<Duration, Fault>),
}

/// Why a seat is not home.
enum Fault {
    /// It did not answer, or its line is gone.
    Silent(String),
    /// It did, and is not home.
    Refused(String),
}

/// Says what the seats will do; an error for each that cannot be homed, of which it has told.
pub(super) fn explain(driven: &Driven, troubles: &mut Troubles) -> Vec<Homed> {
    let one = |controller: &Controller| {
        let drives = controller.drives().ok_or("it is on no link")?;
        match &drives.motors {
            Motors::SilverMax(units) => {
                let units: Vec<_> = units.iter().map(u8::to_string).collect();
                let (link, way) = (&drives.link, way(&drives.drive.homing));
                print::tell(&format!("{}: units {} on link {link} {way}", controller.name, units.join(", ")));
                Ok(Duration::ZERO)
            }
            Motors::Sixpack2 { .. } => Err("SIXpack 2 units are not homed yet; home it with its own program"),
        }
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
        HomeWay::Here => return "take the place where they stand for their zero, and go to park".to_owned(),
    };
    format!("{by}, {toward}, at {speed} mm/s and {travel} mm at the most, and go to park")
}

/// Homes those of the seats that can be; the results take the place of theirs. Says whether somebody ended it.
pub(super) fn home_all(
    driven: &Driven,
    results: &mut [Homed],
    troubles: &mut Troubles,
) -> Result<bool, Failure> {
    let abort = Arc::new(AtomicBool::new(false));
    leave_on_signals(&abort).or_exit(Exit::System)?;
    let ready: Vec<usize> = (0..results.len()).filter(|index| results[*index].is_ok()).collect();
    let on = |link: &Link| -> Vec<usize> {
        let is_on =
            |index: &usize| driven.controllers[*index].drives().is_some_and(|it| it.link == link.name);
        ready.iter().copied().filter(is_on).collect()
    };
    thread::scope(|scope| {
        let (tell, told) = channel();
        for link in &driven.links {
            let (seats, tell, abort) = (on(link), tell.clone(), &*abort);
            if !seats.is_empty() {
                scope.spawn(move || home_link(link, driven, &seats, abort, &tell));
            }
        }
        drop(tell);
        show(driven, &told, results, troubles);
    });
    Ok(abort.load(Ordering::Relaxed))
}

fn show(driven: &Driven, told: &Receiver<Told>, results: &mut [Homed], troubles: &mut Troubles) {
    for told in told {
        let (index, result) = match told {
            Told::Step(index, step) => {
                print::tell(&format!("{}: {}", driven.controllers[index].name, words(step)));
                continue;
            }
            Told::Over(index, result) => (index, result),
        };
        let name = &driven.controllers[index].name;
        results[index] = match result {
            Ok(took) => {
                print::tell(&format!("{name}: home after {:.1} s", took.as_secs_f64()));
                Ok(took)
            }
            Err(Fault::Silent(why)) => {
                troubles.miss(name, &why);
                Err(why)
            }
            Err(Fault::Refused(why)) => {
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
        Step::Searching(axis) => format!("axis {} looks for its zero", axis + 1),
        Step::Found(axis) => format!("axis {} has found its zero", axis + 1),
        Step::Parking => "goes to park".to_owned(),
        Step::Set(axis) => format!("axis {} is set up for shows", axis + 1),
    }
}

/// Homes the seats of a link.
fn home_link(link: &Link, driven: &Driven, seats: &[usize], abort: &AtomicBool, tell: &Sender<Told>) {
    // Whoever shows it listens until all have told.
    let over = |index, result| drop(tell.send(Told::Over(index, result)));
    let line = match LinkLine::open(link) {
        Ok(line) => line,
        Err(error) => {
            seats.iter().for_each(|index| over(*index, Err(Fault::Silent(error.to_string()))));
            return;
        }
    };
    let mut talk = Talk::new(line, TalkTerms::of(link));
    for &index in seats {
        let step = &mut |step| drop(tell.send(Told::Step(index, step)));
        over(index, home_seat(&mut talk, &driven.controllers[index], abort, step));
    }
}

#[expect(clippy::disallowed_methods, reason = "it is people who wait for a homing")]
fn home_seat(
    talk: &mut Talk<LinkLine>,
    controller: &Controller,
    abort: &AtomicBool,
    told: &mut dyn FnMut(Step),
) -> Result<Duration, Fault> {
    if abort.load(Ordering::Relaxed) {
        return Err(Fault::Refused("not begun, as you asked for the end".to_owned()));
    }
    let none = || Fault::Refused("it has no SilverMax units".to_owned());
    let Some(Drives { drive, motors: Motors::SilverMax(units), .. }) = controller.drives() else {
        return Err(none());
    };
    let silvermax = drive.silvermax.as_ref().ok_or_else(none)?;
    let seat = SeatUnits { seat: &controller.seat, drive, silvermax, units };
    let canary = canary().map_err(|error| Fault::Refused(format!("the system gives no chance: {error}")))?;
    let begun = Instant::now();
    match home(talk, seat, Homing { canary, abort, told }) {
        Ok(()) => Ok(begun.elapsed()),
        Err(error @ HomeError::Talk(TalkFault::Silent { .. } | TalkFault::Link(_))) => {
            Err(Fault::Silent(error.to_string()))
        }
        Err(error) => Err(Fault::Refused(error.to_string())),
    }
}

/// A number that stands in no register by itself.
fn canary() -> std::io::Result<i32> {
    // 0 is what a unit has after a reset.
    Ok(match i32::from_le_bytes(chance()?) {
        0 => 1,
        number => number,
    })
}
