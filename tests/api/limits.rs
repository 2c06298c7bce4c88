//! Abuse, and what goes on beside it.

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::thread;

use kinocue::harness::control::{Command, Role};

use crate::client::{Reply, Request, problem};
use crate::hall::Hall;

/// Whether the other end ends the connection.
fn ends(connection: &mut dyn crate::client::Connection) -> bool {
    let mut rest = Vec::new();
    match connection.read_to_end(&mut rest) {
        Ok(_) => true,
        Err(error) => error.kind() == std::io::ErrorKind::ConnectionReset,
    }
}

#[test]
fn a_body_beyond_its_limit_is_refused() {
    let hall = Hall::open();
    let long = format!("{{\"cue\":\"{}\"}}", "a".repeat(70_000));
    let load = Request::new("POST", "/api/v1/show/load").json(long.clone());
    assert_eq!(load.send(&hall.socket()).problem(), problem(413, "size"));
    // The same in chunks, whose length nobody says before.
    let mut connection = hall.socket().connect();
    let head = "POST /api/v1/show/load HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
                Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n";
    connection.write_all(head.as_bytes()).unwrap();
    let _ = connection.write_all(format!("{:x}\r\n{long}\r\n0\r\n\r\n", long.len()).as_bytes());
    assert_eq!(Reply::read(&mut *connection).problem(), problem(413, "size"));
    assert!(hall.asks().is_empty());
}

#[test]
fn a_head_without_end_is_cut_off_before_it_fills_the_memory() {
    let hall = Hall::open();
    let mut connection = hall.port().connect();
    connection.write_all(b"GET / HTTP/1.1\r\nX: ").unwrap();
    let piece = [b'x'; 65_536];
    let taken = (0..1_600).take_while(|_| connection.write_all(&piece).is_ok()).count();
    assert!(taken < 200, "{taken} pieces of 64 KiB were taken");
    assert_eq!(hall.port().get("/").status, 200);
}

#[test]
fn heads_and_requests_that_are_none_end_their_connections_alone() {
    let hall = Hall::open();
    for bytes in [
        &b"\x16\x03\x01\x02\x00"[..],
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"POST /api/v1/show/go HTTP/1.1\r\nHost: localhost\r\nContent-Length: x\r\n\r\n",
        b"POST /api/v1/show/go HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
    ] {
        let mut connection = hall.socket().connect();
        connection.write_all(bytes).unwrap();
        let mut reply = String::new();
        connection.read_to_string(&mut reply).unwrap();
        assert!(reply.is_empty() || reply.starts_with("HTTP/1.1 4"), "{bytes:?}: {reply}");
    }
    assert!(hall.asks().is_empty());
    assert_eq!(hall.socket().get("/api/v1/status").status, 200);
}

#[test]
fn a_head_that_does_not_come_is_not_waited_for() {
    let hall = Hall::open();
    let mut connection = hall.port().connect();
    connection.write_all(b"GET /api/v1/status HTTP/1.1\r\nHost:").unwrap();
    assert!(ends(&mut *connection));
}

#[test]
fn a_stop_passes_a_control_plane_that_is_stuffed_in_every_way() {
    let hall = Hall::with(crate::hall::with_controller(), |api| kinocue::harness::config::Api {
        open_role: Some(Role::View),
        ..api
    });
    hall.sleep();
    thread::scope(|scope| {
        // One after the other asks, until nothing more fits into the queue.
        let stuffed: Vec<_> =
            (0..64).map(|_| hall.handle.post(engineer(), Command::Pause).unwrap()).collect();
        assert_eq!(hall.socket().post("/api/v1/show/pause").problem(), problem(429, "busy"));
        let _idle: Vec<_> = (0..64).map(|_| hall.socket().connect()).collect();
        let _floods: Vec<_> =
            (0..4).map(|_| scope.spawn(|| (0..50).for_each(|_| drop(hall.port().get("/"))))).collect();
        let mut stop = UnixStream::connect(hall.stop_socket()).unwrap();
        stop.write_all(b"stop\n").unwrap();
        let mut reply = String::new();
        stop.read_to_string(&mut reply).unwrap();
        assert_eq!(reply, "stopping\n");
        assert!(hall.desk.take_stop());
        // And by HTTP, though the hall does not answer.
        assert_eq!(hall.port().post("/api/v1/show/stop").state(), "parked");
        assert!(hall.desk.take_stop());
        hall.wake();
        drop(stuffed);
    });
}

fn engineer() -> kinocue::harness::control::Who {
    kinocue::harness::control::Who {
        role: Role::Engineer,
        surface: kinocue::harness::control::Surface::Schedule,
        name: "test".to_owned(),
    }
}

#[test]
fn half_a_request_from_many_addresses_keeps_no_stop_out() {
    let hall = Hall::open();
    let mut half = Vec::new();
    for n in 0..320_u32 {
        let from = std::net::Ipv4Addr::from(0x7f00_0002 + n % 4);
        let mut connection = connect_from(from, hall.address());
        connection.write_all(b"POST /api/v1/show/stop HTTP/1.1\r\nHost:").unwrap();
        half.push(connection);
    }
    assert!(ends(&mut half[0]), "the oldest made room");
    for _ in 0..12 {
        let stop = Request::new("POST", "/api/v1/show/stop").token("guest-token");
        assert_eq!(stop.send(&hall.port()).state(), "stopping");
        assert!(hall.desk.take_stop());
    }
}

/// A connection that comes from another address of this machine.
fn connect_from(from: std::net::Ipv4Addr, to: std::net::SocketAddr) -> std::net::TcpStream {
    use rustix::net::{AddressFamily, SocketAddrV4, SocketType, bind, connect, socket};
    let socket = socket(AddressFamily::INET, SocketType::STREAM, None).unwrap();
    bind(&socket, &SocketAddrV4::new(from, 0)).unwrap();
    connect(&socket, &to).unwrap();
    socket.into()
}

#[test]
fn what_is_answered_before_its_body_is_read_is_answered_whole() {
    let hall = Hall::open();
    let body = "x".repeat(40_000);
    let to = hall.port();
    let stop = Request::new("POST", "/api/v1/show/stop").token("guest-token").body(body.clone());
    let go = Request::new("POST", "/api/v1/show/go").token("tablet-token").header("Idempotency-Key", "a");
    let go = go.sent_ago(0);
    assert_eq!(go.clone().json("{}").send(&to).status, 200);
    let another = go.body(body.clone()); // with a key that was used
    let stranger = Request::new("POST", "/api/v1/show/go").body(body);
    for (request, status) in [(stop, 200), (another, 400), (stranger, 401)] {
        let bytes = request.bytes(&to);
        let head = bytes.windows(4).position(|four| four == b"\r\n\r\n").unwrap() + 4;
        let mut connection = std::net::TcpStream::connect(hall.address()).unwrap();
        connection.write_all(&bytes[..head]).unwrap();
        // Who answers at once has done so now, and closed: what comes behind it would reset the connection.
        connection.set_read_timeout(Some(std::time::Duration::from_millis(50))).unwrap();
        let mut reply = Vec::new();
        connection.read_to_end(&mut reply).expect_err("the other end still listens");
        connection.write_all(&bytes[head..]).unwrap();
        connection.set_read_timeout(None).unwrap();
        connection.read_to_end(&mut reply).expect("an answer, and no reset");
        let reply = String::from_utf8(reply).unwrap();
        assert!(reply.starts_with(&format!("HTTP/1.1 {status}")), "{reply}");
    }
}

#[test]
fn a_stop_whose_body_never_comes_is_a_stop() {
    let hall = Hall::open();
    let mut connection = hall.port().connect();
    let head = "POST /api/v1/show/stop HTTP/1.1\r\nHost: HOST\r\nAuthorization: Bearer guest-token\r\n\
                Connection: close\r\nContent-Length: 900\r\n\r\n";
    connection.write_all(head.replace("HOST", &hall.address().to_string()).as_bytes()).unwrap();
    assert_eq!(Reply::read(&mut *connection).state(), "stopping");
    assert!(hall.desk.take_stop());
}
