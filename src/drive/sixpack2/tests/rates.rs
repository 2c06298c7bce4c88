//! How often each motor is really told something, over the lines of the table in docs/drives.md; and how soon a stop is on its way.

use std::time::Duration;

use super::bench::*;
use super::play::*;
use crate::config::drive::DriveFamily;
use crate::config::link::LinkWiring;
use crate::drive::link::{LinkPlay as _, LinkTalk as _};
use crate::drive::rates::LinkLoad;
use crate::drive::sixpack2::{OrderGap, SeatMotors, find};

/// What a link of so many motors can carry, whose answers begin so late.
fn load(baud: u32, delay: Duration, axes: u32) -> LinkLoad {
    LinkLoad {
        family: DriveFamily::Sixpack2,
        wiring: LinkWiring::Rs232,
        baud,
        octet_bits: 10,
        axes,
        seat_axes: 3,
        seats: axes / 3,
        exchange_octets: 0,
        answer_delay: delay,
        share: 0.80,
    }
}

/// How often each motor of a ride was told something, in each second; and at what rate it was to be.
fn reached(baud: u32, delay_ms: u64, axes: u32) -> [f64; 2] {
    let mut talk = talk_at(&[unit_with(1, shaft())], baud);
    find(&mut talk, &[1]).unwrap();
    let (seat, drive) = (seat(), drive(SWITCH));
    let sixpack2 = drive.sixpack2.clone().unwrap();
    let motors: [&[u8]; 2] = [&[0, 1, 2], &[3, 4, 5]];
    let motors = &motors[..axes as usize / 3];
    let period = load(baud, Duration::from_micros(1_000 * delay_ms + 300), axes).period();
    let lane = |motors: &&'static [u8]| SeatMotors {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &drive,
        sixpack2: &sixpack2,
        unit: 1,
        motors,
        period,
    };
    for motors in motors {
        assert_eq!(home_on(&mut talk, &drive, 1, motors).0, Ok(()));
    }
    let lanes: Vec<_> = motors.iter().map(lane).collect();
    let mut play = Play::over(talk, period, &lanes, |_, _| {}).unwrap();
    play.wait(2.0);
    assert!(play.all_ready(), "{:?}", play.rare());
    play.begin(|at, axis| 0.3 * ride(at, axis));
    play.play(4.0, 0);
    let sent = |play: &Play| play.stream.axis(0, 0).unwrap().account.sent;
    let before = sent(&play);
    play.play(10.0, 0);
    assert!(play.rare().is_empty(), "{:?}", play.rare());
    [(sent(&play) - before) as f64 / 10.0, 1.0 / period.as_secs_f64()]
}

/// Units are set to a delay of 2 ms, whatever rate a link plans with.
#[expect(clippy::print_stdout, reason = "the figures are for who asks to see them")]
#[test]
fn each_motor_is_told_as_often_as_the_table_says_within_a_fiftieth() {
    for (baud, delay_ms) in [(56_818, 6), (56_818, 2), (113_636, 6), (113_636, 2)] {
        for axes in [3, 6] {
            let [hz, wanted] = reached(baud, delay_ms, axes);
            println!("{baud} {delay_ms} ms {axes}: {hz:.1} of {wanted:.1} Hz");
            assert!((hz / wanted - 1.0).abs() < 0.02, "{baud} {delay_ms} ms {axes}: {hz} of {wanted} Hz");
        }
    }
}

#[expect(clippy::print_stdout, reason = "the figures are for who asks to see them")]
#[test]
fn a_stop_is_on_its_way_no_later_than_the_link_says() {
    let mut longest = Duration::ZERO;
    for phase in 0..12 {
        let mut play = Play::homed(&[wired(1, false)], BAUD);
        play.begin(ride);
        play.play(8.0, 0);
        play.wait(0.000_8 * f64::from(phase));
        let (stopped, sent) = (play.now(), play.stream.talk.port().sent.len());
        play.stream.stop().unwrap();
        play.wait(0.1);
        let slice = play.stream.talk.port().sent[sent..].iter().find(|(_, octets)| octets[1] == 0x24);
        longest = longest.max(slice.unwrap().0.since(stopped));
    }
    let octets = [Duration::from_secs(10) / BAUD; 2];
    let gap = OrderGap { period: PERIOD, octets, motors: 3, delay: Duration::from_millis(2) }.longest();
    println!("{longest:?} of {gap:?}");
    assert!(longest <= gap, "{longest:?} of {gap:?}");
}
