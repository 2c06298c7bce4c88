//! One axis that is not simply let pass: it brakes, waits at rest, and is led back.

use super::limits::{AxisLimits, SLACK};
use crate::motion::{Halt, Measure, Spacing};
use crate::time::ShowTime;

/// What the way back takes at the least, as a join does.
const SHORTEST_RETURN: f64 = 1.5;
// The other half is for what it fades onto (docs/limiter.md, section 7).
/// Share of the limits that fading over a whole stroke takes by itself.
const FADE_SHARE: f64 = 0.5;
// What the product rule adds shrinks with the length; what refuses even this leaves room for none.
/// How many times as long a way back may become after several that did not lead there.
const LONGEST: f64 = 8.0;

/// What an axis is about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum AxisMode {
    /// Sends what is asked.
    Following,
    /// Comes to rest, and stays there.
    Braking {
        brake: Halt,
        /// Seconds on it.
        after: f64,
    },
    /// Fades from rest onto what is asked.
    Returning { from: f64, after: f64, seconds: f64 },
}

/// The state of one axis.
#[derive(Debug, Clone)]
pub(super) struct AxisLimiter {
    pub(super) limits: AxisLimits,
    pub(super) mode: AxisMode,
    /// The last way to rest that was looked for in good time, and the frame from whose pose it begins.
    pub(super) way_out: Option<(u64, Halt)>,
    /// Which of the ways to rest did last.
    pub(super) habit: usize,
    fade: f64,
    stretch: f64,
    asked: AskedPose,
}

impl AxisLimiter {
    pub(super) fn new(limits: AxisLimits, spacing: Spacing) -> Self {
        // The greatest derivatives of u^3 (10 - 15 u + 6 u^2) are 15/8, 10/sqrt 3 and 60 (docs/limiter.md, section 7).
        // They go by 1/S, 1/S² and 1/S³ of its length S: the longest of
        // the three keeps all. On the bench seat velocity rules, 2.3 s.
        let share = |limit: f64| FADE_SHARE * limit;
        let fade = (1.875 / share(limits.velocity))
            .max((5.7735 / share(limits.acceleration)).sqrt())
            .max((60.0 / share(limits.jerk)).cbrt())
            .max(SHORTEST_RETURN);
        Self {
            limits,
            mode: AxisMode::Following,
            way_out: None,
            habit: 0,
            fade,
            stretch: 1.0,
            asked: AskedPose::new(spacing),
        }
    }

    /// Forgets all but the limits: the axis stands, and has for long.
    pub(super) fn rest(&mut self) {
        self.mode = AxisMode::Following;
        self.way_out = None;
        self.stretch = 1.0;
        self.asked.forget();
    }

    /// Goes onto a way to rest, `seconds` of which the next frame takes.
    pub(super) fn brake(&mut self, brake: Halt, seconds: f64) -> f64 {
        match self.mode {
            // What the fade adds to what it fades onto shrinks with its length, so a longer one may be let pass.
            AxisMode::Returning { .. } => self.stretch = (2.0 * self.stretch).min(LONGEST),
            // What was asked so far was measured as what was sent: of it alone nothing is known yet.
            AxisMode::Following => self.asked.forget(),
            AxisMode::Braking { .. } => {}
        }
        self.mode = AxisMode::Braking { brake, after: seconds };
        self.way_out = None;
        brake.position(seconds)
    }

    /// Looks at what is asked; whether it broke the limits, taken by itself.
    pub(super) fn look(&mut self, asked: f64, time_ms: u32) -> bool {
        self.asked.look(asked, time_ms, &self.limits)
    }

    /// Where the present mode leads in a frame of so many seconds, `asked` being what is asked. On a way to rest that is
    /// over, the way back, once what is asked can be followed.
    pub(super) fn wish(&self, asked: f64, seconds: f64) -> (AxisMode, f64) {
        match self.mode {
            AxisMode::Following => (AxisMode::Following, asked),
            // From rest alone: a fade begins without speed, and would stop a braking seat at once.
            AxisMode::Braking { brake, after } if after > brake.seconds() && self.asked.is_sound() => {
                let back = AxisMode::Returning {
                    from: brake.position(after),
                    after: 0.0,
                    seconds: self.fade * self.stretch,
                };
                fade_on(back, asked, seconds)
            }
            AxisMode::Braking { brake, after } => {
                let after = after + seconds;
                (AxisMode::Braking { brake, after }, brake.position(after))
            }
            AxisMode::Returning { .. } => fade_on(self.mode, asked, seconds),
        }
    }

    /// Takes up the mode that a wish came with.
    pub(super) fn take_up(&mut self, mode: AxisMode) {
        // This way back has led there; the next may be short again.
        if mode == AxisMode::Following {
            self.stretch = 1.0;
        }
        self.mode = mode;
    }
}

/// The next frame of a way back: what is asked counts for more and more.
fn fade_on(mode: AxisMode, asked: f64, passed: f64) -> (AxisMode, f64) {
    let AxisMode::Returning { from, after, seconds } = mode else { return (mode, asked) };
    let after = after + passed;
    if after >= seconds {
        return (AxisMode::Following, asked);
    }
    let u = after / seconds;
    // Speed and acceleration of the weight are 0 at both ends, so that neither seam has a step.
    let weight = u * u * u * (10.0 + u * (6.0 * u - 15.0));
    (AxisMode::Returning { from, after, seconds }, from + weight * (asked - from))
}

/// What is asked, taken by itself: whether it can be followed.
#[derive(Debug, Clone)]
struct AskedPose {
    spacing: Spacing,
    measure: Measure,
    at: ShowTime,
    /// Poses in a row that kept the limits.
    sound: usize,
}

impl AskedPose {
    const fn new(spacing: Spacing) -> Self {
        Self { spacing, measure: Measure::new(spacing), at: ShowTime::ZERO, sound: 0 }
    }

    fn forget(&mut self) {
        *self = Self::new(self.spacing);
    }

    fn look(&mut self, asked: f64, time_ms: u32, limits: &AxisLimits) -> bool {
        // In the measure it would hide: nothing compares as larger, so differences over it would read 0.
        if !asked.is_finite() {
            self.forget();
            return true;
        }
        self.at = ShowTime::from_nanos(self.at.as_nanos() + i64::from(time_ms) * 1_000_000);
        let seen = self.measure.push(self.at, asked);
        let kept = (0.0..=1.0).contains(&asked)
            && seen.velocity.value.abs() <= SLACK * limits.velocity
            && seen.step.value.abs() <= SLACK * limits.step
            && seen.acceleration.value.abs() <= SLACK * limits.acceleration
            && seen.jerk.value.abs() <= SLACK * limits.jerk;
        self.sound = if kept { self.sound + 1 } else { 0 };
        !kept
    }

    /// True if all that the measure looks back on has kept the limits.
    const fn is_sound(&self) -> bool {
        // The longest difference spans 3 m + 1 poses; the first ones were judged by less than that.
        self.sound > 3 * self.spacing.m + 1
    }
}
