//! Judges if a controller answers, how fast and how reliably, and if it told all that was asked.

use std::time::Duration;

use super::{Check, Notes, Subject, wanted};
use crate::device::change::dialect_name;
use crate::device::survey::{ROUND_TIMEOUT, Survey};
use crate::device::{Address, Fault, PRINTED, table};
use crate::wire::Dialect;

/// Answers slower than this are noted.
const SLOW: Duration = Duration::from_millis(20);
/// Firmware may lack a register or two.
const FEW: usize = 3;
/// Of 20 reads: more than a tenth lost is what a show calls degraded.
const LOST: usize = 2;

/// Median and maximum of round trips; `None` if there are none.
#[must_use]
pub(crate) fn round_trip(took: &[Duration]) -> Option<(Duration, Duration)> {
    let mut sorted = took.to_vec();
    sorted.sort_unstable();
    Some((*sorted.get(sorted.len().checked_sub(1)? / 2)?, *sorted.last()?))
}

pub(super) fn judge(subject: &Subject<'_>, notes: &mut Notes) {
    let Some(survey) = subject.survey else { return };
    let faults = || survey.silent.iter().chain(&survey.unread);
    if faults().any(Fault::is_foreign) {
        let remedy = "leave it out, and send a capture (`kinocue decode --dialect imax`) to the maintainers of this program";
        notes.add(Check::Dialect, PRINTED, remedy);
        return;
    }
    if let Some(fault) = &survey.silent {
        notes.add(
            Check::NoAnswer,
            silence(fault),
            "check power, cable, address and port; PA15 = 1; PA20 to PA24 = this machine",
        );
        return;
    }
    let missing = missing(subject);
    match other_dialect(subject, survey, &missing) {
        Some((found, other)) => notes.add(
            Check::Dialect,
            found,
            format!(
                "write dialect = \"{}\" for this controller, and run preflight again; if its integrator says otherwise, do not play to it",
                dialect_name(other)
            ),
        ),
        None => judge_unread(&missing, &survey.unread, notes),
    }
    if let Some(value) = subject.pa(0x15).filter(|value| *value != 1) {
        notes.add(
            Check::RepliesDisabled,
            format!("PA15 = {value}: replies are switched off"),
            "set PA15 = 1",
        );
    }
    let missed = survey.rounds.saturating_sub(survey.round_trips.len());
    if missed > 0 {
        let check = if missed > LOST { Check::RepliesLost } else { Check::RepliesMissed };
        let ms = ROUND_TIMEOUT.as_millis();
        let late = match survey.odds.late {
            0 => String::new(),
            late => format!("; {late} answers came later"),
        };
        let found = format!("{missed} of {} reads had no answer within {ms} ms{late}", survey.rounds);
        notes.add(check, found, "check cable, switch and load of the network");
    }
    if survey.odds.malformed > 0 {
        let found = format!("{} datagrams from its address were not messages", survey.odds.malformed);
        notes.add(
            Check::BrokenReplies,
            found,
            "check cable and switch, and that no other device has this address",
        );
    }
    if let Some((median, most)) = round_trip(&survey.round_trips).filter(|(_, most)| *most > SLOW) {
        let ms = |took: Duration| took.as_secs_f64() * 1e3;
        let found =
            format!("the slowest answer took {:.1} ms, half of them over {:.1} ms", ms(most), ms(median));
        notes.add(Check::SlowReplies, found, "check switch and load of the network");
    }
}

fn silence(fault: &Fault) -> String {
    match fault {
        Fault::Silent { odd: Some(odd), .. } => format!("does not answer; {odd}"),
        Fault::Silent { tries, timeout, .. } => {
            format!("does not answer: {tries} tries of {} ms", timeout.as_millis())
        }
        other => format!("does not answer: {other}"),
    }
}

/// What was asked and not told.
fn missing(subject: &Subject<'_>) -> Vec<Address> {
    let all = wanted(subject.controller).into_iter();
    all.filter(|address| subject.register(*address).is_none()).collect()
}

/// Of which other dialect it is, and what shows that: its reports, or that it refuses all that this dialect alone has.
fn other_dialect(subject: &Subject<'_>, survey: &Survey, missing: &[Address]) -> Option<(String, Dialect)> {
    let own = subject.controller.connection.dialect;
    let name = dialect_name;
    if let Some(other) = survey.speaks.filter(|speaks| *speaks != own) {
        let found =
            format!("reports its state as {} controllers do, but dialect = \"{}\"", name(other), name(own));
        return Some((found, other));
    }
    let is_own = |address: &Address| !table().has(*address, Dialect::Mbox);
    let refuses = survey.unread.iter().any(Fault::refused) && missing.len() > FEW;
    if own == Dialect::Mbox || survey.speaks.is_some() || !refuses || !missing.iter().all(is_own) {
        return None;
    }
    let found = format!(
        "answers as mbox controllers do, but dialect = \"smc\": it refuses {}, which only smc controllers have",
        runs(missing)
    );
    Some((found, Dialect::Mbox))
}

/// What was asked and not told makes everything that hangs on it unknown.
fn judge_unread(missing: &[Address], faults: &[Fault], notes: &mut Notes) {
    if missing.is_empty() {
        return;
    }
    let why = faults.iter().find(|fault| !matches!(fault, Fault::Unasked { .. }));
    let why = why.map_or_else(String::new, |fault| format!(": {fault}"));
    let found = format!("{} could not be read{why}", runs(missing));
    notes.add(Check::RegisterUnread, found, "try again; check that dialect fits the controller");
}

/// Registers in few words: `PA00 to PA0d, PA55`.
fn runs(addresses: &[Address]) -> String {
    let mut runs: Vec<(Address, Address)> = Vec::new();
    for &address in addresses {
        match runs.last_mut() {
            Some((_, last)) if last.after(1) == Some(address) => *last = address,
            _ => runs.push((address, address)),
        }
    }
    let words = |&(first, last): &(Address, Address)| {
        if first == last { first.to_string() } else { format!("{first} to {last}") }
    };
    runs.iter().map(words).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_and_maximum_of_round_trips() {
        let ms = |all: &[u64]| all.iter().map(|ms| Duration::from_millis(*ms)).collect::<Vec<_>>();
        assert_eq!(round_trip(&[]), None);
        assert_eq!(round_trip(&ms(&[3])), Some((Duration::from_millis(3), Duration::from_millis(3))));
        assert_eq!(
            round_trip(&ms(&[9, 1, 2, 3])),
            Some((Duration::from_millis(2), Duration::from_millis(9)))
        );
    }

    #[test]
    fn registers_that_follow_each_other_are_named_as_a_run() {
        let all = [Address::Pa(0x0c), Address::Pa(0x0d), Address::Pa(0x55), Address::Dp(0xff)];
        assert_eq!(runs(&all), "PA0c to PA0d, PA55, DPFF");
    }
}
