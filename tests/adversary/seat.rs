//! A seat as the manuals of its controller describe it: what it is told goes through a queue, a Time is how long a move
//! takes, and whatever is wrong with a command is executed all the same. Between commands of motion it goes in straight
//! lines.

use std::collections::VecDeque;

use super::judge::{Breach, Executed, FASTEST, How, OUTSIDE_MM, PULSES_PER_MM, admitted_ms, read_before_ns};
use super::words::{self, Frame, Heard};

pub(crate) const MS: u64 = 1_000_000;
/// Frames of one ride are not farther apart, unless the seat was lost.
const LOST: u64 = 300 * MS;
/// More than so many waiting are gone through in haste, where PA06 says so.
const PATIENT: usize = 2;
/// Commands that find room.
const DEPTH: usize = 200;
/// PA09: how long a move takes that says no time.
const NO_TIME_MS: u64 = 100;
/// PA93: an input has to stay so long.
const FILTER: u64 = 200 * MS;
/// How fast an axis goes by itself: to its zero, or jogged, mm/s.
const OWN_MM_S: f64 = 60.0;
const JOG_MM_S: f64 = 40.0;
/// How long after a frame it is led, and cannot be jogged.
const LED: u64 = 150 * MS;
/// How long frames count as bunched after two of them came closer together than they were sent.
const BUNCHED: u64 = 500 * MS;
/// What README admits that may be lost.
const ADMITTED: u64 = 50 * MS;
/// Frames further apart may be of two programs, each with its own numbers.
const ONE_MOTION: u64 = 300 * MS;
/// Frames of another master further apart are of two.
const BOUT: u64 = 1_000 * MS;
/// For how long a seat is looked at before it counts as at rest.
const UNSEEN: u64 = 150 * MS;
/// A seat that does not hear is seen to be elsewhere once it is so far from where it is led, mm, and within so long.
const VISIBLE_MM: f64 = 1.5;
const SEEN: u64 = 350 * MS;
/// Axes that have registers of their positions, and the first of the two of each.
pub(crate) const REGISTERS: usize = 6;
const POSITIONS: [u16; REGISTERS] = [0x06, 0x08, 0x0a, 0x21, 0x23, 0x25];

/// How its controller is set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Settings {
    pub(crate) axes: usize,
    /// The axis that has no end, and looks for no zero: where it is when it homes is its zero (PA03).
    pub(crate) turntable: Option<usize>,
    /// What its type allows, mm/s; its own cap is off, so that it hides nothing.
    pub(crate) mm_s: f64,
    /// Whether it is an IMAX or MBOX.
    pub(crate) mbox: bool,
    /// Whether it says that it knows its zero though it does not (DPF0).
    pub(crate) lies: bool,
    /// Whether it leaves reads of its positions unanswered.
    pub(crate) shy: bool,
    /// Whether the upper word of a position comes first.
    pub(crate) high_first: bool,
    /// PA06.
    pub(crate) hurry: bool,
    /// PA0b, 0 for none.
    pub(crate) cut_ms: u32,
    /// PA91.
    pub(crate) stop_mode: u8,
    /// PA1e, 0 for no reports.
    pub(crate) report_ms: u32,
    /// How often the hall sends.
    pub(crate) period_ms: f64,
    /// How often the hall asks for an ack.
    pub(crate) asks_ms: f64,
    /// How much later than they were sent datagrams may be noticed, ms: none in virtual time, some on a busy machine.
    pub(crate) jitter_ms: f64,
    /// Where its controller listens, as it knows.
    pub(crate) address: ([u8; 4], u16),
}

/// A command on its way through the queue.
#[derive(Debug, Clone, Copy)]
struct Command {
    to: [f64; 12],
    axes: usize,
    time_ns: u64,
    sent_ns: u64,
    lost_since: u64,
    asked: bool,
    number: u32,
    /// Whether its Time is its own, whatever came before it.
    relative: bool,
    /// Whether another master sent it.
    foreign: bool,
}

/// A frame that was executed.
#[derive(Debug, Clone, Copy)]
struct Last {
    sent_ns: u64,
    time_ms: f64,
    number: u32,
    /// That of the newest, and its Time: this may be an old one that the network repeats.
    newest: u32,
    newest_ms: f64,
}

#[derive(Debug, Clone, Copy)]
struct Move {
    from: [f64; 12],
    to: [f64; 12],
    begin: u64,
    end: u64,
    why: Why,
}

/// What a move is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Why {
    /// A frame, or a person where none comes.
    Led,
    /// It homes; what it is told meanwhile it acks and does not do.
    Homes,
    /// It is jogged at its keys, and the same.
    Keys,
}

/// How a datagram came.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrival {
    pub(crate) at: u64,
    pub(crate) sent: u64,
    /// When the first of those was sent that were lost since the one that arrived before.
    pub(crate) lost_since: u64,
    pub(crate) asked: bool,
}

#[derive(Debug)]
pub(crate) struct Seat {
    pub(crate) settings: Settings,
    index: usize,
    /// Where its axes really stand, pulses from their zero, once the last move was over.
    rest: [f64; 12],
    /// What its controller takes for zero.
    zero: [f64; 12],
    moving: Option<Move>,
    jogged: bool,
    queue: VecDeque<Command>,
    last_absolute: Option<u32>,
    /// What was executed last.
    executed: Option<Last>,
    /// Where somebody moved it by hand last: how fast, pulses a nanosecond, from when to when.
    by_hand: ([f64; 12], u64, u64),
    came: Option<(u64, u64)>,
    bunched_until: u64,
    /// Whether its queue has not run empty since frames came bunched.
    heaped: bool,
    /// From when to when nobody told the hall which frames had come.
    pub(crate) untold: (u64, u64),
    packets: u16,
    pub(crate) homed: bool,
    /// Orders to home that it has heard.
    pub(crate) homings: u32,
    dead_until: u64,
    rebooting: bool,
    /// The button, and since when it is so; and whether the controller has seen it.
    button: (bool, u64),
    pub(crate) stopped: bool,
    next_report: u64,
    /// Until when it answers with the place that it had then.
    stale: Option<(u64, [f64; 12])>,
    /// When the first and the last frame came of another master that sends for a while.
    foreign: Option<(u64, u64)>,
    /// What was sent before then is not judged: a hall could not know of them, or that the seat was deaf; and whether they have left it more to do than it has time.
    excused_until: u64,
    /// Whether it was led visibly elsewhere by the frames that come now, since it does not hear.
    astray: bool,
    crowded: bool,
    /// Moves that were hurried though the network brought them as they were sent; and the longest wait in the queue.
    pub(crate) hurried: u32,
    pub(crate) waited_ns: u64,
    pub(crate) fastest: f64,
    /// How often frames stopped and went on.
    pub(crate) stops: u32,
    /// Its outputs, and whether it vibrates: as the last frame or register that it heard had them.
    pub(crate) outputs: u16,
    pub(crate) shakes: bool,
    shake: [(u16, u16); 6],
    /// By how much it vibrated before the frame that came last, pulses.
    shook: f64,
    /// Since when something is on that nobody asks for.
    pub(crate) on_since: Option<u64>,
    pub(crate) breaches: Vec<Breach>,
}

impl Seat {
    pub(crate) fn new(index: usize, settings: Settings) -> Self {
        Self {
            settings,
            index,
            rest: [0.0; 12],
            zero: [0.0; 12],
            moving: None,
            jogged: false,
            queue: VecDeque::new(),
            last_absolute: None,
            executed: None,
            by_hand: ([0.0; 12], 0, 0),
            came: None,
            bunched_until: 0,
            heaped: false,
            untold: (0, 0),
            packets: 17,
            homed: true,
            homings: 0,
            dead_until: 0,
            rebooting: false,
            button: (false, 0),
            stopped: false,
            next_report: 0,
            stale: None,
            foreign: None,
            excused_until: 0,
            astray: false,
            crowded: false,
            hurried: 0,
            waited_ns: 0,
            fastest: 0.0,
            stops: 0,
            outputs: 0,
            shakes: false,
            shake: [(0, 0); 6],
            shook: 0.0,
            on_since: None,
            breaches: Vec::new(),
        }
    }

    /// Where it really stands, pulses.
    pub(crate) fn place(&self, now: u64) -> [f64; 12] {
        let Some(Move { from, to, begin, end, .. }) = self.moving else { return self.rest };
        let part = now.saturating_sub(begin) as f64 / (end - begin).max(1) as f64;
        std::array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * part.min(1.0))
    }

    /// Whether it has no power.
    pub(crate) fn is_away(&self, now: u64) -> bool {
        self.rebooting || now < self.dead_until
    }

    pub(crate) fn is_moving(&self) -> bool {
        self.moving.is_some()
    }

    /// Puts an axis somewhere, as it was before anybody looked.
    pub(crate) fn put(&mut self, axis: usize, mm: f64) {
        self.rest[axis] = mm * PULSES_PER_MM - self.low(axis).abs();
    }

    /// The lower end of its stroke, pulses: that of a turntable is as far below its zero as the other is above.
    fn low(&self, axis: usize) -> f64 {
        if self.settings.turntable == Some(axis) { -75.0 * PULSES_PER_MM } else { 0.0 }
    }

    fn within_stroke(&self, axis: usize, place: f64) -> f64 {
        let low = self.low(axis);
        place.clamp(low, low + 150.0 * PULSES_PER_MM)
    }

    /// Where it is at zero once it has homed from where it is now.
    fn home_zero(&self, now: u64) -> [f64; 12] {
        let place = self.place(now);
        std::array::from_fn(|axis| if self.settings.turntable == Some(axis) { place[axis] } else { 0.0 })
    }

    /// Somebody turns its table while its power is off, or its motor lets go: its controller notices where it has a zero.
    pub(crate) fn turn(&mut self, mm: f64) {
        if let (Some(axis), None) = (self.settings.turntable, self.moving) {
            self.rest[axis] += mm * PULSES_PER_MM;
            self.zero[axis] += if self.rebooting { mm * PULSES_PER_MM } else { 0.0 };
        }
    }

    fn hold(&mut self, now: u64) {
        self.rest = self.place(now);
        self.jogged = false;
        self.moving = None;
        self.queue.clear();
    }

    /// Goes somewhere by itself.
    fn go(&mut self, to: [f64; 12], mm_s: f64, now: u64, why: Why) {
        self.hold(now);
        let far = (0..12).map(|axis| (to[axis] - self.rest[axis]).abs()).fold(0.0, f64::max);
        let takes = (far / PULSES_PER_MM / mm_s * 1e9) as u64;
        self.moving = Some(Move { from: self.rest, to, begin: now, end: now + takes.max(200 * MS), why });
    }

    /// Somebody jogs an axis by so many millimetres, within its stroke; not while it is led or stopped. The next frame ends it.
    pub(crate) fn jog(&mut self, axis: usize, mm: f64, now: u64) -> bool {
        let led = self.came.is_some_and(|(came, _)| now < came + LED);
        if self.is_moving() || self.rebooting || self.stopped || led {
            return false;
        }
        let mut to = self.rest;
        to[axis] = self.within_stroke(axis, to[axis] + mm * PULSES_PER_MM);
        self.go(to, JOG_MM_S, now, Why::Led);
        if let Some(Move { from, to, begin, end, .. }) = self.moving {
            let speed = std::array::from_fn(|axis| (to[axis] - from[axis]).abs() / (end - begin) as f64);
            self.by_hand = (speed, begin, end);
        }
        self.jogged = true;
        true
    }

    /// Somebody takes it out of the hands of whoever leads it, for that long at least: jogs an axis at its keys, or has it home where
    /// none is given. It acks what it is told meanwhile, and does not do it.
    pub(crate) fn seize(&mut self, jogged: Option<(usize, f64)>, now: u64, lasts: u64) {
        self.advance(now);
        if self.rebooting || self.stopped || self.moving.is_some_and(|current| current.why != Why::Led) {
            return;
        }
        let mut to = self.place(now);
        let why = match jogged {
            Some((axis, mm)) => {
                to[axis] = self.within_stroke(axis, to[axis] + mm * PULSES_PER_MM);
                Why::Keys
            }
            None => {
                self.zero = self.home_zero(now);
                (to, self.homed) = (self.zero, false);
                Why::Homes
            }
        };
        self.go(to, JOG_MM_S, now, why);
        if let Some(own) = &mut self.moving {
            own.end = own.end.max(now + lasts);
        }
        (self.executed, self.astray) = (None, false);
    }

    /// Its power goes, and is back after that long: it knows its place no longer.
    pub(crate) fn reboot(&mut self, now: u64, dark: u64) {
        self.hold(now);
        (self.dead_until, self.rebooting, self.homed) = (now + dark, true, false);
        (self.packets, self.last_absolute, self.executed, self.stopped) = (0, None, None, false);
        self.zero = self.rest;
    }

    pub(crate) fn press(&mut self, pressed: bool, now: u64) {
        if self.button.0 != pressed {
            self.button = (pressed, now);
        }
    }

    /// Lives until `now`.
    pub(crate) fn advance(&mut self, now: u64) {
        if self.rebooting && now >= self.dead_until {
            self.rebooting = false;
        }
        let (pressed, since) = self.button;
        if pressed != self.stopped && now >= since + FILTER {
            self.advance_moves(since + FILTER);
            self.on_button(pressed, since + FILTER);
        }
        self.advance_moves(now);
    }

    fn on_button(&mut self, pressed: bool, now: u64) {
        match (pressed, self.settings.stop_mode) {
            (true, 1) => {
                let zero = self.zero;
                self.go(zero, OWN_MM_S, now, Why::Led);
            }
            (true, _) => self.hold(now),
            // Only a reset ends it.
            (false, 2) => return,
            (false, _) => {}
        }
        self.stopped = pressed;
        self.executed = None;
    }

    fn advance_moves(&mut self, now: u64) {
        while let Some(Move { to, end, why, .. }) = self.moving.filter(|current| current.end <= now) {
            self.rest = to;
            self.moving = None;
            self.homed |= why == Why::Homes;
            self.begin_next(end, true);
        }
    }

    /// Begins with the next command; what has waited behind another master's is not judged, whatever the hall could know: no reading
    /// tells of a queue.
    fn begin_next(&mut self, now: u64, has_waited: bool) {
        let waiting = self.queue.len();
        let Some(command) = self.queue.pop_front() else { return };
        let bunched = self.heaped || now < self.bunched_until;
        let hurries = self.settings.hurry && waiting > PATIENT;
        self.hurried += u32::from(hurries && !bunched);
        let takes = (if hurries { command.time_ns / 2 } else { command.time_ns }).max(1);
        let mut to = self.rest;
        let axes = command.axes.min(self.settings.axes);
        for (axis, to) in to.iter_mut().enumerate().take(axes) {
            *to = command.to[axis] + self.zero[axis];
        }
        let sent_before = self.foreign.is_some_and(|(first, _)| command.sent_ns < first);
        let is_excused = command.sent_ns < self.excused_until;
        self.crowded = command.foreign || is_excused || sent_before || (self.crowded && has_waited);
        self.moving = Some(Move { from: self.rest, to, begin: now, end: now + takes, why: Why::Led });
        if command.foreign {
            return;
        }
        self.judge_place(&command, now);
        let executed = Executed {
            far: std::array::from_fn(|axis| to[axis] - self.rest[axis]),
            ms: takes as f64 / MS as f64,
            time_ms: command.time_ns as f64 / MS as f64,
            makes_up_ms: self.makes_up_ms(&command),
            bunched: bunched || self.settings.jitter_ms > 0.0,
            by_hand: self.moved_by_hand(&command, now),
            asked: command.asked,
            shook: self.shook,
        };
        if !self.crowded {
            self.judge(&executed, command.number, now);
        }
        // The first frame that comes ends it.
        self.by_hand = ([0.0; 12], 0, 0);
        let (sent_ns, time_ms, number) = (command.sent_ns, executed.time_ms, command.number);
        let before = self.last_of_motion(&command).filter(|last| last.newest > number);
        let (newest, newest_ms) = before.map_or((number, time_ms), |last| (last.newest, last.newest_ms));
        self.executed = Some(Last { sent_ns, time_ms, number, newest, newest_ms });
    }

    /// What was executed last, if the command goes on with that motion.
    fn last_of_motion(&self, command: &Command) -> Option<Last> {
        self.executed.filter(|last| last.sent_ns.abs_diff(command.sent_ns) < ONE_MOTION)
    }

    /// How long that took, as far as README admits it, which the command makes up for: the frames that were lost since the newest, and
    /// those by which an older one takes the seat back that the network repeats; or the first of a motion. While the program stands
    /// still it sends none that could be lost. A frame of several ticks makes up for as many, and for a quarter of its Time.
    fn makes_up_ms(&self, command: &Command) -> f64 {
        let is_lossy = self.last_of_motion(command).map_or(command.lost_since < command.sent_ns, |last| {
            last.number.wrapping_add(1) != command.number
        });
        let held_back = command.relative && self.settings.asks_ms <= self.settings.period_ms && is_lossy;
        let takes_ms = if held_back { FASTEST * command.time_ns as f64 / MS as f64 } else { 0.0 };
        self.apart_ms(command).max(takes_ms)
    }

    /// How long what is lost took, or repeated, as far as that is admitted.
    fn apart_ms(&self, command: &Command) -> f64 {
        let (period_ms, admitted_ms) = (self.settings.period_ms, self.admitted_ms(command));
        let repeated_ms = ADMITTED as f64 / MS as f64;
        let frames = |one: u32, other: u32| f64::from(one.abs_diff(other)) * period_ms;
        if let Some(Last { time_ms, number, newest, newest_ms, .. }) = self.last_of_motion(command)
            && frames(newest, command.number) <= admitted_ms
            && frames(newest, number) <= repeated_ms
        {
            // The last one may have taken longer than others, or the newest, which an older one overtook.
            let longer_ms = if command.number < number {
                time_ms - period_ms
            } else if command.number > newest && newest > number {
                newest_ms - period_ms
            } else {
                0.0
            };
            // Frames that take several ticks are as far apart; those of a blind lane take longer than any of these.
            let takes_ms = command.time_ns as f64 / MS as f64;
            let is_repeated = number != newest || command.number < number;
            let ticks =
                if is_repeated && takes_ms <= repeated_ms { (takes_ms / period_ms).max(1.0) } else { 1.0 };
            let apart_ms = frames(number, command.number) * ticks;
            return apart_ms + longer_ms.clamp(0.0, (repeated_ms - apart_ms).max(0.0));
        }
        let apart_ms = (command.sent_ns - command.lost_since) as f64 / MS as f64 + period_ms;
        if apart_ms <= admitted_ms { apart_ms } else { 0.0 }
    }

    /// How far somebody has moved each axis by hand since the hall may have read it last before it sent this, pulses.
    fn moved_by_hand(&self, command: &Command, now: u64) -> [f64; 12] {
        let (speed, begin, end) = self.by_hand;
        let read = command.sent_ns.saturating_sub(read_before_ns(self.settings.period_ms));
        let lasts = end.min(now).saturating_sub(begin.max(read)) as f64;
        speed.map(|speed| speed * lasts)
    }

    /// How far apart it and the frame before may have been sent.
    fn admitted_ms(&self, command: &Command) -> f64 {
        let Settings { period_ms, asks_ms, jitter_ms, .. } = self.settings;
        let (from, until) = self.untold;
        let is_untold = (from..until + ADMITTED).contains(&command.sent_ns);
        admitted_ms(period_ms, asks_ms, jitter_ms, is_untold)
    }

    /// Whether the stroke has the place to which it is led.
    fn judge_place(&mut self, command: &Command, at_ns: u64) {
        for axis in 0..command.axes.min(self.settings.axes) {
            let mm = (command.to[axis] - self.within_stroke(axis, command.to[axis])).abs() / PULSES_PER_MM;
            if mm > OUTSIDE_MM {
                let (ms, how) = (command.time_ns as f64 / MS as f64, How::Beyond);
                self.breaches.push(Breach {
                    at_ns,
                    seat: self.index,
                    axis,
                    mm,
                    ms,
                    how,
                    frame: command.number,
                });
            }
        }
    }

    fn judge(&mut self, executed: &Executed, frame: u32, at_ns: u64) {
        let far = executed.far.iter().fold(0.0_f64, |far, one| far.max(one.abs()));
        self.fastest = self.fastest.max(far / PULSES_PER_MM / executed.ms * 1_000.0);
        if let Some((axis, mm, how)) = executed.verdict(self.settings.mm_s) {
            let (seat, ms) = (self.index, executed.ms);
            self.breaches.push(Breach { at_ns, seat, axis, mm, ms, how, frame });
        }
    }

    /// Hears a datagram; what it answers, if anything.
    pub(crate) fn hear(&mut self, octets: &[u8], arrival: Arrival) -> Option<Vec<u8>> {
        self.advance(arrival.at);
        if self.rebooting {
            return None;
        }
        self.packets = self.packets.wrapping_add(1);
        let mbox = self.settings.mbox;
        let x = if self.stopped && !mbox { 4 } else { 2 };
        let inputs = u16::from(self.button.0);
        let reply = match words::hear(octets) {
            Heard::Motion(frame) => {
                self.shook =
                    self.shake.iter().map(|(_, amplitude)| f64::from(*amplitude)).fold(0.0, f64::max);
                (self.outputs, self.shakes, self.shake) = (frame.outputs, frame.shakes, frame.shake);
                self.on_motion(&frame, arrival);
                if mbox && self.stopped {
                    words::motion_reply(octets, 3, words::u16_at(octets, 6), inputs)
                } else {
                    words::motion_reply(octets, x, 0, inputs)
                }
            }
            Heard::Read { channel: 0, start, .. } if self.settings.shy && POSITIONS.contains(&start) => {
                return None;
            }
            Heard::Read { channel, start, num } => {
                let words: Vec<u16> = (start..start.saturating_add(num))
                    .map(|at| self.register(channel, at, arrival.at))
                    .collect();
                words::register_reply(octets, x, 0, &words)
            }
            Heard::Write { channel, start, value } => {
                if (channel, start) == (2, 1) {
                    self.outputs = value;
                }
                if (channel, start, value) == (2, 0, 0) {
                    let zero = self.home_zero(arrival.at);
                    self.homings += 1;
                    (self.zero, self.homed, self.stopped) = (zero, false, self.button.0);
                    (self.last_absolute, self.executed) = (None, None);
                    self.go(zero, OWN_MM_S, arrival.at, Why::Homes);
                }
                words::register_reply(octets, x, 0, &[value])
            }
            Heard::Else => return None,
        };
        words::wants_reply(octets).then_some(reply)
    }

    /// Hears a frame that another master sends; what its moves look like is not judged.
    pub(crate) fn hear_other(&mut self, frame: &Frame, at: u64) {
        self.advance(at);
        if !self.rebooting {
            self.packets = self.packets.wrapping_add(1);
            let goes_on = self.foreign.filter(|(_, last)| at < last + BOUT);
            self.foreign = Some((goes_on.map_or(at, |(first, _)| first), at));
            self.take(frame, Arrival { at, sent: at, lost_since: at, asked: true }, true);
        }
    }

    /// Up to then nobody can know that another master sends to it, or that it does not hear.
    pub(crate) fn excuse(&mut self, until: u64) {
        self.excused_until = self.excused_until.max(until);
    }

    /// Whether another master began to send too short a time ago for anybody to see that the seat does not rest.
    pub(crate) fn is_just_disturbed(&self, now: u64) -> bool {
        self.foreign.is_some_and(|(first, _)| now < first + UNSEEN)
    }

    /// Answers with the place that it has now, wherever it goes, until then.
    pub(crate) fn freeze(&mut self, now: u64, until: u64) {
        self.stale = Some((until, self.place(now)));
    }

    fn on_motion(&mut self, frame: &Frame, arrival: Arrival) {
        let Arrival { at, sent, .. } = arrival;
        if let Some((came, sent_before)) = self.came.replace((at, sent)) {
            // Whoever had given it up tries once more.
            self.astray &= at < came + LED;
            self.stops += u32::from(at > came + LOST);
            let closer = (sent as f64 - sent_before as f64) - (at as f64 - came as f64);
            if closer.abs() > 0.4 * self.settings.period_ms * MS as f64 {
                (self.bunched_until, self.heaped) = (at + BUNCHED, true);
            }
        }
        self.heaped &= self.moving.is_some() || at < self.bunched_until;
        self.take(frame, arrival, false);
    }

    fn take(&mut self, frame: &Frame, arrival: Arrival, foreign: bool) {
        let Arrival { at, sent, lost_since, asked } = arrival;
        if self.jogged {
            self.hold(at);
        }
        let is_deaf = self.moving.is_some_and(|current| current.why != Why::Led);
        if is_deaf && !self.astray && self.is_led_away(frame, at) {
            self.astray = true;
            self.excuse(at + SEEN);
        }
        if self.stopped || is_deaf || self.queue.len() >= DEPTH {
            return;
        }
        let time_ms = self.time_of(frame);
        let to = frame.positions.map(f64::from);
        let (axes, number) = (frame.axes, frame.number);
        self.queue.push_back(Command {
            to,
            axes,
            time_ns: time_ms * MS,
            sent_ns: sent,
            lost_since,
            asked,
            number,
            relative: !frame.absolute,
            foreign,
        });
        if self.moving.is_none() {
            self.begin_next(at, false);
        } else if !self.heaped {
            let ahead: u64 = self.queue.iter().rev().skip(1).map(|command| command.time_ns).sum();
            let end = self.moving.map_or(at, |current| current.end);
            self.waited_ns = self.waited_ns.max(ahead + end.saturating_sub(at));
        }
    }

    fn is_led_away(&self, frame: &Frame, at: u64) -> bool {
        let place = self.place(at);
        let axes = frame.axes.min(self.settings.axes);
        let far = |axis: usize| (f64::from(frame.positions[axis]) + self.zero[axis] - place[axis]).abs();
        (0..axes).any(|axis| far(axis) > VISIBLE_MM * PULSES_PER_MM)
    }

    /// How long its move takes, ms: its Time, or the difference to that of the absolute frame before.
    fn time_of(&mut self, frame: &Frame) -> u64 {
        let said = u64::from(frame.time_ms);
        let takes = if frame.absolute {
            match self.last_absolute.replace(frame.time_ms) {
                Some(before) => said.saturating_sub(u64::from(before)),
                None => said.min(NO_TIME_MS),
            }
        } else {
            self.last_absolute = None;
            said
        };
        let takes = if takes == 0 { NO_TIME_MS } else { takes };
        if self.settings.cut_ms == 0 { takes } else { takes.min(u64::from(self.settings.cut_ms)) }
    }

    /// Where its controller says that an axis stands.
    fn told(&self, axis: usize, now: u64) -> i32 {
        let place =
            self.stale.filter(|(until, _)| now < *until).map_or_else(|| self.place(now), |(_, was)| was);
        let (period, amplitude) = self.shake.get(axis).copied().unwrap_or_default();
        let turn = now as f64 / 125_000.0 / f64::from(period.max(1));
        let shaken = f64::from(amplitude) * (turn * std::f64::consts::TAU).sin();
        (place[axis] - self.zero[axis] + shaken).round() as i32
    }

    /// The same of all axes, pulses.
    pub(crate) fn told_place(&self, now: u64) -> [f64; 12] {
        std::array::from_fn(|axis| f64::from(self.told(axis, now)))
    }

    fn register(&self, channel: u16, at: u16, now: u64) -> u16 {
        if channel == 1 {
            return self.parameter(at);
        }
        if let Some(axis) = POSITIONS.iter().position(|first| at == *first || at == *first + 1) {
            if axis >= self.settings.axes {
                return 0;
            }
            let position = self.told(axis, now).cast_unsigned();
            let upper = (at == POSITIONS[axis]) == self.settings.high_first;
            return if upper { (position >> 16) as u16 } else { position as u16 };
        }
        let homes = self.moving.is_some_and(|current| current.why == Why::Homes);
        match at {
            0x34 if self.settings.mbox => 0,
            0x34 => self.packets,
            0x66 => self.outputs,
            0xf0 if self.homed || (self.settings.lies && !homes) => 2,
            0xf0 => u16::from(homes),
            0xfe => u16::from(!self.settings.mbox),
            0xff => 3,
            _ => 0,
        }
    }

    /// Its parameters: those of the factory but where a show needs others. It tells of caps on speed that it does not keep.
    fn parameter(&self, at: u16) -> u16 {
        let Settings { axes, hurry, cut_ms, stop_mode, report_ms, address: (ip, port), .. } = self.settings;
        match at {
            0x00 => 10,
            0x02 => axes as u16,
            0x06 => u16::from(hurry),
            0x07 | 0x80..=0x85 => 2_880,
            0x09 | 0x40 => 100,
            0x0b => cut_ms as u16,
            0x0c | 0x15 | 0x90 | 0x92 => 1,
            0x10..=0x13 => u16::from(ip[usize::from(at - 0x10)]),
            0x14 => port,
            0x1e => report_ms as u16,
            0x1f => u16::from(report_ms > 0),
            0x20 => 127,
            0x23 => 1,
            0x24 => 8_410,
            0x3d => 1_000,
            0x41 => 50,
            0x42 => 1_600,
            0x91 => u16::from(stop_mode),
            0x93 => (FILTER / MS) as u16,
            0x94 => 300,
            0xa0..=0xa5 => 2,
            0xb0..=0xb5 => 1_500,
            _ => 0,
        }
    }

    /// A status report, when it is time for one.
    pub(crate) fn report(&mut self, now: u64) -> Option<Vec<u8>> {
        if self.settings.report_ms == 0 || self.rebooting || now < self.next_report {
            return None;
        }
        self.next_report = now + u64::from(self.settings.report_ms) * MS;
        let positions: Vec<i32> = (0..self.settings.axes).map(|axis| self.told(axis, now)).collect();
        let ([.., column, row], _) = self.settings.address;
        let id = u16::from_be_bytes([column, row]);
        Some(words::report(id, &positions, u16::from(self.button.0)))
    }
}
