//! What a measurement plays: a flat cue, and seats whose park pose is where they stand, so that there is nowhere to go.

use std::sync::Arc;

use crate::config::{Config, Controller, FanOut, FansOut as _, cue_axes};
use crate::cue::CueBuilder;
use crate::motion::{Pulses, SeatType};
use crate::time::ShowTime;
use crate::timeline::Timeline;

/// What the report calls the cue.
const NAME: &str = "hold";

/// The same hall with seats that park, and scale, where they stand: `places` has the positions of each controller's axes,
/// in the order of the controllers.
#[must_use]
pub(crate) fn held(config: &Config, places: &[Vec<Pulses>]) -> Config {
    let hold = |(controller, places): (&Controller, &Vec<Pulses>)| {
        let seat = standing(&controller.seat, places);
        // A slice is cut on this side of the wire; here all its axes rest.
        let axis_offset = match controller.connection.fan_out() {
            FanOut::Slice => 0,
            FanOut::Shared => controller.axis_offset,
        };
        Controller { seat: Arc::new(seat), axis_offset, ..controller.clone() }
    };
    let controllers: Vec<Controller> = config.controllers.iter().zip(places).map(hold).collect();
    let seats = controllers.iter().map(|controller| Arc::clone(&controller.seat)).collect();
    Config { seats, controllers, ..config.clone() }
}

fn standing(seat: &SeatType, places: &[Pulses]) -> SeatType {
    let mut seat = seat.clone();
    for (axis, place) in seat.each.iter_mut().zip(places) {
        axis.park = axis.fraction(*place);
        axis.neutral = axis.park;
    }
    seat
}

/// A cue that lasts for `seconds` and asks for nothing, with as many axes as the controllers take.
#[must_use]
pub(crate) fn cue(controllers: &[Controller], seconds: u32) -> Timeline {
    let lasts = ShowTime::from_millis(i64::from(seconds) * 1_000);
    Timeline::new(CueBuilder::flat(NAME, cue_axes(controllers), lasts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::from_to_args;
    use crate::drive::{Manner, lanes};

    /// The positions that frames to these controllers carry, which were read at `places`, whatever pose is asked for.
    fn sent(to: &[&str], places: &[Vec<Pulses>], asked: f64) -> Vec<Vec<i32>> {
        let to: Vec<String> = to.iter().map(ToString::to_string).collect();
        let config = held(&from_to_args(&to, &[], 12).unwrap(), places);
        let timeline = cue(&config.controllers, 2);
        assert_eq!(timeline.duration(), ShowTime::from_secs_f64(2.0));
        let mut lanes = lanes(&config, &timeline, Manner { level: 0.0, silent: false });
        let pulses = |lane: &mut crate::drive::Lane| {
            lane.hold();
            lane.window.slots().iter().map(|slot| slot.pulses(asked).0).collect()
        };
        lanes.iter_mut().map(pulses).collect()
    }

    #[test]
    fn every_frame_carries_the_places_that_were_read_to_the_pulse() {
        let places = vec![vec![Pulses(0), Pulses(123_457), Pulses(300_000)], vec![Pulses(7); 6]];
        let to = ["127.0.0.1:1,axes=3", "127.0.0.1:2,axes=6,offset=6"];
        for asked in [0.0, 0.4, 1.0] {
            let sent = sent(&to, &places, asked);
            assert_eq!(sent, [vec![0, 123_457, 300_000], vec![7; 6]], "{asked}");
        }
    }

    #[test]
    fn in_a_shared_frame_each_finds_its_own_places_at_its_offset() {
        let to = ["127.0.0.1:1,axes=2,fan_out=shared", "127.0.0.1:2,axes=1,offset=2,fan_out=shared"];
        let places = vec![vec![Pulses(10), Pulses(20)], vec![Pulses(30)]];
        assert_eq!(sent(&to, &places, 1.0), [[10, 20, 30], [10, 20, 30]]);
    }

    #[test]
    fn every_place_of_a_stroke_survives_the_way_through_fractions() {
        let seat = SeatType::bench3(1).with_each(|axis| (axis.high, axis.lead) = (149.7, 4.9));
        for pulses in (0..=305_510).step_by(7) {
            let park = standing(&seat, &[Pulses(pulses)]).each[0].park;
            assert_eq!(seat.each[0].pulses(park), Pulses(pulses));
        }
    }
}
