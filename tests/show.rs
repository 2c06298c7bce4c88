//! Whole shows in virtual time: a cue goes in, datagrams come out.

use std::time::Duration;

use kinocue::harness::engine::{Ending, Mix};
use kinocue::harness::rt::Alarm;
use kinocue::harness::state::{self, Transition};
use kinocue::harness::time::{MonoTime, ShowTime};
use kinocue::harness::timeline::Hint;
use kinocue::harness::{Event, Frame, Played, Virtual, Worst, swell};
use kinocue::wire::Timing;

/// Within the limits where only pulses are seen.
fn assert_gentle(played: &Played) {
    assert_within(played.worst());
}

fn assert_within(worst: Worst) {
    let Worst { velocity, acceleration, jerk, step } = worst;
    assert!(velocity <= 1.01 && acceleration <= 1.01 && jerk <= 1.01 && step <= 1.01, "{worst:?}");
}

/// The pulses the cue itself asks of an axis at a show time.
fn pulses_of_cue(played: &Played, axis: usize, at: ShowTime) -> i32 {
    let pose = played.timeline.sample(at, &mut Hint::default());
    #[expect(clippy::cast_possible_truncation, reason = "300,000 at the most")]
    let pulses = (pose[axis] * 300_000.0).round() as i32;
    pulses
}

#[test]
fn a_show_joins_the_cue_follows_it_parks_and_closes_with_hold_frames() {
    let played = Virtual::new(swell(3, 6, 40.0, 0.4)).play();
    assert_eq!(played.ended.ending, Ending::Completed);
    assert_eq!(played.ended.missed, 0);
    assert_gentle(&played);
    let frames: Vec<_> = played.lane(0).collect();
    assert!(frames.iter().all(|frame| frame.request.time_ms == 10 && frame.bytes[4..6] == [0x14, 0x01]));
    assert!(frames.iter().zip(1..).all(|(frame, number)| frame.request.frame.0 == number));
    // From the end of the join to the end of the cue, frame k carries the cue one period after its tick.
    let joined = usize::try_from(played.join.as_nanos() / 10_000_000).unwrap() + 1;
    for (k, frame) in frames.iter().enumerate().take(600).skip(joined) {
        let at = ShowTime::from_millis(10 * (i64::try_from(k).unwrap() + 1));
        assert_eq!(frame.request.positions[1].0, pulses_of_cue(&played, 1, at), "frame {k}");
    }
    let at_rest = frames
        .iter()
        .rev()
        .take_while(|frame| frame.request.positions.iter().all(|axis| axis.0 == 0))
        .count();
    assert!(
        (8..14).contains(&at_rest),
        "the last pose of the way to park, and 70 ms of hold frames: {at_rest}"
    );
}

#[test]
fn a_cue_that_starts_and_ends_at_rest_in_the_park_pose_is_played_row_by_row() {
    let cue = "time_ms,a1\n0,0\n500,0\n1000,0.1\n1500,0.2\n2000,0.1\n2500,0\n3000,0\n";
    let played = Virtual::new(cue).play();
    assert_eq!(played.join, ShowTime::ZERO);
    assert_eq!(played.frames[99].request.positions[0].0, 30_000, "at 1 s the cue stands at a tenth");
    assert_eq!(played.frames.len(), 300 + 7);
    assert_gentle(&played);
}

/// Bytes that leave for a cue of two axes with vibration and an effect; written once by this test and read by a person.
const GOLDEN: &str = include_str!("golden/show.hex");

#[test]
fn the_bytes_of_a_small_show_are_those_on_record() {
    let cue = "time_ms,a1,a2,v2_hz,v2_amp,fx_water\n0,0,0,0,0,0\n200,0,0,0,0,0\n400,0.01,0.005,20,0.002,1\n\
               600,0.02,0.005,20,0.002,1\n800,0.01,0,0,0,0\n1000,0,0,0,0,0\n1200,0,0,0,0,0\n";
    let played = Virtual::new(cue).at_rate(20.0).play();
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let sent: Vec<String> = played.frames.iter().map(|frame| hex(&frame.bytes)).collect();
    let recorded: Vec<&str> = GOLDEN.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(sent, recorded, "sent:\n{}", sent.join("\n"));
}

#[test]
fn a_stop_before_the_first_frame_sends_none() {
    let played = Virtual::new(swell(1, 6, 40.0, 0.4)).with(0, Event::Leave).play();
    assert_eq!((played.ended.ending, played.ended.ticks), (Ending::Stopped, 0));
    assert!(played.frames.is_empty());
}

#[test]
fn parking_is_no_faster_than_50_mm_a_second_and_effects_are_off() {
    let cue = "time_ms,a1,fx_air\n0,0.8,1\n3000,0.8,1\n";
    let played = Virtual::new(cue).play();
    let at_end = played.frames.iter().position(|frame| frame.request.outputs == 0).unwrap();
    assert_eq!(at_end, 300, "air is on throughout the cue");
    let mm = played.positions_mm(0, 0);
    let fastest = mm[at_end..].windows(2).map(|pair| (pair[1] - pair[0]).abs() / 0.010).fold(0.0, f64::max);
    assert!(fastest <= 50.1, "{fastest} mm/s");
    assert_gentle(&played);
}

#[test]
fn at_any_rate_distance_and_time_agree() {
    for hz in [1.0, 23.976, 60.0, 600.0, 1000.0] {
        let played = Virtual::new(swell(1, 5, 60.0, 0.25)).at_rate(hz).play();
        let sum: u32 = played.lane(0).map(|frame| frame.request.time_ms).sum();
        let frames = u32::try_from(played.frames.len()).unwrap();
        assert!((f64::from(sum) - f64::from(frames) * 1000.0 / hz).abs() <= 1.0, "{hz} Hz: {sum} ms");
        if hz >= 60.0 {
            assert_gentle(&played);
        }
    }
}

#[test]
fn after_a_late_wakeup_one_frame_leaves_and_the_lag_is_taken_back_gently() {
    let smooth = Virtual::new(swell(1, 20, 60.0, 0.25)).play();
    let played =
        Virtual::new(swell(1, 20, 60.0, 0.25)).with(400, Event::Late(Duration::from_millis(35))).play();
    assert_eq!(played.ended.missed, 3);
    // The poses go on from the last one sent; Time stays one period.
    assert!(played.frames.iter().all(|frame| frame.request.time_ms == 10));
    assert_gentle(&played);
    let positions = |played: &Played, frame: usize| played.frames[frame].request.positions[0].0;
    let off = positions(&played, 400).abs_diff(positions(&smooth, 400));
    assert!(off < 10, "the pose after the gap is the next one, not {off} pulses further");
    let much_later = 2_000 - 60;
    assert_eq!(positions(&played, much_later - 3), positions(&smooth, much_later), "on the grid again");
    // No instant has two frames.
    assert!(played.frames.windows(2).all(|pair| pair[0].at < pair[1].at));
}

#[test]
fn a_tick_is_as_late_as_its_first_frame_left_and_as_it_was_woken_where_none_leaves() {
    let played = Virtual::new(swell(1, 6, 40.0, 0.4))
        .with(200, Event::Late(Duration::from_millis(3)))
        .with(300, Event::Alarm(Alarm::Leave(0)))
        .with(400, Event::Late(Duration::from_millis(4)))
        .play();
    assert!(played.frames.len() < 400, "the only seat is out");
    let late: Vec<_> = played.late_ns.iter().enumerate().filter(|(_, ns)| **ns > 0).collect();
    assert_eq!(late, [(200, &3_000_000), (400, &4_000_000)]);
}

#[test]
fn after_a_long_stall_the_seat_holds_and_then_joins_the_cue_where_the_film_is() {
    let smooth = Virtual::new(swell(1, 20, 60.0, 0.25)).play();
    let played =
        Virtual::new(swell(1, 20, 60.0, 0.25)).with(400, Event::Late(Duration::from_millis(800))).play();
    assert_eq!(played.ended.missed, 80);
    let held = played.frames[399].request.positions[0];
    assert_eq!([400, 401].map(|frame| played.frames[frame].request.positions[0]), [held; 2]);
    let positions = |played: &Played, frame: usize| played.frames[frame].request.positions[0].0;
    assert_eq!(positions(&played, 1_500 - 80), positions(&smooth, 1_500), "in time with the film again");
    // The stall itself is the controller's: it came to rest at the last pose. From there on all is gentle.
    assert_within(played.worst_from_rest(400, played.frames.len()));
}

#[test]
fn a_stall_upon_a_stall_never_lands_in_the_middle_of_a_join() {
    let played = Virtual::new(swell(1, 20, 60.0, 0.25))
        .with(400, Event::Late(Duration::from_millis(60)))
        .with(402, Event::Late(Duration::from_millis(700)))
        .play();
    assert_eq!(played.ended.missed, 76);
    assert_within(played.worst_from_rest(402, played.frames.len()));
}

#[test]
fn a_stop_in_the_last_ticks_of_a_moving_cue_waits_for_what_follows_it() {
    for at in 590..=602 {
        let mut show = Virtual::new(swell(1, 6, 60.0, 0.25)).with(at, Event::Leave);
        show.plays = 2;
        assert_gentle(&show.play());
    }
}

#[test]
fn many_small_gaps_end_in_a_join_that_never_stops_the_seat() {
    let mut show = Virtual::new(swell(1, 20, 60.0, 0.25));
    for gap in 0..8 {
        show = show.with(400 + gap, Event::Late(Duration::from_millis(10)));
    }
    let played = show.play();
    assert_eq!(played.ended.missed, 8);
    assert_gentle(&played);
}

#[test]
fn a_stop_parks_from_the_moving_cue_within_the_limits() {
    for at in [50, 170, 333, 400, 555] {
        let played = Virtual::new(swell(3, 20, 60.0, 0.25)).with(at, Event::Leave).play();
        assert_eq!(played.ended.ending, Ending::Stopped);
        assert_gentle(&played);
        let last = played.frames.last().unwrap();
        assert!(last.request.positions.iter().all(|pulses| pulses.0 == 0) && last.request.outputs == 0);
        assert!(played.frames.len() < usize::try_from(at).unwrap() + 500, "{} frames", played.frames.len());
    }
}

#[test]
fn a_planner_that_answers_late_is_given_more_time_and_the_seat_never_jumps() {
    let played = Virtual::new(swell(1, 20, 60.0, 0.25))
        .with(395, Event::SlowPlanner(25))
        .with(400, Event::Leave)
        .play();
    assert_eq!(played.ended.ending, Ending::Stopped);
    assert_gentle(&played);
    assert_eq!(played.frames.last().unwrap().request.positions[0].0, 0);
}

#[test]
fn a_loop_joins_the_beginning_from_the_end_without_parking() {
    let mut show = Virtual::new(swell(1, 8, 60.0, 0.25));
    show.plays = 2;
    let played = show.play();
    assert_eq!(played.ended.ending, Ending::Completed);
    assert_gentle(&played);
    let again = |frame: usize| played.frames[800 + frame].request.positions[0].0;
    let at = |frame: i64| pulses_of_cue(&played, 0, ShowTime::from_millis(10 * (frame + 1)));
    assert_eq!((again(500), again(700)), (at(500), at(700)));
    assert!(played.positions_mm(0, 0)[200..1500].iter().all(|mm| *mm > 5.0), "no parking in between");
}

#[test]
fn a_show_can_start_inside_the_cue() {
    let mut show = Virtual::new(swell(1, 20, 60.0, 0.25));
    show.start = ShowTime::from_millis(10_000);
    let played = show.play();
    assert_gentle(&played);
    let at = ShowTime::from_millis(10_000 + 5_010);
    assert_eq!(played.frames[500].request.positions[0].0, pulses_of_cue(&played, 0, at));
}

#[test]
fn absolute_time_counts_from_one_period_and_is_bridged_by_a_relative_frame_after_a_stall() {
    let mut show = Virtual::new(swell(1, 10, 60.0, 0.25)).with(300, Event::Late(Duration::from_millis(500)));
    show.timing = Timing::Absolute;
    let played = show.play();
    let times: Vec<(Timing, u32)> =
        played.frames.iter().map(|f| (f.request.timing, f.request.time_ms)).collect();
    assert_eq!(times[..2], [(Timing::Absolute, 10), (Timing::Absolute, 20)]);
    assert_eq!(
        times[299..303],
        [(Timing::Absolute, 3_000), (Timing::Relative, 10), (Timing::Absolute, 10), (Timing::Absolute, 20)]
    );
    assert_eq!(times.last(), Some(&(Timing::Relative, 10)), "whoever plays next starts afresh");
}

#[test]
fn slow_absolute_shows_start_with_a_hold_frame_because_the_first_time_is_cut_to_100_ms() {
    let mut show = Virtual::new(swell(1, 20, 60.0, 0.1)).at_rate(5.0);
    show.timing = Timing::Absolute;
    let played = show.play();
    assert_eq!((played.frames[0].request.time_ms, played.frames[0].request.positions[0].0), (200, 0));
}

#[test]
fn a_level_shrinks_the_motion_about_the_neutral_pose() {
    let mut show = Virtual::new(swell(1, 8, 60.0, 0.25));
    show.level = 0.5;
    let played = show.play();
    let full = pulses_of_cue(&played, 0, ShowTime::from_millis(5_010));
    assert!((played.frames[500].request.positions[0].0 - full / 2).abs() <= 1);
}

#[test]
fn a_show_that_is_paused_or_stopped_before_its_first_frame_can_be_parked() {
    for ask in [Transition::Pause, Transition::Stop] {
        let played = Virtual::new(swell(3, 6, 40.0, 0.4))
            .with(0, Event::Ask(ask))
            .with(300, Event::Ask(Transition::Clear))
            .with(310, Event::Alarm(Alarm::Event(state::Event::PositionsRead)))
            .with(320, Event::Ask(Transition::Park))
            .with(900, Event::Leave)
            .play();
        assert_eq!(played.ended.ending, Ending::Stopped, "{ask}: {:?}", played.news);
        assert!(played.frames.iter().all(|frame| frame.request.positions[0].0 == 0), "nothing has moved");
    }
}

/// Two seats of one hall, the second of which executes what it is sent a tenth of a second later.
fn one_led_ahead(cue: impl Into<String>) -> Virtual {
    let mut hall = Virtual::new(cue);
    hall.to.push("127.0.0.1:7409".to_owned());
    hall.leads = vec![Duration::ZERO, Duration::from_millis(100)];
    hall
}

#[test]
fn a_seat_that_is_led_ahead_gets_each_pose_of_the_cue_by_its_lead_before_the_others() {
    let cue = "time_ms,a1,v1_hz,v1_amp\n0,0,0,0\n500,0,0,0\n1000,0.1,20,0.002\n1500,0.2,20,0.002\n2000,0.1,0,0\n2500,0,0,0\n3000,0,0,0\n";
    let played = one_led_ahead(cue).play();
    assert_eq!(played.ended.ending, Ending::Completed);
    let [own, ahead] = [0, 1].map(|lane| played.lane(lane).collect::<Vec<_>>());
    // Ten frames of lead before the cue; after it seven that hold, and ten more, as the one that is led executes them so much later.
    assert_eq!((own.len(), ahead.len()), (310 + 17, 310 + 17));
    for (k, frame) in own.iter().enumerate().skip(10) {
        let sooner = ahead[k - 10];
        assert_eq!(frame.request.positions[0], sooner.request.positions[0], "frame {k}");
        if k < 310 {
            assert_eq!(frame.request.vibration, sooner.request.vibration, "frame {k}");
        }
    }
    assert!(own.iter().any(|frame| frame.request.vibration.is_some_and(|axes| axes[0].amplitude > 0)));
    assert_eq!(own[109].request.positions[0].0, 30_000, "at 1 s the cue stands at a tenth");
}

/// Begins and ends at rest at half of the stroke.
fn gentle_ride() -> String {
    let row = |ms: i32| {
        let t = f64::from(ms) / 1e3;
        let swell = (std::f64::consts::PI * t / 20.0).sin().powi(2);
        format!("{ms},{:.6}\n", 0.5 + 0.3 * swell * (std::f64::consts::TAU * 0.25 * t).sin())
    };
    (0..=1_000).fold("time_ms,a1\n".to_owned(), |text, n| text + &row(20 * n))
}

#[test]
fn seats_that_are_led_ahead_keep_the_limits_through_stops_pauses_seeks_and_late_ticks() {
    let seek = Event::Seek(ShowTime::from_millis(12_000));
    let late = Event::Late(Duration::from_millis(35));
    let gap = Event::Late(Duration::from_millis(200));
    let [pause, resume] = [Transition::Pause, Transition::Resume].map(Event::Ask);
    let scripts: [&[(u64, Event)]; 5] = [
        &[],
        &[(400, seek)],
        &[(600, late), (900, gap)],
        &[(800, pause), (1100, resume)],
        &[(850, Event::Stop), (1200, Event::Leave)],
    ];
    for script in scripts {
        let mut hall = one_led_ahead(gentle_ride());
        hall.script = script.to_vec();
        let played = hall.play();
        for lane in 0..2 {
            assert_within(played.worst_of_lane(lane, 0..played.lane(lane).count()));
            assert_eq!(played.clamps[lane].clamps, 0, "{script:?}, lane {lane}");
        }
    }
}

/// Three seats that may get one datagram together, by a code that no single frame has.
fn together(cue: impl Into<String>) -> Virtual {
    let to = (1..4).map(|seat| format!("127.0.0.{seat}:7408")).collect();
    Virtual { to, together: true, ..Virtual::new(cue) }
}

fn is_one(frame: &Frame) -> bool {
    frame.bytes[8..10] == [0, 0xff]
}

/// How many of the frames that left before an instant were for all, and whether any from it on was.
fn ones(played: &Played, instant: MonoTime) -> (usize, bool) {
    let before = played.frames.iter().filter(|frame| frame.at < instant && is_one(frame)).count();
    (before, played.frames.iter().any(|frame| frame.at >= instant && is_one(frame)))
}

#[test]
fn a_lane_that_is_cut_off_gets_no_datagram_from_that_tick_on_whatever_permits_one_for_all() {
    let played = together(swell(3, 6, 40.0, 0.4)).with(300, Event::Alarm(Alarm::Cut(1))).play();
    let (cut_at, _) = played.happened[0];
    let (before, after) = ones(&played, cut_at);
    assert!(before > 3 * 100 && !after, "{before}");
    assert!(played.lane(1).all(|frame| frame.at < cut_at), "nothing reaches it");
    assert!(played.lane(1).count() > 290);
    assert!(played.lane(0).filter(|frame| frame.at >= cut_at).count() > 300);
    assert!(played.lane(0).zip(1..).all(|(frame, number)| frame.request.frame.0 == number));
}

#[test]
fn a_seat_that_is_out_gets_frames_of_its_own_to_park_even_where_all_are_there() {
    let out = Event::Mix(1, Mix { on: false, ..Mix::FULL });
    let played = together("time_ms,a1,a2,a3\n0,0,0,0\n6000,0,0,0\n").with(300, out).play();
    let (before, after) = ones(&played, played.happened[0].0);
    assert!(before > 3 * 250 && !after, "{before}");
}

#[test]
fn seats_that_go_together_are_led_through_what_they_would_be_alone_and_stop_each_by_its_own_frames() {
    let cue = swell(3, 6, 40.0, 0.4);
    let stops = |show: Virtual| show.with(200, Event::Stop).with(500, Event::Leave).play();
    let (one, each) = (together(cue.clone()), Virtual { together: false, ..together(cue) });
    let (one, each) = (stops(one), stops(each));
    let (before, after) = ones(&one, one.happened[0].0);
    assert!(before > 100 && !after, "{before}");
    assert!(!each.frames.iter().any(is_one));
    assert_eq!(one.frames.len(), each.frames.len());
    for (one, each) in one.frames.iter().zip(&each.frames) {
        assert_eq!(
            (one.lane, one.at, &one.bytes[..8], &one.bytes[12..]),
            (each.lane, each.at, &each.bytes[..8], &each.bytes[12..])
        );
    }
}

#[test]
fn a_pause_what_goes_on_after_it_and_the_way_to_park_are_each_seats_own_until_all_are_on_the_cue() {
    let played = together(swell(3, 8, 40.0, 0.4))
        .with(200, Event::Ask(Transition::Pause))
        .with(500, Event::Ask(Transition::Resume))
        .with(900, Event::Ask(Transition::Park))
        .play();
    let [paused, resumed, parked] = [0, 1, 2].map(|event| played.happened[event].0);
    let between = |from, to| played.frames.iter().filter(move |frame| frame.at >= from && frame.at < to);
    assert!(between(paused, resumed).count() > 3 && !between(paused, resumed).any(is_one));
    let mut goes_on = between(resumed, parked).map(is_one);
    assert!(!goes_on.next().expect("there is one") && goes_on.any(|one| one));
    assert!(!ones(&played, parked).1);
}
