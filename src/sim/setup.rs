//! What virtual controllers are told before they start.

use std::fs::File;
use std::net::SocketAddrV4;
use std::time::Duration;

use super::{Command, Invented, pa};
use crate::wire::Dialect;

/// One virtual controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setup {
    /// Working axes, 1 to 12 (PA02).
    pub axes: u16,
    /// Parameters that differ from the manual's defaults, as (register, value); a later one wins. They count as saved,
    /// and are not checked: a controller may come with anything.
    pub parameters: Vec<(u8, u16)>,
    /// The port that frames must come from (PA24); 0 takes any.
    pub host_port: u16,
    /// Which family it belongs to.
    pub dialect: Dialect,
    /// Obeys, but never answers and never reports.
    pub mute: bool,
    /// From when on an emergency stop is in effect, after its start; never where there is none.
    pub estop_at: Option<Duration>,
    /// What the manuals leave open.
    pub invented: Invented,
}

impl Default for Setup {
    /// A controller of three axes as it leaves the factory.
    fn default() -> Self {
        Self {
            axes: 3,
            parameters: Vec::new(),
            host_port: 8410,
            dialect: Dialect::Smc,
            mute: false,
            estop_at: None,
            invented: Invented::default(),
        }
    }
}

impl Setup {
    /// Puts settings that are safe for people before its other parameters: an emergency stop at input X01 that holds
    /// until a reset, quick filter, slow release, speed limits, answers, and status reports to `host` every 100 ms.
    #[must_use]
    pub fn safe(mut self, host: SocketAddrV4) -> Self {
        let mut parameters = vec![
            (pa::MAX_RPM, 3_000),
            (pa::ANSWERS, 1),
            (pa::INPUT_FUNCTIONS, 1),
            (pa::ESTOP_WAY, 2),
            (pa::ESTOP_INPUTS, 1),
            (pa::INPUT_FILTER, 20),
            (pa::RELEASE_RPM, 300),
        ];
        parameters.extend((pa::HOST..).zip(host.ip().octets().map(u16::from)));
        if self.dialect == Dialect::Smc {
            let smc = [(pa::MODE, 10), (pa::AUTO_RESET, 0), (pa::REPORT_INTERVAL, 100), (pa::REPORTS, 1)];
            parameters.extend(smc);
            parameters.extend((pa::AXIS_RPM..).zip([3_000; 6]));
        } else {
            parameters.push((pa::FILTER_DEPTH, 0));
        }
        parameters.append(&mut self.parameters);
        Self { parameters, host_port: host.port(), ..self }
    }
}

/// What the network does to datagrams, on purpose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LinkFaults {
    /// Chance that a datagram goes unanswered, 0 to 1: half of those never arrive, of the others the answer is lost.
    pub loss: f64,
    /// Chance that an answer comes twice, 0 to 1.
    pub duplicate: f64,
    /// How much later answers leave.
    pub delay: Duration,
}

/// A farm of virtual controllers.
#[derive(Debug)]
pub struct Options {
    /// Where the first one listens; the others at the ports after it. With port 0 each gets a free one.
    pub listen: SocketAddrV4,
    /// The controllers in the order of their ports.
    pub controllers: Vec<Setup>,
    /// What the network does.
    pub faults: LinkFaults,
    /// What chance begins with; the same seed meets the same datagrams with the same faults.
    pub seed: u64,
    /// Takes a CSV row for each motion frame; emptied once all sockets are bound.
    pub log: Option<File>,
    /// Takes a CSV row for each move that the motors ran; emptied like the other.
    pub moves: Option<File>,
    /// What happens when, counted from the start; in any order.
    pub script: Vec<(Duration, Command)>,
}

impl Options {
    /// Faultless controllers at free ports of 127.0.0.1.
    #[must_use]
    pub const fn loopback(controllers: Vec<Setup>) -> Self {
        Self {
            listen: SocketAddrV4::new(std::net::Ipv4Addr::LOCALHOST, 0),
            controllers,
            faults: LinkFaults { loss: 0.0, duplicate: 0.0, delay: Duration::ZERO },
            seed: 0,
            log: None,
            moves: None,
            script: Vec::new(),
        }
    }
}
