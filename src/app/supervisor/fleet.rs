//! What may be asked of a hall by its fleet, from a place where nobody sees the seats: to hold, to end what people here have begun,
//! and to get ready what they will begin. What is loaded in a hall that a person has armed stays; no seat is moved that nobody here has
//! armed; no level goes above what a person here has set (`gear::levels`).

use super::hall::HallContext;
use crate::config::FleetWord;
use crate::control::{Code, Command, Desired, Problem, Surface};
use crate::state::State;

/// True if it may be done for whom it is asked for.
///
/// # Errors
/// Where it comes by the fleet, and the configuration does not allow it, or the state of the hall forbids it.
pub(super) fn may_ask(desired: &Desired, hall: &HallContext) -> Result<(), Problem> {
    let Desired { ask, who } = desired;
    if who.surface != Surface::Fleet || *ask == Command::Stop {
        return Ok(());
    }
    let refused = |why: String, remedy: &str| {
        let detail = format!("the fleet may not {}: {why}", ask.word());
        Err(Problem::new(Code::Role, detail, remedy))
    };
    let Some(word) = ask.fleet_word() else {
        return refused("whoever asks it has to see the seats".to_owned(), "ask somebody in the hall");
    };
    if !hall.config.fleet.as_ref().is_some_and(|fleet| fleet.allows(word)) {
        let why = if word == FleetWord::Start {
            "start of [fleet] is not true"
        } else {
            "allow of [fleet] does not name it"
        };
        return refused(why.to_owned(), "ask somebody in the hall, or add it there and reload");
    }
    let state = hall.mirror.state;
    match ask {
        // Whoever armed it saw what was loaded, and what preflight found.
        Command::Load { .. } | Command::Preflight if state != State::Parked => {
            refused(format!("the hall is {state}, not parked"), "try again when it is parked")
        }
        // Whoever armed it saw the seats; for what it was armed is known to `starts`.
        Command::StartAt(_) | Command::Commit { .. } if state != State::Armed => refused(
            format!("the hall is {state}, and nobody has armed it"),
            "ask somebody there to arm it with --fleet",
        ),
        // Somebody may stand beside a seat that is off park.
        Command::Park if !hall.is_on_cue() && !matches!(state, State::Armed | State::Parking) => refused(
            format!("nobody has armed the seats that this may move while {state}"),
            "ask somebody who sees the seats to park them",
        ),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::app::supervisor::testing::{Rig, desired, hall};
    use crate::config::Fleet;
    use crate::control::{LevelsChange, StartOrder};
    use crate::time::ShowTime;

    /// One of each; the match has to name a new one.
    fn all() -> Vec<Command> {
        let name = || "A1".to_owned();
        let all = vec![
            Command::Home,
            Command::Load { cue: name() },
            Command::Playlist { id: None },
            Command::Select { entry: 0 },
            Command::Arm { seats_empty: false },
            Command::Arm { seats_empty: true },
            Command::ArmFor(name()),
            Command::StartAt(StartOrder { ticket: name(), group: name(), sha256: name(), at_ms: 0 }),
            Command::Commit { ticket: name() },
            Command::Disarm,
            Command::Go,
            Command::GoFrom(ShowTime::ZERO),
            Command::Pause,
            Command::Resume,
            Command::Seek(ShowTime::ZERO),
            Command::Stop,
            Command::Park,
            Command::Clear,
            Command::Trim(0),
            Command::Nudge(1),
            Command::Source(None),
            Command::Levels(LevelsChange::default()),
            Command::Preset(name()),
            Command::Enable(name()),
            Command::Disable { name: name(), why: None },
            Command::Preflight,
            Command::Test { rows: Vec::new() },
            Command::Reload,
            Command::Mark { text: None },
            Command::Dump,
        ];
        for one in &all {
            match one {
                Command::Home | Command::Load { .. } | Command::Playlist { .. } | Command::Select { .. } => {}
                Command::Arm { .. } | Command::Disarm | Command::Go | Command::GoFrom(_) => {}
                Command::ArmFor(_) | Command::StartAt(_) | Command::Commit { .. } => {}
                Command::Pause | Command::Resume | Command::Seek(_) | Command::Stop | Command::Park => {}
                Command::Clear | Command::Trim(_) | Command::Nudge(_) | Command::Source(_) => {}
                Command::Levels(_) | Command::Preset(_) | Command::Enable(_) | Command::Disable { .. } => {}
                Command::Preflight | Command::Test { .. } | Command::Reload => {}
                Command::Mark { .. } | Command::Dump => {}
            }
        }
        all
    }

    fn member(hall: &mut HallContext, allow: &[FleetWord]) {
        let start = allow.contains(&FleetWord::Start);
        let (name, start_bound) = ("berlin.h3".to_owned(), std::time::Duration::from_millis(2));
        let fleet = Fleet { name, allow: allow.to_vec(), start, start_bound, keys: Vec::new() };
        Arc::make_mut(&mut hall.config).fleet = Some(fleet);
    }

    fn every_word() -> Vec<FleetWord> {
        FleetWord::ALL.iter().map(|(_, word)| *word).chain([FleetWord::Start]).collect()
    }

    /// The words that the fleet may say in a state, where all are allowed to it; written down apart from the code.
    fn may_say(state: State) -> &'static [&'static str] {
        match state {
            State::Boot
            | State::Recovering
            | State::Homing
            | State::Stopping
            | State::Stopped
            | State::Fault => &["disarm", "levels", "pause", "stop", "trim"],
            State::Parked => &["disarm", "levels", "load", "pause", "preflight", "stop", "trim"],
            State::Playing(_) | State::Paused | State::Parking => {
                &["disarm", "levels", "park", "pause", "stop", "trim"]
            }
            // For what it was armed is asked by `starts`.
            State::Armed => &["commit", "disarm", "levels", "park", "pause", "start", "stop", "trim"],
        }
    }

    #[test]
    fn in_each_state_the_fleet_may_say_the_words_of_the_table_and_no_others() {
        for state in State::ALL {
            let mut hall = hall(state, "one");
            member(&mut hall, &every_word());
            let may = |ask: &Command| may_ask(&desired(Surface::Fleet, ask.clone()), &hall);
            let mut said: Vec<_> = all().iter().filter(|ask| may(ask).is_ok()).map(Command::word).collect();
            said.sort_unstable();
            said.dedup();
            assert_eq!(said, may_say(state), "{state}");
            for ask in all() {
                if let Err(problem) = may(&ask) {
                    assert_eq!(problem.code, Code::Role, "{problem}");
                    assert!(problem.detail.starts_with(&format!("the fleet may not {}: ", ask.word())));
                }
                assert!(may_ask(&desired(Surface::Socket, ask), &hall).is_ok(), "people ask as ever");
            }
        }
    }

    #[test]
    fn what_is_not_allowed_is_refused_in_every_state_but_a_stop_and_so_is_all_without_a_fleet() {
        for state in State::ALL {
            let mut hall = hall(state, "one");
            for ask in all() {
                let asked = may_ask(&desired(Surface::Fleet, ask.clone()), &hall);
                assert_eq!(asked.is_ok(), ask == Command::Stop, "{state}: {ask}");
            }
            for word in every_word() {
                member(&mut hall, &[word]);
                for ask in all() {
                    let asked = may_ask(&desired(Surface::Fleet, ask.clone()), &hall);
                    let is_it = ask == Command::Stop || ask.fleet_word() == Some(word);
                    assert!(asked.is_err() || is_it, "{state}: {ask}");
                }
            }
        }
    }

    #[test]
    fn the_fleet_moves_no_seat_of_a_parked_hall_and_raises_no_level_above_what_a_person_set() {
        let mut rig = Rig::parked();
        member(&mut rig.supervisor.hall, &FleetWord::ALL.map(|(_, word)| word));
        let motion =
            |motion| Command::Levels(LevelsChange { motion: Some(motion), ..LevelsChange::default() });
        rig.ask(motion(0.6)).unwrap();
        assert!(rig.ask_as(Surface::Fleet, motion(0.9)).unwrap_err().detail.ends_with("motion is 60 %"));
        assert_eq!(rig.supervisor.hall.settings.levels.motion, 0.6);
        rig.ask_as(Surface::Fleet, motion(0.3)).unwrap();
        assert!(rig.ask_as(Surface::Fleet, Command::Park).unwrap_err().detail.contains("nobody has armed"));
        for ask in [Command::Go, Command::Arm { seats_empty: false }] {
            assert_eq!(rig.ask_as(Surface::Fleet, ask).unwrap_err().code, Code::Role);
        }
        assert_eq!(rig.state(), State::Parked);
        let mut rig = Rig::playing();
        member(&mut rig.supervisor.hall, &FleetWord::ALL.map(|(_, word)| word));
        rig.ask_as(Surface::Fleet, Command::Pause).unwrap();
        assert_eq!(rig.ask_as(Surface::Fleet, Command::Resume).unwrap_err().code, Code::Role);
        rig.ask_as(Surface::Fleet, Command::Park).unwrap();
        assert_eq!(rig.state(), State::Parking);
    }
}
