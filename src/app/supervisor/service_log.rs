//! Unsolicited messages of the supervisor: to the service manager, and to the log.

use std::collections::BTreeMap;
use std::time::Duration;

use super::Supervisor;
use super::warnings::NOTE;
use crate::control::{Severity, Status, Warning};
use crate::journal::Action;
use crate::log::{Line, Log, Priority};
use crate::sd::Notifier;
use crate::state::State;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// How long controllers have to answer before the hall is ready without them.
const ROUND: Duration = Duration::from_secs(2);

/// Who is told, and what was told before.
#[derive(Debug)]
pub struct ServiceLog {
    notifier: Notifier,
    log: Log,
    ready: bool,
    stopping: bool,
    /// Warnings that are in effect, by what and whom they are about.
    warned: BTreeMap<(String, Option<String>), Severity>,
}

impl ServiceLog {
    /// One that speaks to the service manager and to a log.
    #[must_use]
    pub fn new(log: Log) -> Self {
        Self { notifier: Notifier::default(), log, ready: false, stopping: false, warned: BTreeMap::new() }
    }

    fn warn(&mut self, warnings: &[Warning]) {
        let key = |warning: &Warning| (warning.id.clone(), warning.controller.clone());
        let now: BTreeMap<_, _> = warnings.iter().map(|warning| (key(warning), warning.severity)).collect();
        let news = |warning: &&Warning| warning.severity > Severity::Info && warning.id != NOTE;
        for warning in warnings.iter().filter(news) {
            if self.warned.get(&key(warning)) == Some(&warning.severity) {
                continue;
            }
            let priority = match warning.severity {
                Severity::Error => Priority::Error,
                _ => Priority::Warning,
            };
            let Warning { id, controller, text, remedy, .. } = warning;
            let who = controller.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
            let line = Line::new(priority, id.clone(), format!("{who}{text}; {remedy}"));
            self.log.say(match controller {
                Some(name) => line.with("controller", name.clone()),
                None => line,
            });
        }
        self.warned = now;
    }
}

impl Supervisor {
    /// Tells the service manager and the log what is new.
    pub(super) fn speak(&mut self, status: &Status) {
        let now = Monotonic.now();
        let line = format!("{}: {}; next: {}", status.state, status.cause, status.next);
        let service_log = &mut self.ports.service_log;
        service_log.warn(&status.warnings);
        let heard = status.controllers.iter().all(|one| one.heard_s.is_some() || !one.enabled);
        let told = if !service_log.ready && (heard || now.since(self.began) >= ROUND) {
            service_log.ready = true;
            service_log.notifier.ready(&line, now)
        } else if !service_log.stopping && self.reload.is_none() && self.ports.signals.is_leaving() {
            service_log.stopping = true;
            service_log.notifier.stopping(&line, now)
        } else {
            service_log.notifier.status(&line, now);
            Ok(())
        };
        if let Err(error) = told {
            let text = format!("the service manager cannot be told: {error}");
            service_log.log.say(Line::new(Priority::Warning, "notify", text));
        }
    }

    /// Says something that no state says: one such thing hides none that comes after it.
    pub(super) fn say_note(&self, note: &str) {
        self.ports.service_log.log.say(Line::new(Priority::Warning, NOTE, note));
    }

    /// Says how the journal goes, and the keeping of what is set.
    pub(super) fn say_journal(&mut self) {
        for news in self.record.news() {
            self.ports.service_log.log.say(Line::new(Priority::Warning, "journal", news));
        }
        if self.ports.settings_file.take_mended() {
            self.ports.service_log.log.say(Line::new(
                Priority::Notice,
                "settings",
                "what people set is kept again",
            ));
        }
    }

    /// Says something that was set before the program started.
    pub(super) fn say_kept(&self, text: &str) {
        self.ports.service_log.log.say(Line::new(Priority::Notice, "kept", text));
    }

    /// Says that the hall is in another state.
    pub(super) fn say_state(&self, state: State, cause: &str) {
        let priority = match state {
            State::Fault => Priority::Error,
            State::Stopped | State::Recovering => Priority::Warning,
            _ => Priority::Notice,
        };
        let line = Line::new(priority, format!("state-{state}"), format!("{state}: {cause}"));
        self.ports.service_log.log.say(line.with("state", state.word()));
    }

    /// Says what somebody asked, and what came of it.
    pub(super) fn say_ask(&self, action: &Action) {
        let Action { who, what, result, times, .. } = action;
        let often = if *times > 1 { format!(" ({times} times)") } else { String::new() };
        let word = what.split(' ').next().unwrap_or_default();
        let line =
            Line::new(Priority::Notice, format!("ask-{word}"), format!("{who}: {what}: {result}{often}"));
        self.ports.service_log.log.say(line.with("operator", who.clone()));
    }
}
