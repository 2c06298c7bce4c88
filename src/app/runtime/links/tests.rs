//! Whole plays to virtual units, in virtual time: tick loop, ack loop, planner and the loop of the link; judged by where axes really were.

#![expect(clippy::cast_possible_truncation, reason = "numbers of ticks")]

mod chance;
mod silvermax;
mod sixpack;

use std::cell::Cell;
use std::path::Path;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use super::*;
use crate::app::StagedShow;
use crate::app::runtime::{Loops, Numbers, Purpose, Runtime, RuntimeHandle};
use crate::belief::Reading;
use crate::cue::{self, Source};
use crate::drive::link::{LinkFault, LinkPort, TalkTerms, VirtualPort};
use crate::drive::silvermax::{Homing, Talk, home};
use crate::drive::{Manner, units_of};
use crate::engine::{Mix, Show};
use crate::health::HealthState;
use crate::net::{Delivery, DrainGrid, Network, Origin};
use crate::rt::{Command, Ticked};
use crate::sim::serial::{Bus, LineFaults, SerialLine};
use crate::sim::silvermax::{Action, SilverBus, Unit, UnitSetup};
use crate::state::{Event, Finding, LedBefore, Readiness, State, Transition};
use crate::time::{Clock, MonoTime, Rate, ShowTime};
use crate::timeline::Timeline;
use crate::wire::Timing;

const BAUD: u32 = 57_600;
const MM: f64 = 800.0;
/// Counts of 0 mm above the lower stop.
const ZERO: f64 = 3_200.0;

const HALL: &str = "[show]\nrate_hz = 100\n[link.stalls]\nport = \"/dev/ttyUSB0\"\n\
    [seat.s]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 4000\n\
    max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
    [seat.s.drive]\n\
    home = { way = \"switch\", input = 1, toward = \"down\", travel_mm = 165, zero_mm = -2, speed_mm_s = 50 }\n\
    torque = { hold = \"60%\", move = 1.0, full = 20000 }\n\
    [[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"link:stalls\"\ndialect = \"silvermax\"\nunits = [16, 17, 18]\n";

/// A hall without any controller on the network.
#[derive(Debug)]
struct Nobody;

impl Network for Nobody {
    fn lanes(&self) -> usize {
        0
    }

    fn send(&self, _lane: usize, _datagram: &[u8]) -> Delivery {
        unreachable!("nobody is there")
    }

    fn drain(&self, _on: &mut dyn FnMut(Origin, &[u8], MonoTime)) -> MonoTime {
        NOW.get()
    }

    fn port_closed(&self, _lane: usize) -> u64 {
        0
    }
}

thread_local! {
    /// The virtual time of the hall of a test.
    static NOW: Cell<MonoTime> = const { Cell::new(MonoTime::from_nanos(3_000_000_000)) };
}

/// Time that jumps to each deadline.
#[derive(Debug)]
struct Jumps;

impl Clock for Jumps {
    fn now(&self) -> MonoTime {
        NOW.get()
    }

    fn sleep_until(&self, at: MonoTime) {
        NOW.set(NOW.get().max(at));
    }
}

/// The line, which its loop has and the test looks at.
struct SharedLine<B = SilverBus>(Arc<Mutex<VirtualPort<B>>>);

impl<B> Clone for SharedLine<B> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<B: Bus> SharedLine<B> {
    /// A line without faults, of octets of so many bits.
    fn new(bus: B, bits: u32) -> Self {
        let port = VirtualPort::new(SerialLine::new(bus, bits, LineFaults::default(), 7), NOW.get());
        Self(Arc::new(Mutex::new(port)))
    }

    fn lock(&self) -> MutexGuard<'_, VirtualPort<B>> {
        self.0.lock().expect("nobody panics with it")
    }
}

impl<B: Bus> LinkPort for SharedLine<B> {
    fn now(&self) -> MonoTime {
        self.lock().now()
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault> {
        self.lock().send(octets)
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        self.lock().receive(buf, deadline)
    }

    fn flush(&mut self) -> usize {
        self.lock().flush()
    }

    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault> {
        self.lock().send_break(span)
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        self.lock().set_baud(baud)
    }

    fn sleep_until(&mut self, at: MonoTime) {
        self.lock().sleep_until(at);
    }
}

/// A hall of one seat, as a script leads it.
struct Hall<'h, 'l, B = SilverBus> {
    line: SharedLine<B>,
    runtime: RuntimeHandle,
    loops: &'h mut Loops<'l, Jumps>,
    drains: DrainGrid,
    ticked: Ticked,
    tell_at: MonoTime,
    next_drain: MonoTime,
    next_tick: MonoTime,
}

impl<B: Bus> Hall<'_, '_, B> {
    /// All loops, for so long.
    fn run(&mut self, seconds: f64, mut each: impl FnMut(&mut Self)) {
        let until = NOW.get() + Duration::from_secs_f64(seconds);
        while self.next_tick < until {
            let at = self.next_tick.min(self.next_drain);
            for link in &mut self.loops.links {
                while link.now() < at {
                    link.step();
                }
            }
            NOW.set(NOW.get().max(at));
            if at == self.next_drain {
                self.next_drain = self.loops.acks.step(&Jumps, self.drains, &mut self.tell_at);
            } else {
                self.loops.ticks.step(&mut self.ticked);
                self.next_tick = self.loops.ticks.grid.next_deadline();
                self.loops.plans.serve(&mut Vec::new());
                while self.runtime.news.take().is_some() {}
                each(self);
            }
        }
    }

    /// The whole program is held up for so long, while its line and drives go on.
    fn hold_up(&mut self, span: Duration) {
        let until = NOW.get() + span;
        self.line.lock().sleep_until(until);
        NOW.set(until);
    }

    /// That each frame that was handed over had its fate, and none is lost; some were withdrawn.
    fn assert_withdrawn(&self) {
        let counts = self.runtime.live.table()[0].counts;
        assert!(counts.acked > 300 && counts.withdrawn > 0, "{counts:?}");
        assert_eq!((counts.lost, counts.in_flight()), (0, 0), "{counts:?}");
        let times = self.runtime.live.times();
        assert_eq!((times.acks.len(), times.link_acks.len()), (0, counts.acked));
    }

    fn is_led(&self) -> bool {
        self.loops.ticks.engine.lane(0).gets_a_frame()
    }

    /// In a ride the port vanishes, and comes back under its name as the line of another seat: that it is not led.
    fn moves_nobody_on_another_line(
        &mut self,
        show: StagedShow,
        other: &SharedLine<B>,
        places: impl Fn(&B) -> Vec<f64>,
    ) {
        self.go(show);
        self.run(6.0, |_| {});
        assert!(self.is_led());
        self.line.lock().is_gone = true;
        self.run(0.3, |_| {});
        std::mem::swap(&mut self.line.lock().line, &mut other.lock().line);
        self.line.lock().is_gone = false;
        let before = places(self.line.lock().line.bus());
        self.run(10.0, |hall| hall.runtime.live.want(NOW.get()));
        let row = self.runtime.live.table().swap_remove(0);
        assert!(!self.is_led() && row.standing == HealthState::Excluded, "{row:?}");
        assert_eq!(places(self.line.lock().line.bus()), before, "{}", row.why);
    }

    /// That the seat at the far end of its line is not taken for its own, however often it is looked at, and nothing leads it.
    fn takes_no_other_seat(&mut self, places: impl Fn(&B) -> Vec<f64>) {
        let before = places(self.line.lock().line.bus());
        self.run(10.0, |hall| hall.runtime.live.want(NOW.get()));
        let row = self.runtime.live.table().swap_remove(0);
        assert!(!self.is_led() && self.reading().is_none(), "{row:?}");
        assert_eq!(places(self.line.lock().line.bus()), before, "{}", row.why);
    }

    /// That a seat which is held up for a second is read before it is led again, and not led while it is said to be lost.
    fn comes_back_after_a_second(&mut self, show: StagedShow, later: Duration) {
        self.go(show);
        self.run(6.0, |_| {});
        self.hold_up(Duration::from_secs(1) + later);
        let (mut led, mut lost) = (0, 0);
        self.run(6.0, |hall| {
            let is_lost = hall.runtime.live.table()[0].standing == HealthState::Lost;
            lost = if is_lost && hall.is_led() { lost + 1 } else { 0 };
            led += u32::from(hall.is_led());
            // Its last hold frames apart.
            assert!(lost < 30, "it is led by {lost} frames though it is lost");
        });
        let row = self.runtime.live.table().swap_remove(0);
        assert!(led > 200 && row.standing == HealthState::Ok, "{led} {row:?}");
    }

    fn ask(&mut self, commands: impl IntoIterator<Item = Command>) {
        for command in commands {
            self.runtime.commands.push(command).expect("there is room");
        }
    }

    fn state(&self) -> State {
        self.runtime.live.state()
    }

    fn reading(&self) -> Option<Reading> {
        self.runtime.live.evidence(0)?.reading().map(|(_, reading)| reading)
    }

    /// Lets a show go, once the seat was read.
    fn go(&mut self, show: StagedShow) {
        self.run(1.0, |hall| hall.runtime.live.want(NOW.get()));
        assert!(self.reading().is_some_and(|reading| reading.rests), "{:?}", self.reading());
        let found = Finding { homed: true, at_park: true, before: LedBefore::Ended };
        self.ask([
            Command::Event(Event::Identified(found)),
            Command::Event(Event::Readiness(Readiness::Ready)),
        ]);
        self.ask([
            Command::Load(show.loaded()),
            Command::Request(Transition::Arm),
            Command::Request(Transition::Go),
        ]);
    }
}

impl Hall<'_, '_> {
    fn units<T>(&self, of: impl Fn(&Unit) -> T) -> Vec<T> {
        self.line.lock().line.bus().units().iter().map(of).collect()
    }

    fn places_mm(&self) -> Vec<f64> {
        self.units(|unit| (unit.place() - ZERO) / MM)
    }

    /// Something pushes an axis so many mm off where its drive holds it, and is done with that after a second.
    fn push(&mut self, unit: Option<u8>, mm: f64) {
        let at = self.line.lock().now;
        self.line.lock().line.bus_mut().act(unit, Action::Pushed((mm * MM) as i32), at);
        self.run(1.0, |hall| hall.runtime.live.want(NOW.get()));
        self.line.lock().line.bus_mut().units_mut().iter_mut().for_each(Unit::forget_executed);
    }
}

/// Reads a configuration.
fn read(text: &str) -> Config {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("hall.toml");
    std::fs::write(&file, text).expect("it is written");
    crate::config::load(&file).expect("it is right")
}

/// The same hall with a seat of another name.
fn read_of_another(text: &str) -> Config {
    read(&text.replace("\"A1\"", "\"B1\""))
}

/// A line that leads to what another one led to: their adapters have changed places.
fn changed<B: Bus>(line: SharedLine<B>, other: &SharedLine<B>) -> SharedLine<B> {
    std::mem::swap(&mut line.lock().line, &mut other.lock().line);
    line
}

/// Opens a hall whose seat was homed, with a cue on it.
fn hall(lead: impl FnOnce(&mut Hall<'_, '_>, StagedShow, &Timeline)) {
    hall_over(|line| Box::new(line), lead);
}

/// The same, where its play has the line by a port of this kind.
fn hall_over(
    over: impl FnOnce(SharedLine) -> Port,
    lead: impl FnOnce(&mut Hall<'_, '_>, StagedShow, &Timeline),
) {
    hall_of(HALL, over, lead);
}

/// The same of another hall.
fn hall_of(
    text: &str,
    over: impl FnOnce(SharedLine) -> Port,
    lead: impl FnOnce(&mut Hall<'_, '_>, StagedShow, &Timeline),
) {
    let config = Arc::new(read(text));
    let line = homed_line(&config, 7 << 16);
    let port = over(line.clone());
    homed((config, 1.0), line, port, lead);
}

/// A line with three units whose seat was homed.
fn homed_line(config: &Config, canary: i32) -> SharedLine {
    NOW.set(MonoTime::from_nanos(3_000_000_000));
    let setups = [16, 17, 18].map(|unit| UnitSetup { place: 12_000, ..UnitSetup::new(unit) });
    let line = SharedLine::new(SilverBus::new(&setups, BAUD, NOW.get()), 11);
    let seat = units_of(&config.controllers[0]).expect("it has units");
    let homing = Homing { canary, goes_on: &|| true, told: &mut |_| {} };
    home(&mut Talk::new(line.clone(), TalkTerms::of(&config.links[0])), seat, homing)
        .expect("it finds its zero");
    line.lock().line.bus_mut().units_mut().iter_mut().for_each(Unit::forget_executed);
    line
}

/// Opens a hall whose seat was homed over a line, which its play has by a port, with a cue on it at a level.
fn homed<B: Bus>(
    (config, level): (Arc<Config>, f64),
    line: SharedLine<B>,
    port: Port,
    lead: impl FnOnce(&mut Hall<'_, '_, B>, StagedShow, &Timeline),
) {
    NOW.set(line.lock().now());
    let cue = cue::load(Path::new("cues/bench-ride.csv"), &Source::Native).expect("it ships");
    let show = Show { rate: Rate::from_hz(100.0), timing: Timing::Relative, start: ShowTime::ZERO, plays: 1 };
    let manner = Manner { level, silent: false };
    let staged = StagedShow::new(&config, Timeline::new(cue.clone()), show, manner).expect("there is a way");
    let purpose = Purpose::Play { silent: false, film: None };
    let network = crate::net::over(Arc::new(Nobody));
    let runtime =
        Runtime::over_all(config, purpose, &Numbers::new(), &Default::default(), network, vec![port])
            .expect("it opens");
    let origin = NOW.get() + Duration::from_millis(20);
    runtime.stepped(&Jumps, origin, |runtime, _, loops| {
        let desk = Arc::clone(&runtime.desk);
        // Thirty segments a second have no room for its vibration.
        desk.set(0, Mix { motion: level, vibration: 0.0, ..Mix::FULL });
        let mut hall = Hall {
            line,
            runtime,
            loops,
            drains: DrainGrid::new(origin, Duration::from_millis(10)),
            ticked: Ticked::default(),
            tell_at: origin,
            next_drain: origin,
            next_tick: origin,
        };
        lead(&mut hall, staged, &Timeline::new(cue));
    });
}

/// That no axis left its stroke, and none moved harder than a seat may.
fn assert_gentle(hall: &Hall<'_, '_>) {
    for unit in hall.units(|unit| unit.executed().clone()) {
        let mm = |counts: f64| counts / MM;
        let (low, high) = (mm(unit.lowest - ZERO), mm(unit.highest - ZERO));
        assert!(low > -0.1 && high < 150.1, "{low} to {high} mm");
        assert!(mm(unit.velocity) < 241.0, "{} mm/s", mm(unit.velocity));
        assert!(mm(unit.acceleration) < 3_030.0, "{} mm/s2", mm(unit.acceleration));
        assert_eq!(unit.jumps, 0);
    }
}
