//! One tick as it crosses to the recorder: a head, then each frame with what was asked of it and its octets as they left. All
//! numbers are little-endian, as on the machines that this runs on.

use super::cursor::Cursor;
use crate::motion::{MAX_AXES, Pose};
use crate::net::Delivery;
use crate::state::State;
use crate::time::{MonoTime, ShowTime};

/// Octets of a head: length and ticks dropped before it u32, index, deadline, lateness, missed u64, film i64, frames u16, state u8.
const HEAD_LEN: usize = 51;
/// Octets of a frame before its pose and its datagram: instant u64, clamps u32, level f32, lane and length u16, axes and fate u8.
const FRAME_LEN: usize = 22;

/// What is known of a tick once its frames have left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TickHead {
    /// Its place on the grid.
    pub(crate) index: u64,
    /// When it was due.
    pub(crate) deadline: MonoTime,
    /// How long after that its first frame left, or it woke where none did, nanoseconds.
    pub(crate) late_ns: u64,
    /// Ticks slept through since the one before.
    pub(crate) missed: u64,
    /// Show time.
    pub(crate) film: ShowTime,
    /// What the hall was in.
    pub(crate) state: State,
}

#[cfg(feature = "harness")]
impl TickHead {
    /// A tick on time, in the middle of a show.
    #[must_use]
    pub const fn of(index: u64, deadline: MonoTime) -> Self {
        let state = State::Playing(crate::state::PlayMode::Following);
        Self { index, deadline, late_ns: 0, missed: 0, film: ShowTime::ZERO, state }
    }

    /// The same with the film there.
    #[must_use]
    pub const fn showing(self, film: ShowTime) -> Self {
        Self { film, ..self }
    }
}

/// What was asked of a lane before the limiter saw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// Where each slot was to be, fractions of the stroke.
    pub(crate) pose: Pose,
    /// How many slots there are.
    pub(crate) slots: usize,
    /// The level of motion, 0 to 1.
    pub(crate) level: f64,
    /// How often the limiter has held it back so far.
    pub(crate) clamps: u64,
}

impl Asked {
    /// That pose of so many slots at full level.
    #[cfg(feature = "harness")]
    #[must_use]
    pub const fn of(pose: Pose, slots: usize) -> Self {
        Self { pose, slots, level: 1.0, clamps: 0 }
    }

    /// Nothing: a frame that no tick asked for.
    pub(crate) const NOTHING: Self = Self { pose: [0.0; MAX_AXES], slots: 0, level: 0.0, clamps: 0 };
}

/// What the kernel said of a datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Handed {
    /// It has it.
    Taken,
    /// It has it, after it reported that an earlier one met a closed port.
    TakenAfterRefusal,
    /// It did not take it.
    Refused,
}

impl Handed {
    pub(super) const ALL: [Self; 3] = [Self::Taken, Self::TakenAfterRefusal, Self::Refused];
}

impl Handed {
    /// Whether the kernel has it.
    pub(crate) const fn is_taken(self) -> bool {
        !matches!(self, Self::Refused)
    }
}

impl From<Delivery> for Handed {
    fn from(delivery: Delivery) -> Self {
        match delivery {
            Delivery::Sent => Self::Taken,
            Delivery::SentAfterRefusal => Self::TakenAfterRefusal,
            Delivery::Failed(_) => Self::Refused,
        }
    }
}

/// A frame that left, or that the kernel did not take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SentFrame<'a> {
    /// Its lane.
    pub(crate) lane: usize,
    /// The instant before it was handed over.
    pub(crate) at: MonoTime,
    /// What the kernel said.
    pub(crate) handed: Handed,
    /// What was asked of the lane.
    pub(crate) asked: Asked,
    /// Its octets, bit for bit.
    pub(crate) datagram: &'a [u8],
}

/// Octets that such a frame takes at the most.
pub(crate) const fn longest_frame(slots: usize, datagram: usize) -> usize {
    FRAME_LEN + 8 * slots + datagram
}

/// Puts a tick together; allocates once. Tick thread.
#[derive(Debug)]
pub(crate) struct ChunkWriter {
    octets: Box<[u8]>,
    /// Octets that are written.
    len: usize,
    frames: u16,
    /// A frame found no room.
    is_torn: bool,
}

impl ChunkWriter {
    /// One with room for frames of that many octets in all.
    pub(crate) fn with_room(frames: usize) -> Self {
        let octets = vec![0; HEAD_LEN + frames].into_boxed_slice();
        Self { octets, len: HEAD_LEN, frames: 0, is_torn: false }
    }

    /// Octets that it has room for.
    pub(crate) fn room(&self) -> usize {
        self.octets.len()
    }

    /// Adds a frame.
    #[inline]
    pub(crate) fn frame(&mut self, frame: &SentFrame<'_>) {
        let SentFrame { lane, at, handed, ref asked, datagram } = *frame;
        self.put(lane, at, handed, asked, datagram);
    }

    /// The same, of something whose parts stand in different places: nothing is copied but into the chunk.
    #[inline]
    pub(super) fn put(&mut self, lane: usize, at: MonoTime, handed: Handed, asked: &Asked, datagram: &[u8]) {
        let slots = asked.slots.min(MAX_AXES);
        let (Ok(lane), Ok(len)) = (u16::try_from(lane), u16::try_from(datagram.len())) else { return };
        let longest = longest_frame(slots, datagram.len());
        // Written where it stays: what is put together elsewhere is copied once more, in 64 frames a tick.
        let place = self.octets.get_mut(self.len..self.len + longest);
        let Some((head, rest)) = place.and_then(|place| place.split_first_chunk_mut::<FRAME_LEN>()) else {
            self.is_torn = true;
            return;
        };
        #[expect(clippy::cast_possible_truncation, reason = "some thousand clamps; a level needs few digits")]
        let (clamps, level) = (asked.clamps as u32, asked.level as f32);
        head[..8].copy_from_slice(&at.as_nanos().to_le_bytes());
        head[8..12].copy_from_slice(&clamps.to_le_bytes());
        head[12..16].copy_from_slice(&level.to_le_bytes());
        head[16..18].copy_from_slice(&lane.to_le_bytes());
        head[18..20].copy_from_slice(&len.to_le_bytes());
        #[expect(clippy::cast_possible_truncation, reason = "twelve slots, three fates")]
        head[20..].copy_from_slice(&[slots as u8, handed as u8]);
        let (places, rest) = rest.split_at_mut(8 * slots);
        let (places, _) = places.as_chunks_mut();
        places.iter_mut().zip(&asked.pose[..slots]).for_each(|(to, place)| *to = place.to_le_bytes());
        rest.copy_from_slice(datagram);
        self.len += longest;
        self.frames += 1;
    }

    /// The whole chunk, before which `dropped` ticks were lost; `None` where it is not whole.
    pub(crate) fn close(&mut self, head: &TickHead, dropped: u32) -> Option<&[u8]> {
        let TickHead { index, deadline, late_ns, missed, film, state } = *head;
        let len = u32::try_from(self.len).ok().filter(|_| !self.is_torn)?;
        let state = State::ALL.iter().position(|one| *one == state).and_then(|at| u8::try_from(at).ok())?;
        let mut at = 0;
        let mut put = |octets: &[u8]| {
            self.octets[at..at + octets.len()].copy_from_slice(octets);
            at += octets.len();
        };
        put(&len.to_le_bytes());
        put(&dropped.to_le_bytes());
        [index, deadline.as_nanos(), late_ns, missed].iter().for_each(|one| put(&one.to_le_bytes()));
        put(&film.as_nanos().to_le_bytes());
        put(&self.frames.to_le_bytes());
        put(&[state]);
        Some(&self.octets[..self.len])
    }

    /// Begins the next.
    pub(crate) fn clear(&mut self) {
        (self.len, self.frames, self.is_torn) = (HEAD_LEN, 0, false);
    }
}

/// A tick as it is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chunk<'a> {
    /// What is known of it.
    pub(crate) head: TickHead,
    /// Ticks before it that found no room.
    pub(crate) dropped: u32,
    frames: u16,
    body: &'a [u8],
}

impl<'a> Chunk<'a> {
    /// Reads the first of some chunks, and gives what is behind it; `None` where there is no whole one.
    pub(crate) fn parse(octets: &'a [u8]) -> Option<(Self, &'a [u8])> {
        let len = u32::from_le_bytes(*octets.first_chunk()?);
        let (chunk, rest) = octets.split_at_checked(usize::try_from(len).ok()?)?;
        let mut from = Cursor(chunk.get(4..)?);
        let dropped = u32::from_le_bytes(from.take()?);
        let [index, deadline, late_ns, missed] = [from.u64()?, from.u64()?, from.u64()?, from.u64()?];
        let film = ShowTime::from_nanos(i64::from_le_bytes(from.take()?));
        let frames = from.u16()?;
        let state = *State::ALL.get(usize::from(from.u8()?))?;
        let deadline = MonoTime::from_nanos(deadline);
        let head = TickHead { index, deadline, late_ns, missed, film, state };
        Some((Self { head, dropped, frames, body: from.0 }, rest))
    }

    /// Its frames, in the order in which they left; fewer where it is damaged.
    pub(crate) fn frames(&self) -> impl Iterator<Item = SentFrame<'a>> {
        let mut from = Cursor(self.body);
        std::iter::from_fn(move || from.frame()).take(usize::from(self.frames))
    }
}

impl<'a> Cursor<'a> {
    #[inline]
    fn frame(&mut self) -> Option<SentFrame<'a>> {
        let at = MonoTime::from_nanos(self.u64()?);
        let clamps = self.take().map(u32::from_le_bytes)?.into();
        let level = self.take().map(f32::from_le_bytes)?.into();
        let (lane, len) = (usize::from(self.u16()?), usize::from(self.u16()?));
        let slots = usize::from(self.u8()?);
        let handed = *Handed::ALL.get(usize::from(self.u8()?))?;
        let mut pose = [0.0; MAX_AXES];
        for place in pose.get_mut(..slots)? {
            *place = f64::from_le_bytes(self.take()?);
        }
        let datagram = self.slice(len)?;
        let asked = Asked { pose, slots, level, clamps };
        Some(SentFrame { lane, at, handed, asked, datagram })
    }
}
