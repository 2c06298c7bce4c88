//! Judges a controller's present errors, and if it would report the next.

use std::net::SocketAddrV4;

use super::{Check, Notes, ShowTerms, Subject};
use crate::device::survey::LISTEN;
use crate::wire::{DeviceError, Dialect, ReplyCode};

/// Reports at least this often are a beat by which a loss is noticed, ms.
const SLOWEST_BEAT_MS: u16 = 100;

/// Where the addresses of the two hosts begin that reports may go to.
const HOST: u8 = 0x20;
const SECOND_HOST: u8 = 0x25;

pub(super) fn judge(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    judge_state(subject, notes);
    if subject.controller.connection.dialect == Dialect::Smc {
        judge_reports(subject, terms, notes);
    }
}

fn judge_state(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(survey) = subject.survey else { return };
    let reported = survey.reported.error.map_or(0, |heard| heard.value);
    match survey.state {
        Some((ReplyCode::EmergencyStop, _)) if are_belts(subject) => {
            let found = "no belt is closed (x = 4), so the controller takes no motion";
            notes.add(Check::BeltsOpen, found, "close a belt before arming, or disable the seat");
        }
        Some((ReplyCode::EmergencyStop, _)) => {
            let found = "an emergency stop is in effect (x = 4)";
            notes.add(
                Check::EmergencyStopActive,
                found,
                "release the button, reset the controller, then home the seat",
            );
        }
        Some((_, DeviceError(0))) if reported == 0 => {
            add_error("runs with an error that it does not name (x = 3)", notes);
        }
        Some((_, error)) if error.0 != 0 && error.0 != reported => add_error(&error.to_string(), notes),
        _ => {}
    }
    if reported != 0 {
        add_error(&DeviceError(reported).to_string(), notes);
    }
    let drives = survey.reported.servo_errors;
    let drives =
        drives.iter().flat_map(|heard| heard.value.iter().enumerate()).filter(|(_, error)| **error != 0);
    for (axis, error) in drives {
        add_error(&format!("the drive of axis {} reports its error {error}", axis + 1), notes);
    }
}

/// True if what PA92 names are belts and nothing else.
fn are_belts(subject: &Subject<'_>) -> bool {
    let belts = subject.controller.belt_inputs;
    belts != 0 && subject.pa(0x92).is_some_and(|mask| mask & !belts == 0)
}

fn add_error(found: &str, notes: &mut Notes) {
    notes.add(
        Check::ActiveError,
        found,
        "look the error up in the manual; a reset (kinocue home) clears Err17 and Err21",
    );
}

fn judge_reports(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    match subject.pa(0x1f) {
        Some(1) | None => {}
        Some(2) => judge_second_host(subject, terms, notes),
        Some(value) => {
            let what = if value == 0 { "no status reports" } else { "no manual says where reports go" };
            notes.add(Check::StatusOff, format!("PA1f = {value}: {what}"), "set PA1f = 1 and PA1e = 100");
        }
    }
    let Some(interval) = subject.pa(0x1e) else { return };
    if interval == 0 || interval > SLOWEST_BEAT_MS {
        let what = match interval {
            0 => "reports only when an alarm begins".to_owned(),
            _ => format!("reports only every {interval} ms"),
        };
        notes.add(
            Check::StatusSlow,
            format!("PA1e = {interval}: {what}"),
            format!("set PA1e = {SLOWEST_BEAT_MS}"),
        );
    } else if report_to_here(subject, terms)
        && subject.survey.is_some_and(|survey| survey.reported.reports == 0)
    {
        let found = format!(
            "reports should come every {interval} ms (PA1e), but none came in {} ms",
            LISTEN.as_millis()
        );
        notes.add(
            Check::StatusUnheard,
            found,
            "check this machine's firewall, and whether the firmware sends 0x3101",
        );
    }
}

fn judge_second_host(subject: &Subject<'_>, terms: &ShowTerms, notes: &mut Notes) {
    let (Ok(route), Some(to)) = (&subject.route, host(subject, SECOND_HOST)) else { return };
    let here = SocketAddrV4::new(route.local, terms.frame_port);
    if to != here {
        let found = format!("PA1f = 2: reports go to {to} (PA25 to PA29), not to {here}");
        notes.add(Check::StatusElsewhere, found, "set PA1f = 1");
    }
}

/// True if its reports, if there are any, come here.
fn report_to_here(subject: &Subject<'_>, terms: &ShowTerms) -> bool {
    let to = match subject.pa(0x1f) {
        Some(1) => host(subject, HOST),
        Some(2) => host(subject, SECOND_HOST),
        _ => None,
    };
    let here = subject.route.as_ref().map(|route| SocketAddrV4::new(route.local, terms.frame_port));
    to.is_some_and(|to| here == Ok(to))
}

/// An address in four parameters, and its port in the fifth.
fn host(subject: &Subject<'_>, first: u8) -> Option<SocketAddrV4> {
    Some(SocketAddrV4::new(subject.ip(first)?, subject.pa(first + 4)?))
}
