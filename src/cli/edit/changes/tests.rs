use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::channel::{ChannelId, Sample};
use crate::motion::SeatType;
use crate::timeline::EffectSet;

fn timeline(text: &str) -> Timeline {
    Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).expect("a cue"))
}

/// Seats of these types, all of which take all axes of the cue.
fn seats<'t>(of: &'t Timeline, types: &[SeatType]) -> Seats<'t> {
    let types: Vec<_> = types.iter().cloned().map(Arc::new).collect();
    let on = |axis| {
        let mut all = types.iter().map(|seat| SeatAxis::new(seat, axis));
        (all.next().expect("a type"), all.collect())
    };
    Seats(of, (0..of.axes()).map(on).collect())
}

fn bench(of: &Timeline) -> Seats<'_> {
    seats(of, &[SeatType::bench3(of.axes())])
}

fn ms(ms: i64) -> ShowTime {
    ShowTime::from_millis(ms)
}

/// What is on at a time: vibration of each axis, outputs, and effects by name.
fn on(cue: &Timeline, at: ShowTime) -> (Vec<Sample>, BTreeSet<String>) {
    let samples = cue.samples(at, &mut Hint::default());
    let axes = (0..cue.axes()).map(|axis| samples.of(ChannelId::Vibration.on(axis)));
    let EffectSet::Named(on) = cue.effects(at, &mut Hint::default()) else { panic!("effects have names") };
    let names = cue.effect_names().iter().enumerate().filter(|(bit, _)| on >> bit & 1 == 1);
    (
        axes.chain([samples.of(ChannelId::Analogue.of_hall())]).collect(),
        names.map(|(_, name)| name.clone()).collect(),
    )
}

fn is_off(cue: &Timeline, at: ShowTime) -> bool {
    let (samples, effects) = on(cue, at);
    samples.iter().all(|sample| sample.0[1] == 0.0 && (sample.0[0] == 0.0)) && effects.is_empty()
}

/// How far the curves of two cues are apart at the most, between these times of the first.
fn apart(one: &Timeline, (from, until): (i64, i64), other: &Timeline, later_ms: i64) -> f64 {
    let differ = |us: i64| {
        let at = ShowTime::from_nanos(us * 1_000);
        let there = ShowTime::from_nanos(us * 1_000 + later_ms * 1_000_000);
        let both = [one.sample(at, &mut Hint::default()), other.sample(there, &mut Hint::default())];
        (0..one.axes()).map(|axis| (both[0][axis] - both[1][axis]).abs()).fold(0.0, f64::max)
    };
    (from * 1_000..=until * 1_000).step_by(1_370).map(differ).fold(0.0, f64::max)
}

fn made(edit: Edit) -> (Timeline, Laid) {
    let laid = edit.expect("an edit");
    (Timeline::new(laid.cue.clone()), laid)
}

/// Few rows, set by hand, in motion nearly everywhere.
const BY_HAND: &str = "# interpolation: monotone\ntime_ms,a1,a2\n0,0.5,0.2\n500,0.57,0.3\n1000,0.66,0.7\n1500,0.6,0.75\n2200,0.4,0.3\n3000,0.5,0.2\n";

#[test]
fn a_cut_or_a_fade_leaves_the_curve_that_it_does_not_touch_as_it_was() {
    for interpolation in ["monotone", "spline", "linear"] {
        let was = timeline(&BY_HAND.replace("monotone", interpolation));
        let seats = bench(&was);
        let cases: [(Edit, (i64, i64), i64); 4] = [
            (cut(&seats, Some(ms(730)), Some(ms(2650))), (730, 2650), -730),
            (cut(&seats, Some(ms(1_100)), Some(ms(1_400))), (1_100, 1_400), -1_100),
            (fade(&seats, ms(0), ms(1_900)), (0, 1_100), 0),
            (fade(&seats, ms(600), ms(1_700)), (600, 1_300), 0),
        ];
        for (number, (edit, span, later)) in cases.into_iter().enumerate() {
            let (after, laid) = made(edit);
            let off = apart(&was, span, &after, later);
            assert!(off < 1e-6, "{interpolation}, case {number}: {off:e}");
            assert!(laid.strays.is_empty(), "{interpolation}, case {number}: {:?}", laid.strays);
        }
    }
}

#[test]
fn a_curve_that_cannot_stay_as_it_was_is_told_with_how_much_and_where() {
    let was = timeline(BY_HAND);
    let (after, laid) = made(shift(&bench(&was), ms(2_000)));
    // It begins in motion, and now at rest.
    let off = apart(&was, (0, 500), &after, 2_000);
    assert!(off > 1e-3, "{off:e}");
    let [stray] = &laid.strays[..] else { panic!("{:?}", laid.strays) };
    assert!(stray.from >= ms(2_000) && stray.until <= ms(2_500) && stray.until > stray.from, "{stray:?}");
    assert!(stray.by > 0.9 * off && stray.by <= off * 1.01, "{stray:?} of {off}");
    assert!(apart(&was, (500, 3_000), &after, 2_000) < 1e-6);
}

const LIT: &str = "# interpolation: monotone\ntime_ms,a1,v1_hz,v1_amp,dac2,fx_air,fx_fog\n0,0.2,20,0.01,0.5,1,0\n1000,0.3,20,0.01,0.5,1,0\n2000,0.2,20,0.02,0,1,1\n";

#[test]
fn a_rest_before_a_cue_has_nothing_on() {
    let was = timeline(LIT);
    let (after, _) = made(shift(&bench(&was), ms(3_000)));
    assert!((0..3_000).step_by(10).all(|at| is_off(&after, ms(at))));
    for at in (0..=2_000).step_by(10) {
        assert_eq!(on(&after, ms(3_000 + at)), on(&was, ms(at)), "{at} ms");
    }
    assert_eq!(after.duration(), ms(5_000));
    assert!((0..3_000).step_by(10).all(|at| apart(&after, (at, at), &was, -at) < 1e-12), "it rests there");
}

#[test]
fn in_a_gap_everything_is_off_after_what_the_last_row_before_it_switched() {
    let was = [timeline(LIT), timeline(LIT)];
    for (gap, lasts) in [(4_000, 20), (30, 15)] {
        let (after, _) = made(join(&was, &bench(&was[0]), ms(gap)));
        let next = 2_000 + gap;
        let all = (0..next + 2_000).step_by(5).map(|at| (at, on(&after, ms(at))));
        for (at, now) in all {
            match at {
                ..2_000 => assert_eq!(now, on(&was[0], ms(at)), "{at} ms"),
                _ if at < 2_000 + lasts => assert_eq!(now, on(&was[0], ms(2_000)), "{at} ms"),
                _ if at < next => assert!(is_off(&after, ms(at)), "{at} ms: {now:?}"),
                _ => assert_eq!(now, on(&was[1], ms(at - next)), "{at} ms"),
            }
        }
        let mut text = Vec::new();
        cue::write_csv(after.cue(), &mut text).expect("each change has a row");
    }
}

#[test]
fn what_joins_without_a_gap_keeps_the_markers_at_its_ends() {
    let mut cues = [timeline(BY_HAND), timeline(BY_HAND)].map(Timeline::into_cue);
    for (cue, at) in cues.iter_mut().zip([3_000, 0]) {
        cue.mark(ms(at), "here").expect("it is in the cue");
    }
    let all = cues.map(Timeline::new);
    let (after, _) = made(join(&all, &bench(&all[0]), ms(0)));
    let at: Vec<_> = after.cue().markers().iter().map(|marker| marker.at).collect();
    assert_eq!(at, [ms(3_000), ms(3_000)]);
}

#[test]
fn a_fade_of_a_cue_that_dips_between_its_rows_has_no_row_outside_of_the_stroke() {
    let was = timeline("# units: mm\ntime_ms,a1\n0,0\n20,0\n40,0\n60,0\n80,0.5\n100,1\n120,1.5\n140,2\n");
    let seat = SeatType::bench3(1);
    let fits = |cue: &Timeline| cue.fits_stroke(0..1, Some(&seat)).faults;
    assert!(fits(&was).is_none() && was.extremes()[0].min.value < 0.0, "it dips");
    for fall in 60..=100 {
        let (after, _) = made(fade(&bench(&was), ms(0), ms(fall)));
        assert!(fits(&after).is_none(), "{fall} ms: {:?}", fits(&after));
    }
}

#[test]
fn what_two_types_of_seats_have_elsewhere_is_refused_by_name_and_what_they_have_alike_is_not() {
    let high = SeatType { name: "high".to_owned(), ..SeatType::bench3(2) }.with_each(|axis| {
        (axis.park, axis.neutral, axis.high) = (0.5, 0.6, 300.0);
    });
    let both = [SeatType::bench3(2), high];
    let was = timeline(BY_HAND);
    let of_both = seats(&was, &both);
    let told = |edit: Edit| edit.map(|_| ()).map_err(|error| error.to_string());
    assert_eq!(
        told(fade(&of_both, ms(100), ms(0))),
        Err("a1: the park pose of seat type bench3 is 0, of high 0.5; --seat NAME edits the cue for one of them".into())
    );
    assert!(told(scale(&of_both, 0.5, vec![1])).is_err_and(|told| told.starts_with("a2: the neutral pose")));
    assert_eq!(told(mirror(&of_both, vec![0, 1])), Ok(()), "the middle of either stroke is a half of it");
    let in_mm = timeline("# units: mm\ntime_ms,a1,a2\n0,10,10\n1000,20,20\n");
    let told = told(mirror(&seats(&in_mm, &both), vec![1]));
    assert!(told.is_err_and(|told| told.contains("bench3 is 75 mm, of high 150 mm")));
}

/// A cue with a vibration, an output and two effects that change at chance, or with none of them.
fn lanes() -> impl Strategy<Value = Timeline> {
    let row = (100..700_i64, 0.1..0.9_f64, 0..3_u8, 0..3_u8, any::<[bool; 2]>());
    let effect = prop::sample::select(vec!["air", "fog", "leg"]);
    (prop::collection::vec(row, 3..9), effect, any::<bool>()).prop_map(|(rows, effect, has_lanes)| {
        let mut text = "# interpolation: monotone\ntime_ms,a1".to_owned();
        if has_lanes {
            text += &format!(",v1_hz,v1_amp,dac1,fx_light,fx_{effect}");
        }
        let mut at = 0;
        for (step, place, shake, level, on) in rows {
            text += &format!("\n{at},{place}");
            if has_lanes {
                let [light, other] = on.map(u8::from);
                text += &format!(",20,0.00{shake},0.{level},{light},{other}");
            }
            at += step;
        }
        timeline(&text)
    })
}

proptest! {
    #[test]
    fn what_replaces_a_stretch_leaves_every_lane_and_the_curve_outside_of_it_as_they_were(
        was in lanes(), with in lanes(), begin in 0.0..1.0_f64, blend in 0.0..0.5_f64,
    ) {
        let millis = |cue: &Timeline| cue.duration().as_nanos() / 1_000_000;
        prop_assume!(millis(&with) <= millis(&was));
        let ratio = |part: f64, whole: i64| ShowTime::from_secs_f64(part * ms(whole).as_secs_f64());
        let begin = ratio(begin, millis(&was) - millis(&with)).as_nanos() / 1_000_000;
        let blend = ratio(blend, millis(&with));
        let end = begin + millis(&with);
        let (after, laid) = made(replace(&bench(&was), &with, ms(begin), blend));
        prop_assert_eq!(after.duration(), was.duration());
        for at in (0..=millis(&was)).step_by(3).chain([end]).filter(|at| !(begin..end).contains(at)) {
            prop_assert_eq!(on(&after, ms(at)), on(&was, ms(at)), "{} ms, of {} to {}", at, begin, end);
        }
        let off = apart(&was, (0, begin - 2), &after, 0).max(apart(&was, (end + 2, millis(&was)), &after, 0));
        prop_assert!(off < 1e-6 || !laid.strays.is_empty(), "{off:e} is not told");
    }
}
