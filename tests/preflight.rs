//! `kinocue preflight` against `kinocue sim`, over 127.0.0.0/8.
//!
//! Each test has an address of its own there, so that all can hold frame port 8410 at once.

#[path = "common/said.rs"]
mod said;

use std::io::{BufRead as _, BufReader};
use std::net::{SocketAddrV4, UdpSocket};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use said::Said;
use serde_json::Value;

/// Settings that pass, but for the address of the host.
const SAFE: &[&str] = &[
    "00=10", "06=0", "07=2880", "1e=100", "1f=1", "80=2880", "81=2880", "82=2880", "83=2880", "84=2880",
    "85=2880", "90=1", "91=2", "92=1", "93=20", "94=300",
];

/// `kinocue sim`, killed where a test ends before it does.
struct Sim {
    child: Child,
    addresses: Vec<SocketAddrV4>,
}

impl Sim {
    /// As many controllers, with these parameters, that answer to the host 127.83.0.`host`.
    fn start(count: usize, host: u8, parameters: &[&str], more: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.args(["sim", "--listen", "127.0.0.1:0", "--count", &count.to_string()]).args(more);
        let to = ["20=127", "21=83", "22=0"].map(str::to_owned).into_iter().chain([format!("23={host}")]);
        for parameter in to.chain(parameters.iter().map(ToString::to_string)) {
            command.args(["--pa", &parameter]);
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let lines = BufReader::new(child.stderr.take().expect("piped")).lines().take(count);
        let address = |line: std::io::Result<String>| {
            line.expect("text")
                .strip_prefix("ready ")
                .expect("the first lines are these")
                .parse()
                .expect("an address")
        };
        let addresses = lines.map(address).collect();
        Self { child, addresses }
    }

    /// With settings that pass, and then these.
    fn safe(host: u8, parameters: &[&str]) -> Self {
        Self::start(1, host, &[SAFE, parameters].concat(), &[])
    }
}

impl Drop for Sim {
    fn drop(&mut self) {
        let _ = self.child.kill(); // it has ended where all is well
        let _ = self.child.wait();
    }
}

/// Runs preflight from 127.83.0.`host`, port 8410.
fn preflight(host: u8, args: &[&str]) -> Said {
    let output = Command::new(env!("CARGO_BIN_EXE_kinocue"))
        .arg("preflight")
        .args(args)
        .args(["--bind", &format!("127.83.0.{host}:8410")])
        .output()
        .expect("it runs");
    Said::of(output)
}

/// The checks that a controller of a report fails.
fn failed(report: &Value, controller: usize) -> Vec<&str> {
    let findings = report["controllers"][controller]["findings"].as_array().expect("a list");
    let fails = |finding: &&Value| finding["severity"] == "fail" && finding["accepted"].is_null();
    findings.iter().filter(fails).map(|finding| finding["check"].as_str().expect("a name")).collect()
}

/// A configuration with these controllers, more lines under [show], and more under each controller.
fn hall(folder: &tempfile::TempDir, addresses: &[SocketAddrV4], show: &str, more: &str) -> PathBuf {
    let mut text = format!(
        "[show]\n{show}\n[seat.s]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
         max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n"
    );
    for (number, address) in (1..).zip(addresses) {
        let row = if number % 2 == 0 { "B" } else { "A" };
        text += &format!(
            "[[controller]]\nname = \"S{number}\"\nrow = \"{row}\"\nseat = \"s\"\naddress = \"{address}\"\n{more}\n"
        );
    }
    let path = folder.path().join("hall.toml");
    std::fs::write(&path, text).expect("a file");
    path
}

#[test]
fn safe_settings_pass_as_a_table_and_as_json() {
    let sim = Sim::safe(1, &[]);
    let to = format!("{},name=A1,axes=3", sim.addresses[0]);
    let said = preflight(1, &["--to", &to]);
    assert_eq!(said.exit, 0, "{}\n{}", said.out, said.err);
    assert!(said.out.contains("A1") && said.out.contains("e-stop"), "{}", said.out);
    assert!(said.err.contains("preflight passed: 1 of 1"), "{}", said.err);
    let report = preflight(1, &["--to", &to, "--json"]).json();
    assert_eq!((&report["passed"], &report["failed"]), (&true.into(), &0.into()));
    let controller = &report["controllers"][0];
    assert_eq!((&controller["name"], &controller["answered"]), (&"A1".into(), &true.into()));
    assert_eq!(
        (&controller["round_trip_us"]["reads"], &controller["registers"]["PA93"]),
        (&20.into(), &20.into())
    );
    assert!(failed(&report, 0).is_empty(), "{report}");
}

#[test]
fn settings_of_the_factory_are_refused_in_sentences() {
    let sim = Sim::start(2, 2, &[], &[]);
    let tos = sim.addresses.iter().flat_map(|address| ["--to".to_owned(), format!("{address},axes=3")]);
    let tos: Vec<_> = tos.collect();
    let said = preflight(2, &tos.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(said.exit, 1);
    for sentence in [
        "`kinocue register write PA93=20 --keep` and the same --to or --config, while no service runs",
        "FAIL estop-disabled: all 2: PA90 = 0: bit 0 is clear, so the controller ignores its emergency stop inputs",
        "FAIL estop-no-input: all 2: PA92 = 0: no input is an emergency stop",
        "FAIL estop-resumes: all 2: PA91 = 0: the seat holds when the button is pressed, and moves on by itself",
        "FAIL estop-filter: all 2: PA93 = 200",
        "FAIL estop-release: all 2: PA94 = 0",
        "FAIL status-off: all 2: PA1f = 0",
        "work-mode-open: all 2: PA00 = 0",
    ] {
        assert!(said.out.contains(sentence), "{sentence}\n{}", said.out);
    }
}

#[test]
fn each_of_these_settings_is_found_through_the_wire() {
    for (setting, check) in [
        ("92=3", "estop-and"),
        ("0d=500", "auto-reset"),
        ("23=77", "reply-address"),
        ("95=3", "axis-offset"),
        ("03=3", "rotary-axis"),
        ("05=1", "outputs-inverted"),
        ("0e=1", "homes-unsearched"),
        ("41=100", "lead"),
        ("59=11", "bus-period"),
        ("60=1", "analogue-position"),
    ] {
        let sim = Sim::safe(3, &[setting]);
        let said = preflight(3, &["--to", &format!("{},axes=3", sim.addresses[0]), "--json"]);
        assert_eq!((said.exit, failed(&said.json(), 0)), (1, vec![check]), "{setting}");
    }
}

#[test]
fn sixty_four_controllers_of_which_eight_are_dead_are_told_apart_in_time() {
    let sim = Sim::start(56, 4, SAFE, &[]);
    let dead: Vec<UdpSocket> = (0..8).map(|_| UdpSocket::bind("127.0.0.1:0").expect("a free port")).collect();
    let silent =
        dead.iter().map(|socket| socket.local_addr().expect("bound").to_string().parse().expect("IPv4"));
    let addresses: Vec<_> = sim.addresses.iter().copied().chain(silent).collect();
    let folder = tempfile::tempdir().expect("a folder");
    let path = hall(&folder, &addresses, "", "");
    let said = preflight(4, &["--config", path.to_str().expect("text"), "--json"]);
    let report = said.json();
    assert_eq!(
        (said.exit, &report["answered"], &report["failed"]),
        (1, &56.into(), &8.into()),
        "{}",
        said.err
    );
    for number in 1..=64_usize {
        let expected = if number > 56 { vec!["no-answer"] } else { vec![] };
        assert_eq!(failed(&report, number - 1), expected, "S{number}");
    }
    assert!(report["took_s"].as_f64().expect("a number") < 10.0);
    let text = preflight(4, &["--config", path.to_str().expect("text")]).out;
    assert!(text.lines().next().is_some_and(|header| header.contains("row")), "{text}");
    assert!(
        text.contains("FAIL no-answer: S57, S58, S59, S60, S61, S62, S63, S64: does not answer"),
        "{text}"
    );
}

#[test]
fn a_controller_that_may_not_reply_is_dead_and_the_remedy_names_why() {
    let sim = Sim::safe(5, &["15=0"]);
    let said = preflight(5, &["--to", &sim.addresses[0].to_string()]);
    assert_eq!(said.exit, 69);
    assert!(said.out.contains("no-answer") && said.out.contains("PA15 = 1"), "{}", said.out);
    assert!(said.err.contains("no controller answers"), "{}", said.err);
}

#[test]
fn a_held_frame_port_ends_with_75() {
    let _held = UdpSocket::bind("127.83.0.6:8410").expect("nobody else is there");
    let said = preflight(6, &["--to", "127.0.0.1:7408"]);
    assert_eq!(said.exit, 75, "{}", said.err);
    assert!(said.err.contains("frame port"), "{}", said.err);
}

#[test]
fn a_bad_configuration_ends_with_78_and_names_the_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let bad = "accept_findings = [{ check = \"estop-disable\", why = \"x\" }]";
    let path = hall(&folder, &["127.0.0.1:7408".parse().expect("an address")], "", bad);
    let said = preflight(7, &["--config", path.to_str().expect("text")]);
    assert_eq!(said.exit, 78);
    assert!(
        said.err.contains("hall.toml:16:") && said.err.contains("did you mean estop-disabled?"),
        "{}",
        said.err
    );
}

#[test]
fn an_accepted_finding_is_shown_with_its_reason_and_does_not_fail() {
    let sim = Sim::safe(8, &["90=0", "55=5"]);
    let folder = tempfile::tempdir().expect("a folder");
    let accept = |check, why| format!("accept_findings = [{{ check = \"{check}\", why = \"{why}\" }}]");
    let (show, own) = (accept("amplitude", "a small room"), accept("estop-disabled", "contactor K1"));
    let path = hall(&folder, &sim.addresses, &show, &own);
    let said = preflight(8, &["--config", path.to_str().expect("text")]);
    assert_eq!(said.exit, 0, "{}", said.out);
    assert!(said.out.contains("accepted estop-disabled: S1: PA90 = 0"), "{}", said.out);
    assert!(said.out.contains("accepted: contactor K1") && said.out.contains("accepted: a small room"));
    let partly = hall(&folder, &sim.addresses, &show, "");
    let said = preflight(8, &["--config", partly.to_str().expect("text"), "--json"]);
    let report = said.json();
    assert_eq!((said.exit, &report["failed"], &report["accepted"]), (1, &1.into(), &1.into()));
}

#[test]
fn names_and_rows_choose() {
    let sim = Sim::start(3, 9, SAFE, &[]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = hall(&folder, &sim.addresses, "", "");
    let config = path.to_str().expect("text");
    let names = |args: &[&str]| {
        let report = preflight(9, &[&["--config", config, "--json"], args].concat()).json();
        let controllers = report["controllers"].as_array().expect("a list").clone();
        controllers.iter().map(|one| one["name"].as_str().expect("a name").to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names(&[]), ["S1", "S2", "S3"]);
    assert_eq!(names(&["--row", "A"]), ["S1", "S3"]);
    assert_eq!(names(&["S2"]), ["S2"]);
    assert_eq!(preflight(9, &["--config", config, "S9"]).exit, 66);
}

#[test]
fn a_cue_gives_the_axes_and_the_rate_the_longest_time() {
    let sim = Sim::safe(10, &["0b=3000"]);
    let to = sim.addresses[0].to_string();
    let cue = concat!(env!("CARGO_MANIFEST_DIR"), "/cues/voyage.csv"); // twelve axes
    let report = preflight(10, &["--to", &to, "--json"]).json();
    assert!(failed(&report, 0).is_empty(), "{report}");
    let report = preflight(10, &["--to", &to, "--cue", cue, "--json"]).json();
    assert!(failed(&report, 0).contains(&"axis-count"), "{report}");
    let short = Sim::safe(10, &["0b=500"]);
    let report =
        preflight(10, &["--to", &format!("{},axes=3", short.addresses[0]), "--rate", "1", "--json"]).json();
    assert!(failed(&report, 0).contains(&"interval-limit"), "{report}");
}

#[test]
fn mbox_controllers_are_judged_by_what_they_have() {
    let parameters = ["06=0", "07=2880", "51=0", "90=1", "91=2", "92=1", "93=20", "94=300"];
    let sim = Sim::start(1, 11, &parameters, &["--dialect", "mbox"]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = hall(&folder, &sim.addresses, "", "dialect = \"mbox\"\nestop_inputs = [1]");
    let said = preflight(11, &["--config", path.to_str().expect("text"), "--json"]);
    assert_eq!((said.exit, failed(&said.json(), 0)), (0, vec![]));
    let timed = Sim::start(1, 11, &[&parameters[..], &["0a=1"]].concat(), &["--dialect", "mbox"]);
    let path = hall(&folder, &timed.addresses, "", "dialect = \"mbox\"\nestop_inputs = [1]");
    let said = preflight(11, &["--config", path.to_str().expect("text"), "--json"]);
    assert_eq!((said.exit, failed(&said.json(), 0)), (1, vec!["time-ignored"]));
}

#[test]
fn a_controller_that_reports_as_one_of_another_dialect_is_told_with_the_setting_to_change() {
    let folder = tempfile::tempdir().expect("a folder");
    let sim = Sim::safe(17, &[]);
    let path = hall(&folder, &sim.addresses, "", "dialect = \"mbox\"\nestop_inputs = [1]");
    let said = preflight(17, &["--config", path.to_str().expect("text"), "--json"]);
    let report = said.json();
    assert!(failed(&report, 0).contains(&"dialect"), "{report}");
    let text = report.to_string();
    assert!(text.contains("write dialect = \\\"smc\\\" for this controller"), "{text}");
    assert!(!failed(&report, 0).contains(&"register-unread"), "its cause is told: {report}");
}

#[test]
fn a_word_order_other_than_the_dialects_is_found_where_a_seat_is_up() {
    let parameters = ["06=0", "07=2880", "51=0", "90=1", "91=2", "92=1", "93=20", "94=300"];
    let sim = Sim::start(1, 14, &parameters, &["--dialect", "mbox"]);
    let host = UdpSocket::bind("127.83.0.14:8410").expect("nobody else is there");
    // 0x1401 to 20,000 pulses of axis 1 in 100 ms, with a reply.
    let mut frame = vec![0x55, 0xaa, 0, 0, 0x14, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 1, 0, 0, 0, 100];
    frame.extend([20_000_i32, 0, 0].iter().flat_map(|axis| axis.to_be_bytes()).chain([0; 6]));
    host.send_to(&frame, sim.addresses[0]).expect("loopback takes it");
    host.recv(&mut [0; 64]).expect("a reply");
    drop(host);
    let folder = tempfile::tempdir().expect("a folder");
    let judged = |dialect: &str| {
        let path = hall(&folder, &sim.addresses, "", &format!("dialect = \"{dialect}\"\nestop_inputs = [1]"));
        preflight(14, &["--config", path.to_str().expect("text"), "--json"]).json()
    };
    // Preflight takes longer than the frame.
    let _ = judged("mbox");
    assert!(failed(&judged("mbox"), 0).is_empty());
    assert!(failed(&judged("smc"), 0).contains(&"word-order"), "as an smc it stands at 1310720000 pulses");
}

#[test]
fn an_emergency_stop_in_effect_fails() {
    let sim = Sim::start(1, 12, SAFE, &["--estop-at", "0"]);
    let said = preflight(12, &["--to", &format!("{},axes=3", sim.addresses[0]), "--json"]);
    assert_eq!((said.exit, failed(&said.json(), 0)), (1, vec!["emergency-stop-active"]));
}

#[test]
fn a_second_master_is_noticed() {
    let sim = Sim::safe(13, &[]);
    let address = sim.addresses[0];
    let done = AtomicBool::new(false);
    let said = std::thread::scope(|scope| {
        scope.spawn(|| {
            let master = UdpSocket::bind("127.0.0.1:0").expect("a free port");
            master.set_read_timeout(Some(Duration::from_millis(1))).expect("a time-out");
            while !done.load(Ordering::Relaxed) {
                master.send_to(&[0x55, 0xaa], address).expect("loopback takes it");
                let _ = master.recv(&mut [0; 64]); // nothing comes: it paces
            }
        });
        let said = preflight(13, &["--to", &format!("{address},axes=3"), "--json"]);
        done.store(true, Ordering::Relaxed);
        said
    });
    assert_eq!((said.exit, failed(&said.json(), 0)), (79, vec!["other-master"]));
}

#[test]
fn checks_are_explained_without_any_controller() {
    let explain = |args: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_kinocue"))
            .arg("preflight")
            .args(args)
            .output()
            .expect("it runs");
        (output.status.code(), String::from_utf8(output.stdout).expect("text"))
    };
    let (exit, all) = explain(&["--explain"]);
    assert_eq!(exit, Some(0));
    for check in kinocue::harness::preflight::Check::ALL {
        assert!(all.contains(check.id()), "{check}");
        let (exit, one) = explain(&["--explain", check.id()]);
        assert_eq!(exit, Some(0));
        assert!(one.contains(check.why()), "{check}");
    }
    assert_eq!(explain(&["--explain", "nothing"]).0, Some(66));
}
