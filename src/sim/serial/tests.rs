//! Lines in virtual time with a bus that repeats what it hears, and one on a pseudo-terminal.

use std::fs;
use std::path::Path;
use std::time::Duration;

use super::*;
use crate::sys::clock::Monotonic;
use crate::sys::serial::{PortFault, SerialPort, SerialSettings, StopBits};
use crate::time::Clock as _;

/// Answers each octet with itself, a millisecond later.
#[derive(Debug, Default)]
struct Parrot {
    waiting: Vec<(MonoTime, u8)>,
    breaks: u32,
}

const DELAY: Duration = Duration::from_millis(1);

impl Bus for Parrot {
    fn on_octet(&mut self, octet: u8, now: MonoTime) {
        self.waiting.push((now + DELAY, octet));
    }

    fn on_break(&mut self, _now: MonoTime) {
        self.breaks += 1;
    }

    fn advance(&mut self, _now: MonoTime) {}

    fn take_octet(&mut self, now: MonoTime) -> Option<u8> {
        let is_due = self.waiting.first().is_some_and(|(at, _)| *at <= now);
        is_due.then(|| self.waiting.remove(0).1)
    }

    fn next(&self) -> Option<MonoTime> {
        self.waiting.first().map(|(at, _)| *at)
    }

    fn baud(&self) -> u32 {
        57_600
    }
}

fn at(us: u64) -> MonoTime {
    MonoTime::from_nanos(us * 1_000)
}

/// What the host has received by then, octet by octet with the time at which it came.
fn heard(line: &mut SerialLine<Parrot>, until: MonoTime) -> Vec<(MonoTime, u8)> {
    let mut heard = Vec::new();
    while let Some(now) = line.next().filter(|next| *next <= until) {
        line.advance(now);
        heard.extend(std::iter::from_fn(|| line.receive(now)).map(|octet| (now, octet)));
    }
    heard
}

fn octets(heard: &[(MonoTime, u8)]) -> Vec<u8> {
    heard.iter().map(|(_, octet)| *octet).collect()
}

fn line(faults: LineFaults) -> SerialLine<Parrot> {
    SerialLine::new(Parrot::default(), 11, faults, 7)
}

#[test]
fn an_octet_takes_its_bits_at_the_baud_rate_in_each_direction() {
    let mut line = line(LineFaults::default());
    line.send(b"abc", at(0));
    let heard = heard(&mut line, at(100_000));
    assert_eq!(octets(&heard), b"abc");
    // 11 bits at 57,600 baud are 191 µs: three there, a millisecond, the last one back.
    let last = heard[2].0.as_nanos();
    assert!((4 * 190_972 + 1_000_000 - 4..=4 * 190_972 + 1_000_000).contains(&last), "{last}");
}

#[test]
fn a_fault_by_chance_is_the_same_for_the_same_seed_and_as_frequent_as_asked_for() {
    let many = [0x55; 2_000];
    let run = |faults| {
        let mut line = line(faults);
        line.send(&many, at(0));
        octets(&heard(&mut line, at(10_000_000)))
    };
    let lost = run(LineFaults { lost: 0.1, ..LineFaults::default() });
    assert!((1_500..1_740).contains(&lost.len()), "81 % pass both ways: {}", lost.len());
    assert_eq!(lost, run(LineFaults { lost: 0.1, ..LineFaults::default() }));
    let doubled = run(LineFaults { doubled: 0.1, ..LineFaults::default() });
    assert!((2_300..2_540).contains(&doubled.len()), "{}", doubled.len());
    let flipped = run(LineFaults { flipped: 0.1, ..LineFaults::default() });
    let bits: u32 = flipped.iter().map(|octet| (octet ^ 0x55).count_ones()).sum();
    assert!((300..500).contains(&bits) && flipped.len() == many.len(), "{bits}");
}

#[test]
fn late_octets_keep_their_order() {
    let late_by = Duration::from_millis(30);
    let mut line = line(LineFaults { late: 0.2, late_by, ..LineFaults::default() });
    line.send(b"abcdefghijklmnopqrstuvwxyz", at(0));
    let heard = heard(&mut line, at(10_000_000));
    assert_eq!(octets(&heard), b"abcdefghijklmnopqrstuvwxyz");
    assert!(heard[25].0 > at(60_000), "{:?}", heard[25]);
}

#[test]
fn an_answer_that_is_lost_is_lost_whole_and_the_next_one_comes() {
    let mut line = line(LineFaults { lose_answers: 1, ..LineFaults::default() });
    line.send(b"abc", at(0));
    assert_eq!(heard(&mut line, at(50_000)), []);
    line.send(b"def", at(60_000));
    assert_eq!(octets(&heard(&mut line, at(100_000))), b"def");
}

#[test]
fn an_adapter_with_echo_returns_what_is_sent_before_the_answer() {
    let mut line = line(LineFaults { echo: true, ..LineFaults::default() });
    line.send(b"ab", at(0));
    assert_eq!(octets(&heard(&mut line, at(50_000))), b"abab");
}

#[test]
fn an_adapter_that_holds_back_hands_over_where_its_timer_runs_out() {
    let mut line = line(LineFaults { held: Duration::from_millis(16), ..LineFaults::default() });
    line.send(b"ab", at(100));
    let heard = heard(&mut line, at(50_000));
    assert_eq!(heard, [(at(16_000), b'a'), (at(16_000), b'b')]);
}

#[test]
fn at_another_baud_rate_nothing_is_understood_and_within_four_parts_in_a_hundred_all_is() {
    let mut line = line(LineFaults::default());
    line.set_host_baud(Some(19_200));
    line.send(b"ab", at(0));
    line.advance(at(2_000));
    assert!(line.bus().waiting.iter().all(|(_, octet)| *octet == !b'a' || *octet == !b'b'));
    let _ = heard(&mut line, at(50_000));
    line.set_host_baud(Some(56_818));
    line.send(b"ab", at(60_000));
    assert_eq!(octets(&heard(&mut line, at(90_000))), b"ab");
    line.send_break(at(90_000));
    assert_eq!(line.bus().breaks, 1);
}

#[test]
fn octets_that_are_late_come_before_a_break_and_at_the_rate_at_which_they_were_sent() {
    let late_by = Duration::from_millis(5);
    let mut line = line(LineFaults { late: 1.0, late_by, ..LineFaults::default() });
    line.set_host_baud(Some(57_600));
    line.send(b"ab", at(0));
    line.send_break(at(1_000));
    line.set_host_baud(Some(19_200));
    line.advance(at(4_900));
    assert_eq!((line.bus().waiting.len(), line.bus().breaks), (0, 0));
    line.advance(at(5_900));
    let heard: Vec<u8> = line.bus().waiting.iter().map(|(_, octet)| *octet).collect();
    assert_eq!((heard.as_slice(), line.bus().breaks), (b"ab".as_slice(), 1));
}

const SETTINGS: SerialSettings = SerialSettings { baud: 57_600, stop_bits: StopBits::Two, is_rs485: false };

fn exchange(port: &SerialPort, sent: &[u8]) -> Vec<u8> {
    let deadline = Monotonic.now() + Duration::from_secs(10);
    port.line().write(sent, deadline).unwrap();
    let (mut octets, mut count) = ([0; 64], 0);
    while count < sent.len() {
        match port.line().read(&mut octets[count..], deadline).unwrap() {
            0 => break,
            more => count += more,
        }
    }
    octets[..count].to_vec()
}

fn wait_for(what: &str, is_so: impl Fn() -> bool) {
    let deadline = Monotonic.now() + Duration::from_secs(10);
    while !is_so() {
        assert!(Monotonic.now() < deadline, "{what}");
        std::thread::yield_now();
    }
}

#[test]
fn a_line_on_a_pseudo_terminal_is_found_by_its_link_and_answers_at_its_pace() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stalls");
    let running = PtyLoop::start(line(LineFaults::default()), &path, Vec::new()).unwrap();
    let port = SerialPort::open(&path, SETTINGS).unwrap();
    let begin = Monotonic.now();
    assert_eq!(exchange(&port, b"@16 12 1\r"), b"@16 12 1\r");
    assert!(Monotonic.now().since(begin) >= Duration::from_micros(2_700), "ten octets and the delay");
    assert!(running.remote().tell(Box::new(|line, _| line.faults.lose_answers = 1)));
    drop(port);
    assert_eq!(running.stop().faults.lose_answers, 1);
    assert!(!path.is_symlink(), "the link goes with it");
}

#[test]
fn a_line_that_is_unplugged_vanishes_and_comes_back_under_the_same_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stalls");
    let running = PtyLoop::start(line(LineFaults::default()), &path, Vec::new()).unwrap();
    let port = SerialPort::open(&path, SETTINGS).unwrap();
    assert!(running.remote().tell(Box::new(|line, _| line.faults.unplugged = true)));
    let gone = port.line().read(&mut [0], Monotonic.now() + Duration::from_secs(10));
    assert_eq!(gone, Err(PortFault::Vanished));
    drop(port);
    assert!(running.remote().tell(Box::new(|line, _| line.faults.unplugged = false)));
    wait_for("it comes back", || path.exists());
    let port = SerialPort::open(&path, SETTINGS).unwrap();
    assert_eq!(exchange(&port, b"again"), b"again");
}

#[test]
fn a_link_of_a_line_that_ended_badly_is_replaced_and_nothing_else_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stalls");
    std::os::unix::fs::symlink("/dev/pts/9999", &path).unwrap();
    drop(PtyLoop::start(line(LineFaults::default()), &path, Vec::new()).unwrap());
    fs::write(&path, "kept").unwrap();
    let start = |path: &Path| PtyLoop::start(line(LineFaults::default()), path, Vec::new()).map(drop);
    assert!(matches!(start(&path), Err(PtyError::Taken(_))));
    assert_eq!(fs::read_to_string(&path).unwrap(), "kept", "what was not ours stays");
    assert!(matches!(start(&folder.path().join("no/such")), Err(PtyError::Link { .. })));
}
