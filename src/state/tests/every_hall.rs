//! Every hall that there can be: from the start of the program on, each request, each event and each lapse of time is tried in each
//! hall that is found, until nothing new is found. What is asserted here holds in all of them, not in those that somebody thought of.

use std::collections::{BTreeSet, HashMap};

use super::remedies::follow_to_the_show;
use super::*;
use crate::state::rules::height;

/// All of a hall that decides what it does. Since when it is so and how often it was cleared decide nothing, and of controllers and
/// groups the number is only passed on: one of each stands for all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Standing {
    state: State,
    cause: Cause,
    arms_then: bool,
    stop: Option<Cause>,
    fault: Option<Trouble>,
    known: [bool; 5],
    latch: Latch,
    readiness: Readiness,
}

impl Standing {
    fn of(hall: &Machine) -> Self {
        let Machine { state, cause, goal, stop, fault, facts, since: _, clears: _ } = *hall;
        let Facts { identified, homed, measured, astray, pressed, latch, readiness } = facts;
        let known = [identified, homed, measured, astray, pressed];
        Self { state, cause, arms_then: goal == Goal::Armed, stop, fault, known, latch, readiness }
    }
}

/// What leads from one hall to another.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Turn {
    Step(Step),
    /// The time of the state is over.
    Lapse,
}

/// A new event has to be named here, and has to be put into [`events`] with all that it may say.
const fn is_tried(event: Event) {
    match event {
        Event::Identified(_) | Event::PositionsRead | Event::Astray(_) | Event::Rebooted(_) => {}
        Event::Readiness(_) | Event::Homed | Event::JoinBegun | Event::Joined | Event::Late => {}
        Event::CueEnded | Event::FilmLeads | Event::FilmAwaited(_) | Event::FilmOver(_) => {}
        Event::AtRest | Event::Parked | Event::Policy(..) | Event::EmergencyStop(_) => {}
        Event::AllReleased | Event::Slept(_) | Event::Trouble(_) | Event::Latched(_) | Event::ZerosKnown => {}
    }
}

fn events() -> Vec<Event> {
    use Readiness::{NoCue, NotPreflighted, NotProved, Ready};
    let both = [false, true];
    let findings = (0..12_u8).map(|number| {
        let before = [LedBefore::Ended, LedBefore::Crashed, LedBefore::OnCue][usize::from(number >> 2)];
        let [homed, at_park] = [0, 1].map(|bit| number >> bit & 1 == 1);
        Event::Identified(Finding { homed, at_park, before })
    });
    let holds = FilmState::ALL.map(HoldCause::Film).into_iter();
    let holds = holds.chain([HoldCause::Apart, HoldCause::Unstable, HoldCause::Asks]);
    let plain = [
        Event::PositionsRead,
        Event::Rebooted(0),
        Event::Homed,
        Event::JoinBegun,
        Event::Joined,
        Event::Late,
        Event::CueEnded,
        Event::FilmLeads,
        Event::AtRest,
        Event::Parked,
        Event::Policy(Demand::Pause, 0),
        Event::Policy(Demand::Park, 0),
        Event::EmergencyStop(0),
        Event::AllReleased,
        Event::Slept(SLEPT),
        Event::Slept(SLEPT_LONG),
        Event::Slept(SLEPT_LONG * 2),
        Event::ZerosKnown,
    ];
    let parks = [ParkCause::FilmEnded, ParkCause::FilmCutShort, ParkCause::CueLeft, ParkCause::HeldTooLong];
    let all: Vec<_> = (plain.into_iter().chain(findings))
        .chain(both.map(Event::Astray))
        .chain([NoCue, NotProved, NotPreflighted, Ready].map(Event::Readiness))
        .chain([Latch::Free, Latch::Held, Latch::Over].map(Event::Latched))
        .chain(holds.map(Event::FilmAwaited))
        .chain(parks.map(Event::FilmOver))
        .chain(super::remedies::TROUBLES.map(Event::Trouble))
        .collect();
    all.iter().for_each(|event| is_tried(*event));
    all
}

fn turns() -> Vec<Turn> {
    let requests = Transition::ALL.map(Step::Command).into_iter();
    let steps = requests.chain(events().into_iter().map(Step::Tell)).map(Turn::Step);
    steps.chain([Turn::Lapse]).collect()
}

/// The hall after a turn; a refusal where it was a request that was not taken.
fn after(hall: &Machine, turn: Turn) -> (Machine, Option<Refusal>) {
    let mut next = hall.clone();
    let refusal = match turn {
        Turn::Step(step) => take(&mut next, step, hall.since).err(),
        Turn::Lapse => {
            next.tick(hall.lapses().unwrap_or(hall.since));
            None
        }
    };
    (next, refusal)
}

/// Every hall that can be reached, and every way from one to another.
struct EveryHall {
    halls: Vec<Machine>,
    ways: Vec<(usize, Turn, usize)>,
    refused: BTreeSet<(String, String)>,
}

fn every_hall() -> EveryHall {
    let turns = turns();
    let mut halls = vec![Machine::new(s(0))];
    let mut places = HashMap::from([(Standing::of(&halls[0]), 0)]);
    let (mut ways, mut refused) = (Vec::new(), BTreeSet::new());
    let mut said = BTreeSet::new();
    let mut place = 0;
    while let Some(hall) = halls.get(place).cloned() {
        let here = Standing::of(&hall);
        for &turn in &turns {
            let (mut next, refusal) = after(&hall, turn);
            hold_to_the_rules(&hall, turn, refusal.as_ref(), &next);
            if let Some(Refusal { state, asked, why }) = refusal
                && said.insert((state.word(), asked as u8, why.code()))
            {
                refused.insert((why.words().to_owned(), refusal.expect("it is one").to_string()));
            }
            let there = Standing::of(&next);
            if there == here {
                continue;
            }
            next.since = s(0);
            let to = *places.entry(there).or_insert_with(|| {
                halls.push(next);
                halls.len() - 1
            });
            ways.push((place, turn, to));
        }
        place += 1;
    }
    EveryHall { halls, ways, refused }
}

/// What holds of every turn of every hall.
fn hold_to_the_rules(hall: &Machine, turn: Turn, refusal: Option<&Refusal>, next: &Machine) {
    let (from, to) = (hall.state, next.state);
    let way = || format!("{turn:?} led from {hall:?} to {next:?}");
    if refusal.is_some() {
        let unchanged = Standing::of(hall) == Standing::of(next);
        assert!(unchanged && hall.since == next.since && hall.clears == next.clears, "{}", way());
    }
    match turn {
        Turn::Step(Step::Command(request)) => {
            let stopped = if from.may_send_motion() { State::Stopping } else { State::Stopped };
            assert!(request != Transition::Stop || (refusal.is_none() && to == stopped), "{}", way());
            assert!(height(to) <= height(from) || may_lead_up(hall, request, to), "{}", way());
        }
        Turn::Step(Step::Tell(_)) | Turn::Lapse => {
            let is_asked_for = from == State::Homing && hall.goal == Goal::Armed && to == State::Armed;
            let is_found = from == State::Boot && to == State::Parked;
            assert!(height(to) <= height(from) || is_asked_for || is_found, "{}", way());
        }
    }
    // What is stopped or at fault stays so until a person clears it.
    let clears = matches!(turn, Turn::Step(Step::Command(Transition::Clear))) && refusal.is_none();
    assert!(hall.stop.is_none() || next.stop.is_some() || clears, "{}", way());
    assert!(hall.fault.is_none() || next.fault.is_some() || clears, "{}", way());
    assert!(!clears || to == State::Recovering, "{}", way());
    // Nothing begins to move, or to be ready for it, in a hall that nobody has looked at.
    let begins =
        !from.may_send_motion() && (to.may_send_motion() || matches!(to, State::Homing | State::Armed));
    assert!(!begins || next.facts.identified, "{}", way());
}

/// The requests by which a person leads a hall up, and from where.
fn may_lead_up(hall: &Machine, request: Transition, to: State) -> bool {
    match (hall.state, request) {
        (State::Armed, Transition::Go) => to == State::Playing(PlayMode::Joining),
        (State::Paused, Transition::Resume) => to == State::Playing(PlayMode::Joining),
        // Of one show alone, and only where all is known that a motion begins from.
        (State::Recovering, Transition::Resume) => {
            let Facts { identified, homed, measured, readiness, .. } = hall.facts;
            let is_known = identified && homed && measured && readiness == Readiness::Ready;
            to == State::Playing(PlayMode::Joining) && hall.cause == Cause::TookOver && is_known
        }
        (State::Recovering | State::Parked, Transition::Park) => to == State::Parking,
        (State::Recovering | State::Parked, Transition::Home) => to == State::Homing,
        (State::Parked, Transition::Arm) => to == State::Armed && hall.facts.homed,
        (State::Parked, Transition::HomeAndArm) => {
            to == if hall.facts.homed { State::Armed } else { State::Homing }
        }
        (State::Stopped | State::Fault, Transition::Clear) => to == State::Recovering,
        _ => false,
    }
}

/// What holds of every hall, however it came about.
fn hold_to_the_rules_at_rest(hall: &Machine) {
    let Machine { state, stop, fault, facts, .. } = hall;
    assert!(stop.is_none() || matches!(state, State::Stopping | State::Stopped), "{hall:?}");
    assert!(stop.is_some() || *state != State::Stopped, "{hall:?}");
    assert!(!hall.cause.words().is_empty() && !hall.next().to_string().is_empty(), "{hall:?}");
    let wrong = matches!(state, State::Stopping | State::Stopped | State::Fault);
    assert!(wrong || fault.is_none(), "{hall:?}");
    assert!(*state != State::Stopping || stop.is_some() || fault.is_some(), "it stops for nothing: {hall:?}");
    assert!(*state != State::Fault || hall.cause == Cause::Trouble(fault.expect("it is one")), "{hall:?}");
    assert!(!facts.pressed || matches!(state, State::Stopping | State::Stopped), "{hall:?}");
    let ready = facts.homed && facts.identified && facts.readiness == Readiness::Ready;
    assert!(*state != State::Armed || ready, "{hall:?}");
}

/// Which halls lead to one of those, by ways that are `taken`.
fn that_lead_to(
    every: &EveryHall,
    there: impl Fn(&Machine) -> bool,
    taken: impl Fn(Turn) -> bool,
) -> Vec<bool> {
    let mut back = vec![Vec::new(); every.halls.len()];
    for (from, turn, to) in &every.ways {
        if taken(*turn) {
            back[*to].push(*from);
        }
    }
    let mut leads: Vec<bool> = every.halls.iter().map(there).collect();
    let mut open: Vec<usize> = (0..leads.len()).filter(|place| leads[*place]).collect();
    while let Some(place) = open.pop() {
        for &from in &back[place] {
            if !std::mem::replace(&mut leads[from], true) {
                open.push(from);
            }
        }
    }
    leads
}

/// Neither people nor luck: what goes on by itself, once something is wrong.
fn is_unasked(turn: Turn) -> bool {
    !matches!(turn, Turn::Step(Step::Command(_)))
}

fn all(every: &EveryHall, leads: &[bool], what: &str) {
    let lost = every.halls.iter().zip(leads).find(|(_, leads)| !**leads);
    assert!(lost.is_none(), "{what}: {lost:?}");
}

#[test]
#[expect(clippy::print_stdout, reason = "how many there are is for who asks to see it")]
fn every_hall_there_can_be_stops_has_a_way_out_and_goes_up_by_a_person_alone() {
    let every = every_hall();
    let EveryHall { halls, ways, refused } = &every;
    let count =
        format!("{} halls, {} ways between them, {} refusals", halls.len(), ways.len(), refused.len());
    println!("{count}");
    assert!(include_str!("../../../docs/states.md").contains(&count), "docs/states.md should say: {count}");
    halls.iter().for_each(hold_to_the_rules_at_rest);
    let states: BTreeSet<_> = halls.iter().map(|hall| hall.state.word()).collect();
    assert_eq!(states.len(), State::ALL.len(), "every state can be reached");

    // A way out: to a show and back to park, from every one; and by what is named next, with nothing else done.
    let plays = |hall: &Machine| hall.state == State::Playing(PlayMode::Following);
    all(&every, &that_lead_to(&every, plays, |_| true), "no way to a show");
    all(&every, &that_lead_to(&every, |hall| hall.state == State::Parked, |_| true), "no way to park");
    halls.iter().for_each(|hall| follow_to_the_show(&mut hall.clone(), s(1)));

    // Once it is stopped, whatever else happens it moves no more: nothing unasked leads to motion, and what still moves comes to rest in time.
    let moves = that_lead_to(&every, |hall| hall.state.may_send_motion(), is_unasked);
    for (hall, moves) in halls.iter().zip(moves) {
        let (stopped, _) = after(hall, Turn::Step(Step::Command(Transition::Stop)));
        let (rests, _) = after(&stopped, Turn::Lapse);
        assert!(!rests.may_send_motion() && rests.state == State::Stopped, "{hall:?}");
        assert!(hall.state.may_send_motion() || !moves, "it moves by itself: {hall:?}");
    }
    for (words, sentence) in refused {
        assert!(
            !words.is_empty() && sentence.contains(words.as_str()) && sentence.len() > words.len() + 20,
            "{sentence}"
        );
    }
}
