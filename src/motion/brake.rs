//! Braking: the quickest gentle way to rest from wherever an axis is, in closed form, so that the tick thread can make it
//! at once, without the planner.

use super::{Limits, MAX_AXES, Pose, Window};

/// What of the limits a brake uses: the seam with what the axis did before is seen by the measure as well, and full speed
/// of the default seat is gone in 150 ms.
const SHARE: f64 = 0.85;

/// How one axis moves: strokes, strokes per second, strokes per second squared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisState {
    /// Fraction of the stroke.
    pub position: f64,
    /// Strokes per second.
    pub velocity: f64,
    /// Strokes per second squared.
    pub acceleration: f64,
}

impl AxisState {
    /// At rest there.
    #[must_use]
    pub const fn at_rest(position: f64) -> Self {
        Self { position, velocity: 0.0, acceleration: 0.0 }
    }

    /// The same motion run through `pace` times as fast.
    #[must_use]
    pub fn at_pace(self, pace: f64) -> Self {
        Self { velocity: self.velocity * pace, acceleration: self.acceleration * pace * pace, ..self }
    }

    /// The state after `t` seconds of constant `jerk`.
    fn after(self, t: f64, jerk: f64) -> Self {
        let Self { position, velocity, acceleration } = self;
        Self {
            position: position + t * (velocity + t * (acceleration / 2.0 + t * jerk / 6.0)),
            velocity: velocity + t * (acceleration + t * jerk / 2.0),
            acceleration: acceleration + t * jerk,
        }
    }
}

/// The way of one axis to rest: acceleration against the motion grows, stays, and goes.
#[derive(Debug, Clone, Copy, Default)]
struct Halt {
    from: AxisState,
    /// Seconds and jerk of each part.
    parts: [(f64, f64); 3],
}

impl Halt {
    /// The quickest with that share of the limits; an acceleration beyond its share is kept until it can go.
    fn new(from: AxisState, limits: Limits, share: f64) -> Self {
        let jerk = share * limits.jerk;
        let greatest = (share * limits.acceleration).max(from.acceleration.abs());
        // Were the acceleration just let go, this speed would be left.
        let left = from.velocity + from.acceleration * from.acceleration.abs() / (2.0 * jerk);
        let against = if left > 0.0 { -1.0 } else { 1.0 };
        let (velocity, acceleration) = (against * from.velocity, against * from.acceleration);
        let peak = (acceleration * acceleration / 2.0 - jerk * velocity).max(0.0).sqrt().max(acceleration);
        let (peak, held) = if peak <= greatest {
            (peak, 0.0)
        } else {
            let ramps = (2.0 * greatest * greatest - acceleration * acceleration) / (2.0 * jerk);
            (greatest, ((-velocity - ramps) / greatest).max(0.0))
        };
        let jerk = against * jerk;
        let grows = (peak - acceleration) / jerk.abs();
        Self { from, parts: [(grows, jerk), (held, 0.0), (peak / jerk.abs(), -jerk)] }
    }

    fn seconds(&self) -> f64 {
        self.parts.iter().map(|(seconds, _)| seconds).sum()
    }

    fn at(&self, seconds: f64) -> AxisState {
        let (mut state, mut left) = (self.from, seconds.max(0.0));
        for (part, jerk) in self.parts {
            state = state.after(left.min(part), jerk);
            left -= part;
            if left <= 0.0 {
                return state;
            }
        }
        AxisState::at_rest(state.position)
    }
}

/// The way of one lane's slots to rest. Making and following it allocates nothing.
#[derive(Debug, Clone, Copy)]
pub struct Brake {
    halts: [Halt; MAX_AXES],
    seconds: f64,
}

impl Brake {
    /// From the states of a window's slots, in frame order, each axis by its own limits.
    ///
    /// An axis that would leave its stroke so brakes with all of its limits; one that cannot stay inside even then was
    /// driven at the end of its stroke, and is held there.
    #[must_use]
    pub fn new(window: &Window, from: &[AxisState; MAX_AXES]) -> Self {
        let mut halts = [Halt::default(); MAX_AXES];
        let mut seconds = 0.0_f64;
        for ((halt, slot), from) in halts.iter_mut().zip(window.slots()).zip(from) {
            let gentle = Halt::new(*from, slot.limits, SHARE);
            let inside = (0.0..=1.0).contains(&gentle.at(f64::INFINITY).position);
            *halt = if inside { gentle } else { Halt::new(*from, slot.limits, 1.0) };
            seconds = seconds.max(halt.seconds());
        }
        Self { halts, seconds }
    }

    /// How long until the last axis rests, seconds.
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Where the slots are `seconds` after its start, inside the stroke.
    #[must_use]
    pub fn pose(&self, seconds: f64) -> Pose {
        let mut pose = [0.0; MAX_AXES];
        for (place, halt) in pose.iter_mut().zip(&self.halts) {
            *place = halt.at(seconds).position.clamp(0.0, 1.0);
        }
        pose
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::motion::{SeatType, Slot};

    fn limits() -> Limits {
        Limits::of(&SeatType::bench3(1))
    }

    #[test]
    fn full_speed_of_the_default_seat_is_gone_in_150_ms() {
        let from = AxisState { position: 0.5, velocity: limits().velocity, acceleration: 0.0 };
        let halt = Halt::new(from, limits(), SHARE);
        assert!(halt.seconds() <= 0.150, "{}", halt.seconds());
    }

    #[test]
    fn a_seat_at_rest_stays_where_it_is() {
        let window = Window::new(vec![Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0)]);
        let brake = Brake::new(&window, &[AxisState::at_rest(0.3); MAX_AXES]);
        assert_eq!(brake.seconds(), 0.0);
        assert_eq!(brake.pose(1.0)[0], 0.3);
    }

    #[test]
    fn an_axis_that_a_gentle_brake_would_drive_out_of_its_stroke_brakes_with_all_of_its_limits() {
        let window = Window::new(vec![Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0)]);
        let velocity = limits().velocity;
        let stopping = |share| {
            Halt::new(AxisState { velocity, ..AxisState::default() }, limits(), share).at(9.0).position
        };
        let position = 1.0 - stopping(1.0).midpoint(stopping(SHARE));
        let mut from = [AxisState::default(); MAX_AXES];
        from[0] = AxisState { position, velocity, acceleration: 0.0 };
        let end = Brake::new(&window, &from).pose(9.0)[0];
        assert!((position + stopping(1.0) - end).abs() < 1e-12, "{end}");
    }

    proptest! {
        #[test]
        fn every_brake_ends_at_rest_within_the_limits_and_without_a_step(
            velocity in -1.6..1.6_f64, acceleration in -20.0..20.0_f64, share in 0.3..1.0_f64,
        ) {
            let from = AxisState { position: 0.5, velocity, acceleration };
            let halt = Halt::new(from, limits(), share);
            let greatest = (share * limits().acceleration).max(acceleration.abs()) * 1.000_001;
            let steps = 400;
            let mut before = from;
            for step in 0..=steps {
                let t = halt.seconds() * f64::from(step) / f64::from(steps);
                let now = halt.at(t);
                prop_assert!(now.acceleration.abs() <= greatest, "{now:?}");
                let dt = halt.seconds() / f64::from(steps);
                let change = (now.acceleration - before.acceleration).abs();
                prop_assert!(change <= share * limits().jerk * dt * 1.000_001 + 1e-9, "{before:?} {now:?}");
                before = now;
            }
            let end = halt.at(halt.seconds() - 1e-12);
            prop_assert!(end.velocity.abs() < 1e-9 && end.acceleration.abs() < 1e-6, "{end:?}");
        }
    }
}
