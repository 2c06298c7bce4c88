//! Judges what was sent, from the definition of the measure alone, frame by frame and with all its multiplications.

use crate::motion::Limits;
use crate::time::Rate;

/// What frames of a rate make of an axis that stood still before.
pub struct Judge {
    limits: Limits,
    step: f64,
    apart: [usize; 2],
    at_ms: Vec<i64>,
    sent: Vec<f64>,
}

/// The worst that an axis was made to do, each over its limit.
#[derive(Debug, Clone, Copy, Default)]
pub struct Worst {
    pub velocity: f64,
    pub step: f64,
    pub acceleration: f64,
    pub jerk: f64,
    /// How far outside the stroke; infinite where a position is no number.
    pub outside: f64,
}

impl Worst {
    /// The greatest share of a limit.
    pub fn share(&self) -> f64 {
        let most = self.velocity.max(self.step).max(self.acceleration).max(self.jerk);
        if self.outside > 0.0 { f64::INFINITY } else { most }
    }

    fn raise(&mut self, by: &Self) {
        self.velocity = self.velocity.max(by.velocity);
        self.step = self.step.max(by.step);
        self.acceleration = self.acceleration.max(by.acceleration);
        self.jerk = self.jerk.max(by.jerk);
        self.outside = self.outside.max(by.outside);
    }
}

impl Judge {
    /// An axis at rest at `start` before the first frame.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 20, 1 to 1,000")]
    pub fn new(limits: Limits, rate_hz: f64, start: f64) -> Self {
        let n = ((0.020 * rate_hz + 0.5).floor() as usize).max(1);
        let m = (13 * n / 10 + 1..)
            .find(|m| (2..=n).all(|f| !n.is_multiple_of(f) || !m.is_multiple_of(f)))
            .expect("a prime comes");
        let period_ms = i64::from(Rate::from_hz(rate_hz).time_ms(0));
        let before = 3 * m as i64 + 2;
        Self {
            limits,
            step: 4.0 * limits.acceleration * (1.0 / rate_hz).max(0.005),
            apart: [n, m],
            at_ms: (-before..=0).map(|k| k * period_ms.max(1)).collect(),
            sent: vec![start; 3 * m + 3],
        }
    }

    /// Takes the next position and says what it shows.
    pub fn push(&mut self, position: f64, time_ms: u32) -> Worst {
        let at = self.at_ms.last().expect("it stood before") + i64::from(time_ms);
        self.at_ms.push(at);
        self.sent.push(position);
        self.look()
    }

    /// The worst of all frames so far, were their positions these.
    pub fn worst(limits: Limits, rate_hz: f64, start: f64, frames: &[(f64, u32)]) -> Worst {
        let mut judge = Self::new(limits, rate_hz, start);
        let mut worst = Worst::default();
        for &(position, time_ms) in frames {
            worst.raise(&judge.push(position, time_ms));
        }
        worst
    }

    fn look(&self) -> Worst {
        let newest = self.sent[self.sent.len() - 1];
        let outside = if newest.is_finite() { (-newest).max(newest - 1.0).max(0.0) } else { f64::INFINITY };
        let velocity = self.divided(0, 1, 1);
        let mut worst = Worst {
            velocity: velocity.abs() / self.limits.velocity,
            step: (velocity - self.divided(1, 1, 1)).abs() / self.step,
            outside,
            ..Worst::default()
        };
        for apart in self.apart {
            worst.acceleration =
                worst.acceleration.max(2.0 * self.divided(0, apart, 2).abs() / self.limits.acceleration);
            worst.jerk = worst.jerk.max(6.0 * self.divided(0, apart, 3).abs() / self.limits.jerk);
        }
        worst
    }

    /// The divided difference of `order` over the poses `back`, `back + apart` … before the newest, by Lagrange's form.
    #[expect(clippy::cast_precision_loss, reason = "some seconds")]
    fn divided(&self, back: usize, apart: usize, order: usize) -> f64 {
        let place = |node: usize| self.sent.len() - 1 - back - node * apart;
        let seconds = |a: usize, b: usize| (self.at_ms[place(a)] - self.at_ms[place(b)]) as f64 / 1000.0;
        let origin = self.sent[place(0)];
        (0..=order)
            .map(|node| {
                let others = (0..=order).filter(|&other| other != node);
                (self.sent[place(node)] - origin) / others.map(|other| seconds(node, other)).product::<f64>()
            })
            .sum()
    }

    /// The interval that the next position may lie in.
    pub fn room(&mut self, time_ms: u32) -> (f64, f64) {
        let mut room = (0.0_f64, 1.0_f64);
        let at = self.at_ms.last().expect("it stood before") + i64::from(time_ms);
        let last = self.sent[self.sent.len() - 1];
        self.at_ms.push(at);
        self.sent.push(last);
        let mut narrow = |this: &mut Self, back_apart: (usize, usize), factor: f64, limit: f64, rest: f64| {
            let (apart, order) = back_apart;
            // Linear in the next position: its value at the last one, and its slope.
            let value = factor * this.divided(0, apart, order) - rest;
            let end = this.sent.len() - 1;
            this.sent[end] = last + 1.0;
            let slope = factor * this.divided(0, apart, order) - rest - value;
            this.sent[end] = last;
            room.0 = room.0.max(last + (-limit - value) / slope);
            room.1 = room.1.min(last + (limit - value) / slope);
        };
        let before = self.divided(1, 1, 1);
        let Limits { velocity, acceleration, jerk } = self.limits;
        narrow(self, (1, 1), 1.0, velocity, 0.0);
        let step = self.step;
        narrow(self, (1, 1), 1.0, step, before);
        for apart in self.apart {
            narrow(self, (apart, 2), 2.0, acceleration, 0.0);
            narrow(self, (apart, 3), 6.0, jerk, 0.0);
        }
        self.at_ms.pop();
        self.sent.pop();
        room
    }
}
