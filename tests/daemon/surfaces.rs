//! Who may do what, and by which way.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::process::{Command, Stdio};

use rosc::{OscMessage, OscPacket, OscType, encoder};
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use crate::hall::Hall;
use crate::http::{Reply, Request, To, problem};
use crate::process::PATIENCE;
use crate::programs::is_installed;

/// What of a status says how the hall is led.
fn led(status: &Value) -> Value {
    let keys = ["state", "cause", "show", "playlist", "trim_ms", "levels", "preflight", "test", "journal"];
    keys.iter().map(|key| status[*key].clone()).collect()
}

#[test]
fn no_get_changes_anything_and_figures_and_health_are_told() {
    let hall = Hall::open();
    hall.done(&["load", "ride"]);
    let before = led(&hall.status());
    let document = hall.socket().get("/api/v1/openapi.json").value();
    let paths: Vec<&String> = document["paths"].as_object().unwrap().keys().collect();
    assert!(paths.len() > 25, "{paths:?}");
    for path in paths.iter().filter(|path| !path.ends_with("/events")) {
        let is_read = document["paths"][path].get("get").is_some();
        let path = path.replace("{id}", "ride").replace("{name}", "A1").replace("{day}", "2026-11-21");
        let reply = hall.socket().get(&path);
        assert_eq!(reply.status == 405, !is_read, "{path}: {}", reply.text());
    }
    assert_eq!(led(&hall.lives_on(20)), before);

    for path in ["/healthz", "/readyz"] {
        assert_eq!(hall.socket().get(path).value()["state"], "parked");
    }
    let figures = hall.socket().get("/metrics").text();
    for figure in ["kinocue_frames_sent_total", "kinocue_tick_lateness_seconds_bucket"] {
        assert!(figures.contains(figure), "{figure}:\n{figures}");
    }
    assert!(!figures.contains("# EOF"), "nobody asked for OpenMetrics");
    let open =
        Request::new("GET", "/metrics").header("Accept", "application/openmetrics-text; version=1.0.0");
    assert!(open.send(&hall.socket()).text().ends_with("# EOF\n"));
    if is_installed("promtool") {
        let mut check = Command::new("promtool");
        let mut check =
            check.args(["check", "metrics"]).stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        check.stdin.take().unwrap().write_all(figures.as_bytes()).unwrap();
        let checked = check.wait_with_output().unwrap();
        assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    }
}

/// A request by a token over TCP.
fn by(token: &str, address: SocketAddr, path: &str) -> Reply {
    Request::new("POST", path).token(token).sent_ago(0).send(&To::Tcp(address))
}

#[test]
fn a_token_does_what_its_role_may_and_no_more() {
    let hall = Hall::open_with(|config| {
        let tokens = ["view", "operate", "engineer"].map(|role| {
            let sha256: String = Sha256::digest(role).iter().map(|byte| format!("{byte:02x}")).collect();
            format!("[[api.token]]\nname = \"{role}\"\nrole = \"{role}\"\nsha256 = \"{sha256}\"\n")
        });
        config + "[api]\nlisten = [\"127.0.0.1:0\"]\n" + &tokens.concat()
    });
    let address = hall.serving().heard(|line| line.split("http://").nth(1)?.split('/').next()?.parse().ok());
    hall.done(&["load", "ride"]);
    hall.done(&["preflight"]);
    let status = Request::new("GET", "/api/v1/status");
    assert_eq!(status.clone().send(&To::Tcp(address)).problem(), problem(401, "token"));
    assert_eq!(status.token("view").send(&To::Tcp(address)).state(), "parked");
    for (token, act) in [
        ("view", "arm"),
        ("view", "go"),
        ("view", "park"),
        ("operate", "arm"),
        ("operate", "home"),
        ("operate", "clear"),
    ] {
        let refused = by(token, address, &format!("/api/v1/show/{act}")).problem();
        assert_eq!(refused, problem(403, "role"), "{token} {act}");
    }
    assert_eq!(by("engineer", address, "/api/v1/show/arm").state(), "armed");
    assert_eq!(by("view", address, "/api/v1/show/go").problem(), problem(403, "role"));
    assert_eq!(by("operate", address, "/api/v1/show/disarm").state(), "parked");
    assert_eq!(by("view", address, "/api/v1/show/stop").state(), "stopped", "whoever looks may stop");
    assert_eq!(hall.end().motion(), 0);
}

/// A token of that text, in a configuration.
fn token(name: &str) -> String {
    let sha256: String = Sha256::digest(name).iter().map(|byte| format!("{byte:02x}")).collect();
    format!("[[api.token]]\nname = \"{name}\"\nrole = \"operate\"\nsha256 = \"{sha256}\"\n")
}

#[test]
fn a_token_is_added_and_another_revoked_by_a_reload_and_who_watches_with_that_one_is_cut_off() {
    let hall = Hall::open_with(|config| config + "[api]\nlisten = [\"127.0.0.1:0\"]\n" + &token("old"));
    let address: SocketAddr =
        hall.serving().heard(|line| line.split("http://").nth(1)?.split('/').next()?.parse().ok());
    let may = |token: &str| {
        let reply = Request::new("GET", "/api/v1/who").token(token).send(&To::Tcp(address));
        reply.status == 200
    };
    assert_eq!((may("old"), may("new")), (true, false));
    let mut watches = TcpStream::connect(address).unwrap();
    watches.set_read_timeout(Some(PATIENCE)).unwrap();
    let head = format!("GET /api/v1/events HTTP/1.0\r\nHost: {address}\r\nAuthorization: Bearer old\r\n\r\n");
    watches.write_all(head.as_bytes()).unwrap();
    let mut lines = BufReader::new(watches).lines();
    assert!(lines.next().unwrap().unwrap().contains(" 200 "));
    hall.rewrite(|config| config.replace(&token("old"), &token("new")));
    hall.done(&["reload"]);
    assert_eq!((may("old"), may("new")), (false, true));
    assert!(lines.all(|line| line.is_ok()), "it ends");
    let restart = |status: &Value| status["warnings"].to_string().contains("restart the service");
    assert!(!restart(&hall.status()), "tokens need none");
    hall.rewrite(|config| config + "[osc]\nlisten = \"127.0.0.1:1\"\nsources = [\"127.0.0.1\"]\n");
    hall.done(&["reload"]);
    hall.wait(|status| status["warnings"].to_string().contains("[osc] has changed; restart the service"));
    hall.end();
}

/// Show-control gear that speaks OSC.
struct Gear {
    socket: UdpSocket,
    to: SocketAddr,
}

impl Gear {
    fn say(&self, word: &str) {
        let message = OscMessage { addr: format!("/kinocue/{word}"), args: Vec::<OscType>::new() };
        self.socket.send_to(&encoder::encode(&OscPacket::Message(message)).unwrap(), self.to).unwrap();
    }
}

#[test]
fn osc_lets_an_armed_show_go_and_stops_it_but_never_arms_homes_or_clears() {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let hall = Hall::open_with(|config| {
        config
            + &format!("[osc]\nlisten = \"{port}\"\nsources = [\"127.0.0.1\"]\nallow = [\"go\", \"park\"]\n")
    });
    let gear = Gear { socket: UdpSocket::bind("127.0.0.1:0").unwrap(), to: port };
    hall.done(&["load", "night"]);
    hall.done(&["preflight"]);
    ["arm", "home", "load", "go"].iter().for_each(|word| gear.say(word));
    hall.wait(|status| status["journal"][0]["what"] == "go");
    assert_eq!(hall.lives_on(100)["state"], "parked", "a go within the second after is one with the first");
    hall.done(&["arm"]);
    gear.say("go");
    hall.comes_to("playing");
    gear.say("stop");
    hall.comes_to("stopped");
    gear.say("clear");
    gear.say("park");
    hall.wait(|status| status["journal"][0]["what"] == "park");
    assert_eq!(hall.status()["state"], "stopped");
    let who = hall.status()["journal"][0]["who"].clone();
    assert_eq!(who, "127.0.0.1 (osc, operate)");
}

#[test]
fn lines_of_text_let_an_armed_show_go_and_stop_it_but_never_arm_home_or_clear() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let hall = Hall::open_with(|config| {
        config + &format!("[text]\nlisten = \"{port}\"\nsources = [\"127.0.0.1\"]\n")
    });
    let mut gear = TcpStream::connect(port).unwrap();
    gear.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut answers = BufReader::new(gear.try_clone().unwrap()).lines().map_while(Result::ok);
    let mut say = |line: &str| {
        write!(gear, "{line}\r\n").unwrap();
        answers.next().expect("an answer")
    };
    hall.done(&["load", "night"]);
    hall.done(&["preflight"]);
    for word in ["arm", "home", "clear", "load night"] {
        assert!(say(word).starts_with("error role "), "{word}");
    }
    assert!(say("go").starts_with("error state "), "not armed");
    hall.done(&["arm"]);
    assert!(say("status").starts_with("ok armed "));
    assert!(say("level motion 60%").starts_with("ok armed "));
    assert!(say("stop").starts_with("ok stopped "));
    assert!(say("clear").starts_with("error role "));
    hall.done(&["clear"]);
    hall.wait(|status| status["next"] == "park, or home");
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.done(&["arm"]);
    assert!(say("go").starts_with("ok "));
    assert!(say("pause").starts_with("ok paused "));
    // At rest already: stopping is over in a few hold frames.
    let stopped = say("stop");
    assert!(stopped.starts_with("ok stopp"), "{stopped}");
    hall.comes_to("stopped");
}
