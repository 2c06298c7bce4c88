use super::*;

#[test]
fn a_frame_is_obeyed_in_its_time_and_answered_with_itself_and_the_inputs() {
    let mut bench = Bench::with(&[]);
    bench.controller.set_switches(0b101, at(0));
    let answer = bench.play(&FRAME).unwrap();
    assert_eq!((answer.code, answer.frame, answer.time_ms), (ReplyCode::Running, FrameNo(7), 100));
    assert_eq!((&answer.positions[..], answer.inputs), (FRAME.positions, 0b101));
    assert_eq!(bench.wait(50).positions(), [500, 1_000, -1_500]);
    assert_eq!(bench.wait(50).positions(), [1_000, 2_000, -3_000]);
    let counts = bench.controller.counts();
    assert_eq!((counts.received, counts.accepted, counts.replied, counts.executed), (1, 1, 1, 1));
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
    assert_eq!(Bench::with(&[(pa::INTERVAL, 0)]).duration(&timed(0)), 100);
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

fn an_imax_told_so_makes_of_lateness_speed() {
    let parameters = vec![(pa::INTERVAL_SOURCE, 1)];
    let mut late = Bench::new(&Setup { dialect: Dialect::Mbox, parameters, ..Setup::default() });
    late.x(&FRAME);
    late.wait(100).word(0, 0x5e);
    late.wait(20).x(&Motion { positions: &[Pulses(2_000), Pulses(2_000), Pulses(-3_000)], ..FRAME });
    assert_eq!(
        late.wait(20).positions()[0],
        2_000,
        "in the 20 ms since the datagram before, not in its 100 ms"
    );
    let mut smc = Bench::with(&[(pa::INTERVAL_SOURCE, 1)]);
    smc.x(&FRAME);
    assert_eq!(smc.wait(50).positions(), [500, 1_000, -1_500], "there it is for commands without a Time");
}

#[test]
fn inverted_outputs_are_on_where_a_frame_says_off() {
    let mut bench = Bench::with(&[(pa::OUTPUT_POLARITY, 1)]);
    bench.x(&Motion { outputs: 5, ..FRAME });
    assert_eq!(bench.word(0, 0x66), 0x0ffa);
}

#[test]
fn a_controller_whose_port_out_takes_four_bytes_reads_outputs_and_vibration_there_and_refuses_two() {
    let invented = Invented { vibration_port: VibrationPort::Four, ..Invented::default() };
    let mut bench = Bench::new(&Setup { invented, ..Setup::default() });
    bench.controller.set_switches(1, at(0));
    bench.wait(1_000);
    let shake = [Vibration { period: 400, amplitude: 10 }; 3];
    let motion = Motion { vibration: Some(&shake), outputs: 0x0801, ..FRAME };
    let bytes = motion.emit_as(VibrationPort::Four, &mut [0; MAX_LEN]).to_vec();
    let answer = MotionReply::parse_as(VibrationPort::Four, &bench.send(&bytes).unwrap()).unwrap();
    assert_eq!((answer.code, answer.vibration.as_deref()), (ReplyCode::Running, Some(&shake[..])));
    assert_eq!((bench.controller.outputs(), answer.inputs), (0x0801, 1));
    assert_eq!(bench.wait(100).positions(), [1_000, 2_000, -3_000]);

    let bytes = motion.emit(&mut [0; MAX_LEN]).to_vec();
    let answer = MotionReply::parse_as(VibrationPort::Four, &bench.send(&bytes).unwrap()).unwrap();
    assert_eq!((answer.code, bytes.len()), (ReplyCode::Command, 46), "it ends two bytes too soon");
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
