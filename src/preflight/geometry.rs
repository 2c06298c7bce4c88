//! Compares the controller's settings of the mechanics with the cylinders of the seat type: encoder, lead, stroke.

use std::collections::BTreeMap;

use super::{Check, Notes, Subject};
use crate::motion::{AxisGeometry, AxisUnit};
use crate::wire::Dialect;

/// Lines of the encoder by PA54 (SMC manual 2.3.1).
const LINES: [f64; 2] = [5_000.0, 2_500.0];
/// Half of the unit of PA41 and PA42, mm.
const HALF_A_UNIT_MM: f64 = 0.05;
/// The rise of all axes after homing, and where it is 0 those of the first six (both manuals, 5.5).
const ALL_RISE: u8 = 0x40;
const OWN_RISES: u8 = 0x43;
const RISES: usize = 6;

pub(super) fn judge(subject: &Subject<'_>, notes: &mut Notes) {
    judge_encoder(subject, notes);
    judge_lead(subject, notes);
    judge_stroke(subject, notes);
}

/// The manual has lines and no pulses. Public programs send 10,000 pulses for a turn of what the factory has set, 5,000
/// lines, so two for each line; others count four.
fn judge_encoder(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(value) = subject.pa(0x54) else { return };
    let Some(lines) = LINES.get(usize::from(value)) else {
        let found = format!("PA54 = {value}: no manual says which encoder that is");
        return notes.add(Check::Encoder, found, "set PA54 = 0 for 5000 lines or 1 for 2500");
    };
    let seat = &subject.controller.seat;
    let told = |axis: &AxisGeometry| {
        let (name, pulses) = (&seat.name, axis.pulses_per_rev);
        format!("PA54 = {value}: an encoder of {lines} lines, but seat {name} has {pulses} pulses per turn")
    };
    let counts = |axis: &AxisGeometry, each: f64| (axis.pulses_per_rev / lines - each).abs() < 1e-6;
    let neither = cylinders(subject).find(|axis| !counts(axis, 2.0) && !counts(axis, 4.0));
    let by_four = cylinders(subject).find(|axis| counts(axis, 4.0));
    if let Some(axis) = neither {
        let remedy = format!(
            "set PA54 to the motors' encoder, or pulses_per_rev to {} or {}",
            2.0 * lines,
            4.0 * lines
        );
        let told = told(axis);
        notes.add(Check::Encoder, format!("{told}, neither two nor four for each line"), remedy);
    } else if let Some(axis) = by_four {
        let remedy = "move the empty seat a known distance, measure it, and accept this if it is right";
        let told = told(axis);
        notes.add(Check::EncoderUnsure, format!("{told}, four for each line"), remedy);
    }
}

/// The axes of the seat that are driven by a screw.
fn cylinders<'a>(subject: &Subject<'a>) -> impl Iterator<Item = &'a AxisGeometry> {
    subject.controller.seat.own().iter().filter(|axis| axis.unit == AxisUnit::Millimetre)
}

fn judge_lead(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(tenths) = subject.pa(0x41) else { return };
    let seat = &subject.controller.seat;
    let lead = f64::from(tenths) / 10.0;
    let differs = |axis: &&AxisGeometry| (lead - axis.lead).abs() > HALF_A_UNIT_MM;
    let Some(axis) = cylinders(subject).find(differs) else { return };
    let found = format!("PA41 = {tenths}: a lead of {lead} mm, but seat {} has {} mm", seat.name, axis.lead);
    let remedy = format!("set PA41 = {:.0}, or correct lead_mm of the seat type", axis.lead * 10.0);
    notes.add(Check::Lead, found, remedy);
}

/// 0 says nothing. In the SMC manual's table it is the rise of axis 1 where PA40 = 0, in its section 5.7 the stroke, as with
/// IMAX. A value that no rise has is a stroke.
fn judge_stroke(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(tenths) = subject.pa(0x42).filter(|tenths| *tenths > 0) else { return };
    let seat = &subject.controller.seat;
    let stroke = f64::from(tenths) / 10.0;
    let longest = cylinders(subject).map(AxisGeometry::stroke).fold(0.0, f64::max);
    let may_be_rise =
        subject.controller.connection.dialect == Dialect::Smc && subject.pa(ALL_RISE) == Some(0);
    if may_be_rise && stroke < longest {
        return;
    }
    if stroke < longest - HALF_A_UNIT_MM {
        let found =
            format!("PA42 = {tenths}: a stroke of {stroke} mm, but seat {} has {longest} mm", seat.name);
        let remedy = "correct stroke_mm of the seat type, or set PA42 at the controller itself";
        notes.add(Check::Stroke, found, remedy);
    } else {
        judge_rise(subject, stroke, notes);
    }
}

/// Position 0 lies a rise above the mechanical zero (IMAX manual 5.7, SMC manual 5.5 and 5.7): both have to fit the cylinder.
fn judge_rise(subject: &Subject<'_>, cylinder: f64, notes: &mut Notes) {
    let seat = &subject.controller.seat;
    let all = seat.own().iter().enumerate().filter(|(_, axis)| axis.unit == AxisUnit::Millimetre);
    // Of axes that are as far past it the first is named.
    let past = all.rev().filter_map(|(index, axis)| {
        let (register, tenths) = rise(subject, index)?;
        let rise = f64::from(tenths) / 10.0;
        let past = rise + axis.stroke() - cylinder;
        (past > HALF_A_UNIT_MM).then_some((index, axis, register, tenths, past))
    });
    let Some((index, axis, register, tenths, past)) = past.max_by(|a, b| a.4.total_cmp(&b.4)) else { return };
    let (rise, stroke) = (f64::from(tenths) / 10.0, axis.stroke());
    let found = format!(
        "PA{register:02x} = {tenths}: axis {} begins {rise} mm above its zero and moves {stroke} mm from there, {past:.1} mm past the \
         {cylinder} mm of its cylinder (PA42)",
        index + 1
    );
    let room = ((cylinder - stroke) * 10.0).floor();
    notes.add(
        Check::Rise,
        found,
        format!("set PA{register:02x} = {room} or less, or correct stroke_mm of the seat type"),
    );
}

/// Where the rise of an axis stands, and what it holds: PA40 is that of all axes, and where it is 0 each has its own.
fn rise(subject: &Subject<'_>, axis: usize) -> Option<(u8, u16)> {
    match subject.pa(ALL_RISE)? {
        0 => {
            let own = OWN_RISES + u8::try_from(axis).ok().filter(|axis| usize::from(*axis) < RISES)?;
            Some((own, subject.pa(own)?))
        }
        tenths => Some((ALL_RISE, tenths)),
    }
}

/// One seat type has one number of pulses a turn, so its controllers one encoder: tells those that differ from most.
pub(super) fn judge_together(subjects: &[Subject<'_>], all: &mut [Notes]) {
    let of = |subject: &Subject<'_>| Some((subject.controller.seat.name.clone(), subject.pa(0x54)?));
    let mut counts: BTreeMap<(String, u16), usize> = BTreeMap::new();
    for key in subjects.iter().filter_map(of) {
        *counts.entry(key).or_default() += 1;
    }
    for (subject, notes) in subjects.iter().zip(all) {
        let Some((seat, own)) = of(subject) else { continue };
        let of_seat = counts.iter().filter(|((name, _), _)| *name == seat);
        let Some(((_, most), _)) = of_seat.max_by_key(|(_, count)| **count) else { continue };
        if own != *most {
            let found = format!("PA54 = {own}, while most of seat {seat} have {most}");
            notes.add(
                Check::EncoderDiffers,
                found,
                format!("set PA54 = {most}, or give it a seat type of its own"),
            );
        }
    }
}
