//! How much of a cue is taken into memory, and which values no seat could follow. `--help` shows the first four.

use crate::time::ShowTime;

/// The most rows of a cue: two hours at 1 kHz and some.
pub(crate) const MAX_ROWS: usize = 8_000_000;
/// The most bytes of one line, its end not counted, and of one MCAP message.
pub(crate) const MAX_LINE: usize = 64 * 1024;
/// The most bytes of a file, and of what a compressed file unpacks to.
pub(crate) const MAX_FILE: u64 = 2 * 1024 * 1024 * 1024;
/// The most effects that a cue may name.
pub(crate) const MAX_EFFECTS: usize = 32;
/// The most markers of a cue.
pub(crate) const MAX_MARKERS: usize = 10_000;
/// The most bytes of a marker's name.
pub(crate) const MAX_MARKER_NAME: usize = 256;
/// The bytes of a title that are kept.
pub(super) const MAX_TITLE: usize = 1_024;
/// The last show time a row may have: a day.
pub(crate) const MAX_TIME: ShowTime = ShowTime::from_millis(86_400_000);
/// The greatest position in mm, far beyond any seat.
pub(super) const MAX_MILLIMETRES: f64 = 100_000.0;
/// The greatest position in degrees, a hundred turns: far beyond any seat.
pub(super) const MAX_DEGREES: f64 = 36_000.0;
/// The greatest position in pulses: what a frame can carry (SMC manual 2.2.2.5).
pub(super) const MAX_PULSES: f64 = i32::MAX as f64;
/// The outputs that a controller has, Y01 to Y12 as bits 0 to 11 (SMC manual 2.2.2.5).
pub(super) const ALL_OUTPUTS: u16 = 0x0fff;
/// The slowest vibration a frame can carry, Hz: a period of 65,535 x 0.125 ms (SMC manual 2.2.2.9), rounded up.
pub(crate) const MIN_VIBRATION_HZ: f64 = 0.1221;
/// The fastest vibration, Hz: a period of 0.125 ms (SMC manual 2.2.2.9).
pub(crate) const MAX_VIBRATION_HZ: f64 = 8_000.0;

/// The limits that a person may meet, for `--help`.
pub(crate) const IN_WORDS: &str =
    "at most 8 million rows (two hours at 1 kHz), 12 axes, 64 KiB a line and 2 GiB a file";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_are_those_of_the_numbers() {
        assert_eq!((MAX_ROWS, crate::motion::MAX_AXES), (8_000_000, 12));
        assert_eq!((MAX_LINE, MAX_FILE), (64 << 10, 2 << 30));
    }
}
