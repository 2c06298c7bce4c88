//! A controller that speaks as the IMAX manual prints: registers of 32 bits, no frame number in motion.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use kinocue::wire::{Message, ReadRequest};

/// It answers reads as long as the test runs, and counts what would move its seat.
pub(crate) struct PrintedImax {
    pub(crate) address: String,
    frames: Arc<AtomicUsize>,
    reads: Arc<AtomicUsize>,
}

impl PrintedImax {
    pub(crate) fn start() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        socket.set_read_timeout(Some(Duration::from_secs(60))).expect("it is longer than nothing");
        let address = socket.local_addr().expect("it is bound").to_string();
        let (frames, reads) = (Arc::<AtomicUsize>::default(), Arc::<AtomicUsize>::default());
        let seen = (Arc::clone(&frames), Arc::clone(&reads));
        std::thread::spawn(move || {
            let mut bytes = [0; 2048];
            while let Ok((len, from)) = socket.recv_from(&mut bytes) {
                if let Ok(read) = ReadRequest::parse(&bytes[..len]) {
                    seen.1.fetch_add(1, Ordering::Relaxed);
                    let mut answer = bytes[..16].to_vec();
                    answer[5] = 2;
                    answer[8..12].fill(0);
                    answer.resize(16 + 4 * usize::from(read.num), 0);
                    let _ = socket.send_to(&answer, from); // who is gone is gone
                } else if matches!(Message::parse(&bytes[..len]), Ok(Message::Motion(_) | Message::Write(_)))
                {
                    seen.0.fetch_add(1, Ordering::Relaxed);
                }
            }
        });
        Self { address, frames, reads }
    }

    /// Motion frames and writes that reached it.
    pub(crate) fn frames(&self) -> usize {
        self.frames.load(Ordering::Relaxed)
    }

    /// Reads that it answered.
    pub(crate) fn reads(&self) -> usize {
        self.reads.load(Ordering::Relaxed)
    }
}
