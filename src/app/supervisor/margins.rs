//! What a proved cue leaves of the limits, where it leaves least.

use crate::control::{MarginOf, MarginStatus};
use crate::proof::{AxisProof, Proof, Quantity};

/// The least of each limit over all axes and seats.
pub(super) fn least(proof: &Proof) -> Vec<MarginStatus> {
    let mut least: Vec<MarginStatus> = Vec::new();
    for margin in proof.axes.iter().flat_map(of_axis) {
        match least.iter_mut().find(|one| one.of == margin.of) {
            Some(one) if one.part <= margin.part => {}
            Some(one) => *one = margin,
            None => least.push(margin),
        }
    }
    least
}

fn of_axis(axis: &AxisProof) -> Vec<MarginStatus> {
    let margin = |of, part, at_s| MarginStatus { of, axis: axis.axis + 1, part, at_s };
    let limited = axis.worst().into_iter().map(|(quantity, worst)| {
        let of = match quantity {
            Quantity::Velocity => MarginOf::Velocity,
            Quantity::Step => MarginOf::Step,
            Quantity::Acceleration => MarginOf::Acceleration,
            Quantity::Jerk => MarginOf::Jerk,
        };
        margin(of, worst.margin(), worst.at.as_secs_f64())
    });
    let (part, nearest) = axis.nearest();
    [margin(MarginOf::Stroke, part, nearest.at.as_secs_f64())].into_iter().chain(limited).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{Rig, proved};

    #[test]
    fn a_loaded_cue_says_what_it_leaves_of_each_limit_and_where() {
        let config = (*Rig::armed().supervisor.hall.config).clone();
        let margins = proved("ride", &config)
            .status(crate::time::ShowTime::ZERO, crate::time::MonoTime::from_nanos(0))
            .margins;
        assert_eq!(margins.iter().map(|one| one.of).collect::<Vec<_>>(), MarginOf::ALL);
        assert!(margins.iter().all(|one| (0.0..=1.0).contains(&one.part) && one.axis > 0), "{margins:?}");
        // It begins at park, at one end of the stroke, which is no use of the stroke.
        assert!(margins[0].part > 0.1, "{margins:?}");
    }
}
