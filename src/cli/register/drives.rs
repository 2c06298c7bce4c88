//! `kinocue register` for seats on serial links: what SilverMax units hold by their registers, what a SIXpack 2 answers to its
//! queries. Reads alone; what no command reads is refused by name.

use std::collections::BTreeMap;

use anyhow::{anyhow, bail};
use serde::Serialize;

use crate::cli::targets::{DrivenTargets, PortRefused, Troubles, open_link};
use crate::cli::{Exit, Failure, OrExit as _};
use crate::config::drive::DriveFamily;
use crate::config::drive_controller::Motors;
use crate::config::{Controller, Drives, Link};
use crate::drive::link::{LinkLine, TalkTerms};
use crate::drive::{silvermax, sixpack2};
use crate::wire::silvermax::register;
use crate::wire::silvermax::{Internal, StatusWord as _, kill_names};

/// Registers that homing writes and that stay as they are: what is kept and compared.
const SETTINGS: [u8; 6] = [
    register::DRY_BRAKE,
    register::SOFT_LIMIT_LOW,
    register::SOFT_LIMIT_HIGH,
    register::TORQUE_CLOSED,
    register::TORQUE_OPEN,
    register::ERROR_LIMITS,
];
/// The queries of a SIXpack 2: number and what it answers.
const QUERIES: [(u8, &str); 3] =
    [(0x20, "position, action and stop flag of each motor"), (0x30, "supply"), (0x43, "unit")];
/// What SilverMax commands set and no command reads.
const UNREADABLE: [&str; 6] = ["KMC", "EMT", "GOC", "SSL", "ADL", "MTT"];

/// What is asked of drives.
#[derive(Debug, Clone, Default)]
pub(super) struct DriveRegisters {
    /// Of SilverMax units.
    silvermax: Vec<u8>,
    /// Of a SIXpack 2.
    sixpack2: Vec<u8>,
}

/// A row of `register list`.
#[derive(Debug, Serialize)]
pub(super) struct DriveRegister {
    pub(super) register: String,
    pub(super) dialect: &'static str,
    pub(super) name: &'static str,
}

/// What was read of one register.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DriveValue {
    /// Unit and register, as `16.R38`; of a SIXpack 2 as `1.$20.motor0.position`.
    pub(super) register: String,
    pub(super) name: String,
    pub(super) value: i64,
    /// What it means, where a person would have to work it out.
    pub(super) says: Option<String>,
}

/// What was read of one seat.
#[derive(Debug, Clone, Default)]
pub(super) struct DriveFound {
    pub(super) values: Vec<DriveValue>,
    pub(super) faults: Vec<String>,
}

/// SilverMax registers that can be read (RRG, page 162).
fn readable() -> impl Iterator<Item = u8> {
    (0..=40).chain(200..=211)
}

/// Takes the words that name registers of drives (`R38`, `R0..40`, `$20`) out of those that name registers of controllers.
///
/// # Errors
/// What cannot be read, by name.
pub(super) fn take(words: &[String]) -> anyhow::Result<(Vec<String>, DriveRegisters)> {
    let (mut rest, mut wanted) = (Vec::new(), DriveRegisters::default());
    for word in words {
        let upper = word.to_ascii_uppercase();
        if let Some(query) = word.strip_prefix('$') {
            wanted.sixpack2.push(self::query(query)?);
        } else if let Some(range) =
            upper.strip_prefix('R').filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
        {
            wanted.silvermax.extend(registers(word, range)?);
        } else if UNREADABLE.contains(&upper.as_str()) {
            bail!(
                "{word}: a SilverMax has no command that reads it; `kinocue home` writes it, or its own program"
            );
        } else {
            rest.push(word.clone());
        }
    }
    Ok((rest, wanted))
}

fn registers(word: &str, range: &str) -> anyhow::Result<impl Iterator<Item = u8>> {
    let (first, last) = range.split_once("..").unwrap_or((range, range));
    let last = last.strip_prefix('R').unwrap_or(last);
    let none = || anyhow!("{word} is not a SilverMax register; they are R0 to R40 and R200 to R211, decimal");
    let number = |text: &str| text.parse::<u8>().map_err(|_| none());
    let (first, last) = (number(first)?, number(last)?);
    if !readable().any(|known| (first..=last).contains(&known)) {
        return Err(none());
    }
    Ok(readable().filter(move |known| (first..=last).contains(known)))
}

fn query(text: &str) -> anyhow::Result<u8> {
    match u8::from_str_radix(text, 16) {
        Ok(number) if QUERIES.iter().any(|(known, _)| *known == number) => Ok(number),
        Ok(number @ 0x10..=0x19) => {
            bail!(
                "${number:02X}: a SIXpack 2 has no command that reads its settings back; `kinocue home` writes them whole"
            )
        }
        _ => bail!("${text} is not a query of a SIXpack 2; they are $20, $30 and $43"),
    }
}

impl DriveRegisters {
    /// All that can be read.
    pub(super) fn all() -> Self {
        let named = readable().filter(|number| register::name(*number).is_some());
        Self { silvermax: named.collect(), sixpack2: QUERIES.map(|(number, _)| number).into() }
    }

    /// What is kept and compared.
    pub(super) fn settings() -> Self {
        Self { silvermax: SETTINGS.into(), sixpack2: Vec::new() }
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.silvermax.is_empty() && self.sixpack2.is_empty()
    }

    /// True if anything of it is asked of drives of that family.
    fn is_for(&self, family: DriveFamily) -> bool {
        match family {
            DriveFamily::SilverMax => !self.silvermax.is_empty(),
            DriveFamily::Sixpack2 => !self.sixpack2.is_empty(),
        }
    }

    /// As rows of a list.
    pub(super) fn rows(&self) -> Vec<DriveRegister> {
        let of_unit = |number: &u8| DriveRegister {
            register: format!("R{number}"),
            dialect: DriveFamily::SilverMax.word(),
            name: register::name(*number).unwrap_or("free"),
        };
        let of_pack = |number: &u8| DriveRegister {
            register: format!("${number:02X}"),
            dialect: DriveFamily::Sixpack2.word(),
            name: QUERIES.iter().find(|(known, _)| known == number).map_or("", |(_, name)| name),
        };
        self.silvermax.iter().map(of_unit).chain(self.sixpack2.iter().map(of_pack)).collect()
    }
}

/// Those seats of which something is asked; the others have nothing of it.
pub(super) fn asked(driven: DrivenTargets, wanted: &DriveRegisters) -> DrivenTargets {
    let is_asked =
        |one: &Controller| one.drives().is_some_and(|drives| wanted.is_for(drives.motors.family()));
    DrivenTargets { controllers: driven.controllers.into_iter().filter(is_asked).collect(), ..driven }
}

/// Reads that of each seat, link after link. What is wrong with a port is told of each of its seats.
///
/// # Errors
/// 75 where another program has a port.
pub(super) fn read(
    driven: &DrivenTargets,
    wanted: &DriveRegisters,
    troubles: &mut Troubles,
) -> Result<Vec<DriveFound>, Failure> {
    let mut found = vec![DriveFound::default(); driven.controllers.len()];
    for link in &driven.links {
        let on_it: Vec<usize> = (0..found.len())
            .filter(|index| driven.controllers[*index].drives().is_some_and(|it| it.link == link.name))
            .collect();
        if on_it.is_empty() {
            continue;
        }
        let mut line = match open_link(link) {
            Ok(line) => RegisterReader::over(line, link),
            Err(PortRefused::Taken(error)) => return Err(error).or_exit(Exit::TryAgain),
            Err(PortRefused::Other(why)) => {
                for index in on_it {
                    troubles.miss(&driven.controllers[index].name, &why);
                    found[index].faults.push(why.clone());
                }
                continue;
            }
        };
        for index in on_it {
            let controller = &driven.controllers[index];
            found[index] = line.read(controller, wanted);
            found[index].faults.iter().for_each(|why| troubles.miss(&controller.name, why));
        }
    }
    Ok(found)
}

/// The conversation with the drives of a link.
enum RegisterReader {
    SilverMax(silvermax::Talk<LinkLine>),
    Sixpack2(sixpack2::Talk<LinkLine>),
}

impl RegisterReader {
    fn over(line: LinkLine, link: &Link) -> Self {
        let terms = TalkTerms::of(link);
        match link.family {
            Some(DriveFamily::Sixpack2) => Self::Sixpack2(sixpack2::Talk::new(line, terms)),
            Some(DriveFamily::SilverMax) | None => Self::SilverMax(silvermax::Talk::new(line, terms)),
        }
    }

    fn read(&mut self, controller: &Controller, wanted: &DriveRegisters) -> DriveFound {
        let mut found = DriveFound::default();
        match (self, controller.drives().map(|drives| &drives.motors)) {
            (Self::SilverMax(talk), Some(Motors::SilverMax(units))) => {
                for unit in units {
                    for number in &wanted.silvermax {
                        match talk.register(*unit, *number) {
                            Ok(value) => found.values.push(of_unit(controller, *unit, *number, value)),
                            Err(fault) => {
                                found.faults.push(fault.to_string());
                                break;
                            }
                        }
                    }
                }
            }
            (Self::Sixpack2(talk), Some(Motors::Sixpack2 { unit, motors })) => {
                match sixpack2::look_for(talk, *unit, motors) {
                    Ok(Some(facts)) => found.values = of_pack(&facts, wanted),
                    Ok(None) => {
                        let why = format!("unit {unit} is at its power-on baud, 19,200; home it, seat empty");
                        found.faults.push(why);
                    }
                    Err(fault) => found.faults.push(fault.to_string()),
                }
            }
            _ => {}
        }
        found
    }
}

fn of_unit(controller: &Controller, unit: u8, number: u8, value: i32) -> DriveValue {
    let (high, low) = (value.cast_unsigned() >> 16, value.cast_unsigned() & 0xffff);
    let says = match number {
        register::TARGET
        | register::POSITION
        | register::INPUT_POSITION
        | register::SOFT_LIMIT_LOW
        | register::SOFT_LIMIT_HIGH => mm(controller, unit, value),
        3 => {
            let word = Internal(u16::try_from(high).unwrap_or_default());
            Some(word.names().collect::<Vec<_>>().join(", "))
        }
        register::ERRORS => Some(format!("greatest {high}, now {low} counts")),
        register::TORQUE_CLOSED | register::TORQUE_OPEN => Some(format!("hold {high}, moving {low}")),
        register::ERROR_LIMITS => Some(format!("moving {high}, holding {low} counts")),
        register::KILL_CAUSE if value != 0 => Some(kill_names(value)),
        register::CANARY if value == 0 => Some("not home, or restarted since".to_owned()),
        _ => None,
    };
    let name = register::name(number).unwrap_or("free").to_owned();
    DriveValue { register: format!("{unit}.R{number}"), name, value: value.into(), says }
}

/// Counts of a unit as its place, where the seat type says what counts are.
fn mm(controller: &Controller, unit: u8, counts: i32) -> Option<String> {
    let Drives { drive, motors: Motors::SilverMax(units), .. } = controller.drives()? else { return None };
    let axis = units.iter().position(|one| *one == unit)?;
    let of = controller.seat.own().get(axis)?;
    let sign = if drive.reverse[axis] { -1.0 } else { 1.0 };
    Some(format!("{:.2} mm", sign * f64::from(counts) * of.lead / of.pulses_per_rev))
}

fn of_pack(facts: &sixpack2::UnitFacts, wanted: &DriveRegisters) -> Vec<DriveValue> {
    let unit = facts.unit;
    let value = |register: String, name: &str, value: i64| DriveValue {
        register: format!("{unit}.{register}"),
        name: name.to_owned(),
        value,
        says: None,
    };
    let mut values = Vec::new();
    for number in &wanted.sixpack2 {
        match number {
            0x20 => values.extend(facts.motors.iter().flat_map(|motor| {
                let of = |what: &str| format!("$20.motor{}.{what}", motor.motor);
                [
                    value(of("position"), "position, microsteps", motor.position.into()),
                    value(of("action"), "action", motor.action.into()),
                    value(of("stop"), "stopped by its switch since last read", motor.was_stopped.into()),
                ]
            })),
            0x30 => {
                let says = Some(format!("{:.1} V", facts.volts));
                #[expect(clippy::cast_possible_truncation, reason = "some thousands at the most")]
                let units = (facts.volts * 22.0).round() as i64;
                values
                    .push(DriveValue { says, ..value("$30.input7".to_owned(), "supply, 22 a volt", units) });
            }
            _ => values.extend([
                value("$43.firmware".to_owned(), "firmware", facts.firmware.into()),
                value("$43.reset".to_owned(), "was reset since last read", facts.was_reset.into()),
                value("$43.celsius".to_owned(), "°C", facts.celsius.into()),
                value("$43.serial".to_owned(), "serial number", facts.serial.into()),
            ]),
        }
    }
    values
}

/// What a seat holds, to be kept: unit and register, value.
pub(super) fn kept(found: &DriveFound) -> BTreeMap<String, i64> {
    found.values.iter().map(|value| (value.register.clone(), value.value)).collect()
}

/// Seats of which no setting can be read.
pub(super) fn unreadable(driven: &DrivenTargets) -> Vec<&str> {
    let is_pack = |one: &&Controller| {
        one.drives().is_some_and(|drives| drives.motors.family() == DriveFamily::Sixpack2)
    };
    driven.controllers.iter().filter(is_pack).map(|one| one.name.as_str()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(words: &[&str]) -> Result<(Vec<String>, DriveRegisters), String> {
        let words: Vec<String> = words.iter().map(|&word| word.to_owned()).collect();
        take(&words).map_err(|error| error.to_string())
    }

    #[test]
    fn registers_of_drives_are_told_from_those_of_controllers_by_their_names() {
        let (rest, wanted) = taken(&["PA95", "R38..40", "r211", "$20", "dp", "06"]).unwrap();
        assert_eq!(rest, ["PA95", "dp", "06"]);
        assert_eq!((wanted.silvermax, wanted.sixpack2), (vec![38, 39, 40, 211], vec![0x20]));
    }

    #[test]
    fn what_no_command_reads_is_refused_by_name() {
        for (word, why) in [
            ("R41", "R0 to R40 and R200 to R211"),
            ("R41..199", "R0 to R40"),
            ("R300", "R0 to R40"),
            ("$15", "`kinocue home` writes them whole"),
            ("$CC", "they are $20, $30 and $43"),
            ("KMC", "has no command that reads it"),
        ] {
            let told = taken(&[word]).unwrap_err();
            assert!(told.contains(why), "{told}");
        }
    }
}
