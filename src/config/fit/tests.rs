use std::path::Path;

use super::*;
use crate::config::from_to_args;
use crate::cue::{self, Source};

fn cue(header: &str, row: &str) -> Timeline {
    let text = format!("time_s,{header}\n0,{row}\n1,{row}\n");
    Timeline::new(cue::read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
}

fn misfits(targets: &[&str], header: &str, row: &str) -> Vec<String> {
    let timeline = cue(header, row);
    let targets: Vec<String> = targets.iter().map(|target| format!("127.0.0.1:{target}")).collect();
    let config = from_to_args(&targets, &[], timeline.axes()).unwrap();
    config.misfits(&timeline).iter().map(ToString::to_string).collect()
}

#[test]
fn an_axis_that_no_controller_takes_is_named() {
    let found = misfits(&["1,axes=1", "2,axes=1,offset=2"], "a1,a2,a3", "0,0,0");
    assert_eq!(found.len(), 1);
    assert!(found[0].starts_with("a2: no controller takes this axis"), "{found:?}");
    let found = misfits(&["1,axes=3"], "a1,a2,a3,a4,a5,a6", "0,0,0,0,0,0");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("a4 to a6: no controller takes these axes"), "{found:?}");
    assert!(found[0].ends_with("`kinocue edit axes CUE 1-3 -o OUT` leaves them out"), "{found:?}");
}

#[test]
fn an_effect_without_an_output_is_named_with_its_likeness() {
    let found = misfits(&["1"], "a1,fx_watter,fx_air", "0,1,1");
    assert_eq!(found.len(), 1);
    assert!(found[0].starts_with("fx_watter: unknown effect"), "{found:?}");
    assert!(found[0].ends_with("did you mean water?"), "{found:?}");
}

#[test]
fn vibration_that_a_seat_type_leaves_out_is_refused_nowhere_on_it() {
    let timeline = cue("a1,a2,v2_hz,v2_amp", "0,0,20,0.9");
    for target in ["1,dialect=mbox", "1,axes=10", "1"] {
        let mut config = from_to_args(&[format!("127.0.0.1:{target}")], &[], 2).unwrap();
        assert!(config.unshaken_seats(&timeline).is_empty());
        assert!(!config.misfits(&timeline).is_empty(), "{target}");
        for controller in &mut config.controllers {
            let seat = SeatType { vibration: 0.0, ..(*controller.seat).clone() };
            controller.seat = Arc::new(seat);
        }
        assert!(config.misfits(&timeline).is_empty(), "{target}");
        assert_eq!(config.unshaken_seats(&timeline), ["bench3"]);
    }
}

#[test]
fn vibration_is_refused_where_a_frame_cannot_carry_it() {
    let (header, row) = ("a1,a2,v2_hz,v2_amp", "0,0,20,0.01");
    assert!(misfits(&["1"], header, row).is_empty());
    assert!(
        misfits(&["1,dialect=mbox"], header, row)[0].starts_with("v2_hz: vibration cannot be sent to c1")
    );
    assert!(misfits(&["1,axes=1,dialect=mbox", "2,axes=1,offset=1"], header, row).is_empty());
    assert!(misfits(&["1,axes=10"], header, row)[0].ends_with("carry 10 axes, over 6"));
    assert!(misfits(&["1,axes=6"], header, row).is_empty());
    assert_eq!(misfits(&["1,axes=7"], header, row).len(), 1);
    assert!(misfits(&["1,axes=10"], header, "0,0,0,0").is_empty());
}

#[test]
fn a_level_is_held_to_what_a_controller_has_and_what_its_frames_can_carry() {
    let timeline = cue("a1,a2,v2_hz,v2_amp,dac1", "0,0,20,0.01,0.75");
    let targets = ["127.0.0.1:1,axes=1", "127.0.0.1:2,axes=1,offset=1"].map(str::to_owned);
    let hall = |at_most: [[f64; 2]; 2]| {
        let mut config = from_to_args(&targets, &[], 2).unwrap();
        config.controllers.iter_mut().zip(at_most).for_each(|(one, most)| one.at_most = most);
        config
    };
    assert!(hall([[0.75, 0.0], [0.0, 1.0]]).misfits(&timeline).is_empty());
    for (at_most, text) in [
        (
            [[0.5, 0.0], [0.0; 2]],
            "dac1: the level of 0.75 at 00:00.000 is over 0.5, the highest that c1 allows",
        ),
        (
            [[1.0; 2], [1.0; 2]],
            "dac1: this output cannot be set at c2, as its frames carry the vibration of axis 2",
        ),
        ([[0.0, 1.0]; 2], "dac1: no controller has this output"),
    ] {
        let found = hall(at_most).misfits(&timeline);
        let [misfit] = &found[..] else { panic!("told once: {found:?}") };
        assert!(misfit.to_string().starts_with(text) && misfit.column() == "dac1", "{misfit}");
    }
}

#[test]
fn a_swing_that_no_frame_can_say_is_refused_with_its_time_and_the_limit() {
    let shake = |amplitude: &str| {
        let text = format!("# units: mm\ntime_s,a1,v1_hz,v1_amp\n0,9,20,1\n1.5,9,20,{amplitude}\n2,9,0,99\n");
        let timeline =
            Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap());
        let targets = ["127.0.0.1:1".to_owned(), "127.0.0.1:2".to_owned()];
        from_to_args(&targets, &[], 1).unwrap().misfits(&timeline)
    };
    assert!(shake("32.7675").is_empty(), "65,535 pulses, and what has no frequency shakes nothing");
    let found = shake("32.768");
    let [misfit] = &found[..] else { panic!("told once for both seats: {found:?}") };
    assert_eq!(misfit.column(), "v1_amp");
    assert_eq!(
        misfit.to_string(),
        "v1_amp: the amplitude at 00:01.500 (32.768 mm, 65536 pulses, on seat bench3) is over 32.767 mm, 65535 \
         pulses, the most that a frame can carry; lower the amplitude"
    );
}

#[test]
fn a_swing_over_half_the_stroke_of_a_seat_is_refused() {
    let shake = |percent: f64| {
        let timeline = cue("a1,a2,v2_hz,v2_amp", &format!("0,0,20,{}", percent / 100.0));
        let targets = ["127.0.0.1:1,axes=1".to_owned(), "127.0.0.1:2,axes=1,offset=1".to_owned()];
        let mut config = from_to_args(&targets, &[], 2).unwrap();
        let coarse = SeatType::bench3(1).with_each(|axis| axis.pulses_per_rev = 1_000.0);
        config.controllers[1].seat = Arc::new(coarse);
        config.misfits(&timeline)
    };
    assert!(shake(50.0).is_empty());
    let found = shake(51.0);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(matches!(found[0], Misfit::AmplitudePastStroke { axis: 2, .. }), "{found:?}");
    let text = found[0].to_string();
    assert!(text.contains("76.500 mm, 15300 pulses"), "{text}");
    assert!(text.contains("is over 75.000 mm, 15000 pulses, half the stroke"), "{text}");
}

#[test]
fn each_seat_proves_the_stroke_of_its_own_axes() {
    let text = "# units: mm\ntime_s,a1,a2\n0,0,0\n1,100,160\n2,100,160\n3,100,160\n";
    let timeline = Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap());
    let targets = ["127.0.0.1:1,axes=1".to_owned(), "127.0.0.1:2,axes=1,offset=1".to_owned()];
    let mut config = from_to_args(&targets, &[], 2).unwrap();
    assert_eq!(config.fits_stroke(&timeline).faults.len(), 1);
    let longer = SeatType::bench3(1).with_each(|axis| axis.high = 200.0);
    config.controllers[1].seat = Arc::new(longer);
    assert!(config.fits_stroke(&timeline).faults.is_empty());
}
