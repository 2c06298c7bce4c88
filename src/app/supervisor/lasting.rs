//! What lasts over a restart of the program and over another configuration: what people have set, what is loaded, and where in
//! it they were left. None of it starts anything.

use jiff::Zoned;

use super::act::{Act, Feature, SupervisorEvent};
use super::coded::{RemedyCode, WarningCode};
use super::hall::{HallContext, SetAside};
use super::job::{Again, Job, JobResult};
use super::show::LeftAt;
use crate::app::pair::{Ride, TookOver};
use crate::control::{Coded, Command, Desired, Severity, Warning, Who};
use crate::journal::{PlaylistPlace, stamp};
use crate::log::{Line, Priority};
use crate::settings::{LoadedShow, Out, Settings, seats_out};
use crate::state::State;
use crate::time::ShowTime;

/// How exactly it is known after a crash where a show was.
const KEPT_EVERY_MS: i64 = 5_000;

/// What is known of what lasts, beside the settings themselves.
#[derive(Debug, Default)]
pub(super) struct Lasting {
    /// What was loaded before, while it is loaded again.
    loading: Option<LoadedShow>,
    /// It is loaded, and the hall moves: it is taken up once it rests.
    ready: Option<Again>,
    /// What came back with the start of the program, in words; none once a show has begun.
    came_back: Option<String>,
    /// Nobody has armed the hall since the start of the program.
    unsaid: bool,
    /// What was loaded before was so at another machine, whose files may be others.
    pub(super) is_taken_over: bool,
    /// The show that was under way there, until it is loaded here and looked at whether it may go on.
    pub(super) ride: Option<Ride>,
}

impl Lasting {
    /// After the start of a program, for which that came back, in words; of this machine, or of the one that it took over from.
    pub(super) fn since_start(came_back: Option<String>, took_over: Option<&TookOver>) -> Self {
        let (is_taken_over, ride) = (took_over.is_some(), took_over.and_then(|it| it.ride));
        Self { came_back, unsaid: true, is_taken_over, ride, ..Self::default() }
    }

    /// The same for another hall, which loads anew what was loaded.
    pub(super) fn go_over(&mut self) -> Self {
        Self { loading: None, ready: None, is_taken_over: false, ride: None, ..std::mem::take(self) }
    }

    /// All that is to last, the playlist being there.
    pub(super) fn settings(&self, hall: &HallContext, playlist: Option<PlaylistPlace>) -> Settings {
        Settings {
            levels: hall.settings.levels.clone(),
            ceiling: Some(&hall.settings.ceiling).filter(|most| **most != hall.settings.levels).cloned(),
            trim_ms: hall.settings.trim_ms,
            out: hall.settings.out.clone(),
            show: self.loading.clone().or_else(|| loaded(hall, playlist)),
        }
    }

    /// Loads what was loaded before.
    pub(super) fn load_again(&mut self, loaded: LoadedShow) -> Act {
        self.loading = Some(loaded.clone());
        Act::Start(Job::Again(loaded))
    }

    /// What was loaded before is to be taken up: gives it back with what it was, unless the hall moves. It is taken up then once it
    /// rests.
    pub(super) fn take(&mut self, again: Again, hall: &HallContext) -> Option<(Again, Option<LoadedShow>)> {
        if hall.may("load").is_err() {
            self.ready = Some(again);
            return None;
        }
        Some((again, self.loading.take()))
    }

    /// Says what came back with the start.
    fn say(&self, hall: &HallContext, out: &mut Vec<Act>) {
        let now = Zoned::now();
        for (group, since) in &hall.settings.out {
            let names: Vec<&str> = hall.names_of(group).collect();
            if !names.is_empty() {
                out.push(kept(seats_out(&names, since, &now)));
            }
        }
        let words = self.came_back.as_ref();
        out.extend(words.map(|words| kept(format!("restored from before the start: {words}"))));
    }

    /// What is worth a word of it.
    pub(super) fn warnings(&self, hall: &HallContext, now: &Zoned) -> Vec<Warning> {
        let note = |id: RemedyCode, controller, text, remedy: &str| Warning {
            id: id.to_string(),
            severity: Severity::Info,
            controller,
            text,
            remedy: remedy.to_owned(),
            remedy_code: Some(id.to_string()),
            ..Warning::default()
        };
        let mut notes = Vec::new();
        for (group, out) in &hall.settings.out {
            let remedy = "enable it once it is repaired";
            let code = if out.why.is_some() { WarningCode::SeatOutWhy } else { WarningCode::SeatOut };
            let coded = Coded::new(code.word(), [&out.at, &out.who].into_iter().chain(&out.why).cloned());
            notes.extend(hall.names_of(group).map(|name| Warning {
                coded: Some(coded.clone()),
                ..note(RemedyCode::SeatOut, Some(name.to_owned()), out.words(now), remedy)
            }));
        }
        notes.extend(self.came_back.as_ref().map(|words| {
            let remedy = "change what should be different today";
            let coded = Some(Coded::new(WarningCode::Kept.word(), []));
            Warning {
                coded,
                ..note(RemedyCode::Kept, None, format!("restored from before the start: {words}"), remedy)
            }
        }));
        notes
    }
}

impl Feature for Lasting {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, out: &mut Vec<Act>) {
        match event {
            // A show begins: what was before is over.
            SupervisorEvent::Begun(_) => self.came_back = None,
            SupervisorEvent::Done(Desired { ask: Command::Arm { .. } | Command::ArmFor(_), .. })
                if self.unsaid =>
            {
                self.unsaid = false;
                self.say(hall, out);
            }
            SupervisorEvent::Entered(_) if hall.may("load").is_ok() => {
                out.extend(self.ready.take().map(|again| Act::Take(JobResult::Again(again))));
            }
            // Whoever resumes it is not to wait for preflight then.
            SupervisorEvent::Round(_) if hall.has_taken_over() && hall.job.is_none() => {
                out.extend(self.ride.take().map(|_| Act::Start(Job::Preflight)));
            }
            _ => {}
        }
    }
}

/// What is loaded; while seats are tested, what was before.
fn loaded(hall: &HallContext, playlist: Option<PlaylistPlace>) -> Option<LoadedShow> {
    let cued = hall.aside.as_ref().map_or(hall.cued.as_ref(), |SetAside(before)| before.as_ref())?;
    let at = millis(hall.live.show());
    let every = |ms: i64| Some(ms / KEPT_EVERY_MS * KEPT_EVERY_MS).filter(|ms| *ms > 0);
    // Of a film that runs on no more is kept than of one that plays.
    let left = cued.left(hall.now).map(millis);
    let left = if cued.left_at.is_some_and(LeftAt::runs) { left.and_then(every) } else { left };
    let film_ms = match hall.mirror.state {
        _ if hall.aside.is_some() => left,
        State::Playing(_) => every(at),
        State::Paused => Some(at).filter(|ms| *ms > 0),
        _ => hall.left_at.map(millis).or(left), // the seats may be on their way to rest
    };
    let (cue, sha256, (begins_ms, movie)) = (cued.id.clone(), cued.sha256.clone(), cued.led_by());
    Some(LoadedShow { cue, sha256, playlist, film_ms, begins_ms, movie })
}

/// Says something that was set before the program started.
fn kept(text: String) -> Act {
    Act::Log(Line::new(Priority::Notice, "kept", text))
}

impl Out {
    /// Taken out just now.
    pub(super) fn now(who: &Who, why: Option<String>) -> Self {
        let name = who.name.chars().filter(|c| !c.is_control()).collect();
        Self { who: name, surface: who.surface, at: stamp(&Zoned::now()), why }
    }
}

const fn millis(film: ShowTime) -> i64 {
    film.as_nanos() / 1_000_000
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{desired, hall, proved, told};
    use crate::control::Surface;

    #[test]
    fn what_came_back_is_said_at_the_first_arm_after_a_start_and_not_again() {
        let hall = hall(State::Armed, "one");
        let mut lasting = Lasting::since_start(Some("motion 60 %".to_owned()), None);
        let asks = [Command::Pause, Command::Arm { seats_empty: false }, Command::Arm { seats_empty: true }];
        let said = asks
            .map(|ask| told(&mut lasting, &SupervisorEvent::Done(&desired(Surface::Http, ask)), &hall).len());
        assert_eq!(said, [0, 1, 0]);
    }

    #[test]
    fn what_was_loaded_before_waits_for_the_hall_to_rest_and_is_kept_meanwhile() {
        let mut hall = hall(State::Parking, "one");
        let mut lasting = Lasting::default();
        let before = loaded(&hall, None).unwrap();
        lasting.load_again(before.clone());
        let again = || (None, Ok(Box::new(proved("one", &hall.config))));
        assert!(lasting.take(again(), &hall).is_none());
        hall.cued = None;
        assert_eq!(lasting.settings(&hall, None).show, Some(before.clone()));
        assert!(told(&mut lasting, &SupervisorEvent::Entered(State::Stopping), &hall).is_empty());
        hall.mirror.state = State::Stopped;
        let acts = told(&mut lasting, &SupervisorEvent::Entered(State::Stopped), &hall);
        let [Act::Take(JobResult::Again(again))] = <[Act; 1]>::try_from(acts).unwrap() else {
            panic!("it is taken up")
        };
        assert_eq!(lasting.take(again, &hall).unwrap().1, Some(before));
    }

    #[test]
    fn the_place_of_a_show_that_is_paused_or_on_its_way_to_rest_is_kept_exactly() {
        let mut hall = hall(State::Paused, "one");
        hall.live.on_show(ShowTime::from_millis(2_345));
        let place = |hall: &HallContext| loaded(hall, None).unwrap().film_ms;
        assert_eq!(place(&hall), Some(2_345));
        hall.note_place(State::Paused, State::Stopping);
        hall.mirror.state = State::Stopping;
        assert_eq!(place(&hall), Some(2_345));
    }

    #[test]
    fn while_seats_are_tested_what_was_loaded_before_lasts() {
        let mut hall = hall(State::Armed, "one");
        let test = Box::new(proved("test", &hall.config));
        hall.apply(super::super::hall::ShowChange::Test(test, None));
        assert_eq!(hall.cued.as_ref().unwrap().id, "test");
        assert_eq!(loaded(&hall, None).unwrap().cue, "one");
        hall.end_test();
        assert_eq!(hall.cued.as_ref().unwrap().id, "one");
    }
}
