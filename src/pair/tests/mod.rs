mod world;

use std::time::Duration;

use super::*;
use crate::time::MonoTime;
use world::{Faults, World};

fn ms(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

/// How many worlds there are; a night has more.
fn worlds(usual: u64) -> u64 {
    std::env::var("KINOCUE_PAIRS").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[test]
fn whatever_halts_is_lost_late_twice_or_forgotten_no_two_machines_lead_at_one_instant() {
    let (mut takeovers, mut frames) = (0, 0);
    for seed in 0..worlds(400) {
        let mut world = World::new(seed, Faults::ALL);
        world.run_for(Duration::from_secs(60));
        takeovers += world.takeovers;
        frames += world.frames;
    }
    assert!(takeovers > 400 && frames > 100_000, "little happened: {takeovers} takeovers, {frames} frames");
}

#[test]
fn a_machine_that_dies_is_replaced_within_two_seconds_where_the_engine_answers() {
    for seed in 0..100 {
        let mut world = World::new(seed, Faults::NONE);
        world.run_for(Duration::from_millis(8_000 + 37 * seed));
        let leader = world.leader().expect("one leads");
        world.kill(leader);
        let silence = world.silence_until_the_other_leads(Duration::from_secs(5));
        assert!(silence.is_some_and(|one| one < Duration::from_secs(2)), "seed {seed}: {silence:?}");
    }
}

#[test]
fn while_the_engine_is_away_or_the_other_machine_the_leader_leads_on_and_nobody_takes_over() {
    for seed in 0..20 {
        for (engine, partner) in [(true, false), (false, true)] {
            let mut world = World::new(seed, Faults::NONE);
            world.run_for(Duration::from_secs(8));
            let leader = world.leader().expect("one leads");
            world.cut(engine, partner);
            world.run_for(Duration::from_secs(10));
            assert_eq!(world.leader(), Some(leader), "seed {seed}, engine away: {engine}");
            assert_eq!(world.takeovers, 1);
            // What comes back is asked again, a key that is gone made anew, and then the other may go.
            world.forget();
            world.cut(false, false);
            world.run_for(Duration::from_secs(8));
            world.cut(false, true);
            world.run_for(Duration::from_secs(5));
            assert_eq!(world.leader(), Some(leader), "seed {seed}, engine away: {engine}");
        }
    }
}

#[test]
fn with_both_away_the_lead_ends_a_second_after_the_last_promise_was_asked_for() {
    let mut world = World::new(1, Faults::NONE);
    world.run_for(Duration::from_secs(8));
    let leader = world.leader().expect("one leads");
    world.cut(true, true);
    world.run_for(Duration::from_millis(900));
    assert_eq!(world.leader(), Some(leader));
    world.run_for(Duration::from_millis(102));
    assert_eq!(world.leader(), None);
    world.run_for(Duration::from_secs(20));
    assert_eq!(world.leader(), None, "the other one knows no more");
}

#[test]
fn of_two_that_start_the_first_leads_and_one_that_is_alone_does_not_without_a_key_or_a_persons_word() {
    let mut world = World::new(2, Faults::NONE);
    world.run_for(Duration::from_secs(3));
    assert_eq!(world.leader(), Some(0));
    for alone in [0, 1] {
        let mut world = World::new(2, Faults::NONE);
        world.kill(1 - alone);
        world.run_for(Duration::from_secs(30));
        assert_eq!(world.leader(), None);
        world.start_alone(alone);
        world.run_for(Duration::from_secs(3));
        assert_eq!(world.leader(), Some(alone));
    }
}

fn beat(from: u64, to: u64, number: u64, leads: bool, word: u64) -> Beat {
    Beat { from, to, number, echo: 0, leads, wants: false, word, print: 0 }
}

/// Has a machine receive a beat that echoes what it has sent at that very time.
fn hear(claim: &mut Claim, beat: &Beat, now: MonoTime) -> bool {
    let echo = claim.beat(now).number;
    claim.hear(&Beat { echo, ..*beat }, now)
}

#[test]
fn what_was_recorded_and_is_sent_again_promises_nothing() {
    let mut claim = Claim::new(7, true, ms(0));
    hear(&mut claim, &beat(9, 7, 1, false, 0), ms(1_300));
    let asked = claim.beat(ms(1_310));
    assert!(asked.wants && asked.to == 9);
    for (old, why) in [
        (beat(9, 6, 2, false, asked.number), "for a session of ours that is over"),
        (beat(8, 7, 2, false, asked.number), "of another session"),
        (beat(9, 7, 1, false, asked.number), "a number that came before"),
        (beat(7, 7, 2, false, asked.number), "our own"),
        (beat(9, 7, 2, false, asked.number + 2), "the word for what was not asked"),
    ] {
        let mut claim = claim.clone();
        hear(&mut claim, &old, ms(1_320));
        assert_eq!(claim.role(ms(1_320)), Role::Follows, "{why}");
    }
    hear(&mut claim, &beat(9, 7, 2, false, asked.number), ms(1_320));
    assert_eq!(claim.role(ms(1_320)), Role::Leads { until: ms(2_310) }, "from when it was asked for");
    hear(&mut claim, &beat(9, 7, 2, false, asked.number), ms(1_330));
    assert_eq!(claim.role(ms(2_310)), Role::Lost);
    hear(&mut claim, &beat(9, 7, 3, false, asked.number), ms(2_320));
    assert_eq!(claim.role(ms(2_320)), Role::Lost, "it never leads again");
}

#[test]
fn beats_that_were_recorded_count_for_nothing_once_their_machine_is_silent_whatever_comes_between() {
    let mut claim = Claim::new(7, false, ms(0));
    let mut recorded = Vec::new();
    for (number, at) in (1..).zip((1_300..2_300).step_by(20)) {
        let echo = claim.beat(ms(at)).number;
        let beat = Beat { echo, ..beat(9, 7, number, true, 0) };
        assert!(claim.hear(&beat, ms(at + 1)));
        recorded.push(beat);
    }
    let silent = 2_300 + 600;
    for between in [
        vec![],
        vec![beat(8, 6, 40, true, 0)],
        vec![beat(8, 0, 1, false, 0)],
        vec![beat(8, 7, 1, true, 0), beat(8, 0, 2, false, 0)],
    ] {
        let mut claim = claim.clone();
        between.iter().for_each(|beat| assert!(!claim.hear(beat, ms(silent)), "{beat:?}"));
        for (beat, at) in recorded.iter().zip((silent..).step_by(20)) {
            assert!(!claim.hear(beat, ms(at)), "{beat:?} after {between:?}");
            claim.beat(ms(at + 10));
        }
        assert!(!claim.hears(ms(silent)));
        // The machine itself is back, started anew: it introduces itself, and is heard as soon as it echoes.
        let at = ms(silent + 1_100);
        assert!(!claim.hear(&beat(10, 0, 1, false, 0), at));
        let ours = claim.beat(at);
        assert_eq!((ours.to, ours.echo), (10, 1));
        assert!(claim.hear(&Beat { echo: ours.number, ..beat(10, 7, 2, false, 0) }, at));
    }
}

#[test]
fn a_beat_counts_once_and_only_where_it_is_newer_than_a_beat_of_ours_of_just_now() {
    let mut claim = Claim::new(7, false, ms(0));
    let asked = claim.beat(ms(1_300)).number;
    let answer = |number, echo| Beat { echo, ..beat(9, 7, number, true, 0) };
    assert!(claim.clone().hear(&answer(1, asked), ms(1_899)));
    assert!(!claim.clone().hear(&answer(1, asked), ms(1_900)), "late");
    assert!(!claim.clone().hear(&answer(1, asked + 1), ms(1_301)), "it echoes what has not left");
    assert!(!claim.clone().hear(&answer(1, 0), ms(1_301)), "it echoes nothing");
    assert!(claim.hear(&answer(5, asked), ms(1_301)));
    assert!(!claim.hear(&answer(5, asked), ms(1_302)) && !claim.hear(&answer(4, asked), ms(1_302)));
    assert!(claim.hear(&answer(6, asked), ms(1_302)));
}

#[test]
fn a_leader_whose_clock_stood_still_leads_no_more_once_it_hears_the_other_one_lead() {
    let mut claim = Claim::new(7, true, ms(0));
    hear(&mut claim, &beat(9, 7, 1, false, 0), ms(1_300));
    let asked = claim.beat(ms(1_310)).number;
    hear(&mut claim, &beat(9, 7, 2, false, asked), ms(1_320));
    assert_eq!(claim.role(ms(1_320)), Role::Leads { until: ms(2_310) });
    // It is paused here, with its clock; the other one waits for 1.2 s and leads.
    assert!(hear(&mut claim, &beat(9, 7, 80, true, 0), ms(1_330)));
    assert_eq!(claim.role(ms(1_331)), Role::Lost);
    hear(&mut claim, &beat(9, 7, 81, false, asked), ms(1_340));
    assert_eq!(claim.role(ms(1_341)), Role::Lost, "for good");
}

#[test]
fn a_word_is_given_once_for_each_beat_that_asks_and_by_no_machine_that_leads_or_claims() {
    let mut claim = Claim::new(7, false, ms(0));
    hear(&mut claim, &beat(9, 7, 5, true, 0), ms(100));
    assert_eq!(claim.beat(ms(110)).word, 5);
    assert_eq!(claim.beat(ms(130)).word, 0);
    hear(&mut claim, &beat(9, 7, 6, false, 0), ms(140));
    assert_eq!(claim.beat(ms(150)).word, 0, "nobody asked");
    // It sees a key that nobody renews, and asks for it once its own word is over.
    let holder = Holder { session: 9, count: 3, print: 0 };
    let (mut now, mut wanted) = (150, Want::Read);
    while wanted == Want::Read {
        now += 100;
        let ask = claim.ask(ms(now));
        wanted = ask.want;
        if wanted == Want::Read {
            claim.answer(ask.ticket, Answer::Key { holder, revision: 40 }, ms(now));
        }
    }
    assert_eq!(now, 1_450, "1.2 s after it was seen first");
    assert!(matches!(wanted, Want::Swap { revision: 40, .. }));
    hear(&mut claim, &beat(9, 7, 7, true, 0), ms(now + 10));
    assert_eq!(claim.beat(ms(now + 20)).word, 0);
    let mut leads = claim.clone();
    leads.answer(claim_ticket(&wanted), Answer::Granted { revision: 41 }, ms(now + 90));
    assert_eq!(
        leads.role(ms(now + 90)),
        Role::Leads { until: ms(now + 1_000) },
        "from when it was asked for"
    );
    assert_eq!(leads.beat(ms(now + 100)).word, 0);
    // What is asked and not answered keeps no lease.
    leads.ask(ms(now + 500));
    assert!(leads.has_lease(ms(now + 599)) && !leads.has_lease(ms(now + 600)));
    claim.answer(claim_ticket(&wanted), Answer::Refused, ms(now + 90));
    assert_eq!((claim.role(ms(now + 90)), claim.beat(ms(now + 100)).word), (Role::Follows, 0));
}

fn claim_ticket(want: &Want) -> u64 {
    let Want::Swap { holder, .. } = want else { panic!("{want:?}") };
    holder.count
}

#[test]
fn a_key_is_not_taken_by_an_old_look_nor_one_that_was_written_just_now() {
    let holder = Holder { session: 9, count: 3, print: 0 };
    let look = |revision: u64, last: u64| {
        let mut claim = Claim::new(7, false, ms(0));
        for at in [100, last] {
            let ask = claim.ask(ms(at));
            claim.answer(ask.ticket, Answer::Key { holder, revision }, ms(at));
        }
        claim
    };
    let takes = |mut claim: Claim, at| claim.ask(ms(at)).want != Want::Read;
    assert!(takes(look(15, 1_250), 1_350));
    assert!(!takes(look(15, 1_250), 1_299), "seen for less than 1.2 s");
    assert!(!takes(look(14, 1_250), 1_350), "written too few times");
    assert!(!takes(look(15, 1_250), 1_551), "looked at too long ago");
}

#[test]
fn a_machine_that_hears_a_leader_or_has_given_it_its_word_leaves_a_key_alone_that_nobody_renews() {
    let holder = Holder { session: 9, count: 3, print: 0 };
    let look = |claim: &mut Claim, at| {
        let ask = claim.ask(ms(at));
        assert_eq!(ask.want, Want::Read, "at {at} ms");
        claim.answer(ask.ticket, Answer::Key { holder, revision: 40 }, ms(at));
    };
    let mut claim = Claim::new(7, false, ms(0));
    look(&mut claim, 100);
    look(&mut claim, 1_400);
    assert!(matches!(claim.clone().ask(ms(1_420)).want, Want::Swap { .. }), "nobody is heard");
    hear(&mut claim, &beat(9, 7, 1, true, 0), ms(1_410));
    assert_eq!(claim.ask(ms(1_420)).want, Want::Read, "it hears that the other one leads");
    assert_eq!(claim.beat(ms(1_430)).word, 1);
    // The other one is away since 2,010 ms, and may lead by this word alone until 2,430 ms.
    look(&mut claim, 2_300);
    assert_eq!(claim.ask(ms(2_400)).want, Want::Read, "it has given its word");
    look(&mut claim, 2_600);
    assert!(matches!(claim.ask(ms(2_640)).want, Want::Swap { .. }), "its word is over");
}

/// A machine of that configuration that sees a key of another day, which nobody renews.
fn alone_with(print: u64, key: u64) -> Claim {
    let mut claim = Claim::new(7, true, ms(0));
    claim.set_print(print);
    for at in [100, 1_250] {
        let ask = claim.ask(ms(at));
        let holder = Holder { session: 9, count: 3, print: key };
        claim.answer(ask.ticket, Answer::Key { holder, revision: 40 }, ms(at));
    }
    claim
}

#[test]
fn a_machine_that_was_started_again_with_another_configuration_than_led_last_does_not_lead_unless_a_person_says_so()
 {
    for (key, is_fit) in [(5, true), (0, true), (6, false)] {
        let mut claim = alone_with(5, key);
        assert_eq!(claim.misfit(ms(1_300)), (!is_fit).then_some(PairMisfit::Leader));
        let ask = claim.ask(ms(1_350));
        assert_eq!(matches!(ask.want, Want::Swap { .. }), is_fit, "{ask:?}");
        if let Want::Swap { holder, .. } = ask.want {
            assert_eq!(holder.print, 5, "the next one is told which configuration leads now");
        }
    }
    let mut claim = alone_with(5, 6);
    claim.is_alone(ms(1_300));
    assert!(matches!(claim.ask(ms(1_350)).want, Want::Swap { revision: 40, .. }));
}

#[test]
fn of_two_with_different_configurations_neither_begins_to_lead_until_they_are_the_same() {
    let other = |print| Beat { print, ..beat(9, 7, 1, false, 0) };
    let mut claim = Claim::new(7, true, ms(0));
    claim.set_print(5);
    hear(&mut claim, &other(6), ms(1_290));
    assert_eq!((claim.beat(ms(1_310)).wants, claim.misfit(ms(1_310))), (false, Some(PairMisfit::Other)));
    let mut by_word = claim.clone();
    let number = by_word.beat(ms(1_320)).number;
    hear(&mut by_word, &Beat { print: 6, number: 2, ..beat(9, 7, 2, false, number) }, ms(1_330));
    assert_eq!(by_word.role(ms(1_330)), Role::Follows);
    // The one that is heard counts, whoever led on another day.
    let mut claim = alone_with(5, 6);
    hear(&mut claim, &other(5), ms(1_290));
    assert_eq!((claim.beat(ms(1_310)).wants, claim.misfit(ms(1_310))), (true, None));
}
