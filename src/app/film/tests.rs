//! Sources that are heard as they are in a hall: sockets and FIFOs of this machine, in real time.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddrV4, TcpStream, UdpSocket};
use std::path::Path;
use std::sync::atomic::AtomicU8;
use std::thread::JoinHandle;

use rosc::{OscMessage, OscPacket, OscType, encoder};
use tempfile::TempDir;

use super::*;
use crate::film::point::FilmState;
use crate::film::source::MtcInput;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, ShowTime};

/// How long a source may take to be where it is expected, on a machine that has much to do.
const PATIENCE: Duration = Duration::from_secs(20);

const RULES: SourceRules = SourceRules { allows_coarse: false, band: 0.0015, freewheel: 1.0 };

/// An address that no other test and no other run of them has.
fn address() -> Ipv4Addr {
    static NEXT: AtomicU8 = AtomicU8::new(1);
    let [_, _, high, low] = std::process::id().to_be_bytes();
    Ipv4Addr::new(127, 64 + NEXT.fetch_add(1, Ordering::Relaxed), high, low.max(1))
}

fn listen(sources: &[String]) -> FilmReader {
    let of = |text: &String| FilmArgs::new(text.parse().expect("it is a source"), Some("25"), None);
    let args: Vec<FilmArgs> = sources.iter().map(|text| of(text).expect("it is whole")).collect();
    FilmReader::start(&args, RULES).expect("it can be read")
}

/// Waits until the table is so, and gives it.
fn until(reader: &FilmReader, what: &str, is_so: impl Fn(&FilmTable) -> bool) -> FilmTable {
    let end = Monotonic.now() + PATIENCE;
    loop {
        let table = reader.table().read();
        if is_so(&table) {
            return table;
        }
        assert!(Monotonic.now() < end, "{what}: {table:#?}");
        thread::yield_now();
    }
}

fn in_state(reader: &FilmReader, state: FilmState) -> SourceRow {
    until(reader, &format!("{state:?}"), |table| table.sources.first().is_some_and(|row| row.state == state))
        .sources
        .remove(0)
}

/// A film that is told in real time, until this is dropped.
struct RunningFilm(Arc<AtomicBool>, Option<JoinHandle<()>>);

impl RunningFilm {
    fn new(
        pieces: impl Iterator<Item = (Duration, Vec<u8>)> + Send + 'static,
        mut send: impl FnMut(&[u8]) + Send + 'static,
    ) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let (ended, begun) = (Arc::clone(&over), Monotonic.now());
        let thread = thread::spawn(move || {
            for (after, bytes) in pieces {
                if ended.load(Ordering::Relaxed) {
                    return;
                }
                Monotonic.sleep_until(begun + after);
                send(&bytes);
            }
        });
        Self(over, Some(thread))
    }

    fn by_datagrams(from: Ipv4Addr, to: SocketAddrV4, start: &str) -> Self {
        let socket = sender(from, to);
        let film = TimecodeSent::new("25", start).expect("there is such a label");
        Self::new(film.artnet(), move |bytes| drop(socket.send(bytes)))
    }

    fn by_sound(fifo: &Path, start: &str) -> Self {
        let mut line = File::options().write(true).open(fifo).expect("somebody reads");
        let mut film = LtcSound::new("25", start).expect("there is such a label");
        let block = move |n: u32| {
            let sound = film.by_ref().take(480).flat_map(i16::to_le_bytes);
            (Duration::from_millis(10) * n, sound.collect())
        };
        Self::new((1..).map(block), move |bytes| drop(line.write_all(bytes)))
    }

    fn by_fifo(fifo: &Path, start: &str) -> Self {
        let mut line = File::options().write(true).open(fifo).expect("somebody reads");
        let film = TimecodeSent::new("25", start).expect("there is such a label");
        Self::new(film.mtc(), move |bytes| drop(line.write_all(bytes)))
    }
}

impl Drop for RunningFilm {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
        if let Some(thread) = self.1.take() {
            let _ = thread.join(); // what it panicked with is printed
        }
    }
}

fn sender(from: Ipv4Addr, to: SocketAddrV4) -> UdpSocket {
    let socket = UdpSocket::bind((from, 0)).expect("it is of this machine");
    socket.connect(to).expect("so is that");
    socket
}

#[test]
fn artnet_of_the_named_sender_locks_and_another_sender_is_ignored_and_named() {
    let (named, foreign, here) = (address(), address(), SocketAddrV4::new(address(), 6454));
    let reader = listen(&[format!("artnet:{named},bind={here}")]);
    let other = RunningFilm::by_datagrams(foreign, here, "05:00:00:00");
    let table = until(&reader, "named", |table| table.sources[0].notes.foreign > 5);
    assert_eq!(table.sources[0].state, FilmState::Absent, "nobody is heard who is not named");
    assert!(table.warnings()[0].contains(&foreign.to_string()), "{:?}", table.warnings());
    let film = RunningFilm::by_datagrams(named, here, "00:10:00:00");
    let row = in_state(&reader, FilmState::Locked);
    let at = row.media_s.expect("it is known");
    assert!((600.0..700.0).contains(&at) && row.may_lead, "{row:?}");
    drop(other);
    drop(film);
    assert_eq!(in_state(&reader, FilmState::Lost).notes.foreign_from, Some(foreign), "silence");
}

#[test]
fn garbage_of_the_named_sender_is_counted_and_leads_nobody_astray() {
    let (named, here) = (address(), SocketAddrV4::new(address(), 6454));
    let reader = listen(&[format!("artnet:{named},bind={here}")]);
    let film = RunningFilm::by_datagrams(named, here, "00:10:00:00");
    in_state(&reader, FilmState::Locked);
    let garbage = sender(named, here);
    let mut long = vec![0xff; 4_000];
    long[..10].copy_from_slice(b"Art-Net\0\x00\x97");
    for bytes in [&b""[..], b"Art-Net\0", &long, &[0; 19]].iter().cycle().take(400) {
        let _ = garbage.send(bytes); // a full buffer is part of the test
    }
    let table = until(&reader, "counted", |table| table.sources[0].notes.garbage > 20);
    assert_eq!((table.sources[0].state, table.sources[0].jumps), (FilmState::Locked, 0), "{table:?}");
    drop(film);
}

#[test]
fn midi_timecode_of_a_fifo_locks_survives_garbage_and_locks_again_with_the_next_writer() {
    let folder = TempDir::new().expect("there is room");
    let fifo = fifo(&folder, "line");
    let reader = listen(&[format!("mtc:{}", fifo.display())]);
    let film = RunningFilm::by_fifo(&fifo, "00:10:00:00");
    in_state(&reader, FilmState::Locked);
    let mut other = File::options().write(true).open(&fifo).expect("somebody reads");
    let noise: Vec<u8> = (0..4_000_u32).map(|n| n.wrapping_mul(2_654_435_761).to_be_bytes()[1]).collect();
    other.write_all(&noise).expect("somebody reads");
    let again = until(&reader, "heard on", |table| table.sources[0].used > 200);
    assert!(again.sources[0].media_s.is_some_and(|at| (600.0..700.0).contains(&at)), "{again:?}");
    drop((film, other));
    in_state(&reader, FilmState::Lost);
    let film = RunningFilm::by_fifo(&fifo, "00:20:00:00");
    let row = in_state(&reader, FilmState::Locked);
    assert!(row.media_s.is_some_and(|at| (1_200.0..1_300.0).contains(&at)), "{row:?}");
    drop(film);
}

#[test]
fn two_halls_hear_through_a_relay_what_its_devices_carry_and_hear_it_again_once_a_device_is_back() {
    let folder = TempDir::new().expect("there is room");
    let (midi, sound) = (folder.path().join("midi"), fifo(&folder, "sound"));
    let lines = [format!("mtc:{}", midi.display()), format!("ltc:fifo:{}", sound.display())];
    let args = lines.each_ref().map(|line| FilmArgs::of(line.parse().expect("it is a source")));
    let _relay = FilmReader::relay(&args, folder.path()).expect("nobody else serves there");
    let at = |kind: &str| format!("{kind}:relay:{}", folder.path().join(format!("{kind}.sock")).display());
    let halls = [(); 2].map(|()| listen(&[at("mtc"), at("ltc")]));
    let is_without =
        |row: &SourceRow| row.notes.trouble.as_deref().is_some_and(|why| why.contains("no line at present"));
    until(&halls[0], "no device", |table| is_without(&table.sources[0]));
    assert_eq!(fifo(&folder, "midi"), midi, "it is plugged in");

    let locked = |row: &SourceRow, after: f64| {
        row.state == FilmState::Locked && row.media_s.is_some_and(|at| (after..after + 100.0).contains(&at))
    };
    until(&halls[0], "plugged in", |table| table.sources[0].notes.trouble.is_none());
    let film = [RunningFilm::by_fifo(&midi, "00:10:00:00"), RunningFilm::by_sound(&sound, "00:10:00:00")];
    for hall in &halls {
        let table = until(hall, "both", |table| table.sources.iter().all(|row| locked(row, 600.0)));
        assert!(table.sources[1].notes.level_db.is_some_and(|level| level > -30.0), "{table:?}");
    }
    drop(film);
    until(&halls[0], "gone", |table| table.sources.iter().all(|row| row.state == FilmState::Lost));
    let _film = RunningFilm::by_fifo(&midi, "00:20:00:00");
    for hall in &halls {
        until(hall, "again", |table| locked(&table.sources[0], 1_200.0));
    }
}

#[test]
fn what_has_no_device_is_not_relayed() {
    let folder = TempDir::new().expect("there is room");
    for source in ["mpv:/s", "artnet:10.0.0.20", "ltc:reel.wav", "ltc:relay:/run/ltc.sock", "clock:19:00"] {
        let args = FilmArgs::of(source.parse().expect("it is a source"));
        let error = FilmReader::relay(&[args], folder.path()).expect_err(source).to_string();
        assert!(error.contains("is not a line that a relay reads; take ltc:alsa:DEVICE"), "{error}");
    }
}

/// A player at that socket that has a film open which began when the test did, or which stands, and then another.
fn player(socket: &Path, films: [&'static str; 2], runs: bool) -> std::sync::mpsc::Sender<()> {
    let (listener, begun) =
        (std::os::unix::net::UnixListener::bind(socket).expect("it is free"), Monotonic.now());
    let (next, wanted) = std::sync::mpsc::channel();
    let changed = |name: &str, data: serde_json::Value| serde_json::json!({ "event": "property-change", "name": name, "data": data });
    thread::spawn(move || {
        let (stream, _) = listener.accept().expect("it is looked for");
        let (mut out, mut open) = (stream.try_clone().expect("it can be cloned"), None);
        writeln!(out, "{}", changed("pause", (!runs).into())).expect("somebody listens");
        for line in std::io::BufRead::lines(std::io::BufReader::new(stream)) {
            let asked: serde_json::Value = serde_json::from_str(&line.expect("text")).expect("JSON");
            let film = if wanted.try_recv().is_ok() { Some(films[1]) } else { open.or(Some(films[0])) };
            if film != open {
                open = film;
                let told = [changed("path", film.into()), changed("time-pos", 0.04.into())];
                told.iter().for_each(|one| writeln!(out, "{one}").expect("somebody listens"));
            }
            let at = Monotonic.now().since(begun).as_secs_f64();
            let id = &asked["request_id"];
            let answer = if runs {
                serde_json::json!({ "data": at, "error": "success", "request_id": id })
            } else {
                serde_json::json!({ "error": "property unavailable", "request_id": id })
            };
            writeln!(out, "{answer}").expect("somebody listens");
        }
    });
    next
}

/// Whoever asks the player at that socket, and follows one film of its two alone.
fn follows_the_feature(socket: &Path) -> FilmReader {
    let source = FilmSource::Mpv(socket.to_owned());
    let args = FilmArgs { films: vec!["feature.mkv".to_owned()], ..FilmArgs::of(source) };
    FilmReader::start(&[args], RULES).expect("it can be asked")
}

#[test]
fn a_player_leads_nobody_with_a_film_that_is_none_of_its_own() {
    let folder = TempDir::new().expect("there is room");
    let socket = folder.path().join("mpv.sock");
    let next = player(&socket, ["/srv/trailer.mkv", "/srv/feature.mkv"], true);
    let reader = follows_the_feature(&socket);
    let row = until(&reader, "refused", |table| table.sources[0].notes.refused.is_some()).sources.remove(0);
    assert!(
        row.notes
            .refused
            .as_deref()
            .is_some_and(|why| why.starts_with("/srv/trailer.mkv is not one of its films"))
    );
    assert_eq!((row.used, row.state), (0, FilmState::Absent));
    next.send(()).expect("it lives");
    assert_eq!(in_state(&reader, FilmState::Locked).notes.refused, None);
}

#[test]
fn a_film_that_stands_where_it_is_opened_after_another_is_stopped_and_not_lost() {
    let folder = TempDir::new().expect("there is room");
    let socket = folder.path().join("mpv.sock");
    let next = player(&socket, ["/srv/trailer.mkv", "/srv/feature.mkv"], false);
    let reader = follows_the_feature(&socket);
    until(&reader, "refused", |table| table.sources[0].notes.refused.is_some());
    next.send(()).expect("it lives");
    let row = in_state(&reader, FilmState::Stopped);
    assert!(row.media_s.is_some_and(|at| at.abs() < 0.01), "it is known where: {row:?}");
}

#[test]
fn a_file_is_no_line_of_midi() {
    let folder = TempDir::new().expect("there is room");
    let path = folder.path().join("song.mid");
    std::fs::write(&path, b"MThd").expect("there is room");
    let args = FilmArgs::new(FilmSource::Mtc(MtcInput::Device(path)), None, None).expect("it is whole");
    let error = anyhow::Error::new(FilmReader::start(&[args], RULES).expect_err("it is none"));
    assert!(format!("{error:#}").contains("nor a FIFO"), "{error:#}");
}

/// A message of where a film is that began when the test did.
fn osc(begun: crate::time::MonoTime, playing: bool) -> Vec<u8> {
    let ms = 60_000.0 + Monotonic.now().since(begun).as_secs_f64() * 1e3;
    let args = vec![OscType::Double(ms), OscType::Bool(playing)];
    encoder::encode(&OscPacket::Message(OscMessage { addr: "/kinocue/sync".to_owned(), args })).expect("OSC")
}

#[test]
fn positions_by_osc_prove_fine_and_a_told_stop_is_one() {
    let (named, foreign, here) = (address(), address(), SocketAddrV4::new(address(), 8430));
    let reader = listen(&[format!("osc:{named},bind={here}")]);
    let (ours, other, begun) = (sender(named, here), sender(foreign, here), Monotonic.now());
    let stop = ours.try_clone().expect("it can be cloned");
    let every = (0..).map(|n| (Duration::from_millis(20) * n, Vec::new()));
    let film = RunningFilm::new(every, move |_| {
        let _ = ours.send(&osc(begun, true));
        let _ = other.send(&osc(begun, false));
        let _ = ours.connect(here); // what a refusal left is taken
    });
    until(&reader, "fine", |table| table.sources[0].state == FilmState::Locked && table.sources[0].may_lead);
    drop(film);
    stop.send(&osc(begun, false)).expect("it is sent");
    stop.send(b"/kinocue/sync\0\0\0,s\0\0now\0").expect("it is sent");
    let row = in_state(&reader, FilmState::Stopped);
    assert_eq!(row.notes.foreign_from, Some(foreign));
    until(&reader, "counted", |table| table.sources[0].notes.garbage == 1);
}

fn connected(from: Ipv4Addr, to: SocketAddrV4) -> TcpStream {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::STREAM, None).expect("a socket");
    socket.bind(&SocketAddrV4::new(from, 0).into()).expect("it is of this machine");
    socket.connect(&to.into()).expect("somebody listens");
    socket.into()
}

/// What is answered to a request with that head and body.
fn asked(from: Ipv4Addr, to: SocketAddrV4, head: &str, body: &str) -> String {
    let mut stream = connected(from, to);
    // Unless it is asked by another name.
    let host = if head.contains("\r\nhost: ") { String::new() } else { format!("\r\nhost: {to}") };
    let (line, more) = head.split_once("\r\n").unwrap_or((head, ""));
    let text = format!(
        "{line} HTTP/1.1{host}\r\n{more}{}connection: close\r\ncontent-length: {}\r\n\r\n{body}",
        if more.is_empty() { "" } else { "\r\n" },
        body.len()
    );
    let _ = stream.write_all(text.as_bytes()); // who is not heard may find that out here
    let mut answer = String::new();
    let _ = stream.read_to_string(&mut answer);
    answer
}

#[test]
fn positions_by_http_lead_from_the_named_player_alone_and_what_is_none_is_refused_in_words() {
    let (named, foreign, here) = (address(), address(), SocketAddrV4::new(address(), 8431));
    let reader = listen(&[format!("http:{named},bind={here}")]);
    let (put, begun) = ("PUT /api/v1/sync/position", Monotonic.now());
    let every = (0..).map(|n| (Duration::from_millis(50) * n, Vec::new()));
    let film = RunningFilm::new(every, move |_| {
        let ms = 60_000.0 + Monotonic.now().since(begun).as_secs_f64() * 1e3;
        let answer = asked(named, here, put, &format!("{{\"media_ms\": {ms}}}"));
        assert!(answer.starts_with("HTTP/1.1 204"), "{answer}");
    });
    in_state(&reader, FilmState::Locked);
    let long = format!("{{\"media_ms\": 1{}}}", "0".repeat(2_000));
    let refused = [
        ("PUT /", "", "404"),
        ("GET /api/v1/sync/position", "", "405"),
        (put, "{}", "400"),
        (put, "{\"media_ms\": 1, \"speed\": 2}", "400"),
        (put, "{\"media_ms\": 1, \"media_ms\": 2}", "400"),
        ("PUT /api/v1/sync/position\r\nhost: evil.example:8431", "{\"media_ms\": 1}", "403"),
        ("PUT /api/v1/sync/position\r\norigin: http://evil.example", "{\"media_ms\": 1}", "403"),
        ("PUT /api/v1/sync/position\r\nsec-fetch-site: cross-site", "{\"media_ms\": 1}", "403"),
        (put, &long, "413"),
    ];
    for (head, body, status) in refused {
        let answer = asked(named, here, head, body);
        assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{head} {body:.40}: {answer}");
    }
    assert_eq!(asked(foreign, here, put, "{\"media_ms\": 1}"), "", "nobody else is answered");
    let table = until(&reader, "counted", |table| table.sources[0].notes.garbage == 9);
    assert_eq!(table.sources[0].notes.foreign_from, Some(foreign));
    drop(film);
    assert!(asked(named, here, put, "{\"media_ms\": 90000, \"playing\": false}").starts_with("HTTP/1.1 204"));
    in_state(&reader, FilmState::Stopped);
}

#[test]
fn half_open_connections_of_the_players_own_machine_keep_the_player_out_at_no_time() {
    let (named, here) = (address(), SocketAddrV4::new(address(), 8431));
    let reader = listen(&[format!("http:{named},bind={here}")]);
    let put = |at: f64| asked(named, here, "PUT /api/v1/sync/position", &format!("{{\"media_ms\": {at}}}"));
    let half = |octets: &[u8]| {
        let mut stream = connected(named, here);
        let _ = stream.write_all(octets);
        stream
    };
    let mut held = Vec::new();
    for n in 0..300_u16 {
        held.push(half(
            [&b""[..], b"PUT /api/v1/sync/posi", b"PUT /api/v1/sync/position HTTP/1.1\r\nhost:"]
                [usize::from(n % 3)],
        ));
        if n % 50 == 49 {
            let answer = put(60_000.0 + f64::from(n));
            assert!(answer.starts_with("HTTP/1.1 204"), "beside {n}: {answer}");
        }
    }
    drop((held, reader));
}

#[test]
fn the_clock_of_the_day_leads_where_it_is_steered_and_is_refused_with_its_error_where_it_is_not() {
    let minute_ago = crate::sys::clock::local_now() - jiff::SignedDuration::from_secs(60);
    let text = |more: &str| format!("clock:{}{more}", minute_ago.timestamp());
    let reader = listen(&[text(",max_error=20000ms")]);
    let row = in_state(&reader, FilmState::Locked);
    assert!(row.media_s.is_some_and(|at| (60.0..80.0).contains(&at)) && row.may_lead, "{row:?}");
    assert!(row.rate_ppm.is_some_and(|ppm| ppm.abs() < 1_500.0), "{row:?}");
    let args = FilmArgs::new(text(",max_error=0ms").parse().expect("it is a time"), None, None);
    let error = FilmReader::start(&[args.expect("it is whole")], RULES).expect_err("no clock is that good");
    assert!(error.to_string().contains("chrony") && error.to_string().contains("max_error="), "{error}");
}

#[test]
fn a_source_that_falls_silent_leaves_the_lead_to_the_next_of_the_ranking() {
    let (first, second) = (address(), address());
    let at = |place: Ipv4Addr| SocketAddrV4::new(place, 6454);
    let (here, there) = (at(address()), at(address()));
    let reader = listen(&[format!("artnet:{first},bind={here}"), format!("artnet:{second},bind={there}")]);
    let best = RunningFilm::by_datagrams(first, here, "00:10:00:00");
    until(&reader, "the first leads", |table| table.leads == Some(0));
    let _other = RunningFilm::by_datagrams(second, there, "00:10:00:00");
    until(&reader, "both are there", |table| table.sources[1].state == FilmState::Locked);
    assert_eq!(reader.table().read().leads, Some(0));
    drop(best);
    let table = until(&reader, "the second leads", |table| table.leads == Some(1));
    assert_eq!((table.sources[0].state, table.switches), (FilmState::Lost, 1));
}

fn fifo(folder: &TempDir, name: &str) -> std::path::PathBuf {
    let path = folder.path().join(name);
    let (kind, mode) = (rustix::fs::FileType::Fifo, rustix::fs::Mode::from_raw_mode(0o600));
    rustix::fs::mknodat(rustix::fs::CWD, &path, kind, mode, 0).expect("a FIFO can be made");
    path
}

#[test]
fn a_reader_that_is_left_takes_nothing_of_a_fifo_from_the_one_that_comes_after_it() {
    let folder = TempDir::new().expect("there is room");
    let (path, text) = (fifo(&folder, "line"), |path: &Path| format!("ltc:fifo:{}", path.display()));
    // None of them has had a writer: each waits for one when it is left.
    (0..4).for_each(|_| drop(listen(&[text(&path)])));
    let reader = listen(&[text(&path)]);
    let mut line = File::options().write(true).open(&path).expect("somebody reads");
    let mut sound = super::LtcSound::new("25", "00:00:10:00").expect("there is such a label");
    let blocks = (0..).map(move |block| {
        let samples = (&mut sound).take(480).flat_map(i16::to_le_bytes).collect();
        (Duration::from_millis(10 * block), samples)
    });
    let _film = RunningFilm::new(blocks, move |bytes| drop(line.write_all(bytes)));
    let row = in_state(&reader, FilmState::Locked);
    assert_eq!((row.rejected, row.jumps, row.dropouts), (0, 0, 0), "{row:?}");
}

#[test]
fn a_command_ends_with_whoever_listened_and_so_does_what_its_shell_has_started() {
    let folder = TempDir::new().expect("there is room");
    let path = folder.path().join("pid");
    let reader = listen(&[format!("ltc:pipe:sleep 600 & echo $! > {}; wait", path.display())]);
    let end = Monotonic.now() + PATIENCE;
    let started = loop {
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        if let Some(pid) = text.trim().parse().ok().and_then(rustix::process::Pid::from_raw) {
            break pid;
        }
        assert!(Monotonic.now() < end, "the shell starts nothing");
        thread::yield_now();
    };
    drop(reader);
    let runs = || {
        // One that has ended and that nobody has waited for is a zombie.
        let state = std::fs::read_to_string(format!("/proc/{}/stat", started.as_raw_nonzero()));
        state.is_ok_and(|state| !state.contains(") Z"))
    };
    while runs() {
        assert!(Monotonic.now() < end, "it runs on");
        thread::yield_now();
    }
}

#[test]
fn a_source_that_a_hall_does_not_find_at_first_is_heard_once_it_is_there() {
    let folder = TempDir::new().expect("there is room");
    let path = folder.path().join("line");
    let source = format!("mtc:{}", path.display()).parse().expect("it is a source");
    let args = FilmArgs::new(source, Some("25"), None).expect("it is whole");
    let reader = FilmReader::open(&[args], RULES, None).expect("a hall opens without it");
    until(&reader, "missing", |table| table.sources[0].notes.trouble.is_some());
    let path = fifo(&folder, "line");
    let table = until(&reader, "there", |table| table.sources[0].notes.trouble.is_none());
    assert_eq!(table.sources[0].state, FilmState::Absent);
    let _film = RunningFilm::by_fifo(&path, "00:00:10:00");
    in_state(&reader, FilmState::Locked);
}

#[test]
fn where_the_film_is_in_the_cue_is_said_with_who_says_so() {
    let place = |media_s| {
        let row = SourceRow { media_s, ..SourceRow::named("ltc:-", FilmState::Locked) };
        let table = FilmTable { sources: vec![row], ..FilmTable::default() };
        table.place(ShowTime::from_millis(60_000), true).expect("there is a source")
    };
    assert_eq!(place(None), "locked by ltc:-");
    assert_eq!(place(Some(-1.25)), "locked, 00:01.250 before the cue by ltc:-");
    assert_eq!(place(Some(7.5)), "locked, at 00:07.500 of the cue by ltc:-");
    assert_eq!(place(Some(61.0)), "locked, 00:01.000 behind the end of the cue by ltc:-");
    assert_eq!(FilmTable::default().place(ShowTime::ZERO, true), None);
}
