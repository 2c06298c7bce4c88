//! The port with real datagrams over loopback, before a hall that a double of its supervisor keeps.

use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use rosc::{OscBundle, OscMessage, OscPacket, OscTime, OscType, decoder, encoder};
use tokio::runtime::Builder;

use super::{Counts, open};
use crate::config::{GearWord, OscPort};
use crate::control::{
    Code, Command, FilmStatus, Inbox, LevelsChange, Problem, Role, Severity, ShowStatus, Status,
    StatusSource, Surface, Warning, handle,
};
use crate::rt::Desk;
use crate::state::{PlayMode, State};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::time::Clock as _;

/// Nothing is waited for longer; where all is well it takes milliseconds.
const PATIENCE: Duration = Duration::from_secs(20);

struct Stage {
    port: SocketAddr,
    counts: Arc<Counts>,
    inbox: Inbox,
    source: StatusSource,
    desk: Arc<Desk>,
    gear: UdpSocket,
}

impl Stage {
    fn new() -> Self {
        Self::of(&[Ipv4Addr::LOCALHOST])
    }

    fn of(sources: &[Ipv4Addr]) -> Self {
        let desk = Arc::new(Desk::new(std::iter::empty()));
        let (hall, inbox, source) = handle(Arc::clone(&desk), Status::starting("Hall 1"));
        let config = OscPort {
            listen: SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0),
            sources: sources.to_vec(),
            allow: GearWord::ALL.map(|(_, word)| word).to_vec(),
        };
        let counts = Arc::<Counts>::default();
        let osc = open(&config, hall, Arc::clone(&counts)).unwrap();
        let port = osc.address().unwrap();
        let runtime = Builder::new_current_thread().enable_all().build().unwrap();
        std::thread::spawn(move || runtime.block_on(osc.serve())); // as long as the tests run
        let gear = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        gear.set_read_timeout(Some(PATIENCE)).unwrap();
        Self { port, counts, inbox, source, desk, gear }
    }

    fn send(&self, packet: &OscPacket) {
        self.gear.send_to(&encoder::encode(packet).unwrap(), self.port).unwrap();
    }

    fn say(&self, word: &str, args: Vec<OscType>) {
        self.send(&message(word, args));
    }

    /// What the hall is asked next; it is answered well.
    fn asked(&self) -> Command {
        let asked = self.inbox.next(PATIENCE).expect("something is asked");
        assert_eq!((asked.desired.who.role, asked.desired.who.surface), (Role::Operate, Surface::Osc));
        assert_eq!(asked.desired.who.name, "127.0.0.1");
        let ask = asked.desired.ask.clone();
        asked.answer(Ok(Arc::new(Status::starting("Hall 1"))));
        ask
    }

    /// The next message to the gear that is called so.
    fn heard(&self, word: &str) -> Vec<OscType> {
        let mut bytes = [0; 2048];
        loop {
            let (len, from) = self.gear.recv_from(&mut bytes).expect("something is said");
            assert_eq!(from, self.port);
            let (_, packet) = decoder::decode_udp(&bytes[..len]).unwrap();
            let OscPacket::Message(message) = packet else { panic!("a bundle") };
            if message.addr == format!("/kinocue/{word}") {
                return message.args;
            }
        }
    }

    /// Waits until something has been counted.
    fn wait_for(&self, word: &str) {
        let until = Monotonic.now() + PATIENCE;
        while self.counts.of(word) == 0 {
            assert!(Monotonic.now() < until, "nothing is {word}");
            std::thread::yield_now();
        }
    }

    fn subscribe(&self, seconds: i32) {
        let port = i32::from(self.gear.local_addr().unwrap().port());
        self.say("subscribe", vec![OscType::Int(port), OscType::Int(seconds)]);
    }
}

fn message(word: &str, args: Vec<OscType>) -> OscPacket {
    OscPacket::Message(OscMessage { addr: format!("/kinocue/{word}"), args })
}

fn playing_at(position_s: f64) -> Status {
    let show = ShowStatus {
        cue: "coaster".to_owned(),
        title: None,
        sha256: String::new(),
        length_s: 60.0,
        position_s,
        join_s: 2.0,
        resume_s: None,
        axes: 3,
        effects: Vec::new(),
        margins: vec![],
    };
    Status {
        state: State::Playing(PlayMode::Following).into(),
        show: Some(show),
        ..Status::starting("Hall 1")
    }
}

#[test]
fn what_is_said_is_asked_in_its_order() {
    let stage = Stage::new();
    stage.say("go", vec![]);
    stage.say("pause", vec![]);
    stage.say("seek", vec![OscType::Float(12.5)]);
    assert_eq!([stage.asked(), stage.asked()], [Command::Go, Command::Pause]);
    assert_eq!(stage.asked(), Command::Seek(crate::time::ShowTime::from_millis(12_500)));
}

#[test]
fn a_go_that_comes_twice_is_asked_once() {
    let stage = Stage::new();
    stage.say("go", vec![]);
    stage.say("go", vec![]);
    stage.say("park", vec![]);
    assert_eq!([stage.asked(), stage.asked()], [Command::Go, Command::Park]);
    assert_eq!(stage.counts.of("repeated"), 1);
}

#[test]
fn a_stop_reaches_the_tick_thread_while_nobody_answers() {
    let stage = Stage::new();
    for _ in 0..40 {
        stage.say("pause", vec![]);
    }
    stage.say("stop", vec![]);
    stage.say("arm", vec![]);
    stage.wait_for("forbidden"); // what came before it was read
    assert!(stage.desk.take_stop());
}

#[test]
fn nothing_arms_and_whoever_tries_is_told() {
    let stage = Stage::new();
    for word in ["arm", "home", "clear"] {
        stage.say(word, vec![]);
        let heard = stage.heard("warning");
        let [OscType::Int(2), OscType::String(text)] = heard.as_slice() else { panic!("{heard:?}") };
        assert!(text.starts_with(&format!("OSC may never {word}")), "{text}");
    }
    assert_eq!(stage.counts.of("forbidden"), 3);
    assert!(stage.inbox.next(Duration::ZERO).is_none());
}

#[test]
fn strangers_are_not_heard() {
    let stage = Stage::of(&[Ipv4Addr::new(10, 0, 0, 5)]);
    stage.say("stop", vec![]);
    stage.wait_for("foreign");
    assert!(!stage.desk.take_stop());
}

#[test]
fn nothing_is_done_later_but_a_stop_is_done_at_once() {
    let stage = Stage::new();
    let content = vec![message("go", vec![]), message("stop", vec![])];
    let now_s = wall_now_ns() / 1_000_000_000 + 2_208_988_800; // since 1900
    let timetag = OscTime { seconds: u32::try_from(now_s).unwrap() + 3_600, fractional: 0 };
    stage.send(&OscPacket::Bundle(OscBundle { timetag, content }));
    assert_eq!(stage.asked(), Command::Stop);
    assert!(stage.desk.take_stop());
    assert_eq!(stage.counts.of("early"), 1);
}

#[test]
fn faders_that_move_while_levels_are_set_add_up_to_their_last_value() {
    let stage = Stage::new();
    let motion = |level| vec![OscType::Float(level)];
    stage.say("level/motion", motion(0.9));
    let first = stage.inbox.next(PATIENCE).unwrap();
    for level in [0.8, 0.7, 0.6] {
        stage.say("level/motion", motion(level));
    }
    stage.say("effect/water", vec![OscType::Int(0)]);
    stage.say("arm", vec![]);
    stage.heard("warning");
    first.answer(Ok(Arc::new(Status::starting("Hall 1"))));
    let effects = [("water".to_owned(), false)].into();
    assert_eq!(stage.asked(), Command::Levels(LevelsChange { motion: Some(0.6), effects, ..<_>::default() }));
}

#[test]
fn a_refusal_of_the_hall_is_told_to_whoever_asked() {
    let stage = Stage::new();
    stage.say("go", vec![]);
    let asked = stage.inbox.next(PATIENCE).unwrap();
    asked.answer(Err(Problem::new(Code::State, "cannot go while parked", "arm first")));
    assert!(stage.heard("warning").contains(&OscType::from("cannot go while parked; arm first")));
    assert_eq!(stage.counts.of("not_done"), 1);
}

#[test]
fn a_subscriber_hears_state_position_warnings_and_the_beat() {
    let stage = Stage::new();
    stage.source.put(Arc::new(playing_at(1.5)));
    stage.subscribe(60);
    assert_eq!(stage.heard("state"), [OscType::from("playing")]);
    assert_eq!(stage.heard("position"), [OscType::Float(1.5)]);
    assert_eq!(stage.heard("heartbeat"), [OscType::Int(0)]);
    let warning = Warning {
        id: "controller-lost".to_owned(),
        severity: Severity::Error,
        controller: Some("A1".to_owned()),
        text: "no ack".to_owned(),
        remedy: "look at its plug".to_owned(),
        ..Warning::default()
    };
    stage.source.put(Arc::new(Status { warnings: vec![warning], uptime_s: 1.2, ..playing_at(2.5) }));
    assert_eq!(stage.heard("position"), [OscType::Float(2.5)]);
    assert_eq!(stage.heard("warning"), [OscType::Int(2), OscType::from("A1: no ack; look at its plug")]);
    assert_eq!(stage.heard("heartbeat"), [OscType::Int(1)]);
}

#[test]
fn a_subscriber_hears_of_the_film_what_is_new_of_it() {
    let film = |state: &str, cause: &str, timecode: Option<&str>| {
        let [state, cause] = [state, cause].map(str::to_owned);
        let film = FilmStatus { state, cause, timecode: timecode.map(str::to_owned), ..<_>::default() };
        Arc::new(Status { film: Some(film), ..playing_at(1.5) })
    };
    let stage = Stage::new();
    stage.source.put(film("locked", "the film runs", Some("01:00:05:12")));
    stage.subscribe(60);
    assert_eq!(stage.heard("film"), ["locked", "the film runs"].map(OscType::from));
    assert_eq!(stage.heard("timecode"), [OscType::from("01:00:05:12")]);
    stage.source.put(film("locked", "the film runs", Some("01:00:05:14")));
    assert_eq!(stage.heard("timecode"), [OscType::from("01:00:05:14")]);
    stage.source.put(film("lost", "no position is received from the film any more", None));
    let next = stage.heard("film");
    assert_eq!(next[0], OscType::from("lost"), "what did not change was not told again");
}

#[test]
fn bytes_that_are_no_osc_are_counted_and_the_port_lives_on() {
    let stage = Stage::new();
    for bytes in
        [b"".as_slice(), b"GET / HTTP/1.1\r\n\r\n", &[0xff; 1400], b"#bundle\0\0\0\0\0\0\0\0\x01\0\0\xff\xff"]
    {
        stage.gear.send_to(bytes, stage.port).unwrap();
    }
    stage.say("park", vec![]);
    assert_eq!(stage.asked(), Command::Park);
    assert_eq!(stage.counts.of("malformed"), 4);
}
