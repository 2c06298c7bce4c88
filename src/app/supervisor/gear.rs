//! What show-control gear and buttons may do in a hall that people lead: go on where it paused itself, take in what it took out itself,
//! and set levels up to what a person has set. The address that its messages come from proves nothing.

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::{HallContext, ShowChange};
use super::hall_settings::HallSettings;
use crate::control::{Code, Command, Desired, Levels, LevelsChange, Problem, Surface};
use crate::state::{PlayMode, State};
use crate::time::MonoTime;

/// Seats wait for the film, or for a person who lets them join it.
const WAITING: State = State::Playing(PlayMode::Waiting);

/// What has to be known of gear, to tell its doing from that of people.
#[derive(Debug, Default)]
pub(super) struct GearLimits {
    /// Since when the hall is paused by gear, and by no person; where that is not the pause of now, it is an old one.
    paused: Option<MonoTime>,
    /// The state of the hall when what is done now was asked.
    before: Option<State>,
}

impl GearLimits {
    /// True if it may be done for whom it is asked for.
    ///
    /// # Errors
    /// Where gear would undo what a person did.
    pub(super) fn may_ask(&self, desired: &Desired, hall: &HallContext) -> Result<(), Problem> {
        let Desired { ask, who } = desired;
        if who.surface == Surface::Buttons {
            return of_button(ask, hall);
        }
        if !who.surface.is_gear() || matches!(ask, Command::Stop | Command::Pause) {
            return Ok(());
        }
        let refused = |why: &str, remedy: &str| {
            let detail = format!("{} may not {}: {why}", who.surface, ask.word());
            Err(Problem::new(Code::Role, detail, remedy))
        };
        let mirror = &hall.mirror;
        if mirror.state == State::Paused && self.paused != Some(mirror.since) {
            return refused("it did not pause the hall", "let a person resume it");
        }
        match ask {
            Command::Resume if mirror.state == WAITING => {
                refused("a person lets seats join a film", "let a person resume")
            }
            Command::Resume if !hall.is_on_cue() => {
                refused("nothing is paused", "let a person check the hall first")
            }
            Command::Enable(name)
                if hall.settings.out.get(group(hall, name)).is_some_and(|out| !out.surface.is_gear()) =>
            {
                refused(&format!("it did not disable {name}"), "let a person enable it")
            }
            _ => Ok(()),
        }
    }
}

impl Feature for GearLimits {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, _out: &mut Vec<Act>) {
        match event {
            SupervisorEvent::Asked(_) => self.before = Some(hall.mirror.state),
            SupervisorEvent::Done(Desired { ask: Command::Pause, who }) => {
                // To resume is to let seats join, which is not for gear where they waited for that.
                if !who.surface.is_gear() || self.before == Some(WAITING) {
                    self.paused = None;
                } else if self.before != Some(State::Paused) {
                    self.paused = Some(hall.mirror.since);
                }
            }
            _ => {}
        }
    }
}

/// True if a button may ask it: it moves no seat that nobody has armed, as a park would in a hall that is parked or recovering.
fn of_button(ask: &Command, hall: &HallContext) -> Result<(), Problem> {
    let state = hall.mirror.state;
    if *ask != Command::Park || hall.is_on_cue() || matches!(state, State::Armed | State::Parking) {
        return Ok(());
    }
    let detail =
        format!("a button may not park while {state}: nobody has armed the seats that this may move");
    Err(Problem::new(
        Code::Role,
        detail,
        "look at the seats, then park on the console or with `kinocue park`",
    ))
}

/// Sets levels for gear: no higher than a person has set, which it is told where it asked for more.
///
/// # Errors
/// Where it is no change.
pub(super) fn levels(change: &LevelsChange, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    let (change, over) = hall.settings.within(change);
    let mut settings = hall.settings.clone();
    settings.change_below(&change)?;
    let mut acts = vec![Act::Stage(ShowChange::Settings(Box::new(settings)))];
    if !over.is_empty() {
        let detail = format!("a person has set a lower level: {}", over.join(", "));
        let remedy = "let a person raise it, on the console or with `kinocue level`";
        acts.push(Act::Fail(Problem::new(Code::Role, detail, remedy)));
    }
    Ok(acts)
}

fn group<'n>(hall: &'n HallContext, name: &'n str) -> &'n str {
    let controllers = &hall.config.controllers;
    controllers.iter().find(|one| one.name == name).map_or(name, |one| &one.group)
}

impl HallSettings {
    /// What of a change a person has allowed for, and in words what was taken back to that.
    fn within(&self, change: &LevelsChange) -> (LevelsChange, Vec<String>) {
        let Levels { motion, vibration, effects, rows } = &self.ceiling;
        let mut change = change.clone();
        let mut over = Vec::new();
        let mut level = |name: &str, asked: &mut f64, most: f64| {
            if *asked > most {
                over.push(format!("{name} is {:.0} %", most * 100.0));
                *asked = most;
            }
        };
        if let Some(asked) = &mut change.motion {
            level("motion", asked, *motion);
        }
        if let Some(asked) = &mut change.vibration {
            level("vibration", asked, *vibration);
        }
        for (row, asked) in &mut change.rows {
            level(&format!("row {row}"), asked, rows.get(row).copied().unwrap_or(1.0));
        }
        for (name, on) in
            change.effects.iter_mut().filter(|(name, on)| **on && effects.get(*name) == Some(&false))
        {
            over.push(format!("{name} is off"));
            *on = false;
        }
        (change, over)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{Rig, desired, hall};

    fn role(result: Result<std::sync::Arc<crate::control::Status>, Problem>) -> String {
        let problem = result.unwrap_err();
        assert_eq!(problem.code, Code::Role, "{problem}");
        problem.detail
    }

    #[test]
    fn gear_goes_on_where_it_paused_itself_and_nowhere_else() {
        let mut rig = Rig::playing();
        for surface in [Surface::Osc, Surface::Text] {
            rig.ask_as(surface, Command::Pause).unwrap();
            rig.ask_as(surface, Command::Resume).unwrap();
            rig.ask(Command::Pause).unwrap();
            assert!(role(rig.ask_as(surface, Command::Resume)).ends_with("it did not pause the hall"));
            rig.ask_as(surface, Command::Pause).unwrap();
            role(rig.ask_as(surface, Command::Resume));
            for ask in [
                Command::Park,
                Command::Seek(crate::time::ShowTime::ZERO),
                Command::Disable { name: "A1".to_owned(), why: None },
            ] {
                role(rig.ask_as(surface, ask));
            }
            assert_eq!(rig.state(), State::Paused);
            rig.ask(Command::Resume).unwrap();
        }
        rig.ask_as(Surface::Osc, Command::Pause).unwrap();
        rig.ask(Command::Pause).unwrap();
        role(rig.ask_as(Surface::Osc, Command::Resume));
        rig.ask(Command::Stop).unwrap();
        role(rig.ask_as(Surface::Osc, Command::Resume));
    }

    #[test]
    fn a_button_parks_what_a_person_has_armed_and_moves_no_other_seat() {
        let park = desired(Surface::Buttons, Command::Park);
        let may = |state| GearLimits::default().may_ask(&park, &hall(state, "one")).is_ok();
        for state in
            [State::Playing(PlayMode::Following), WAITING, State::Paused, State::Armed, State::Parking]
        {
            assert!(may(state), "{state}");
        }
        for state in
            [State::Boot, State::Recovering, State::Parked, State::Homing, State::Stopped, State::Fault]
        {
            assert!(!may(state), "{state}");
        }
        let mut rig = Rig::playing();
        rig.ask(Command::Pause).unwrap();
        rig.ask_as(Surface::Buttons, Command::Park).unwrap();
        let mut rig = Rig::parked();
        assert!(role(rig.ask_as(Surface::Buttons, Command::Park)).contains("nobody has armed"));
        assert!(rig.ask_as(Surface::Buttons, Command::Go).is_err(), "nobody has armed it");
    }

    #[test]
    fn gear_lets_no_seats_join_a_film_not_even_by_a_pause_of_its_own() {
        let mut rig = Rig::playing();
        rig.supervisor.hall.mirror.state = WAITING;
        let limits = |rig: &Rig, ask| {
            let desired = desired(Surface::Osc, ask);
            GearLimits::default().may_ask(&desired, &rig.supervisor.hall)
        };
        assert!(limits(&rig, Command::Resume).is_err());
        assert!(limits(&rig, Command::Pause).is_ok());
    }

    #[test]
    fn gear_takes_in_only_what_it_took_out() {
        let mut rig = Rig::parked();
        let (enable, disable) =
            (|| Command::Enable("A1".to_owned()), || Command::Disable { name: "A1".to_owned(), why: None });
        rig.ask_as(Surface::Osc, disable()).unwrap();
        rig.ask_as(Surface::Osc, enable()).unwrap();
        rig.ask(disable()).unwrap();
        assert!(role(rig.ask_as(Surface::Osc, enable())).ends_with("it did not disable A1"));
        rig.ask_as(Surface::Osc, disable()).unwrap();
        role(rig.ask_as(Surface::Osc, enable()));
        rig.ask(enable()).unwrap();
        rig.ask_as(Surface::Osc, disable()).unwrap();
        rig.ask(disable()).unwrap();
        role(rig.ask_as(Surface::Osc, enable()));
        assert!(rig.supervisor.hall.settings.out.contains_key("A1"));
    }

    #[test]
    fn gear_sets_levels_up_to_what_a_person_set() {
        let mut rig = Rig::parked();
        let motion =
            |motion| Command::Levels(LevelsChange { motion: Some(motion), ..LevelsChange::default() });
        rig.ask(motion(0.6)).unwrap();
        for (asked, is) in [(1.0, 0.6), (0.2, 0.2), (0.5, 0.5), (0.7, 0.6)] {
            let answer = rig.ask_as(Surface::Osc, motion(asked));
            if asked > is {
                assert!(role(answer).ends_with("motion is 60 %"));
            }
            assert_eq!(rig.supervisor.hall.settings.levels.motion, is, "{asked} was asked");
        }
        // Nor after a restart is what gear has set taken for what a person did.
        rig.ask_as(Surface::Osc, motion(0.2)).unwrap();
        let kept = crate::settings::Settings::parse(&rig.supervisor.settings().text()).unwrap();
        let mut after =
            crate::app::supervisor::hall_settings::HallSettings::with(&rig.supervisor.hall.config, &kept);
        assert_eq!(
            (after.levels.motion, after.within(&LevelsChange { motion: Some(1.0), ..<_>::default() }).1),
            (0.2, vec!["motion is 60 %".to_owned()])
        );
        after.change_below(&LevelsChange { motion: Some(0.6), ..<_>::default() }).unwrap();
        let rows = |a: f64, b: f64| LevelsChange {
            rows: [("A".to_owned(), a), ("B".to_owned(), b)].into(),
            ..LevelsChange::default()
        };
        rig.ask(Command::Levels(rows(0.5, 1.0))).unwrap();
        role(rig.ask_as(Surface::Text, Command::Levels(rows(1.0, 0.1))));
        let levels = &rig.supervisor.hall.settings.levels.rows;
        assert_eq!(
            (levels["A"], levels["B"]),
            (0.5, 0.1),
            "one that was too high keeps none from being lowered"
        );
        rig.ask(motion(1.0)).unwrap();
        rig.ask_as(Surface::Osc, motion(0.9)).unwrap();
    }
}
