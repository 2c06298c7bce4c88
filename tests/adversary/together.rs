//! Halls whose seats may get one datagram together: what seats execute is what they would alone, whoever is out is not reached, and
//! every frame is accounted for.

use std::collections::BTreeMap;

use kinocue::harness::engine::Mix;
use kinocue::harness::recording::replayed;
use kinocue::harness::state::{LedBefore, PlayMode, State, Transition};
use kinocue::wire::FrameNo;

use super::bent::Bent;
use super::chance::{Keeps, assert_at_most, live_through, setting, tell};
use super::cues::{Kind, OUTSIDE, TOGETHER};
use super::ether::{Ether, Weather};
use super::hall::{Hall, Thread, breaches, open, seats};

/// Where the histories begin that are always the same.
const FIXED: u64 = 23_000_000;

fn quiet(kind: Kind) -> Ether {
    let ether = Ether::new(&seats(&kind), 7);
    ether.world().executed = Some(vec![Vec::new(); kind.axes.len()]);
    ether
}

fn lead<T>(kind: Kind, ether: &Ether, lead: impl FnOnce(&mut Hall<'_, '_>) -> T) -> T {
    open(ether, kind, LedBefore::Ended, &BTreeMap::new(), lead).0
}

/// Ticks whose frames left as one datagram, and as one for each.
fn ticks(hall: &Hall<'_, '_>) -> [u64; 2] {
    hall.runtime.live.broadcast().expect("it has a network").ticks()
}

fn is_permitted(hall: &Hall<'_, '_>) -> bool {
    hall.runtime.live.broadcast().expect("it has a network").is_permitted()
}

fn frames(hall: &Hall<'_, '_>) -> Vec<u64> {
    hall.ether.world().lines.iter().map(|line| line.frames).collect()
}

/// Plays for so long, and gives how many ticks were together and apart meanwhile.
fn plays(hall: &mut Hall<'_, '_>, ms: u64) -> [u64; 2] {
    let before = ticks(hall);
    hall.pass(ms);
    let after = ticks(hall);
    [after[0] - before[0], after[1] - before[1]]
}

fn switch(hall: &mut Hall<'_, '_>, seat: usize, on: bool) {
    let mix = hall.runtime.desk.mix(seat);
    hall.set(seat, Mix { on, ..mix });
}

/// Once all seats rest: the next show.
#[track_caller]
fn rides_again(hall: &mut Hall<'_, '_>) -> [u64; 2] {
    assert!(hall.comes_to(|state| state == State::Parked, 20_000), "{:?}", hall.state);
    rides_until_asked(hall);
    plays(hall, 600)
}

/// A show begins, and is on the cue until all have been asked: until then each seat gets its own.
#[track_caller]
fn rides_until_asked(hall: &mut Hall<'_, '_>) {
    let motion = hall.ether.world().to_all[0];
    hall.ride(0);
    let [now, questions] = hall.ether.world().to_all;
    assert_eq!(now, motion, "nothing goes to all before they are on the cue and were asked since");
    hall.pass(1_500);
    assert!(hall.ether.world().to_all[1] > questions, "all are asked anew");
}

/// A show in which one datagram goes to all.
#[track_caller]
fn once_together<T>(kind: Kind, ether: &Ether, then: impl FnOnce(&mut Hall<'_, '_>) -> T) -> T {
    lead(kind, ether, |hall| {
        rides_until_asked(hall);
        assert!(plays(hall, 600)[0] > 10);
        then(hall)
    })
}

/// A show from whose beginning on each seat gets its own.
#[track_caller]
fn nothing_goes_to_all(kind: Kind, ether: &Ether) {
    lead(kind, ether, |hall| {
        hall.ride(0);
        let [one, each] = plays(hall, 2_500);
        assert!(one == 0 && each > 10, "{one} as one, {each} as one for each");
        assert_eq!(hall.ether.world().to_all[0], 0);
    });
    assert_eq!(breaches(ether).len(), 0);
}

/// Once nothing moves.
#[track_caller]
fn assert_accounts(hall: &mut Hall<'_, '_>) {
    if hall.state != State::Parked {
        hall.ask(Transition::Stop);
    }
    hall.pass(4_000);
    let sent = frames(hall);
    for (row, sent) in hall.runtime.live.table().iter().zip(sent) {
        let counts = row.counts;
        assert_eq!(counts.sent, sent, "{counts:?}");
        assert_eq!(counts.asked, counts.acked + counts.refused() + counts.lost, "{counts:?}");
        assert_eq!((counts.stray, counts.duplicate), (0, 0), "{counts:?}");
    }
}

/// A ride with a pause, a stop and a way to park; what each seat was led through, frame by frame.
fn executed(kind: Kind) -> (Vec<Vec<Vec<u8>>>, [u64; 2]) {
    let ether = quiet(kind);
    let ticks = lead(kind, &ether, |hall| {
        hall.ride(0);
        hall.pass(2_000);
        hall.ask(Transition::Pause);
        hall.pass(2_500);
        hall.ask(Transition::Resume);
        hall.pass(3_000);
        hall.ask(Transition::Stop);
        hall.pass(3_000);
        hall.ask(Transition::Clear);
        hall.pass(1_000);
        hall.ask(Transition::Park);
        assert!(hall.comes_to(|state| state == State::Parked, 10_000), "{:?}", hall.state);
        let ticks = hall.runtime.live.broadcast().map_or([0; 2], |one| one.ticks());
        assert_accounts(hall);
        ticks
    });
    assert_eq!(breaches(&ether).len(), 0);
    let executed = ether.world().executed.take().expect("they are kept");
    (executed, ticks)
}

#[test]
fn what_seats_are_led_through_by_one_datagram_is_to_the_bit_what_they_would_be_by_their_own() {
    for kind in TOGETHER {
        let (alone, none) = executed(kind.alone());
        let (together, [one, each]) = executed(kind);
        assert_eq!(none, [0, 0]);
        // A seat that was looked at anew after the stop is led to park by itself.
        assert!(one > 50, "{one} as one, {each} as one for each");
        assert!(alone[0].len() > 100);
        for (seat, (alone, together)) in alone.iter().zip(&together).enumerate() {
            assert!(alone == together, "seat {}: {} and {} frames", seat + 1, alone.len(), together.len());
        }
    }
}

#[test]
fn a_seat_that_is_taken_out_is_reached_by_nothing_and_the_others_go_together_again_once_it_is_back() {
    for kind in TOGETHER {
        let ether = quiet(kind);
        once_together(kind, &ether, |hall| {
            switch(hall, 1, false);
            // It parks, and is told so.
            assert_eq!(plays(hall, 3_000)[0], 0);
            let before = frames(hall);
            assert_eq!(plays(hall, 1_000)[0], 0);
            let after = frames(hall);
            assert_eq!(before[1], after[1], "nothing goes to it");
            assert!(!is_permitted(hall));
            assert!(after[0] > before[0] + 10, "the others play on");
            switch(hall, 1, true);
            let [one, each] = rides_again(hall);
            assert!(one > 10 && each == 0, "{one} as one, {each} as one for each");
            assert_accounts(hall);
        });
        assert_eq!(breaches(&ether).len(), 0);
    }
}

#[test]
fn a_seat_that_is_lost_is_reached_by_nothing_until_it_is_back() {
    for kind in TOGETHER {
        let ether = quiet(kind);
        once_together(kind, &ether, |hall| {
            hall.ether.turns(0, Weather::Cut, 3_000);
            hall.pass(2_000);
            let before = frames(hall);
            assert_eq!(plays(hall, 900)[0], 0);
            let after = frames(hall);
            assert_eq!(before[0], after[0], "nothing goes to it");
            assert!(!is_permitted(hall));
            assert!(after[1] > before[1] + 10, "the others play on");
            let [one, each] = rides_again(hall);
            assert!(one > 10 && each == 0, "{one} as one, {each} as one for each");
        });
        assert_eq!(breaches(&ether).len(), 0);
    }
}

#[test]
fn a_seat_with_a_level_of_its_own_gets_frames_of_its_own() {
    let kind = TOGETHER[0];
    let ether = quiet(kind);
    lead(kind, &ether, |hall| {
        let mix = hall.runtime.desk.mix(2);
        hall.set(2, Mix { motion: 0.5, ..mix });
        hall.ride(0);
        hall.pass(600);
        let before = frames(hall);
        let [one, each] = plays(hall, 600);
        assert!(one == 0 && each > 10, "{one} as one, {each} as one for each");
        assert!(is_permitted(hall), "though one might go to all");
        assert!(frames(hall).iter().zip(before).all(|(after, before)| *after > before + 10));
        hall.set(2, mix);
        let goes_together = (0..30).any(|_| plays(hall, 100)[0] > 0);
        assert!(goes_together, "once it has the level of the others");
        assert_accounts(hall);
    });
    assert_eq!(breaches(&ether).len(), 0);
}

#[test]
fn an_answer_to_a_frame_from_somebody_else_ends_it_for_good() {
    let kind = TOGETHER[0];
    once_together(kind, &quiet(kind), |hall| {
        let reply = hall.ether.world().last_reply.clone().expect("there was one");
        hall.ether.world().strangers.push_back(("127.0.1.99:7408".parse().expect("one"), reply));
        // As soon as it is read.
        hall.pass(30);
        let [one, each] = plays(hall, 2_000);
        assert!(one == 0 && each > 10, "{one} as one, {each} as one for each");
        assert_accounts(hall);
    });
}

#[test]
fn nothing_is_sent_together_where_one_does_not_answer_a_broadcast_or_somebody_else_does() {
    let kind = TOGETHER[0];
    for deaf in [true, false] {
        let ether = quiet(kind);
        ether.world().deaf_to_all = deaf.then_some(2);
        ether.world().stranger_answers = (!deaf).then(|| "127.0.1.99:7408".parse().expect("one"));
        lead(kind, &ether, |hall| {
            hall.ride(0);
            let [one, each] = plays(hall, 2_000);
            assert!(one == 0 && each > 10, "{one} as one, {each} as one for each");
        });
        assert_eq!(breaches(&ether).len(), 0);
    }
}

#[test]
fn a_second_controller_with_the_address_of_one_is_found_at_rest_before_anything_goes_to_both() {
    let kind = TOGETHER[0];
    let ether = quiet(kind);
    ether.world().twice = Some(1);
    nothing_goes_to_all(kind, &ether);
}

#[test]
fn a_second_controller_with_the_address_of_one_that_comes_in_mid_show_ends_it_with_its_first_ack() {
    let kind = TOGETHER[0];
    once_together(kind, &quiet(kind), |hall| {
        let before = hall.ether.world().to_all[0];
        hall.ether.world().twice = Some(1);
        let [_, each] = plays(hall, 2_000);
        let reached = hall.ether.world().to_all[0] - before;
        assert!(reached <= 2 && each > 10, "{reached} frames reached it, {each} as one for each");
    });
}

#[test]
fn a_member_whose_acks_are_lost_ends_it_within_a_few_frames_and_until_all_are_asked_anew() {
    for kind in TOGETHER {
        let ether = quiet(kind);
        once_together(kind, &ether, |hall| {
            hall.ether.turns(1, Weather::Mute, 60_000);
            hall.pass(300);
            assert_eq!(plays(hall, 1_000)[0], 0);
        });
        assert_eq!(breaches(&ether).len(), 0);
    }
}

#[test]
fn a_stop_and_a_pause_go_to_each_from_the_first_frame_on() {
    for (kind, request) in
        TOGETHER.iter().flat_map(|kind| [(*kind, Transition::Stop), (*kind, Transition::Pause)])
    {
        let ether = quiet(kind);
        once_together(kind, &ether, |hall| {
            let before = frames(hall);
            let motion = hall.ether.world().to_all[0];
            hall.ask(request);
            hall.pass(2_000);
            assert_eq!(hall.ether.world().to_all[0], motion, "{request:?}");
            assert!(frames(hall).iter().zip(before).all(|(after, before)| *after > before + 5));
            assert_accounts(hall);
        });
        assert_eq!(breaches(&ether).len(), 0);
    }
}

#[test]
fn whenever_a_seat_is_taken_out_and_put_back_all_are_asked_before_one_datagram_goes_to_it_again() {
    let kind = TOGETHER[0];
    // Also in the midst of a look, and for two ticks alone.
    for (at, out) in (0..16).flat_map(|step| [(90 * step, 45), (90 * step, 130)]) {
        let ether = quiet(kind);
        lead(kind, &ether, |hall| {
            hall.ride(0);
            hall.pass(at);
            switch(hall, 1, false);
            let motion = hall.ether.world().to_all[0];
            hall.pass(out);
            assert_eq!(hall.ether.world().to_all[0], motion, "at {at} ms");
            switch(hall, 1, true);
            let asked = hall.ether.world().to_all[1];
            for _ in 0..300 {
                hall.pass(10);
                let [goes, asks] = hall.ether.world().to_all;
                assert!(goes == motion || asks >= asked + 3, "at {at} ms for {out} ms");
            }
        });
        assert_eq!(breaches(&ether).len(), 0, "at {at} ms for {out} ms");
    }
}

#[test]
fn where_the_kernel_takes_nothing_for_all_each_gets_its_own_from_the_next_tick_on() {
    for kind in TOGETHER {
        let ether = quiet(kind);
        lead(kind, &ether, |hall| {
            hall.ride(3);
            hall.pass(1_500);
            assert!(plays(hall, 600)[0] > 10, "{kind:?}");
            hall.ether.world().refuses_all = true;
            hall.pass(100);
            let [one, each] = plays(hall, 1_000);
            assert!(one == 0 && each > 40, "{kind:?}: {one} as one, {each} as one for each");
            assert_eq!(hall.state, State::Playing(PlayMode::Following));
            // The look that is under way then has lost a question; the next one is a second later.
            hall.ether.world().refuses_all = false;
            assert!((0..40).any(|_| plays(hall, 100)[0] > 0), "{kind:?}: once it takes them again");
            assert_accounts(hall);
        });
        assert_eq!(breaches(&ether).len(), 0);
    }
}

#[test]
fn numbers_that_lie_all_over_the_round_have_none_that_is_later_than_all() {
    let kind = TOGETHER[0];
    let rounds =
        [([u32::MAX - 90, 5, 1], true), ([1, 9_000, 1], true), ([1, 1_500_000_000, 3_000_000_000], false)];
    for (firsts, goes_together) in rounds {
        let ether = quiet(kind);
        let number = |(seat, first)| (format!("127.0.1.{seat}:7408"), FrameNo(first));
        let numbers = (1..).zip(firsts).map(number).collect();
        open(&ether, kind, LedBefore::Ended, &numbers, |hall| {
            hall.ride(0);
            hall.pass(1_500);
            let [one, each] = plays(hall, 1_000);
            assert_eq!(one > 40 && each == 0, goes_together, "{one} as one, {each} as one for each");
            assert_eq!(one == 0 && each > 40, !goes_together, "{one} as one, {each} as one for each");
            assert_accounts(hall);
        });
        assert_eq!(breaches(&ether).len(), 0);
    }
}

#[test]
fn a_seat_that_goes_on_with_the_numbers_of_others_is_asked_for_acks_as_often_as_before() {
    let kind = TOGETHER[2];
    let every = (kind.asks_ms() / kind.period_ms()) as u32;
    for out in 0..u64::from(every) {
        let ether = quiet(kind);
        ether.world().frames = Some(Vec::new());
        lead(kind, &ether, |hall| {
            hall.ride(3);
            hall.pass(1_500);
            assert!(plays(hall, 600)[0] > 10);
            switch(hall, 1, false);
            // It parks, and is sent nothing for some seconds.
            hall.pass(8_000 + 10 * out);
            switch(hall, 1, true);
            assert!((0..60).any(|_| plays(hall, 100)[0] > 0));
            assert_accounts(hall);
        });
        let frames = ether.world().frames.take().expect("they are kept");
        for seat in ["seat 1: ", "seat 2: "] {
            let numbers = frames.iter().filter_map(|line| line.split_once(seat)?.1.strip_prefix("frame "));
            let numbers = numbers.map(|line| line.split(',').next().and_then(|text| text.parse().ok()));
            let asks =
                numbers.map(|number: Option<u32>| (number.expect("a number") - 1).is_multiple_of(every));
            let unasked = asks.scan(0, |run, asks| {
                *run = if asks { 0 } else { *run + 1 };
                Some(*run)
            });
            assert!(
                unasked.max().is_some_and(|most| most < every),
                "{seat}after {out} more frames of the other"
            );
        }
    }
}

#[test]
fn while_somebody_else_asks_a_permit_is_ten_seconds_old_at_most() {
    let kind = TOGETHER[0];
    lead(kind, &quiet(kind), |hall| {
        hall.ride(3);
        hall.pass(1_500);
        assert!(plays(hall, 600)[0] > 10);
        let questions = hall.ether.world().to_all[1];
        hall.line.open(true);
        assert!(plays(hall, 5_000)[0] > 200);
        hall.pass(6_000);
        assert_eq!(plays(hall, 1_000)[0], 0);
        assert_eq!(hall.ether.world().to_all[1], questions, "nobody asks in between");
        hall.line.open(false);
        hall.pass(5_000);
        assert!(plays(hall, 600)[0] > 10);
    });
}

#[test]
fn a_look_in_which_the_thread_that_asks_was_held_up_permits_nothing() {
    let kind = TOGETHER[0];
    lead(kind, &quiet(kind), |hall| {
        while hall.ether.world().to_all[1] == 0 {
            hall.pass(1);
        }
        hall.still(Thread::Acks, 400);
        hall.pass(450);
        assert_eq!(hall.ether.world().to_all[1], 1);
        assert!(!is_permitted(hall), "nobody else may have heard it");
        hall.pass(2_000);
        assert!(is_permitted(hall));
    });
}

#[test]
fn a_seat_of_another_network_that_takes_what_goes_to_all_is_found_at_rest() {
    let ether = quiet(OUTSIDE);
    ether.world().outside_takes = true;
    nothing_goes_to_all(OUTSIDE, &ether);
}

#[test]
fn a_seat_of_another_network_that_begins_to_take_it_in_mid_show_ends_it_with_its_first_ack() {
    // One that is out is sent no frame of the numbers that it acks.
    for is_out in [false, true] {
        lead(OUTSIDE, &quiet(OUTSIDE), |hall| {
            hall.pass(1_000);
            switch(hall, 2, !is_out);
            rides_until_asked(hall);
            assert!(plays(hall, 600)[0] > 10);
            let before = hall.ether.world().to_all[0];
            hall.ether.world().outside_takes = true;
            let [_, each] = plays(hall, 1_000);
            let reached = hall.ether.world().to_all[0] - before;
            assert!(reached <= 2 && each > 10, "{reached} frames reached it, {each} as one for each");
            assert!(!is_permitted(hall));
        });
    }
}

#[test]
fn all_are_asked_again_at_rest_and_while_the_show_runs() {
    let kind = TOGETHER[0];
    let ether = quiet(kind);
    let questions = |hall: &Hall<'_, '_>| hall.ether.world().to_all[1];
    lead(kind, &ether, |hall| {
        hall.pass(5_000);
        let first = questions(hall);
        assert!(first >= 3);
        hall.pass(31_000);
        assert_eq!(questions(hall), first + 3, "at rest");
        rides_until_asked(hall);
        let before = questions(hall);
        assert!(plays(hall, 3_500)[0] > 100);
        assert_eq!(questions(hall), before + 3, "on the cue");
    });
    assert_eq!(breaches(&ether).len(), 0);
}

#[test]
fn such_a_history_that_was_recorded_is_judged_again_as_it_was() {
    let (mut differs, mut fates) = (Vec::new(), 0);
    for seed in FIXED..FIXED + 24 {
        for file in live_through(seed, Some(Bent::Together), u64::MAX, Keeps::Recordings).recordings {
            let again = replayed(&file);
            fates += again.fates;
            differs.extend(again.differences.first().map(|one| format!("seed {seed}: {one}")));
        }
    }
    assert!(fates > 400 && differs.is_empty(), "{fates}: {differs:#?}");
}

#[test]
fn no_history_of_seats_that_go_together_moves_one_faster_than_its_type_allows_or_unasked() {
    let (seed, count) =
        (setting("KINOCUE_SEED").unwrap_or(FIXED), setting("KINOCUE_HISTORIES").unwrap_or(300));
    if count == 1 {
        return tell(seed, Some(Bent::Together));
    }
    assert_at_most(0, seed, count, Some(Bent::Together));
}
