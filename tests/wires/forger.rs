//! What the tests have done on a machine of their net: this very program, started there once more, says as a controller, or as the
//! service, what neither has said, by raw sockets. It has the rights for that in its namespaces alone.

use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddrV4, TcpStream};
use std::process::{Child, Stdio};
use std::time::Duration;

use kinocue::harness::motion::Pulses;
use kinocue::wire::{
    Analogue, Code, FrameNo, MAX_LEN, Motion, MotionReply, MotionRequest, PerAxis, ReplyCode, Timing,
};
use socket2::{Domain, Protocol, Socket, Type};

use crate::hall::{FRAME_PORT, PORT, SEATS, SHOW};
use crate::net::Machine;

/// What it is told to do there.
const TASK: &str = "KINOCUE_WIRES_TASK";
/// Longer than anything takes until a datagram comes by.
const PATIENCE: Duration = Duration::from_secs(20);
/// The number of the frame with a wrong sum that it sends as the service, before that with the right one; the service is far from it.
pub(crate) const FORGED: u32 = 987_654;

/// Has that done on a machine.
pub(crate) fn told(machine: &Machine, task: &str) -> Child {
    let program = std::env::current_exe().expect("it runs");
    let mut command = machine.command(program.to_str().expect("text"));
    command.args(["--exact", "forger::what_is_told_is_done", "--nocapture"]).env(TASK, task);
    command.stdout(Stdio::piped()).spawn().expect("it starts")
}

/// Waits until it is done; gives what was said meanwhile.
#[track_caller]
pub(crate) fn done(child: Child) -> String {
    let output = child.wait_with_output().expect("it is ours");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).expect("text")
}

/// What the console answers on a machine.
pub(crate) fn page(machine: &Machine) -> String {
    let said = done(told(machine, "page"));
    let answer = said.split_once("answer: ").map(|(_, answer)| answer.to_owned());
    answer.unwrap_or_else(|| panic!("no answer: {said}"))
}

/// Acks as the second controller, with a code, of the frame that came or of another, with a checksum that is right or not, so many.
pub(crate) fn acks(machine: &Machine, code: ReplyCode, of: &str, sum: &str, many: u32) -> Child {
    told(machine, &format!("ack {} {of} {sum} {many}", code as u8))
}

#[test]
fn what_is_told_is_done() {
    let Ok(task) = std::env::var(TASK) else { return };
    match *task.split(' ').collect::<Vec<_>>() {
        ["page"] => get(),
        ["ack", code, of, sum, many] => {
            let code = ReplyCode::from_byte(code.parse().expect("a code")).expect("one that there is");
            forge(code, of, sum == "right", many.parse().expect("a count"));
        }
        ["frame", sum] => lead(sum == "right"),
        _ => panic!("{task}?"),
    }
}

fn get() {
    let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, 8480)).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("it is longer than nothing");
    stream.write_all(b"GET / HTTP/1.0\r\nHost: 127.0.0.1:8480\r\n\r\n").expect("it listens");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("text");
    println!("answer: {}", answer.replacen("HTTP/1.0", "HTTP/1.1", 1));
}

fn raw(from: [u8; 4]) -> Socket {
    let socket = Socket::new(Domain::IPV4, Type::RAW, Some(Protocol::UDP)).expect("its namespace is ours");
    socket.bind(&SocketAddrV4::new(from.into(), 0).into()).expect("it is here");
    socket.set_read_timeout(Some(PATIENCE)).expect("it is longer than nothing");
    socket
}

/// Answers what comes to the second controller, in its name.
fn forge(code: ReplyCode, of: &str, is_right: bool, many: u32) {
    let socket = raw(SEATS[1]);
    let (way, number) = of.split_at(1);
    let number: u32 = number.parse().expect("a number");
    let mut answered = 0;
    while answered < many {
        let mut packet = [0; 2048];
        let len = (&socket).read(&mut packet).expect("somebody asks");
        let packet = &packet[..len];
        let header = usize::from(packet[0] & 0x0f) * 4;
        let [_, _, to_high, to_low, ..] = packet[header..] else { continue };
        if u16::from_be_bytes([to_high, to_low]) != PORT {
            continue;
        }
        let frame = match (way, MotionRequest::parse(&packet[header + 8..])) {
            ("+", Ok(frame)) => FrameNo(frame.frame.0 + number),
            ("=", _) => FrameNo(number + answered),
            _ => continue,
        };
        let positions = PerAxis::new(&[Pulses(0); 3]);
        let (timing, channel, error) = (Timing::Relative, 0, 0);
        let reply = MotionReply {
            timing,
            code,
            channel,
            error,
            frame,
            time_ms: 10,
            positions,
            inputs: 0,
            extend: 0,
            vibration: None,
        };
        let payload = reply.emit(&mut [0; MAX_LEN]).to_vec();
        say(&socket, (SEATS[1], PORT), (SHOW, FRAME_PORT), &payload, is_right);
        answered += 1;
    }
}

/// Sends the second controller a frame in the name of the service, to where its seat is parked.
fn lead(is_right: bool) {
    let frame = Motion {
        timing: Timing::Relative,
        channel: 0,
        accept: Code::ALL,
        reply: Code::NONE,
        frame: FrameNo(FORGED + u32::from(is_right)),
        time_ms: 100,
        positions: &[Pulses(0); 3],
        outputs: 0,
        analogue: Analogue::OFF,
        vibration: None,
    };
    let payload = frame.emit(&mut [0; MAX_LEN]).to_vec();
    say(&raw(SHOW), (SHOW, FRAME_PORT), (SEATS[1], PORT), &payload, is_right);
}

/// Sends a datagram with its checksum, or with another.
fn say(socket: &Socket, from: ([u8; 4], u16), to: ([u8; 4], u16), payload: &[u8], is_right: bool) {
    let len = u16::try_from(8 + payload.len()).expect("it is short");
    let mut datagram = Vec::new();
    for word in [from.1, to.1, len, 0] {
        datagram.extend_from_slice(&word.to_be_bytes());
    }
    datagram.extend_from_slice(payload);
    let pseudo = [&from.0[..], &to.0, &[0, 17], &len.to_be_bytes()].concat();
    let right = sum(&[pseudo, datagram.clone()].concat());
    let told = if is_right { right } else { right ^ 0x0101 };
    datagram[6..8].copy_from_slice(&told.to_be_bytes());
    socket.send_to(&datagram, &SocketAddrV4::new(to.0.into(), 0).into()).expect("it goes out");
}

/// The checksum of the Internet, which is never 0 in UDP.
fn sum(octets: &[u8]) -> u16 {
    let words = octets.chunks(2).map(|two| (u32::from(two[0]) << 8) | u32::from(*two.get(1).unwrap_or(&0)));
    let mut sum: u32 = words.sum();
    while sum >> 16 != 0 {
        sum = (sum & 0xffff) + (sum >> 16);
    }
    let sum = !u16::try_from(sum).expect("it was folded");
    if sum == 0 { 0xffff } else { sum }
}
