//! Belts: which of them are open, and whether GO waits for them. An input is active while its belt is open, as in the second
//! example of the manuals' section 5.6.

use std::time::Duration;

use super::coded::{NextCode, RemedyCode, WarningCode};
use super::hall::HallContext;
use crate::config::{Belts, Controller};
use crate::control::{Code, Coded, Problem, Severity, Warning};
use crate::observe::ControllerState;
use crate::rt::Row;
use crate::state::State;
use crate::time::MonoTime;

/// What was told longer ago says nothing of now: while nothing moves the inputs are read every half a second or so.
const FRESH: Duration = Duration::from_secs(3);

/// The belts of a controller that are open; `None` if it has none, or has not told lately.
pub(super) fn open(controller: &Controller, state: &ControllerState, now: MonoTime) -> Option<u16> {
    let inputs = state.inputs.filter(|inputs| inputs.age(now) <= FRESH)?;
    (controller.belt_inputs != 0).then_some(inputs.value & controller.belt_inputs)
}

/// The inputs of a mask, counted from 1.
pub(super) fn numbers(mask: u16) -> Vec<u8> {
    (1..=12_u8).filter(|input| mask & (1 << (input - 1)) != 0).collect()
}

/// A controller whose belts are not all known to be closed.
struct Unbuckled<'k> {
    controller: &'k Controller,
    /// `None` if it does not tell.
    open: Option<u16>,
    /// True if GO waits for it.
    holds: bool,
}

impl Unbuckled<'_> {
    fn words(&self) -> String {
        let of =
            |mask| numbers(mask).iter().map(|input| format!("X{input:02}")).collect::<Vec<_>>().join(", ");
        self.open.map_or_else(|| "does not report its belts".to_owned(), of)
    }

    fn warning(&self) -> Warning {
        let words = self.words();
        let (text, coded) = match self.open {
            Some(_) => (format!("not buckled: {words}"), Coded::new(WarningCode::BeltOpen.word(), [words])),
            None => (words, Coded::new(WarningCode::BeltUntold.word(), [])),
        };
        let (code, remedy) = if self.holds {
            (RemedyCode::BuckleFirst, "GO waits for it: ")
        } else {
            (RemedyCode::Buckle, "")
        };
        Warning {
            id: WarningCode::BeltOpen.to_string(),
            severity: if self.holds { Severity::Warning } else { Severity::Info },
            controller: Some(self.controller.name.clone()),
            text,
            coded: Some(coded),
            remedy: format!("{remedy}buckle it, or disable the seat if nobody sits there"),
            remedy_code: Some(code.to_string()),
        }
    }
}

/// Those that take part and are not buckled.
fn unbuckled<'h>(hall: &'h HallContext, table: &[Row]) -> Vec<Unbuckled<'h>> {
    let config = &hall.config;
    let all: Vec<_> = (config.controllers.iter().enumerate())
        .filter(|(lane, one)| one.belt_inputs != 0 && hall.settings.is_on(*lane))
        .map(|(lane, one)| (one, table.get(lane).and_then(|row| open(one, &row.state, hall.now))))
        .collect();
    let closed = |one: &Controller, open: Option<u16>| open.is_some_and(|open| open != one.belt_inputs);
    let one_is_closed =
        |group: &str| all.iter().any(|(other, open)| other.group == group && closed(other, *open));
    let holds = |one: &Controller| match config.show.belts {
        Belts::Shown => false,
        Belts::One => !one_is_closed(&one.group),
        Belts::All => true,
    };
    let unbuckled = all.iter().filter(|(_, open)| *open != Some(0));
    unbuckled.map(|&(controller, open)| Unbuckled { controller, open, holds: holds(controller) }).collect()
}

/// True if nobody has to be buckled before the seats move.
///
/// # Errors
/// Who has to be.
pub(super) fn check(hall: &HallContext) -> Result<(), Problem> {
    match awaited(hall, &hall.live.table()) {
        None => Ok(()),
        Some(who) => {
            let remedy = "buckle them, or disable the seats where nobody sits";
            Err(Problem::new(Code::State, format!("cannot go: not buckled: {who}"), remedy))
        }
    }
}

/// Whose belts GO waits for; `None` if it need not.
fn awaited(hall: &HallContext, table: &[Row]) -> Option<String> {
    let unbuckled = unbuckled(hall, table);
    let holding = unbuckled.iter().filter(|one| one.holds);
    let who: Vec<_> = holding.map(|one| format!("{} ({})", one.controller.name, one.words())).collect();
    (!who.is_empty()).then(|| who.join(", "))
}

/// What a person does first, where GO waits for belts.
pub(super) fn next_action(hall: &HallContext, table: &[Row]) -> Option<(String, Coded)> {
    let who = (hall.mirror.state == State::Armed).then(|| awaited(hall, table)).flatten()?;
    Some((format!("GO waits until these are buckled: {who}"), Coded::new(NextCode::Belts.word(), [who])))
}

pub(super) fn warnings(hall: &HallContext, table: &[Row]) -> Vec<Warning> {
    unbuckled(hall, table).iter().map(Unbuckled::warning).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::testing::Rig;
    use super::*;
    use crate::control::Command;
    use crate::drive::LeftOn;
    use crate::health::{HealthState, Why};
    use crate::observe::Heard;
    use crate::sys::clock::Monotonic;
    use crate::time::Clock as _;
    use crate::tracker::Counts;

    const BELTS: u16 = 0b11;

    /// An armed hall whose two seats have two belts each; `inputs` is what they told just now.
    fn armed(rule: Belts, inputs: [Option<u16>; 2]) -> Rig {
        let mut rig = Rig::armed();
        let mut config = (*rig.supervisor.hall.config).clone();
        config.show.belts = rule;
        config.controllers.iter_mut().for_each(|one| one.belt_inputs = BELTS);
        rig.supervisor.hall.config = Arc::new(config);
        tell(&rig, inputs);
        rig
    }

    fn tell(rig: &Rig, inputs: [Option<u16>; 2]) {
        let at = Monotonic.now();
        rig.supervisor.hall.live.on_table(|rows| {
            *rows = inputs.map(|inputs| row(inputs, at)).into();
        });
    }

    fn row(inputs: Option<u16>, at: MonoTime) -> Row {
        let mut state = ControllerState::default();
        state.inputs = inputs.map(|value| Heard { value, at });
        Row {
            counts: Counts::default(),
            ack_ns: None,
            standing: HealthState::Ok,
            why: Why::Acked,
            left_on: LeftOn::default(),
            left_since: None,
            state,
            homed: Some(true),
            at,
        }
    }

    fn refused(rig: &mut Rig) -> String {
        let problem = rig.ask(Command::Go).unwrap_err();
        assert_eq!(rig.state(), State::Armed);
        problem.detail
    }

    #[test]
    fn go_waits_until_every_belt_is_closed_where_the_configuration_says_so() {
        let mut rig = armed(Belts::All, [Some(0b10), Some(0)]);
        assert_eq!(refused(&mut rig), "cannot go: not buckled: A1 (X02)");
        let status = rig.supervisor.status();
        assert_eq!(status.next, "GO waits until these are buckled: A1 (X02)");
        assert_eq!(status.controllers[0].belts_open, Some(vec![2]));
        let warning = status.warnings.iter().find(|one| one.id == "belt-open").unwrap();
        assert_eq!((warning.severity, &*warning.text), (Severity::Warning, "not buckled: X02"));
        tell(&rig, [Some(0), Some(0b100)]);
        assert_eq!(rig.supervisor.status().next, "go, or disarm");
        rig.ask(Command::Go).unwrap();
    }

    #[test]
    fn one_belt_of_a_seat_is_enough_where_that_is_the_rule() {
        let mut rig = armed(Belts::One, [Some(0b10), Some(0b11)]);
        assert_eq!(refused(&mut rig), "cannot go: not buckled: B1 (X01, X02)");
        tell(&rig, [Some(0b10), Some(0b01)]);
        rig.ask(Command::Go).unwrap();
    }

    #[test]
    fn belts_that_are_only_shown_hold_nothing_up() {
        let mut rig = armed(Belts::Shown, [Some(0b11), None]);
        let warnings = rig.supervisor.status().warnings;
        let told: Vec<_> = warnings.iter().filter(|one| one.id == "belt-open").collect();
        assert_eq!(told.len(), 2);
        assert!(told.iter().all(|one| one.severity == Severity::Info));
        rig.ask(Command::Go).unwrap();
    }

    #[test]
    fn a_belt_of_which_nobody_tells_is_not_closed_and_a_seat_that_is_out_needs_none() {
        let mut rig = armed(Belts::One, [None, Some(0)]);
        assert_eq!(refused(&mut rig), "cannot go: not buckled: A1 (does not report its belts)");
        assert_eq!(rig.supervisor.status().controllers[0].belts_open, None);
        rig.ask(Command::Disable { name: "A1".to_owned(), why: None }).unwrap();
        rig.ask(Command::Go).unwrap();
    }

    #[test]
    fn what_was_told_long_ago_is_no_closed_belt() {
        let rig = armed(Belts::All, [Some(0), Some(0)]);
        let then = Monotonic.now();
        let state = row(Some(0), then).state;
        let controller = &rig.supervisor.hall.config.controllers[0];
        assert_eq!(open(controller, &state, then + FRESH), Some(0));
        assert_eq!(open(controller, &state, then + FRESH + Duration::from_millis(1)), None);
    }
}
