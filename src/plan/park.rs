//! Parking: from wherever a lane is and however it moves to rest in its park pose, no faster than 50 mm/s, or 10 degrees a second.

use super::seam::{Before, LeastRough, roughness_of_leaving};
use super::solve::{MoveProblem, to_position, to_velocity};
use super::{AxisState, Plan, PlanError};
use crate::motion::{AxisGeometry, Limits, SeatType, Window};
use crate::time::ShowTime;

/// The longest Time that a controller executes as it is in the factory (PA0b, IMAX manual 2.3.1).
const LONGEST_MS: u32 = 3_000;

/// What of the seat's own acceleration and jerk a move is planned with: all but what rounding to pulses adds, less only
/// where its seam with what the lane did before would be rough.
const SHARES: [f64; 5] = [0.99, 0.9, 0.8, 0.7, 0.6];

/// Plans the move from the states `from`, one for each moving slot of the window, to rest in its park pose: straight
/// where that can be had, else a stop where the lane is and then to park. It starts at show time `start`; `before` is what
/// the lane does until then, where it does not rest, at `pace` times the clock.
///
/// # Errors
/// [`PlanError::NoStop`] where the solver refuses everything.
pub(super) fn park(
    window: &Window,
    from: &[AxisState],
    start: ShowTime,
    rate_hz: f64,
    pace: f64,
    mut before: Option<Before<'_, '_>>,
) -> Result<Plan, PlanError> {
    let mut least_rough = LeastRough::default();
    let mut refused = None;
    // Where the pace was changing, that shows as jerk too.
    let shares = if pace == 1.0 { &SHARES[..] } else { &SHARES[1..] };
    for &share in shares {
        // With less than all a seat may not be able to stop inside its stroke.
        let planned = match straight(window, from, share) {
            Err(_) if least_rough.is_none() => {
                straight(window, from, 1.0).or_else(|_| stop_first(window, from))
            }
            planned => planned,
        };
        let mut plan = match planned {
            Ok(plan) => plan,
            Err(refusal) => {
                refused.get_or_insert(refusal);
                continue;
            }
        };
        let leaving = before
            .as_deref_mut()
            .map(|before| roughness_of_leaving(window, &mut plan, start, rate_hz, before));
        let roughness = leaving.unwrap_or(0.0);
        if let Some(smooth) = least_rough.smooth_or_keep(plan, roughness) {
            return Ok(smooth);
        }
    }
    least_rough.into_plan().ok_or_else(|| PlanError::NoStop(refused.unwrap_or_default()))
}

fn target(window: &Window) -> Vec<AxisState> {
    window.moving().map(|(_, slot)| AxisState::at_rest(slot.park)).collect()
}

/// As fast a stop as the seat's own limits allow, wherever that ends, and from there to park.
fn stop_first(window: &Window, from: &[AxisState]) -> Result<Plan, String> {
    let limits: Vec<Limits> =
        window.moving().zip(from).map(|((_, slot), from)| stopping(slot.limits, from, 1.0)).collect();
    let mut stop =
        to_velocity(&MoveProblem { from, to: &target(window), limits: &limits, minimum_s: 0.001 })?;
    let ends = stop.seconds();
    let stopped: Vec<AxisState> =
        stop.position_at(ends).iter().map(|position| AxisState::at_rest(*position)).collect();
    Ok(stop.then(straight(window, &stopped, 1.0)?))
}

/// The Time of the one slow frame that brings a seat to park from wherever it stands, ms: the whole stroke of its slowest axis
/// at the speed of parking, at most 3 s; and whether it had to be cut to that.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a saturating cast is what is wanted"
)]
#[must_use]
pub(crate) fn slow_park_time(seat: &SeatType) -> (u32, bool) {
    let of_axis = |axis: &AxisGeometry| (axis.stroke() / axis.unit.park_velocity() * 1000.0).ceil();
    let whole = seat.own().iter().map(of_axis).fold(1.0, f64::max) as u32;
    (whole.min(LONGEST_MS), whole > LONGEST_MS)
}

fn straight(window: &Window, from: &[AxisState], share: f64) -> Result<Plan, String> {
    let limits: Vec<Limits> = window
        .moving()
        .zip(from)
        .map(|((_, slot), from)| Limits {
            velocity: slot.limits.velocity.min(slot.unit.park_velocity() / slot.stroke),
            ..stopping(slot.limits, from, share)
        })
        .collect();
    to_position(&MoveProblem { from, to: &target(window), limits: &limits, minimum_s: 0.001 })
}

/// A share of the seat's own limits, raised to the acceleration it has.
fn stopping(limits: Limits, from: &AxisState, share: f64) -> Limits {
    let acceleration = (share * limits.acceleration).max(from.acceleration.abs());
    Limits { acceleration, jerk: share * limits.jerk, ..limits }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Slot;

    fn one_axis() -> (Window, Limits) {
        let slot = Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0);
        (Window::new(vec![slot]), slot.limits)
    }

    #[test]
    fn a_seat_at_rest_parks_at_no_more_than_50_mm_a_second() {
        let (window, _) = one_axis();
        let mut plan = park(&window, &[AxisState::at_rest(1.0)], ShowTime::ZERO, 100.0, 1.0, None).unwrap();
        // 150 mm at 50 mm/s, and the time to gather and to lose the speed.
        assert!(plan.seconds() > 3.0 && plan.seconds() < 3.2, "{}", plan.seconds());
        let fastest = (0..3200)
            .map(|ms| plan.states_at(f64::from(ms) * 1e-3).next().unwrap().velocity.abs())
            .fold(0.0, f64::max);
        assert!(fastest * 150.0 <= 50.0 * 1.000_001, "{fastest}");
        assert!(plan.position_at(plan.seconds())[0].abs() < 1e-9);
    }

    #[test]
    fn a_seat_at_full_speed_slows_down_within_its_own_limits_first() {
        let (window, limits) = one_axis();
        let from = AxisState { position: 0.5, velocity: -limits.velocity, acceleration: 0.0 };
        let mut plan = park(&window, &[from], ShowTime::ZERO, 100.0, 1.0, None).unwrap();
        for ms in 0..4000 {
            let state = plan.states_at(f64::from(ms) * 1e-3).next().unwrap();
            assert!(state.acceleration.abs() <= limits.acceleration * 1.000_001, "{state:?}");
            assert!((0.0..=1.0).contains(&state.position), "{state:?}");
        }
    }

    #[test]
    fn a_seat_that_cannot_stop_inside_its_stroke_stops_as_fast_as_it_may_and_then_parks() {
        let (window, limits) = one_axis();
        let from = AxisState { position: 0.99, velocity: limits.velocity, acceleration: 0.0 };
        let mut plan = park(&window, &[from], ShowTime::ZERO, 100.0, 1.0, None).unwrap();
        let halted = (0..200)
            .map(|ms| plan.states_at(f64::from(ms) * 1e-3).next().unwrap().velocity)
            .any(|v| v.abs() < 0.02);
        assert!(halted, "a seat at its full 240 mm/s is slow within 200 ms");
        let mut last = from.position;
        for ms in 0..4000 {
            let now = plan.position_at(f64::from(ms) * 1e-3)[0];
            assert!((now - last).abs() <= limits.velocity * 1.001e-3, "{ms} ms: {last} to {now}");
            last = now;
        }
        assert!(last.abs() < 1e-9);
    }

    #[test]
    fn a_parked_seat_parks_again_without_a_refusal() {
        let (window, _) = one_axis();
        for off in [0.0, 1e-16, 1e-15, 1e-13, 1e-11, 1e-9, 1e-6] {
            assert!(
                park(&window, &[AxisState::at_rest(off)], ShowTime::ZERO, 100.0, 1.0, None)
                    .unwrap()
                    .seconds()
                    < 0.1,
                "{off}"
            );
        }
    }

    #[test]
    fn the_way_home_takes_the_stroke_at_50_mm_a_second_and_3_s_at_the_most() {
        let seat = |stroke_mm: f64| SeatType::bench3(1).with_each(|axis| axis.high = stroke_mm);
        assert_eq!(slow_park_time(&seat(100.0)), (2_000, false));
        assert_eq!(slow_park_time(&seat(150.0)), (3_000, false));
        assert_eq!(slow_park_time(&seat(475.0)), (3_000, true));
    }
}
