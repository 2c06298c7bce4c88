//! A serial line as procedures have it: opened by what the configuration says of a link, and ours alone until it is dropped.

use std::time::Duration;

use super::{LinkFault, LinkPort};
use crate::config::Link;
use crate::config::link::LinkWiring;
use crate::sys::clock::Monotonic;
use crate::sys::serial::{SerialError, SerialPort, SerialSettings, StopBits};
use crate::time::{Clock as _, MonoTime};

/// How long the driver may take for a message: its buffer holds more than any.
const HAND_OVER: Duration = Duration::from_millis(50);

/// A line that is open.
#[derive(Debug)]
pub(crate) struct LinkLine(SerialPort);

impl LinkLine {
    /// Opens the port of a link.
    ///
    /// # Errors
    /// A [`SerialError`] that says what to do.
    pub(crate) fn open(link: &Link) -> Result<Self, SerialError> {
        let stop_bits = if link.stop_bits == 2 { StopBits::Two } else { StopBits::One };
        let is_rs485 = link.wiring == LinkWiring::Rs485;
        let settings = SerialSettings { baud: link.baud, stop_bits, is_rs485 };
        SerialPort::open(&link.port, settings).map(Self)
    }
}

impl LinkPort for LinkLine {
    fn now(&self) -> MonoTime {
        Monotonic.now()
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault> {
        let taken = self.0.line().write(octets, self.now() + HAND_OVER).map_err(|_| LinkFault)?;
        if taken == octets.len() { Ok(()) } else { Err(LinkFault) }
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        self.0.line().read(buf, deadline).map_err(|_| LinkFault)
    }

    fn flush(&mut self) -> usize {
        let (mut octets, mut dropped) = ([0; 64], 0);
        // A port that is gone is found by whoever asks next.
        while let Ok(count @ 1..) = self.0.line().read(&mut octets, MonoTime::default()) {
            dropped += count;
        }
        dropped
    }

    fn sleep_until(&mut self, at: MonoTime) {
        Monotonic.sleep_until(at);
    }
}
