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
/// How often it is asked whether it has sent what it was given, where it is late with that.
const LOOKS: Duration = Duration::from_micros(200);

/// A line. One that fails is closed, so that its name is free for what is plugged in next, and can be opened again.
#[derive(Debug)]
pub(crate) struct LinkLine {
    port: Option<SerialPort>,
    path: PathBuf,
    settings: SerialSettings,
}

impl LinkLine {
    /// Opens the port of a link.
    ///
    /// # Errors
    /// A [`SerialError`] that says what to do.
    pub(crate) fn open(link: &Link) -> Result<Self, SerialError> {
        let mut line = Self::closed(link);
        line.open_again()?;
        Ok(line)
    }

    /// The line of a link as long as its port cannot be had.
    pub(crate) fn closed(link: &Link) -> Self {
        let stop_bits = if link.stop_bits == 2 { StopBits::Two } else { StopBits::One };
        let is_rs485 = link.wiring == LinkWiring::Rs485;
        let settings = SerialSettings { baud: link.baud, stop_bits, is_rs485 };
        Self { port: None, path: link.port.clone(), settings }
    }

    fn open_again(&mut self) -> Result<(), SerialError> {
        if self.port.is_none() {
            self.port = Some(SerialPort::open(&self.path, self.settings)?);
        }
        Ok(())
    }

    /// All that was sent has left the driver: a break or another rate would make other orders of what is late.
    fn drain(&mut self) -> Result<(), LinkFault> {
        let deadline = self.now() + HAND_OVER;
        while self.with(|port| port.line().unsent().ok())? > 0 {
            if self.now() >= deadline {
                self.port = None;
                return Err(LinkFault);
            }
            self.sleep_until(self.now() + LOOKS);
        }
        Ok(())
    }

    /// Does something with the port, which is closed where that fails.
    fn with<T>(&mut self, does: impl FnOnce(&mut SerialPort) -> Option<T>) -> Result<T, LinkFault> {
        let done = self.port.as_mut().and_then(does);
        if done.is_none() {
            self.port = None;
        }
        done.ok_or(LinkFault)
    }
}

impl LinkPort for LinkLine {
    fn now(&self) -> MonoTime {
        Monotonic.now()
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault> {
        let deadline = self.now() + HAND_OVER;
        self.with(|port| {
            let taken = port.line().write(octets, deadline).ok()?;
            (taken == octets.len()).then_some(())
        })
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        self.with(|port| port.line().read(buf, deadline).ok())
    }

    fn flush(&mut self) -> usize {
        let (mut octets, mut dropped) = ([0; 64], 0);
        // A port that is gone is found by whoever asks next.
        while let Ok(count @ 1..) = self.receive(&mut octets, MonoTime::default()) {
            dropped += count;
        }
        dropped
    }

    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault> {
        self.drain()?;
        self.with(|port| port.send_break(span).ok())
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        self.settings.baud = baud;
        self.drain()?;
        let (path, settings) = (self.path.clone(), self.settings);
        self.with(|port| port.set(&path, settings).ok())
    }

    fn mend(&mut self) -> Result<(), SerialError> {
        self.open_again()
    }

    fn sleep_until(&mut self, at: MonoTime) {
        Monotonic.sleep_until(at);
    }
}
