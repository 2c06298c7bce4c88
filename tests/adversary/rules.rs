//! That the seats do what the manuals say, and that the judge sees what it is there to see.

use kinocue::wire::{Code, Status};

use super::cues::KINDS;
use super::hall::seats;
use super::judge::{How, PULSES_PER_MM};
use super::seat::{Arrival, MS, Seat, Settings};
use super::words::{self, Heard};

/// When the first frame comes.
const BEGIN: u64 = 5_000 * MS;

fn seat(set: impl Fn(&mut Settings)) -> Seat {
    let mut settings = seats(&KINDS[0])[0];
    set(&mut settings);
    Seat::new(0, settings)
}

/// A frame for three axes, of which the first goes there.
fn frame(function: u16, number: u32, time_ms: u32, mm: f64) -> Vec<u8> {
    let mut octets = vec![0x55, 0xaa, 0, 0];
    octets.extend_from_slice(&function.to_be_bytes());
    octets.extend_from_slice(&[0, 0, 0xff, 0xff, 0xff, 0xff]);
    octets.extend_from_slice(&number.to_be_bytes());
    octets.extend_from_slice(&time_ms.to_be_bytes());
    octets.extend_from_slice(&((mm * PULSES_PER_MM) as i32).to_be_bytes());
    octets.resize(38, 0);
    octets
}

/// Has a seat hear a frame that was sent so many milliseconds after the first, and came without delay.
fn hears(seat: &mut Seat, octets: &[u8], ms: u64) -> Option<Vec<u8>> {
    let at = BEGIN + ms * MS;
    seat.hear(octets, Arrival { at, sent: at, lost_since: at, asked: true })
}

fn mm(seat: &mut Seat, ms: u64) -> f64 {
    seat.advance(BEGIN + ms * MS);
    seat.place(BEGIN + ms * MS)[0] / PULSES_PER_MM
}

#[test]
fn a_relative_time_is_how_long_a_move_takes() {
    let mut seat = seat(|_| {});
    hears(&mut seat, &frame(0x1401, 1, 100, 10.0), 0);
    assert_eq!([50, 100, 200].map(|ms| mm(&mut seat, ms).round() as i32), [5, 10, 10]);
    assert_eq!(seat.breaches, []);
}

#[test]
fn an_absolute_time_counts_from_that_of_the_frame_before() {
    let mut seat = seat(|_| {});
    hears(&mut seat, &frame(0x1301, 1, 100, 10.0), 0);
    hears(&mut seat, &frame(0x1301, 2, 300, 30.0), 100);
    assert_eq!([100, 200, 300].map(|ms| mm(&mut seat, ms).round() as i32), [10, 20, 30]);
}

#[test]
fn a_longer_time_than_it_takes_is_cut() {
    let mut seat = seat(|seat| seat.cut_ms = 500);
    hears(&mut seat, &frame(0x1401, 1, 3_000, 150.0), 0);
    assert_eq!(mm(&mut seat, 500).round() as i32, 150);
    assert_eq!(seat.breaches.len(), 1);
    assert_eq!(seat.breaches[0].mm_s().round() as i32, 300);
}

#[test]
fn of_more_than_two_frames_that_wait_each_is_gone_through_in_half_its_time() {
    for (hurry, end) in [(true, 80), (false, 110)] {
        let mut seat = seat(|seat| seat.hurry = hurry);
        hears(&mut seat, &frame(0x1401, 1, 50, 0.0), 0);
        for number in 2..8 {
            hears(&mut seat, &frame(0x1401, number, 10, f64::from(number - 1)), 5 + u64::from(number) * 5);
        }
        assert!(mm(&mut seat, end - 2) < 5.9, "{hurry}");
        assert_eq!(mm(&mut seat, end + 10).round() as i32, 6, "{hurry}");
    }
}

#[test]
fn what_was_lost_for_less_than_fifty_milliseconds_is_admitted_and_no_more() {
    for (lost_ms, breaches) in [(40, 0), (150, 1)] {
        let mut seat = seat(|_| {});
        hears(&mut seat, &frame(0x1401, 1, 10, 2.0), 0);
        let far = 2.0 + 0.2 * lost_ms as f64;
        hears(&mut seat, &frame(0x1401, 1 + lost_ms as u32 / 10, 10, far), lost_ms);
        mm(&mut seat, 1_000);
        assert_eq!(seat.breaches.len(), breaches, "{lost_ms} ms");
    }
}

#[test]
fn a_move_that_nobody_asked_for_is_seen_however_slow_it_is() {
    let mut seat = seat(|_| {});
    let arrival = Arrival { at: BEGIN, sent: BEGIN, lost_since: BEGIN, asked: false };
    seat.hear(&frame(0x1401, 1, 1_000, 1.0), arrival);
    assert_eq!(seat.breaches.iter().map(|one| one.how).collect::<Vec<_>>(), [How::Unasked]);
}

#[test]
fn a_pressed_seat_stands_where_it_is_and_says_so() {
    let mut seat = seat(|seat| seat.stop_mode = 2);
    hears(&mut seat, &frame(0x1401, 1, 1_000, 100.0), 0);
    seat.press(true, BEGIN + 100 * MS);
    // The input has to stay so for 200 ms.
    assert_eq!(mm(&mut seat, 900).round() as i32, 30);
    let reply = hears(&mut seat, &frame(0x1401, 2, 10, 30.0), 1_000).expect("it answers");
    assert_eq!(reply[4..6], [0x14, 4]);
    assert_eq!(mm(&mut seat, 1_100).round() as i32, 30);
}

#[test]
fn a_seat_whose_power_went_counts_from_where_it_stands() {
    let mut seat = seat(|_| {});
    hears(&mut seat, &frame(0x1401, 1, 1_000, 100.0), 0);
    mm(&mut seat, 1_000);
    seat.reboot(BEGIN + 1_100 * MS, 600 * MS);
    let read = [0x55, 0xaa, 0, 0, 0x11, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0, 0x06, 0, 2];
    assert_eq!(hears(&mut seat, &read, 1_500), None);
    let reply = hears(&mut seat, &read, 1_800).expect("it answers again");
    assert_eq!(reply[16..20], [0; 4]);
    assert_eq!(mm(&mut seat, 1_900).round() as i32, 100);
    assert!(!seat.homed);
}

#[test]
fn a_report_is_of_the_station_that_its_address_says_and_is_heard_as_that() {
    let mut seat = seat(|seat| (seat.report_ms, seat.address.0) = (100, [127, 0, 1, 7]));
    let report = Status::parse(&seat.report(BEGIN).expect("it is time for one")).expect("it is one").station;
    assert_eq!(report, Code::station([127, 0, 1, 7]));
}

#[test]
fn what_another_master_moves_is_not_judged_and_what_the_hall_moves_after_it_is_once_it_may_know_of_that() {
    for (excused_ms, breaches) in [(0, 1), (400, 0)] {
        let mut seat = seat(|_| {});
        hears(&mut seat, &frame(0x1401, 1, 10, 2.0), 0);
        let Heard::Motion(other) = words::hear(&frame(0x1401, 1, 10, 100.0)) else { panic!("it is motion") };
        seat.hear_other(&other, BEGIN + 200 * MS);
        seat.excuse(BEGIN + excused_ms * MS);
        assert_eq!((mm(&mut seat, 250).round() as i32, seat.breaches.len()), (100, 0));
        hears(&mut seat, &frame(0x1401, 2, 10, 2.0), 300);
        assert_eq!((mm(&mut seat, 400).round() as i32, seat.breaches.len()), (2, breaches));
    }
}

#[test]
fn what_is_moved_by_hand_in_the_moment_before_the_first_frame_is_not_judged_and_what_was_before_is() {
    for (jogged_ms, breaches) in [(300, 0), (200, 0), (0, 1)] {
        let mut seat = seat(|_| {});
        assert!(seat.jog(0, 60.0, BEGIN + jogged_ms * MS));
        hears(&mut seat, &frame(0x1401, 1, 10, 0.0), 315);
        assert_eq!((mm(&mut seat, 400), seat.breaches.len()), (0.0, breaches), "jogged at {jogged_ms} ms");
    }
}

#[test]
fn a_program_that_stood_still_has_lost_no_frames_meanwhile() {
    for (number, breaches) in [(2, 1), (6, 0)] {
        let mut seat = seat(|_| {});
        hears(&mut seat, &frame(0x1401, 1, 10, 2.0), 0);
        hears(&mut seat, &frame(0x1401, number, 10, 12.0), 60);
        assert_eq!((mm(&mut seat, 200), seat.breaches.len()), (12.0, breaches), "frame {number}");
    }
}

#[test]
fn a_pressed_mbox_refuses_frames_as_an_error_and_answers_the_rest_as_if_nothing_were() {
    let mut seat = seat(|seat| seat.mbox = true);
    seat.press(true, BEGIN);
    let refused = hears(&mut seat, &frame(0x1401, 2, 10, 30.0), 1_000).expect("it answers");
    assert_eq!(refused[4..8], [0x14, 3, 0, 0]);
    let count = [0x55, 0xaa, 0, 0, 0x11, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0, 0x34, 0, 1];
    let answer = hears(&mut seat, &count, 1_100).expect("it answers");
    assert_eq!((answer[5], &answer[16..18]), (2, &[0, 0][..]));
}

#[test]
fn a_seat_that_lies_says_that_it_knows_its_zero_and_one_that_is_behind_says_where_it_was() {
    let read = |start| [0x55, 0xaa, 0, 0, 0x11, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0, start, 0, 2];
    let word = |octets: &[u8], at| i32::from(words::u16_at(octets, at));
    for (lies, reset) in [(false, 0), (true, 2)] {
        let mut seat = seat(|seat| seat.lies = lies);
        seat.reboot(BEGIN, 100 * MS);
        assert_eq!(word(&hears(&mut seat, &read(0xf0), 200).expect("it answers"), 16), reset);
    }
    let mut seat = seat(|_| {});
    seat.freeze(BEGIN, BEGIN + 100 * MS);
    hears(&mut seat, &frame(0x1401, 1, 50, 5.0), 0);
    let told = [60, 120].map(|ms| word(&hears(&mut seat, &read(0x06), ms).expect("it answers"), 16));
    assert_eq!(told, [0, 10_000]);
}
