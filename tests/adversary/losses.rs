//! Losses and delays by patterns: a seat that does not get some of its frames, or whose acks do not come back, catches up no faster than
//! by a quarter over its limit, and is not lost for it.

use kinocue::harness::state::LedBefore;

use super::cues::{KINDS, Kind};
use super::ether::{Way, Weather};
use super::judge::{FASTEST, PULSES_PER_MM};
use super::named::{assert_no_breach, ether, lead};

const AT_50: Kind = KINDS[6];
const AT_100: Kind = KINDS[0];
const AT_200: Kind = KINDS[5];
const AT_1000: Kind = KINDS[7];
const RATES: [Kind; 4] = [AT_50, AT_100, AT_200, AT_1000];

/// How long a ride goes through it: twice and a half over the cue's swing.
const LASTS_MS: usize = 3_000;
/// The distance over which a person feels a jerk, as the limiter measures it.
const FELT_MS: usize = 20;

const fn lost(way: Way, lost: u64, of: u64) -> Weather {
    Weather::Pattern { way, lost, of }
}

const fn bursts(way: Way, lost_ms: u64, of_ms: u64) -> Weather {
    Weather::Bursts { way, lost_ms, of_ms }
}

/// What a ride through some weather was like.
#[derive(Debug)]
struct Ridden {
    /// The fastest move, as a multiple of the limit.
    fastest: f64,
    /// The root of the mean square of jerk, and the greatest, as multiples of the bench seat's limit.
    jerk: [f64; 2],
    /// Times at which frames stopped: a seat that was lost.
    stops: u32,
}

fn ride(kind: Kind, weathers: &[Weather]) -> Ridden {
    let ether = ether(kind, |_| {});
    let mut places = Vec::new();
    lead(kind, &ether, LedBefore::Ended, |hall| {
        hall.ride(0);
        hall.ether.world().lines[0].seat.fastest = 0.0;
        hall.ether.world().lines[0].seat.stops = 0;
        weathers.iter().for_each(|one| hall.ether.turns(0, *one, LASTS_MS as u64));
        for _ in 0..LASTS_MS {
            hall.pass(1);
            places.push(hall.ether.world().lines[0].seat.place(hall.ether.ns())[0] / PULSES_PER_MM);
        }
    });
    assert_no_breach(&ether);
    let seconds = FELT_MS as f64 * 1e-3;
    let jerks: Vec<f64> = places
        .windows(3 * FELT_MS + 1)
        .map(|at| {
            (at[3 * FELT_MS] - 3.0 * at[2 * FELT_MS] + 3.0 * at[FELT_MS] - at[0]) / seconds.powi(3) / 60_000.0
        })
        .collect();
    let mean = jerks.iter().map(|jerk| jerk * jerk).sum::<f64>() / jerks.len() as f64;
    let greatest = jerks.iter().fold(0.0_f64, |most, jerk| most.max(jerk.abs()));
    let world = ether.world();
    let seat = &world.lines[0].seat;
    Ridden { fastest: seat.fastest / seat.settings.mm_s, jerk: [mean.sqrt(), greatest], stops: seat.stops }
}

/// Rides through each, and says how; no move is faster than may be, and no more seats are lost than may be.
#[track_caller]
fn rides_through(kinds: &[Kind], weathers: &[(&str, &[Weather])], most_stops: u32) {
    let mut wrong = Vec::new();
    for kind in kinds {
        for (name, weather) in weathers {
            let ridden = ride(*kind, weather);
            let Ridden { fastest, jerk: [mean, greatest], stops } = ridden;
            println!(
                "{:5} Hz, {name:32}: {fastest:.2} of the speed, jerk {mean:.2}, {greatest:.2}, lost {stops}",
                kind.hz
            );
            if fastest > FASTEST || stops > most_stops {
                wrong.push(format!("{} Hz, {name}: {ridden:?}", kind.hz));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn frames_lost_by_any_pattern_make_a_seat_no_faster_than_a_quarter_over_its_limit() {
    use Way::There;
    let patterns: [(&str, &[Weather]); 4] = [
        ("every 3rd frame", &[lost(There, 1, 3)]),
        ("every other frame", &[lost(There, 1, 2)]),
        ("every 7th frame", &[lost(There, 1, 7)]),
        ("2 of 3 frames", &[lost(There, 2, 3)]),
    ];
    rides_through(&RATES[..3], &patterns[..3], 0);
    rides_through(&RATES[3..], &patterns, 0);
    rides_through(&RATES, &[("frames of 19 of 100 ms", &[bursts(There, 19, 100)])], 0);
    rides_through(&RATES[1..], &[("frames of 39 of 150 ms", &[bursts(There, 39, 150)])], 0);
}

#[test]
fn acks_lost_by_any_pattern_hold_a_seat_back_and_lose_it_not() {
    use Way::Back;
    let patterns: [(&str, &[Weather]); 4] = [
        ("every 3rd ack", &[lost(Back, 1, 3)]),
        ("every other ack", &[lost(Back, 1, 2)]),
        ("every 7th ack", &[lost(Back, 1, 7)]),
        ("2 of 3 acks", &[lost(Back, 2, 3)]),
    ];
    rides_through(&RATES[..3], &patterns[..3], 0);
    rides_through(&RATES[3..], &patterns, 0);
    rides_through(&RATES, &[("acks of 19 of 100 ms", &[bursts(Back, 19, 100)])], 0);
    rides_through(&RATES[1..], &[("acks of 39 of 150 ms", &[bursts(Back, 39, 150)])], 0);
}

#[test]
fn frames_and_acks_lost_in_turn_keep_the_limit_as_well() {
    use Way::{Back, There};
    let patterns: [(&str, &[Weather]); 2] = [
        ("every 3rd frame, every 4th ack", &[lost(There, 1, 3), lost(Back, 1, 4)]),
        ("every 5th frame, every other ack", &[lost(There, 1, 5), lost(Back, 1, 2)]),
    ];
    rides_through(&RATES, &patterns, 1);
}

#[test]
fn a_fifth_of_all_lost_at_random_keeps_the_limit_as_well() {
    let patterns: [(&str, &[Weather]); 3] = [
        ("20 % of frames and acks", &[Weather::Thin(5), Weather::Hoarse(5)]),
        ("20 % of frames", &[Weather::Thin(5)]),
        ("20 % of acks", &[Weather::Hoarse(5)]),
    ];
    rides_through(&RATES, &patterns, 3);
}

#[test]
fn a_slow_network_that_loses_nothing_keeps_the_limit_and_no_seat_is_lost() {
    let patterns: [(&str, &[Weather]); 3] = [
        ("acks 20 ms later", &[Weather::Far { there: 0, back: 20 }]),
        ("frames and acks 10 ms later", &[Weather::Far { there: 10, back: 10 }]),
        ("acks 7 ms later", &[Weather::Far { there: 0, back: 7 }]),
    ];
    rides_through(&RATES, &patterns, 0);
}

/// What is lost before an ack is overdue is still made up for in one frame.
#[test]
fn a_single_frame_that_a_slow_network_loses_is_made_up_for_as_it_was_before() {
    let weather = [Weather::Far { there: 0, back: 12 }, lost(Way::There, 1, 7)];
    for kind in RATES {
        let Ridden { fastest, stops, .. } = ride(kind, &weather);
        println!("{:5} Hz: {fastest:.2} of the speed", kind.hz);
        assert!(fastest <= 1.7 && stops == 0, "{} Hz: {fastest}, lost {stops}", kind.hz);
    }
}

#[test]
fn a_quick_network_leaves_every_frame_as_it_was() {
    for kind in [AT_50, AT_100, AT_200] {
        let Ridden { fastest, jerk: [_, greatest], stops } = ride(kind, &[]);
        assert!(fastest <= 1.0 && greatest <= 1.01 && stops == 0, "{} Hz: {fastest} {greatest}", kind.hz);
    }
}
