//! The courses of drives against the table of what was to be expected, and each refusal by itself.

use std::path::Path;
use std::sync::Arc;

use super::super::Digest;
use super::*;
use crate::cue::{Source, read};
use crate::motion::SeatType;
use crate::time::Rate;

fn timeline(text: &[u8]) -> Timeline {
    Timeline::new(read(Path::new("test.csv"), text, &Source::Native).unwrap())
}

fn bench_ride() -> Timeline {
    timeline(&std::fs::read("cues/bench-ride.csv").unwrap())
}

/// The bench seat with so many counts, or microsteps, a turn.
fn seat(counts: f64) -> SeatType {
    SeatType::bench3(3).with_each(|axis| axis.pulses_per_rev = counts)
}

fn silvermax(hz: f64) -> DriveTerms {
    let period = Duration::from_secs_f64(hz.recip());
    DriveTerms { family: DrivenBy::SilverMax, period, max_deviation: 0.5, shake: 0.0 }
}

fn sixpack(ms: f64, propdiv: Option<u8>, jump: Option<f64>) -> DriveTerms {
    let period = Duration::from_secs_f64(ms * 1e-3);
    DriveTerms { family: DrivenBy::SixPack { clock_divider: 3, propdiv, jump }, period, ..silvermax(1.0) }
}

fn prove(timeline: &Timeline, seat: SeatType, link: &DriveTerms) -> DriveProof {
    let digest = Digest::of(timeline.cue());
    let terms = Terms::of_seat(Arc::new(seat), timeline.axes(), digest, Rate::from_hz(100.0), 1.0);
    prove_driven(timeline, &terms, link)
}

fn messages(proof: &DriveProof) -> Vec<String> {
    proof.violations.iter().map(ToString::to_string).collect()
}

/// The greatest of a figure over all axes.
fn most(proof: &DriveProof, figure: impl Fn(&DriveAxisProof) -> f64) -> f64 {
    proof.axes.iter().map(figure).fold(0.0, f64::max)
}

fn jumps(axis: &DriveAxisProof) -> f64 {
    match axis.roughness {
        Roughness::Jumps(jump) => jump.value,
        Roughness::Segments { .. } => f64::NAN,
    }
}

/// The greatest step of acceleration from one segment to the next.
fn steps(axis: &DriveAxisProof, hz: f64) -> f64 {
    match axis.roughness {
        Roughness::Segments { jerk, .. } => jerk.value / hz,
        Roughness::Jumps(_) => f64::NAN,
    }
}

#[test]
fn segments_of_the_bench_ride_are_as_far_beside_it_and_as_rough_as_the_table_says() {
    let ride = bench_ride();
    let table = [
        (90.0, 0.006, 540.0),
        (62.0, 0.008, 780.0),
        (50.0, 0.01, 980.0),
        (31.0, 0.04, 1_530.0),
        (25.0, 0.08, 1_850.0),
        (20.0, 0.18, 2_200.0),
        (15.0, 0.485, 2_530.0),
        (10.0, 1.55, 1_980.0),
    ];
    for (hz, deviation, step) in table {
        let proof = prove(&ride, seat(4_000.0), &silvermax(hz));
        let met = most(&proof, |axis| axis.deviation.value);
        // Knots that fall between ticks are led to where the cue is at the tick: finer than the table at high rates.
        assert!(met < deviation + 0.005 && (hz > 40.0 || met > deviation - 0.005), "{hz} Hz: {met} mm");
        let rough = most(&proof, |axis| steps(axis, hz));
        assert!((rough / step - 1.0).abs() < 0.015, "{hz} Hz: {rough} mm/s²");
        assert_eq!(messages(&proof).is_empty(), hz > 10.0, "{hz} Hz: {:?}", messages(&proof));
    }
}

#[test]
fn three_axes_at_57600_baud_play_the_bench_ride_within_a_tenth_of_a_millimetre() {
    let proof = prove(&bench_ride(), seat(4_000.0), &silvermax(30.0));
    assert_eq!(proof.axes.len(), 3);
    assert!(most(&proof, |axis| axis.deviation.value) <= 0.1 && messages(&proof).is_empty(), "{proof:?}");
}

#[test]
fn targets_of_the_bench_ride_are_as_far_beside_it_and_jump_as_far_as_the_table_says() {
    // The table knows no greatest speed, which a divider of 3 puts out of the way, and no whole numbers: the loop comes no
    // nearer to its target than propdiv microsteps.
    let ride = bench_ride();
    let table = [(2.0, 3, 0.01, 4.0), (7.5, 6, 0.08, 68.0), (7.5, 12, 0.05, 38.0), (15.0, 12, 0.13, 84.0)];
    for (ms, propdiv, deviation, jump) in table {
        let proof = prove(&ride, seat(3_200.0), &sixpack(ms, Some(propdiv), Some(1e3)));
        let met = most(&proof, |axis| axis.deviation.value);
        let rounding = f64::from(propdiv) * 5.0 / 3_200.0;
        assert!((deviation..deviation + rounding + 0.01).contains(&met), "{ms} ms, {propdiv}: {met} mm");
        let jumped = most(&proof, jumps);
        assert!((jumped / jump - 1.0).abs() < 0.1, "{ms} ms, {propdiv}: {jumped} mm/s");
    }
}

#[test]
fn targets_that_are_held_at_the_end_of_the_stroke_cost_a_long_lag_some_tenths_of_a_millimetre() {
    let proof = prove(&bench_ride(), seat(3_200.0), &sixpack(15.0, Some(24), Some(1e3)));
    assert!(messages(&proof).is_empty(), "{:?}", messages(&proof));
    assert!(proof.axes[1].deviation.value < 0.1 && proof.axes[0].deviation.value > 0.3);
    assert!(proof.axes.iter().all(|axis| axis.lowest.value > -0.01 && jumps(axis) < 53.0));
}

/// A swing of axis 1 between two places of the stroke, in so many milliseconds there, rows of 20 ms.
fn swing(low: f64, high: f64, ms: u32) -> Timeline {
    let row = |index: u32| {
        let part = f64::from(index * 20) / f64::from(ms);
        let eased = (1.0 - (std::f64::consts::PI * part).cos()) / 2.0;
        format!("{},{:.6}\n", index * 20, low + (high - low) * eased)
    };
    let rows: String = (0..=2 * ms / 20).map(row).collect();
    timeline(format!("# units: fraction\ntime_ms,a1\n{rows}").as_bytes())
}

#[test]
fn a_seat_whose_turns_no_silvermax_counts_is_refused() {
    let proof = prove(&bench_ride(), seat(10_000.0), &silvermax(30.0));
    let said = messages(&proof);
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(proof.axes.is_empty() && said[0].contains("has 4000, 8000 or 16000 counts per turn"), "{said:?}");
}

#[test]
fn a_cue_beside_which_the_drive_would_be_too_far_is_refused_with_the_level_that_fits() {
    let ride = bench_ride();
    let said = messages(&prove(&ride, seat(4_000.0), &silvermax(10.0)));
    assert!(said[0].contains("1.55 mm off the cue at 00:06.150, 0.50 are allowed"), "{said:?}");
    assert!(said[0].contains("it fits at level 32%"), "{said:?}");
    let digest = Digest::of(ride.cue());
    let lower = Terms::of_seat(Arc::new(seat(4_000.0)), 3, digest, Rate::from_hz(100.0), 0.32);
    assert!(prove_driven(&ride, &lower, &silvermax(10.0)).violations.is_empty());
}

#[test]
fn what_passes_at_a_level_passes_below_it_and_is_no_farther_beside_the_cue() {
    let ride = bench_ride();
    let at = |seat: SeatType, level: f64, link: &DriveTerms| {
        let terms = Terms::of_seat(Arc::new(seat), 3, Digest::of(ride.cue()), Rate::from_hz(100.0), level);
        let proof = prove_driven(&ride, &terms, link);
        assert!(messages(&proof).is_empty(), "{level}: {:?}", messages(&proof));
        most(&proof, |axis| axis.deviation.value)
    };
    // What is whole, counts, ticks and propdiv, does not shrink with the level.
    for (counts, link, whole) in
        [(4_000.0, silvermax(20.0), 0.002), (3_200.0, sixpack(7.5, Some(12), Some(45.0)), 0.02)]
    {
        let full = at(seat(counts), 1.0, &link);
        for level in [0.9, 0.75, 0.5, 0.3, 0.1, 0.0] {
            let met = at(seat(counts), level, &link);
            assert!(met <= full * level + whole, "{level}: {met} of {full}");
        }
    }
}

#[test]
fn a_motor_that_would_jump_too_far_is_refused_at_what_its_seat_accelerates_in_a_period() {
    let said = messages(&prove(&bench_ride(), seat(3_200.0), &sixpack(7.5, Some(12), None)));
    assert!(said[0].contains("jump by 36 mm/s") && said[0].contains("22 are allowed (jump_mm_s"), "{said:?}");
    let allowed = prove(&bench_ride(), seat(3_200.0), &sixpack(7.5, Some(12), Some(40.0)));
    assert!(messages(&allowed).is_empty(), "{:?}", messages(&allowed));
}

#[test]
fn where_nobody_sets_propdiv_it_is_that_of_the_seat_and_a_motor_that_cannot_follow_is_refused_by_name() {
    let ride = bench_ride();
    let auto = most(&prove(&ride, seat(3_200.0), &sixpack(7.5, None, Some(45.0))), jumps);
    let set = most(&prove(&ride, seat(3_200.0), &sixpack(7.5, Some(13), Some(45.0))), jumps);
    assert_eq!(auto, set, "240 mm/s, 7.5 ms and 45 mm/s ask for 40 ms");
    let family = DrivenBy::SixPack { clock_divider: 5, propdiv: None, jump: None };
    let said = messages(&prove(&ride, seat(3_200.0), &DriveTerms { family, ..sixpack(7.5, None, None) }));
    assert!(said[0].contains("240 mm/s of seat bench3 needs clock_divider 3 or less, it is 5"), "{said:?}");
    let said = messages(&prove(&ride, seat(3_200.0), &sixpack(7.5, None, Some(1.0))));
    assert!(
        said[0].contains("no propdiv lets a motor at 240 mm/s jump by no more than 1.0 mm/s"),
        "{said:?}"
    );
}

#[test]
fn the_rate_that_fits_is_the_next_that_is_not_refused() {
    let ride = bench_ride();
    let fits = |seat: SeatType, most: f64| {
        let (link, digest) = (silvermax(10.0), Digest::of(ride.cue()));
        let terms = Terms::of_seat(Arc::new(seat.clone()), 3, digest, Rate::from_hz(100.0), 1.0);
        rate_that_fits(&prove(&ride, seat, &link), &ride, &terms, &link, most)
    };
    let rate = fits(seat(4_000.0), 200.0).unwrap();
    assert!((11.0..20.0).contains(&rate), "{rate}");
    assert!(messages(&prove(&ride, seat(4_000.0), &silvermax(rate))).is_empty());
    assert_eq!(fits(seat(4_000.0), 10.9), None);
    assert_eq!(fits(seat(10_000.0), 200.0), None, "no rate makes a drive count otherwise");
}

#[test]
fn a_vibration_that_has_no_eight_slices_a_swing_is_refused_unless_its_level_is_0() {
    let ride = bench_ride();
    let shaken = |hz| messages(&prove(&ride, seat(4_000.0), &DriveTerms { shake: 1.0, ..silvermax(hz) }));
    let said = shaken(30.0);
    assert!(said.iter().any(|said| said.contains("v1_hz: vibration at 20.0 Hz at")), "{said:?}");
    assert!(!shaken(165.0).iter().any(|said| said.contains("too fast")), "{:?}", shaken(165.0));
    assert!(messages(&prove(&ride, seat(4_000.0), &silvermax(30.0))).is_empty());
}

#[test]
fn a_link_that_dies_at_any_knot_leaves_room_to_brake_or_the_cue_is_refused() {
    // At the top of the stroke it turns with all of its acceleration: no more than a brake would take.
    let turning = prove(&swing(0.0, 1.0, 1_100), seat(4_000.0), &silvermax(30.0));
    assert!(messages(&turning).is_empty(), "{:?}", messages(&turning));
    let weak = seat(4_000.0).with_each(|axis| axis.max_acceleration = 500.0);
    let said = messages(&prove(&swing(0.0, 1.0, 1_100), weak, &silvermax(30.0)));
    assert!(said.iter().any(|said| said.contains("if the link died at")), "{said:?}");
}

#[test]
fn a_cue_that_begins_and_ends_in_motion_is_led_in_and_out_within_the_limits() {
    let rows: String =
        (0..=100).map(|row| format!("{},{:.6}\n", row * 20, 0.2 + 0.005 * f64::from(row))).collect();
    let ramp = timeline(format!("# units: fraction\ntime_ms,a1\n{rows}").as_bytes());
    let proof = prove(&ramp, seat(4_000.0), &silvermax(30.0));
    assert!(messages(&proof).is_empty(), "{:?}", messages(&proof));
    assert!(most(&proof, |axis| axis.deviation.value) < 0.1, "{proof:?}");
}
