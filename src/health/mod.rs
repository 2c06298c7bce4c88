//! Health of each motion group: from frames, acks, reports and reads it decides who is degraded, lost, back, stopped,
//! in error or excluded, what the hall does about it, and whose registers are to be read. Ack thread; pure: the time is an argument; its
//! memory is made at the start.
//!
//! Life is an ack, the first one to a frame that asked and newer than any acked before, or a status report. Repeated,
//! older and stray acks are none, nor is any ack once the group is lost: it comes back by registers that were asked for
//! since, and by them alone.

mod counter;
mod faults;
mod groups;
mod health_state;
mod input;
mod judge;
mod late;
mod member;
mod proof;
mod reads;
mod replies;
#[cfg(test)]
mod tests;
mod window;
mod words;

use std::time::Duration;

pub use groups::Groups;
pub use health_state::Notice;
pub(crate) use health_state::{Change, HealthState, Pushed, Why};
pub(crate) use input::HealthInput;
pub(crate) use proof::{Continuity, Identity, Sighting};
pub(crate) use words::ACKS_OFF;

use crate::belief::Fall;
use crate::config::LossPolicy;
use crate::motion::Pulses;
use crate::observe;
use crate::state::{self, Demand, Latch};
use crate::time::MonoTime;
use crate::wire::FrameNo;
use member::Member;

/// Acks have to come well for so long before a degraded group is well again.
const WELL_AFTER: Duration = Duration::from_secs(1);

/// The standing of all groups. Every method that takes a controller or a group panics if there is none of that number.
#[derive(Debug, Clone)]
pub struct HealthTable {
    groups: Groups,
    members: Vec<Member>,
    places: Vec<GroupStanding>,
    policy: LossPolicy,
    watched: bool,
    /// The hall was told of an emergency stop, and not yet that it is over.
    stop_told: bool,
    /// What the hall was told of controllers that are held.
    latch_told: Latch,
}

/// Where one group stands.
#[derive(Debug, Clone, Copy)]
struct GroupStanding {
    standing: HealthState,
    why: Why,
    /// When acks were last missing.
    poor: MonoTime,
}

impl HealthTable {
    /// Groups that all stand well, as after preflight. Each `ack_every`-th frame asks, one frame in each `period`; with
    /// `ack_every` 0 they are unwatched.
    #[must_use]
    pub fn new(groups: Groups, policy: LossPolicy, ack_every: u32, period: Duration) -> Self {
        let watched = ack_every > 0;
        let interval = period * ack_every.max(1);
        let members = (0..groups.controllers()).map(|controller| Member::new(controller, interval)).collect();
        let (standing, why) = well(watched);
        let place = GroupStanding { standing, why, poor: MonoTime::default() };
        let places = vec![place; groups.len()];
        Self { groups, members, places, policy, watched, stop_told: false, latch_told: Latch::Free }
    }

    /// The same where what is sent is confirmed so much later, controller by controller, because it is executed as late.
    #[must_use]
    pub(crate) fn led_ahead(mut self, leads: impl Iterator<Item = Duration>) -> Self {
        for (member, lead) in self.members.iter_mut().zip(leads) {
            member.expect_acks_after(lead);
        }
        self
    }

    /// The same for a hall that homes its seats: one that does not know its zero is out, whenever it is first seen.
    #[must_use]
    pub(crate) fn of_a_hall(mut self) -> Self {
        self.members.iter_mut().for_each(Member::demand_home);
        self
    }

    /// True if somebody wants a controller to take part: clearing and parking wait for nobody else.
    pub(crate) fn on_part(&mut self, controller: usize, takes_part: bool) {
        self.members[controller].out = !takes_part;
    }

    /// The groups.
    #[must_use]
    pub(crate) const fn groups(&self) -> &Groups {
        &self.groups
    }

    /// True if a sighting is of another controller than that which was seen before, or of one that restarted.
    #[must_use]
    pub(crate) fn is_refuted_by(&self, controller: usize, sighting: &Sighting, at: MonoTime) -> bool {
        self.members[controller].is_refuted_by(sighting, at)
    }

    /// How a group stands.
    #[must_use]
    pub(crate) fn standing(&self, group: usize) -> HealthState {
        self.places[group].standing
    }

    /// Why it stands so.
    #[must_use]
    pub(crate) fn why(&self, group: usize) -> Why {
        self.places[group].why
    }

    /// A frame was handed to the kernel, taken or not; `asked` says whether it requests an ack. A frame left out is none
    /// that could be acked. While the hall holds at a low rate, each frame should ask: a group is lost after ten that did.
    pub fn on_sent(&mut self, controller: usize, frame: FrameNo, asked: bool, at: MonoTime) {
        self.members[controller].on_sent(frame, asked, at);
    }

    /// An ack, x = 2, that the kernel received at `at`. To be told after the sending of its frame was.
    pub fn on_ack(&mut self, controller: usize, frame: FrameNo, at: MonoTime) {
        self.members[controller].on_ack(frame, at);
    }

    /// A frame was refused: x = 3 or 5, of an MBOX controller also 4.
    pub(crate) fn on_refused(&mut self, controller: usize) {
        self.members[controller].faults.on_refused();
    }

    /// A status report of the controller itself.
    pub(crate) fn on_status(&mut self, controller: usize, at: MonoTime) {
        self.members[controller].on_life(at);
    }

    /// What the observer has noticed.
    pub(crate) fn on_event(&mut self, event: &observe::Event) {
        let member = &mut self.members[event.controller];
        match event.what {
            observe::What::EmergencyStop { .. } => member.on_emergency_stop(true),
            observe::What::EmergencyStopHeld => member.on_stop_held(),
            observe::What::EmergencyStopOver => member.on_emergency_stop(false),
            observe::What::Error(error) => member.faults.on_error(error),
            observe::What::ServoError { axis, error } => member.faults.on_drive(axis, error),
            observe::What::Alarm { register, value } => member.faults.on_alarm(register, value),
            observe::What::Report { .. } => {}
        }
    }

    /// So many datagrams went out to read what a [`Sighting`] takes.
    pub(crate) fn on_read_sent(&mut self, controller: usize, datagrams: u32) {
        self.members[controller].on_read_sent(datagrams);
    }

    /// So many other datagrams went out to a controller: its packet counter will have grown by as many.
    pub(crate) fn on_other_sent(&mut self, controller: usize, datagrams: u64) {
        self.members[controller].on_other_sent(datagrams);
    }

    /// A beat went out: any answer of the controller is a sign of life ([`HealthTable::on_status`]), and it is lost without one.
    pub(crate) fn on_beat_sent(&mut self, controller: usize, at: MonoTime) {
        self.members[controller].on_beat_sent(at);
    }

    /// A beat did not go out, as the kernel did not take it: an answer is missing as if it had.
    pub(crate) fn on_beat_kept(&mut self, controller: usize, at: MonoTime) {
        self.members[controller].on_beat(at);
    }

    /// What DPF0 says, read by itself, of whether a controller knows its zero.
    pub(crate) fn on_zero(&mut self, controller: usize, homed: bool) {
        self.members[controller].on_zero(homed);
    }

    /// A drive of a controller has let go of its motor: its axis, from 1, and the bits of what killed.
    pub(crate) fn on_killed(&mut self, controller: usize, axis: usize, cause: u16) {
        self.members[controller].faults.on_killed(axis, cause);
    }

    /// It has restarted, or let go of its seat: it does not know its zero.
    pub(crate) fn on_lost_zero(&mut self, controller: usize) {
        self.members[controller].on_lost_zero();
    }

    /// It has answered something that this thread or another one asked.
    pub(crate) fn on_answer(&mut self, controller: usize, at: MonoTime) {
        self.members[controller].on_answer(at);
    }

    /// It has answered with registers of 32 bits, as the IMAX manual has them (2.3) and no program that is known.
    pub(crate) fn on_wide_registers(&mut self, controller: usize) {
        self.members[controller].faults.on_wide_registers();
    }

    /// What was read; of no account where no read was sent since the group was lost.
    pub(crate) fn on_sighting(&mut self, controller: usize, sighting: &Sighting, at: MonoTime) {
        self.members[controller].on_sighting(sighting, at);
    }

    /// A controller drives so many axes, which are not those that its frames lead.
    pub(crate) fn on_other_axes(&mut self, controller: usize, drives: u16) {
        self.members[controller].faults.on_other_axes(drives);
    }

    /// The packet counter of a controller, which was read while frames go there. To be told before the sending of all that it
    /// may have counted was.
    pub(crate) fn on_count(&mut self, controller: usize, packets: u16) {
        self.members[controller].on_count(packets);
    }

    /// The same as part of a look, whose sighting has the count.
    pub(crate) fn on_counted(&mut self, controller: usize) {
        self.members[controller].on_counted();
    }

    /// A seat at rest was found elsewhere than frames left it: its group is out until it was looked at, and joins from there.
    pub(crate) fn on_moved(&mut self, controller: usize) {
        self.members[controller].unsure = Some(Why::Moved(controller));
    }

    /// It is not known where the frames to a controller have led its seat, and none goes there any more: its group is out until it was
    /// looked at.
    pub(crate) fn on_fell_out(&mut self, controller: usize, why: Fall) {
        let was_in = self.places[self.groups.group_of(controller)].standing.may_move();
        self.members[controller].on_fell_out(why, was_in);
    }

    /// A seat was found, but not all of its axes tell where they are: its group is out until it was homed.
    pub(crate) fn on_unread(&mut self, controller: usize) {
        self.members[controller].on_unread();
    }

    /// An axis, from 0, says that it is outside of its stroke, and where; none once all are inside. That is no position.
    pub(crate) fn on_outside(&mut self, controller: usize, outside: Option<(usize, Pulses)>) {
        self.members[controller].outside = outside;
    }

    /// An axis is pushed off where its drive holds it, too far to be led; none once none is.
    pub(crate) fn on_pushed(&mut self, controller: usize, pushed: Option<Pushed>) {
        self.members[controller].pushed = pushed;
    }

    /// True if the positions of a controller make two places of each, and nothing says in which order their words come.
    pub(crate) fn on_ambiguous(&mut self, controller: usize, ambiguous: bool) {
        self.members[controller].ambiguous = ambiguous;
    }

    /// A controller is home; a person homes one only while the hall is paused or parked. Where that was all its group was
    /// out for, the group is looked at next.
    pub(crate) fn on_homed(&mut self, controller: usize) {
        self.members[controller].on_homed();
        let place = &mut self.places[self.groups.group_of(controller)];
        if matches!(place.why, Why::Killed { controller: killed, .. } if killed == controller) {
            (place.standing, place.why) = (HealthState::Lost, Why::NotSeenYet);
        }
    }

    /// All lanes of a group are on the cue, or at park: a group that rejoined is well.
    pub(crate) fn on_joined(&mut self, group: usize) {
        let place = &mut self.places[group];
        if place.standing == HealthState::Rejoining {
            (place.standing, place.why) = well(self.watched);
        }
    }

    /// A person has cleared the group, or the hall is about to be armed: what was latched and is over is forgotten, and
    /// the group takes part again once it was seen as it was.
    pub(crate) fn look_anew(&mut self, group: usize) {
        for controller in self.groups.members(group) {
            self.members[controller].clear();
            self.members[controller].forget();
        }
        self.places[group].standing = HealthState::Lost;
        self.places[group].why = Why::NotSeenYet;
    }

    /// Judges all groups at `now`, an instant up to which all was told, and tells `on` what is new: for each group at most
    /// one change and one demand, for each controller at most one read and one word of it, and for the hall four words of all.
    pub fn tick(&mut self, now: MonoTime, on: &mut dyn FnMut(Notice)) {
        for member in &mut self.members {
            member.tick(now);
        }
        self.tell_of_stops(on);
        for group in 0..self.places.len() {
            self.judge(group, now, on);
        }
        self.tell_of_latches(on);
        self.tell_of_reads(now, on);
        self.tell_of_counts(now, on);
    }
}

/// How a group stands with which all is well.
const fn well(watched: bool) -> (HealthState, Why) {
    if watched { (HealthState::Ok, Why::Acked) } else { (HealthState::Unwatched, Why::AcksOff) }
}
