//! MIDI timecode (MMA0001): quarter frames, of which eight carry a label and each marks a quarter of a frame; the full message of a
//! machine that was wound; stop and play of machine control. Bytes in, as they come from a line.

#[cfg(test)]
mod tests;

use std::time::Duration;

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
/// A full message that names a place so near to the quarter frames, frames, is one of a machine that runs, or stops there: a whole set is two
/// to four frames old, and more where quarter frames come by the block of sound.
const NEAR: i64 = 10;
/// So many reads after one that brought several quarter frames others may: what a player sends by the block of sound comes by turns in ones
/// and twos.
const BY_BLOCK: u32 = 200;
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
    /// The newest quarter frame that nothing was made of yet: its label, if that is known, the rate bits of that, and which it is.
    newest: Option<Option<(Label, u8, u8)>>,
    /// How many came at this instant, and for how many reads more each is late by up to a quarter frame.
    at_once: u32,
    by_block: u32,
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
            newest: None,
            at_once: 0,
            by_block: 0,
        }
    }

    /// Its labels.
    pub(crate) const fn labels(&self) -> &LabelClock {
        &self.labels
    }

    /// Takes bytes that came at an instant.
    pub(crate) fn hear(&mut self, bytes: &[u8], at: MonoTime, out: &mut impl FnMut(Observation)) {
        for byte in bytes {
            self.hear_byte(*byte, at, out);
        }
        self.place(at, out);
    }

    fn hear_byte(&mut self, byte: u8, at: MonoTime, out: &mut impl FnMut(Observation)) {
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
                self.on_quarter(byte);
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

    fn on_quarter(&mut self, data: u8) {
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
        self.newest = Some(self.expected.map(|(label, bits)| (label, bits, piece)));
        self.at_once += 1;
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

    /// Says where the film is by the newest quarter frame. Players that send all of a block of sound at once are late with the others.
    fn place(&mut self, at: MonoTime, out: &mut impl FnMut(Observation)) {
        let Some(newest) = self.newest.take() else { return };
        let by_block = if self.at_once > 1 { BY_BLOCK } else { self.by_block.saturating_sub(1) };
        (self.by_block, self.at_once) = (by_block, 0);
        let media = newest.and_then(|(label, bits, piece)| {
            self.labels.media(at, label, i64::from(piece), Some(rate_bits(bits).0))
        });
        let word = media.map_or(FilmWord::Unplaced, FilmWord::Position);
        let quarter =
            newest.map(|(_, bits, _)| Duration::from_secs_f64(0.25 / rate_of(bits).frames_per_second()));
        let bound = quarter.filter(|_| by_block > 0).unwrap_or_default() / 2;
        out(Observation { at, bound, word });
    }

    /// Whether quarter frames have come up to about that label.
    fn runs_at(&self, label: Label, bits: u8) -> bool {
        let Some((whole, its, true)) = self.whole else { return false };
        let code = |label| Timecode::of(label, rate_of(bits));
        let apart = code(label).ok().zip(code(whole).ok()).map(|(here, there)| here.since(there));
        rate_bits(its) == rate_bits(bits) && apart.is_some_and(|frames| frames.abs() <= NEAR)
    }

    /// A message for all: where a machine was wound to, or what it is told.
    fn on_exclusive(&mut self, at: MonoTime, out: &mut impl FnMut(Observation)) {
        self.place(at, out);
        let data = self.data;
        let word = match (self.length, data) {
            // Full message: somebody was wound there, and stands.
            (8, [0x7f, _, 0x01, 0x01, hours, minutes, seconds, frames, ..]) => {
                let (labels, drops) = rate_bits(hours >> 5);
                let label = Label { hours: hours & 0x1f, minutes, seconds, frames, drops };
                // Some machines send one each second while they run.
                if self.runs_at(label, hours >> 5) {
                    return out(Observation::new(at, FilmWord::MayStop));
                }
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
    Timecode::of(label, rate_of(bits)).ok().map(|label| label.plus(frames).label())
}

/// A rate that has such labels.
const fn rate_of(bits: u8) -> FrameRate {
    let (labels, drops) = rate_bits(bits);
    FrameRate::whole(labels, drops)
}
