//! The channel of a page: who is let in, what is pushed, and a stop that passes whatever else is stuck.

use std::io::{Read as _, Write as _};

use kinocue::harness::control::{Command, Role};
use serde_json::{Value, json};

use crate::client::{Connection, Request, To, problem};
use crate::hall::{Hall, long_status, with_controller};

/// The handshake of a page.
fn handshake() -> Request {
    Request::new("GET", "/api/v1/live")
        .header("Connection", "Upgrade")
        .header("Upgrade", "websocket")
        .header("Sec-WebSocket-Version", "13")
        .header("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==")
}

/// The same, with the origin that a browser says.
fn handshake_to(to: &To) -> Request {
    match to {
        To::Tcp(address) => handshake().header("Origin", format!("http://{address}")),
        To::Unix(_) => handshake(),
    }
}

/// A page, as far as it has come.
struct Page(Box<dyn Connection>);

impl Page {
    /// Opens the channel, and says nothing yet.
    fn open(to: &To) -> Self {
        let mut page = Self(to.connect());
        page.0.write_all(&handshake_to(to).bytes(to)).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            head.push(page.byte());
        }
        let head = String::from_utf8(head).unwrap().to_ascii_lowercase();
        assert!(head.starts_with("http/1.1 101 "), "{head}");
        assert!(head.contains("sec-websocket-accept: s3pplmbitxaq9kygzzhzrbk+xoo="), "{head}");
        page
    }

    /// One that shows a token; none where it is empty.
    fn with(to: &To, token: &str) -> Self {
        let mut page = Self::open(to);
        page.say(&if token.is_empty() { String::new() } else { format!("Bearer {token}") });
        page
    }

    fn byte(&mut self) -> u8 {
        let mut byte = [0];
        self.0.read_exact(&mut byte).unwrap();
        byte[0]
    }

    /// Says something, by a mask of zeros.
    fn say(&mut self, text: &str) {
        let mut frame = vec![0x81, 0x80 | u8::try_from(text.len()).unwrap(), 0, 0, 0, 0];
        frame.extend_from_slice(text.as_bytes());
        self.0.write_all(&frame).unwrap();
    }

    /// What it is told next; nothing at the end.
    fn told(&mut self) -> Option<Value> {
        let mut head = [0; 2];
        self.0.read_exact(&mut head).ok()?;
        assert_eq!(head[0], 0x81, "text, whole");
        let len = match head[1] {
            126 => usize::from(u16::from_be_bytes([self.byte(), self.byte()])),
            127 => (0..8).fold(0, |len, _| len << 8 | usize::from(self.byte())),
            len => usize::from(len),
        };
        let mut text = vec![0; len];
        self.0.read_exact(&mut text).ok()?;
        Some(serde_json::from_slice(&text).unwrap())
    }

    /// The next that has that key.
    fn next(&mut self, key: &str) -> Value {
        loop {
            let told = self.told().expect("it ended");
            if let Some(value) = told.get(key) {
                return value.clone();
            }
        }
    }
}

#[test]
fn a_page_gets_the_status_and_its_changes_and_its_stop_passes_a_hall_that_takes_nothing() {
    let hall = Hall::open();
    let mut page = Page::with(&hall.port(), "tablet-token");
    assert_eq!(page.next("status")["hall"], "Hall 1");
    hall.socket().post("/api/v1/show/arm");
    while page.next("status")["state"] != "armed" {}
    page.say("echo");
    assert!(page.next("time").as_u64() > Some(1_600_000_000_000));

    hall.sleep();
    page.say("stop");
    assert_eq!(page.next("stop"), "received");
    assert!(hall.desk.take_stop(), "before the supervisor has taken anything");
    hall.wake();
    while hall.asks().last() != Some(&Command::Stop) {}
    let who = hall.asked.lock().unwrap().last().unwrap().who.to_string();
    assert_eq!(who, "operate's (http, operate)");
}

#[test]
fn whoever_may_look_may_stop_by_it_and_whoever_may_not_is_told_why() {
    let hall = Hall::with(with_controller(), |api| kinocue::harness::config::Api {
        open_role: Some(Role::View),
        ..api
    });
    let mut guest = Page::with(&hall.port(), "");
    guest.say(" STOP\n");
    guest.next("stop");
    assert!(hall.desk.take_stop());

    let closed = Hall::open();
    for (token, detail) in [("", "this server requires a token"), ("wrong", "unknown token")] {
        let mut page = Page::with(&closed.port(), token);
        page.say("stop");
        let refusal = page.told().unwrap()["problem"].clone();
        assert_eq!((&refusal["status"], &refusal["detail"]), (&json!(401), &json!(detail)));
        assert_eq!(refusal.get("state"), None, "nothing of the hall");
        assert_eq!(page.told(), None, "it ends");
    }
    assert!(!closed.desk.take_stop());
}

#[test]
fn no_page_of_others_opens_it_whatever_token_it_knows() {
    let hall = Hall::open();
    let foreign = |request: Request| request.send(&hall.port()).problem();
    assert_eq!(foreign(handshake().header("Origin", "http://evil.example")), problem(403, "origin"));
    assert_eq!(foreign(handshake().header("Origin", "null")), problem(403, "origin"));
    assert_eq!(foreign(handshake().host("evil.example")), problem(403, "origin"));
    assert_eq!(foreign(Request::new("GET", "/api/v1/live")), problem(400, "value"));
}

#[test]
fn nothing_but_a_stop_is_a_stop_and_what_is_no_message_ends_the_channel() {
    let hall = Hall::open();
    for text in ["stopp", "go", "{\"stop\":true}", "sto"] {
        let mut page = Page::with(&hall.port(), "booth-token");
        page.next("status");
        page.say(text);
        while page.told().is_some() {}
    }
    let mut bare = Page::open(&hall.port());
    bare.0.write_all(b"\x81\x04stop").unwrap();
    while bare.told().is_some() {}
    assert!(!hall.desk.take_stop());
}

#[test]
fn channels_share_the_room_of_event_streams_and_leave_it() {
    let hall = Hall::open();
    let mut pages: Vec<_> = (0..16).map(|_| Page::with(&hall.port(), "booth-token")).collect();
    pages.iter_mut().for_each(|page| drop(page.next("status")));
    let mut more = Page::with(&hall.port(), "booth-token");
    assert_eq!(more.told().unwrap()["problem"]["code"], "busy");
    pages.pop();
    let again = (0..10_000).map(|_| Page::with(&hall.port(), "booth-token").told().unwrap());
    assert!(again.into_iter().any(|told| told.get("status").is_some()));
}

#[test]
fn a_stop_passes_though_the_page_takes_nothing_of_what_it_is_sent() {
    let hall = Hall::with(long_status(), |api| api);
    let mut slow = Page::with(&hall.socket(), "");
    let mut quick = Page::with(&hall.socket(), "");
    // More than the buffers of a socket hold, and shorter than a stall may last.
    for _ in 0..20 {
        quick.next("status");
    }
    slow.say("stop");
    assert!((0..30).any(|_| quick.next("status").is_object() && hall.desk.take_stop()), "it is read and set");
}

#[test]
fn a_page_that_sleeps_makes_room() {
    let hall = Hall::open();
    let mut asleep = Page::with(&hall.socket(), "");
    let mut awake = Page::with(&hall.socket(), "");
    while asleep.told().is_some() {
        awake.say("echo");
        awake.next("time");
    }
    awake.say("stop");
    awake.next("stop");
}
