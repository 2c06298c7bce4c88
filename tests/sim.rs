//! Virtual controllers over real sockets of 127.0.0.1, in the library and as the program.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use kinocue::harness::motion::Pulses;
use kinocue::harness::sim::{
    Action, Command as Order, CommandError, Controller, Farm, FarmError, LinkFaults, Options, Setup, pa,
};
use kinocue::harness::time::MonoTime;
use kinocue::wire::{
    Analogue, Code, FrameNo, MAX_LEN, Motion, MotionReply, ReadRequest, RegisterReply, ReplyCode, Status,
    Timing,
};

use proptest::prelude::*;

/// Long enough for the slowest machine; nothing waits that long where all is well.
const PATIENCE: Duration = Duration::from_secs(10);

fn host() -> UdpSocket {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
    socket.set_read_timeout(Some(PATIENCE)).expect("a time-out");
    socket
}

fn setup(host: &UdpSocket) -> Setup {
    Setup { host_port: host.local_addr().expect("it is bound").port(), ..Setup::default() }
}

fn send(host: &UdpSocket, to: SocketAddrV4, frame: u32) {
    let motion = Motion {
        timing: Timing::Relative,
        channel: 0,
        accept: Code::ALL,
        reply: Code::ALL,
        frame: FrameNo(frame),
        time_ms: 1,
        positions: &[Pulses(10), Pulses(20), Pulses(30)],
        outputs: 0,
        analogue: Analogue::from_levels([0.5, 0.0]),
        vibration: None,
    };
    let mut buf = [0; MAX_LEN];
    host.send_to(motion.emit(&mut buf), to).expect("loopback takes it");
}

fn answer(host: &UdpSocket) -> FrameNo {
    reply(host).frame
}

fn reply(host: &UdpSocket) -> MotionReply {
    let mut buf = [0; MAX_LEN];
    let len = host.recv(&mut buf).expect("an answer in time");
    MotionReply::parse(&buf[..len]).expect("a motion reply")
}

/// Asks a controller for a register.
fn ask(host: &UdpSocket, to: SocketAddrV4, channel: u16, start: u16) -> u16 {
    let mut buf = [0; MAX_LEN];
    let read = ReadRequest { channel, accept: Code::ALL, reply: Code::ALL, start, num: 1 };
    host.send_to(read.emit(&mut buf), to).expect("loopback takes it");
    let len = host.recv(&mut buf).expect("an answer in time");
    RegisterReply::parse(&buf[..len]).expect("a register reply").data.get(0).expect("a word")
}

/// The next status report.
fn status(host: &UdpSocket) -> (SocketAddr, Status) {
    let mut buf = [0; MAX_LEN];
    let (len, from) = host.recv_from(&mut buf).expect("a report in time");
    (from, Status::parse(&buf[..len]).expect("a status report"))
}

fn to(controller: usize, action: Action) -> Order {
    Order { controller: Some(controller), action }
}

#[test]
fn a_farm_answers_from_each_address_and_counts_what_came() {
    let host = host();
    let farm = Farm::start(Options::loopback(vec![setup(&host); 3])).expect("free ports");
    let addresses = farm.addresses();
    for frame in 0..30 {
        for &address in &addresses {
            send(&host, address, frame);
            assert_eq!(answer(&host), FrameNo(frame));
        }
    }
    for outcome in farm.stop().expect("no log to fail") {
        assert_eq!((outcome.counts.received, outcome.counts.accepted, outcome.counts.replied), (30, 30, 30));
        assert_eq!(outcome.counts.refused.total(), 0);
    }
}

#[test]
fn a_repeating_link_answers_twice_and_a_dead_one_not_at_all() {
    let host = host();
    let farm = |loss, duplicate, delay| {
        let faults = LinkFaults { loss, duplicate, delay };
        Farm::start(Options { faults, ..Options::loopback(vec![setup(&host)]) }).expect("a free port")
    };
    let twice = farm(0.0, 1.0, Duration::from_millis(5));
    send(&host, twice.addresses()[0], 1);
    assert_eq!((answer(&host), answer(&host)), (FrameNo(1), FrameNo(1)));
    assert_eq!(twice.stop().expect("no log to fail")[0].counts.duplicated, 1);

    let (dead, live) = (farm(1.0, 0.0, Duration::ZERO), farm(0.0, 0.0, Duration::ZERO));
    for frame in 0..20 {
        send(&host, dead.addresses()[0], frame);
        send(&host, live.addresses()[0], 100 + frame);
        assert_eq!(answer(&host), FrameNo(100 + frame), "only the live one answers");
    }
    let counts = dead.stop().expect("no log to fail")[0].counts;
    assert_eq!((counts.received, counts.lost_frames + counts.lost_replies), (20, 20));
    assert_eq!(counts.received, counts.lost_frames + counts.accepted);
}

#[test]
fn a_taken_port_and_ports_past_the_last_are_refused() {
    let taken = host();
    let port = taken.local_addr().expect("it is bound").port();
    let at = |port, count| Options {
        listen: SocketAddrV4::new(Ipv4Addr::LOCALHOST, port),
        ..Options::loopback(vec![Setup::default(); count])
    };
    assert!(matches!(Farm::start(at(port, 1)), Err(FarmError::Listen { .. })));
    assert!(matches!(Farm::start(at(65_535, 2)), Err(FarmError::Ports { .. })));
}

#[test]
fn a_remote_acts_on_one_controller_or_on_all() {
    let host = host();
    let farm = Farm::start(Options::loopback(vec![setup(&host); 2])).expect("free ports");
    let (remote, addresses) = (farm.remote(), farm.addresses());
    assert_eq!(remote.tell(to(1, Action::Error(12))), Ok(()));
    let codes = addresses.iter().map(|&address| {
        send(&host, address, 1);
        (reply(&host).code, ask(&host, address, 1, 2))
    });
    assert_eq!(codes.collect::<Vec<_>>(), [(ReplyCode::Running, 3), (ReplyCode::Fault, 3)]);
    let all = |action| Order { controller: None, action };
    assert_eq!(remote.tell(all(Action::Switch { input: 3, closed: true })), Ok(()));
    assert_eq!(remote.tell(all(Action::Duplicate(1.0))), Ok(()));
    for &address in &addresses {
        assert_eq!((ask(&host, address, 0, 0x5e), ask_again(&host)), (4, 4));
    }
    assert_eq!(remote.tell(to(2, Action::Reboot)), Err(CommandError::Controller { index: 2, count: 2 }));
    assert_eq!(remote.tell(all(Action::Error(9))), Err(CommandError::Error(9)));
    farm.stop().expect("no log to fail");
    assert_eq!(remote.tell(all(Action::Reboot)), Err(CommandError::Ended));
}

/// The word of an answer that came once more.
fn ask_again(host: &UdpSocket) -> u16 {
    let mut buf = [0; MAX_LEN];
    let len = host.recv(&mut buf).expect("an answer in time");
    RegisterReply::parse(&buf[..len]).expect("a register reply").data.get(0).expect("a word")
}

#[test]
fn safe_controllers_report_to_the_host_and_a_script_stops_one_of_them() {
    let host = host();
    let SocketAddr::V4(address) = host.local_addr().expect("it is bound") else { panic!("IPv4") };
    let script = vec![(Duration::ZERO, to(0, Action::Switch { input: 1, closed: true }))];
    let safe = Setup::default().safe(address);
    let farm = Farm::start(Options { script, ..Options::loopback(vec![safe]) }).expect("a free port");
    let from = farm.addresses()[0];
    let stopped = std::iter::repeat_with(|| status(&host)).take(100).find(|(_, status)| status.inputs == 1);
    let (sender, seen) = stopped.expect("a report with X01");
    assert_eq!((sender, seen.station, seen.positions.len()), (from.into(), Code(0x0001), 3));
    assert!(farm.stop().expect("no log to fail")[0].counts.reported > 0);
}

#[test]
fn a_script_for_nobody_is_refused() {
    let script = vec![(Duration::ZERO, to(1, Action::Reboot))];
    let options = Options { script, ..Options::loopback(vec![Setup::default()]) };
    assert!(matches!(Farm::start(options), Err(FarmError::Script(CommandError::Controller { .. }))));
}

/// The program, killed where a test ends before it does.
struct Program(Child);

impl Program {
    fn start(args: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.arg("sim").args(args).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(command.spawn().expect("the program starts"))
    }

    /// The addresses that it says are ready.
    fn ready(&mut self, count: usize) -> Vec<SocketAddrV4> {
        let lines = BufReader::new(self.0.stderr.as_mut().expect("piped")).lines().take(count);
        lines
            .map(|line| {
                let line = line.expect("text");
                let address = line.strip_prefix("ready ").expect("the first lines are these");
                address.parse().expect("an address")
            })
            .collect()
    }

    /// Asks it to end, and returns its exit code and what it wrote to its standard output.
    fn end(&mut self, signal: rustix::process::Signal) -> (Option<i32>, String) {
        let pid = rustix::process::Pid::from_child(&self.0);
        rustix::process::kill_process(pid, signal).expect("it runs");
        let mut text = String::new();
        self.0.stdout.as_mut().expect("piped").read_to_string(&mut text).expect("text");
        (self.0.wait().expect("it ends").code(), text)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill(); // it has ended where all is well
        let _ = self.0.wait();
    }
}

#[test]
fn the_program_says_when_it_is_ready_logs_frames_and_moves_counts_and_ends_with_0() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("frames.csv");
    let log_arg = log.to_str().expect("text");
    let moves = folder.path().join("moves.csv");
    let moves_arg = moves.to_str().expect("text");
    let mut sim = Program::start(&[
        "--listen",
        "127.0.0.1:0",
        "--count",
        "2",
        "--host-port",
        "0",
        "--json",
        "--log",
        log_arg,
        "--moves",
        moves_arg,
    ]);
    let addresses = sim.ready(2);
    let host = host();
    for (frame, &address) in (1..).zip(&addresses) {
        send(&host, address, frame);
        assert_eq!(answer(&host), FrameNo(frame));
    }
    let (code, text) = sim.end(rustix::process::Signal::TERM);
    assert_eq!(code, Some(0));
    let report: serde_json::Value = serde_json::from_str(&text).expect("one JSON object");
    for (controller, address) in report["controllers"].as_array().expect("a list").iter().zip(addresses) {
        assert_eq!(controller["address"], address.to_string());
        assert_eq!((&controller["accepted"], &controller["refused"]["fault"]), (&1.into(), &0.into()));
    }
    let rows = rows(&log);
    assert_eq!(rows.len(), 5, "a header, two frames, two ends");
    assert!(rows.iter().all(|row| row.len() == 8 + 24));
    assert_eq!(rows[1][2..11], ["1", "0x1401", "1", "2", "0x0000", "0x80000000", "10", "20", "30"]);
    let moves = self::rows(&moves);
    assert_eq!(moves.len(), 3, "a header, two moves");
    assert!(moves.iter().all(|row| row.len() == 3 + 24));
    let from = ["0", "0", "0", ""];
    assert!(moves[1..].iter().all(|row| row[3..7] == from && row[18].is_empty()), "{moves:?}");
}

/// The cells of a log.
fn rows(path: &std::path::Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).expect("a log");
    text.lines().map(|row| row.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn the_program_ends_with_0_on_ctrl_c_too() {
    let mut sim = Program::start(&["--listen", "127.0.0.1:0"]);
    sim.ready(1);
    assert_eq!(sim.end(rustix::process::Signal::INT).0, Some(0));
}

#[test]
fn the_program_refuses_a_taken_port_with_75_and_the_lan_with_64() {
    let taken = host();
    let address = taken.local_addr().expect("it is bound").to_string();
    for (args, code) in
        [(["--listen", &address], 75), (["--listen", "0.0.0.0:0"], 64), (["--pa", "zz=1"], 64)]
    {
        let mut sim = Program::start(&args);
        assert_eq!(sim.0.wait().expect("it ends").code(), Some(code), "{args:?}");
    }
}

#[test]
fn the_program_takes_commands_at_its_control_socket_and_removes_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sim.sock");
    let path_arg = path.to_str().expect("text");
    drop(std::os::unix::net::UnixListener::bind(&path).expect("a socket")); // left over from another program
    let args = ["--listen", "127.0.0.1:0", "--count", "2", "--host-port", "0", "--control", path_arg];
    let mut sim = Program::start(&args);
    let addresses = sim.ready(2);
    let control = UnixStream::connect(&path).expect("it listens");
    control.set_read_timeout(Some(PATIENCE)).expect("a time-out");
    let mut lines = BufReader::new(&control);
    let mut command = |text: &str| {
        writeln!(&control, "{text}").expect("it takes lines");
        let mut line = String::new();
        lines.read_line(&mut line).expect("an answer in time");
        line
    };
    assert_eq!(command("c2@pa95=6"), "ok\n");
    assert_eq!(command("3@reboot"), "error there is no controller 3; there are 2\n");
    assert!(command("jump").starts_with("error \"jump\" is not a command; commands are X1=1"));
    let host = host();
    assert_eq!([0, 1].map(|index| ask(&host, addresses[index], 1, 0x95)), [0, 6]);
    let second = Program::start(&["--listen", "127.0.0.1:0", "--control", path_arg]).0.wait();
    assert_eq!(second.expect("it ends").code(), Some(75), "the socket is taken");
    assert_eq!(sim.end(rustix::process::Signal::TERM).0, Some(0));
    assert!(!path.exists());
}

#[test]
fn the_program_follows_its_script() {
    let args = ["--listen", "127.0.0.1:0", "--host-port", "0", "--safe", "--script", "0:X1=1, 0:pa02=6"];
    let mut sim = Program::start(&args);
    let (address, host) = (sim.ready(1)[0], host());
    assert_eq!((ask(&host, address, 0, 0x5e), ask(&host, address, 1, 2)), (1, 6));
    assert_eq!([0x90, 0x91, 0x92, 0x94].map(|number| ask(&host, address, 1, number)), [1, 2, 1, 300]);
    assert_eq!(sim.end(rustix::process::Signal::TERM).0, Some(0));
    for wrong in ["1:jump", "1:2@reboot", "X1=1"] {
        let code = Program::start(&["--listen", "127.0.0.1:0", "--script", wrong]).0.wait();
        assert_eq!(code.expect("it ends").code(), Some(64), "{wrong}");
    }
}

/// What a line answers to octets, up to a carriage return.
fn exchange(line: &std::fs::File, octets: &[u8]) -> Vec<u8> {
    (&*line).write_all(octets).expect("it takes octets");
    let mut answer = Vec::new();
    let patience = rustix::time::Timespec { tv_sec: 10, tv_nsec: 0 };
    while !answer.ends_with(b"\r") {
        let mut polled = [rustix::event::PollFd::new(line, rustix::event::PollFlags::IN)];
        assert_eq!(rustix::event::poll(&mut polled, Some(&patience)), Ok(1), "an answer in time: {answer:?}");
        let mut some = [0; 64];
        let count = (&*line).read(&mut some).expect("octets");
        answer.extend(&some[..count]);
    }
    answer
}

#[test]
fn the_program_runs_units_on_a_serial_line_with_a_link_and_says_what_became_of_them() {
    use std::os::unix::fs::OpenOptionsExt as _;
    let folder = tempfile::tempdir().expect("a folder");
    let (path, socket) = (folder.path().join("stalls"), folder.path().join("sim.sock"));
    let (tty, control) = (path.to_str().expect("text"), socket.to_str().expect("text"));
    let mut sim = Program::start(&[
        "--dialect",
        "silvermax",
        "--tty",
        tty,
        "--units",
        "16,26",
        "--seed",
        "1",
        "--control",
        control,
        "--faults",
        "26@X2=0",
        "--json",
    ]);
    let lines = BufReader::new(sim.0.stderr.as_mut().expect("piped")).lines().next();
    assert_eq!(lines.expect("a line").expect("text"), format!("ready {tty}"));
    let line = std::fs::File::options().read(true).write(true).custom_flags(libc::O_NOCTTY).open(&path);
    let line = line.expect("the link leads to it");
    assert_eq!(exchange(&line, b"@16 12 1\r"), b"# 10 000C 0000 0000\r");
    assert_eq!(
        exchange(&line, b"@26 21\r"),
        b"# 1A 0015 F0C0\r",
        "input 2 is low, and 1 away from the switch"
    );
    let control = UnixStream::connect(&socket).expect("it listens");
    let mut answers = BufReader::new(&control).lines();
    let mut command = |text: &str| {
        writeln!(&control, "{text}").expect("it takes lines");
        answers.next().expect("an answer").expect("text")
    };
    assert_eq!(command("26@as=16"), "ok");
    assert_eq!(command("27@reset"), "error there is no unit 27; the line has [16, 26]");
    assert_eq!(exchange(&line, b"@26 1 0\r"), b"* 10\r");
    let (code, text) = sim.end(rustix::process::Signal::TERM);
    assert_eq!(code, Some(0));
    let report: serde_json::Value = serde_json::from_str(&text).expect("one JSON object");
    assert_eq!((&report["units"][0]["requests"], &report["units"][1]["requests"]), (&1.into(), &2.into()));
    assert_eq!(report["units"][0]["executed"]["jumps"], 0);
    assert!(!path.is_symlink() && !socket.exists());
}

#[test]
fn the_program_refuses_what_means_nothing_on_a_serial_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("kept");
    std::fs::write(&file, "kept").expect("a file");
    let kept = file.to_str().expect("text");
    for wrong in [
        &["--dialect", "silvermax"][..],
        &["--tty", "./never"],
        &["--units", "16"],
        &["--dialect", "silvermax", "--tty", "./never", "--listen", "127.0.0.1:0"],
        &["--dialect", "silvermax", "--tty", "./never", "--queue-depth", "3"],
        &["--dialect", "silvermax", "--tty", "./never", "--pa", "95=3"],
        &["--dialect", "silvermax", "--tty", "./never", "--faults", "lost=2"],
        &["--dialect", "silvermax", "--tty", "./never", "--script", "1:17@reset"],
        &["--dialect", "silvermax", "--tty", "./never", "--units", "255"],
        &["--dialect", "silvermax", "--tty", kept],
    ] {
        let code = Program::start(wrong).0.wait();
        assert_eq!(code.expect("it ends").code(), Some(64), "{wrong:?}");
    }
    assert_eq!(std::fs::read_to_string(&file).expect("it is there"), "kept");
}

/// Bytes that open as a request does and go on by chance.
fn request() -> impl Strategy<Value = Vec<u8>> {
    let family = prop::sample::select(&[0x11_u8, 0x12, 0x13, 0x14, 0x18, 0x19, 0x21, 0x22][..]);
    let rest = proptest::collection::vec(prop_oneof![0..4_u8, any::<u8>()], 0..120);
    (family, 0..4_u8, any::<bool>(), rest).prop_map(|(family, channel, answered, rest)| {
        let confirm = if family > 0x20 { [0x33, 0xcc] } else { [0x55, 0xaa] };
        let reply = if answered { 0xff } else { 0 };
        let mut bytes = confirm.to_vec();
        bytes.extend([0, 0, family, 1, 0, channel, 0xff, 0xff, reply, reply]);
        bytes.extend(rest);
        bytes
    })
}

/// What happens in between.
const ACTIONS: [Action; 9] = [
    Action::Switch { input: 1, closed: true },
    Action::Switch { input: 1, closed: false },
    Action::Error(12),
    Action::Error(0),
    Action::Reboot,
    Action::EmergencyStop(true),
    Action::EmergencyStop(false),
    Action::Parameter(pa::INPUT_POLARITY, 0),
    Action::Parameter(pa::AUTO_RESET, 500),
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_is_sent_the_books_of_a_controller_balance(
        datagrams in proptest::collection::vec((request(), 0..2_000_u64), 1..300),
    ) {
        let from = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 8410);
        let address = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 7408);
        let mut controller = Controller::new(&Setup::default().safe(from), address, MonoTime::default());
        let (mut at_ms, mut answers) = (0, 0);
        for (bytes, after_ms) in &datagrams {
            at_ms += after_ms;
            let at = MonoTime::from_nanos(at_ms * 1_000_000);
            let mut buf = [0xa5; MAX_LEN];
            let handled = controller.on_datagram(from, bytes, at, &mut buf);
            answers += u64::from(handled.reply.is_some());
            controller.act(&ACTIONS[bytes.len() % ACTIONS.len()], at);
            let _ = controller.report(at, &mut buf);
        }
        let counts = controller.counts();
        prop_assert_eq!(counts.received, u64::try_from(datagrams.len()).expect("few"));
        prop_assert_eq!(counts.received, counts.accepted + counts.refused.total());
        prop_assert_eq!(counts.replied, answers);
    }
}
