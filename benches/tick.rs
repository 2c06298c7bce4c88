//! What one tick costs before anything is sent: sample, course and encode for 64 six-axis controllers, against 64 bare
//! sends to loopback in the same run, tick by tick in turns; what following a film adds to it; and what it costs where a quarter of the
//! seats are on serial drives, their poses handed over to the threads of links.
//!
//! `cargo bench --bench tick -- [--rounds N] [--quick]`

mod common {
    pub(crate) mod spread;
}

use std::hint::black_box;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use common::spread::{Spread, verdict};
use kinocue::harness::belief::{LaneEvidence, Reading, Taken};
use kinocue::harness::config::{self, Config};
use kinocue::harness::engine::Step;
use kinocue::harness::film::chase::{Chase, ChaseInput, ChaseRules, ChaseVerdict, FilmLeave};
use kinocue::harness::film::point::{ChasedFilm, FilmPoint, FilmState, PublishedPoint};
use kinocue::harness::motion::MAX_AXES;
use kinocue::harness::net::{Delivery, Ports};
use kinocue::harness::rt::{Live, Places, mailboxes};
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, MonoTime, ShowTime, Tick};
use kinocue::harness::{LinkOutlets, ride, stage, stage_in};
use kinocue::wire::MAX_LEN;

const CONTROLLERS: usize = 64;
const GOAL: f64 = 0.25;
/// Nanoseconds that a film may add to a tick of all controllers.
const FILM_GOAL: f64 = 100.0;
/// A point is published anew after so many ticks, as it is ten times a second and more.
const TOLD_EVERY: u64 = 50;
/// How much a tick may cost with seats on drives, of what it costs without.
const DRIVES_GOAL: f64 = 1.05;
/// Seats of these halls that are on drives, each on a link of its own.
const ON_DRIVES: usize = 16;
/// Ticks of one round: the join lasts 1.5 s, the ride fills the rest.
const TICKS: u64 = 4_500;
const SECONDS: u32 = 6;

/// What the ticks of one round took, µs for all controllers: those on the join and those on the cue, each with the sends
/// beside it.
#[derive(Default)]
struct Round {
    joining: Phase,
    following: Phase,
}

#[derive(Default)]
struct Phase {
    tick_us: Vec<f64>,
    sends_us: Vec<f64>,
}

impl Phase {
    /// Median tick, median sends, and the first over the second.
    fn figures(&self) -> [f64; 3] {
        let [tick, sends] = [&self.tick_us, &self.sends_us].map(|us| Spread::of(us.iter().copied()).median);
        [tick, sends, tick / sends]
    }
}

fn main() {
    let rounds = rounds();
    let links: Vec<Link> = (0..CONTROLLERS).map(|_| Link::open()).collect();
    let halls = [Hall::Plain, Hall::Chasing, Hall::WithDrives];
    let triples: Vec<[Round; 3]> = (0..rounds).map(|_| halls.map(|hall| round(&links, hall))).collect();
    let rounds: Vec<&Round> = triples.iter().map(|[alone, ..]| alone).collect();
    println!(
        "one tick for {CONTROLLERS} six-axis controllers, median of {} rounds (least..greatest)",
        rounds.len()
    );
    println!("{:<10} {:>20} {:>22} {:>22}  goal", "", "tick, us", "64 bare sends, us", "tick / sends");
    tell("following", rounds.iter().map(|round| &round.following));
    tell("joining", rounds.iter().map(|round| &round.joining));
    let tick_ns = |round: &Round| 1e3 * round.following.figures()[0];
    let added = Spread::of(triples.iter().map(|[alone, chasing, _]| tick_ns(chasing) - tick_ns(alone)));
    // What a film adds is done once a tick. With one controller little else varies beside it.
    let alone: Vec<[Round; 2]> = (0..rounds.len())
        .map(|_| [Hall::Plain, Hall::Chasing].map(|hall| round(&links[..1], hall)))
        .collect();
    let to_one = Spread::of(alone.iter().map(|[plain, chasing]| tick_ns(chasing) - tick_ns(plain)));
    println!(
        "a film adds {to_one:.0} ns to a tick for one controller  <= {FILM_GOAL}: {}",
        verdict(to_one, FILM_GOAL)
    );
    println!("and {added:.0} ns to one for all  <= {FILM_GOAL}: {}", verdict(added, FILM_GOAL));
    let sent = |round: &Round| round.following.figures()[0] + round.following.figures()[1];
    let ratio = Spread::of(triples.iter().map(|[alone, _, drives]| sent(drives) / sent(alone)));
    let bare = Spread::of(triples.iter().map(|[alone, _, drives]| tick_ns(drives) / tick_ns(alone)));
    println!(
        "with {ON_DRIVES} of the seats on drives a tick with its sends takes {ratio:.3} of that  <= {DRIVES_GOAL}: {}; without {bare:.3}",
        verdict(ratio, DRIVES_GOAL)
    );
}

/// Whom a tick is for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hall {
    /// Controllers on the network.
    Plain,
    /// The same, which follow a film.
    Chasing,
    /// As many seats, some of which are on drives.
    WithDrives,
}

/// A hall as a file has it: seats of six axes on the network, and those on drives behind them.
fn hall_with_drives(links: &[Link]) -> Config {
    let mut text = String::from(
        "[show]\nrate_hz = 1000\n[seat.s]\naxes = 6\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 4000\n\
         max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n[seat.d]\naxes = 6\n\
         stroke_mm = 150\nlead_mm = 5\npulses_per_rev = 4000\nmax_velocity_mm_s = 240\n\
         max_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n[seat.d.drive]\n\
         home = { way = \"switch\", input = 1, toward = \"down\", travel_mm = 165, zero_mm = -2 }\n\
         torque = { hold = \"60%\", move = 1.0, full = 20000 }\n",
    );
    for (index, link) in links.iter().enumerate() {
        let seat = index.checked_sub(links.len() - ON_DRIVES);
        text += &match seat {
            None => format!(
                "[[controller]]\nname = \"A{index}\"\nseat = \"s\"\naddress = \"{}\"\n",
                link.address()
            ),
            Some(of) => format!(
                "[link.l{of}]\nport = \"/dev/ttyS{of}\"\nbaud = 230400\n[[controller]]\nname = \"A{index}\"\n\
                 seat = \"d\"\naddress = \"link:l{of}\"\ndialect = \"silvermax\"\nunits = [16, 17, 18, 19, 20, 21]\n"
            ),
        };
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("hall.toml");
    std::fs::write(&file, text).expect("it is written");
    config::load(&file).expect("it is right")
}

/// `--rounds N`, `--quick`; other arguments are the bench runner's own.
fn rounds() -> usize {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let given = arguments.iter().skip_while(|argument| *argument != "--rounds").nth(1);
    let usual = if arguments.iter().any(|argument| argument == "--quick") { 3 } else { 15 };
    given.map_or(usual, |count| count.parse::<usize>().expect("--rounds takes a number")).max(1)
}

fn tell<'a>(name: &str, phases: impl Iterator<Item = &'a Phase>) {
    let figures: Vec<[f64; 3]> = phases.map(Phase::figures).collect();
    let [tick, sends, ratio] = [0, 1, 2].map(|place: usize| Spread::of(figures.iter().map(|of| of[place])));
    let columns = [format!("{tick:.1}"), format!("{sends:.1}"), format!("{ratio:.3}")];
    let [tick_us, sends_us, share] = columns;
    println!("{name:<10} {tick_us:>20} {sends_us:>22} {share:>22}  <= {GOAL}: {}", verdict(ratio, GOAL));
}

/// A connected socket and the one that it sends to.
struct Link {
    from: UdpSocket,
    to: UdpSocket,
}

impl Link {
    fn open() -> Self {
        let [from, to] = [0; 2].map(|_| UdpSocket::bind("127.0.0.1:0").expect("loopback has a free port"));
        from.connect(to.local_addr().expect("it is bound")).expect("loopback can be reached");
        to.set_nonblocking(true).expect("any socket can be");
        Self { from, to }
    }

    fn address(&self) -> SocketAddrV4 {
        match self.to.local_addr() {
            Ok(SocketAddr::V4(address)) => address,
            other => unreachable!("bound to an IPv4 address, not {other:?}"),
        }
    }
}

/// One play, flat out: each tick is followed by as many bare sends, which nobody counts twice because the receivers are
/// emptied outside the measurement.
fn round(links: &[Link], hall: Hall) -> Round {
    let addresses: Vec<SocketAddrV4> = links.iter().map(Link::address).collect();
    let cue = ride(SECONDS, 0.1, &[]);
    let (staged, _) = match hall {
        Hall::WithDrives => stage_in(&hall_with_drives(links), cue, 1000.0, false),
        Hall::Plain | Hall::Chasing => stage(cue, 1000.0, &addresses, false),
    };
    let settled = staged.course.settled();
    let rate = staged.show.rate;
    let (mut engine, mut lanes, _planner, _timeline) = staged.split();
    let live = Arc::new(Live::new(lanes.len()));
    let (mail, _ends) = mailboxes(lanes.len(), rate, Arc::clone(&live));
    let parked = Reading::at_rest([0.0; MAX_AXES], MonoTime::default());
    evidence(&live).for_each(|evidence| evidence.on_reading(&parked));
    let mut places = Places::new(&lanes, rate);
    let mut film = (hall == Hall::Chasing).then(|| Film::new(engine.playhead().at()));
    let stations = if hall == Hall::WithDrives { links.len() - ON_DRIVES } else { links.len() };
    let ports = Ports::open(SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0), &addresses[..stations]);
    let (sender, _receiver) = ports.expect("loopback can be reached").split();
    let mut outlets = LinkOutlets::over(sender, stations, &lanes);
    let (mut round, mut buf) = (Round::default(), [0; MAX_LEN]);
    for tick in 0..TICKS {
        let joining = engine.playhead().at() < settled;
        let at = MonoTime::default() + rate.offset(tick);
        if let Some(film) = film.as_mut().filter(|_| tick % TOLD_EVERY == 0) {
            film.publish(at);
        }
        let tick_us = timed(|| {
            let due = Tick { index: tick, deadline: at, late: Duration::ZERO, missed: 0 };
            // The first frame of a chased show joins, for which there is no planner here.
            let target = film.as_mut().and_then(|film| film.target(&due)).filter(|_| tick > 1);
            places.look(&mut engine, &mail, at, true);
            let Step::Send = engine.tick(0, target) else { unreachable!("the ride is longer") };
            for (index, lane) in lanes.iter_mut().enumerate() {
                let (beat, pose) = places.admit(index, &mut engine, at).expect("every lane takes part");
                let (stamped, bytes) = lane.encode(&beat, &pose, engine.lane(index).mix(), &mut buf);
                // What is on the network is sent below.
                if index >= stations {
                    outlets.send(index, bytes, at);
                }
                black_box(bytes);
                let taken = Taken {
                    frame: stamped.frame,
                    asked: true,
                    pose: &pose,
                    lasts_ms: beat.lasts_ms,
                    at_most_ms: beat.lasts_ms,
                    shakes: stamped.shakes,
                    at,
                };
                places.sent(index, &taken, Delivery::Sent);
            }
        });
        // Every frame is acked before the next tick.
        lanes.iter().zip(evidence(&live)).for_each(|(lane, evidence)| evidence.on_ack(lane.last_frame()));
        let sends_us = timed(|| send_all(&links[..stations]));
        links.iter().for_each(|link| empty(&link.to));
        assert_eq!(outlets.take(), links.len() - stations, "each seat on drives has its pose");
        let phase = if joining { &mut round.joining } else { &mut round.following };
        phase.tick_us.push(tick_us);
        phase.sends_us.push(sends_us);
    }
    round
}

/// A film that runs a little faster than the clock, and the chase of it.
struct Film {
    begun: ShowTime,
    point: Arc<PublishedPoint>,
    clock: ChasedFilm,
    chase: Chase,
}

impl Film {
    fn new(begun: ShowTime) -> Self {
        let point = Arc::<PublishedPoint>::default();
        let rules = ChaseRules::until(ShowTime::from_millis(1_000 * i64::from(SECONDS)));
        let clock = ChasedFilm::new(Arc::clone(&point));
        Self { begun, point, clock, chase: Chase::new(rules, MonoTime::default()) }
    }

    fn publish(&self, at: MonoTime) {
        let begun = FilmPoint {
            at: MonoTime::default(),
            media: self.begun,
            rate: 1.000_2,
            epoch: 0,
            state: FilmState::Locked,
        };
        self.point.publish(&FilmPoint { at, media: begun.media_at(at), ..begun });
    }

    fn target(&mut self, tick: &Tick) -> Option<ShowTime> {
        let point = self.clock.at(tick);
        let frame = Duration::from_millis(1);
        let input = ChaseInput { tick, frame, point, trim_ms: 0, leave: FilmLeave::Lead };
        match self.chase.tick(&input) {
            ChaseVerdict::Follow { playhead, .. } => Some(playhead),
            _ => None,
        }
    }
}

fn evidence(live: &Live) -> impl Iterator<Item = LaneEvidence<'_>> {
    (0..).map_while(|lane| live.evidence(lane))
}

fn timed(work: impl FnOnce()) -> f64 {
    let start = Monotonic.now();
    work();
    Monotonic.now().since(start).div_duration_f64(Duration::from_micros(1))
}

fn send_all(links: &[Link]) {
    let frame = [0x55; 50];
    for link in links {
        link.from.send(&frame).expect("its receiver is there");
    }
}

fn empty(socket: &UdpSocket) {
    while socket.recv(&mut [0; 64]).is_ok() {}
}
