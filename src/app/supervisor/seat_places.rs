//! Where a seat is, by what it said.

use std::time::Duration;

use crate::config::Controller;
use crate::motion::Pulses;
use crate::observe::{ControllerState, Heard};
use crate::wire::PerAxis;

/// How long a measured place is the newest that is known of a seat that acks frames.
const MEASURED_HOLDS: Duration = Duration::from_secs(1);

/// Where a seat is, axis by axis.
#[derive(Debug, Default, PartialEq)]
pub(super) struct SeatPlaces {
    /// As measured or else as commanded, mm or degrees.
    pub(super) positions_mm: Option<Vec<f64>>,
    /// By the last frame that it acked, parts of each axis's range.
    pub(super) commanded: Option<Vec<f64>>,
    /// As measured, parts of each axis's range.
    pub(super) measured: Option<Vec<f64>>,
}

impl SeatPlaces {
    pub(super) fn of(controller: &Controller, state: &ControllerState) -> Self {
        let axes = controller.seat.own();
        let parts = |heard: Heard<PerAxis<Pulses>>, first: usize| {
            let own = axes.iter().zip(heard.value.iter().skip(first));
            own.map(|(axis, at)| axis.fraction(*at)).collect::<Vec<f64>>()
        };
        // A frame has a slot for each axis of the cue, the registers one for each axis of the controller.
        let commanded = state.echoed.map(|echoed| parts(echoed, controller.axis_offset));
        // What was measured before it acked other places says no more where it is: most measure at rest alone.
        let holds = |measured: &Heard<_>| {
            state.echoed.is_none_or(|echoed| echoed.at.since(measured.at) <= MEASURED_HOLDS)
        };
        let measured = state.measured.filter(holds).map(|measured| parts(measured, 0));
        let places =
            |parts: &Vec<f64>| axes.iter().zip(parts).map(|(axis, part)| axis.place(*part)).collect();
        let rounded = |parts: Vec<f64>| parts.iter().map(|part| (part * 1e3).round() / 1e3).collect();
        Self {
            positions_mm: measured.as_ref().or(commanded.as_ref()).map(places),
            commanded: commanded.map(rounded),
            measured: measured.map(rounded),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::from_to_args;
    use crate::time::MonoTime;

    fn heard(pulses: &[i32], at_s: f64) -> Option<Heard<PerAxis<Pulses>>> {
        let pulses: Vec<Pulses> = pulses.iter().copied().map(Pulses).collect();
        Some(Heard {
            value: PerAxis::new(&pulses),
            at: MonoTime::from_nanos(0) + Duration::from_secs_f64(at_s),
        })
    }

    #[test]
    fn a_seat_is_where_it_measured_until_it_acks_other_places_and_by_its_own_axes_of_the_frame() {
        let to = ["127.0.0.1:7408,offset=3".to_owned()];
        let config = from_to_args(&to, &[], 6).unwrap();
        let controller = &config.controllers[0];
        let stroke = controller.seat.own()[0].stroke_pulses();
        #[expect(clippy::cast_possible_truncation, reason = "a half of a stroke")]
        let half = (stroke / 2.0).round() as i32;
        let echoed = heard(&[7, 7, 7, half, 0, 0], 10.0);
        let mut state = ControllerState::default();
        (state.echoed, state.measured) = (echoed, heard(&[0, half, 0], 9.5));
        let both = SeatPlaces::of(controller, &state);
        assert_eq!(both.commanded, Some(vec![0.5, 0.0, 0.0]));
        assert_eq!(both.measured, Some(vec![0.0, 0.5, 0.0]));
        state.measured = heard(&[0, half, 0], 8.5);
        let moved = SeatPlaces::of(controller, &state);
        assert_eq!((moved.commanded, moved.measured), (Some(vec![0.5, 0.0, 0.0]), None));
        assert!(moved.positions_mm.unwrap()[0] > 10.0, "by what it acked");
        assert_eq!(SeatPlaces::of(controller, &ControllerState::default()), SeatPlaces::default());
    }
}
