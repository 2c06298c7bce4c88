//! The network of a virtual hall, and its clock: what it does to the datagrams of each seat, in either direction.

use std::collections::VecDeque;
use std::net::SocketAddrV4;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use kinocue::harness::net::{Delivery, Network, Origin, SendFault};
use kinocue::harness::time::{Clock, MonoTime};

use super::dice::Dice;
use super::master::{Master, UNKNOWN};
use super::seat::{Arrival, MS, REGISTERS, Seat, Settings};
use super::words::{self, Heard};

/// The way that a datagram goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    There,
    Back,
}

/// What befalls the datagrams of a seat for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Weather {
    /// None arrives there.
    Lost,
    /// One in so many does not.
    Thin(u64),
    /// None comes back.
    Mute,
    /// One in so many of those that come back does not arrive.
    Hoarse(u64),
    /// Neither.
    Cut,
    /// All that goes there waits for the end of it.
    Held,
    /// All that comes back does.
    HeldBack,
    /// Some that go there come a little later, each by up to so many milliseconds, in their order.
    Late(u64),
    /// Some come twice, or in another order, by less than what README admits.
    Shuffled,
    /// Replies come twice or late, by up to so many milliseconds, in any order.
    Echo(u64),
    /// The kernel takes none.
    Refused,
    /// The first so many of each row of frames of motion that go there, or of their replies, do not arrive.
    Pattern { way: Way, lost: u64, of: u64 },
    /// None of those of the first so many milliseconds of each row of them.
    Bursts { way: Way, lost_ms: u64, of_ms: u64 },
    /// All that goes there, and all that comes back, takes so many milliseconds more.
    Far { there: u64, back: u64 },
    /// Frames of motion do not arrive whose Time is longer than so many milliseconds.
    Slow(u32),
}

/// When the seats' time begins.
pub(crate) const BEGIN: u64 = 1_000 * MS;
/// Answers and reports of a seat that are kept.
const KEPT: usize = 2_000;
/// So long after a frame, or after somebody asked for motion, nobody jogs a seat.
const JUST: u64 = 300 * MS;

/// Weather in which no true answer arrives.
const DEAF: [Weather; 3] = [Weather::Lost, Weather::Cut, Weather::Mute];

#[derive(Debug, Clone)]
struct Packet {
    at: u64,
    sent: u64,
    lost_since: u64,
    asked: bool,
    octets: Vec<u8>,
    /// Of a stretch of old answers: they are of both sources of a place.
    of_stretch: bool,
}

#[derive(Debug)]
pub(crate) struct Line {
    pub(crate) seat: Seat,
    weather: Vec<(u64, Weather)>,
    there: VecDeque<Packet>,
    back: VecDeque<Packet>,
    /// Frames of motion that the kernel took.
    pub(crate) frames: u64,
    /// Replies to such.
    replies: u64,
    /// When the newest was to be sent; and the first of those since the last that will arrive.
    pub(crate) newest: u64,
    lost_since: Option<u64>,
    master: Option<Master>,
    /// Answers and reports of its seat, oldest first: the network may deliver them again.
    pub(crate) said: VecDeque<(u64, Vec<u8>)>,
}

impl Line {
    /// Somebody jogs an axis: nobody does while frames come, or have just been asked for; nor one of which nothing tells, unless
    /// the seat has to be homed.
    fn jog(&mut self, axis: usize, mm: f64, now: u64, asked_at: u64) -> bool {
        let quiet = now > self.newest + JUST && now > asked_at + JUST;
        let is_told = axis < REGISTERS || self.seat.settings.report_ms > 0 || !self.seat.homed;
        quiet && is_told && self.there.is_empty() && self.seat.jog(axis, mm, now)
    }

    /// Whether anything befalls its datagrams, or did so long ago.
    pub(crate) fn is_troubled(&self, now: u64, ago: u64) -> bool {
        self.master.is_some() || self.weather.iter().any(|(until, _)| *until + ago > now)
    }

    fn is(&self, now: u64, weather: Weather) -> Option<u64> {
        self.weather.iter().find(|(until, what)| *until > now && *what == weather).map(|(until, _)| *until)
    }

    fn until(&self, now: u64, is: impl Fn(&Weather) -> bool) -> Option<(u64, Weather)> {
        self.weather.iter().find(|(until, what)| *until > now && is(what)).copied()
    }
}

/// Everything but the program under test.
#[derive(Debug)]
pub(crate) struct World {
    pub(crate) lines: Vec<Line>,
    dice: Dice,
    /// Whether a person has asked for motion, and when one did.
    pub(crate) asked: bool,
    pub(crate) asked_at: u64,
    /// What was sent until then was asked for, however late it is read.
    pub(crate) asked_until: u64,
    /// Frames of motion in words, where somebody wants to read them.
    pub(crate) frames: Option<Vec<String>>,
    /// Recordings of the halls that were, where somebody wants them.
    pub(crate) recordings: Option<Vec<Vec<u8>>>,
    /// The frames of motion that each seat was sent, but for their numbers and who was to take them, where somebody wants them.
    pub(crate) executed: Option<Vec<Vec<Vec<u8>>>>,
    /// The newest reply to a frame of motion.
    pub(crate) last_reply: Option<Vec<u8>>,
    /// What somebody else has sent.
    pub(crate) strangers: VecDeque<(SocketAddrV4, Vec<u8>)>,
    /// A seat that takes no broadcasts, and somebody else who answers them.
    pub(crate) deaf_to_all: Option<usize>,
    pub(crate) stranger_answers: Option<SocketAddrV4>,
    /// A seat at whose address there is a second controller, which takes what goes to all.
    pub(crate) twice: Option<usize>,
    /// How many seats, the last, are not in the network; and whether they take what goes to all of it nevertheless.
    pub(crate) outside: usize,
    pub(crate) outside_takes: bool,
    /// The kernel takes nothing that is to go to all.
    pub(crate) refuses_all: bool,
    /// Frames of motion, and questions, that went to all.
    pub(crate) to_all: [u64; 2],
}

/// The network, with its clock.
#[derive(Debug, Clone)]
pub(crate) struct Ether {
    now: Arc<AtomicU64>,
    world: Arc<Mutex<World>>,
}

impl Ether {
    pub(crate) fn new(seats: &[Settings], seed: u64) -> Self {
        let line = |(index, settings): (usize, &Settings)| Line {
            seat: Seat::new(index, *settings),
            weather: Vec::new(),
            there: VecDeque::new(),
            back: VecDeque::new(),
            frames: 0,
            replies: 0,
            newest: 0,
            lost_since: None,
            master: None,
            said: VecDeque::new(),
        };
        let lines = seats.iter().enumerate().map(line).collect();
        let dice = Dice::new(!seed);
        let world = World {
            lines,
            dice,
            asked: false,
            asked_at: 0,
            asked_until: 0,
            frames: None,
            recordings: None,
            executed: None,
            last_reply: None,
            strangers: VecDeque::new(),
            deaf_to_all: None,
            stranger_answers: None,
            twice: None,
            outside: 0,
            outside_takes: false,
            refuses_all: false,
            to_all: [0; 2],
        };
        Self { now: Arc::new(AtomicU64::new(BEGIN)), world: Arc::new(Mutex::new(world)) }
    }

    pub(crate) fn ns(&self) -> u64 {
        self.now.load(Ordering::Relaxed)
    }

    pub(crate) fn world(&self) -> MutexGuard<'_, World> {
        self.world.lock().expect("nothing panics with it")
    }

    /// Lets time pass until then, never back.
    pub(crate) fn pass_to(&self, ns: u64) {
        let ns = ns.max(self.ns());
        self.now.store(ns, Ordering::Relaxed);
        self.world().deliver(ns);
    }

    /// Somebody jogs an axis of a seat; says whether that could be.
    pub(crate) fn jog(&self, seat: usize, axis: usize, mm: f64, now: u64) -> bool {
        let world = &mut *self.world();
        world.lines[seat].jog(axis, mm, now, world.asked_at)
    }

    /// Takes a datagram that was sent at that instant.
    pub(crate) fn take_in(&self, lane: usize, datagram: &[u8], sent: u64) -> Delivery {
        let now = self.ns();
        let World { lines, dice, asked, asked_until, frames, executed, .. } = &mut *self.world();
        let asked = *asked || sent <= *asked_until;
        let delivery = lines[lane].take(datagram, (now, sent), asked, dice);
        if let (Some(executed), Heard::Motion(_)) = (executed, words::hear(datagram)) {
            executed[lane].push([&datagram[..8], &datagram[16..]].concat());
        }
        if let (Some(frames), Heard::Motion(frame)) = (frames, words::hear(datagram)) {
            let places: Vec<i32> = frame.positions[..frame.axes].iter().map(|at| at / 200).collect();
            let (at, number, ms) = (now as f64 * 1e-9, frame.number, frame.time_ms);
            frames.push(format!(
                "{at:8.4} s: seat {}: frame {number}, {ms} ms to {places:?} tenths of a mm, {delivery:?}",
                lane + 1
            ));
        }
        delivery
    }

    /// What has come back from a seat.
    pub(crate) fn take_back(&self, seat: usize) -> Option<Vec<u8>> {
        let now = self.ns();
        self.world().lines[seat].next_back(now).map(|packet| packet.octets)
    }

    /// Another master sends to a seat.
    pub(crate) fn intrude(&self, seat: usize, master: Master) {
        self.world().lines[seat].master = Some(master);
    }

    /// Two seats exchange their addresses; what is on its way to them is lost.
    pub(crate) fn exchange(&self) {
        let [one, other] = &mut self.world().lines[..] else { panic!("two are exchanged") };
        std::mem::swap(&mut one.seat, &mut other.seat);
        std::mem::swap(&mut one.seat.settings.address, &mut other.seat.settings.address);
        for line in [one, other] {
            line.there.clear();
            line.back.clear();
        }
    }

    /// Whatever befell seats is over.
    pub(crate) fn calm(&self) {
        let now = self.ns();
        for line in &mut self.world().lines {
            line.weather.iter_mut().for_each(|(until, _)| *until = now.min(*until));
        }
    }

    /// It becomes so for a while.
    pub(crate) fn turns(&self, seat: usize, weather: Weather, ms: u64) {
        let now = self.ns();
        let line = &mut self.world().lines[seat];
        // What comes in another order by less than is admitted, and is late or lost besides, may be so by more.
        if weather == Weather::Shuffled && line.there.back().is_some_and(|last| last.at > now + MS) {
            return;
        }
        line.weather.retain(|(until, other)| {
            *until > now && *other != Weather::Shuffled && weather != Weather::Shuffled
        });
        line.weather.push((now + ms * MS, weather));
    }
}

impl World {
    /// Brings what has arrived at the seats by then, and has them answer.
    fn deliver(&mut self, now: u64) {
        let Self { lines, dice, asked_at, last_reply, twice, .. } = self;
        for (seat, line) in lines.iter_mut().enumerate() {
            while line.there.front().is_some_and(|packet| packet.at <= now) {
                line.intrude(line.there[0].at, *asked_at);
                let Some(Packet { at, sent, lost_since, asked, octets, .. }) = line.there.pop_front() else {
                    break;
                };
                if let Some(reply) = line.seat.hear(&octets, Arrival { at, sent, lost_since, asked }) {
                    if matches!(reply[4], 0x13 | 0x14) {
                        *last_reply = Some(reply.clone());
                    }
                    if *twice == Some(seat) && words::is_to_all(&octets) {
                        line.answer(reply.clone(), at, dice);
                    }
                    line.answer(reply, at, dice);
                }
            }
            line.intrude(now, *asked_at);
            line.seat.advance(now);
            if let Some(report) = line.seat.report(now) {
                line.answer(report, now, dice);
            }
        }
    }
}

/// How long a datagram takes where nothing is wrong: 100 to 400 µs.
fn flight(dice: &mut Dice) -> u64 {
    dice.range(100_000, 400_000)
}

impl Line {
    /// What another master has sent by then arrives.
    fn intrude(&mut self, now: u64, asked_at: u64) {
        let Some(master) = &mut self.master else { return };
        let moves_until = (self.newest + JUST).max(asked_at + JUST);
        master.send(&mut self.seat, now, moves_until);
        self.master.take_if(|master| master.is_over());
    }

    /// The network delivers that at an instant, whatever befalls all else.
    pub(crate) fn deliver_again(&mut self, octets: Vec<u8>, at: u64, of_stretch: bool) {
        insert(&mut self.back, Packet { at, sent: at, lost_since: at, asked: false, octets, of_stretch });
    }

    /// The next that has come back by then.
    fn next_back(&mut self, now: u64) -> Option<Packet> {
        loop {
            let packet = self.back.pop_front_if(|packet| packet.at <= now)?;
            // README: where old answers of both sources arrive and no true one does, nobody can know that they are old.
            let is_deaf = || DEAF.iter().any(|weather| self.is(packet.at, *weather).is_some());
            if !(packet.of_stretch && (self.seat.is_away(packet.at) || is_deaf())) {
                return Some(packet);
            }
        }
    }

    /// Whether the pattern of the weather loses the one of that number that goes that way.
    fn is_of_pattern(&self, now: u64, on: Way, number: u64) -> bool {
        let is_lost = |what: &Weather| match what {
            Weather::Pattern { way, lost, of } => *way == on && number % of < *lost,
            Weather::Bursts { way, lost_ms, of_ms } => *way == on && now / MS % of_ms < *lost_ms,
            _ => false,
        };
        self.until(now, is_lost).is_some()
    }

    /// How much longer what goes there takes, and what comes back, ns.
    fn far(&self, now: u64) -> [u64; 2] {
        match self.until(now, |what| matches!(what, Weather::Far { .. })) {
            Some((_, Weather::Far { there, back })) => [there * MS, back * MS],
            _ => [0; 2],
        }
    }

    fn answer(&mut self, octets: Vec<u8>, at: u64, dice: &mut Dice) {
        let moves = matches!(octets[4], 0x13 | 0x14);
        self.replies += u64::from(moves);
        if moves && self.is_of_pattern(at, Way::Back, self.replies) {
            return;
        }
        if !matches!(octets[4], 0x13 | 0x14 | 0x18 | 0x19) {
            self.said.drain(..self.said.len().saturating_sub(KEPT));
            self.said.push_back((at, octets.clone()));
        }
        let hoarse = self.until(at, |what| matches!(what, Weather::Hoarse(_)));
        let lost = matches!(hoarse, Some((_, Weather::Hoarse(times))) if dice.one_in(times));
        if lost || self.is(at, Weather::Mute).is_some() || self.is(at, Weather::Cut).is_some() {
            return;
        }
        let held = self.is(at, Weather::HeldBack).map_or(0, |until| until - at);
        let arrives = at + flight(dice) + held + self.far(at)[1];
        if let Some((_, Weather::Echo(ms))) = self.until(at, |what| matches!(what, Weather::Echo(_))) {
            if dice.one_in(3) {
                let later = arrives + dice.range(0, ms * MS);
                insert(
                    &mut self.back,
                    Packet {
                        at: later,
                        sent: at,
                        lost_since: at,
                        asked: false,
                        octets: octets.clone(),
                        of_stretch: false,
                    },
                );
            }
            if dice.one_in(3) {
                let later = arrives + dice.range(0, ms * MS);
                return insert(
                    &mut self.back,
                    Packet { at: later, sent: at, lost_since: at, asked: false, octets, of_stretch: false },
                );
            }
        }
        insert(
            &mut self.back,
            Packet { at: arrives, sent: at, lost_since: at, asked: false, octets, of_stretch: false },
        );
    }

    fn take(&mut self, octets: &[u8], (now, sent): (u64, u64), asked: bool, dice: &mut Dice) -> Delivery {
        let moves = matches!(octets.get(4), Some(0x13 | 0x14 | 0x18 | 0x19));
        // What was lost of an earlier motion is none of this.
        self.lost_since = self.lost_since.filter(|_| !moves || now <= self.newest + JUST);
        let lost_since = if moves { *self.lost_since.get_or_insert(sent) } else { sent };
        if moves {
            if now > self.newest + JUST && self.seat.is_just_disturbed(now) {
                self.seat.excuse(now + UNKNOWN);
            }
            self.newest = now;
        }
        if self.is(now, Weather::Refused).is_some() {
            return Delivery::Failed(SendFault::of(libc::ENOBUFS));
        }
        self.frames += u64::from(moves);
        let thin = self.until(now, |what| matches!(what, Weather::Thin(_)));
        let lost = matches!(thin, Some((_, Weather::Thin(times))) if dice.one_in(times));
        let slow = self.until(now, |what| matches!(what, Weather::Slow(_)));
        let lost = lost || (moves && self.is_of_pattern(now, Way::There, self.frames));
        let lost = lost || matches!(slow, Some((_, Weather::Slow(ms))) if words::takes_longer(octets, ms));
        if lost || self.is(now, Weather::Lost).is_some() || self.is(now, Weather::Cut).is_some() {
            return Delivery::Sent;
        }
        if moves {
            self.lost_since = None;
        }
        let octets = octets.to_vec();
        let held = self.is(now, Weather::Held).map_or(0, |until| until - now);
        let mut at = now + flight(dice) + held + self.far(now)[0];
        if let Some((_, Weather::Late(ms))) = self.until(now, |what| matches!(what, Weather::Late(_))) {
            at += dice.range(0, ms * MS);
        }
        let packet = Packet { at, sent, lost_since, asked, octets, of_stretch: false };
        if held == 0 && self.is(now, Weather::Shuffled).is_some() {
            let later = now.max(sent + dice.range(1, 40) * MS);
            if dice.one_in(6) {
                insert(&mut self.there, Packet { at: later, ..packet.clone() });
            } else if dice.one_in(6) {
                // What overtakes it ends the loss, not this.
                self.lost_since = moves.then_some(lost_since);
                insert(&mut self.there, Packet { at: later, ..packet });
                return Delivery::Sent;
            }
        } else {
            // One way keeps the order of what goes along it.
            at = at.max(self.there.back().map_or(0, |last| last.at));
        }
        insert(&mut self.there, Packet { at, ..packet });
        Delivery::Sent
    }
}

/// Puts a datagram where it belongs by the time of its arrival.
fn insert(queue: &mut VecDeque<Packet>, packet: Packet) {
    let place = queue.iter().rposition(|other| other.at <= packet.at).map_or(0, |last| last + 1);
    queue.insert(place, packet);
}

impl Network for Ether {
    fn lanes(&self) -> usize {
        self.world().lines.len()
    }

    fn send(&self, lane: usize, datagram: &[u8]) -> Delivery {
        self.take_in(lane, datagram, self.ns())
    }

    fn send_to_all(&self, datagram: &[u8]) -> Delivery {
        let now = self.ns();
        let world = self.world();
        if world.refuses_all || world.lines.iter().any(|line| line.is(now, Weather::Refused).is_some()) {
            return Delivery::Failed(SendFault::of(libc::ENOBUFS));
        }
        let lanes = world.lines.len() - if world.outside_takes { 0 } else { world.outside };
        let deaf = world.deaf_to_all;
        drop(world);
        for lane in (0..lanes).filter(|lane| deaf != Some(*lane)) {
            self.take_in(lane, datagram, now);
        }
        let world = &mut *self.world();
        world.to_all[usize::from(!matches!(words::hear(datagram), Heard::Motion(_)))] += 1;
        if let (Some(from), Heard::Read { .. }) = (world.stranger_answers, words::hear(datagram)) {
            world.strangers.push_back((from, words::register_reply(datagram, 2, 0, &[0, 99])));
        }
        Delivery::Sent
    }

    fn drain(&self, on: &mut dyn FnMut(Origin, &[u8], MonoTime)) -> MonoTime {
        let now = self.ns();
        for lane in 0..self.lanes() {
            loop {
                // What hears it may send.
                let mut world = self.world();
                let Some(packet) = world.lines[lane].next_back(now) else { break };
                drop(world);
                on(Origin::Controller(lane), &packet.octets, MonoTime::from_nanos(packet.at));
            }
        }
        loop {
            let next = self.world().strangers.pop_front();
            let Some((from, octets)) = next else { break };
            on(Origin::Stranger(from), &octets, MonoTime::from_nanos(now));
        }
        MonoTime::from_nanos(now)
    }

    fn port_closed(&self, _lane: usize) -> u64 {
        0
    }
}

impl Clock for Ether {
    fn now(&self) -> MonoTime {
        MonoTime::from_nanos(self.ns())
    }

    fn sleep_until(&self, deadline: MonoTime) {
        self.pass_to(deadline.as_nanos());
    }
}
