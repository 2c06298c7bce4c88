//! What the ack thread makes of all that it hears, beside the books: how each group stands, what the tick thread has to
//! hear of that, and whose registers are read.

use std::sync::Arc;

use rtrb::Producer;

use super::live::{Live, Phase};
use super::mail::{Alarm, Sent};
use super::sight::Looker;
use super::standby::{Seen, Standby};
use super::table::{Row, Turns};
use crate::config::Controller;
use crate::fanout::Lane;
use crate::health::{Change, Health, Notice, Standing};
use crate::motion::{Pose, Pulses};
use crate::net::Sender;
use crate::observe::Observer;
use crate::state::Event;
use crate::time::MonoTime;
use crate::tracker::{Fate, Reply, Tracker};
use crate::wire::{Dialect, PerAxis, ReplyCode};

/// Changes that are kept for the report.
const CHANGES_KEPT: usize = 1_000;

/// The watch over the controllers of one play.
#[derive(Debug)]
pub struct Watch {
    health: Health,
    lookers: Vec<Looker>,
    /// Where each seat stood when it was last looked at.
    poses: Vec<Pose>,
    sender: Sender,
    alarms: Producer<Alarm>,
    live: Arc<Live>,
    /// Events of the observer that were heard.
    heard: u64,
    notices: Vec<Notice>,
    changes: Vec<Change>,
    /// Whether positions are read anew, because the hall was cleared.
    anew: bool,
    phase: Phase,
    /// When it last judged.
    looked: MonoTime,
    silent: bool,
    /// A group stands otherwise than was told last.
    untold: bool,
    /// What a hall has beside a play.
    standby: Option<Standby>,
    turns: Turns,
}

impl Watch {
    /// A watch over controllers, in the order of their lanes; `health` is of as many.
    #[must_use]
    pub fn new(
        health: Health,
        controllers: &[Controller],
        lanes: &[Lane],
        sender: Sender,
        alarms: Producer<Alarm>,
        live: Arc<Live>,
    ) -> Self {
        let groups = health.groups().len();
        let silent = (0..groups).all(|group| health.standing(group) == Standing::Unwatched);
        Self {
            lookers: controllers.iter().zip(lanes).map(|(one, lane)| Looker::new(one, lane)).collect(),
            poses: lanes.iter().map(|lane| lane.window.park()).collect(),
            notices: Vec::with_capacity(4 * (controllers.len() + groups) + 4),
            changes: Vec::with_capacity(CHANGES_KEPT),
            heard: 0,
            anew: false,
            phase: Phase::default(),
            looked: MonoTime::default(),
            health,
            sender,
            alarms,
            live,
            silent,
            untold: false,
            standby: None,
            turns: Turns::default(),
        }
    }

    /// The same for a hall that lives on between shows: at first it finds out where all seats stand.
    #[must_use]
    pub fn of_a_hall(mut self, standby: Standby) -> Self {
        (0..self.health.groups().len()).for_each(|group| self.health.look_anew(group));
        self.standby = Some(standby);
        self
    }

    /// How the groups stood otherwise than before, the first 1,000 times; and the controllers that were given up in the end.
    #[must_use]
    pub fn into_outcome(self) -> (Vec<Change>, Vec<usize>) {
        let groups = self.health.groups();
        let is_gone = |controller: &usize| {
            matches!(self.health.standing(groups.group_of(*controller)), Standing::Lost | Standing::Excluded)
        };
        let gone = (0..groups.controllers()).filter(is_gone).collect();
        (self.changes, gone)
    }

    pub(super) fn on_sent(&mut self, sent: Sent) {
        match sent {
            Sent::Posted { lane, frame, asked, at } => {
                self.health.on_sent(usize::from(lane), frame, asked, at);
            }
            Sent::Failed { .. } => {}
            Sent::Joined { lane } => {
                self.on_joined(self.health.groups().group_of(usize::from(lane)));
            }
        }
    }

    fn on_joined(&mut self, group: usize) {
        let from = self.health.standing(group);
        self.health.on_joined(group);
        let (to, why) = (self.health.standing(group), self.health.why(group));
        if from != to {
            self.keep(Change { group, at: self.looked, from, to, why });
        }
    }

    /// Whether a group stands otherwise than when this was last asked.
    pub(super) const fn take_untold(&mut self) -> bool {
        std::mem::replace(&mut self.untold, false)
    }

    fn keep(&mut self, change: Change) {
        self.untold = true;
        if self.changes.len() < CHANGES_KEPT {
            self.changes.push(change);
        }
    }

    /// What became of a reply.
    pub(super) fn on_fate(&mut self, reply: &Reply, fate: Fate) {
        let smc = self.lookers.get(reply.controller).is_some_and(|one| one.dialect() == Dialect::Smc);
        match fate {
            Fate::Answered(ReplyCode::Running) => self.health.on_ack(reply.controller, reply.frame, reply.at),
            Fate::Answered(ReplyCode::Fault | ReplyCode::Command) if smc => {
                self.health.on_refused(reply.controller);
            }
            _ => {}
        }
    }

    /// Hears a datagram that is no reply to a frame; says whether it was an answer to a look.
    pub(super) fn hear(&mut self, controller: usize, octets: &[u8], at: MonoTime) -> bool {
        let awaited = self.standby.as_mut().is_some_and(|standby| standby.pass_on(controller, octets, at));
        let looker = &mut self.lookers[controller];
        let is_answer = looker.hear(octets);
        let standing = self.health.standing(self.health.groups().group_of(controller));
        if let Some((sighting, pose)) = looker.take()
            // Whoever joins from where it is found has to be at rest there.
            && (looker.is_at_rest(&pose, at) || !standing.is_looked_at())
        {
            self.poses[controller] = pose;
            self.health.on_sighting(controller, &sighting, at);
            if let Some(standby) = &mut self.standby {
                standby.on_seen(controller, Seen { homed: sighting.homed, at_park: looker.is_parked(&pose) });
            }
        }
        is_answer || awaited
    }

    /// Whether it is that of a hall that sends no frames.
    pub(super) fn is_idle(&self) -> bool {
        self.standby.is_some() && !self.live.is_moving()
    }

    /// Notes how often a controller's port was found closed so far.
    pub(super) fn on_closed(&self, controller: usize, times: u64) {
        if let Some(standby) = &self.standby {
            standby.on_closed(controller, times);
        }
    }

    /// Hears an answer to a beat: a sign of life, and where the first axes of the seat stand; none where it is none.
    pub(super) fn hear_beat(
        &mut self,
        controller: usize,
        octets: &[u8],
        at: MonoTime,
    ) -> Option<PerAxis<Pulses>> {
        let positions = self.standby.as_mut()?.beat_of(controller, octets)?;
        self.health.on_status(controller, at);
        self.mind_rest(controller);
        Some(positions)
    }

    /// Hears an answer to a beat that asked for inputs: a sign of life, and which are active; none where it is none.
    pub(super) fn hear_inputs(&mut self, controller: usize, octets: &[u8], at: MonoTime) -> Option<u16> {
        let inputs = self.standby.as_ref()?.inputs_of(controller, octets)?;
        self.health.on_status(controller, at);
        Some(inputs)
    }

    /// The next show begins where the last one left the seats. One that somebody has moved since is found first, or it would
    /// jump.
    fn mind_rest(&mut self, controller: usize) {
        let standing = self.health.standing(self.health.groups().group_of(controller));
        let is_set = matches!(self.phase, Phase::Parking | Phase::Joining) && !self.live.is_moving();
        if !is_set || !standing.may_move() {
            return;
        }
        let Self { standby: Some(standby), lookers, poses, health, .. } = self else { return };
        let looker = &lookers[controller];
        let rest = if standing == Standing::Rejoining { &poses[controller] } else { looker.park() };
        if standby.is_away(controller, |places| looker.rests_at(places, rest)) {
            health.on_moved(controller);
        }
    }

    /// Tells whoever looks how the controllers stand.
    pub(super) fn tell_table(&mut self, tracker: &Tracker, observer: &Observer) {
        let Self { health, standby, turns, looked, live, .. } = self;
        live.on_table(|rows| {
            let row = |controller: usize, before: Option<&Row>| {
                let group = health.groups().group_of(controller);
                Row {
                    counts: tracker.counts(controller),
                    ack_ns: before.and_then(|row| row.ack_ns),
                    standing: health.standing(group),
                    why: health.why(group),
                    state: observer.states()[controller],
                    homed: standby.as_ref().and_then(|standby| standby.homed(controller)),
                    at: *looked,
                }
            };
            let all = 0..health.groups().controllers();
            if rows.len() == all.len() {
                all.for_each(|controller| rows[controller] = row(controller, Some(&rows[controller])));
            } else {
                *rows = all.map(|controller| row(controller, None)).collect();
            }
            turns.look_up(rows, tracker);
        });
    }

    /// Judges all at `now`, an instant up to which all was told.
    pub(super) fn look(&mut self, observer: &Observer, now: MonoTime) {
        self.looked = now;
        let health = &mut self.health;
        self.heard = observer.events_since(self.heard, |event| health.on_event(event));
        for (controller, state) in observer.states().iter().enumerate() {
            if let Some(at) = state.reported_at {
                self.health.on_status(controller, at);
            }
        }
        self.look_anew();
        self.stand_by(now);
        let notices = &mut self.notices;
        self.health.tick(now, &mut |notice| notices.push(notice));
        for index in 0..self.notices.len() {
            self.tell(self.notices[index]);
        }
        self.notices.clear();
        self.end_look_anew();
    }

    fn tell(&mut self, notice: Notice) {
        match notice {
            // One that is out may be at work on: it stays away until it was homed, and holds up nobody.
            Notice::Hall(Event::Rebooted(controller)) if !self.takes_part(controller) => {}
            Notice::Hall(event) => self.alarm(Alarm::Event(event)),
            // Preflight counts every datagram that a controller received, and would take the answers for its own.
            Notice::Read(_) if self.is_hushed() => {}
            // A homing is watched by who ordered it; only those that are looked for are looked at beside.
            Notice::Read(controller) if self.is_asked_otherwise() && self.stands(controller).may_move() => {}
            Notice::Read(controller) => {
                let datagrams = self.lookers[controller].ask(controller, &self.sender);
                self.health.on_read_sent(controller, datagrams);
            }
            Notice::Group(change) => {
                self.keep(change);
                for controller in 0..self.lookers.len() {
                    if self.health.groups().group_of(controller) == change.group {
                        self.tell_lane(controller, change);
                    }
                }
            }
        }
    }

    /// Whether the control plane holds a conversation with the controllers.
    fn is_asked_otherwise(&self) -> bool {
        self.standby.as_ref().is_some_and(Standby::is_asked_otherwise)
    }

    /// Whether that conversation wants to be the only one.
    fn is_hushed(&self) -> bool {
        self.standby.as_ref().is_some_and(Standby::is_hushed) && !self.live.is_moving()
    }

    fn stands(&self, controller: usize) -> Standing {
        self.health.standing(self.health.groups().group_of(controller))
    }

    fn takes_part(&self, controller: usize) -> bool {
        self.standby.as_ref().is_none_or(|standby| standby.takes_part(controller))
    }

    /// What a lane has to do because its group stands otherwise.
    fn tell_lane(&mut self, controller: usize, change: Change) {
        let lane = u16::try_from(controller).expect("fewer controllers than ports");
        match change.to {
            Standing::Stopped => self.alarm(Alarm::Cut(lane)),
            Standing::Rejoining => self.alarm(Alarm::Found(lane, self.poses[controller])),
            to if !to.may_move() => self.alarm(Alarm::Leave(lane)),
            _ => {}
        }
    }

    /// Where it finds no room the tick thread has not looked for dozens of ticks, and what it does next is a hold.
    fn alarm(&mut self, alarm: Alarm) {
        let _ = self.alarms.push(alarm);
    }

    /// Whoever cleared the hall wants to know where its seats stand: nothing is taken on trust.
    fn look_anew(&mut self) {
        let phase = self.live.phase();
        if std::mem::replace(&mut self.phase, phase) == phase || phase != Phase::Recovering {
            return;
        }
        if self.silent {
            // Nobody answers: where the frames left the seats is all there is to know.
            self.alarm(Alarm::Event(Event::PositionsRead));
            return;
        }
        self.anew = true;
        (0..self.health.groups().len()).for_each(|group| self.health.look_anew(group));
    }

    fn stand_by(&mut self, now: MonoTime) {
        let Self { standby, health, sender, live, untold, .. } = self;
        let Some(standby) = standby else { return };
        standby.serve(health, sender, live.is_moving(), now);
        if live.is_moving() {
            return;
        }
        // A group that was found at park is where the others are.
        for group in 0..health.groups().len() {
            if health.standing(group) == Standing::Rejoining
                && standby.is_at_park(health.groups().members(group))
            {
                health.on_joined(group);
                *untold = true;
            }
        }
        if let Some(finding) = standby.take_finding(health) {
            self.alarm(Alarm::Event(Event::Identified(finding)));
        }
    }

    fn end_look_anew(&mut self) {
        let health = &self.health;
        let is_open = |group| health.standing(group).is_looked_at();
        if self.anew && !(0..health.groups().len()).any(is_open) {
            self.anew = false;
            self.alarm(Alarm::Event(Event::PositionsRead));
        }
    }
}
