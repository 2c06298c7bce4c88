//! A machine that is on before its network: addresses and networks that come after the start of the service.

use std::io::Write as _;
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;

use crate::hall::{Hall, Place, SEATS, all, health, plays_on, warning};

/// What is said of a seat to which no network leads yet.
fn has_no_way(status: &Value, seat: usize) -> bool {
    warning(status, "controller-lost", Some(seat)).is_some_and(|(text, remedy)| {
        text == "lost: this machine has no way to it yet: no network of its leads there"
            && remedy.contains("rejoins by itself")
    })
}

/// Sends a text to a port of the hall over TCP from the machine of the controllers; gives what comes back.
fn ask(hall: &Hall, port: u16, text: &str) -> String {
    let script = format!(
        "import socket, sys; s = socket.create_connection(('10.77.0.1', {port}), 20); s.sendall(sys.stdin.buffer.read()); \
         print(s.recv(4096).decode())"
    );
    let mut command = hall.far.command("python3");
    let mut asked =
        command.args(["-c", &script]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("python3");
    asked.stdin.take().expect("it has one").write_all(text.as_bytes()).expect("it reads");
    let said = asked.wait_with_output().expect("it ends");
    String::from_utf8_lossy(&said.stdout).into_owned()
}

#[test]
fn a_machine_without_its_address_comes_up_says_what_is_missing_and_has_all_of_it_once_that_is_there() {
    let more = "[api]\nlisten = [\"10.77.0.1:8480\", \"127.0.0.1:8480\"]\n\
                [osc]\nlisten = \"10.77.0.1:53000\"\nsources = [\"10.77.0.2\"]\n\
                [text]\nlisten = \"10.77.0.1:7411\"\nsources = [\"10.77.0.2\"]\n";
    let at = Place { bind: "10.77.0.1", seats: SEATS, lay: "", more };
    let Some(hall) = Hall::open_at(3, &[], &at) else { return };
    let waits = hall.wait(|status| {
        (0..2).all(|seat| has_no_way(status, seat))
            && warning(status, "address", None).is_some_and(|(text, _)| {
                ["show", "api", "osc", "text"]
                    .iter()
                    .all(|table| text.contains(&format!("10.77.0.1 of [{table}]")))
            })
    });
    assert!(warning(&waits, "address", None).is_some_and(|(_, remedy)| remedy.contains("switch")), "{waits}");
    let later = hall.lives_on(300);
    assert!((0..2).all(|seat| has_no_way(&later, seat)), "{later}");
    let said = hall.serving().lines();
    let of_show = said.iter().filter(|line| line.contains("this machine does not have")).count();
    assert_eq!(of_show, 1, "it is logged once: {said:?}");

    hall.show.run("ip address add 10.77.0.1/24 dev show");
    hall.wait(|status| status["state"] == "parked" && all(status, "ok"));
    hall.wait(|status| warning(status, "address", None).is_none());
    let health = ask(&hall, 8480, "GET /healthz HTTP/1.0\r\nHost: 10.77.0.1:8480\r\n\r\n");
    assert!(health.contains(" 200 "), "{health}");
    assert!(!ask(&hall, 7411, "status\n").is_empty());
    hall.play("ride");
    hall.comes_to("parked");
    hall.ends(true);
}

/// A hall of which only the first network is there, laid so; a person has taken the seat out that is in the other.
fn half(lay: &str) -> Option<Hall> {
    let at = Place { bind: "0.0.0.0", seats: [SEATS[0], [10, 78, 0, 3]], lay, more: "" };
    let hall = Hall::open_at(3, &[], &at)?;
    hall.wait(|status| plays_on(status, 0) && health(status, 1) == "lost");
    hall.done(&["disable", "A2"]);
    hall.comes_to("parked");
    Some(hall)
}

/// The first seat plays, the second network comes in mid-show, and its seat plays as well once a person has enabled it.
fn plays_once_it_is_there(hall: Hall) {
    hall.done(&["load", "night"]);
    hall.done(&["preflight"]);
    hall.done(&["arm"]);
    hall.done(&["go"]);
    hall.wait(|status| status["state"] == "playing" && plays_on(status, 0));
    hall.show.run("ip address add 10.78.0.1/24 dev show");
    hall.wait(|status| plays_on(status, 0) && !["lost", "unknown"].contains(&health(status, 1)));
    hall.lives_on(100);
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.done(&["enable", "A2"]);
    hall.wait(|status| status["state"] == "parked" && all(status, "ok"));
    hall.play("night");
    hall.lives_on(100);
    hall.comes_down();
    let frames = hall.ends(true);
    assert!(frames.iter().all(|seat| seat.len() > 50), "both were led");
}

#[test]
fn one_of_two_networks_that_comes_in_mid_show_has_its_seat_seen_and_in_the_next_show_led_without_a_jerk() {
    let Some(hall) = half("ip address add 10.77.0.1/24 dev show") else { return };
    let said = hall.serving().lines();
    assert!(said.iter().any(|line| line.contains("A2: lost: this machine has no way to it yet")), "{said:?}");
    plays_once_it_is_there(hall);
}

#[test]
fn nor_does_a_way_by_a_router_keep_frames_on_the_address_of_another_network() {
    let lay = "ip address add 10.77.0.1/24 dev show\nip route add default via 10.77.0.9 dev show";
    let Some(hall) = half(lay) else { return };
    plays_once_it_is_there(hall);
}

#[test]
fn a_port_that_another_program_has_is_named_and_served_once_it_is_free() {
    let more = "[api]\nlisten = [\"127.0.0.1:8480\"]\n[text]\nlisten = \"10.77.0.1:7411\"\nsources = [\"10.77.0.2\"]\n";
    let hold = "python3 -c \"import socket, time; a = [socket.create_server(('', port)) for port in (8480, 7411)]; \
                open('$HELD', 'w'); time.sleep(600)\" < /dev/null > /dev/null 2>&1 & echo $! > $HOLDER; while [ ! -e $HELD ]; do sleep 0.05; done";
    let folder = tempfile::tempdir().expect("a folder");
    let name = |name: &str| folder.path().join(name).to_str().expect("text").to_owned();
    let lay = format!("ip address add 10.77.0.1/24 dev show\n{hold}")
        .replace("$HELD", &name("held"))
        .replace("$HOLDER", &name("holder"));
    let at = Place { bind: "10.77.0.1", seats: SEATS, lay: &lay, more };
    let Some(hall) = Hall::open_at(3, &[], &at) else { return };
    hall.wait(|status| {
        all(status, "ok")
            && warning(status, "port", None).is_some_and(|(text, _)| {
                ["127.0.0.1:8480", "10.77.0.1:7411"].iter().all(|port| text.contains(port))
            })
    });
    hall.play("ride");
    hall.comes_to("parked");
    release(&hall, folder.path());
    hall.wait(|status| warning(status, "port", None).is_none());
    assert!(!ask(&hall, 7411, "status\n").is_empty());
    hall.ends(true);
}

/// Ends whoever holds the ports.
fn release(hall: &Hall, folder: &Path) {
    let holder = std::fs::read_to_string(folder.join("holder")).expect("it was written");
    hall.show.run(&format!("kill {holder}"));
}
