//! What the ack thread has seen of one lane, as levels that the tick thread reads: nothing of it can be lost in a full mailbox,
//! and nobody waits. One thread writes.

use crate::motion::{MAX_AXES, Pose};
use crate::published::{SharedWord, SharedWords};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// Where a reading comes from; the place of each is its number in [`ReadingWords`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// The position registers DP06 to DP0b and DP21 to DP26 (SMC manual 2.3.3).
    Registers,
    /// A status report, 0x3101 (SMC manual 2.2.2.15).
    Report,
    /// The controller said that it is home: its axes are at 0 (SMC manual 5.7).
    Homing,
    /// Some of the registers, while frames led the seat: it tells whether the seat follows, and not where it is by now.
    Passing,
}

/// Where a seat was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The pose, as fractions of each slot's stroke.
    pub(crate) pose: Pose,
    /// The slots that it tells of, a bit each; what the pose says of the others means nothing.
    pub(crate) slots: u16,
    /// When the oldest part of it was read.
    pub(crate) at: MonoTime,
    /// Whether earlier readings found it in the same place.
    pub(crate) rests: bool,
    /// Whether one found it elsewhere, not long ago.
    pub(crate) moves: bool,
    /// How far from where it was read it may be, strokes, if it has swung about one place for long by no more than what it was told
    /// to vibrate; else 0.
    pub(crate) sways: f64,
    /// Where it comes from.
    pub(crate) by: Source,
}

impl Reading {
    /// A seat that was read at rest, of all of its axes.
    #[must_use]
    pub const fn at_rest(pose: Pose, at: MonoTime) -> Self {
        Self { pose, slots: u16::MAX, at, rests: true, moves: false, sways: 0.0, by: Source::Registers }
    }

    /// True if another tells of a place that is off this one by more than that, strokes, in a slot that both tell of.
    #[must_use]
    pub(crate) fn differs(&self, other: &Self, by: f64) -> bool {
        let both = self.slots & other.slots;
        (self.pose.iter().zip(&other.pose).enumerate())
            .any(|(slot, (one, other))| both & (1 << slot) != 0 && (one - other).abs() > by)
    }
}

/// Of a reading the pose, when it was made, how far it sways, and the rest in one word.
type ReadingWords = SharedWords<{ MAX_AXES + 3 }>;

/// That of all lanes. The acks lie side by side: the tick thread looks at all of them, each tick, after another processor has written
/// them, and of 64 lanes they take 8 lines of its cache.
#[derive(Debug, Default)]
pub struct EvidenceTable {
    /// The number of the newest frame that was acked, and [`SOME`]; 0 where there is none. [`FOREIGN`] beside it.
    acked: Box<[SharedWord]>,
    readings: Box<[ReadingWords]>,
}

impl EvidenceTable {
    /// Nothing was seen of so many lanes.
    #[must_use]
    pub(crate) fn of(lanes: usize) -> Self {
        Self {
            acked: (0..lanes).map(|_| SharedWord::default()).collect(),
            readings: (0..lanes).map(|_| ReadingWords::default()).collect(),
        }
    }

    /// That of a lane; none where there is no such lane.
    #[must_use]
    pub(crate) fn lane(&self, lane: usize) -> Option<LaneEvidence<'_>> {
        Some(LaneEvidence { acked: self.acked.get(lane)?, reading: self.readings.get(lane)? })
    }
}

/// The newest ack of a lane and the newest reading of its seat.
#[derive(Debug, Clone, Copy)]
pub struct LaneEvidence<'t> {
    acked: &'t SharedWord,
    reading: &'t ReadingWords,
}

const SOME: u64 = 1 << 32;
const FOREIGN: u64 = 1 << 33;
const RESTS: u64 = 1 << 16;
const MOVES: u64 = 1 << 17;
const BY: u32 = 18;

impl LaneEvidence<'_> {
    /// The newest frame that was acked.
    #[must_use]
    pub(crate) fn acked(&self) -> Option<FrameNo> {
        let acked = self.acked.get();
        #[expect(clippy::cast_possible_truncation, reason = "the number is the lower half")]
        (acked & SOME != 0).then_some(FrameNo(acked as u32))
    }

    /// Notes an ack; an older one than the newest says nothing new.
    pub fn on_ack(&self, frame: FrameNo) {
        if self.acked().is_none_or(|newest| frame.since(newest) > 0) {
            self.acked.put(SOME | u64::from(frame.0) | (self.acked.get() & FOREIGN));
        }
    }

    /// True if its controller answers in another layout than that of our frames, to which these mean other positions and times.
    #[must_use]
    pub(crate) fn is_foreign(&self) -> bool {
        self.acked.get() & FOREIGN != 0
    }

    /// Notes whether it does. One thread alone may.
    pub(crate) fn on_layout(&self, is_foreign: bool) {
        self.acked.put((self.acked.get() & !FOREIGN) | if is_foreign { FOREIGN } else { 0 });
    }

    /// Which reading is the newest; 0 before the first.
    #[must_use]
    pub(crate) fn version(&self) -> u32 {
        self.reading.version()
    }

    /// The newest reading and its version; none before the first, and while one is being written.
    #[must_use]
    pub(crate) fn reading(&self) -> Option<(u32, Reading)> {
        let (version, [pose @ .., at, sways, word]) = self.reading.get()?;
        let by = match word >> BY {
            0 => Source::Registers,
            1 => Source::Report,
            2 => Source::Homing,
            _ => Source::Passing,
        };
        let reading = Reading {
            pose: pose.map(f64::from_bits),
            slots: (word & 0xffff) as u16,
            at: MonoTime::from_nanos(at),
            rests: word & RESTS != 0,
            moves: word & MOVES != 0,
            sways: f64::from_bits(sways),
            by,
        };
        Some((version, reading))
    }

    /// Notes a reading. One thread alone may.
    pub fn on_reading(&self, reading: &Reading) {
        let how = (u64::from(reading.rests) * RESTS) | (u64::from(reading.moves) * MOVES);
        let word = u64::from(reading.slots) | how | (reading.by as u64) << BY;
        let words = [reading.at.as_nanos(), reading.sways.to_bits(), word];
        self.reading.put(std::array::from_fn(|place| {
            let of_pose = reading.pose.get(place).map(|fraction| fraction.to_bits());
            of_pose.unwrap_or_else(|| words[place - MAX_AXES])
        }));
    }
}
