//! Shows that are led by hand in real time, over real sockets, to the controllers of `kinocue sim`: by its own log, what
//! their motors executed stays within the limits of the seats.
//!
//! The log is judged by the Time that each straight line took, one after the other: how long the simulator or the show
//! was held up by a busy machine between two lines is the machine's doing, and says nothing of either.

#[expect(dead_code, reason = "shows that are led by hand need a part of it")]
#[path = "common/process.rs"]
mod process;

use std::io::Read as _;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

use kinocue::cue::{self, Source};
use kinocue::harness::app::{Control, Play, PlayHandle, Played};
use kinocue::harness::config::from_to_args;
use kinocue::harness::drive::Manner;
use kinocue::harness::engine::{Mix, Show};
use kinocue::harness::motion::AxisGeometry;
use kinocue::harness::rt::{Command, News};
use kinocue::harness::state::{PlayMode, Refusal, State, Transition, Why};
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, Rate, ShowTime};
use kinocue::harness::timeline::Timeline;
use kinocue::harness::{Worst, swell, worst_of_lines};
use kinocue::wire::Timing;
use process::Sim;
use tempfile::NamedTempFile;

/// Nothing is waited for longer.
const PATIENCE: Duration = Duration::from_secs(30);
/// How often it is looked for.
const LOOK: Duration = Duration::from_millis(1);
const FOLLOWING: State = State::Playing(PlayMode::Following);

/// Leads a show from a thread of its own; however that ends, the show does too.
struct Leader {
    control: Control,
    handle: PlayHandle,
    /// What was refused while other news was waited for.
    refused: Vec<Refusal>,
}

impl Drop for Leader {
    fn drop(&mut self) {
        self.control.leave.store(true, Ordering::Relaxed);
    }
}

impl Leader {
    fn ask(&mut self, request: Transition) {
        self.command(Command::Request(request));
    }

    fn seek(&mut self, seconds: i64) {
        self.command(Command::Seek(ShowTime::from_millis(seconds * 1_000)));
    }

    /// What is waited for afterwards has to be new: a machine that was held up makes news of its own.
    fn command(&mut self, command: Command) {
        while let Ok(news) = self.handle.news.pop() {
            self.keep_refusal(news);
        }
        self.handle.commands.push(command).expect("there is room");
    }

    fn keep_refusal(&mut self, news: News) {
        if let News::Refused(refusal) = news {
            self.refused.push(refusal);
        }
    }

    fn wait_until<T>(&mut self, what: &str, mut found: impl FnMut(&mut Self) -> Option<T>) -> T {
        let deadline = Monotonic.now() + PATIENCE;
        loop {
            if let Some(found) = found(self) {
                return found;
            }
            assert!(Monotonic.now() < deadline, "waited in vain for {what}: {:?}", self.control.live);
            Monotonic.sleep_until(Monotonic.now() + LOOK);
        }
    }

    /// Waits until the hall has entered a state since what was waited for last.
    fn wait_for(&mut self, wanted: State) {
        self.wait_until(&format!("{wanted:?}"), |leader| {
            loop {
                match leader.handle.news.pop().ok()? {
                    News::Entered { state, .. } if state == wanted => return Some(()),
                    news => leader.keep_refusal(news),
                }
            }
        });
    }

    /// Waits until the film is that far.
    fn wait_for_film(&mut self, ms: i64) {
        let film = ShowTime::from_millis(ms);
        self.wait_until("the film", |leader| (leader.control.live.show() >= film).then_some(()));
    }

    /// Waits until that many further ticks have passed.
    fn wait_for_ticks(&mut self, ticks: u64) {
        let then = self.control.live.beats() + ticks;
        self.wait_until("ticks", |leader| (leader.control.live.beats() >= then).then_some(()));
    }

    /// Everything but the end: a pause, a seek each way, levels, a trim, and a seat that is off for a while.
    fn lead(&mut self, rate_hz: u32) {
        self.wait_for(FOLLOWING);
        self.ask(Transition::Pause);
        self.wait_for(State::Paused);
        self.wait_for_ticks(u64::from(rate_hz) / 8 + 1); // decelerated, and some hold frames
        self.ask(Transition::Resume);
        self.wait_for(FOLLOWING);
        self.seek(11);
        self.control.desk.set(1, Mix { on: false, ..Mix::FULL });
        self.wait_for(FOLLOWING);
        self.control.desk.set(0, Mix { motion: 0.4, ..Mix::FULL });
        self.control.desk.set_trim_ms(60);
        self.wait_for_film(13_000);
        self.seek(4);
        self.wait_for(FOLLOWING);
        (0..2).for_each(|lane| self.control.desk.set(lane, Mix::FULL));
        self.control.desk.set_trim_ms(-20);
        self.wait_for_film(7_600);
    }

    /// Stops, and says why the show does not go on.
    fn stop(&mut self) -> Why {
        self.control.desk.stop();
        self.wait_for(State::Stopped);
        self.ask(Transition::Resume);
        self.wait_until("the refusal", |leader| match leader.handle.news.pop().ok()? {
            News::Refused(refusal) => Some(refusal.why),
            _ => None,
        })
    }
}

/// A show to simulators of its own.
struct Real {
    sim: Sim,
    moves: NamedTempFile,
    axes: u32,
    rate_hz: u32,
    timing: Timing,
}

impl Real {
    /// Two controllers.
    fn new(axes: u32, rate_hz: u32, timing: Timing) -> Self {
        let moves = NamedTempFile::new().expect("a file");
        // Without fast forward and with a long queue, so that a simulator that was held up executes all there is.
        let (axes_arg, path) = (axes.to_string(), moves.path().to_str().expect("text"));
        let args = ["--axes", &axes_arg, "--pa", "06=0", "--queue-depth", "5000", "--moves", path];
        Self { sim: Sim::start(2, &args), moves, axes, rate_hz, timing }
    }

    /// Plays it, led by `lead`.
    fn play(&self, lead: impl FnOnce(&mut Leader) + Send) -> Played {
        let text = swell(self.axes, 20, 40.0, 0.6);
        let cue = cue::read(Path::new("show.csv"), text.as_bytes(), &Source::Native).expect("it is sound");
        let timeline = Timeline::new(cue);
        let to: Vec<String> =
            self.sim.addresses.iter().map(|address| format!("{address},axes={}", self.axes)).collect();
        let mut config = from_to_args(&to, &[], timeline.axes()).expect("the addresses differ");
        config.show.bind = "127.0.0.1:0".parse().expect("an address");
        let rate = Rate::from_hz(f64::from(self.rate_hz));
        let show = Show { rate, timing: self.timing, start: ShowTime::ZERO, plays: 1 };
        let manner = Manner { level: 1.0, silent: false };
        let play = Play::new(config, timeline, show, manner).expect("the show is gentle");
        let control = play.control();
        std::thread::scope(|scope| {
            let attend = |handle| {
                let mut leader = Leader { control, handle, refused: Vec::new() };
                scope.spawn(move || {
                    lead(&mut leader);
                    assert_eq!(leader.refused, [], "nothing was refused on the way");
                });
                true
            };
            play.run(attend).expect("the show plays")
        })
    }

    /// Ends the simulators, and says what their motors executed, by controller.
    fn executed(self) -> Vec<Vec<Move>> {
        let addresses = self.sim.addresses.clone();
        self.sim.end();
        let mut text = String::new();
        self.moves.reopen().expect("a file").read_to_string(&mut text).expect("text");
        let of = |address: &String| {
            text.lines()
                .skip(1)
                .filter(|row| row.split(',').nth(1) == Some(address))
                .map(Move::parse)
                .collect()
        };
        addresses.iter().map(of).collect()
    }
}

/// A straight line that the motors of a simulator ran.
#[derive(Debug)]
struct Move {
    took: Duration,
    from: Vec<i32>,
    to: Vec<i32>,
}

impl Move {
    fn parse(row: &str) -> Self {
        let cells: Vec<&str> = row.split(',').collect();
        let pulses = |cells: &[&str]| cells.iter().filter_map(|cell| cell.parse().ok()).collect();
        let took = Duration::from_secs_f64(cells[2].parse::<f64>().expect("milliseconds") / 1e3);
        Self { took, from: pulses(&cells[3..15]), to: pulses(&cells[15..27]) }
    }

    fn stands_at_park(&self) -> bool {
        self.from.iter().chain(&self.to).all(|pulses| *pulses == 0)
    }
}

/// What they make the worst axis do, from rest where the first begins.
fn worst(rate_hz: u32, moves: &[Move]) -> Worst {
    let per_pulse = 150.0 / AxisGeometry::BENCH.stroke_pulses();
    let rate = Rate::from_hz(f64::from(rate_hz));
    let axes = 0..moves[0].to.len();
    let worst = axes.map(|axis| {
        let lines = moves.iter().map(|line| (line.took, f64::from(line.to[axis]) * per_pulse));
        worst_of_lines(rate, f64::from(moves[0].from[axis]) * per_pulse, lines)
    });
    worst.fold(Worst::default(), Worst::max)
}

/// No line begins anywhere but where the one before ended, and all of them are within the limits of the seats.
fn assert_gentle(rate_hz: u32, moves: &[Move]) {
    assert!(moves.windows(2).all(|pair| pair[0].to == pair[1].from), "a step");
    let worst = worst(rate_hz, moves);
    let Worst { velocity, acceleration, jerk, step } = worst;
    assert!(velocity <= 1.01 && acceleration <= 1.01 && jerk <= 1.01 && step <= 1.01, "{worst:?}");
    assert!(velocity > 0.3 && acceleration > 0.3 && jerk > 0.3, "a show that hardly moves: {worst:?}");
}

/// How long the longest rest in the park pose is that has motion on both sides.
fn longest_park(moves: &[Move]) -> Duration {
    let (mut longest, mut rest) = (Duration::ZERO, None);
    for line in moves {
        rest = match rest {
            Some(rest) if line.stands_at_park() => Some(rest + line.took),
            _ if line.stands_at_park() => None,
            rest => {
                longest = longest.max(rest.unwrap_or_default());
                Some(Duration::ZERO)
            }
        };
    }
    longest
}

#[test]
fn a_led_show_of_two_six_axis_seats_at_250_hz_executes_no_step_and_its_stop_is_latched() {
    let real = Real::new(6, 250, Timing::Relative);
    let played = real.play(|leader| {
        leader.lead(250);
        assert_eq!(leader.stop(), Why::Latched);
    });
    assert_eq!(played.report.result.word(), "stopped");
    let executed = real.executed();
    executed.iter().for_each(|moves| assert_gentle(250, moves));
    assert!(longest_park(&executed[0]).is_zero(), "the first seat was never off");
    assert!(!longest_park(&executed[1]).is_zero(), "the second was");
}

#[test]
fn a_led_show_in_absolute_time_executes_no_step_and_ends_in_park() {
    let real = Real::new(3, 100, Timing::Absolute);
    let played = real.play(|leader| leader.lead(100));
    assert_eq!(played.report.result.word(), "stopped");
    let executed = real.executed();
    executed.iter().for_each(|moves| assert_gentle(100, moves));
    assert!(longest_park(&executed[0]).is_zero(), "the first seat was never off");
    assert!(!longest_park(&executed[1]).is_zero(), "the second was");
    assert!(executed.iter().all(|moves| moves.last().is_some_and(Move::stands_at_park)));
}
