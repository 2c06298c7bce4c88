//! What must not happen when things come at the same time.

use std::sync::atomic::Ordering;
use std::sync::mpsc::channel;
use std::thread::JoinHandle;

use super::homing::Homing;
use super::job::{Job, JobResult};
use super::preflighted::Preflighted;
use super::show::LeftAt;
use super::testing::{Rig, row};
use super::*;
use crate::app::film::{FilmTable, SharedTable};
use crate::app::pair::{Ride, TookOver};
use crate::config::Belts;
use crate::control::{Code, Command, LevelsChange};
use crate::engine::Unplanned;
use crate::film::chase::ChaseRules;
use crate::health::HealthState;
use crate::motion::Pulses;
use crate::observe::Heard;
use crate::rt::{FilmStart, News, Row};
use crate::settings::{Kept, LoadedShow};
use crate::state::{Event, Finding, LedBefore, Next, PlayMode, Transition, Trouble};
use crate::time::ShowTime;
use crate::wire::PerAxis;

mod told;

const ARM: Command = Command::Arm { seats_empty: false };

fn out(name: &str) -> Command {
    Command::Disable { name: name.to_owned(), why: None }
}

#[test]
fn a_hall_that_was_latched_is_so_with_another_configuration_too() {
    let mut before = Rig::parked();
    before.ask(Command::Stop).unwrap();
    let carryover = before.supervisor.remember();
    let mut rig = Rig::starting(carryover);
    rig.wait_until(|supervisor| supervisor.hall.mirror.state == State::Stopped);
    assert!(
        rig.supervisor.notes.iter().any(|note| note.contains("stopped by the operator")),
        "{:?}",
        rig.supervisor.notes
    );
    let parked = Rig::starting(Rig::parked().supervisor.remember());
    assert_eq!(parked.state(), State::Boot);
}

#[test]
fn so_is_one_that_the_tick_thread_stopped_as_it_left() {
    let mut before = Rig::parked();
    before.handle.stop();
    while before.state() != State::Stopped {
        std::thread::yield_now();
    }
    let mut rig = Rig::starting(before.supervisor.remember());
    rig.wait_until(|supervisor| supervisor.hall.mirror.state == State::Stopped);
}

#[test]
fn a_seat_that_is_out_is_out_from_the_first_tick_of_the_next_hall_on() {
    let mut before = Rig::parked();
    before.ask(out("B1")).unwrap();
    let rig = Rig::starting(before.supervisor.remember());
    assert_eq!([0, 1].map(|lane| rig.supervisor.hall.desk.mix(lane).on), [true, false]);
}

/// What a supervisor that ends here leaves for one that starts after it, as its file does.
fn after_a_restart(mut rig: Rig) -> Carryover {
    let folder = rig.folder.path().to_owned();
    rig.supervisor.keep_settings();
    let Rig { supervisor, folder: kept, .. } = rig;
    drop(supervisor);
    let (_store, found) = SettingsFile::open(&folder);
    drop(kept);
    Carryover::of(found, None)
}

#[test]
fn a_seat_that_was_taken_out_is_out_after_a_restart_and_whoever_arms_first_is_told() {
    let mut before = Rig::parked();
    let why = Some("broken leg".to_owned());
    before.ask(Command::Disable { name: "B1".to_owned(), why }).unwrap();
    before.ask(Command::Levels(LevelsChange { motion: Some(0.6), ..LevelsChange::default() })).unwrap();
    before.ask(Command::Trim(-40)).unwrap();
    let mut rig = Rig::starting(after_a_restart(before));
    let desk = &rig.supervisor.hall.desk;
    assert_eq!(([0, 1].map(|lane| desk.mix(lane).on), desk.trim_ms()), ([true, false], -40));
    assert!((desk.mix(0).motion - 0.6).abs() < 1e-6);
    let status = rig.supervisor.status();
    let said = |id: &str| status.warnings.iter().find(|one| one.id == id).map(|one| one.text.clone());
    let out = said("seat-out").unwrap();
    assert!(out.starts_with("out since ") && out.ends_with(", by anna: broken leg"), "{out}");
    assert_eq!(said("kept").unwrap(), "restored from before the start: motion 60 %, trim -40 ms, cue one");
    assert!(status.controllers[1].why.contains("broken leg"), "{}", status.controllers[1].why);
    rig.ask(Command::Enable("B1".to_owned())).unwrap();
    assert!(rig.supervisor.settings().out.is_empty());
}

#[test]
fn a_seat_that_is_taken_out_again_stays_out_since_then_and_a_reason_can_be_added() {
    let mut rig = Rig::parked();
    rig.ask(out("B1")).unwrap();
    let first = rig.supervisor.settings().out["B1"].clone();
    rig.ask(Command::Disable { name: "B1".to_owned(), why: Some("broken leg".to_owned()) }).unwrap();
    rig.ask(out("B1")).unwrap();
    let now = rig.supervisor.settings().out["B1"].clone();
    assert_eq!((&now.at, now.why.as_deref()), (&first.at, Some("broken leg")));
    let long = Command::Disable { name: "A1".to_owned(), why: Some("x".repeat(201)) };
    assert_eq!(rig.ask(long).unwrap_err().code, Code::Value);
    assert!(rig.supervisor.hall.settings.is_on(0));
}

#[test]
fn what_was_loaded_is_loaded_after_a_restart_and_nothing_starts() {
    let mut before = Rig::parked();
    before.ask(Command::Load { cue: "two".to_owned() }).unwrap();
    let folder = before.folder.path().to_owned();
    let mut rig = Rig::starting_in(|folder_of_next| {
        std::fs::create_dir(folder_of_next.join("cues")).unwrap();
        let cue = "cues/two.csv";
        std::fs::copy(folder.join(cue), folder_of_next.join(cue)).unwrap();
        after_a_restart(before)
    });
    // Also where the program ends before it is loaded.
    assert_eq!(rig.supervisor.settings().show.unwrap().cue, "two");
    rig.settle();
    assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().id, "two");
    assert_eq!(rig.state(), State::Boot);
}

/// Has the supervisor look after all until it has loaded a cue, while each status says that it does, or that it has.
#[track_caller]
fn loads_without_a_gap(rig: &mut Rig, cue: &str) {
    let is_loaded = |status: &Status| status.show.as_ref().is_some_and(|show| show.cue == cue);
    while rig.supervisor.hall.job.is_some() || !is_loaded(&rig.handle.status()) {
        let status = rig.handle.status();
        assert!(status.job.as_deref() == Some("loading") || is_loaded(&status), "{status:?}");
        rig.supervisor.told = MonoTime::default(); // a status is due at once
        rig.supervisor.turn();
    }
}

#[test]
fn from_before_a_cue_is_read_until_it_is_loaded_each_status_says_that_it_is_being_loaded() {
    let mut rig = Rig::parked();
    let changing = rig.library.clone();
    let changing = changing.changing();
    let asked = rig.post(Command::Load { cue: "two".to_owned() });
    rig.hear();
    assert_eq!(rig.handle.status().job.as_deref(), Some("loading"), "before anything else is looked after");
    // What a fleet was about to change is changed before it is read.
    let path = rig.folder.path().join("cues/two.csv");
    let before = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, before.replace("0.6", "0.55")).unwrap();
    drop(changing);
    loads_without_a_gap(&mut rig, "two");
    rig.settle();
    asked.join().unwrap().unwrap();
    let wanted = rig.library.read(&"two".parse().unwrap()).unwrap().1;
    assert_eq!(rig.handle.status().show.as_ref().unwrap().sha256, wanted);
    let mut next = Rig::starting_in(|folder| {
        std::fs::create_dir(folder.join("cues")).unwrap();
        std::fs::copy(&path, folder.join("cues/two.csv")).unwrap();
        after_a_restart(rig)
    });
    next.supervisor.turn();
    loads_without_a_gap(&mut next, "two");
}

/// A hall that took over from a machine whose show was at 1.5 s of `two`, which runs on since then or is paused.
fn taken_over(runs_since: Option<MonoTime>) -> Rig {
    taken_over_as(runs_since, |_| {})
}

/// The same of a show that was loaded so.
fn taken_over_as(runs_since: Option<MonoTime>, was: impl FnOnce(&mut LoadedShow)) -> Rig {
    let mut before = Rig::parked();
    let cue = before.folder.path().join("cues/two.csv");
    // Long enough for a machine that takes seconds for what follows.
    std::fs::write(&cue, "time_ms,a1\n0,0.5\n1000,0.5\n2000,0.5\n60000,0.5\n").unwrap();
    before.ask(Command::Load { cue: "two".to_owned() }).unwrap();
    let mut rig = Rig::starting_in(|folder| {
        std::fs::create_dir(folder.join("cues")).unwrap();
        std::fs::copy(&cue, folder.join("cues/two.csv")).unwrap();
        let mut settings = before.supervisor.settings();
        let show = settings.show.as_mut().unwrap();
        show.film_ms = Some(1_500);
        was(show);
        let took_over = TookOver { words: "took over".to_owned(), ride: Some(Ride { runs_since }) };
        Carryover::of(Kept { settings: Some(settings), said: Vec::new() }, Some(took_over))
    });
    rig.settle();
    rig.supervisor.features.lasting.ride = None; // nobody answers a preflight here
    rig.tell(Event::Identified(Finding { homed: true, at_park: false, before: LedBefore::OnCue }));
    rig.supervisor.features.readiness.preflighted = Some(Preflighted::passing(2));
    rig.supervisor.procedures.add(Vec::new());
    rig.settle();
    rig
}

/// Loads a cue that is another one by its name alone.
fn load_another(rig: &mut Rig) {
    let cue = |name| rig.folder.path().join("cues").join(name);
    std::fs::copy(cue("two.csv"), cue("one.csv")).unwrap();
    rig.ask(Command::Load { cue: "one".to_owned() }).unwrap();
}

#[test]
fn a_show_that_was_taken_over_goes_on_by_resume_where_its_film_is_by_then_and_not_past_its_end() {
    let start = |rig: &Rig| rig.supervisor.hall.cued.as_ref().unwrap().start;
    let mut paused = taken_over(None);
    assert_eq!(paused.supervisor.status().next, "resume, or park");
    paused.ask(Command::Resume).unwrap();
    assert_eq!(
        (paused.state(), start(&paused)),
        (State::Playing(PlayMode::Joining), ShowTime::from_millis(1_500))
    );

    let since = ago(1);
    let mut runs = taken_over(Some(since));
    runs.ask(Command::Resume).unwrap();
    let most = ShowTime::from_millis(1_500) + Monotonic.now().since(since);
    assert!(start(&runs) >= ShowTime::from_millis(2_500) && start(&runs) <= most, "{:?}", start(&runs));

    let mut over = taken_over(Some(ago(120)));
    assert_eq!(over.supervisor.status().show.unwrap().resume_s, None);
    let refused = over.ask(Command::Resume).unwrap_err();
    assert!(refused.detail.contains("its film is over"), "{refused}");
    assert_eq!(over.state(), State::Recovering);

    // Another cue is none that was under way.
    let mut other = taken_over(None);
    load_another(&mut other);
    assert_eq!(other.ask(Command::Resume).unwrap_err().code, Code::State);
    assert_eq!(other.state(), State::Recovering);
}

/// So many seconds ago.
fn ago(seconds: u64) -> MonoTime {
    MonoTime::from_nanos(Monotonic.now().as_nanos().saturating_sub(seconds * 1_000_000_000))
}

#[test]
fn a_place_that_runs_on_with_its_film_is_no_new_setting_at_each_moment() {
    let since = ago(10);
    let mut rig = taken_over(Some(since));
    let first = rig.supervisor.settings();
    let kept = first.show.as_ref().unwrap().film_ms.unwrap();
    for ms in [100, 700, 1_200] {
        rig.supervisor.hall.now = since + Duration::from_millis(u64::try_from(kept - 1_500).unwrap() + ms);
        assert_eq!(
            rig.supervisor.settings(),
            first,
            "it is written down, and told the other machine, each time"
        );
    }
    let waits = taken_over(None);
    assert_eq!(waits.supervisor.settings().show.unwrap().film_ms, Some(1_500));
}

#[test]
fn resume_is_named_as_the_next_action_only_where_it_is_taken() {
    let next = |rig: &Rig| rig.supervisor.status().next;
    let runs = taken_over(Some(ago(1)));
    assert_eq!(next(&runs), "resume, or park");
    let over = taken_over(Some(ago(120)));
    assert_eq!(next(&over), "park, or home");
    assert_ne!(over.supervisor.status().next_coded.code, "resume");
    let mut other = taken_over(None);
    load_another(&mut other);
    assert_eq!(next(&other), "park, or home");
}

#[test]
fn nor_is_a_cue_that_another_playlist_here_has_begin_elsewhere_in_the_film_or_be_shown_with_another_one() {
    type Leads = fn(&mut LoadedShow);
    let leads: [Leads; 2] =
        [|show| show.begins_ms = Some(600_000), |show| show.movie = Some("two.mkv".to_owned())];
    for led in leads {
        let mut rig = taken_over_as(None, led);
        assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().id, "two");
        assert_eq!(rig.supervisor.status().next, "park, or home");
        assert_eq!(rig.ask(Command::Resume).unwrap_err().code, Code::State);
        assert_eq!(rig.state(), State::Recovering);
    }
}

#[test]
fn another_cue_is_not_gone_on_with_be_it_that_a_film_that_others_show_leads_it() {
    let led = |rig: &mut Rig| {
        let cued = rig.supervisor.hall.cued.as_mut().unwrap();
        let rules = ChaseRules::until(cued.timeline.duration());
        cued.film = Some(FilmStart { begin: ShowTime::ZERO, rules });
    };
    // Where its film is by then that says itself, be it past what was reckoned here.
    let mut same = taken_over(Some(ago(120)));
    led(&mut same);
    assert_eq!(same.supervisor.status().next, "resume, or park");
    same.ask(Command::Resume).unwrap();
    assert_eq!(same.state(), State::Playing(PlayMode::Joining));
    let mut other = taken_over(None);
    load_another(&mut other);
    led(&mut other);
    assert_eq!(other.ask(Command::Resume).unwrap_err().code, Code::State);
    assert_eq!(other.state(), State::Recovering);
}

#[test]
fn a_show_that_was_taken_over_is_gone_on_with_once_and_by_people_alone() {
    let mut rig = taken_over(None);
    for surface in [Surface::Osc, Surface::Text, Surface::Fleet] {
        assert_eq!(rig.ask_as(surface, Command::Resume).unwrap_err().code, Code::Role, "{surface}");
    }
    assert_eq!(rig.state(), State::Recovering);
    rig.supervisor.hall.job = Some("preflight");
    assert_eq!(rig.ask(Command::Resume).unwrap_err().code, Code::Busy);
    rig.supervisor.hall.job = None;
    for _ in 0..2 {
        rig.ask(Command::Resume).unwrap();
        assert_eq!(rig.state(), State::Playing(PlayMode::Joining));
    }
    assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().start, ShowTime::from_millis(1_500));
    assert!(rig.supervisor.features.records.is_under_way());
    assert!(!rig.supervisor.notes.iter().any(|note| note.contains("took over")));
    rig.ask(Command::Stop).unwrap();
    rig.tell(Event::AtRest);
    rig.ask(Command::Clear).unwrap();
    rig.tell(Event::PositionsRead);
    assert_eq!(rig.ask(Command::Resume).unwrap_err().code, Code::State);
    // Nor where the configuration was read anew in between.
    let mut rig = taken_over(None);
    let mut next = Rig::starting(rig.supervisor.remember());
    next.settle();
    next.tell(Event::Identified(Finding { homed: true, at_park: false, before: LedBefore::Ended }));
    assert_eq!(next.ask(Command::Resume).unwrap_err().code, Code::State);
}

#[test]
fn how_long_a_show_that_was_taken_over_can_be_gone_on_with_is_told() {
    let rig = taken_over(None);
    let lapses = rig.supervisor.status().lapses_s.unwrap();
    assert!((290.0..=300.0).contains(&lapses), "{lapses}");
}

#[test]
fn a_seat_that_fails_preflight_is_named_and_without_it_the_show_goes_on() {
    let mut rig = taken_over(None);
    rig.supervisor.features.readiness.preflighted = Some(Preflighted::failing_at(1, 2));
    rig.does(Vec::new());
    let refused = rig.ask(Command::Resume).unwrap_err();
    assert!(refused.detail.contains("preflight"), "{refused}");
    assert_eq!(rig.state(), State::Recovering);
    assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().start, ShowTime::ZERO);
    rig.ask(out("B1")).unwrap();
    assert_eq!(rig.supervisor.status().next, "resume, or park");
    rig.ask(Command::Resume).unwrap();
    assert_eq!(rig.state(), State::Playing(PlayMode::Joining));
}

#[test]
fn a_show_that_was_taken_over_waits_for_its_belts_as_go_does() {
    let mut rig = taken_over(None);
    let mut config = (*rig.supervisor.hall.config).clone();
    config.show.belts = Belts::All;
    config.controllers.iter_mut().for_each(|one| one.belt_inputs = 1);
    rig.supervisor.hall.config = Arc::new(config);
    let refused = rig.ask(Command::Resume).unwrap_err();
    assert!(refused.detail.contains("not buckled"), "{refused}");
    assert_eq!(rig.state(), State::Recovering);
}

#[test]
fn what_another_machine_played_is_taken_over_by_its_content_and_another_file_of_that_name_is_not_loaded() {
    let led = Monotonic.now();
    for is_same in [true, false] {
        let mut before = Rig::parked();
        before.ask(Command::Load { cue: "two".to_owned() }).unwrap();
        let folder = before.folder.path().to_owned();
        let mut rig = Rig::starting_in(|folder_of_next| {
            std::fs::create_dir(folder_of_next.join("cues")).unwrap();
            let cue = std::fs::read_to_string(folder.join("cues/two.csv")).unwrap();
            let cue = if is_same { cue } else { cue.replace("0.6", "0.55") };
            std::fs::write(folder_of_next.join("cues/two.csv"), cue).unwrap();
            before.supervisor.keep_settings();
            let mut settings = before.supervisor.settings();
            settings.show.as_mut().unwrap().film_ms = Some(2_345);
            let ride = Some(Ride { runs_since: Some(led) });
            let took_over = TookOver { words: "took over".to_owned(), ride };
            Carryover::of(Kept { settings: Some(settings), said: Vec::new() }, Some(took_over))
        });
        rig.settle();
        let loaded = rig.supervisor.hall.cued.as_ref();
        assert_eq!(loaded.is_some(), is_same);
        assert_eq!(
            loaded.and_then(|cued| cued.left_at),
            is_same.then_some(LeftAt { film: ShowTime::from_millis(2_345), runs_since: Some(led) })
        );
        let notes: Vec<_> = rig.supervisor.notes.iter().map(String::as_str).collect();
        assert_eq!(notes[0], "took over");
        let says =
            notes.get(1).is_some_and(|note| note.starts_with("two is not loaded: the file here (SHA-256 "));
        assert!(
            says != is_same && (is_same || notes[1].contains("played before, at 00:02.345")),
            "{notes:?}"
        );
        rig.does(vec![Act::Begin(Box::new(act::ShowBegun {
            who: "anna".to_owned(),
            surface: Surface::Socket,
            counted: rig.supervisor.hall.count(),
            place: None,
        }))]);
        let is_told = |rig: &Rig| rig.supervisor.notes.iter().any(|note| note == "took over");
        assert!(!is_told(&rig), "a show has begun since");
    }
}

#[test]
fn what_was_loaded_before_is_taken_up_once_the_seats_rest() {
    let mut rig = Rig::playing();
    let cued = rig.supervisor.hall.cued.take().unwrap();
    rig.does(vec![Act::Take(JobResult::Again((None, Ok(Box::new(cued)))))]);
    assert!(rig.supervisor.hall.cued.is_none(), "the seats move");
    rig.tell(Event::CueEnded);
    rig.tell(Event::Parked);
    assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().id, "one");
    let mut other = rig.supervisor.hall.cued.take().unwrap();
    rig.ask(Command::Load { cue: "two".to_owned() }).unwrap();
    other.id = "three".to_owned();
    rig.does(vec![Act::Take(JobResult::Again((None, Ok(Box::new(other)))))]);
    assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().id, "two", "a person has loaded that since");
}

#[test]
fn a_cue_that_is_gone_after_a_restart_is_named_and_the_hall_goes_on_without() {
    let carryover = after_a_restart(Rig::parked());
    let mut rig = Rig::starting(carryover);
    rig.settle();
    assert!(rig.supervisor.hall.cued.is_none() && rig.supervisor.settings().show.is_none());
    assert!(rig.supervisor.notes.iter().any(|note| note.contains("one")), "{:?}", rig.supervisor.notes);
}

/// A show that was stopped where the film was at 2.5 s, with the seats parked since.
fn stopped_in_its_midst() -> Rig {
    let mut rig = Rig::playing();
    let show = ShowTime::from_millis(2_500);
    rig.supervisor.hall.live.on_show(show);
    let place = |rig: &Rig| rig.supervisor.status().show.unwrap().position_s;
    rig.ask(Command::Stop).unwrap();
    rig.tell(Event::AtRest);
    assert_eq!((rig.state(), place(&rig)), (State::Stopped, 2.5), "where the film stopped");
    rig.ask(Command::Clear).unwrap();
    rig.tell(Event::PositionsRead);
    assert_eq!((rig.state(), place(&rig)), (State::Recovering, 2.5));
    rig.ask(Command::Park).unwrap();
    rig.tell(Event::Parked);
    assert_eq!((rig.state(), place(&rig)), (State::Parked, 0.0));
    rig
}

#[test]
fn a_show_that_was_stopped_goes_on_from_there_once_a_person_asks_and_not_before() {
    let mut rig = stopped_in_its_midst();
    let status = rig.supervisor.status();
    assert_eq!(status.show.as_ref().unwrap().resume_s, Some(2.5));
    assert!(status.next.contains("it can go from 00:02.500"), "{}", status.next);
    let place = Command::GoFrom(ShowTime::from_millis(2_500));
    assert_eq!(rig.ask(place.clone()).unwrap_err().code, Code::State, "nobody has armed it");
    rig.ask(ARM).unwrap();
    assert!(rig.supervisor.status().next.contains("or go from 00:02.500"));
    assert_eq!(rig.ask(Command::GoFrom(ShowTime::from_millis(4_000))).unwrap_err().code, Code::Value);
    rig.ask(place).unwrap();
    assert_eq!(rig.state(), State::Playing(PlayMode::Joining));
    let cued = rig.supervisor.hall.cued.as_ref().unwrap();
    assert_eq!((cued.start, cued.left_at), (ShowTime::from_millis(2_500), None));
    rig.tell(Event::Joined);
    rig.tell(Event::CueEnded);
    rig.tell(Event::Parked);
    let cued = rig.supervisor.hall.cued.as_ref().unwrap();
    assert_eq!((cued.start, cued.left_at), (ShowTime::ZERO, None), "the next one is whole");
}

#[test]
fn a_show_that_is_stopped_on_its_way_to_park_after_its_end_is_over() {
    let mut rig = Rig::playing();
    let show = ShowTime::from_millis(3_900);
    rig.supervisor.hall.live.on_show(show);
    rig.tell(Event::CueEnded);
    rig.ask(Command::Stop).unwrap();
    rig.tell(Event::AtRest);
    rig.wait_until(|supervisor| supervisor.hall.mirror.state == State::Stopped);
    assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().left_at, None);
}

#[test]
fn a_plain_go_after_a_stop_begins_at_the_beginning() {
    let mut rig = stopped_in_its_midst();
    rig.ask(ARM).unwrap();
    rig.ask(Command::Go).unwrap();
    assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().start, ShowTime::ZERO);
    assert_eq!(rig.supervisor.status().show.unwrap().resume_s, None);
}

#[test]
fn where_a_show_was_left_lasts_over_a_restart_unless_the_cue_is_another_by_then() {
    for (change, left_at) in [("", Some(LeftAt::waits(ShowTime::from_millis(2_500)))), ("5000,0.6\n", None)] {
        let before = stopped_in_its_midst();
        let ride = std::fs::read_to_string(before.folder.path().join("cues/one.csv")).unwrap();
        let mut rig = Rig::starting_in(|folder| {
            std::fs::create_dir(folder.join("cues")).unwrap();
            std::fs::write(folder.join("cues/one.csv"), ride + change).unwrap();
            after_a_restart(before)
        });
        rig.settle();
        assert_eq!(rig.supervisor.hall.cued.as_ref().unwrap().left_at, left_at, "{change}");
    }
}

#[test]
fn where_a_crash_has_cut_a_show_is_known_to_five_seconds() {
    let rig = Rig::playing();
    for (film_ms, kept) in [(4_900, None), (12_340, Some(10_000))] {
        let show = ShowTime::from_millis(film_ms);
        rig.supervisor.hall.live.on_show(show);
        assert_eq!(rig.supervisor.settings().show.unwrap().film_ms, kept);
    }
}

#[test]
fn a_configuration_is_read_anew_once_nobody_speaks_with_the_controllers_any_more() {
    let mut rig = Rig::parked();
    let (go_on, held) = channel::<()>();
    rig.does(vec![Act::Start(Job::Held(held))]);
    assert_eq!(rig.ask(Command::Reload).unwrap_err().code, Code::Busy);
    rig.supervisor.ports.signals.reload.store(true, Ordering::Release);
    rig.supervisor.turn();
    assert!(!rig.supervisor.hall.leave.load(Ordering::Acquire), "the port is in use");
    drop(go_on);
    rig.wait_until(|supervisor| supervisor.hall.leave.load(Ordering::Acquire));
    assert!(rig.supervisor.reload.is_some());
}

#[test]
fn nothing_long_begins_in_a_hall_that_closes() {
    let mut rig = Rig::parked();
    rig.supervisor.hall.leave.store(true, Ordering::Release);
    for ask in [Command::Preflight, Command::Home, Command::Load { cue: "two".to_owned() }] {
        assert_eq!(rig.ask(ask).unwrap_err().code, Code::Busy);
    }
}

#[test]
fn a_clear_that_was_asked_before_a_stop_clears_it_not() {
    let mut rig = Rig::parked();
    rig.tell(Event::Trouble(Trouble::Limiter));
    let clear = rig.post(Command::Clear);
    rig.supervisor.hall.desk.stop();
    rig.hear_of(State::Stopped);
    rig.hear();
    assert_eq!(clear.join().unwrap().unwrap_err().code, Code::Late);
    assert_eq!(rig.state(), State::Stopped);
    rig.ask(Command::Clear).unwrap();
}

#[test]
fn arming_homes_no_seat_unless_somebody_says_that_they_are_empty() {
    let mut rig = Rig::parked();
    rig.tell(Event::Rebooted(1));
    assert!(rig.supervisor.status().arm_homes);
    assert!(rig.ask(ARM).unwrap_err().detail.contains("home first"));
    assert_eq!(rig.state(), State::Parked);
    rig.ask(Command::Arm { seats_empty: true }).unwrap();
    assert_eq!(rig.state(), State::Homing);
}

#[test]
fn what_cannot_be_set_is_not_set_on_the_desk_either() {
    let mut rig = Rig::playing();
    // As where the supervisor has not heard yet that the seats move.
    rig.supervisor.hall.mirror.state = State::Parked;
    assert_eq!(rig.ask(out("B1")).unwrap_err().code, Code::State);
    assert!(rig.supervisor.hall.settings.is_on(1) && rig.supervisor.hall.desk.mix(1).on);
}

#[test]
fn a_seat_whose_preflight_has_not_passed_does_not_join_a_show() {
    let mut rig = Rig::parked();
    rig.ask(out("B1")).unwrap();
    rig.supervisor.features.readiness.preflighted = Some(preflighted::Preflighted::failing_at(1, 2));
    rig.ask(ARM).unwrap();
    rig.ask(Command::Go).unwrap();
    assert_eq!(rig.ask(Command::Enable("B1".to_owned())).unwrap_err().code, Code::State);
    assert!(!rig.supervisor.hall.desk.mix(1).on);
    rig.ask(out("A1")).unwrap();
    rig.ask(Command::Enable("A1".to_owned())).unwrap();
    assert!(rig.supervisor.hall.desk.mix(0).on);
}

#[test]
fn an_armed_hall_is_not_asked_for_registers() {
    let mut rig = Rig::armed();
    assert_eq!(rig.ask(Command::Preflight).unwrap_err().code, Code::State);
    assert_eq!((rig.state(), rig.supervisor.hall.mirror.next), (State::Armed, Next::Go));
}

#[test]
fn a_park_between_shows_leaves_the_next_show_where_it_is_to_begin() {
    let mut rig = Rig::armed();
    let start = ShowTime::from_millis(2_000);
    rig.ask(Command::Seek(start)).unwrap();
    rig.ask(Command::Disarm).unwrap();
    let refused = rig.ask(Command::Seek(ShowTime::ZERO)).unwrap_err();
    assert_eq!(refused.to_string(), "cannot seek while parked: the hall is not armed; arm first");
    rig.tell(Event::Astray(true));
    rig.ask(Command::Park).unwrap();
    assert_eq!(rig.state(), State::Parking);
    rig.tell(Event::Parked);
    assert_eq!(
        (rig.state(), rig.supervisor.hall.cued.as_ref().map(|cued| cued.start)),
        (State::Parked, Some(start))
    );
}

#[test]
fn a_move_that_was_not_found_is_a_warning_with_the_name_of_the_seat_and_what_to_do() {
    let mut rig = Rig::playing();
    rig.supervisor.hear(News::Unplanned(Unplanned::Lane(1)));
    let warnings = rig.supervisor.status().warnings;
    let told =
        warnings.iter().find(|one| one.text.starts_with("B1: it stays where it is")).expect("it is told");
    assert!(told.text.ends_with("seek elsewhere in the cue, or park"), "{}", told.text);
}

#[test]
fn a_test_that_is_made_while_the_hall_is_disarmed_is_forgotten() {
    for held_by in [Command::Disarm, Command::Stop, Command::Go] {
        let mut rig = Rig::armed();
        let test = rig.post(Command::Test { rows: vec!["A".to_owned()] });
        rig.hear();
        let other = rig.post(held_by.clone());
        rig.hear();
        rig.settle();
        rig.wait_until(|_| test.is_finished() && other.is_finished());
        let problem = test.join().unwrap().unwrap_err();
        assert_eq!(problem.code, Code::State, "{problem:?}");
        let cued = rig.supervisor.hall.cued.as_ref().map(|cued| cued.id.clone());
        assert_eq!(
            (cued.as_deref(), rig.supervisor.features.seats.test.is_none()),
            (Some("one"), true),
            "{held_by:?}"
        );
        assert!(rig.supervisor.hall.desk.mix(1).on, "the other row is as it was");
    }
}

#[test]
fn a_homing_that_is_stopped_tells_no_further_seat_to_home() {
    let mut rig = Rig::parked();
    rig.post(Command::Home);
    rig.hear();
    rig.hear_of(State::Homing);
    let Homing::UnderWay(_, called_off) = &rig.supervisor.features.homing else { panic!("it homes") };
    let called_off = Arc::clone(called_off);
    assert!(!called_off.load(Ordering::Acquire));
    rig.ask(Command::Stop).unwrap();
    assert!(called_off.load(Ordering::Acquire));
    assert_eq!(rig.state(), State::Stopped);
    assert!(matches!(rig.supervisor.features.homing, Homing::Idle));
}

#[test]
fn who_waits_for_an_answer_while_the_hall_closes_is_told_why_none_comes() {
    let mut rig = Rig::parked();
    let waits = rig.while_it_waits(|rig| {
        let waits = rig.post(Command::Disarm);
        rig.hear();
        rig.supervisor.refuse_asked();
        waits
    });
    let detail = waits.join().unwrap().unwrap_err().detail;
    assert_eq!(detail, "the service ended before the tick thread had answered");
}

#[test]
fn what_is_asked_waits_for_what_was_asked_before_it_and_neither_holds_up_the_status() {
    let mut rig = Rig::parked();
    let half = LevelsChange { motion: Some(0.5), ..LevelsChange::default() };
    let asked = [Command::Trim(40), Command::Levels(half)].map(|ask| rig.post(ask));
    rig.while_it_waits(|rig| {
        let given = rig.supervisor.given;
        rig.supervisor.told = MonoTime::default();
        for _ in 0..3 {
            rig.supervisor.turn();
        }
        assert_eq!(rig.supervisor.given, given + 1, "the second was given before the first was answered");
        assert_ne!(rig.supervisor.told, MonoTime::default(), "no status while something is waited for");
        assert!(!asked[0].is_finished());
    });
    rig.wait_until(|_| asked.iter().all(JoinHandle::is_finished));
    for answer in asked {
        answer.join().unwrap().unwrap();
    }
    let settings = &rig.supervisor.hall.settings;
    assert_eq!((settings.trim_ms, settings.levels.motion), (40, 0.5), "the second has undone the first");
}

#[test]
fn an_entry_that_is_about_to_start_by_itself_does_not_in_a_hall_that_begins_to_close() {
    let mut rig = Rig::armed();
    let go =
        || vec![Act::Go { by: Transition::Go, who: "the playlist".to_owned(), surface: Surface::Schedule }];
    rig.supervisor.hall.close();
    rig.does(go());
    assert_eq!(rig.state(), State::Armed);
    rig.supervisor.hall.leave.store(false, Ordering::Release);
    rig.does(go());
    assert_eq!(rig.state(), State::Playing(PlayMode::Joining));
}

#[test]
fn a_hall_is_not_said_to_be_parked_without_a_word_where_a_seat_was_read_elsewhere() {
    let rig = Rig::parked();
    let at = rig.supervisor.hall.now;
    let cause = rig.supervisor.status().cause;
    let stroke = rig.supervisor.hall.config.controllers[1].seat.own()[0].stroke_pulses();
    let stands = |part: f64, homed: Option<bool>| {
        let mut moved = row(at);
        #[expect(clippy::cast_possible_truncation, reason = "a part of a stroke")]
        let value = PerAxis::new(&[Pulses((part * stroke) as i32)]);
        (moved.state.measured, moved.homed) = (Some(Heard { value, at }), homed);
        rig.supervisor.hall.live.on_table(|table| *table = vec![row(at), moved]);
        rig.supervisor.status().cause
    };
    let told = stands(0.25, Some(true));
    assert!(told.starts_with(&cause) && told.ends_with("; not at park: B1 (axis 1 at 37.5 mm)"), "{told}");
    assert_eq!(stands(0.001, Some(true)), cause, "what a loaded motor is beside its place");
    assert_eq!(stands(0.25, Some(false)), cause, "what one tells that is not home is no place");
}

#[test]
fn whoever_arms_is_told_which_seats_will_not_move() {
    let mut rig = Rig::parked();
    let at = rig.supervisor.hall.now;
    let rows = |standing| vec![row(at), Row { standing, ..row(at) }];
    rig.supervisor.hall.live.on_table(|table| *table = rows(HealthState::Lost));
    let status = rig.ask(Command::Arm { seats_empty: false }).unwrap();
    assert_eq!(status.cause, "armed by the operator, with 1 of 2 seats: B1 lost");
    rig.supervisor.hall.live.on_table(|table| *table = rows(HealthState::Rejoining));
    assert_eq!(rig.supervisor.status().cause, "armed by the operator");
}

#[test]
fn after_a_preflight_that_failed_the_next_is_to_correct_what_it_found_and_not_to_run_it_again() {
    let mut rig = Rig::parked();
    rig.supervisor.features.readiness.preflighted = Some(Preflighted::failing_at(1, 2));
    rig.supervisor.procedures.add(Vec::new());
    rig.settle();
    let status = rig.supervisor.status();
    assert!(status.next.starts_with("correct each error that preflight found"), "{}", status.next);
    rig.supervisor.features.readiness.preflighted = None;
    assert_eq!(rig.supervisor.status().next, "run preflight, then arm");
}

#[test]
fn a_cue_that_follows_no_film_in_a_hall_that_has_one_is_worth_a_warning() {
    let mut rig = Rig::parked();
    let warned = |rig: &Rig| rig.supervisor.status().warnings.iter().any(|one| one.id == "no-film");
    assert!(!warned(&rig), "there is no [sync]");
    rig.supervisor.hall.film = Some(SharedTable::of(FilmTable::default()));
    assert!(warned(&rig));
    rig.supervisor.hall.cued = None;
    assert!(!warned(&rig));
}
