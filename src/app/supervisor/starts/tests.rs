use std::sync::Arc;

use nkeys::KeyPair;
use serde_json::json;

use super::*;
use crate::api::Letterbox;
use crate::app::supervisor::testing::{Rig, desired, hall, told};
use crate::config::{Fleet, FleetKey, FleetWord};
use crate::control::{ClockReading, LevelsChange, Role, Surface};
use crate::fleet::{Letter, Order, new_letter_key};
use crate::harness::asked::Chance;
use crate::time::{MonoTime, WallAt};

const T0_MS: i64 = 1_795_306_800_000;
const DIGEST: &str = "0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f0f";

/// The wall clock and the machine's so many ms after the beginning of a test.
fn at(ms: i64) -> WallAt {
    let since = Duration::from_millis(u64::try_from(ms).unwrap());
    let wall_ns = u64::try_from((T0_MS + ms) * 1_000_000).unwrap();
    WallAt { at: MonoTime::from_nanos(1_000_000_000_000) + since, wall_ns }
}

fn fleet(keys: Vec<FleetKey>) -> Fleet {
    let (name, start_bound) = ("berlin.h3".to_owned(), Duration::from_millis(2));
    Fleet { name, allow: Vec::new(), start: true, start_bound, keys }
}

/// A hall in that state, of a fleet that may start it, whose clock was just measured.
fn member(state: State) -> HallContext {
    let mut hall = hall(state, "storm");
    hall.cued.as_mut().unwrap().sha256 = DIGEST.to_owned();
    Arc::make_mut(&mut hall.config).fleet = Some(fleet(Vec::new()));
    is_at(&mut hall, 0);
    measured(&hall, 100_000);
    hall
}

fn is_at(hall: &mut HallContext, ms: i64) {
    (hall.wall, hall.now) = (at(ms), at(ms).at);
}

fn measured(hall: &HallContext, offset_ns: i64) {
    let reading = ClockReading::of("ntp".to_owned(), offset_ns, 80_000, Duration::ZERO, &hall.wall).unwrap();
    hall.clock.set(reading);
}

fn armed() -> (FleetStarts, HallContext) {
    let (mut starts, hall) = (FleetStarts::default(), member(State::Armed));
    starts.armed("trio".to_owned(), &hall);
    (starts, hall)
}

fn office() -> Who {
    Who { role: Role::Operate, surface: Surface::Fleet, name: "office".to_owned() }
}

/// A start that is so many ms after the beginning of the test.
fn order(ticket: &str, at_ms: i64) -> StartOrder {
    let (ticket, group, sha256) = (ticket.to_owned(), "trio".to_owned(), DIGEST.to_owned());
    StartOrder { ticket, group, sha256, at_ms: T0_MS + at_ms }
}

fn ask(starts: &mut FleetStarts, order: &StartOrder, hall: &HallContext) -> Result<(), Problem> {
    starts.ask(order, &office(), hall).map(|acts| assert!(acts.is_empty(), "nothing is done at once"))
}

fn commit(starts: &mut FleetStarts, ticket: &str, hall: &HallContext) -> Result<(), Problem> {
    starts.commit(ticket, &office(), hall).map(|acts| assert!(acts.is_empty()))
}

/// The instant that the tick thread is given, if it is.
fn given_in(acts: &[Act]) -> Option<MonoTime> {
    acts.iter().find_map(|act| if let Act::Tick(TickCommand::StartAt(at)) = act { Some(*at) } else { None })
}

fn notes(acts: &[Act]) -> Vec<&str> {
    acts.iter().filter_map(|act| if let Act::Passing(note) = act { Some(&**note) } else { None }).collect()
}

fn called_off(starts: &FleetStarts, hall: &HallContext) -> String {
    let start = starts.status(hall).unwrap().start.unwrap();
    assert_eq!(start.phase, StartPhase::CalledOff);
    start.why
}

#[test]
fn a_start_is_given_to_the_tick_thread_a_second_before_it_once_it_is_committed() {
    let (mut starts, mut hall) = armed();
    ask(&mut starts, &order("t1", 10_003), &hall).unwrap();
    commit(&mut starts, "t1", &hall).unwrap();
    commit(&mut starts, "t1", &hall).unwrap();
    is_at(&mut hall, 9_002);
    assert!(starts.due(&hall).is_empty());
    is_at(&mut hall, 9_003);
    let acts = starts.due(&hall);
    assert_eq!(given_in(&acts), Some(at(10_003).at));
    // At 100 Hz from the zero of the clock on: the first tick is 7 ms after the instant, and the film is there by then.
    let start = acts.iter().find_map(|act| match act {
        Act::Stage(ShowChange::Start(film)) => Some(*film),
        _ => None,
    });
    assert_eq!(start, Some(ShowTime::from_millis(7)));
    assert!(starts.due(&hall).is_empty(), "once");
    let start = starts.status(&hall).unwrap().start.unwrap();
    assert_eq!((start.phase, start.at.as_str()), (StartPhase::Committed, "2026-11-22T00:20:10.003Z"));
    let bound_us = start.bound_us.unwrap();
    assert!((bound_us - (100.0 + 40.0 + 9.003 * 50.0)).abs() < 1e-6, "{bound_us}");
    let (who, _) = starts.begun(&hall);
    assert_eq!(who, "office (fleet, operate)");
    assert_eq!(starts.status(&hall).unwrap().start.unwrap().phase, StartPhase::Started);
}

#[test]
fn a_seat_that_is_led_ahead_begins_sooner_and_all_that_has_to_be_there_before_is() {
    let (mut starts, mut hall) = armed();
    hall.cued.as_mut().unwrap().lead = Duration::from_millis(400);
    assert_eq!(ask(&mut starts, &order("t0", 2_399), &hall).unwrap_err().code, Code::Late);
    ask(&mut starts, &order("t1", 10_003), &hall).unwrap();
    is_at(&mut hall, 9_303);
    commit(&mut starts, "t1", &hall).unwrap();
    let acts = starts.due(&hall);
    assert_eq!(given_in(&acts), Some(at(10_003).at), "the film's instant is what it was");
    let (mut starts, mut hall) = armed();
    hall.cued.as_mut().unwrap().lead = Duration::from_millis(400);
    ask(&mut starts, &order("t1", 10_003), &hall).unwrap();
    is_at(&mut hall, 9_304);
    assert_eq!(commit(&mut starts, "t1", &hall).unwrap_err().code, Code::Late);
}

#[test]
fn a_start_that_is_not_committed_300_ms_before_it_is_called_off_and_leaves_the_hall_armed() {
    let (mut starts, mut hall) = armed();
    ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
    is_at(&mut hall, 9_700);
    assert!(starts.due(&hall).is_empty());
    is_at(&mut hall, 9_701);
    assert_eq!(
        commit(&mut starts, "t1", &hall).unwrap_err().detail,
        "299 ms are left, and at least 300 are needed"
    );
    let acts = starts.due(&hall);
    assert_eq!(
        notes(&acts),
        ["the start of trio at 2026-11-22T00:20:10.000Z was called off: desk not heard"]
    );
    assert!(given_in(&acts).is_none() && acts.len() == 1, "nothing else is done: {acts:?}");
    assert_eq!(called_off(&starts, &hall), "desk not heard");
    assert_eq!(starts.status(&hall).unwrap().armed_for.unwrap().group, "trio");
    let problem = commit(&mut starts, "t1", &hall).unwrap_err();
    assert_eq!(problem.detail, "the start t1 does not wait here: called-off desk not heard");
    // The desk may ask anew, with another ticket.
    assert_eq!(ask(&mut starts, &order("t1", 20_000), &hall).unwrap_err().code, Code::Late);
    ask(&mut starts, &order("t2", 20_000), &hall).unwrap();
}

#[test]
fn a_supervisor_that_was_held_up_gives_no_start_that_is_nearly_over() {
    for (ms, given) in [(9_850, true), (9_851, false), (10_000, false), (3_600_000, false)] {
        let (mut starts, mut hall) = armed();
        ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
        commit(&mut starts, "t1", &hall).unwrap();
        is_at(&mut hall, ms);
        measured(&hall, 0);
        assert_eq!(given_in(&starts.due(&hall)).is_some(), given, "{ms}");
        assert!(given || called_off(&starts, &hall).contains("held up"));
    }
}

#[test]
fn in_no_state_but_armed_is_a_start_taken_and_what_was_taken_ends_with_that_state() {
    for state in State::ALL.into_iter().filter(|state| *state != State::Armed) {
        let (mut starts, hall) = (FleetStarts::default(), member(state));
        starts.armed("trio".to_owned(), &hall);
        assert!(starts.status(&hall).unwrap().armed_for.is_none(), "{state}");
        assert_eq!(ask(&mut starts, &order("t1", 10_000), &hall).unwrap_err().code, Code::State, "{state}");
        let (mut starts, mut hall) = armed();
        ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
        commit(&mut starts, "t1", &hall).unwrap();
        hall.mirror.state = state;
        let acts = told(&mut starts, &SupervisorEvent::Entered(state), &hall);
        assert!(notes(&acts)[0].contains("was called off: "), "{state}");
        assert!(starts.status(&hall).unwrap().armed_for.is_none(), "{state}");
        is_at(&mut hall, 9_500);
        assert!(starts.due(&hall).is_empty(), "{state}");
    }
}

#[test]
fn what_is_armed_for_another_group_or_with_another_cue_is_not_started_and_neither_is_what_nobody_armed() {
    let why = |starts: &mut FleetStarts, order: &StartOrder, hall: &HallContext| {
        let problem = ask(starts, order, hall).unwrap_err();
        assert!(starts.held.is_none() && !problem.remedy.is_empty());
        problem.detail
    };
    let (_, hall) = armed();
    let nobody = why(&mut FleetStarts::default(), &order("t1", 10_000), &hall);
    assert_eq!(nobody, "nobody here has armed the hall for trio");
    let (mut starts, mut hall) = armed();
    let duo = StartOrder { group: "duo".to_owned(), ..order("t1", 10_000) };
    assert_eq!(why(&mut starts, &duo, &hall), "the hall is armed for trio, not for duo");
    let other = StartOrder { sha256: DIGEST.replace('0', "1"), ..order("t1", 10_000) };
    assert!(why(&mut starts, &other, &hall).starts_with("the hall is armed with storm, and that is not"));
    // The playlist has put another in its place.
    hall.cued.as_mut().unwrap().sha256 = other.sha256.clone();
    for order in [&order("t1", 10_000), &other] {
        assert!(why(&mut starts, order, &hall).contains("that is not the cue that is meant"));
    }
    // A plain arming, and a jump to elsewhere in the cue, are for no start of the fleet.
    for ask in [Command::Arm { seats_empty: false }, Command::Seek(ShowTime::ZERO)] {
        let (mut starts, hall) = armed();
        told(&mut starts, &SupervisorEvent::Asked(&desired(Surface::Socket, ask)), &hall);
        assert_eq!(why(&mut starts, &order("t1", 10_000), &hall), "nobody here has armed the hall for trio");
    }
}

#[test]
fn an_instant_that_is_too_near_or_too_far_is_refused_and_a_start_waits_alone() {
    for (at_ms, taken) in
        [(-60_000, false), (0, false), (1_999, false), (2_000, true), (60_000, true), (60_001, false)]
    {
        let (mut starts, hall) = armed();
        let asked = ask(&mut starts, &order("t1", at_ms), &hall);
        assert_eq!(asked.is_ok(), taken, "{at_ms}");
        assert!(taken || asked.unwrap_err().detail.ends_with("s from now, not 2 to 60 s"));
    }
    for at_ms in [i64::MIN, i64::MAX, i64::MIN + 1] {
        let (mut starts, hall) = armed();
        assert!(ask(&mut starts, &StartOrder { at_ms, ..order("t1", 0) }, &hall).is_err());
    }
    let (mut starts, hall) = armed();
    ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
    assert_eq!(ask(&mut starts, &order("t2", 10_000), &hall).unwrap_err().code, Code::Busy);
    let stranger = Who { name: "booth".to_owned(), ..office() };
    assert_eq!(starts.commit("t1", &stranger, &hall).unwrap_err().code, Code::State, "whoever asked commits");
    assert_eq!(commit(&mut starts, "t2", &hall).unwrap_err().code, Code::State);
    commit(&mut starts, "t1", &hall).unwrap();
}

#[test]
fn no_start_is_taken_or_kept_where_the_clock_is_off_by_too_much_or_nobody_knows() {
    let (mut starts, mut hall) = armed();
    measured(&hall, -1_961_000);
    let wide = ask(&mut starts, &order("t1", 10_000), &hall).unwrap_err();
    assert_eq!(wide.detail, "the clock may be 2.00 ms off ntp, more than the 2 ms of start_bound_ms");
    measured(&hall, -1_959_000);
    ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
    commit(&mut starts, "t1", &hall).unwrap();
    // By then it may have come to more.
    is_at(&mut hall, 1_500);
    assert!(given_in(&starts.due(&hall)).is_none());
    assert!(called_off(&starts, &hall).starts_with("the clock may be 2.07 ms off ntp"));
    is_at(&mut hall, 41_600);
    let old = ask(&mut starts, &order("t2", 50_000), &hall).unwrap_err();
    assert_eq!(old.detail, "nobody has measured lately how far this machine's clock is off");
}

#[test]
fn a_clock_that_is_set_before_the_instant_is_taken_over_calls_the_start_off_and_after_that_changes_nothing() {
    for step_ns in [-40_000_000_i64, -2_000_000, 2_000_000, 7_000_000_000] {
        let set = |hall: &mut HallContext| {
            hall.wall.wall_ns = hall.wall.wall_ns.saturating_add_signed(step_ns);
        };
        let (mut starts, mut hall) = armed();
        ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
        commit(&mut starts, "t1", &hall).unwrap();
        is_at(&mut hall, 5_000);
        set(&mut hall);
        assert!(given_in(&starts.due(&hall)).is_none());
        assert!(called_off(&starts, &hall).starts_with("the clock may be "), "{step_ns}");
        let (mut starts, mut hall) = armed();
        ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
        commit(&mut starts, "t1", &hall).unwrap();
        is_at(&mut hall, 9_000);
        assert_eq!(given_in(&starts.due(&hall)), Some(at(10_000).at));
        is_at(&mut hall, 9_500);
        if step_ns < 2_000_000_000 {
            set(&mut hall);
            assert!(starts.due(&hall).is_empty(), "{step_ns}");
        }
    }
}

/// What a person may ask of an armed hall that waits for a start, and whether it goes on with it.
fn asks() -> Vec<(Command, bool)> {
    let motion = LevelsChange { motion: Some(0.5), ..LevelsChange::default() };
    vec![
        (Command::Stop, false),
        (Command::Pause, false),
        (Command::Park, false),
        (Command::Disarm, false),
        (Command::Go, false),
        (Command::GoFrom(ShowTime::ZERO), false),
        (Command::Seek(ShowTime::ZERO), false),
        (Command::Arm { seats_empty: false }, false),
        (Command::ArmFor("trio".to_owned()), false),
        (Command::Load { cue: "calm".to_owned() }, false),
        (Command::Reload, false),
        (Command::Levels(motion), true),
        (Command::Trim(10), true),
        (Command::Mark { text: None }, true),
        (Command::Disable { name: "A1".to_owned(), why: None }, true),
    ]
}

#[test]
fn whoever_asks_something_else_of_the_armed_hall_calls_the_start_off_until_it_has_begun() {
    for (ask_of, goes_on) in asks() {
        let asked = desired(Surface::Socket, ask_of.clone());
        let (mut starts, mut hall) = armed();
        ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
        commit(&mut starts, "t1", &hall).unwrap();
        let acts = told(&mut starts, &SupervisorEvent::Asked(&asked), &hall);
        assert_eq!(starts.held.is_some(), goes_on, "{ask_of}");
        assert!(
            goes_on
                || notes(&acts)[0].ends_with(&format!("anna (socket, engineer) asked for {}", ask_of.word()))
        );
        // Once the tick thread has it, that is told, and says what came of it.
        let (mut starts, _) = armed();
        is_at(&mut hall, 0);
        ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
        commit(&mut starts, "t1", &hall).unwrap();
        is_at(&mut hall, 9_000);
        assert!(given_in(&starts.due(&hall)).is_some());
        let acts = told(&mut starts, &SupervisorEvent::Asked(&asked), &hall);
        let tells = acts.iter().any(|act| matches!(act, Act::Tick(TickCommand::CallOff)));
        assert_eq!(tells, !goes_on, "{ask_of}: {acts:?}");
        let acts = starts.called_off(StartOff::Asked, &hall);
        assert!(acts.iter().any(|act| matches!(act, Act::RewindStart)), "{ask_of}");
        assert_eq!(called_off(&starts, &hall).contains(ask_of.word()), !goes_on, "{ask_of}");
    }
}

#[test]
fn what_the_tick_thread_says_of_a_start_is_noted_and_where_it_says_nothing_that_is() {
    for (why, words) in [
        (StartOff::Late, "this machine was held up at that very instant"),
        (StartOff::NotArmed, "the program has started"),
    ] {
        let (mut starts, mut hall) = armed();
        ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
        commit(&mut starts, "t1", &hall).unwrap();
        is_at(&mut hall, 9_000);
        assert!(given_in(&starts.due(&hall)).is_some());
        assert_eq!(starts.called_off(why, &hall).len(), 2);
        assert_eq!(called_off(&starts, &hall), words);
        assert!(starts.called_off(why, &hall).is_empty(), "once");
    }
    let (mut starts, mut hall) = armed();
    ask(&mut starts, &order("t1", 10_000), &hall).unwrap();
    commit(&mut starts, "t1", &hall).unwrap();
    is_at(&mut hall, 9_000);
    assert!(given_in(&starts.due(&hall)).is_some());
    is_at(&mut hall, 12_001);
    assert!(!starts.due(&hall).is_empty());
    assert_eq!(called_off(&starts, &hall), "nobody said what came of it");
    // A show is never without its record: what begins all the same is known.
    assert_eq!(starts.begun(&hall).0, "the fleet");
}

#[test]
fn a_person_arms_for_the_fleet_only_where_it_may_start_what_is_loaded() {
    let mut rig = Rig::parked();
    let arm = || Command::ArmFor("trio".to_owned());
    assert_eq!(rig.ask(arm()).unwrap_err().code, Code::Off, "in no fleet");
    let set = |rig: &mut Rig, start| {
        let config = Arc::make_mut(&mut rig.supervisor.hall.config);
        config.fleet = Some(Fleet { start, ..fleet(Vec::new()) });
    };
    set(&mut rig, false);
    assert_eq!(rig.ask(arm()).unwrap_err().code, Code::Off);
    assert_eq!(rig.state(), State::Parked);
    set(&mut rig, true);
    let status = rig.ask(arm()).unwrap();
    let armed = status.fleet.as_ref().unwrap().armed_for.clone().unwrap();
    assert_eq!((armed.group.as_str(), armed.cue.as_str()), ("trio", "one"));
    assert!((590.0..=600.0).contains(&armed.lapses_s), "{armed:?}");
    assert_eq!(armed.sha256, status.show.as_ref().unwrap().sha256);
    let status = rig.ask(Command::Disarm).unwrap();
    assert_eq!(status.fleet.as_ref().unwrap().armed_for, None);
    rig.ask(arm()).unwrap();
    let status = rig.ask(Command::Arm { seats_empty: false }).unwrap();
    assert_eq!(status.fleet.as_ref().unwrap().armed_for, None, "plainly armed");
}

#[test]
fn a_start_that_comes_is_a_show_with_its_record_and_is_armed_for_once() {
    let mut rig = Rig::parked();
    Arc::make_mut(&mut rig.supervisor.hall.config).fleet = Some(fleet(Vec::new()));
    rig.ask(Command::ArmFor("trio".to_owned())).unwrap();
    let wall = rig.supervisor.hall.wall;
    let reading = ClockReading::of("ntp".to_owned(), 0, 0, Duration::ZERO, &wall).unwrap();
    rig.supervisor.hall.clock.set(reading);
    let sha256 = rig.supervisor.hall.cued.as_ref().unwrap().sha256.clone();
    let at_ms = i64::try_from(wall.wall_ns / 1_000_000).unwrap() + 9_000;
    let start = StartOrder { sha256, at_ms, ..order("t1", 0) };
    // For the fleet alone, whoever else has the words.
    let refused = rig.ask_as(Surface::Fleet, Command::Commit { ticket: "t1".to_owned() }).unwrap_err();
    assert_eq!(refused.code, Code::State);
    rig.ask_as(Surface::Fleet, Command::StartAt(start)).unwrap();
    let status = rig.ask_as(Surface::Fleet, Command::Commit { ticket: "t1".to_owned() }).unwrap();
    assert_eq!(status.fleet.as_ref().unwrap().start.as_ref().unwrap().phase, StartPhase::Committed);
    // The instant is near, as the clocks have it.
    rig.supervisor.hall.wall.wall_ns += 8_100_000_000;
    rig.supervisor
        .hall
        .clock
        .set(ClockReading::of("ntp".to_owned(), 0, 0, Duration::ZERO, &rig.supervisor.hall.wall).unwrap());
    let acts = rig.supervisor.features.starts.due(&rig.supervisor.hall);
    assert!(given_in(&acts).is_some());
    rig.does(acts);
    rig.wait_until(|supervisor| supervisor.features.records.is_under_way());
    let status = rig.supervisor.status();
    let of_fleet = status.fleet.as_ref().unwrap();
    assert_eq!(
        (of_fleet.armed_for.clone(), of_fleet.start.as_ref().unwrap().phase),
        (None, StartPhase::Started)
    );
    assert!(status.moving, "{}", status.state);
}

/// Letters by chance: signed by whom the hall knows, by others or by nobody, for this hall or another, once or again, sooner or later.
fn letter(chance: &mut Chance, keys: &[KeyPair; 2], now_ms: i64) -> Letter {
    fn pick(chance: &mut Chance, of: &[&str]) -> String {
        of[chance.below(of.len())].to_owned()
    }
    let spread = |chance: &mut Chance, from: i64, span: usize| {
        now_ms + from + i64::try_from(chance.below(span)).unwrap()
    };
    let words =
        ["start", "start", "commit", "ready", "go", "arm", "resume", "clear", "home", "pause", "disarm"];
    let (word, to) =
        (pick(chance, &words), pick(chance, &["berlin.h3", "berlin.h3", "berlin.h3", "berlin.h4"]));
    let (ticket, group) = (pick(chance, &["t1", "t2", "t3"]), pick(chance, &["trio", "duo"]));
    let (sha256, other) = (pick(chance, &[DIGEST, OTHER]), pick(chance, &["trio", "solo"]));
    let at_ms = spread(chance, -5_000, 75_000);
    let args = match word.as_str() {
        "start" => json!({ "ticket": ticket, "group": group, "sha256": sha256, "at_ms": at_ms }),
        "commit" => json!({ "ticket": ticket }),
        _ => json!({}),
    };
    let (id, sent_ms) = (chance.below(100_000).to_string(), spread(chance, -3_000, 4_000));
    let order = Order { id, to, word, args, sent_ms };
    let key = &keys[usize::from(chance.once_in(4))];
    let mut letter = Letter::sign(key, serde_json::to_string(&order).unwrap()).unwrap();
    if chance.once_in(8) {
        letter.body = letter.body.replace("duo", &other);
        letter.key = keys[0].public_key();
    }
    letter
}

const OTHER: &str = "1111111111111111111111111111111111111111111111111111111111111111";

/// Who armed the hall for what.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Case {
    /// Nobody, in any state.
    Nobody,
    /// A person, for no start of the fleet.
    Plainly,
    /// A person, for another group.
    OtherGroup,
    /// A person, with another cue.
    OtherCue,
    /// A person, for this one: to see that it would come.
    ForIt,
}

/// What ten thousand letters have done in a hall: how many counted, and how many starts were given to the tick thread.
fn ten_thousand(case: Case, keys: &[KeyPair; 2], of_fleet: &Fleet) -> (usize, usize) {
    let (letterbox, mut chance) = (Letterbox::of(of_fleet), Chance::new(19));
    let mut hall = member(State::Armed);
    Arc::make_mut(&mut hall.config).fleet = Some(of_fleet.clone());
    if case == Case::OtherCue {
        hall.cued.as_mut().unwrap().sha256 = "2".repeat(64);
    }
    let (mut starts, mut now_ms, mut taken, mut given) = (FleetStarts::default(), 0, 0, 0);
    for number in 0..10_000 {
        if number % 20 == 0 {
            match case {
                Case::Nobody => hall.mirror.state = State::ALL[chance.below(State::ALL.len())],
                Case::Plainly => {}
                Case::OtherGroup => starts.armed("solo".to_owned(), &hall),
                Case::OtherCue | Case::ForIt => starts.armed("trio".to_owned(), &hall),
            }
        }
        now_ms += i64::try_from(chance.below(1_500)).unwrap();
        is_at(&mut hall, now_ms);
        measured(&hall, 0);
        let letter = letter(&mut chance, keys, T0_MS + now_ms);
        let mut acts = starts.due(&hall);
        if let Ok((who, Some(ask))) = letterbox.open(&letter, &hall.wall) {
            taken += 1;
            acts.extend(does(&mut starts, &Desired { ask, who }, &hall));
        }
        for act in &acts {
            match act {
                Act::Tick(TickCommand::StartAt(_)) => given += 1,
                Act::Tick(TickCommand::CallOff) | Act::Passing(_) | Act::RewindStart | Act::Name(_) => {}
                Act::Stage(ShowChange::Start(_)) | Act::Otherwise(_) => {}
                other => panic!("{case:?}: {other:?}"),
            }
        }
    }
    (taken, given)
}

/// What is done for a letter that counts.
fn does(starts: &mut FleetStarts, asked: &Desired, hall: &HallContext) -> Vec<Act> {
    if crate::app::supervisor::fleet::may_ask(asked, hall).is_err() {
        return Vec::new();
    }
    let mut acts = told(starts, &SupervisorEvent::Asked(asked), hall);
    let done = match &asked.ask {
        Command::StartAt(order) => starts.ask(order, &asked.who, hall),
        Command::Commit { ticket } => starts.commit(ticket, &asked.who, hall),
        Command::Disarm | Command::Pause => Ok(Vec::new()),
        other => panic!("the fleet may {other}"),
    };
    acts.extend(done.unwrap_or_default());
    acts
}

#[test]
fn ten_thousand_letters_start_no_hall_that_no_person_has_armed_for_it() {
    let keys = [new_letter_key(), new_letter_key()];
    let known = FleetKey { name: "office".to_owned(), role: Role::Operate, public: keys[0].public_key() };
    let mut of_fleet = fleet(vec![known]);
    of_fleet.allow = FleetWord::ALL.map(|(_, word)| word).to_vec();
    for case in [Case::Nobody, Case::Plainly, Case::OtherGroup, Case::OtherCue, Case::ForIt] {
        let (taken, given) = ten_thousand(case, &keys, &of_fleet);
        assert!(taken > 1_000, "{case:?}: {taken} letters counted");
        assert_eq!(given > 0, case == Case::ForIt, "{case:?}: {given} starts");
    }
}
