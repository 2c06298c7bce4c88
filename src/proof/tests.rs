//! The proof against every phase of the grid tried one by one, and each rule broken by itself.

use std::path::Path;
use std::time::Duration;

use proptest::prelude::*;

use super::*;
use crate::config::{Config, EffectLimit, from_to_args};
use crate::cue::{Source, read};
use crate::motion::Spacing;
use crate::timeline::Hint;

fn timeline(text: &str) -> Timeline {
    Timeline::new(read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
}

fn terms(timeline: &Timeline, seat: SeatType, hz: f64, level: f64) -> Terms {
    let digest = Digest::of(timeline.cue());
    Terms::of_seat(Arc::new(seat), timeline.axes(), digest, Rate::from_hz(hz), level)
}

/// The proof on the bench seat at 100 Hz and full level.
fn on_bench(text: &str) -> Proof {
    let timeline = timeline(text);
    let terms = terms(&timeline, SeatType::bench3(timeline.axes()), 100.0, 1.0);
    prove(&timeline, terms)
}

fn messages(proof: &Proof) -> Vec<String> {
    proof.violations.iter().map(ToString::to_string).collect()
}

/// The greatest velocity, change of velocity, acceleration and jerk of axis 1, in mm, over 100 phases of the grid: what
/// frames do, by nothing but the definition.
fn brute(timeline: &Timeline, seat: &SeatType, hz: f64, level: f64) -> [f64; 4] {
    let rate = Rate::from_hz(hz);
    let Spacing { n, m } = Spacing::at_rate(hz);
    let end = timeline.duration().as_nanos();
    let (mut worst, axis) = ([0.0_f64; 4], &seat.each[0]);
    // Where Times alternate, each phase is met with several arrangements of them, though not with each.
    let first_frames = if has_whole_periods(hz) { 1 } else { 3 };
    for (phase, first) in (0..100_u32).flat_map(|phase| (0..first_frames).map(move |first| (phase, first))) {
        let mut at = i64::from(phase) * i64::try_from(rate.period().as_nanos()).unwrap() / 100;
        let mut frame = first;
        let (mut times, mut places) = (Vec::new(), Vec::new());
        let mut hint = Hint::default();
        while at <= end {
            let value =
                timeline.sample(ShowTime::from_nanos(at), &mut hint)[0] * timeline.unit(0).to_stroke(axis);
            let scaled = axis.neutral + level * (value - axis.neutral);
            times.push(ShowTime::from_nanos(at).as_secs_f64());
            places.push(scaled.clamp(0.0, 1.0) * axis.stroke());
            at += i64::from(rate.time_ms(frame)) * 1_000_000;
            frame += 1;
        }
        let slope = |a: usize, b: usize| (places[b] - places[a]) / (times[b] - times[a]);
        let second =
            |a: usize, d: usize| (slope(a + d, a + 2 * d) - slope(a, a + d)) / (times[a + 2 * d] - times[a]);
        for a in 0..times.len() {
            if a + 1 < times.len() {
                worst[0] = worst[0].max(slope(a, a + 1).abs());
            }
            if a + 2 < times.len() {
                worst[1] = worst[1].max((slope(a + 1, a + 2) - slope(a, a + 1)).abs());
            }
            for d in [n, m] {
                if a + 2 * d < times.len() {
                    worst[2] = worst[2].max(2.0 * second(a, d).abs());
                }
                if a + 3 * d < times.len() {
                    let third = (second(a + d, d) - second(a, d)) / (times[a + 3 * d] - times[a]);
                    worst[3] = worst[3].max(6.0 * third.abs());
                }
            }
        }
    }
    worst
}

fn has_whole_periods(hz: f64) -> bool {
    Rate::from_hz(hz).period().subsec_nanos().is_multiple_of(1_000_000)
}

fn cue_text(interpolation: &str, rows: &[(u32, f64)]) -> String {
    let mut text = format!("# interpolation: {interpolation}\ntime_ms,a1\n");
    let mut time = 0;
    for (wait, value) in rows {
        text += &format!("{time},{value}\n");
        time += wait;
    }
    text
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 30, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_phase_of_the_grid_is_worse_than_the_proof_and_the_proof_is_no_worse_than_they(
        interpolation in prop::sample::select(vec!["spline", "monotone", "linear", "hold"]),
        hz in prop::sample::select(vec![50.0, 59.94, 60.0, 100.0, 144.0, 240.0, 600.0, 1000.0]),
        level in prop::sample::select(vec![1.0, 0.6]),
        neutral in 0.0..1.0_f64,
        regular in prop::option::of(prop::sample::select(vec![5_u32, 10, 20, 50])),
        rows in prop::collection::vec((5_u32..150, 0.0..1.0_f64), 8..25),
    ) {
        let rows: Vec<_> = rows.iter().map(|row| (regular.unwrap_or(row.0), row.1)).collect();
        let timeline = timeline(&cue_text(interpolation, &rows));
        let seat = SeatType::bench3(1).with_each(|axis| axis.neutral = neutral);
        let tried = brute(&timeline, &seat, hz, level);
        let proof = prove(&timeline, terms(&timeline, seat, hz, level));
        for (((what, proved), tried), most) in proof.axes[0].worst().iter().zip(tried).zip([1.01, 1.05, 1.05, 1.05]) {
            prop_assert!(proved.value >= tried * (1.0 - 1e-6) - 1e-6, "{what:?}: {} under {tried}", proved.value);
            prop_assert!(!has_whole_periods(hz) || proved.value <= tried * most + 1e-6, "{what:?}: {} far over {tried}", proved.value);
            let broken = proof.violations.iter().any(|v| matches!(v.breach, Breach::Motion { quantity, .. } if quantity == *what));
            prop_assert!(proof.more > 0 || broken == (proved.value > proved.limit * SLACK), "{what:?}");
        }
    }

    #[test]
    fn positions_are_those_of_the_curve_that_is_sent(
        interpolation in prop::sample::select(vec!["spline", "monotone", "linear", "hold"]),
        rows in prop::collection::vec((1_u32..150, 0.0..1.0_f64), 4..20),
    ) {
        let timeline = timeline(&cue_text(interpolation, &rows));
        let proof = prove(&timeline, terms(&timeline, SeatType::bench3(1), 100.0, 1.0));
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        let mut hint = Hint::default();
        for at in (0..=timeline.duration().as_nanos()).step_by(100_000) {
            let place = 150.0 * timeline.sample(ShowTime::from_nanos(at), &mut hint)[0];
            (low, high) = (low.min(place), high.max(place));
        }
        let axis = &proof.axes[0];
        prop_assert!(axis.lowest.value <= low + 1e-6 && axis.lowest.value >= low - 0.01 * 150.0);
        prop_assert!(axis.highest.value >= high - 1e-6 && axis.highest.value <= high + 0.01 * 150.0);
    }
}

#[test]
fn where_times_alternate_the_proof_of_a_smooth_cue_is_as_close() {
    for hz in [23.976, 60.0, 144.0, 600.0] {
        let ride = |row: u32| 0.5 + 0.2 * (f64::from(row) * 0.1).sin() + 0.1 * (f64::from(row) * 0.23).cos();
        let rows: Vec<_> = (0..100).map(|row| (25, ride(row))).collect();
        let timeline = timeline(&cue_text("spline", &rows));
        let tried = brute(&timeline, &SeatType::bench3(1), hz, 1.0);
        let proof = prove(&timeline, terms(&timeline, SeatType::bench3(1), hz, 1.0));
        for (((what, proved), tried), most) in
            proof.axes[0].worst().iter().zip(tried).zip([1.01, 1.05, 1.05, 1.05])
        {
            assert!(
                proved.value >= tried * (1.0 - 1e-6),
                "{hz} Hz: {what:?}: {} under {tried}",
                proved.value
            );
            assert!(proved.value <= tried * most, "{hz} Hz: {what:?}: {} far over {tried}", proved.value);
        }
    }
}

#[test]
fn a_curve_that_is_held_at_an_end_of_the_stroke_is_proved_as_it_is_held() {
    // Rises so steeply out of rest that it dips below 0 first, and is in mm, so that the slot holds it at a level too.
    let rows = "# units: mm\ntime_ms,a1\n0,0\n100,0\n200,0\n300,30\n400,60\n500,60\n600,60\n";
    let timeline = timeline(rows);
    assert!(timeline.extremes()[0].min.value < -1.0, "it dips");
    for level in [1.0, 0.7] {
        let tried = brute(&timeline, &SeatType::bench3(1), 100.0, level);
        let proof = prove(&timeline, terms(&timeline, SeatType::bench3(1), 100.0, level));
        for ((what, proved), tried) in proof.axes[0].worst().iter().zip(tried) {
            assert!(
                proved.value >= tried * (1.0 - 1e-6) && proved.value <= 1.05 * tried,
                "{what:?} {tried} {proved:?}"
            );
        }
        assert_eq!(proof.axes[0].lowest.value, 0.0);
    }
}

#[test]
fn a_cue_within_all_limits_passes_and_its_margins_are_told() {
    let proof = on_bench("time_s,a1\n0,0.2\n1,0.5\n2,0.8\n3,0.5\n");
    assert!(proof.passed(), "{:?}", messages(&proof));
    let axis = &proof.axes[0];
    assert!((axis.highest.value - 120.0).abs() < 2.0 && axis.velocity.margin() > 0.5, "{axis:?}");
    assert!((axis.velocity.limit, axis.jerk.limit) == (240.0, 60_000.0));
}

#[test]
fn a_jump_is_named_with_line_column_value_and_limit() {
    let proof = on_bench(
        "# interpolation: linear\ntime_ms,a1,a2\n0,0.5,0.1\n1000,0.5,0.1\n1100,0.5,0.5\n2000,0.5,0.5\n",
    );
    assert!(!proof.passed());
    let velocity = messages(&proof).into_iter().find(|text| text.contains("velocity")).unwrap();
    assert!(velocity.contains("a2: velocity 600.0 mm/s at 00:01."), "{velocity}");
    assert!(velocity.contains("is over 240.0, the limit of seat bench3"), "{velocity}");
    assert!(proof.violations.iter().all(|v| v.column == "a2"), "{:?}", messages(&proof));
}

/// Whoever wrote 900 would look for 250 in vain.
#[test]
fn a_limit_of_speed_that_is_the_controller_s_is_named_as_its_max_rpm() {
    let timeline = timeline("# interpolation: linear\ntime_ms,a1\n0,0.1\n1000,0.1\n1100,0.5\n2000,0.5\n");
    let seat = SeatType::bench3(1).with_each(|axis| axis.max_velocity = 900.0);
    let proof = prove(&timeline, terms(&timeline, seat, 100.0, 1.0));
    let velocity = messages(&proof).into_iter().find(|text| text.contains("velocity 600.0")).unwrap();
    assert!(velocity.contains("over 250.0, the limit of seat bench3 at 3000 rpm, its max_rpm"), "{velocity}");
}

#[test]
fn what_one_phase_of_the_grid_hides_is_found() {
    // Between the frames of a grid that begins with the cue nothing happens.
    let proof =
        on_bench("# interpolation: linear\ntime_ms,a1\n0,0.5\n1002,0.5\n1005,0.52\n1008,0.5\n2000,0.5\n");
    assert!(proof.axes[0].velocity.value > 240.0, "{:?}", proof.axes[0]);
}

#[test]
fn motion_that_one_distance_is_blind_to_shows_at_the_other() {
    // It repeats every 20 ms, which is the first distance at 100 Hz.
    let rows: Vec<_> = (0..100).map(|row| (10, if row % 2 == 0 { 0.49 } else { 0.51 })).collect();
    let proof = on_bench(&cue_text("spline", &rows));
    let axis = &proof.axes[0];
    assert!(axis.acceleration.value > 2.0 * axis.acceleration.limit, "{axis:?}");
    assert!(axis.jerk.value > 2.0 * axis.jerk.limit, "{axis:?}");
    assert!(axis.step.margin() < 0.0, "{axis:?}");
}

#[test]
fn a_lower_level_breaks_less() {
    let text = "# interpolation: linear\ntime_ms,a1\n0,0.2\n1000,0.2\n2000,0.2\n";
    let timeline = timeline(text);
    let full = terms(&timeline, SeatType::bench3(1), 100.0, 1.0);
    let proof = prove(&timeline, full.clone());
    assert!(proof.covers(&full));
    assert!(proof.covers(&Terms { level: 0.4, ..full.clone() }));
    assert!(!proof.covers(&Terms { rate: Rate::from_hz(101.0), ..full.clone() }));
    assert!(!proof.covers(&Terms { cue: Digest([0; 32]), ..full.clone() }));
    let low = prove(&timeline, Terms { level: 0.4, ..full.clone() });
    assert!(!low.covers(&full), "what is proved at 40 % is not proved at 100 %");
    let other = SeatType::bench3(1).with_each(|axis| axis.max_jerk = 50_000.0);
    assert!(!proof.covers(&terms(&timeline, other, 100.0, 1.0)));
}

#[test]
fn vibration_must_stay_inside_the_stroke_between_rows_too() {
    // 4 mm about a parabola from 15 mm down to 3.75 mm and back.
    let rows = "time_s,a1,v1_hz,v1_amp\n0,0.1,0,0\n1,0.025,2,{}\n2,0.1,0,0\n3,0.1,0,0\n";
    let shake = |amplitude: &str| on_bench(&rows.replace("{}", amplitude));
    let proof = shake("0.02");
    assert!(proof.passed(), "{:?}", messages(&proof));
    let lowest = proof.axes[0].lowest_shaken.unwrap();
    assert!(lowest.value > 0.0 && lowest.value < 0.8, "{lowest:?}");
    let proof = shake("0.03");
    let [message] = &messages(&proof)[..] else { panic!("{:?}", messages(&proof)) };
    assert!(message.contains("v1_amp: vibration of 4.500 mm about 3."), "{message}");
    assert!(message.contains("leaves the stroke of seat bench3, 0 to 150 mm"), "{message}");
}

/// A cue of one axis in mm on the bench seat: it stands, then runs straight up to `top` at that speed, and ends there.
fn ends_at(top: f64, mm_s: f64) -> Proof {
    // An S-curve of half a second out of rest, and on from there.
    let speed = |t: f64| {
        let u = (t / 0.5).clamp(0.0, 1.0);
        mm_s * u * u * u * (10.0 + u * (6.0 * u - 15.0))
    };
    let mut text = "# units: mm\ntime_ms,a1\n".to_owned();
    let mut way = vec![0.0];
    for row in 1..=1_000 {
        let t = f64::from(row) * 1e-3;
        way.push(way[way.len() - 1] + 1e-3 * speed(t - 0.1));
    }
    let from = top - way[1_000];
    for row in (0..=1_000_usize).step_by(10) {
        text += &format!("{row},{:.9}\n", from + way[row]);
    }
    on_bench(&text)
}

#[test]
fn a_cue_that_ends_in_motion_where_the_stroke_has_no_room_for_a_stop_is_refused_and_says_how_much_is_missing()
{
    // From 140 mm/s with 3,000 mm/s² and 60,000 mm/s³ to rest takes some 6.6 mm, and 6.9 mm as it is asked for.
    let proof = ends_at(149.0, 140.0);
    let [message] = &messages(&proof)[..] else { panic!("{:?}", messages(&proof)) };
    assert!(
        message.contains("a1: the cue ends at 00:01.000 in motion, 140.0 mm/s at 149.000 mm"),
        "{message}"
    );
    assert!(
        message.contains("needs 5.8") && message.contains("mm more than the stroke, 0 to 150 mm"),
        "{message}"
    );
    assert!(matches!(proof.violations[0].place, Place::Text { line: 103, .. }), "{:?}", proof.violations[0]);
    assert!(ends_at(141.0, 140.0).passed(), "with 9 mm left there is room");
}

#[test]
fn a_cue_that_ends_with_more_acceleration_than_its_last_window_shows_is_refused() {
    // Jerk of 58,000 mm/s³ for the last 60 ms: 3,480 mm/s² at the end, of which the last window, 20 ms before, sees 2,320.
    let text = |jerk: f64| {
        let mut text = "# units: mm\ntime_ms,a1\n".to_owned();
        for row in 0..=100 {
            let t = (f64::from(row) * 5e-3 - 0.44).max(0.0);
            text += &format!("{},{:.9}\n", row * 5, 20.0 + jerk * t * t * t / 6.0);
        }
        text
    };
    let proof = on_bench(&text(58_000.0));
    assert!(proof.axes[0].acceleration.margin() > 0.1, "the windows end too soon: {:?}", proof.axes[0]);
    // The first says that half a second is short for a ride.
    let [_, message] = &messages(&proof)[..] else { panic!("{:?}", messages(&proof)) };
    assert!(message.contains("the gentlest way to rest from there takes acceleration 3"), "{message}");
    assert!(on_bench(&text(40_000.0)).passed());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn room_to_rest_is_asked_for_to_a_tenth_of_a_millimetre(mm_s in 20.0..170.0_f64) {
        let (mut fits, mut fails) = (120.0, 150.0);
        for _ in 0..12 {
            let top = f64::midpoint(fits, fails);
            if ends_at(top, mm_s).passed() { fits = top } else { fails = top }
        }
        // What braking with all means takes, from the highest pace and with a little less than all: by steps.
        let (mut at, mut speed, mut pull) = (0.0, HURRY * mm_s, 0.0_f64);
        while speed > 0.0 {
            pull = (pull + 0.95 * 60_000.0 * 1e-6).min(0.95 * 3_000.0);
            speed -= pull * 1e-6;
            at += speed * 1e-6;
        }
        prop_assert!((150.0 - fits - at).abs() < 0.1, "{fits} {at}");
    }

    #[test]
    fn vibration_is_allowed_up_to_what_motion_leaves_of_its_limits_and_no_further(
        hz in 1.0..200.0_f64, mm_s in 0.0..200.0_f64,
    ) {
        let text = |amplitude: f64| {
            let end = 20.0 + mm_s * 0.4;
            format!(
                "# units: mm\n# interpolation: linear\ntime_s,a1,v1_hz,v1_amp\n0,20,0,0\n0.2,{},{hz},{amplitude}\n0.4,{end},0,0\n",
                20.0 + mm_s * 0.2
            )
        };
        let (mut passes, mut fails) = (0.0, 20.0);
        for _ in 0..40 {
            let middle = f64::midpoint(passes, fails);
            let found = on_bench(&text(middle));
            let shaken = |v: &Violation| matches!(v.breach, Breach::Shaken { .. });
            if found.violations.iter().any(shaken) { fails = middle } else { passes = middle }
        }
        // As a frame says it, in eighths of a millisecond.
        let turns = std::f64::consts::TAU * 8_000.0 / (8_000.0 / hz).round();
        let expected = ((250.0 - mm_s) / turns).min(9_806.65 / (turns * turns));
        // The sum may be over by 0.1 %.
        let slack = 1e-3 * (250.0 / turns).min(9_806.65 / (turns * turns)) + 1e-3 * expected;
        prop_assert!(passes <= 19.9 || expected >= 19.8);
        prop_assert!(passes > 19.9 || (passes - expected).abs() <= 2.5 * slack + 1e-3 * mm_s / turns, "{passes} {expected}");
    }
}

#[test]
fn thirty_millimetres_at_twenty_hertz_are_refused_wherever_they_fit_into_the_stroke() {
    let proof = on_bench("# units: mm\ntime_s,a1,v1_hz,v1_amp\n0,75,0,0\n1,75,20,30\n2,75,0,0\n3,75,0,0\n");
    let [message] = &messages(&proof)[..] else { panic!("{:?}", messages(&proof)) };
    assert!(
        message.contains("v1_amp: vibration of 30.000 mm at 20.0 Hz, 473741.0 mm/s² of acceleration"),
        "{message}"
    );
    assert!(
        message.contains("is over 9806.6 mm/s² in all, the limit of seat bench3, at 00:01.000"),
        "{message}"
    );
}

#[test]
fn a_seat_that_stands_more_vibration_says_so_and_no_drive_goes_beyond_its_own_speed() {
    let timeline = timeline("# units: mm\ntime_s,a1,v1_hz,v1_amp\n0,75,20,1.5\n1,75,20,1.5\n");
    let on = |seat: SeatType| prove(&timeline, terms(&timeline, seat, 100.0, 1.0));
    assert!(!on(SeatType::bench3(1)).passed(), "23,687 mm/s²");
    let hard = SeatType::bench3(1).with_each(|axis| axis.max_shaken_acceleration = Some(24_000.0));
    assert!(on(hard.clone()).passed(), "and 188 mm/s");
    let slow = hard.clone().with_each(|axis| axis.max_shaken_velocity = Some(180.0));
    assert!(
        messages(&on(slow))[0]
            .contains("188.5 mm/s of velocity, on motion of 0.0 mm/s is over 180.0 mm/s in all")
    );
    let held = hard.with_each(|axis| {
        (axis.max_velocity, axis.max_rpm) = (100.0, Some(2_000));
        axis.max_shaken_velocity = Some(900.0);
    });
    assert!(messages(&on(held))[0].contains("is over 166.7 mm/s in all"), "PA07");
}

fn hall(limit: EffectLimit) -> Config {
    let mut config = from_to_args(&["127.0.0.1:1".to_owned()], &[], 1).unwrap();
    config.effect_limits = vec![limit];
    config
}

fn air() -> EffectLimit {
    let window = Duration::from_secs(10);
    EffectLimit {
        name: "air".to_owned(),
        min_on: Duration::ZERO,
        max_on: None,
        max_duty: None,
        duty_window: window,
    }
}

fn with_effects(limit: EffectLimit, text: &str) -> Vec<String> {
    let timeline = timeline(text);
    let terms = Terms::of_hall(&hall(limit), Digest::of(timeline.cue()), Rate::from_hz(100.0), 1.0);
    messages(&prove(&timeline, terms))
}

#[test]
fn an_effect_that_is_on_for_whole_periods_is_on_for_as_long_in_frames() {
    for hz in [24.0, 30.0, 60.0, 72.0, 100.0, 144.0] {
        let second = Duration::from_secs(1);
        let config = hall(EffectLimit { min_on: second, max_on: Some(second), ..air() });
        let timeline = timeline("time_ms,a1,fx_air\n0,0.5,0\n1000,0.5,1\n2000,0.5,0\n3000,0.5,0\n");
        let terms = Terms::of_hall(&config, Digest::of(timeline.cue()), Rate::from_hz(hz), 1.0);
        assert_eq!(messages(&prove(&timeline, terms)), [""; 0], "{hz} Hz");
    }
}

#[test]
fn an_effect_is_on_long_enough_and_not_too_long_in_frames_too() {
    let text = "time_ms,a1,fx_air\n0,0.5,0\n1000,0.5,1\n1055,0.5,0\n2000,0.5,0\n";
    let at_least = |ms| EffectLimit { min_on: Duration::from_millis(ms), ..air() };
    let at_most = |ms| EffectLimit { max_on: Some(Duration::from_millis(ms)), ..air() };
    assert_eq!(with_effects(at_least(50), text), [""; 0]);
    let found = with_effects(at_least(55), text);
    assert_eq!(found.len(), 1, "five frames may be all of it: {found:?}");
    assert!(found[0].contains("fx_air: on at 00:01.000 for 55ms, which may be 50ms in frames"), "{found:?}");
    assert_eq!(with_effects(at_most(60), text), [""; 0]);
    assert_eq!(with_effects(at_most(55), text).len(), 1);
    let word = text.replace("fx_air", "io");
    assert_eq!(with_effects(at_least(55), &word).len(), 1, "air is Y01");
}

#[test]
fn the_duty_of_an_effect_is_that_of_its_busiest_window() {
    let text = "time_s,a1,fx_air\n0,0.5,0\n2,0.5,1\n5,0.5,0\n9,0.5,1\n12,0.5,0\n30,0.5,0\n";
    let duty = |max_duty| with_effects(EffectLimit { max_duty: Some(max_duty), ..air() }, text);
    assert_eq!(duty(0.6), [""; 0]);
    let found = duty(0.5);
    assert_eq!(found.len(), 1);
    assert!(found[0].contains("on for 60.0 % of the 10s from 00:02.000 on; at most 50.0 %"), "{found:?}");
}

#[test]
fn a_seat_faster_than_its_controller_and_frames_too_far_apart_are_named() {
    let timeline = timeline("time_s,a1\n0,0.5\n10,0.5\n");
    let seat = SeatType { max_interval_ms: 900, ..SeatType::bench3(1) };
    let seat = seat.with_each(|axis| axis.max_rpm = Some(2_000));
    let found = messages(&prove(&timeline, terms(&timeline, seat.clone(), 1.0, 1.0)));
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        found[0].contains("2000 rpm (PA07), 166.7 mm/s at a lead of 5 mm; seat bench3 goes up to 240 mm/s")
    );
    assert!(found[1].contains("PA0b = 900: frames of the show, of 1000 ms, are cut to 900 ms"), "{found:?}");
    let slower = seat.with_each(|axis| axis.max_velocity = 160.0);
    assert!(prove(&timeline, terms(&timeline, slower, 2.0, 1.0)).passed());
}

#[test]
fn a_cue_never_passes_for_faster_than_the_controllers_own_limit() {
    let timeline = timeline("# interpolation: linear\ntime_s,a1\n0,0\n0.5,1\n");
    let seat = SeatType::bench3(1).with_each(|axis| axis.max_velocity = 400.0);
    let proof = prove(&timeline, terms(&timeline, seat, 100.0, 1.0));
    assert_eq!(proof.axes[0].velocity.limit, 250.0, "3000 rpm at a lead of 5 mm");
    assert!(!proof.passed());
}

#[test]
fn seats_of_one_type_are_proved_once() {
    let timeline = timeline("time_s,a1,a2\n0,0.5,0.5\n10,0.5,0.5\n");
    let tos: Vec<String> = (1..=8).map(|port| format!("127.0.0.1:{port}")).collect();
    let config = from_to_args(&tos, &[], 2).unwrap();
    let terms = Terms::of_hall(&config, Digest::of(timeline.cue()), Rate::from_hz(100.0), 1.0);
    assert_eq!(prove(&timeline, terms).axes.len(), 2);
}

#[test]
fn a_cue_that_is_too_short_to_be_judged_does_not_pass_and_one_whose_times_may_be_seconds_is_told_so() {
    const SECONDS: &str = "; if its times are in seconds, name their column time_s";
    let ride = |step_ms: u32| {
        let rows = [0.0, 0.3, 0.5, 0.3, 0.0, 0.0].iter().zip(0_u32..);
        let rows: String = rows.map(|(at, row)| format!("{},{at}\n", row * step_ms)).collect();
        messages(&on_bench(&format!("# interpolation: monotone\ntime_ms,a1\n{rows}")))
    };
    // Up and down in less than a period: no two frames see it.
    for step_ms in [1, 10] {
        let told = ride(step_ms);
        assert!(told[0].contains(SECONDS), "{told:?}");
    }
    assert!(ride(100).iter().any(|told| told.contains(SECONDS)) && ride(1_000).is_empty());
    assert!(on_bench("time_ms,a1\n0,0.5\n10,0.5\n").passed(), "it does not move");
}
