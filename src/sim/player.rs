//! Where the motors are: moves one after another from a queue, each a straight line over its time.

use std::collections::VecDeque;
use std::time::Duration;

use crate::motion::{MAX_AXES, Pulses};
use crate::time::{MonoTime, nanos};

/// Commands that wait at most; the manuals do not say how many fit.
pub(super) const QUEUE_DEPTH: usize = 200;
/// With more waiting than this, moves run in half their time where fast forward is on (PA06).
const FAST_FORWARD_ABOVE: usize = 2;

/// Positions of all axes that a controller could have.
pub(super) type Positions = [Pulses; MAX_AXES];

/// What a controller's parameters say about moves; taken when a move begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    /// Whether moves run faster when more than two wait (PA06).
    pub(super) fast_forward: bool,
    /// Greatest speed of each axis, pulses per millisecond.
    pub(super) limits: [f64; MAX_AXES],
}

/// A move that waits.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    to: Positions,
    duration: Duration,
}

/// A move that runs, or the last one that ran.
#[derive(Debug, Clone, Copy)]
struct Move {
    from: Positions,
    to: Positions,
    start: MonoTime,
    duration: Duration,
    arrived: bool,
}

/// The queue had no room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Overflow;

/// The queue of moves and the motors behind it.
#[derive(Debug)]
pub(super) struct Player {
    current: Move,
    waiting: VecDeque<Waiting>,
    /// Moves that were taken.
    taken: usize,
    /// Moves that reached their end.
    pub(super) executed: u64,
    /// Moves that ran in half their time.
    pub(super) fast_forwarded: u64,
}

impl Player {
    /// Motors at rest in zero.
    pub(super) fn new(at: MonoTime) -> Self {
        let rest = [Pulses(0); MAX_AXES];
        Self {
            current: Move { from: rest, to: rest, start: at, duration: Duration::ZERO, arrived: true },
            waiting: VecDeque::with_capacity(QUEUE_DEPTH),
            taken: 0,
            executed: 0,
            fast_forwarded: 0,
        }
    }

    /// Runs all that is due until `at`.
    pub(super) fn advance(&mut self, at: MonoTime, pace: &Pace) {
        while !self.current.arrived && self.current.end() <= at {
            self.current.arrived = true;
            self.executed += 1;
            let fast = pace.fast_forward && self.waiting.len() > FAST_FORWARD_ABOVE;
            if let Some(next) = self.waiting.pop_front() {
                let duration = if fast { next.duration / 2 } else { next.duration };
                self.fast_forwarded += u64::from(fast);
                self.begin(next.to, duration, self.current.end(), pace);
            }
        }
    }

    /// Takes a move to where `to` is, after those that wait.
    pub(super) fn push(
        &mut self,
        to: Positions,
        duration: Duration,
        at: MonoTime,
        pace: &Pace,
    ) -> Result<(), Overflow> {
        self.advance(at, pace);
        if self.current.arrived {
            self.begin(to, duration, at, pace);
        } else if self.waiting.len() < QUEUE_DEPTH {
            self.waiting.push_back(Waiting { to, duration });
        } else {
            return Err(Overflow);
        }
        self.taken += 1;
        Ok(())
    }

    /// Stops where the motors are and forgets what waits.
    pub(super) fn hold(&mut self, at: MonoTime, pace: &Pace) {
        self.advance(at, pace);
        let here = self.positions(at);
        self.waiting.clear();
        self.current = Move { from: here, to: here, start: at, duration: Duration::ZERO, arrived: true };
    }

    /// Forgets what waits and moves to zero in `duration`, or as long as the speed limits ask for.
    pub(super) fn go_to_zero(&mut self, duration: Duration, at: MonoTime, pace: &Pace) {
        self.hold(at, pace);
        self.begin([Pulses(0); MAX_AXES], duration, at, pace);
    }

    /// Where the motors are; the player has been advanced to `at`.
    pub(super) fn positions(&self, at: MonoTime) -> Positions {
        self.current.positions(at)
    }

    /// Where the motors will be when nothing waits any more.
    pub(super) fn target(&self) -> &Positions {
        self.waiting.back().map_or(&self.current.to, |last| &last.to)
    }

    /// When the present move ends.
    pub(super) fn end(&self) -> MonoTime {
        self.current.end()
    }

    /// Where in the queue the next move goes, and from where the next one is taken.
    pub(super) fn pointers(&self) -> [u16; 2] {
        let place = |moves| u16::try_from(moves % QUEUE_DEPTH).expect("below the depth of the queue");
        [place(self.taken), place(self.taken - self.waiting.len())]
    }

    fn begin(&mut self, to: Positions, duration: Duration, start: MonoTime, pace: &Pace) {
        let from = self.current.positions(start);
        let duration = duration.max(fastest(&from, &to, pace));
        self.current = Move { from, to, start, duration, arrived: false };
    }
}

impl Move {
    fn end(&self) -> MonoTime {
        self.start + self.duration
    }

    #[expect(clippy::cast_possible_truncation, reason = "between two i32")]
    #[expect(
        clippy::cast_precision_loss,
        reason = "whole pulses come out right up to 104 days of nanoseconds"
    )]
    fn positions(&self, at: MonoTime) -> Positions {
        let (gone, whole) = (nanos(at.since(self.start)), nanos(self.duration));
        if gone >= whole {
            return self.to;
        }
        let part = gone as f64 / whole as f64;
        std::array::from_fn(|axis| {
            let (from, to) = (f64::from(self.from[axis].0), f64::from(self.to[axis].0));
            Pulses((from + (to - from) * part).round() as i32)
        })
    }
}

/// The shortest time in which all axes stay within their speed.
fn fastest(from: &Positions, to: &Positions, pace: &Pace) -> Duration {
    let ms = (0..MAX_AXES).map(|axis| {
        let distance = (f64::from(to[axis].0) - f64::from(from[axis].0)).abs();
        distance / pace.limits[axis]
    });
    let longest_ms = ms.fold(0.0, f64::max);
    Duration::try_from_secs_f64(longest_ms / 1e3).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Pace { fast_forward: true, limits: [500.0; MAX_AXES] };

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    fn all(position: i32) -> Positions {
        [Pulses(position); MAX_AXES]
    }

    fn push(player: &mut Player, to: i32, duration_ms: u64, at_ms: u64) -> Result<(), Overflow> {
        player.push(all(to), Duration::from_millis(duration_ms), ms(at_ms), &PACE)
    }

    fn at(player: &mut Player, at_ms: u64) -> i32 {
        player.advance(ms(at_ms), &PACE);
        player.positions(ms(at_ms))[0].0
    }

    #[test]
    fn a_move_is_a_straight_line_over_its_time() {
        let mut player = Player::new(ms(0));
        push(&mut player, 1_000, 100, 50).unwrap();
        let seen = [50, 75, 100, 149, 150, 500].map(|t| at(&mut player, t));
        assert_eq!(seen, [0, 250, 500, 990, 1_000, 1_000]);
        assert_eq!(player.executed, 1);
    }

    #[test]
    fn a_waiting_move_begins_where_the_one_before_ends_and_after_a_gap_at_once() {
        let mut player = Player::new(ms(0));
        push(&mut player, 100, 10, 0).unwrap();
        push(&mut player, 200, 10, 8).unwrap();
        assert_eq!(at(&mut player, 15), 150);
        push(&mut player, 300, 10, 40).unwrap();
        assert_eq!([40, 45, 50].map(|t| at(&mut player, t)), [200, 250, 300]);
    }

    #[test]
    fn with_more_than_two_waiting_moves_take_half_their_time() {
        let mut player = Player::new(ms(0));
        for to in [100, 200, 300, 400] {
            push(&mut player, to, 10, 0).unwrap();
        }
        // Three wait when the first ends: the second is fast; then two wait, and the others are not.
        assert_eq!([10, 15, 25, 35].map(|t| at(&mut player, t)), [100, 200, 300, 400]);
        assert_eq!(player.fast_forwarded, 1);
    }

    #[test]
    fn fast_forward_can_be_off() {
        let pace = Pace { fast_forward: false, ..PACE };
        let mut player = Player::new(ms(0));
        for to in [100, 200, 300, 400] {
            player.push(all(to), Duration::from_millis(10), ms(0), &pace).unwrap();
        }
        player.advance(ms(20), &pace);
        assert_eq!(player.positions(ms(20))[0].0, 200);
    }

    #[test]
    fn no_axis_is_faster_than_its_limit() {
        let mut player = Player::new(ms(0));
        push(&mut player, 50_000, 10, 0).unwrap();
        assert_eq!(at(&mut player, 10), 5_000);
        assert_eq!(at(&mut player, 100), 50_000);
    }

    #[test]
    fn the_201st_waiting_move_finds_no_room() {
        let mut player = Player::new(ms(0));
        for k in 0..=i32::try_from(QUEUE_DEPTH).unwrap() {
            push(&mut player, k, 10, 0).unwrap();
        }
        assert_eq!(push(&mut player, 0, 10, 0), Err(Overflow));
    }

    #[test]
    fn a_hold_stays_where_it_came() {
        let mut player = Player::new(ms(0));
        push(&mut player, 1_000, 100, 0).unwrap();
        push(&mut player, 2_000, 100, 0).unwrap();
        player.hold(ms(50), &PACE);
        assert_eq!(at(&mut player, 1_000), 500);
        assert_eq!(player.target()[0].0, 500);
    }
}
