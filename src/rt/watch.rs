//! What the ack thread makes of all that it hears, beside the books: how each group stands, what the tick thread has to
//! hear of that, and whose registers are read.

use std::sync::Arc;

use rtrb::Producer;

use super::idle::Beats;
use super::live::{Live, Phase};
use super::mail::{Alarm, Sent};
use super::positions::Positions;
use super::sight::Looker;
use super::standby::{Seen, Standby};
use super::table::{Row, Turns};
use crate::belief::Source;
use crate::config::Controller;
use crate::fanout::Lane;
use crate::health::{Change, Health, Notice, Standing};
use crate::motion::Pulses;
use crate::net::Sender;
use crate::observe::Observer;
use crate::state::Event;
use crate::time::MonoTime;
use crate::tracker::{Fate, Reply, Tracker};
use crate::wire::{Dialect, ImaxRegisters, PerAxis, ReplyCode};

/// Changes that are kept for the report.
const CHANGES_KEPT: usize = 1_000;

/// The watch over the controllers of one play.
#[derive(Debug)]
pub struct Watch {
    health: Health,
    lookers: Vec<Looker>,
    /// What each seat tells of where it is.
    positions: Vec<Positions>,
    /// Asks for that while nothing moves.
    beats: Beats,
    sender: Sender,
    alarms: Producer<Alarm>,
    live: Arc<Live>,
    /// Since when a reading of all seats was asked for that was sent last.
    wanted: MonoTime,
    /// When the last status report of each came that was taken up.
    reported: Vec<MonoTime>,
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
        if !silent {
            live.on_reader();
        }
        Self {
            lookers: controllers.iter().zip(lanes).map(|(one, lane)| Looker::new(one, lane)).collect(),
            positions: controllers.iter().map(positions).collect(),
            beats: Beats::new(controllers, lanes),
            notices: Vec::with_capacity(4 * (controllers.len() + groups) + 4),
            changes: Vec::with_capacity(CHANGES_KEPT),
            wanted: MonoTime::default(),
            reported: vec![MonoTime::default(); controllers.len()],
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
                self.positions[usize::from(lane)].on_sent();
            }
            Sent::Failed { .. } => {}
            Sent::Joined { lane } => {
                self.on_joined(self.health.groups().group_of(usize::from(lane)));
            }
            Sent::FellOut { lane } => self.health.on_fell_out(usize::from(lane)),
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
            // With x = 4 an SMC controller tells of an emergency stop, which the observer hears.
            Fate::Answered(code) if !(smc && code == ReplyCode::EmergencyStop) => {
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
        if let Some((first, positions)) = looker.take_positions() {
            self.on_positions(controller, first, &positions, at, Source::Registers);
        }
        if is_answer || awaited {
            self.health.on_answer(controller, at);
        }
        if ImaxRegisters::parse(octets).is_ok_and(|reply| reply.is_wide()) {
            self.health.on_wide_registers(controller);
        }
        self.take_sighting(controller, at);
        is_answer || awaited
    }

    /// Where some axes of a seat are: what is known by now of all of them is for the tick thread, too.
    fn on_positions(&mut self, controller: usize, first: usize, told: &[Pulses], at: MonoTime, by: Source) {
        let positions = &mut self.positions[controller];
        positions.hear(first, told, at, by);
        self.health.on_outside(controller, positions.outside());
        self.health.on_ambiguous(controller, positions.is_ambiguous());
        if let (Some(reading), Some(evidence)) = (positions.reading(at), self.live.evidence(controller)) {
            evidence.on_reading(&reading);
        }
    }

    /// Whoever joins from where it is found has to be at rest there.
    fn take_sighting(&mut self, controller: usize, at: MonoTime) {
        let standing = self.stands(controller);
        let Some(reading) = self.positions[controller].reading(at) else { return };
        let looker = &mut self.lookers[controller];
        let Some(sighting) = looker.take() else { return };
        if reading.rests || !standing.is_looked_at() {
            self.health.on_sighting(controller, &sighting, at);
            if let Some(standby) = &mut self.standby {
                let at_park = looker.is_parked(&reading.pose);
                standby.on_seen(controller, Seen { homed: sighting.homed, at_park });
            }
        }
    }

    /// Whether it is that of a hall that sends no frames.
    pub(super) fn is_idle(&self) -> bool {
        !self.silent && !self.live.is_moving()
    }

    /// Notes how often a controller's port was found closed so far.
    pub(super) fn on_closed(&self, controller: usize, times: u64) {
        if let Some(standby) = &self.standby {
            standby.on_closed(controller, times);
        }
    }

    /// Hears an answer to a beat: a sign of life, and where the axes of the seat are, as far as that is known by now; none where
    /// it is none.
    pub(super) fn hear_beat(
        &mut self,
        controller: usize,
        octets: &[u8],
        at: MonoTime,
    ) -> Option<PerAxis<Pulses>> {
        let (first, told) = self.beats.hear(controller, octets)?;
        self.on_positions(controller, first, &told, at, Source::Registers);
        self.health.on_status(controller, at);
        self.mind_rest(controller, at);
        self.positions[controller].told()
    }

    /// Hears an answer to a beat that asked for inputs: a sign of life, and which are active; none where it is none.
    pub(super) fn hear_inputs(&mut self, controller: usize, octets: &[u8], at: MonoTime) -> Option<u16> {
        let inputs = self.beats.hear_inputs(controller, octets)?;
        self.health.on_status(controller, at);
        Some(inputs)
    }

    /// The next show begins where the last one left the seats. That somebody has moved one since is worth a word.
    fn mind_rest(&mut self, controller: usize, at: MonoTime) {
        let is_set = matches!(self.phase, Phase::Parking | Phase::Joining) && !self.live.is_moving();
        if !is_set || self.standby.is_none() || !self.stands(controller).may_move() {
            return;
        }
        let Some(reading) = self.positions[controller].reading(at).filter(|reading| reading.rests) else {
            return;
        };
        if self.stands(controller) != Standing::Rejoining
            && !self.lookers[controller].rests_at_park(&reading.pose)
        {
            self.health.on_moved(controller);
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
            let Some(at) = state.reported_at else { continue };
            self.health.on_status(controller, at);
            if let Some(told) = state.measured.filter(|told| told.at == at && at > self.reported[controller])
            {
                self.reported[controller] = at;
                self.on_positions(controller, 0, &told.value, at, Source::Report);
            }
        }
        self.look_anew();
        self.stand_by();
        self.beat(now);
        self.read_all();
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
            Standing::Rejoining => self.alarm(Alarm::Found(lane)),
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

    /// A motion that begins waits for readings of where the seats are by now.
    fn read_all(&mut self) {
        let wanted = self.live.wanted();
        if self.silent || std::mem::replace(&mut self.wanted, wanted) == wanted {
            return;
        }
        for controller in 0..self.lookers.len() {
            if self.stands(controller).may_move() {
                let sent = self.beats.send_all(controller, &self.sender);
                self.health.on_other_sent(controller, sent);
            }
        }
    }

    /// While nothing moves, no ack tells that a controller lives, nor where its seat is.
    fn beat(&mut self, now: MonoTime) {
        // Preflight counts every datagram that a controller received: none of ours may come between.
        if self.silent
            || self.live.is_moving()
            || self.is_hushed()
            || self.is_asked_otherwise()
            || !self.beats.take(now)
        {
            return;
        }
        for controller in 0..self.lookers.len() {
            if self.stands(controller).may_move() && self.beats.send(controller, &self.sender) {
                self.health.on_beat_sent(controller, now);
            }
        }
    }

    fn stand_by(&mut self) {
        let Self { standby, health, positions, live, untold, .. } = self;
        let Some(standby) = standby else { return };
        standby.serve(health, |homed| positions[homed].on_homed());
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

/// What the seat of a controller tells of where it is.
fn positions(controller: &Controller) -> Positions {
    Positions::new(Arc::clone(&controller.seat), controller.first_slot())
}
