//! `kinocue decode`: the built program on hex, captures, the standard input, and on what is malformed.

#![allow(clippy::unwrap_used, reason = "whatever fails here fails the test")]

#[path = "common/pcap.rs"]
mod pcap;

use std::net::SocketAddrV4;
use std::path::PathBuf;
use std::time::Duration;

use assert_cmd::Command;
use pcap::{Pcap, ethernet};
use serde_json::{Value, json};

const READ: &str = "55aa000011010001ffffffff00020001";
const READ_REPLY: &str = "55aa00001102000100000000000200010006";
const FRAME: &str = "55aa000014010000ffffffff000000070000003200000001fffffffe00000003080200000000";
const ACK: &str = "55aa0000140200000000000000000007000000320000000100000000000000000001deadbeef";
const TRUNCATED: &str = "55aa000012010001ffffffff002000020001";

struct Ran {
    code: i32,
    out: String,
    err: String,
}

impl Ran {
    fn json(&self) -> Vec<Value> {
        self.out.lines().map(|line| serde_json::from_str(line).expect("every line is JSON")).collect()
    }
}

fn decode(args: &[&str], stdin: &[u8]) -> Ran {
    let output = Command::cargo_bin("kinocue").unwrap().arg("decode").args(args).write_stdin(stdin).output();
    let output = output.unwrap();
    Ran {
        code: output.status.code().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

fn host() -> SocketAddrV4 {
    "192.168.15.101:8410".parse().unwrap()
}

fn seat() -> SocketAddrV4 {
    "192.168.15.201:7408".parse().unwrap()
}

fn at(ms: u64) -> Duration {
    Duration::from_secs(1_700_000_000) + Duration::from_millis(ms)
}

/// A frame, its reply, a truncated write, and packets of every other sort.
fn capture() -> Pcap {
    let mut pcap = Pcap::new();
    pcap.datagram(at(0), host(), seat(), &bytes(FRAME));
    pcap.datagram(at(2), seat(), host(), &bytes(ACK));
    pcap.datagram(at(20), host(), seat(), &bytes(TRUNCATED));
    let stranger = "10.0.0.1:53".parse().unwrap();
    pcap.datagram(at(21), stranger, "10.0.0.2:5353".parse().unwrap(), b"who is there");
    pcap.datagram(at(22), stranger, "10.0.0.2:7402".parse().unwrap(), &bytes(READ));
    pcap.packet(at(30), &ethernet(host(), seat(), &bytes(FRAME), 0), 60);
    pcap.packet(at(31), &ethernet(host(), seat(), &[0; 40], 0x2000), usize::MAX);
    pcap.packet(at(32), &[0; 60], usize::MAX);
    pcap
}

fn file(name: &str, content: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path)
}

#[test]
fn hex_is_told_field_by_field() {
    let ran = decode(&["55aa0000", "11010001ffffffff", "00020001"], b"");
    assert_eq!((ran.code, ran.err.as_str()), (0, ""));
    assert!(ran.out.starts_with("message    read registers\n"), "{}", ran.out);
    assert!(ran.out.contains("first      PA02\n"), "{}", ran.out);
}

#[test]
fn a_malformed_message_says_where_and_why_and_the_next_is_told_all_the_same() {
    let ran = decode(&[TRUNCATED, READ], b"");
    assert_eq!(ran.code, 65);
    assert!(
        ran.out.starts_with("malformed: byte 18: ends after 18 bytes; this message takes 20: 55aa"),
        "{}",
        ran.out
    );
    assert!(ran.out.contains("read registers"), "{}", ran.out);
    let ran = decode(&[TRUNCATED, READ, "--json"], b"");
    assert_eq!(ran.code, 65);
    let lines = ran.json();
    assert_eq!((&lines[0]["malformed"]["byte"], &lines[1]["function"]), (&json!(18), &json!("0x1101")));
}

#[test]
fn what_is_neither_hex_nor_a_file_is_wrong_use() {
    let ran = decode(&["55zz"], b"");
    assert_eq!(ran.code, 64);
    assert!(ran.err.contains("'z' after 2 hex digits"), "{}", ran.err);
    assert_eq!(decode(&[READ, "show.pcap"], b"").code, 64);
    assert_eq!(decode(&["--all", "--port", "1", READ], b"").code, 64);
}

#[test]
fn a_missing_file_and_a_folder_are_no_input() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.pcap");
    for path in [missing.as_path(), folder.path()] {
        let ran = decode(&[path.to_str().unwrap()], b"");
        assert_eq!(ran.code, 66, "{}", ran.err);
        assert!(ran.err.contains(path.to_str().unwrap()), "{}", ran.err);
    }
}

#[test]
fn a_capture_is_told_a_line_for_each_message_and_counted() {
    let (_folder, path) = file("show.pcap", capture().bytes());
    let ran = decode(&[path.to_str().unwrap()], b"");
    assert_eq!((ran.code, ran.err.as_str()), (65, ""));
    assert_eq!(
        ran.out.trim_start(),
        "\
    0.000000  192.168.15.101:8410 -> 192.168.15.201:7408  motion, relative time: frame 7, in 50 ms, positions 1 -2 3, outputs Y02 Y12
    0.002000  192.168.15.201:7408 -> 192.168.15.101:8410  reply to motion, relative time: received, running normally, frame 7, in 50 ms, positions 1 0 0, inputs X01
    0.020000  192.168.15.101:8410 -> 192.168.15.201:7408  malformed: byte 18: ends after 18 bytes; this message takes 20: 55aa000012010001ffffffff002000020001
    0.030000  192.168.15.101:8410 -> 192.168.15.201:7408  cut: the capture kept 18 of 38 bytes
    0.031000  192.168.15.101:8410 -> 192.168.15.201:7408  fragment: from byte 0 of it on; not reassembled

2 messages in 0.032 s from 2023-11-14 22:13:20 UTC
       1  0x1401 motion, relative time
       1  0x1402 reply to motion, relative time
       1  malformed
       1  cut short by the capture
       1  fragments of datagrams, not reassembled
       2  other datagrams
       1  other packets
"
    );
}

#[test]
fn ports_may_be_chosen_and_all_ports_are_told_by_how_a_message_opens() {
    let (_folder, path) = file("show.pcap", capture().bytes());
    let path = path.to_str().unwrap();
    let ran = decode(&[path, "--port", "7402"], b"");
    assert_eq!(ran.code, 0, "{}", ran.out);
    assert!(ran.out.contains("10.0.0.2:7402  read registers: PA02\n"), "{}", ran.out);
    assert!(ran.out.contains("1 message "), "{}", ran.out);
    let ran = decode(&[path, "--all"], b"");
    assert!(ran.out.contains("3 messages") && ran.out.contains("1  other datagrams"), "{}", ran.out);
}

#[test]
fn verbose_tells_all_fields_of_a_capture() {
    let (_folder, path) = file("show.pcap", capture().bytes());
    let ran = decode(&[path.to_str().unwrap(), "--verbose"], b"");
    assert!(
        ran.out.contains("192.168.15.201:7408 -> 192.168.15.101:8410\nmessage    reply to motion"),
        "{}",
        ran.out
    );
    assert!(ran.out.contains("\na2         -2 pulses\n"), "{}", ran.out);
}

#[test]
fn json_names_packet_time_and_ends_of_each_message_and_ends_with_the_counts() {
    let ran = decode(&["--json"], capture().bytes());
    let lines = ran.json();
    assert_eq!((ran.code, lines.len()), (65, 6));
    let frame = &lines[0];
    assert_eq!(frame["packet"], 1);
    assert_eq!(frame["time_ns"], 1_700_000_000_000_000_000_u64);
    assert_eq!(frame["source"], "192.168.15.101:8410");
    assert_eq!(frame["positions"], json!([1, -2, 3]));
    assert_eq!(lines[2]["malformed"]["byte"], 18);
    assert_eq!(lines[3]["cut"], json!({ "kept": 18, "bytes": 38 }));
    assert_eq!(lines[5]["summary"]["messages"], json!({ "0x1401": 1, "0x1402": 1 }));
}

#[test]
fn lines_of_hex_are_a_message_each_and_bad_ones_are_counted() {
    let lines = format!("{READ}\n\n{}\nnot hex\n{TRUNCATED}\n", READ_REPLY.to_uppercase());
    let ran = decode(&["-"], lines.as_bytes());
    assert_eq!(ran.code, 65);
    assert_eq!(
        ran.out,
        "\
line 1  read registers: PA02
line 3  reply to read registers: received, running normally, PA02 = 6
line 4  not hex: 'n' after 0 hex digits is not a hex digit; give the message as 0-9 and a-f
line 5  malformed: byte 18: ends after 18 bytes; this message takes 20: 55aa000012010001ffffffff002000020001

2 messages
       1  0x1101 read registers
       1  0x1102 reply to read registers
       1  malformed
       1  lines that are not hex
"
    );
    let (_folder, path) = file("lines.txt", lines.as_bytes());
    assert_eq!(decode(&[path.to_str().unwrap()], b"").out, ran.out);
}

#[test]
fn a_capture_cut_off_is_told_as_far_as_it_goes() {
    let whole = capture();
    let ran = decode(&["-"], &whole.bytes()[..150]);
    assert_eq!(ran.code, 65);
    assert!(ran.out.contains("frame 7") && ran.out.contains("1 message "), "{}", ran.out);
    assert!(ran.err.contains("standard input: byte 150: the capture ends inside a packet"), "{}", ran.err);
}

#[test]
fn what_is_neither_a_capture_nor_hex_is_refused() {
    let ran = decode(&["-"], b"\x89PNG\r\n\x1a\n and so on");
    assert_eq!((ran.code, ran.out.as_str()), (65, "0 messages\n"));
    assert!(ran.err.contains("89504e47 opens neither pcap nor pcapng"), "{}", ran.err);
    let ran = decode(&["-"], b"\n");
    assert_eq!(ran.code, 65);
    assert!(ran.err.contains("neither hex nor a capture"), "{}", ran.err);
}

#[test]
fn an_error_of_an_mbox_is_not_read_from_the_slot_of_the_channel() {
    let refused = "55aa00001203000a00000000005500010005";
    assert!(decode(&[refused], b"").out.contains("Err10"));
    assert!(decode(&[refused, "--dialect", "mbox"], b"").out.contains("channel    10"));
}

fn serial(stdin: &[u8], args: &[&str]) -> Ran {
    decode(&[&["--dialect", "silvermax"], args].concat(), stdin)
}

#[test]
fn every_golden_message_of_a_silvermax_is_read_from_a_log_with_its_names() {
    let golden: Value = serde_json::from_str(include_str!("data/vectors-drives.json")).unwrap();
    let ours = |vector: &&Value| vector["family"] == "silvermax";
    let vectors: Vec<&Value> = golden["vectors"].as_array().unwrap().iter().filter(ours).collect();
    let mut log = String::new();
    for vector in &vectors {
        log += &format!("1.5 > {}\n", vector["hex"].as_str().unwrap());
        if let Some(hex) = vector["reply"]["hex"].as_str() {
            log += &format!("1.6 < {hex}\n");
        }
    }
    let ran = serial(log.as_bytes(), &["--json"]);
    assert_eq!(ran.code, 0, "{}", ran.out);
    let lines = ran.json();
    let (total, mut lines) = (lines.last().unwrap().clone(), lines.iter());
    assert_eq!(total["strays"], 0);
    for vector in vectors {
        let (said, fields) = (lines.next().unwrap(), &vector["fields"]);
        assert_eq!((&said["direction"], &said["at_s"]), (&json!("to_drive"), &json!(1.5)));
        assert_eq!(said["unit"], fields["unit"], "{vector}");
        if let Some(mnemonic) = fields.get("mnemonic") {
            assert_eq!(&said["mnemonic"], mnemonic);
            assert_eq!(said["parameters"], fields["parameters"], "{vector}");
        }
        if !vector["reply"].is_null() {
            let (said, fields) = (lines.next().unwrap(), &vector["reply"]["fields"]);
            assert_eq!(said["direction"], "from_drive");
            for name in ["kind", "words", "value", "reason"] {
                let expected = fields.get(name);
                assert!(expected.is_none_or(|expected| said[name] == *expected), "{vector}: {said}");
            }
        }
    }
}

#[test]
fn a_serial_line_is_told_in_words_and_what_is_no_message_is_shown() {
    let ran = serial(b"x\r@16 12 1\r# 10 000C FFFF FF9C\r! 10 0019 0006\r@16 25 2 21", &[]);
    assert_eq!(ran.code, 65);
    for words in [
        "  ?  78 0d: no line",
        " 16  RRG register=1 (position)",
        " 16  RRG register 1 (position) = -100 (FFFF FF9C)",
        " 16  IMW refused: queue full (6)",
        "it ends in the middle of a line",
        "3 messages, 2 times octets that are none",
    ] {
        assert!(ran.out.contains(words), "{words}: {}", ran.out);
    }
    let ran = serial(b"0.25 < 23 20 31 30 20 30 30 31 34 20 30 31 30 30 0D\n0.3 < zz\n", &[]);
    assert!(ran.out.contains("    0.250000  <  16  RIS 0100: moving error, hot"), "{}", ran.out);
    assert!(ran.code == 65 && ran.out.contains("not hex"), "{}", ran.out);
}

#[test]
fn octets_that_two_forms_explain_are_not_taken_for_one_of_them() {
    // A poll of unit 33 in nine bits; an opening of a refusal as well.
    let ran = serial(b"0.1 > 21 00 df\n0.2 > 20 00 e0\n", &[]);
    assert!(
        ran.out.contains("which of them is unknown") && ran.out.contains(" 32  POL  (nine bits)"),
        "{}",
        ran.out
    );
    assert_eq!(decode(&["--dialect", "silvermax", "40", "31 36", "0d"], b"").out, " 16  POL\n");
    assert_eq!(serial(b"", &["--port", "7"]).code, 64);
}

fn sixpack2(stdin: &[u8], args: &[&str]) -> Ran {
    decode(&[&["--dialect", "sixpack2"], args].concat(), stdin)
}

/// The golden messages of a SIXpack 2 on a serial line, each with its answer: the objects, and their octets in hex.
fn golden_frames() -> Vec<(Value, &'static str)> {
    let golden: Value = serde_json::from_str(include_str!("data/vectors-drives.json")).unwrap();
    let all = golden["vectors"].as_array().unwrap().iter();
    let ours = all.filter(|vector| vector["family"] == "sixpack2" && vector["protocol"] == "serial");
    let both = ours.flat_map(|vector| [(vector, ">"), (&vector["reply"], "<")]);
    both.filter(|(message, _)| !message.is_null()).map(|(message, way)| (message.clone(), way)).collect()
}

#[test]
fn every_golden_message_of_a_sixpack_2_is_read_from_a_log_and_from_bare_octets_with_its_names() {
    let golden = golden_frames();
    let hex = |message: &Value| message["hex"].as_str().unwrap().to_owned();
    let log: String = golden.iter().map(|(message, way)| format!("1.5 {way} {}\n", hex(message))).collect();
    let bare: String = golden.iter().map(|(message, _)| hex(message) + "\n").collect();
    for input in [log, bare] {
        let ran = sixpack2(input.as_bytes(), &["--json"]);
        assert_eq!(ran.code, 0, "{}", ran.out);
        let lines = ran.json();
        assert_eq!(lines.len(), golden.len() + 1);
        for ((message, way), said) in golden.iter().zip(&lines) {
            assert_eq!(said["kind"], if *way == ">" { "request" } else { "answer" });
            for (name, value) in message["fields"].as_object().unwrap() {
                let told = said.get(name).unwrap_or(&said["parameters"][name]);
                assert_eq!(told, value, "{name}: {message} {said}");
            }
        }
    }
}

#[test]
fn frames_are_told_in_words_and_octets_without_a_frame_are_shown() {
    let log = b"0.1 > 01 15 00 90 01 00 00 C8 5A\n\
                0.2 > 01 20 00\n\
                0.3 > 01 20 00 02 00 00 00 00 00\n\
                0.31 < 02 20 00 40\n\
                0.32 < 1F 00 00 0A 00\n\
                0.4 > 01 CC 00 00 00 00 00 00 00\n\
                0.5 > 01 24 00 40 1F 00 00 00 07\n\
                0.6 < 02\n";
    let ran = sixpack2(log, &[]);
    assert_eq!(ran.code, 65);
    for words in [
        ">   1  motor parameters motor=0 poslimit=400 p5=200 (TestNull, StopNull, FilterSwitch) p6=90 (FastRef, ",
        ">   ?  01 20 00: a part of a frame",
        "<   2  position motor=0 position=8000 action=10 (PI) stop=0",
        ">   1  $CC? parameter=0",
        ">   1  PI target motor=0 target=8000  (bytes that it does not use are not 0)",
        "<   ?  02: it ends in the middle of a frame",
        "5 messages, 2 times octets that are none",
    ] {
        assert!(ran.out.contains(words), "{words}: {}", ran.out);
    }
}

#[test]
fn frames_of_a_bus_are_read_as_candump_writes_them() {
    let log = b"(1436509052.249713) can0 008#2400401F00000000\n\
                (1436509052.251) can0 008#2000FF0000000000\n\
                (1436509052.252) can0 7F8#2000401F00000A00\n\
                (1436509052.253) can0 009#2000401F00000A00\n\
                (1436509052.254) can0 008#2000\n";
    let ran = sixpack2(log, &[]);
    assert_eq!(ran.code, 65);
    for words in [
        ">   1  PI target motor=0 target=8000\n",
        ">   1  position? motor=0 response=255\n",
        "< 255  position motor=0 position=8000 action=10 (PI) stop=0\n",
        "3 messages, 2 times octets that are none",
    ] {
        assert!(ran.out.contains(words), "{words}: {}", ran.out);
    }
}
