//! The tick thread's end: copies what leaves into a ring, and waits for nobody.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};

use super::chunk::{ChunkWriter, Handed};
use super::{Asked, RecordedSeat, TickHead};
use crate::net::Delivery;
use crate::time::{MonoTime, Rate};

/// Seconds of ticks that the ring holds: a disk may take so long.
const HELD_S: f64 = 2.0;

/// Octets of a frame and its reply in columns beside positions: instants, latency, what was held back.
const OTHERS: usize = 8;
/// Octets of a sample of a seat.
const SAMPLE: u64 = 400;

/// Copies what leaves. Never waits, never allocates: a tick that finds no room is lost as a whole, and the next says so.
#[derive(Debug)]
pub struct Tap {
    ring: Producer<u8>,
    chunk: ChunkWriter,
    asked: Asked,
    /// Ticks lost since the last that found room.
    dropped: u32,
    at_end: DroppedAtEnd,
}

/// What was lost since the last that found room, once a thread has let go of its tap: no chunk says so any more.
#[derive(Debug, Clone, Default)]
pub(super) struct DroppedAtEnd(Arc<AtomicU32>);

impl DroppedAtEnd {
    /// A tap is let go.
    pub(super) fn put(&self, dropped: u32) {
        self.0.store(dropped, Ordering::Release);
    }

    /// How much there is, once.
    pub(super) fn take(&self) -> u32 {
        self.0.swap(0, Ordering::Acquire)
    }
}

impl Drop for Tap {
    fn drop(&mut self) {
        self.at_end.put(self.dropped);
    }
}

/// A tap of the lanes of these seats, in their order, and the end from which its chunks are read.
#[must_use]
pub fn tap(seats: &[RecordedSeat], rate: Rate) -> (Tap, Consumer<u8>) {
    let frames = seats.iter().map(RecordedSeat::longest_frame).sum();
    let chunk = ChunkWriter::with_room(frames);
    let chunks = (rate.hz() * HELD_S).ceil().max(2.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "two thousand at the most")]
    let (ring, end) = RingBuffer::new(chunk.room() * chunks as usize);
    (Tap { ring, chunk, asked: Asked::NOTHING, dropped: 0, at_end: DroppedAtEnd::default() }, end)
}

/// Octets a second that all of these seats takes in the flight recorder: samples, and columns of ticks and replies, of which a frame
/// takes less than an octet for each slot and [`OTHERS`], whatever moves; poses for links stand there as they are.
pub(crate) fn octets_a_second(seats: &[RecordedSeat], rate: Rate, sample_hz: u32) -> u64 {
    let tick: usize = 64 + seats.iter().map(|seat| seat.in_columns() + OTHERS).sum::<usize>();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a thousand a second")]
    let ticks = rate.hz().ceil() as u64;
    ticks * tick as u64 + SAMPLE * u64::from(sample_hz) * (1 + seats.len() as u64)
}

/// The same of a file: samples are a quarter as long once they are packed, and whole ticks are there only where everything is kept.
pub(crate) fn file_octets_a_second(
    seats: &[RecordedSeat],
    rate: Rate,
    sample_hz: u32,
    keeps_ticks: bool,
) -> u64 {
    let samples = SAMPLE * u64::from(sample_hz) * (1 + seats.len() as u64);
    let ticks = octets_a_second(seats, rate, sample_hz) - samples;
    samples / 4 + if keeps_ticks { ticks } else { 0 }
}

impl Tap {
    /// What is lost at its end.
    pub(super) fn at_end(&self) -> DroppedAtEnd {
        self.at_end.clone()
    }

    /// The next frame comes of that.
    #[inline]
    pub fn asked(&mut self, asked: Asked) {
        self.asked = asked;
    }

    /// That left, or was to.
    #[inline]
    pub fn frame(&mut self, lane: usize, datagram: &[u8], at: MonoTime, delivery: Delivery) {
        self.chunk.put(lane, at, Handed::from(delivery), &self.asked, datagram);
        let Asked { slots, level, clamps, .. } = Asked::NOTHING;
        (self.asked.slots, self.asked.level, self.asked.clamps) = (slots, level, clamps);
    }

    /// A tick is over.
    #[inline]
    pub fn tick(&mut self, head: &TickHead) {
        let chunk = self.chunk.close(head, self.dropped);
        let is_posted = chunk.is_some_and(|chunk| self.ring.push_entire_slice(chunk).is_ok());
        self.dropped = if is_posted { 0 } else { self.dropped.saturating_add(1) };
        self.chunk.clear();
    }
}
