//! What is judged, and by what.

use std::net::Ipv4Addr;
use std::ops::RangeInclusive;

use crate::config::{Controller, FanOut, Station};
use crate::device::survey::Survey;
use crate::device::{Address, home, places, table};
use crate::motion::MAX_AXES;
use crate::net::Route;
use crate::time::Rate;
use crate::wire::{Dialect, motion_channel_and_slots, motion_len};

/// Bytes of the longest register message that preflight itself exchanges: a read of 32 registers answered.
const REGISTER_LEN: usize = 80;
/// Frames with vibration carry at most so many axes (SMC manual 2.2.2.9).
const MAX_VIBRATING_AXES: usize = 6;
/// Bytes of IP and UDP before each message.
const HEADERS_LEN: usize = 28;

/// What is known of one controller.
#[derive(Debug)]
pub(crate) struct Subject<'a> {
    /// What it should be.
    pub(crate) controller: &'a Controller<Station>,
    /// How many axes its seat has; `None` if nobody says.
    pub(crate) axes: Option<usize>,
    /// The way to it, or why there is none.
    pub(crate) route: Result<Route, String>,
    /// What it told; `None` if it could not be asked.
    pub(crate) survey: Option<&'a Survey>,
}

/// What a show will ask of the controllers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ShowTerms {
    /// The port that controllers answer to; 0 if it is another each time.
    pub(crate) frame_port: u16,
    /// Frames a second.
    pub(crate) rate_hz: f64,
    /// The axes of the cue, and whether it vibrates; `None` if no cue is known.
    pub(crate) cue: Option<(usize, bool)>,
}

/// Parameters that are judged.
const PARAMETERS: [RangeInclusive<u8>; 15] = [
    0x00..=0x0e,
    0x10..=0x1b,
    0x1e..=0x29,
    0x40..=0x48,
    0x4c..=0x4d,
    0x50..=0x51,
    0x54..=0x55,
    0x59..=0x59,
    0x60..=0x62,
    0x80..=0x85,
    0x90..=0x98,
    0x9d..=0x9d,
    0x9f..=0x9f,
    0xa0..=0xa5,
    0xb0..=0xb5,
];

/// The registers that are judged of a controller, as far as its manual has them.
#[must_use]
pub(crate) fn wanted(controller: &Controller<Station>) -> Vec<Address> {
    let parameters = PARAMETERS.into_iter().flatten().map(Address::Pa);
    let monitors = [home::DPF0, Address::Dp(0xfe), Address::Dp(0xff)];
    let known = |it: &Address| {
        table().get(*it).is_some_and(|register| register.dialect.has(controller.connection.dialect))
    };
    parameters.chain(places(controller.seat.axes)).chain(monitors).filter(known).collect()
}

impl Subject<'_> {
    /// True if it answered at all.
    #[must_use]
    pub(crate) fn answered(&self) -> bool {
        self.survey.is_some_and(Survey::answered)
    }

    /// What a parameter holds, where the controller has it and told.
    #[must_use]
    pub(crate) fn pa(&self, number: u8) -> Option<u16> {
        self.register(Address::Pa(number))
    }

    /// What a register holds, where the controller has it and told.
    #[must_use]
    pub(crate) fn register(&self, address: Address) -> Option<u16> {
        self.survey?.values.get(&address).copied()
    }

    /// An IPv4 address in four parameters; `None` if one is missing or no byte.
    #[must_use]
    pub(crate) fn ip(&self, first: u8) -> Option<Ipv4Addr> {
        let byte = |step| self.pa(first + step).and_then(|word| u8::try_from(word).ok());
        Some(Ipv4Addr::new(byte(0)?, byte(1)?, byte(2)?, byte(3)?))
    }

    /// Axes that it works with: the seat's, else what PA02 says.
    #[must_use]
    pub(crate) fn working_axes(&self) -> usize {
        self.axes.or_else(|| self.pa(0x02).map(usize::from)).unwrap_or(MAX_AXES).min(MAX_AXES)
    }
}

impl ShowTerms {
    /// The largest Time of the show's own frames, ms.
    #[must_use]
    pub(crate) fn frame_time_ms(&self) -> u32 {
        // The Times of one second hold every Time there is.
        let rate = Rate::from_hz(self.rate_hz);
        (0..1_000).map(|frame| rate.time_ms(frame)).max().unwrap_or(0)
    }

    /// The largest IP packet that goes to a controller or comes from it, bytes.
    #[must_use]
    pub(crate) fn packet_len(&self, controller: &Controller<Station>) -> usize {
        let cue_axes = self.cue.map_or_else(|| most_axes(controller), |(axes, _)| axes);
        let (_, slots) = motion_channel_and_slots(controller.frame_axes(cue_axes));
        let vibrates = self.cue.is_none_or(|(_, vibrates)| vibrates)
            && controller.connection.dialect == Dialect::Smc
            && slots <= MAX_VIBRATING_AXES;
        let frame = motion_len(slots, vibrates.then_some(controller.connection.vibration_port));
        frame.max(REGISTER_LEN) + HEADERS_LEN
    }
}

/// The most axes a frame to it may ever carry.
fn most_axes(controller: &Controller<Station>) -> usize {
    match controller.connection.fan_out {
        FanOut::Slice => controller.seat.axes,
        FanOut::Shared => MAX_AXES,
    }
}
