//! Plays over bad lines, and to units in trouble.

use std::time::Duration;

use super::bench::*;
use crate::drive::link::*;
use crate::drive::silvermax::look;
use crate::sim::serial::LineFaults;
use crate::sim::silvermax::Action;

/// Rides for a while over a line with faults; whatever happens to the lane, no axis leaves its course.
fn ride_over(faults: LineFaults, seconds: f64) -> Play {
    let mut play = Play::with_ppm([100, -100, 0]);
    play.judged = false;
    play.line().faults = faults;
    play.begin(ride);
    play.play(seconds, 0);
    play
}

#[test]
fn segments_in_doubt_are_found_out_and_none_is_executed_twice() {
    for lost in [0.001, 0.003] {
        let mut play = ride_over(LineFaults { answer_lost: lost, ..LineFaults::default() }, 60.0);
        let figures = play.figures();
        play.assert_gentle();
        let doubts: u64 = figures.iter().map(|axis| axis.account.in_doubt).sum();
        assert!(doubts > 3, "{lost}: {figures:?}");
        let off = figures.iter().map(|axis| axis.off_course_mm).fold(0.0, f64::max);
        assert!(off < 0.3 && !play.has("OffCourse"), "{lost}: {off} {:?}", play.rare());
        // Answers that are lost one after the other may cost more time than is queued: then the seat brakes, and says so.
        let is_through = figures
            .iter()
            .all(|axis| axis.account.made > 1_770 && axis.account.acked + 5 > axis.account.made);
        assert!(is_through || (lost > 0.001 && play.has("Braked")), "{figures:?} {:?}", play.rare());
    }
}

#[test]
fn octets_that_are_lost_doubled_or_late_do_no_harm() {
    for (index, faults) in [
        LineFaults { lost: 0.000_2, ..LineFaults::default() },
        LineFaults { doubled: 0.000_2, ..LineFaults::default() },
        LineFaults { late: 0.000_5, late_by: Duration::from_millis(25), ..LineFaults::default() },
    ]
    .into_iter()
    .enumerate()
    {
        let mut play = ride_over(faults, 40.0);
        for axis in 0..3 {
            let executed = play.unit(axis).executed();
            let (low, high) = ((executed.lowest - ZERO) / MM, (executed.highest - ZERO) / MM);
            assert!(low >= -1.01 && high <= 151.01, "{index}: {low} {high}");
        }
    }
}

#[test]
fn flipped_bits_never_lead_beyond_the_soft_limits() {
    let mut play = ride_over(LineFaults { flipped: 0.000_3, ..LineFaults::default() }, 40.0);
    for axis in 0..3 {
        let executed = play.unit(axis).executed();
        let (low, high) = ((executed.lowest - ZERO) / MM, (executed.highest - ZERO) / MM);
        assert!(low >= -1.01 && high <= 151.01, "{low} {high}");
    }
}

#[expect(clippy::print_stdout, reason = "the figure is for who asks to see it")]
#[test]
fn a_segment_that_was_damaged_puts_its_seat_out_within_a_few_readings_of_its_place() {
    let mut longest = Duration::ZERO;
    for phase in 0..8 {
        let mut play = Play::with_ppm([0; 3]);
        play.judged = false;
        play.begin(ride);
        play.play(6.0 + 0.13 * f64::from(phase), 0);
        // A segment of unit 17 of as many ticks, but as fast as can be.
        play.stream.talk.port().damage = Some(Box::new(|sent| {
            let text = String::from_utf8_lossy(sent).into_owned();
            let words: Vec<_> = text.trim_end().split(' ').collect();
            let ["@17", "25", ticks, place @ ("2147483647" | "-2147483648"), _, _] = words[..] else {
                return false;
            };
            *sent = format!("@17 25 {ticks} {place} 9999999 2000000000\r").into_bytes();
            true
        }));
        let damaged = play.now();
        play.play(3.0, 0);
        assert!(
            play.stream.talk.port().damage.is_none() && play.has("OffCourse"),
            "{phase}: {:?}",
            play.rare()
        );
        let out = play.told.iter().find(|(_, event)| matches!(event, StreamEvent::OffCourse { .. }));
        longest = longest.max(out.unwrap().0.since(damaged));
    }
    println!("{longest:?}");
    assert!(longest < Duration::from_millis(600), "{longest:?}");
}

#[test]
fn a_stop_is_on_the_line_after_one_exchange_and_each_unit_has_acked_it() {
    let mut play = Play::with_ppm([0; 3]);
    play.begin(ride);
    play.play(10.0, 0);
    let before = play.stream.talk.port().sent.len();
    let _ = play.stream.round();
    play.stream.stop().unwrap();
    play.judged = false;
    play.wait(0.03);
    let sent: Vec<_> = play.stream.talk.port().sent[before..]
        .iter()
        .map(|(_, line)| String::from_utf8_lossy(line).into_owned())
        .collect();
    let at = sent.iter().position(|line| line == "@255 3 2319282\r").unwrap();
    assert!(at <= 1, "{sent:?}");
    assert_eq!(sent[at + 1..at + 4], ["@16 3 2319282\r", "@17 3 2319282\r", "@18 3 2319282\r"]);
    play.wait(1.0);
    assert!((0..3).all(|axis| !play.unit(axis).is_moving() || play.unit(axis).queued() == 0));
    assert!(play.stream.is_ready(0) && play.has("Stopped"), "{:?}", play.rare());
    play.assert_gentle();
}

#[test]
fn unplugged_in_mid_course_it_is_at_rest_within_the_lead_and_comes_back_where_it_stands() {
    let mut play = Play::with_ppm([0; 3]);
    play.judged = false;
    play.begin(ride);
    play.play(10.0, 0);
    play.line().faults.unplugged = true;
    let brake = 0.1;
    play.play(play.lead().as_secs_f64() + brake, 0);
    let rest = [0, 1, 2].map(|axis| play.place(axis));
    play.play(1.0, 0);
    assert_eq!([0, 1, 2].map(|axis| play.place(axis)), rest);
    assert!(play.has("Lost"), "{:?}", play.rare());
    play.line().faults.unplugged = false;
    play.wait(2.0);
    assert!(play.has("Back") && play.stream.is_ready(0), "{:?}", play.rare());
    assert_eq!([0, 1, 2].map(|axis| play.place(axis)), rest);
    play.assert_gentle();
}

#[test]
fn a_port_that_is_gone_is_an_error_and_all_lanes_are_lost() {
    let mut play = Play::with_ppm([0; 3]);
    play.stream.talk.port().is_gone = true;
    let rounds: Vec<_> = (0..300).map(|_| play.stream.round()).collect();
    play.wait(0.0);
    assert!(rounds.contains(&Err(LinkFault)), "{:?}", play.rare());
    assert!(
        play.events.pop().is_ok_and(|event| matches!(event, StreamEvent::Lost { lane: 0, .. }))
            || play.has("Lost")
    );
}

#[test]
fn a_unit_that_was_restarted_is_told_and_its_seat_stays_out_until_it_is_homed() {
    let mut play = Play::with_ppm([0; 3]);
    play.judged = false;
    play.begin(ride);
    play.play(10.0, 0);
    let now = play.now();
    play.line().bus_mut().act(Some(17), Action::Reset, now);
    play.play(3.0, 0);
    assert!(play.has("Restarted { lane: 0, axis: 1 }"), "{:?}", play.rare());
    let rest = [0, 2].map(|axis| play.place(axis));
    play.play(2.0, 0);
    assert_eq!([0, 2].map(|axis| play.place(axis)), rest);
    assert!(!play.stream.is_ready(0));
    let homed = home_as(&mut play.stream.talk, &drive(SWITCH), &[16, 17, 18]).0;
    assert_eq!(homed, Ok(()));
    let canary = look(&mut play.stream.talk, 16).unwrap().canary;
    play.stream.rejoin(0, canary);
    play.wait(1.0);
    assert!(play.stream.is_ready(0));
}

/// Asks a unit for another register instead of its canary, once: a digit was bad on the way.
fn misread_canary(unit: u8) -> Damage {
    Box::new(move |octets| {
        let is_it = octets == format!("@{unit} 12 40\r").as_bytes();
        if is_it {
            *octets = format!("@{unit} 12 39\r").into_bytes();
        }
        is_it
    })
}

#[test]
fn one_bad_digit_of_a_canary_puts_no_seat_out() {
    for unit in [16, 17, 18] {
        let mut play = Play::with_damage([0; 3], Some(misread_canary(unit)));
        play.begin(ride);
        for _ in 0..3 {
            play.play(3.0, 0);
            play.stream.talk.port().damage = Some(misread_canary(unit));
        }
        play.play(3.0, 0);
        assert!(play.stream.talk.port().damage.is_none(), "it was misread");
        assert!(!play.has("homed: false"), "{unit}: {:?}", play.rare());
        assert!(!play.has("Restarted"), "{unit}: {:?}", play.rare());
    }
}

/// Has one question of a unit answered by a bare ACK, for as long as it stays.
fn untold(unit: u8, register: u8) -> Damage {
    Box::new(move |octets| {
        if octets == format!("@{unit} 12 {register}\r").as_bytes() {
            *octets = format!("@{unit} 0\r").into_bytes();
        }
        false
    })
}

#[test]
fn a_unit_that_takes_its_segments_and_tells_nothing_is_lost_after_two_seconds_and_its_seat_brakes() {
    // Where it is, and whether it was restarted.
    for register in [1, 40] {
        let mut play = Play::with_ppm([0; 3]);
        play.judged = false;
        play.begin(ride);
        play.play(10.0, 0);
        assert!(!play.has("Lost"), "{register}: {:?}", play.rare());
        play.stream.talk.port().damage = Some(untold(17, register));
        let since = play.now();
        let lost = (0..40).find_map(|_| {
            play.play(0.1, 0);
            let event = play.told.iter().find(|(_, event)| matches!(event, StreamEvent::Lost { .. }));
            event.map(|(at, _)| at.since(since).as_secs_f64())
        });
        assert!(
            lost.is_some_and(|after| (1.9..3.5).contains(&after)),
            "{register}: {lost:?} {:?}",
            play.rare()
        );
        // No hall that reads no seat leads it on.
        play.wait(0.5);
        let rest = [0, 1, 2].map(|axis| play.place(axis));
        play.wait(0.5);
        assert_eq!([0, 1, 2].map(|axis| play.place(axis)), rest, "{register}");
        play.assert_gentle();
    }
}

#[test]
fn one_answer_that_tells_nothing_loses_no_unit() {
    let mut play = Play::with_ppm([0; 3]);
    play.begin(ride);
    for _ in 0..4 {
        play.play(2.5, 0);
        let mut once = untold(17, 1);
        play.stream.talk.port().damage =
            Some(Box::new(move |octets| octets.starts_with(b"@17 12 1\r") && !once(octets)));
    }
    assert!(!play.has("Lost"), "{:?}", play.rare());
}

#[test]
fn a_blocked_axis_is_killed_and_told_by_what() {
    let mut play = Play::with_ppm([0; 3]);
    play.judged = false;
    play.begin(ride);
    play.play(10.0, 0);
    let now = play.now();
    play.line().bus_mut().act(Some(18), Action::Blocked(true), now);
    play.play(2.0, 0);
    assert!(play.has("Killed { lane: 0, axis: 2, cause: "), "{:?}", play.rare());
    assert!((0..2).all(|axis| !play.unit(axis).is_moving()));
    // Nor does another run take it for home, whose look finds that the event was told and cleared.
    let facts = look(&mut play.stream.talk, 18).unwrap();
    assert!(facts.kill_cause != 0 && facts.canary == 0, "{facts:?}");
}
