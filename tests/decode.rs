//! `kinocue decode` as the program: exit codes and streams.

use assert_cmd::Command;

fn decode(args: &[&str], input: &str) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
    let output = command.arg("decode").args(args).write_stdin(input).output().expect("the program runs");
    let text = |octets| String::from_utf8(octets).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_message_goes_to_the_standard_output_however_it_is_given() {
    let (code, lines, _) = decode(&["55aa0000", "12:01:00:02", "ffffffff", "0x0000", "0001", "0000"], "");
    assert_eq!(code, Some(0));
    assert!(
        lines.contains("message    write registers\n") && lines.contains("DPF0       0 (0x0000)\n"),
        "{lines}"
    );
    assert_eq!(
        decode(&["-"], "55 aa 00 00 12 01 00 02 ff ff ff ff\n00 00 00 01 00 00\n"),
        (code, lines, String::new())
    );
}

#[test]
fn octets_that_are_no_message_end_with_65_and_say_where() {
    let (code, json, error) = decode(&["--json", "55aa000013010009ffffffff00"], "");
    assert_eq!(code, Some(65));
    assert!(error.contains("octet 13: ends after 13 octets; this message takes 62"), "{error}");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["malformed"]["octet"], 13);
}

#[test]
fn what_is_no_hex_ends_with_64() {
    for args in [&["5"][..], &["xy"], &["-"], &[]] {
        let (code, out, error) = decode(args, "");
        assert_eq!((code, out.as_str()), (Some(64), ""), "{args:?}");
        assert!(!error.is_empty());
    }
}
