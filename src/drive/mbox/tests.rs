use std::path::Path;

use super::*;
use crate::config::{Accept, from_to_args};
use crate::cue::{Source, read};
use crate::drive::{Manner, lanes};
use crate::timeline::Timeline;
use crate::wire::{Access, ReadRequest};

const CODE: Code = Code(0x0fc9);

fn ms(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

/// A controller of that many axes, with belts, of which a cue of one axis leads the first.
fn peer(dialect: Dialect, axes: usize) -> MboxPeer {
    let text = &b"time_ms,a1\n0,0\n1000,0.1\n"[..];
    let cue = Timeline::new(read(Path::new("a.csv"), text, &Source::Native).unwrap());
    let mut config = from_to_args(&[format!("127.0.0.1:1,axes={axes}")], &[], 1).unwrap();
    config.controllers[0].station_mut().dialect = dialect;
    config.controllers[0].station_mut().accept = Accept::Code(CODE.0);
    config.controllers[0].belt_inputs = 1;
    let lane = lanes(&config, &cue, Manner { level: 1.0, silent: false }).remove(0);
    MboxPeer::new(&config.stations()[0], &lane)
}

/// What it is asked for, by channel, first register and count.
fn asked(peer: &mut MboxPeer, need: Need, at: u64) -> Vec<(u16, u16, u16)> {
    let mut asked = Vec::new();
    let sent = peer.poll(need, ms(at), &mut |datagram| {
        let ReadRequest { channel, accept, reply, start, num } = ReadRequest::parse(datagram).unwrap();
        assert_eq!((accept, reply), (CODE, CODE));
        asked.push((channel, start, num));
        true
    });
    assert_eq!(asked.len(), usize::try_from(sent).unwrap());
    asked
}

fn answer(start: u16, words: &[u16]) -> RegisterReply<'_> {
    let (num, data) = (u16::try_from(words.len()).unwrap(), Words::from(words));
    let code = ReplyCode::Running;
    RegisterReply { access: Access::Read, code, channel: 0, error: 0, start, num, data }
}

/// What an answer is evidence of, while nobody else asks anything.
fn hear(peer: &mut MboxPeer, reply: RegisterReply<'_>, at: u64) -> Vec<Evidence> {
    let mut out = Vec::with_capacity(crate::drive::MOST_EVIDENCE);
    let room = out.capacity();
    let message = FromController::Registers(reply);
    peer.receive(Incoming { message, at: ms(at), others_ask: false }, &mut out);
    assert_eq!(out.capacity(), room, "there is room for all of it");
    out
}

fn position(start: u16) -> RegisterReply<'static> {
    answer(start, &[7, 0, 7, 0, 7, 0])
}

/// The two parts of that, of which each tells of other axes.
fn parts(start: u16) -> [RegisterReply<'static>; 2] {
    [answer(start, &[7, 0]), answer(start + 2, &[7, 0, 7, 0])]
}

#[test]
fn a_look_asks_for_all_that_tells_who_it_is_and_an_mbox_for_less() {
    let smc = [(1, 0, 3), (0, 0xf0, 1), (0, 0xfe, 2), (0, 0x34, 1), (1, 0x92, 1), (0, 0x5e, 1)];
    // Its frames have places for six axes.
    let blocks = [(0, DP_POSITIONS[0], 6), (0, DP_POSITIONS[3], 6)];
    let [one, three] = [0, 3].map(|axis| [(0, DP_POSITIONS[axis], 2), (0, DP_POSITIONS[axis + 1], 4)]);
    let places = [&blocks[..], &one, &three].concat();
    assert_eq!(asked(&mut peer(Dialect::Smc, 4), Need::Identity, 0), [&smc[..], &places].concat());
    let mbox = asked(&mut peer(Dialect::Mbox, 4), Need::Identity, 0);
    assert_eq!(mbox, [&smc[..3], &places].concat());
    assert!(asked(&mut peer(Dialect::Mbox, 4), Need::Count, 0).is_empty(), "it does not tell one");
    assert_eq!(asked(&mut peer(Dialect::Smc, 4), Need::Count, 0), [(0, 0x34, 1)]);
}

#[test]
fn one_thing_at_a_time_is_asked_for_as_a_sign_of_life_and_its_zero_while_frames_lead_it() {
    let mut peer = peer(Dialect::Smc, 6);
    let mut starts = |is_led| -> Vec<u16> {
        (0..12)
            .flat_map(|turn| asked(&mut peer, Need::KeepAlive { is_led }, 100 * turn))
            .map(|(_, start, _)| start)
            .collect()
    };
    let mut told = starts(false);
    told[..7].sort_unstable();
    assert_eq!(told[..7], [0x06, 0x06, 0x08, 0x21, 0x21, 0x23, 0x5e], "of a place by both sources");
    let mut led = starts(true);
    led[..4].sort_unstable();
    assert_eq!(led[..4], [0x06, 0x21, 0x5e, 0xf0]);
}

#[test]
fn an_answer_to_a_position_read_tells_of_three_axes_and_no_other_answer_is_one() {
    let mut peer = peer(Dialect::Smc, 6);
    peer.drives = Some(6);
    asked(&mut peer, Need::Position, 0);
    let told = hear(&mut peer, answer(DP_POSITIONS[3], &[4, 0, 5, 0, 6, 0]), 1);
    let Some(Evidence::Position(place)) = told.get(2) else { panic!("{told:?}") };
    assert_eq!(place.passing.unwrap().slots, 0b11_1000);
    assert_eq!((place.reading, &place.told), (None, &None), "the first three are to come");
    let told = hear(&mut peer, position(DP_POSITIONS[0]), 2);
    assert!(matches!(&told[2], Evidence::Position(place) if place.reading.is_none()), "{told:?}");
    let others =
        [parts(DP_POSITIONS[0])[1], answer(DP_POSITIONS[3], &[4, 0]), answer(DP_POSITIONS[4], &[5, 0, 6, 0])];
    others.into_iter().for_each(|part| drop(hear(&mut peer, part, 2)));
    let told = hear(&mut peer, parts(DP_POSITIONS[0])[0], 2);
    assert!(matches!(&told[2], Evidence::Position(place) if place.reading.is_some()), "{told:?}");
    assert_eq!(hear(&mut peer, position(DP_POSITIONS[1]), 3), [], "nobody asks so");
    let many = [0; 40];
    assert_eq!(hear(&mut peer, answer(DP_POSITIONS[0], &many), 3), [], "nor so");
}

#[test]
fn an_answer_that_nobody_waits_for_makes_no_place_and_is_no_sign_of_life_and_contradicts_another() {
    let mut peer = peer(Dialect::Smc, 3);
    asked(&mut peer, Need::KeepAlive { is_led: false }, 0);
    asked(&mut peer, Need::Position, 0);
    for _ in 0..2 {
        let _ = hear(&mut peer, position(DP_POSITIONS[0]), 1);
    }
    let told = hear(&mut peer, answer(DP_POSITIONS[0], &[9, 0, 9, 0, 9, 0]), 90);
    assert_eq!(told, [Evidence::Code(ReplyCode::Running)], "it was repeated on its way");
    let told = hear(&mut peer, answer(DP_POSITIONS[0], &[9_000, 0, 9, 0, 9, 0]), 90);
    assert!(
        matches!(&told[..], [Evidence::Code(_), Evidence::Position(_)]),
        "one of the two is old: {told:?}"
    );
    let place = peer.whereabouts(None, ms(91));
    assert_eq!(place.told.unwrap()[0], Pulses(7));
    // A conversation of another thread: what nobody here waits for may be for that.
    let mut out = Vec::new();
    let message = FromController::Registers(position(DP_POSITIONS[0]));
    peer.receive(Incoming { message, at: ms(95), others_ask: true }, &mut out);
    assert!(out.contains(&Evidence::Answered) && out.contains(&Evidence::Alive), "{out:?}");
    assert!(!out.iter().any(|one| matches!(one, Evidence::Position(_))));
}

#[test]
fn what_the_kernel_does_not_take_is_not_waited_for() {
    let mut peer = peer(Dialect::Smc, 3);
    assert_eq!(peer.poll(Need::Position, ms(0), &mut |_| false), 0);
    let told = hear(&mut peer, position(DP_POSITIONS[0]), 1);
    assert!(!told.iter().any(|one| matches!(one, Evidence::Position(_) | Evidence::Alive)));
}

#[test]
fn an_answer_with_inputs_is_a_sign_of_life_where_they_are_asked_for() {
    for (has_belts, has_stop_inputs, alive) in
        [(true, false, true), (false, true, true), (false, false, false)]
    {
        let mut peer = peer(Dialect::Smc, 3);
        (peer.has_belts, peer.has_stop_inputs) = (has_belts, has_stop_inputs);
        asked(&mut peer, Need::Identity, 0);
        let inputs = RegisterReply { code: ReplyCode::EmergencyStop, ..answer(0x5e, &[3]) };
        let told = hear(&mut peer, inputs, 1);
        assert_eq!(told.contains(&Evidence::Alive), alive, "also while it says that no belt is closed");
        assert!(told.contains(&Evidence::Code(ReplyCode::EmergencyStop)));
    }
}

#[test]
fn its_packet_counter_is_told_where_that_alone_was_asked_for() {
    let mut peer = peer(Dialect::Smc, 3);
    asked(&mut peer, Need::Identity, 0);
    assert!(!hear(&mut peer, answer(0x34, &[77]), 1).contains(&Evidence::Count(77)));
    asked(&mut peer, Need::Count, 2);
    assert!(hear(&mut peer, answer(0x34, &[78]), 3).contains(&Evidence::Count(78)));
    assert!(!hear(&mut peer, answer(0x34, &[79]), 4).contains(&Evidence::Count(79)), "it was repeated");
}

#[test]
fn a_controller_has_to_drive_the_axes_of_its_seat_and_none_that_nobody_reads_and_its_frames_have_places_for()
{
    let mut peer = peer(Dialect::Smc, 1);
    (peer.places, peer.axes) = (3, 3);
    assert_eq!([0, 1, 3, 12].map(|drives| peer.leads_all(drives)), [false, true, true, true]);
    (peer.places, peer.axes) = (10, 6);
    assert_eq!([6, 7, 12].map(|drives| peer.leads_all(drives)), [true, false, false]);
}

#[test]
fn where_a_seat_is_counts_only_once_its_controller_has_told_that_it_drives_its_axes() {
    let place = |told: &[Evidence]| {
        let found =
            told.iter().find_map(|one| if let Evidence::Position(place) = one { Some(place) } else { None });
        found.expect("it told its positions").reading
    };
    let mut peer = peer(Dialect::Smc, 3);
    let [start, second, _] = [0, 1, 2].map(|axis| DP_POSITIONS[axis]);
    let places = [(0, start, 6), (0, start, 2), (0, second, 4)];
    assert_eq!(asked(&mut peer, Need::Position, 0), [&[(1, 0, 3)], &places[..]].concat());
    let answers = |peer: &mut MboxPeer, at| {
        parts(start).into_iter().for_each(|part| drop(hear(peer, part, at)));
        place(&hear(peer, position(start), at))
    };
    assert_eq!(answers(&mut peer, 1), None);
    for (drives, tells) in [(2, true), (3, false)] {
        let words = [0, 0, drives];
        let mode = RegisterReply { channel: 1, ..answer(0, &words) };
        asked(&mut peer, Need::Identity, 2);
        assert_eq!(hear(&mut peer, mode, 3).contains(&Evidence::OtherAxes(drives)), tells);
        assert_eq!(answers(&mut peer, 4).is_none(), tells);
    }
    assert_eq!(asked(&mut peer, Need::Position, 5), places, "that does not change by itself");
}

#[test]
fn effects_are_switched_off_by_a_register_that_moves_nothing_and_read_to_be_so() {
    let darken = |peer: &mut MboxPeer, at| {
        let mut sent = Vec::new();
        peer.poll(Need::Dark, ms(at), &mut |datagram| {
            sent.push(datagram.to_vec());
            true
        });
        sent
    };
    for (dialect, positions) in [(Dialect::Mbox, 0), (Dialect::Smc, 3)] {
        let mut peer = peer(dialect, 3);
        let sent = darken(&mut peer, 1);
        let write = WriteRequest::parse(&sent[0]).unwrap();
        assert_eq!((write.channel, write.start, write.data.get(0)), (2, 1, Some(0)), "DPF1");
        assert_eq!((write.accept, write.reply), (CODE, Code::NONE));
        let asked = sent[1..].iter().map(|octets| {
            let ReadRequest { channel, start, num, .. } = ReadRequest::parse(octets).unwrap();
            (channel, start, num)
        });
        let [first, second, _] = [0, 1, 2].map(|axis| DP_POSITIONS[axis]);
        let all = [(1, 0x05, 1), (0, 0x66, 1), (0, first, 6), (0, first, 2), (0, second, 4)];
        assert_eq!(asked.collect::<Vec<_>>(), all[..2 + positions], "{dialect:?}: an MBOX has no vibration");
        hear(&mut peer, RegisterReply { channel: 1, ..answer(0x05, &[0]) }, 2);
        for at in [3, 10] {
            darken(&mut peer, at);
            assert!(peer.on.left_on().outputs);
            hear(&mut peer, answer(0x66, &[0]), at + 1);
        }
        assert!(!peer.on.left_on().outputs);
        let sent = darken(&mut peer, 20);
        let read = ReadRequest::parse(&sent[0]).unwrap();
        assert_eq!((read.channel, read.start, sent.len()), (0, 0x66, 1 + positions), "it is only read");
    }
}

#[test]
fn only_an_smc_tells_by_the_code_of_a_reply_to_a_frame_how_it_is() {
    use ReplyCode::{Command, EmergencyStop, Fault, Running};
    let codes = [Running, Fault, EmergencyStop, Command];
    let refusals = |dialect| codes.map(|code| peer(dialect, 3).on_reply_code(code));
    assert_eq!(refusals(Dialect::Smc), [false, true, false, true]);
    assert_eq!(refusals(Dialect::Mbox), [false, true, true, true]);
}
