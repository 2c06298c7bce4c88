//! Long runs in virtual time: nothing drifts and nothing grows, and every count goes right past its end.

use std::cell::{Cell, RefCell};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use kinocue::cue::{self, Source};
use kinocue::harness::app::StagedShow;
use kinocue::harness::belief::Reading;
use kinocue::harness::config::from_to_args;
use kinocue::harness::drive::{Lane, Manner};
use kinocue::harness::engine::{Ending, Show};
use kinocue::harness::motion::MAX_AXES;
use kinocue::harness::net::Delivery;
use kinocue::harness::rt::{
    Conductor, Ended, FrameSink, Live, MailEnds, Places, PlanLoop, Planning, Sent, Task, TickLoop,
    TickReport, mailboxes,
};
use kinocue::harness::time::{Clock, MonoTime, Rate, ShowTime, TickGrid};
use kinocue::harness::timeline::Timeline;
use kinocue::harness::tracker::Tracker;
use kinocue::wire::{FrameNo, MotionRequest, ReplyCode, Timing};
use rtrb::Consumer;

/// When tick 0 is due: the machine has been up for ten years.
const ORIGIN: MonoTime = MonoTime::from_nanos(315_360_000_000_000_000);
/// A cue that begins and ends at rest in the park pose, and nods once.
fn nod(seconds: u64) -> Timeline {
    let [rise, top, fall, end] = [1, 2, 3, 4].map(|quarter| quarter * seconds * 250);
    let text = format!("time_ms,a1\n0,0\n{rise},0\n{top},0.02\n{fall},0\n{end},0\n");
    Timeline::new(
        cue::read(Path::new("nod.csv"), text.as_bytes(), &Source::Native).expect("it is well formed"),
    )
}

/// Ticks between two looks at the mailboxes.
const LOOK: u64 = 50;
/// Courses that may be out at a time: one followed, one to come, one on its way back.
const COURSES: u64 = 3;

/// One lane in endless loops.
struct Run {
    rate_hz: u32,
    timing: Timing,
    first: FrameNo,
    /// Seconds that the cue lasts.
    lap_s: u64,
    /// The tick before which somebody stops the show.
    ticks: u64,
}

impl Run {
    fn play(&self) -> Left {
        let timeline = nod(self.lap_s);
        let config = from_to_args(&["127.0.0.1:7408".to_owned()], &[], 1).expect("the address is sound");
        let rate = Rate::from_hz(f64::from(self.rate_hz));
        let show = Show { rate, timing: self.timing, start: ShowTime::ZERO, plays: 0 };
        let staged = StagedShow::new(&config, timeline, show, Manner { level: 1.0, silent: false })
            .expect("there is a join");
        let desk = staged.desk();
        let (engine, lanes, planner, timeline) = staged.split();
        let lanes: Vec<Lane> = lanes.into_iter().map(|lane| lane.starting_at(self.first)).collect();
        let live = Arc::new(Live::new(1));
        let evidence = || live.evidence(0).expect("there is one lane");
        evidence().on_reading(&Reading::at_rest([0.0; MAX_AXES], ORIGIN));
        let places = Places::new(&lanes, rate);
        let (mail, MailEnds { sent, ticks, tasks, answers, .. }) = mailboxes(1, rate, Arc::clone(&live));
        let plans = PlanLoop { planning: Box::new(Planning { planner, timeline }), tasks, answers };
        let stop = AtomicBool::new(false);
        let books =
            Books { sent, ticks, live: Arc::clone(&live), tracker: Tracker::starting_at(&[self.first], 1) };
        let clock = Jumps {
            run: self,
            wake_ups: Cell::new(0),
            now: Cell::new(ORIGIN),
            live: Arc::clone(&live),
            shown: Cell::default(),
            laps: Cell::new(0),
            given: Cell::new(1),
            returned: Cell::new(0),
            plans: RefCell::new(plans),
            books: RefCell::new(books),
            stop: &stop,
        };
        let sink = Link { next: self.first, timing: self.timing, sum_ms: 0, bridges: 0 };
        let conductor = Conductor::of_a_play(ORIGIN, false);
        let grid = TickGrid::new(ORIGIN, rate);
        let mut tick_loop = TickLoop {
            clock: &clock,
            grid,
            engine,
            conductor,
            lanes,
            places,
            sink,
            mail,
            desk: &desk,
            leave: &stop,
        };
        let ended = tick_loop.run();
        let (bridges, last) = (tick_loop.sink.bridges, tick_loop.lanes[0].last_frame());
        let laps = clock.laps.get();
        let mut books = clock.books.into_inner();
        books.look();
        Left { ended, tracker: books.tracker, last, bridges, laps }
    }
}

/// What a run left.
struct Left {
    ended: Ended,
    tracker: Tracker,
    last: FrameNo,
    /// Frames with a relative Time in a show in absolute time.
    bridges: u32,
    laps: u64,
}

impl Left {
    #[track_caller]
    fn assert_sound(&self, run: &Run) {
        assert_eq!((self.ended.missed, self.ended.unposted, self.ended.ending), (0, 0, Ending::Stopped));
        assert!(self.ended.ticks >= run.ticks, "{:?}", self.ended);
        let counts = self.tracker.counts(0);
        assert_eq!((counts.sent, counts.acked), (self.ended.ticks, self.ended.ticks), "{counts:?}");
        assert_eq!((counts.lost, counts.stray, counts.in_flight()), (0, 0, 0), "{counts:?}");
        let frames = u32::try_from(self.ended.ticks % (1 << 32)).expect("less than the divisor");
        assert_eq!(self.last, FrameNo(run.first.0.wrapping_add(frames).wrapping_sub(1)));
        assert!(!self.tracker.lost_at_end(0));
        // Each lap takes the time of the cue.
        let laps = run.ticks / u64::from(run.rate_hz) / run.lap_s;
        assert!(self.laps.abs_diff(laps) <= 1, "{} laps, not {laps}", self.laps);
    }
}

/// The ack thread, whose controller answers at once.
struct Books {
    sent: Consumer<Sent>,
    ticks: Consumer<TickReport>,
    live: Arc<Live>,
    tracker: Tracker,
}

impl Books {
    fn look(&mut self) {
        while let Ok(sent) = self.sent.pop() {
            let Sent::Posted { frame, asked, at, .. } = sent else { panic!("nothing fails: {sent:?}") };
            self.tracker.on_sent(0, frame, asked, at);
            self.tracker.on_reply(0, frame, ReplyCode::Running, at);
            self.live.evidence(0).expect("there is one lane").on_ack(frame);
            self.tracker.expire(at);
        }
        while let Ok(report) = self.ticks.pop() {
            assert_eq!(report.late_ns, 0, "a tick left its place on the grid");
        }
    }
}

/// Time that jumps from deadline to deadline, does in between what other threads do, and counts what might grow.
struct Jumps<'a> {
    run: &'a Run,
    wake_ups: Cell<u64>,
    now: Cell<MonoTime>,
    live: Arc<Live>,
    shown: Cell<ShowTime>,
    laps: Cell<u64>,
    given: Cell<u64>,
    returned: Cell<u64>,
    plans: RefCell<PlanLoop>,
    books: RefCell<Books>,
    stop: &'a AtomicBool,
}

impl Jumps<'_> {
    fn serve_planner(&self) {
        let mut plans = self.plans.borrow_mut();
        let waiting = plans.tasks.slots();
        let tasks = plans.tasks.read_chunk(waiting).expect("so many wait");
        let (first, second) = tasks.as_slices();
        let count = |is: fn(&Task) -> bool| first.iter().chain(second).filter(|task| is(task)).count() as u64;
        let asked = count(|task| matches!(task, Task::Plan(_)));
        let back = count(|task| matches!(task, Task::Retire(_)));
        if asked + back == 0 {
            return;
        }
        assert!(asked <= 1, "one request at a time");
        self.given.set(self.given.get() + asked);
        self.returned.set(self.returned.get() + back);
        assert!(self.given.get() - self.returned.get() <= COURSES, "courses stay out");
        let mut refusals = Vec::new();
        plans.serve(&mut refusals);
        assert!(refusals.is_empty(), "{refusals:?}");
    }
}

impl Clock for Jumps<'_> {
    fn now(&self) -> MonoTime {
        self.now.get()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        let tick = self.wake_ups.replace(self.wake_ups.get() + 1);
        let due = ORIGIN + Duration::from_nanos(tick * 1_000_000_000 / u64::from(self.run.rate_hz));
        assert_eq!(deadline, due, "tick {tick} left the grid");
        self.now.set(deadline);
        self.serve_planner();
        if tick.is_multiple_of(LOOK) {
            self.books.borrow_mut().look();
        }
        let show = self.live.show();
        self.laps.set(self.laps.get() + u64::from(show < self.shown.replace(show) && tick <= self.run.ticks));
        if tick == self.run.ticks {
            self.stop.store(true, Ordering::Relaxed);
        }
        let way_home = 10 * u64::from(self.run.rate_hz);
        assert!(tick < self.run.ticks + way_home, "the show does not end");
    }
}

/// The controller, which knows what number and what Time comes next.
struct Link {
    next: FrameNo,
    timing: Timing,
    sum_ms: u32,
    bridges: u32,
}

impl FrameSink for Link {
    fn send(&mut self, _lane: usize, datagram: &[u8], _at: MonoTime) -> Delivery {
        let frame = MotionRequest::parse(datagram).expect("only frames are sent");
        assert_eq!(frame.frame, self.next, "numbers follow each other");
        self.next = frame.frame.next();
        match frame.timing {
            Timing::Absolute => {
                assert!(frame.time_ms > self.sum_ms, "{} ms after {}", frame.time_ms, self.sum_ms);
                self.sum_ms = frame.time_ms;
            }
            Timing::Relative => {
                self.bridges += u32::from(self.timing == Timing::Absolute);
                self.sum_ms = 0;
            }
        }
        Delivery::Sent
    }
}

#[test]
fn at_a_thousand_ticks_a_second_nothing_drifts_and_nothing_grows() {
    // Two hours where the tests are optimised, a sixth of that where they are not, so that the suite stays quick.
    let ticks = if cfg!(debug_assertions) { 1_200_000 } else { 7_200_000 };
    let run = Run { rate_hz: 1_000, lap_s: 2, timing: Timing::Relative, first: FrameNo::FIRST, ticks };
    run.play().assert_sound(&run);
}

#[test]
fn frame_numbers_go_round_in_the_middle_of_a_ride() {
    let first = FrameNo(u32::MAX - 3_000);
    let run = Run { rate_hz: 1_000, lap_s: 2, timing: Timing::Relative, first, ticks: 10_000 };
    let left = run.play();
    left.assert_sound(&run);
    assert!(left.last.0 < 10_000, "{}", left.last);
}

#[test]
#[cfg_attr(debug_assertions, ignore = "takes ten seconds where it is not optimised")]
fn the_sum_of_milliseconds_goes_on_after_fifty_days() {
    let ticks = u64::from(u32::MAX) / 1_000 + 1_000;
    let run = Run { rate_hz: 1, lap_s: 1_000, timing: Timing::Absolute, first: FrameNo::FIRST, ticks };
    let left = run.play();
    left.assert_sound(&run);
    assert_eq!(left.bridges, 2, "where the sum is full, and where the show closes");
}
