//! `[[controller]]` with `address = "link:NAME"`: seats that serial drives move, and the links that they share.

mod together;

use std::sync::Arc;

use toml::de::DeTable;

use crate::channel::{self, SWITCHES};
use crate::motion::{MAX_AXES, SeatType};
use crate::plain;

pub(super) use together::{find_twins, refuse_parted_groups, settle};

use super::accept::acceptances;
use super::drive::homing::HomeWay;
use super::drive::sixpack2::Sixpack2Drive;
use super::drive::{DriveEntry, DriveFamily, SeatDrive, refuse_axes};
use super::fault::Faults;
use super::link::LinkEntry;
use super::section::{Entry, Section, did_you_mean};
use super::site::{Site, seat_of};
use super::{Connection, Controller};

/// What an address begins with that names a link.
const LINK: &str = "link:";
/// The motors of a SIXpack 2.
const MOTORS: u8 = 6;

/// The drives of a seat, and the link that they are on.
#[derive(Debug, Clone, PartialEq)]
pub struct Drives {
    /// How they move it.
    pub(crate) drive: Arc<SeatDrive>,
    /// The name of their link.
    pub(crate) link: String,
    /// The drives, axis by axis.
    pub(crate) motors: Motors,
    /// The names of seats on other links whose drives have the same numbers: theirs answer if two lines change places.
    pub(crate) twins: Vec<String>,
}

/// Which drives move the axes of a seat.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Motors {
    /// A SilverMax for each axis, by its number.
    SilverMax(Vec<u8>),
    /// A SIXpack 2, and a motor of it for each axis.
    Sixpack2 {
        /// Its number.
        unit: u8,
        /// Motors, 0 to 5.
        motors: Vec<u8>,
    },
}

impl Motors {
    /// What they are.
    pub(crate) const fn family(&self) -> DriveFamily {
        match self {
            Self::SilverMax(_) => DriveFamily::SilverMax,
            Self::Sixpack2 { .. } => DriveFamily::Sixpack2,
        }
    }

    /// The numbers of SilverMax units, axis by axis; none of others.
    pub(crate) fn units(&self) -> &[u8] {
        if let Self::SilverMax(units) = self { units } else { &[] }
    }
}

/// A controller, and the places of what is judged with its neighbours.
pub(super) struct Placed {
    pub(super) controller: Controller,
    /// False if it is out for good.
    pub(super) enabled: bool,
    link: String,
    motors: Motors,
    /// Of each of its motors, else of `units` as a whole.
    motors_at: Vec<usize>,
    unit_at: usize,
    group_at: usize,
}

/// True if the address of a controller names a link.
pub(super) fn is_on_link(table: &DeTable<'_>) -> bool {
    let address = table.get("address").and_then(|address| address.get_ref().as_str());
    address.is_some_and(|address| address.starts_with(LINK))
}

/// Reads one controller; `links` and `drives` are what it may refer to.
pub(super) fn drive_controller<'t>(
    at: usize,
    table: &'t DeTable<'t>,
    site: &Site<'_>,
    (links, drives): (&[LinkEntry<'_>], &[DriveEntry]),
    faults: &mut Faults<'_>,
) -> Option<Placed> {
    let mut section = Section::new("[[controller]]", at, table, faults);
    section.require(&["name", "seat", "dialect"]);
    let [name, row, group] = ["name", "row", "group"].map(|key| section.text(key));
    let group_at = section.get("group").map_or(at, |entry| entry.at);
    let link = link_of(&mut section, links);
    let family = family(&mut section);
    let seat_at = section.get("seat");
    let seat = seat_of(&mut section, site);
    let axis_offset = section.whole_in("axis_offset", 0..=MAX_AXES - 1).unwrap_or(0);
    let accept_findings = acceptances(&mut section);
    let enabled = section.get("enabled").and_then(|entry| entry.switch(section.faults)).unwrap_or(true);
    refuse_keys(&mut section);
    let unit_at = section.get("unit").map_or(at, |entry| entry.at);
    let axes = seat.as_ref().map(|seat| seat.axes);
    let motors = family.and_then(|family| motors(&mut section, family, axes));
    section.finish();
    let (seat, family, seat_at) = (seat?, family?, seat_at?);
    refuse_axes(seat_at, &seat, family, faults);
    let drive = drive_of(seat_at, &seat, family, drives, faults);
    let ((motors, motors_at), name, link) = (motors?, name?, link?);
    let drives =
        Drives { drive: Arc::new(drive?), link: link.clone(), motors: motors.clone(), twins: Vec::new() };
    let controller = Controller {
        group: group.unwrap_or_else(|| name.clone()),
        name,
        row,
        seat,
        connection: Connection::Link(drives),
        axis_offset,
        effects: Some(Vec::new()),
        at_most: [0.0; SWITCHES],
        estop_inputs: 0,
        belt_inputs: 0,
        accept_findings,
    };
    Some(Placed { controller, enabled, link, motors, motors_at, unit_at, group_at })
}

fn link_of(section: &mut Section<'_, '_, '_>, links: &[LinkEntry<'_>]) -> Option<String> {
    let entry = section.get("address")?;
    let name = entry.text(section.faults)?.strip_prefix(LINK)?;
    if links.iter().any(|link| link.name == name) {
        return Some(name.to_owned());
    }
    let hint = did_you_mean(name, links.iter().map(|link| link.name));
    entry.fault(section.faults, &format!("there is no [link.{}]{hint}", plain::seen(name)));
    None
}

fn family(section: &mut Section<'_, '_, '_>) -> Option<DriveFamily> {
    let entry = section.get("dialect")?;
    if matches!(entry.value.as_str(), Some("smc" | "mbox")) {
        let message = "is for UDP; on a link write \"silvermax\" or \"sixpack2\", else address = \"IP:PORT\"";
        entry.fault(section.faults, message);
        return None;
    }
    entry.choice(&DriveFamily::ALL, section.faults)
}

/// Notes what controllers have and drives have not, by name.
fn refuse_keys(section: &mut Section<'_, '_, '_>) {
    if section.get("fan_out").is_some_and(|entry| entry.value.as_str() != Some("slice")) {
        section.refuse("fan_out", "drives do not share frames; omit it");
    }
    for (key, why) in [
        ("accept", "drives have no accept code; omit it"),
        ("vibration_port_octets", "drives have no vibration frames; omit it"),
        ("wide_channel", "drives have no object channel; omit it"),
        ("belt_inputs", "kinocue reads no belts through drives; omit it"),
        (
            "estop_inputs",
            "kinocue reads no inputs of drives while it leads them; wire the emergency stop to their power, and omit it",
        ),
    ] {
        section.refuse(key, why);
    }
    if section.get("effects").is_some_and(|entry| entry.value.as_array().is_none_or(|list| !list.is_empty()))
    {
        section.refuse("effects", "drives switch no effects; give them to a controller that does");
    }
    for (_, _, output) in channel::switches() {
        section.refuse(output, "drives have no such output; give it to a controller that does");
    }
}

/// The drive of each axis, and the place of each.
fn motors(
    section: &mut Section<'_, '_, '_>,
    family: DriveFamily,
    axes: Option<usize>,
) -> Option<(Motors, Vec<usize>)> {
    match family {
        DriveFamily::SilverMax => {
            section.require(&["units"]);
            for key in ["unit", "motors"] {
                section.refuse(key, "a SilverMax is one motor; list the unit of each axis as units");
            }
            let (units, at) = numbers(section, "units", 1, 254, axes)?;
            Some((Motors::SilverMax(units), at))
        }
        DriveFamily::Sixpack2 => {
            section.require(&["unit", "motors"]);
            section
                .refuse("units", "a SIXpack 2 is one unit of six motors; write unit = 1, motors = [0, 1, 2]");
            let unit = section.whole_in("unit", 1..=254_u8);
            let (motors, at) = numbers(section, "motors", 0, MOTORS - 1, axes)?;
            Some((Motors::Sixpack2 { unit: unit?, motors }, at))
        }
    }
}

/// A list with one number for each axis.
fn numbers(
    section: &mut Section<'_, '_, '_>,
    key: &'static str,
    least: u8,
    most: u8,
    axes: Option<usize>,
) -> Option<(Vec<u8>, Vec<usize>)> {
    let entry = section.get(key)?;
    let entries = entry.array(section.faults)?;
    if let Some(axes) = axes.filter(|&axes| axes != entries.len()) {
        let message = format!("{} numbers for {axes} axes; give one for each axis", entries.len());
        entry.fault(section.faults, &message);
        return None;
    }
    entries.iter().map(|one| Some((one.whole_in(least..=most, section.faults)?, one.at))).collect()
}

/// The drive of the seat type, which has to say what this family needs.
fn drive_of(
    entry: Entry<'_>,
    seat: &SeatType,
    family: DriveFamily,
    drives: &[DriveEntry],
    faults: &mut Faults<'_>,
) -> Option<SeatDrive> {
    let name = &seat.name;
    let Some(found) = drives.iter().find(|drive| drive.seat == *name) else {
        let message = format!("{name} has no [seat.{name}.drive], which says how {} move it", family.word());
        entry.fault(faults, &message);
        return None;
    };
    let drive = found.drive.clone()?;
    let note = |faults: &mut Faults<'_>, text: String| faults.note(found.at, format!("drive: {text}"));
    match family {
        DriveFamily::SilverMax if drive.silvermax.is_none() => {
            note(
                faults,
                "a SilverMax needs torque = { hold = \"60%\", move = \"100%\", full = N }".to_owned(),
            );
        }
        DriveFamily::Sixpack2 if drive.sixpack2.is_none() => {
            note(faults, "a SIXpack 2 needs current = { peak = N }".to_owned());
        }
        _ => {}
    }
    refuse_home(&drive, family, found.at, faults);
    if let Some(why) = drive.sixpack2.as_ref().filter(|_| family == DriveFamily::Sixpack2) {
        let unclear = Sixpack2Drive::ambiguous_for(seat, drive.homing.travel_mm);
        why.too_slow_for(seat).into_iter().chain(unclear).for_each(|why| note(faults, why));
    }
    Some(drive)
}

/// Notes a way home that the family does not have.
fn refuse_home(drive: &SeatDrive, family: DriveFamily, at: usize, faults: &mut Faults<'_>) {
    let message = match (family, drive.homing.way) {
        (
            DriveFamily::SilverMax,
            HomeWay::Switch { input: None, .. } | HomeWay::Index { input: None, .. },
        ) => "home: a SilverMax needs the input of the switch, 1 to 7, as input = 1",
        (DriveFamily::Sixpack2, HomeWay::Switch { input: Some(_), .. }) => {
            "home: each motor of a SIXpack 2 has its own reference switch; omit input"
        }
        (DriveFamily::Sixpack2, HomeWay::Index { .. }) => {
            "home: a SIXpack 2 has no index pulse; use way = \"switch\""
        }
        _ => return,
    };
    faults.note(at, format!("drive: {message}"));
}
