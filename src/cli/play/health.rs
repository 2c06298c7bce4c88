//! Messages on controllers while a play runs: lost, refusing frames, back.

use crate::health::{HealthState, Why};
use crate::rt::Row;

/// How the controllers stood when they were looked at last; empty before that.
#[derive(Debug, Default)]
pub(super) struct HealthMessages(Vec<StandingsSeen>);

#[derive(Debug, Clone, Copy, Default)]
struct StandingsSeen {
    /// What was said of it last; `None` if all was well.
    trouble: Option<(HealthState, Why)>,
    /// True if a refusal was said.
    refused: bool,
}

impl HealthMessages {
    /// What is new, a line for each controller that stands otherwise. Acks that are missing now and then are for the report.
    pub(super) fn changes(&mut self, rows: &[Row], names: &[String]) -> Vec<String> {
        self.0.resize(rows.len(), StandingsSeen::default());
        let mut lines: Vec<String> = Vec::new();
        for ((seen, row), name) in self.0.iter_mut().zip(rows).zip(names) {
            let trouble = (!is_well(row.standing)).then_some((row.standing, row.why));
            // One member's trouble is the whole group's.
            let whose = row.why.controller().and_then(|index| names.get(index)).unwrap_or(name);
            let line = match (seen.trouble, trouble) {
                (before, now) if before == now => None,
                (_, Some((HealthState::Rejoining, why))) => {
                    Some(format!("{name}: {why}; it rejoins from where it is"))
                }
                (_, Some((standing, why))) => {
                    let next = why.next().unwrap_or(standing.next());
                    Some(format!("{whose}: {standing}: {why}; next: {next}"))
                }
                (_, None) => Some(format!("{name}: takes part again")),
            };
            let refuses = row.counts.refused() > 0 && !seen.refused;
            if refuses && line.is_none() {
                lines.push(format!("{name}: it refuses frames (x = 3, 4 or 5); the report has their number"));
            }
            *seen = StandingsSeen { trouble, refused: seen.refused || refuses };
            lines.extend(line.filter(|line| !lines.contains(line)));
        }
        lines
    }
}

/// True if it takes part as it should.
const fn is_well(standing: HealthState) -> bool {
    matches!(standing, HealthState::Ok | HealthState::Degraded | HealthState::Unwatched)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::ControllerState;
    use crate::time::MonoTime;
    use crate::tracker::Counts;

    fn row(standing: HealthState, why: Why) -> Row {
        let state = ControllerState::default();
        let counts = Counts::default();
        Row {
            counts,
            ack_ns: None,
            standing,
            why,
            state,
            homed: None,
            left_on: crate::drive::LeftOn::default(),
            left_since: None,
            at: MonoTime::default(),
        }
    }

    fn names() -> [String; 2] {
        ["A1", "A2"].map(str::to_owned)
    }

    #[test]
    fn a_controller_that_is_lost_and_returns_is_named_each_time_once() {
        let (mut standings, names) = (HealthMessages::default(), names());
        let well = row(HealthState::Ok, Why::Acked);
        let mut said = |other: Row| standings.changes(&[well, other], &names);
        assert_eq!(said(well), [""; 0]);
        assert_eq!(said(row(HealthState::Degraded, Why::AcksMissing(1))), [""; 0], "the report has it");
        let lost = row(HealthState::Lost, Why::Silent(1));
        let told = said(lost);
        assert!(
            told.len() == 1
                && told[0].starts_with("A2: lost: no ack and no report for too long; next: check")
        );
        assert_eq!(said(lost), [""; 0]);
        let told = said(row(HealthState::Rejoining, Why::SeenAgain));
        assert_eq!(told, ["A2: back as it was; it rejoins from where it is"]);
        assert_eq!(said(well), ["A2: takes part again"]);
    }

    #[test]
    fn a_group_has_one_line_and_names_whose_trouble_it_is() {
        let lost = row(HealthState::Lost, Why::Silent(1));
        let told = HealthMessages::default().changes(&[lost, lost], &names());
        assert!(told.len() == 1 && told[0].starts_with("A2: lost: "), "{told:?}");
    }

    #[test]
    fn a_refusal_is_said_once_however_many_there_are() {
        let (mut standings, names) = (HealthMessages::default(), names());
        let mut refusing = row(HealthState::Ok, Why::Acked);
        refusing.counts.fault = 1;
        let told = standings.changes(&[refusing], &names);
        assert!(told.len() == 1 && told[0].starts_with("A1: it refuses frames"), "{told:?}");
        refusing.counts.fault = 900;
        assert_eq!(standings.changes(&[refusing], &names), [""; 0]);
    }
}
