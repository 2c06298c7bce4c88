use std::path::Path;

use super::*;
use crate::channel::{ChannelId, Sample};
use crate::config::{Config, from_to_args};
use crate::cue::{Source, read};
use crate::drive::{Manner, lanes};
use crate::motion::MAX_AXES;
use crate::timeline::{EffectSet, Timeline};
use crate::wire::{Code, MotionRequest, Vibration, VibrationPort};

const FULL: Manner = Manner { level: 1.0, silent: false };

fn cue(text: &str) -> Timeline {
    Timeline::new(read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
}

fn hall(tos: &[&str], axes: usize) -> Config {
    let tos: Vec<String> = tos.iter().map(|to| (*to).to_owned()).collect();
    from_to_args(&tos, &[], axes).unwrap()
}

fn four_axes() -> Timeline {
    cue("time_ms,a1,a2,a3,a4\n0,0,0,0,0\n1000,0.1,0.2,0.3,0.4\n")
}

/// The first frame of each lane, for a pose of 0.1, 0.2, 0.3 and 0.4 of the stroke on axes 1 to 4.
fn frames(config: &Config, cue: &Timeline, manner: Manner) -> Vec<MotionRequest> {
    let mut pose = [0.0; MAX_AXES];
    pose[..4].copy_from_slice(&[0.1, 0.2, 0.3, 0.4]);
    let mut beat = Beat::still(Timing::Relative, 10);
    beat.effects = EffectSet::Word(0xffff);
    let frame = |lane: &mut Lane| {
        let placed = lane.window.place(&pose);
        let mut buf = [0xa5; MAX_LEN];
        let (_, bytes) = lane.encode(&beat, &placed, Mix { vibration: manner.level, ..Mix::FULL }, &mut buf);
        MotionRequest::parse(bytes).unwrap()
    };
    lanes(config, cue, manner).iter_mut().map(frame).collect()
}

fn positions(frame: &MotionRequest) -> Vec<i32> {
    frame.positions.iter().map(|pulses| pulses.0).collect()
}

#[test]
fn a_slice_carries_just_the_controllers_own_axes_and_padding_rests() {
    let config = hall(&["127.0.0.1:1,axes=3", "127.0.0.1:2,axes=4,offset=3"], 4);
    let frames = frames(&config, &four_axes(), FULL);
    assert_eq!(positions(&frames[0]), [30_000, 60_000, 90_000]);
    assert_eq!(positions(&frames[1]), [120_000, 0, 0, 0, 0, 0]);
    assert_eq!((frames[0].channel, frames[1].channel), (0, 1));
}

#[test]
fn a_shared_frame_carries_the_whole_cue_to_each_controller() {
    let config =
        hall(&["127.0.0.1:1,axes=3,fan_out=shared", "127.0.0.1:2,axes=3,offset=3,fan_out=shared"], 4);
    for frame in frames(&config, &four_axes(), FULL) {
        assert_eq!(positions(&frame), [30_000, 60_000, 90_000, 120_000, 0, 0]);
    }
}

#[test]
fn frames_ask_for_replies_unless_the_play_is_silent() {
    let config = hall(&["127.0.0.1:1"], 4);
    let asks = |silent| frames(&config, &four_axes(), Manner { silent, ..FULL })[0].reply;
    assert_eq!((asks(false), asks(true)), (Code::ALL, Code::NONE));
}

#[test]
fn a_frame_for_a_whole_network_is_that_of_one_to_the_bit_but_for_the_codes_and_takes_no_number() {
    let mut config = hall(&["127.0.0.1:1"], 3);
    config.show.ack_every = 2;
    let mut lane = lanes(&config, &cue("time_ms,a1,a2,a3\n0,0,0,0\n1000,0.1,0.2,0.3\n"), FULL).remove(0);
    let (beat, pose) = (Beat::still(Timing::Relative, 10), [0.1; MAX_AXES]);
    let draft = |lane: &Lane, frame| {
        let mut buf = [0xa5; MAX_LEN];
        let (stamped, octets) = lane.draft(frame, Code(0x0fff), &beat, &pose, Mix::FULL, &mut buf).unwrap();
        (stamped.asked, octets.to_vec())
    };
    let (asked, octets) = draft(&lane, FrameNo::FIRST);
    let head = [0x55, 0xaa, 0, 0, 0x14, 0x01, 0, 0, 0x0f, 0xff, 0x0f, 0xff, 0, 0, 0, 1, 0, 0, 0, 10];
    assert_eq!((asked, &octets[..20]), (true, &head[..]));
    let (asked, silent) = draft(&lane, FrameNo(2));
    assert_eq!((asked, &silent[8..16]), (false, &[0x0f, 0xff, 0, 0, 0, 0, 0, 2][..]));

    let mut buf = [0xa5; MAX_LEN];
    let (stamped, own) = lane.encode(&beat, &pose, Mix::FULL, &mut buf);
    assert_eq!(stamped.frame, FrameNo::FIRST, "a draft takes no number");
    assert_eq!((&own[..8], &own[12..]), (&octets[..8], &octets[12..]));
    assert!(!lane.take(FrameNo(2)), "it is the next");
    assert!(lane.take(FrameNo(7)), "numbers are left out");
    assert_eq!(lane.next_frame(), FrameNo(8));
}

#[test]
fn raw_words_reach_only_the_outputs_a_controller_has() {
    let config = hall(&["127.0.0.1:1"], 4);
    assert_eq!(frames(&config, &four_axes(), FULL)[0].outputs, 0x0fff);
}

#[test]
fn a_cue_with_vibration_is_sent_in_frames_that_carry_it() {
    let cue = cue("time_ms,a1,v1_hz,v1_amp\n0,0,20,0.01\n1000,0,20,0.01\n");
    let config = hall(&["127.0.0.1:1"], 1);
    let mut lane = lanes(&config, &cue, FULL).remove(0);
    let mut beat = Beat::still(Timing::Absolute, 10);
    beat.samples.set(ChannelId::Vibration.on(0), Sample([20.0, 0.01]));
    let mut buf = [0xa5; MAX_LEN];
    let (stamped, bytes) = lane.encode(&beat, &lane.window.park(), Mix::FULL, &mut buf);
    let frame = MotionRequest::parse(bytes).unwrap();
    assert_eq!(stamped, Stamped { frame: FrameNo::FIRST, asked: true, lights: false, shakes: 0.01 });
    assert_eq!(frame.vibration.unwrap()[0], Vibration { period: 400, amplitude: 3_000 });
    assert_eq!(bytes[4..6], [0x18, 0x01]);
}

#[test]
fn analogue_outputs_go_as_far_as_the_controller_says_and_are_off_on_the_way_to_park_and_in_a_hold() {
    let cue = cue("time_ms,a1,dac1,dac2\n0,0,0.5,1\n1000,0,0.5,1\n");
    let mut config = hall(&["127.0.0.1:1", "127.0.0.1:2,dialect=mbox"], 1);
    config.controllers[1].at_most = [0.25, 0.0];
    let mut beat = Beat::still(Timing::Relative, 10);
    beat.samples.set(ChannelId::Analogue.of_hall(), Sample([0.5, 1.0]));
    let mut buf = [0xa5; MAX_LEN];
    let mut sent = |lane: &mut Lane, beat: &Beat, mix| {
        let park = lane.window.park();
        MotionRequest::parse(lane.encode(beat, &park, mix, &mut buf).1).unwrap().extend
    };
    let mut lanes = lanes(&config, &cue, FULL);
    assert_eq!([0, 1].map(|lane| sent(&mut lanes[lane], &beat, Mix::FULL)), [0x8000_ffff, 0x4000_0000]);
    assert_eq!(sent(&mut lanes[0], &Beat::still(Timing::Relative, 10), Mix::FULL), 0);
    assert_eq!(sent(&mut lanes[0], &beat, Mix::STILL), 0);
    lanes[1].hold();
    assert_eq!(sent(&mut lanes[1], &beat, Mix::FULL), 0);
    let (_, bytes) = lanes[0].encode_slow_park(3_000, &mut buf);
    assert_eq!(MotionRequest::parse(bytes).unwrap().extend, 0);
}

#[test]
fn vibration_stands_two_bytes_further_back_where_port_out_takes_four() {
    let cue = cue("time_ms,a1,v1_hz,v1_amp\n0,0,20,0.01\n1000,0,20,0.01\n");
    let mut config = hall(&["127.0.0.1:1"], 1);
    config.controllers[0].station_mut().vibration_port = VibrationPort::Four;
    let mut lane = lanes(&config, &cue, FULL).remove(0);
    let mut beat = Beat::still(Timing::Relative, 10);
    beat.effects = EffectSet::Word(0x0003);
    beat.samples.set(ChannelId::Vibration.on(0), Sample([20.0, 0.01]));
    let mut buf = [0xa5; MAX_LEN];
    let park = lane.window.park();
    let (_, bytes) = lane.encode(&beat, &park, Mix::FULL, &mut buf);
    assert_eq!((bytes.len(), &bytes[32..36]), (48, &[0, 0, 0, 3][..]));
    let frame = MotionRequest::parse_as(VibrationPort::Four, bytes).unwrap();
    assert_eq!(frame.vibration.unwrap()[0], Vibration { period: 400, amplitude: 3_000 });
    let (_, bytes) = lane.encode_slow_park(3_000, &mut buf);
    assert_eq!(bytes.len(), 38, "a frame without vibration is the same for all");
}

#[test]
fn the_way_home_is_relative_and_plain_and_takes_a_frame_number() {
    let cue = cue("time_ms,a1,v1_hz,v1_amp\n0,0,20,0.01\n1000,0,20,0.01\n");
    let mut lane = lanes(&hall(&["127.0.0.1:1"], 1), &cue, FULL).remove(0);
    let mut buf = [0xa5; MAX_LEN];
    let (first, bytes) = lane.encode_slow_park(3_000, &mut buf);
    assert_eq!((first.frame, &bytes[4..6]), (FrameNo(1), &[0x14, 0x01][..]));
    let (second, bytes) =
        lane.encode(&Beat::still(Timing::Relative, 10), &lane.window.park(), Mix::FULL, &mut buf);
    assert_eq!((second.frame, &bytes[4..6]), (FrameNo(2), &[0x19, 0x01][..]));
}

#[test]
fn drives_vibrate_by_the_level_of_their_seat_on_top_of_the_mix() {
    let text = std::fs::read_to_string("tests/data/config/drives.toml").unwrap();
    let text = text.replace("max_error_mm = 3.0", "max_error_mm = 3.0\nvibration = \"50%\"");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hall.toml");
    std::fs::write(&path, text).unwrap();
    let config = crate::config::load(&path).unwrap();
    let cue = cue("# units: fraction\ntime_ms,a1,v1_hz,v1_amp\n0,0.5,5,0.1\n1000,0.5,5,0.1\n");
    let mut beat = Beat::still(Timing::Relative, 10);
    beat.samples.set(ChannelId::Vibration.on(0), Sample([5.0, 0.1]));
    let amplitudes = lanes(&config, &cue, FULL).into_iter().map(|mut lane| {
        let mut buf = [0; MAX_LEN];
        let mix = Mix { vibration: 0.5, ..Mix::FULL };
        let (_, record) = lane.encode(&beat, &[0.5; MAX_AXES], mix, &mut buf);
        LinkPose::parse(record.try_into().unwrap()).vibration[0].amplitude
    });
    assert_eq!(amplitudes.collect::<Vec<_>>(), [0.025, 0.05], "the second seat has no level of its own");
}
