//! The Wireshark dissector against the parser of the program: each says the same of every message, good and bad.

#![allow(clippy::unwrap_used, reason = "whatever fails here fails the test")]

#[path = "common/pcap.rs"]
mod pcap;
#[path = "common/programs.rs"]
mod programs;

use std::collections::BTreeMap;
use std::net::SocketAddrV4;
use std::path::Path;
use std::process::{Command, Output};
use std::time::Duration;

use kinocue::harness::Virtual;
use kinocue::harness::motion::Pulses;
use kinocue::harness::sim::{Controller, Setup};
use kinocue::wire::{
    Access, Code, MAX_LEN, Message, ReadRequest, RegisterReply, ReplyCode, Status, Vibration, VibrationPort,
    WireError, Words, WriteRequest,
};
use pcap::Pcap;
use programs::is_installed;
use serde::Deserialize;

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tools/wireshark/kinocue.lua");

/// The fields that are compared, those a message lacks included.
const FIELDS: [&str; 29] = [
    "kinocue.function",
    "kinocue.answer",
    "kinocue.channel",
    "kinocue.servo",
    "kinocue.error",
    "kinocue.accept",
    "kinocue.reply",
    "kinocue.frame",
    "kinocue.time",
    "kinocue.axis",
    "kinocue.output",
    "kinocue.input",
    "kinocue.extend",
    "kinocue.extend.dac1",
    "kinocue.extend.dac2",
    "kinocue.vibration.period",
    "kinocue.vibration.amplitude",
    "kinocue.vibration.hz",
    "kinocue.register",
    "kinocue.count",
    "kinocue.value",
    "kinocue.station",
    "kinocue.axes",
    "kinocue.force",
    "kinocue.servo.error",
    "kinocue.surplus",
    "kinocue.malformed.byte",
    "kinocue.malformed.why",
    "kinocue.cut",
];

/// The fields that a message has, several values joined by commas.
type Fields = BTreeMap<&'static str, String>;

/// Whether there is a tshark; false where somebody asked for tests without it.
fn tshark_runs() -> bool {
    if !is_installed("tshark") {
        return false;
    }
    let Output { stdout, .. } = Command::new("tshark").arg("--version").output().unwrap();
    let version = String::from_utf8_lossy(&stdout);
    assert!(version.contains("with Lua"), "this tshark runs no dissectors: {version}");
    true
}

/// The lines that tshark prints of a capture, one for each packet.
fn tshark(capture: &Pcap, args: &[&str]) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("capture.pcap");
    std::fs::write(&path, capture.bytes()).unwrap();
    let output = Command::new("tshark")
        .env("HOME", folder.path()) // nobody's own settings and plug-ins
        .env_remove("XDG_CONFIG_HOME")
        .args(["-n", "-X", &format!("lua_script:{SCRIPT}"), "-r", path.to_str().unwrap()])
        .args(["-T", "fields", "-E", "separator=/t", "-E", "occurrence=a", "-E", "aggregator=,"])
        .args(args)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !errors.contains("kinocue.lua"), "{errors}");
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

/// The fields of each packet.
fn dissected(capture: &Pcap) -> Vec<Fields> {
    let args: Vec<&str> = FIELDS.iter().flat_map(|name| ["-e", name]).collect();
    let fields = |line: &String| {
        let values = FIELDS.iter().zip(line.split('\t'));
        values.filter(|(_, value)| !value.is_empty()).map(|(name, value)| (*name, value.to_owned())).collect()
    };
    tshark(capture, &args).iter().map(fields).collect()
}

/// What the parser says of a datagram, in the dissector's fields.
fn parsed(bytes: &[u8]) -> Fields {
    let mut fields = Fields::new();
    if bytes.len() >= 6 {
        fields.insert("kinocue.function", format!("0x{}", hex(&bytes[4..6])));
    }
    let message = match Message::parse(bytes) {
        Ok(message) => message,
        Err(error) => {
            fields.insert("kinocue.malformed.byte", error.offset().to_string());
            fields.insert("kinocue.malformed.why", why(error));
            return fields;
        }
    };
    let layout = put(&mut fields, bytes, &message);
    if bytes.len() > layout {
        fields.insert("kinocue.surplus", hex(&bytes[layout..]));
    }
    fields
}

/// The reason of an error without its place.
fn why(error: WireError) -> String {
    error.to_string().split_once(": ").unwrap().1.to_owned()
}

/// The fields of a message; gives the bytes of its layout.
fn put(fields: &mut Fields, bytes: &[u8], message: &Message<'_>) -> usize {
    match message {
        Message::Motion(motion) => {
            codes(fields, motion.accept, motion.reply);
            fields.insert("kinocue.channel", motion.channel.to_string());
            fields.insert("kinocue.output", format!("0x{:04x}", motion.outputs));
            body(fields, motion.frame.0, motion.time_ms, &motion.positions);
            tail(fields, motion.extend, motion.vibration.as_deref());
            motion.layout_len(VibrationPort::Two)
        }
        Message::MotionReply(reply) => {
            answer(fields, bytes, reply.code, ("kinocue.channel", reply.channel), reply.error);
            fields.insert("kinocue.input", format!("0x{:04x}", reply.inputs));
            body(fields, reply.frame.0, reply.time_ms, &reply.positions);
            tail(fields, reply.extend, reply.vibration.as_deref());
            reply.layout_len(VibrationPort::Two)
        }
        Message::Status(status) => {
            put_status(fields, status);
            bytes.len()
        }
        _ => put_registers(fields, bytes, message),
    }
}

fn put_registers(fields: &mut Fields, bytes: &[u8], message: &Message<'_>) -> usize {
    let data = Words::EMPTY;
    let (start, num, data) = match message {
        Message::Read(read) => {
            codes(fields, read.accept, read.reply);
            fields.insert("kinocue.channel", read.channel.to_string());
            (read.start, usize::from(read.num), data)
        }
        Message::Write(write) => {
            codes(fields, write.accept, write.reply);
            fields.insert("kinocue.channel", write.channel.to_string());
            (write.start, write.data.len(), write.data)
        }
        Message::RegisterReply(reply) => {
            answer(fields, bytes, reply.code, ("kinocue.channel", reply.channel), reply.error);
            (reply.start, usize::from(reply.num), reply.data)
        }
        Message::ServoRead(read) => {
            codes(fields, read.accept, read.reply);
            fields.insert("kinocue.servo", read.channel.to_string());
            (read.start, usize::from(read.num), data)
        }
        Message::ServoWrite(write) => {
            codes(fields, write.accept, write.reply);
            fields.insert("kinocue.servo", write.channel.to_string());
            (write.start, write.data.len(), write.data)
        }
        Message::ServoReply(reply) => {
            answer(fields, bytes, reply.code, ("kinocue.servo", reply.servo), reply.error);
            (reply.start, usize::from(reply.num), reply.data)
        }
        Message::Report(report) => {
            codes(fields, report.accept, report.reply);
            fields.insert("kinocue.channel", report.channel.to_string());
            (report.start, report.data.len(), report.data)
        }
        other => panic!("no message about registers: {other:?}"),
    };
    fields.insert("kinocue.register", format!("0x{start:04x}"));
    fields.insert("kinocue.count", num.to_string());
    list(fields, "kinocue.value", data.iter());
    16 + 2 * data.len()
}

fn put_status(fields: &mut Fields, status: &Status) {
    fields.insert("kinocue.station", format!("0x{}", status.station));
    fields.insert("kinocue.axes", status.positions.len().to_string());
    list(fields, "kinocue.axis", status.positions.iter().map(|position| position.0));
    list(fields, "kinocue.force", status.forces.iter());
    list(fields, "kinocue.servo.error", status.servo_errors.iter());
    fields.insert("kinocue.error", status.error.to_string());
    fields.insert("kinocue.output", format!("0x{:04x}", status.outputs));
    fields.insert("kinocue.input", format!("0x{:04x}", status.inputs));
}

fn codes(fields: &mut Fields, accept: Code, reply: Code) {
    fields.insert("kinocue.accept", format!("0x{accept}"));
    fields.insert("kinocue.reply", format!("0x{reply}"));
}

/// The header of a reply, whose codes the parser does not keep.
fn answer(
    fields: &mut Fields,
    bytes: &[u8],
    code: ReplyCode,
    (slot, running): (&'static str, u16),
    error: u16,
) {
    fields.insert("kinocue.answer", (code as u8).to_string());
    match code {
        ReplyCode::Running => fields.insert(slot, running.to_string()),
        _ => fields.insert("kinocue.error", error.to_string()),
    };
    fields.insert("kinocue.accept", format!("0x{}", hex(&bytes[8..10])));
    fields.insert("kinocue.reply", format!("0x{}", hex(&bytes[10..12])));
}

fn body(fields: &mut Fields, frame: u32, time_ms: u32, positions: &[Pulses]) {
    fields.insert("kinocue.frame", frame.to_string());
    fields.insert("kinocue.time", time_ms.to_string());
    list(fields, "kinocue.axis", positions.iter().map(|position| position.0));
}

fn tail(fields: &mut Fields, extend: u32, vibration: Option<&[Vibration]>) {
    let Some(vibration) = vibration else {
        fields.insert("kinocue.extend", format!("0x{extend:08x}"));
        fields.insert("kinocue.extend.dac1", (extend >> 16).to_string());
        fields.insert("kinocue.extend.dac2", (extend & 0xffff).to_string());
        return;
    };
    list(fields, "kinocue.vibration.period", vibration.iter().map(|shake| shake.period));
    list(fields, "kinocue.vibration.amplitude", vibration.iter().map(|shake| shake.amplitude));
    list(fields, "kinocue.vibration.hz", vibration.iter().filter_map(|shake| shake.hz()));
}

fn list<T: ToString>(fields: &mut Fields, name: &'static str, values: impl Iterator<Item = T>) {
    let text = values.map(|value| value.to_string()).collect::<Vec<_>>().join(",");
    if !text.is_empty() {
        fields.insert(name, text);
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Frequencies to four places; versions of tshark print different numbers of digits.
fn rounded(mut fields: Fields) -> Fields {
    if let Some(hz) = fields.get_mut("kinocue.vibration.hz") {
        let shorter = |value: &str| format!("{:.3e}", value.parse::<f64>().unwrap());
        *hz = hz.split(',').map(shorter).collect::<Vec<_>>().join(",");
    }
    if let Some(surplus) = fields.get_mut("kinocue.surplus") {
        surplus.retain(|c| c != ':');
    }
    fields
}

fn assert_agreed(capture: &Pcap, datagrams: &[Vec<u8>]) {
    let dissected = dissected(capture);
    assert_eq!(dissected.len(), datagrams.len());
    for (bytes, fields) in datagrams.iter().zip(dissected) {
        assert_eq!(rounded(fields), rounded(parsed(bytes)), "{}", hex(bytes));
    }
}

fn host() -> SocketAddrV4 {
    "192.168.15.101:8410".parse().unwrap()
}

fn seat() -> SocketAddrV4 {
    "192.168.15.201:7408".parse().unwrap()
}

/// A capture of datagrams, a millisecond apart.
fn captured(datagrams: &[Vec<u8>]) -> Pcap {
    let mut pcap = Pcap::new();
    for (ms, bytes) in (0..).zip(datagrams) {
        pcap.datagram(Duration::from_millis(ms), host(), seat(), bytes);
    }
    pcap
}

#[derive(Deserialize)]
struct Golden {
    vectors: Vec<Vector>,
}

#[derive(Deserialize)]
struct Vector {
    hex: String,
}

/// The bytes of the golden file, good and malformed ones.
fn golden() -> Vec<Vec<u8>> {
    let golden: Golden = serde_json::from_str(include_str!("golden/wire.json")).unwrap();
    let bytes = |hex: &str| {
        (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
    };
    golden.vectors.iter().map(|vector| bytes(&vector.hex)).collect()
}

/// Replies to reads of the monitor registers, with positions among them, and one with a whole table.
fn monitored() -> Vec<Vec<u8>> {
    let words: Vec<u16> = (0..256).map(|word| word * 257).collect();
    let reads = [(0x06, 8), (0x08, 6), (0x0a, 6), (0x0b, 2), (0x21, 5), (0x23, 8), (0x25, 1), (0x00, 256)];
    let reply = |(start, num): (u16, usize)| {
        let data = Words::from(&words[..num]);
        let num = u16::try_from(num).unwrap();
        let (access, code) = (Access::Read, ReplyCode::Running);
        let reply = RegisterReply { access, code, channel: 0, error: 0, start, num, data };
        reply.emit(&mut [0; MAX_LEN]).to_vec()
    };
    reads.into_iter().map(reply).collect()
}

#[test]
fn golden_messages_are_dissected_as_they_are_parsed() {
    if !tshark_runs() {
        return;
    }
    let datagrams = [golden(), monitored()].concat();
    assert_agreed(&captured(&datagrams), &datagrams);
}

#[test]
fn damaged_messages_are_refused_at_the_same_byte_for_the_same_reason() {
    if !tshark_runs() {
        return;
    }
    let mut datagrams = std::collections::BTreeSet::new();
    for bytes in golden() {
        datagrams.extend((1..bytes.len()).map(|len| bytes[..len].to_vec()));
        for at in 0..bytes.len().min(16) {
            for to in [0, 1, 3, 6, 13, 0xff] {
                let mut changed = bytes.clone();
                changed[at] = to;
                datagrams.insert(changed);
            }
        }
    }
    let datagrams: Vec<_> = datagrams.into_iter().collect();
    assert!(datagrams.len() > 3_000);
    assert_agreed(&captured(&datagrams), &datagrams);
}

/// A show of a second with the answers of a virtual controller, between these ports: on the way the emergency stop is
/// pressed, and at the end registers are read and written.
fn exchange(host: SocketAddrV4, seat: SocketAddrV4) -> (Pcap, Vec<Vec<u8>>) {
    let played = Virtual::new(kinocue::harness::swell(3, 1, 20.0, 1.0)).play();
    let frames: Vec<_> = played.lane(0).map(|frame| (frame.at, frame.bytes.clone())).collect();
    let (start, end, pressed) = (frames[0].0, frames[frames.len() - 1].0, frames.len() / 2);
    let all = Code::ALL;
    let read = ReadRequest { channel: 0, accept: all, reply: all, start: 0x06, num: 6 };
    let words = [0, 1];
    let write = WriteRequest { channel: 2, accept: all, reply: all, start: 0, data: Words::from(&words[..]) };
    let registers = [Message::Read(read), Message::Write(write)];
    let registers = registers.map(|message| (end, message.emit(&mut [0; MAX_LEN]).to_vec()));

    let parameters = vec![(0x90, 1), (0x92, 1), (0x93, 0)];
    let setup = Setup { host_port: host.port(), parameters, ..Setup::default() };
    let mut controller = Controller::new(&setup, seat, start);
    let (mut pcap, mut datagrams, mut buf) = (Pcap::new(), Vec::new(), [0; MAX_LEN]);
    for (index, (at, bytes)) in frames.into_iter().chain(registers).enumerate() {
        if index == pressed {
            controller.set_switches(1, at);
        }
        let since = at.since(start);
        pcap.datagram(since, host, seat, &bytes);
        let reply = controller.on_datagram(host, &bytes, at, &mut buf).reply.expect("it answers");
        pcap.datagram(since + Duration::from_micros(300), seat, host, reply);
        datagrams.extend([bytes, reply.to_vec()]);
    }
    (pcap, datagrams)
}

#[test]
fn a_show_and_its_replies_are_dissected_whole_on_any_port() {
    if !tshark_runs() {
        return;
    }
    let (pcap, datagrams) = exchange(host(), seat());
    for code in [ReplyCode::Running, ReplyCode::EmergencyStop] {
        let answered = datagrams.iter().filter(|bytes| bytes[4..6] == [0x14, code as u8]).count();
        assert!(answered > 50, "{answered} answers with {code:?}");
    }
    assert_agreed(&pcap, &datagrams);
    let (pcap, datagrams) = exchange("127.0.0.1:40001".parse().unwrap(), "127.0.0.1:40002".parse().unwrap());
    assert_agreed(&pcap, &datagrams);
}

#[test]
fn a_reply_names_the_packet_that_it_answers_and_the_time_it_took() {
    if !tshark_runs() {
        return;
    }
    let everyone = "192.168.15.255:7408".parse().unwrap();
    let golden = golden();
    let find = |function: [u8; 2]| golden.iter().find(|bytes| bytes[4..6] == function).unwrap();
    let (request, mut reply) = (find([0x14, 1]), find([0x14, 2]).clone());
    reply[12..16].copy_from_slice(&request[12..16]);
    let mut pcap = Pcap::new();
    pcap.datagram(Duration::from_micros(0), host(), everyone, request);
    pcap.datagram(Duration::from_micros(700), seat(), host(), &reply);
    pcap.datagram(Duration::from_micros(900), "192.168.15.202:7408".parse().unwrap(), host(), &reply);
    reply[15] = reply[15].wrapping_add(1);
    pcap.datagram(Duration::from_micros(950), seat(), host(), &reply);
    let lines = tshark(&pcap, &["-e", "kinocue.answers", "-e", "kinocue.latency"]);
    let told = |line: &str| {
        let (packet, ms) = line.split_once('\t').unwrap();
        (packet.to_owned(), ms.parse::<f64>().ok().map(|ms| (ms * 1e3).round()))
    };
    let expected = [(String::new(), None), ("1".to_owned(), Some(700.0)), ("1".to_owned(), Some(900.0))];
    assert_eq!(lines[..3].iter().map(|line| told(line)).collect::<Vec<_>>(), expected);
    assert_eq!(told(&lines[3]), (String::new(), None), "no frame of that number was sent");
}

#[test]
fn what_only_looks_like_a_message_on_another_port_is_left_alone() {
    if !tshark_runs() {
        return;
    }
    let (from, to) = ("127.0.0.1:40001".parse().unwrap(), "127.0.0.1:40002".parse().unwrap());
    let mut pcap = Pcap::new();
    let openings: [&[u8]; 4] = [
        b"\x55\xaa\x00\x00\x21\x01\x00\x00\x00\x00\x00\x00",
        b"\x55\xaa\x00\x01\x14\x01\x00\x00\x00\x00\x00\x00",
        b"\x55\xaa\x00\x00\x14\x06\x00\x00\x00\x00\x00\x00",
        b"\x55\xaa",
    ];
    for bytes in openings {
        pcap.datagram(Duration::ZERO, from, to, bytes);
    }
    assert!(dissected(&pcap).iter().all(Fields::is_empty));
}

#[test]
fn a_message_that_the_capture_cut_is_named_so() {
    if !tshark_runs() {
        return;
    }
    let mut pcap = Pcap::new();
    pcap.packet(Duration::ZERO, &pcap::ethernet(host(), seat(), &golden()[0], 0), 70);
    let fields = &dissected(&pcap)[0];
    assert!(fields.contains_key("kinocue.cut") && !fields.contains_key("kinocue.frame"), "{fields:?}");
}

/// The one-line words of `kinocue decode` for each packet of a capture.
fn decoded(path: &Path, args: &[&str]) -> Vec<String> {
    let output =
        assert_cmd::Command::cargo_bin("kinocue").unwrap().arg("decode").arg(path).args(args).output();
    let text = String::from_utf8(output.unwrap().stdout).unwrap();
    let messages = text.lines().take_while(|line| !line.is_empty());
    messages.map(|line| line.rsplit_once("7408  ").unwrap().1.to_owned()).collect()
}

#[test]
fn the_info_column_says_what_decode_says_in_both_dialects_and_with_both_ports_of_vibration() {
    if !tshark_runs() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("golden.pcap");
    let readings = [
        (["--dialect", "smc"], "kinocue.dialect:SMC", VibrationPort::Two),
        (["--dialect", "mbox"], "kinocue.dialect:MBOX", VibrationPort::Two),
        (["--vibration-port-octets", "4"], "kinocue.vibration_port_octets:4", VibrationPort::Four),
    ];
    for (args, preference, port) in readings {
        let mut datagrams = [golden(), monitored()].concat();
        datagrams.retain(|bytes| Message::parse_as(port, bytes).is_ok());
        let capture = captured(&datagrams);
        std::fs::write(&path, capture.bytes()).unwrap();
        let infos = tshark(&capture, &["-o", preference, "-e", "_ws.col.Info"]);
        let words = decoded(&path, &args);
        assert_eq!(infos.len(), words.len());
        for (info, words) in infos.iter().zip(words) {
            assert_eq!(*info, words, "{preference}");
        }
    }
}
