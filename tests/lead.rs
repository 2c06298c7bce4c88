//! Shows that are led by hand, in virtual time: pause, stop, seek, levels, trim, seats out and in, controllers lost and
//! back. Whatever is done, what is sent stays within the limits of the seats.

use std::time::Duration;

use kinocue::harness::engine::{Ending, Mix, Unplanned};
use kinocue::harness::motion::MAX_AXES;
use kinocue::harness::rt::{Alarm, News};
use kinocue::harness::state::{self, Cause, Refusal, State, Transition, Trouble, Why};
use kinocue::harness::time::ShowTime;
use kinocue::harness::timeline::Hint;
use kinocue::harness::{Event, Frame, Played, Virtual, Worst, swell};
use kinocue::wire;

fn assert_within(worst: Worst) {
    let Worst { velocity, acceleration, jerk, step } = worst;
    assert!(velocity <= 1.01 && acceleration <= 1.01 && jerk <= 1.01 && step <= 1.01, "{worst:?}");
}

/// Twenty seconds, 60 mm to either side of the middle; a quarter of a turn a second is 94 mm/s.
fn ride() -> Virtual {
    Virtual::new(swell(3, 20, 60.0, 0.25))
}

/// The same with vibration and an effect that are on throughout.
fn ride_with_effects() -> Virtual {
    let motion = swell(1, 20, 60.0, 0.25);
    let mut rows = motion.lines();
    let head = rows.next().expect("there is a header");
    let rows: Vec<String> = rows.map(|row| format!("{row},20,0.01,1")).collect();
    Virtual::new(format!("{head},v1_hz,v1_amp,fx_air\n{}\n", rows.join("\n")))
}

fn refusal(news: &News) -> Option<Refusal> {
    match news {
        News::Refused(refusal) => Some(*refusal),
        News::Entered { .. } | News::Taken | News::NotLoaded(_) | News::Unplanned(_) => None,
        News::Started | News::CalledOff(_) => None,
    }
}

const fn unplanned(news: &News) -> Option<Unplanned> {
    match news {
        News::Unplanned(what) => Some(*what),
        News::Entered { .. } | News::Taken | News::NotLoaded(_) | News::Refused(_) => None,
        News::Started | News::CalledOff(_) => None,
    }
}

fn pulses(frame: &Frame) -> i32 {
    frame.request.positions[0].0
}

/// Where the cue puts the first axis, in pulses.
fn cue_at(played: &Played, ms: i64) -> i32 {
    let pose = played.timeline.sample(ShowTime::from_millis(ms), &mut Hint::default());
    #[expect(clippy::cast_possible_truncation, reason = "300,000 at the most")]
    let pulses = (pose[0] * 300_000.0).round() as i32;
    pulses
}

/// How many frames from `from` on move the seat.
fn moving(played: &Played, from: usize) -> usize {
    let frames: Vec<i32> = played.lane(0).map(pulses).collect();
    frames[from - 1..].windows(2).take_while(|pair| pair[0] != pair[1]).count()
}

#[test]
fn a_stop_slows_every_seat_from_the_next_frame_on_then_holds_for_70_ms_and_sends_no_more() {
    for hz in [50_u32, 100, 333, 1000] {
        for part in 0..20 {
            let at = hz * 4 + hz * part / 4;
            let (press, leave) = (u64::from(at), u64::from(at) + 2_000);
            let show = ride().at_rate(f64::from(hz));
            let played = show.with(press, Event::Stop).with(leave, Event::Leave).play();
            assert_eq!(played.ended.ending, Ending::Stopped);
            assert_within(played.worst());
            let count = usize::try_from(at).unwrap();
            let in_200_ms = usize::try_from(hz / 5).unwrap();
            let slowing = moving(&played, count);
            assert!(slowing <= in_200_ms, "{hz} Hz, {at}: {slowing} frames");
            let frames = played.lane(0).count();
            assert!(frames <= count + in_200_ms + 4, "{hz} Hz, {at}: {frames} frames");
            let rest = played.lane(0).skip(frames - 3);
            assert!(rest.map(pulses).all(|last| last == pulses(&played.frames[frames - 1])));
        }
    }
}

#[test]
fn the_first_frame_after_a_stop_is_slower_than_the_one_before() {
    let played = ride().with(500, Event::Stop).with(900, Event::Leave).play();
    let smooth = ride().play();
    let step =
        |played: &Played, frame: usize| pulses(&played.frames[frame]) - pulses(&played.frames[frame - 1]);
    assert!(step(&played, 500).abs() < step(&smooth, 500).abs(), "frame 500 is the first after the request");
}

#[test]
fn a_pause_tells_the_seats_for_70_ms_to_hold_and_then_nothing_and_resume_joins_the_film_where_it_waited() {
    let smooth = ride().play();
    let played =
        ride().with(600, Event::Ask(Transition::Pause)).with(1_000, Event::Ask(Transition::Resume)).play();
    assert_eq!(played.ended.ending, Ending::Completed);
    assert_within(played.worst());
    let slowing = moving(&played, 600);
    assert!((5..=20).contains(&slowing), "{slowing} frames");
    let frames: Vec<&Frame> = played.lane(0).collect();
    let quiet = frames.windows(2).position(|pair| pair[1].at.since(pair[0].at) > Duration::from_secs(3));
    let quiet = quiet.expect("nothing is sent for as long as the pause lasts");
    let rest = frames[..=quiet].iter().rev().take_while(|f| pulses(f) == pulses(frames[quiet])).count();
    assert!((7..=9).contains(&rest), "the last of the slowing holds as well: {rest}");
    assert!(frames.iter().all(|frame| frame.request.time_ms == 10), "none keeps those of the join waiting");
    // From the end on both shows send the same.
    let tail = |played: &Played| played.lane(0).rev_pulses(700);
    assert_eq!(tail(&played), tail(&smooth));
}

trait RevPulses {
    fn rev_pulses(self, count: usize) -> Vec<i32>;
}

impl<'a, I: Iterator<Item = &'a Frame>> RevPulses for I {
    fn rev_pulses(self, count: usize) -> Vec<i32> {
        let all: Vec<i32> = self.map(pulses).collect();
        all[all.len() - count..].to_vec()
    }
}

#[test]
fn a_seek_joins_the_cue_elsewhere_from_the_moving_seat() {
    for (at, to_s) in [(500, 12), (1_200, 3), (900, 9), (510, 19), (100, 10)] {
        let target = ShowTime::from_millis(to_s * 1_000);
        let played = ride().with(at, Event::Seek(target)).play();
        assert_eq!(played.ended.ending, Ending::Completed);
        assert_within(played.worst());
        // The film goes on there 20 ms after the request: some seconds later the seat is where the cue is.
        let later = usize::try_from(at).unwrap() + 403;
        if to_s < 15 {
            let (now, cue) = (pulses(&played.frames[later]), cue_at(&played, to_s * 1_000 + 4_010));
            assert_eq!(now, cue, "{at}, {to_s} s");
        }
    }
}

#[test]
fn a_seek_in_a_pause_moves_nothing_until_resume() {
    let target = ShowTime::from_millis(15_000);
    let played = ride()
        .with(600, Event::Ask(Transition::Pause))
        .with(700, Event::Seek(target))
        .with(800, Event::Ask(Transition::Resume))
        .play();
    assert_within(played.worst());
    let frames = played.lane(0).count();
    assert!(frames < 600 + 30 + 20 + 510 + 400, "{frames}: five seconds of film were left");
    // From when it is resumed on the film runs from there, to the tick.
    let (resumed, _) = played.happened[2];
    let later = |frame: &&Frame| frame.at.since(resumed) >= Duration::from_millis(3_500);
    let later = played.lane(0).find(later).expect("it goes on for five seconds");
    assert_eq!(pulses(later), cue_at(&played, 18_500));
}

#[test]
fn a_seek_in_a_hold_after_a_gap_or_overtaken_by_one_or_by_a_pause_is_done_all_the_same() {
    let (seek, slow) = (Event::Seek(ShowTime::from_millis(15_000)), Event::SlowPlanner(40));
    let late = Event::Late(Duration::from_millis(300));
    let (pause, resume) = (Event::Ask(Transition::Pause), Event::Ask(Transition::Resume));
    let shows = [
        ("in a hold", ride().with(590, slow).with(600, late).with(605, seek)),
        ("before a gap", ride().with(590, slow).with(600, seek).with(605, late)),
        ("before a pause", ride().with(590, slow).with(600, seek).with(605, pause).with(800, resume)),
    ];
    for (what, show) in shows {
        let played = show.play();
        assert_eq!(played.ended.ending, Ending::Completed, "{what}");
        let frames = played.lane(0).count();
        assert!(frames < 1_750, "{what}: {frames} frames, where five seconds of film were left");
    }
}

#[test]
fn a_park_out_of_a_pause_and_a_stop_out_of_a_park_are_gentle() {
    for stop_at in [700, 702, 710, 750, 800] {
        let played = ride()
            .with(600, Event::Ask(Transition::Pause))
            .with(690, Event::Ask(Transition::Park))
            .with(stop_at, Event::Stop)
            .with(stop_at + 90, Event::Ask(Transition::Park))
            .with(stop_at + 100, Event::Ask(Transition::Clear))
            .with(stop_at + 110, Event::Ask(Transition::Park))
            .with(stop_at + 120, Event::Alarm(Alarm::Event(state::Event::PositionsRead)))
            .with(stop_at + 130, Event::Ask(Transition::Park))
            .play();
        let refused: Vec<Why> = played.news.iter().filter_map(refusal).map(|refusal| refusal.why).collect();
        assert_eq!(
            refused,
            [Why::Latched, Why::PositionsNotRead],
            "a stop is latched, and nothing is taken on trust"
        );
        assert_within(played.worst());
        assert_eq!(pulses(played.frames.last().unwrap()), 0, "parked in the end");
    }
}

#[test]
fn a_stop_a_pause_and_a_park_take_effects_and_vibration_away_at_once() {
    for event in [Event::Stop, Event::Ask(Transition::Pause)] {
        let played = ride_with_effects().with(600, event).with(800, Event::Leave).play();
        assert_eq!(played.frames[599].request.outputs, 1);
        assert_eq!(played.frames[600].request.outputs, 0);
        let vibrates = |frame: &Frame| {
            frame.request.vibration.as_ref().is_some_and(|axes| axes[0] != wire::Vibration::NONE)
        };
        assert!(vibrates(&played.frames[599]) && !vibrates(&played.frames[600]));
    }
}

#[test]
fn a_level_fades_within_the_limits_and_arrives() {
    let neutral = 0;
    let mix = Mix { motion: 0.4, ..Mix::FULL };
    let played = ride().with(500, Event::Mix(0, mix)).with(1_300, Event::Mix(0, Mix::FULL)).play();
    assert_within(played.worst());
    let at = |frame: usize| (pulses(&played.frames[frame]), cue_at(&played, 10 * (frame as i64 + 1)));
    let (now, cue) = at(1_250);
    assert!((f64::from(now - neutral) - 0.4 * f64::from(cue)).abs() < 2.0, "{now} of {cue}");
    let (now, cue) = at(1_900);
    assert!((now - cue).abs() < 2, "{now} of {cue}");
}

#[test]
fn no_level_goes_beyond_the_greatest_that_a_cue_keeps_the_limits_at() {
    // Five seconds of rest, and then a swing that is a tenth faster than the seat may be.
    let row = |ms: i32| {
        let t = f64::from(ms - 5_000).max(0.0) / 1e3;
        let swell = (t / 4.0).min(1.0).powi(2) * (3.0 - 2.0 * (t / 4.0).min(1.0));
        format!("{ms},{:.6}\n", 0.5 + 0.4 * swell * (std::f64::consts::TAU * 0.7 * t).sin())
    };
    let cue = (0..=700).fold("time_ms,a1\n".to_owned(), |text, n| text + &row(20 * n));
    let show = Virtual { level: 0.8, proved: 0.8, at_most: 3_000, ..Virtual::new(cue) };
    let played = show.with(300, Event::Mix(0, Mix::FULL)).play();
    assert_within(played.worst());
    assert_eq!(played.clamps[0].clamps, 0);
    let fastest = played.positions_mm(0, 0).windows(2).map(|p| (p[1] - p[0]).abs()).fold(0.0, f64::max);
    assert!(fastest > 0.95 * 2.4, "{fastest} mm a frame: it gets what it can");
}

#[test]
fn a_level_that_changes_all_the_time_keeps_the_limits_also_where_the_show_is_stopped_or_sought() {
    let mut show = Virtual::new(swell(3, 20, 70.0, 0.45));
    for (step, at) in (300..1_900).step_by(37).enumerate() {
        let motion = [0.2, 1.0, 0.5, 0.9, 0.0][step % 5];
        show = show.with(at, Event::Mix(0, Mix { motion, ..Mix::FULL }));
    }
    assert_within(show.play().worst());
    for at in [700, 713, 1_111, 1_500] {
        let seek = Event::Seek(ShowTime::from_millis(4_000));
        for event in [Event::Stop, Event::Leave, Event::Ask(Transition::Pause), seek] {
            let show = Virtual { script: show.script.clone(), ..Virtual::new(show.cue.clone()) };
            let played = show.with(at, event).with(at + 500, Event::Leave).play();
            assert_within(played.worst());
        }
    }
}

#[test]
fn a_trim_is_slewed_in_and_ends_where_it_should() {
    for (ms, frame) in [(80, 1_500), (-80, 1_500), (200, 1_900)] {
        let played = ride().with(300, Event::Trim(ms)).play();
        assert_within(played.worst());
        let now = pulses(&played.frames[frame]);
        let cue = cue_at(&played, 10 * (frame as i64 + 1) - i64::from(ms));
        assert!((now - cue).abs() < 30, "{ms} ms: {now} of {cue}");
        let fastest = played.positions_mm(0, 0).windows(2).map(|p| (p[1] - p[0]).abs()).fold(0.0, f64::max);
        assert!(fastest <= 0.94248 * 1.021, "{fastest} mm a frame");
    }
}

/// Two seats that play the same.
fn two_seats() -> Virtual {
    let to = ["127.0.0.1:7408", "127.0.0.1:7409"].map(str::to_owned);
    Virtual { to: to.to_vec(), ..ride() }
}

#[test]
fn a_stop_brakes_each_of_several_seats() {
    let show = Virtual { at_most: 2_000, ..two_seats() };
    let played = show.with(460, Event::Stop).with(700, Event::Leave).play();
    assert_eq!(played.ended.ending, Ending::Stopped);
    let [first, second] = [0, 1].map(|lane| played.lane(lane).map(pulses).collect::<Vec<_>>());
    assert!((465..500).contains(&first.len()), "{} frames", first.len());
    assert_eq!(first, second, "they play the same");
    assert_within(played.worst_of_lane(1, 0..second.len()));
}

fn bytes(played: &Played, lane: usize) -> Vec<Vec<u8>> {
    played.lane(lane).map(|frame| frame.bytes.clone()).collect()
}

#[test]
fn a_seat_that_is_switched_off_parks_softly_and_on_joins_again_while_the_other_gets_the_very_same_frames() {
    let smooth = two_seats().play();
    let off = Mix { on: false, ..Mix::FULL };
    let played = two_seats()
        .with(400, Event::Mix(1, off))
        .with(1_200, Event::Mix(1, Mix::FULL))
        .with(1_210, Event::FoundThere(1))
        .play();
    assert_within(played.worst());
    assert_within(played.worst_of_lane(1, 0..played.lane(1).count()));
    assert_eq!(bytes(&played, 0), bytes(&smooth, 0));
    let second: Vec<i32> = played.lane(1).map(pulses).collect();
    let parked = 440 + second[440..].iter().position(|pulses| *pulses == 0).expect("it parks");
    let held = second[parked..].iter().take_while(|pulses| **pulses == 0).count();
    assert!(held < 20, "{held} frames to a seat that is parked, of 500 ticks and more");
    assert_eq!(played.lane(1).rev_pulses(200), smooth.lane(1).rev_pulses(200), "with the cue again");
    let mm = played.positions_mm(1, 0);
    let fastest =
        mm[440..parked].windows(2).map(|pair| (pair[1] - pair[0]).abs() / 0.010).fold(0.0, f64::max);
    assert!(fastest <= 50.1, "{fastest} mm/s on the way to park");
}

#[test]
fn a_seat_that_is_off_gets_nothing_once_it_is_parked_through_pauses_seeks_loops_and_the_end() {
    let off = Mix { on: false, ..Mix::FULL };
    let mut show = two_seats()
        .with(200, Event::Mix(1, off))
        .with(900, Event::Ask(Transition::Pause))
        .with(1_000, Event::Ask(Transition::Resume))
        .with(1_300, Event::Seek(ShowTime::from_millis(16_000)));
    show.plays = 2;
    let played = show.play();
    assert_eq!(played.ended.ending, Ending::Completed);
    assert_within(played.worst());
    let second: Vec<i32> = played.lane(1).map(pulses).collect();
    assert!(second.len() < 800, "{} frames", second.len());
    let rest = second.iter().rev().take_while(|pulses| **pulses == 0).count();
    assert!((3..=20).contains(&rest), "{rest} frames to a seat that is parked");
}

#[test]
fn a_pause_in_whichever_tick_a_seat_is_told_that_it_is_out_keeps_it_out() {
    let off = Mix { on: false, ..Mix::FULL };
    let told = two_seats().with(400, Event::Mix(1, off)).play().lane(1).count();
    for back in 0..6 {
        let pause = u64::try_from(told).unwrap() - back;
        let played = two_seats()
            .with(400, Event::Mix(1, off))
            .with(pause, Event::Ask(Transition::Pause))
            .with(pause + 100, Event::Ask(Transition::Resume))
            .play();
        assert_eq!(played.ended.ending, Ending::Completed, "{back}");
        assert!(played.lane(1).count() < told + 40, "{back}: {} frames", played.lane(1).count());
        assert_eq!(played.lane(1).rev_pulses(3), [0; 3], "{back}: at park");
    }
}

#[test]
fn a_lost_controller_is_brought_to_rest_told_so_for_70_ms_and_gets_nothing_until_it_is_back() {
    let smooth = two_seats().play();
    let played = two_seats().with(500, Event::Alarm(Alarm::Leave(1))).play();
    assert_eq!(bytes(&played, 0), bytes(&smooth, 0), "the other plays on");
    let count = played.lane(1).count();
    assert!((503..=530).contains(&count), "{count} frames");
    assert_within(played.worst_of_lane(1, 0..count));
    let last: Vec<i32> = played.lane(1).rev_pulses(4);
    assert!(last.iter().all(|pulses| *pulses == last[0]), "{last:?}");
    let numbers: Vec<u32> = played.lane(1).map(|frame| frame.request.frame.0).collect();
    assert!(numbers.iter().zip(1..).all(|(number, expected)| *number == expected));
}

#[test]
fn a_controller_that_is_back_joins_from_where_it_was_read() {
    let mut pose = [0.0; MAX_AXES];
    pose[..3].copy_from_slice(&[0.2, 0.9, 0.5]);
    let played =
        two_seats().with(500, Event::Alarm(Alarm::Leave(1))).with(1_000, Event::Found(1, pose)).play();
    assert_within(played.worst());
    let gap = played.lane(1).position(|frame| pulses(frame) == 60_000).unwrap();
    let count = played.lane(1).count();
    assert_within(played.worst_of_lane(1, gap..count));
    let (first, second) = (played.lane(0).rev_pulses(600), played.lane(1).rev_pulses(600));
    assert_eq!(first, second, "with the other again");
}

#[test]
fn a_controller_that_is_heard_again_while_it_is_brought_to_rest_joins_from_where_it_is_read_after_that() {
    let smooth = two_seats().play();
    let gone = two_seats().with(500, Event::Alarm(Alarm::Leave(1))).play().lane(1).count();
    for back in 500..u64::try_from(gone).unwrap() {
        // A reading of a seat that frames still lead is of the past.
        let played = two_seats()
            .with(500, Event::Alarm(Alarm::Leave(1)))
            .with(back, Event::FoundThere(1))
            .with(600, Event::FoundThere(1))
            .play();
        assert_eq!(bytes(&played, 0), bytes(&smooth, 0), "the other plays on");
        let count = played.lane(1).count();
        assert_within(played.worst_of_lane(1, 0..count));
        assert!(count < played.lane(0).count(), "{back}: it was away");
        let (first, second) = (played.lane(0).rev_pulses(600), played.lane(1).rev_pulses(600));
        assert_eq!(first, second, "{back}: with the other again");
    }
}

#[test]
fn seats_that_are_all_found_again_after_they_were_brought_to_rest_go_on_with_the_film() {
    let smooth = two_seats().play();
    let leave = |show: Virtual, lane| show.with(500, Event::Alarm(Alarm::Leave(lane)));
    let back = |show: Virtual, lane| show.with(600, Event::FoundThere(lane));
    let played = back(back(leave(leave(two_seats(), 0), 1), 0), 1).play();
    for lane in 0..2 {
        assert_within(played.worst_of_lane(lane, 0..played.lane(lane).count()));
        assert_eq!(played.lane(lane).rev_pulses(600), smooth.lane(lane).rev_pulses(600));
    }
}

#[test]
fn a_controller_that_is_lost_once_more_before_it_rests_is_away() {
    let played = two_seats()
        .with(500, Event::Alarm(Alarm::Leave(1)))
        .with(503, Event::Found(1, [0.5; MAX_AXES]))
        .with(505, Event::Alarm(Alarm::Leave(1)))
        .play();
    assert!((503..=530).contains(&played.lane(1).count()));
}

#[test]
fn a_seat_for_which_no_join_is_found_is_named_once_and_stays_up_until_all_park() {
    let played = two_seats()
        .with(500, Event::Alarm(Alarm::Leave(1)))
        .with(1_000, Event::Refuse)
        .with(1_000, Event::Found(1, [0.2; MAX_AXES]))
        .play();
    let told = played.news.iter().filter_map(unplanned).collect::<Vec<_>>();
    assert_eq!(told, [Unplanned::Lane(1)]);
    assert_eq!(played.ended.ending, Ending::Completed, "the other plays on");
    let up = played.lane(1).map(pulses).skip_while(|pulses| *pulses != 60_000);
    assert!(up.take_while(|pulses| *pulses == 60_000).count() > 900, "it waits for the end of the cue");
    assert_eq!(played.lane(1).rev_pulses(1), [0]);
}

#[test]
fn a_seek_to_which_no_move_leads_is_told_and_the_show_goes_on_where_it_is() {
    let smooth = ride().play();
    let seek = Event::Seek(ShowTime::from_millis(15_000));
    let played = ride().with(500, Event::Refuse).with(500, seek).play();
    assert_eq!(played.news.iter().filter_map(unplanned).collect::<Vec<_>>(), [Unplanned::Seek]);
    assert_eq!(bytes(&played, 0), bytes(&smooth, 0));
}

#[test]
fn a_controller_in_emergency_stop_gets_no_frame_from_the_next_tick_on() {
    let played = two_seats().with(500, Event::Alarm(Alarm::Cut(1))).play();
    assert_eq!(played.lane(1).count(), 500);
    assert_eq!(played.ended.ending, Ending::Completed, "what the hall does is decided elsewhere");
}

#[test]
fn a_planner_that_sleeps_through_the_end_of_a_moving_cue_leaves_the_seat_at_rest_not_at_a_wall() {
    for end in 5..9 {
        let cue = swell(1, end, 60.0, 0.21);
        let played =
            Virtual::new(cue).with(10, Event::SlowPlanner(1_200)).with(300, Event::SlowPlanner(1_200)).play();
        assert_within(played.worst());
        assert_eq!(pulses(played.frames.last().unwrap()), 0);
    }
}

#[test]
fn a_stall_in_the_middle_of_a_stop_leaves_the_seat_where_the_stall_left_it() {
    let late = Event::Late(Duration::from_millis(300));
    let played = ride().with(500, Event::Stop).with(505, late).with(700, Event::Leave).play();
    let frames: Vec<i32> = played.lane(0).map(pulses).collect();
    assert_eq!(frames.len(), 505 + 7, "70 ms of hold frames after the stall: {}", frames.len());
    assert!(frames[504..].iter().all(|pulses| *pulses == frames[504]));
}

#[test]
fn a_seat_that_is_switched_off_while_its_controller_is_lost_is_left_where_it_is_until_it_is_wanted_again() {
    let mut pose = [0.0; MAX_AXES];
    pose[..3].copy_from_slice(&[0.2, 0.9, 0.5]);
    let off = Mix { on: false, ..Mix::FULL };
    // The second one is led again by the time that it is switched off, and nobody reads it any more.
    for (switched, back_on, read) in [(700, 1_500, 1_510), (1_010, 1_200, 999)] {
        let played = two_seats()
            .with(500, Event::Alarm(Alarm::Leave(1)))
            .with(switched, Event::Mix(1, off))
            .with(1_000, Event::Found(1, pose))
            .with(back_on, Event::Mix(1, Mix::FULL))
            .with(read, Event::Found(1, pose))
            .play();
        assert_within(played.worst());
        let gap = played.lane(1).position(|frame| pulses(frame) == 60_000).unwrap();
        let since = played.lane(1).nth(gap).unwrap().at.since(played.frames[0].at);
        let led = if switched < 1_000 { back_on } else { 1_000 };
        assert!(since >= Duration::from_millis(10 * (led - 1)), "none while it was off: {since:?}");
        assert_within(played.worst_of_lane(1, gap..played.lane(1).count()));
        let (first, second) = (played.lane(0).rev_pulses(50), played.lane(1).rev_pulses(50));
        assert_eq!(first, second, "with the other again");
    }
}

#[test]
fn a_show_whose_seats_are_all_switched_off_parks_them_and_comes_to_its_end() {
    let off = Mix { on: false, ..Mix::FULL };
    let played = two_seats().with(500, Event::Mix(0, off)).with(500, Event::Mix(1, off)).play();
    assert_eq!(played.ended.ending, Ending::Completed);
    for lane in 0..2 {
        assert_within(played.worst_of_lane(lane, 0..played.lane(lane).count()));
        assert_eq!(played.lane(lane).rev_pulses(4), [0; 4], "parked");
        assert!(played.lane(lane).count() < 1_200);
    }
}

/// The states that the hall came to, in order.
fn states(played: &Played) -> Vec<State> {
    let entered = |news: &News| match news {
        News::Entered { state, .. } => Some(*state),
        _ => None,
    };
    let mut states: Vec<State> = played.news.iter().filter_map(entered).collect();
    states.dedup();
    states
}

#[test]
fn a_planner_that_gives_no_way_to_park_leaves_the_seat_at_rest_within_two_seconds_until_it_does() {
    let played = ride()
        .with(400, Event::SlowPlanner(1_000_000))
        .with(500, Event::Ask(Transition::Park))
        .with(1_500, Event::SlowPlanner(0))
        .play();
    assert_within(played.worst());
    let frames: Vec<i32> = played.lane(0).map(pulses).collect();
    assert!(frames[700..1_450].iter().all(|pulses| *pulses == frames[700]), "at rest");
    assert_eq!((frames.last(), played.ended.ending), (Some(&0), Ending::Stopped));
}

#[test]
fn while_nobody_reads_replies_the_seat_is_brought_to_rest_within_a_second_and_the_hall_says_so() {
    let played = ride().with(500, Event::Deaf(true)).with(900, Event::Leave).play();
    assert_within(played.worst());
    let deaf = |news: &News| matches!(news, News::Entered { cause: Cause::Trouble(Trouble::Deaf), .. });
    assert!(played.news.iter().any(deaf));
    assert_eq!(states(&played)[2..], [State::Stopping, State::Fault]);
    assert!(played.lane(0).count() < 610, "{} frames", played.lane(0).count());
}

#[test]
fn a_tick_thread_that_was_held_itself_does_not_take_that_for_a_deaf_one() {
    let late = Event::Late(Duration::from_millis(600));
    let played = ride().with(500, late).play();
    assert_eq!(played.ended.ending, Ending::Completed);
}

#[test]
fn after_a_sleep_of_seconds_the_seat_stays_where_it_was_until_a_person_resumes() {
    let played = ride()
        .with(500, Event::Late(Duration::from_secs(3)))
        .with(900, Event::Ask(Transition::Resume))
        .play();
    assert!(states(&played).contains(&State::Paused));
    assert_within(played.worst_from_rest(500, played.frames.len()));
    let woken = played.frames[499].at + Duration::from_secs(3);
    let still = |frame: &&Frame| frame.at > woken && frame.at < woken + Duration::from_millis(3_900);
    let held = pulses(&played.frames[499]);
    assert!(played.frames.iter().filter(still).all(|frame| pulses(frame) == held));
    assert_eq!(played.ended.ending, Ending::Completed);
}

#[test]
fn after_a_sleep_of_minutes_no_frame_leaves_until_a_person_clears() {
    let played = ride().with(500, Event::Late(Duration::from_secs(400))).with(5_000, Event::Leave).play();
    assert_eq!((played.frames.len(), *states(&played).last().unwrap()), (500, State::Stopped));
}
