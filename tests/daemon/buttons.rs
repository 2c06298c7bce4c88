//! Buttons: the socket of a relay stands for a pad, and says what the kernel would.

use std::io::{Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use tempfile::TempDir;

use crate::hall::Hall;
use crate::process::PATIENCE;

const ESC: u16 = 1;
const F13: u16 = 183;
const F14: u16 = 184;
const F15: u16 = 185;
const F16: u16 = 186;
/// Kinds of records, and the lamp that shows a fault.
const SYN: u16 = 0;
const KEY: u16 = 1;
const LED: u16 = 0x11;
const FAULT: u16 = 2;

struct Pad {
    folder: TempDir,
    listener: UnixListener,
}

/// A pad that the hall has.
struct Held {
    stream: UnixStream,
    /// Dropped, the relay falls silent.
    _beats: Sender<()>,
}

fn record(kind: u16, code: u16, value: i32, ago: Duration) -> [u8; 24] {
    let now = clock_gettime(ClockId::Monotonic);
    let now = Duration::new(u64::try_from(now.tv_sec).unwrap(), u32::try_from(now.tv_nsec).unwrap());
    let at = now.checked_sub(ago).unwrap();
    let mut record = [0; 24];
    record[..8].copy_from_slice(&at.as_secs().to_ne_bytes());
    record[8..16].copy_from_slice(&u64::from(at.subsec_micros()).to_ne_bytes());
    record[16..18].copy_from_slice(&kind.to_ne_bytes());
    record[18..20].copy_from_slice(&code.to_ne_bytes());
    record[20..].copy_from_slice(&value.to_ne_bytes());
    record
}

/// A relay lives as long as it says something each second.
fn beat(mut stream: UnixStream, ends: &Receiver<()>) {
    while ends.recv_timeout(Duration::from_millis(500)) == Err(RecvTimeoutError::Timeout) {
        if stream.write_all(&record(SYN, 0, 0, Duration::ZERO)).is_err() {
            return;
        }
    }
}

impl Pad {
    fn made() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let listener = UnixListener::bind(folder.path().join("desk.sock")).unwrap();
        Self { folder, listener }
    }

    fn table(&self) -> String {
        let socket = self.folder.path().join("desk.sock");
        format!(
            "[buttons.desk]\ndevice = \"relay:{}\"\nkeys = {{ KEY_ESC = \"stop\", KEY_F13 = \"go\", KEY_F14 = \"pause\", KEY_F15 = \
             \"park\", KEY_F16 = \"mark\" }}\nlamps = {{ LED_SCROLLL = \"fault\" }}\n",
            socket.display()
        )
    }

    /// The hall takes it.
    fn taken(&self) -> Held {
        let (mut stream, _) = self.listener.accept().unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.write_all(b"kinocue buttons 1\n").unwrap();
        let (beats, ends) = channel();
        let beating = stream.try_clone().unwrap();
        thread::spawn(move || beat(beating, &ends));
        Held { stream, _beats: beats }
    }
}

impl Held {
    fn say(&mut self, code: u16, value: i32, ago_ms: u64) {
        self.stream.write_all(&record(KEY, code, value, Duration::from_millis(ago_ms))).unwrap();
    }

    /// A key is pressed and let go, so long ago.
    fn press(&mut self, code: u16, ago_ms: u64) {
        self.say(code, 1, ago_ms);
        self.say(code, 0, ago_ms - 50);
    }

    /// Waits until a lamp is lit.
    fn lights(&mut self, lamp: u16) {
        let mut record = [0; 24];
        loop {
            self.stream.read_exact(&mut record).unwrap();
            if record[16..] == [&LED.to_ne_bytes()[..], &lamp.to_ne_bytes(), &1_i32.to_ne_bytes()].concat() {
                return;
            }
        }
    }
}

/// A hall with a pad that is taken, and has been for longer than it takes to settle.
fn hall_with(pad: &Pad) -> (Hall, Held) {
    let hall = Hall::open_with(|config| config + &pad.table());
    let held = pad.taken();
    hall.wait(|status| status["buttons"][0]["works"] == true);
    hall.lives_on(100);
    (hall, held)
}

#[test]
fn two_presses_of_go_start_what_a_person_armed_and_stop_stops_it_and_nothing_arms_or_moves_other_seats() {
    let pad = Pad::made();
    let (hall, mut desk) = hall_with(&pad);
    hall.done(&["load", "night"]);
    hall.done(&["preflight"]);
    desk.press(F13, 400);
    desk.press(F13, 60);
    hall.serving().heard(|line| line.contains("go was pressed, and does nothing while parked").then_some(()));
    desk.press(F15, 60);
    let refused = hall.wait(|status| status["journal"][0]["what"] == "park");
    assert_eq!((&refused["state"], &refused["moving"]), (&"parked".into(), &false.into()));
    assert_eq!(refused["journal"][0]["who"], "desk (buttons, operate)");

    hall.done(&["arm"]);
    hall.lives_on(20); // a press so soon after the last one would be a bounce of its contact
    desk.press(F13, 60);
    hall.serving().heard(|line| line.contains("waits for its second press").then_some(()));
    // Held, bounced and pressed too late to be meant: none of it is a second press.
    desk.say(F13, 2, 0);
    desk.press(F16, 60);
    assert_eq!(hall.wait(|status| status["journal"][0]["what"] == "mark")["state"], "armed");
    hall.lives_on(60);
    desk.press(F13, 400);
    desk.press(F13, 60);
    hall.comes_to("playing");
    desk.say(ESC, 1, 0);
    let stopped = hall.wait(|status| status["state"] == "stopped" && status["journal"][0]["what"] == "stop");
    assert_eq!(stopped["journal"][0]["who"], "desk (buttons, operate)");
    desk.lights(FAULT);

    desk.press(F15, 60);
    hall.wait(|status| status["journal"][0]["what"] == "park");
    hall.done(&["clear"]);
    hall.comes_to("recovering");
    hall.wait(|status| status["next"] == "park, or home");
    desk.press(F15, 60);
    desk.press(F14, 60);
    hall.wait(|status| status["journal"][0]["what"] == "pause");
    assert_eq!(hall.lives_on(50)["state"], "recovering", "nobody armed the seats that a park would move");
    hall.end();
}

#[test]
fn a_pad_that_is_gone_is_told_and_taken_again_with_its_keys_up() {
    let pad = Pad::made();
    let (hall, desk) = hall_with(&pad);
    hall.arm("night");
    drop(desk);
    let is_told = |warning: &serde_json::Value| warning["id"] == "buttons" && warning["severity"] == "error";
    let told = hall.wait(|status| status["warnings"].as_array().unwrap().iter().any(is_told));
    assert_eq!(told["buttons"][0]["works"], false);
    hall.serving()
        .heard(|line| line.contains("the buttons of desk are not heard, its STOP neither").then_some(()));
    let mut desk = pad.taken();
    // Of a key that is down as it is plugged in, the first report makes a press.
    desk.press(F13, 60);
    desk.press(F13, 51);
    hall.wait(|status| status["buttons"][0]["works"] == true);
    let back = hall.lives_on(50);
    assert!(!back["warnings"].as_array().unwrap().iter().any(is_told));
    assert_eq!(back["state"], "armed");
    // STOP counts at once.
    drop(desk);
    let mut desk = pad.taken();
    desk.say(ESC, 1, 0);
    hall.comes_to("stopped");
    hall.end();
}
