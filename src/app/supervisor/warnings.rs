//! What a person should know, with what to do.

use std::time::Duration;

use super::Supervisor;
use crate::control::{Health, Severity, Warning};
use crate::health::{HealthState, Why};
use crate::rt::Row;
use crate::state::{Next, State};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// In a new state all controllers have this long to be looked at before one that was not is worth a word.
const FIRST_LOOK: Duration = Duration::from_secs(1);
/// What the warnings are called that say what no state says.
pub(super) const NOTE: &str = "note";

impl From<HealthState> for Health {
    fn from(standing: HealthState) -> Self {
        match standing {
            HealthState::Ok => Self::Ok,
            HealthState::Degraded => Self::Degraded,
            HealthState::Lost => Self::Lost,
            HealthState::Rejoining => Self::Rejoining,
            HealthState::Stopped => Self::Stopped,
            HealthState::Error => Self::Error,
            HealthState::Excluded => Self::Excluded,
            HealthState::Unwatched => Self::Unwatched,
        }
    }
}

impl Supervisor {
    /// All of them, gravest first.
    pub(super) fn warnings(&self, table: &[Row]) -> Vec<Warning> {
        let mut warnings: Vec<Warning> = self.of_controllers(table).collect();
        let takes_part = |(lane, row): (usize, &Row)| self.settings.is_on(lane) && row.standing.may_move();
        warnings.extend(nobody(table, self.mirror.state, takes_part));
        warnings.extend(self.of_strangers());
        warnings.extend(self.of_belts(table));
        warnings.extend(self.of_the_machine());
        warnings.extend(self.of_preflight());
        warnings.extend(self.of_what_lasts());
        warnings.extend(self.of_the_settings_file());
        warnings.extend(self.record.trouble().map(|trouble| Warning {
            id: "journal".to_owned(),
            severity: Severity::Warning,
            controller: None,
            text: trouble,
            remedy: String::new(),
        }));
        warnings.extend(self.notes.iter().rev().map(|note| Warning {
            id: NOTE.to_owned(),
            severity: Severity::Warning,
            controller: None,
            text: note.clone(),
            remedy: String::new(),
        }));
        warnings.sort_by_key(|warning| std::cmp::Reverse(warning.severity));
        warnings
    }

    fn of_controllers(&self, table: &[Row]) -> impl Iterator<Item = Warning> {
        let controllers = self.runtime.config.controllers.iter().zip(table).enumerate();
        let has_begun = Monotonic.now().since(self.mirror.since) < FIRST_LOOK;
        let of = |(lane, (controller, row)): (usize, (&crate::config::Controller, &Row))| {
            let severity = match row.standing {
                HealthState::Rejoining if matches!(row.why, Why::Moved(_)) => Severity::Error,
                HealthState::Rejoining if self.mirror.next == Next::ParkOrStart => Severity::Warning,
                // While a show runs it joins by itself.
                HealthState::Ok | HealthState::Rejoining => return None,
                HealthState::Lost if has_begun && row.why == Why::NotSeenYet => return None,
                HealthState::Degraded | HealthState::Unwatched => Severity::Warning,
                _ if !self.settings.is_on(lane) => Severity::Info,
                _ => Severity::Error,
            };
            Some(Warning {
                id: format!("controller-{}", Health::from(row.standing)),
                severity,
                controller: Some(controller.name.clone()),
                text: format!("{}: {}", row.standing, row.why),
                remedy: row.why.next().unwrap_or_else(|| row.standing.next()).to_owned(),
            })
        };
        controllers.filter_map(of).collect::<Vec<_>>().into_iter()
    }

    fn of_strangers(&self) -> impl Iterator<Item = Warning> {
        let controllers = self.runtime.config.controllers.iter().enumerate();
        controllers.filter_map(|(lane, controller)| {
            let answers = self.strangers.of(lane)?;
            Some(Warning {
                id: "another-master".to_owned(),
                severity: Severity::Error,
                controller: Some(controller.name.clone()),
                text: format!("{answers} answers within a minute to frames that were not sent from here"),
                remedy: "another machine may drive this seat: find it and stop it, before anybody sits down"
                    .to_owned(),
            })
        })
    }

    fn of_the_machine(&self) -> impl Iterator<Item = Warning> {
        self.runtime.granted.refusals.iter().map(|refusal| {
            let (text, remedy) = refusal.split_once("; ").unwrap_or((refusal, ""));
            Warning {
                id: "not-real-time".to_owned(),
                severity: Severity::Warning,
                controller: None,
                text: text.to_owned(),
                remedy: remedy.to_owned(),
            }
        })
    }

    fn of_the_settings_file(&self) -> Option<Warning> {
        let trouble = self.ports.settings_file.trouble()?;
        let (text, remedy) = trouble.split_once("; ").unwrap_or((&trouble, ""));
        Some(Warning {
            id: "settings".to_owned(),
            severity: Severity::Warning,
            controller: None,
            text: text.to_owned(),
            remedy: remedy.to_owned(),
        })
    }

    fn of_preflight(&self) -> Option<Warning> {
        let (text, severity) = match &self.preflighted {
            None => ("preflight was not run since the program started", Severity::Info),
            Some(it) if !it.has_passed(|lane| self.settings.is_on(lane)) => {
                ("preflight failed", Severity::Error)
            }
            Some(_) => return None,
        };
        Some(Warning {
            id: "preflight".to_owned(),
            severity,
            controller: None,
            text: text.to_owned(),
            remedy: "run preflight".to_owned(),
        })
    }
}

/// A hall may play and park with all its seats out; what its state says is true of none of them then.
fn nobody(table: &[Row], state: State, takes_part: impl FnMut((usize, &Row)) -> bool) -> Option<Warning> {
    let is_looked_for = |row: &Row| row.why == Why::NotSeenYet;
    if table.iter().all(is_looked_for) || table.iter().enumerate().any(takes_part) {
        return None;
    }
    Some(Warning {
        id: "no-seat".to_owned(),
        severity: Severity::Error,
        controller: None,
        text: format!("no seat takes part: \"{state}\" is said of none"),
        remedy: "take seats in (`kinocue enable`), or see at each what keeps it out".to_owned(),
    })
}
