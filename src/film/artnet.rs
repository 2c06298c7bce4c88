//! Art-Net timecode (`ArtTimeCode` of the Art-Net 4 protocol): 19 bytes of UDP.

#[cfg(test)]
mod tests;

use super::labels::LabelClock;
use super::observation::{FilmWord, Observation};
use super::timecode::{FrameRate, Label};
use crate::time::MonoTime;

const HEAD: [u8; 10] = *b"Art-Net\0\x00\x97";
const VERSION: u8 = 14;
/// The bytes of a datagram that count; longer ones are padded.
const LENGTH: usize = 19;
/// Deviation of the instant of a label, seconds: timers of senders.
const SIGMA_S: f64 = 0.004;

/// A datagram of timecode: the label, and how many there are in a second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ArtTimecode {
    pub(crate) label: Label,
    pub(crate) labels: u32,
}

impl ArtTimecode {
    /// The timecode of a datagram; `None` if it is another of Art-Net, or none.
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        let (head, rest) = bytes.get(..LENGTH)?.split_at(HEAD.len());
        let [_, version, _, _, frames, seconds, minutes, hours, kind] = *<&[u8; 9]>::try_from(rest).ok()?;
        let (labels, drops) = match kind {
            0 => (24, false),
            1 => (25, false),
            2 => (30, true),
            3 => (30, false),
            _ => return None,
        };
        let is_one = head == HEAD && version >= VERSION && u32::from(frames) < labels;
        let label = Label { hours, minutes, seconds, frames, drops };
        is_one.then_some(Self { label, labels })
    }

    /// The datagram of a frame. A network of 30,000/1,001 frames without drop, and of 24,000/1,001, goes by the name of the whole number.
    pub(crate) fn emit(label: Label, rate: FrameRate) -> [u8; LENGTH] {
        let kind = match rate {
            FrameRate::F23_976 | FrameRate::F24 => 0,
            FrameRate::F25 => 1,
            FrameRate::F29_97Drop => 2,
            FrameRate::F29_97 | FrameRate::F30 => 3,
        };
        let mut bytes = [0; LENGTH];
        bytes[..HEAD.len()].copy_from_slice(&HEAD);
        bytes[11] = VERSION;
        bytes[14..].copy_from_slice(&[label.frames, label.seconds, label.minutes, label.hours, kind]);
        bytes
    }
}

/// Hears a sender of Art-Net timecode.
#[derive(Debug, Clone)]
pub(crate) struct ArtNetReader {
    labels: LabelClock,
    garbage: u64,
}

impl ArtNetReader {
    /// One whose frames last as `rate` says, or as is found; the label `start` is time 0 of the film.
    pub(crate) const fn new(rate: Option<FrameRate>, start: Label) -> Self {
        Self { labels: LabelClock::new(rate, start, SIGMA_S), garbage: 0 }
    }

    /// Datagrams that are no timecode.
    pub(crate) const fn garbage(&self) -> u64 {
        self.garbage
    }

    /// Its labels.
    pub(crate) const fn labels(&self) -> &LabelClock {
        &self.labels
    }

    /// Takes a datagram that came at an instant.
    pub(crate) fn hear(&mut self, bytes: &[u8], at: MonoTime, out: &mut impl FnMut(Observation)) {
        let Some(ArtTimecode { label, labels }) = ArtTimecode::parse(bytes) else {
            self.garbage += 1;
            return;
        };
        let media = self.labels.media(at, label, 0, Some(labels));
        out(Observation::new(at, media.map_or(FilmWord::Unplaced, FilmWord::Position)));
    }
}
