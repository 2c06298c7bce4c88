//! Which of many sockets have something to read: asked of the kernel in one call, where one for each socket would find most of them empty.
//! Ack thread; allocates nothing once it is made.

use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};

use rustix::event::Timespec;
use rustix::event::epoll::{self, CreateFlags, Event, EventData, EventFlags};

/// So many are told of in one call. On the stack, as what the kernel writes may not go from thread to thread.
const TOLD: usize = 512;

/// The sockets, by their places among them.
#[derive(Debug)]
pub(super) struct Ready {
    epoll: OwnedFd,
    /// Which of them were found so last.
    found: Box<[bool]>,
}

impl Ready {
    /// Of sockets that live as long as it is asked.
    ///
    /// # Errors
    /// Where the system gives no descriptor for it.
    pub(super) fn of<S: AsFd>(sockets: impl Iterator<Item = S>) -> io::Result<Self> {
        let epoll = epoll::create(CreateFlags::CLOEXEC)?;
        let mut found = Vec::new();
        for (place, socket) in (0..).zip(sockets) {
            epoll::add(&epoll, socket, EventData::new_u64(place), EventFlags::IN)?;
            found.push(false);
        }
        Ok(Self { epoll, found: found.into() })
    }

    /// Looks which are: those with a datagram, or with an error of an earlier one.
    pub(super) fn look(&mut self) {
        self.found.fill(false);
        // The kernel puts those that it has told of behind the others.
        for _ in 0..self.found.len().div_ceil(TOLD) {
            let mut room = [const { MaybeUninit::<Event>::uninit() }; TOLD];
            let Ok((events, left)) = epoll::wait(&self.epoll, &mut room[..], Some(&Timespec::default()))
            else {
                self.found.fill(true); // where the kernel does not say, each is read
                return;
            };
            for event in &*events {
                let place = usize::try_from(event.data.u64()).ok();
                place.and_then(|place| self.found.get_mut(place)).into_iter().for_each(|found| *found = true);
            }
            if !left.is_empty() {
                return;
            }
        }
    }

    /// Whether the socket at that place was.
    pub(super) fn is(&self, place: usize) -> bool {
        self.found[place]
    }
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;

    use super::*;

    #[test]
    fn a_socket_is_ready_with_a_datagram_or_the_error_of_an_earlier_one_and_no_more_once_it_is_read() {
        let sockets = [(); 3].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
        let mut ready = Ready::of(sockets.iter()).unwrap();
        let mut looked = || {
            ready.look();
            [0, 1, 2].map(|place| ready.is(place))
        };
        assert_eq!(looked(), [false; 3]);
        sockets[0].send_to(b"x", sockets[2].local_addr().unwrap()).unwrap();
        assert_eq!(looked(), [false, false, true]);
        assert_eq!(looked(), [false, false, true], "it was not read");
        sockets[2].recv(&mut [0; 1]).unwrap();
        let closed = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        sockets[1].connect(closed).unwrap();
        sockets[1].send(b"x").unwrap();
        assert_eq!(looked(), [false, true, false]);
        sockets[1].recv(&mut [0; 1]).unwrap_err();
        assert_eq!(looked(), [false; 3]);
    }
}
