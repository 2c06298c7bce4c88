//! A serial line as procedures have it: opened by what the configuration says of a link, and ours alone until it is dropped.

use std::path::PathBuf;
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
pub(crate) struct LinkLine {
    port: SerialPort,
    path: PathBuf,
    settings: SerialSettings,
}

impl LinkLine {
    /// Opens the port of a link.
    ///
    /// # Errors
    /// A [`SerialError`] that says what to do.
    pub(crate) fn open(link: &Link) -> Result<Self, SerialError> {
        let stop_bits = if link.stop_bits == 2 { StopBits::Two } else { StopBits::One };
        let is_rs485 = link.wiring == LinkWiring::Rs485;
        let settings = SerialSettings { baud: link.baud, stop_bits, is_rs485 };
        let port = SerialPort::open(&link.port, settings)?;
        Ok(Self { port, path: link.port.clone(), settings })
    }
}

impl LinkPort for LinkLine {
    fn now(&self) -> MonoTime {
        Monotonic.now()
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault> {
        let taken = self.port.line().write(octets, self.now() + HAND_OVER).map_err(|_| LinkFault)?;
        if taken == octets.len() { Ok(()) } else { Err(LinkFault) }
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        self.port.line().read(buf, deadline).map_err(|_| LinkFault)
    }

    fn flush(&mut self) -> usize {
        let (mut octets, mut dropped) = ([0; 64], 0);
        // A port that is gone is found by whoever asks next.
        while let Ok(count @ 1..) = self.port.line().read(&mut octets, MonoTime::default()) {
            dropped += count;
        }
        dropped
    }

    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault> {
        self.port.send_break(span).map_err(|_| LinkFault)
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        self.settings.baud = baud;
        self.port.set(&self.path, self.settings).map_err(|_| LinkFault)
    }

    fn sleep_until(&mut self, at: MonoTime) {
        Monotonic.sleep_until(at);
    }
}
