//! One hall by chance: a tick loop whose clock jumps, and what everybody else does between two ticks.

use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use kinocue::harness::ORIGIN;
use kinocue::harness::app::staged::chasing;
use kinocue::harness::asked::Chance;
use kinocue::harness::belief::Reading;
use kinocue::harness::engine::Mix;
use kinocue::harness::film::chase::ChaseRules;
use kinocue::harness::film::point::{FilmPoint, FilmState, PublishedPoint};
use kinocue::harness::motion::{MAX_AXES, Pose};
use kinocue::harness::net::Delivery;
use kinocue::harness::rt::{
    Alarm, Answer, Command, Conductor, Desk, FilmLead, FrameSink, Live, MailEnds, NewsIn, Places, PlanLoop,
    Planning, Sent, Task, TickLoop, Ticked, mailboxes,
};
use kinocue::harness::state::{Event, Finding, Latch, LedBefore, Readiness, State, Transition};
use kinocue::harness::time::{Clock, MonoTime, ShowTime, TickGrid};
use kinocue::wire::MotionRequest;
use rtrb::{Consumer, Producer};

use super::Digest;
use super::stage::Stage;

const PULSES: f64 = 300_000.0;

/// What was seen of a hall.
#[derive(Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) frames: Digest,
    pub(crate) words: Digest,
    pub(crate) film: Digest,
    pub(crate) count: u64,
}

/// How a hall is led.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Led {
    /// One show that was let go.
    Play,
    /// Show after show, by a person.
    Hall,
    /// One show, by a film.
    Film,
}

/// Everything but the tick loop.
pub(crate) struct Hall<'a> {
    stage: &'a Stage,
    led: Led,
    /// About how many ticks lie between two things that happen.
    calm: usize,
    chance: RefCell<Chance>,
    now: Cell<MonoTime>,
    tick: Cell<u64>,
    ticks: u64,
    desk: &'a Desk,
    leave: &'a AtomicBool,
    live: &'a Live,
    commands: RefCell<Producer<Command>>,
    alarms: RefCell<Producer<Alarm>>,
    plans: RefCell<PlanLoop>,
    /// Ticks until the planner answers; none where that is not known yet.
    planner_waits: Cell<Option<usize>>,
    sent: RefCell<Consumer<Sent>>,
    news: RefCell<NewsIn>,
    film: Arc<PublishedPoint>,
    shown: Cell<Option<FilmPoint>>,
    /// Where the seats are.
    stands: RefCell<Vec<Pose>>,
    /// A seat that hears nothing, up to that tick.
    unheard: Cell<(usize, u64)>,
    seen: Cell<Seen>,
}

impl Hall<'_> {
    /// What is seen of the hall of that seed.
    pub(crate) fn live(stages: &[Stage], seed: u64) -> Seen {
        let mut chance = Chance::new(seed);
        let stage = &stages[chance.below(stages.len())];
        let led = chance.one_of(&[Led::Play, Led::Play, Led::Hall, Led::Film]);
        let (mut staged, trim_ms) = stage.staged(&mut chance);
        let rules = ChaseRules::until(staged.timeline.duration());
        if led == Led::Film {
            staged.headroom = chasing(staged.headroom, &rules);
        }
        let (desk, leave) = (staged.desk(), AtomicBool::new(false));
        let (mut engine, lanes, planner, timeline) = staged.split();
        engine.begin_trimmed(trim_ms);
        desk.set_trim_ms(trim_ms);
        let live = Arc::new(Live::new(stage.seats));
        let (mail, ends) = mailboxes(stage.seats, stage.rate, Arc::clone(&live));
        let MailEnds { sent, ticks: _reports, tasks, answers, commands, alarms, news } = ends;
        let planning = Box::new(Planning { planner, timeline });
        let hall = Hall {
            stage,
            led,
            calm: chance.one_of(&[4, 12, 12, 40, 40, 200]),
            now: Cell::new(ORIGIN),
            tick: Cell::new(0),
            ticks: ticks(stage.rate.hz(), chance.between(1.0, 7.0)),
            desk: &desk,
            leave: &leave,
            live: &live,
            commands: RefCell::new(commands),
            alarms: RefCell::new(alarms),
            plans: RefCell::new(PlanLoop { planning, tasks, answers }),
            planner_waits: Cell::new(None),
            sent: RefCell::new(sent),
            news: RefCell::new(news),
            film: Arc::default(),
            shown: Cell::new(None),
            stands: RefCell::new(vec![[0.0; MAX_AXES]; stage.seats]),
            unheard: Cell::new((0, 0)),
            seen: Cell::new(Seen { frames: Digest::NEW, words: Digest::NEW, film: Digest::NEW, count: 0 }),
            chance: RefCell::new(chance),
        };
        (0..stage.seats).for_each(|lane| hall.read(lane));
        let conductor = match led {
            Led::Play => Conductor::of_a_play(ORIGIN, true),
            Led::Hall => Conductor::of_a_hall(ORIGIN),
            Led::Film => Conductor::of_a_play(ORIGIN, true).chasing(Some(FilmLead::new(
                Arc::clone(&hall.film),
                rules,
                ORIGIN,
            ))),
        };
        let engine = match led {
            Led::Play => engine,
            Led::Hall => engine.unknown(),
            Led::Film => engine.waiting(),
        };
        let places = Places::new(&lanes, stage.rate);
        let mut tick_loop = TickLoop {
            clock: &hall,
            grid: TickGrid::new(ORIGIN, stage.rate),
            engine,
            conductor,
            places,
            lanes,
            sink: Link { hall: &hall },
            mail,
            desk: &desk,
            leave: &leave,
        };
        let mut ticked = Ticked::default();
        while hall.tick.get() < hall.ticks && tick_loop.step(&mut ticked) {}
        let ending = format!("{:?}", tick_loop.conductor.ending(&tick_loop.engine));
        hall.word(&ending);
        hall.hear();
        hall.seen.get()
    }

    fn word(&self, text: &str) {
        let mut seen = self.seen.get();
        seen.words.add(&self.tick.get().to_le_bytes());
        seen.words.add(text.as_bytes());
        self.seen.set(seen);
    }

    /// Hears what was made known, frames apart.
    fn hear(&self) {
        while let Ok(news) = self.news.borrow_mut().pop() {
            self.word(&format!("{news:?}"));
        }
        let told = std::iter::from_fn(|| self.sent.borrow_mut().pop().ok());
        let told = told.filter(|sent| !matches!(sent, Sent::Posted { .. }));
        // Of several lanes in one tick it does not matter which comes first.
        let mut told: Vec<String> = told.map(|sent| format!("{sent:?}")).collect();
        told.sort_unstable();
        told.iter().for_each(|told| self.word(told));
    }

    /// The ack thread reads a seat at rest.
    fn read(&self, lane: usize) {
        let reading = Reading::at_rest(self.stands.borrow()[lane], self.now.get());
        self.live.evidence(lane).expect("there is such a lane").on_reading(&reading);
    }

    fn command(&self, command: Command) {
        // A flood of them is refused.
        let _ = self.commands.borrow_mut().push(command);
    }

    fn ask(&self, request: Transition) {
        self.command(Command::Request(request));
    }

    fn alarm(&self, alarm: Alarm) {
        let _ = self.alarms.borrow_mut().push(alarm);
    }

    fn serve_planner(&self) {
        let mut plans = self.plans.borrow_mut();
        while let Ok(task) = plans.tasks.peek() {
            if matches!(task, Task::Plan(_)) && self.planner_is_busy() {
                return;
            }
            let is_refused = matches!(task, Task::Plan(_)) && self.chance.borrow_mut().once_in(25);
            match plans.tasks.pop() {
                Ok(Task::Plan(request)) if is_refused => {
                    let _ = plans.answers.push(Answer::Refused(request.serial, request.scene));
                }
                Ok(Task::Plan(request)) => plans.plan(request, &mut Vec::new()),
                Ok(Task::Load(planning)) => plans.planning = planning,
                Ok(Task::Free(_) | Task::Retire(_)) | Err(_) => {}
            }
        }
    }

    /// Whether what it was asked first has to wait for another tick.
    fn planner_is_busy(&self) -> bool {
        let mut chance = self.chance.borrow_mut();
        let waits =
            self.planner_waits.get().unwrap_or_else(|| if chance.once_in(3) { chance.below(12) } else { 0 });
        self.planner_waits.set(waits.checked_sub(1));
        waits > 0
    }

    /// Whoever leads a hall brings it to where a show runs, as soon as it occurs to them.
    fn lead(&self) {
        if self.chance.borrow_mut().below(self.calm.min(12)) > 1 {
            return;
        }
        match self.live.state() {
            State::Boot => {
                let found = Finding { homed: true, at_park: true, before: LedBefore::Ended };
                self.command(Command::Event(Event::Identified(found)));
                self.command(Command::Event(Event::Readiness(Readiness::Ready)));
                (0..self.stage.seats).for_each(|lane| self.find(lane));
                self.load();
            }
            State::Stopped | State::Fault => {
                self.command(Command::Event(Event::AllReleased));
                self.command(Command::Event(Event::Latched(Latch::Free)));
                self.ask(Transition::Clear);
            }
            State::Recovering => {
                self.command(Command::Event(Event::PositionsRead));
                self.ask(Transition::Park);
            }
            State::Parked if self.chance.borrow_mut().once_in(2) => self.load(),
            State::Parked => self.ask(Transition::Arm),
            State::Armed => self.ask(Transition::Go),
            State::Homing => self.command(Command::Event(Event::Homed)),
            State::Paused => self.ask(Transition::Resume),
            _ => {}
        }
    }

    fn load(&self) {
        let (staged, trim_ms) = self.stage.staged(&mut self.chance.borrow_mut());
        let mut loaded = staged.loaded();
        loaded.engine.begin_trimmed(trim_ms);
        self.desk.set_trim_ms(trim_ms);
        self.command(Command::Load(loaded));
    }

    fn find(&self, lane: usize) {
        self.read(lane);
        self.alarm(Alarm::Found(u16::try_from(lane).expect("few seats")));
    }

    fn happen(&self) {
        let mut chance = self.chance.borrow_mut();
        let lane = chance.below(self.stage.seats);
        let number = u16::try_from(lane).expect("few seats");
        match chance.below(20) {
            0..3 => {
                let ms = chance.one_of(&[5.0, 45.0, 60.0, 300.0, 1_500.0, 3_000.0]);
                self.now.set(self.now.get() + Duration::from_secs_f64(1e-3 * chance.between(0.0, ms)));
                drop(chance);
                (0..self.stage.seats).for_each(|lane| self.read(lane));
            }
            3 => self.ask(Transition::Pause),
            4 | 5 => self.ask(Transition::Resume),
            6 => {
                let request = chance.one_of(&Transition::ALL);
                self.ask(request);
            }
            7 if chance.once_in(2) => self.desk.stop(),
            7 | 8 => {
                if chance.once_in(3) {
                    self.ask(Transition::Park);
                }
            }
            9 | 10 => self.command(Command::Seek(ShowTime::from_secs_f64(chance.between(-0.5, 3.5)))),
            11 | 12 => {
                let ms = chance.one_of(&[-600, -60, -20, -5, 0, 1, 10, 30, 120, 600]);
                self.desk.set_trim_ms(ms);
            }
            13..16 => {
                let motion = chance.one_of(&[1.0, 1.0, 0.999, 0.8, 0.5, 0.0]);
                let (on, vibration) = (!chance.once_in(3), chance.between(0.0, 1.0));
                self.desk.set(lane, Mix { motion, vibration, on, ..Mix::FULL });
            }
            16 => self.alarm(if chance.once_in(2) { Alarm::Leave(number) } else { Alarm::Cut(number) }),
            17 => {
                if chance.once_in(2) {
                    self.stands.borrow_mut()[lane] = std::array::from_fn(|_| chance.between(0.0, 0.9));
                }
                drop(chance);
                self.find(lane);
            }
            18 => self.unheard.set((lane, self.tick.get() + chance.one_of(&[2, 5, 30]))),
            _ => {
                let event = chance.one_of(&[
                    Event::EmergencyStop(0),
                    Event::AllReleased,
                    Event::Latched(Latch::Free),
                    Event::Readiness(Readiness::Ready),
                    Event::Homed,
                    Event::PositionsRead,
                ]);
                self.alarm(Alarm::Event(event));
            }
        }
    }

    /// Whoever reads the film publishes where it is.
    fn show(&self) {
        let (now, mut chance) = (self.now.get(), self.chance.borrow_mut());
        let before = self.shown.get();
        if before.is_none() || chance.below(self.calm * 3) == 0 {
            let media = before.map_or(ShowTime::ZERO, |point| point.media_at(now));
            let jump = chance.one_of(&[0.0, 0.0, 0.005, -0.02, 0.03, 0.5, -0.7, -2.0]);
            let state = chance.one_of(&[
                FilmState::Locked,
                FilmState::Locked,
                FilmState::Locked,
                FilmState::Freewheeling,
                FilmState::Stopped,
                FilmState::Lost,
                FilmState::Jumped,
            ]);
            let media = ShowTime::from_secs_f64(media.as_secs_f64() + jump);
            let (rate, epoch) =
                (chance.one_of(&[1.0, 1.0, 0.99, 1.001]), before.map_or(0, |point| point.epoch + 1));
            self.shown.set(Some(FilmPoint { at: now, media, rate, epoch, state }));
        }
        let Some(point) = self.shown.get() else { return };
        self.film.publish(&FilmPoint { at: now, media: point.media_at(now), ..point });
    }
}

impl Clock for Hall<'_> {
    fn now(&self) -> MonoTime {
        self.now.get()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        self.now.set(deadline.max(self.now.get()));
        let tick = self.tick.replace(self.tick.get() + 1);
        self.hear();
        self.serve_planner();
        let beat = ticks(self.stage.rate.hz(), 0.25);
        if tick.is_multiple_of(beat) && !self.live.is_moving() {
            (0..self.stage.seats).for_each(|lane| self.read(lane));
        }
        self.live.expect_by(self.now.get() + Duration::from_millis(105));
        self.lead();
        if self.led == Led::Film {
            self.show();
        }
        let happens = self.chance.borrow_mut().once_in(self.calm);
        if happens {
            self.happen();
        }
        if tick == self.ticks * 4 / 5 && self.led != Led::Hall && self.chance.borrow_mut().once_in(2) {
            self.leave.store(true, Ordering::Relaxed);
        }
        let mut seen = self.seen.get();
        seen.film.add(&self.live.show().as_nanos().to_le_bytes());
        self.seen.set(seen);
    }
}

/// A network that loses what goes to a seat that hears nothing; each other frame is acked at once.
struct Link<'a> {
    hall: &'a Hall<'a>,
}

impl FrameSink for Link<'_> {
    fn send(&mut self, lane: usize, datagram: &[u8], _at: MonoTime) -> Delivery {
        let Hall { tick, live, stands, seen, unheard, .. } = self.hall;
        let mut now = seen.get();
        now.frames.add(&tick.get().to_le_bytes());
        now.frames.add(&[u8::try_from(lane).expect("few seats")]);
        now.frames.add(datagram);
        now.count += 1;
        seen.set(now);
        if unheard.get().0 == lane && tick.get() < unheard.get().1 {
            return Delivery::Sent;
        }
        let request = MotionRequest::parse(datagram).expect("only frames are sent");
        live.evidence(lane).expect("there is such a lane").on_ack(request.frame);
        let there = |slot: usize| request.positions.get(slot).map_or(0.0, |at| f64::from(at.0) / PULSES);
        stands.borrow_mut()[lane] = std::array::from_fn(there);
        Delivery::Sent
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand ticks")]
fn ticks(hz: f64, seconds: f64) -> u64 {
    (hz * seconds) as u64
}
