//! Decides if an axis can come to rest after the cue's last pose: windows of the measure that end at the last row see nothing
//! of what has to follow it.
//!
//! This is also what makes a stop possible anywhere before. With -jerk, and then with all acceleration, an axis turns before
//! anything else it may do would (`motion::halt`); and one thing it may do is to follow the cue, which stays inside the
//! stroke, up to where it turns by itself or ends. So where the cue turns, the stroke has room for a stop at any instant
//! before; and where it ends without turning, if there is room from its last pose. Room for every stop is thus a matter of
//! the last pose alone, as far as the curve itself keeps the limits; where only the measure does, because a corner is too
//! short for it, the limiter finds the stop that the measure takes no more of than of the corner.

use super::pieces::AxisPieces;
use super::stencil::{Stencil, Stencils};
use super::sweep::sweep;
use super::{Quantity, SLACK};
use crate::motion::{AxisState, Halt, Limits};

// 2 % of the slew, and the slack on top (docs/limiter.md, section 5).
/// The most that show time may run faster than the clock, as a factor: the last pose may be met with that much more speed.
pub(crate) const HURRY: f64 = 1.021;
/// What of acceleration and jerk has to be enough to stay inside the stroke: moves that go on from the last pose are
/// planned with nearly all.
const ROOM_SHARE: f64 = 0.95;
/// Shares of acceleration and jerk of the ways to rest that are tried.
const SHARES: [f64; 3] = [0.85, 0.95, 1.0];

/// Why no way to rest goes on from the last pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum NoRest {
    /// The stroke ends too soon.
    NoRoom {
        /// By so many strokes.
        missing: f64,
    },
    /// Each way breaks a limit.
    TooRough {
        /// The limit that the gentlest of them breaks most.
        quantity: Quantity,
        /// What it comes to, and may; strokes and seconds.
        value: f64,
        limit: f64,
    },
}

/// What an axis may do, in strokes and seconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Allowed {
    pub(super) limits: Limits,
    /// Change of velocity from frame to frame.
    pub(super) step: f64,
    /// A pulse.
    pub(super) pulse: f64,
}

/// Why the axis cannot come to rest after its last pose; nothing where it can, or rests.
pub(super) fn no_rest(pieces: &AxisPieces, allowed: &Allowed, stencils: &Stencils) -> Option<NoRest> {
    let from = pieces.last_motion();
    if from.velocity == 0.0 && from.acceleration == 0.0 {
        return None;
    }
    let limits = allowed.limits;
    // The stroke has to suffice at any pace; for roughness the clock's counts, which pace is back at before the end.
    let hurried = from.at_pace(HURRY);
    // A curve that only the measure keeps may bend beyond the limit; a brake begins at the limit.
    let acceleration = hurried.acceleration.clamp(-limits.acceleration, limits.acceleration);
    let missing = Halt::least_past(AxisState { acceleration, ..hurried }, limits, ROOM_SHARE);
    if missing > allowed.pulse {
        return Some(NoRest::NoRoom { missing });
    }
    too_rough(pieces, from, allowed, stencils)
}

/// What the gentlest way to rest breaks, if it does.
fn too_rough(pieces: &AxisPieces, from: AxisState, allowed: &Allowed, stencils: &Stencils) -> Option<NoRest> {
    let limits = allowed.limits;
    let reach = stencils.reach();
    let ending = pieces.ending(reach, 1.0, 0.0);
    // From gentle to hard, the first that keeps the measure; if none does, the least is told.
    let mut least: Option<(Quantity, f64, f64)> = None;
    for share in SHARES {
        // Room was asked for above: here a way that leaves the stroke counts by its roughness alone.
        let way = Halt::inside(from, limits, &[share]).unwrap_or_else(|| Halt::full(from, limits));
        let then = ending.then(&way, reach);
        let swept = |quantity, stencils: &[Stencil], order, limit: f64| {
            (quantity, sweep(&then, stencils, order, f64::INFINITY).worst, limit)
        };
        let worst = [
            swept(Quantity::Velocity, &stencils.velocity, 1, limits.velocity),
            swept(Quantity::Step, &stencils.step, 2, allowed.step),
            swept(Quantity::Acceleration, &stencils.acceleration, 2, limits.acceleration),
            swept(Quantity::Jerk, &stencils.jerk, 3, limits.jerk),
        ];
        let part = |of: &(Quantity, f64, f64)| of.1 / of.2;
        let worst = worst.into_iter().max_by(|a, b| part(a).total_cmp(&part(b)))?;
        if part(&worst) <= SLACK {
            return None;
        }
        if least.is_none_or(|least| part(&worst) < part(&least)) {
            least = Some(worst);
        }
    }
    least.map(|(quantity, value, limit)| NoRest::TooRough { quantity, value, limit })
}
