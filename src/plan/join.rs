//! Joins: a move from where a lane is onto the moving cue, met at its position, velocity and acceleration.

use super::seam::{Before, LeastRough, SLACK, roughness_around, roughness_of_leaving};
use super::solve::{MoveProblem, to_position};
use super::states::following;
use super::{AxisState, Curve, Plan, PlanError};
use crate::motion::{Limits, Window};
use crate::time::ShowTime;

/// The shortest join, seconds.
pub(crate) const JOIN_MIN: f64 = 1.5;
/// The longest join, seconds.
const JOIN_MAX: f64 = 10.0;
/// How much later the cue is met where it cannot be met yet, seconds.
const LATER: f64 = 0.010;
/// What of the limits a join is planned with, so that the slewing of a lag fits on top of it.
const SHARE: f64 = 0.9;
/// How many later meetings are tried to find one whose seam the measure does not see.
const SMOOTHER: usize = 50;

/// Plans a join that starts at show time `start` from the states `from`, one for each moving slot of the window; `before`
/// is what the lane does until then, where it does not rest.
///
/// # Errors
/// [`PlanError::NoJoin`] where the solver finds no move of up to 10 s.
pub(super) fn join(
    window: &Window,
    from: &[AxisState],
    cue: &Curve<'_>,
    start: ShowTime,
    rate_hz: f64,
    mut before: Option<Before<'_, '_>>,
) -> Result<Plan, PlanError> {
    let mut least_rough = LeastRough::default();
    let (mut meeting, mut smoother) = (JOIN_MIN, 0);
    let mut reason = String::new();
    while meeting <= JOIN_MAX && smoother < SMOOTHER {
        match attempt(window, from, cue, start, meeting) {
            Ok(plan) if plan.seconds() > meeting + 1e-9 => {
                reason = format!("it takes {:.3} s to arrive", plan.seconds());
                meeting = plan.seconds() + LATER;
            }
            Ok(mut plan) => {
                let roughness = roughness(window, &mut plan, cue, start, rate_hz, before.as_deref_mut());
                if let Some(smooth) = least_rough.smooth_or_keep(plan, roughness) {
                    return Ok(smooth);
                }
                smoother += 1;
                meeting += LATER;
            }
            Err(refusal) => {
                reason = refusal;
                meeting += LATER;
            }
        }
    }
    let no_join = PlanError::NoJoin { at: start, limit_s: JOIN_MAX, reason };
    least_rough.into_plan().ok_or(no_join)
}

/// True if a lane at rest in its park pose can take up the cue at `start` without a move: the cue stands there in that
/// pose, to a pulse, and leaves it within the limits.
#[must_use]
pub(super) fn joins_without_a_move(window: &Window, cue: &Curve<'_>, start: ShowTime, rate_hz: f64) -> bool {
    let (park, first) = (window.park(), window.place(&(cue.pose)(start)));
    let there =
        window.moving().all(|(slot, axis)| (first[slot] - park[slot]).abs() * axis.stroke_pulses <= 1.0);
    let pose = |at: ShowTime| if at <= start { park } else { window.place(&(cue.pose)(at)) };
    there && roughness_around(window, start, rate_hz, pose) <= SLACK
}

fn attempt(
    window: &Window,
    from: &[AxisState],
    cue: &Curve<'_>,
    start: ShowTime,
    meeting: f64,
) -> Result<Plan, String> {
    let at = ShowTime::from_nanos(start.as_nanos() + ShowTime::from_secs_f64(meeting).as_nanos());
    let to = following(window, cue, at);
    let limits: Vec<Limits> = window
        .moving()
        .zip(from.iter().zip(&to))
        .map(|((_, slot), (from, to))| raised(slot.limits, from, to))
        .collect();
    to_position(&MoveProblem { from, to: &to, limits: &limits, minimum_s: meeting })
}

/// Ninety per cent of the limits, raised to what the present state and the target need.
fn raised(limits: Limits, from: &AxisState, to: &AxisState) -> Limits {
    let jerk = SHARE * limits.jerk;
    let acceleration = from.acceleration.abs().max(to.acceleration.abs()).max(SHARE * limits.acceleration);
    // An acceleration still there takes the speed further before it is gone.
    let reached = |s: &AxisState| s.velocity.abs() + s.acceleration * s.acceleration / (2.0 * jerk);
    let velocity = (SHARE * limits.velocity).max(1.000_001 * reached(from)).max(1.000_001 * reached(to));
    Limits { velocity, acceleration, jerk }
}

/// How rough the seams of the move are: where it leaves what the lane did before, and where it meets the cue.
fn roughness(
    window: &Window,
    plan: &mut Plan,
    cue: &Curve<'_>,
    start: ShowTime,
    rate_hz: f64,
    before: Option<Before<'_, '_>>,
) -> f64 {
    let length = ShowTime::from_secs_f64(plan.seconds());
    let meeting = ShowTime::from_nanos(start.as_nanos() + length.as_nanos());
    let met = roughness_around(window, meeting, rate_hz, |at| {
        if at < meeting { plan.pose_at(at, start, window) } else { window.place(&(cue.pose)(at)) }
    });
    match before {
        Some(before) => met.max(roughness_of_leaving(window, plan, start, rate_hz, before)),
        None => met,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{MAX_AXES, SeatType, Slot};

    fn three_axes() -> Window {
        let seat = SeatType::bench3(3);
        Window::new((0..3).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect())
    }

    /// Sines of 0.4 Hz about the middle of the stroke, each axis a third of a turn behind the one before.
    fn swell(at: ShowTime) -> crate::motion::Pose {
        let mut pose = [0.0; MAX_AXES];
        for (axis, place) in (0_u32..).zip(&mut pose) {
            let turn = at.as_secs_f64() * 0.4 - f64::from(axis) / 3.0;
            *place = 0.5 + 0.3 * (turn * std::f64::consts::TAU).sin();
        }
        pose
    }

    fn cue() -> Curve<'static> {
        Curve { pose: &swell, end: ShowTime::from_millis(60_000) }
    }

    #[test]
    fn a_join_from_park_meets_the_moving_cue_within_the_limits() {
        let window = three_axes();
        let mut plan =
            join(&window, &[AxisState::default(); 3], &cue(), ShowTime::ZERO, 100.0, None).unwrap();
        assert!(plan.seconds() >= JOIN_MIN - 1e-9, "{}", plan.seconds());
        let at = ShowTime::from_secs_f64(plan.seconds());
        let target = following(&window, &cue(), at);
        for (axis, target) in target.iter().enumerate() {
            let end = plan.states_at(plan.seconds()).nth(axis).unwrap();
            assert!((end.position - target.position).abs() < 1e-6, "axis {axis}: {end:?} {target:?}");
            assert!((end.velocity - target.velocity).abs() < 1e-6, "axis {axis}: {end:?} {target:?}");
        }
        assert!(roughness(&window, &mut plan, &cue(), ShowTime::ZERO, 100.0, None) <= SLACK);
    }

    #[test]
    fn a_cue_that_outruns_the_seat_is_refused_before_anything_moves() {
        let leap = |at: ShowTime| {
            let mut pose = [0.0; MAX_AXES];
            pose[0] = if at.as_nanos() / 5_000_000 % 2 == 0 { 0.0 } else { 1.0 };
            pose
        };
        let cue = Curve { pose: &leap, end: ShowTime::from_millis(60_000) };
        let seat = SeatType::bench3(1);
        let window = Window::new(vec![Slot::new(&seat, 0, Some(0), 1.0)]);
        let outcome = join(&window, &[AxisState::at_rest(0.5)], &cue, ShowTime::ZERO, 100.0, None);
        // Either refused, or planned no faster than the cue itself is.
        if let Err(error) = outcome {
            assert!(error.to_string().contains("no move of up to 10 s"), "{error}");
        }
    }

    #[test]
    fn a_cue_at_rest_in_the_park_pose_needs_no_move_and_one_under_way_does() {
        let window = three_axes();
        let resting = |_| [0.0; MAX_AXES];
        let rest = Curve { pose: &resting, end: ShowTime::from_millis(1000) };
        assert!(joins_without_a_move(&window, &rest, ShowTime::ZERO, 100.0));
        assert!(!joins_without_a_move(&window, &cue(), ShowTime::ZERO, 100.0));
    }
}
