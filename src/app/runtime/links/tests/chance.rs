//! Plays over lines and units that fail by chance, judged by what the axes executed.
//!
//! `KINOCUE_FAULTS` is how many faults there are at least, `KINOCUE_SEED` the first seed.

use super::*;
use crate::sim::chance::Chance;
use crate::sim::silvermax::Action;

/// What fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Failing {
    /// Whole requests, answers and octets of answers, the adapter, the port, the thread of the link.
    Line,
    /// The same, and units: they are restarted, deaf, or have crystals that are off.
    Units,
    /// Octets that units hear: a digit that is another one is obeyed.
    Digits,
}

/// What happens to the octets that go next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Harm {
    RequestLost,
    RequestTwice,
    /// The octet so far on in what is sent is lost, is there twice, or has another bit.
    RequestOctet(usize, OctetHarm),
    AnswerLost,
    AnswerOctet(usize, OctetHarm),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum OctetHarm {
    Lost,
    Twice,
    Flipped(u8),
}

impl OctetHarm {
    fn of(self, octet: u8) -> impl Iterator<Item = u8> {
        let (times, bit) = match self {
            Self::Lost => (0, 0),
            Self::Twice => (2, 0),
            Self::Flipped(bit) => (1, 1 << bit),
        };
        std::iter::repeat_n(octet ^ bit, times)
    }
}

/// A line that harms what goes over it.
struct BadLine {
    line: SharedLine,
    harm: Arc<Mutex<Option<Harm>>>,
    /// What came already and was not taken.
    back: Vec<u8>,
}

impl BadLine {
    /// The harm, if it is for what goes this way.
    fn take(&self, is_out: bool) -> Option<Harm> {
        let is_for = |harm: &mut Harm| is_out != matches!(harm, Harm::AnswerLost | Harm::AnswerOctet(..));
        self.harm.lock().unwrap().take_if(is_for)
    }

    fn put_back(&self, harm: Harm) {
        *self.harm.lock().unwrap() = Some(harm);
    }
}

impl LinkPort for BadLine {
    fn now(&self) -> MonoTime {
        self.line.now()
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault> {
        match self.take(true) {
            Some(Harm::RequestLost) => Ok(()),
            Some(Harm::RequestTwice) => self.line.send(&[octets, octets].concat()),
            Some(Harm::RequestOctet(at, harm)) => {
                let at = at % octets.len();
                let sent: Vec<u8> = octets[..at]
                    .iter()
                    .copied()
                    .chain(harm.of(octets[at]))
                    .chain(octets[at + 1..].iter().copied())
                    .collect();
                self.line.send(&sent)
            }
            _ => self.line.send(octets),
        }
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        loop {
            if let Some(octet) = self.back.pop() {
                buf[0] = octet;
                return Ok(1);
            }
            if self.line.receive(&mut buf[..1], deadline)? == 0 {
                return Ok(0);
            }
            match self.take(false) {
                // Up to the end of the line.
                Some(harm @ Harm::AnswerLost) if buf[0] != b'\r' => self.put_back(harm),
                Some(Harm::AnswerLost) => {}
                Some(Harm::AnswerOctet(0, harm)) => self.back.extend(harm.of(buf[0])),
                Some(Harm::AnswerOctet(at, harm)) => {
                    self.put_back(Harm::AnswerOctet(at - 1, harm));
                    return Ok(1);
                }
                _ => return Ok(1),
            }
        }
    }

    fn flush(&mut self) -> usize {
        self.line.flush() + std::mem::take(&mut self.back).len()
    }

    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault> {
        self.line.send_break(span)
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        self.line.set_baud(baud)
    }

    fn sleep_until(&mut self, at: MonoTime) {
        self.line.sleep_until(at);
    }
}

/// Who lets things fail.
struct Fate {
    chance: Chance,
    failing: Failing,
    harm: Arc<Mutex<Option<Harm>>>,
    /// From one fault to the next, seconds, about.
    every: f64,
    next: MonoTime,
    /// When the line, the port and the units are whole again.
    mends: MonoTime,
    faults: u64,
    /// Those while an axis moved.
    in_motion: u64,
    places: Vec<f64>,
    resets: u32,
}

impl Fate {
    fn new(seed: u64, failing: Failing) -> Self {
        let mut chance = Chance::new(seed, 1);
        let every = 0.1 * 40.0_f64.powf(chance.draw());
        let (next, mends) = (NOW.get() + Duration::from_secs(2), MonoTime::default());
        Self {
            chance,
            failing,
            harm: Arc::default(),
            every,
            next,
            mends,
            faults: 0,
            in_motion: 0,
            places: Vec::new(),
            resets: 0,
        }
    }

    fn span(&mut self, least: f64, most: f64) -> Duration {
        Duration::from_secs_f64(least * (most / least).powf(self.chance.draw()))
    }

    fn below(&mut self, count: u64) -> u64 {
        self.chance.bits() % count
    }

    fn octet(&mut self) -> (usize, OctetHarm) {
        let at = self.below(30) as usize;
        let harm = match self.below(3) {
            0 => OctetHarm::Lost,
            1 => OctetHarm::Twice,
            _ => OctetHarm::Flipped(self.below(8) as u8),
        };
        (at, harm)
    }

    /// At each tick.
    fn pass(&mut self, hall: &mut Hall<'_, '_>) {
        let (now, places) = (NOW.get(), hall.places_mm());
        let places = std::mem::replace(&mut self.places, places);
        if now >= self.mends && self.mends > MonoTime::default() {
            self.mend(hall);
        }
        if now < self.next {
            return;
        }
        self.next = now + self.span(self.every / 3.0, self.every * 3.0);
        self.faults += 1;
        self.in_motion += u64::from(places != self.places);
        let kinds = if self.failing == Failing::Line { 8 } else { 12 };
        match self.below(kinds) {
            _ if self.failing == Failing::Digits => {
                let (at, harm) = self.octet();
                let twice = self.below(8) == 0;
                self.harm_next(if twice { Harm::RequestTwice } else { Harm::RequestOctet(at, harm) });
            }
            0 | 1 => self.harm_next(Harm::RequestLost),
            2 => self.harm_next(Harm::AnswerLost),
            3 | 4 => {
                let (at, harm) = self.octet();
                self.harm_next(Harm::AnswerOctet(at, harm));
            }
            kind => self.break_for_a_while(hall, kind),
        }
    }

    fn harm_next(&self, harm: Harm) {
        *self.harm.lock().unwrap() = Some(harm);
    }

    fn break_for_a_while(&mut self, hall: &Hall<'_, '_>, kind: u64) {
        let span = self.span(0.003, 0.6);
        let (index, number) = (self.below(3) as usize, 16 + self.below(3) as u8);
        let mut port = hall.line.lock();
        let at = port.now;
        self.mends = NOW.get().max(self.mends) + span;
        let mut act = |action| port.line.bus_mut().act(Some(number), action, at);
        match kind {
            5 => port.line.faults.unplugged = true,
            6 => port.is_gone = true,
            // Nobody runs the thread of the link meanwhile; the adapter holds back what it has.
            7 if index == 0 => port.sleep_until(at + span / 2),
            7 => (port.line.faults.late, port.line.faults.late_by) = (0.05, span / 8),
            8 if self.chance.bits().is_multiple_of(8) => {
                act(Action::Reset);
                self.resets += 1;
            }
            8 | 9 => act(Action::Dead(true)),
            10 => act(Action::AnswersAs(Some(16 + index as u8))),
            _ => act(Action::Crystal(300 * (index as i32 - 1))),
        }
    }

    fn mend(&mut self, hall: &Hall<'_, '_>) {
        let mut port = hall.line.lock();
        let at = port.now;
        port.line.faults = LineFaults::default();
        port.is_gone = false;
        for action in [Action::Dead(false), Action::AnswersAs(None)] {
            port.line.bus_mut().act(None, action, at);
        }
        self.mends = MonoTime::default();
    }
}

/// What came of the plays of some seeds.
#[derive(Debug, Default)]
struct Sum {
    faults: u64,
    in_motion: u64,
    /// Plays in which an axis moved faster or harder than a seat may.
    hard: u64,
    velocity: f64,
    acceleration: f64,
}

impl Sum {
    /// Plays to a seat while things fail, then stops it.
    fn play(&mut self, seed: u64, failing: Failing) {
        let harm: Arc<Mutex<Option<Harm>>> = Arc::default();
        let bad = Arc::clone(&harm);
        hall_over(
            |line| Box::new(BadLine { line, harm: bad, back: Vec::new() }),
            |hall, show, _| {
                let lead = show.lanes[0].window.lead();
                hall.go(show);
                let mut fate = Fate { harm, ..Fate::new(seed, failing) };
                let seconds = 4.0 + 18.0 * fate.chance.draw();
                hall.run(seconds, |hall| fate.pass(hall));
                hall.runtime.desk.stop();
                // What it has braked by itself is over by then, too, if nobody could tell it to stop.
                hall.run(lead.as_secs_f64() + 0.3, |hall| fate.pass(hall));
                let places = hall.places_mm();
                hall.run(1.0, |hall| fate.pass(hall));
                if failing == Failing::Line {
                    assert_eq!(hall.places_mm(), places, "seed {seed}: it rests after a stop");
                }
                self.judge(hall, &fate, seed);
            },
        );
    }

    fn judge(&mut self, hall: &Hall<'_, '_>, fate: &Fate, seed: u64) {
        let failing = fate.failing;
        for (unit, resets) in hall.units(|unit| (unit.executed().clone(), unit.tally().resets)) {
            let mm = |counts: f64| counts / MM;
            let (low, high) = (mm(unit.lowest - ZERO), mm(unit.highest - ZERO));
            let room = if failing == Failing::Digits { 1.01 } else { 0.1 };
            let (velocity, acceleration) = (mm(unit.velocity), mm(unit.acceleration));
            let what = format!(
                "seed {seed}, {failing:?}: {low} to {high} mm, {velocity} mm/s, {acceleration} mm/s2, {resets} restarts"
            );
            assert!(low > -room && high < 150.0 + room, "{what}");
            assert!(unit.jumps <= resets && (resets <= fate.resets || failing == Failing::Digits), "{what}");
            let is_hard = velocity > 241.0 || acceleration > 3_030.0;
            // A unit that is restarted stops as no seat does, by itself.
            assert!(!is_hard || failing == Failing::Digits || resets > 0, "{what}");
            self.hard += u64::from(is_hard && resets == 0);
            self.velocity = self.velocity.max(velocity);
            self.acceleration = self.acceleration.max(acceleration);
        }
        self.faults += fate.faults;
        self.in_motion += fate.in_motion;
    }
}

fn setting(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|value| value.parse().expect("a number"))
}

/// As many plays as there are faults to be, or enough of them for a quick look.
#[expect(clippy::print_stdout, reason = "the figures are for who asks to see them")]
fn plays(failing: Failing) {
    let (faults, mut seed) = (setting("KINOCUE_FAULTS").unwrap_or(60), setting("KINOCUE_SEED").unwrap_or(1));
    let (first, mut sum) = (seed, Sum::default());
    while sum.faults < faults {
        sum.play(seed, failing);
        seed += 1;
    }
    println!("{failing:?}, seeds {first} to {}: {sum:?}", seed - 1);
}

#[test]
fn whatever_fails_on_a_line_no_axis_leaves_its_stroke_or_moves_harder_than_a_seat_may() {
    plays(Failing::Line);
}

#[test]
fn whatever_units_do_beside_no_axis_leaves_its_stroke_or_moves_harder_than_a_seat_may() {
    plays(Failing::Units);
}

#[test]
fn digits_that_units_hear_wrongly_lead_no_axis_beyond_its_soft_limits() {
    plays(Failing::Digits);
}
