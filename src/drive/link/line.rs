//! A serial line, or a CAN bus, as procedures have it: opened by what the configuration says of a link, and ours alone until it is dropped.

use std::time::Duration;

use super::bus::BusPort;
use super::{LinkFault, LinkPort, MOST_STRAY};
use crate::config::Link;
use crate::config::link::LinkWiring;
#[cfg(test)]
use crate::sys::can::CanSocket;
use crate::sys::clock::Monotonic;
use crate::sys::serial::{CanError, SerialError, SerialPort, SerialSettings, StopBits};
use crate::time::{Clock as _, MonoTime};

/// How long the driver may take for a message: its buffer holds more than any.
const HAND_OVER: Duration = Duration::from_millis(50);
/// How often it is asked whether it has sent what it was given, where it is late with that.
const LOOKS: Duration = Duration::from_micros(200);

/// A line. One that fails is closed, so that its name is free for what is plugged in next, and can be opened again.
#[derive(Debug)]
pub(crate) struct LinkLine {
    port: Option<OpenPort>,
    link: Link,
}

#[derive(Debug)]
enum OpenPort {
    Serial(SerialPort),
    Bus(BusPort),
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
        Self { port: None, link: link.clone() }
    }

    /// That of a link over a bus that is open.
    #[cfg(test)]
    pub(crate) fn over(link: &Link, bus: CanSocket) -> Self {
        Self { port: Some(OpenPort::Bus(BusPort::over(bus))), link: link.clone() }
    }

    fn settings(&self) -> SerialSettings {
        let stop_bits = if self.link.stop_bits == 2 { StopBits::Two } else { StopBits::One };
        SerialSettings { baud: self.link.baud, stop_bits, is_rs485: self.link.wiring == LinkWiring::Rs485 }
    }

    fn open_again(&mut self) -> Result<(), SerialError> {
        let path = &self.link.port;
        if self.port.is_none() {
            self.port = Some(match self.link.wiring {
                LinkWiring::Can => OpenPort::Bus(BusPort::open(path)?),
                LinkWiring::Rs232 | LinkWiring::Rs485 => {
                    OpenPort::Serial(SerialPort::open(path, self.settings())?)
                }
            });
        }
        Ok(())
    }

    /// All that was sent has left the driver: a break or another rate would make other orders of what is late. What waits on a bus that
    /// nobody acknowledges cannot be taken back; so nothing more is handed over, and its port stays open.
    fn drain(&mut self) -> Result<(), LinkFault> {
        let deadline = self.now() + HAND_OVER;
        loop {
            let has_left = self.with(|port| match port {
                OpenPort::Serial(port) => Some(port.line().unsent().ok()? == 0),
                OpenPort::Bus(bus) => bus.drain(deadline).ok(),
            })?;
            match self.port {
                _ if has_left => return Ok(()),
                Some(OpenPort::Serial(_)) if self.now() < deadline => {
                    self.sleep_until(self.now() + LOOKS);
                }
                Some(OpenPort::Bus(_)) => return Err(LinkFault),
                _ => {
                    self.port = None;
                    return Err(LinkFault);
                }
            }
        }
    }

    /// Does something with the port, which is closed where that fails.
    fn with<T>(&mut self, does: impl FnOnce(&mut OpenPort) -> Option<T>) -> Result<T, LinkFault> {
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
            let is_taken = match port {
                OpenPort::Serial(port) => port.line().write(octets, deadline).ok()? == octets.len(),
                OpenPort::Bus(bus) => bus.send(octets, deadline).ok()?,
            };
            is_taken.then_some(())
        })
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        self.with(|port| match port {
            OpenPort::Serial(port) => port.line().read(buf, deadline).ok(),
            OpenPort::Bus(bus) => bus.read(buf, deadline).ok(),
        })
    }

    fn flush(&mut self) -> usize {
        let (mut octets, mut dropped) = ([0; 64], 0);
        // A port that is gone is found by whoever asks next.
        while dropped < MOST_STRAY
            && let Ok(count @ 1..) = self.receive(&mut octets, MonoTime::default())
        {
            dropped += count;
        }
        dropped
    }

    /// A frame of a bus begins by itself.
    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault> {
        self.drain()?;
        self.with(|port| match port {
            OpenPort::Serial(port) => port.send_break(span).ok(),
            OpenPort::Bus(_) => Some(()),
        })
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        self.link.baud = baud;
        self.drain()?;
        let (path, settings) = (self.link.port.clone(), self.settings());
        self.with(|port| match port {
            OpenPort::Serial(port) => port.set(&path, settings).ok(),
            OpenPort::Bus(_) => None, // that of a bus is the system's
        })
    }

    fn mend(&mut self, until: MonoTime) -> Result<(), SerialError> {
        if let Some(OpenPort::Bus(bus)) = &mut self.port {
            // What waited is followed at once by what is told next.
            match bus.drain(until) {
                Ok(true) => return Ok(()),
                Ok(false) => return Err(CanError::Unheard(self.link.port.clone()).into()),
                Err(_) => self.port = None,
            }
        }
        self.sleep_until(until);
        self.open_again()
    }

    fn sleep_until(&mut self, at: MonoTime) {
        Monotonic.sleep_until(at);
    }
}
