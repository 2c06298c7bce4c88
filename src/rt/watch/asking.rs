//! What controllers are asked beside the looks: where seats are before a motion and while nothing moves, and all of it anew once the
//! hall was cleared.

use super::super::mail::Alarm;
use super::super::standby::Standby;
use super::{SILENT_AFTER, Watch};
use crate::drive::Need;
use crate::health::{HealthInput, HealthState};
use crate::net::Delivery;
use crate::state::{Event, State};
use crate::time::MonoTime;

impl Watch {
    /// Whoever cleared the hall wants to know where its seats stand: nothing is taken on trust.
    pub(super) fn look_anew(&mut self, now: MonoTime) {
        let state = self.live.state();
        let is_new = std::mem::replace(&mut self.state, state) != state;
        if let Some(standby) = self.standby.as_mut().filter(|_| is_new && state == State::Homing) {
            standby.forget_seats();
        }
        let has_entered = is_new && state == State::Recovering;
        let clears = self.live.clears();
        let is_cleared = std::mem::replace(&mut self.clears, clears) != clears;
        if !has_entered && !is_cleared {
            return;
        }
        if self.silent {
            // Nobody answers: where the frames left the seats is all there is to know.
            self.alarm(Alarm::Event(Event::PositionsRead));
            return;
        }
        self.anew = Some(now);
        (0..self.health.groups().len()).for_each(|group| self.judge(HealthInput::LookAnew(group)));
    }

    /// A motion that begins waits for readings of where the seats are by now, as does whoever leads a play before that.
    pub(super) fn read_all(&mut self) {
        let wanted = self.live.wanted();
        if std::mem::replace(&mut self.wanted, wanted) == wanted {
            return;
        }
        for controller in 0..self.peers.len() {
            if self.stands(controller).may_move() {
                let sent = self.ask(controller, Need::Position, self.looked);
                self.judge(HealthInput::OtherSent(controller, sent));
            }
        }
    }

    /// Asks a controller for something; says in how many datagrams. What the kernel does not take is asked for again.
    pub(super) fn ask(&mut self, controller: usize, need: Need, now: MonoTime) -> u32 {
        self.try_ask(controller, need, now).0
    }

    /// The same; also says whether the kernel did not take one.
    fn try_ask(&mut self, controller: usize, need: Need, now: MonoTime) -> (u32, bool) {
        let Self { peers, sender, .. } = self;
        let mut is_kept = false;
        let mut send = |datagram: &[u8]| {
            let failed = matches!(sender.send(controller, datagram), Delivery::Failed(_));
            is_kept |= failed;
            !failed
        };
        (peers[controller].poll(need, now, &mut send), is_kept)
    }

    /// While nothing moves, no ack tells that a controller lives, nor where its seat is; and while frames flow none tells that a seat
    /// follows them.
    pub(super) fn beat(&mut self, now: MonoTime) {
        // Preflight counts every datagram that a controller received: none of ours may come between. Those that home are asked all the
        // while: an emergency stop is heard of by their answers.
        if self.silent || self.is_hushed() {
            return;
        }
        if self.live.is_moving() {
            while let Some(controller) = self.rounds.take_led(now) {
                if !self.peers[controller].is_behind(now) {
                    self.ask_beat(controller, true, now);
                }
            }
        } else if self.rounds.take(now) {
            (0..self.peers.len()).for_each(|controller| self.ask_beat(controller, false, now));
        }
    }

    fn ask_beat(&mut self, controller: usize, is_led: bool, now: MonoTime) {
        if !self.stands(controller).may_move() {
            return;
        }
        match self.try_ask(controller, Need::KeepAlive { is_led }, now) {
            (0, false) => {}
            (0, true) => self.judge(HealthInput::BeatKept(controller, now)),
            (sent, _) => {
                self.judge(HealthInput::BeatSent(controller, now));
                // Each datagram counts, and the beat is one of them.
                self.judge(HealthInput::OtherSent(controller, sent - 1));
            }
        }
    }

    pub(super) fn stand_by(&mut self) {
        let Some(mut standby) = self.standby.take() else { return };
        for controller in 0..self.peers.len() {
            self.judge(HealthInput::Part(controller, standby.takes_part(controller)));
        }
        while let Some(homed) = standby.take_homed() {
            self.peers[homed].on_homed();
            self.judge(HealthInput::Homed(homed));
            self.judge(HealthInput::LookAnew(self.health.groups().group_of(homed)));
        }
        for controller in 0..self.peers.len() {
            self.judge(HealthInput::OtherSent(controller, standby.take_sent(controller)));
        }
        if !self.live.is_moving() {
            self.join_at_park(&standby);
            if let Some(finding) = standby.take_finding(&self.health) {
                self.alarm(Alarm::Event(Event::Identified(finding)));
            }
        }
        self.standby = Some(standby);
    }

    /// A group that was found at park is where the others are.
    fn join_at_park(&mut self, standby: &Standby) {
        for group in 0..self.health.groups().len() {
            if self.health.standing(group) == HealthState::Rejoining
                && standby.is_at_park(self.health.groups().members(group))
            {
                self.judge(HealthInput::Joined(group));
                self.untold = true;
            }
        }
    }

    /// Those that take part are waited for, and not for ever: nothing goes to one that is silent, and the others may park.
    pub(super) fn end_look_anew(&mut self, now: MonoTime) {
        let Some(since) = self.anew else { return };
        let is_open = |group| {
            let mut members = self.health.groups().members(group);
            self.health.standing(group) == HealthState::Lost
                && members.any(|controller| self.takes_part(controller))
        };
        let is_read = !(0..self.health.groups().len()).any(is_open);
        if is_read || now.since(since) >= SILENT_AFTER {
            self.anew = None;
            self.alarm(Alarm::Event(Event::PositionsRead));
        }
    }
}
