//! Where the motors are: moves one after another from a queue, each a straight line over its time.

use std::collections::VecDeque;
use std::time::Duration;

use crate::motion::{MAX_AXES, Pulses};
use crate::time::{MonoTime, nanos};
use crate::wire::{PerAxis, Vibration};

/// With more waiting than this, moves run faster where fast forward is on (PA06).
const FAST_FORWARD_ABOVE: usize = 2;

/// What a vibration's period counts: 0.125 ms.
const VIBRATION_STEP_NS: u64 = 125_000;

/// Positions of all axes that a controller could have.
pub(super) type MotorPositions = [Pulses; MAX_AXES];

/// What a controller's parameters say about moves; taken when a move begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    /// By what the time of moves is divided when more than two wait (PA06), where it is.
    pub(super) fast_forward: Option<u32>,
    /// Greatest speed of each axis, pulses per millisecond.
    pub(super) limits: [f64; MAX_AXES],
}

/// A move to come.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlayedLeg {
    /// Where it ends.
    pub(super) to: MotorPositions,
    /// How long it takes.
    pub(super) duration: Duration,
    /// What shakes the axes meanwhile.
    pub(super) vibration: PerAxis<Vibration>,
}

/// A move that runs, or the last one that ran.
#[derive(Debug, Clone, Copy)]
struct Move {
    from: MotorPositions,
    leg: PlayedLeg,
    start: MonoTime,
    arrived: bool,
}

/// A straight line that the motors ran, to its end or until something cut it short.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Executed {
    /// When it began.
    pub(super) start: MonoTime,
    /// How long it took.
    pub(super) duration: Duration,
    /// Where it began.
    pub(super) from: MotorPositions,
    /// Where it ended.
    pub(super) to: MotorPositions,
}

/// The queue had no room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Overflow;

/// The queue of moves and the motors behind it.
#[derive(Debug)]
pub(super) struct Player {
    current: Move,
    waiting: VecDeque<PlayedLeg>,
    depth: usize,
    /// Moves wait for a release.
    paused: bool,
    /// What is left of the move that a pause cut short.
    interrupted: Option<PlayedLeg>,
    /// Moves that were taken.
    taken: usize,
    /// Moves that reached their end.
    pub(super) executed: u64,
    /// Moves that ran in less than their time.
    pub(super) fast_forwarded: u64,
    /// Moves that ended since they were asked for, where somebody does ask.
    record: Option<Vec<Executed>>,
}

impl Player {
    /// Motors at rest in zero, and a queue of this many moves.
    pub(super) fn new(depth: usize, at: MonoTime) -> Self {
        Self {
            current: Move::rest([Pulses(0); MAX_AXES], at),
            waiting: VecDeque::with_capacity(depth),
            depth: depth.max(1),
            paused: false,
            interrupted: None,
            taken: 0,
            executed: 0,
            fast_forwarded: 0,
            record: None,
        }
    }

    /// Keeps the moves that end from now on, until they are asked for.
    pub(super) fn keep_record(&mut self) {
        self.record.get_or_insert_default();
    }

    /// The moves that ended since they were last asked for, in their order; `None` if no record is kept.
    pub(super) fn take_record(&mut self) -> impl Iterator<Item = Executed> {
        self.record.as_mut().map(|record| record.drain(..)).into_iter().flatten()
    }

    /// Runs all that is due until `at`.
    pub(super) fn advance(&mut self, at: MonoTime, pace: &Pace) {
        while !self.current.arrived && self.current.end() <= at {
            self.note(self.current.end());
            self.current.arrived = true;
            self.executed += 1;
            if self.paused {
                return;
            }
            let fast = pace.fast_forward.filter(|_| self.waiting.len() > FAST_FORWARD_ABOVE);
            if let Some(mut next) = self.waiting.pop_front() {
                next.duration /= fast.unwrap_or(1).max(1);
                self.fast_forwarded += u64::from(fast.is_some());
                self.begin(next, self.current.end(), pace);
            }
        }
    }

    /// Takes a move, after those that wait.
    pub(super) fn push(&mut self, leg: PlayedLeg, at: MonoTime, pace: &Pace) -> Result<(), Overflow> {
        self.advance(at, pace);
        if self.current.arrived {
            self.begin(leg, at, pace);
        } else if self.waiting.len() < self.depth {
            self.waiting.push_back(leg);
        } else {
            return Err(Overflow);
        }
        self.taken += 1;
        Ok(())
    }

    /// Stops where the motors are and forgets what waits.
    pub(super) fn hold(&mut self, at: MonoTime, pace: &Pace) {
        self.advance(at, pace);
        self.halt(at);
        self.waiting.clear();
        self.interrupted = None;
        self.paused = false;
    }

    /// Stops where the motors are until [`Player::resume`], or a hold.
    pub(super) fn pause(&mut self, at: MonoTime, pace: &Pace) {
        self.advance(at, pace);
        if !self.current.arrived {
            let duration = self.current.end().since(at);
            self.interrupted = Some(PlayedLeg { duration, ..self.current.leg });
        }
        self.halt(at);
        self.paused = true;
    }

    /// Moves to zero, as fast as may be, and pauses there.
    pub(super) fn pause_in_zero(&mut self, at: MonoTime, pace: &Pace) {
        self.pause(at, pace);
        self.begin(PlayedLeg::to_zero(Duration::ZERO), at, pace);
    }

    /// Goes on with the move that was cut short, and then with those that wait.
    pub(super) fn resume(&mut self, at: MonoTime, pace: &Pace) {
        self.advance(at, pace);
        self.paused = false;
        self.halt(at);
        if let Some(next) = self.interrupted.take().or_else(|| self.waiting.pop_front()) {
            self.begin(next, at, pace);
        }
    }

    /// Forgets what waits, and from `start` on moves to zero in `duration`, or as long as the speed limits ask for.
    pub(super) fn go_to_zero(&mut self, duration: Duration, start: MonoTime, at: MonoTime, pace: &Pace) {
        self.hold(at, pace);
        self.begin(PlayedLeg::to_zero(duration), start, pace);
    }

    /// Takes where an axis is for zero.
    pub(super) const fn zero(&mut self, axis: usize) {
        self.current.from[axis] = Pulses(0);
        self.current.leg.to[axis] = Pulses(0);
    }

    /// Where the motors are; the player has been advanced to `at`.
    pub(super) fn positions(&self, at: MonoTime) -> MotorPositions {
        self.current.positions(at)
    }

    /// Where they are with what shakes them, which swings about the position as a sine.
    pub(super) fn shaken(&self, at: MonoTime) -> MotorPositions {
        let mut positions = self.positions(at);
        for (position, shake) in positions.iter_mut().zip(self.current.leg.vibration.iter()) {
            if shake.period != 0 && shake.amplitude != 0 {
                position.0 = position.0.saturating_add(shake_pulses(*shake, at));
            }
        }
        positions
    }

    /// How fast each axis is, pulses per millisecond.
    pub(super) fn speeds(&self) -> [f64; MAX_AXES] {
        let ms = self.current.leg.duration.as_secs_f64() * 1e3;
        let (from, to) = (&self.current.from, &self.current.leg.to);
        if self.idle() || ms == 0.0 {
            return [0.0; MAX_AXES];
        }
        std::array::from_fn(|axis| (f64::from(to[axis].0) - f64::from(from[axis].0)) / ms)
    }

    /// Where the motors will be when nothing waits any more.
    pub(super) fn target(&self) -> &MotorPositions {
        self.waiting.back().map_or(&self.current.leg.to, |last| &last.to)
    }

    /// When the present move ends.
    pub(super) fn end(&self) -> MonoTime {
        self.current.end()
    }

    /// True if nothing moves and nothing waits.
    pub(super) fn idle(&self) -> bool {
        self.current.arrived && self.waiting.is_empty()
    }

    /// Where in the queue the next move goes, and from where the next one is taken.
    pub(super) fn pointers(&self) -> [u16; 2] {
        let place = |moves: usize| u16::try_from(moves % self.depth).unwrap_or(u16::MAX);
        [place(self.taken), place(self.taken - self.waiting.len())]
    }

    /// Counts what is taken from the start again.
    pub(super) const fn restart(&mut self) {
        self.taken = 0;
    }

    /// Ends the present move where the motors are; the player has been advanced to `at`.
    pub(super) fn halt(&mut self, at: MonoTime) {
        if !self.current.arrived && self.current.start < at {
            self.note(at);
        }
        self.current = Move::rest(self.positions(at), at);
    }

    /// Records the present move, which is over at `end`.
    fn note(&mut self, end: MonoTime) {
        let (start, from, to) = (self.current.start, self.current.from, self.current.positions(end));
        if let Some(record) = &mut self.record {
            record.push(Executed { start, duration: end.since(start), from, to });
        }
    }

    fn begin(&mut self, leg: PlayedLeg, start: MonoTime, pace: &Pace) {
        let from = self.current.positions(start);
        let duration = leg.duration.max(fastest(&from, &leg.to, pace));
        self.current = Move { from, leg: PlayedLeg { duration, ..leg }, start, arrived: false };
    }
}

impl PlayedLeg {
    fn to_zero(duration: Duration) -> Self {
        Self { to: [Pulses(0); MAX_AXES], duration, vibration: PerAxis::default() }
    }
}

impl Move {
    fn rest(to: MotorPositions, at: MonoTime) -> Self {
        let leg = PlayedLeg { to, duration: Duration::ZERO, vibration: PerAxis::default() };
        Self { from: to, leg, start: at, arrived: true }
    }

    fn end(&self) -> MonoTime {
        self.start + self.leg.duration
    }

    #[expect(clippy::cast_possible_truncation, reason = "between two i32")]
    #[expect(
        clippy::cast_precision_loss,
        reason = "whole pulses come out right up to 104 days of nanoseconds"
    )]
    fn positions(&self, at: MonoTime) -> MotorPositions {
        let (gone, whole) = (nanos(at.since(self.start)), nanos(self.leg.duration));
        if gone >= whole {
            return self.leg.to;
        }
        let part = gone as f64 / whole as f64;
        std::array::from_fn(|axis| {
            let (from, to) = (f64::from(self.from[axis].0), f64::from(self.leg.to[axis].0));
            Pulses((from + (to - from) * part).round() as i32)
        })
    }
}

/// How far a vibration has swung out; all swing with the clock.
#[expect(clippy::cast_possible_truncation, reason = "at most the amplitude")]
#[expect(clippy::cast_precision_loss, reason = "less than a period of at most 8 s of nanoseconds")]
fn shake_pulses(shake: Vibration, at: MonoTime) -> i32 {
    let period_ns = u64::from(shake.period) * VIBRATION_STEP_NS;
    let turn = (at.as_nanos() % period_ns) as f64 / period_ns as f64;
    (f64::from(shake.amplitude) * (turn * std::f64::consts::TAU).sin()).round() as i32
}

/// The shortest time in which all axes stay within their speed.
fn fastest(from: &MotorPositions, to: &MotorPositions, pace: &Pace) -> Duration {
    let ms = (0..MAX_AXES).map(|axis| {
        let distance = (f64::from(to[axis].0) - f64::from(from[axis].0)).abs();
        distance / pace.limits[axis]
    });
    let longest_ms = ms.fold(0.0, f64::max);
    Duration::try_from_secs_f64(longest_ms / 1e3).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests;
