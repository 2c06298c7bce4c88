//! Braking: the quickest gentle way to rest from wherever an axis is, in closed form, so that the tick thread can make it
//! at once, without the planner.

use super::{Halt, MAX_AXES, Pose, Window};

/// What of the limits a brake uses, first: the seam with what the axis did before is seen by the measure as well, and full
/// speed of the default seat is gone in 150 ms. Where the stroke has no room for that, all.
const SHARES: [f64; 2] = [0.85, 1.0];

/// How one axis moves: strokes, strokes per second, strokes per second squared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct AxisState {
    /// Fraction of the stroke.
    pub(crate) position: f64,
    /// Strokes per second.
    pub(crate) velocity: f64,
    /// Strokes per second squared.
    pub(crate) acceleration: f64,
}

impl AxisState {
    /// At rest there.
    #[must_use]
    pub(crate) const fn at_rest(position: f64) -> Self {
        Self { position, velocity: 0.0, acceleration: 0.0 }
    }

    /// The same motion run through `pace` times as fast.
    #[must_use]
    pub(crate) fn at_pace(self, pace: f64) -> Self {
        Self { velocity: self.velocity * pace, acceleration: self.acceleration * pace * pace, ..self }
    }
}

/// The way of one lane's slots to rest. Making and following it allocates nothing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Brake {
    halts: [Option<Halt>; MAX_AXES],
    seconds: f64,
}

impl Brake {
    /// From the states of a window's slots, in frame order, each axis by its own limits.
    ///
    /// An axis that would leave its stroke so brakes with all of its limits, and where that has no room either turns back
    /// and rests further inside; one that cannot stay inside even then was driven at the end of its stroke, and is held
    /// there.
    #[must_use]
    pub(crate) fn new(window: &Window, from: &[AxisState; MAX_AXES]) -> Self {
        let mut halts = [None; MAX_AXES];
        let mut seconds = 0.0_f64;
        for ((kept, slot), from) in halts.iter_mut().zip(window.slots()).zip(from) {
            let halt =
                Halt::inside(*from, slot.limits, &SHARES).unwrap_or_else(|| Halt::full(*from, slot.limits));
            seconds = seconds.max(halt.seconds());
            *kept = Some(halt);
        }
        Self { halts, seconds }
    }

    /// How long until the last axis rests, seconds.
    #[must_use]
    pub(crate) const fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Where the slots are `seconds` after its start, inside the stroke.
    #[must_use]
    pub(crate) fn pose(&self, seconds: f64) -> Pose {
        let mut pose = [0.0; MAX_AXES];
        for (place, halt) in pose.iter_mut().zip(&self.halts) {
            *place = halt.as_ref().map_or(0.0, |halt| halt.position(seconds));
        }
        pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{AxisGeometry, Limits, SeatType, Slot};

    fn limits() -> Limits {
        Limits::of(&AxisGeometry::BENCH)
    }

    fn one_axis() -> Window {
        Window::new(vec![Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0)])
    }

    fn brake(position: f64, velocity: f64, acceleration: f64) -> Brake {
        let mut from = [AxisState::default(); MAX_AXES];
        from[0] = AxisState { position, velocity, acceleration };
        Brake::new(&one_axis(), &from)
    }

    #[test]
    fn full_speed_of_the_default_seat_is_gone_in_150_ms() {
        let seconds = brake(0.5, limits().velocity, 0.0).seconds();
        assert!(seconds <= 0.150, "{seconds}");
    }

    #[test]
    fn a_seat_at_rest_stays_where_it_is() {
        let brake = brake(0.3, 0.0, 0.0);
        assert_eq!(brake.seconds(), 0.0);
        assert_eq!(brake.pose(1.0)[0], 0.3);
    }

    #[test]
    fn an_axis_that_a_gentle_brake_would_drive_out_of_its_stroke_brakes_with_all_of_its_limits() {
        let velocity = limits().velocity;
        let stopping = |share| {
            let from = AxisState { velocity, ..AxisState::default() };
            Halt::inside(from, limits(), &[share]).expect("there is room").rest()
        };
        let position = 1.0 - stopping(1.0).midpoint(stopping(SHARES[0]));
        let end = brake(position, velocity, 0.0).pose(9.0)[0];
        assert!((position + stopping(1.0) - end).abs() < 1e-12, "{end}");
    }

    #[test]
    fn an_axis_that_turns_at_the_end_of_its_stroke_turns_there_when_it_is_stopped_and_rests_further_inside() {
        // A swing up to the very end: 50 mm/s left, and just the acceleration that takes them back there.
        let (velocity, acceleration) = (50.0 / 150.0, -2_900.0 / 150.0);
        let position = 1.0 - velocity * velocity / (2.0 * -acceleration);
        let brake = brake(position, velocity, acceleration);
        let way: Vec<f64> = (0..100).map(|step| brake.pose(f64::from(step) * 2e-3)[0]).collect();
        let jerks = way.windows(4).map(|x| (x[3] - 3.0 * x[2] + 3.0 * x[1] - x[0]) / 8e-9);
        let most = jerks.fold(0.0, |most: f64, jerk| most.max(jerk.abs()));
        assert!(most <= limits().jerk * 1.1, "{most} strokes/s³: it is not held at the end, it turns");
        assert!(way[99] < 1.0 - 1e-4, "{}", way[99]);
    }
}
