//! Surveys of virtual controllers, in virtual time.

use super::*;
use crate::config::from_to_args;
use crate::device::testing::{Rig, millis};
use crate::motion::Pulses;
use crate::sim::Setup;
use crate::wire::{Code, MAX_LEN, PerAxis, Status};

/// Whatever happens, a survey of 64 controllers ends within this.
const LIMIT: Duration = Duration::from_secs(10);

fn wanted() -> Vec<Address> {
    let ranges = [0x00..=0x0d, 0x1e..=0x29, 0x55..=0x55, 0x80..=0x85, 0x90..=0x9d, 0xa0..=0xa5, 0xb0..=0xb5];
    let parameters = ranges.into_iter().flatten().map(Address::Pa);
    parameters.filter(|it| table().get(*it).is_some()).chain([Address::Dp(0xfe), Address::Dp(0xff)]).collect()
}

fn controllers(count: usize) -> Vec<Controller<Station>> {
    let to: Vec<_> = (0..count).map(|n| format!("127.0.0.1:{}", 7_408 + n)).collect();
    from_to_args(&to, &[], 3).unwrap().stations()
}

fn run(rig: &Rig) -> Vec<Survey> {
    let controllers = controllers(rig.lanes());
    survey(&mut rig.talk(), &controllers, &vec![wanted(); rig.lanes()], &mut |_| {})
}

fn hall(count: usize, mute: impl Fn(usize) -> bool) -> Rig {
    Rig::of((0..count).map(|n| Setup { mute: mute(n), ..Setup::default() }).collect())
}

#[test]
fn a_survey_tells_every_wanted_register_and_twenty_round_trips() {
    let found = run(&hall(1, |_| false)).remove(0);
    for address in wanted() {
        assert!(found.values.contains_key(&address), "{address}");
    }
    assert_eq!(found.values[&Address::Pa(0x13)], 1, "its own address");
    assert_eq!((found.round_trips.len(), found.rounds), (ROUNDS, ROUNDS));
    assert!(found.round_trips.iter().all(|took| *took == Duration::from_micros(700)));
    assert!(found.answered() && found.unread.is_empty() && found.state.is_none() && found.changed.is_empty());
    assert_eq!((found.foreign_packets, found.odds), (Some(0), Odds::default()));
}

#[test]
fn sixty_four_controllers_of_which_eight_are_dead_are_surveyed_in_seconds() {
    let rig = hall(64, |n| n % 8 == 3);
    let found = run(&rig);
    for (lane, survey) in found.iter().enumerate() {
        assert_eq!(survey.answered(), lane % 8 != 3, "{lane}");
        assert_eq!(survey.round_trips.len(), if survey.answered() { ROUNDS } else { 0 });
    }
    assert!(rig.elapsed() < millis(1_500), "{:?}", rig.elapsed());
}

#[test]
fn a_network_that_loses_two_replies_of_three_holds_nobody_up() {
    let rig = hall(64, |_| false);
    rig.filter(|nth, reply| if nth / 64 % 3 == 2 { vec![reply] } else { vec![] });
    run(&rig);
    assert!(rig.elapsed() < LIMIT, "{:?}", rig.elapsed());
}

#[test]
fn controllers_that_fall_silent_at_any_point_hold_nobody_up() {
    for after in [1, 2, 5, 10, 11, 12, 20, 31, 32, 40] {
        let rig = hall(1, |_| false);
        rig.filter(move |nth, reply| if nth < after { vec![reply] } else { vec![] });
        let found = run(&rig).remove(0);
        assert!(rig.elapsed() < LIMIT, "{after}: {:?}", rig.elapsed());
        assert!(found.answered());
        assert!(!found.unread.is_empty() || found.round_trips.len() < ROUNDS || after >= 31, "{after}");
    }
}

#[test]
fn lost_replies_do_not_look_like_another_master() {
    let rig = hall(1, |_| false);
    rig.filter(|nth, reply| if nth % 3 == 1 { vec![] } else { vec![reply] });
    assert_eq!(run(&rig)[0].foreign_packets, Some(0));
}

#[test]
fn an_early_count_that_comes_late_does_not_look_like_another_master() {
    let rig = hall(1, |_| false);
    let mut held = None;
    rig.filter(move |nth, reply| match nth {
        1 => {
            held = Some(reply); // DP34, counted before it was asked for again
            vec![]
        }
        2 => held.take().into_iter().collect(),
        _ => vec![reply],
    });
    assert_eq!(run(&rig)[0].foreign_packets, Some(0));
}

#[test]
fn packets_that_nobody_here_sent_are_counted() {
    let rig = hall(1, |_| false);
    let mut packets = 0;
    rig.filter(move |_, mut reply| {
        if reply[6..8] == [0, 0] && reply[12..14] == [0, 0x34] && reply.len() == 18 {
            packets += 1;
            reply[17] += 7 * (packets - 1); // DP34 the second time
        }
        vec![reply]
    });
    assert_eq!(run(&rig)[0].foreign_packets, Some(7));
}

#[test]
fn two_controllers_of_one_address_are_seen_by_their_answers() {
    let rig = hall(1, |_| false);
    let mut asked = 0;
    rig.filter(move |_, reply| {
        if reply[12..16] == [0, 0x10, 0, 12] {
            asked += 1;
            let mut other = reply.clone();
            other[39] = asked; // the last byte of the hardware address
            return vec![other, reply];
        }
        vec![reply]
    });
    let found = run(&rig).remove(0);
    assert_eq!(found.changed, [Address::Pa(0x1b)]);
    assert!(found.odds.duplicate > 0);
}

#[test]
fn reports_are_heard_from_the_frame_port_and_from_elsewhere() {
    let status = |station| Status {
        station,
        positions: PerAxis::from_fn(3, |_| Pulses(0)),
        forces: PerAxis::from_fn(3, |_| 0),
        servo_errors: PerAxis::from_fn(3, |_| 0),
        error: 21,
        outputs: 0,
        inputs: 0,
    };
    let own = Code::station([127, 0, 0, 1]);
    for (origin, station, reports) in [
        (Origin::Controller(0), own, 1),
        (Origin::Stranger("127.0.0.1:5000".parse().unwrap()), own, 1),
        (Origin::Stranger("127.0.0.2:7408".parse().unwrap()), own, 0),
        (Origin::Controller(0), Code(0x0102), 0),
    ] {
        let rig = hall(1, |_| false);
        rig.inject(origin, status(station).emit(&mut [0; MAX_LEN]).to_vec());
        let found = run(&rig).remove(0);
        assert_eq!(found.reported.reports, reports, "{origin:?}");
        assert_eq!(found.reported.error.map(|heard| heard.value), (reports > 0).then_some(21));
        assert!(rig.elapsed() >= LISTEN);
    }
}

#[test]
fn a_state_that_is_not_normal_is_kept() {
    let rig = Rig::of(vec![Setup { estop_at: Some(Duration::ZERO), ..Setup::default() }]);
    let found = run(&rig).remove(0);
    assert_eq!(found.state.unwrap().0, ReplyCode::EmergencyStop);
    assert!(found.values.contains_key(&Address::Pa(0x90)), "it still tells its registers");
}

#[test]
fn mbox_controllers_are_not_asked_what_they_lack() {
    let rig = Rig::of(vec![Setup { dialect: Dialect::Mbox, ..Setup::default() }]);
    let mut controllers = controllers(1);
    controllers[0].connection.dialect = Dialect::Mbox;
    let found = survey(&mut rig.talk(), &controllers, &[vec![Address::Pa(0x90)]], &mut |_| {}).remove(0);
    assert_eq!(found.foreign_packets, None);
    assert!(!found.values.contains_key(&PACKETS));
    assert_eq!((found.rounds, found.round_trips.len()), (ROUNDS, ROUNDS));
}

/// A reply as a hostile network would have it: cut, lengthened, with bytes changed, twice, late or not at all.
fn mutated(reply: &[u8], dice: &mut impl FnMut(usize) -> usize) -> Vec<Vec<u8>> {
    let mut bytes = reply.to_vec();
    match dice(6) {
        0 => bytes.truncate(dice(reply.len())),
        1 => bytes.extend([0xa5; 7]),
        2 => return vec![],
        3 => return vec![bytes.clone(), bytes],
        _ => {
            for _ in 0..=dice(4) {
                let at = dice(bytes.len());
                bytes[at] = dice(256).try_into().unwrap();
            }
        }
    }
    vec![bytes]
}

#[test]
fn ten_thousand_mutated_replies_neither_panic_nor_hold_a_survey_up() {
    let mut sent = 0;
    for seed in 1_u64.. {
        let rig = hall(64, |_| false);
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        rig.filter(move |_, reply| {
            let mut dice = |sides: usize| {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                usize::try_from(state % u64::try_from(sides).unwrap()).unwrap()
            };
            // Most arrive whole, so that every part of the survey is reached.
            if dice(4) > 0 { vec![reply] } else { mutated(&reply, &mut dice) }
        });
        run(&rig);
        assert!(rig.elapsed() < LIMIT, "seed {seed}: {:?}", rig.elapsed());
        sent += rig.received();
        // A quarter of the replies is mutated.
        if sent > 44_000 {
            return;
        }
    }
}
