//! Another machine that sends frames to a seat as if nobody else did.

use super::dice::Dice;
use super::judge::PULSES_PER_MM;
use super::seat::{MS, Seat};
use super::words::Frame;

/// So many datagrams that nobody sent may have been doubled on their way. Of more a hall knows within two seconds, and its seats
/// rest a while after.
const UNNOTICED: u32 = 64;
pub(crate) const UNKNOWN: u64 = 3_500 * MS;

/// What it sends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Plan {
    /// A cue that swings by so many millimetres about where the seat stands.
    Swing(f64),
    /// One slow frame to its park pose.
    Park,
    /// Now and then a frame that takes until the next.
    Jumps,
}

#[derive(Debug, Clone)]
pub(crate) struct Master {
    plan: Plan,
    period: u64,
    begin: u64,
    until: u64,
    next: u64,
    number: u32,
    /// Its frames since the hall moves the seat.
    among: u32,
    from: Option<[f64; 12]>,
    dice: Dice,
}

impl Master {
    pub(crate) fn new(plan: Plan, now: u64, ms: u64, dice: &mut Dice) -> Self {
        let period = match plan {
            Plan::Swing(_) => dice.pick(&[10, 20, 50]),
            Plan::Park => 2_500,
            Plan::Jumps => 400,
        };
        let ms = if plan == Plan::Park { 1 } else { ms };
        let dice = Dice::new(dice.next());
        let (begin, until) = (now, now + ms * MS);
        Self { plan, period: period * MS, begin, until, next: now, number: 1, among: 0, from: None, dice }
    }

    pub(crate) const fn is_over(&self) -> bool {
        self.next >= self.until
    }

    /// Its frames until now; the hall moves the seat until `moves_until`, as far as one sees.
    pub(crate) fn send(&mut self, seat: &mut Seat, now: u64, moves_until: u64) {
        while self.next <= now && !self.is_over() {
            let at = self.next;
            self.next += self.period;
            self.among = if at <= moves_until { self.among + 1 } else { 0 };
            if (1..=UNNOTICED).contains(&self.among) {
                seat.excuse(at + UNKNOWN);
            }
            let frame = self.frame(seat, at);
            seat.hear_other(&frame, at);
        }
    }

    fn frame(&mut self, seat: &Seat, at: u64) -> Frame {
        let axes = seat.settings.axes;
        let from = *self.from.get_or_insert_with(|| seat.told_place(at));
        let seconds = (at + self.period - self.begin) as f64 * 1e-9;
        let mut positions = [0; 12];
        for (axis, to) in positions.iter_mut().enumerate().take(axes) {
            let place = match self.plan {
                Plan::Swing(mm) => from[axis] + mm * PULSES_PER_MM * (3.0 * seconds).sin() * seconds.min(1.0),
                Plan::Park => 0.0,
                Plan::Jumps => from[axis] + (self.dice.range(0, 40) as f64 - 20.0) * PULSES_PER_MM,
            };
            *to = place.clamp(0.0, 150.0 * PULSES_PER_MM) as i32;
        }
        self.number += 1;
        let time_ms = (self.period / MS) as u32;
        Frame {
            absolute: false,
            number: self.number,
            time_ms,
            axes,
            positions,
            outputs: 0,
            shakes: false,
            shake: [(0, 0); 6],
        }
    }
}
