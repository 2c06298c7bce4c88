use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::channel::ChannelId;
use crate::cue::{Source, read};
use crate::motion::{AxisUnit, SeatType};

fn timeline(text: &str) -> Timeline {
    Timeline::new(
        read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap_or_else(|f| panic!("{f}")),
    )
}

/// A cue of one axis through points in ms and mm.
fn through(interpolation: &str, points: &[(f64, f64)]) -> Timeline {
    let rows: String = points.iter().map(|(ms, mm)| format!("{ms},{mm}\n")).collect();
    timeline(&format!("# units: mm\n# interpolation: {interpolation}\ntime_ms,a1\n{rows}"))
}

fn at(timeline: &Timeline, seconds: f64) -> f64 {
    timeline.sample(ShowTime::from_secs_f64(seconds), &mut Hint::default())[0]
}

fn assert_near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

#[test]
fn a_spline_reproduces_a_cubic() {
    let cubic = |t: f64| 20.0 + 3.0 * t - 7.0 * t * t + 4.0 * t * t * t;
    let points: Vec<_> = [0.0, 0.3, 0.5, 1.1, 1.2, 2.0].iter().map(|t| (t * 1000.0, cubic(*t))).collect();
    let spline = through("spline", &points);
    for k in 0..=200 {
        let t = f64::from(k) * 0.01;
        assert_near(at(&spline, t), cubic(t), 1e-5);
    }
    assert_near(at(&through("spline", &points[..4]), 0.9), cubic(0.9), 1e-5);
}

#[test]
fn three_points_make_a_parabola_and_two_a_line() {
    let parabola = through("spline", &[(0.0, 1.0), (1000.0, 2.0), (3000.0, 10.0)]);
    assert_near(at(&parabola, 2.0), 5.0, 1e-6);
    assert_near(at(&parabola, 0.5), 1.25, 1e-6);
    assert_near(at(&through("spline", &[(0.0, 1.0), (1000.0, 2.0)]), 0.25), 1.25, 1e-12);
}

#[test]
fn linear_runs_straight_and_hold_stands() {
    let points = [(0.0, 1.0), (1000.0, 3.0), (2000.0, 2.0)];
    assert_eq!(at(&through("linear", &points), 0.75), 2.5);
    assert_eq!(at(&through("hold", &points), 0.999), 1.0);
    assert_eq!(at(&through("hold", &points), 1.0), 3.0);
}

#[test]
fn the_ends_hold_outside_the_cue() {
    for interpolation in ["spline", "monotone", "linear", "hold"] {
        let curve = through(interpolation, &[(0.0, 1.0), (10.0, 3.0), (20.0, 2.0), (30.0, 7.0)]);
        assert_eq!((at(&curve, -5.0), at(&curve, 0.0)), (1.0, 1.0));
        assert_eq!((at(&curve, 0.030), at(&curve, 9e9)), (7.0, 7.0));
        assert_eq!(curve.duration(), ShowTime::from_millis(30));
    }
}

#[test]
fn vibration_and_effects_hold_from_their_row_on() {
    let cue = timeline("time_ms,a1,v1_hz,v1_amp,fx_air,fx_water\n0,0,0,0,1,0\n10,0,20,0.01,0,1\n20,0,,,,0\n");
    let mut hint = Hint::default();
    let ms = ShowTime::from_millis;
    assert!(cue.has_vibration());
    let mut vibration =
        |time| Vibration::from(cue.samples(ms(time), &mut hint).of(ChannelId::Vibration.on(0)));
    assert_eq!(vibration(9), Vibration::default());
    assert_eq!(vibration(10), Vibration { hz: 20.0, amplitude: 0.01 });
    assert_eq!(vibration(99).hz, 20.0);
    assert_eq!(cue.effect_names(), ["air", "water"]);
    let set = |time, hint: &mut Hint| cue.effects(ms(time), hint);
    assert_eq!(set(-1, &mut hint), EffectSet::Named(0));
    assert_eq!(set(0, &mut hint), EffectSet::Named(0b01));
    assert_eq!(set(15, &mut hint), EffectSet::Named(0b10));
    assert_eq!(set(20, &mut hint), EffectSet::Named(0));
    assert!(!timeline("time_ms,a1,v1_hz,v1_amp\n0,0,20,0\n1,0,0,0.5\n").has_vibration());
}

#[test]
fn a_small_dip_is_held_and_told() {
    let dip = timeline("time_ms,a1\n0,0\n1000,0\n2000,0\n3000,0.02\n4000,0.1\n5000,0.2\n");
    let low = dip.extremes()[0].min;
    assert!(low.value < 0.0 && low.value > -0.001 && low.line == 3, "{low:?}");
    assert_eq!(at(&dip, low.at.as_secs_f64()), 0.0);
    let fit = dip.fits_stroke(0..1, None);
    assert_eq!(fit.faults, None);
    assert_eq!((fit.held.len(), fit.held[0].over, fit.held[0].line), (1, -low.value, low.line));
}

#[test]
fn a_large_dip_is_refused_with_time_and_value() {
    let dip = timeline("time_ms,a1\n0,0\n1000,0\n2000,0\n3000,1\n4000,1\n5000,1\n");
    let faults = dip.fits_stroke(0..1, None).faults.expect("a fault").to_string();
    let first = faults.lines().next().unwrap_or("");
    assert!(first.starts_with("t.csv:3:1: a1: the curve reaches -0.1283 at 00:01.577, outside"), "{first}");
    assert!(first.contains("the stroke, 0 to 1, by more than 0.001 of it"), "{first}");
    assert!(
        timeline("# interpolation: monotone\ntime_ms,a1\n0,0\n1000,0\n2000,1\n3000,1\n")
            .fits_stroke(0..1, None)
            .faults
            .is_none()
    );
}

#[test]
fn millimetres_are_held_against_the_seat() {
    let cue = through("linear", &[(0.0, 0.0), (1000.0, 150.0), (2000.0, 150.001)]);
    let faults = cue.fits_stroke(0..1, Some(&SeatType::bench3(1))).faults.expect("a fault");
    assert_eq!(faults.to_string(), "t.csv:6:1: a1: 150.001 is outside the stroke, 0 to 150 mm");
    assert!(cue.fits_stroke(0..1, None).faults.is_none());
    let wide = SeatType::bench3(1).with_each(|axis| axis.high = 200.0);
    assert!(cue.fits_stroke(0..1, Some(&wide)).faults.is_none());
}

#[test]
fn strange_spacing_gives_no_numbers_that_are_none() {
    let curve = through("spline", &[(0.0, 0.0), (1e-6, 1e5), (8e7, 0.0), (8.1e7, 1e5), (8.1e7 + 1e-6, 0.0)]);
    for k in 0..100 {
        assert!(at(&curve, f64::from(k) * 810.0).is_finite());
    }
    assert!(curve.fits_stroke(0..1, Some(&SeatType::bench3(1))).faults.is_some());
}

fn points() -> impl Strategy<Value = Vec<(f64, f64)>> {
    proptest::collection::vec((1_u32..3000, 0_u32..=1000), 2..30).prop_map(|steps| {
        let mut ms = 0.0;
        steps
            .iter()
            .enumerate()
            .map(|(i, (gap, value))| {
                ms += if i == 0 { 0.0 } else { f64::from(*gap) };
                (ms, f64::from(*value))
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn every_curve_passes_through_its_points(points in points(), kind in 0..4_usize) {
        let curve = through(["spline", "monotone", "linear", "hold"][kind], &points);
        for (ms, value) in &points {
            prop_assert_eq!(at(&curve, ms / 1000.0), *value);
        }
    }

    #[test]
    fn a_spline_has_no_kink_in_value_slope_or_bend(points in points()) {
        let curve = through("spline", &points);
        for row in 1..points.len() - 1 {
            let (before, after) = (curve.cubic(row - 1, 0).0, curve.cubic(row, 0).0);
            let (h0, h1) = ((points[row].0 - points[row - 1].0) / 1e3, (points[row + 1].0 - points[row].0) / 1e3);
            let end = before.iter().sum::<f64>();
            let slopes = ((before[1] + 2.0 * before[2] + 3.0 * before[3]) / h0, after[1] / h1);
            let bends = ((2.0 * before[2] + 6.0 * before[3]) / (h0 * h0), 2.0 * after[2] / (h1 * h1));
            let size = 1.0 + slopes.0.abs() + (bends.0.abs() + bends.1.abs()) * (h0 + h1);
            prop_assert!((end - after[0]).abs() < 1e-6 * (1.0 + end.abs()));
            prop_assert!((slopes.0 - slopes.1).abs() < 1e-4 * size, "{:?} {}", slopes, size);
            prop_assert!((bends.0 - bends.1).abs() < 1e-4 * (1.0 + bends.0.abs()), "{:?}", bends);
        }
    }

    #[test]
    fn a_monotone_curve_stays_between_its_neighbours(points in points()) {
        let curve = through("monotone", &points);
        for pair in points.windows(2) {
            let (low, high) = (pair[0].1.min(pair[1].1) - 1e-9, pair[0].1.max(pair[1].1) + 1e-9);
            for k in 0..=20 {
                let value = at(&curve, (pair[0].0 + (pair[1].0 - pair[0].0) * f64::from(k) / 20.0) / 1000.0);
                prop_assert!(low <= value && value <= high, "{value} in {pair:?}");
            }
        }
    }

    #[test]
    fn extremes_are_those_of_the_curve(points in points(), kind in 0..4_usize) {
        let curve = through(["spline", "monotone", "linear", "hold"][kind], &points);
        let found = curve.extremes()[0];
        let dense: Vec<f64> = (0..=20_000)
            .map(|k| at(&curve, curve.duration().as_secs_f64() * f64::from(k) / 20_000.0))
            .chain(points.iter().map(|point| point.1))
            .collect();
        let (low, high) = dense.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        let slack = 1e-9 + 1e-3 * (high - low);
        prop_assert!(found.min.value <= low + 1e-9 && found.min.value >= low - slack, "{found:?} {low}");
        prop_assert!(found.max.value >= high - 1e-9 && found.max.value <= high + slack, "{found:?} {high}");
        prop_assert!((at(&curve, found.max.at.as_secs_f64()) - found.max.value).abs() < 1e-3 * (1.0 + high - low));
    }

    #[test]
    fn a_hint_changes_nothing(points in points(), seeks in proptest::collection::vec(-1000_i64..100_000, 1..50)) {
        let curve = through("spline", &points);
        let mut hint = Hint::default();
        for ms in seeks {
            for step in 0..3 {
                let time = ShowTime::from_millis(ms + step * 7);
                prop_assert_eq!(curve.sample(time, &mut hint), curve.sample(time, &mut Hint::default()));
            }
        }
    }
}

#[test]
fn a_cue_in_millimetres_says_nothing_of_an_axis_that_is_measured_in_degrees() {
    let mut seat = SeatType::bench3(2);
    seat.each[1].unit = AxisUnit::Degree;
    let rows = "time_s,a1,a2\n0,0,0\n1,0,0\n2,0,0\n3,0,0\n";
    let faults =
        timeline(&format!("# units: mm\n{rows}")).fits_stroke(0..2, Some(&seat)).faults.expect("a fault");
    let text = faults.to_string();
    assert!(text.contains(": a2: is in mm, and this axis of seat bench3 is measured in deg"), "{text}");
    assert!(!text.contains("a1"), "{text}");
    assert!(timeline(rows).fits_stroke(0..2, Some(&seat)).faults.is_none(), "fractions suit every axis");
}

#[test]
fn a_cue_in_degrees_is_held_against_both_ends_of_the_range() {
    let mut seat = SeatType::bench3(2);
    let turns = &mut seat.each[1];
    (turns.unit, turns.low, turns.high) = (AxisUnit::Degree, -180.0, 90.0);
    let faults = |rows: &str| {
        let text = format!("# units: mm, deg\n# interpolation: linear\ntime_s,a1,a2\n{rows}");
        let fit = timeline(&text).fits_stroke(0..2, Some(&seat));
        fit.faults.map_or_else(String::new, |faults| faults.to_string())
    };
    assert_eq!(faults("0,0,-180\n1,150,90\n"), "");
    assert!(faults("0,0,-180.5\n1,0,0\n").ends_with("a2: -180.5 is outside the stroke, -180 to 90 deg"));
    assert!(faults("0,0,0\n1,0,91\n").ends_with("a2: 91 is outside the stroke, -180 to 90 deg"));
    assert!(faults("0,-1,0\n1,0,0\n").ends_with("a1: -1 is outside the stroke, 0 to 150 mm"));
}

#[test]
fn degrees_become_fractions_of_the_range_and_pulses_about_its_zero() {
    let mut seat = SeatType::bench3(1);
    (seat.each[0].unit, seat.each[0].low, seat.each[0].high) = (AxisUnit::Degree, -180.0, 90.0);
    (seat.each[0].lead, seat.each[0].pulses_per_rev) = (360.0, 36_000.0);
    (seat.each[0].park, seat.each[0].neutral) = (2.0 / 3.0, 2.0 / 3.0);
    let slot = timeline("# units: deg\ntime_s,a1\n0,0\n1,0\n").unit(0).slot(&seat, 0, Some(0));
    for (degrees, fraction, pulses) in [(-180.0, 0.0, -18_000), (0.0, 2.0 / 3.0, 0), (45.0, 5.0 / 6.0, 4_500)]
    {
        assert_near(slot.place(degrees), fraction, 1e-12);
        assert_eq!(slot.pulses(slot.place(degrees)).0, pulses, "{degrees} deg");
    }
    let half = slot.at_level(0.5);
    assert_eq!(half.pulses(half.place(-90.0)).0, -4_500, "half the way from its neutral pose");
    let (scale, shift) = half.scale();
    assert_near(-90.0 * scale + shift, half.place(-90.0), 1e-12);
}
