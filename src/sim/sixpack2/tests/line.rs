//! On a line that loses and changes octets, and on a pseudo-terminal.

use super::*;
use crate::sim::serial::{LineFaults, PtyLoop, SerialLine};
use crate::sys::clock::Monotonic;
use crate::sys::serial::{SerialPort, SerialSettings, StopBits};
use crate::time::Clock as _;

fn line(faults: LineFaults) -> (SerialLine<SixpackBus>, MonoTime) {
    let now = MonoTime::from_nanos(1_000_000_000);
    (SerialLine::new(SixpackBus::waking([setup()], now), 10, faults, 7), now)
}

fn books(line: &SerialLine<SixpackBus>) -> UnitBooks {
    line.bus().units()[0].books
}

#[test]
fn a_lost_or_doubled_octet_costs_no_frame_but_its_own_where_each_follows_a_break() {
    let (mut line, mut now) = line(LineFaults { lost: 0.01, doubled: 0.01, ..LineFaults::default() });
    for place in 0..300 {
        line.send_break(now);
        line.send(&target(0, place).frame(UNIT).octets(), now);
        now = now + MS(10);
        line.advance(now);
    }
    // Nine octets of ten are unharmed with a chance of 0.83; one that is doubled leaves a frame that says something else.
    let UnitBooks { frames, .. } = books(&line);
    assert!((235..300).contains(&frames), "{frames}");
    line.faults = LineFaults::default();
    line.send_break(now);
    line.send(&target(0, 300).frame(UNIT).octets(), now);
    line.advance(now + MS(10));
    assert_eq!(books(&line).frames, frames + 1);
}

#[test]
fn a_flipped_bit_is_obeyed_since_nothing_tells_it() {
    let (mut line, now) = line(LineFaults { flipped: 1.0, ..LineFaults::default() });
    let sent = target(0, 0).frame(0).octets();
    let reached = (0..200).any(|round| {
        let now = now + MS(10) * round;
        line.send_break(now);
        line.send(&sent, now);
        line.advance(now + MS(10));
        books(&line).frames > 0
    });
    assert!(reached, "a frame to nobody reaches unit 1 by a bit of its address");
}

#[test]
fn at_the_rate_before_or_after_a_switch_nothing_is_understood() {
    let (mut line, now) = line(LineFaults::default());
    line.set_host_baud(Some(56_818));
    line.send(&target(0, 0).frame(UNIT).octets(), now);
    line.advance(now + MS(10));
    assert_eq!(books(&line).frames, 0);
    line.set_host_baud(Some(19_200));
    line.send_break(now + MS(10));
    line.send(&SixpackOrder::Baud(BaudSwitch { divisor: 22, delay: 1 }).frame(UNIT).octets(), now + MS(10));
    line.advance(now + MS(30));
    assert_eq!((books(&line).frames, line.bus().baud()), (1, 56_818));
    line.send(&target(0, 0).frame(UNIT).octets(), now + MS(30));
    line.advance(now + MS(50));
    assert_eq!(books(&line).frames, 1);
}

fn ask(port: &SerialPort, order: SixpackOrder) -> Option<SixpackReply> {
    let deadline = Monotonic.now() + Duration::from_secs(10);
    port.line().write(&order.frame(UNIT).octets(), deadline).unwrap();
    let (mut octets, mut count) = ([0; FRAME_LEN], 0);
    while count < FRAME_LEN {
        match port.line().read(&mut octets[count..], deadline).unwrap() {
            0 => return None,
            more => count += more,
        }
    }
    order.answered_by(SixpackFrame::from_octets(octets))
}

#[test]
fn on_a_pseudo_terminal_a_unit_is_found_switched_and_led_and_the_books_come_back_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stalls");
    let bus = SixpackBus::waking([setup()], Monotonic.now());
    let running =
        PtyLoop::start(SerialLine::new(bus, 10, LineFaults::default(), 0), &path, Vec::new()).unwrap();
    let settings = SerialSettings { baud: 19_231, stop_bits: StopBits::One, is_rs485: false };
    let mut port = SerialPort::open(&path, settings).unwrap();
    let who = SixpackOrder::AskUnit(UnitQuery { response: ANSWER });
    let told = ask(&port, who);
    assert!(matches!(told, Some(SixpackReply::UnitTold(UnitTold { reset: 1, .. }))), "{told:?}");
    // Nothing answers to that: a host waits, and asks at the other rate.
    let switch = SixpackOrder::Baud(BaudSwitch { divisor: 11, delay: 1 }).frame(UNIT).octets();
    port.line().write(&switch, Monotonic.now() + Duration::from_secs(10)).unwrap();
    let deadline = Monotonic.now() + Duration::from_secs(10);
    let (baud, rates) = std::sync::mpsc::channel();
    while Monotonic.now() < deadline {
        let baud = baud.clone();
        running.remote().tell(Box::new(move |line, _| baud.send(line.bus().baud()).unwrap()));
        if rates.recv() == Ok(113_636) {
            break;
        }
    }
    port.set(&path, SerialSettings { baud: 113_636, ..settings }).unwrap();
    let told = ask(&port, who);
    assert!(matches!(told, Some(SixpackReply::UnitTold(UnitTold { reset: 0, .. }))), "{told:?}");
    let octets = target(0, 640).frame(UNIT).octets();
    port.line().write(&octets, Monotonic.now() + Duration::from_secs(10)).unwrap();
    let position = SixpackOrder::AskPosition(PositionQuery { motor: 0, response: ANSWER });
    let is_there = || match ask(&port, position) {
        Some(SixpackReply::PositionTold(told)) => told.position > 600 && told.action == action::PI,
        other => panic!("{other:?}"),
    };
    assert!((0..2_000).any(|_| is_there()));
    let books = books(&running.stop());
    assert!(books.frames >= 5 && books.unknown == 0 && books.collisions == 0, "{books:?}");
}
