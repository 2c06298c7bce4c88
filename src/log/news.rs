//! What changed from one status to the next, as lines of the log.

use super::{Line, Priority};
use crate::hall::{JournalLine, Severity, Status, Warning};

/// Lines for what is new in `after`: its state, what somebody asked, warnings that came, controllers that are back, ticks
/// slept through, motion held back by the last gate.
#[must_use]
pub fn news(before: &Status, after: &Status) -> Vec<Line> {
    let mut lines: Vec<Line> = state(before, after).into_iter().collect();
    lines.extend(asked(before, after));
    lines.extend(came(before, after).map(warning));
    lines.extend(back(before, after));
    lines.extend(missed(before, after));
    lines.extend(held(before, after));
    lines
}

/// States hold each other back no more than causes do: a stop right after a start is told at once.
fn state(before: &Status, after: &Status) -> Option<Line> {
    let Status { state, cause, next, .. } = after;
    if (before.state, &before.cause) == (*state, cause) {
        return None;
    }
    let priority = match *state {
        "fault" => Priority::Error,
        "stopped" | "recovering" | "freewheeling" => Priority::Warning,
        _ => Priority::Notice,
    };
    let line = Line::new(priority, format!("state-{state}"), format!("{state}: {cause}; next: {next}"));
    let line = line.with("state", *state);
    Some(match &after.show {
        Some(show) => line.with("cue", &show.cue).with("position", format!("{:.3}", show.position_s)),
        None => line,
    })
}

/// The journal has its newest line first.
fn asked<'a>(before: &'a Status, after: &'a Status) -> impl Iterator<Item = Line> {
    let known = before.journal.first();
    let new: Vec<&JournalLine> = after.journal.iter().take_while(|line| Some(*line) != known).collect();
    new.into_iter().rev().map(|JournalLine { who, what, result, .. }| {
        let word = what.split_whitespace().next().unwrap_or_default();
        let line = Line::new(Priority::Notice, format!("asked-{word}"), format!("{who}: {what}: {result}"));
        line.with("who", who).with("result", result)
    })
}

fn came<'a>(before: &'a Status, after: &'a Status) -> impl Iterator<Item = &'a Warning> {
    let alike = |a: &Warning, b: &Warning| (&a.id, &a.controller, &a.text) == (&b.id, &b.controller, &b.text);
    after.warnings.iter().filter(move |new| !before.warnings.iter().any(|old| alike(old, new)))
}

fn warning(warning: &Warning) -> Line {
    let Warning { id, severity, controller, text, remedy } = warning;
    let priority = match severity {
        Severity::Error => Priority::Error,
        Severity::Warning => Priority::Warning,
        Severity::Info => Priority::Info,
    };
    let whose = controller.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
    let remedy = if remedy.is_empty() { String::new() } else { format!("; {remedy}") };
    let line = Line::new(priority, id.clone(), format!("{whose}{text}{remedy}"));
    match controller {
        Some(controller) => line.with("controller", controller),
        None => line,
    }
}

/// Those that stand badly are told by a warning.
fn back(before: &Status, after: &Status) -> impl Iterator<Item = Line> {
    let pairs = before.controllers.iter().zip(&after.controllers);
    let back = pairs.filter(|(old, new)| {
        old.name == new.name && new.standing == "ok" && !matches!(old.standing, "ok" | "unknown")
    });
    back.map(|(_, new)| {
        let message = format!("{}: ok again: {}", new.name, new.why);
        Line::new(Priority::Info, "controller-ok", message).with("controller", &new.name)
    })
}

fn missed(before: &Status, after: &Status) -> Option<Line> {
    let missed = after.missed_ticks.checked_sub(before.missed_ticks).filter(|missed| *missed > 0)?;
    let message = format!("{missed} ticks were slept through; kinocue doctor looks for the reason");
    Some(Line::new(Priority::Warning, "ticks-missed", message).with("ticks", missed.to_string()))
}

fn held(before: &Status, after: &Status) -> Option<Line> {
    let clamps = |status: &Status| status.controllers.iter().map(|one| one.clamps).sum::<u64>();
    let held = clamps(after).checked_sub(clamps(before)).filter(|held| *held > 0)?;
    let message =
        format!("the last gate held motion back {held} times: what is played is not what was proved");
    Some(Line::new(Priority::Error, "limits", message).with("times", held.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(change: impl FnOnce(&mut Status)) -> Vec<(Priority, String, String)> {
        let before = crate::metrics::tests::playing();
        let mut after = before.clone();
        change(&mut after);
        let lines = news(&before, &after).into_iter();
        lines.map(|line| (line.priority, line.cause.into_owned(), line.message)).collect()
    }

    fn entry(what: &str) -> JournalLine {
        JournalLine {
            at: "2026-01-01T10:00:00Z".to_owned(),
            who: "ann (socket, engineer)".to_owned(),
            what: what.to_owned(),
            result: "done".to_owned(),
        }
    }

    #[test]
    fn nothing_is_said_where_nothing_changed() {
        let same = told(|after| {
            after.uptime_s += 0.1;
            after.ticks += 100;
            after.controllers[0].acked += 100;
        });
        assert_eq!(same, []);
    }

    #[test]
    fn a_new_state_is_told_with_cause_and_next_action() {
        let lines = told(|after| {
            after.state = "fault";
            after.cause = "A1: drive alarm".to_owned();
            after.next = "put the error right".to_owned();
        });
        let words = "fault: A1: drive alarm; next: put the error right".to_owned();
        assert_eq!(lines, [(Priority::Error, "state-fault".to_owned(), words)]);
    }

    #[test]
    fn what_somebody_asked_is_told_oldest_first_and_once() {
        let lines = told(|after| after.journal = vec![entry("arm"), entry("load storm")]);
        let causes: Vec<_> = lines.iter().map(|(_, cause, _)| cause.as_str()).collect();
        assert_eq!(causes, ["asked-load", "asked-arm"]);
        assert_eq!(lines[0].2, "ann (socket, engineer): load storm: done");
        let mut before = crate::metrics::tests::playing();
        before.journal = vec![entry("arm")];
        let mut after = before.clone();
        after.journal.insert(0, entry("go"));
        assert_eq!(news(&before, &after).len(), 1);
    }

    #[test]
    fn a_warning_is_told_when_it_comes_and_a_controller_when_it_is_back() {
        let lines = told(|after| {
            after.controllers[0].standing = "degraded";
            after.warnings.push(Warning {
                id: "controller-degraded".to_owned(),
                severity: Severity::Warning,
                controller: Some("A1".to_owned()),
                text: "degraded: acks are missing".to_owned(),
                remedy: "look at the network".to_owned(),
            });
        });
        let words = "A1: degraded: acks are missing; look at the network".to_owned();
        assert_eq!(lines, [(Priority::Warning, "controller-degraded".to_owned(), words)]);

        let mut lost = crate::metrics::tests::playing();
        lost.controllers[0].standing = "lost";
        let back = news(&lost, &crate::metrics::tests::playing());
        assert_eq!(back[0].message, "A1: ok again: its acks come");
        assert_eq!(back[0].fields, [("controller", "A1".to_owned())]);
    }

    #[test]
    fn ticks_and_limits_are_told_by_how_much_they_grew() {
        let lines = told(|after| {
            after.missed_ticks += 7;
            after.controllers[1].clamps += 2;
        });
        let causes: Vec<_> = lines.iter().map(|(_, cause, _)| cause.as_str()).collect();
        assert_eq!(causes, ["ticks-missed", "limits"]);
        assert!(lines[0].2.starts_with("7 ticks") && lines[1].2.contains("2 times"));
        let less = told(|after| after.missed_ticks = 0);
        assert_eq!(less, [], "a hall that was opened anew counts from 0");
    }
}
