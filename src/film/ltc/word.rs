//! The 80 bits of an LTC frame (SMPTE ST 12-1): the digits of the label between user bits, and the sync word that ends it and says
//! which way the tape runs. Bit 0 is sent first.

use crate::film::timecode::{FrameRate, Label};

/// Bits of a frame.
pub(super) const BITS: u32 = 80;
const ALL: u128 = (1 << BITS) - 1;
const SYNC_AT: u32 = 64;
/// 0011 1111 1111 1101, first bit lowest. No label and no user bits have twelve ones in a row.
const SYNC: u128 = 0xbffc;
/// The same as it comes when the tape runs backwards.
const SYNC_BACKWARDS: u128 = 0x3ffd;
const DROPS_AT: u32 = 10;
/// The bit that makes the number of zeros even, so that every frame begins with the same polarity.
const EVEN_AT: u32 = 27;
const EVEN_AT_25: u32 = 59;

/// Digits of a label: where they begin, and how many bits they have.
const DIGITS: [(u32, u32); 8] = [(0, 4), (8, 2), (16, 4), (24, 3), (32, 4), (40, 3), (48, 4), (56, 2)];

/// The last 80 bits of a line.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LtcWord(u128);

impl LtcWord {
    /// Takes the next bit of the line.
    pub(super) const fn push(&mut self, bit: bool) {
        self.0 = self.0 >> 1 | (bit as u128) << (BITS - 1);
    }

    /// The label of the frame that these bits are, and whether it ran backwards; `None` if they are none.
    pub(super) fn label(self) -> Option<(Label, bool)> {
        if self.0 >> SYNC_AT == SYNC {
            Some((self.digits()?, false))
        } else if self.0 & 0xffff == SYNC_BACKWARDS {
            Some((Self(self.0.reverse_bits() >> (128 - BITS)).digits()?, true))
        } else {
            None
        }
    }

    fn digits(self) -> Option<Label> {
        let digit =
            |(at, bits): (u32, u32)| u8::try_from(self.0 >> at & ((1 << bits) - 1)).unwrap_or(u8::MAX);
        let pair = |units: usize| {
            let (units, tens) = (digit(DIGITS[units]), digit(DIGITS[units + 1]));
            (units <= 9).then_some(10 * tens + units)
        };
        let label = Label {
            frames: pair(0)?,
            seconds: pair(2)?,
            minutes: pair(4)?,
            hours: pair(6)?,
            drops: self.0 >> DROPS_AT & 1 == 1,
        };
        // Digits that cannot be are bits that were turned: nothing of such a frame is believed.
        let is_one = label.frames < 30 && label.seconds < 60 && label.minutes < 60 && label.hours < 24;
        is_one.then_some(label)
    }

    /// The bits of a label's frame.
    pub(super) fn of(label: Label, rate: FrameRate) -> Self {
        let parts = [label.frames, label.seconds, label.minutes, label.hours];
        let digits = parts.into_iter().flat_map(|part| [part % 10, part / 10]);
        let mut bits = SYNC << SYNC_AT | u128::from(label.drops) << DROPS_AT;
        for ((at, _), digit) in DIGITS.into_iter().zip(digits) {
            bits |= u128::from(digit) << at;
        }
        let even_at = if rate == FrameRate::F25 { EVEN_AT_25 } else { EVEN_AT };
        Self(bits | u128::from((ALL & !bits).count_ones() % 2) << even_at)
    }

    pub(super) const fn bit(self, index: u32) -> bool {
        self.0 >> index & 1 == 1
    }
}

/// Whether one label comes right after another, whatever their rate is.
pub(super) fn follows(label: Label, before: Label) -> bool {
    if label.drops != before.drops {
        return false;
    }
    if label == (Label { frames: before.frames + 1, ..before }) {
        return true;
    }
    // A second ends after 24, 25 or 30 frames, and how many there are is not known yet: any end will do.
    let rates: &[FrameRate] = match (before.frames, before.drops) {
        (23, false) => &[FrameRate::F24],
        (24, false) => &[FrameRate::F25],
        (29, false) => &[FrameRate::F30],
        (29, true) => &[FrameRate::F29_97Drop],
        _ => &[],
    };
    let after = |rate: &FrameRate| super::Timecode::of(before, *rate).map(|before| before.plus(1).label());
    rates.iter().any(|rate| after(rate) == Ok(label))
}
