//! The last frames of one controller, by number.

use crate::time::MonoTime;
use crate::wire::FrameNo;

/// How many frames of a controller are remembered: four seconds at 1 kHz, far past the second in which one is lost.
pub const KEPT: u32 = 4_096;

/// How a remembered frame stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrameState {
    /// Sent, asking for nothing.
    Unasked,
    /// Waiting for a reply.
    InFlight,
    /// Waiting for a reply; when it was sent is not known, only that it was no later than the entry says.
    InFlightUntimed,
    /// Acked.
    Acked,
    /// Refused.
    Refused,
    /// Given up.
    Lost,
    /// Whoever was to execute it was told to stop first.
    Withdrawn,
    /// Not taken by the kernel, or a number that no frame has.
    Failed,
}

impl FrameState {
    pub(super) const fn open(self) -> bool {
        matches!(self, Self::InFlight | Self::InFlightUntimed)
    }
}

/// A remembered frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameEntry {
    pub(super) state: FrameState,
    /// When it was sent.
    pub(super) at: MonoTime,
    /// How many frames that wanted a reply there had been with it, round after 4,294,967,295.
    pub(super) wanted: u32,
}

/// Where a frame number leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberPlace {
    /// No frame of that number has been on record.
    Never,
    /// There was one, too long ago.
    Forgotten,
    /// The entry of this index.
    Kept(usize),
}

/// A ring of the last [`KEPT`] frames on record.
#[derive(Debug)]
pub(super) struct Ring {
    entries: Box<[FrameEntry]>,
    newest: FrameNo,
    /// Frames on record so far.
    total: u64,
}

impl Ring {
    /// An empty ring; the first frame will be `first`.
    pub(super) fn new(first: FrameNo) -> Self {
        let vacant = FrameEntry { state: FrameState::Unasked, at: MonoTime::default(), wanted: 0 };
        let newest = FrameNo(first.0.wrapping_sub(1));
        Self { entries: vec![vacant; KEPT as usize].into_boxed_slice(), newest, total: 0 }
    }

    /// How many numbers `frame` is ahead of the newest on record; 0 if it is on record itself.
    pub(super) fn ahead(&self, frame: FrameNo) -> u32 {
        u32::try_from(frame.since(self.newest)).unwrap_or(0)
    }

    /// Takes the next frame on record; gives the entry that had its place.
    pub(super) fn push(&mut self, entry: FrameEntry) -> FrameEntry {
        self.skip(1);
        std::mem::replace(&mut self.entries[slot(self.newest)], entry)
    }

    /// Takes `count` frames on record that are forgotten at once: at least [`KEPT`] more must be pushed after them.
    pub(super) fn skip(&mut self, count: u32) {
        self.newest = FrameNo(self.newest.0.wrapping_add(count));
        self.total += u64::from(count);
    }

    pub(super) fn find(&self, frame: FrameNo) -> NumberPlace {
        match u32::try_from(self.newest.since(frame)) {
            Ok(age) if u64::from(age) >= self.total => NumberPlace::Never,
            Ok(age) if age >= KEPT => NumberPlace::Forgotten,
            Ok(_) => NumberPlace::Kept(slot(frame)),
            Err(_) => NumberPlace::Never,
        }
    }

    pub(super) fn get(&self, index: usize) -> FrameEntry {
        self.entries[index]
    }

    pub(super) fn get_mut(&mut self, index: usize) -> &mut FrameEntry {
        &mut self.entries[index]
    }

    /// The number of the next frame on record.
    pub(super) const fn next(&self) -> FrameNo {
        self.newest.next()
    }
}

const fn slot(frame: FrameNo) -> usize {
    (frame.0 % KEPT) as usize
}
