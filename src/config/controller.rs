//! `[[controller]]`: what moves one seat, and how it is reached.

use std::net::SocketAddrV4;
use std::ops::Range;
use std::sync::Arc;

use super::{Acceptance, Dialect, Drives, VibrationPort};
use crate::channel::SWITCHES;
use crate::motion::{MAX_AXES, SeatType};

/// What moves one seat: a controller on the network, or the drives of its axes on a serial link. Whoever knows only controllers on the
/// network takes `Controller<Station>`.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller<C = Connection> {
    /// Its name in reports, unlike any other's.
    pub(crate) name: String,
    /// The row its seat stands in.
    pub(crate) row: Option<String>,
    /// What it moves.
    pub seat: Arc<SeatType>,
    /// How it is reached.
    pub(crate) connection: C,
    /// PA95: its first axis is axis `axis_offset + 1` of the cue; 0 to 11.
    pub(crate) axis_offset: usize,
    /// Controllers under one rigid seat share a group; its own name by default.
    pub(crate) group: String,
    /// The effects it switches; `None` for all of them and every bit of a raw output word.
    pub(crate) effects: Option<Vec<String>>,
    /// The highest level of each output of the table that cues set ([`crate::channel::switches`]), 0 to 1; 0 where it has none.
    pub(crate) at_most: [f64; SWITCHES],
    /// The inputs of which any one means an emergency stop, bit 0 = X01; 0 if only its replies tell.
    pub estop_inputs: u16,
    /// The inputs of its belts, each active while its belt is open, bit 0 = X01; 0 for none.
    pub(crate) belt_inputs: u16,
    /// Findings of preflight that are accepted for good of this controller.
    pub(crate) accept_findings: Vec<Acceptance>,
}

/// How a controller is reached, and what only one has that is reached so.
#[derive(Debug, Clone, PartialEq)]
pub enum Connection {
    /// By datagrams.
    Udp(Station),
    /// By a serial link that it shares with others.
    Link(Drives),
}

/// A controller on the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Station {
    /// Where it listens (PA10 to PA14), unlike any other's.
    pub(crate) address: SocketAddrV4,
    /// Who applies the axis offset.
    pub(crate) fan_out: FanOut,
    /// The message set it speaks; an IMAX speaks that of MBOX.
    pub(crate) dialect: Dialect,
    /// How it has Port Out in vibration frames.
    pub(crate) vibration_port: VibrationPort,
    /// True if the object channel of its frames of more than six axes is their number (SMC manual 2.2.2.5), and not 2 (2.2.2.7).
    pub(crate) counts_axes: bool,
    /// The accept and reply code of its frames.
    pub(crate) accept: Accept,
}

impl Station {
    /// The accept and reply code in a frame to it.
    #[must_use]
    pub(crate) fn code(&self) -> u16 {
        self.accept.code(self.address)
    }
}

/// Who applies the axis offset (PA95).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FanOut {
    /// The host: a frame carries just the controller's own axes; PA95 is 0.
    Slice,
    /// The device: a frame carries all axes of the cue; PA95 is the axis offset.
    Shared,
}

/// The accept and reply code (SMC manual 2.2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Accept {
    /// ffff: whoever gets the datagram.
    All,
    /// The station's own code: the last two bytes of its address (PA12, PA13).
    Station,
    /// A code given as it is, not 0.
    Code(u16),
}

impl Accept {
    /// The code in a frame to the station at `address`.
    #[must_use]
    pub(crate) fn code(self, address: SocketAddrV4) -> u16 {
        let [_, _, xx, yy] = address.ip().octets();
        match self {
            Self::All => 0xffff,
            Self::Station => u16::from_be_bytes([xx, yy]),
            Self::Code(code) => code,
        }
    }
}

/// Axes of a cue that has every axis of these controllers.
#[must_use]
pub(crate) fn cue_axes<C>(controllers: &[Controller<C>]) -> usize {
    controllers.iter().map(|one| one.window().end).max().unwrap_or(1).min(MAX_AXES)
}

/// Who applies the axis offset of a controller.
pub trait FansOut {
    /// That.
    fn fan_out(&self) -> FanOut;
}

impl FansOut for Station {
    fn fan_out(&self) -> FanOut {
        self.fan_out
    }
}

impl FansOut for Connection {
    /// The host, for those on links.
    fn fan_out(&self) -> FanOut {
        match self {
            Self::Udp(station) => station.fan_out,
            Self::Link(_) => FanOut::Slice,
        }
    }
}

impl Controller {
    /// What it is on the network, where it is there.
    #[must_use]
    pub(crate) const fn station(&self) -> Option<&Station> {
        match &self.connection {
            Connection::Udp(station) => Some(station),
            Connection::Link(_) => None,
        }
    }

    #[cfg(test)]
    pub(crate) fn station_mut(&mut self) -> &mut Station {
        match &mut self.connection {
            Connection::Udp(station) => station,
            Connection::Link(_) => panic!("{} is on a link", self.name),
        }
    }

    /// The same controller as one of the network, where it is one.
    #[must_use]
    pub(crate) fn on_network(&self) -> Option<Controller<Station>> {
        self.station().map(|station| self.clone().connected(*station))
    }

    /// Its drives, where it has a link.
    #[must_use]
    pub(crate) const fn drives(&self) -> Option<&Drives> {
        match &self.connection {
            Connection::Udp(_) => None,
            Connection::Link(drives) => Some(drives),
        }
    }

    /// Where it is, in the words of the configuration: `IP:PORT` or `link:NAME`.
    #[must_use]
    pub(crate) fn address(&self) -> String {
        match &self.connection {
            Connection::Udp(station) => station.address.to_string(),
            Connection::Link(drives) => format!("link:{}", drives.link),
        }
    }
}

impl<C> Controller<C> {
    /// The same, reached otherwise.
    fn connected<D>(self, connection: D) -> Controller<D> {
        let Self { name, row, seat, axis_offset, group, effects, at_most, .. } = self;
        let Self { estop_inputs, belt_inputs, accept_findings, .. } = self;
        Controller {
            name,
            row,
            seat,
            connection,
            axis_offset,
            group,
            effects,
            at_most,
            estop_inputs,
            belt_inputs,
            accept_findings,
        }
    }

    /// True if axis `axis` of the cue, counted from 0, is one of its own.
    #[must_use]
    pub(crate) fn takes(&self, axis: usize) -> bool {
        self.window().contains(&axis)
    }

    /// The axes of the cue that are its own, counted from 0.
    #[must_use]
    pub(crate) fn window(&self) -> Range<usize> {
        self.seat.axes_from(self.axis_offset)
    }

    pub(super) fn switches(&self, effect: &str) -> bool {
        self.effects.as_ref().is_none_or(|names| names.iter().any(|name| name == effect))
    }
}

impl<C: FansOut> Controller<C> {
    /// Axes that its frames have to carry of a cue of `cue_axes` axes: just its own, or all up to its last.
    #[must_use]
    pub(crate) fn frame_axes(&self, cue_axes: usize) -> usize {
        match self.connection.fan_out() {
            FanOut::Slice => self.seat.axes,
            FanOut::Shared => cue_axes.max(self.window().end).min(MAX_AXES),
        }
    }

    /// The place of its first own axis in its frames.
    #[must_use]
    pub(crate) fn first_slot(&self) -> usize {
        match self.connection.fan_out() {
            FanOut::Slice => 0,
            FanOut::Shared => self.axis_offset,
        }
    }

    /// The axes of a cue of `cue_axes` axes that its frames carry, also those of others, from 0.
    pub(super) fn sees(&self, cue_axes: usize) -> Range<usize> {
        match self.connection.fan_out() {
            FanOut::Slice => self.window(),
            FanOut::Shared => 0..cue_axes,
        }
    }
}
