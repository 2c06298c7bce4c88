//! What goes wrong while people sit on the seats, and the stop.

use std::io::Write as _;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use serde_json::Value;

use crate::hall::Hall;

/// A rival that asks would see that it is not alone, and not begin.
const UNASKING: [&str; 1] = ["--no-acks"];

fn health(status: &Value, controller: usize) -> &str {
    status["controllers"][controller]["health"].as_str().expect("a word")
}

/// Connections that send half a request and stay, and are made anew when there are many, until this is dropped.
struct Flood {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Flood {
    fn of(socket: PathBuf) -> Self {
        let over = Arc::<AtomicBool>::default();
        let is_over = Arc::clone(&over);
        let thread = thread::spawn(move || {
            let mut held = Vec::new();
            while !is_over.load(Ordering::Relaxed) {
                if held.len() == 200 {
                    held.clear();
                }
                if let Ok(mut stream) = UnixStream::connect(&socket) {
                    let _ = stream.write_all(b"GET /api/v1/status HTTP/1.1\r\nHost: localhost\r\n");
                    held.push(stream);
                }
            }
        });
        Self { over, thread: Some(thread) }
    }
}

impl Drop for Flood {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join); // what it did is no matter
    }
}

/// Whether frames still go to it; acks may come late where the machine is busy.
fn plays_on(status: &Value, controller: usize) -> bool {
    ["ok", "degraded"].contains(&health(status, controller))
}

/// The warning about a controller that is no more than news.
fn warning<'s>(status: &'s Value, controller: &str) -> Option<&'s Value> {
    let warnings = status["warnings"].as_array().expect("a list");
    warnings.iter().find(|one| one["controller"] == controller && one["severity"] == "error")
}

#[test]
fn the_stop_socket_brings_the_seats_to_rest_while_the_api_is_flooded() {
    let hall = Hall::open();
    hall.play("night");
    let flood = [(); 2].map(|()| Flood::of(hall.path("control.sock")));
    hall.serving().heard(|line| line.contains("too many connections").then_some(()));
    assert_eq!(hall.stop_socket("stop\n"), "stopping\n");
    hall.serving().heard(|line| line.contains("stopped: ").then_some(()));
    drop(flood);
    let stopped = hall.comes_to("stopped");
    assert_eq!(stopped["next"], "clear, then park or home");
    let rest = hall.lives_on(20);
    assert_eq!(
        rest["controllers"][0]["sent"],
        hall.lives_on(20)["controllers"][0]["sent"],
        "no frames any more"
    );
    assert_eq!(hall.run(&["go"]).code, Some(75));
    hall.done(&["clear"]);
    hall.wait(|status| status["next"] == "park, or home");
    hall.done(&["park"]);
    hall.comes_to("parked");
}

#[test]
fn a_plug_pulled_in_mid_show_is_named_the_others_play_on_and_put_back_it_joins_again() {
    let hall = Hall::open();
    hall.play("night");
    hall.relay(1).pull();
    let lost = hall.wait(|status| health(status, 1) == "lost");
    assert!(lost["state"] == "playing" && plays_on(&lost, 0), "{lost}");
    let told = warning(&lost, "A2").expect("it is told");
    // After 50 ms its frames are cut off, and after 250 ms it is lost; on a busy machine the first status is of the second.
    let text = told["text"].as_str().unwrap();
    assert!(
        ["missing for over 50 ms", "no ack and no report"].iter().any(|why| text.contains(why)),
        "{told}"
    );
    assert!(told["remedy"].as_str().unwrap().contains("power and its cable"), "{told}");
    hall.serving().heard(|line| (line.contains("controller-lost") && line.contains("A2")).then_some(()));
    let acked = |status: &Value| status["controllers"][0]["acked"].as_u64();
    let later = hall.lives_on(100);
    assert!(acked(&later) > acked(&lost) && later["state"] == "playing", "{later}");

    hall.relay(1).put_back();
    let back = hall.wait(|status| health(status, 1) == "ok");
    assert!(warning(&back, "A2").is_none(), "{back}");
    hall.relay(1).count();
    hall.relay(1).wait_for(|_| true);
    hall.done(&["park"]);
    hall.comes_to("parked");
}

#[test]
fn a_seat_whose_plug_was_pulled_in_mid_show_and_is_put_back_after_it_comes_down_once_a_person_parks_it() {
    let hall = Hall::open();
    hall.play("ride");
    hall.rises(1);
    hall.relay(1).pull();
    hall.comes_to("parked");
    hall.relay(1).put_back();
    let down = "park, or start a show: it joins slowly";
    let up = hall.wait(|status| status["next"] == down && health(status, 1) == "rejoining");
    let warnings = up["warnings"].as_array().expect("a list");
    let told = warnings.iter().find(|one| one["id"] == "controller-rejoining").expect("it is told");
    assert_eq!((told["controller"].as_str(), told["remedy"].as_str()), (Some("A2"), Some(down)));
    hall.relay(1).count();
    hall.lives_on(50);
    assert_eq!(hall.relay(1).count(), 0, "nothing moves by itself");

    assert_eq!(hall.done(&["park"]).code, Some(0));
    hall.relay(1).wait_for(|frame| frame.positions[0].0 == 0);
    hall.wait(|status| status["state"] == "parked" && health(status, 1) == "ok");
    assert_ne!(hall.status()["next"], down);
    assert!(hall.end().rest_in_park());
}

#[test]
fn a_plug_pulled_between_shows_is_seen_and_put_back_it_is_well_again() {
    let hall = Hall::open();
    // How the controllers stand may be told a moment later than the state.
    hall.wait(|status| [0, 1].iter().all(|one| health(status, *one) == "ok"));
    hall.relay(0).pull();
    let lost = hall.wait(|status| health(status, 0) == "lost");
    assert_eq!((lost["state"].as_str(), health(&lost, 1)), (Some("parked"), "ok"));
    assert!(warning(&lost, "A1").is_some(), "{lost}");
    hall.relay(0).put_back();
    let back = hall.wait(|status| health(status, 0) == "ok");
    assert!(warning(&back, "A1").is_none(), "{back}");
    hall.arm("ride");
    assert_eq!(hall.end().motion(), 0);
}

#[test]
fn a_controller_that_reboots_in_mid_show_is_out_until_a_person_homes_it() {
    let hall = Hall::open();
    hall.play("night");
    hall.lives_on(200);
    hall.happens("2@reboot");
    let out = hall.wait(|status| health(status, 1) == "excluded");
    assert!(out["state"] == "playing" && plays_on(&out, 0), "{out}");
    let told = warning(&out, "A2").expect("it is told");
    assert!(told["remedy"].as_str().unwrap().contains("home it"), "{told}");
    hall.relay(1).count();
    hall.lives_on(100);
    assert_eq!(hall.relay(1).count(), 0, "no motion goes to it");

    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.done(&["home", "--seats-empty"]);
    let home = hall.wait(|status| status["state"] == "parked" && health(status, 1) == "ok");
    assert!(warning(&home, "A2").is_none(), "{home}");
    hall.arm("ride");
    hall.done(&["go"]);
    hall.relay(1).wait_for(|_| true);
    hall.wait(|status| status["cause"] == "the seats that take part have parked");
}

#[test]
fn a_controller_that_reboots_between_shows_is_out_until_a_person_homes_it() {
    let hall = Hall::open();
    // A counter of a few datagrams looks the same after a reboot; so the controllers are asked for more.
    (0..4).for_each(|_| drop(hall.done(&["preflight"])));
    hall.lives_on(50);
    hall.happens("1@reboot");
    let out = hall.wait(|status| health(status, 0) == "excluded");
    assert_eq!((out["state"].as_str(), health(&out, 1)), (Some("parked"), "ok"));
    hall.done(&["home", "--seats-empty"]);
    hall.wait(|status| status["state"] == "parked" && health(status, 0) == "ok");
    assert_eq!(hall.end().motion(), 0);
}

#[test]
fn another_machine_that_drives_a_seat_at_rest_is_a_fault_and_the_seat_is_homed_before_it_plays_again() {
    let hall = Hall::open();
    hall.arm("ride");
    let mut rival = hall.rival(&UNASKING);
    let fault = hall.comes_to("fault");
    assert!(fault["cause"].as_str().expect("text").contains("another master sends frames"), "{fault}");
    assert_eq!(fault["next"], "stop the other master, then clear");
    assert_eq!(hall.run(&["go"]).code, Some(75));
    let excluded = hall.wait(|status| [0, 1].map(|one| health(status, one)) == ["excluded"; 2]);
    let remedy = warning(&excluded, "A1").expect("it is told")["remedy"].as_str().expect("text");
    assert_eq!(remedy, "stop the other machine; then clear, and home it with nobody on the seat");
    assert!(rival.wait().expect("it is ours").success());
    assert_eq!(excluded["controllers"][0]["sent"], 0, "nothing was sent from here");

    hall.done(&["clear"]);
    hall.done(&["home", "--seats-empty"]);
    hall.comes_to("parked");
    hall.arm("ride");
    hall.done(&["go"]);
    hall.comes_to("playing");
    hall.comes_to("parked");
    assert!(hall.end().rest_in_park());
}

#[test]
fn the_halls_homing_refuses_a_controller_that_would_not_search_its_zero() {
    let mut hall = Hall::closed(&["--pa", "0e=1"], |config| config);
    hall.serve();
    hall.run(&["home", "--seats-empty"]);
    let told = |status: &Value| {
        let warnings = status["warnings"].as_array().expect("a list");
        let texts = warnings.iter().filter_map(|warning| warning["text"].as_str());
        texts.filter(|text| text.contains("without a search (PA0e = 1)")).count() == 2
    };
    let status = hall.wait(|status| status["state"] == "fault" && told(status));
    assert_eq!(status["cause"], "A1: a seat failed to home");
}

#[test]
fn another_machine_that_drives_a_seat_in_mid_show_is_a_fault_that_says_so() {
    let hall = Hall::open();
    hall.play("night");
    hall.lives_on(200);
    let mut rival = hall.rival(&UNASKING);
    let fault = hall.comes_to("fault");
    assert!(fault["cause"].as_str().expect("text").contains("another master sends frames"), "{fault}");
    assert_eq!(fault["next"], "stop the other master, then clear");
    assert!(rival.wait().expect("it is ours").success());
}

#[test]
fn a_play_does_not_begin_at_controllers_that_a_hall_has_and_sends_no_frame() {
    let hall = Hall::open();
    let mut play = hall.rival(&[]);
    assert_eq!(play.wait().expect("it is ours").code(), Some(79));
    hall.lives_on(100);
    assert_eq!(hall.status()["state"], "parked", "a few reads are no frames");
    assert_eq!(hall.end().motion(), 0);
}
