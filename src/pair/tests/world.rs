//! Two machines, the networks between them, and an engine, in virtual time: whatever can halt, get lost, come late, twice or in another
//! order, or be forgotten. In each instant in which a frame leaves, the other machine must not lead.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet};
use std::time::Duration;

use super::super::{Answer, Ask, BEAT, Beat, Claim, Holder, RENEW, Role, Want};
use crate::time::MonoTime;

const MS: u64 = 1_000_000;
/// From one frame to the next.
const FRAME: u64 = 10 * MS;
/// A beat that counts is not older.
const NEWS: u64 = 601 * MS;
/// The longest that a thread is held up between its look at the time and its frame: what the margins are for.
const HELD_UP: u64 = 197 * MS;

/// What goes wrong.
#[derive(Clone, Copy)]
pub(crate) struct Faults {
    /// Threads and whole machines halt, and machines die.
    halts: bool,
    /// Messages get lost, come late or twice; networks are cut.
    loses: bool,
    /// The engine starts anew with nothing in it.
    forgets: bool,
}

impl Faults {
    pub(crate) const ALL: Self = Self { halts: true, loses: true, forgets: true };
    pub(crate) const NONE: Self = Self { halts: false, loses: false, forgets: false };
}

#[derive(Clone, Copy)]
enum What {
    /// The pair's thread has something to do, unless the machine was started anew since.
    Beat,
    Hear(Beat),
    Ask,
    Answered(u64, Answer),
    /// What the tick thread is told at last.
    Told(MonoTime),
    /// The tick thread looks at the time, and what it decided by that goes out.
    Frame,
    Leaves,
}

#[derive(Clone, Copy)]
enum Happens {
    AtMachine {
        machine: usize,
        start: u64,
        what: What,
    },
    AtEngine {
        machine: usize,
        start: u64,
        ask: Ask,
    },
    Trouble,
    Starts(usize),
    /// The ways of whoever leads are cut: to the engine, or else between the machines.
    Cuts {
        engine: bool,
        millis: u64,
    },
}

struct Machine {
    claim: Claim,
    /// How often it was started; what is for an earlier start is gone with it.
    start: u64,
    is_alive: bool,
    /// What the tick thread compares with before it sends.
    gate: MonoTime,
    leads: bool,
    /// Its clock: nanoseconds ahead, and parts of a million fast.
    ahead: u64,
    ppm: i64,
    /// The pair's thread, and the tick thread, stand still until then.
    halted: [u64; 2],
}

impl Machine {
    fn local(&self, at: u64) -> MonoTime {
        let drift = i128::from(at) * i128::from(self.ppm) / 1_000_000;
        let ns = i128::from(at) + drift + i128::from(self.ahead);
        MonoTime::from_nanos(u64::try_from(ns).unwrap())
    }
}

pub(crate) struct World {
    seed: u64,
    dice: u64,
    faults: Faults,
    now: u64,
    order: u64,
    due: BinaryHeap<Reverse<(u64, u64)>>,
    happens: HashMap<u64, Happens>,
    machines: [Machine; 2],
    key: Option<(Holder, u64)>,
    writes: u64,
    /// Of each machine, to the engine.
    engine_cut: [u64; 2],
    partner_cut: u64,
    last_frame: u64,
    /// Every beat that was sent to a machine, and when: somebody records them, and sends some again.
    recorded: [Vec<(u64, Beat)>; 2],
    /// Which of them have counted, at which start of which machine.
    counted: HashSet<(usize, u64, u64, u64)>,
    pub(crate) takeovers: u64,
    pub(crate) frames: u64,
}

impl World {
    pub(crate) fn new(seed: u64, faults: Faults) -> Self {
        let machine = |number: usize| Machine {
            claim: Claim::new(1 + number as u64, number == 0, MonoTime::default()),
            start: 0,
            is_alive: false,
            gate: MonoTime::default(),
            leads: false,
            ahead: 0,
            ppm: 0,
            halted: [0, 0],
        };
        let mut world = Self {
            seed,
            dice: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d,
            faults,
            now: 0,
            order: 0,
            due: BinaryHeap::new(),
            happens: HashMap::new(),
            machines: [machine(0), machine(1)],
            key: None,
            writes: 0,
            engine_cut: [0, 0],
            partner_cut: 0,
            last_frame: 0,
            recorded: [Vec::new(), Vec::new()],
            counted: HashSet::new(),
            takeovers: 0,
            frames: 0,
        };
        for number in 0..2 {
            let (ahead, ppm) = (world.below(1 << 40), world.below(1_001) as i64 - 500);
            (world.machines[number].ahead, world.machines[number].ppm) = (ahead, ppm);
            world.start(number, false);
        }
        if faults.halts || faults.loses || faults.forgets {
            world.plan(100 * MS, Happens::Trouble);
        }
        world
    }

    fn below(&mut self, most: u64) -> u64 {
        self.dice ^= self.dice << 13;
        self.dice ^= self.dice >> 7;
        self.dice ^= self.dice << 17;
        (self.dice.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) % most.max(1)
    }

    fn plan(&mut self, after: u64, what: Happens) {
        self.order += 1;
        self.due.push(Reverse((self.now + after, self.order)));
        self.happens.insert(self.order, what);
    }

    fn plan_at(&mut self, machine: usize, after: u64, what: What) {
        let start = self.machines[machine].start;
        self.plan(after, Happens::AtMachine { machine, start, what });
    }

    fn start(&mut self, number: usize, alone: bool) {
        let session = self.below(1 << 50) + 1;
        let now = self.machines[number].local(self.now);
        let machine = &mut self.machines[number];
        machine.claim = Claim::new(session, number == 0, now);
        if alone {
            machine.claim.is_alone(now);
        }
        machine.start += 1;
        (machine.is_alive, machine.leads, machine.gate) = (true, false, MonoTime::default());
        for what in [What::Beat, What::Ask, What::Frame] {
            let after = self.below(10 * MS);
            self.plan_at(number, after, what);
        }
    }

    pub(crate) fn start_alone(&mut self, number: usize) {
        self.start(number, true);
    }

    pub(crate) fn kill(&mut self, number: usize) {
        let machine = &mut self.machines[number];
        machine.start += 1;
        (machine.is_alive, machine.leads) = (false, false);
    }

    /// Cuts the ways to the engine, and those between the machines, or mends them.
    pub(crate) fn cut(&mut self, engine: bool, partner: bool) {
        let until = |cut| if cut { u64::MAX } else { 0 };
        (self.engine_cut, self.partner_cut) = ([until(engine); 2], until(partner));
    }

    /// The engine has lost its memory.
    pub(crate) fn forget(&mut self) {
        (self.key, self.writes) = (None, 0);
    }

    /// Which machine leads, if one does.
    pub(crate) fn leader(&self) -> Option<usize> {
        (0..2).find(|&number| self.may_send(number))
    }

    fn may_send(&self, number: usize) -> bool {
        let machine = &self.machines[number];
        machine.is_alive && machine.local(self.now) < machine.gate
    }

    /// How long no frame left before the other one led.
    pub(crate) fn silence_until_the_other_leads(&mut self, most: Duration) -> Option<Duration> {
        let (since, frames) = (self.last_frame, self.frames);
        let until = self.now + u64::try_from(most.as_nanos()).unwrap();
        while self.now < until && self.frames == frames {
            self.run_for(Duration::from_millis(1));
        }
        (self.frames > frames).then(|| Duration::from_nanos(self.last_frame - since))
    }

    pub(crate) fn run_for(&mut self, time: Duration) {
        let until = self.now + u64::try_from(time.as_nanos()).unwrap();
        while let Some(&Reverse((at, order))) = self.due.peek()
            && at <= until
        {
            self.due.pop();
            self.now = at;
            match self.happens.remove(&order).unwrap() {
                Happens::AtMachine { machine, start, what } => self.at_machine(machine, start, what),
                Happens::AtEngine { machine, start, ask } => self.at_engine(machine, start, ask),
                Happens::Trouble => self.trouble(),
                Happens::Starts(number) if !self.machines[number].is_alive => self.start(number, false),
                Happens::Starts(_) => {}
                Happens::Cuts { engine, millis } => self.cut_leader(engine, millis),
            }
        }
        self.now = until;
    }

    fn at_machine(&mut self, number: usize, start: u64, what: What) {
        let machine = &self.machines[number];
        if machine.start != start || !machine.is_alive {
            return;
        }
        let thread = usize::from(matches!(what, What::Frame));
        let halted = machine.halted[thread];
        // A frame that is on its way out is held up by the halt alone that began meanwhile, and no longer than the margins allow.
        if halted > self.now && !matches!(what, What::Leaves | What::Told(_)) {
            return self.plan_at(number, halted - self.now, what);
        }
        let now = machine.local(self.now);
        match what {
            What::Frame => self.frame(number, now),
            What::Leaves => self.leaves(number),
            What::Told(until) => {
                let machine = &mut self.machines[number];
                machine.gate = machine.gate.max(until);
            }
            _ => self.pair(number, now, what),
        }
    }

    /// The pair's thread does one thing; what comes of it leaves at once, or after a halt.
    fn pair(&mut self, number: usize, now: MonoTime, what: What) {
        let after = if self.faults.halts && self.below(200) == 0 { self.below(3_000 * MS) } else { 0 };
        match what {
            What::Beat => {
                let beat = self.machines[number].claim.beat(now);
                self.send_beat(number, after, beat);
                self.plan_at(number, nanos(BEAT), What::Beat);
            }
            What::Ask => {
                let ask = self.machines[number].claim.ask(now);
                let start = self.machines[number].start;
                if let Some(way) = self.way(self.engine_cut[number]) {
                    self.plan(after + way, Happens::AtEngine { machine: number, start, ask });
                }
                if let Some(way) = self.again() {
                    self.plan(after + way, Happens::AtEngine { machine: number, start, ask });
                }
                self.plan_at(number, nanos(RENEW), What::Ask);
            }
            What::Hear(beat) => {
                if self.machines[number].claim.hear(&beat, now) {
                    self.counts(number, &beat);
                }
            }
            What::Answered(ticket, answer) => self.machines[number].claim.answer(ticket, answer, now),
            What::Told(_) | What::Frame | What::Leaves => unreachable!("the tick thread's"),
        }
        self.tell(number, now, after);
    }

    /// What counts as a beat has just been sent, and has not counted before.
    fn counts(&mut self, number: usize, beat: &Beat) {
        let recorded = &self.recorded[number];
        let index = recorded.iter().rposition(|(_, one)| one == beat).expect("nobody else has the key");
        let age = self.now - recorded[index].0;
        assert!(age < NEWS, "seed {}: a beat counts {} ms after it was sent", self.seed, age / MS);
        let is_first = self.counted.insert((number, self.machines[number].start, beat.from, beat.number));
        assert!(is_first, "seed {}: {beat:?} counts twice", self.seed);
    }

    fn tell(&mut self, number: usize, now: MonoTime, after: u64) {
        let role = self.machines[number].claim.role(now);
        if let Role::Leads { until } = role {
            if !std::mem::replace(&mut self.machines[number].leads, true) {
                self.takeovers += 1;
            }
            self.plan_at(number, after, What::Told(until));
        }
        if role == Role::Lost {
            // The program ends, and is started again.
            self.kill(number);
            self.plan(500 * MS, Happens::Starts(number));
        }
    }

    fn send_beat(&mut self, number: usize, after: u64, beat: Beat) {
        self.recorded[1 - number].push((self.now, beat));
        // Two networks.
        for _ in 0..2 {
            if let Some(way) = self.way(self.partner_cut) {
                self.plan_at(1 - number, after + way, What::Hear(beat));
            }
        }
        if let Some(way) = self.again() {
            self.plan_at(1 - number, after + way, What::Hear(beat));
        }
        if self.faults.loses && self.below(20) == 0 {
            let old = self.below(self.recorded[1 - number].len() as u64);
            let (_, beat) = self.recorded[1 - number][usize::try_from(old).expect("a place in it")];
            self.plan_at(1 - number, after, What::Hear(beat));
        }
    }

    /// How long a message takes; `None` where it does not arrive.
    fn way(&mut self, cut: u64) -> Option<u64> {
        if cut > self.now {
            return None;
        }
        if !self.faults.loses {
            return Some(MS / 4);
        }
        match self.below(20) {
            0 => None,
            1 => Some(self.below(3_000 * MS)),
            2 => Some(self.below(300 * MS)),
            _ => Some(self.below(2 * MS)),
        }
    }

    /// The same of a second copy that nobody sent.
    fn again(&mut self) -> Option<u64> {
        (self.faults.loses && self.below(20) == 0).then(|| self.below(5_000 * MS))
    }

    fn at_engine(&mut self, machine: usize, start: u64, ask: Ask) {
        let answer = match (ask.want, self.key) {
            (Want::Read, None) => Answer::NoKey,
            (Want::Read, Some((holder, revision))) => Answer::Key { holder, revision },
            (Want::Swap { revision, holder }, key) => {
                if revision == key.map_or(0, |(_, revision)| revision) {
                    self.writes += 1;
                    self.key = Some((holder, self.writes));
                    Answer::Granted { revision: self.writes }
                } else {
                    Answer::Refused
                }
            }
        };
        if self.machines[machine].start == start
            && let Some(way) = self.way(self.engine_cut[machine])
        {
            self.plan_at(machine, way, What::Answered(ask.ticket, answer));
        }
    }

    fn frame(&mut self, number: usize, now: MonoTime) {
        if now < self.machines[number].gate {
            let after = match self.below(8) {
                0 if self.faults.halts => self.below(HELD_UP),
                1 if self.faults.halts => HELD_UP,
                _ => 0,
            };
            self.plan_at(number, after, What::Leaves);
        }
        self.plan_at(number, FRAME, What::Frame);
    }

    fn leaves(&mut self, number: usize) {
        assert!(
            !self.may_send(1 - number),
            "seed {}: at {} ms machine {number} sends, and the other one leads",
            self.seed,
            self.now / MS
        );
        (self.frames, self.last_frame) = (self.frames + 1, self.now);
    }

    fn trouble(&mut self) {
        let Faults { halts, loses, forgets } = self.faults;
        let number = usize::from(self.below(2) == 0);
        let long = [100, 700, 1_500, 5_000][usize::try_from(self.below(4)).expect("below 4")] * MS;
        let until = self.now + self.below(long);
        match self.below(8) {
            0 if halts => self.machines[number].halted[0] = until,
            1 if halts => self.machines[number].halted = [until, until],
            2 if halts && self.machines[number].is_alive => {
                self.kill(number);
                let after = self.below(4_000 * MS);
                self.plan(after, Happens::Starts(number));
            }
            3 if loses => self.engine_cut[number] = until,
            4 if loses => self.engine_cut = [until, until],
            5 if loses => self.partner_cut = until,
            6 if forgets => self.forget(),
            7 if loses => {
                // Both go, one after the other: what is left is the last promise, to its end.
                let first = self.below(2) == 0;
                self.plan(0, Happens::Cuts { engine: first, millis: 6_000 });
                let after = (1_300 + self.below(1_500)) * MS;
                self.plan(after, Happens::Cuts { engine: !first, millis: 3_000 });
            }
            _ => {}
        }
        let after = self.below(1_500 * MS);
        self.plan(after, Happens::Trouble);
    }
}

impl World {
    fn cut_leader(&mut self, engine: bool, millis: u64) {
        let until = self.now + millis * MS;
        match self.leader() {
            Some(leader) if engine => self.engine_cut[leader] = until,
            _ => self.partner_cut = until,
        }
    }
}

fn nanos(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap()
}
