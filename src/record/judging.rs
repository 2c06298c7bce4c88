//! What whoever judges the acks of a recording again has to know of its hall, as it stands in the metadata.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::config::{Config, Connection};
use crate::drive::Lane;
use crate::health::Groups;
use crate::time::nanos;
use crate::wire::Dialect;

/// How acks are judged in a hall.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Judging {
    /// A reply is asked for in each of so many frames; 0 in none.
    pub(crate) ack_every: u32,
    /// True if it homes its seats: one that does not know its zero is out.
    pub(crate) is_hall: bool,
    /// Its controllers, in the order of the seats.
    pub(crate) controllers: Vec<JudgedController>,
}

/// What has to be known of one of them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct JudgedController {
    /// The number of its group, from 0.
    pub(crate) group: usize,
    /// Its message set; none of drives on a link.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dialect: Option<RecordedDialect>,
    /// The inputs of which any one means an emergency stop, bit 0 = X01.
    pub(crate) estop_inputs: u16,
    /// The last two octets of its address, by which its messages name it.
    pub(crate) station: [u8; 2],
    /// So much later acks come than from a controller that executes what it has at once, ns.
    acked_after_ns: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RecordedDialect {
    Smc,
    Mbox,
}

impl Judging {
    /// That of a hall with these lanes.
    pub(crate) fn of(config: &Config, lanes: &[Lane], ack_every: u32, is_hall: bool) -> Self {
        let groups = Groups::of(&config.controllers);
        let controller = |(index, (controller, lane)): (usize, (&crate::config::Controller, &Lane))| {
            let (dialect, station) = match &controller.connection {
                Connection::Udp(station) => {
                    let dialect = match station.dialect {
                        Dialect::Smc => RecordedDialect::Smc,
                        Dialect::Mbox => RecordedDialect::Mbox,
                    };
                    let [_, _, column, row] = station.address.ip().octets();
                    (Some(dialect), [column, row])
                }
                Connection::Link(_) => (None, [0, 0]),
            };
            JudgedController {
                group: groups.group_of(index),
                dialect,
                estop_inputs: controller.estop_inputs,
                station,
                acked_after_ns: nanos(lane.window.acked_after()),
            }
        };
        let controllers = config.controllers.iter().zip(lanes).enumerate().map(controller).collect();
        Self { ack_every, is_hall, controllers }
    }

    /// What of it cannot be so in a hall of so many seats.
    pub(crate) fn fault(&self, seats: usize) -> Option<&'static str> {
        let is_first_of_links =
            |pair: &[JudgedController]| pair[0].dialect.is_some() || pair[1].dialect.is_none();
        if self.controllers.len() != seats {
            Some("not as many controllers as seats")
        } else if !self.controllers.windows(2).all(is_first_of_links) {
            Some("a controller on a link before one on the network")
        } else if self.controllers.iter().any(|one| one.group >= seats) {
            Some("a group with a number beyond those of the seats")
        } else {
            None
        }
    }
}

impl JudgedController {
    /// Its message set; none of drives on a link.
    pub(crate) fn dialect(&self) -> Option<Dialect> {
        self.dialect.map(|dialect| match dialect {
            RecordedDialect::Smc => Dialect::Smc,
            RecordedDialect::Mbox => Dialect::Mbox,
        })
    }

    /// So much later its acks come.
    pub(crate) const fn acked_after(&self) -> Duration {
        Duration::from_nanos(self.acked_after_ns)
    }

    /// An address with the octets by which its messages name it.
    pub(crate) const fn address(&self) -> SocketAddrV4 {
        let [column, row] = self.station;
        SocketAddrV4::new(Ipv4Addr::new(0, 0, column, row), 0)
    }
}
