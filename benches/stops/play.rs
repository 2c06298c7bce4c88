//! One play that is stopped, with all the threads that `kinocue play` has and those of the flood beside them.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use kinocue::harness::belief::Reading;
use kinocue::harness::motion::MAX_AXES;
use kinocue::harness::net::{DrainGrid, Ports};
use kinocue::harness::rt::{
    AckLoop, Conductor, Desk, Live, MailEnds, Places, PlanLoop, Planning, TickLoop, mailboxes,
};
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::sys::realtime;
use kinocue::harness::time::{Clock as _, MonoTime, TickGrid};
use kinocue::harness::{ride, stage};

use super::flood::{self, Flood};
use super::watch::{Seen, Watch};

/// From here to tick 0: time to start the threads.
const RUN_UP: Duration = Duration::from_millis(20);
/// Seats stand so soon after the first decelerating frame: 150 ms from full speed, and some to spare.
const AT_REST_S: f64 = 0.2;
const HOLD_FRAMES: u64 = 3;
const RIDE_S: u32 = 10;

/// What one stop took.
#[derive(Debug)]
pub(crate) struct Stop {
    /// From the request to when the kernel had the first decelerating frame of the first controller.
    pub(crate) first_ms: f64,
    /// The same of the last controller.
    pub(crate) last_ms: f64,
    pub(crate) ticks: u64,
    pub(crate) missed: u64,
    pub(crate) flood: Flood,
    /// How the tick thread was scheduled.
    pub(crate) policy: String,
}

/// Plays, and stops that long after tick 0; none where a frame was so late that the seats held when the request came.
pub(crate) fn stop(rate_hz: f64, to: &[SocketAddrV4], after: Duration) -> Option<Stop> {
    let (staged, watched) = stage(ride(RIDE_S, 0.1, &["air"]), rate_hz, to, false);
    let rate = staged.show.rate;
    let any = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);
    let (sender, receiver) = Ports::open(any, to).expect("loopback has a free port").split();
    let live = Arc::new(Live::new(to.len()));
    let (mail, ends) = mailboxes(to.len(), rate, Arc::clone(&live));
    let MailEnds { sent, ticks, tasks, answers, commands, alarms: _alarms, news: _news } = ends;
    let mut acks = AckLoop::new(receiver, watched, 1, sent, ticks);
    acks.tell(Arc::clone(&live));
    let desk = &staged.desk();
    let (engine, lanes, planner, timeline) = staged.split();
    let mut plans = PlanLoop { planning: Box::new(Planning { planner, timeline }), tasks, answers };
    let (done, never) = (&AtomicBool::new(false), AtomicBool::new(false));
    let policy = realtime::request().policy.to_string();
    let origin = Monotonic.now() + RUN_UP;
    let parked = Reading::at_rest([0.0; MAX_AXES], origin);
    (0..to.len()).filter_map(|lane| live.evidence(lane)).for_each(|evidence| evidence.on_reading(&parked));
    let places = Places::new(&lanes, rate);
    let mut tick_loop = TickLoop {
        clock: &Monotonic,
        grid: TickGrid::new(origin, rate),
        engine,
        conductor: Conductor::of_a_play(origin, false),
        lanes,
        places,
        sink: Watch::new(sender, to.len()),
        mail,
        desk,
        leave: &never,
    };
    thread::scope(|scope| {
        let over = || done.load(Ordering::Acquire);
        scope.spawn(move || acks.run(&Monotonic, DrainGrid::new(origin, rate.period()), over));
        let planning = scope.spawn(move || plans.run(done));
        tick_loop.mail.wakes(planning.thread().clone());
        let floods = flood::begin(scope, commands, desk, done);
        let request = scope.spawn(move || press(desk, origin + after));
        let ended = tick_loop.run();
        done.store(true, Ordering::Release);
        planning.thread().unpark();
        let asked = request.join().expect("it is pressed");
        let flood = floods.into_iter().map(|flood| flood.join().expect("it only pushes")).sum();
        let [first_ms, last_ms] = took(&tick_loop.sink.lanes, asked, rate_hz)?;
        Some(Stop { first_ms, last_ms, ticks: ended.ticks, missed: ended.missed, flood, policy })
    })
}

/// Asks for a stop, and says when. On a thread as urgent as the tick thread, so that it is not held up in between.
fn press(desk: &Desk, at: MonoTime) -> MonoTime {
    let _ = realtime::request();
    Monotonic.sleep_until(at);
    let asked = Monotonic.now();
    desk.stop();
    asked
}

/// How long it took to the first and to the last controller, ms; none where the seats held already. All of them came to
/// rest, or the figures mean nothing.
fn took(lanes: &[Seen], asked: MonoTime, rate_hz: f64) -> Option<[f64; 2]> {
    let mut took = [f64::INFINITY, 0.0_f64];
    for seen in lanes {
        #[expect(clippy::cast_precision_loss, reason = "some hundred frames")]
        let at_rest_s = seen.since.saturating_sub(seen.still) as f64 / rate_hz;
        let unlit = seen.unlit.filter(|unlit| *unlit >= asked)?;
        assert!(at_rest_s <= AT_REST_S && seen.still >= HOLD_FRAMES, "{seen:?}");
        let ms = unlit.since(asked).as_secs_f64() * 1e3;
        took = [took[0].min(ms), took[1].max(ms)];
    }
    Some(took)
}
