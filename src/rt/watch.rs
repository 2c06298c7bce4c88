//! What the ack thread makes of all that it hears, beside the books: how each group stands, what the tick thread has to
//! hear of that, and whose registers are read.

mod asking;
mod broadcast;
mod dark;
mod hearing;
mod notes;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use rtrb::{Producer, PushError};

use super::live::Live;
use super::mail::{Alarm, Sent};
use super::standby::Standby;
use super::table::{Row, Turns};
use crate::belief::Reading;
use crate::config::Controller;
use crate::drive::link::LaneWants;
use crate::drive::{EvidenceList, Lane, MOST_EVIDENCE, Need, Peer, Rounds, SentFrame, Whereabouts};
use crate::health::{Change, HealthInput, HealthState, HealthTable, Notice};
use crate::net::Sender;
use crate::observe::Observer;
use crate::record::AckRecord;
use crate::state::{Event, State};
use crate::time::MonoTime;
use crate::tracker::{Fate, Reply, Tracker};
use crate::wire::ReplyCode;
use broadcast::BroadcastLook;
use dark::Tended;
use notes::Notes;

/// Changes that are kept for the report.
const CHANGES_KEPT: usize = 1_000;

/// A seat at rest that is so far from where it was, strokes, was moved.
const MOVED: f64 = 0.002;
/// A controller that was not seen for so long after the hall was cleared holds up nobody.
const SILENT_AFTER: Duration = Duration::from_secs(3);

/// The watch over the controllers of one play.
#[derive(Debug)]
pub(crate) struct Watch {
    health: HealthTable,
    peers: Vec<Peer>,
    /// What the message says that is being heard.
    evidence: EvidenceList,
    /// When they are asked for a sign of life.
    rounds: Rounds,
    sender: Sender,
    alarms: Producer<Alarm>,
    /// Alarms for which there was no room yet, oldest first: none is ever dropped.
    waiting: VecDeque<Alarm>,
    live: Arc<Live>,
    /// Since when a reading of all seats was asked for that was sent last.
    wanted: MonoTime,
    /// Where each seat was read first in the pause that is under way.
    paused_at: Vec<Option<Reading>>,
    /// When the last status report of each came that was taken up.
    reported: Vec<MonoTime>,
    /// Events of the observer that were heard.
    heard: u64,
    notices: Vec<Notice>,
    changes: Vec<Change>,
    /// How far each is with being made dark and still.
    tended: Vec<Tended>,
    /// Since when positions are read anew, because the hall was cleared.
    anew: Option<MonoTime>,
    /// How often it was cleared so far.
    clears: u32,
    /// A controller that takes part does not know its position, and the hall was told so.
    lost_zero: bool,
    state: State,
    /// When it last judged.
    looked: MonoTime,
    silent: bool,
    /// A group stands otherwise than was told last.
    untold: bool,
    /// What a hall has beside a play.
    standby: Option<Standby>,
    turns: Turns,
    /// How far the look at the network of broadcasts is.
    broadcast_look: BroadcastLook,
    /// What is told to `health`, where somebody records.
    records: Option<Notes>,
}

impl Watch {
    /// A watch over controllers, in the order of their lanes; `health` is of as many.
    #[must_use]
    pub(crate) fn new(
        health: HealthTable,
        controllers: &[Controller],
        lanes: &[Lane],
        sender: Sender,
        alarms: Producer<Alarm>,
        live: Arc<Live>,
    ) -> Self {
        let groups = health.groups().len();
        let silent = (0..groups).all(|group| health.standing(group) == HealthState::Unwatched);
        if !silent {
            live.on_reader();
        }
        Self {
            peers: controllers.iter().zip(lanes).map(|(one, lane)| Peer::new(one, lane)).collect(),
            evidence: Vec::with_capacity(MOST_EVIDENCE),
            rounds: Rounds::new(controllers.len()),
            notices: Vec::with_capacity(4 * (controllers.len() + groups) + 4),
            changes: Vec::with_capacity(CHANGES_KEPT),
            wanted: MonoTime::default(),
            paused_at: vec![None; controllers.len()],
            reported: vec![MonoTime::default(); controllers.len()],
            heard: 0,
            tended: (0..controllers.len()).map(Tended::of).collect(),
            anew: None,
            clears: 0,
            lost_zero: false,
            waiting: VecDeque::with_capacity(4 * (controllers.len() + groups) + 4),
            state: State::Boot,
            looked: MonoTime::default(),
            health,
            sender,
            alarms,
            broadcast_look: BroadcastLook::of(live.broadcast()),
            live,
            silent,
            untold: false,
            standby: None,
            turns: Turns::default(),
            records: None,
        }
    }

    /// The same for a hall that lives on between shows: at first it finds out where all seats stand.
    #[must_use]
    pub(crate) fn of_a_hall(mut self, standby: Standby) -> Self {
        (0..self.health.groups().len()).for_each(|group| self.health.look_anew(group));
        self.standby = Some(standby);
        self
    }

    /// Keeps what it makes of all that it hears, for whoever records.
    pub(super) fn keep_records(&mut self) {
        self.records = Some(Notes::of(self.peers.len()));
    }

    /// Gives what it made of all that it heard since; says how much found no room.
    pub(super) fn take_records(&mut self, give: &mut dyn FnMut(&AckRecord<'static>)) -> u32 {
        self.records.as_mut().map_or(0, |records| records.take(give))
    }

    /// Tells the table something, unless it is known there.
    fn judge(&mut self, input: HealthInput) {
        if self.health.knows(input) {
            return;
        }
        self.health.take(input);
        if let Some(records) = &mut self.records {
            records.health(input);
        }
    }

    /// How the groups stood otherwise than before, the first 1,000 times; and the controllers that were given up in the end.
    #[must_use]
    pub(crate) fn into_outcome(self) -> (Vec<Change>, Vec<usize>) {
        let groups = self.health.groups();
        let is_gone = |controller: &usize| {
            matches!(
                self.health.standing(groups.group_of(*controller)),
                HealthState::Lost | HealthState::Excluded
            )
        };
        let gone = (0..groups.controllers()).filter(is_gone).collect();
        (self.changes, gone)
    }

    /// What is wanted of a controller by the thread of its link; none where it has none.
    #[must_use]
    pub(crate) fn wants(&self, controller: usize) -> Option<Arc<LaneWants>> {
        self.peers.get(controller)?.wants()
    }

    pub(super) fn on_sent(&mut self, sent: Sent) {
        match sent {
            Sent::Posted { lane, frame, asked, at, lights, shakes } => {
                self.health.on_sent(usize::from(lane), frame, asked, at);
                self.peers[usize::from(lane)].on_sent(&SentFrame { frame, lights, shakes, at });
                self.tended[usize::from(lane)].posted = at;
            }
            Sent::Failed { .. } | Sent::Skipped { .. } => {}
            Sent::Joined { lane } => {
                self.on_joined(self.health.groups().group_of(usize::from(lane)));
            }
            Sent::FellOut { lane, why, shakes } => {
                self.health.on_fell_out(usize::from(lane), why);
                self.peers[usize::from(lane)].on_cut_off(shakes);
            }
            Sent::Unread { lane } => self.health.on_unread(usize::from(lane)),
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

    /// True if a group stands otherwise than the table says.
    pub(super) const fn is_untold(&self) -> bool {
        self.untold
    }

    fn keep(&mut self, change: Change) {
        self.untold = true;
        if self.changes.len() < CHANGES_KEPT {
            self.changes.push(change);
        }
    }

    /// What became of a reply.
    pub(super) fn on_fate(&mut self, reply: &Reply, fate: Fate) {
        let is_refusal = self.peers[reply.controller].on_reply_code(reply.code);
        match fate {
            Fate::Answered(ReplyCode::Running) => {
                self.tended[reply.controller].answered = reply.at;
                self.peers[reply.controller].on_ack(reply.frame);
                self.health.on_ack(reply.controller, reply.frame, reply.at);
            }
            Fate::Answered(_) if is_refusal => self.judge(HealthInput::Refused(reply.controller)),
            Fate::Duplicate | Fate::Stray => self.mind_foreign(reply.controller, fate),
            _ => {}
        }
    }

    /// Whether no frames are sent.
    pub(super) fn is_idle(&self) -> bool {
        !self.live.is_moving()
    }

    /// Notes how often a controller's port was found closed so far.
    pub(super) fn on_closed(&self, controller: usize, times: u64) {
        if let Some(standby) = &self.standby {
            standby.on_closed(controller, times);
        }
    }

    /// The next motion begins where the last one left the seats. That somebody has moved one since is worth a word: off park, or in a
    /// pause off where it was read first.
    fn mind_rest(&mut self, controller: usize, place: &Whereabouts) {
        let is_set = matches!(self.state, State::Parked | State::Armed | State::Paused);
        let stands = self.stands(controller);
        if !is_set || self.standby.is_none() || self.live.is_moving() {
            self.paused_at[controller] = None;
            return;
        }
        let Some(reading) = place.reading.filter(|reading| reading.rests && stands.may_move()) else {
            return;
        };
        let is_off = if self.state == State::Paused {
            self.paused_at[controller].get_or_insert(reading).differs(&reading, MOVED)
        } else {
            place.is_off_park
        };
        if is_off && stands != HealthState::Rejoining {
            self.judge(HealthInput::Moved(controller));
        }
    }

    /// Tells whoever looks how the controllers stand.
    pub(super) fn tell_table(&mut self, tracker: &Tracker, observer: &Observer) {
        let mut turns = std::mem::take(&mut self.turns);
        let Self { health, standby, looked, live, .. } = &*self;
        let is_told = live.on_table(|rows| {
            let row = |controller: usize, before: Option<&Row>| {
                let group = health.groups().group_of(controller);
                let (left_on, left_since) = self.left_on(controller);
                Row {
                    left_on,
                    left_since,
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
        (self.turns, self.untold) = (turns, !is_told);
    }

    /// Judges all at `now`, an instant up to which all was told.
    pub(super) fn look(&mut self, observer: &Observer, now: MonoTime) {
        self.looked = now;
        let health = &mut self.health;
        self.heard = observer.events_since(self.heard, |event| health.on_event(event));
        if let Some(records) = &mut self.records {
            records.on_events();
        }
        for (controller, state) in observer.states().iter().enumerate() {
            let Some(at) = state.reported_at else { continue };
            self.health.on_status(controller, at);
            if let Some(told) = state.measured.filter(|told| told.at == at && at > self.reported[controller])
            {
                self.reported[controller] = at;
                let outputs = state.outputs.filter(|outputs| outputs.at == at).map(|outputs| outputs.value);
                self.tended[controller].answered = at;
                if let Some(place) = self.peers[controller].on_report(&told.value, outputs, at) {
                    self.publish(controller, &place);
                }
            }
        }
        self.look_anew(now);
        self.stand_by();
        self.beat(now);
        self.read_all();
        self.tend(now);
        let notices = &mut self.notices;
        self.health.tick(now, &mut |notice| notices.push(notice));
        if let Some(records) = &mut self.records {
            records.on_judged();
        }
        for index in 0..self.notices.len() {
            self.tell(self.notices[index]);
        }
        self.notices.clear();
        self.mind_broadcast(now);
        self.tell_of_zeros();
        self.end_look_anew(now);
        self.send_alarms();
        if let Some(records) = &mut self.records {
            records.end_look();
        }
    }

    fn tell(&mut self, notice: Notice) {
        match notice {
            // Of a hall that is told as it stands.
            Notice::Hall(Event::Rebooted(_)) if self.standby.is_some() => {}
            Notice::Hall(event) => self.alarm(Alarm::Event(event)),
            // Preflight counts every datagram that a controller received, and would take the answers for its own.
            Notice::Read(_) | Notice::Count(_) if self.is_hushed() => {}
            // A homing is watched by who ordered it; only those that are looked for are looked at beside.
            Notice::Read(controller) if self.is_asked_otherwise() && self.stands(controller).may_move() => {}
            Notice::Count(controller) => drop(self.ask(controller, Need::Count, self.looked)),
            Notice::Read(controller) => {
                let datagrams = self.ask(controller, Need::Identity, self.looked);
                self.judge(HealthInput::ReadSent(controller, datagrams));
            }
            Notice::Group(change) => {
                self.keep(change);
                for controller in 0..self.peers.len() {
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

    /// How the group of a controller stands.
    pub(super) fn stands(&self, controller: usize) -> HealthState {
        self.health.standing(self.health.groups().group_of(controller))
    }

    fn takes_part(&self, controller: usize) -> bool {
        self.standby.as_ref().is_none_or(|standby| standby.takes_part(controller))
    }

    /// What a lane has to do because its group stands otherwise.
    fn tell_lane(&mut self, controller: usize, change: Change) {
        let lane = u16::try_from(controller).expect("fewer controllers than ports");
        match change.to {
            HealthState::Stopped => self.alarm(Alarm::Cut(lane)),
            HealthState::Rejoining => self.alarm(Alarm::Found(lane)),
            to if !to.may_move() => self.alarm(Alarm::Leave(lane)),
            _ => {}
        }
    }

    /// What finds no room waits for the next look: the tick thread hears all of it, in this order.
    fn alarm(&mut self, alarm: Alarm) {
        self.waiting.push_back(alarm);
    }

    fn send_alarms(&mut self) {
        while let Some(alarm) = self.waiting.pop_front() {
            if let Err(PushError::Full(alarm)) = self.alarms.push(alarm) {
                self.waiting.push_front(alarm);
                return;
            }
        }
    }

    /// Tells the hall whether all that take part know their positions. One that is out may be at work on: it holds up nobody.
    fn tell_of_zeros(&mut self) {
        if self.standby.is_none() {
            return;
        }
        let groups = self.health.groups();
        let is_lost = |controller: &usize| {
            self.health.standing(groups.group_of(*controller)) == HealthState::Excluded
                && self.takes_part(*controller)
        };
        let lost = (0..groups.controllers()).find(is_lost);
        match (std::mem::replace(&mut self.lost_zero, lost.is_some()), lost) {
            (false, Some(controller)) => self.alarm(Alarm::Event(Event::Rebooted(controller))),
            (true, None) => self.alarm(Alarm::Event(Event::ZerosKnown)),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
