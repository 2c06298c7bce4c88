//! How a controller takes frames: what it does with their Time, with a backlog, with silence, and with positions.

use super::{Check, Notes, Subject, Terms};
use crate::plan::homing_time;
use crate::wire::Dialect;

pub(super) fn judge(subject: &Subject<'_>, terms: &Terms, notes: &mut Notes) {
    judge_interval(subject, terms, notes);
    if let Some(after) = subject.pa(0x0d).filter(|after| *after != 0) {
        let found = format!(
            "PA0d = {after}: resets by itself {after} after the last frame (probably ms; no manual says)"
        );
        notes.add(Check::AutoReset, found, "set PA0d = 0");
    }
    match subject.pa(0x06) {
        Some(1) => {
            let found = "PA06 = 1: hurries when more than two frames wait";
            notes.add(
                Check::FastForward,
                found,
                "accept it by name, or set PA06 = 0 and watch the queue (DP48, DP49)",
            );
        }
        Some(value @ 2..) => {
            let found = format!("PA06 = {value}: no manual says what this does with a backlog");
            notes.add(Check::FastForwardUnknown, found, "set PA06 = 0 or 1");
        }
        _ => {}
    }
    judge_amplitude(subject, notes);
    if subject.pa(0x9d) == Some(1) {
        let found = "PA9d = 1: ignores the outputs of frames, so effects never switch";
        notes.add(Check::OutputsIgnored, found, "set PA9d = 0, or take its effects out of the configuration");
    }
}

/// Every Time that is sent has to be executed as it is.
fn judge_interval(subject: &Subject<'_>, terms: &Terms, notes: &mut Notes) {
    let Some(most) = subject.pa(0x0b) else { return };
    if most == 0 {
        if subject.controller.dialect == Dialect::Mbox {
            let found = "PA0b = 0: no limit by the SMC manual, unexplained by this controller's own";
            notes.add(Check::IntervalUnlimited, found, "set PA0b = 3000");
        }
        return;
    }
    let frame = terms.frame_time_ms();
    let (slow, _) = homing_time(subject.controller.seat.stroke_mm);
    let (longest, what) = match frame.max(slow) {
        longest if longest == frame => (longest, "frames of the show"),
        longest => (longest, "the frame that brings the seat to its park pose"),
    };
    if u32::from(most) < longest {
        let found =
            format!("PA0b = {most}: {what}, of {longest} ms, are cut to {most} ms and so made faster");
        let found = if frame < slow { found.replace("are cut", "is cut") } else { found };
        notes.add(Check::IntervalLimit, found, format!("set PA0b = {}", longest.max(3_000)));
    }
}

/// 0 is the whole amplitude, 1 to 9 are tenths of it (SMC manual 2.3.1).
fn judge_amplitude(subject: &Subject<'_>, notes: &mut Notes) {
    let found = match subject.pa(0x55) {
        None | Some(0) => return,
        Some(tenths @ 1..=9) => format!("PA55 = {tenths}: plays every position at {tenths}0 %"),
        Some(value) => format!("PA55 = {value}: no manual says how far the seat then moves"),
    };
    notes.add(Check::Amplitude, found, "set PA55 = 0, and use level to play with less");
}
