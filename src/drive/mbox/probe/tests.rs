use super::*;
use crate::motion::Pulses;
use crate::observe::StopSign;
use crate::wire::{Access, Words, position_words};

/// A look at a controller of one axis, in frames of three, that was asked.
fn probe(dialect: Dialect) -> Probe {
    let mut probe = Probe::new(dialect, 3, 0);
    probe.begin();
    probe
}

/// Answers to a read, as a controller gives it in that state.
fn answer(probe: &mut Probe, read: MonitorRead, code: ReplyCode, error: u16, words: &[u16]) {
    let request = read.request(3, crate::wire::Code::NONE).unwrap();
    let is_well = code == ReplyCode::Running;
    let channel = if is_well { request.channel } else { 0 };
    let error = if is_well { 0 } else { error };
    let (start, num, data) = (request.start, request.num, Words::from(words));
    let reply = RegisterReply { access: Access::Read, code, channel, error, start, num, data };
    assert_eq!(MonitorRead::answered_by(&reply, 3), Some(read));
    probe.mind_stop(code);
    probe.hear(read, &reply);
}

/// Answers to all but its inputs.
fn answers(probe: &mut Probe, code: ReplyCode, error: u16) {
    let place = position_words(Pulses(75_000), Dialect::Smc);
    answer(probe, Mode, code, error, &[2, 0, 1]);
    answer(probe, Zero, code, error, &[ZERO_KNOWN]);
    answer(probe, Versions, code, error, &[1, 3]);
    answer(probe, Packets, code, error, &[77]);
    answer(probe, MonitorRead::FirstPositions, code, error, &[place, [0, 0], [0, 0]].concat());
}

/// A look that is answered so, with those inputs.
fn look(probe: &mut Probe, code: ReplyCode, inputs: u16) -> StopSign {
    probe.begin();
    answers(probe, code, 0);
    answer(probe, StopMask, code, 0, &[1]);
    answer(probe, Inputs, code, 0, &[inputs]);
    probe.take_look().expect("it is whole").stop
}

#[test]
fn what_a_controller_tells_is_taken_whole_and_once() {
    let mut probe = probe(Dialect::Smc);
    answers(&mut probe, ReplyCode::Running, 0);
    assert!(probe.take().is_none(), "its inputs are to come");
    look(&mut probe, ReplyCode::Running, 0);
    let sighting = probe.take().unwrap();
    let identity = Identity { version: 3, minor_version: 1, work_mode: 2, axes: 1 };
    assert_eq!(
        sighting,
        Sighting { identity, error: 0, alarm: 0, continuity: Continuity::Packets(77), homed: true }
    );
    assert!(probe.take().is_none());
}

#[test]
fn an_mbox_tells_the_alarm_of_its_drives_where_others_tell_a_version_and_a_refusal_tells_nothing() {
    let mut probe = probe(Dialect::Mbox);
    answers(&mut probe, ReplyCode::Running, 0);
    let sighting = probe.take().unwrap();
    assert_eq!((sighting.identity.minor_version, sighting.alarm), (0, 1));
    probe.begin();
    answers(&mut probe, ReplyCode::Fault, 0);
    assert!(probe.take().is_none());
}

#[test]
fn one_with_an_error_is_heard_as_well_though_its_answers_name_no_channel() {
    let mut probe = probe(Dialect::Smc);
    answer(&mut probe, Inputs, ReplyCode::Fault, 21, &[0]);
    answers(&mut probe, ReplyCode::Fault, 21);
    assert_eq!(probe.take().unwrap().error, 21);
}

#[test]
fn an_emergency_stop_is_over_after_two_whole_looks_that_were_asked_since_its_last_sign() {
    use ReplyCode::{EmergencyStop, Fault, Running};
    use StopSign::{Over, Unsure};
    let mut probe = probe(Dialect::Smc);
    assert_eq!(look(&mut probe, EmergencyStop, 0), Unsure);
    assert_eq!([Running, Running].map(|code| look(&mut probe, code, 0)), [Unsure, Over]);
    assert_eq!(look(&mut probe, EmergencyStop, 0), Unsure);
    assert_eq!([Fault, Running].map(|code| look(&mut probe, code, 0)), [Unsure, Over], "an error is none");
    probe.mind_stop(EmergencyStop);
    look(&mut probe, Running, 0);
    probe.begin();
    probe.mind_stop(EmergencyStop);
    answers(&mut probe, Running, 0);
    assert!(probe.take_look().is_none(), "without the inputs it is not whole");
    assert_eq!(look(&mut probe, Running, 0), Unsure, "what was asked before the last sign does not count");
}

#[test]
fn a_request_that_is_too_short_for_an_mbox_stops_nobody() {
    let mut probe = probe(Dialect::Mbox);
    answers(&mut probe, ReplyCode::Running, 0);
    probe.take_look().unwrap();
    probe.begin();
    probe.mind_stop(ReplyCode::EmergencyStop);
    answers(&mut probe, ReplyCode::Running, 0);
    assert_eq!(probe.take_look().unwrap().stop, StopSign::Over);
}

#[test]
fn one_late_answer_of_before_is_no_whole_look() {
    let mut probe = probe(Dialect::Smc);
    probe.mind_stop(ReplyCode::EmergencyStop);
    probe.begin();
    for _ in 0..9 {
        answer(&mut probe, Zero, ReplyCode::Running, 0, &[ZERO_KNOWN]);
    }
    assert!(probe.take_look().is_none());
}

#[test]
fn nothing_is_taken_that_nobody_asked_for() {
    let mut probe = Probe::new(Dialect::Smc, 3, 0);
    answers(&mut probe, ReplyCode::Running, 0);
    answer(&mut probe, Inputs, ReplyCode::Running, 0, &[0]);
    assert!(probe.take().is_none() && probe.take_look().is_none());
}
