//! Controllers that answer every frame with x = 2, until whoever started them is gone.

use std::io;
use std::net::UdpSocket;

use kinocue::wire::{MAX_LEN, MotionReply, MotionRequest, ReplyCode};
use rustix::buffer::spare_capacity;
use rustix::event::epoll::{self, CreateFlags, Event, EventData, EventFlags};

/// Marks the event that the other end of stdin is closed.
const GONE: u64 = u64::MAX;

/// Answers on `count` ports of loopback, told on stdout, one line for all.
pub(crate) fn run(count: usize) {
    let sockets: Vec<UdpSocket> =
        (0..count).map(|_| UdpSocket::bind("127.0.0.1:0").expect("loopback has a free port")).collect();
    let addresses: Vec<String> =
        sockets.iter().map(|socket| socket.local_addr().expect("it is bound").to_string()).collect();
    let epoll = epoll::create(CreateFlags::CLOEXEC).expect("the system has epoll");
    for (index, socket) in (0..).zip(&sockets) {
        epoll::add(&epoll, socket, EventData::new_u64(index), EventFlags::IN)
            .expect("a socket can be watched");
    }
    epoll::add(&epoll, io::stdin(), EventData::new_u64(GONE), EventFlags::IN).expect("a pipe can be watched");
    println!("{}", addresses.join(" "));

    let mut events: Vec<Event> = Vec::with_capacity(count + 1);
    loop {
        events.clear();
        match epoll::wait(&epoll, spare_capacity(&mut events), None) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => panic!("waiting for frames: {error}"),
        }
        for event in &events {
            let index = event.data.u64();
            if index == GONE {
                return;
            }
            answer(&sockets[usize::try_from(index).expect("an index of the sockets")]);
        }
    }
}

/// Answers one frame; if there are more, the socket stays ready.
fn answer(socket: &UdpSocket) {
    let mut bytes = [0; MAX_LEN];
    // An error is an earlier answer's, to a sender that has ended.
    let Ok((len, from)) = socket.recv_from(&mut bytes) else { return };
    let Ok(frame) = MotionRequest::parse(&bytes[..len]) else { return };
    let MotionRequest { timing, channel, frame, time_ms, positions, extend, vibration, .. } = frame;
    let code = ReplyCode::Running;
    let (error, inputs) = (0, 0);
    let reply =
        MotionReply { timing, code, channel, error, frame, time_ms, positions, inputs, extend, vibration };
    let _ = socket.send_to(reply.emit(&mut [0; MAX_LEN]), from);
}
