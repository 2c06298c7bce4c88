//! One axis of a play: the targets of its motor, and where that is by them.

use std::time::Duration;

use super::super::scale::MotorScale;
use super::super::set_up::MotorAxis;
use crate::drive::link::{AxisFigures, LinkAxis};
use crate::drive::{LOOP, Lag, Middle, Motor, Shaker, TargetMaker};
use crate::motion::Limits;
use crate::time::MonoTime;

/// How long ago a motor was told to stop at the least where one that moves strays.
const BRAKES: Duration = Duration::from_millis(250);
/// The same in ramps from full speed.
const RAMPS: f64 = 1.25;
/// How long a motor may be off its course at the least.
const STRAYED: Duration = Duration::from_millis(250);

/// After so long a motor is where its target was.
const ARRIVED: Duration = Duration::from_secs(2);

/// How far a motor may be from where its targets lead, mm.
pub(super) const OFF_COURSE_MM: f64 = 0.5;
/// When exactly a unit reads its counter is not known to better than this, seconds: its loop, and when that falls.
pub(super) const READING: f64 = 0.004;

/// One axis.
#[derive(Debug)]
pub(crate) struct Axis {
    pub(super) motor: u8,
    pub(super) scale: MotorScale,
    pub(super) limits: Limits,
    pub(super) shaker: Shaker,
    /// By then it stands that was told to stop, whatever it did: longer than its ramp takes from full speed.
    pub(super) brakes: Duration,
    lag: Lag,
    /// The greatest speed, and jump of speed, that its motor is asked for, microsteps a second.
    most: [f64; 2],
    maker: TargetMaker,
    target: i32,
    /// The one before.
    before: i32,
    /// Where its motor is by its targets, and until when that was reckoned.
    model: Motor,
    reckoned: MonoTime,
    /// While it is made ready: as it was read last; whether it rests there; whether it is told to be where it was led, or was read.
    pub(super) stood_at: Option<i32>,
    pub(super) rests: bool,
    pub(super) holds: bool,
    /// Readings that it is off its course, one after the other, and when the first was.
    pub(super) strayed: u32,
    pub(super) strays_since: MonoTime,
    pub(super) figures: AxisFigures,
}

impl LinkAxis for Axis {
    fn place(&self) -> f64 {
        self.scale.fraction(self.model.position())
    }

    fn off_mm(&self, place: f64) -> f64 {
        self.scale.mm_of(self.scale.way_of(place - self.place())).abs()
    }

    fn figures(&self, _: MonoTime) -> AxisFigures {
        self.figures
    }
}

impl Axis {
    pub(super) fn new(of: &MotorAxis<'_>, period: Duration, now: MonoTime) -> Self {
        let stroke = of.axis.stroke();
        let limits = Limits {
            velocity: of.axis.max_velocity / stroke,
            acceleration: of.axis.max_acceleration / stroke,
            jerk: of.axis.max_jerk / stroke,
        };
        let (scale, lag) = (of.scale, of.lag);
        let ramp_mm_s2 = scale.ramp_mm_s2(scale.acceleration(of.axis.max_acceleration));
        let brakes = Duration::try_from_secs_f64(RAMPS * scale.full_mm_s() / ramp_mm_s2);
        Self {
            motor: of.motor,
            scale,
            limits,
            shaker: Shaker::default(),
            brakes: brakes.map_or(BRAKES, |brakes| brakes.max(BRAKES)),
            lag,
            most: [of.axis.max_velocity.max(of.axis.shaken_velocity()), of.of.jump_mm_s(of.axis, period)]
                .map(|mm_s| mm_s / scale.mm_of(1.0).abs()),
            before: scale.whole(of.axis.low),
            maker: TargetMaker::at_rest(lag, scale.reach(0.0), scale.at(0.0)),
            target: scale.whole(of.axis.low),
            model: Motor::at_rest(lag, scale.at(0.0)),
            reckoned: now,
            stood_at: None,
            rests: false,
            holds: false,
            strayed: 0,
            strays_since: now,
            figures: AxisFigures { clock: 1.0, ..AxisFigures::default() },
        }
    }

    /// It stands there, by its counter.
    pub(super) fn rest_at(&mut self, position: i32, now: MonoTime) {
        self.maker = TargetMaker::at_rest(self.lag, self.scale.reach(0.0), position.into());
        self.model = Motor::at_rest(self.lag, position.into());
        self.shaker = Shaker::default();
        (self.target, self.before, self.reckoned, self.strayed) = (position, position, now, 0);
        (self.rests, self.holds) = (true, true);
    }

    /// The target that has arrived at an instant, of what the axis is to do half a slice later, in strokes; the one before where
    /// that is not known.
    pub(super) fn aim(&mut self, middle: Option<Middle>, at: MonoTime) -> i32 {
        self.run(at);
        self.before = self.target;
        if let Some(Middle { position, velocity }) = middle {
            let (position, velocity) = (self.scale.at(position), self.scale.way_of(velocity));
            let asked = self.maker.push(Middle { position, velocity });
            self.target = self.gently(asked);
        }
        self.figures.account.made += 1;
        self.figures.account.sent += 1;
        self.target
    }

    /// What is asked, or where a slice comes late, and the motor lags behind more than a ride makes it, so much of the way there that it
    /// makes up for that no faster, and jumps by no more, than its seat may. No farther than one of both leads: each is inside the stroke.
    #[expect(clippy::cast_possible_truncation, reason = "between two targets")]
    fn gently(&self, asked: i32) -> i32 {
        let ([most, jump], lag) = (self.most, self.lag.tau());
        let (place, speed) = (self.model.position(), self.model.velocity());
        let wanted = (f64::from(asked) - place) / lag;
        if (wanted - speed).abs() <= jump && wanted.abs() <= most {
            return asked;
        }
        let kept = wanted.clamp(speed - jump, speed + jump).clamp(-most, most);
        (place + lag * kept).round() as i32
    }

    /// What was told last arrives so much later than was reckoned with: until then its motor did what it was told before.
    pub(super) fn come_late(&mut self, late: Duration) {
        let last = std::mem::replace(&mut self.target, self.before);
        self.run(self.reckoned + late);
        (self.target, self.before) = (last, last);
    }

    /// Reckons where its motor is at an instant.
    pub(super) fn run(&mut self, at: MonoTime) {
        while self.reckoned + LOOP <= at {
            self.model.run(self.target);
            self.reckoned = self.reckoned + LOOP;
        }
    }

    /// Nothing may have led its motor for hours: that is not reckoned loop by loop.
    pub(super) fn skip(&mut self, now: MonoTime) {
        self.reckoned = self.reckoned.max(now.before(ARRIVED));
    }

    /// For how long where its motor is was not reckoned.
    #[cfg(test)]
    pub(in super::super) fn owes(&self, now: MonoTime) -> Duration {
        now.since(self.reckoned)
    }

    /// True if its motor follows something.
    pub(super) fn moves(&self) -> bool {
        self.model.velocity() != 0.0
    }

    /// How far a reading is beside where its motor should be by now, and how fast that is, mm and mm/s.
    pub(super) fn beside(&self, position: i32) -> (f64, f64) {
        // A target waits for the next loop of the unit, whenever that is; here it is taken up by the one that runs.
        let velocity = self.model.velocity();
        let by = f64::from(position) - (self.model.position() - velocity * LOOP.as_secs_f64());
        (self.scale.mm_of(by), self.scale.mm_of(velocity).abs())
    }

    /// Takes a reading of a motor that is to come to rest: how far it went since the last, mm; none where there was no other.
    pub(super) fn went(&mut self, position: i32, at: MonoTime) -> Option<f64> {
        self.run(at);
        self.figures.error_mm = self.beside(position).0;
        let before = self.stood_at.replace(position)?;
        Some(self.scale.mm_of(f64::from(position) - f64::from(before)).abs())
    }

    /// How long what one wrong target did to it takes to be gone.
    pub(super) fn heals_in(&self) -> Duration {
        STRAYED.max(Duration::from_secs_f64(4.0 * self.lag.tau()))
    }
}
