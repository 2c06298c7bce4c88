//! The other end of the rings: ticks and drains as they come, each in the order of its thread, folded into messages.

use std::time::Duration;

use rtrb::Consumer;

use super::{
    AckChunk, AckRecord, AckTap, Chunk, IncidentCause, Message, RecordedSeat, Sampled, Tap, Watchman,
    ack_tap, tap,
};
use crate::time::{MonoTime, Rate};
use crate::tracker::Fate;
use crate::wire::ReplyCode;

/// How much of every tick and of every reply makes a message.
const BLOCK: Duration = Duration::from_millis(500);

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
    /// What came since.
    pub(crate) const fn since(&self, before: &Self) -> Self {
        Self {
            ticks: self.ticks - before.ticks,
            frames: self.frames - before.frames,
            dropped: self.dropped - before.dropped,
            acked: self.acked - before.acked,
            refused: self.refused - before.refused,
            dropped_records: self.dropped_records - before.dropped_records,
        }
    }

    /// Each by its name in `kinocue.end`.
    pub(crate) fn named(&self) -> [(&'static str, String); 6] {
        let Self { ticks, frames, dropped, acked, refused, dropped_records } = *self;
        [
            ("ticks", ticks),
            ("frames", frames),
            ("dropped", dropped),
            ("acked", acked),
            ("refused", refused),
            ("dropped_records", dropped_records),
        ]
        .map(|(name, count)| (name, count.to_string()))
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
    /// What is collected of every tick and of every reply, and since when, where that is wanted.
    full: Option<[(MonoTime, Vec<u8>); 2]>,
    watchman: Watchman,
    found: Vec<(IncidentCause, MonoTime)>,
}

impl Intake {
    /// Taps of the lanes of these seats, in their order, and what takes from them and makes so many samples a second.
    pub(crate) fn new(seats: Vec<RecordedSeat>, rate: Rate, sample_hz: u32) -> (Taps, Self) {
        let watchman = Watchman::new(seats.len(), rate.period());
        let ((ticks, of_ticks), (acks, of_acks)) = (tap(&seats, rate), ack_tap(seats.len(), rate));
        let intake = Self {
            ticks: of_ticks,
            acks: of_acks,
            held: Vec::new(),
            held_acks: Vec::new(),
            fold: Sampled::new(seats, sample_hz),
            counts: Counts::default(),
            full: None,
            watchman,
            found: Vec::new(),
        };
        (Taps { ticks, acks }, intake)
    }

    /// The same that tells of every tick and of every reply as well.
    pub(crate) fn in_full(self) -> Self {
        Self { full: Some(Default::default()), ..self }
    }

    /// What was found since it was asked last that is worth an incident.
    pub(crate) fn take_found(&mut self) -> Vec<(IncidentCause, MonoTime)> {
        std::mem::take(&mut self.found)
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
        let (mut held, mut held_acks) = (std::mem::take(&mut self.held), std::mem::take(&mut self.held_acks));
        empty(&mut self.acks, &mut held_acks);
        empty(&mut self.ticks, &mut held);
        let (mut drains, mut rest) = (held_acks.as_slice(), held.as_slice());
        while let Some((chunk, behind)) = Chunk::parse(rest) {
            let octets = &rest[..rest.len() - behind.len()];
            rest = behind;
            self.take_acks(&mut drains, Some(chunk.head.deadline), tell);
            let Self { fold, counts, full, watchman, found, .. } = self;
            counts.ticks += 1;
            counts.dropped += u64::from(chunk.dropped);
            counts.frames += chunk.frames().count() as u64;
            watchman.look(&chunk, &mut |cause, at| found.push((cause, at)));
            fold.take(&chunk, tell);
            if let Some(full) = full {
                collect(full, 0, chunk.head.deadline, octets, tell);
            }
        }
        self.take_acks(&mut drains, None, tell);
        (self.held, self.held_acks) = (held, held_acks);
    }

    /// Takes the drains up to an instant, or all.
    fn take_acks(
        &mut self,
        drains: &mut &[u8],
        until: Option<MonoTime>,
        tell: &mut impl FnMut(MonoTime, Message),
    ) {
        let Self { fold, counts, full, watchman, found, .. } = self;
        while let Some((chunk, behind)) = AckChunk::parse(drains) {
            if chunk.drained.zip(until).is_some_and(|(drained, until)| drained > until) {
                return;
            }
            let octets = &drains[..drains.len() - behind.len()];
            *drains = behind;
            counts.dropped_records += u64::from(chunk.dropped);
            for record in chunk.records() {
                match record {
                    AckRecord::Fate(_, _, Fate::Answered(ReplyCode::Running), _) => counts.acked += 1,
                    AckRecord::Fate(_, _, Fate::Answered(_), _) => counts.refused += 1,
                    _ => {}
                }
            }
            watchman.look_at_acks(&chunk, &mut |cause, at| found.push((cause, at)));
            fold.take_acks(&chunk);
            if let (Some(full), Some(at)) = (full.as_mut(), chunk.drained.or(until)) {
                collect(full, 1, at, octets, tell);
            }
        }
    }

    /// Tells of what is not over.
    pub(crate) fn close(&mut self, tell: &mut impl FnMut(MonoTime, Message)) {
        self.fold.close(tell);
        for (topic, (since, octets)) in self.full.iter_mut().flatten().enumerate() {
            if !octets.is_empty() {
                tell(*since, Message::Full(topic, std::mem::take(octets)));
            }
        }
    }
}

/// Adds octets to those of a topic, and tells of these once they are of half a second.
fn collect(
    full: &mut [(MonoTime, Vec<u8>); 2],
    topic: usize,
    at: MonoTime,
    octets: &[u8],
    tell: &mut impl FnMut(MonoTime, Message),
) {
    let (since, held) = &mut full[topic];
    if !held.is_empty() && at.since(*since) >= BLOCK {
        tell(*since, Message::Full(topic, std::mem::take(held)));
    }
    if held.is_empty() {
        *since = at;
    }
    held.extend_from_slice(octets);
}

/// All that is in a ring. Chunks are pushed whole, so whole ones are there.
fn empty(ring: &mut Consumer<u8>, held: &mut Vec<u8>) {
    held.resize(ring.slots(), 0);
    ring.pop_entire_slice(held).unwrap_or_default();
}
