use super::*;
use crate::wire::{ServoRead, ServoReply, ServoWrite};

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
    for (dialect, x, value) in [(Dialect::Smc, 2, 47), (Dialect::Mbox, 2, 5)] {
        let mut bench = Bench::new(&Setup { dialect, ..Setup::default() });
        assert_eq!(bench.write(0, 0x33, &[5]), x, "{dialect:?}");
        assert_eq!(bench.word(1, 0x33), value, "{dialect:?}");
    }
}

#[test]
fn parameters_of_mbox_are_kept_by_channel_1_and_those_of_smc_by_pa0f() {
    let mut mbox = Bench::new(&Setup { dialect: Dialect::Mbox, ..Setup::default() });
    assert_eq!([mbox.write(0, 0x30, &[40]), mbox.write(1, 0x31, &[41])], [2, 2]);
    mbox.controller.act(&Action::Reboot, at(0));
    assert_eq!((mbox.wait(1_500).word(1, 0x30), mbox.word(1, 0x31)), (47, 41));

    let mut smc = Bench::with(&[]);
    smc.write(1, 0x31, &[41]);
    assert_eq!((smc.write(1, 0x0f, &[2]), smc.word(1, 0x0f)), (2, 0));
    smc.write(1, 0x30, &[40]);
    smc.controller.act(&Action::Reboot, at(0));
    assert_eq!((smc.wait(1_500).word(1, 0x30), smc.word(1, 0x31)), (47, 41));
    assert_eq!((smc.write(1, 0x0f, &[1]), smc.word(1, 0x31)), (2, 47));
}

#[test]
fn a_register_or_value_that_is_not_in_the_manuals_changes_nothing() {
    for (dialect, x) in [(Dialect::Smc, 5), (Dialect::Mbox, 3)] {
        let mut bench = Bench::new(&Setup { dialect, ..Setup::default() });
        for (channel, start, words) in [
            (1, 0x91, &[3][..]),
            (1, 0x1c, &[1]),
            (1, 0x100, &[0]),
            (1, 0x06, &[2]),
            (1, 0x06, &[0, 3_000, 2]), // the last one is out of range
            (2, 3, &[0]),
            (2, 16, &[0]),
            (3, 0x06, &[0]),
        ] {
            assert_eq!(bench.write(channel, start, words), x, "{dialect:?} {channel} {start:02x} {words:?}");
        }
        assert_eq!((bench.word(1, 0x06), bench.word(1, 0x91)), (1, 0));
        assert_eq!((bench.read(1, 0xff, 2).0, bench.read(2, 0, 1).0), (x, x));
        assert_eq!(bench.refused().command, 10);
    }
}

#[test]
fn registers_of_another_dialect_are_not_there() {
    let mut mbox = Bench::new(&Setup { dialect: Dialect::Mbox, ..Setup::default() });
    assert_eq!([mbox.write(1, 0x1f, &[1]), mbox.write(1, 0x0d, &[9]), mbox.write(2, 2, &[1])], [3, 3, 3]);
    assert_eq!(mbox.word(0, 0xf5), 3);
    let mut smc = Bench::with(&[]);
    assert_eq!((smc.write(1, 0x50, &[1]), smc.word(1, 0x50), smc.word(0, 0xf5)), (5, 0, 0));
}

#[test]
fn measured_registers_are_written_on_smc_in_vain() {
    let mut smc = Bench::with(&[]);
    assert_eq!((smc.write(0, 0x06, &[5, 5]), smc.read(0, 0x06, 2).1), (2, vec![0, 0]));
    assert_eq!((smc.write(0, 0xf1, &[3]), smc.word(0, 0x66)), (2, 3), "DPF1 is no measurement");
}

#[test]
fn unused_registers_read_0_or_are_refused() {
    let mut bench = Bench::with(&[]);
    assert_eq!(bench.read(0, 0x00, 0x0c).1, [0; 12]);
    let mut strict = Bench::new(&Setup {
        invented: Invented { unused_read: false, ..Invented::default() },
        ..Setup::default()
    });
    assert_eq!((strict.read(0, 0x03, 1).0, strict.read(0, 0x06, 6).0, strict.read(1, 0x1c, 1).0), (5, 2, 5));
}

#[test]
fn a_refusal_of_smc_has_the_error_in_slot_6_and_one_of_mbox_where_the_data_stood() {
    let refusal = |dialect| {
        let mut bench = Bench::new(&Setup { dialect, ..Setup::default() });
        bench.controller.act(&Action::Error(12), at(0));
        let mut buf = [0; MAX_LEN];
        let data = Words::from(&[9][..]);
        let codes = (Code::ALL, Code::ALL);
        let bad = WriteRequest { channel: 1, accept: codes.0, reply: codes.1, start: 0x06, data };
        let read = ReadRequest { channel: 1, accept: codes.0, reply: codes.1, start: 0x02, num: 1 };
        let [bad, read] = [bad.emit(&mut buf).to_vec(), read.emit(&mut buf).to_vec()]
            .map(|bytes| bench.send(&bytes).unwrap());
        (bad[4..8].to_vec(), bad[12..].to_vec(), read[4..8].to_vec())
    };
    let (bad, data, read) = refusal(Dialect::Smc);
    assert_eq!((bad, read), (vec![0x12, 5, 0, 0], vec![0x11, 3, 0, 12]));
    assert_eq!(data, [0, 6, 0, 1, 0, 9]);
    let (bad, data, read) = refusal(Dialect::Mbox);
    assert_eq!((bad, read), (vec![0x12, 3, 0, 1], vec![0x11, 2, 0, 1]));
    assert_eq!(data, [0, 6, 0, 1, 0, 0]);
}

#[test]
fn the_monitors_tell_of_speed_time_and_traffic() {
    let mut bench = Bench::new(&Setup { axes: 6, ..Setup::default() });
    let positions = [Pulses(1_000), Pulses(-500), Pulses(0), Pulses(0), Pulses(0), Pulses(2_000)];
    bench.play(&Motion { channel: 1, positions: &positions, ..FRAME });
    bench.wait(40);
    assert_eq!(bench.read(0, 0x00, 3).1, [60, 65_506, 0], "rpm at 10,000 pulses per turn");
    assert_eq!((bench.word(0, 0x1a), bench.word(0, 0x1d)), (120, 0));
    assert_eq!((bench.word(0, 0x50), bench.word(0, 0x55)), (60, 60));
    assert_eq!((bench.word(0, 0x33), bench.word(0, 0x34)), (16, 8), "this read is the eighth");
    assert_eq!([0x35, 0x37, 0x38].map(|register| bench.word(0, register)), [100, 0x1401, 100]);
    assert_eq!((bench.word(0, 0x90), bench.word(0, 0x95)), (10, 11));
    bench.play(&FRAME);
    assert_eq!(bench.read(0, 0x48, 2).1, [2, 1]);
    let mut mbox = Bench::new(&Setup { axes: 6, dialect: Dialect::Mbox, ..Setup::default() });
    mbox.play(&Motion { channel: 1, positions: &positions, ..FRAME });
    assert_eq!((mbox.wait(40).word(0, 0x1d), mbox.word(0, 0x1a)), (120, 0));
    assert_eq!(mbox.wait(7).word(0, 0xf6), 7);
}

#[test]
fn the_version_stands_in_dpff_and_dpfe() {
    let mut bench = Bench::new(&Setup {
        invented: Invented { version: [3, 14], ..Invented::default() },
        ..Setup::default()
    });
    assert_eq!(bench.read(0, 0xfe, 2).1, [14, 3]);
}

/// Asks a drive: x, slot 6 and the words.
fn servo(bench: &mut Bench, bytes: &[u8]) -> Option<(u8, u16, Vec<u16>)> {
    bench.send(bytes).map(|answer| {
        let reply = ServoReply::parse(&answer).unwrap();
        (reply.code as u8, reply.servo.max(reply.error), reply.data.iter().collect())
    })
}

#[test]
fn drives_keep_what_is_written_to_their_registers_at_most_six_at_a_time() {
    let mut bench = Bench::with(&[]);
    let mut buf = [0; MAX_LEN];
    let mut ask = |bench: &mut Bench, servo_id, start, num| {
        let read = ServoRead { channel: servo_id, accept: Code::ALL, reply: Code::ALL, start, num };
        servo(bench, read.emit(&mut buf))
    };
    assert_eq!(ask(&mut bench, 1, 508, 1), Some((2, 1, vec![0])));
    let mut buf = [0; MAX_LEN];
    let data = Words::from(&[7, 8][..]);
    let write = ServoWrite { channel: 3, accept: Code::ALL, reply: Code::ALL, start: 508, data };
    assert_eq!(servo(&mut bench, write.emit(&mut buf)), Some((2, 3, vec![7, 8])));
    assert_eq!(ask(&mut bench, 3, 507, 6), Some((2, 3, vec![0, 7, 8, 0, 0, 0])));
    assert_eq!(ask(&mut bench, 2, 508, 1), Some((2, 2, vec![0])));
    for (id, start, num) in [(0, 508, 1), (4, 508, 1), (1, 508, 7), (1, 508, 0), (1, 995, 6), (1, 65_535, 6)]
    {
        assert_eq!(ask(&mut bench, id, start, num), Some((5, 0, vec![])), "{id} {start} {num}");
    }
    bench.controller.act(&Action::Error(3), at(0));
    assert_eq!(ask(&mut bench, 3, 508, 1), Some((3, 3, vec![])), "nobody can speak to that drive");
    let mut mbox = Bench::new(&Setup { dialect: Dialect::Mbox, ..Setup::default() });
    assert_eq!(ask(&mut mbox, 1, 508, 1), None);
}
