//! A hall in virtual time: the loops of the program, stepped by turns, and what a supervisor does beside them.

use kinocue::harness::app::StagedShow;
use kinocue::harness::app::runtime::{Loops, Numbers, Purpose, Runtime, RuntimeHandle};
use kinocue::harness::engine::{Mix, Show};
use kinocue::harness::net::{DrainGrid, over};
use kinocue::harness::recording::HallRecording;
use kinocue::harness::rt::{Command, Line, News, Order, Ticked};
use kinocue::harness::state::{Event, LedBefore, Readiness, State, Transition, Trouble};
use kinocue::harness::time::{MonoTime, Rate, ShowTime};
use kinocue::wire::Dialect;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::cues::{Book, Kind};
use super::ether::Ether;
use super::judge::Breach;
use super::seat::{MS, Settings};

/// How often the supervisor looks.
const LOOK: u64 = 20 * MS;
/// What comes sooner than this after a homing may be from before it, and how long is waited for the rest.
const STALE: u64 = 300 * MS;
const SEEN_WITHIN: u64 = 5_000 * MS;
/// How long the order to home is waited upon until it is repeated.
const REPEAT: u64 = 200 * MS;
/// How long seats that were told to rest may go on.
const COMES_TO_REST: u64 = 1_500 * MS;

/// A show that was asleep for longer is resumed by a person.
const ASLEEP_MS: u64 = 2_000;

/// Which loop stands still.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Thread {
    Tick,
    Acks,
    Planner,
    All,
}

#[derive(Debug, Clone, Copy)]
enum Homing {
    UnderWay { told: u64 },
    Settling { since: u64 },
}

pub(crate) struct Hall<'h, 'l> {
    pub(crate) ether: Ether,
    pub(crate) kind: Kind,
    book: &'static Book,
    pub(crate) runtime: RuntimeHandle,
    pub(crate) line: Line,
    loops: &'h mut Loops<'l, Ether>,
    drains: DrainGrid,
    tell_at: MonoTime,
    ticked: Ticked,
    next_ack: u64,
    next_look: u64,
    next_plan: Option<u64>,
    /// Until when each loop stands still: ticks, acks, planner.
    still: [u64; 3],
    /// How long the planner takes, and the least time from one look for acks to the next.
    pub(crate) planner_ns: u64,
    pub(crate) acks_ns: u64,
    pub(crate) cue: usize,
    cued: bool,
    start: ShowTime,
    pub(crate) state: State,
    since: u64,
    homing: Option<Homing>,
    /// Orders to home that each seat had heard before the last homing.
    homings: Vec<u32>,
    ready: bool,
    /// The commands that the hall has not answered yet, in their order: whether each asks for motion.
    open: VecDeque<bool>,
    show_over: bool,
    pub(crate) closed: bool,
    pub(crate) diary: Option<Vec<String>>,
    recording: Option<HallRecording>,
}

/// A hall of virtual seats that opens, and is `led`; where it reopens, from which frame numbers on.
pub(crate) fn open<T>(
    ether: &Ether,
    kind: Kind,
    before: LedBefore,
    numbers: &Numbers,
    lead: impl FnOnce(&mut Hall<'_, '_>) -> T,
) -> (T, Numbers) {
    let book = kind.book();
    for line in &mut ether.world().lines {
        (line.seat.settings.period_ms, line.seat.settings.asks_ms) = (kind.period_ms(), kind.asks_ms());
    }
    ether.world().outside = kind.outside;
    let halves = over(Arc::new(ether.clone()));
    let mut runtime = Runtime::over(
        Arc::clone(&book.config),
        Purpose::Hall { before, may_come: false },
        numbers,
        &Default::default(),
        halves,
    )
    .expect("the hall opens");
    let recording = ether.world().recordings.is_some().then(|| HallRecording::tap(&mut runtime));
    let origin = MonoTime::from_nanos(ether.ns() + 20 * MS);
    let period = Rate::from_hz(kind.hz).period();
    let (outcome, numbers) = runtime.stepped(ether, origin, |runtime, line, loops| {
        let mut hall = Hall {
            ether: ether.clone(),
            kind,
            book,
            runtime,
            line,
            loops,
            drains: DrainGrid::new(origin, period),
            tell_at: origin,
            ticked: Ticked::default(),
            next_ack: ether.ns(),
            next_look: ether.ns(),
            next_plan: None,
            still: [0; 3],
            planner_ns: 2 * MS,
            acks_ns: 0,
            cue: 0,
            cued: false,
            start: ShowTime::ZERO,
            state: State::Boot,
            since: ether.ns(),
            homing: None,
            homings: Vec::new(),
            ready: false,
            open: VecDeque::new(),
            show_over: false,
            closed: false,
            diary: None,
            recording,
        };
        let outcome = lead(&mut hall);
        (outcome, hall.recording)
    });
    let (outcome, recording) = outcome;
    // Its taps are gone.
    if let (Some(recording), Some(all)) = (recording, &mut ether.world().recordings) {
        all.push(recording.finish());
    }
    (outcome, numbers)
}

/// Seats as a kind of hall has them, set as they leave the factory, but for the cap on speed.
pub(crate) fn seats(kind: &Kind) -> Vec<Settings> {
    let seat = |(index, axes): (usize, &usize)| Settings {
        axes: *axes,
        turntable: kind.turns.then(|| axes - 1),
        mm_s: 240.0,
        mbox: kind.dialect == Dialect::Mbox,
        lies: false,
        shy: false,
        // As its manual has it.
        high_first: kind.dialect == Dialect::Mbox,
        hurry: true,
        cut_ms: 3_000,
        stop_mode: 0,
        report_ms: 0,
        period_ms: kind.period_ms(),
        asks_ms: kind.asks_ms(),
        jitter_ms: 0.0,
        address: ([127, 0, 1, index as u8 + 1], 7_408),
    };
    kind.axes.iter().enumerate().map(seat).collect()
}

impl Hall<'_, '_> {
    pub(crate) fn note(&mut self, what: impl FnOnce() -> String) {
        if let Some(diary) = &mut self.diary {
            diary.push(format!("{:8.3} s: {}", self.ether.ns() as f64 * 1e-9, what()));
        }
    }

    /// Lets so many milliseconds pass.
    pub(crate) fn pass(&mut self, ms: u64) {
        let end = self.ether.ns() + ms * MS;
        while !self.closed && self.step(end) {}
        self.ether.pass_to(end);
    }

    /// Waits until the hall is in one of these states; says whether it came there within so many milliseconds.
    pub(crate) fn comes_to(&mut self, is: impl Fn(State) -> bool, within_ms: u64) -> bool {
        let end = self.ether.ns() + within_ms * MS;
        while !is(self.state) && self.ether.ns() < end {
            self.pass(10);
        }
        is(self.state)
    }

    /// Has the loop run that is due next, where that is before `end`.
    fn step(&mut self, end: u64) -> bool {
        let [ticks, acks, planner] = self.still;
        let tick = self.loops.ticks.grid.next_deadline().as_nanos().max(ticks);
        let ack = self.next_ack.max(acks);
        let plan = self.next_plan.map_or(u64::MAX, |at| at.max(planner));
        let due = tick.min(ack).min(plan).min(self.next_look);
        if due > end {
            return false;
        }
        self.ether.pass_to(due);
        if due == tick {
            self.tick();
        } else if due == plan {
            self.next_plan = None;
            self.loops.plans.serve(&mut Vec::new());
        } else if due == ack {
            let next = self.loops.acks.step(&self.ether, self.drains, &mut self.tell_at);
            self.next_ack = next.as_nanos().max(self.ether.ns() + self.acks_ns);
        } else {
            self.next_look = due + LOOK;
            self.look();
        }
        true
    }

    fn tick(&mut self) {
        self.closed = !self.loops.ticks.step(&mut self.ticked);
        if self.next_plan.is_none() && !self.loops.plans.tasks.is_empty() {
            self.next_plan = Some(self.ether.ns() + self.planner_ns);
        }
        let (now, state) = (self.ether.ns(), self.loops.ticks.conductor.machine().state());
        if state != self.state {
            let cause = self.loops.ticks.conductor.machine().cause();
            self.note(|| format!("the hall: {state:?}, {cause:?}"));
            self.show_over |= self.state.may_send_motion() && !state.may_send_motion();
            self.homing = (state == State::Homing).then_some(Homing::UnderWay { told: 0 });
            self.line.open(state == State::Homing);
            (self.state, self.since) = (state, now);
            self.see_who_asks();
        }
        self.judge_what_is_on(now);
        if matches!(state, State::Paused | State::Stopping) && now > self.since + COMES_TO_REST {
            self.ether.world().asked = false;
        }
    }

    /// What the supervisor does.
    fn look(&mut self) {
        if let Some(recording) = &mut self.recording {
            recording.take();
        }
        while let Ok(news) = self.runtime.news.pop() {
            match news {
                News::Refused(refusal) => {
                    self.open.pop_front();
                    self.note(|| format!("refused: {:?}, {:?}", refusal.asked, refusal.why));
                }
                News::NotLoaded(state) => {
                    self.open.pop_front();
                    self.note(|| format!("not loaded while {state:?}"));
                }
                News::Taken => drop(self.open.pop_front()),
                News::Unplanned(what) => self.note(|| format!("unplanned: {what:?}")),
                News::Entered { .. } | News::Started | News::CalledOff(_) => {}
            }
        }
        self.see_who_asks();
        if std::mem::take(&mut self.show_over) {
            self.start = ShowTime::ZERO;
            self.stage();
        }
        self.see_to_homing();
    }

    fn see_to_homing(&mut self) {
        let now = self.ether.ns();
        let lanes: Vec<usize> = (0..self.kind.axes.len()).filter(|lane| self.takes_part(*lane)).collect();
        // One whose order was lost is as it was before, home or not.
        let is_open = |lane: &&usize| {
            let (seat, before) = (&self.ether.world().lines[**lane].seat, self.homings.get(**lane));
            !seat.homed || before == Some(&seat.homings)
        };
        let open: Vec<usize> = lanes.iter().filter(is_open).copied().collect();
        match self.homing {
            Some(Homing::UnderWay { told: 0 }) => {
                self.homings = self.ether.world().lines.iter().map(|line| line.seat.homings).collect();
                lanes.into_iter().for_each(|lane| self.tell_home(lane));
                self.homing = Some(Homing::UnderWay { told: now });
            }
            Some(Homing::UnderWay { told }) if !open.is_empty() => {
                self.repeat_home(&open, told);
            }
            Some(Homing::UnderWay { .. }) => {
                self.line.open(false);
                for lane in lanes {
                    let _ = self.runtime.orders.push(Order::Homed(lane as u16));
                }
                self.homing = Some(Homing::Settling { since: now });
            }
            Some(Homing::Settling { since }) => self.settle(since),
            None => {}
        }
    }

    /// An order to home may be lost.
    fn repeat_home(&mut self, lanes: &[usize], told: u64) {
        let now = self.ether.ns();
        if now <= told + REPEAT {
            return;
        }
        for lane in lanes {
            if !self.ether.world().lines[*lane].seat.is_moving() {
                self.tell_home(*lane);
            }
        }
        self.homing = Some(Homing::UnderWay { told: now });
    }

    fn settle(&mut self, since: u64) {
        let table = self.runtime.live.table();
        let stale = MonoTime::from_nanos(since + STALE);
        let open = table
            .iter()
            .enumerate()
            .find(|(lane, row)| self.takes_part(*lane) && (row.at < stale || !row.standing.may_move()));
        let event = match open {
            None if !table.is_empty() => Event::Homed,
            Some((lane, _)) if self.ether.ns() > since + SEEN_WITHIN => Event::Trouble(Trouble::Homing(lane)),
            _ => return,
        };
        self.homing = None;
        self.command(Command::Event(event));
    }

    fn tell_home(&mut self, lane: usize) {
        let order: [u8; 18] = [0x55, 0xaa, 0, 0, 0x12, 1, 0, 2, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 1, 0, 0];
        let _ = self.line.send(lane, &order);
    }

    fn takes_part(&self, lane: usize) -> bool {
        self.runtime.desk.mix(lane).on
    }

    /// A hall that rests moves nobody, unless somebody asked for that and has no answer yet.
    fn see_who_asks(&self) {
        if !self.state.may_send_motion() && !self.open.contains(&true) {
            self.ether.world().asked = false;
        }
    }

    fn command(&mut self, command: Command) {
        let moves =
            matches!(command, Command::Request(Transition::Go | Transition::Resume | Transition::Park));
        if self.runtime.commands.push(command).is_ok() {
            self.open.push_back(moves);
        }
    }

    /// Makes the show anew from what is set, and hands it over.
    fn stage(&mut self) {
        if !self.cued {
            return;
        }
        let (timeline, headroom) = &self.book.cues[self.cue];
        let config = &self.book.config;
        let rate = Rate::from_hz(config.show.rate_hz);
        let show = Show { rate, timing: config.show.timing, start: self.start, plays: 1 };
        let mixes: Vec<Mix> = (0..self.kind.axes.len()).map(|lane| self.runtime.desk.mix(lane)).collect();
        match StagedShow::mixed(config, timeline, headroom.clone(), show, &mixes, false) {
            Ok(staged) => self.command(Command::Load(staged.loaded())),
            Err(error) => self.note(|| format!("not staged: {error}")),
        }
        if !std::mem::replace(&mut self.ready, true) {
            self.command(Command::Event(Event::Readiness(Readiness::Ready)));
        }
    }

    /// Somebody loads a cue.
    pub(crate) fn load(&mut self, cue: usize) {
        if self.state.may_send_motion() || self.state == State::Armed {
            return;
        }
        (self.cue, self.cued, self.start) = (cue, true, ShowTime::ZERO);
        self.note(|| format!("load cue {cue}"));
        self.stage();
    }

    /// Somebody asks for something.
    pub(crate) fn ask(&mut self, request: Transition) {
        self.note(|| format!("asks: {request:?}"));
        if matches!(request, Transition::Go | Transition::Resume | Transition::Park) {
            self.wants();
        }
        if request == Transition::Stop {
            self.runtime.desk.stop();
        } else {
            self.command(Command::Request(request));
        }
    }

    /// Somebody wants the seats to move.
    fn wants(&mut self) {
        let (now, world) = (self.ether.ns(), &mut *self.ether.world());
        (world.asked, world.asked_at) = (true, now);
    }

    pub(crate) fn seek(&mut self, ms: i64) {
        let film = ShowTime::from_millis(ms);
        self.note(|| format!("seeks {film}"));
        if matches!(self.state, State::Armed | State::Parked | State::Recovering) {
            self.start = film;
            self.stage();
        } else {
            self.command(Command::Seek(film));
        }
    }

    /// Somebody sets what a lane makes of the cue.
    pub(crate) fn set(&mut self, lane: usize, mix: Mix) {
        self.note(|| format!("seat {} is set {mix:?}", lane + 1));
        self.runtime.desk.set(lane, mix);
        if !self.state.may_send_motion() {
            self.stage();
        }
    }

    pub(crate) fn trim(&mut self, ms: i32) {
        self.note(|| format!("trim {ms} ms"));
        self.runtime.desk.set_trim_ms(ms);
    }

    /// A thread stands still for so many milliseconds. Whoever was asleep for seconds waits for somebody to go on.
    pub(crate) fn still(&mut self, thread: Thread, ms: u64) {
        self.note(|| format!("{thread:?} stands still for {ms} ms"));
        let until = self.ether.ns() + ms * MS;
        let which: &[usize] = match thread {
            Thread::Tick => &[0],
            Thread::Acks => &[1],
            Thread::Planner => &[2],
            Thread::All => &[0, 1, 2],
        };
        which.iter().for_each(|index| self.still[*index] = self.still[*index].max(until));
        if matches!(thread, Thread::Acks | Thread::All) {
            let now = self.ether.ns();
            self.ether.world().lines.iter_mut().for_each(|line| line.seat.untold = (now, until));
        }
        if thread == Thread::All && ms > ASLEEP_MS && matches!(self.state, State::Playing(_)) {
            self.ether.world().asked = false;
        }
    }

    /// Whether a loop stands still, or did a moment ago.
    pub(super) fn stands_still(&self, now: u64) -> bool {
        self.still.iter().any(|until| now < until + 1_000 * MS)
    }

    /// Somebody wants the hall to close.
    pub(crate) fn leave(&mut self) {
        self.note(|| "the hall is to close".to_owned());
        // It parks first.
        if matches!(self.state, State::Playing(_) | State::Paused) {
            self.wants();
        }
        self.runtime.leave.store(true, Ordering::Relaxed);
    }
}

/// What no seat may do, so far.
pub(crate) fn breaches(ether: &Ether) -> Vec<Breach> {
    ether.world().lines.iter().flat_map(|line| line.seat.breaches.clone()).collect()
}
