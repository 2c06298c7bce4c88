//! The film that is shown from here with a cue: what the hall's player is told, and what a person should know of it. The seats are told
//! first, and never wait for it.

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::HallContext;
use crate::app::player::PlayerAsk;
use crate::config::OnStop;
use crate::control::Command;
use crate::state::{Cause, State};
use crate::time::ShowTime;

/// A film that is longer or shorter than its cue by no more is of its length.
const ALIKE_S: f64 = 1.0;

/// Tells the player what happens.
#[derive(Debug, Default)]
pub(super) struct FilmShown {
    /// How often it had ended by itself when that was noted last.
    ends: Option<u64>,
}

/// What is to be shown with what is loaded.
pub(super) fn load(hall: &HallContext) -> PlayerAsk {
    let movie = hall.cued.as_ref().and_then(|cued| cued.movie.as_ref());
    PlayerAsk::Load(movie.and_then(|movie| movie.file.clone().ok()))
}

/// Winds the film to a place in the cue, where one is shown.
pub(super) fn seek(film: ShowTime, hall: &HallContext) -> Option<Act> {
    shown(hall).map(|(begin, _)| Act::Player(PlayerAsk::Seek(later(begin, film))))
}

/// Where the film that is shown is when the cue begins and ends.
fn shown(hall: &HallContext) -> Option<(ShowTime, ShowTime)> {
    let cued = hall.cued.as_ref().filter(|cued| cued.movie.is_some())?;
    let begin = cued.film.map_or(ShowTime::ZERO, |film| film.begin);
    Some((begin, later(begin, cued.timeline.duration())))
}

fn later(begin: ShowTime, by: ShowTime) -> ShowTime {
    ShowTime::from_nanos(begin.as_nanos().saturating_add(by.as_nanos()).max(0))
}

/// What becomes of the film in a state that the hall has entered.
fn in_state(state: State, hall: &HallContext) -> Option<PlayerAsk> {
    let on_stop = || {
        let pauses = hall.config.film.as_ref().is_some_and(|film| film.on_stop == OnStop::Pause);
        pauses.then_some(PlayerAsk::Pause)
    };
    match state {
        State::Paused => Some(PlayerAsk::Pause),
        // The seats are done with it, and it with its end.
        State::Parking if matches!(hall.mirror.cause, Cause::CueEnded | Cause::FilmOver(_)) => None,
        State::Parking | State::Stopping | State::Stopped | State::Fault | State::Recovering => on_stop(),
        _ => None,
    }
}

impl Feature for FilmShown {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, out: &mut Vec<Act>) {
        if let SupervisorEvent::Round(_) = event {
            out.extend(self.note_end(hall));
        }
        let Some((begin, until)) = shown(hall) else { return };
        let ask = match event {
            SupervisorEvent::Begun(_) => {
                let from = hall.cued.as_ref().map_or(begin, |cued| later(begin, cued.start));
                Some(PlayerAsk::Begin { from, until })
            }
            SupervisorEvent::Entered(state) => in_state(*state, hall),
            SupervisorEvent::Done(desired) if matches!(desired.ask, Command::Resume) => Some(PlayerAsk::Play),
            _ => None,
        };
        out.extend(ask.map(Act::Player));
    }
}

impl FilmShown {
    /// The player has ended by itself: seats that followed it hold, and a person has to let both go on.
    fn note_end(&mut self, hall: &HallContext) -> Option<Act> {
        let state = hall.player.as_ref()?.state();
        let is_new = self.ends.replace(state.ends).is_some_and(|noted| noted < state.ends);
        let note = || format!("{}; resume once the film is back, paused where it was", state.ended);
        is_new.then(|| Act::Note(note()))
    }
}

/// What a person should know of the film that is shown, each with what to do.
pub(super) fn warnings(hall: &HallContext) -> Vec<String> {
    let Some(player) = &hall.player else { return Vec::new() };
    let state = player.state();
    let cued = hall.cued.as_ref();
    let missing = cued.and_then(|cued| cued.movie.as_ref()?.file.as_ref().err().cloned());
    let lengths = cued.zip(shown(hall)).zip(state.length_s).and_then(|((cued, (_, until)), length_s)| {
        let movie = cued.movie.as_ref()?;
        apart(&movie.name, length_s, &cued.id, until.as_secs_f64())
    });
    [missing, lengths, state.trouble].into_iter().flatten().collect()
}

/// What is to be said of a film whose cue ends elsewhere than it does.
fn apart(movie: &str, length_s: f64, cue: &str, until_s: f64) -> Option<String> {
    let over_s = length_s - until_s;
    let (of_film, of_cue) =
        (format!("the film {movie} is {length_s:.1} s long"), format!("{cue} ends at {until_s:.1} s of it"));
    if over_s > ALIKE_S {
        Some(format!(
            "{of_film}, and {of_cue}; the seats park there, and the next entry that starts cuts off the rest of the film"
        ))
    } else if over_s < -ALIKE_S {
        Some(format!(
            "{of_film}, and {of_cue}; the seats park where the film ends: is it the film of this cue?"
        ))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::sync::Arc;

    use super::*;
    use crate::app::supervisor::show::Movie;
    use crate::app::supervisor::testing::{hall, told};
    use crate::config::FilmPlayer;
    use crate::film::chase::ParkCause;
    use crate::state::Transition;

    fn showing(state: State, on_stop: OnStop, cause: Cause) -> HallContext {
        let mut hall = hall(state, "two");
        let folder = PathBuf::from("/srv/films");
        Arc::make_mut(&mut hall.config).film = Some(FilmPlayer {
            folder: folder.clone(),
            on_stop,
            fullscreen: true,
            screen: None,
            audio_device: None,
            video_output: None,
        });
        let movie = Movie { name: "two.mkv".to_owned(), file: Ok(folder.join("two.mkv")) };
        hall.cued.as_mut().unwrap().movie = Some(movie);
        hall.mirror.cause = cause;
        hall
    }

    fn asked(state: State, on_stop: OnStop, cause: Cause) -> Option<PlayerAsk> {
        let hall = showing(state, on_stop, cause);
        let acts = told(&mut FilmShown::default(), &SupervisorEvent::Entered(state), &hall);
        acts.into_iter().next().map(|act| match act {
            Act::Player(ask) => ask,
            act => panic!("{act:?}"),
        })
    }

    #[test]
    fn a_pause_pauses_the_film_a_stop_as_configured_and_the_end_of_either_leaves_it_alone() {
        let pause = Some(PlayerAsk::Pause);
        let by = Cause::Asked(Transition::Stop);
        for on_stop in [OnStop::Keep, OnStop::Pause] {
            assert_eq!(asked(State::Paused, on_stop, by), pause);
            for over in [Cause::CueEnded, Cause::FilmOver(ParkCause::FilmEnded)] {
                assert_eq!(asked(State::Parking, on_stop, over), None, "{over}");
            }
            for state in [State::Stopping, State::Stopped, State::Fault, State::Parking] {
                assert_eq!(asked(state, on_stop, by), pause.clone().filter(|_| on_stop == OnStop::Pause));
            }
        }
    }

    #[test]
    fn a_show_without_a_film_of_ours_tells_the_player_nothing() {
        let mut hall = showing(State::Paused, OnStop::Pause, Cause::CueEnded);
        hall.cued.as_mut().unwrap().movie = None;
        assert!(told(&mut FilmShown::default(), &SupervisorEvent::Entered(State::Paused), &hall).is_empty());
        assert!(seek(ShowTime::ZERO, &hall).is_none());
        assert_eq!(load(&hall), PlayerAsk::Load(None));
    }

    #[test]
    fn a_film_of_another_length_than_its_cue_is_named_with_both_lengths() {
        let said = |length_s| apart("a.mkv", length_s, "ride", 60.0);
        assert_eq!((said(60.9), said(59.1)), (None, None));
        assert!(said(72.5).unwrap().starts_with(
            "the film a.mkv is 72.5 s long, and ride ends at 60.0 s of it; the seats park there"
        ));
        assert!(said(48.0).unwrap().contains("is it the film of this cue?"));
    }
}
