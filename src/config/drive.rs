//! `[seat.NAME.drive]`: what a type of seat is beyond its axes where serial drives move it: how it finds its zero, how strong its
//! motors are, what is a fault.

use std::sync::Arc;

use crate::motion::{AxisGeometry, AxisUnit, MAX_AXES, SeatType};

use super::fault::Faults;
use super::level::level;
use super::section::{Entry, Section};

pub(crate) mod homing;
pub(crate) mod sixpack2;
#[cfg(test)]
mod tests;

use homing::DriveHoming;
use sixpack2::Sixpack2Drive;

/// The families of serial drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DriveFamily {
    /// SilverMax servos, one unit for each axis.
    SilverMax,
    /// SIXpack 2, six stepper motors on one unit.
    Sixpack2,
}

impl DriveFamily {
    /// All of them, by their words.
    pub(crate) const ALL: [(&'static str, Self); 2] =
        [(Self::SilverMax.word(), Self::SilverMax), (Self::Sixpack2.word(), Self::Sixpack2)];

    /// What `dialect` calls it.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::SilverMax => "silvermax",
            Self::Sixpack2 => "sixpack2",
        }
    }
}

/// How far drives may be beside a cue, where nobody says more, mm.
pub(crate) const MAX_DEVIATION_MM: f64 = 0.5;

/// How drives move a type of seat.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SeatDrive {
    /// Axes whose positive pulses go down.
    pub(crate) reverse: [bool; MAX_AXES],
    /// How an axis finds its zero.
    pub(crate) homing: DriveHoming,
    /// How far outside the stroke the soft limits lie, mm.
    pub(crate) margin_mm: f64,
    /// The farthest that its drives may be beside a cue, mm, their own error apart.
    pub(crate) max_deviation_mm: f64,
    /// Level of vibration on its drives, 0 to 1, on top of all that operators set.
    pub(crate) vibration: f64,
    /// What only a SilverMax has; `None` if its torque is not said.
    pub(crate) silvermax: Option<SilverMaxDrive>,
    /// What only a SIXpack 2 has; `None` if its current is not said.
    pub(crate) sixpack2: Option<Sixpack2Drive>,
}

/// Settings of SilverMax units.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SilverMaxDrive {
    /// How strong it is.
    pub(crate) torque: Torque,
    /// What gravity takes (GOC), in units of torque.
    pub(crate) gravity: i32,
    /// How far the motor may be from its course while it moves, mm.
    pub(crate) max_error_mm: f64,
    /// The same at rest.
    pub(crate) hold_error_mm: f64,
    /// How long the motor has to come to rest, ms.
    pub(crate) settle_ms: u32,
}

/// Torque of a motor, 0 to 1 of its full torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Torque {
    /// At rest.
    pub(crate) hold: f64,
    /// Moving.
    pub(crate) moving: f64,
    /// What the drive calls full (TQL, command reference page 74).
    pub(crate) full: u32,
}

/// The table of one seat type, and where it stands.
pub(super) struct DriveEntry {
    pub(super) seat: String,
    pub(super) at: usize,
    /// `None` if it has faults.
    pub(super) drive: Option<SeatDrive>,
}

/// Reads the tables of all seat types that are sound.
pub(super) fn seat_drives(
    seats: Entry<'_>,
    sound: &[Arc<SeatType>],
    faults: &mut Faults<'_>,
) -> Vec<DriveEntry> {
    let Some(table) = seats.value.as_table() else { return Vec::new() };
    let read = |seat: &Arc<SeatType>| {
        let value = table.get(seat.name.as_str())?.get_ref().as_table()?.get("drive")?;
        let entry = Entry::new("drive", value);
        let drive = seat_drive(seat, entry, faults);
        Some(DriveEntry { seat: seat.name.clone(), at: entry.at, drive })
    };
    sound.iter().filter_map(read).collect()
}

fn seat_drive(seat: &SeatType, entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<SeatDrive> {
    let mut section =
        Section::new(format!("[seat.{}.drive]", seat.name), entry.at, entry.table(faults)?, faults);
    section.require(&["home"]);
    let reverse = reverse(&mut section, seat.axes);
    let margin_mm = section.number_in("margin_mm", 0.1..=10.0).unwrap_or(1.0);
    let max_deviation_mm = section.number_in("max_deviation_mm", 0.01..=10.0).unwrap_or(MAX_DEVIATION_MM);
    let vibration = level(&mut section, "vibration").unwrap_or(1.0);
    let homing = section.get("home").and_then(|entry| homing::homing(entry, seat.own(), section.faults));
    let silvermax = silvermax(&mut section);
    let sixpack2 = sixpack2::sixpack2(&mut section);
    section.finish();
    Some(SeatDrive {
        reverse,
        homing: homing?,
        margin_mm,
        max_deviation_mm,
        vibration,
        silvermax: silvermax?,
        sixpack2: sixpack2?,
    })
}

/// Which axes go the other way, from a list that counts from 1.
fn reverse(section: &mut Section<'_, '_, '_>, axes: usize) -> [bool; MAX_AXES] {
    let mut reverse = [false; MAX_AXES];
    let entries = section.get("reverse").and_then(|entry| entry.array(section.faults));
    for entry in entries.unwrap_or_default() {
        if let Some(axis) = entry.whole_in(1..=axes, section.faults) {
            let is_there = std::mem::replace(&mut reverse[axis - 1], true);
            if is_there {
                entry.fault(section.faults, &format!("axis {axis} stands there twice"));
            }
        }
    }
    reverse
}

/// What it says of SilverMax units, which may be nothing; `None` if that has faults.
fn silvermax(section: &mut Section<'_, '_, '_>) -> Option<Option<SilverMaxDrive>> {
    let torque_at = section.get("torque");
    let gravity = section.whole_in("gravity", -32_767..=32_767).unwrap_or(0);
    let max_error_mm = section.number_in("max_error_mm", 0.1..=50.0).unwrap_or(3.0);
    let hold_error_mm = section.number_in("hold_error_mm", 0.05..=50.0).unwrap_or(max_error_mm.min(1.0));
    let settle_ms = section.whole_in("settle_ms", 1..=3_000).unwrap_or(120);
    if let Some(entry) = section.get("hold_error_mm").filter(|_| hold_error_mm > max_error_mm) {
        let message = format!("{hold_error_mm} is over max_error_mm, {max_error_mm}; at rest less is wrong");
        entry.fault(section.faults, &message);
    }
    let Some(torque_at) = torque_at else { return Some(None) };
    let torque = torque(torque_at, section.faults)?;
    Some(Some(SilverMaxDrive { torque, gravity, max_error_mm, hold_error_mm, settle_ms }))
}

fn torque(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Torque> {
    let mut section = Section::new("torque", entry.at, entry.table(faults)?, faults);
    section.require(&["hold", "move", "full"]);
    let [hold, moving] = ["hold", "move"].map(|key| share(&mut section, key));
    let full = section.whole_in("full", 1..=32_767);
    section.finish();
    Some(Torque { hold: hold?, moving: moving?, full: full? })
}

/// A share of what a motor can do, above 0.
fn share(section: &mut Section<'_, '_, '_>, key: &'static str) -> Option<f64> {
    let share = level(section, key)?;
    if share > 0.0 {
        return Some(share);
    }
    let entry = section.get(key)?;
    entry.fault(section.faults, "0 holds nothing up: the seat would drop; give more");
    None
}

/// Notes an axis that drives cannot be asked for.
pub(super) fn refuse_axes(entry: Entry<'_>, seat: &SeatType, family: DriveFamily, faults: &mut Faults<'_>) {
    if let Some(turns) = seat.own().iter().position(|axis| axis.unit == AxisUnit::Degree) {
        let message = format!(
            "axis {} of {} turns; serial drives move cylinders only: give the turntable a controller of its own",
            turns + 1,
            seat.name
        );
        entry.fault(faults, &message);
    }
    if family == DriveFamily::SilverMax
        && let Some(fast) = seat.own().iter().find(|axis| axis.needed_rpm() > SILVERMAX_RPM)
    {
        let AxisGeometry { max_velocity, lead, .. } = fast;
        let message = format!(
            "{max_velocity} mm/s at a lead of {lead} mm are {:.0} rpm, over {SILVERMAX_RPM:.0}, the most of a SilverMax; \
             lower max_velocity_mm_s of {}",
            fast.needed_rpm(),
            seat.name
        );
        entry.fault(faults, &message);
    }
}

/// What a SilverMax calls full velocity (command reference page 11).
const SILVERMAX_RPM: f64 = 4_000.0;
