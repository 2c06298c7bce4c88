//! The other end of the rings: ticks and drains as they come, each in the order of its thread, folded into messages.

use rtrb::Consumer;

use super::ack_columns::AckPacker;
use super::block::Block;
use super::margins::Margins;
use super::tap::DroppedAtEnd;
use super::{
    AckChunk, AckRecord, AckTap, Chunk, IncidentCause, Message, RecordedSeat, Sampled, Tap, Watchman,
    ack_tap, tap,
};
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
    /// How often the limiter held a seat back.
    pub(crate) clamps: u64,
    /// Moments that were marked.
    pub(crate) marks: u64,
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
            clamps: self.clamps - before.clamps,
            marks: self.marks - before.marks,
        }
    }

    /// Each by its name in `kinocue.end`.
    pub(crate) fn named(&self) -> [(&'static str, String); 8] {
        let Self { ticks, frames, dropped, acked, refused, dropped_records, clamps, marks } = *self;
        [
            ("ticks", ticks),
            ("frames", frames),
            ("dropped", dropped),
            ("acked", acked),
            ("refused", refused),
            ("dropped_records", dropped_records),
            ("clamps", clamps),
            ("marks", marks),
        ]
        .map(|(name, count)| (name, count.to_string()))
    }
}

/// Both rings, and what is made of them.
#[derive(Debug)]
pub(crate) struct Intake {
    ticks: Consumer<u8>,
    acks: Consumer<u8>,
    /// Ticks and records.
    at_end: [DroppedAtEnd; 2],
    held: Vec<u8>,
    held_acks: Vec<u8>,
    seats: Vec<RecordedSeat>,
    fold: Sampled,
    margins: Margins,
    /// What becomes blocks, where whole ticks are kept.
    whole: Option<Whole>,
    counts: Counts,
    watchman: Watchman,
    found: Vec<(IncidentCause, MonoTime)>,
}

/// Ticks and drains of the half second that is not over.
#[derive(Debug, Default)]
struct Whole {
    ticks: Block,
    drains: Vec<u8>,
    packer: AckPacker,
    /// When the last tick was due.
    last: MonoTime,
}

impl Intake {
    /// Taps of the lanes of these seats, in their order, and what takes from them and makes so many samples a second.
    pub(crate) fn new(seats: Vec<RecordedSeat>, rate: Rate, sample_hz: u32) -> (Taps, Self) {
        let watchman = Watchman::new(seats.len(), rate.period());
        let ((ticks, of_ticks), (acks, of_acks)) = (tap(&seats, rate), ack_tap(seats.len(), rate));
        let intake = Self {
            ticks: of_ticks,
            acks: of_acks,
            at_end: [ticks.at_end(), acks.at_end()],
            held: Vec::new(),
            held_acks: Vec::new(),
            margins: Margins::new(&seats, rate),
            fold: Sampled::new(seats.clone(), sample_hz),
            seats,
            whole: None,
            counts: Counts::default(),
            watchman,
            found: Vec::new(),
        };
        (Taps { ticks, acks }, intake)
    }

    /// The same, which tells of every tick and drain beside the samples.
    pub(crate) fn in_full(self) -> Self {
        Self { whole: Some(Whole::default()), ..self }
    }

    /// What it came to so far, each by its name in `kinocue.end`: counts, and as JSON the most that each axis was sent to do.
    pub(crate) fn end(&self) -> Vec<(&'static str, String)> {
        self.end_since(&Counts::default())
    }

    /// The same of a file that was begun later, when so much had come through; the most is of all.
    pub(crate) fn end_since(&self, before: &Counts) -> Vec<(&'static str, String)> {
        let most = serde_json::to_string(&self.margins.most(&self.seats)).unwrap_or_default();
        let counts = self.counts.since(before).named();
        counts.into_iter().chain([("most", most)]).collect()
    }

    /// A moment was marked.
    pub(crate) const fn marked(&mut self) {
        self.counts.marks += 1;
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
        if let Some(whole) = &mut self.whole {
            whole.drains.extend_from_slice(&held_acks);
        }
        while let Some((chunk, behind)) = Chunk::parse(rest) {
            rest = behind;
            self.take_acks(&mut drains, Some(chunk.head.deadline));
            self.take_tick(&chunk, tell);
        }
        self.take_acks(&mut drains, None);
        (self.held, self.held_acks) = (held, held_acks);
        self.take_end();
    }

    /// Counts what was lost last, where its thread has let go of its end.
    fn take_end(&mut self) {
        let [ticks, records] = [0, 1].map(|end: usize| self.at_end[end].take());
        self.counts.dropped += u64::from(ticks);
        self.counts.dropped_records += u64::from(records);
        self.fold.lose(ticks);
    }

    fn take_tick(&mut self, chunk: &Chunk<'_>, tell: &mut impl FnMut(MonoTime, Message)) {
        let Self { seats, fold, margins, whole, counts, watchman, found, .. } = self;
        let head = &chunk.head;
        let mut find = |cause, at| found.push((cause, at));
        counts.ticks += 1;
        counts.dropped += u64::from(chunk.dropped);
        watchman.begin(head, &mut find);
        margins.begin(chunk);
        fold.begin(chunk, tell);
        if let Some(whole) = whole {
            let block = whole.ticks.begin(chunk, seats.len());
            // As of its last tick: by then its samples are told.
            let last = std::mem::replace(&mut whole.last, head.deadline);
            block.into_iter().for_each(|(_, block)| whole.tell(last, block, tell));
        }
        for frame in chunk.frames() {
            counts.frames += 1;
            counts.clamps += watchman.frame(head, &frame, &mut find);
            let Some(seat) = seats.get(frame.lane) else { continue };
            let read = seat.read(frame);
            margins.frame(head, &read, seat, &mut |_, _, _| ());
            fold.frame(head, &read);
            if let Some(whole) = whole {
                whole.ticks.frame(&read, seat);
            }
        }
    }

    /// Takes the drains up to an instant, or all.
    fn take_acks(&mut self, drains: &mut &[u8], until: Option<MonoTime>) {
        let Self { fold, counts, watchman, found, .. } = self;
        while let Some((chunk, behind)) = AckChunk::parse(drains) {
            if chunk.drained.zip(until).is_some_and(|(drained, until)| drained > until) {
                return;
            }
            *drains = behind;
            counts.dropped_records += u64::from(chunk.dropped);
            let at = chunk.drained.unwrap_or_default();
            for record in chunk.records() {
                match record {
                    AckRecord::Fate(_, _, Fate::Answered(ReplyCode::Running), _) => counts.acked += 1,
                    AckRecord::Fate(_, _, Fate::Answered(_), _) => counts.refused += 1,
                    _ => {}
                }
                watchman.ack(at, &record, &mut |cause, at| found.push((cause, at)));
                fold.ack(&record);
            }
        }
    }

    /// Tells of what is not over, so that a file that ends here has all that was counted.
    pub(crate) fn close(&mut self, tell: &mut impl FnMut(MonoTime, Message)) {
        self.fold.close(tell);
        let Some(whole) = &mut self.whole else { return };
        if let Some((_, block)) = whole.ticks.close() {
            whole.tell(whole.last, block, tell);
        }
        // Replies come after the last tick as well.
        whole.tell_drains(whole.last, tell);
    }
}

impl Whole {
    /// Tells of a block whose last tick was then, and of the drains so far.
    fn tell(&mut self, at: MonoTime, block: Vec<u8>, tell: &mut impl FnMut(MonoTime, Message)) {
        tell(at, Message::Ticks(block));
        self.tell_drains(at, tell);
    }

    fn tell_drains(&mut self, at: MonoTime, tell: &mut impl FnMut(MonoTime, Message)) {
        if !self.drains.is_empty() {
            tell(at, Message::Drains(self.packer.pack(&self.drains)));
            self.drains.clear();
        }
    }
}

/// All that is in a ring. Chunks are pushed whole, so whole ones are there.
fn empty(ring: &mut Consumer<u8>, held: &mut Vec<u8>) {
    held.resize(ring.slots(), 0);
    ring.pop_entire_slice(held).unwrap_or_default();
}
