//! The tick thread allocates and frees nothing: the real loop over real sockets, ten thousand ticks in virtual time with
//! acks arriving, from the join through two laps, missed ticks and a stall into park, with and without a spin before each
//! tick, under an allocator that counts each thread's calls.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use kinocue::app::Staged;
use kinocue::config::from_to_args;
use kinocue::cue::{Source, read};
use kinocue::engine::{Ending, Rate, Show, TickGrid};
use kinocue::fanout::{Lane, Manner};
use kinocue::net::{DrainGrid, Ports};
use kinocue::observe::Watched;
use kinocue::rt::{Accounts, AckLoop, Ended, Live, MailEnds, PlanLoop, Spinning, TickLoop, mailboxes};
use kinocue::sys::clock::Monotonic;
use kinocue::time::{Clock, MonoTime, ShowTime};
use kinocue::timeline::Timeline;
use kinocue::wire::{MAX_LEN, MotionReply, MotionRequest, ReplyCode, Timing};

const PERIOD: Duration = Duration::from_millis(1);
/// The tick at which somebody stops the show.
const STOP_AT: u64 = 10_000;
/// Ticks whose replies may be under way; the least receive buffer that a system has by default holds them.
const UNDER_WAY: u64 = 64;
const CONTROLLERS: usize = 2;
/// Ticks before which the tick thread sleeps too long, and for how many periods: a lag that is slewed away, and one
/// after which the lanes hold and join again.
const OVERSLEPT: [(u64, u32); 2] = [(3_000, 3), (5_000, 80)];

/// Counts what each thread asks of it.
struct Counting;

thread_local! {
    static CALLS: Cell<Calls> = const { Cell::new(Calls { allocations: 0, frees: 0 }) };
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Calls {
    allocations: u64,
    frees: u64,
}

impl Calls {
    /// Those of the calling thread so far.
    fn so_far() -> Self {
        CALLS.get()
    }

    fn since(self, earlier: Self) -> Self {
        Self { allocations: self.allocations - earlier.allocations, frees: self.frees - earlier.frees }
    }
}

fn count(allocations: u64, frees: u64) {
    // Not there any more while its thread ends; nobody measures then.
    let _ = CALLS.try_with(|calls| {
        let before = calls.get();
        calls.set(Calls { allocations: before.allocations + allocations, frees: before.frees + frees });
    });
}

#[expect(unsafe_code, reason = "an allocator is unsafe by its trait")]
// SAFETY: every method passes its arguments on to the system's allocator as they are, and returns what that returns;
// counting touches only a thread-local without a destructor, which needs no memory of its own.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(1, 0);
        // SAFETY: the caller keeps the trait's contract, which is that of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(1, 0);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, len: usize) -> *mut u8 {
        count(1, 1);
        // SAFETY: as above; `block` came from `System` with that layout.
        unsafe { System.realloc(block, layout, len) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count(0, 1);
        // SAFETY: as above; `block` came from `System` with that layout.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How far the threads are, so that virtual time never leaves real work behind.
#[derive(Debug, Default)]
struct Pace {
    /// Ticks begun.
    ticks: AtomicU64,
    /// Ticks up to which the planner has served all that was asked.
    planned: AtomicU64,
    /// Frames that the peers have answered.
    answered: AtomicU64,
    /// Answers that the ack thread has read for certain.
    read: AtomicU64,
    over: AtomicBool,
    stop: AtomicBool,
}

impl Pace {
    /// Waits until the answers to all but `under_way` of the first `ticks` ticks have been read.
    fn wait_for_answers_to(&self, ticks: u64, under_way: u64) {
        let wanted = ticks.saturating_sub(under_way) * CONTROLLERS as u64;
        while self.read.load(Ordering::Acquire) < wanted {
            thread::yield_now();
        }
    }

    /// The planner's thread: within a tick of virtual time it has answered.
    fn serve(&self, plans: &mut PlanLoop) {
        let mut refusals = Vec::new();
        while !self.over.load(Ordering::Acquire) {
            let tick = self.ticks.load(Ordering::Acquire);
            plans.serve(&mut refusals);
            self.planned.store(tick, Ordering::Release);
            thread::yield_now();
        }
        assert!(refusals.is_empty(), "{refusals:?}");
    }
}

/// Time that jumps to each deadline, once the other threads have caught up, and passes by a little with each look at it.
struct Jumps<'a> {
    pace: &'a Pace,
    live: Arc<Live>,
    now: Cell<MonoTime>,
    /// Show time at the tick before.
    show: Cell<ShowTime>,
    /// How often show time went back.
    laps: Cell<u32>,
}

impl Clock for Jumps<'_> {
    fn now(&self) -> MonoTime {
        self.now.set(self.now.get() + Duration::from_micros(1));
        self.now.get()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        let tick = self.pace.ticks.fetch_add(1, Ordering::AcqRel) + 1;
        while self.pace.planned.load(Ordering::Acquire) < tick {
            thread::yield_now();
        }
        self.pace.wait_for_answers_to(tick - 1, UNDER_WAY);
        if self.live.show() < self.show.replace(self.live.show()) {
            self.laps.set(self.laps.get() + 1);
        }
        let overslept = OVERSLEPT.iter().find(|(at, _)| *at == tick).map_or(0, |(_, periods)| *periods);
        self.now.set(deadline + PERIOD * overslept);
        self.pace.stop.store(tick >= STOP_AT, Ordering::Relaxed);
    }
}

/// The ack thread's time, which tells how much it has read.
struct Drains<'a> {
    now: Cell<MonoTime>,
    /// What the peers had answered before the drain that now ends.
    answered: Cell<u64>,
    pace: &'a Pace,
}

impl Clock for Drains<'_> {
    fn now(&self) -> MonoTime {
        self.now.get()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        self.now.set(deadline);
        self.pace.read.store(self.answered.get(), Ordering::Release);
        self.answered.set(self.pace.answered.load(Ordering::Acquire));
        thread::yield_now();
    }
}

/// A controller that answers every frame, until it is sent an empty datagram.
fn answer(peer: &UdpSocket, pace: &Pace) {
    let (mut octets, mut buf) = ([0; MAX_LEN], [0; MAX_LEN]);
    loop {
        let (len, from) = peer.recv_from(&mut octets).expect("loopback works");
        let Ok(frame) = MotionRequest::parse(&octets[..len]) else { return };
        let MotionRequest { timing, channel, frame, time_ms, positions, extend, vibration, .. } = frame;
        let code = ReplyCode::Running;
        let reply = MotionReply {
            timing,
            code,
            channel,
            error: 0,
            frame,
            time_ms,
            positions,
            inputs: 0,
            extend,
            vibration,
        };
        peer.send_to(reply.emit(&mut buf), from).expect("loopback works");
        pace.answered.fetch_add(1, Ordering::AcqRel);
    }
}

/// Two seconds away from park, so that each lap begins with a join; with vibration and effects.
fn ride() -> Timeline {
    let mut text = String::from("time_ms,a1,a2,a3,a4,a5,a6,v1_hz,v1_amp,fx_air\n");
    for row in 0..=200 {
        let swing = 0.4 + 0.1 * (f64::from(row) * 0.03).sin();
        let shaking = if row % 50 < 25 { "20,0.01,1" } else { "0,0,0" };
        text += &format!("{},{swing},{swing},{swing},0.5,0.5,{swing},{shaking}\n", row * 10);
    }
    Timeline::new(
        read(Path::new("ride.csv"), text.as_bytes(), &Source::Native).expect("the ride is well formed"),
    )
}

/// The ride to a controller of six axes and one of three, in loops until it is stopped.
fn staged(addresses: &[SocketAddrV4; 2]) -> (Staged, Vec<Watched>) {
    let timeline = ride();
    let tos = [format!("{},axes=6", addresses[0]), format!("{},axes=3", addresses[1])];
    let config = from_to_args(&tos, &[], timeline.axes()).expect("the addresses differ");
    let show =
        Show { rate: Rate::from_hz(1000.0), timing: Timing::Absolute, start: ShowTime::ZERO, plays: 0 };
    let staged = Staged::new(&config, timeline, show, Manner { level: 1.0, silent: false })
        .expect("the ride is gentle");
    (staged, config.controllers.iter().map(Watched::of).collect())
}

struct Outcome {
    ended: Ended,
    calls: Calls,
    laps: u32,
    accounts: Accounts,
}

/// Plays as `kinocue play` does, on the calling thread; spins for as long as `spin` before each tick.
fn play(addresses: &[SocketAddrV4; 2], pace: &Pace, spin: Duration) -> Outcome {
    let (staged, watched) = staged(addresses);
    let rate = staged.show.rate;
    let (engine, lanes, planner, timeline) = staged.split();
    let any = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);
    let (sender, receiver) = Ports::open(any, addresses).expect("loopback has a free port").split();
    let live = Arc::new(Live::default());
    let (mut mail, ends) = mailboxes(lanes.len(), rate, Arc::clone(&live));
    let MailEnds { sent, ticks, requests, answers, retired } = ends;
    let mut plans = PlanLoop { planner, timeline, requests, answers, retired };
    // The kernel stamps replies with the real time; ahead of it, no frame is ever given up in a slow test.
    let origin = Monotonic.now() + Duration::from_secs(3_600);

    thread::scope(|scope| {
        let ack_thread = scope.spawn(move || {
            let clock = Drains { now: Cell::new(origin), answered: Cell::new(0), pace };
            let over = || pace.over.load(Ordering::Acquire);
            AckLoop::new(receiver, watched, 1, sent, ticks).run(&clock, DrainGrid::new(origin, PERIOD), over)
        });
        let plan_thread = scope.spawn(move || pace.serve(&mut plans));
        mail.wakes(plan_thread.thread().clone());
        let clock = Jumps { pace, live, now: Cell::new(origin), show: Cell::default(), laps: Cell::new(0) };
        let grid = TickGrid::new(origin, rate);
        let spinning = Spinning::new(&clock, spin, PERIOD);
        let mut tick_loop =
            TickLoop { clock: &spinning, grid, engine, lanes, sink: sender, mail, stop: &pace.stop };
        let before = Calls::so_far();
        let ended = tick_loop.run();
        let calls = Calls::so_far().since(before);
        pace.wait_for_answers_to(ended.ticks, 0);
        pace.over.store(true, Ordering::Release);
        let mut accounts = ack_thread.join().expect("the ack thread does not panic");
        accounts.close(tick_loop.lanes.iter().map(Lane::last_frame), clock.now());
        Outcome { ended, calls, laps: clock.laps.get(), accounts }
    })
}

/// Plays ten thousand ticks with that spin, in which `missed` are missed.
fn assert_quiet(spin: Duration, missed: u64) {
    let peers = [0; 2].map(|_| UdpSocket::bind("127.0.0.1:0").expect("loopback has a free port"));
    let addresses = [0, 1].map(|index: usize| match peers[index].local_addr().expect("it is bound") {
        SocketAddr::V4(address) => address,
        other => unreachable!("bound to an IPv4 address, not {other}"),
    });
    let pace = Pace::default();
    let outcome = thread::scope(|scope| {
        for peer in &peers {
            scope.spawn(|| answer(peer, &pace));
        }
        let outcome = play(&addresses, &pace, spin);
        for address in addresses {
            peers[0].send_to(&[], address).expect("loopback works");
        }
        outcome
    });
    let Outcome { ended, calls, laps, accounts } = outcome;
    assert_eq!(calls, Calls { allocations: 0, frees: 0 });
    assert!(ended.ticks > STOP_AT && laps >= 3, "{ended:?}, {laps} laps");
    assert_eq!((ended.missed, ended.ending, ended.unposted), (missed, Ending::Stopped, 0));
    for controller in 0..CONTROLLERS {
        let counts = accounts.books.tracker().counts(controller);
        assert_eq!((counts.sent, counts.asked, counts.acked), (ended.ticks, ended.ticks, ended.ticks));
        assert_eq!((counts.refused(), counts.lost, counts.duplicate, counts.stray), (0, 0, 0, 0));
    }
    assert_eq!(accounts.lateness.len(), ended.ticks);
}

#[test]
fn ten_thousand_ticks_neither_allocate_nor_free() {
    assert_quiet(Duration::ZERO, 83);
}

#[test]
fn nor_do_they_where_the_rest_of_each_wait_is_spun() {
    // Who oversleeps from before the deadline on misses one tick less.
    assert_quiet(Duration::from_micros(100), 81);
}

#[test]
fn the_allocator_counts_its_own_thread_and_no_other() {
    let before = Calls::so_far();
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(Calls::so_far().since(before), Calls { allocations: 1, frees: 1 });
    let there = thread::spawn(|| {
        let before = Calls::so_far();
        let mut grown = std::hint::black_box(vec![1_u8; 1]);
        grown.reserve_exact(100);
        Calls::so_far().since(before)
    });
    let here = Calls::so_far();
    while !there.is_finished() {
        thread::yield_now();
    }
    assert_eq!(Calls::so_far(), here);
    assert_eq!(there.join().unwrap(), Calls { allocations: 2, frees: 1 });
}
