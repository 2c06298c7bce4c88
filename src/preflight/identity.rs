//! Decides if a controller is the one it should be, alone at its address, and set up for its seat.

use std::collections::BTreeMap;

use super::{Check, Notes, Subject};
use crate::config::FanOut;
use crate::device::Address;
use crate::wire::Dialect;

pub(super) fn judge(subject: &Subject<'_>, notes: &mut Notes) {
    judge_address(subject, notes);
    judge_company(subject, notes);
    judge_axes(subject, notes);
    judge_mode(subject, notes);
    judge_rotary(subject, notes);
    judge_offset(subject, notes);
    if let Some(version) = version(subject) {
        notes.add(Check::Version, format!("software {version}"), "");
    }
    if subject.controller.connection.dialect == Dialect::Mbox {
        let found = "not in the IMAX manual, so not read: auto reset (PA0d), status reports (PA1e, PA1f), amplitude \
                     (PA55), encoder (PA54), bus period (PA59), analogue positions (PA60), speed of single axes (PA80 to PA85), \
                     emergency reset (PA98), outputs (PA9d), packets (DP34)";
        notes.add(Check::NotAsked, found, "");
    }
}

fn judge_address(subject: &Subject<'_>, notes: &mut Notes) {
    let address = subject.controller.connection.address;
    let (Some(ip), Some(port)) = (subject.ip(0x10), subject.pa(0x14)) else { return };
    if (ip, port) != (*address.ip(), address.port()) {
        let found = format!("is set to {ip}:{port} (PA10 to PA14), but was reached at {address}");
        notes.add(Check::Address, found, "set PA10 to PA14 to its address, or correct the configuration");
    }
}

/// Signs that somebody else is there.
fn judge_company(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(survey) = subject.survey else { return };
    let look = "look for a second controller with this address, and for another program that sends to it";
    if !survey.changed.is_empty() {
        let names: Vec<_> = survey.changed.iter().map(Address::to_string).collect();
        let found = format!("{} had two values within seconds", names.join(", "));
        notes.add(Check::Contradiction, found, look);
    }
    match survey.odds.duplicate {
        0 => {}
        1 => notes.add(Check::TwoAnswer, "a request was answered twice", look),
        count => notes.add(Check::TwoAnswer, format!("{count} answers came twice"), look),
    }
    if survey.odds.foreign > 0 {
        let found = format!("{} answers without a request", survey.odds.foreign);
        notes.add(Check::ForeignReplies, found, look);
    }
    if let Some(count) = survey.foreign_packets.filter(|count| *count > 0) {
        let found = format!("got {count} more packets (DP34) than were sent from here");
        notes.add(Check::OtherMaster, found, "end the other sender: another kinocue, player or tool");
    }
}

fn judge_axes(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(works) = subject.pa(0x02) else { return };
    let seat = &subject.controller.seat.name;
    match subject.axes {
        None => notes.add(
            Check::AxisCountOpen,
            format!("PA02 = {works}: works with {works} axes"),
            "give axes= in --to, or --cue",
        ),
        Some(axes) if axes == usize::from(works) => {}
        Some(axes) => {
            let found = format!("PA02 = {works}: works with {works} axes, but seat {seat} has {axes}");
            notes.add(Check::AxisCount, found, format!("set PA02 = {axes}, or give it another seat type"));
        }
    }
}

/// The axis that takes its place at a reset for zero, against the one that turns here.
fn judge_rotary(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(told) = subject.pa(0x03).map(usize::from) else { return };
    let seat = &subject.controller.seat;
    let own = seat.rotary_axis().map_or(0, |axis| axis + 1);
    let name = &seat.name;
    match (told, own) {
        (0, 0) => {}
        (told, own) if told == own => {
            let found = format!("PA03 = {told}: axis {told} takes its position at a reset or start for zero");
            let remedy = format!("make sure that axis {told} is at its 0 before either; then accept this");
            notes.add(Check::RotaryZero, found, remedy);
        }
        (0, own) => {
            let found = format!(
                "PA03 = 0: the controller searches for the zero of axis {own}, a rotary axis of seat {name}"
            );
            notes.add(Check::RotaryAxis, found, format!("set PA03 = {own}, or describe the axis in mm"));
        }
        (told, _) => {
            let found = format!(
                "PA03 = {told}: axis {told} is a rotary axis, whose position at a reset becomes zero"
            );
            let remedy = format!("set PA03 = {own}, or describe it: [seat.{name}.axis{told}] unit = \"deg\"");
            notes.add(Check::RotaryAxis, found, remedy);
        }
    }
}

/// 10 is the work mode (SMC manual 2.3.1); 0 that of RS-485 controllers (IMAX manual 5.2).
fn judge_mode(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(mode) = subject.pa(0x00) else { return };
    let dialect = subject.controller.connection.dialect;
    let what = match (mode, dialect) {
        (10, _) | (0, Dialect::Mbox) => return,
        (0, Dialect::Smc) => {
            let found = "PA00 = 0: the work mode of RS-485 units; that of CAN units is 10";
            let remedy = "accept it if this is an RS-485 unit; otherwise have the integrator set PA00 = 10";
            return notes.add(Check::WorkModeOpen, found, remedy);
        }
        (1, _) => "manual test",
        (2 | 12, _) => "test",
        (11, Dialect::Smc) => "effects",
        (11, Dialect::Mbox) => "CAN inputs and outputs",
        _ => "no manual has such a mode",
    };
    let remedy = match dialect {
        Dialect::Smc => "have the integrator set the work mode, PA00 = 10",
        Dialect::Mbox => "have the integrator set the work mode, PA00 = 0 for RS-485 or 10 for CAN",
    };
    notes.add(Check::WorkMode, format!("PA00 = {mode}: {what}"), remedy);
}

fn judge_offset(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(offset) = subject.pa(0x95) else { return };
    let (word, wanted) = match subject.controller.connection.fan_out {
        FanOut::Slice => ("slice", 0),
        FanOut::Shared => ("shared", subject.controller.axis_offset),
    };
    if usize::from(offset) != wanted {
        let found = format!(
            "PA95 = {offset}: takes axes from {} on, but fan_out = {word} means PA95 = {wanted}",
            u32::from(offset) + 1
        );
        notes.add(Check::AxisOffset, found, format!("set PA95 = {wanted}"));
    }
}

/// Version and minor version. The IMAX manual has something else where SMC controllers have the minor one.
fn version(subject: &Subject<'_>) -> Option<String> {
    let (major, minor) = (subject.register(Address::Dp(0xff))?, subject.register(Address::Dp(0xfe)));
    Some(match (subject.controller.connection.dialect, minor) {
        (Dialect::Smc, Some(minor)) => format!("{major}.{minor}"),
        _ => major.to_string(),
    })
}

/// What only shows when controllers are held against each other.
pub(super) fn judge_together(subjects: &[Subject<'_>], all: &mut [Notes]) {
    for (index, subject) in subjects.iter().enumerate() {
        let twin = |other: &&Subject<'_>| {
            other.controller.connection.address == subject.controller.connection.address
                || mac(subject).is_some_and(|own| mac(other) == Some(own))
        };
        let others = subjects[..index].iter().chain(&subjects[index + 1..]);
        let twins: Vec<&str> = others.filter(twin).map(|other| other.controller.name.as_str()).collect();
        if !twins.is_empty() {
            let found = format!("has the same address, or hardware address, as {}", twins.join(", "));
            all[index].add(Check::DuplicateAddress, found, "give each controller its own (PA10 to PA1b)");
        }
    }
    judge_versions(subjects, all);
}

/// Those that differ from what most of their dialect have.
fn judge_versions(subjects: &[Subject<'_>], all: &mut [Notes]) {
    let of = |subject: &Subject<'_>| {
        version(subject).map(|version| (subject.controller.connection.dialect == Dialect::Smc, version))
    };
    let mut counts: BTreeMap<(bool, String), usize> = BTreeMap::new();
    for key in subjects.iter().filter_map(of) {
        *counts.entry(key).or_default() += 1;
    }
    for (subject, notes) in subjects.iter().zip(all) {
        let Some((smc, own)) = of(subject) else { continue };
        let same_dialect = counts.iter().filter(|((dialect, _), _)| *dialect == smc);
        let Some(((_, most), _)) = same_dialect.max_by_key(|(_, count)| **count) else { continue };
        if own != *most {
            let found = format!("software {own}, but most have {most}");
            notes.add(Check::VersionDiffers, found, "test it by itself, its emergency stop first");
        }
    }
}

/// The hardware address, where the controller tells one.
fn mac(subject: &Subject<'_>) -> Option<[u16; 6]> {
    let mut mac = [0; 6];
    for (byte, number) in mac.iter_mut().zip(0x16..) {
        *byte = subject.pa(number)?;
    }
    (mac != [0; 6]).then_some(mac)
}
