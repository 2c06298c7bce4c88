//! What is on is a belief about the controller: whoever led the seats before, and however that ended, each that answers is made dark and
//! still, by its own word, and nobody moves by it.

use kinocue::harness::engine::Mix;
use kinocue::harness::state::{LedBefore, PlayMode, State, Transition};

use super::cues::{KINDS, Kind, MBOXES, OTHERS};
use super::ether::{Ether, Weather};
use super::hall::{Hall, Thread};
use super::named::{assert_no_breach, ether, lead};
use super::seat::MS;

const WET: usize = 3;
const WET_AT_REST: usize = 4;
const STRONG: usize = 6;
const THREE: Kind = KINDS[0];
const TWO: Kind = KINDS[6];
const FAST: Kind = OTHERS[7];

/// Outputs, and whether it vibrates, of each seat.
fn on(ether: &Ether) -> Vec<(u16, bool)> {
    ether.world().lines.iter().map(|line| (line.seat.outputs, line.seat.shakes)).collect()
}

/// That all seats are dark and still within so many milliseconds; gives after how many.
#[track_caller]
fn goes_dark(hall: &mut Hall<'_, '_>, within_ms: u64, what: &str) -> u64 {
    let begin = hall.ether.ns();
    let is_on = |ether: &Ether| on(ether).iter().any(|(outputs, shakes)| *outputs != 0 || *shakes);
    while is_on(&hall.ether) && hall.ether.ns() < begin + within_ms * MS {
        hall.pass(20);
    }
    let took = (hall.ether.ns() - begin) / MS;
    let left = on(&hall.ether);
    let table: Vec<String> = hall.runtime.live.table().iter().map(|row| format!("{row:?}")).collect();
    assert!(!is_on(&hall.ether), "{what}: {left:?} after {took} ms, {:?}: {table:#?}", hall.state);
    took
}

/// A hall whose program dies so many milliseconds after that was asked for in its show; water, air and vibration were on.
fn dies_after(kind: Kind, cue: usize, ask: Option<Transition>, ms: u64) -> Ether {
    let ether = ether(kind, |_| {});
    lead(kind, &ether, LedBefore::Ended, |hall| {
        hall.ride(cue);
        hall.pass(500);
        assert_eq!(on(&hall.ether)[0], (1, true));
        ask.into_iter().for_each(|ask| hall.ask(ask));
        hall.pass(ms);
    });
    ether.pass_to(ether.ns() + 300 * MS);
    ether
}

/// What each seat executed of the hall that opens then is judged as well: nobody asks for anything.
#[track_caller]
fn goes_dark_after(kind: Kind, ether: &Ether, before: LedBefore, what: &str) {
    lead(kind, ether, before, |hall| {
        let took = goes_dark(hall, 2_500, what);
        println!("{what}: {took} ms, {:?}", hall.state);
        assert!(hall.comes_to(|state| !matches!(state, State::Boot), 3_000), "{what}: {:?}", hall.state);
        hall.pass(1_500);
        assert_eq!(on(&hall.ether).iter().filter(|on| **on != (0, false)).count(), 0);
    });
    assert_no_breach(ether);
}

#[test]
fn after_a_crash_in_whichever_phase_every_seat_is_dark_and_still_before_anybody_asks_for_anything() {
    let asks = [
        (None, 0),
        (Some(Transition::Pause), 30),
        (Some(Transition::Stop), 10),
        (Some(Transition::Park), 20),
    ];
    for kind in [THREE, TWO, FAST] {
        for (ask, ms) in asks {
            let ether = dies_after(kind, WET, ask, ms);
            goes_dark_after(kind, &ether, LedBefore::Crashed, &format!("{} Hz, {ask:?} {ms} ms", kind.hz));
        }
    }
    // Where it stands still but for that.
    for cue in [WET_AT_REST, STRONG] {
        let ether = dies_after(THREE, cue, None, 0);
        goes_dark_after(THREE, &ether, LedBefore::Crashed, &format!("cue {cue}"));
    }
}

#[test]
fn after_a_takeover_by_the_other_machine_every_seat_is_dark_and_still_and_the_show_goes_on_when_asked() {
    for kind in [THREE, TWO] {
        let ether = dies_after(kind, WET, None, 0);
        goes_dark_after(kind, &ether, LedBefore::OnCue, "taken over");
    }
    let ether = dies_after(THREE, WET, None, 0);
    lead(THREE, &ether, LedBefore::OnCue, |hall| {
        hall.load(WET);
        assert!(hall.comes_to(|state| state == State::Recovering, 2_500), "{:?}", hall.state);
        goes_dark(hall, 2_500, "taken over");
        hall.pass(1_500);
        hall.ask(Transition::Resume);
        let follows = hall.comes_to(|state| state == State::Playing(PlayMode::Following), 8_000);
        assert!(follows, "{:?}", hall.state);
    });
    assert_no_breach(&ether);
}

#[test]
fn a_seat_of_an_mbox_whose_effects_were_left_on_is_dark_after_a_crash() {
    let kind = MBOXES[0];
    let ether = ether(kind, |_| {});
    ether.world().lines[0].seat.outputs = 0b101;
    lead(kind, &ether, LedBefore::Crashed, |hall| goes_dark(hall, 1_500, "mbox"));
}

/// A seat of two that is cut off in the show, with water and vibration on.
fn cut_off(hall: &mut Hall<'_, '_>, ms: u64) {
    hall.ride(WET);
    hall.pass(500);
    assert_eq!(on(&hall.ether)[0], (1, true));
    hall.ether.turns(0, Weather::Cut, ms);
}

#[test]
fn a_seat_that_is_taken_out_and_then_the_hall_is_parked_keeps_nothing_on() {
    for (lost_ms, out_ms, park_ms) in [(600, 300, 600), (600, 700, 50), (1_500, 200, 100)] {
        let ether = ether(TWO, |_| {});
        lead(TWO, &ether, LedBefore::Ended, |hall| {
            cut_off(hall, lost_ms);
            hall.pass(out_ms);
            let mix = hall.runtime.desk.mix(0);
            hall.set(0, Mix { on: false, ..mix });
            hall.pass(park_ms);
            hall.ask(Transition::Park);
            assert!(hall.comes_to(|state| state == State::Parked, 30_000), "{:?}", hall.state);
            goes_dark(hall, 2_500, &format!("{lost_ms}, {out_ms}, {park_ms} ms"));
            // And put back, nothing moves nor is on.
            hall.set(0, mix);
            hall.pass(1_000);
            assert_eq!(on(&hall.ether), [(0, false); 2]);
        });
        assert_no_breach(&ether);
    }
}

#[test]
fn a_configuration_that_is_read_again_forgets_no_seat_that_was_still_to_be_darkened() {
    for closes_ms in [200, 700, 1_400] {
        let ether = ether(TWO, |_| {});
        lead(TWO, &ether, LedBefore::Ended, |hall| {
            cut_off(hall, 2_000);
            hall.pass(300);
            hall.ask(Transition::Stop);
            hall.pass(closes_ms);
        });
        lead(TWO, &ether, LedBefore::Ended, |hall| {
            hall.pass(2_500);
            goes_dark(hall, 2_500, &format!("closed after {closes_ms} ms"));
        });
        assert_no_breach(&ether);
    }
}

#[test]
fn a_stop_or_a_pause_after_frames_were_lost_for_a_while_is_over_when_the_seats_are_dark_and_still() {
    for kind in [THREE, FAST] {
        for lost_ms in [60, 150, 300, 600, 1_500] {
            for ask in [Transition::Stop, Transition::Pause] {
                let ether = ether(kind, |_| {});
                lead(kind, &ether, LedBefore::Ended, |hall| {
                    hall.ride(WET);
                    hall.pass(500);
                    hall.ether.turns(0, Weather::Lost, lost_ms);
                    hall.pass(lost_ms.saturating_sub(20));
                    hall.ask(ask);
                    hall.pass(40);
                    let what = format!("{} Hz, {lost_ms} ms, {ask:?}", kind.hz);
                    let is_over = |hall: &Hall<'_, '_>| hall.state == State::Stopped;
                    for _ in 0..250 {
                        let left = on(&hall.ether)[0];
                        assert!(!is_over(hall) || left == (0, false), "{what}: stopped with {left:?}");
                        hall.pass(20);
                    }
                    goes_dark(hall, 20, &what);
                    if ask == Transition::Stop {
                        assert_eq!(hall.state, State::Stopped);
                    }
                });
                assert_no_breach(&ether);
            }
        }
    }
}

#[test]
fn nothing_is_left_on_by_a_stop_after_a_sleep_of_seconds_whose_answers_are_held_back_for_longer() {
    for (kind, ask) in [(THREE, Some(Transition::Stop)), (TWO, None), (FAST, Some(Transition::Stop))] {
        let ether = ether(kind, |_| {});
        lead(kind, &ether, LedBefore::Ended, |hall| {
            hall.ride(WET);
            hall.pass(500);
            hall.still(Thread::All, 2_500);
            for seat in 0..kind.axes.len() {
                hall.ether.turns(seat, Weather::HeldBack, 4_000);
            }
            hall.pass(2_550);
            ask.into_iter().for_each(|ask| hall.ask(ask));
            hall.pass(1_450);
            goes_dark(hall, 4_000, &format!("{} Hz, {ask:?}", kind.hz));
        });
        assert_no_breach(&ether);
    }
}

#[test]
fn an_output_that_nobody_asked_for_is_switched_off_wherever_the_hall_rests() {
    for report_ms in [0, 100] {
        let ether = ether(TWO, |seat| seat.report_ms = report_ms);
        lead(TWO, &ether, LedBefore::Ended, |hall| {
            hall.load(WET);
            assert!(hall.comes_to(|state| state == State::Parked, 5_000), "{:?}", hall.state);
            hall.pass(1_000);
            for _ in 0..3 {
                hall.ether.world().lines[1].seat.outputs = 0b100;
                goes_dark(hall, 2_000, "parked");
            }
            let mix = hall.runtime.desk.mix(1);
            hall.set(1, Mix { on: false, ..mix });
            hall.pass(200);
            hall.ether.world().lines[1].seat.outputs = 0b10;
            goes_dark(hall, 2_000, "out");
        });
        assert_no_breach(&ether);
    }
}

#[test]
fn a_seat_that_is_jogged_to_and_fro_after_a_crash_gets_no_frame_as_it_does_not_vibrate() {
    let ether = ether(THREE, |_| {});
    ether.world().lines[0].seat.put(0, 70.0);
    lead(THREE, &ether, LedBefore::Crashed, |hall| {
        hall.pass(50);
        for mm in [8.0, -8.0, 8.0, -8.0, 8.0, -8.0] {
            hall.ether.jog(0, 0, mm, hall.ether.ns());
            hall.pass(400);
        }
        assert_eq!(hall.ether.world().lines[0].frames, 0);
    });
    assert_no_breach(&ether);
}

#[test]
fn a_seat_that_vibrates_and_does_not_know_its_zero_is_told_of_and_gets_no_frame() {
    let ether = dies_after(THREE, WET, None, 0);
    ether.world().lines[0].seat.homed = false;
    let frames = ether.world().lines[0].frames;
    lead(THREE, &ether, LedBefore::Crashed, |hall| {
        hall.pass(4_000);
        let row = hall.runtime.live.table()[0];
        assert!(row.is_left_on_for(std::time::Duration::from_secs(3)), "{row:?}");
        assert_eq!(on(&hall.ether)[0].0, 0);
        assert_eq!(hall.ether.world().lines[0].frames, frames);
    });
    assert_no_breach(&ether);
}
