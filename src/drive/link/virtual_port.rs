//! The host's end of a line in virtual time, with virtual drives at its far end.

use std::time::Duration;

use super::{LinkFault, LinkPort};
use crate::sim::chance::Chance;
use crate::sim::serial::{Bus, SerialLine};
use crate::time::MonoTime;

/// The host's end of a virtual line.
pub(crate) struct VirtualPort<B> {
    pub(crate) line: SerialLine<B>,
    pub(crate) now: MonoTime,
    /// The port is gone altogether.
    pub(crate) is_gone: bool,
    /// What was sent, with when.
    pub(crate) sent: Vec<(MonoTime, Vec<u8>)>,
    /// What happens to the line next, and when.
    pub(crate) script: Option<(MonoTime, Happening<B>)>,
    /// What damages the octets that are sent next, until it says that it has.
    pub(crate) damage: Option<Damage>,
    /// By how much its thread is late whenever it has waited.
    pub(crate) stalls: Option<Stalls>,
}

/// Something that happens to a line.
pub(crate) type Happening<B> = fn(&mut SerialLine<B>, MonoTime);

/// How late a thread of a real-time priority goes on that has waited: by 0.04 ms as a mean, one time in 50 by up to 1 ms, in 2,000 (once a
/// second, about) by up to 5 ms, in 100,000 (about once a minute) by 10 to 25 ms.
pub(crate) struct Stalls(pub(crate) Chance);

impl Stalls {
    fn next(&mut self) -> Duration {
        let (kind, part) = (self.0.bits() % 100_000, self.0.draw());
        Duration::from_secs_f64(match kind {
            0 => 0.01 + 0.015 * part,
            1..51 => 0.001 + 0.004 * part,
            51..2_051 => 0.000_1 + 0.000_9 * part,
            _ => -0.000_04 * (1.0 - part).ln(),
        })
    }
}

/// Damages octets that are sent; true if those were what it was for.
pub(crate) type Damage = Box<dyn FnMut(&mut Vec<u8>) -> bool + Send>;

impl<B: Bus> VirtualPort<B> {
    /// That of a line, from now on.
    pub(crate) fn new(line: SerialLine<B>, now: MonoTime) -> Self {
        Self { line, now, is_gone: false, sent: Vec::new(), script: None, damage: None, stalls: None }
    }

    /// Goes on in time, if that is later, when its thread is woken.
    fn wait(&mut self, at: MonoTime) {
        let late = self.stalls.as_mut().filter(|_| at > self.now).map_or(Duration::ZERO, Stalls::next);
        self.go(at + late);
    }

    /// Goes on in time, if that is later.
    fn go(&mut self, at: MonoTime) {
        if let Some((then, happens)) = self.script.take_if(|(then, _)| *then <= at) {
            self.line.advance(then);
            happens(&mut self.line, then);
        }
        self.now = self.now.max(at);
        self.line.advance(self.now);
    }
}

impl<B: Bus> LinkPort for VirtualPort<B> {
    fn now(&self) -> MonoTime {
        self.now
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault> {
        if self.is_gone {
            return Err(LinkFault);
        }
        let mut octets = octets.to_vec();
        self.damage.take_if(|damage| damage(&mut octets));
        self.line.send(&octets, self.now);
        self.sent.push((self.now, octets));
        Ok(())
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        if self.is_gone {
            return Err(LinkFault);
        }
        loop {
            self.line.advance(self.now);
            if let Some(octet) = self.line.receive(self.now) {
                buf[0] = octet;
                return Ok(1);
            }
            if self.now >= deadline {
                return Ok(0);
            }
            let next = self.line.next().map_or(deadline, |next| next.max(self.now).min(deadline));
            self.wait(next);
        }
    }

    fn flush(&mut self) -> usize {
        self.line.advance(self.now);
        std::iter::from_fn(|| self.line.receive(self.now)).count()
    }

    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault> {
        self.line.send_break(self.now);
        self.sleep_until(self.now + span);
        Ok(())
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        // What is plugged in again is opened at the rate that it was told last.
        self.line.set_host_baud(Some(baud));
        if self.is_gone { Err(LinkFault) } else { Ok(()) }
    }

    fn sleep_until(&mut self, at: MonoTime) {
        self.wait(at);
    }
}
