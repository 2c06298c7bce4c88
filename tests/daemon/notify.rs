//! Alarms to people elsewhere: a receiver of the test's own, and a mailer that writes into a file.

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use serde_json::Value;

use crate::hall::Hall;
use crate::process::PATIENCE;

/// A receiver at a port of its own: gives each message that is posted.
fn receiver() -> (String, Receiver<Value>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/alarms", listener.local_addr().unwrap());
    let (posted, messages) = channel();
    thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            if posted.send(message(stream)).is_err() {
                return;
            }
        }
    });
    (url, messages)
}

fn message(mut stream: TcpStream) -> Value {
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let (mut got, mut octets) = (Vec::new(), [0; 4_096]);
    loop {
        let count = stream.read(&mut octets).unwrap();
        assert!(count > 0, "{}", String::from_utf8_lossy(&got));
        got.extend_from_slice(&octets[..count]);
        let text = String::from_utf8_lossy(&got);
        if let Some((_, body)) = text.split_once("\r\n\r\n")
            && let Ok(message) = serde_json::from_str(body)
        {
            stream.write_all(b"HTTP/1.1 204 No Content\r\n\r\n").unwrap();
            return message;
        }
    }
}

/// Waits for a message with such an alarm of A1.
fn told(messages: &Receiver<Value>, what: &str) -> Value {
    loop {
        let message = messages.recv_timeout(PATIENCE).expect("a message");
        let alarms = message["alarms"].as_array().unwrap();
        let is_it = |alarm: &&Value| alarm["what"] == what && alarm["controller"] == "A1";
        if let Some(alarm) = alarms.iter().find(is_it) {
            return alarm.clone();
        }
    }
}

#[test]
fn an_alarm_is_posted_and_mailed_as_it_is_raised_and_as_it_is_over() {
    let (url, messages) = receiver();
    let folder = tempfile::tempdir().unwrap();
    let (mailer, mails) = (folder.path().join("mailer"), folder.path().join("mails"));
    fs::write(&mailer, format!("cat >> {}\n", mails.display())).unwrap();
    let hall = Hall::open_with(|config| {
        let args = format!("[\"{}\", \"-t\"]", mailer.display());
        config
            + &format!("[notify]\nevery_s = 1\n[notify.webhook]\nurl = \"{url}\"\n")
            + &format!("[notify.mail]\nto = [\"root\"]\nprogram = \"/bin/sh\"\nargs = {args}\n")
    });
    hall.relay(0).pull();
    let raised = told(&messages, "raised");
    assert_eq!((&raised["id"], &raised["severity"]), (&"controller-lost".into(), &"error".into()));
    assert!(raised["remedy"].as_str().is_some_and(|remedy| !remedy.is_empty()), "{raised}");
    let mailed = |part: &str| {
        hall.wait(|_| fs::read_to_string(&mails).is_ok_and(|text| text.contains(part)));
    };
    mailed("error: A1: lost");
    hall.relay(0).put_back();
    told(&messages, "cleared");
    mailed("over: A1: lost");
    let status = hall.wait(|status| status["notify"][0]["sent"].as_u64() >= Some(2));
    assert_eq!(
        (&status["notify"][0]["way"], &status["notify"][1]["way"]),
        (&"webhook".into(), &"mail".into())
    );
    hall.end();
}

#[test]
fn a_message_that_nobody_takes_is_in_the_status_and_the_log_and_holds_nothing_up() {
    let gone = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let hall = Hall::open_with(|config| {
        config
            + &format!("[notify.webhook]\nurl = \"http://{gone}/\"\n[notify.mail]\nto = [\"root\"]\n")
            + "program = \"/none/mailer\"\n"
    });
    hall.arm("night");
    hall.done(&["go"]);
    hall.comes_to("playing");
    hall.relay(0).pull();
    let is_told = |warning: &&Value| warning["id"] == "notify";
    let status = hall.wait(|status| {
        let warnings = status["warnings"].as_array().unwrap();
        warnings.iter().filter(is_told).count() == 2
    });
    let trouble = status["notify"][1]["trouble"].as_str().unwrap();
    assert!(trouble.starts_with("/none/mailer: No such file") && trouble.contains("; check"), "{trouble}");
    hall.serving().heard(|line| line.contains("by webhook was not sent, it is tried again").then_some(()));
    assert_eq!(hall.lives_on(50)["state"], "playing");
    hall.end();
}
