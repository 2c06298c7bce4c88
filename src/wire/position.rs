//! Positions of axes 1 to 6 in the monitor registers: two words each, in an order that the manuals disagree on (SMC
//! manual 2.3.3: low word first; IMAX manual 2.3.3: high word first). Further axes have none.

use super::{Code, Dialect, PerAxis, ReadRequest, Words};
use crate::motion::Pulses;

/// The monitor register at which the position of each of axes 1 to 6 begins.
pub(crate) const DP_POSITIONS: [u16; 6] = [0x06, 0x08, 0x0a, 0x21, 0x23, 0x25];

/// The monitor register of the active inputs, bit 0 = X01.
pub(crate) const DP_INPUTS: u16 = 0x5e;
/// Active outputs, bit 0 = Y01 (2.3.3 of both manuals).
pub(crate) const DP_OUTPUTS: u16 = 0x66;

/// Axes of one block of position registers.
pub(crate) const AXES_PER_BLOCK: usize = 3;

/// The reads that tell the position of axes 1 to `axes`: DP06.. for axes 1 to 3, and DP21.. for 4 to 6 where there are
/// as many. The words of each answer go to [`positions`].
pub(crate) fn position_reads(axes: usize, accept: Code, reply: Code) -> impl Iterator<Item = ReadRequest> {
    let axes = axes.min(DP_POSITIONS.len());
    (0..axes).step_by(AXES_PER_BLOCK).map(move |first| {
        let num = if axes - first < AXES_PER_BLOCK { axes - first } else { AXES_PER_BLOCK };
        let num = super::bytes::count(2 * num);
        ReadRequest { channel: 0, accept, reply, start: DP_POSITIONS[first], num }
    })
}

/// Two reads that tell the same as one of [`position_reads`], that of a block from axis `first` on, from 0: the first axis alone, and the
/// others. Answers name a first register and a count and nothing else, and these are no other read's: an answer to the one is never
/// taken for an answer to the other. A block of one axis has one read, which goes on to the next axis.
pub(crate) fn position_parts(
    first: usize,
    axes: usize,
    accept: Code,
    reply: Code,
) -> [Option<ReadRequest>; 2] {
    let axes = axes.min(DP_POSITIONS.len()).saturating_sub(first).min(AXES_PER_BLOCK);
    let read = |axis: usize, axes: usize| {
        let start = DP_POSITIONS.get(axis).copied().filter(|_| axes > 0)?;
        Some(ReadRequest { channel: 0, accept, reply, start, num: super::bytes::count(2 * axes) })
    };
    match axes {
        0 => [None, None],
        1 => [read(first, 2), None],
        _ => [read(first, 1), read(first + 1, axes - 1)],
    }
}

/// The positions that position registers hold, first axis first; an odd word at the end is left out.
#[must_use]
pub(crate) fn positions(words: Words<'_>, dialect: Dialect) -> PerAxis<Pulses> {
    PerAxis::from_fn(words.len() / 2, |axis| {
        let word = |index| words.get(index).unwrap_or(0);
        position([word(2 * axis), word(2 * axis + 1)], dialect)
    })
}

/// The position that two registers hold.
#[must_use]
pub const fn position(words: [u16; 2], dialect: Dialect) -> Pulses {
    let [low, high] = swapped(words, dialect);
    Pulses(((high as u32) << 16 | low as u32).cast_signed())
}

/// The two registers that hold a position.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "each takes half of the 32 bits")]
pub const fn position_words(position: Pulses, dialect: Dialect) -> [u16; 2] {
    let bits = position.0.cast_unsigned();
    swapped([bits as u16, (bits >> 16) as u16], dialect)
}

const fn swapped([first, second]: [u16; 2], dialect: Dialect) -> [u16; 2] {
    match dialect {
        Dialect::Smc => [first, second],
        Dialect::Mbox => [second, first],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_word_order_follows_the_dialect() {
        assert_eq!(position([6784, 6], Dialect::Smc), Pulses(400_000));
        assert_eq!(position([6, 6784], Dialect::Mbox), Pulses(400_000));
        assert_eq!(positions(Words::from(&[0xff9c, 0xffff, 7][..]), Dialect::Smc)[..], [Pulses(-100)]);
        for dialect in [Dialect::Smc, Dialect::Mbox] {
            let there = Pulses(-1_234_567);
            assert_eq!(position(position_words(there, dialect), dialect), there);
        }
    }

    #[test]
    fn the_parts_of_a_block_are_other_reads_than_the_block_whatever_its_axes() {
        for axes in 1..=8 {
            let whole: Vec<ReadRequest> = position_reads(axes, Code::ALL, Code::ALL).collect();
            for (block, read) in whole.iter().enumerate() {
                let first = block * AXES_PER_BLOCK;
                let parts = position_parts(first, axes, Code::ALL, Code::ALL);
                let told: u16 = parts.iter().flatten().map(|part| part.num).sum();
                assert!(told >= read.num && parts[0].is_some_and(|part| part.start == read.start));
                assert!(parts.iter().flatten().all(|part| part != read), "{axes} axes");
            }
        }
        assert_eq!(position_parts(3, 3, Code::ALL, Code::ALL), [None, None]);
    }

    #[test]
    fn four_axes_take_two_reads_and_ten_no_more() {
        let reads = |axes| -> Vec<(u16, u16)> {
            position_reads(axes, Code::ALL, Code::ALL).map(|read| (read.start, read.num)).collect()
        };
        assert_eq!(reads(2), [(0x06, 4)]);
        assert_eq!(reads(4), [(0x06, 6), (0x21, 2)]);
        assert_eq!(reads(10), [(0x06, 6), (0x21, 6)]);
    }
}
