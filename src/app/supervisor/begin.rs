//! What stands against a motion that is to begin, whoever asks for it: seats that nobody buckled, and no seat at all.

use super::belts;
use super::hall::HallContext;
use crate::control::{Code, Problem};
use crate::health::HealthState;

/// True if a show may begin, or go on.
///
/// # Errors
/// What a person does first.
pub(super) fn check(what: &str, hall: &HallContext) -> Result<(), Problem> {
    needs_a_seat(what, false, hall)?;
    belts::check(hall)
}

/// True if a seat takes part, or will once it is homed, where that is asked for: else nothing would be armed, and the hall would say that it
/// plays.
///
/// # Errors
/// What a person does first.
pub(super) fn needs_a_seat(what: &str, homes: bool, hall: &HallContext) -> Result<(), Problem> {
    let table = hall.live.table();
    let may = |lane: usize| match table.get(lane).map(|row| row.standing) {
        Some(HealthState::Excluded) => homes,
        standing => standing.is_none_or(HealthState::may_move), // before the first report nothing is armed
    };
    if hall.lanes_on().any(may) {
        return Ok(());
    }
    let remedy = "enable seats (`kinocue enable`), or see at each why it is out, then repeat it";
    Err(Problem::new(Code::State, format!("cannot {what}: no seat takes part"), remedy))
}

#[cfg(test)]
mod tests {
    use crate::app::supervisor::testing::Rig;
    use crate::control::{Code, Command};
    use crate::health::HealthState::{self, Error, Excluded, Lost, Ok as Well};
    use crate::rt::Row;
    use crate::state::State;

    fn stand(rig: &Rig, standings: [HealthState; 2]) {
        let at = rig.supervisor.hall.now;
        let row = |standing| Row { standing, ..crate::app::supervisor::testing::row(at) };
        rig.supervisor.hall.live.on_table(|table| *table = standings.map(row).to_vec());
    }

    fn refused(rig: &mut Rig, ask: Command) {
        let word = ask.word();
        let problem = rig.ask(ask).unwrap_err();
        let told = (
            problem.code,
            problem.detail.ends_with(": no seat takes part"),
            problem.remedy.contains("enable"),
        );
        assert_eq!(told, (Code::State, true, true), "{word}: {problem}");
    }

    #[test]
    fn nothing_is_armed_begun_or_resumed_with_no_seat() {
        let mut rig = Rig::parked();
        let arms = [false, true].map(|seats_empty| Command::Arm { seats_empty });
        stand(&rig, [Lost, Error]);
        arms.iter().for_each(|arm| refused(&mut rig, arm.clone()));
        stand(&rig, [Excluded, Lost]);
        refused(&mut rig, arms[0].clone());
        stand(&rig, [Well, Lost]);
        rig.ask(arms[0].clone()).unwrap();
        // They fall out between arm and go, and in a pause.
        stand(&rig, [Lost, Lost]);
        refused(&mut rig, Command::Go);
        assert_eq!(rig.state(), State::Armed);
        stand(&rig, [Lost, Well]);
        rig.ask(Command::Go).unwrap();
        rig.ask(Command::Pause).unwrap();
        stand(&rig, [Lost, Lost]);
        refused(&mut rig, Command::Resume);
        assert_eq!(rig.state(), State::Paused);
        stand(&rig, [Lost, Well]);
        rig.ask(Command::Resume).unwrap();
        assert!(matches!(rig.state(), State::Playing(_)), "{}", rig.state());
    }

    #[test]
    fn nothing_is_armed_where_every_seat_is_disabled() {
        let mut rig = Rig::parked();
        stand(&rig, [Well, Well]);
        for name in ["A1", "B1"] {
            rig.ask(Command::Disable { name: name.to_owned(), why: None }).unwrap();
        }
        refused(&mut rig, Command::Arm { seats_empty: false });
    }
}
