//! Entries start by themselves where a person has let the one before go, or armed the hall for their time, and never otherwise.

use std::path::Path;

use super::*;
use crate::app::film::{FilmTable, SharedTable, SourceRow};
use crate::app::supervisor::testing::{Rig, hall, told};
use crate::config::{Config, FilmSync};
use crate::control::LevelsChange;
use crate::film::chase::{ChaseRules, ParkCause};
use crate::film::point::FilmState;
use crate::film::source::{FilmArgs, FilmSource};
use crate::playlist::{Playlist, Schedule};
use crate::rt::FilmStart;
use crate::state::{Event, PlayMode};
use crate::time::ShowTime;

const JOINING: State = State::Playing(PlayMode::Joining);
const DAY: &str = "title = \"Day\"\n[[entry]]\ncue = \"one\"\nthen = \"go\"\n[[entry]]\ncue = \"two\"\nthen = \"go\"\n\
    [[entry]]\ncue = \"three\"\nlevel = 0.5\n";

fn list() -> List {
    let playlist = Playlist::parse(Path::new("day.toml"), DAY).unwrap();
    let cues = vec![(None, 4.0); playlist.entries.len()];
    List {
        id: "day".to_owned(),
        playlist,
        cues,
        current: 0,
        schedule: Schedule::default(),
        missing: Vec::new(),
    }
}

/// A hall whose first entry plays.
fn playing() -> Rig {
    let mut rig = Rig::playing();
    rig.supervisor.features.onward.list = Some(list());
    rig
}

/// A hall that is armed, and loads the second entry, whose time has come.
fn due() -> Rig {
    let mut rig = Rig::armed();
    rig.supervisor.features.onward.list = Some(list());
    let acts = rig.supervisor.features.onward.fetch(1, Some(Start::Time));
    rig.does(acts);
    rig
}

fn cue(rig: &Rig) -> Option<&str> {
    rig.supervisor.hall.cued.as_ref().map(|cued| cued.id.as_str())
}

/// The seats have parked, and the next cue is on its way.
fn end_show(rig: &mut Rig) {
    rig.happens(|machine, now| machine.event(Event::Parked, now));
    rig.hear_of(State::Parked);
    rig.do_begun();
    assert!(rig.supervisor.hall.job.is_some());
}

/// Has something asked, with nothing looked after in between.
fn ask_in_between(rig: &mut Rig, ask: Command) {
    drop(rig.post(ask));
    rig.hear();
    rig.do_begun();
}

#[test]
fn an_entry_goes_on_to_the_next_once_its_cue_or_the_film_that_led_it_came_to_its_end() {
    for end in [Event::CueEnded, Event::FilmOver(ParkCause::FilmEnded)] {
        let mut rig = playing();
        rig.tell(end);
        rig.tell(Event::Parked);
        rig.settle();
        assert_eq!((rig.state(), cue(&rig)), (JOINING, Some("two")));
    }
}

#[test]
fn an_entry_whose_cue_has_gone_is_named_until_something_is_loaded_and_the_one_before_is_not_played_again() {
    let mut rig = playing();
    let [two, away] = ["cues/two.csv", "two.csv"].map(|name| rig.folder.path().join(name));
    std::fs::rename(&two, &away).unwrap();
    rig.tell(Event::CueEnded);
    rig.tell(Event::Parked);
    rig.settle();
    let status = rig.supervisor.status();
    let warning = status.warnings.iter().find(|one| one.id == "playlist").map(|one| one.text.clone());
    assert_eq!(warning.as_deref(), Some("entry 2 of day did not start: there is no cue two"));
    assert_eq!((rig.state(), cue(&rig), status.playlist.unwrap().current), (State::Parked, None, 1));
    assert_eq!(
        rig.ask(Command::Arm { seats_empty: false }).unwrap_err().detail,
        "cannot arm while parked: no cue is loaded"
    );
    std::fs::rename(&away, &two).unwrap();
    let status = rig.ask(Command::Select { entry: 1 }).unwrap();
    assert!(status.warnings.iter().all(|one| one.id != "playlist"), "{:?}", status.warnings);
    assert_eq!(cue(&rig), Some("two"));
}

#[test]
fn an_entry_whose_film_ended_or_left_in_the_midst_of_its_cue_goes_on_to_nothing() {
    for why in [ParkCause::FilmCutShort, ParkCause::CueLeft, ParkCause::HeldTooLong] {
        let mut rig = playing();
        rig.tell(Event::FilmOver(why));
        rig.tell(Event::Parked);
        rig.settle();
        assert_eq!((rig.state(), cue(&rig)), (State::Parked, Some("one")), "{why:?}");
    }
}

#[test]
fn a_cue_that_a_person_loads_beside_the_playlist_goes_on_to_nothing() {
    let mut rig = Rig::parked();
    rig.supervisor.features.onward.list = Some(list());
    rig.ask(Command::Load { cue: "three".to_owned() }).unwrap();
    rig.ask(Command::Arm { seats_empty: false }).unwrap();
    rig.ask(Command::Go).unwrap();
    assert_eq!(rig.supervisor.features.onward.place(&rig.supervisor.hall), None);
    rig.tell(Event::CueEnded);
    rig.tell(Event::Parked);
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (State::Parked, Some("three")));
}

#[test]
fn nothing_goes_on_that_a_person_wanted_to_rest_before_the_seats_were_parked() {
    for ask in [Command::Park, Command::Disarm, Command::Pause] {
        let mut rig = playing();
        rig.tell(Event::CueEnded);
        ask_in_between(&mut rig, ask.clone());
        rig.tell(Event::Parked);
        rig.settle();
        assert_eq!((rig.state(), cue(&rig)), (State::Parked, Some("two")), "{ask}");
    }
}

#[test]
fn nothing_goes_on_that_a_person_wanted_to_rest_while_the_next_cue_was_loaded() {
    for ask in [Command::Stop, Command::Park, Command::Disarm, Command::Pause] {
        let mut rig = playing();
        rig.tell(Event::CueEnded);
        end_show(&mut rig);
        ask_in_between(&mut rig, ask.clone());
        if ask == Command::Park {
            rig.tell(Event::Parked); // all were read once more
        }
        rig.settle();
        let rests = if ask == Command::Stop { State::Stopped } else { State::Parked };
        assert_eq!((rig.state(), cue(&rig)), (rests, Some("two")), "{ask}");
    }
}

#[test]
fn the_next_cue_that_comes_while_all_seats_are_read_once_more_is_loaded_after_that() {
    let mut rig = playing();
    rig.tell(Event::CueEnded);
    end_show(&mut rig);
    ask_in_between(&mut rig, Command::Park);
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (State::Parking, Some("one")));
    rig.tell(Event::Parked);
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (State::Parked, Some("two")));
}

#[test]
fn nothing_goes_on_after_a_stop_that_was_cleared_before_the_next_cue_was_loaded() {
    let mut rig = playing();
    rig.tell(Event::CueEnded);
    end_show(&mut rig);
    // By the stop socket, of which no word may come.
    rig.supervisor.hall.desk.stop();
    rig.hear_of(State::Stopped);
    rig.happens(|machine, now| {
        machine.request(Transition::Clear, now).unwrap();
        machine.event(Event::PositionsRead, now);
        machine.request(Transition::Park, now).unwrap();
    });
    rig.hear_of(State::Parking);
    rig.happens(|machine, now| machine.event(Event::Parked, now));
    rig.hear_of(State::Parked);
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (State::Parked, Some("two")));
}

#[test]
fn nothing_goes_on_while_the_program_ends() {
    let mut rig = playing();
    rig.tell(Event::CueEnded);
    rig.supervisor.ports.signals.leave.store(true, std::sync::atomic::Ordering::Release);
    rig.tell(Event::Parked);
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (State::Parked, Some("one")));
}

#[test]
fn an_entry_that_goes_on_homes_no_seat() {
    let mut rig = playing();
    rig.tell(Event::Rebooted(1));
    rig.tell(Event::CueEnded);
    rig.tell(Event::Parked);
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (State::Parked, Some("two")));
    assert!(
        rig.supervisor.notes.iter().any(|note| note.contains("home first")),
        "{:?}",
        rig.supervisor.notes
    );
}

#[test]
fn an_entry_whose_time_has_come_starts_while_the_hall_is_armed() {
    let mut rig = due();
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (JOINING, Some("two")));
}

#[test]
fn an_entry_whose_time_has_come_arms_nothing_that_a_person_has_disarmed_meanwhile() {
    for ask in [Command::Disarm, Command::Park, Command::Stop] {
        let mut rig = due();
        ask_in_between(&mut rig, ask.clone());
        rig.settle();
        assert!(matches!(rig.state(), State::Parked | State::Stopped), "{ask}: {}", rig.state());
    }
}

#[test]
fn an_entry_whose_time_has_come_does_not_start_where_arming_has_lapsed_meanwhile() {
    let mut rig = due();
    rig.happens(|machine, now| machine.tick(now + crate::state::ARMED_FOR));
    rig.hear_of(State::Parked);
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (State::Parked, Some("two")));
}

#[test]
fn a_show_that_a_person_lets_go_stays_the_one_that_is_loaded() {
    let mut rig = due();
    ask_in_between(&mut rig, Command::Go);
    rig.settle();
    assert_eq!((rig.state(), cue(&rig)), (JOINING, Some("one")));
    assert_eq!(rig.supervisor.features.onward.list.as_ref().unwrap().current, 0);
    let half = LevelsChange { motion: Some(0.5), ..LevelsChange::default() };
    rig.ask(Command::Levels(half)).unwrap();
}

#[test]
fn a_playlist_that_was_loaded_before_is_at_the_entry_where_it_was_or_at_that_of_its_cue() {
    let list = list();
    assert_eq!(list.nearest(1, "two"), 1);
    assert_eq!(list.nearest(0, "three"), 2, "somebody has changed it meanwhile");
    assert_eq!(list.nearest(0, "beside"), 0, "a cue that was loaded beside it");
    assert_eq!(list.nearest(7, "beside"), 2);
}

/// What is done for a wall clock that passes the time of the second entry in that state.
fn at_its_time(state: State) -> Vec<Act> {
    let text = "title = \"Day\"\ntimezone = \"UTC\"\n[[entry]]\ncue = \"one\"\n[[entry]]\ncue = \"two\"\nat = \"19:00\"\n";
    let playlist = Playlist::parse(Path::new("day.toml"), text).unwrap();
    let list = List { playlist, cues: vec![(None, 4.0); 2], current: 1, ..list() };
    let mut onward = Onward { list: Some(list), ..Onward::default() };
    let hall = hall(state, "two");
    let wall = |text: &str| text.parse::<Zoned>().unwrap();
    let before = wall("2026-11-22T18:59:59+00:00[UTC]");
    assert!(told(&mut onward, &SupervisorEvent::Clock(&before), &hall).is_empty());
    let starts_in = onward.list.as_ref().unwrap().starts_in(&before);
    assert_eq!(starts_in, Some(std::time::Duration::from_secs(1)));
    let at = wall("2026-11-22T19:00:00.01+00:00[UTC]");
    let acts = told(&mut onward, &SupervisorEvent::Clock(&at), &hall);
    assert!(told(&mut onward, &SupervisorEvent::Clock(&at), &hall).is_empty(), "once");
    acts
}

#[test]
fn the_time_of_an_entry_starts_it_in_an_armed_hall_and_is_noted_in_any_other() {
    let acts = at_its_time(State::Armed);
    let [Act::Name(_), Act::TellReadiness, Act::CheckBelts, Act::Go { surface: Surface::Schedule, .. }] =
        &acts[..]
    else {
        panic!("{acts:?}")
    };
    for state in [State::Parked, State::Recovering, State::Stopped, State::Playing(PlayMode::Following)] {
        let acts = at_its_time(state);
        let [Act::Passing(note)] = &acts[..] else { panic!("{acts:?}") };
        assert!(note.contains("nobody had armed the hall"), "{note}");
    }
}

/// What a hall in that state, in which `cue` is loaded of a reel of three parts, does for a film that is there, seconds after the hour.
struct Reel {
    onward: Onward,
    hall: HallContext,
}

impl Reel {
    fn new(state: State, cue: &str) -> Self {
        let text = "title = \"Reel\"\n[[entry]]\ncue = \"one\"\nfilm = \"01:00:00:00\"\n\
                    [[entry]]\ncue = \"two\"\nfilm = \"01:01:00:00\"\n[[entry]]\ncue = \"three\"\n";
        let playlist = Playlist::parse(Path::new("reel.toml"), text).unwrap();
        let list = List { playlist, cues: vec![(None, 60.0); 3], ..list() };
        let mut hall = hall(state, cue);
        let source = FilmSource::Mpv("/s".into());
        let args = FilmArgs::new(source, Some("25"), Some("01:00:00:00")).unwrap();
        let sync = FilmSync { sources: vec![args], leads: true, ..FilmSync::default() };
        hall.config = std::sync::Arc::new(Config { sync: Some(sync), ..(*hall.config).clone() });
        Self { onward: Onward { list: Some(list), ..Onward::default() }, hall }
    }

    /// Which entry is loaded for it, counted from 0.
    fn at(&mut self, media_s: f64, state: FilmState) -> Option<usize> {
        let row = SourceRow { media_s: Some(media_s), may_lead: true, ..SourceRow::named("ltc", state) };
        let table = FilmTable { sources: vec![row], leads: Some(0), ..FilmTable::default() };
        self.hall.film = Some(SharedTable::of(table));
        let heeded = told(&mut self.onward, &SupervisorEvent::Round(&[]), &self.hall);
        let [Act::Take(JobResult::Reached(entry))] = heeded[..] else {
            assert!(heeded.is_empty(), "a film has something else done: {heeded:?}");
            return None;
        };
        match &self.onward.enter(entry, &self.hall)[..] {
            [] => None,
            [Act::Name(_), Act::Start(Job::Entry(entry, ..))] => Some(*entry),
            acts => panic!("a film has something else done: {acts:?}"),
        }
    }
}

#[test]
fn a_film_that_comes_to_the_part_of_another_entry_has_it_loaded_once_while_all_is_parked() {
    let mut reel = Reel::new(State::Parked, "one");
    assert_eq!(reel.at(10.0, FilmState::Locked), None, "it is loaded");
    for state in FilmState::ALL.into_iter().filter(|state| *state != FilmState::Locked) {
        assert_eq!(reel.at(70.0, state), None, "{state:?}");
    }
    assert_eq!(reel.at(59.9, FilmState::Locked), None, "a part goes before the way up to the next");
    assert_eq!(reel.at(60.0, FilmState::Locked), Some(1));
    assert_eq!(reel.at(61.0, FilmState::Locked), None, "once: a person may select another meanwhile");
    reel.at(500.0, FilmState::Locked);
    assert_eq!(reel.at(-9.0, FilmState::Locked), None, "it is loaded, and ten seconds ahead it is");
    reel.at(-11.0, FilmState::Locked);
    assert_eq!(reel.at(119.0, FilmState::Locked), Some(1), "it has come there anew");
}

#[test]
fn frames_last_as_long_as_those_of_the_film_that_is_configured_or_heard() {
    let mut hall = hall(State::Armed, "one");
    let ms =
        |hall: &HallContext| [-1, 1, 2].map(|frames| crate::app::supervisor::film::frames_ms(frames, hall));
    assert_eq!(ms(&hall), [-42, 42, 83], "24 a second, where nobody knows");
    let told = |fps: &str| {
        let mut row = SourceRow::named("ltc", FilmState::Locked);
        row.notes.fps = Some(fps.to_owned());
        row
    };
    let mut table = FilmTable { sources: ["25", "30"].map(told).to_vec(), ..FilmTable::default() };
    hall.film = Some(SharedTable::of(table.clone()));
    assert_eq!(ms(&hall), [-40, 40, 80], "as of the first, while none leads");
    table.leads = Some(1);
    hall.film = Some(SharedTable::of(table));
    assert_eq!(ms(&hall), [-33, 33, 67]);
}

#[test]
fn no_film_has_a_cue_loaded_that_is_armed_or_moves_or_where_a_person_has_loaded_another() {
    let states = State::ALL.into_iter().filter(|state| *state != State::Parked);
    for state in states {
        let mut reel = Reel::new(state, "one");
        assert_eq!(reel.at(70.0, FilmState::Locked), None, "{state}");
        reel.hall.mirror.state = State::Parked;
        assert_eq!(reel.at(71.0, FilmState::Locked), Some(1), "after {state}: the film is still there");
    }
    assert_eq!(Reel::new(State::Parked, "beside").at(70.0, FilmState::Locked), None);
    let mut busy = Reel::new(State::Parked, "one");
    busy.hall.job = Some("preflight");
    assert_eq!(busy.at(70.0, FilmState::Locked), None);
    let mut goes_on = Reel::new(State::Parked, "one");
    goes_on.onward.fetch(1, Some(Start::GoOn));
    assert!(goes_on.onward.enter(2, &goes_on.hall).is_empty());
    assert_eq!((goes_on.at(70.0, FilmState::Locked), goes_on.onward.start), (None, Some(Start::GoOn)));
}

#[test]
fn a_show_that_waits_says_on_which_side_of_its_cue_the_film_is() {
    let mut hall = hall(State::Parked, "one");
    let begin = ShowTime::from_millis(60_000);
    let end = hall.cued.as_ref().unwrap().timeline.duration();
    hall.cued.as_mut().unwrap().film = Some(FilmStart { begin, rules: ChaseRules::until(end) });
    let mut side = |media_s| {
        let row = SourceRow { media_s: Some(media_s), ..SourceRow::named("ltc", FilmState::Locked) };
        hall.film = Some(SharedTable::of(FilmTable { sources: vec![row], ..FilmTable::default() }));
        crate::app::supervisor::film::outside(&hall)
    };
    assert_eq!(side(52.5), Some("it is before the beginning of the cue"));
    assert_eq!(side(61.0), None);
    assert_eq!(side(66.0), Some("it is behind the end of the cue"));
}

#[test]
fn what_is_next_about_a_film_that_runs_depends_on_whether_its_show_was_started() {
    let row = SourceRow::named("ltc", FilmState::Locked);
    let table = FilmTable { sources: vec![row], ..FilmTable::default() };
    let next = |state| crate::app::supervisor::film::status(&table, &hall(state, "one")).next;
    assert_eq!(next(JOINING), "nothing; the seats join it as soon as it is in the cue");
    for state in [State::Parked, State::Armed, State::Paused] {
        assert_eq!(next(state), "nothing; seats follow it once a person starts or resumes the show");
    }
}
