//! MIDI timecode (MMA0001): quarter frames, of which eight carry a label and each marks a quarter of a frame; the full message of a
//! machine that was wound; stop and play of machine control. Bytes in, as they come from a line.

#[cfg(test)]
mod tests;

use super::labels::LabelClock;
use super::observation::{FilmWord, Observation};
use super::timecode::{FrameRate, Label, Timecode};
use crate::time::MonoTime;

const QUARTER: u8 = 0xf1;
const EXCLUSIVE: u8 = 0xf0;
const EXCLUSIVE_ENDS: u8 = 0xf7;
/// From here on a byte is a message of its own, even within another.
const REALTIME: u8 = 0xf8;
/// The longest message that says anything to us, without its frame; of longer ones the rest is not kept.
const LONGEST: usize = 9;
/// Deviation of the instant of a quarter frame, seconds.
const SIGMA_S: f64 = 0.000_5;
/// Quarter frames of a label, and the frames that pass with them.
const QUARTERS: u8 = 8;
const FRAMES_OF_A_SET: i64 = 2;

/// The labels of a second, and whether they drop, by the two bits that say so.
const fn rate_bits(bits: u8) -> (u32, bool) {
    match bits & 3 {
        0 => (24, false),
        1 => (25, false),
        2 => (30, true),
        _ => (30, false),
    }
}

/// The rate bits of a rate; networks have no name for 23.976, nor for 29.97 that does not drop.
const fn bits_of(rate: FrameRate) -> u8 {
    match rate {
        FrameRate::F23_976 | FrameRate::F24 => 0,
        FrameRate::F25 => 1,
        FrameRate::F29_97Drop => 2,
        FrameRate::F29_97 | FrameRate::F30 => 3,
    }
}

/// The eight data bytes of a label's quarter frames.
fn pieces(label: Label, bits: u8) -> [u8; QUARTERS as usize] {
    let parts = [label.frames, label.seconds, label.minutes, label.hours | bits << 5];
    std::array::from_fn(|piece| {
        let half = parts[piece / 2] >> (4 * (piece % 2)) & 0xf;
        u8::try_from(piece).unwrap_or(0) << 4 | half
    })
}

/// The quarter frames of a label, each two bytes: for tests, and for technicians who have no other generator.
pub(crate) fn quarter_frames(frame: Timecode) -> [[u8; 2]; QUARTERS as usize] {
    pieces(frame.label(), bits_of(frame.rate())).map(|data| [QUARTER, data])
}

/// Which of the last quarter frames were what.
#[derive(Debug, Clone, Copy, Default)]
struct QuarterSet {
    data: [u8; QUARTERS as usize],
    /// How many came in order, up to the newest.
    run: u8,
    newest: u8,
    backwards: bool,
}

impl QuarterSet {
    /// Notes a quarter frame; true if a whole set is there.
    fn push(&mut self, data: u8) -> bool {
        let piece = data >> 4 & 7;
        let forward = (self.newest + 1) % QUARTERS == piece;
        let backward = (piece + 1) % QUARTERS == self.newest;
        let goes_on = if self.backwards { backward } else { forward };
        if self.run > 0 && !goes_on {
            // It turned round, or some were lost.
            self.run = u8::from(forward || backward);
            self.backwards = backward && !forward;
        }
        self.data[usize::from(piece)] = data & 0xf;
        self.newest = piece;
        self.run = self.run.saturating_add(1);
        let is_last = piece == if self.backwards { 0 } else { QUARTERS - 1 };
        is_last && self.run >= QUARTERS
    }

    /// The label that the pieces are, and its rate bits.
    fn label(&self) -> (Label, u8) {
        let part = |low: usize, most: u8| (self.data[low] | self.data[low + 1] << 4) & most;
        let (hours, bits) = (part(6, 0x1f), self.data[7] >> 1);
        let (_, drops) = rate_bits(bits);
        (Label { hours, minutes: part(4, 0x3f), seconds: part(2, 0x3f), frames: part(0, 0x1f), drops }, bits)
    }
}

/// Reads MTC from the bytes of a line.
#[derive(Debug, Clone)]
pub(crate) struct MtcReader {
    labels: LabelClock,
    /// The status of the message that is under way, and its data so far.
    status: u8,
    data: [u8; LONGEST],
    length: usize,
    set: QuarterSet,
    /// The label of the newest whole set, and whether the one before agreed.
    whole: Option<(Label, u8, bool)>,
    /// The label that the set under way has to have, once two agreed.
    expected: Option<(Label, u8)>,
}

impl MtcReader {
    /// A line; a rate that is not configured is found.
    pub(crate) fn new(rate: Option<FrameRate>, start: Label) -> Self {
        Self {
            labels: LabelClock::new(rate, start, SIGMA_S),
            status: 0,
            data: [0; LONGEST],
            length: 0,
            set: QuarterSet::default(),
            whole: None,
            expected: None,
        }
    }

    /// Its labels.
    pub(crate) const fn labels(&self) -> &LabelClock {
        &self.labels
    }

    /// Takes a byte that came at an instant.
    pub(crate) fn hear(&mut self, byte: u8, at: MonoTime, out: &mut impl FnMut(Observation)) {
        match byte {
            // Clocks of other machines come at any time, within a message too, and end none.
            REALTIME.. => {}
            EXCLUSIVE_ENDS => {
                if self.status == EXCLUSIVE {
                    self.on_exclusive(at, out);
                }
                self.status = 0;
            }
            0x80.. => (self.status, self.length) = (byte, 0),
            _ if self.status == QUARTER => {
                // A quarter frame has no running status: what follows it belongs to nothing.
                self.status = 0;
                self.on_quarter(byte, at, out);
            }
            _ if self.status == EXCLUSIVE => {
                if let Some(place) = self.data.get_mut(self.length) {
                    *place = byte;
                }
                self.length = (self.length + 1).min(LONGEST + 1);
            }
            _ => {}
        }
    }

    fn on_quarter(&mut self, data: u8, at: MonoTime, out: &mut impl FnMut(Observation)) {
        let is_whole = self.set.push(data);
        let (piece, backwards) = (self.set.newest, self.set.backwards);
        let is_first = piece == if backwards { QUARTERS - 1 } else { 0 };
        // Where a set begins its label is known from the one before; at its end it has to be what it said.
        if is_first {
            self.expected = self.whole.filter(|whole| whole.2).and_then(|(label, bits, _)| {
                Some((
                    stepped(label, bits, if backwards { -FRAMES_OF_A_SET } else { FRAMES_OF_A_SET })?,
                    bits,
                ))
            });
        }
        // A piece that is not what it has to be: the set says something else, or was put together from two.
        let fits =
            |(label, bits): &(Label, u8)| pieces(*label, *bits)[usize::from(piece)] & 0xf == data & 0xf;
        self.expected = self.expected.filter(|expected| self.set.run > 0 && fits(expected));
        if let Some((label, bits)) = self.expected {
            let quarters = i64::from(piece);
            if let Some(media) = self.labels.media(at, label, quarters, Some(rate_bits(bits).0)) {
                out(Observation::new(at, FilmWord::Position(media)));
            }
        }
        if is_whole {
            let (label, bits) = self.set.label();
            let step = if backwards { -FRAMES_OF_A_SET } else { FRAMES_OF_A_SET };
            // A set that was filled while its label changed may be a minute off with
            // all of its pieces in order; two sets that follow each other are not.
            let agrees = self
                .whole
                .is_some_and(|(before, its, _)| its == bits && stepped(before, bits, step) == Some(label));
            self.whole = Some((label, bits, agrees));
        }
    }

    /// A message for all: where a machine was wound to, or what it is told.
    fn on_exclusive(&mut self, at: MonoTime, out: &mut impl FnMut(Observation)) {
        let data = self.data;
        let word = match (self.length, data) {
            // Full message: somebody was wound there, and stands.
            (8, [0x7f, _, 0x01, 0x01, hours, minutes, seconds, frames, ..]) => {
                let (labels, drops) = rate_bits(hours >> 5);
                let label = Label { hours: hours & 0x1f, minutes, seconds, frames, drops };
                // It was wound: sets from before say nothing of the next.
                self.whole = None;
                out(Observation::new(at, FilmWord::Stop));
                let Some(media) = self.labels.media(at, label, 0, Some(labels)) else { return };
                FilmWord::Position(media)
            }
            (4, [0x7f, _, 0x06, 0x01 | 0x09, ..]) => FilmWord::Stop,
            (4, [0x7f, _, 0x06, 0x02 | 0x03, ..]) => FilmWord::Play,
            _ => return,
        };
        out(Observation::new(at, word));
    }
}

/// The label so many frames on, by the rate that the bits name; `None` if there is no such label.
fn stepped(label: Label, bits: u8, frames: i64) -> Option<Label> {
    let rate = match rate_bits(bits) {
        (24, _) => FrameRate::F24,
        (25, _) => FrameRate::F25,
        (_, true) => FrameRate::F29_97Drop,
        (_, false) => FrameRate::F30,
    };
    Timecode::of(label, rate).ok().map(|label| label.plus(frames).label())
}
