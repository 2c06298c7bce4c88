//! What the ack thread does for a hall that lives on between shows: it finds out where all seats stand when the program
//! starts, asks after controllers to which no frame goes, and keeps the books of what the control plane sends.

use std::sync::Arc;

use rtrb::Consumer;

use super::desk::Desk;
use super::idle::Beats;
use super::line::LineEnd;
use crate::config::Controller;
use crate::fanout::Lane;
use crate::health::{Health, Standing};
use crate::motion::Pulses;
use crate::net::Sender;
use crate::state::Finding;
use crate::time::MonoTime;
use crate::wire::PerAxis;

/// What the control plane tells the ack thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// This controller is home: its group is looked at anew.
    Homed(u16),
}

/// What a hall has beside a play.
#[derive(Debug)]
pub struct Standby {
    beats: Beats,
    line: LineEnd,
    desk: Arc<Desk>,
    orders: Consumer<Order>,
    /// Whether the program is still to find out where the seats stand, and whether it crashed the last time.
    boot: Option<bool>,
    /// What each controller said of its zero, and whether its seat stands at park.
    seen: Vec<Option<Seen>>,
}

/// What was read of one controller.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    pub(super) homed: bool,
    pub(super) at_park: bool,
}

impl Standby {
    /// For a hall that has just started; `crashed` says whether the mark of a crash was there.
    #[must_use]
    pub fn new(
        controllers: &[Controller],
        lanes: &[Lane],
        line: LineEnd,
        desk: Arc<Desk>,
        orders: Consumer<Order>,
        crashed: bool,
    ) -> Self {
        Self {
            beats: Beats::new(controllers, lanes),
            line,
            desk,
            orders,
            boot: Some(crashed),
            seen: vec![None; controllers.len()],
        }
    }

    /// Hands a datagram to the line; says whether somebody waits for one.
    pub(super) fn pass_on(&mut self, controller: usize, octets: &[u8], at: MonoTime) -> bool {
        self.line.hear(controller, octets, at)
    }

    /// Where the axes stand by an answer to a beat; none where it is none.
    pub(super) fn beat_of(&mut self, controller: usize, octets: &[u8]) -> Option<PerAxis<Pulses>> {
        self.beats.hear(controller, octets)
    }

    /// Whether a seat is surely elsewhere than where it rests; to be asked with every answer to a beat.
    pub(super) fn is_away(
        &mut self,
        controller: usize,
        rests: impl FnOnce(&[Option<Pulses>]) -> bool,
    ) -> bool {
        self.beats.is_away(controller, rests)
    }

    /// Notes what was read of a controller.
    pub(super) fn on_seen(&mut self, controller: usize, seen: Seen) {
        self.seen[controller] = Some(seen);
    }

    /// Whether a controller knows its position; none where it never told.
    pub(super) fn homed(&self, controller: usize) -> Option<bool> {
        self.seen[controller].map(|seen| seen.homed)
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

    /// Takes orders, counts what the line sent, and beats while nothing moves.
    pub(super) fn serve(&mut self, health: &mut Health, sender: &Sender, moving: bool, now: MonoTime) {
        while let Ok(Order::Homed(controller)) = self.orders.pop() {
            health.on_homed(usize::from(controller));
            health.look_anew(health.groups().group_of(usize::from(controller)));
        }
        for controller in 0..self.seen.len() {
            health.on_other_sent(controller, self.line.take_sent(controller));
        }
        // Preflight counts every datagram that a controller received: none of ours may come between.
        if moving || self.line.is_open() {
            self.beats.forget();
            return;
        }
        if !self.beats.take(now) {
            return;
        }
        for controller in 0..self.seen.len() {
            let standing = health.standing(health.groups().group_of(controller));
            if standing.may_move() && self.beats.send(controller, sender) {
                health.on_beat_sent(controller, now);
            }
        }
    }

    /// What the start has found, once every controller that is to take part has told; said once.
    pub(super) fn take_finding(&mut self, health: &Health) -> Option<Finding> {
        let crashed = self.boot?;
        let groups = health.groups();
        // What is latched was seen as well; it waits for a person, who may clear it only once all have told.
        let known = |controller: usize| {
            let standing = health.standing(groups.group_of(controller));
            self.seen[controller].filter(|_| standing != Standing::Lost)
        };
        let mut finding = Finding { homed: true, at_park: true, crashed };
        for controller in (0..self.seen.len()).filter(|controller| self.takes_part(*controller)) {
            let seen = known(controller)?;
            finding.homed &= seen.homed;
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
