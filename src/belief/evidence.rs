//! What the ack thread has seen of one lane, as levels that the tick thread reads: nothing of it can be lost in a full mailbox,
//! and nobody waits. One thread writes.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};

use crate::motion::{MAX_AXES, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// Where a reading comes from.
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

/// The newest ack of a lane and the newest reading of its seat.
#[derive(Debug, Default)]
pub struct LaneEvidence {
    /// The number of the newest frame that was acked, and [`SOME`]; 0 where there is none.
    acked: AtomicU64,
    /// Odd while a reading is being written.
    version: AtomicU32,
    pose: [AtomicU64; MAX_AXES],
    at: AtomicU64,
    sways: AtomicU64,
    slots: AtomicU32,
}

const SOME: u64 = 1 << 32;
const RESTS: u32 = 1 << 16;
const MOVES: u32 = 1 << 17;
const BY: u32 = 18;

impl LaneEvidence {
    /// The newest frame that was acked.
    #[must_use]
    pub(crate) fn acked(&self) -> Option<FrameNo> {
        let acked = self.acked.load(Ordering::Acquire);
        #[expect(clippy::cast_possible_truncation, reason = "the number is the lower half")]
        (acked & SOME != 0).then_some(FrameNo(acked as u32))
    }

    /// Notes an ack; an older one than the newest says nothing new.
    pub fn on_ack(&self, frame: FrameNo) {
        if self.acked().is_none_or(|newest| frame.since(newest) > 0) {
            self.acked.store(SOME | u64::from(frame.0), Ordering::Release);
        }
    }

    /// Which reading is the newest; 0 before the first.
    #[must_use]
    pub(crate) fn version(&self) -> u32 {
        self.version.load(Ordering::Acquire)
    }

    /// The newest reading and its version; none before the first, and while one is being written.
    #[must_use]
    pub(crate) fn reading(&self) -> Option<(u32, Reading)> {
        let version = self.version();
        if version == 0 || version % 2 == 1 {
            return None;
        }
        let pose = std::array::from_fn(|slot| f64::from_bits(self.pose[slot].load(Ordering::Relaxed)));
        let (at, word) = (self.at.load(Ordering::Relaxed), self.slots.load(Ordering::Relaxed));
        let sways = f64::from_bits(self.sways.load(Ordering::Relaxed));
        // What was loaded before this is of one version if the version is still the same after it.
        fence(Ordering::Acquire);
        let by = match word >> BY {
            0 => Source::Registers,
            1 => Source::Report,
            2 => Source::Homing,
            _ => Source::Passing,
        };
        let reading = Reading {
            pose,
            slots: (word & 0xffff) as u16,
            at: MonoTime::from_nanos(at),
            rests: word & RESTS != 0,
            moves: word & MOVES != 0,
            sways,
            by,
        };
        (self.version.load(Ordering::Relaxed) == version).then_some((version, reading))
    }

    /// Notes a reading. One thread alone may.
    pub fn on_reading(&self, reading: &Reading) {
        let version = self.version.load(Ordering::Relaxed);
        self.version.store(version.wrapping_add(1), Ordering::Relaxed);
        // Nothing of the reading is seen before the version is odd.
        fence(Ordering::Release);
        for (cell, place) in self.pose.iter().zip(reading.pose) {
            cell.store(place.to_bits(), Ordering::Relaxed);
        }
        self.at.store(reading.at.as_nanos(), Ordering::Relaxed);
        self.sways.store(reading.sways.to_bits(), Ordering::Relaxed);
        let by = match reading.by {
            Source::Registers => 0,
            Source::Report => 1,
            Source::Homing => 2,
            Source::Passing => 3,
        };
        let rests = if reading.rests { RESTS } else { 0 };
        let moves = if reading.moves { MOVES } else { 0 };
        self.slots.store(u32::from(reading.slots) | rests | moves | by << BY, Ordering::Relaxed);
        // Zero stays for "none": after 2^31 readings the count begins anew.
        let next = version.wrapping_add(2);
        self.version.store(if next == 0 { 2 } else { next }, Ordering::Release);
    }
}
