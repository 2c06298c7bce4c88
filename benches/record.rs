//! What recording costs: the taps on the tick and ack threads, the thread behind them, the lateness of ticks with and without, and
//! how soon an incident is on the disk. 64 controllers of six axes, 1,000 ticks a second.
//!
//! `cargo bench --bench record -- [--rounds N] [--quick] [--costs]`; with `--plot` alone, what a picture of two hours costs.

#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "figures of a few digits"
)]

mod common {
    pub(crate) mod spread;
}
mod senders {
    pub(super) mod again;
    pub(super) mod children;
    #[expect(dead_code, reason = "each bench uses its own part")]
    pub(super) mod ours;
    pub(super) mod outcome;
    pub(super) mod peer;
}

use std::hint::black_box;
use std::net::{SocketAddrV4, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use common::spread::{Spread, verdict};
use kinocue::harness::motion::{MAX_AXES, SeatType, Slot, Window};
use kinocue::harness::net::{Delivery, Sender};
use kinocue::harness::record::{AckTap, Asked, FrameKind, RecordedSeat, Tap, TickHead};
use kinocue::harness::recording::{RecorderRig, drained, recorded_show, replies};
use kinocue::harness::rt::FrameSink;
use kinocue::harness::sys::clock::{Monotonic, thread_cpu_time};
use kinocue::harness::sys::realtime::normal_priority;
use kinocue::harness::time::{Clock as _, MonoTime, Rate, ShowTime};
use kinocue::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, Timing, VibrationPort};
use senders::again::sender;
use senders::children::Peer;
use senders::outcome::Outcome;
use senders::{ours, peer};

const LANES: usize = 64;
const AXES: usize = 6;
const RATE_HZ: f64 = 1_000.0;
/// What an incident begins with and goes on for.
const INCIDENT_S: u64 = 70;
const FLIGHT: u64 = 128 << 20;
/// How often the recorder's thread looks.
const LOOK_MS: u64 = 50;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["peer", count] => peer::run(count.parse().expect("a number")),
        ["plain", seconds, ref to @ ..] => finish(&play(seconds, to, Behind::Nobody)),
        ["tapped", seconds, ref to @ ..] => finish(&play(seconds, to, Behind::Recorder)),
        ["stalled", seconds, ref to @ ..] => finish(&play(seconds, to, Behind::StalledDisk)),
        ["--plot"] => plots(),
        _ => measure(&words),
    }
}

fn finish(outcome: &Outcome) {
    println!("{}", serde_json::to_string(outcome).expect("an outcome has only names and numbers"));
}

fn measure(words: &[&str]) {
    let is_quick = words.contains(&"--quick");
    let given = words.iter().skip_while(|word| **word != "--rounds").nth(1);
    let rounds: usize = given.map_or(if is_quick { 2 } else { 5 }, |count| count.parse().expect("a number"));
    let seconds = if is_quick { 2 } else { 10 };
    println!(
        "recording {LANES} controllers of {AXES} axes at {RATE_HZ} Hz, {rounds} rounds of {seconds} s: median (least..greatest)"
    );
    costs(rounds, seconds);
    if !words.contains(&"--costs") {
        lateness(rounds, seconds);
    }
}

/// Flat out: every tick of some seconds is tapped, and taken as often as the thread looks.
fn costs(rounds: usize, seconds: u64) {
    let all: Vec<Costs> = (0..rounds).map(|_| Costs::of(seconds)).collect();
    let spread = |figure: fn(&Costs) -> f64| Spread::of(all.iter().map(figure));
    let tap = spread(|costs| costs.tap_us);
    println!("tick tap, p50         {tap:.2} us  <= 2: {}", verdict(tap, 2.0));
    println!("tick tap, p99         {:.2} us", spread(|costs| costs.tap_p99_us));
    println!("tick tap / bare sends {:.4}", spread(|costs| costs.tap_us / costs.sends_us));
    println!("ack tap, a drain, p50 {:.2} us", spread(|costs| costs.acks_us));
    let share = spread(|costs| costs.share);
    println!("recorder thread       {share:.2} % of a core  <= 3: {}", verdict(share, 3.0));
    println!("flight recorder       {:.2} MB/s", spread(|costs| costs.octets_a_s / 1e6));
    let file = spread(|costs| costs.file_a_s / 1e6);
    println!("file of all in full   {file:.3} MB/s  <= 0.5: {}", verdict(file, 0.5));
    let incident = Spread::of((0..rounds).map(|_| incident_s(INCIDENT_S)));
    println!("incident of {INCIDENT_S} s      {incident:.2} s  <= 2: {}", verdict(incident, 2.0));
}

/// How long it takes until so many seconds are on the disk as a file, seconds.
fn incident_s(seconds: u64) -> f64 {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut tap, mut acks, mut rig) = rig(folder.path());
    let mut dice = Dice(7);
    for tick in 0..1_000 * seconds {
        let at = MonoTime::from_nanos(tick * 1_000_000);
        tapped(&mut tap, tick, at, &frames(tick));
        replied(&mut acks, tick, at, &mut dice);
        if tick % LOOK_MS == LOOK_MS - 1 {
            rig.take();
        }
    }
    let began = Monotonic.now();
    black_box(rig.incident(&folder.path().join("incident.mcap")).expect("there is room"));
    Monotonic.now().since(began).as_secs_f64()
}

fn rig(folder: &Path) -> (Tap, AckTap, RecorderRig) {
    RecorderRig::new(seats(), Rate::from_hz(RATE_HZ), &folder.join("flight.ring"), FLIGHT)
}

/// All controllers reply, as on a wire that is shared: after 150 to 250 µs.
fn replied(acks: &mut AckTap, tick: u64, at: MonoTime, dice: &mut Dice) {
    let after_us: Vec<u32> = (0..LANES).map(|_| 150 + dice.below(100)).collect();
    replies(acks, FrameNo(u32::try_from(tick).expect("few")), at, &after_us);
    drained(acks, at);
}

struct Costs {
    tap_us: f64,
    tap_p99_us: f64,
    sends_us: f64,
    acks_us: f64,
    share: f64,
    octets_a_s: f64,
    file_a_s: f64,
}

impl Costs {
    fn of(seconds: u64) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (mut tap, mut acks, mut rig) = rig(folder.path());
        let sockets = Sockets::open();
        let (mut ticks_us, mut drains_us, mut sends_us) = (Vec::new(), Vec::new(), Vec::new());
        let (mut cpu, mut octets) = (Duration::ZERO, 0);
        let mut dice = Dice(7);
        for tick in 0..1_000 * seconds {
            let at = MonoTime::from_nanos(tick * 1_000_000);
            let frames = frames(tick);
            ticks_us.push(timed(|| tapped(&mut tap, tick, at, &frames)));
            drains_us.push(timed(|| replied(&mut acks, tick, at, &mut dice)));
            sends_us.push(timed(|| frames.iter().for_each(|frame| sockets.send(frame.datagram()))));
            sockets.empty();
            if tick % LOOK_MS == LOOK_MS - 1 {
                let before = thread_cpu_time();
                octets += rig.take();
                cpu += thread_cpu_time().saturating_sub(before);
            }
        }
        assert_eq!(rig.dropped(), (0, 0));
        let incident = folder.path().join("incident.mcap");
        rig.incident(&incident).expect("there is room");
        let file = std::fs::metadata(&incident).expect("it is there").len();
        let median = |figures: &[f64]| Spread::of(figures.iter().copied()).median;
        let seconds = seconds as f64;
        Self {
            tap_us: median(&ticks_us),
            tap_p99_us: quantile(&mut ticks_us, 0.99),
            sends_us: median(&sends_us),
            acks_us: median(&drains_us),
            share: 100.0 * cpu.as_secs_f64() / seconds,
            octets_a_s: octets as f64 / seconds,
            file_a_s: file as f64 / seconds,
        }
    }
}

fn quantile(figures: &mut [f64], part: f64) -> f64 {
    figures.sort_by(f64::total_cmp);
    figures[((figures.len() - 1) as f64 * part) as usize]
}

fn timed(work: impl FnOnce()) -> f64 {
    let began = Monotonic.now();
    work();
    Monotonic.now().since(began).as_secs_f64() * 1e6
}

fn seats() -> Vec<RecordedSeat> {
    let seat = SeatType::bench3(AXES);
    let window = Window::new((0..AXES).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect());
    (0..LANES)
        .map(|lane| RecordedSeat::new(&format!("S{lane}"), &window, FrameKind::Datagram(VibrationPort::Two)))
        .collect()
}

/// Numbers by chance, the same each time.
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % u64::from(most)) as u32
    }
}

/// A frame, and the pose that was asked for.
struct Led {
    octets: [u8; MAX_LEN],
    len: usize,
    pose: [f64; MAX_AXES],
}

impl Led {
    fn datagram(&self) -> &[u8] {
        &self.octets[..self.len]
    }
}

/// A tick of sines of up to 8 Hz, each lane at its own level.
fn frames(tick: u64) -> Vec<Led> {
    let frame = |lane: usize| {
        let place = |axis: usize| {
            let phase =
                std::f64::consts::TAU * tick as f64 / 1_000.0 * (0.5 + 1.5 * axis as f64) + lane as f64;
            // Faster ones are smaller, as limits have it.
            let swing = (100_000.0 + 500.0 * lane as f64) / (1.0 + axis as f64 * axis as f64 * 4.0);
            150_000.0 + swing * phase.sin()
        };
        let mut pose = [0.0; MAX_AXES];
        (0..AXES).for_each(|axis| pose[axis] = place(axis) / 300_000.0);
        let positions: [_; AXES] =
            std::array::from_fn(|axis| kinocue::harness::motion::Pulses(place(axis).round() as i32));
        let motion = Motion {
            timing: Timing::Relative,
            // Six axes.
            channel: 1,
            accept: Code(0xffff),
            reply: Code(1),
            frame: FrameNo(u32::try_from(tick).expect("few")),
            time_ms: 1,
            positions: &positions,
            outputs: 0,
            analogue: Analogue::default(),
            vibration: None,
        };
        let mut octets = [0; MAX_LEN];
        let len = motion.emit(&mut octets).len();
        Led { octets, len, pose }
    };
    (0..LANES).map(frame).collect()
}

fn tapped(tap: &mut Tap, tick: u64, at: MonoTime, frames: &[Led]) {
    tap_all(tap, at, frames);
    tap.tick(&TickHead::of(tick, at));
}

fn tap_all(tap: &mut Tap, at: MonoTime, frames: &[Led]) {
    for (lane, frame) in frames.iter().enumerate() {
        tap.asked(Asked::of(frame.pose, AXES));
        // One after the other, a microsecond or so each.
        tap.frame(lane, frame.datagram(), at + Duration::from_nanos(1_200 * lane as u64), Delivery::Sent);
    }
}

/// A socket to each of as many, on loopback.
struct Sockets(Vec<[UdpSocket; 2]>);

impl Sockets {
    fn open() -> Self {
        let pair = |_| {
            let [from, to] =
                [0; 2].map(|_| UdpSocket::bind("127.0.0.1:0").expect("loopback has a free port"));
            from.connect(to.local_addr().expect("it is bound")).expect("loopback can be reached");
            to.set_nonblocking(true).expect("any socket can be");
            [from, to]
        };
        Self((0..LANES).map(pair).collect())
    }

    fn send(&self, octets: &[u8]) {
        // One each: whoever sends a tick sends to all.
        thread_local! { static NEXT: std::cell::Cell<usize> = const { std::cell::Cell::new(0) }; }
        let next = NEXT.get();
        NEXT.set((next + 1) % LANES);
        let _ = self.0[next][0].send(octets);
    }

    fn empty(&self) {
        let mut buf = [0; MAX_LEN];
        self.0.iter().for_each(|[_, to]| while to.recv(&mut buf).is_ok() {});
    }
}

/// A show of two hours at 100 Hz, sampled as shows are by themselves, and pictures of it by the program.
fn plots() {
    const HOURS: u64 = 2;
    let folder = tempfile::tempdir().expect("a folder");
    let show = folder.path().join("show.mcap");
    let mut dice = Dice(7);
    let began = Monotonic.now();
    recorded_show(seats(), Rate::from_hz(100.0), &show, HOURS * 360_000, |tap, acks, tick| {
        let at = MonoTime::from_nanos(tick * 10_000_000);
        tap_all(tap, at, &frames(10 * tick));
        tap.tick(&TickHead::of(tick, at).showing(ShowTime::from_millis(10 * tick.cast_signed())));
        replied(acks, tick, at, &mut dice);
    });
    let took = Monotonic.now().since(began).as_secs_f64();
    let size = std::fs::metadata(&show).expect("it is there").len() as f64 / 1e6;
    println!("show of {HOURS} h          {size:.1} MB, made in {took:.1} s");
    for name in ["picture.html", "picture.svg"] {
        let out = folder.path().join(name);
        let (seconds, resident) = plot(&show, &out);
        let size = std::fs::metadata(&out).expect("it was drawn").len() as f64 / 1e3;
        println!(
            "{name}        {seconds:.2} s  <= 2 (5 by RECORD.md)  {size:.0} kB  <= 500  {resident:.0} MB  <= 300"
        );
    }
}

/// Draws a recording; gives how long that took, s, and how much memory, MB.
fn plot(show: &Path, out: &Path) -> (f64, f64) {
    let began = Monotonic.now();
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_kinocue"))
        .args([Path::new("plot"), show, Path::new("-o"), out, Path::new("--force")])
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("it runs");
    let (status, mut resident) = (format!("/proc/{}/status", child.id()), 0.0_f64);
    while child.try_wait().expect("it is ours").is_none() {
        let told = std::fs::read_to_string(&status).unwrap_or_default();
        let most = told.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"));
        resident = resident.max(most.and_then(|kb| kb.parse().ok()).unwrap_or(0.0) / 1e3);
        Monotonic.sleep_until(Monotonic.now() + Duration::from_millis(5));
    }
    (Monotonic.now().since(began).as_secs_f64(), resident)
}

/// With taps and without, and with a disk that stands still, by turns, each in a process of its own.
fn lateness(rounds: usize, seconds: u64) {
    let peer = Peer::start(LANES);
    let ratios: Vec<[f64; 3]> = (0..rounds)
        .map(|round| {
            let mut kinds = ["plain", "stalled", "tapped"];
            kinds.rotate_left(round % 3);
            let mut p99 = kinds.map(|kind| {
                let outcome: Outcome = sender(&[kind, &seconds.to_string()], &peer.addresses);
                (kind, outcome.lateness.p99)
            });
            p99.sort_unstable_by_key(|(kind, _)| *kind);
            p99.map(|(_, us)| us)
        })
        .collect();
    let column = |at: usize| Spread::of(ratios.iter().map(|pair| pair[at]));
    let ratio = |at: usize| Spread::of(ratios.iter().map(|one| one[at] / one[0]));
    println!("lateness p99 without  {:.1} us", column(0));
    println!("lateness p99 with     {:.1} us", column(2));
    println!("the disk stands still {:.1} us", column(1));
    println!("with / without        {:.3}  <= 1.05: {}", ratio(2), verdict(ratio(2), 1.05));
    println!("still / without       {:.3}  <= 1.05: {}", ratio(1), verdict(ratio(1), 1.05));
}

/// The sockets, and a tap.
struct Tapped {
    sender: Sender,
    tap: Option<Tap>,
}

impl FrameSink for Tapped {
    fn send(&mut self, lane: usize, datagram: &[u8], at: MonoTime) -> Delivery {
        let delivery = FrameSink::send(&mut self.sender, lane, datagram, at);
        if let Some(tap) = &mut self.tap {
            tap.frame(lane, datagram, at, delivery);
        }
        delivery
    }

    fn asked(&mut self, asked: Asked) {
        if let Some(tap) = &mut self.tap {
            tap.asked(asked);
        }
    }

    fn tick_over(&mut self, head: &TickHead) {
        if let Some(tap) = &mut self.tap {
            tap.tick(head);
        }
    }
}

/// What is behind the taps.
#[derive(Clone, Copy, PartialEq)]
enum Behind {
    /// There are none.
    Nobody,
    /// The thread that a hall has.
    Recorder,
    /// The same, at a disk that stands still for the whole play.
    StalledDisk,
}

/// Plays to controllers that answer, recorded or not.
fn play(seconds: &str, to: &[&str], behind: Behind) -> Outcome {
    let to: Vec<SocketAddrV4> = to.iter().map(|word| word.parse().expect("an address")).collect();
    let folder = PathBuf::from("/dev/shm").join(format!("kinocue-bench-{}", std::process::id()));
    let over = AtomicBool::new(false);
    let (tap, acks, mut rig) = RecorderRig::new(seats(), Rate::from_hz(RATE_HZ), &folder, 64 << 20);
    let outcome = std::thread::scope(|scope| {
        let over = &over;
        scope.spawn(move || {
            let _ = normal_priority();
            while !over.load(Ordering::Acquire) {
                if behind == Behind::Recorder {
                    rig.take();
                }
                Monotonic.sleep_until(Monotonic.now() + Duration::from_millis(LOOK_MS));
            }
        });
        let taps: Option<(Tap, AckTap)> = (behind != Behind::Nobody).then_some((tap, acks));
        let outcome =
            ours::run_into(&Monotonic, seconds.parse().expect("a number"), &to, false, |sender, loops| {
                let tap = taps.map(|(tap, acks)| {
                    loops.record(acks);
                    tap
                });
                Tapped { sender, tap }
            });
        over.store(true, Ordering::Release);
        outcome
    });
    let _ = std::fs::remove_file(&folder);
    outcome
}
