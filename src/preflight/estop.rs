//! The controller's own emergency stop: whether one press of one button stops the seat, at once, and keeps it stopped.
//! It is no safety input; people are protected by hard wiring.

use super::{Check, Notes, Subject};
use crate::wire::Dialect;

/// The longest filter of inputs that still stops soon enough, ms.
const LONGEST_FILTER_MS: u16 = 50;

/// Bits of PA90 (SMC manual 2.3.1; bit 2 IMAX manual 2.3.1).
const ESTOP: u16 = 1;
const JOG: u16 = 0b110;
const RESET: u16 = 0b1000;

pub(super) fn judge(subject: &Subject<'_>, notes: &mut Notes) {
    if let Some(functions) = subject.pa(0x90).filter(|functions| functions & ESTOP == 0) {
        let found = format!(
            "PA90 = {functions}: bit 0 is clear, so the controller ignores its emergency stop inputs"
        );
        notes.add(Check::EstopDisabled, found, format!("set PA90 = {}", functions | ESTOP));
    }
    if !judge_belts(subject, notes) {
        judge_inputs(subject, notes);
        judge_action(subject, notes);
    }
    judge_filter_and_release(subject, notes);
    if subject.pa(0x04) == Some(1) {
        let found =
            "PA04 = 1: open inputs count as not pressed, so a broken wire to the button goes unnoticed";
        notes.add(
            Check::EstopWire,
            found,
            "wire a normally closed button and set PA04 = 0, or test the button before each show",
        );
    }
    judge_other_functions(subject, notes);
}

/// The second example of the manual's section 5.6: the one function of inputs is the belts'. Says whether it is.
fn judge_belts(subject: &Subject<'_>, notes: &mut Notes) -> bool {
    let belts = subject.controller.belt_inputs;
    let Some(mask) = subject.pa(0x92).filter(|mask| mask & belts != 0) else { return false };
    let then = match subject.pa(0x91) {
        Some(0) => "the seat holds once all of them are open, and moves on by itself when one is closed",
        Some(1) => {
            "the seat moves to zero once all of them are open, and moves on by itself when one is closed"
        }
        Some(2) => "the seat holds once all of them are open, until a reset",
        _ => "no manual says what the seat does once all of them are open",
    };
    let found = format!(
        "PA92 = {mask}: {} are belts (belt_inputs), so no input is an emergency stop; {then}",
        inputs(mask)
    );
    let remedy = "accept it if the emergency stop is hard-wired; otherwise move the belts to inputs that PA92 does not name";
    notes.add(Check::EstopIsBelts, found, remedy);
    true
}

fn judge_inputs(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(mask) = subject.pa(0x92) else { return };
    match mask.count_ones() {
        0 => notes.add(
            Check::EstopNoInput,
            "PA92 = 0: no input is an emergency stop, so pressing one does nothing",
            "set PA92 to the one input of the button: 1 for X01",
        ),
        1 => {}
        _ => {
            let found = format!(
                "PA92 = {mask}: all of {} must be active at once, so pressing one button does nothing",
                inputs(mask)
            );
            let remedy = format!(
                "wire the buttons in series to one input and name only that in PA92; if these are belts, write \
                 belt_inputs = [{}]",
                numbers(mask)
            );
            notes.add(Check::EstopAnd, found, remedy);
        }
    }
    let watched = subject.controller.estop_inputs;
    let mbox = subject.controller.connection.dialect == Dialect::Mbox;
    let remedy = format!("write estop_inputs = [{}] for this controller", numbers(mask));
    if watched != 0 && watched != mask {
        let found =
            format!("estop_inputs watches {}, but PA92 = {mask} stops at {}", inputs(watched), inputs(mask));
        notes.add(Check::EstopUnwatched, found, remedy);
    } else if watched == 0 && mbox && mask != 0 {
        let found =
            "replies of MBOX controllers do not report an emergency stop, and estop_inputs names no input";
        notes.add(Check::EstopUnwatched, found, remedy);
    }
}

/// Only 2 ends in a reset; the parameter table of the SMC manual lists 0 and 1 alone, its section 5.6 all three.
fn judge_action(subject: &Subject<'_>, notes: &mut Notes) {
    let remedy = "set PA91 = 2 (hold until a reset), then try it on this firmware";
    match subject.pa(0x91) {
        None | Some(2) => {}
        Some(0) => {
            let found = "PA91 = 0: the seat holds when the button is pressed, and moves on by itself when it is released";
            notes.add(Check::EstopResumes, found, remedy);
        }
        Some(1) => {
            let found = "PA91 = 1: the seat moves to zero when the button is pressed, and moves on by itself when it is \
                         released";
            notes.add(Check::EstopReturns, found, remedy);
        }
        Some(value) => {
            let found = format!("PA91 = {value}: no manual says what the seat does in an emergency stop");
            notes.add(Check::EstopAction, found, remedy);
        }
    }
}

fn judge_filter_and_release(subject: &Subject<'_>, notes: &mut Notes) {
    if let Some(ms) = subject.pa(0x93).filter(|ms| *ms > LONGEST_FILTER_MS) {
        let found = format!("PA93 = {ms}: the seat moves on for {ms} ms after the button is pressed");
        notes.add(Check::EstopFilter, found, format!("set PA93 = {LONGEST_FILTER_MS} or less"));
    }
    match (subject.pa(0x94), subject.pa(0x07)) {
        (Some(0), _) => {
            let found = "PA94 = 0: possibly no limit on the speed at which the seat leaves an emergency stop";
            notes.add(Check::EstopRelease, found, "set PA94 to a slow speed, such as 300 rpm");
        }
        (Some(release), Some(most)) if most != 0 && release >= most => {
            let found =
                format!("PA94 = {release}: the seat leaves an emergency stop at full speed (PA07 = {most})");
            notes.add(Check::EstopReleaseFast, found, "set PA94 to a slow speed, such as 300 rpm");
        }
        _ => {}
    }
}

/// What else inputs can do to the seat.
fn judge_other_functions(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(functions) = subject.pa(0x90) else { return };
    if functions & JOG != 0 {
        let found = format!("PA90 = {functions}: inputs may jog the seat by hand");
        notes.add(Check::EstopJog, found, format!("set PA90 = {}", functions & !JOG));
    }
    let (Some(reset), Some(stop)) = (subject.pa(0x98), subject.pa(0x92)) else { return };
    if functions & RESET == 0 || reset == 0 {
        return;
    }
    let remedy =
        format!("set PA90 = {}, or give the reset an input that only staff can reach", functions & !RESET);
    if reset & stop != 0 {
        let found = format!(
            "PA98 = {reset} and PA92 = {stop} share {}: what stops the seat also resets it",
            inputs(reset & stop)
        );
        notes.add(Check::EstopResetShared, found, remedy);
    } else {
        let found = format!(
            "PA90 bit 3 and PA98 = {reset}: {} resets the controller, and the seat moves",
            inputs(reset)
        );
        notes.add(Check::EstopResetInput, found, remedy);
    }
}

/// The inputs of a mask: `X01 and X03`.
fn inputs(mask: u16) -> String {
    let names: Vec<_> = set(mask).map(|input| format!("X{input:02}")).collect();
    names.join(" and ")
}

fn numbers(mask: u16) -> String {
    set(mask).map(|input| input.to_string()).collect::<Vec<_>>().join(", ")
}

fn set(mask: u16) -> impl Iterator<Item = u16> {
    (1..=16).filter(move |input| mask & (1 << (input - 1)) != 0)
}
