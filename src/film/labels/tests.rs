use super::*;
use crate::harness::shown::{Luck, mono};

const START: &str = "01:00:00:00";

/// Labels of so many seconds at a rate, with noise; what the clock says at the end.
fn after(
    seconds: f64,
    rate: FrameRate,
    clock: &mut LabelClock,
    noise_s: f64,
    said: Option<u32>,
) -> Option<ShowTime> {
    let mut luck = Luck::new(3);
    let from = Timecode::parse("01:00:07:11", rate).expect("there is such a frame");
    let frames = (seconds * rate.frames_per_second()) as i64;
    let at = |frame: i64, luck: &mut Luck| {
        mono(5.0 + frame as f64 / rate.frames_per_second() + noise_s * luck.share())
    };
    (0..frames)
        .map(|frame| clock.media(at(frame, &mut luck), from.plus(frame).label(), 0, said))
        .last()
        .flatten()
}

fn clock(configured: Option<FrameRate>, sigma_s: f64) -> LabelClock {
    LabelClock::new(configured, START.parse().expect("it is a label"), sigma_s)
}

#[test]
fn each_rate_is_found_by_the_time_that_labels_take() {
    for rate in FrameRate::ALL {
        let mut clock = clock(None, 0.000_05);
        after(0.9, rate, &mut clock, 0.000_03, None);
        assert_eq!((clock.rate(), clock.is_sure), (Some(rate), true), "{rate}");
    }
}

#[test]
fn where_jitter_hides_the_rate_it_is_guessed_and_set_right_when_it_is_sure() {
    let mut clock = clock(None, 0.004);
    after(1.5, FrameRate::F23_976, &mut clock, 0.010, Some(24));
    assert_eq!((clock.rate(), clock.is_sure), (Some(FrameRate::F24), false));
    let mut clock = LabelClock::new(None, START.parse().expect("it is a label"), 0.004);
    after(100.0, FrameRate::F23_976, &mut clock, 0.010, Some(24));
    assert_eq!((clock.rate(), clock.is_sure), (Some(FrameRate::F23_976), true));
}

#[test]
fn a_configured_rate_places_the_first_label() {
    let mut of = clock(Some(FrameRate::F24), 0.0);
    let label = "01:00:10:12".parse().expect("it is a label");
    assert_eq!(of.media(mono(1.0), label, 4, None), Some(ShowTime::from_nanos(10_541_666_667)));
    assert_eq!(of.media(mono(1.1), label, 0, None), Some(ShowTime::from_millis(10_500)));
    let mut drops = clock(Some(FrameRate::F29_97), 0.0);
    let label = "01:01:00;02".parse().expect("it is a label");
    assert_eq!(drops.media(mono(1.0), label, 0, None), Some(ShowTime::from_nanos(60_060_000_000)));
    assert_eq!(drops.rate(), Some(FrameRate::F29_97Drop));
}

#[test]
fn labels_that_contradict_the_configured_rate_are_refused_in_words_until_they_do_not() {
    let mut of = clock(Some(FrameRate::F25), 0.0);
    assert_eq!(of.media(mono(1.0), "01:00:00:27".parse().expect("it is a label"), 0, None), None);
    let why = |clock: &LabelClock| clock.refused().expect("it is refused").to_string();
    assert_eq!(why(&of), "01:00:00:27: 27 frames are outside 0..=24");
    assert_eq!(of.media(mono(1.1), "01:00:00;05".parse().expect("it is a label"), 0, None), None);
    assert_eq!(
        why(&of),
        "01:00:00;05 is drop frame, which there is at 29.97 frames a second alone; 25 is configured"
    );
    assert!(of.media(mono(1.2), "01:00:00:05".parse().expect("it is a label"), 0, None).is_some());

    let mut of = clock(Some(FrameRate::F30), 0.0);
    assert_eq!(after(3.5, FrameRate::F24, &mut of, 0.0, None), None);
    assert_eq!(why(&of), "a second ends with frame 23, so there are 24 frames a second; 30 is configured");
    assert_eq!(after(3.5, FrameRate::F24, &mut of, 0.0, Some(24)), None);
    assert_eq!(why(&of), "the source says that it has 24 frames a second; 30 is configured");
    let mut of = clock(Some(FrameRate::F24), 0.0);
    assert!(after(3.5, FrameRate::F24, &mut of, 0.0, None).is_some());
}

#[test]
fn labels_of_no_rate_are_placed_nowhere() {
    let mut luck = Luck::new(1);
    let mut of = clock(None, 0.000_05);
    for n in 0..2_000 {
        let mut part = |below: usize| u8::try_from(luck.below(below)).expect("below 256");
        let label = Label {
            hours: part(256),
            minutes: part(256),
            seconds: part(256),
            frames: part(256),
            drops: false,
        };
        assert_eq!(of.media(mono(f64::from(n) * 0.04), label, 0, None), None);
    }
}

#[test]
fn what_is_refused_again_and_again_is_said_once() {
    let contradictions = [
        (FrameRate::F25, FrameRate::F30, None),
        (FrameRate::F24, FrameRate::F30, Some(30)),
        (FrameRate::F25, FrameRate::F29_97Drop, None),
    ];
    for (configured, rate, said) in contradictions {
        let mut of = clock(Some(configured), 0.0);
        after(3.0, rate, &mut of, 0.0, said);
        let mut all = vec![of.refused().cloned()];
        let from = Timecode::parse("01:00:10:11", rate).expect("there is such a frame");
        for frame in 0..300 {
            let at = mono(8.0 + f64::from(frame) / rate.frames_per_second());
            assert_eq!(of.media(at, from.plus(frame.into()).label(), 0, said), None);
            all.push(of.refused().cloned());
        }
        all.dedup();
        assert_eq!(all.len(), 1, "{configured} of {rate}: {all:?}");
        assert!(all[0].is_some());
    }
}
