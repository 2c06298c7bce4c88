//! A way to the engine that is cut again and again: each connection carries so many bytes, and then no more.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

/// Such a way.
pub(crate) struct CutWay {
    address: String,
    counts: Arc<Counts>,
}

struct Counts {
    /// Bytes that each connection carries, there and back.
    each: AtomicU64,
    /// Bytes that all of them carry together, before the way is closed.
    most: AtomicU64,
    /// Bytes so far.
    all: AtomicU64,
    /// Connections that were cut.
    cuts: AtomicU64,
}

impl CutWay {
    /// To that address.
    pub(crate) fn to(engine: &str, each: u64) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let counts = Counts { each: each.into(), most: u64::MAX.into(), all: 0.into(), cuts: 0.into() };
        let (engine, counts) = (engine.to_owned(), Arc::new(counts));
        let of_thread = Arc::clone(&counts);
        thread::spawn(move || {
            for member in listener.incoming().map_while(Result::ok) {
                if of_thread.is_open()
                    && let Ok(engine) = TcpStream::connect(&engine)
                {
                    let left = Arc::new(AtomicU64::new(of_thread.each.load(Ordering::Relaxed)));
                    for (from, to) in [(&member, &engine), (&engine, &member)] {
                        let (from, to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                        let (left, counts) = (Arc::clone(&left), Arc::clone(&of_thread));
                        thread::spawn(move || carry(from, to, &left, &counts));
                    }
                }
            }
        });
        Self { address, counts }
    }

    pub(crate) fn address(&self) -> &str {
        &self.address
    }

    /// Is closed once so many bytes went by in all.
    pub(crate) fn ends_at(&self, bytes: u64) {
        self.counts.most.store(bytes, Ordering::Relaxed);
    }

    /// Bytes that went by.
    pub(crate) fn bytes(&self) -> u64 {
        self.counts.all.load(Ordering::Relaxed)
    }

    /// How often it was cut.
    pub(crate) fn cuts(&self) -> u64 {
        self.counts.cuts.load(Ordering::Relaxed)
    }
}

impl Counts {
    fn is_open(&self) -> bool {
        self.all.load(Ordering::Relaxed) < self.most.load(Ordering::Relaxed)
    }
}

fn carry(mut from: TcpStream, mut to: TcpStream, left: &AtomicU64, counts: &Counts) {
    let mut bytes = [0; 8192];
    while let Ok(length @ 1..) = from.read(&mut bytes) {
        let length = length as u64;
        counts.all.fetch_add(length, Ordering::Relaxed);
        let taken = left.fetch_update(Ordering::AcqRel, Ordering::Acquire, |left| left.checked_sub(length));
        if taken.is_err() || !counts.is_open() {
            counts.cuts.fetch_add(1, Ordering::Relaxed);
            break;
        }
        if to.write_all(&bytes[..usize::try_from(length).unwrap()]).is_err() {
            break;
        }
    }
    for end in [from, to] {
        let _ = end.shutdown(Shutdown::Both); // it may be gone
    }
}
