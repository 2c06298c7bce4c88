//! Reports that controllers send unasked, over real sockets: from their frame port, from another port of their address,
//! and from strangers.

use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::sync::Arc;

use kinocue::harness::motion::Pulses;
use kinocue::harness::net::Ports;
use kinocue::harness::observe::Watched;
use kinocue::harness::rt::{Accounts, AckLoop, Live, MailEnds, mailboxes};
use kinocue::harness::time::Rate;
use kinocue::wire::{Code, Dialect, MAX_LEN, PerAxis, Status, VibrationPort};

const ANY: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 0);

fn on_loopback(host: u8) -> UdpSocket {
    UdpSocket::bind((Ipv4Addr::new(127, 0, 0, host), 0)).expect("127/8 is this machine's")
}

fn address(socket: &UdpSocket) -> SocketAddrV4 {
    socket.local_addr().expect("it is bound").to_string().parse().expect("it is IPv4")
}

/// A report of the station whose address ends in `host`.
fn report(host: u16, error: u16) -> Vec<u8> {
    let status = Status {
        station: Code(host),
        positions: PerAxis::new(&[Pulses(1_000), Pulses(2_000), Pulses(3_000)]),
        forces: PerAxis::new(&[0; 3]),
        servo_errors: PerAxis::new(&[0; 3]),
        error,
        outputs: 0,
        inputs: 0,
    };
    status.emit(&mut [0; MAX_LEN]).to_vec()
}

/// Opens the frame port towards controllers at 127.0.0.2 and 127.0.0.3, has `send` send to it, and drains it once.
fn heard(send: impl FnOnce([UdpSocket; 2], SocketAddrV4)) -> Accounts {
    let controllers = [2, 3].map(on_loopback);
    let addresses = [0, 1].map(|index: usize| address(&controllers[index]));
    let ports = Ports::open(ANY, &addresses).expect("there is a free port");
    let ours = SocketAddrV4::new(Ipv4Addr::LOCALHOST, ports.local().port());
    let watched = addresses.map(|address| Watched {
        address,
        dialect: Dialect::Smc,
        vibration_port: VibrationPort::Two,
        estop_inputs: 0,
    });
    let (_mail, MailEnds { sent, ticks, .. }) = mailboxes(2, Rate::from_hz(100.0), Arc::new(Live::default()));
    let (_sender, receiver) = ports.split();
    let mut acks = AckLoop::new(receiver, watched.to_vec(), 1, sent, ticks);
    send(controllers, ours);
    // Loopback delivers within the call that sends.
    acks.drain(&mut |_, _| false);
    acks.into_accounts()
}

#[test]
fn a_report_from_the_frame_port_is_its_controllers() {
    let accounts = heard(|[_, second], ours| {
        second.send_to(&report(3, 12), ours).unwrap();
    });
    let states = accounts.observer.states();
    assert_eq!((states[0].reports, states[1].reports, accounts.strangers), (0, 1, 0));
    assert_eq!(states[1].error.unwrap().value, 12);
    assert_eq!(states[1].measured.unwrap().value[..], [Pulses(1_000), Pulses(2_000), Pulses(3_000)]);
    assert_eq!(accounts.books.tracker().counts(1).stray, 0);
}

#[test]
fn a_report_from_another_port_of_its_address_is_its_controllers() {
    let accounts = heard(|_, ours| {
        on_loopback(2).send_to(&report(2, 0), ours).unwrap();
    });
    assert_eq!((accounts.observer.states()[0].reports, accounts.strangers), (1, 0));
}

#[test]
fn a_report_that_gives_another_station_is_nobodys() {
    let accounts = heard(|[first, _], ours| {
        first.send_to(&report(3, 12), ours).unwrap();
        on_loopback(2).send_to(&report(3, 12), ours).unwrap();
        on_loopback(9).send_to(&report(2, 12), ours).unwrap();
    });
    assert!(accounts.observer.states().iter().all(|state| state.reports == 0));
    assert_eq!((accounts.books.tracker().counts(0).stray, accounts.strangers), (1, 2));
}

#[test]
fn a_report_that_is_cut_or_lies_about_its_axes_changes_nothing() {
    let accounts = heard(|[first, _], ours| {
        let whole = report(2, 12);
        first.send_to(&whole[..whole.len() - 1], ours).unwrap();
        let mut lying = whole;
        lying[9] = 12;
        first.send_to(&lying, ours).unwrap();
    });
    assert_eq!(accounts.observer.states()[0].reports, 0);
    assert_eq!(accounts.books.tracker().counts(0).stray, 2);
}
