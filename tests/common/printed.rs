//! A controller that speaks as the IMAX manual prints: registers of 32 bits, no frame number in motion.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use kinocue::wire::Message;

/// What reached it.
#[derive(Default)]
struct Counts {
    frames: AtomicUsize,
    writes: AtomicUsize,
    reads: AtomicUsize,
}

/// It answers reads as long as the test runs, and counts what would move its seat.
pub(crate) struct PrintedImax {
    pub(crate) address: String,
    counts: Arc<Counts>,
}

impl PrintedImax {
    pub(crate) fn start() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        socket.set_read_timeout(Some(Duration::from_secs(60))).expect("it is longer than nothing");
        let address = socket.local_addr().expect("it is bound").to_string();
        let counts = Arc::<Counts>::default();
        let seen = Arc::clone(&counts);
        std::thread::spawn(move || {
            let mut bytes = [0; 2048];
            while let Ok((len, from)) = socket.recv_from(&mut bytes) {
                let count = match Message::parse(&bytes[..len]) {
                    Ok(Message::Read(read)) => {
                        let mut answer = bytes[..16].to_vec();
                        answer[5] = 2;
                        answer[8..12].fill(0);
                        answer.resize(16 + 4 * usize::from(read.num), 0);
                        let _ = socket.send_to(&answer, from); // who is gone is gone
                        &seen.reads
                    }
                    Ok(Message::Motion(_)) => &seen.frames,
                    Ok(Message::Write(_)) => &seen.writes,
                    _ => continue,
                };
                count.fetch_add(1, Ordering::Relaxed);
            }
        });
        Self { address, counts }
    }

    /// Motion frames that reached it.
    pub(crate) fn frames(&self) -> usize {
        self.counts.frames.load(Ordering::Relaxed)
    }

    /// Writes that reached it. A hall that has no answer of it yet may switch its outputs off.
    pub(crate) fn writes(&self) -> usize {
        self.counts.writes.load(Ordering::Relaxed)
    }

    /// Reads that it answered.
    pub(crate) fn reads(&self) -> usize {
        self.counts.reads.load(Ordering::Relaxed)
    }
}
