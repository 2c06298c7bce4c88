//! The port with real connections over loopback, before a hall that a double of its supervisor keeps.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use sha2::{Digest as _, Sha256};
use tokio::runtime::Builder;

use super::{CONNECTIONS, open};
use crate::config::{GearWord, TextPort};
use crate::control::{
    Code, Command, FilmStatus, Inbox, Problem, Role, ShowStatus, Status, StatusSource, Surface, handle,
};
use crate::rt::Desk;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Nothing is waited for longer; where all is well it takes milliseconds.
const PATIENCE: Duration = Duration::from_secs(20);

struct Stage {
    port: SocketAddr,
    inbox: Inbox,
    source: StatusSource,
    desk: Arc<Desk>,
}

impl Stage {
    fn new() -> Self {
        Self::with(Ipv4Addr::LOCALHOST, super::IDLE, None)
    }

    fn with(source: Ipv4Addr, idle: Duration, token: Option<&str>) -> Self {
        let desk = Arc::new(Desk::new(std::iter::empty()));
        let (hall, inbox, statuses) = handle(Arc::clone(&desk), playing());
        let config = TextPort {
            listen: SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0),
            sources: vec![source],
            allow: GearWord::ALL.map(|(_, word)| word).to_vec(),
            token: token.map(|token| Sha256::digest(token).into()),
        };
        let mut text = open(&config, hall).unwrap();
        text.idle = idle;
        let port = text.address().unwrap();
        let runtime = Builder::new_current_thread().enable_all().build().unwrap();
        std::thread::spawn(move || runtime.block_on(text.serve())); // as long as the tests run
        Self { port, inbox, source: statuses, desk }
    }

    fn connect(&self) -> Peer {
        let stream = TcpStream::connect(self.port).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Peer(BufReader::new(stream))
    }

    /// What the hall is asked next, and the way to answer it.
    fn asked(&self) -> crate::control::Asked {
        let asked = self.inbox.next(PATIENCE).expect("something is asked");
        assert_eq!((asked.desired.who.role, asked.desired.who.surface), (Role::Operate, Surface::Text));
        asked
    }
}

struct Peer(BufReader<TcpStream>);

impl Peer {
    fn send(&mut self, bytes: &[u8]) {
        self.0.get_mut().write_all(bytes).unwrap();
    }

    /// The next line; empty if the port closed the connection.
    fn line(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).unwrap();
        line
    }
}

fn playing() -> Status {
    let show = ShowStatus {
        cue: "coaster".to_owned(),
        title: None,
        sha256: String::new(),
        length_s: 60.0,
        position_s: 12.34,
        join_s: 2.0,
        resume_s: None,
        axes: 3,
        effects: Vec::new(),
        margins: vec![],
    };
    Status {
        state: crate::state::State::Playing(crate::state::PlayMode::Following).into(),
        show: Some(show),
        ..Status::starting("Hall 1")
    }
}

#[test]
fn a_line_is_asked_and_answered_with_state_and_position() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(b"go\r\n");
    let asked = stage.asked();
    assert_eq!(asked.desired.ask, Command::Go);
    asked.answer(Ok(Arc::new(playing())));
    assert_eq!(peer.line(), "ok playing 00:12.340\r\n");
    peer.send(b"pause\n");
    stage
        .asked()
        .answer(Err(Problem::new(Code::State, "cannot pause", "go first").with(vec!["x".to_owned()])));
    assert_eq!(peer.line(), "error state cannot pause; go first\r\n");
    peer.send(b"status\n");
    assert_eq!(peer.line(), "ok playing 00:12.340\r\n");
}

#[test]
fn the_film_is_told_in_a_line_where_the_hall_follows_one() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(b"film\n");
    assert!(peer.line().starts_with("error unknown this hall follows no film; "));
    let film = |timecode: Option<&str>| {
        let [state, cause] = ["locked", "the film\nruns"].map(str::to_owned);
        let film = FilmStatus { state, cause, timecode: timecode.map(str::to_owned), ..<_>::default() };
        Arc::new(Status { film: Some(film), ..playing() })
    };
    for (timecode, told) in [(Some("01:00:05:12"), "01:00:05:12"), (None, "-")] {
        stage.source.put(film(timecode));
        peer.send(b"film\r\n");
        assert_eq!(peer.line(), format!("ok locked {told} the film runs\r\n"));
    }
}

#[test]
fn nothing_arms_homes_or_clears() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(b"arm\nhome\nclear\n");
    for word in ["arm", "home", "clear"] {
        assert!(peer.line().starts_with(&format!("error role lines of text may never {word}; ")));
    }
    assert!(stage.inbox.next(Duration::ZERO).is_none());
}

#[test]
fn a_stop_is_read_while_an_answer_is_waited_for() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(b"park\nstop\n");
    let (park, stop) = (stage.asked(), stage.asked());
    assert_eq!((&park.desired.ask, &stop.desired.ask), (&Command::Park, &Command::Stop));
    assert!(stage.desk.take_stop(), "before anything is answered");
    stop.answer(Err(Problem::new(Code::State, "second", "-")));
    park.answer(Err(Problem::new(Code::State, "first", "-")));
    assert_eq!(
        [peer.line(), peer.line()].map(|line| line.contains("first")),
        [true, false],
        "in their order"
    );
}

#[test]
fn who_closes_its_own_side_still_gets_its_answer() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(b"park\n");
    peer.0.get_ref().shutdown(std::net::Shutdown::Write).unwrap();
    stage.asked().answer(Ok(Arc::new(Status::starting("Hall 1"))));
    assert_eq!(peer.line(), "ok boot -\r\n");
    assert_eq!(peer.line(), "");
}

#[test]
fn a_line_without_end_and_lines_without_number_end_the_connection() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(&[b'a'; 256]);
    assert!(peer.line().starts_with("error value the line is longer than 256 bytes"));
    assert_eq!(peer.line(), "");
    let mut peer = stage.connect();
    peer.send(&b"park\n".repeat(100));
    // Nobody answers the first; what was read ahead is asked, and the rest is not read.
    let asked =
        std::iter::from_fn(|| stage.inbox.next(Duration::ZERO).or_else(|| stage.inbox.next(PATIENCE / 40)));
    assert!(asked.count() < 20);
    let mut rest = Vec::new();
    let _ = peer.0.read_to_end(&mut rest); // a reset, as lines were left unread
}

#[test]
fn strangers_are_shut_out_without_a_word() {
    let stage = Stage::with(Ipv4Addr::new(10, 0, 0, 5), super::IDLE, None);
    let mut peer = stage.connect();
    assert_eq!(peer.line(), "");
}

#[test]
fn a_page_of_anybody_cannot_have_a_browser_start_the_show() {
    let stage = Stage::new();
    for body in ["go\n", "status\r\ngo\r\n"] {
        let mut peer = stage.connect();
        let head = "POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain;charset=UTF-8\r\n\r\n";
        peer.send(format!("{head}{body}").as_bytes());
        assert!(peer.line().starts_with("error value \"POST / HTTP/1.1\" is not a line that kinocue knows"));
        assert_eq!(peer.line(), "", "and that was all of it");
    }
    let mut peer = stage.connect();
    peer.send(b"status\nnonsense\ngo\n");
    assert!(
        peer.line().starts_with("ok ") && peer.line().starts_with("error value") && peer.line().is_empty()
    );
    assert!(stage.inbox.next(Duration::ZERO).is_none());
}

#[test]
fn an_order_with_a_value_that_is_none_is_answered_and_the_next_is_heard() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(b"trim 501\nstop\n");
    assert!(peer.line().starts_with("error value \"501\": a trim is"));
    assert_eq!(stage.asked().desired.ask, Command::Stop);
}

#[test]
fn where_a_token_is_wanted_nothing_but_a_stop_is_taken_without_it() {
    let stage = Stage::with(Ipv4Addr::LOCALHOST, super::IDLE, Some("hush"));
    for first in ["go\ngo\n", "status\ngo\n", "token wrong\ngo\n", "token\ngo\n"] {
        let mut peer = stage.connect();
        peer.send(first.as_bytes());
        assert!(peer.line().starts_with("error token "), "{first}");
        assert_eq!(peer.line(), "", "{first}");
    }
    assert!(stage.inbox.next(Duration::ZERO).is_none());
    let mut peer = stage.connect();
    peer.send(b"stop\n");
    assert_eq!(stage.asked().desired.ask, Command::Stop);
    assert!(stage.desk.take_stop());
    let mut peer = stage.connect();
    peer.send(b"token hush\r\ngo\r\n");
    assert_eq!(peer.line(), "ok playing 00:12.340\r\n");
    assert_eq!(stage.asked().desired.ask, Command::Go);
}

#[test]
fn whatever_can_be_read_as_a_stop_is_one_however_its_line_ends_and_whatever_stands_before() {
    let stage = Stage::new();
    for octets in [
        &b"stop\r"[..],
        b"\r\nstop\r\n",
        b"\n \n\nSTOP\n",
        b"\xef\xbb\xbfstop\n",
        b"stop!",
        b"status\rstop",
        &[&b"stop"[..], &[b' '; 300]].concat(),
    ] {
        let mut peer = stage.connect();
        peer.send(octets);
        let end = Monotonic.now() + PATIENCE;
        while !stage.desk.take_stop() {
            assert!(Monotonic.now() < end, "{:?}", String::from_utf8_lossy(octets));
            std::thread::yield_now();
        }
        peer.0.get_ref().shutdown(std::net::Shutdown::Write).unwrap();
        assert_eq!(stage.asked().desired.ask, Command::Stop, "{:?}", String::from_utf8_lossy(octets));
        let _ = stage.desk.take_stop();
    }
    let mut peer = stage.connect();
    peer.send(b"stopwatch");
    peer.0.get_ref().shutdown(std::net::Shutdown::Write).unwrap();
    assert_eq!(peer.line(), "");
    assert!(!stage.desk.take_stop(), "another word");
}

#[test]
fn lines_end_with_cr_or_lf_or_both_and_empty_ones_are_none() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(b"\r\nstatus\rstatus\n\r\nstatus\r\n");
    for _ in 0..3 {
        assert_eq!(peer.line(), "ok playing 00:12.340\r\n");
    }
    peer.send(b"GO\r");
    assert_eq!(stage.asked().desired.ask, Command::Go);
}

#[test]
fn idle_connections_keep_no_stop_out() {
    let stage = Stage::new();
    let mut gear = stage.connect();
    gear.send(b"status\n");
    assert!(gear.line().starts_with("ok "));
    let mut idle: Vec<Peer> = (0..2 * CONNECTIONS).map(|_| stage.connect()).collect();
    let mut peer = stage.connect();
    peer.send(b"stop\n");
    assert_eq!(stage.asked().desired.ask, Command::Stop);
    assert!(stage.desk.take_stop());
    assert_eq!(idle[0].line(), "", "the one that was silent longest has made room");
    gear.send(b"stop\n");
    assert_eq!(stage.asked().desired.ask, Command::Stop, "who has asked something keeps a place");
}

#[test]
fn a_stop_behind_too_many_lines_is_heard() {
    let stage = Stage::new();
    let mut peer = stage.connect();
    peer.send(&b"park\n".repeat(100));
    peer.send(b"stop\n");
    let stops =
        std::iter::from_fn(|| stage.inbox.next(PATIENCE)).find(|asked| asked.desired.ask == Command::Stop);
    assert!(stops.is_some() && stage.desk.take_stop());
}

#[test]
fn a_silent_connection_is_closed() {
    let stage = Stage::with(Ipv4Addr::LOCALHOST, Duration::from_millis(1), None);
    assert_eq!(stage.connect().line(), "");
}
