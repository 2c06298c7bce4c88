use super::*;

fn at(text: &str, rate: FrameRate) -> Timecode {
    Timecode::parse(text, rate).expect("there is such a frame")
}

#[test]
fn every_label_of_a_day_is_read_back_as_the_frame_that_it_names() {
    for rate in FrameRate::ALL {
        let (mut next, mut left_out) = (0, 0);
        for second in 0..86_400_u32 {
            let part = |value: u32| u8::try_from(value).expect("below 60");
            let (hours, minutes, seconds) = (part(second / 3_600), part(second / 60 % 60), part(second % 60));
            // Where none is left out the frames of a second are as those of any other.
            if !rate.drops() && second % 60 > 1 {
                next += rate.labels();
                continue;
            }
            for frame in 0..rate.labels() {
                let label = Label { hours, minutes, seconds, frames: part(frame), drops: rate.drops() };
                match Timecode::of(label, rate) {
                    Ok(timecode) => {
                        assert_eq!(timecode.index(), next, "{rate}: {label}");
                        assert_eq!(timecode.label(), label, "{rate}");
                        next += 1;
                    }
                    Err(error) => {
                        assert_eq!(error, TimecodeError::LeftOut(label));
                        left_out += 1;
                    }
                }
            }
        }
        assert_eq!(next, rate.labels_of_a_day(), "{rate}");
        assert_eq!(left_out, if rate.drops() { 24 * 54 * 2 } else { 0 }, "{rate}");
    }
}

#[test]
fn drop_frame_leaves_out_two_labels_of_each_minute_but_every_tenth() {
    let rate = FrameRate::F29_97Drop;
    assert_eq!(at("00:00:59:29", rate).plus(1).to_string(), "00:01:00;02");
    assert_eq!(at("00:09:59:29", rate).plus(1).to_string(), "00:10:00;00");
    assert_eq!(at("00:01:00;02", FrameRate::F29_97).plus(-1).to_string(), "00:00:59;29");
    assert_eq!(at("01:00:00;00", rate).index(), 107_892);
}

#[test]
fn after_the_last_frame_of_a_day_comes_the_first() {
    for rate in FrameRate::ALL {
        let midnight = at("00:00:00:00", rate);
        let last = midnight.plus(-1);
        assert_eq!(last.index() + 1, rate.labels_of_a_day());
        assert_eq!(last.plus(1), midnight);
        assert_eq!((midnight.since(last), last.since(midnight)), (1, -1), "{rate}");
        assert_eq!(at("00:00:10:00", rate).since(at("23:59:50:00", rate)), i64::from(20 * rate.labels()));
    }
}

#[test]
fn media_time_goes_by_how_long_frames_last_and_not_by_their_labels() {
    let media = |text, rate| at(text, rate).media_since(at("01:00:00:00", rate)).as_nanos();
    assert_eq!(media("02:00:00:00", FrameRate::F24), 3_600_000_000_000);
    assert_eq!(media("02:00:00:00", FrameRate::F23_976), 3_603_600_000_000);
    assert_eq!(media("02:00:00:00", FrameRate::F29_97), 3_603_600_000_000);
    assert_eq!(media("02:00:00:00", FrameRate::F29_97Drop), 3_599_996_400_000);
    assert_eq!(media("00:59:59:24", FrameRate::F25), -40_000_000);
    assert_eq!(media("01:00:00:01", FrameRate::F30), 33_333_333);
    assert_eq!(media("00:59:59:29", FrameRate::F30), -33_333_333);
    assert_eq!(FrameRate::F25.quarters(7).as_nanos(), 70_000_000);
}

#[test]
fn what_is_no_timecode_is_refused_in_words() {
    let why = |text, rate| Timecode::parse(text, rate).expect_err(text).to_string();
    for text in [
        "",
        "1:2:3",
        "01:00:00:00:00",
        "01:00:0a:00",
        "01:00:00:-1",
        "+1:00:00:00",
        "01;00:00:00",
        "01:00:000:00",
    ] {
        assert_eq!(
            why(text, FrameRate::F24),
            format!("{text} is not a timecode; write HH:MM:SS:FF, such as 01:00:00:00")
        );
    }
    assert_eq!(why("24:00:00:00", FrameRate::F24), "24:00:00:00: 24 hours are outside 0..=23");
    assert_eq!(why("01:60:00:00", FrameRate::F24), "01:60:00:00: 60 minutes are outside 0..=59");
    assert_eq!(why("01:00:00:24", FrameRate::F23_976), "01:00:00:24: 24 frames are outside 0..=23");
    assert_eq!(
        why("00:01:00;01", FrameRate::F29_97),
        "00:01:00;01 does not exist: drop frame leaves out ;00 and ;01 of each minute but every tenth; take ;02"
    );
    assert_eq!(
        why("00:01:00;02", FrameRate::F25),
        "00:01:00;02 is drop frame, which there is at 29.97 frames a second alone; 25 is configured"
    );
    let rate = "26".parse::<FrameRate>().expect_err("no such rate").to_string();
    assert_eq!(rate, "26 is not a frame rate; take 23.976, 24, 25, 29.97 or 30");
    assert_eq!("29.97".parse::<FrameRate>(), Ok(FrameRate::F29_97));
}

#[test]
fn the_label_of_a_place_in_the_film_is_that_of_the_frame_which_is_shown_there() {
    for rate in FrameRate::ALL {
        let start = Timecode::parse("01:00:00:00", rate).expect("all rates have that");
        for frames in [0, 1, 1_799, 1_800, 17_982, 107_892, -1] {
            let begins = start.plus(frames).media_since(start).as_secs_f64();
            for within in [0.0, 0.5, 0.9] {
                let media = ShowTime::from_secs_f64(begins + within / rate.frames_per_second());
                assert_eq!(start.at_media(media), start.plus(frames), "{within} into {frames} of {rate}");
            }
        }
    }
}

proptest::proptest! {
    #[test]
    fn steps_forth_and_back_meet_again(rate in 0..6_usize, index in 0..2_592_000_i64, by in -3_000_000_i64..3_000_000) {
        let here = Timecode::at_index(FrameRate::ALL[rate], index);
        proptest::prop_assert_eq!(here.plus(by).plus(-by), here);
        let day = i64::from(here.rate().labels_of_a_day());
        proptest::prop_assert_eq!((here.plus(by).since(here) - by).rem_euclid(day), 0);
        proptest::prop_assert_eq!(Timecode::parse(&here.to_string(), here.rate()), Ok(here));
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in "\\PC{0,14}", rate in 0..6_usize) {
        let _ = Timecode::parse(&text, FrameRate::ALL[rate]);
    }

    #[test]
    fn no_label_makes_a_frame_that_has_another(parts in proptest::array::uniform4(0_u8..), drops: bool, rate in 0..6_usize) {
        let [hours, minutes, seconds, frames] = parts;
        let label = Label { hours, minutes, seconds, frames, drops };
        if let Ok(timecode) = Timecode::of(label, FrameRate::ALL[rate]) {
            proptest::prop_assert_eq!(timecode.label(), label);
        }
    }
}
