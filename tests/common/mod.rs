//! A whole show in virtual time: a clock that jumps from deadline to deadline, a planner that answers between ticks, and
//! a link that keeps every datagram.

#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part")]

use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use kinocue::app::StagedShow;
use kinocue::belief::Reading;
use kinocue::config::{Config, from_to_args};
use kinocue::cue::{self, Source};
use kinocue::engine::{Mix, Show};
use kinocue::fanout::Manner;
use kinocue::limiter::Counts;
use kinocue::motion::{MAX_AXES, Measure, Pose, SeatType, Spacing};
use kinocue::net::Delivery;
use kinocue::rt::{
    Alarm, Answer, Command, Conductor, Desk, Ended, FrameSink, Live, MailEnds, News, Places, PlanLoop,
    Planning, Task, TickLoop, mailboxes,
};
use kinocue::state::Transition;
use kinocue::time::{Clock, MonoTime, Rate, ShowTime, TickGrid};
use kinocue::timeline::Timeline;
use kinocue::wire::{MotionRequest, Timing};
use rtrb::Producer;

/// When tick 0 is due.
pub const ORIGIN: MonoTime = MonoTime::from_nanos(1_000_000_000);

/// Something that happens at a tick.
#[derive(Debug, Clone, Copy)]
pub enum Event {
    /// The tick thread wakes up this much late.
    Late(Duration),
    /// Somebody presses Ctrl-C.
    Leave,
    /// Somebody presses stop.
    Stop,
    /// Somebody asks for something.
    Ask(Transition),
    /// Somebody seeks.
    Seek(ShowTime),
    /// Something is seen of a controller.
    Alarm(Alarm),
    /// A controller takes part again: its seat was read at rest in that pose.
    Found(usize, Pose),
    /// The same where its last frame led it.
    FoundThere(usize),
    /// Somebody sets what a lane makes of the cue.
    Mix(usize, Mix),
    /// Somebody sets the trim.
    Trim(i32),
    /// From here on the planner takes this many ticks to answer.
    SlowPlanner(u32),
    /// The planner finds no move for what it is asked next.
    Refuse,
    /// From here on nobody reads replies, or somebody does again.
    Deaf(bool),
}

/// A show to be played in virtual time.
pub struct Virtual {
    pub cue: String,
    pub to: Vec<String>,
    pub rate_hz: f64,
    pub timing: Timing,
    pub start: ShowTime,
    pub plays: u32,
    pub level: f64,
    /// What happens at the wake-up of that number, counted from 0.
    pub script: Vec<(u64, Event)>,
    /// Wake-ups after which a show that does not end is given up.
    pub at_most: u64,
}

impl Virtual {
    /// One three-axis seat at 100 Hz, relative time, once.
    pub fn new(cue: impl Into<String>) -> Self {
        Self {
            cue: cue.into(),
            to: vec!["127.0.0.1:7408".to_owned()],
            rate_hz: 100.0,
            timing: Timing::Relative,
            start: ShowTime::ZERO,
            plays: 1,
            level: 1.0,
            script: Vec::new(),
            at_most: 1_000_000,
        }
    }

    pub fn at_rate(mut self, hz: f64) -> Self {
        self.rate_hz = hz;
        self
    }

    pub fn with(mut self, wake_up: u64, event: Event) -> Self {
        self.script.push((wake_up, event));
        self
    }

    pub fn timeline(&self) -> Timeline {
        Timeline::new(
            cue::read(Path::new("show.csv"), self.cue.as_bytes(), &Source::Native).expect("the cue is sound"),
        )
    }

    pub fn config(&self) -> Config {
        from_to_args(&self.to, &[], self.timeline().cue().axes()).expect("the addresses are sound")
    }

    /// Plays it to its end.
    pub fn play(&self) -> Played {
        let rate = Rate::from_hz(self.rate_hz);
        let show = Show { rate, timing: self.timing, start: self.start, plays: self.plays };
        let manner = Manner { level: self.level, silent: false };
        let staged = StagedShow::new(&self.config(), self.timeline(), show, manner).expect("there is a join");
        let join = ShowTime::from_nanos(staged.course.settled().as_nanos() - self.start.as_nanos());
        let desk = staged.desk();
        let (engine, lanes, planner, timeline) = staged.split();
        let live = Arc::new(Live::new(lanes.len()));
        (0..lanes.len()).for_each(|lane| read_at_rest(&live, lane, [0.0; MAX_AXES], ORIGIN));
        let (mail, ends) = mailboxes(lanes.len(), rate, Arc::clone(&live));
        let MailEnds { sent: _sent, ticks: _ticks, tasks, answers, commands, alarms, news } = ends;
        let planning = Box::new(Planning { planner, timeline: Arc::clone(&timeline) });
        let plans = PlanLoop { planning, tasks, answers };
        let leave = AtomicBool::new(false);
        let stands = RefCell::new(vec![[0.0; MAX_AXES]; lanes.len()]);
        let hands = Hands {
            desk: &desk,
            leave: &leave,
            commands: RefCell::new(commands),
            alarms: RefCell::new(alarms),
            live: &live,
            stands: &stands,
            deaf: Cell::new(false),
        };
        let clock = Stage::new(plans, hands, &self.script, self.at_most);
        let grid = TickGrid::new(clock.now(), rate);
        let conductor = Conductor::of_a_play(clock.now(), true);
        let sink = Link { now: &clock.now, live: &live, stands: &stands, frames: Vec::new() };
        let places = Places::new(&lanes, rate);
        let mut tick_loop = TickLoop {
            places,
            clock: &clock,
            grid,
            engine,
            conductor,
            lanes,
            sink,
            mail,
            desk: &desk,
            leave: &leave,
        };
        let ended = tick_loop.run();
        let clamps = (0..tick_loop.lanes.len()).map(|lane| *tick_loop.engine.clamps(lane)).collect();
        let frames = tick_loop.sink.frames;
        let mut news = news;
        let news = std::iter::from_fn(|| news.pop().ok()).collect();
        Played { ended, frames, happened: clock.happened.take(), news, clamps, join, timeline, rate }
    }
}

/// What operators have in their hands.
struct Hands<'a> {
    desk: &'a Desk,
    leave: &'a AtomicBool,
    commands: RefCell<Producer<Command>>,
    alarms: RefCell<Producer<Alarm>>,
    live: &'a Live,
    /// Where the last frame of each lane led it.
    stands: &'a RefCell<Vec<Pose>>,
    deaf: Cell<bool>,
}

impl Hands<'_> {
    fn command(&self, command: Command) {
        self.commands.borrow_mut().push(command).expect("there is room");
    }

    /// Reads replies, as an ack thread does between ticks; the next time is to be soon.
    fn hear(&self, now: MonoTime) {
        if !self.deaf.get() {
            self.live.expect_by(now + Duration::from_millis(105));
        }
    }
}

/// Turns the clock by hand, and does in between what other threads do.
struct Stage<'a> {
    now: Cell<MonoTime>,
    beat_at: Cell<MonoTime>,
    wake_ups: Cell<u64>,
    plans: RefCell<PlanLoop>,
    planner_delay: Cell<u32>,
    planner_waits: Cell<u32>,
    planner_refuses: Cell<bool>,
    hands: Hands<'a>,
    happened: RefCell<Vec<(MonoTime, Event)>>,
    script: &'a [(u64, Event)],
    at_most: u64,
}

impl<'a> Stage<'a> {
    fn new(plans: PlanLoop, hands: Hands<'a>, script: &'a [(u64, Event)], at_most: u64) -> Self {
        Self {
            now: Cell::new(ORIGIN),
            beat_at: Cell::default(),
            wake_ups: Cell::new(0),
            plans: RefCell::new(plans),
            planner_delay: Cell::new(0),
            planner_waits: Cell::new(0),
            planner_refuses: Cell::new(false),
            hands,
            happened: RefCell::default(),
            script,
            at_most,
        }
    }

    /// While nothing moves each seat is read four times a second.
    fn beat(&self) {
        if self.now.get().since(self.beat_at.get()) < Duration::from_millis(250)
            || self.hands.live.is_moving()
        {
            return;
        }
        self.beat_at.set(self.now.get());
        for (lane, pose) in self.hands.stands.borrow().iter().enumerate() {
            read_at_rest(self.hands.live, lane, *pose, self.now.get());
        }
    }

    fn serve_planner(&self) {
        let mut plans = self.plans.borrow_mut();
        while self.planner_refuses.get()
            && let Ok(task) = plans.tasks.pop()
        {
            if let Task::Plan(request) = task {
                let answer = Answer::Refused(request.serial, request.scene);
                plans.answers.push(answer).expect("there is room");
                self.planner_refuses.set(false);
            }
        }
        drop(plans);
        if self.plans.borrow().tasks.is_empty() {
            self.planner_waits.set(self.planner_delay.get());
        } else if self.planner_waits.get() > 0 {
            self.planner_waits.set(self.planner_waits.get() - 1);
            return;
        }
        self.plans.borrow_mut().serve(&mut Vec::new());
    }
}

impl Clock for Stage<'_> {
    fn now(&self) -> MonoTime {
        self.now.get()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        let wake_up = self.wake_ups.get();
        assert!(wake_up < self.at_most, "the show does not end");
        self.wake_ups.set(wake_up + 1);
        self.now.set(deadline.max(self.now.get()));
        self.serve_planner();
        self.beat();
        self.hands.hear(self.now.get());
        for (_, event) in self.script.iter().filter(|(at, _)| *at == wake_up) {
            self.happened.borrow_mut().push((self.now.get(), *event));
            match event {
                Event::Late(span) => self.now.set(self.now.get() + *span),
                Event::Leave => self.hands.leave.store(true, Ordering::Relaxed),
                Event::Stop => self.hands.desk.stop(),
                Event::Ask(request) => self.hands.command(Command::Request(*request)),
                Event::Seek(film) => self.hands.command(Command::Seek(*film)),
                Event::Alarm(alarm) => {
                    self.hands.alarms.borrow_mut().push(*alarm).expect("there is room");
                }
                Event::Found(lane, pose) => {
                    self.hands.stands.borrow_mut()[*lane] = *pose;
                    read_at_rest(self.hands.live, *lane, *pose, self.now.get());
                    let found = Alarm::Found(u16::try_from(*lane).expect("few lanes"));
                    self.hands.alarms.borrow_mut().push(found).expect("there is room");
                }
                Event::FoundThere(lane) => {
                    let pose = self.hands.stands.borrow()[*lane];
                    read_at_rest(self.hands.live, *lane, pose, self.now.get());
                    let found = Alarm::Found(u16::try_from(*lane).expect("few lanes"));
                    self.hands.alarms.borrow_mut().push(found).expect("there is room");
                }
                Event::Mix(lane, mix) => self.hands.desk.set(*lane, *mix),
                Event::Trim(ms) => self.hands.desk.set_trim_ms(*ms),
                Event::Deaf(deaf) => self.hands.deaf.set(*deaf),
                Event::Refuse => self.planner_refuses.set(true),
                Event::SlowPlanner(ticks) => {
                    self.planner_delay.set(*ticks);
                    self.planner_waits.set(*ticks);
                }
            }
        }
    }
}

/// The ack thread has read the seat of a lane at rest in that pose.
pub fn read_at_rest(live: &Live, lane: usize, pose: Pose, at: MonoTime) {
    live.evidence(lane).expect("there is such a lane").on_reading(&Reading::at_rest(pose, at));
}

/// A network that loses nothing: every frame is acked before the next tick.
struct Link<'a> {
    now: &'a Cell<MonoTime>,
    live: &'a Live,
    stands: &'a RefCell<Vec<Pose>>,
    frames: Vec<Frame>,
}

impl FrameSink for Link<'_> {
    fn send(&mut self, lane: usize, datagram: &[u8]) -> Delivery {
        let request = MotionRequest::parse(datagram).expect("only frames are sent");
        self.live.evidence(lane).expect("there is such a lane").on_ack(request.frame);
        let stroke = SeatType::bench3(1).stroke_pulses();
        let there = |slot: usize| request.positions.get(slot).map_or(0.0, |at| f64::from(at.0) / stroke);
        self.stands.borrow_mut()[lane] = std::array::from_fn(there);
        self.frames.push(Frame { lane, at: self.now.get(), request, bytes: datagram.to_vec() });
        Delivery::Sent
    }
}

/// A frame as it left.
#[derive(Debug, Clone)]
pub struct Frame {
    pub lane: usize,
    pub at: MonoTime,
    pub request: MotionRequest,
    pub bytes: Vec<u8>,
}

/// A show that was played.
pub struct Played {
    pub ended: Ended,
    pub frames: Vec<Frame>,
    /// The events of the script, and when each came.
    pub happened: Vec<(MonoTime, Event)>,
    /// What the hall made known.
    pub news: Vec<News>,
    /// What the limiter had to do, lane by lane.
    pub clamps: Vec<Counts>,
    /// How long the first join takes.
    pub join: ShowTime,
    pub timeline: Arc<Timeline>,
    pub rate: Rate,
}

/// The worst that a seat was made to do, each over its limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Worst {
    pub velocity: f64,
    pub acceleration: f64,
    pub jerk: f64,
    pub step: f64,
}

impl Worst {
    /// The worse of the two, part by part.
    pub fn max(self, other: Self) -> Self {
        Self {
            velocity: self.velocity.max(other.velocity),
            acceleration: self.acceleration.max(other.acceleration),
            jerk: self.jerk.max(other.jerk),
            step: self.step.max(other.step),
        }
    }
}

impl Played {
    /// The frames of one lane.
    pub fn lane(&self, lane: usize) -> impl Iterator<Item = &Frame> {
        self.frames.iter().filter(move |frame| frame.lane == lane)
    }

    /// The positions of one axis of one lane, frame by frame, mm.
    pub fn positions_mm(&self, lane: usize, axis: usize) -> Vec<f64> {
        let per_pulse = 150.0 / SeatType::bench3(1).stroke_pulses();
        self.lane(lane).map(|frame| f64::from(frame.request.positions[axis].0) * per_pulse).collect()
    }

    /// What the frames make the first lane do from rest in its park pose.
    pub fn worst(&self) -> Worst {
        self.worst_of(0, 0..self.lane(0).count(), |_| 0.0)
    }

    /// What the frames before `end` make the first lane do from rest in its park pose.
    pub fn worst_until(&self, end: usize) -> Worst {
        self.worst_of(0, 0..end, |_| 0.0)
    }

    /// What the frames from `first` to before `end` make the first lane do, if it was at rest in the pose of the first.
    pub fn worst_from_rest(&self, first: usize, end: usize) -> Worst {
        self.worst_of(0, first..end, |mm| mm)
    }

    /// The same of its first axis, if that was at rest `mm` up.
    pub fn worst_from_rest_at(&self, mm: f64, first: usize, end: usize) -> Worst {
        self.worst_of_axis(0, 0, first..end, |_| mm)
    }

    /// What its frames of those numbers make a lane do, if it was at rest in the pose of the first.
    pub fn worst_of_lane(&self, lane: usize, frames: Range<usize>) -> Worst {
        self.worst_of(lane, frames, |mm| mm)
    }

    /// By the measure of what is sent, over the limits of the bench seat; before the first frame the seat rested where
    /// `before` puts it.
    fn worst_of(&self, lane: usize, frames: Range<usize>, before: impl Fn(f64) -> f64) -> Worst {
        let axes = 0..self.frames[0].request.positions.len();
        let worst = axes.map(|axis| self.worst_of_axis(lane, axis, frames.clone(), &before));
        worst.fold(Worst::default(), Worst::max)
    }

    fn worst_of_axis(
        &self,
        lane: usize,
        axis: usize,
        frames: Range<usize>,
        before: impl Fn(f64) -> f64,
    ) -> Worst {
        let sent: Vec<&Frame> = self.lane(lane).collect();
        let mm = self.positions_mm(lane, axis);
        let time = |frame: usize| Duration::from_millis(u64::from(self.time_ms(sent[frame], frame)));
        let lines = frames.clone().map(|frame| {
            let first = frame == frames.start;
            (if first { self.rate.period() } else { time(frame) }, mm[frame])
        });
        worst_of_lines(self.rate, before(mm[frames.start]), lines)
    }

    /// How long a frame gives its seat.
    fn time_ms(&self, frame: &Frame, index: usize) -> u32 {
        match frame.request.timing {
            Timing::Relative => frame.request.time_ms,
            Timing::Absolute => self.rate.time_ms(index as u64),
        }
    }
}

/// What straight lines make an axis of the bench seat do, from rest `before` mm up: each takes that long, and ends that
/// many mm up. By the measure of what is sent at that rate.
pub fn worst_of_lines(rate: Rate, before: f64, lines: impl IntoIterator<Item = (Duration, f64)>) -> Worst {
    let seat = SeatType::bench3(1);
    let step = 4.0 * seat.max_acceleration_mm_s2 * (1.0 / rate.hz()).max(0.005);
    let mut worst = Worst::default();
    let mut measure = Measure::new(Spacing::at_rate(rate.hz()));
    let mut at = ShowTime::ZERO;
    measure.push(at, before);
    for _ in 1..100 {
        at += rate.period();
        measure.push(at, before);
    }
    for (span, mm) in lines {
        at += span;
        let seen = measure.push(at, mm);
        worst.velocity = worst.velocity.max(seen.velocity.value.abs() / seat.max_velocity_mm_s);
        worst.acceleration =
            worst.acceleration.max(seen.acceleration.value.abs() / seat.max_acceleration_mm_s2);
        worst.jerk = worst.jerk.max(seen.jerk.value.abs() / seat.max_jerk_mm_s3);
        worst.step = worst.step.max(seen.step.value.abs() / step);
    }
    worst
}

/// A cue of sines about the middle of the stroke, rows 20 ms apart: `mm` of swing at `hz` on each of `axes` axes.
pub fn swell(axes: u32, seconds: u32, mm: f64, hz: f64) -> String {
    use std::fmt::Write as _;
    let mut text = "time_ms".to_owned();
    (1..=axes).for_each(|axis| write!(text, ",a{axis}").expect("a String takes what is written to it"));
    for row in 0..=50 * seconds {
        let t = f64::from(row) * 0.02;
        write!(text, "\n{}", row * 20).expect("a String takes what is written to it");
        for axis in 0..axes {
            let turn = t * hz + f64::from(axis) / f64::from(axes);
            write!(text, ",{:.6}", 0.5 + mm / 150.0 * (turn * std::f64::consts::TAU).sin())
                .expect("a String takes what is written to it");
        }
    }
    text.push('\n');
    text
}
