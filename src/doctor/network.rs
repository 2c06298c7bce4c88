//! Tables and buffers that a hall of many controllers can outgrow.

use super::{FindingLine, Hall, Seen, count};
use crate::net::SendCost;
use crate::sys::machine::ProcessLimit;

/// What is known of the network's limits.
#[derive(Debug, Clone)]
pub(crate) struct NetworkFacts {
    /// Sizes of the table of neighbours.
    pub(crate) neighbours: Seen<NeighbourTable>,
    /// Bytes that a socket's receive buffer may be asked to have (`rmem_max`).
    pub(crate) receive_max: Seen<u64>,
    /// Bytes that it has unasked (`rmem_default`).
    pub(crate) receive_default: Seen<u64>,
    /// Pages that all UDP sockets of the machine may fill together (the last of `udp_mem`).
    pub(crate) udp_pages: Seen<u64>,
    /// Files that the process may have open.
    pub(crate) files: ProcessLimit,
    /// What a frame costs.
    pub(crate) sending: Seen<SendCost>,
}

/// The kernel's table of link addresses, `net.ipv4.neigh.default.gc_thresh1` to `3`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NeighbourTable {
    /// Below this many entries none is ever dropped.
    pub(crate) kept: u64,
    /// Above this many those that are older than 5 s are dropped when one is added.
    pub(crate) tidied: u64,
    /// There are never more than this.
    pub(crate) most: u64,
}

/// Neighbours that are no controllers: consoles, servers, gateways.
const OTHER_NEIGHBOURS: u64 = 32;
/// Files that a play has open beside its sockets.
const OTHER_FILES: u64 = 64;
/// Replies of a controller in 5 ms at 1 kHz: how long the thread that reads them may be kept from running.
const REPLIES: u64 = 5;
/// Bytes that one short datagram takes of a receive buffer: half a page of the network card's driver and the kernel's
/// own record of it.
const REPLY_BYTES: u64 = 2_304;
/// Bytes that a play asks for.
const ASKED: u64 = 1 << 20;
/// The smallest page there is.
const PAGE: u64 = 4_096;

impl NetworkFacts {
    /// One line for each.
    #[must_use]
    pub(crate) fn judge(&self, hall: Hall) -> Vec<FindingLine> {
        vec![self.neighbour_table(hall), self.receive_buffer(hall), self.open_files(hall), self.sending(hall)]
    }

    fn neighbour_table(&self, hall: Hall) -> FindingLine {
        const ID: &str = "neighbour_table";
        let need = u64::from(hall.neighbours) + OTHER_NEIGHBOURS;
        let table = match &self.neighbours {
            Ok(table) => *table,
            Err(_) if hall.neighbours == 0 => {
                return FindingLine::ok(ID, "not needed: no controller is elsewhere");
            }
            Err(why) => {
                return FindingLine::unknown(
                    ID,
                    why,
                    "on the host: sysctl -a | grep neigh.default.gc_thresh",
                );
            }
        };
        let found = format!(
            "{}/{}/{} entries for {} elsewhere and {OTHER_NEIGHBOURS} others",
            table.kept,
            table.tidied,
            table.most,
            count(hall.neighbours as usize, "controller")
        );
        if hall.neighbours == 0 || need <= table.tidied {
            return FindingLine::ok(ID, found);
        }
        let kept = need.next_power_of_two();
        let fix = format!(
            "in /etc/sysctl.d/90-kinocue.conf, then sysctl --system: net.ipv4.neigh.default.gc_thresh1={kept}, \
             gc_thresh2={}, gc_thresh3={}",
            2 * kept,
            4 * kept
        );
        if need > table.most {
            FindingLine::bad(ID, found + ": frames to some controllers will find no link address", fix)
        } else {
            FindingLine::warn(ID, found + ": idle entries are dropped, and their next frames wait", fix)
        }
    }

    fn receive_buffer(&self, hall: Hall) -> FindingLine {
        const ID: &str = "socket_buffers";
        const LOOK: &str = "on the host: sysctl net.core.rmem_max net.ipv4.udp_mem";
        let (most, unasked) = match (&self.receive_max, &self.receive_default) {
            (Ok(most), Ok(unasked)) => (*most, *unasked),
            (Err(why), _) | (_, Err(why)) => return FindingLine::unknown(ID, why, LOOK),
        };
        let one = REPLIES * REPLY_BYTES;
        let all = one * u64::from(hall.controllers);
        // The kernel doubles what is asked for: its own records count as well.
        let has = 2 * ASKED.min(most);
        let found = format!(
            "{has} bytes for each controller's replies (rmem_max {most}, rmem_default {unasked}); 5 ms of them take {one}"
        );
        if has < one {
            return FindingLine::warn(ID, found, format!("sysctl -w net.core.rmem_max={ASKED}"));
        }
        match &self.udp_pages {
            Ok(pages) if pages.saturating_mul(PAGE) < all => FindingLine::warn(
                ID,
                format!("{found}; those of all {all}, but UDP has {pages} pages of memory"),
                format!(
                    "sysctl -w net.ipv4.udp_mem=\"{0} {1} {2}\"",
                    all / PAGE,
                    2 * all / PAGE,
                    4 * all / PAGE
                ),
            ),
            Ok(_) => FindingLine::ok(ID, format!("{found}, those of all {all}")),
            Err(why) => FindingLine::unknown(
                ID,
                format!("{found}, those of all {all}; UDP's own memory: {why}"),
                LOOK,
            ),
        }
    }

    fn sending(&self, hall: Hall) -> FindingLine {
        const ID: &str = "sending";
        let cost = match &self.sending {
            Ok(cost) => cost,
            Err(why) => return FindingLine::unknown(ID, why, "ip link set lo up"),
        };
        let (controllers, rate) = (hall.controllers as usize, hall.rate);
        let found = cost.words(controllers, rate);
        match cost.remedy(controllers, rate) {
            None => FindingLine::ok(ID, found),
            Some(remedy) if cost.share(controllers, rate) < 1.0 => FindingLine::warn(ID, found, remedy),
            Some(remedy) => FindingLine::bad(ID, found + ": ticks are missed, and seats lost", remedy),
        }
    }

    fn open_files(&self, hall: Hall) -> FindingLine {
        const ID: &str = "open_files";
        let need = u64::from(hall.controllers) + OTHER_FILES;
        let hard = self.files.hard.map_or_else(|| "unlimited".to_owned(), |most| most.to_string());
        let found = format!("RLIMIT_NOFILE {hard}, needed {need}");
        if self.files.hard.is_none_or(|most| most >= need) {
            return FindingLine::ok(ID, found);
        }
        let enough = need.next_power_of_two();
        FindingLine::bad(
            ID,
            found,
            format!(
                "LimitNOFILE={enough} in the unit, or `@kinocue - nofile {enough}` in \
                 /etc/security/limits.d/kinocue.conf and log in again"
            ),
        )
    }
}
