//! The other end of the rings: ticks and drains as they come, each in the order of its thread, folded into messages.

use rtrb::Consumer;

use super::{AckChunk, AckRecord, AckTap, Chunk, Message, RecordedSeat, Sampled, Tap, ack_tap, tap};
use crate::time::{MonoTime, Rate};
use crate::tracker::Fate;
use crate::wire::ReplyCode;

/// The ends of both rings that threads of a runtime have.
#[derive(Debug)]
pub(crate) struct Taps {
    /// The tick thread's.
    pub(crate) ticks: Tap,
    /// The ack thread's.
    pub(crate) acks: AckTap,
}

/// What came through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Counts {
    /// Ticks.
    pub(crate) ticks: u64,
    /// Frames in them.
    pub(crate) frames: u64,
    /// Ticks that found no room.
    pub(crate) dropped: u64,
    /// Frames that were acked.
    pub(crate) acked: u64,
    /// Frames that were refused.
    pub(crate) refused: u64,
    /// Records of the ack thread that found no room.
    pub(crate) dropped_records: u64,
}

impl Counts {
    /// Each by its name in `kinocue.end`.
    pub(crate) const fn named(&self) -> [(&'static str, u64); 6] {
        let Self { ticks, frames, dropped, acked, refused, dropped_records } = *self;
        [
            ("ticks", ticks),
            ("frames", frames),
            ("dropped", dropped),
            ("acked", acked),
            ("refused", refused),
            ("dropped_records", dropped_records),
        ]
    }
}

/// Both rings, and what is made of them.
#[derive(Debug)]
pub(crate) struct Intake {
    ticks: Consumer<u8>,
    acks: Consumer<u8>,
    held: Vec<u8>,
    held_acks: Vec<u8>,
    fold: Sampled,
    counts: Counts,
}

impl Intake {
    /// Taps of the lanes of these seats, in their order, and what takes from them and makes so many samples a second.
    pub(crate) fn new(seats: Vec<RecordedSeat>, rate: Rate, sample_hz: u32) -> (Taps, Self) {
        let ((ticks, of_ticks), (acks, of_acks)) = (tap(&seats, rate), ack_tap(seats.len(), rate));
        let intake = Self {
            ticks: of_ticks,
            acks: of_acks,
            held: Vec::new(),
            held_acks: Vec::new(),
            fold: Sampled::new(seats, sample_hz),
            counts: Counts::default(),
        };
        (Taps { ticks, acks }, intake)
    }

    /// True once the threads have let go of their ends. To be asked before they are emptied for the last time.
    pub(crate) fn is_over(&self) -> bool {
        self.ticks.is_abandoned() && self.acks.is_abandoned()
    }

    /// What came through so far.
    pub(crate) const fn counts(&self) -> Counts {
        self.counts
    }

    /// Takes all that is there, and tells of what is over by it.
    pub(crate) fn take(&mut self, tell: &mut impl FnMut(MonoTime, Message)) {
        let Self { ticks, acks, held, held_acks, fold, counts } = self;
        empty(acks, held_acks);
        empty(ticks, held);
        let mut drains = held_acks.as_slice();
        let mut rest = held.as_slice();
        while let Some((chunk, behind)) = Chunk::parse(rest) {
            rest = behind;
            take_acks(&mut drains, Some(chunk.head.deadline), fold, counts);
            counts.ticks += 1;
            counts.dropped += u64::from(chunk.dropped);
            counts.frames += chunk.frames().count() as u64;
            fold.take(&chunk, tell);
        }
        take_acks(&mut drains, None, fold, counts);
    }

    /// Tells of what is not over.
    pub(crate) fn close(&mut self, tell: &mut impl FnMut(MonoTime, Message)) {
        self.fold.close(tell);
    }
}

/// All that is in a ring. Chunks are pushed whole, so whole ones are there.
fn empty(ring: &mut Consumer<u8>, held: &mut Vec<u8>) {
    held.resize(ring.slots(), 0);
    ring.pop_entire_slice(held).unwrap_or_default();
}

/// Takes the drains up to an instant, or all.
fn take_acks(drains: &mut &[u8], until: Option<MonoTime>, fold: &mut Sampled, counts: &mut Counts) {
    while let Some((chunk, behind)) = AckChunk::parse(drains) {
        if chunk.drained.zip(until).is_some_and(|(drained, until)| drained > until) {
            return;
        }
        *drains = behind;
        counts.dropped_records += u64::from(chunk.dropped);
        for record in chunk.records() {
            match record {
                AckRecord::Fate(_, _, Fate::Answered(ReplyCode::Running), _) => counts.acked += 1,
                AckRecord::Fate(_, _, Fate::Answered(_), _) => counts.refused += 1,
                _ => {}
            }
        }
        fold.take_acks(&chunk);
    }
}
