//! Lengths that look as if somebody had given metres where millimetres are read: a thousandth of what is meant, of which no limit
//! is broken.

use crate::config::Config;
use crate::cue::Unit;
use crate::motion::{AxisGeometry, AxisUnit, SeatAxis};
use crate::timeline::Timeline;

/// Of what seats are built, nothing is below these.
const LEAST_STROKE: f64 = 2.0;
const LEAST_LEAD: f64 = 0.1;
const LEAST_VELOCITY: f64 = 1.0;
const LEAST_ACCELERATION: f64 = 10.0;
const LEAST_JERK: f64 = 100.0;
/// A cue that uses less than this part of a stroke can hardly be felt.
const LEAST_PART: f64 = 1.0 / 200.0;
/// Millimetres in a metre.
const METRE: f64 = 1_000.0;

/// What is said of the seat types of a hall.
pub(super) fn of_hall(hall: &Config) -> Vec<String> {
    let said = |seat: &std::sync::Arc<crate::motion::SeatType>| {
        let small = seat.own().iter().find_map(|axis| Some(small(axis)).filter(|small| !small.is_empty()))?;
        let words = |factor: f64| {
            let word = |(key, value): &(&str, f64)| format!("{key} = {}", value * factor);
            small.iter().map(word).collect::<Vec<_>>().join(", ")
        };
        Some(format!(
            "[seat.{}]: {} is read as millimetres, and is little for a seat; if it was given in metres, write {}",
            seat.name,
            words(1.0),
            words(METRE)
        ))
    };
    hall.seats.iter().filter_map(said).collect()
}

fn small(axis: &AxisGeometry) -> Vec<(&'static str, f64)> {
    let all = [
        ("stroke_mm", axis.stroke(), LEAST_STROKE),
        ("lead_mm", axis.lead, LEAST_LEAD),
        ("max_velocity_mm_s", axis.max_velocity, LEAST_VELOCITY),
        ("max_acceleration_mm_s2", axis.max_acceleration, LEAST_ACCELERATION),
        ("max_jerk_mm_s3", axis.max_jerk, LEAST_JERK),
    ];
    let is_small = |(_, value, least): &(&str, f64, f64)| axis.unit == AxisUnit::Millimetre && value < least;
    all.into_iter().filter(is_small).map(|(key, value, _)| (key, value)).collect()
}

/// What is said of a cue in millimetres on the seats of its axes.
pub(super) fn of_cue(timeline: &Timeline, seats: &[SeatAxis]) -> Option<String> {
    let axes = timeline.extremes().iter().zip(seats).enumerate();
    let in_mm = axes.filter(|(axis, (_, seat))| {
        timeline.unit(*axis) == Unit::Millimetre && seat.geometry().unit == AxisUnit::Millimetre
    });
    let reach = |(_, (ends, seat)): (usize, (&crate::timeline::AxisExtremes, &SeatAxis))| {
        (ends.max.value.abs().max(ends.min.value.abs()), seat.geometry().stroke())
    };
    let (most, stroke) = in_mm.map(reach).max_by(|(one, _), (other, _)| one.total_cmp(other))?;
    if most == 0.0 || most >= stroke * LEAST_PART {
        return None;
    }
    // To a ten-thousandth: a curve through rows ends in more digits than they have.
    let most = (most * 1e4).round() / 1e4;
    Some(format!(
        "its positions are read as millimetres, and reach {most} mm of a stroke of {stroke} mm; if they were given in metres, which \
         would reach {} mm, write them in millimetres",
        most * METRE
    ))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::config::from_to_args;
    use crate::cue::{self, Source};
    use crate::motion::SeatType;

    fn said_of_cue(rows: &str) -> Option<String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cue.csv");
        std::fs::write(&path, format!("# units: mm\ntime_ms,a1\n{rows}")).unwrap();
        let timeline = Timeline::new(cue::load(&path, &Source::Native).unwrap());
        of_cue(&timeline, &[SeatAxis::new(&Arc::new(SeatType::bench3(3)), 0)])
    }

    #[test]
    fn a_cue_in_metres_is_named_with_both_readings_and_one_in_millimetres_is_not() {
        let said = said_of_cue("0,0\n1000,0.12\n2000,0\n").unwrap();
        assert!(
            said.contains("reach 0.12 mm of a stroke of 150 mm") && said.contains("would reach 120 mm"),
            "{said}"
        );
        assert_eq!(said_of_cue("0,0\n1000,120\n2000,0\n"), None);
        assert_eq!(said_of_cue("0,0\n1000,0\n"), None, "a cue that rests");
    }

    #[test]
    fn a_seat_in_metres_is_named_with_both_readings_and_one_in_millimetres_is_not() {
        let mut hall = from_to_args(&["127.0.0.1:9".to_owned()], &[], 1).unwrap();
        assert_eq!(of_hall(&hall), [""; 0]);
        let metres = SeatType::bench3(3).with_each(|axis| {
            (axis.high, axis.lead, axis.max_velocity) = (0.15, 0.005, 0.25);
        });
        hall.seats = vec![Arc::new(metres)];
        let [said] = &of_hall(&hall)[..] else { panic!("one") };
        assert!(
            said.contains("stroke_mm = 0.15, lead_mm = 0.005, max_velocity_mm_s = 0.25 is read"),
            "{said}"
        );
        assert!(said.ends_with("write stroke_mm = 150, lead_mm = 5, max_velocity_mm_s = 250"), "{said}");
    }
}
