//! A serial line in virtual time: an octet takes as long as its bits at the baud rate, both ways at once.

use std::collections::VecDeque;
use std::time::Duration;

use super::{Bus, LineFaults};
use crate::sim::chance::Chance;
use crate::time::{MonoTime, nanos};

/// How far two ends may differ in their baud rate before nothing is understood, in parts of a hundred.
const BAUD_TOLERANCE: u32 = 4;

/// A line with a bus at its far end.
#[derive(Debug)]
pub(crate) struct SerialLine<B> {
    bus: B,
    /// Bits of an octet with start and stop: 10 or 11.
    bits: u32,
    /// At which the host sends and listens; at that of the bus where nobody has set it.
    host_baud: Option<u32>,
    /// What it does to octets.
    pub(crate) faults: LineFaults,
    chance: Chance,
    /// What the host sends, each at its rate; breaks as none.
    out: Wire<Option<(u8, Option<u32>)>>,
    back: Wire<u8>,
    /// The answer that is being sent is lost.
    is_losing: bool,
    /// When the next octet comes that nobody sent, and which way.
    noise: Option<(MonoTime, bool)>,
}

/// One direction.
#[derive(Debug)]
struct Wire<T> {
    /// When each octet has wholly arrived, in their order.
    octets: VecDeque<(MonoTime, T)>,
    /// When the last one had.
    free: MonoTime,
}

impl<T> Wire<T> {
    const fn empty() -> Self {
        Self { octets: VecDeque::new(), free: MonoTime::from_nanos(0) }
    }

    /// Puts an octet on the wire once that is free.
    fn put(&mut self, octet: T, now: MonoTime, takes: Duration) {
        self.free = self.free.max(now) + takes;
        self.octets.push_back((self.free, octet));
    }
}

impl<B: Bus> SerialLine<B> {
    /// A line of octets of so many bits, start and stop among them; the same seed gives the same faults.
    pub(crate) fn new(bus: B, bits: u32, faults: LineFaults, seed: u64) -> Self {
        Self {
            bus,
            bits,
            host_baud: None,
            faults,
            chance: Chance::new(seed, 0),
            out: Wire::empty(),
            back: Wire::empty(),
            is_losing: false,
            noise: None,
        }
    }

    /// What hangs at the far end.
    pub(crate) const fn bus(&self) -> &B {
        &self.bus
    }

    /// The same, to be told what happens to it.
    pub(crate) const fn bus_mut(&mut self) -> &mut B {
        &mut self.bus
    }

    /// From now on the host sends and listens at this rate; where none is named, always at that of the bus.
    pub(crate) const fn set_host_baud(&mut self, baud: Option<u32>) {
        self.host_baud = baud;
    }

    /// The host sends octets.
    pub(crate) fn send(&mut self, octets: &[u8], now: MonoTime) {
        self.advance(now);
        if self.faults.unplugged {
            return;
        }
        let takes = self.octet_time(self.host_baud.unwrap_or_else(|| self.bus.baud()));
        for octet in octets {
            if self.faults.echo {
                self.back.put(*octet, now, takes);
            }
            let (count, octet, late) = self.harm(*octet);
            for _ in 0..count {
                self.out.put(Some((octet, self.host_baud)), now + late, takes);
            }
        }
    }

    /// The host begins a break, which takes effect behind what is on its way.
    pub(crate) fn send_break(&mut self, now: MonoTime) {
        self.advance(now);
        if !self.faults.unplugged {
            self.out.put(None, now, Duration::ZERO);
        }
        self.advance(now);
    }

    /// All that happens up to now, in its order.
    pub(crate) fn advance(&mut self, now: MonoTime) {
        self.make_noise(now);
        loop {
            let arrival = self.out.octets.front().map(|(at, _)| *at);
            let due = [arrival, self.bus.next()].into_iter().flatten().min();
            let Some(at) = due.filter(|at| *at <= now) else { break };
            self.bus.advance(at);
            if arrival == Some(at)
                && let Some((_, octet)) = self.out.octets.pop_front()
            {
                match octet {
                    Some((octet, baud)) => self.bus.on_octet(self.heard(octet, baud), at),
                    None => self.bus.on_break(at),
                }
            }
            let is_stuck = self.take_answers(at) == 0 && arrival != Some(at) && self.bus.next() == Some(at);
            debug_assert!(!is_stuck, "a bus that asked for {at:?} and did nothing then");
            if is_stuck {
                break;
            }
        }
        self.bus.advance(now);
        self.take_answers(now);
    }

    /// The next octet that the host has wholly received by now.
    pub(crate) fn receive(&mut self, now: MonoTime) -> Option<u8> {
        if self.faults.unplugged {
            self.back.octets.clear();
        }
        let (at, _) = self.back.octets.front()?;
        let is_there = self.released(*at) <= now;
        is_there.then(|| self.back.octets.pop_front()).flatten().map(|(_, octet)| octet)
    }

    /// When the next thing happens, if any is under way.
    pub(crate) fn next(&self) -> Option<MonoTime> {
        let arrival = self.out.octets.front().map(|(at, _)| *at);
        let back = self.back.octets.front().map(|(at, _)| self.released(*at));
        let noise = self.noise.map(|(at, _)| at);
        [arrival, back, noise, self.bus.next()].into_iter().flatten().min()
    }

    /// Puts on the wires what nobody sends by now.
    fn make_noise(&mut self, now: MonoTime) {
        if self.faults.noise == 0 {
            self.noise = None;
            return;
        }
        while let Some((at, is_out)) = self.noise.filter(|(at, _)| *at <= now) {
            let takes = self.octet_time(self.host_baud.unwrap_or_else(|| self.bus.baud()));
            #[expect(clippy::cast_possible_truncation, reason = "any octet")]
            let octet = self.chance.bits() as u8;
            match is_out {
                _ if self.faults.unplugged => {}
                true => self.out.put(Some((octet, self.host_baud)), at, takes),
                false => self.back.put(octet, at, takes),
            }
            self.noise = Some(self.next_noise(at));
        }
        self.noise = self.noise.or_else(|| Some(self.next_noise(now)));
    }

    fn next_noise(&mut self, at: MonoTime) -> (MonoTime, bool) {
        let seconds = -(1.0 - self.chance.draw()).ln() / f64::from(self.faults.noise);
        (at + Duration::from_secs_f64(seconds), self.chance.bits().is_multiple_of(2))
    }

    /// When an adapter hands over what has come at `at`: where its latency timer runs out next.
    fn released(&self, at: MonoTime) -> MonoTime {
        match nanos(self.faults.held) {
            0 => at,
            held => MonoTime::from_nanos(at.as_nanos().div_ceil(held).saturating_mul(held)),
        }
    }

    /// Takes from the bus what it sends by now: how many octets.
    fn take_answers(&mut self, now: MonoTime) -> usize {
        let mut taken = 0;
        while let Some(octet) = self.bus.take_octet(now) {
            taken += 1;
            if self.back.free < now {
                self.is_losing = self.loses_answer();
            }
            let takes = self.octet_time(self.bus.baud());
            let octet = self.heard(octet, self.host_baud);
            if self.is_losing {
                self.back.free = self.back.free.max(now) + takes;
                continue;
            }
            let (count, octet, late) = self.harm(octet);
            for _ in 0..count {
                self.back.put(octet, now + late, takes);
            }
        }
        taken
    }

    fn loses_answer(&mut self) -> bool {
        if self.faults.lose_answers > 0 {
            self.faults.lose_answers -= 1;
            return true;
        }
        self.chance.draw() < self.faults.answer_lost
    }

    /// An octet as it is heard at the other end: as another where the two ends differ in their rate.
    fn heard(&self, octet: u8, host: Option<u32>) -> u8 {
        let bus = self.bus.baud();
        let differs = |host: u32| u64::from(host.abs_diff(bus)) * 100 > u64::from(BAUD_TOLERANCE * bus);
        if host.is_some_and(differs) { !octet } else { octet }
    }

    /// How often an octet arrives, as what, and how much later.
    fn harm(&mut self, octet: u8) -> (u32, u8, Duration) {
        let mut hits = |chance: f64| chance > 0.0 && self.chance.draw() < chance;
        let LineFaults { lost, doubled, flipped, late, late_by, .. } = self.faults;
        let (is_lost, is_doubled) = (hits(lost), hits(doubled));
        let (is_flipped, is_late) = (hits(flipped), hits(late));
        let bit = if is_flipped { 1 << (self.chance.bits() % 8) } else { 0 };
        let count = if is_lost { 0 } else { 1 + u32::from(is_doubled) };
        (count, octet ^ bit, if is_late { late_by } else { Duration::ZERO })
    }

    fn octet_time(&self, baud: u32) -> Duration {
        Duration::from_nanos(u64::from(self.bits) * 1_000_000_000 / u64::from(baud.max(1)))
    }
}
