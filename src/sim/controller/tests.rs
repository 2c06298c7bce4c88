use super::*;
use crate::wire::{FrameNo, Motion, ReadRequest, RegisterReply, Vibration, Words, WriteRequest};

const HOST: u16 = 8410;

/// A controller in virtual time, and the host that talks to it.
struct Bench {
    controller: Controller,
    at_ms: u64,
    from_port: u16,
}

/// A relative frame to three axes that everyone obeys and answers.
const FRAME: Motion<'static> = Motion {
    timing: Timing::Relative,
    channel: 0,
    accept: Code::ALL,
    reply: Code::ALL,
    frame: FrameNo(7),
    time_ms: 100,
    positions: &[Pulses(1_000), Pulses(2_000), Pulses(-3_000)],
    outputs: 0,
    vibration: None,
};

impl Bench {
    fn new(setup: &Setup) -> Self {
        let address = "192.168.15.201:7408".parse().unwrap();
        Self { controller: Controller::new(setup, address, at(0)), at_ms: 0, from_port: HOST }
    }

    fn with(parameters: &[(u8, u16)]) -> Self {
        Self::new(&Setup { parameters: parameters.to_vec(), ..Setup::default() })
    }

    /// Sends octets and returns the answer.
    fn send(&mut self, octets: &[u8]) -> Option<Vec<u8>> {
        let from = SocketAddrV4::new([192, 168, 15, 101].into(), self.from_port);
        let mut buf = [0xa5; MAX_LEN];
        let handled = self.controller.on_datagram(from, octets, at(self.at_ms), &mut buf);
        handled.reply.map(<[u8]>::to_vec)
    }

    fn play(&mut self, motion: &Motion<'_>) -> Option<MotionReply> {
        let mut buf = [0; MAX_LEN];
        let octets = motion.emit(&mut buf).to_vec();
        self.send(&octets).map(|answer| MotionReply::parse(&answer).unwrap())
    }

    /// Plays a frame and returns the x of its answer and the error.
    fn x(&mut self, motion: &Motion<'_>) -> (u8, u16) {
        let answer = self.play(motion).expect("it answers");
        (answer.code as u8, answer.error)
    }

    /// Reads registers: x and the words.
    fn read(&mut self, channel: u16, start: u16, num: u16) -> (u8, Vec<u16>) {
        let mut buf = [0; MAX_LEN];
        let request = ReadRequest { channel, accept: Code::ALL, reply: Code::ALL, start, num };
        let answer = self.send(request.emit(&mut buf)).expect("it answers");
        let answer = RegisterReply::parse(&answer).unwrap();
        (answer.code as u8, answer.data.iter().collect())
    }

    fn word(&mut self, channel: u16, register: u16) -> u16 {
        self.read(channel, register, 1).1[0]
    }

    /// Writes registers and returns the x of the answer.
    fn write(&mut self, channel: u16, start: u16, words: &[u16]) -> u8 {
        let mut buf = [0; MAX_LEN];
        let data = Words::from(words);
        let request = WriteRequest { channel, accept: Code::ALL, reply: Code::ALL, start, data };
        let answer = self.send(request.emit(&mut buf)).expect("it answers");
        RegisterReply::parse(&answer).unwrap().code as u8
    }

    fn wait(&mut self, ms: u64) -> &mut Self {
        self.at_ms += ms;
        self
    }

    fn positions(&mut self) -> Vec<i32> {
        self.controller.positions(at(self.at_ms)).iter().map(|position| position.0).collect()
    }

    /// How many milliseconds the move takes that a frame starts, at rest.
    fn duration(&mut self, motion: &Motion<'_>) -> u64 {
        self.play(motion);
        let end = self.controller.player.end();
        u64::try_from(end.since(at(self.at_ms)).as_millis()).unwrap()
    }

    fn refused(&self) -> super::super::Refused {
        self.controller.counts().refused
    }
}

fn at(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

fn absolute(time_ms: u32) -> Motion<'static> {
    Motion { timing: Timing::Absolute, time_ms, ..FRAME }
}

#[test]
fn a_frame_is_obeyed_in_its_time_and_answered_with_itself_and_the_inputs() {
    let mut bench = Bench::with(&[]);
    bench.controller.set_inputs(0b101, at(0));
    let answer = bench.play(&FRAME).unwrap();
    assert_eq!((answer.code, answer.frame, answer.time_ms), (ReplyCode::Running, FrameNo(7), 100));
    assert_eq!((&answer.positions[..], answer.inputs), (FRAME.positions, 0b101));
    assert_eq!(bench.wait(50).positions(), [500, 1_000, -1_500]);
    assert_eq!(bench.wait(50).positions(), [1_000, 2_000, -3_000]);
    let counts = bench.controller.counts();
    assert_eq!((counts.received, counts.accepted, counts.replied, counts.executed), (1, 1, 1, 1));
}

#[test]
fn only_the_station_that_is_meant_obeys() {
    let mut bench = Bench::with(&[]);
    for (code, obeyed) in [
        (0xffff, true),
        (0x0fff, true),
        (0xffc9, true),
        (0x0fc9, true),
        (0, false),
        (0x0fca, false),
        (0x00ff, false),
    ] {
        let answer = bench.play(&Motion { accept: Code(code), ..FRAME });
        assert_eq!(answer.is_some(), obeyed, "{code:04x}");
    }
    assert_eq!(bench.refused().not_addressed, 3);
}

#[test]
fn it_obeys_but_is_silent_where_no_answer_is_wanted_or_allowed() {
    let mut bench = Bench::with(&[]);
    assert_eq!(bench.play(&Motion { reply: Code::NONE, ..FRAME }), None);
    assert_eq!(bench.wait(100).positions(), [1_000, 2_000, -3_000]);

    for mut quiet in [Bench::with(&[(pa::ANSWERS, 0)]), Bench::new(&Setup { mute: true, ..Setup::default() })]
    {
        assert_eq!(quiet.play(&FRAME), None);
        assert_eq!(quiet.wait(100).positions(), [1_000, 2_000, -3_000]);
        assert_eq!(quiet.controller.counts().replied, 0);
    }
}

#[test]
fn frames_from_another_port_than_pa24_are_not_there() {
    let mut bench = Bench::with(&[]);
    bench.from_port = 8411;
    assert_eq!(bench.play(&FRAME), None);
    assert_eq!((bench.refused().source_port, bench.wait(100).positions()), (1, vec![0, 0, 0]));

    let mut anyone = Bench::new(&Setup { host_port: 0, ..Setup::default() });
    anyone.from_port = 50_000;
    assert!(anyone.play(&FRAME).is_some());
}

#[test]
fn pa02_says_how_many_axes_move() {
    let mut two = Bench::new(&Setup { axes: 2, ..Setup::default() });
    two.play(&FRAME);
    assert_eq!(two.wait(100).positions(), [1_000, 2_000]);
    let mut six = Bench::new(&Setup { axes: 6, ..Setup::default() });
    six.play(&FRAME);
    assert_eq!(six.wait(100).positions(), [1_000, 2_000, -3_000, 0, 0, 0]);
    assert_eq!([six.write(1, 2, &[13]), six.write(1, 2, &[0]), six.write(1, 2, &[4])], [5, 5, 2]);
    assert_eq!(six.positions().len(), 4);
}

#[test]
fn a_frame_without_time_takes_pa09_and_a_long_one_is_cut_at_pa0b() {
    let timed = |time_ms| Motion { time_ms, ..FRAME };
    assert_eq!(Bench::with(&[]).duration(&timed(0)), 100);
    assert_eq!(Bench::with(&[(pa::INTERVAL, 40)]).duration(&timed(0)), 40);
    assert_eq!(Bench::with(&[]).duration(&timed(10_000)), 3_000);
    assert_eq!(Bench::with(&[(pa::MAX_TIME, 0)]).duration(&timed(10_000)), 10_000);
}

#[test]
fn absolute_time_moves_by_the_difference_and_begins_anew_after_a_relative_frame() {
    let mut bench = Bench::with(&[]);
    assert_eq!(bench.duration(&absolute(15_000)), 100, "a first one takes no longer than PA09");
    assert_eq!(bench.wait(100).duration(&absolute(15_250)), 250);
    assert_eq!(bench.wait(250).duration(&absolute(15_250)), 100, "no difference is no time");
    assert_eq!(bench.wait(100).duration(&absolute(15_240)), 100, "time that goes back is none either");
    bench.wait(100).duration(&FRAME);
    assert_eq!(bench.wait(100).duration(&absolute(60)), 60, "a first one shorter than PA09 takes its time");
}

#[test]
fn pa55_scales_the_movement() {
    let mut bench = Bench::with(&[(pa::AMPLITUDE, 5)]);
    bench.play(&FRAME);
    assert_eq!(bench.wait(100).positions(), [500, 1_000, -1_500]);
}

#[test]
fn pa95_takes_its_own_axes_of_the_command_and_holds_what_it_does_not_reach() {
    let row: Vec<Pulses> = (1..=12).map(|axis| Pulses(axis * 100)).collect();
    let shared = Motion { channel: 2, positions: &row, ..FRAME };
    let mut bench = Bench::with(&[(pa::OFFSET, 6)]);
    bench.play(&shared);
    assert_eq!(bench.wait(100).positions(), [700, 800, 900]);
    bench.write(1, u16::from(pa::OFFSET), &[10]);
    bench.play(&Motion { time_ms: 10, ..shared });
    assert_eq!(bench.wait(100).positions(), [1_100, 1_200, 900]);
    bench.play(&FRAME);
    assert_eq!(bench.wait(100).positions(), [1_100, 1_200, 900]);
}

#[test]
fn each_frame_overwrites_the_outputs_unless_pa9d_says_not_to() {
    let mut bench = Bench::with(&[]);
    bench.play(&Motion { outputs: 0xf005, ..FRAME });
    assert_eq!((bench.controller.outputs(), bench.word(0, 0xf1)), (5, 5));
    assert_eq!(bench.write(2, 1, &[0x0800]), 2);
    assert_eq!(bench.word(0, 0x66), 0x0800);
    bench.play(&FRAME);
    assert_eq!(bench.controller.outputs(), 0);
    bench.write(1, u16::from(pa::KEEP_OUTPUTS), &[1]);
    bench.write(2, 1, &[3]);
    bench.play(&FRAME);
    assert_eq!(bench.controller.outputs(), 3);
}

#[test]
fn a_queue_that_runs_over_stops_the_play_with_err21_until_a_reset() {
    let mut bench = Bench::with(&[]);
    for _ in 0..201 {
        assert_eq!(bench.x(&FRAME), (2, 0));
    }
    bench.wait(50);
    assert_eq!(bench.x(&FRAME), (3, 21));
    let held = bench.positions();
    assert_eq!(held, [500, 1_000, -1_500]);
    assert_eq!(bench.wait(5_000).x(&FRAME), (3, 21));
    assert_eq!((bench.positions(), bench.read(0, 6, 1).0), (held, 3));
    assert_eq!(bench.write(2, 0, &[0]), 2);
    assert_eq!(bench.wait(500).x(&FRAME), (2, 0));
    let counts = bench.controller.counts();
    assert_eq!((counts.queue_overflows, counts.refused.fault), (1, 2));
}

#[test]
fn waiting_frames_run_in_half_their_time_with_pa06() {
    let sent = |parameters: &[(u8, u16)]| {
        let mut bench = Bench::with(parameters);
        for k in 1..=4 {
            bench.play(&Motion { positions: &[Pulses(k * 100); 3], ..FRAME });
        }
        bench.wait(150).positions()[0]
    };
    assert_eq!(sent(&[]), 200);
    assert_eq!(sent(&[(pa::FAST_FORWARD, 0)]), 150);
}

#[test]
fn a_reset_homes_and_drops_motion_meanwhile() {
    let mut bench = Bench::with(&[]);
    bench.play(&FRAME);
    bench.wait(100);
    assert_eq!(bench.word(0, 0xf0), 2);
    assert_eq!(bench.write(2, 0, &[0]), 2);
    assert_eq!(bench.word(0, 0xf0), 1);
    assert_eq!(bench.wait(250).positions(), [500, 1_000, -1_500]);
    assert_eq!(bench.x(&FRAME), (2, 0));
    assert_eq!((bench.wait(250).positions(), bench.word(0, 0xf0)), (vec![0, 0, 0], 2));
    assert_eq!(bench.refused().homing, 1);
    assert_eq!(bench.duration(&absolute(9_000)), 100, "absolute time begins anew");
}

#[test]
fn pa08_resets_too_and_pa0e_goes_to_zero_without_homing() {
    let mut bench = Bench::with(&[(pa::RESET_WAY, 1)]);
    bench.play(&FRAME);
    bench.wait(100);
    assert_eq!(bench.write(1, u16::from(pa::RESET), &[1]), 2);
    assert_eq!(bench.word(1, u16::from(pa::RESET)), 0);
    // 3,000 pulses at 500 pulses/ms.
    assert_eq!((bench.word(0, 0xf0), bench.wait(6).word(0, 0xf0)), (1, 2));
    assert_eq!(bench.positions(), [0, 0, 0]);
}

#[test]
fn a_forced_emergency_stop_holds_and_answers_x_4() {
    let estop_at = Some(Duration::from_millis(50));
    let mut bench = Bench::new(&Setup { estop_at, ..Setup::default() });
    assert_eq!(bench.x(&FRAME), (2, 0));
    assert_eq!(bench.wait(80).x(&FRAME), (4, 0));
    assert_eq!(bench.positions(), [500, 1_000, -1_500]);
    assert_eq!((bench.read(0, 6, 2), bench.write(2, 0, &[0])), ((4, vec![500, 0]), 4));
    assert_eq!(bench.wait(600).positions(), [500, 1_000, -1_500]);
    assert_eq!(bench.refused().emergency_stop, 2);
}

#[test]
fn a_homing_that_an_emergency_stop_cuts_short_never_ends_by_itself() {
    let mut bench = Bench::with(&[(pa::INPUT_FUNCTIONS, 1), (pa::ESTOP_INPUTS, 1), (pa::INPUT_FILTER, 0)]);
    bench.play(&FRAME);
    bench.wait(100).write(2, 0, &[0]);
    bench.controller.set_inputs(1, at(350));
    bench.controller.set_inputs(0, at(400));
    assert_eq!((bench.wait(5_000).word(0, 0xf0), bench.positions()), (1, vec![500, 1_000, -1_500]));
    bench.write(2, 0, &[0]);
    assert_eq!((bench.wait(500).word(0, 0xf0), bench.positions()), (2, vec![0, 0, 0]));
}

#[test]
fn inputs_stop_it_once_pa90_pa92_and_pa93_agree() {
    let mut bench = Bench::with(&[(pa::ESTOP_INPUTS, 3)]);
    bench.controller.set_inputs(3, at(0));
    assert_eq!(bench.wait(300).x(&FRAME), (2, 0), "PA90 does not enable it");
    bench.write(1, u16::from(pa::INPUT_FUNCTIONS), &[1]);
    assert_eq!(bench.wait(199).x(&FRAME).0, 2, "the filter has not passed");
    assert_eq!(bench.wait(1).x(&FRAME).0, 4);
    bench.controller.set_inputs(1, at(bench.at_ms));
    assert_eq!(bench.x(&FRAME).0, 2, "one input of two is none, and PA91 = 0 goes on");
}

#[test]
fn pa91_holds_until_a_reset_or_goes_to_zero() {
    let stop = |way| {
        let mut bench = Bench::with(&[(pa::INPUT_FUNCTIONS, 1), (pa::ESTOP_INPUTS, 1), (pa::ESTOP_WAY, way)]);
        bench.play(&FRAME);
        bench.controller.set_inputs(1, at(100));
        bench.wait(400).positions();
        bench.controller.set_inputs(0, at(400));
        bench
    };
    let mut zero = stop(1);
    assert_eq!((zero.positions(), zero.x(&FRAME).0), (vec![0, 0, 0], 2));
    let mut latched = stop(2);
    assert_eq!((latched.positions(), latched.x(&FRAME).0), (vec![1_000, 2_000, -3_000], 4));
    assert_eq!(latched.write(2, 0, &[0]), 2);
    assert_eq!(latched.wait(500).x(&FRAME).0, 2);
}

#[test]
fn broken_requests_are_answered_with_x_5_where_they_say_whose_they_are() {
    let mut bench = Bench::with(&[]);
    let mut buf = [0; MAX_LEN];
    let frame = FRAME.emit(&mut buf).to_vec();
    let answer = MotionReply::parse(&bench.send(&frame[..37]).unwrap()).unwrap();
    assert_eq!((answer.code, answer.frame, answer.time_ms), (ReplyCode::Command, FrameNo(7), 100));
    assert_eq!(bench.send(&frame[..19]), None);
    assert_eq!(bench.send(b"55aa"), None);
    assert_eq!(bench.read(0, 0xff, 4), (5, vec![]));
    assert_eq!(bench.read(3, 0, 1).0, 5);
    assert_eq!(bench.write(2, 16, &[0]), 5);
    assert_eq!((bench.refused().command, bench.refused().malformed), (4, 2));
    let counts = bench.controller.counts();
    assert_eq!(counts.received, counts.accepted + counts.refused.total());
}

#[test]
fn a_controller_does_not_answer_what_controllers_say() {
    let mut bench = Bench::with(&[]);
    let answer = bench.play(&FRAME).unwrap();
    let mut buf = [0; MAX_LEN];
    assert_eq!(bench.send(answer.emit(&mut buf)), None);
}

#[test]
fn positions_stand_in_dp06_and_dp21_in_the_word_order_of_the_dialect() {
    let far = [Pulses(70_000), Pulses(-2), Pulses(0), Pulses(0), Pulses(0), Pulses(131_073)];
    let motion = Motion { channel: 1, positions: &far, time_ms: 1_000, ..FRAME };
    let words = |dialect| {
        let mut bench = Bench::new(&Setup { axes: 6, dialect, ..Setup::default() });
        bench.play(&motion);
        bench.wait(1_000);
        (bench.read(0, 0x06, 4).1, bench.read(0, 0x25, 2).1)
    };
    assert_eq!(words(Dialect::Smc), (vec![4_464, 1, 0xfffe, 0xffff], vec![1, 2]));
    assert_eq!(words(Dialect::Mbox), (vec![1, 4_464, 0xffff, 0xfffe], vec![2, 1]));
}

#[test]
fn channel_0_of_a_write_means_parameters_on_mbox_and_monitors_on_smc() {
    for (dialect, value) in [(Dialect::Smc, 0), (Dialect::Mbox, 5)] {
        let mut bench = Bench::new(&Setup { dialect, ..Setup::default() });
        assert_eq!(bench.write(0, 0x55, &[5]), 2);
        assert_eq!(bench.word(1, 0x55), value, "{dialect:?}");
    }
}

#[test]
fn vibration_is_for_smc_alone() {
    let shake = [Vibration { period: 400, amplitude: 10 }; 3];
    let motion = Motion { vibration: Some(&shake), ..FRAME };
    let mut bench = Bench::with(&[]);
    let answer = bench.play(&motion).unwrap();
    assert_eq!((answer.code, answer.vibration.as_deref()), (ReplyCode::Running, Some(&shake[..])));
    let mut mbox = Bench::new(&Setup { dialect: Dialect::Mbox, ..Setup::default() });
    assert_eq!(mbox.x(&motion).0, 3);
    assert_eq!(mbox.wait(100).positions(), [0, 0, 0]);
}

#[test]
fn a_reboot_is_silent_for_a_while_and_forgets_what_was_not_kept() {
    let mut bench = Bench::with(&[(pa::START_OUTPUTS, 8)]);
    bench.write(1, u16::from(pa::AMPLITUDE), &[5]);
    assert_eq!(bench.write(2, 2, &[1]), 2);
    assert_eq!(bench.wait(1_499).play(&FRAME), None);
    bench.wait(1);
    assert_eq!((bench.word(1, u16::from(pa::AMPLITUDE)), bench.controller.outputs()), (0, 8));
    assert_eq!(bench.refused().rebooting, 1);
}

#[test]
fn servo_registers_are_refused_by_name() {
    let mut bench = Bench::with(&[]);
    let mut buf = [0; MAX_LEN];
    let read = crate::wire::ServoRead { servo: 1, accept: Code::ALL, reply: Code::ALL, start: 508, num: 1 };
    let answer = bench.send(read.emit(&mut buf)).unwrap();
    assert_eq!(answer[..6], [0x33, 0xcc, 0, 0, 0x21, 5]);
}
