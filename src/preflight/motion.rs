//! How a controller takes frames: what it does with their Time, with a backlog, with silence, and with positions.

use super::{Check, Notes, ShowTerms, Subject};
use crate::plan::slow_park_time;
use crate::wire::Dialect;

pub(super) fn judge(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    judge_interval(subject, terms, notes);
    if let Some(after) = subject.pa(0x0d).filter(|after| *after != 0) {
        let found = format!(
            "PA0d = {after}: resets by itself {after} after the last frame (probably ms; no manual says)"
        );
        notes.add(Check::AutoReset, found, "set PA0d = 0");
    }
    match subject.pa(0x06) {
        Some(1) => {
            let found = "PA06 = 1: shortens Time when more than two frames are queued";
            notes.add(
                Check::FastForward,
                found,
                "accept it by name, or set PA06 = 0 and watch the queue (DP48, DP49)",
            );
        }
        Some(value @ 2..) => {
            let found = format!("PA06 = {value}: no manual says what it does with a backlog");
            notes.add(Check::FastForwardUnknown, found, "set PA06 = 0 or 1");
        }
        _ => {}
    }
    judge_amplitude(subject, notes);
    judge_signed(subject, notes);
    judge_source(subject, notes);
    judge_bus(subject, terms, notes);
    judge_delay(subject, terms, notes);
    if let Some(value) = subject.pa(0x0e).filter(|value| *value != 0) {
        let found = format!("PA0e = {value}: a reset goes to zero without a search, even if zero was lost");
        notes.add(Check::HomesUnsearched, found, "set PA0e = 0");
    }
}

/// Whatever else than the Time and the positions of frames it goes by.
fn judge_source(subject: &Subject<'_>, notes: &mut Notes) {
    // SMC has another meaning for it: a time for commands that have none. Ours always have one.
    let imax = subject.controller.connection.dialect == Dialect::Mbox;
    if let Some(value) = subject.pa(0x0a).filter(|value| imax && *value != 0) {
        let found = format!("PA0a = {value}: ignores the Time of frames and uses their arrival times");
        notes.add(Check::TimeIgnored, found, "set PA0a = 0");
    }
    if let Some(value) = subject.pa(0x60).filter(|value| *value != 0) {
        let factor = subject.pa(0x61).zip(subject.pa(0x62));
        let factor = factor.map_or_else(String::new, |(over, under)| format!(", times {over}/{under}"));
        let found = format!("PA60 = {value}: positions come from the analogue inputs{factor}");
        notes.add(Check::AnaloguePosition, found, "set PA60 = 0");
    }
}

/// Frames that come faster than the drives are told wait in the controller.
fn judge_bus(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    let Some(ms) = subject.pa(0x59) else { return };
    let period = 1e3 / terms.rate_hz;
    if f64::from(ms) > period {
        let found = format!(
            "PA59 = {ms}: commands the drives every {ms} ms at most, but frames come every {period:.1} ms"
        );
        let remedy =
            format!("set PA59 = 0, or play at {:.0} Hz or less", (1e3 / f64::from(ms)).floor().max(1.0));
        notes.add(Check::BusPeriod, found, remedy);
    }
}

/// The filter of an IMAX controller has to be off where positions go below 0 (IMAX manual 5.7).
fn judge_signed(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(depth) = subject.pa(0x51).filter(|depth| *depth != 0) else { return };
    let below = subject.controller.seat.own().iter().position(|axis| axis.low < 0.0);
    if let Some(axis) = below.filter(|_| subject.controller.connection.dialect == Dialect::Mbox) {
        let found = format!("PA51 = {depth}: filters positions, and those of axis {} go below 0", axis + 1);
        notes.add(Check::SignedFilter, found, "set PA51 = 0");
    }
}

/// By how much the seat is behind its frames. No manual gives the formula of the filter, nor the unit of the delays: the
/// least and the most that they may mean.
fn judge_delay(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    let value = |number| subject.pa(number).unwrap_or(0);
    let (what, least, most) = match subject.controller.connection.dialect {
        Dialect::Mbox => {
            // 0 is no filter and 1 smooths nothing (IMAX manual 5.8).
            let depth = value(0x51).min(16);
            let frames = [depth.saturating_sub(1), (1_u16 << depth.saturating_sub(1)).saturating_sub(1)];
            let [least, most] = frames.map(|frames| f64::from(frames) * 1e3 / terms.rate_hz);
            (format!("PA51 = {} (and PA50 = {}): with this filter", value(0x51), value(0x50)), least, most)
        }
        Dialect::Smc => {
            let (delay, smooth) = (f64::from(value(0x4c)), f64::from(value(0x4d)));
            let what = format!("PA4c = {delay} and PA4d = {smooth}: if these are ms,");
            (what, delay + smooth / 2.0, delay + smooth)
        }
    };
    if most <= 0.0 {
        return;
    }
    let span = if least < most { format!("{least:.0} to {most:.0} ms") } else { format!("{most:.0} ms") };
    let remedy = match subject.controller.connection.dialect {
        Dialect::Mbox => "set PA51 = 0",
        Dialect::Smc => "set PA4c = 0 and PA4d = 0",
    };
    let remedy = format!("{remedy}; or measure the delay, and set a negative trim of that size");
    notes.add(Check::MotionLate, format!("{what} motion comes {span} later than the film"), remedy);
}

/// Every Time that is sent has to be executed as it is.
fn judge_interval(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    let Some(most) = subject.pa(0x0b) else { return };
    if most == 0 {
        if subject.controller.connection.dialect == Dialect::Mbox {
            let found = "PA0b = 0: no limit in the SMC manual, unexplained in that of this controller";
            notes.add(Check::IntervalUnlimited, found, "set PA0b = 3000");
        }
        return;
    }
    let frame = terms.frame_time_ms();
    let (slow, _) = slow_park_time(&subject.controller.seat);
    let (longest, what) = match frame.max(slow) {
        longest if longest == frame => (longest, "frames of the show"),
        longest => (longest, "the frame that brings the seat to its park pose"),
    };
    if u32::from(most) < longest {
        let found = format!("PA0b = {most}: {what}, of {longest} ms, are cut to {most} ms and become faster");
        let found = if frame < slow { found.replace("are cut", "is cut") } else { found };
        notes.add(Check::IntervalLimit, found, format!("set PA0b = {}", longest.max(3_000)));
    }
}

/// 0 is the whole amplitude, 1 to 9 are tenths of it (SMC manual 2.3.1).
fn judge_amplitude(subject: &Subject<'_>, notes: &mut Notes) {
    let found = match subject.pa(0x55) {
        None | Some(0) => return,
        Some(tenths @ 1..=9) => format!("PA55 = {tenths}: plays every position at {tenths}0 %"),
        Some(value) => format!("PA55 = {value}: no manual says how far the seat moves"),
    };
    notes.add(Check::Amplitude, found, "set PA55 = 0, and use the level to reduce motion");
}
