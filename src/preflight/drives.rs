//! Seats on serial links: what was read of their port and their units, held against the configuration.

use std::collections::BTreeMap;
use std::time::Duration;

use super::{Check, Notes};
use crate::config::drive_controller::Motors;
use crate::config::{Controller, Link};
use crate::drive::link::{AT_PARK, HomedAs, LinkPort, LinkTalk as _, STANDS_MM, TalkCounts};
use crate::drive::rates::{LinkLoad, short};
use crate::drive::silvermax::{TalkFault, UnitFacts, UnitSettings};
use crate::drive::{motors_of, silvermax, sixpack2, units_of};
use crate::sys::serial::{CanError, SerialError};
use crate::wire::silvermax::{Poll, StatusWord as _, kill_names};

/// Answers that begin so late are held back by an adapter, no unit waits so long.
const HELD_BACK: Duration = Duration::from_millis(12);
const HOME: &str = "home it, with nobody on the seat";
/// In so many requests one that something else comes of is noise, and no chance.
const NOISY: u64 = 20;
/// What answers may be later than was reckoned with, as a part of it.
const LATER: f64 = 1.25;

/// What was read of a link: its port, and each unit that was asked.
#[derive(Debug, Default)]
pub(crate) struct LinkSurvey {
    /// Why there was nothing to ask by.
    pub(crate) fault: Option<SerialError>,
    /// What nine of ten answers took to begin at the most; none where nobody answered.
    pub(crate) delay: Option<Duration>,
    /// What came over it meanwhile: what was on the line before is no trouble of now.
    pub(crate) counts: TalkCounts,
    /// What SilverMax units told, by their numbers.
    pub(crate) units: BTreeMap<u8, Result<UnitFacts, TalkFault>>,
    /// What SIXpack 2 units told; none of one that waits as it woke.
    pub(crate) sixpacks: BTreeMap<u8, Result<Option<sixpack2::UnitFacts>, sixpack2::TalkFault>>,
}

impl LinkSurvey {
    /// Of a link by which nobody could be asked, for that reason.
    pub(crate) fn silent(why: SerialError) -> Self {
        Self { fault: Some(why), ..Self::default() }
    }
}

impl LinkSurvey {
    /// What the SilverMax units among those motors tell; nobody is asked any more once the port is gone.
    pub(crate) fn of_units<P: LinkPort>(talk: &mut silvermax::Talk<P>, motors: &[&Motors]) -> Self {
        let (mut units, before) = (BTreeMap::new(), talk.counts());
        for unit in motors.iter().flat_map(|motors| motors.units()) {
            let facts = silvermax::look(talk, *unit);
            let is_gone = matches!(facts, Err(TalkFault::Link(_)));
            units.insert(*unit, facts);
            if is_gone {
                break;
            }
        }
        Self { delay: talk.usual_delay(), counts: talk.counts().since(before), units, ..Self::default() }
    }

    /// The same of SIXpack 2 units.
    pub(crate) fn of_sixpacks<P: LinkPort>(talk: &mut sixpack2::Talk<P>, motors: &[&Motors]) -> Self {
        let mut asked = BTreeMap::<u8, Vec<u8>>::new();
        for motors in motors {
            let Motors::Sixpack2 { unit, motors } = motors else { continue };
            asked.entry(*unit).or_default().extend(motors);
        }
        let (mut sixpacks, before) = (BTreeMap::new(), talk.counts());
        for (unit, motors) in asked {
            let facts = sixpack2::look_for(talk, unit, &motors);
            let is_gone = matches!(facts, Err(sixpack2::TalkFault::Link(_)));
            sixpacks.insert(unit, facts);
            if is_gone {
                break;
            }
        }
        Self { delay: talk.usual_delay(), counts: talk.counts().since(before), sixpacks, ..Self::default() }
    }
}

/// What is known of one controller on a link.
#[derive(Debug)]
pub(crate) struct DriveSubject<'a> {
    /// What it should be.
    pub(crate) controller: &'a Controller,
    /// Its link.
    pub(crate) link: &'a Link,
    /// What that carries, by the configuration.
    pub(crate) load: Option<LinkLoad>,
    /// What was read.
    pub(crate) survey: &'a LinkSurvey,
}

impl DriveSubject<'_> {
    /// Its units that answered all questions.
    pub(crate) fn facts(&self) -> impl Iterator<Item = &UnitFacts> {
        self.units().iter().filter_map(|unit| self.survey.units.get(unit)?.as_ref().ok())
    }

    /// Its SIXpack 2, if that answered all questions.
    pub(crate) fn sixpack(&self) -> Option<&sixpack2::UnitFacts> {
        let Motors::Sixpack2 { unit, .. } = self.controller.drives()?.motors else { return None };
        self.survey.sixpacks.get(&unit)?.as_ref().ok()?.as_ref()
    }

    /// True if any of its units answered.
    #[must_use]
    pub(crate) fn answered(&self) -> bool {
        let Some(Motors::Sixpack2 { unit, .. }) = self.controller.drives().map(|drives| &drives.motors)
        else {
            return self.facts().next().is_some();
        };
        matches!(self.survey.sixpacks.get(unit), Some(Ok(_)))
    }

    fn units(&self) -> &[u8] {
        self.controller.drives().map_or(&[], |drives| drives.motors.units())
    }

    /// What homing leaves in its units; none where no unit can be set so, which homing tells.
    fn settings(&self) -> Vec<UnitSettings> {
        units_of(self.controller).and_then(|seat| seat.settings().ok()).unwrap_or_default()
    }
}

/// What is found of one of them.
pub(super) fn one(subject: &DriveSubject<'_>) -> Notes {
    let mut notes = Notes::default();
    if let Some(error) = &subject.survey.fault {
        port(error, &mut notes);
    } else if let Some(Motors::Sixpack2 { unit, .. }) = subject.controller.drives().map(|one| &one.motors) {
        sixpack(subject, *unit, &mut notes);
    } else {
        answers(subject, &mut notes);
        line(subject, &mut notes);
        if subject.answered() {
            rate(subject, &mut notes);
            home(subject, &mut notes);
            places(subject, &mut notes);
            subject.facts().for_each(|unit| trouble(unit, &mut notes));
            settings(subject, &mut notes);
        }
    }
    notes
}

fn port(error: &SerialError, notes: &mut Notes) {
    let check = match error {
        SerialError::Missing(_) | SerialError::Vanished(_) | SerialError::Can(CanError::Missing(_)) => {
            Check::PortMissing
        }
        SerialError::Taken(_) | SerialError::Can(CanError::Taken(_)) => Check::PortTaken,
        SerialError::Forbidden(_) => Check::PortForbidden,
        _ => Check::PortUnfit,
    };
    told(check, &error.to_string(), notes);
}

/// A sentence whose remedy stands behind a semicolon.
fn told(check: Check, words: &str, notes: &mut Notes) {
    let (found, remedy) = words.split_once("; ").unwrap_or((words, ""));
    notes.add(check, found, remedy);
}

/// A SIXpack 2, of which no setting can be read.
fn sixpack(subject: &DriveSubject<'_>, unit: u8, notes: &mut Notes) {
    line(subject, notes);
    let facts = match subject.survey.sixpacks.get(&unit) {
        None => return told(Check::NoAnswer, &format!("unit {unit} was not read; try again"), notes),
        Some(Err(fault)) => return told(Check::NoAnswer, &fault.to_string(), notes),
        Some(Ok(None)) => {
            let found = format!("unit {unit} has its power-on settings: it was not homed since power-on");
            notes.add(Check::NotHome, found, HOME);
            return;
        }
        Some(Ok(Some(facts))) => facts,
    };
    rate(subject, notes);
    let period = subject.load.and_then(|load| load.period_for(subject.link.rate_hz).ok());
    let seat = motors_of(subject.controller, period.unwrap_or(Duration::from_millis(20)));
    let lost = seat.map(|seat| seat.strangers(facts)).unwrap_or_default();
    if facts.was_reset {
        let found = format!("unit {unit} was reset since it was last read: it has no settings");
        notes.add(Check::NotHome, found, HOME);
    } else if !lost.is_empty() {
        let lost: Vec<String> = lost.iter().map(u8::to_string).collect();
        let found = format!(
            "motors {} of unit {unit} count no position of this seat as it is configured",
            lost.join(", ")
        );
        homed_otherwise(found, seat.and_then(|seat| seat.homed_as(facts)), notes);
    }
    if let Some(seat) = seat.filter(|_| is_home(notes)) {
        for (axis, motor) in seat.motors.iter().enumerate() {
            let told = facts.motors.iter().find(|told| told.motor == *motor);
            if let Some(place) = told.and_then(|told| seat.place(told)) {
                off_park(subject, axis, [place; 2], notes);
            }
        }
    }
    for motor in facts.motors.iter().filter(|motor| motor.searches()) {
        let found = format!("motor {} of unit {unit} searches for its zero without a command", motor.motor);
        notes.add(Check::DriveError, found, HOME);
    }
}

/// Units that did not answer, or for which others did.
fn answers(subject: &DriveSubject<'_>, notes: &mut Notes) {
    for unit in subject.units() {
        match subject.survey.units.get(unit) {
            Some(Err(fault @ TalkFault::Foreign { .. })) => {
                told(Check::DuplicateUnit, &fault.to_string(), notes)
            }
            Some(Err(fault)) => told(Check::NoAnswer, &fault.to_string(), notes),
            None => told(Check::NoAnswer, &format!("unit {unit} was not read"), notes),
            Some(Ok(_)) => {}
        }
    }
}

/// What came that should not have.
fn line(subject: &DriveSubject<'_>, notes: &mut Notes) {
    let (link, TalkCounts { asked, answered, malformed, doubled, echo_differs, echoed, .. }) =
        (&subject.link.name, subject.survey.counts);
    if subject.link.has_echo && 2 * echo_differs > asked {
        let found = format!("{echo_differs} of {asked} requests were not echoed on link {link}");
        notes.add(Check::EchoDiffers, found, "this adapter does not echo what is sent: set echo = false");
    } else if !subject.link.has_echo && 2 * echoed > asked {
        let found =
            format!("{echoed} of {asked} requests came back besides {answered} answers on link {link}");
        notes.add(Check::EchoDiffers, found, "this adapter echoes what is sent: set echo = true");
    } else if doubled > 0 {
        let found = format!("{doubled} more answers than requests on link {link}");
        notes.add(
            Check::DuplicateUnit,
            found,
            "connect each unit alone to the line, and give those that share a number another",
        );
    } else if NOISY * malformed > asked {
        let found = format!(
            "what nobody sent came {malformed} times while {asked} requests were sent on link {link}"
        );
        notes.add(
            Check::LineNoise,
            found,
            "check shield, ground, and the resistors at the ends of two wires, and that baud and stop_bits are those of the units",
        );
    }
}

/// How late answers are, and what that leaves of the rate.
fn rate(subject: &DriveSubject<'_>, notes: &mut Notes) {
    let (Some(load), Some(delay)) = (&subject.load, subject.survey.delay) else { return };
    let hz = match load.period_for(subject.link.rate_hz) {
        Ok(period) => period.as_secs_f64().recip(),
        Err(slow) => {
            told(Check::LinkTooSlow, &format!("link {}: {slow}", subject.link.name), notes);
            return;
        }
    };
    let measured = LinkLoad { answer_delay: delay, ..*load };
    let (late, fits) = (1e3 * delay.as_secs_f64(), measured.rate_hz());
    let reckoned = 1e3 * load.answer_delay.as_secs_f64();
    let found = format!(
        "answers take {late:.1} ms instead of the assumed {reckoned:.1} ms: {} Hz become {}",
        short(hz),
        short(fits.min(hz))
    );
    let alone = LinkLoad { share: 1.0, ..measured };
    if delay >= HELD_BACK {
        let remedy =
            "if it is a USB adapter, install 60-kinocue-drives.rules, which sets its latency timer to 1 ms";
        notes.add(Check::AdapterSlow, found.clone(), remedy);
    } else if late > LATER * reckoned && fits < hz {
        notes.add(Check::SlowReplies, found.clone(), "lower ADL of the units, or use a built-in serial port");
    }
    if alone.rate_hz() < hz {
        let other = measured.carries(hz).map_or_else(String::new, |other| format!(", or {other}"));
        notes.add(Check::LinkTooSlow, found, format!("set rate_hz = {}{other}", short(fits)));
    }
}

/// Whether the seat was homed, all of it at once: then the same number stands in each.
fn home(subject: &DriveSubject<'_>, notes: &mut Notes) {
    let canaries: Vec<(u8, i32)> = subject.facts().map(|unit| (unit.unit, unit.canary)).collect();
    let lost: Vec<String> =
        canaries.iter().filter(|(_, canary)| *canary == 0).map(|(unit, _)| unit.to_string()).collect();
    let differ = canaries.windows(2).any(|pair| pair[0].1 != pair[1].1);
    if lost.len() == canaries.len() {
        let found = format!("units {} were not homed since they were switched on", lost.join(", "));
        notes.add(Check::NotHome, found, HOME);
    } else if differ {
        let found = if lost.is_empty() {
            "its units were homed at different times (register 40)".to_owned()
        } else {
            format!("units {} were switched off since the seat was homed (register 40)", lost.join(", "))
        };
        notes.add(Check::Restarted, found, HOME);
    } else if let Some(seat) = units_of(subject.controller)
        && canaries.iter().any(|(_, canary)| !seat.is_own(*canary))
    {
        let found =
            "its units were homed with other settings, or by another name, than it has now (register 40)"
                .to_owned();
        let canaries: Vec<i32> = canaries.iter().map(|(_, canary)| *canary).collect();
        homed_otherwise(found, seat.homed_as(&canaries), notes);
    }
}

/// A seat that is not home as it is now; perhaps its line leads to another.
fn homed_otherwise(found: String, homed_as: Option<&str>, notes: &mut Notes) {
    match homed_as {
        Some(name) => told(Check::NotHome, &HomedAs(name.to_owned()).to_string(), notes),
        None => notes.add(Check::NotHome, found, HOME),
    }
}

/// True if nothing is found by which the seat is not home.
fn is_home(notes: &Notes) -> bool {
    !notes.0.iter().any(|one| matches!(one.check, Check::NotHome | Check::Restarted))
}

/// Where the axes of a seat stand that is home.
fn places(subject: &DriveSubject<'_>, notes: &mut Notes) {
    let Some(seat) = units_of(subject.controller).filter(|_| is_home(notes)) else { return };
    for facts in subject.facts() {
        let axis = seat.units.iter().position(|unit| *unit == facts.unit);
        if let (Some(axis), Some(places)) = (axis, seat.places(facts)) {
            off_park(subject, axis, places, notes);
        }
    }
}

/// Whether an axis, from 0, that was read there, and is held there, stands at park.
fn off_park(subject: &DriveSubject<'_>, axis: usize, [at, held]: [f64; 2], notes: &mut Notes) {
    let Some(geometry) = subject.controller.seat.own().get(axis) else { return };
    if (at - geometry.park).abs() <= AT_PARK {
        return;
    }
    let [read, park, held] = [at, geometry.park, held].map(|part| geometry.place(part));
    let found = format!("axis {} stands at {read:.1} mm, its park place is {park:.1} mm", axis + 1);
    if (read - held).abs() < STANDS_MM {
        notes.add(Check::OffPark, found, "park it, or start a show: it joins slowly from there");
    } else {
        let found = format!("{found}, and its drive holds it at {held:.1} mm");
        notes.add(Check::OffPark, found, "free it, or find out why its motor does not hold it");
    }
}

/// What a unit says is wrong.
fn trouble(facts: &UnitFacts, notes: &mut Notes) {
    let unit = facts.unit;
    // Whoever led it then has cleared its events, and taken back what it was home by.
    if facts.poll.has(Poll::KILLED) || (facts.kill_cause != 0 && facts.canary == 0) {
        let cause = kill_names(facts.kill_cause);
        let found = format!("unit {unit} was killed by {cause} (register 211)");
        notes.add(Check::Killed, found, "find out what blocks or heats it, then home");
    }
    if facts.internal.is_hot() {
        notes.add(
            Check::DriveHot,
            format!("unit {unit} is too hot"),
            "let it cool, and find out what loads it",
        );
    }
    let says = |names: [&'static str; 2]| -> Vec<&'static str> {
        facts.internal.names().filter(|name| names.contains(name)).collect()
    };
    let errors = says(["moving error", "holding error"]);
    if !errors.is_empty() && !facts.poll.has(Poll::KILLED) {
        let found = format!("unit {unit} has had a {}", errors.join(" and a "));
        notes.add(Check::DriveError, found, "find out what blocks it, then home");
    }
    let supply = says(["low voltage", "high voltage"]);
    if !supply.is_empty() {
        let found = format!("unit {unit} has had {}", supply.join(" and "));
        notes.add(Check::Supply, found, "check the supply; braking needs a clamp");
    }
}

/// Registers that homing wrote, of a seat that is home.
fn settings(subject: &DriveSubject<'_>, notes: &mut Notes) {
    const REMEDY: &str = "home it, which writes them; if they change again, another program uses the line";
    let wanted = subject.settings();
    for facts in subject.facts().filter(|unit| unit.canary != 0) {
        let Some(wanted) = wanted.iter().find(|one| one.unit == facts.unit) else { continue };
        let torque = [wanted.torque; 2];
        for (check, held, found, wanted) in [
            (Check::SoftLimits, "registers 38 and 39 hold", &facts.soft_limits[..], &wanted.soft_limits[..]),
            (Check::ErrorLimits, "register 208 holds", &[facts.error_limits], &[wanted.error_limits]),
            (Check::DriveTorque, "registers 206 and 207 hold", &facts.torque, &torque),
            (Check::BrakeRate, "register 19 holds", &[facts.dry_brake], &[wanted.dry_brake]),
        ] {
            if found != wanted {
                let list =
                    |values: &[i32]| values.iter().map(i32::to_string).collect::<Vec<_>>().join(" and ");
                let (unit, found, wanted) = (facts.unit, list(found), list(wanted));
                notes.add(check, format!("unit {unit}: {held} {found}, homing writes {wanted}"), REMEDY);
            }
        }
    }
}
