//! Messages of a play: from its state, its cause and its current figures.

use std::fmt::{Display, Write as _};
use std::sync::Arc;
use std::time::Duration;

use super::{CtrlC, keyboard};
use crate::app::film::SharedTable;
use crate::app::{Control, RollCall};
use crate::engine::Unplanned;
use crate::film::chase::HoldCause;
use crate::rt::News;
use crate::state::{Cause, State, Transition, Whose};
use crate::time::ShowTime;

/// What there is to say of a play.
pub(super) struct Messages {
    pub(super) control: Control,
    pub(super) ctrl_c: CtrlC,
    /// Length of the cue.
    pub(super) length: ShowTime,
    /// How long the first move onto the cue takes.
    pub(super) join: Duration,
    /// What is heard of the film, if one leads the show.
    pub(super) film: Option<SharedTable>,
    /// Who answered.
    pub(super) roll: Arc<RollCall>,
    /// The controllers' names.
    pub(super) names: Vec<String>,
}

impl Messages {
    /// What goes on before the hall plays.
    pub(super) fn preparing(&self) -> String {
        let (seats, time) = self.control.live.parking();
        if seats == 0 {
            return "reading the positions of the seats".to_owned();
        }
        let noun = if seats == 1 { "seat" } else { "seats" };
        format!("bringing {seats} {noun} to park (up to {:.1} s)", time.as_secs_f64())
    }

    /// Who does not answer, and what to do, once that is known.
    pub(super) fn silent(&self) -> Option<String> {
        let silent = self.roll.silent();
        let next =
            if self.roll.is_open() { "press y to play without, or q to end" } else { "it plays without" };
        (!silent.is_empty()).then(|| format!("{}: nobody answers; {next}", silent.join(", ")))
    }

    /// What has happened: the state with its cause and the next action, or why a request was not taken; `None` if there is
    /// nothing to say.
    pub(super) fn news(&self, news: &News) -> Option<String> {
        let (state, cause, next) = match *news {
            News::Entered { state, cause, next, .. } => (state, cause, next),
            News::Refused(refusal) => return Some(refusal.by_keys()),
            News::Unplanned(what) => return Some(self.unplanned(what)),
            News::Taken | News::NotLoaded(_) | News::Started | News::CalledOff(_) => return None,
        };
        let mut text = match (state, cause) {
            // A play goes as soon as it is armed, and one that chases a film waits for that.
            (State::Boot | State::Armed, _) => return None,
            (State::Playing(_), Cause::Asked(Transition::Go)) if self.film.is_some() => return None,
            (State::Playing(_), Cause::Asked(Transition::Go)) => {
                format!("{state} ({:.2} s): {cause}", self.join.as_secs_f64())
            }
            _ => format!("{state}: {cause}"),
        };
        if let Some(name) = self.name(cause) {
            let _ = write!(text, " ({name})"); // a String takes it
        }
        // Why it waits is how the film was then, which may have changed by now.
        let says_state = !matches!(cause, Cause::FilmAwaited(HoldCause::Film(_)));
        if let Some(film) = self.film_place(says_state).filter(|_| matches!(state, State::Playing(_))) {
            let _ = write!(text, "; film {film}");
        }
        // Parked, the play is over.
        if state != State::Parked {
            let next = next.by_keys().map_or_else(|| next.to_string(), str::to_owned);
            let _ = write!(text, "; {}", self.next(next));
        }
        Some(text)
    }

    /// How the film is, if that is to be said, where in the cue, and by whom that is known.
    pub(super) fn film_place(&self, says_state: bool) -> Option<String> {
        self.film.as_ref()?.read().place(self.length, says_state)
    }

    fn unplanned(&self, what: Unplanned) -> String {
        match what {
            Unplanned::Seek => what.to_string(),
            Unplanned::Lane(lane) => format!("{}: {what}", self.names[lane]),
        }
    }

    fn name(&self, cause: Cause) -> Option<&str> {
        match cause.whose()? {
            Whose::Controller(index) => self.names.get(index).map(String::as_str),
            Whose::Group(_) => None,
        }
    }

    /// What a person does next.
    pub(super) fn next(&self, next: impl Display) -> String {
        let more = if self.ctrl_c.is_armed() { "; Ctrl-C again ends at once" } else { "" };
        format!("next: {next}{more}")
    }

    /// Where the show stands; behind the end of the cue that is its end.
    pub(super) fn show(&self) -> ShowTime {
        self.control.live.show().min(self.length)
    }

    /// The figures of this instant.
    pub(super) fn figures(&self, state: State) -> String {
        let Control { desk, live, .. } = &self.control;
        let mixes: Vec<_> = (0..desk.lanes()).map(|lane| desk.mix(lane)).collect();
        let (percent, trim, missed) = (keyboard::percent(&mixes), desk.trim_ms(), live.missed());
        let sign = if trim > 0 { "+" } else { "" };
        let mut text =
            format!("{state}: {} / {}, level {percent} %, trim {sign}{trim} ms", self.show(), self.length);
        if missed > 0 {
            let _ = write!(text, ", {missed} missed"); // a String takes it
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::film::{FilmTable, SourceRow};
    use crate::engine::Mix;
    use crate::film::point::FilmState;
    use crate::rt::{Desk, TickReport};
    use crate::state::{Next, PlayMode, Refusal, Trouble, Why};
    use crate::time::MonoTime;

    fn said() -> Messages {
        let desk = Arc::new(Desk::new([Mix::FULL, Mix { motion: 0.5, ..Mix::FULL }].into_iter()));
        Messages {
            control: Control { desk, live: Arc::default(), leave: Arc::default() },
            ctrl_c: CtrlC::default(),
            length: ShowTime::from_secs_f64(8.0),
            join: Duration::from_millis(1_250),
            film: None,
            roll: Arc::default(),
            names: vec!["A1".to_owned(), "A2".to_owned()],
        }
    }

    fn entered(state: State, cause: Cause, next: Next) -> News {
        News::Entered { state, cause, next, at: MonoTime::default() }
    }

    #[test]
    fn before_the_play_it_says_what_the_seats_are_doing() {
        let said = said();
        assert_eq!(said.preparing(), "reading the positions of the seats");
        [2_000, 3_000].into_iter().for_each(|ms| said.control.live.on_parking(ms));
        assert_eq!(said.preparing(), "bringing 2 seats to park (up to 3.0 s)");
    }

    #[test]
    fn a_state_comes_with_its_cause_and_the_next_action() {
        let said = said();
        let go = entered(State::Playing(PlayMode::Joining), Cause::Asked(Transition::Go), Next::Watch);
        assert_eq!(
            said.news(&go).unwrap(),
            "joining (1.25 s): started by the operator; next: nothing; pause, park or stop as needed"
        );
        let pressed = entered(State::Stopped, Cause::EmergencyStop(1), Next::Release);
        assert_eq!(
            said.news(&pressed).unwrap(),
            "stopped: emergency stop (A2); next: release the emergency-stop button, then clear"
        );
        let broken = Trouble::Homing(0);
        let fault = entered(State::Fault, Cause::Trouble(broken), Next::LookAtSeat);
        assert_eq!(
            said.news(&fault).unwrap(),
            "fault: a seat failed to home (A1); next: inspect the seat, then clear and home again"
        );
        let parked = entered(State::Parked, Cause::ArrivedAtPark, Next::Arm);
        assert_eq!(
            said.news(&parked).unwrap(),
            "parked: the seats that take part have parked",
            "the play is over"
        );
    }

    #[test]
    fn why_it_waits_for_the_film_comes_with_its_place_and_with_no_state_that_is_another_by_now() {
        let row = SourceRow { media_s: Some(4.0), ..SourceRow::named("ltc:-", FilmState::Locked) };
        let film = FilmTable { sources: vec![row], ..FilmTable::default() };
        let said = Messages { film: Some(SharedTable::of(film)), ..said() };
        let lost = Cause::FilmAwaited(HoldCause::Film(FilmState::Lost));
        let waits = said.news(&entered(State::Playing(PlayMode::Waiting), lost, Next::AwaitFilm)).unwrap();
        assert!(waits.contains("any more; film at 00:04.000 of the cue by ltc:-; next: "), "{waits}");
        let joins = entered(State::Playing(PlayMode::Joining), Cause::FilmLeads, Next::Watch);
        assert!(said.news(&joins).unwrap().contains("; film locked, at 00:04.000 of the cue by ltc:-; "));
    }

    #[test]
    fn a_refusal_says_what_stands_against_it_and_what_to_do_first() {
        let refusal =
            Refusal { state: State::Recovering, asked: Transition::Park, why: Why::PositionsNotRead };
        assert_eq!(
            said().news(&News::Refused(refusal)).unwrap(),
            "cannot park while recovering: the seats' positions have not been read since they stopped; wait until the \
             controllers have answered"
        );
    }

    #[test]
    fn it_names_nothing_that_its_keys_cannot_do() {
        let text = |next| said().news(&entered(State::Recovering, Cause::Cleared, next)).unwrap();
        assert!(text(Next::Home).contains("quit, then `kinocue home` with this --config or --to"));
        assert!(text(Next::ParkOrHome).ends_with("next: park"));
        for next in Next::ALL {
            assert!(!text(next).contains("disable"), "{next}");
        }
    }

    #[test]
    fn a_move_that_was_not_found_names_the_seat_and_what_to_do() {
        let told = said().news(&News::Unplanned(Unplanned::Lane(1))).unwrap();
        assert!(told.starts_with("A2: it stays where it is: ") && told.ends_with(", or park"), "{told}");
    }

    #[test]
    fn only_after_a_first_ctrl_c_does_it_say_what_a_second_one_does() {
        let said = said();
        assert_eq!(said.next("wait"), "next: wait");
        said.ctrl_c.arm();
        assert_eq!(said.next("wait"), "next: wait; Ctrl-C again ends at once");
    }

    #[test]
    fn the_figures_are_state_position_length_level_and_trim() {
        let said = said();
        let paused = |said: &Messages| said.figures(State::Paused);
        assert_eq!(paused(&said), "paused: 00:00.000 / 00:08.000, level 100 %, trim 0 ms");
        said.control.desk.set_trim_ms(10);
        (0..2).for_each(|lane| said.control.desk.set(lane, Mix { motion: 0.45, ..Mix::FULL }));
        let show = ShowTime::from_secs_f64(9.0);
        said.control.live.on_show(show);
        said.control.live.on_tick(&TickReport { late_ns: 0, missed: 2 });
        let past_the_end = "paused: 00:08.000 / 00:08.000, level 45 %, trim +10 ms, 2 missed";
        assert_eq!(paused(&said), past_the_end);
    }
}
