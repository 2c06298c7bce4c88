//! Whole conversations with virtual controllers, in virtual time.

use std::net::Ipv4Addr;

use super::*;
use crate::device::testing::{Rig, millis};
use crate::device::{Address, Fault, Odd, reads, table};
use crate::sim::Setup;
use crate::wire::{Dialect, ReplyCode};

fn all(dialect: Dialect) -> Vec<Address> {
    table().of(dialect).map(|register| register.address).collect()
}

fn hall(count: usize, mute: impl Fn(usize) -> bool) -> Rig {
    Rig::of((0..count).map(|n| Setup { mute: mute(n), ..Setup::default() }).collect())
}

#[test]
fn sixty_four_controllers_of_which_eight_are_dead_are_read_whole_in_seconds() {
    let rig = hall(64, |n| n % 8 == 3);
    let reads = reads(&all(Dialect::Smc));
    assert!(reads.len() > 20);
    let requests = (0..64).flat_map(|lane| reads.iter().map(move |read| (lane, read.clone()))).collect();
    let outcomes = rig.talk().ask(requests, Patience::default());
    assert_eq!(outcomes.len(), 64 * reads.len());
    for outcome in &outcomes {
        assert_eq!(outcome.result.is_err(), outcome.lane % 8 == 3, "{}: {:?}", outcome.lane, outcome.result);
    }
    let silent = outcomes.iter().filter(|outcome| matches!(outcome.result, Err(Fault::Silent { .. })));
    assert_eq!(silent.count(), 8, "a dead controller is given up with its first request");
    assert!(rig.elapsed() < millis(1_500), "{:?}", rig.elapsed());
}

#[test]
fn what_is_written_is_read_back_in_both_dialects() {
    for dialect in [Dialect::Smc, Dialect::Mbox] {
        let rig = Rig::of(vec![Setup { dialect, ..Setup::default() }]);
        let address = Address::Pa(0x95);
        let requests = vec![(0, Request::write(address, 6)), (0, Request::read(address))];
        let outcomes = rig.talk().ask(requests, Patience::default());
        for outcome in &outcomes {
            assert_eq!(outcome.result.as_ref().unwrap().words, [6], "{dialect:?}");
        }
        assert_eq!(outcomes[0].result.as_ref().unwrap().took, Duration::from_micros(700));
    }
}

#[test]
fn an_mbox_controller_is_never_asked_to_write_a_monitor_register() {
    let rig = Rig::of(vec![Setup { dialect: Dialect::Mbox, ..Setup::default() }]);
    let outcomes = rig.talk().ask(vec![(0, Request::write(Address::Dp(0x34), 1))], Patience::default());
    assert!(matches!(outcomes[0].result, Err(Fault::NoWay { .. })));
    assert_eq!(rig.received(), 0);
}

#[test]
fn a_reply_that_is_lost_is_asked_for_again() {
    let rig = hall(1, |_| false);
    rig.filter(|nth, reply| if nth < 2 { vec![] } else { vec![reply] });
    let outcomes = rig.talk().ask(vec![(0, Request::read(Address::Pa(7)))], Patience::default());
    let answer = outcomes[0].result.as_ref().unwrap();
    assert_eq!((answer.tries, answer.words.as_slice()), (3, &[3_000][..]));
}

#[test]
fn an_equal_request_waits_until_no_late_answer_to_the_one_before_can_come() {
    let rig = hall(1, |_| false);
    rig.filter(|nth, reply| if nth == 0 { vec![] } else { vec![reply] });
    let (mut talk, read) = (rig.talk(), Request::read(Address::Dp(0xf0)));
    talk.ask(vec![(0, read.clone())], Patience::default());
    let before = rig.elapsed();
    talk.ask(vec![(0, Request::read(Address::Pa(2)))], Patience::default());
    assert!(rig.elapsed() < before + millis(5), "another request does not wait");
    talk.ask(vec![(0, read)], Patience::default());
    assert!(rig.elapsed() > before + millis(900), "{:?} {before:?}", rig.elapsed());
}

#[test]
fn a_repeated_reply_is_counted_and_never_taken_for_the_next_answer() {
    let rig = hall(1, |_| false);
    rig.filter(|_, reply| vec![reply.clone(), reply]);
    let mut talk = rig.talk();
    let requests = [0x06, 0x07, 0x0b].map(|number| (0, Request::read(Address::Pa(number)))).to_vec();
    let words: Vec<_> =
        talk.ask(requests, Patience::default()).into_iter().map(|one| one.result.unwrap().words).collect();
    assert_eq!(words, [[1], [3_000], [3_000]]);
    assert_eq!(talk.odds(0).duplicate, 3);
}

#[test]
fn a_controller_in_emergency_stop_is_still_read_and_says_so() {
    let rig = Rig::of(vec![Setup { estop_at: Some(Duration::ZERO), ..Setup::default() }]);
    let outcomes = rig.talk().ask(vec![(0, Request::read(Address::Pa(7)))], Patience::default());
    let answer = outcomes[0].result.as_ref().unwrap();
    assert_eq!((answer.words.as_slice(), answer.code), (&[3_000][..], ReplyCode::EmergencyStop));
}

#[test]
fn what_a_controller_refuses_is_told_and_the_next_request_goes_on() {
    let rig = hall(1, |_| false);
    let servo = Address::Servo { servo: 9, number: 508 }; // there are three
    let requests = vec![(0, Request::read(servo)), (0, Request::read(Address::Pa(2)))];
    let outcomes = rig.talk().ask(requests, Patience::default());
    let error = outcomes[0].result.as_ref().unwrap_err();
    assert!(error.refused());
    let text = error.to_string();
    assert!(text.starts_with("cannot read servo 9 508: refused, the command was wrong"), "{text}");
    assert_eq!(outcomes[1].result.as_ref().unwrap().words, [3]);
}

#[test]
fn a_controller_whose_registers_have_32_bits_is_asked_once_and_nothing_behind_that_is_sent() {
    let rig = hall(1, |_| false);
    rig.filter(|_, reply| vec![[reply, vec![0, 0]].concat()]);
    let requests = [0x95, 0x96].map(|number| (0, Request::read(Address::Pa(number))));
    let outcomes = rig.talk().ask(requests.to_vec(), Patience::default());
    assert!(matches!(outcomes[0].result, Err(Fault::Foreign { .. })), "{:?}", outcomes[0].result);
    assert!(matches!(outcomes[1].result, Err(Fault::Unasked { .. })), "{:?}", outcomes[1].result);
    assert!(rig.elapsed() < millis(300), "it waits for no other answer");
}

#[test]
fn truncated_long_and_foreign_replies_and_lying_counts_end_in_one_line_that_says_so() {
    let read = Request::read(Address::Pa(0x95));
    let told = |mangle: fn(Vec<u8>) -> Vec<u8>| {
        let rig = hall(1, |_| false);
        rig.filter(move |_, reply| vec![mangle(reply)]);
        let outcomes = rig.talk().ask(vec![(0, read.clone())], Patience::default());
        assert!(rig.elapsed() < millis(910));
        let Err(Fault::Silent { odd: Some(odd), .. }) = &outcomes[0].result else {
            panic!("{:?}", outcomes[0].result)
        };
        assert!(!odd.to_string().contains('\n'));
        *odd
    };
    assert!(matches!(told(|reply| reply[..17].to_vec()), Odd::Malformed(_)));
    assert!(matches!(told(|reply| reply[..11].to_vec()), Odd::Malformed(_)));
    assert!(matches!(told(|reply| [reply, vec![0]].concat()), Odd::Malformed(_)));
    assert!(
        matches!(
            told(|mut reply| {
                reply[15] = 9;
                reply
            }),
            Odd::Malformed(_)
        ),
        "counts more than it has"
    );
    assert!(
        matches!(
            told(|mut reply| {
                reply[15] = 0;
                reply
            }),
            Odd::Malformed(_)
        ),
        "counts less than it has"
    );
    assert_eq!(
        told(|mut reply| {
            reply[13] = 0x96;
            reply
        }),
        Odd::Foreign { start: 0x96, num: 1 }
    );
    assert_eq!(
        told(|mut reply| {
            reply[7] = 0;
            reply
        }),
        Odd::Foreign { start: 0x95, num: 1 },
        "DP, not PA"
    );
    assert_eq!(
        told(|mut reply| {
            reply[4] = 0x12;
            reply
        }),
        Odd::Foreign { start: 0x95, num: 1 },
        "a write"
    );
}

#[test]
fn a_reboot_is_asked_for_once_though_its_answer_is_lost() {
    let rig = hall(1, |_| false);
    rig.filter(|_, _| vec![]);
    let outcomes = rig.talk().ask(vec![(0, Request::write(Address::Dp(0xf2), 1))], Patience::default());
    assert!(matches!(outcomes[0].result, Err(Fault::Silent { tries: 1, .. })));
    assert_eq!(rig.received(), 1);
}

#[test]
fn a_controller_that_reboots_halfway_costs_one_silence_and_answers_again_later() {
    let rig = hall(2, |_| false);
    let mut talk = rig.talk();
    let reboot = Request::write(Address::Dp(0xf2), 1);
    let reads = [2, 7, 9].map(|number| Request::read(Address::Pa(number)));
    let requests = [
        (0, reads[0].clone()),
        (0, reboot),
        (0, reads[1].clone()),
        (0, reads[2].clone()),
        (1, reads[1].clone()),
    ];
    let outcomes = talk.ask(requests.to_vec(), Patience::default());
    assert!(outcomes[1].result.is_ok() && outcomes[4].result.is_ok());
    assert!(matches!(outcomes[2].result, Err(Fault::Silent { .. })));
    assert!(matches!(outcomes[3].result, Err(Fault::Unasked { .. })));
    let until = talk.now() + Duration::from_secs(3);
    talk.wait(until, &mut |_, _, _| {});
    let outcomes = talk.ask(vec![(0, reads[2].clone())], Patience::default());
    assert_eq!(outcomes[0].result.as_ref().unwrap().words, [100]);
}

#[test]
fn a_stranger_is_counted_and_not_believed() {
    let rig = hall(1, |_| false);
    rig.filter(|_, _| vec![]);
    let stranger = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 66), 7408);
    rig.inject(Origin::Stranger(stranger), b"\x55\xaa\0\0\x11\x02\0\x01\0\0\0\0\0\x95\0\x01\0\x06".to_vec());
    let mut talk = rig.talk();
    let mut watched = 0;
    let patience = Patience { timeout: millis(100), tries: 2 };
    let requests = vec![(0, Request::read(Address::Pa(0x95)))];
    let outcomes = talk.ask_watching(requests, patience, &mut |_, _, _| watched += 1);
    assert!(matches!(outcomes[0].result, Err(Fault::Silent { odd: None, tries: 2, .. })));
    assert_eq!((talk.strangers().get(&stranger), watched), (Some(&1), 1));
}
