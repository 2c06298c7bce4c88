//! Virtual controllers asked where their seats stand, in virtual time.

use super::*;
use crate::config::from_to_args;
use crate::device::testing::Rig;
use crate::sim::{Setup, pa};
use crate::wire::{DP_POSITIONS, MAX_LEN, RegisterReply, Words, position_words};

type Stood = Result<Vec<Pulses>, StandError>;

fn setup(parameters: &[(u8, u16)]) -> Setup {
    Setup { parameters: parameters.to_vec(), host_port: 0, ..Setup::default() }
}

/// What one controller of that setup says, reached as `to` has it.
fn stood(setup: Setup, to: &str) -> Stood {
    stood_on(&Rig::of(vec![setup]), to)
}

fn stood_on(rig: &Rig, to: &str) -> Stood {
    let to: Vec<_> = (0..rig.lanes()).map(|n| format!("127.0.0.1:{}{to}", 7_408 + n)).collect();
    let controllers = from_to_args(&to, &[], 3).unwrap().stations();
    stand(&mut rig.talk(), &controllers).remove(0)
}

/// The words of what one says who stands at `pulses` with its first axis, from its `from`th such answer on.
fn standing_at(rig: &Rig, at: impl Fn(usize) -> [u16; 2] + 'static) {
    let mut readings = 0;
    rig.filter(move |_, bytes| {
        let Ok(reply) = RegisterReply::parse(&bytes) else { return vec![bytes] };
        if reply.channel != 0 || reply.start != DP_POSITIONS[0] {
            return vec![bytes];
        }
        let mut words: Vec<u16> = reply.data.iter().collect();
        words[..2].copy_from_slice(&at(readings));
        readings += 1;
        let data = Words::from(&words[..]);
        vec![RegisterReply { data, ..reply }.emit(&mut [0; MAX_LEN]).to_vec()]
    });
}

#[test]
fn a_seat_that_stands_tells_where_and_nothing_moves() {
    let rig = Rig::of(vec![setup(&[])]);
    standing_at(&rig, |_| position_words(Pulses(123_456), Dialect::Smc));
    assert_eq!(stood_on(&rig, ""), Ok(vec![Pulses(123_456), Pulses(0), Pulses(0)]));
    // Two axis and offset reads, then positions, twice.
    assert!(rig.elapsed() >= APART && rig.received() < 10, "{}", rig.received());
}

#[test]
fn each_of_many_is_judged_by_itself() {
    let rig = Rig::of(vec![setup(&[]), Setup { mute: true, ..setup(&[]) }, setup(&[(pa::AXES, 6)])]);
    let to: Vec<_> = (0..3).map(|n| format!("127.0.0.1:{}", 7_408 + n)).collect();
    let controllers = from_to_args(&to, &[], 3).unwrap().stations();
    let stood = stand(&mut rig.talk(), &controllers);
    assert_eq!(stood[0], Ok(vec![Pulses(0); 3]));
    assert!(matches!(&stood[1], Err(error @ StandError::Unread(_)) if !error.answered()), "{stood:?}");
    assert!(matches!(&stood[2], Err(error @ StandError::Axes { works: 6, axes: 3 }) if error.answered()));
}

#[test]
fn a_controller_that_would_make_something_else_of_a_position_is_refused() {
    assert_eq!(stood(setup(&[(pa::AMPLITUDE, 5)]), ""), Err(StandError::Amplitude(5)));
    assert_eq!(stood(setup(&[(pa::AUTO_RESET, 500)]), ""), Err(StandError::AutoReset(500)));
    assert_eq!(stood(setup(&[(pa::OFFSET, 3)]), ""), Err(StandError::Offset { offset: 3, wanted: 0 }));
    assert_eq!(stood(setup(&[(pa::OFFSET, 1)]), ",axes=3,offset=1,fan_out=shared"), Ok(vec![Pulses(0); 3]));
    let six = Setup { axes: 6, ..setup(&[]) };
    assert_eq!(stood(six, ",axes=6"), Ok(vec![Pulses(0); 6]));
    let ten = Setup { axes: 10, ..setup(&[]) };
    assert_eq!(stood(ten, ",axes=10"), Err(StandError::TooManyAxes { axes: 10 }));
}

#[test]
fn a_controller_in_emergency_stop_is_refused() {
    let stopped = Setup { estop_at: Some(Duration::ZERO), ..setup(&[]) };
    assert!(matches!(stood(stopped, ""), Err(StandError::State { code: ReplyCode::EmergencyStop, .. })));
}

#[test]
fn a_seat_that_moves_or_stands_outside_its_stroke_is_refused() {
    let place = |pulses| position_words(Pulses(pulses), Dialect::Smc);
    let rig = Rig::of(vec![setup(&[])]);
    standing_at(&rig, move |reading| place(if reading == 0 { 100_000 } else { 100_002 }));
    assert_eq!(stood_on(&rig, ""), Err(StandError::Moves { axis: 1, from: 100_000, to: 100_002 }));
    for outside in [-1, 300_001] {
        let rig = Rig::of(vec![setup(&[])]);
        standing_at(&rig, move |_| place(outside));
        let refused = Err(StandError::PastStroke {
            axis: 1,
            pulses: outside,
            stroke: PulseRange { low: 0.0, high: 300_000.0 },
        });
        assert_eq!(stood_on(&rig, ""), refused);
    }
}

#[test]
fn a_place_that_the_other_order_of_words_puts_elsewhere_in_the_stroke_is_refused() {
    // 3 pulses up as an smc controller says it, 196,608 as an mbox one does.
    let rig = Rig::of(vec![setup(&[])]);
    standing_at(&rig, |_| [3, 0]);
    assert_eq!(stood_on(&rig, ""), Err(StandError::WordOrder { axis: 1, smc: 3, mbox: 196_608 }));
}
