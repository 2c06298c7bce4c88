//! Losses where acks are requested as seldom as they may be: wherever between two acks they begin, the first frame after one makes up for
//! no more than README says.

use kinocue::harness::state::LedBefore;

use super::chance::setting;
use super::cues::{KINDS, Kind, SELDOM};
use super::dice::Dice;
use super::ether::Weather;
use super::hall::Hall;
use super::named::{assert_no_breach, ether, lead};

/// What lies between two acks, and all that is admitted beside it, is less than so much longer, ms.
const LONGEST: u64 = 150;

/// A ride with such a spell, so many periods after it follows, and in it one frame that the kernel does not take.
fn rides_through(kind: Kind, after: u64, refuses: Option<u64>, (weather, ms): (Weather, u64)) {
    let (ether, period) = (ether(kind, |_| {}), kind.period_ms() as u64);
    lead(kind, &ether, LedBefore::Ended, |hall| {
        hall.ride(0);
        hall.pass(period * after);
        hall.ether.turns(0, weather, ms);
        if let Some(frame) = refuses {
            hall.pass(period * frame);
            hall.ether.turns(0, Weather::Refused, period);
        }
        hall.pass(ms + 1_300);
    });
    assert_no_breach(&ether);
}

fn ride_all(refuses: bool) {
    let mut dice = Dice::new(setting("KINOCUE_SEED").unwrap_or(7));
    for kind in SELDOM {
        for _ in 0..setting("KINOCUE_HISTORIES").unwrap_or(60) {
            let after = dice.range(0, (1_300.0 / kind.period_ms()) as u64);
            let ms = dice.range(30, LONGEST + 2 * kind.asks_ms() as u64);
            let weather = dice.pick(&[Weather::Lost, Weather::Cut]);
            let refused = dice.range(0, (kind.asks_ms() / kind.period_ms()) as u64);
            rides_through(kind, after, refuses.then_some(refused), (weather, ms));
        }
    }
}

#[test]
fn wherever_a_loss_begins_between_two_acks_it_is_made_up_for_by_no_more_than_is_said() {
    ride_all(false);
}

#[test]
fn nor_by_more_where_the_kernel_refuses_a_frame_of_it() {
    ride_all(true);
}

#[test]
fn nor_by_more_where_it_refuses_all_from_an_ack_on_for_as_long_as_that_is_no_gap() {
    let mut dice = Dice::new(setting("KINOCUE_SEED").unwrap_or(7));
    for kind in SELDOM {
        let (period, every) = (kind.period_ms() as u64, (kind.asks_ms() / kind.period_ms()) as u64);
        for _ in 0..setting("KINOCUE_HISTORIES").unwrap_or(60) {
            let ether = ether(kind, |_| {});
            lead(kind, &ether, LedBefore::Ended, |hall| {
                hall.ride(0);
                hall.pass(period * dice.range(0, 40 * every));
                let refuses = period * dice.range(1, 2 + 50 / period);
                hall.ether.turns(0, Weather::Refused, refuses);
                hall.pass(refuses);
                hall.ether.turns(0, Weather::Lost, dice.range(period, LONGEST));
                hall.pass(LONGEST + 1_300);
            });
            assert_no_breach(&ether);
        }
    }
}

#[test]
fn a_seat_whose_frames_the_kernel_refused_for_long_rejoins_and_stays() {
    for kind in SELDOM.into_iter().chain([KINDS[0], KINDS[7]]) {
        let ether = ether(kind, |_| {});
        lead(kind, &ether, LedBefore::Ended, |hall| {
            let takes_part = |hall: &mut Hall<'_, '_>| {
                hall.pass(10);
                hall.runtime.live.table()[0].standing.may_move()
            };
            hall.ride(3);
            hall.ether.turns(0, Weather::Refused, 3_000);
            hall.pass(3_000);
            assert!(!takes_part(hall), "{kind:?}");
            assert!((0..200).any(|_| takes_part(hall)), "{kind:?}");
            assert!((0..500).all(|_| takes_part(hall)), "it falls out once more: {kind:?}");
        });
        assert_no_breach(&ether);
    }
}
