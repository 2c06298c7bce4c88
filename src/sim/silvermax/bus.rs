//! Units on one line.

use std::collections::VecDeque;
use std::time::Duration;

use super::unit::Unit;
use super::{Action, TICK_NS, UnitSetup};
use crate::sim::serial::Bus;
use crate::time::MonoTime;
use crate::wire::silvermax::{AnyRequest, Collected, LineCollector, MAX_LINE, Poll, Reply};

/// From the end of a request to its answer without ADL: what a unit takes to look at it.
const TURN: Duration = Duration::from_micros(200);

/// The codes of baud rates are in hundreds (BRT, page 35).
const BAUD: u8 = 174;

/// Virtual units that share a line.
#[derive(Debug)]
pub(crate) struct SilverBus {
    units: Vec<Unit>,
    baud: u32,
    collector: LineCollector,
    /// Octets to send, each with its earliest time.
    answers: VecDeque<(MonoTime, u8)>,
}

impl SilverBus {
    /// Units that have been on for long; their ticks begin at `start`.
    pub(crate) fn new(setups: &[UnitSetup], baud: u32, start: MonoTime) -> Self {
        let units = setups.iter().map(|setup| Unit::new(*setup, start)).collect();
        Self { units, baud, collector: LineCollector::of_requests(), answers: VecDeque::new() }
    }

    /// All units, in the order of their setups.
    pub(crate) fn units(&self) -> &[Unit] {
        &self.units
    }

    /// The same, to be changed.
    #[cfg(test)]
    pub(crate) fn units_mut(&mut self) -> &mut [Unit] {
        &mut self.units
    }

    /// Something happens now to the units with that number, or to all.
    pub(crate) fn act(&mut self, unit: Option<u8>, action: Action, now: MonoTime) {
        self.advance(now);
        let named = self.units.iter_mut().filter(|one| unit.is_none_or(|unit| one.number() == unit));
        named.for_each(|one| one.act(action, now));
    }

    /// All units hear a line.
    fn hear(&mut self, line: &[u8], now: MonoTime) {
        let Ok(request) = AnyRequest::parse(line) else { return };
        let mut answer = LineAnswer::default();
        for unit in &mut self.units {
            if let Some(reply) = unit.hear(&request) {
                let delay = TURN + Duration::from_nanos(u64::from(TICK_NS) * u64::from(unit.setup.adl));
                answer.add(&reply, now + delay);
                // In force before its answer (page 35); all units of a line are taken to follow.
                if let (BAUD, Reply::Ack { .. }, [code]) =
                    (request.number, reply, request.parameters.as_slice())
                {
                    self.baud = u32::try_from(100 * code).unwrap_or(self.baud);
                }
            }
        }
        self.answers.extend(answer.octets);
    }
}

/// What units say together: where two speak at once a bit is 0 if one of them has it so, and their bits do not fall on each other.
#[derive(Debug, Default)]
struct LineAnswer {
    octets: Vec<(MonoTime, u8)>,
}

impl LineAnswer {
    fn add(&mut self, reply: &Reply, at: MonoTime) {
        let mut buf = [0; MAX_LINE];
        let octets = reply.emit(&mut buf);
        for (index, octet) in octets.iter().enumerate() {
            match self.octets.get_mut(index) {
                Some((_, both)) => *both &= octet.rotate_right(3),
                None => self.octets.push((at, *octet)),
            }
        }
    }
}

impl Bus for SilverBus {
    fn on_octet(&mut self, octet: u8, now: MonoTime) {
        self.advance(now);
        match self.collector.push(octet) {
            Some(Collected::Line(line)) => {
                let mut kept = [0; MAX_LINE];
                let kept = &mut kept[..line.len()];
                kept.copy_from_slice(line);
                self.hear(kept, now);
            }
            Some(Collected::Stray(stray)) if stray.len() == MAX_LINE => {
                self.units.iter_mut().for_each(|unit| unit.status.news |= Poll::TOO_LONG);
            }
            Some(Collected::Stray(_)) | None => {}
        }
    }

    fn on_break(&mut self, _now: MonoTime) {
        self.collector.rest();
    }

    fn advance(&mut self, now: MonoTime) {
        self.units.iter_mut().for_each(|unit| unit.advance(now));
    }

    fn take_octet(&mut self, now: MonoTime) -> Option<u8> {
        self.answers.pop_front_if(|(at, _)| *at <= now).map(|(_, octet)| octet)
    }

    fn next(&self) -> Option<MonoTime> {
        self.answers.front().map(|(at, _)| *at)
    }

    fn baud(&self) -> u32 {
        self.baud
    }
}
