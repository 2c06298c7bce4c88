//! Events: the whole status at once, then at each change.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};

use serde_json::Value;

use crate::client::{Connection, Request, To, problem};
use crate::hall::{Hall, long_status};

/// A stream of events.
struct Events(BufReader<Box<dyn Connection>>);

impl Events {
    fn open(to: &To) -> Self {
        let mut connection = to.connect();
        connection.write_all(&Request::new("GET", "/api/v1/events").bytes(to)).unwrap();
        Self(BufReader::new(connection))
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        assert!(self.0.read_line(&mut line).unwrap() > 0, "it ended");
        line.trim_end().to_owned()
    }

    /// The next status.
    fn next(&mut self) -> Value {
        while self.line() != "event: status" {}
        serde_json::from_str(self.line().strip_prefix("data: ").unwrap()).unwrap()
    }
}

#[test]
fn who_connects_gets_the_whole_status_at_once_and_each_change_after() {
    let hall = Hall::open();
    let mut events = Events::open(&hall.socket());
    let first = events.next();
    assert_eq!((first["state"].as_str(), first["hall"].as_str()), (Some("boot"), Some("Hall 1")));
    assert!(first["controllers"].is_array() && first["levels"].is_object());
    hall.socket().post("/api/v1/show/arm");
    while events.next()["state"] != "armed" {}
}

#[test]
fn of_many_changes_no_more_than_ten_a_second_are_pushed() {
    let hall = Hall::open();
    let mut events = Events::open(&hall.socket());
    let uptime = |status: &Value| status["ticks"].as_u64().unwrap();
    let (first, second) = (events.next(), events.next());
    for _ in 0..3 {
        events.next();
    }
    let fifth = events.next();
    assert!(uptime(&second) > uptime(&first), "the newest, not all of them");
    assert!(uptime(&fifth) - uptime(&first) >= 12, "the double makes one every 5 ms or so: {first} {fifth}");
}

#[test]
fn who_reads_nothing_is_cut_off_and_the_others_go_on() {
    let hall = Hall::with(long_status(), |api| api);
    let mut slow = hall.socket().connect();
    slow.write_all(&Request::new("GET", "/api/v1/events").bytes(&hall.socket())).unwrap();
    let mut quick = Events::open(&hall.socket());
    // More than any buffer holds in between, and longer than a stall may last.
    for _ in 0..70 {
        quick.next();
    }
    let mut rest = Vec::new();
    slow.take(4_000_000).read_to_end(&mut rest).unwrap();
    assert!(rest.len() < 4_000_000, "what was on its way, and then the end");
    quick.next();
}

#[test]
fn there_is_room_for_so_many_and_a_place_is_free_again_when_one_goes() {
    let hall = Hall::open();
    let mut watching: Vec<_> = (0..16).map(|_| Events::open(&hall.socket())).collect();
    watching.iter_mut().for_each(|events| {
        events.next();
    });
    assert_eq!(hall.socket().get("/api/v1/events").problem(), problem(429, "busy"));
    watching.pop();
    let mut again = Events::open(&hall.socket());
    while again.line().starts_with("HTTP/1.1 429") {
        again = Events::open(&hall.socket());
    }
    again.next();
}

#[test]
fn viewers_who_watch_do_not_shut_the_booth_out() {
    let hall = Hall::with(long_status(), |api| kinocue::harness::config::Api {
        open_role: Some(kinocue::harness::control::Role::View),
        ..api
    });
    let watch = |token: Option<&str>| {
        let request = Request::new("GET", "/api/v1/events");
        let request = token.into_iter().fold(request, Request::token);
        let mut connection = hall.port().connect();
        connection.write_all(&request.bytes(&hall.port())).unwrap();
        Events(BufReader::new(connection))
    };
    let mut viewers: Vec<_> = (0..16).map(|_| watch(None)).collect();
    viewers.extend((0..16).map(|_| watch(Some("guest-token"))));
    viewers.iter_mut().for_each(|events| {
        events.next();
    });
    watch(Some("booth-token")).next();
}

#[test]
fn streams_end_with_the_server() {
    let mut hall = Hall::open();
    let mut events = Events::open(&hall.socket());
    events.next();
    hall.sleep();
    hall.close();
    let mut rest = String::new();
    events.0.read_to_string(&mut rest).unwrap();
    assert!(rest.ends_with("0\r\n\r\n"), "a whole end: {rest:?}");
    assert!(std::os::unix::net::UnixStream::connect(hall.dir.path().join("control.sock")).is_err());
}
