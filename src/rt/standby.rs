//! What the ack thread does for a hall that lives on between shows: it finds out where all seats stand when the program
//! starts, and keeps the books of what the control plane sends.

use std::sync::Arc;

use rtrb::Consumer;

use super::desk::Desk;
use super::line::LineEnd;
use crate::config::Controller;
use crate::drive::Seen;
use crate::health::{HealthState, HealthTable};
use crate::state::{Finding, LedBefore};
use crate::time::MonoTime;

/// What the control plane tells the ack thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// This controller is home: its group is looked at anew.
    Homed(u16),
}

/// What a hall has beside a play.
#[derive(Debug)]
pub(crate) struct Standby {
    line: LineEnd,
    desk: Arc<Desk>,
    orders: Consumer<Order>,
    /// How it ended before, while the program is still to find out where the seats stand.
    boot: Option<LedBefore>,
    /// What each controller said of its zero, and whether its seat stands at park.
    seen: Vec<Option<Seen>>,
}

impl Standby {
    /// For a hall that has just started.
    #[must_use]
    pub(crate) fn new(
        controllers: &[Controller],
        line: LineEnd,
        desk: Arc<Desk>,
        orders: Consumer<Order>,
        before: LedBefore,
    ) -> Self {
        Self { line, desk, orders, boot: Some(before), seen: vec![None; controllers.len()] }
    }

    /// Hands a datagram to the line; says whether somebody waits for one.
    pub(super) fn pass_on(&mut self, controller: usize, octets: &[u8], at: MonoTime) -> bool {
        self.line.hear(controller, octets, at)
    }

    /// Notes what was read of a controller.
    pub(super) fn on_seen(&mut self, controller: usize, seen: Seen) {
        self.seen[controller] = Some(seen);
    }

    /// Seats that take part home: what was seen of them is over.
    pub(super) fn forget_seats(&mut self) {
        for controller in (0..self.seen.len()).filter(|controller| self.desk.mix(*controller).on) {
            self.seen[controller] = None;
        }
    }

    /// Whether a controller knows its position; none where it has not told since it was homed.
    pub(super) fn homed(&self, controller: usize) -> Option<bool> {
        self.seen[controller].map(|seen| seen.sighting.homed)
    }

    /// Whether somebody wants a controller to take part.
    pub(super) fn takes_part(&self, controller: usize) -> bool {
        self.desk.mix(controller).on
    }

    /// Whether all seats of a group stand at park, as they were seen last.
    pub(super) fn is_at_park(&self, mut members: impl Iterator<Item = usize>) -> bool {
        members.all(|controller| self.seen[controller].is_some_and(|seen| seen.at_park))
    }

    /// Whether the control plane holds a conversation with the controllers.
    pub(super) fn is_asked_otherwise(&self) -> bool {
        self.line.is_open()
    }

    /// Whether that conversation wants nobody else to ask.
    pub(super) fn is_hushed(&self) -> bool {
        self.line.is_hushed()
    }

    /// The next controller that somebody said is home.
    pub(super) fn take_homed(&mut self) -> Option<usize> {
        self.orders.pop().ok().map(|Order::Homed(controller)| usize::from(controller))
    }

    /// How many datagrams the line sent to a controller since this was asked last.
    pub(super) fn take_sent(&mut self, controller: usize) -> u32 {
        u32::try_from(self.line.take_sent(controller)).unwrap_or(u32::MAX)
    }

    /// What the start has found, once every controller that is to take part has told; said once.
    pub(super) fn take_finding(&mut self, health: &HealthTable) -> Option<Finding> {
        let before = self.boot?;
        let groups = health.groups();
        // What is latched was seen as well; it waits for a person, who may clear it only once all have told.
        let known = |controller: usize| {
            let standing = health.standing(groups.group_of(controller));
            self.seen[controller].filter(|_| standing != HealthState::Lost)
        };
        let mut finding = Finding { homed: true, at_park: true, before };
        for controller in (0..self.seen.len()).filter(|controller| self.takes_part(*controller)) {
            let seen = known(controller)?;
            finding.homed &= seen.sighting.homed;
            finding.at_park &= seen.at_park;
        }
        self.boot = None;
        Some(finding)
    }

    /// Notes how often a controller's port was found closed so far.
    pub(super) fn on_closed(&self, controller: usize, times: u64) {
        self.line.on_closed(controller, times);
    }
}
