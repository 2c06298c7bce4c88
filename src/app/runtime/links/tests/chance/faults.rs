//! What fails by chance: octets on the way, the line, the port, the thread of the link, units.

use std::collections::BTreeMap;

use super::Rig;
use crate::app::runtime::links::tests::*;
use crate::sim::chance::Chance;

/// What fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Failing {
    /// Whole requests, answers and octets of answers, the adapter, the port, the thread of the link.
    Line,
    /// The same, and units: they are restarted, deaf, or have crystals that are off.
    Units,
    /// Octets that units hear: a digit that is another one is obeyed.
    Digits,
    /// Octets that nobody sent, between those that somebody did, in both directions.
    Noise,
}

/// What happens to the octets that go next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Harm {
    RequestLost,
    RequestTwice,
    /// The octet so far on in what is sent is lost, is there twice, or has another bit.
    RequestOctet(usize, OctetHarm),
    /// So many octets of the answer, or all up to the end of its line.
    AnswerLost(Option<usize>),
    AnswerOctet(usize, OctetHarm),
}

impl Harm {
    const fn name(self) -> &'static str {
        match self {
            Self::RequestLost => "request lost",
            Self::RequestTwice => "request twice",
            Self::RequestOctet(_, harm) => ["octet lost", "octet twice", "octet flipped"][harm.kind()],
            Self::AnswerLost(_) => "answer lost",
            Self::AnswerOctet(_, harm) => {
                ["answer's octet lost", "answer's octet twice", "answer's octet flipped"][harm.kind()]
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum OctetHarm {
    Lost,
    Twice,
    Flipped(u8),
}

impl OctetHarm {
    const fn kind(self) -> usize {
        match self {
            Self::Lost => 0,
            Self::Twice => 1,
            Self::Flipped(_) => 2,
        }
    }

    fn of(self, octet: u8) -> impl Iterator<Item = u8> {
        let (times, bit) = match self {
            Self::Lost => (0, 0),
            Self::Twice => (2, 0),
            Self::Flipped(bit) => (1, 1 << bit),
        };
        std::iter::repeat_n(octet ^ bit, times)
    }
}

/// What a line does to the octets that go over it next, if anything.
#[derive(Debug, Clone, Default)]
pub(super) struct Harms(Arc<Mutex<Option<Harm>>>);

/// A line that harms what goes over it.
pub(super) struct BadLine<B> {
    line: SharedLine<B>,
    harms: Harms,
    /// What came already and was not taken.
    back: Vec<u8>,
}

impl<B> BadLine<B> {
    pub(super) const fn new(line: SharedLine<B>, harms: Harms) -> Self {
        Self { line, harms, back: Vec::new() }
    }

    /// The harm, if it is for what goes this way.
    fn take(&self, is_out: bool) -> Option<Harm> {
        let is_for = |harm: &mut Harm| is_out != matches!(harm, Harm::AnswerLost(_) | Harm::AnswerOctet(..));
        self.harms.0.lock().unwrap().take_if(is_for)
    }

    fn put_back(&self, harm: Harm) {
        *self.harms.0.lock().unwrap() = Some(harm);
    }
}

impl<B: Bus> LinkPort for BadLine<B> {
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
                Some(harm @ Harm::AnswerLost(None)) if buf[0] != b'\r' => self.put_back(harm),
                Some(Harm::AnswerLost(Some(left @ 2..))) => self.put_back(Harm::AnswerLost(Some(left - 1))),
                Some(Harm::AnswerLost(_)) => {}
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
pub(super) struct Fate {
    pub(super) chance: Chance,
    pub(super) failing: Failing,
    harms: Harms,
    /// From one fault to the next, seconds, about.
    every: f64,
    next: MonoTime,
    /// When the line, the port and the units are whole again.
    mends: MonoTime,
    pub(super) faults: u64,
    /// Those while an axis moved.
    pub(super) in_motion: u64,
    places: Vec<f64>,
    pub(super) resets: u32,
    pub(super) kinds: BTreeMap<&'static str, u64>,
}

impl Fate {
    pub(super) fn new(seed: u64, failing: Failing, harms: Harms) -> Self {
        let mut chance = Chance::new(seed, 1);
        let every = 0.1 * 40.0_f64.powf(chance.draw());
        let (next, mends) = (NOW.get() + Duration::from_secs(2), MonoTime::default());
        Self {
            chance,
            failing,
            harms,
            every,
            next,
            mends,
            faults: 0,
            in_motion: 0,
            places: Vec::new(),
            resets: 0,
            kinds: BTreeMap::new(),
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
    pub(super) fn pass<B: Rig>(&mut self, hall: &mut Hall<'_, '_, B>) {
        let (now, places) = (NOW.get(), hall.really_mm());
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
            _ if self.failing == Failing::Noise => {
                hall.line.lock().line.faults.noise = 3 << self.below(9);
                self.mends = NOW.get() + self.span(0.1, 3.0);
                *self.kinds.entry("noise").or_default() += 1;
            }
            _ if self.failing == Failing::Digits => {
                let (at, harm) = self.octet();
                let twice = self.below(8) == 0;
                self.harm_next(if twice { Harm::RequestTwice } else { Harm::RequestOctet(at, harm) });
            }
            0 | 1 => self.harm_next(Harm::RequestLost),
            2 => self.harm_next(Harm::AnswerLost(B::ANSWER)),
            3 | 4 => {
                let (at, harm) = self.octet();
                self.harm_next(Harm::AnswerOctet(at, harm));
            }
            kind => self.break_for_a_while(hall, kind),
        }
    }

    fn harm_next(&mut self, harm: Harm) {
        *self.kinds.entry(harm.name()).or_default() += 1;
        *self.harms.0.lock().unwrap() = Some(harm);
    }

    fn break_for_a_while<B: Rig>(&mut self, hall: &Hall<'_, '_, B>, kind: u64) {
        let span = self.span(0.003, 0.6);
        let is_held = self.below(3) == 0;
        let mut port = hall.line.lock();
        let at = port.now;
        self.mends = NOW.get().max(self.mends) + span;
        let what = match kind {
            5 => {
                port.line.faults.unplugged = true;
                "line cut"
            }
            6 => {
                port.is_gone = true;
                "port gone"
            }
            // Nobody runs the thread of the link meanwhile; the adapter holds back what it has.
            7 if is_held => {
                port.sleep_until(at + span / 2);
                "thread held up"
            }
            7 => {
                (port.line.faults.late, port.line.faults.late_by) = (0.05, span / 8);
                "octets late"
            }
            kind => {
                let (what, is_reset) = port.line.bus_mut().fail(kind, &mut self.chance, at);
                self.resets += u32::from(is_reset);
                what
            }
        };
        *self.kinds.entry(what).or_default() += 1;
    }

    fn mend<B: Rig>(&mut self, hall: &Hall<'_, '_, B>) {
        let mut port = hall.line.lock();
        let at = port.now;
        port.line.faults = LineFaults::default();
        port.is_gone = false;
        port.line.bus_mut().mend(at);
        self.mends = MonoTime::default();
    }
}
