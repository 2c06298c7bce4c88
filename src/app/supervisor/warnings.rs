//! What a person should know, with what to do.

use std::time::Duration;

use super::coded::{RemedyCode, WarningCode};
use super::notes::NoteBoard;
use super::readiness::CORRECT;
use super::standing::standing_words;
use super::status::StatusParts;
use super::{away, belts, player, recorded};
use crate::app::notify::NotifyTable;
use crate::app::pair::PairWatch;
use crate::app::{broadcasts, links};
use crate::config::Controller;
use crate::control::{Coded, Health, Severity, Warning};
use crate::health::{HealthState, Why};
use crate::rt::Row;
use crate::state::{Next, State};
use crate::time::MonoTime;

/// In a new state all controllers have this long to be looked at before one that was not is worth a word.
const FIRST_LOOK: Duration = Duration::from_secs(1);

/// Seats that were last heard within so long of each other fell silent at one instant: while nothing moves each is asked twice a second.
const AT_ONCE: Duration = Duration::from_secs(2);

/// One that answers, though not as it should, was heard within less.
const SILENT: Duration = Duration::from_millis(500);

/// Of fewer each is named.
const LEAST_AT_ONCE: usize = 3;

/// What nobody asks for is ended by itself within less.
const LEFT_ON: Duration = Duration::from_secs(3);

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

impl StatusParts<'_> {
    /// All of them, gravest first, with what is noted, and what is wrong with the keeping of what is set.
    pub(super) fn warnings(
        &self,
        table: &[Row],
        notes: &NoteBoard,
        settings_file: Option<String>,
    ) -> Vec<Warning> {
        let Self { hall, features, .. } = *self;
        let mut warnings: Vec<Warning> = match self.of_all(table) {
            Some(all) => vec![all],
            None => self.of_controllers(table).chain(self.of_nobody(table)).collect(),
        };
        warnings.extend(away::warnings(hall, table));
        warnings.extend(self.of_left_on(table));
        warnings.extend(self.of_strangers());
        warnings.extend(belts::warnings(hall, table));
        warnings.extend(self.of_the_machine());
        warnings.extend(self.of_preflight());
        let of_the_film = hall.film.iter().flat_map(|table| table.read().warnings());
        warnings.extend(of_the_film.map(|sentence| in_two(WarningCode::Film.word(), &sentence)));
        warnings
            .extend(player::warnings(hall).iter().map(|trouble| in_two(WarningCode::Player.word(), trouble)));
        warnings.extend(self.of_no_film());
        let failed = features.onward.failed.iter();
        warnings.extend(failed.map(|trouble| in_two(WarningCode::Playlist.word(), trouble)));
        warnings
            .extend(links::troubles(&hall.links).map(|trouble| in_two(WarningCode::Link.word(), &trouble)));
        warnings.extend(hall.reach.trouble().map(|trouble| in_two(WarningCode::Address.word(), &trouble)));
        warnings.extend(hall.awaited.trouble().map(|trouble| in_two(WarningCode::Port.word(), &trouble)));
        warnings.extend(hall.buttons.iter().flat_map(|pads| pads.warnings(WarningCode::Buttons.word())));
        let of_broadcasts = broadcasts::troubles(&hall.config.controllers, &hall.live);
        warnings.extend(of_broadcasts.iter().map(|trouble| in_two(WarningCode::Broadcast.word(), trouble)));
        let of_pair = hall.pair.iter().flat_map(PairWatch::troubles);
        warnings.extend(of_pair.map(|trouble| in_two(WarningCode::Pair.word(), &trouble)));
        let untold = hall.notify.iter().flat_map(NotifyTable::status).filter_map(|way| {
            Some(in_two(
                WarningCode::Notify.word(),
                &format!("alarms by {} are not sent: {}", way.way, way.trouble?),
            ))
        });
        warnings.extend(untold);
        warnings.extend(features.lasting.warnings(hall, &features.onward.local_now()));
        let troubles = self.record.troubles.iter();
        warnings.extend(troubles.map(|(of, trouble)| in_two(&format!("record-{of}"), trouble)));
        warnings.extend(
            (self.record.recording.is_none().then(|| recorded::lacks_room(hall)).flatten())
                .map(|trouble| in_two(WarningCode::RecordRoom.word(), &trouble)),
        );
        warnings.extend(settings_file.map(|trouble| in_two(WarningCode::Settings.word(), &trouble)));
        warnings.extend(features.records.trouble().map(|trouble| Warning {
            id: WarningCode::Journal.to_string(),
            severity: Severity::Warning,
            controller: None,
            text: trouble,
            ..Warning::default()
        }));
        warnings.extend(notes.iter().rev().map(|note| Warning {
            id: WarningCode::Note.to_string(),
            severity: Severity::Warning,
            controller: None,
            text: note.clone(),
            ..Warning::default()
        }));
        warnings.sort_by_key(|warning| std::cmp::Reverse(warning.severity));
        warnings
    }

    /// Whether the hall came to its state a moment ago: who is looked for may not have answered yet.
    fn has_begun(&self) -> bool {
        self.hall.now.since(self.hall.mirror.since) < FIRST_LOOK
    }

    /// All seats that take part fell silent at one instant: the cause is one, and none of them.
    fn of_all(&self, table: &[Row]) -> Option<Warning> {
        let on = || table.iter().enumerate().filter(|(lane, _)| self.hall.settings.is_on(*lane));
        let count = on().count();
        let is_one = on().all(|(_, row)| row.standing == HealthState::Lost)
            && are_silent_at_once(on().map(|(_, row)| row.state.heard_at), self.hall.now);
        (count >= LEAST_AT_ONCE && is_one).then(|| Warning {
            id: WarningCode::AllSilent.to_string(),
            severity: Severity::Error,
            coded: Some(Coded::new(WarningCode::AllSilent.word(), [count.to_string()])),
            remedy_code: Some(RemedyCode::AllSilent.to_string()),
            controller: None,
            text: format!("all {count} seats fell silent at one instant"),
            remedy: "check the network switch and its power, and the network cable of this machine"
                .to_owned(),
        })
    }

    /// A hall may play and park with all its seats out; what its state says is true of none of them then. All others say that seats are
    /// not looked for yet, move by themselves, or wait for a person.
    fn of_nobody(&self, table: &[Row]) -> Option<Warning> {
        let (settings, state) = (&self.hall.settings, self.hall.mirror.state);
        let is_of_seats = matches!(
            state,
            State::Parked | State::Armed | State::Playing(_) | State::Paused | State::Parking
        );
        if !is_of_seats {
            return None;
        }
        let is_looked_for = |row: &Row| self.has_begun() && row.why == Why::NotSeenYet;
        let takes_part = |(lane, row): (usize, &Row)| settings.is_on(lane) && row.standing.may_move();
        if table.iter().all(is_looked_for) || table.iter().enumerate().any(takes_part) {
            return None;
        }
        Some(Warning {
            id: WarningCode::NoSeat.to_string(),
            severity: Severity::Error,
            coded: Some(Coded::new(WarningCode::NoSeat.word(), [])),
            remedy_code: Some(RemedyCode::NoSeat.to_string()),
            controller: None,
            text: format!("no seat takes part: the hall is {state}, its seats are not"),
            remedy: "enable seats (`kinocue enable`), or see at each why it is out".to_owned(),
        })
    }

    fn of_controllers(&self, table: &[Row]) -> impl Iterator<Item = Warning> {
        let hall = self.hall;
        let controllers = hall.config.controllers.iter().zip(table).enumerate();
        let (has_begun, homes) = (self.has_begun(), hall.mirror.state == State::Homing);
        let of = |(lane, (controller, row)): (usize, (&Controller, &Row))| {
            let severity = match row.standing {
                HealthState::Rejoining if matches!(row.why, Why::Moved(_)) => Severity::Error,
                HealthState::Rejoining if hall.mirror.next == Next::ParkOrStart => Severity::Warning,
                // While a show runs it joins by itself.
                HealthState::Ok | HealthState::Rejoining => return None,
                // So is each that has just come home.
                HealthState::Lost if (has_begun || homes) && row.why == Why::NotSeenYet => return None,
                HealthState::Degraded | HealthState::Unwatched => Severity::Warning,
                _ if !hall.settings.is_on(lane) => Severity::Info,
                _ => Severity::Error,
            };
            let (code, remedy) = match row.why.next() {
                _ if row.why == Why::NotSeenYet && hall.reach.is_unreached(lane) => {
                    (RemedyCode::NoRoute.to_string(), NO_ROUTE_NEXT)
                }
                Some(remedy) => (row.why.code().to_owned(), remedy),
                None => (row.standing.to_string(), row.standing.next()),
            };
            let (why, coded) = standing_words(hall, lane, row.why);
            Some(Warning {
                id: format!("controller-{}", Health::from(row.standing)),
                severity,
                controller: Some(controller.name.clone()),
                text: format!("{}: {why}", row.standing),
                coded: Some(coded),
                remedy: remedy.to_owned(),
                remedy_code: Some(code),
            })
        };
        controllers.filter_map(of).collect::<Vec<_>>().into_iter()
    }

    /// What is still on at a controller though nobody asks for it, and could not be ended by itself.
    fn of_left_on(&self, table: &[Row]) -> Vec<Warning> {
        let controllers = self.hall.config.controllers.iter().zip(table);
        let left = controllers.filter(|(_, row)| row.is_left_on_for(LEFT_ON));
        let warning = |(controller, row): (&Controller, &Row)| {
            let outputs = row.left_on.outputs_in_words();
            let (code, values, text) = match outputs {
                Some(outputs) => (
                    WarningCode::LeftOn.word(),
                    vec![outputs.clone()],
                    format!("outputs may be on that nobody asks for: {outputs}"),
                ),
                None => (
                    WarningCode::LeftShaking.word(),
                    Vec::new(),
                    "its seat may vibrate though nobody asks for it".to_owned(),
                ),
            };
            Warning {
                id: WarningCode::LeftOn.to_string(),
                severity: Severity::Error,
                controller: Some(controller.name.clone()),
                text,
                coded: Some(Coded::new(code, values)),
                remedy: "clear what holds its seat, then park or resume; where that does not end it, cut its power"
                    .to_owned(),
                remedy_code: Some(RemedyCode::LeftOn.to_string()),
            }
        };
        left.map(warning).collect()
    }

    fn of_strangers(&self) -> impl Iterator<Item = Warning> {
        let controllers = self.hall.config.controllers.iter().enumerate();
        controllers.filter_map(|(lane, controller)| {
            let answers = self.features.figures.strangers.of(lane)?;
            Some(Warning {
                id: WarningCode::AnotherMaster.to_string(),
                severity: Severity::Error,
                controller: Some(controller.name.clone()),
                text: format!("{answers} acks within a minute of frames that were not sent from here"),
                remedy: "another machine may drive this seat: find it and stop it, before anybody sits down"
                    .to_owned(),
                coded: Some(Coded::new(WarningCode::AnotherMaster.word(), [answers.to_string()])),
                remedy_code: Some(RemedyCode::AnotherMaster.to_string()),
            })
        })
    }

    fn of_the_machine(&self) -> impl Iterator<Item = Warning> {
        let crowding = self.hall.crowding.iter().map(|words| in_two(WarningCode::Sending.word(), words));
        let refusals = &self.hall.granted.refusals;
        refusals.iter().map(|refusal| in_two(WarningCode::NotRealTime.word(), refusal)).chain(crowding)
    }

    /// A cue that follows nothing in a hall whose film others show: it starts as soon as it is let go.
    fn of_no_film(&self) -> Option<Warning> {
        let Self { hall, features, .. } = *self;
        let entries = features.onward.list.iter().flat_map(|list| &list.playlist.entries);
        let is_meant =
            features.seats.test.is_some() || entries.into_iter().any(|entry| entry.film.begin.is_some());
        let follows = |cued: &super::show::ProvedShow| cued.film.is_some();
        if hall.film.is_none() || hall.player.is_some() || is_meant || hall.cued.as_ref().is_none_or(follows)
        {
            return None;
        }
        let code = WarningCode::NoFilm.word();
        Some(Warning {
            coded: Some(Coded::new(code, [])),
            remedy_code: Some(RemedyCode::NoFilm.to_string()),
            ..in_two(code, NO_FILM)
        })
    }

    fn of_preflight(&self) -> Option<Warning> {
        let readiness = &self.features.readiness;
        let (code, text, remedy, of, severity) = match &readiness.preflighted {
            None => (
                WarningCode::PreflightNever,
                "preflight has not been run since the program started",
                "run preflight",
                RemedyCode::Preflight,
                Severity::Info,
            ),
            Some(_) if readiness.has_failed(self.hall) => (
                WarningCode::PreflightFailed,
                "preflight failed",
                CORRECT,
                RemedyCode::Correct,
                Severity::Error,
            ),
            Some(_) => return None,
        };
        Some(Warning {
            id: RemedyCode::Preflight.to_string(),
            severity,
            text: text.to_owned(),
            coded: Some(Coded::new(code.word(), [])),
            remedy: remedy.to_owned(),
            remedy_code: Some(of.to_string()),
            ..Warning::default()
        })
    }
}

/// True if all were heard once, last at one instant, and not since.
fn are_silent_at_once(heard: impl Iterator<Item = Option<MonoTime>> + Clone, now: MonoTime) -> bool {
    let (first, last) = (heard.clone().min().flatten(), heard.max().flatten());
    first.zip(last).is_some_and(|(first, last)| last.since(first) <= AT_ONCE && now.since(last) > SILENT)
}

/// Of a controller to which no way leads.
const NO_ROUTE_NEXT: &str =
    "check switch, cable and address of this machine there; the seat rejoins by itself once it is reached";

/// Of a cue that nothing leads, in a hall whose film others show.
const NO_FILM: &str = "the cue that is loaded follows no film, and starts at once when it is let go: [sync] has no start; \
                       set start in [sync], or film in its entry of the playlist";

/// A warning of a text that ends with what to do.
fn in_two(id: &str, trouble: &str) -> Warning {
    let (text, remedy) = trouble.split_once("; ").unwrap_or((trouble, ""));
    Warning {
        id: id.to_owned(),
        severity: Severity::Warning,
        text: text.to_owned(),
        remedy: remedy.to_owned(),
        ..Warning::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seats_that_were_last_heard_within_two_seconds_fell_silent_at_one_instant() {
        let at = |ms: u64| Some(MonoTime::from_nanos(ms * 1_000_000));
        for (heard, now, at_once) in [
            ([at(1_000), at(1_400), at(3_000)], 4_000, true),
            ([at(1_000), at(1_400), at(3_001)], 4_000, false),
            ([at(1_000), at(1_400), at(3_000)], 3_500, false),
            ([at(1_000), None, at(1_000)], 4_000, false),
            ([None; 3], 4_000, false),
        ] {
            let now = MonoTime::from_nanos(now * 1_000_000);
            assert_eq!(are_silent_at_once(heard.into_iter(), now), at_once, "{heard:?}");
        }
    }
}
