use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::path::Path;

use rtrb::RingBuffer;

use super::*;
use crate::config::{Config, LossPolicy, from_to_args};
use crate::cue::{Source, read};
use crate::drive::{Incoming, Manner, lanes};
use crate::health::Groups;
use crate::motion::Pulses;
use crate::net::Ports;
use crate::observe::Watched;
use crate::rt::{AckLoop, MailEnds, mailboxes};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, Rate};
use crate::timeline::Timeline;
use crate::wire::{
    Access, Dialect, FrameNo, FromController, MAX_LEN, MotionReply, PerAxis, RegisterReply, Timing,
    VibrationPort, Words,
};

/// A watch over one controller with a belt, and room for two alarms.
fn watch(dialect: Dialect) -> (Watch, rtrb::Consumer<Alarm>, Observer) {
    let mut config = from_to_args(&["127.0.0.1:9".to_owned()], &[], 1).unwrap();
    config.controllers[0].station_mut().dialect = dialect;
    config.controllers[0].belt_inputs = 1;
    watch_over(&config, 2)
}

/// A watch over the controllers of a configuration, and room for so many alarms.
fn watch_over(config: &Config, room: usize) -> (Watch, rtrb::Consumer<Alarm>, Observer) {
    let cue = read(Path::new("a.csv"), &b"time_ms,a1\n0,0\n1000,0.1\n"[..], &Source::Native).unwrap();
    let stations = config.stations();
    let addresses: Vec<_> = stations.iter().map(|one| one.connection.address).collect();
    let lanes = lanes(config, &Timeline::new(cue), Manner { level: 1.0, silent: false });
    let (sender, _) = Ports::open("127.0.0.1:0".parse().unwrap(), &addresses).unwrap().split();
    let (producer, alarms) = RingBuffer::new(room);
    let health =
        HealthTable::new(Groups::of(&config.controllers), LossPolicy::Continue, 1, Duration::from_millis(10));
    let watch = Watch::new(health, &config.controllers, &lanes, sender, producer, Arc::default());
    (watch, alarms, Observer::new(stations.iter().map(Watched::of).collect()))
}

#[test]
fn a_refusal_of_an_mbox_tells_no_inputs_though_a_belt_waits_for_them() {
    let refusal = RegisterReply {
        access: Access::Read,
        code: ReplyCode::Fault,
        channel: 0,
        error: 0,
        start: 0x5e,
        num: 1,
        data: Words::from(&[3][..]),
    };
    for (dialect, told) in [(Dialect::Smc, Some(3)), (Dialect::Mbox, None)] {
        let (mut watch, _, mut observer) = watch(dialect);
        let (message, at) = (FromController::Registers(refusal), MonoTime::default());
        assert!(!observer.hear(0, &message, at));
        watch.hear(&mut observer, 0, Incoming { message, at, others_ask: false });
        assert_eq!(observer.states()[0].inputs.map(|inputs| inputs.value), told, "{dialect:?}");
    }
}

#[test]
fn no_alarm_is_dropped_where_the_tick_thread_has_no_room_and_all_come_in_their_order() {
    let (mut watch, mut alarms, _) = watch(Dialect::Smc);
    let all: Vec<Alarm> = (0..7).map(Alarm::Leave).collect();
    all.iter().for_each(|alarm| watch.alarm(*alarm));
    let mut heard = Vec::new();
    while heard.len() < all.len() {
        watch.send_alarms();
        assert!(!alarms.is_empty(), "{heard:?}");
        heard.extend(std::iter::from_fn(|| alarms.pop().ok()));
    }
    assert_eq!(heard, all);
}

#[test]
fn an_emergency_stop_cuts_every_lane_of_its_seat_and_no_other() {
    let tos = ["127.0.0.1:9", "127.0.0.2:9", "127.0.0.3:9"].map(str::to_owned);
    let mut config = from_to_args(&tos, &[], 1).unwrap();
    config.controllers[1].group = config.controllers[0].group.clone();
    let (mut watch, mut alarms, mut observer) = watch_over(&config, 8);
    let at = MonoTime::from_nanos(1_000_000);
    observer.on_code(1, ReplyCode::EmergencyStop, at);
    watch.look(&observer, at);
    let heard: Vec<_> = std::iter::from_fn(|| alarms.pop().ok()).collect();
    let is_of_lane = |alarm: &&Alarm| !matches!(alarm, Alarm::Event(_));
    let of_lanes: Vec<_> = heard.iter().filter(is_of_lane).collect();
    assert_eq!(of_lanes, [&Alarm::Cut(0), &Alarm::Cut(1)], "{heard:?}");
}

/// Acks are matched when all that came was read; a count of datagrams is held against them before that.
#[test]
fn what_was_acked_before_an_answer_came_is_in_the_books_when_that_is_heard() {
    let controller = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let SocketAddr::V4(address) = controller.local_addr().unwrap() else { panic!("it is IPv4") };
    let ports = Ports::open("127.0.0.1:0".parse().unwrap(), &[address]).unwrap();
    let ours = SocketAddrV4::new(Ipv4Addr::LOCALHOST, ports.local().port());
    let live = Arc::new(Live::new(1));
    let (mut mail, MailEnds { sent, ticks, .. }) = mailboxes(1, Rate::from_hz(1_000.0), Arc::clone(&live));
    let (dialect, vibration_port) = (Dialect::Smc, VibrationPort::Two);
    let watched = Watched { address, dialect, vibration_port, estop_inputs: 0 };
    let mut acks = AckLoop::new(ports.split().1, vec![watched], 1, sent, ticks);
    acks.tell(Arc::clone(&live));
    let frame = FrameNo(1);
    let (at, lights, shakes) = (Monotonic.now(), false, 0.0);
    mail.post(Sent::Posted { lane: 0, frame, asked: true, at, lights, shakes });
    let (timing, code, positions) = (Timing::Relative, ReplyCode::Running, PerAxis::new(&[Pulses(0); 3]));
    let (channel, error, time_ms, inputs, extend, vibration) = (0, 0, 1, 0, 0, None);
    let ack =
        MotionReply { timing, code, channel, error, frame, time_ms, positions, inputs, extend, vibration };
    let (access, start, num) = (Access::Read, 0x34, 1);
    let count = RegisterReply { access, code, channel, error, start, num, data: Words::from(&[7][..]) };
    controller.send_to(ack.emit(&mut [0; MAX_LEN]), ours).unwrap();
    controller.send_to(count.emit(&mut [0; MAX_LEN]), ours).unwrap();
    let mut acked = Vec::new();
    acks.drain(&mut |controller, _| {
        acked.push(live.evidence(controller).unwrap().acked());
        true
    });
    assert_eq!(acked, [Some(frame)]);
}
