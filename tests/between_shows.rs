//! A hall that lives on between shows, in virtual time: what is loaded in one state is played from another, and the seats go
//! on from where they are.

use std::cell::{Cell, RefCell};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use kinocue::cue::{self, Source};
use kinocue::harness::app::StagedShow;
use kinocue::harness::belief::Reading;
use kinocue::harness::config::from_to_args;
use kinocue::harness::drive::Manner;
use kinocue::harness::engine::Show;
use kinocue::harness::motion::{MAX_AXES, Pose};
use kinocue::harness::net::Delivery;
use kinocue::harness::rt::{
    Alarm, Command, Conductor, Desk, FrameSink, Live, Loaded, MailEnds, News, NewsIn, Places, PlanLoop,
    Planning, TickLoop, mailboxes,
};
use kinocue::harness::state::{Event, Finding, LedBefore, PlayMode, Readiness, State, Transition};
use kinocue::harness::time::{Clock, MonoTime, Rate, ShowTime, TickGrid};
use kinocue::harness::timeline::Timeline;
use kinocue::harness::{ORIGIN, swell};
use kinocue::wire::{MotionRequest, Timing};
use rtrb::Producer;

/// Something that happens between shows.
#[derive(Debug, Clone, Copy)]
enum Deed {
    Load,
    /// The same, made for that trim.
    LoadTrimmed(i32),
    Trim(i32),
    Ask(Transition),
    Tell(Event),
    See(Alarm),
    /// A controller takes part again: its seat was read at rest in that pose.
    Found(Pose),
    /// A script has the seat parked by one slow frame.
    Slowly,
    Stop,
    /// Somebody hears what there is to hear.
    Hear,
}

use Deed::{Ask, Found, Hear, Load, LoadTrimmed, See, Slowly, Stop, Tell, Trim};

const PARKED: Pose = [0.0; MAX_AXES];
const READY: Deed = Tell(Event::Readiness(Readiness::Ready));

const fn found(homed: bool, at_park: bool) -> Deed {
    Tell(Event::Identified(Finding { homed, at_park, before: LedBefore::Ended }))
}

/// Four seconds for one seat of one axis.
fn staged() -> StagedShow {
    staged_at(ShowTime::ZERO)
}

fn staged_at(start: ShowTime) -> StagedShow {
    let text = swell(1, 4, 30.0, 0.2);
    let timeline = Timeline::new(
        cue::read(Path::new("ride.csv"), text.as_bytes(), &Source::Native).expect("the cue is sound"),
    );
    let config = from_to_args(&["127.0.0.1:7408".to_owned()], &[], 1).expect("the address is sound");
    let show = Show { rate: Rate::from_hz(100.0), timing: Timing::Relative, start, plays: 1 };
    StagedShow::new(&config, timeline, show, Manner { level: 1.0, silent: false }).expect("there is a join")
}

/// A clock that jumps, with what happens at each tick of that number.
struct Hands<'a> {
    now: Cell<MonoTime>,
    tick: Cell<u64>,
    script: &'a [(u64, Deed)],
    end: u64,
    leave: &'a AtomicBool,
    desk: &'a Desk,
    commands: RefCell<Producer<Command>>,
    alarms: RefCell<Producer<Alarm>>,
    plans: RefCell<PlanLoop>,
    news: RefCell<NewsIn>,
    states: RefCell<Vec<State>>,
    live: &'a Live,
    /// Where the seat is.
    stands: Cell<Pose>,
}

impl Hands<'_> {
    /// The ack thread reads the seat.
    fn read(&self) {
        let reading = Reading::at_rest(self.stands.get(), self.now.get());
        self.live.evidence(0).expect("there is one lane").on_reading(&reading);
    }

    fn hear(&self) {
        while let Ok(news) = self.news.borrow_mut().pop() {
            if let News::Entered { state, .. } = news
                && self.states.borrow().last() != Some(&state)
            {
                self.states.borrow_mut().push(state);
            }
        }
    }
}

impl Clock for Hands<'_> {
    fn now(&self) -> MonoTime {
        self.now.get()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        self.now.set(deadline);
        if self.tick.get().is_multiple_of(25) && !self.live.is_moving() {
            self.read(); // a beat
        }
        self.plans.borrow_mut().serve(&mut Vec::new());
        let tick = self.tick.replace(self.tick.get() + 1);
        let command = |command| self.commands.borrow_mut().push(command).expect("there is room");
        for (_, deed) in self.script.iter().filter(|(at, _)| *at == tick) {
            match deed {
                Load => command(Command::Load(show())),
                LoadTrimmed(ms) => command(Command::Load(show_trimmed(*ms))),
                Trim(ms) => self.desk.set_trim_ms(*ms),
                Slowly => command(Command::ParkSlowly { lane: 0, time_ms: 3_000 }),
                Ask(request) => command(Command::Request(*request)),
                Tell(event) => command(Command::Event(*event)),
                Found(pose) => {
                    self.stands.set(*pose);
                    self.read();
                    self.alarms.borrow_mut().push(Alarm::Found(0)).expect("there is room");
                }
                See(alarm) => self.alarms.borrow_mut().push(*alarm).expect("there is room"),
                Stop => self.desk.stop(),
                Hear => self.hear(),
            }
        }
        if tick >= self.end {
            self.leave.store(true, std::sync::atomic::Ordering::Relaxed);
        }
    }
}

fn show() -> Box<Loaded> {
    staged().loaded()
}

fn show_trimmed(ms: i32) -> Box<Loaded> {
    let mut loaded = staged_at(ShowTime::from_millis(-i64::from(ms))).loaded();
    loaded.engine.begin_trimmed(ms);
    loaded
}

/// First axes of the frames, in pulses, each with its tick.
struct Link<'a> {
    hands: &'a Hands<'a>,
    frames: Vec<(u64, i32)>,
}

impl FrameSink for Link<'_> {
    fn send(&mut self, _lane: usize, datagram: &[u8], _at: MonoTime) -> Delivery {
        let request = MotionRequest::parse(datagram).expect("only frames are sent");
        // Each frame is acked at once, and leads the seat.
        self.hands.live.evidence(0).expect("there is one lane").on_ack(request.frame);
        let first = request.positions[0].0;
        self.hands.stands.set(up(f64::from(first) / 300_000.0));
        self.frames.push((self.hands.tick.get(), first));
        Delivery::Sent
    }
}

/// A hall of one seat that lives through a script until tick `end`: its frames, and the states that it was in.
fn live_through(script: &[(u64, Deed)], end: u64) -> (Vec<(u64, i32)>, Vec<State>) {
    let (engine, lanes, planner, timeline) = staged().split();
    let (desk, leave) = (staged().desk(), AtomicBool::new(false));
    let live = Arc::new(Live::new(1));
    let (mail, ends) = mailboxes(1, Rate::from_hz(100.0), Arc::clone(&live));
    let MailEnds { sent: _sent, ticks: _ticks, tasks, answers, commands, alarms, news } = ends;
    let planning = Box::new(Planning { planner, timeline });
    let hands = Hands {
        now: Cell::new(ORIGIN),
        tick: Cell::new(0),
        script,
        end,
        leave: &leave,
        desk: &desk,
        commands: RefCell::new(commands),
        alarms: RefCell::new(alarms),
        plans: RefCell::new(PlanLoop { planning, tasks, answers }),
        news: RefCell::new(news),
        states: RefCell::default(),
        live: &live,
        stands: Cell::new(PARKED),
    };
    let places = Places::new(&lanes, Rate::from_hz(100.0));
    let mut ticks = TickLoop {
        clock: &hands,
        grid: TickGrid::new(ORIGIN, Rate::from_hz(100.0)),
        engine: engine.unknown(),
        conductor: Conductor::of_a_hall(ORIGIN),
        lanes,
        places,
        sink: Link { hands: &hands, frames: Vec::new() },
        mail,
        desk: &desk,
        leave: &leave,
    };
    ticks.run();
    let frames = ticks.sink.frames;
    hands.hear();
    (frames, hands.states.take())
}

/// That the cue was played from `go` on: it was joined within three seconds, and the seat parked in the end.
#[track_caller]
fn assert_played(script: &[(u64, Deed)], go: u64) {
    let (frames, states) = live_through(script, go + 1_500);
    assert!(states.contains(&State::Playing(PlayMode::Following)), "{states:?}");
    assert_eq!(states.last(), Some(&State::Parked), "{states:?}");
    let (first, _) = frames.iter().find(|(tick, _)| *tick > go).expect("frames go out");
    assert!(*first <= go + 2, "the first frame came at tick {first}");
    let farthest = frames.iter().map(|(_, pulses)| *pulses).max();
    assert!(farthest > Some(150_000), "{farthest:?} pulses");
    assert!(frames.windows(2).all(|pair| (pair[1].1 - pair[0].1).abs() <= 4_800), "no step over 240 mm/s");
}

#[test]
fn a_slow_frame_to_park_leaves_before_the_hall_knows_of_its_seats_and_never_after() {
    let script = [(2, Slowly), (10, Found(PARKED)), (11, found(true, true)), (20, Slowly)];
    let armed = [(30, Load), (31, READY), (32, Ask(Transition::Arm)), (40, Slowly), (50, Stop), (60, Slowly)];
    let (frames, states) = live_through(&[&script[..], &armed[..]].concat(), 100);
    assert_eq!(frames, [(3, 0)], "one frame, to park");
    assert!(states.ends_with(&[State::Armed, State::Stopped]), "{states:?}");
}

#[test]
fn a_cue_that_was_loaded_before_the_seats_were_found_is_played() {
    let script =
        [(1, Load), (2, READY), (5, Found(PARKED)), (6, found(true, true)), (9, Ask(Transition::Arm))];
    assert_played(&[&script[..], &[(10, Ask(Transition::Go))]].concat(), 10);
}

#[test]
fn a_cue_that_was_loaded_before_the_seats_homed_is_played_from_where_they_are_then() {
    let mut home = PARKED;
    home[0] = 0.02;
    let script = [
        (1, Found(PARKED)),
        (2, found(false, true)),
        (3, Load),
        (4, READY),
        (5, Ask(Transition::HomeAndArm)),
        (50, See(Alarm::Leave(0))),
        (60, Found(home)),
        (70, Tell(Event::Homed)),
        (80, Ask(Transition::Go)),
    ];
    assert_played(&script, 80);
}

#[test]
fn a_seat_that_was_moved_while_the_hall_was_armed_joins_from_where_it_was_found() {
    let mut elsewhere = PARKED;
    elsewhere[0] = 0.3;
    let script = [
        (1, Found(PARKED)),
        (2, found(true, true)),
        (3, Load),
        (4, READY),
        (5, Ask(Transition::Arm)),
        (20, See(Alarm::Leave(0))),
        (40, Found(elsewhere)),
        (60, Ask(Transition::Go)),
    ];
    assert_played(&script, 60);
    let (frames, _) = live_through(&script, 200);
    let (_, first) = frames[0];
    assert!((first - 90_000).abs() <= 4_800, "{first} pulses at first, from 90,000");
}

#[test]
fn a_hall_that_was_stopped_cleared_and_homed_plays_what_was_loaded_meanwhile() {
    let script = [
        (1, Found(PARKED)),
        (2, found(true, true)),
        (3, Load),
        (4, READY),
        (5, Stop),
        (6, Load),
        (7, Ask(Transition::Clear)),
        (8, Tell(Event::PositionsRead)),
        (9, Ask(Transition::Home)),
        (50, Tell(Event::Homed)),
        (60, Ask(Transition::Arm)),
        (61, Ask(Transition::Go)),
    ];
    assert_played(&script, 61);
}

/// That height of the only axis, fraction of its stroke.
fn up(height: f64) -> Pose {
    let mut pose = PARKED;
    pose[0] = height;
    pose
}

/// Parked by a show, or before any, with a seat that comes back up at tick 20 and is asked to park at tick 100.
fn astray(before: &[(u64, Deed)]) -> Vec<(u64, Deed)> {
    let found = [(1, Found(PARKED)), (2, found(true, true))];
    let back = [(19, See(Alarm::Leave(0))), (20, Found(up(0.3))), (100, Ask(Transition::Park))];
    [&found[..], before, &back[..]].concat()
}

#[test]
fn a_seat_that_came_back_up_between_shows_is_parked_slowly_once_a_person_asks() {
    let loaded = [(3, Load), (4, READY)];
    for before in [&loaded[..], &[]] {
        let (frames, states) = live_through(&astray(before), 600);
        assert_eq!(states, [State::Boot, State::Parked, State::Parking, State::Parked]);
        let (first, from) = frames[0];
        assert!(first >= 100 && (from - 90_000).abs() <= 1_000, "{from} pulses at tick {first}");
        // 50 mm/s are 1,000 pulses in 10 ms.
        let steps = frames.windows(2).map(|pair| pair[0].1 - pair[1].1);
        assert!(steps.clone().all(|step| (0..=1_001).contains(&step)), "{:?}", steps.max());
        assert_eq!(frames.last().map(|(_, pulses)| *pulses), Some(0));
    }
}

#[test]
fn a_seat_that_was_parked_between_shows_plays_the_next_one() {
    let script =
        [&astray(&[(3, Load), (4, READY)])[..], &[(600, Load), (601, Ask(Transition::Arm))]].concat();
    assert_played(&[&script[..], &[(610, Ask(Transition::Go))]].concat(), 610);
}

#[test]
fn a_seat_that_comes_up_again_is_parked_again_though_nothing_was_loaded_since() {
    let again = [(700, Found(up(0.1))), (710, Ask(Transition::Park))];
    let (frames, states) = live_through(&[&astray(&[])[..], &again].concat(), 1_000);
    assert_eq!(states.iter().filter(|state| **state == State::Parking).count(), 2, "{states:?}");
    let (_, from) = frames.iter().find(|(tick, _)| *tick > 700).expect("frames go out");
    assert!((from - 30_000).abs() <= 1_000, "{from} pulses");
    assert_eq!(frames.last().map(|(_, pulses)| *pulses), Some(0));
}

#[test]
fn a_park_of_seats_that_are_all_at_park_sends_nothing() {
    for before in [&[(3, Load), (4, READY)][..], &[]] {
        let found = [(1, Found(PARKED)), (2, found(true, true)), (100, Ask(Transition::Park))];
        let (frames, states) = live_through(&[&found[..], before].concat(), 200);
        assert_eq!(
            (frames, states),
            (vec![], vec![State::Boot, State::Parked, State::Parking, State::Parked])
        );
    }
}

#[test]
fn a_seat_that_is_stopped_before_it_sets_out_to_park_stays_where_it_is() {
    let script = [
        (101, Stop),
        (110, Ask(Transition::Clear)),
        (111, Tell(Event::PositionsRead)),
        // Had it set out, it would be half-way by now, as far as the engine knows.
        (190, Ask(Transition::Park)),
    ];
    let (frames, states) = live_through(&[&astray(&[])[..], &script].concat(), 700);
    assert_eq!(states.last(), Some(&State::Parked), "{states:?}");
    let (first, from) = frames[0];
    assert!(first >= 190 && (from - 90_000).abs() <= 1_000, "{from} pulses at tick {first}");
}

#[test]
fn whoever_hears_nothing_for_a_while_still_hears_where_the_hall_stands() {
    let mut script = vec![(1, found(true, true)), (2, Load), (3, READY)];
    // More news than find room.
    script.extend(
        (0..100).flat_map(|turn| {
            [(10 + 2 * turn, Ask(Transition::Arm)), (11 + 2 * turn, Ask(Transition::Disarm))]
        }),
    );
    script.extend([(220, Stop), (230, Hear)]);
    let (_, states) = live_through(&script, 240);
    assert_eq!(states.last(), Some(&State::Stopped));
}

/// Two shows, one after the other, each loaded by `load`: the positions of the second one while it follows the cue, by how many
/// ticks after its go they came.
fn second_show(load: Deed, trim_ms: i32) -> Vec<(u64, i32)> {
    let show = |go: u64| [(go - 3, load), (go - 1, Ask(Transition::Arm)), (go, Ask(Transition::Go))];
    let begin = [(1, Found(PARKED)), (2, Trim(trim_ms)), (3, found(true, true)), (4, READY), (1_900, Hear)];
    let (frames, _) = live_through(&[&begin[..], &show(10), &show(2_000)].concat(), 3_900);
    frames.into_iter().filter_map(|(tick, pulses)| Some((tick.checked_sub(2_000)?, pulses))).collect()
}

#[test]
fn a_trim_that_was_set_before_two_shows_holds_in_the_second_as_well() {
    let at = |frames: &[(u64, i32)], tick: u64| frames.iter().find(|one| one.0 == tick).expect("a frame").1;
    let plain = second_show(Load, 0);
    // The cue is joined by then, and 20 ms are slewed in.
    for tick in (300..380).step_by(20) {
        let (before, now) = (at(&plain, tick - 2), at(&plain, tick));
        assert!((before - now).abs() > 20, "it moves: {before} {now}");
        for load in [Load, LoadTrimmed(20)] {
            let trimmed = at(&second_show(load, 20), tick);
            assert!((trimmed - before).abs() <= 2, "{load:?} at {tick}: {trimmed}, not {before} but {now}");
        }
    }
}
