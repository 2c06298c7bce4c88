//! One call of the solver, with what is always the same about it.

use rsruckig::prelude::{
    ControlInterface, DataArrayOrVec, InputParameter, Ruckig, RuckigResult, Synchronization,
    ThrowErrorHandler, Trajectory,
};

use super::{AxisState, Plan};
use crate::motion::Limits;

/// States nearer than this are the same: a start equal to its target up to rounding makes the solver fail.
const SAME: f64 = 1e-9;

/// A move that ends farther than this from its target, in strokes or strokes per second, does not lead there.
const MISSED: f64 = 1e-5;

/// A seat at the very end of its stroke is not refused for the last bit of its position.
const ROUNDING: f64 = 1e-6;

/// What is asked of the solver, axis by axis.
pub(super) struct MoveProblem<'a> {
    pub(super) from: &'a [AxisState],
    /// Positions are ignored where only a velocity is to be reached.
    pub(super) to: &'a [AxisState],
    pub(super) limits: &'a [Limits],
    pub(super) minimum_s: f64,
}

/// A move to the target, all axes arriving together where that can be had, inside the stroke.
pub(super) fn to_position(problem: &MoveProblem<'_>) -> Result<Plan, String> {
    solve(problem, Synchronization::Time, ControlInterface::Position)
        .or_else(|_| solve(problem, Synchronization::None, ControlInterface::Position))
}

/// A move that only reaches the target's velocity; the position is where it ends. Without limits of position, because
/// the solver gives no best effort where the end of the stroke cannot be kept; poses are held inside it later.
pub(super) fn to_velocity(problem: &MoveProblem<'_>) -> Result<Plan, String> {
    solve(problem, Synchronization::None, ControlInterface::Velocity)
}

fn solve(
    problem: &MoveProblem<'_>,
    sync: Synchronization,
    interface: ControlInterface,
) -> Result<Plan, String> {
    let axes = problem.from.len();
    let mut input = InputParameter::<0>::new(Some(axes));
    input.synchronization = sync;
    input.control_interface = interface;
    input.minimum_duration = Some(problem.minimum_s);
    for axis in 0..axes {
        let (from, to, limits) = (problem.from[axis], snapped(problem, axis), problem.limits[axis]);
        input.current_position[axis] = from.position;
        input.current_velocity[axis] = from.velocity;
        input.current_acceleration[axis] = from.acceleration;
        input.target_position[axis] = to.position;
        input.target_velocity[axis] = to.velocity;
        input.target_acceleration[axis] = to.acceleration;
        input.max_velocity[axis] = limits.velocity;
        input.max_acceleration[axis] = limits.acceleration;
        input.max_jerk[axis] = limits.jerk;
    }
    if interface == ControlInterface::Position {
        input.min_position = Some(DataArrayOrVec::new(Some(axes), -ROUNDING));
        input.max_position = Some(DataArrayOrVec::new(Some(axes), 1.0 + ROUNDING));
    }
    let mut trajectory = Trajectory::<0>::new(Some(axes));
    match Ruckig::<0, ThrowErrorHandler>::new(Some(axes), 0.001).calculate(&input, &mut trajectory) {
        // Some refusals come as a result that is an error.
        Ok(RuckigResult::Working | RuckigResult::Finished) => {
            arrived(problem, Plan::new(trajectory, axes), interface)
        }
        Ok(refusal) => Err(format!("{refusal:?}")),
        Err(error) => Err(error.to_string()),
    }
}

/// The plan, if it ends where it was to: of a minimum duration the solver sometimes makes a move that does not, and says nothing.
fn arrived(problem: &MoveProblem<'_>, mut plan: Plan, interface: ControlInterface) -> Result<Plan, String> {
    let ends = plan.seconds();
    let misses = |(ends, to): (AxisState, &AxisState)| {
        let position =
            interface == ControlInterface::Position && (ends.position - to.position).abs() > MISSED;
        position || (ends.velocity - to.velocity).abs() > MISSED
    };
    if plan.states_at(ends).zip(problem.to).any(misses) {
        return Err("its move ends elsewhere".to_owned());
    }
    Ok(plan)
}

fn snapped(problem: &MoveProblem<'_>, axis: usize) -> AxisState {
    let (from, to) = (problem.from[axis], problem.to[axis]);
    let snap = |from: f64, to: f64| if (from - to).abs() < SAME { from } else { to };
    AxisState {
        position: snap(from.position, to.position),
        velocity: snap(from.velocity, to.velocity),
        acceleration: snap(from.acceleration, to.acceleration),
    }
}
