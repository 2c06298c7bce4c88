//! How a hall is, in about a kilobyte: what a desk with many halls shows.

use serde::{Deserialize, Serialize};

use crate::control::model::Word;
use crate::control::{FORMAT, FleetStatus, Health, Status, Warning};
use crate::state::State;

/// Warnings that are told; the gravest.
const WARNINGS: usize = 5;

/// The status of a hall, under the names of the whole one, less controllers, figures, test and journal.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct BriefStatus {
    /// The layout, as that of the whole status.
    pub(crate) format: u32,
    /// When it was so, RFC 3339, by the clock of the hall.
    pub(crate) at: String,
    /// Counts up with each that the hall's link sends.
    pub(crate) seq: u64,
    /// The hall as its own people call it.
    pub(crate) hall: String,
    /// The version of its program.
    pub(crate) version: String,
    /// The state, one word.
    pub(crate) state: Word<State>,
    /// Why it is in that state.
    pub(crate) cause: String,
    /// What a person does next.
    pub(crate) next: String,
    /// Seconds since it is in that state.
    pub(crate) since_s: f64,
    /// True if motion frames leave.
    pub(crate) moving: bool,
    /// What is loaded.
    pub(crate) show: Option<BriefShow>,
    /// The level of the motion, 0 to 1.
    pub(crate) level: f64,
    /// Its seats.
    pub(crate) seats: SeatCounts,
    /// What a person should know, the gravest; at most five.
    pub(crate) warnings: Vec<Warning>,
    /// How many there are in all.
    pub(crate) warnings_total: usize,
    /// What the fleet may start there, and how far its clock may be off.
    pub(crate) fleet: Option<FleetStatus>,
}

/// What is loaded, in short.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct BriefShow {
    /// The id of the cue.
    pub(crate) cue: String,
    /// SHA-256 of its file, hexadecimal.
    pub(crate) sha256: String,
    /// How long it is, s.
    pub(crate) length_s: f64,
    /// Where the film is in it, s.
    pub(crate) position_s: f64,
    /// How long the seats take onto it after its start, s.
    pub(crate) join_s: f64,
}

/// The seats of a hall by their controllers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct SeatCounts {
    /// All but those that the configuration has out for good.
    pub(crate) total: usize,
    /// Of these: those that take part and answer.
    pub(crate) taking_part: usize,
    /// Those that are to take part, and do not: lost, stopped, with an error, or waiting for a person.
    pub(crate) lost: usize,
}

impl BriefStatus {
    /// That of a hall at that time.
    pub(crate) fn of(status: &Status, at: String) -> Self {
        let show = status.show.as_ref().map(|show| BriefShow {
            cue: show.cue.clone(),
            sha256: show.sha256.clone(),
            length_s: show.length_s,
            position_s: show.position_s,
            join_s: show.join_s,
        });
        Self {
            format: FORMAT,
            at,
            seq: 0,
            hall: status.hall.clone(),
            version: status.version.clone(),
            state: status.state.clone(),
            cause: status.cause.clone(),
            next: status.next.clone(),
            since_s: status.since_s,
            moving: status.moving,
            show,
            level: status.levels.motion,
            seats: SeatCounts::of(status),
            warnings: status.warnings.iter().take(WARNINGS).cloned().collect(),
            warnings_total: status.warnings.len(),
            fleet: status.fleet.clone(),
        }
    }

    /// True if a person would want to know that it is another: all but times and counts.
    #[must_use]
    pub(crate) fn differs(&self, before: &Self) -> bool {
        let Self { at, seq, since_s, show, .. } = before;
        let mut now = Self { at: at.clone(), seq: *seq, since_s: *since_s, ..self.clone() };
        if let (Some(show), Some(before)) = (&mut now.show, show) {
            show.position_s = before.position_s;
        }
        if let (Some(fleet), Some(before)) = (&mut now.fleet, &before.fleet) {
            if fleet.clock.is_some() && before.clock.is_some() {
                fleet.clock.clone_from(&before.clock);
            }
            if let (Some(armed), Some(before)) = (&mut fleet.armed_for, &before.armed_for) {
                armed.lapses_s = before.lapses_s;
            }
        }
        now != *before
    }
}

impl SeatCounts {
    fn of(status: &Status) -> Self {
        let mut counts = Self::default();
        for one in status.controllers.iter().filter(|one| one.health != Health::Out) {
            counts.total += 1;
            match one.health {
                _ if !one.enabled => {}
                Health::Ok | Health::Degraded | Health::Rejoining | Health::Unwatched => {
                    counts.taking_part += 1
                }
                Health::Lost | Health::Stopped | Health::Error | Health::Excluded => counts.lost += 1,
                Health::Out | Health::Unknown => {}
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brief() -> BriefStatus {
        let status: Status = serde_json::from_str(include_str!("../../tests/data/status.json")).unwrap();
        BriefStatus::of(&status, "2026-11-21T19:05:12.400+01:00".to_owned())
    }

    #[test]
    fn a_brief_status_is_short_and_read_as_it_was_written() {
        let json = serde_json::to_string(&brief()).unwrap();
        assert!(json.len() < 4096, "{} bytes: {json}", json.len());
        assert_eq!(serde_json::from_str::<BriefStatus>(&json).unwrap(), brief());
        assert_eq!(serde_json::from_str::<BriefStatus>("{}").unwrap(), BriefStatus::default());
    }

    #[test]
    fn time_alone_is_no_change_and_all_else_is() {
        let before = brief();
        let mut now = BriefStatus { at: "later".to_owned(), seq: 7, since_s: 9.0, ..before.clone() };
        if let Some(show) = &mut now.show {
            show.position_s += 1.0;
        }
        assert!(before.show.is_some() && !now.differs(&before));
        assert!(BriefStatus { level: 0.123, ..before.clone() }.differs(&before));
        assert!(BriefStatus { cause: "another".to_owned(), ..before.clone() }.differs(&before));
        assert!(BriefStatus { show: None, ..before.clone() }.differs(&before));
    }
}
