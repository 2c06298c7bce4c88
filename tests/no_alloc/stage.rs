//! The real loop over real sockets, in virtual time that never leaves the other threads behind.

use std::cell::{Cell, RefCell};
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use kinocue::cue::{Source, read};
use kinocue::harness::app::StagedShow;
use kinocue::harness::belief::Reading;
use kinocue::harness::config::from_to_args;
use kinocue::harness::drive::{Lane, Manner};
use kinocue::harness::engine::{Mix, Show};
use kinocue::harness::film::chase::ChaseRules;
use kinocue::harness::film::point::{FilmPoint, FilmState, PublishedPoint};
use kinocue::harness::motion::{MAX_AXES, Pose, SeatType, Slot, Window};
use kinocue::harness::net::{Delivery, DrainGrid, Lead, Ports, Sender};
use kinocue::harness::observe::Watched;
use kinocue::harness::record::{Asked, FrameKind, RecordedSeat, Tap, TickHead, ack_tap, tap};
use kinocue::harness::rt::{
    Accounts, AckLoop, Alarm, Command, Conductor, Desk, Ended, FilmLead, FrameSink, Live, Loaded, MailEnds,
    News, Places, PlanLoop, Planning, Spinning, TickLoop, mailboxes,
};
use kinocue::harness::state::Transition;
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock, MonoTime, Rate, ShowTime, TickGrid};
use kinocue::harness::timeline::Timeline;
use kinocue::wire::{MAX_LEN, MotionReply, MotionRequest, ReplyCode, Timing, VibrationPort};
use rtrb::Producer;

use super::counting::Calls;

pub(crate) const PERIOD: Duration = Duration::from_millis(1);
/// Frames whose replies may be under way: 16 ms where they are of one controller alone, which with 80 ms that are overslept is no gap.
const UNDER_WAY: u64 = 16;
pub(crate) const CONTROLLERS: usize = 2;

/// Something that happens before a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Deed {
    /// The tick thread sleeps that many periods too long.
    Oversleep(u32),
    /// Somebody asks for something.
    Ask(Transition),
    /// Somebody wants to go on elsewhere in the film.
    Seek(ShowTime),
    /// The show is exchanged for another one.
    Load,
    /// Something is seen of a controller.
    See(Alarm),
    /// A controller takes part again: its seat was read at rest in that pose.
    Found(usize, Pose),
    /// Somebody sets what a lane makes of the cue.
    Mix(usize, Mix),
    /// Somebody sets the trim.
    Trim(i32),
    /// The film that leads is there from now on, and runs so fast.
    Film(ShowTime, f64, FilmState),
    /// Somebody presses stop.
    Stop,
    /// Somebody wants the play to end.
    Leave,
}

/// How far the threads are, so that virtual time never leaves real work behind.
#[derive(Debug, Default)]
struct Pace {
    /// Ticks begun.
    ticks: AtomicU64,
    /// Ticks up to which the planner has served all that was asked.
    planned: AtomicU64,
    /// Frames sent.
    sent: AtomicU64,
    /// Frames that the peers have answered.
    answered: AtomicU64,
    /// Answers that the ack thread has read for certain.
    read: AtomicU64,
    over: AtomicBool,
    leave: AtomicBool,
}

impl Pace {
    /// Waits until the answers to all but `under_way` of the frames so far have been read.
    fn wait_for_answers(&self, under_way: u64) {
        let wanted = self.sent.load(Ordering::Acquire).saturating_sub(under_way);
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

/// The sockets, which tell how much they have sent, and a recorder's tap.
struct Counted<'a> {
    sender: Sender,
    pace: &'a Pace,
    tap: Tap,
}

impl FrameSink for Counted<'_> {
    fn send(&mut self, lane: usize, datagram: &[u8], at: MonoTime) -> Delivery {
        self.pace.sent.fetch_add(1, Ordering::AcqRel);
        let delivery = FrameSink::send(&mut self.sender, lane, datagram, at);
        self.tap.frame(lane, datagram, at, delivery);
        delivery
    }

    fn asked(&mut self, asked: Asked) {
        self.tap.asked(asked);
    }

    fn tick_over(&mut self, head: &TickHead) {
        self.tap.tick(head);
    }
}

/// Time that jumps to each deadline, once the other threads have caught up and the script's deeds are done.
struct Jumps<'a> {
    pace: &'a Pace,
    script: &'a [(u64, Deed)],
    desk: &'a Desk,
    commands: RefCell<Producer<Command>>,
    alarms: RefCell<Producer<Alarm>>,
    /// The show to exchange the first for.
    next: Cell<Option<Box<Loaded>>>,
    /// The film that leads, and where it was said to be last.
    film: Arc<PublishedPoint>,
    shown: Cell<Option<FilmPoint>>,
    live: Arc<Live>,
    now: Cell<MonoTime>,
    /// Show time at the tick before.
    show: Cell<ShowTime>,
    /// How often show time went back.
    laps: Cell<u32>,
}

impl Jumps<'_> {
    fn command(&self, command: Command) {
        self.commands.borrow_mut().push(command).expect("there is room");
    }

    fn read(&self, lane: usize, pose: Pose) {
        let reading = Reading::at_rest(pose, self.now.get());
        self.live.evidence(lane).expect("there is such a lane").on_reading(&reading);
    }

    fn happen(&self, deed: Deed) {
        match deed {
            Deed::Oversleep(periods) => self.now.set(self.now.get() + PERIOD * periods),
            Deed::Ask(request) => self.command(Command::Request(request)),
            Deed::Seek(film) => self.command(Command::Seek(film)),
            Deed::Load => self.command(Command::Load(self.next.take().expect("there is one"))),
            Deed::Found(lane, pose) => {
                self.read(lane, pose);
                let found = Alarm::Found(u16::try_from(lane).expect("few lanes"));
                self.alarms.borrow_mut().push(found).expect("there is room");
            }
            Deed::See(alarm) => self.alarms.borrow_mut().push(alarm).expect("there is room"),
            Deed::Mix(lane, mix) => self.desk.set(lane, mix),
            Deed::Trim(ms) => self.desk.set_trim_ms(ms),
            Deed::Film(media, rate, state) => {
                let epoch = self.shown.get().map_or(0, |before| before.epoch + 1);
                self.shown.set(Some(FilmPoint { at: self.now.get(), media, rate, epoch, state }));
            }
            Deed::Stop => self.desk.stop(),
            Deed::Leave => self.pace.leave.store(true, Ordering::Relaxed),
        }
    }
}

impl Clock for Jumps<'_> {
    /// A microsecond later each time it is asked, so that a spin comes to its end.
    fn now(&self) -> MonoTime {
        self.now.set(self.now.get() + Duration::from_micros(1));
        self.now.get()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        let tick = self.pace.ticks.fetch_add(1, Ordering::AcqRel) + 1;
        while self.pace.planned.load(Ordering::Acquire) < tick {
            thread::yield_now();
        }
        self.pace.wait_for_answers(UNDER_WAY);
        if self.live.show() < self.show.replace(self.live.show()) {
            self.laps.set(self.laps.get() + 1);
        }
        self.now.set(deadline);
        self.script.iter().filter(|(at, _)| *at == tick).for_each(|(_, deed)| self.happen(*deed));
        if let Some(point) = self.shown.get() {
            self.film.publish(&FilmPoint { at: deadline, media: point.media_at(deadline), ..point });
        }
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
    let (mut bytes, mut buf) = ([0; MAX_LEN], [0; MAX_LEN]);
    loop {
        let (len, from) = peer.recv_from(&mut bytes).expect("loopback works");
        let Ok(frame) = MotionRequest::parse(&bytes[..len]) else { return };
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

/// Three seconds away from park, so that each lap begins with a join, and is followed a while also where the trim leaves out half a
/// second of it; with vibration and effects.
fn ride() -> Timeline {
    let mut text = String::from("time_ms,a1,a2,a3,a4,a5,a6,v1_hz,v1_amp,fx_air\n");
    for row in 0..=300 {
        let swing = 0.4 + 0.1 * (f64::from(row) * 0.03).sin();
        let shaking = if row % 50 < 25 { "20,0.01,1" } else { "0,0,0" };
        text += &format!("{},{swing},{swing},{swing},0.5,0.5,{swing},{shaking}\n", row * 10);
    }
    Timeline::new(
        read(Path::new("ride.csv"), text.as_bytes(), &Source::Native).expect("the ride is well formed"),
    )
}

/// The ride to a controller of six axes and one of three, in loops until it is stopped.
fn staged(addresses: &[SocketAddrV4; CONTROLLERS]) -> (StagedShow, Vec<Watched>) {
    let timeline = ride();
    let tos = [format!("{},axes=6", addresses[0]), format!("{},axes=3", addresses[1])];
    let config = from_to_args(&tos, &[], timeline.axes()).expect("the addresses differ");
    let show =
        Show { rate: Rate::from_hz(1000.0), timing: Timing::Absolute, start: ShowTime::ZERO, plays: 0 };
    let staged = StagedShow::new(&config, timeline, show, Manner { level: 1.0, silent: false })
        .expect("the ride is gentle");
    (staged, config.stations().iter().map(Watched::of).collect())
}

/// A seat of so many axes, as it is recorded.
fn recorded_seat(axes: usize) -> RecordedSeat {
    let seat = SeatType::bench3(axes);
    let window = Window::new((0..axes).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect());
    RecordedSeat::new("A1", &window, FrameKind::Datagram(VibrationPort::Two))
}

/// What came of a play.
pub(crate) struct Outcome {
    pub(crate) ended: Ended,
    /// What the tick thread asked of the allocator.
    pub(crate) calls: Calls,
    /// How often the ride began again.
    pub(crate) laps: u32,
    pub(crate) accounts: Accounts,
    pub(crate) news: Vec<News>,
}

/// Plays to peers that answer everything, while the script's deeds happen before the ticks of those numbers, the first of
/// which is 1; spins for as long as `spin` before each tick. Where nobody is there to clear what is latched, a stop is the end.
pub(crate) fn play(script: &[(u64, Deed)], attended: bool, spin: Duration) -> Outcome {
    let peers = [0; CONTROLLERS].map(|_| UdpSocket::bind("127.0.0.1:0").expect("loopback has a free port"));
    let addresses = [0, 1].map(|index: usize| {
        peers[index].local_addr().expect("it is bound").to_string().parse().expect("an IPv4 address")
    });
    let pace = Pace::default();
    thread::scope(|scope| {
        for peer in &peers {
            scope.spawn(|| answer(peer, &pace));
        }
        let outcome = play_to(&addresses, &pace, script, attended, spin);
        for address in addresses {
            peers[0].send_to(&[], address).expect("loopback takes it");
        }
        outcome
    })
}

/// Plays as `kinocue play` does, on the calling thread.
fn play_to(
    addresses: &[SocketAddrV4; CONTROLLERS],
    pace: &Pace,
    script: &[(u64, Deed)],
    attended: bool,
    spin: Duration,
) -> Outcome {
    let (next, _) = staged(addresses);
    let (staged, watched) = staged(addresses);
    let rate = staged.show.rate;
    let desk = &staged.desk();
    let (mut engine, lanes, planner, timeline) = staged.split();
    let film: Arc<PublishedPoint> = Arc::default();
    let rules = ChaseRules::until(timeline.duration());
    let lead = script.iter().any(|(_, deed)| matches!(deed, Deed::Film(..)));
    if lead {
        engine = engine.waiting();
    }
    let any = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);
    let (sender, receiver) = Ports::open(any, addresses).expect("loopback has a free port").split();
    let live = Arc::new(Live::new(CONTROLLERS));
    let seen = Arc::clone(&live);
    let (mut mail, ends) = mailboxes(lanes.len(), rate, Arc::clone(&live));
    let MailEnds { sent, ticks, tasks, answers, commands, alarms, mut news } = ends;
    let mut plans = PlanLoop { planning: Box::new(Planning { planner, timeline }), tasks, answers };
    // The kernel stamps replies with the real time; ahead of it, no frame is ever given up in a slow test.
    let origin = Monotonic.now() + Duration::from_secs(3_600);

    thread::scope(|scope| {
        let ack_thread = scope.spawn(move || {
            let clock = Drains { now: Cell::new(origin), answered: Cell::new(0), pace };
            let over = || pace.over.load(Ordering::Acquire);
            let mut acks = AckLoop::new(receiver, watched, 1, sent, ticks);
            acks.tell(seen);
            let (tap, _recorder) = ack_tap(CONTROLLERS, rate);
            acks.record(tap);
            acks.run(&clock, DrainGrid::new(origin, PERIOD), over)
        });
        let plan_thread = scope.spawn(move || pace.serve(&mut plans));
        mail.wakes(plan_thread.thread().clone());
        let clock = Jumps {
            pace,
            script,
            desk,
            commands: RefCell::new(commands),
            alarms: RefCell::new(alarms),
            next: Cell::new(Some(next.loaded())),
            film: Arc::clone(&film),
            shown: Cell::default(),
            live,
            now: Cell::new(origin),
            show: Cell::default(),
            laps: Cell::new(0),
        };
        (0..CONTROLLERS).for_each(|lane| clock.read(lane, [0.0; MAX_AXES]));
        let spinning = Spinning::new(&clock, spin, PERIOD);
        let places = Places::new(&lanes, rate);
        let seats = [6, 3].map(recorded_seat);
        // Nobody empties it: after two seconds each tick is dropped, which allocates nothing either.
        let (tap, _recorder) = tap(&seats, rate);
        // It leads for ever, and looks at that each time.
        let lasting = Arc::<Lead>::default();
        lasting.extend(MonoTime::from_nanos(u64::MAX));
        let mut tick_loop = TickLoop {
            clock: &spinning,
            grid: TickGrid::new(origin, rate),
            engine,
            conductor: Conductor::of_a_play(origin, attended)
                .chasing(lead.then(|| FilmLead::new(Arc::clone(&film), rules, origin)))
                .led_by(Some(Arc::clone(&lasting))),
            lanes,
            places,
            sink: Counted { sender: sender.led_by(Some(lasting)), pace, tap },
            mail,
            desk,
            leave: &pace.leave,
        };
        let before = Calls::so_far();
        let ended = tick_loop.run();
        let calls = Calls::so_far().since(before);
        pace.wait_for_answers(0);
        pace.over.store(true, Ordering::Release);
        let mut accounts = ack_thread.join().expect("the ack thread does not panic");
        accounts.close(tick_loop.lanes.iter().map(Lane::last_frame), clock.now());
        let news = std::iter::from_fn(|| news.pop().ok()).collect();
        Outcome { ended, calls, laps: clock.laps.get(), accounts, news }
    })
}
