//! A whole show in virtual time: a clock that jumps from deadline to deadline, a planner that answers between ticks, and
//! a link that keeps every datagram.

use std::cell::{Cell, RefCell};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rtrb::Producer;

use super::shown::{Showing, ShownFilm};
use super::{Frame, Played};
use crate::app::StagedShow;
use crate::app::staged::chasing;
use crate::belief::Reading;
use crate::config::{Config, from_to_args};
use crate::cue::{self, Source};
use crate::drive::{Manner, lanes};
#[cfg(test)]
use crate::engine::Engine;
use crate::engine::{Headroom, Mix, Show};
use crate::film::chase::ChaseRules;
use crate::film::point::{FilmPoint, FilmState, PublishedPoint};
use crate::motion::{AxisGeometry, MAX_AXES, Pose, Window};
use crate::net::Delivery;
use crate::record::TickHead;
use crate::rt::{
    Alarm, Answer, Broadcast, Command, Conductor, Desk, FilmLead, FrameSink, Live, MailEnds, Places,
    PlanLoop, Planning, Task, TickLoop, mailboxes,
};
use crate::state::Transition;
use crate::time::{Clock, MonoTime, Rate, ShowTime, TickGrid};
use crate::timeline::Timeline;
use crate::wire::{MotionRequest, Timing};

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
    /// What is loaded is to start with its film at its beginning at that instant.
    StartAt(MonoTime),
    /// It is not.
    CallOff,
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
    /// From here on the film that is chased is said to be there, at that pace, and in that state.
    Film(ShowTime, f64, FilmState),
}

/// A show to be played in virtual time.
pub struct Virtual {
    pub cue: String,
    pub to: Vec<String>,
    /// How long before it executes them each controller is sent its poses; 0 where nothing is said.
    pub leads: Vec<Duration>,
    pub rate_hz: f64,
    pub timing: Timing,
    pub start: ShowTime,
    pub plays: u32,
    pub level: f64,
    /// The level that its cue was proved at.
    pub proved: f64,
    /// True if it chases a film, of which nobody has heard before the first [`Event::Film`].
    pub chases: bool,
    /// True if the hall is armed, and starts by what it is asked; else it goes at once.
    pub armed: bool,
    /// True if one datagram may go to all of its seats.
    pub together: bool,
    /// Whoever tells of it, where it is not the script.
    pub film: Option<ShownFilm>,
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
            leads: Vec::new(),
            rate_hz: 100.0,
            timing: Timing::Relative,
            start: ShowTime::ZERO,
            plays: 1,
            level: 1.0,
            proved: 1.0,
            chases: false,
            armed: false,
            together: false,
            film: None,
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

    fn stage(&self, show: Show) -> StagedShow {
        let timeline = Arc::new(self.timeline());
        let mut lanes = lanes(&self.config(), &timeline, Manner { level: self.proved, silent: false });
        for (lane, lead) in lanes.iter_mut().zip(&self.leads) {
            lane.window = lane.window.clone().led_ahead(*lead);
        }
        let windows: Vec<Window> = lanes.iter().map(|lane| lane.window.clone()).collect();
        let mut headroom = Headroom::measure(&windows, &timeline, show.rate);
        if self.chases {
            headroom = chasing(headroom, &ChaseRules::until(timeline.duration()));
        }
        let level = Mix { motion: self.level, vibration: self.level, ..Mix::FULL };
        let mixes = vec![level; lanes.len()];
        StagedShow::of_lanes(lanes, &timeline, headroom, show, &mixes).expect("there is a join")
    }

    /// Its engine before the first tick.
    #[cfg(test)]
    pub(crate) fn engine(&self) -> Engine {
        let rate = Rate::from_hz(self.rate_hz);
        self.stage(Show { rate, timing: self.timing, start: self.start, plays: self.plays }).split().0
    }

    /// Plays it to its end.
    pub fn play(&self) -> Played {
        let rate = Rate::from_hz(self.rate_hz);
        let show = Show { rate, timing: self.timing, start: self.start, plays: self.plays };
        let staged = self.stage(show);
        let join = ShowTime::from_nanos(staged.course.settled().as_nanos() - staged.show.start.as_nanos());
        let desk = staged.desk();
        let (mut engine, lanes, planner, timeline) = staged.split();
        if self.chases || self.armed {
            engine = engine.waiting();
        }
        let broadcast = self.together.then(|| Broadcast::permitted(self.config())).flatten();
        let live = Arc::new(Live::new(lanes.len()).with_broadcast(broadcast));
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
            deaf: Cell::default(),
            film: Arc::default(),
            shown: Cell::default(),
            showing: RefCell::new(self.film.as_ref().map(Showing::new)),
        };
        let rules = ChaseRules::until(timeline.duration());
        let film = self.chases.then(|| FilmLead::new(Arc::clone(&hands.film), rules, ORIGIN));
        let clock = Stage::new(plans, hands, &self.script, self.at_most);
        let grid = TickGrid::new(clock.now(), rate);
        let conductor = if self.armed {
            Conductor::of_an_armed_hall(clock.now())
        } else {
            Conductor::of_a_play(clock.now(), true).chasing(film)
        };
        let sink =
            Link { now: &clock.now, live: &live, stands: &stands, frames: Vec::new(), late_ns: Vec::new() };
        let (places, clock) = (Places::new(&lanes, rate), &clock);
        let (desk, leave) = (&desk, &leave);
        let mut run = TickLoop { places, clock, grid, engine, conductor, lanes, sink, mail, desk, leave };
        let ended = run.run();
        let clamps = (0..run.lanes.len()).map(|lane| *run.engine.lane(lane).clamps()).collect();
        let Link { frames, late_ns, .. } = run.sink;
        let mut news = news;
        let news = std::iter::from_fn(|| news.pop().ok()).collect();
        Played { ended, frames, late_ns, happened: clock.happened.take(), news, clamps, join, timeline, rate }
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
    film: Arc<PublishedPoint>,
    /// Where the film was said to be last.
    shown: Cell<Option<FilmPoint>>,
    /// Whoever reads the film from a source.
    showing: RefCell<Option<Showing>>,
}

impl Hands<'_> {
    /// Whoever reads the film publishes where it is.
    fn show(&self, now: MonoTime) {
        if let Some(showing) = &mut *self.showing.borrow_mut() {
            showing.hear(now, &self.film);
        }
        if let Some(point) = self.shown.get() {
            self.film.publish(&FilmPoint { at: now, media: point.media_at(now), ..point });
        }
    }

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
        self.read_all();
    }

    fn read_all(&self) {
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

    /// Lets an event of the script happen.
    fn happens(&self, event: &Event) {
        match event {
            Event::Late(span) => {
                self.now.set(self.now.get() + *span);
                self.read_all(); // whoever was asleep wants to know
            }
            Event::Leave => self.hands.leave.store(true, Ordering::Relaxed),
            Event::Stop => self.hands.desk.stop(),
            Event::Ask(request) => self.hands.command(Command::Request(*request)),
            Event::StartAt(film_zero) => self.hands.command(Command::StartAt(*film_zero)),
            Event::CallOff => self.hands.command(Command::CallOff),
            Event::Seek(film) => self.hands.command(Command::Seek(*film)),
            Event::Alarm(alarm) => {
                self.hands.alarms.borrow_mut().push(*alarm).expect("there is room");
            }
            Event::Found(lane, pose) => self.is_found(*lane, *pose),
            Event::FoundThere(lane) => {
                let pose = self.hands.stands.borrow()[*lane];
                self.is_found(*lane, pose);
            }
            Event::Mix(lane, mix) => self.hands.desk.set(*lane, *mix),
            Event::Trim(ms) => self.hands.desk.set_trim_ms(*ms),
            Event::Film(media, rate, state) => {
                let epoch = self.hands.shown.get().map_or(0, |point| point.epoch + 1);
                let point =
                    FilmPoint { at: self.now.get(), media: *media, rate: *rate, epoch, state: *state };
                self.hands.shown.set(Some(point));
                self.hands.show(self.now.get());
            }
            Event::Deaf(deaf) => self.hands.deaf.set(*deaf),
            Event::Refuse => self.planner_refuses.set(true),
            Event::SlowPlanner(ticks) => {
                self.planner_delay.set(*ticks);
                self.planner_waits.set(*ticks);
            }
        }
    }

    /// A seat was read at rest in that pose, and takes part again.
    fn is_found(&self, lane: usize, pose: Pose) {
        self.hands.stands.borrow_mut()[lane] = pose;
        read_at_rest(self.hands.live, lane, pose, self.now.get());
        let found = Alarm::Found(u16::try_from(lane).expect("few lanes"));
        self.hands.alarms.borrow_mut().push(found).expect("there is room");
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
        self.hands.show(self.now.get());
        for (_, event) in self.script.iter().filter(|(at, _)| *at == wake_up) {
            self.happened.borrow_mut().push((self.now.get(), *event));
            self.happens(event);
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
    late_ns: Vec<u64>,
}

impl FrameSink for Link<'_> {
    fn send_to_all(&mut self, datagram: &[u8]) -> Delivery {
        let lanes = self.stands.borrow().len();
        for lane in 0..lanes {
            self.send(lane, datagram, self.now.get());
        }
        Delivery::Sent
    }

    fn send(&mut self, lane: usize, datagram: &[u8], _at: MonoTime) -> Delivery {
        let request = MotionRequest::parse(datagram).expect("only frames are sent");
        self.live.evidence(lane).expect("there is such a lane").on_ack(request.frame);
        let stroke = AxisGeometry::BENCH.stroke_pulses();
        let there = |slot: usize| request.positions.get(slot).map_or(0.0, |at| f64::from(at.0) / stroke);
        self.stands.borrow_mut()[lane] = std::array::from_fn(there);
        self.frames.push(Frame { lane, at: self.now.get(), request, bytes: datagram.to_vec() });
        Delivery::Sent
    }

    fn tick_over(&mut self, head: &TickHead) {
        self.late_ns.push(head.late_ns);
    }
}
