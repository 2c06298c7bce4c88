//! Unsolicited messages of the supervisor: to the service manager, to the log, and of alarms to people elsewhere.

use std::collections::BTreeMap;
use std::time::Duration;

use super::coded::WarningCode;
use crate::app::notify::{AlarmTeller, NotifyTable};
use crate::control::{Severity, Status, Warning};
use crate::journal::Action;
use crate::log::{Line, Log, Priority};
use crate::sd::Notifier;
use crate::state::State;
use crate::time::MonoTime;

/// How long controllers have to answer before the hall is ready without them.
const ROUND: Duration = Duration::from_secs(2);

/// Who is told, and what was told before.
#[derive(Debug)]
pub(crate) struct ServiceLog {
    notifier: Notifier,
    log: Log,
    ready: bool,
    stopping: bool,
    alarms: AlarmTeller,
    /// Warnings that are in effect, by what and whom they are about.
    warned: BTreeMap<(String, Option<String>), Severity>,
}

impl ServiceLog {
    /// One that speaks to the service manager and to a log.
    #[must_use]
    pub(crate) fn new(log: Log, alarms: AlarmTeller) -> Self {
        let (notifier, warned) = (Notifier::default(), BTreeMap::new());
        Self { notifier, log, ready: false, stopping: false, alarms, warned }
    }

    /// How the ways to tell alarms are, if there are any.
    pub(super) fn notify_table(&self) -> Option<NotifyTable> {
        self.alarms.table()
    }

    fn warn(&mut self, warnings: &[Warning]) {
        let key = |warning: &Warning| (warning.id.clone(), warning.controller.clone());
        let now: BTreeMap<_, _> = warnings.iter().map(|warning| (key(warning), warning.severity)).collect();
        let news =
            |warning: &&Warning| warning.severity > Severity::Info && warning.id != WarningCode::Note.word();
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
            let next = if remedy.is_empty() { String::new() } else { format!("; {remedy}") };
            let line = Line::new(priority, id.clone(), format!("{who}{text}{next}"));
            self.log.say(match controller {
                Some(name) => line.with("controller", name.clone()),
                None => line,
            });
        }
        self.warned = now;
    }

    /// Tells the service manager and the log what is new in a hall that opened then; `ends` says whether the program does.
    pub(super) fn speak(&mut self, status: &Status, opened: MonoTime, ends: bool, now: MonoTime) {
        let line = format!("{}: {}; next: {}", status.state, status.cause, status.next);
        self.warn(&status.warnings);
        let fault = (status.state == State::Fault).then(|| Warning {
            id: "state-fault".to_owned(),
            severity: Severity::Error,
            text: format!("{}: {}", status.state, status.cause),
            remedy: status.next.clone(),
            ..Warning::default()
        });
        self.alarms.take(status.warnings.iter().chain(&fault));
        let heard = status.controllers.iter().all(|one| one.heard_s.is_some() || !one.enabled);
        let told = if !self.ready && (heard || now.since(opened) >= ROUND) {
            self.ready = true;
            self.notifier.ready(&line, now)
        } else if !self.stopping && ends {
            self.stopping = true;
            self.notifier.stopping(&line, now)
        } else {
            self.notifier.status(&line, now);
            Ok(())
        };
        if let Err(error) = told {
            self.say(Priority::Warning, "notify", format!("cannot notify the service manager: {error}"));
        }
    }

    /// Writes a line.
    pub(super) fn put(&self, line: Line) {
        self.log.say(line);
    }

    fn say(&self, priority: Priority, cause: &'static str, text: impl Into<String>) {
        self.put(Line::new(priority, cause, text));
    }

    /// Says something that no state says: one such thing hides none that comes after it.
    pub(super) fn say_note(&self, note: &str) {
        self.say(Priority::Warning, WarningCode::Note.word(), note);
    }

    /// Says how the keeping of files goes, all that is new in one line: of one cause no second line would be written at once.
    pub(super) fn say_kept(&self, cause: &'static str, news: &[String]) {
        /// Sentences of a line; more are counted.
        const MOST: usize = 30;
        if news.is_empty() {
            return;
        }
        let mut text = news[..news.len().min(MOST)].join("; ");
        if news.len() > MOST {
            text += &format!("; and {} more", news.len() - MOST);
        }
        self.say(Priority::Warning, cause, text);
    }

    /// Says what became better in keeping what people set.
    pub(super) fn say_settings(&self, news: Option<&'static str>) {
        news.into_iter().for_each(|news| self.say(Priority::Notice, "settings", news));
    }

    /// Says that the hall is in another state.
    pub(super) fn say_state(&self, state: State, cause: &str) {
        let priority = match state {
            State::Fault => Priority::Error,
            State::Stopped | State::Recovering => Priority::Warning,
            _ => Priority::Notice,
        };
        let line = Line::new(priority, format!("state-{state}"), format!("{state}: {cause}"));
        self.put(line.with("state", state.word()));
    }

    /// Says what somebody asked, and what came of it.
    pub(super) fn say_ask(&self, action: &Action) {
        let Action { who, what, result, times, .. } = action;
        let often = if *times > 1 { format!(" ({times} times)") } else { String::new() };
        let word = what.split(' ').next().unwrap_or_default();
        let line =
            Line::new(Priority::Notice, format!("ask-{word}"), format!("{who}: {what}: {result}{often}"));
        self.put(line.with("operator", who.clone()));
    }
}
