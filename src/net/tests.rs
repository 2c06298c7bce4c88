//! The sockets over loopback, with free ports. Nothing waits for a length of time: a peer blocks on its socket, and a
//! drain is repeated until what must come has come.

use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use socket2::{Domain, Socket, Type};

use super::*;
use crate::sys::clock::Monotonic;
use crate::time::Clock;

const LOOPBACK: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);

/// Far longer than anything on loopback takes.
const PATIENCE: Duration = Duration::from_secs(10);

fn peer() -> (UdpSocket, SocketAddrV4) {
    let socket = UdpSocket::bind(LOOPBACK).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let address = v4(socket.local_addr().unwrap());
    (socket, address)
}

fn v4(address: SocketAddr) -> SocketAddrV4 {
    let SocketAddr::V4(address) = address else { panic!("{address} is not IPv4") };
    address
}

/// An address where nothing listens: that of a socket just closed, on a host that no other test uses.
fn closed_port() -> SocketAddrV4 {
    v4(UdpSocket::bind("127.0.0.2:0").unwrap().local_addr().unwrap())
}

fn take(peer: &UdpSocket) -> Vec<u8> {
    let mut buffer = [0; 100];
    let len = peer.recv(&mut buffer).unwrap();
    buffer[..len].to_vec()
}

/// Drains until `count` datagrams have come.
fn collect(receiver: &mut Receiver, count: usize) -> Vec<(Origin, Vec<u8>, MonoTime)> {
    let (mut got, start) = (Vec::new(), Monotonic.now());
    while got.len() < count {
        assert!(Monotonic.now().since(start) < PATIENCE, "{} of {count} came", got.len());
        receiver.drain(|origin, bytes, at| got.push((origin, bytes.to_vec(), at)));
    }
    got
}

/// Binds as another program that wants to share the port would.
fn bind_shared(address: SocketAddrV4) -> std::io::Result<()> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, None)?;
    socket.set_reuse_address(true)?;
    socket.bind(&address.into())
}

#[test]
fn a_second_program_cannot_have_the_port_not_even_by_sharing_it() {
    let ((_a, a), (_b, b)) = (peer(), peer());
    let ports = Ports::open(LOOPBACK, &[a, b]).unwrap();
    assert_ne!(ports.local().port(), 0);
    let error = Ports::open(ports.local(), &[a]).unwrap_err();
    let NetError::Refused { address, ref cause, .. } = error else { panic!("{error}") };
    assert_eq!((address, cause.kind()), (ports.local(), std::io::ErrorKind::AddrInUse));
    assert!(error.to_string().contains("second kinocue"), "{error}");
    let (_sender, _receiver) = ports.split();
    assert!(bind_shared(address).is_err());
    let any = SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, address.port());
    assert!(bind_shared(any).is_err());
}

#[test]
fn the_port_is_free_again_once_both_halves_are_gone() {
    let (_peer, address) = peer();
    let ports = Ports::open(LOOPBACK, &[address]).unwrap();
    let local = ports.local();
    let (sender, receiver) = ports.split();
    drop(sender);
    assert!(Ports::open(local, &[address]).is_err());
    drop(receiver);
    Ports::open(local, &[address]).unwrap();
}

#[test]
fn peers_that_cannot_have_a_socket_of_their_own_are_refused() {
    let open = |peers: &[&str]| {
        let peers: Vec<SocketAddrV4> = peers.iter().map(|peer| peer.parse().unwrap()).collect();
        Ports::open(LOOPBACK, &peers).unwrap_err()
    };
    assert!(matches!(open(&["127.0.0.1:7408", "127.0.0.1:7409", "127.0.0.1:7408"]), NetError::Twice(_)));
    for odd in ["255.255.255.255:7408", "224.0.0.1:7408", "0.0.0.0:7408", "127.0.0.1:0"] {
        assert!(matches!(open(&[odd]), NetError::NotUnicast(_)), "{odd}");
    }
}

#[test]
fn each_reply_comes_from_its_own_controller_and_anyone_else_is_a_stranger() {
    let ((a, a_address), (b, b_address), (stranger, stranger_address)) = (peer(), peer(), peer());
    let ports = Ports::open(SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 0), &[a_address, b_address]).unwrap();
    let local = SocketAddrV4::new(Ipv4Addr::LOCALHOST, ports.local().port());
    let (sender, mut receiver) = ports.split();

    let start = Monotonic.now();
    assert_eq!(sender.send(0, b"to a"), Delivery::Sent);
    assert_eq!(sender.send(1, b"to b"), Delivery::Sent);
    assert_eq!((take(&a), take(&b)), (b"to a".to_vec(), b"to b".to_vec()));
    for (socket, bytes) in [(&b, b"from b"), (&stranger, b"no one"), (&a, b"from a")] {
        socket.send_to(bytes, local).unwrap();
    }
    let mut got = collect(&mut receiver, 3);
    let now = Monotonic.now();
    got.sort_by_key(|(_, bytes, _)| bytes.clone());
    let of = |index: usize| (got[index].0, got[index].1.as_slice());
    assert_eq!(of(0), (Origin::Controller(0), &b"from a"[..]));
    assert_eq!(of(1), (Origin::Controller(1), &b"from b"[..]));
    assert_eq!(of(2), (Origin::Stranger(stranger_address), &b"no one"[..]));
    for (_, _, at) in got {
        assert!(start <= at && at <= now, "{start:?} {at:?} {now:?}");
    }
}

#[test]
fn what_a_stranger_sends_while_the_sockets_open_is_never_taken_for_a_reply() {
    // A host that no other test uses, so that the port stays free from one opening to the next.
    let host = SocketAddrV4::new(Ipv4Addr::new(127, 0, 0, 3), 0);
    let peers: Vec<_> = (0..8).map(|_| peer()).collect();
    let addresses: Vec<_> = peers.iter().map(|&(_, address)| address).collect();
    let local = Ports::open(host, &addresses).unwrap().local();

    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let (stranger, _) = peer();
            let sends = (0..1_000_000).take_while(|_| !done.load(Ordering::Relaxed));
            sends.for_each(|_| drop(stranger.send_to(b"forged", local)));
        });
        let (start, mut openings) = (Monotonic.now(), 0);
        while openings < 30 && Monotonic.now().since(start) < PATIENCE {
            let (_sender, mut receiver) = Ports::open(local, &addresses).unwrap().split();
            let mut strangers = 0;
            receiver.drain(|origin, _, _| {
                assert!(matches!(origin, Origin::Stranger(_)), "{origin:?}");
                strangers += 1;
            });
            openings += strangers.min(1); // only those that met the stranger
        }
        done.store(true, Ordering::Relaxed);
    });
}

#[test]
fn a_closed_port_costs_the_others_nothing_and_itself_nothing_once_it_opens() {
    const FRAMES: u32 = 100; // twice that fits into a peer's receive buffer
    let live: Vec<_> = (0..3).map(|_| peer()).collect();
    let dead = closed_port();
    let peers = [live[0].1, dead, live[1].1, live[2].1];
    let (sender, mut receiver) = Ports::open(LOOPBACK, &peers).unwrap().split();
    let send_all = |frame: u32, receiver: &mut Receiver| {
        for lane in 0..peers.len() {
            let delivery = sender.send(lane, &frame.to_be_bytes());
            assert!(!matches!(delivery, Delivery::Failed(_)), "{lane} {delivery:?}");
        }
        if frame.is_multiple_of(5) {
            receiver.drain(|origin, _, _| panic!("nothing was sent by {origin:?}"));
        }
    };

    for frame in 0..FRAMES {
        send_all(frame, &mut receiver);
    }
    let opened = UdpSocket::bind(dead).unwrap();
    opened.set_read_timeout(Some(PATIENCE)).unwrap();
    let before = receiver.port_closed(1);
    for frame in FRAMES..2 * FRAMES {
        send_all(frame, &mut receiver);
    }
    for (peer, _) in &live {
        for frame in 0..2 * FRAMES {
            assert_eq!(take(peer), frame.to_be_bytes());
        }
    }
    for frame in FRAMES..2 * FRAMES {
        assert_eq!(take(&opened), frame.to_be_bytes());
    }
    // The last frame to the closed port may still have been on its way back.
    assert!(receiver.port_closed(1) - before <= 1);
    assert_eq!([0, 2, 3].map(|lane| receiver.port_closed(lane)), [0; 3]);
}

// The kernel sends only so many refusals a second, to all tests together: one datagram need not bring one.
#[test]
fn a_refusal_is_read_by_a_drain_and_counted_once() {
    let (sender, mut receiver) = Ports::open(LOOPBACK, &[closed_port()]).unwrap().split();
    let start = Monotonic.now();
    while receiver.port_closed(0) == 0 {
        assert!(Monotonic.now().since(start) < PATIENCE);
        assert_eq!(sender.send(0, b"x"), Delivery::Sent);
        receiver.drain(|_, _, _| ());
    }
    receiver.drain(|_, _, _| ());
    assert_eq!((receiver.port_closed(0), sender.send(0, b"x")), (1, Delivery::Sent));
}

#[test]
fn a_datagram_that_meets_the_refusal_of_an_earlier_one_is_sent_once_more() {
    let (sender, receiver) = Ports::open(LOOPBACK, &[closed_port()]).unwrap().split();
    let start = Monotonic.now();
    let mut delivery = Delivery::Sent;
    while delivery == Delivery::Sent {
        assert!(Monotonic.now().since(start) < PATIENCE);
        delivery = sender.send(0, b"x");
    }
    assert_eq!((delivery, receiver.port_closed(0)), (Delivery::SentAfterRefusal, 1));
}

#[test]
fn a_send_that_fails_says_why_and_what_to_do() {
    let (_peer, address) = peer();
    let (sender, _receiver) = Ports::open(LOOPBACK, &[address]).unwrap().split();
    // More than a UDP datagram can hold.
    let Delivery::Failed(fault) = sender.send(0, &[0; 70_000]) else { panic!("it was sent") };
    assert_eq!((fault.errno(), fault.refused()), (libc::EMSGSIZE, false));
    assert!(fault.to_string().contains("too long"), "{fault}");
}

#[test]
fn one_datagram_reaches_all_of_a_network_from_where_its_controllers_answer_to_and_a_way_elsewhere_is_refused()
{
    let any = UdpSocket::bind("0.0.0.0:0").unwrap();
    any.set_read_timeout(Some(PATIENCE)).unwrap();
    let port = any.local_addr().unwrap().port();
    let at = |ip: [u8; 4]| SocketAddrV4::new(ip.into(), port);
    let whole = |address, bits| Whole { address, bits, lanes: vec![0] };
    let open = |peer, whole: Whole| Ports::open_with(LOOPBACK, &[peer], Some(&whole), false);
    let all = at([127, 255, 255, 255]);
    let (sender, receiver) = {
        let ports = open(at([127, 0, 0, 2]), whole(all, 8)).unwrap();
        assert!(bind_shared(ports.local()).is_err(), "nobody else can have the port");
        ports.split()
    };
    assert_eq!(sender.send_to_all(b"all"), Delivery::Sent);
    let mut buffer = [0; 10];
    let (len, from) = any.recv_from(&mut buffer).unwrap();
    assert_eq!((&buffer[..len], *v4(from).ip()), (&b"all"[..], *LOOPBACK.ip()));
    assert_eq!(receiver.lanes(), 1);

    for (peer, address, bits) in [([127, 0, 0, 2], all, 24), ([127, 0, 0, 1], all, 8)] {
        let refused = open(at(peer), whole(address, bits)).unwrap_err();
        assert!(
            matches!(refused, NetError::OffTheWire { controller, .. } if controller == at(peer)),
            "{refused}"
        );
    }
    let refused = open(at([127, 0, 0, 2]), whole(at([127, 0, 0, 255]), 24)).unwrap_err();
    assert!(matches!(refused, NetError::NoBroadcast(_)), "{refused}");

    let lead = std::sync::Arc::new(Lead::default());
    let led = sender.led_by(Some(lead));
    assert_eq!(led.send_to_all(b"no"), Delivery::Failed(SendFault::NOT_LEADING));
}
