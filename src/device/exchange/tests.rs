//! Replies that are not what they should be, by the thousand.

use proptest::prelude::*;

use super::*;
use crate::device::Address;

const PEER: Endpoint = Endpoint { dialect: Dialect::Smc, code: Code::ALL };

fn at(ms: u64) -> MonoTime {
    MonoTime::from_nanos(5_000_000_000 + ms * 1_000_000)
}

/// A right reply to `request`.
fn reply_to(request: &[u8]) -> Vec<u8> {
    let mut reply = request.to_vec();
    reply[5] = 2;
    reply[8..12].fill(0);
    if reply[4] & 0x0f == 1 {
        let words = usize::from(u16::from_be_bytes([reply[14], reply[15]]));
        reply.resize(16 + 2 * words, 0x17);
    }
    reply
}

/// What a network or a bad controller makes of a reply.
fn mangled() -> impl Strategy<Value = Vec<(usize, u8)>> {
    prop::collection::vec((0_usize..90, any::<u8>()), 0..6)
}

fn requests() -> impl Strategy<Value = Request> {
    let address = prop_oneof![
        any::<u8>().prop_map(Address::Pa),
        any::<u8>().prop_map(Address::Dp),
        (1_u16..7, any::<u16>()).prop_map(|(servo, number)| Address::Servo { servo, number }),
    ];
    (address, 1_u16..33, any::<u16>(), any::<bool>(), any::<bool>()).prop_map(
        |(first, count, value, keep, read)| {
            if read { Request::Read { first, count } } else { Request::Write { address: first, value, keep } }
        },
    )
}

/// Asks once, answers every sending with what `replies` makes of the right answer, and gives the outcome and the time
/// it took in milliseconds.
fn run(
    peer: Endpoint,
    request: &Request,
    mut replies: impl FnMut(Vec<u8>) -> Vec<Vec<u8>>,
) -> (RequestOutcome, u64) {
    let mut exchange = Exchange::new(&[peer]);
    exchange.begin(vec![(0, request.clone())], Patience::default());
    for ms in 0..5_000 {
        while let Some(bytes) = exchange.due(0, at(ms)) {
            let reply = reply_to(bytes);
            for bytes in replies(reply) {
                exchange.on_datagram(0, &bytes, at(ms));
            }
        }
        if exchange.finished() {
            return (exchange.take().pop().unwrap(), ms);
        }
    }
    panic!("it never ends")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn no_mutated_reply_panics_or_keeps_a_request_past_its_time(
        request in requests(),
        mangled in mangled(),
        cut in 0_usize..90,
        longer in prop::collection::vec(any::<u8>(), 0..8),
        mbox in any::<bool>(),
    ) {
        let dialect = if mbox { Dialect::Mbox } else { Dialect::Smc };
        let peer = Endpoint { dialect, ..PEER };
        let (outcome, ms) = run(peer, &request, |mut reply| {
            for (place, byte) in &mangled {
                if let Some(there) = reply.get_mut(*place) {
                    *there ^= byte;
                }
            }
            reply.truncate(cut);
            reply.extend(&longer);
            vec![reply]
        });
        prop_assert!(ms <= 900, "{ms} ms");
        match (&outcome.result, &request) {
            (Ok(answer), Request::Read { count, .. }) => {
                prop_assert_eq!(answer.words.len(), usize::from(*count));
            }
            (Ok(_), Request::Write { .. }) => {}
            (Err(fault), _) => prop_assert_eq!(fault.to_string().lines().count(), 1),
        }
    }
}

#[test]
fn the_right_reply_is_taken_and_only_that() {
    let read = Request::Read { first: Address::Pa(0x80), count: 6 };
    let (outcome, ms) = run(PEER, &read, |reply| vec![b"?".to_vec(), reply.clone(), reply]);
    assert_eq!((outcome.result.unwrap().words, ms), (vec![0x1717; 6], 0));
    let (outcome, ms) = run(PEER, &read, |_| vec![]);
    assert!(matches!(outcome.result, Err(Fault::Silent { tries: 3, .. })));
    assert_eq!(ms, 900);
}

#[test]
fn registers_of_a_drive_are_told_by_that_drive_alone() {
    let read = Request::Read { first: Address::Servo { servo: 2, number: 508 }, count: 6 };
    let told = |servo| {
        run(PEER, &read, |mut reply| {
            reply[7] = servo;
            vec![reply]
        })
        .0
        .result
    };
    assert_eq!(told(2).unwrap().words, [0x1717; 6]);
    let Err(Fault::Silent { odd, .. }) = told(1) else { panic!("that was another drive") };
    assert_eq!(odd, Some(Odd::Foreign { start: 508, num: 6 }));
    let write = Request::write(Address::Servo { servo: 2, number: 508 }, 7);
    let (outcome, _) = run(PEER, &write, |reply| vec![reply]);
    assert_eq!(outcome.result.unwrap().words, [7]);
}

#[test]
fn x_3_and_4_tell_of_an_smc_controllers_state_and_refuse_on_mbox() {
    let read = Request::read(Address::Pa(2));
    let with = |peer: Endpoint, x: u8, slot: u8, words: usize| {
        let (outcome, _) = run(peer, &read, |mut reply| {
            (reply[5], reply[7]) = (x, slot);
            reply.truncate(16 + 2 * words);
            vec![reply]
        });
        outcome.result
    };
    let answer = with(PEER, 3, 12, 1).unwrap();
    assert_eq!((answer.code, answer.error, answer.words), (ReplyCode::Fault, DeviceError(12), vec![0x1717]));
    assert!(matches!(with(PEER, 3, 12, 0), Err(Fault::Refused { error: DeviceError(12), .. })));
    assert_eq!(with(PEER, 4, 0, 1).unwrap().code, ReplyCode::EmergencyStop);
    assert!(matches!(with(PEER, 5, 0, 1), Err(Fault::Refused { code: ReplyCode::Command, .. })));
    let mbox = Endpoint { dialect: Dialect::Mbox, ..PEER };
    // The channel stays, and an error number stands where the words belong.
    let Err(Fault::Refused { error, .. }) = with(mbox, 3, 1, 1) else { panic!("it was refused") };
    assert_eq!(error, DeviceError(0x1717));
    assert!(matches!(with(mbox, 3, 0, 1), Err(Fault::Silent { .. })), "another channel's");
}

#[test]
fn a_late_refusal_that_does_not_tell_its_channel_is_not_taken_for_another_registers() {
    let mut exchange = Exchange::new(&[PEER]);
    let once = Patience { timeout: Duration::from_millis(100), tries: 1 };
    exchange.begin(vec![(0, Request::read(Address::Dp(7)))], once);
    let mut late = reply_to(exchange.due(0, at(0)).unwrap());
    (late[5], late[7]) = (3, 12); // in place of the channel, the error number
    assert!(exchange.due(0, at(100)).is_none());
    exchange.begin(vec![(0, Request::read(Address::Pa(7)))], once);
    assert!(exchange.due(0, at(101)).is_none(), "PA07 is not asked for while DP07 may still be answered");
    exchange.on_datagram(0, &late, at(150));
    assert_eq!(exchange.odds(0).late, 1);
    assert!(exchange.due(0, at(151)).is_some());
}

#[test]
fn a_late_reply_is_counted_as_late() {
    let mut exchange = Exchange::new(&[PEER]);
    exchange.begin(
        vec![(0, Request::read(Address::Pa(2)))],
        Patience { timeout: Duration::from_millis(100), tries: 1 },
    );
    let reply = reply_to(exchange.due(0, at(0)).unwrap());
    assert_eq!(exchange.wake(), Some(at(100)));
    assert!(exchange.due(0, at(100)).is_none() && exchange.finished());
    exchange.on_datagram(0, &reply, at(150));
    exchange.on_datagram(0, &reply, at(151));
    assert_eq!(exchange.odds(0), Odds { late: 1, foreign: 1, ..Odds::default() });
}

#[test]
fn a_motion_reply_is_left_to_others() {
    let mut exchange = Exchange::new(&[PEER]);
    let mut motion = vec![0; 38];
    motion[..6].copy_from_slice(&[0x55, 0xaa, 0, 0, 0x14, 2]);
    assert!(!exchange.on_datagram(0, &motion, at(0)));
    assert!(exchange.on_datagram(0, b"junk", at(0)));
}
