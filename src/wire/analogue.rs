//! The analogue outputs of a controller, four bytes behind Port Out of a motion frame without vibration: "Extend" (SMC manual
//! 2.2.2.5 to 2.2.2.8), "Play DAC" (IMAX manual 2.2.2.6 and 2.2.2.7). Both manuals give the width, `L`, and no more; controllers
//! of the family that came before (MBOX) take it as two words, DAC1 and DAC2, and so does this.

/// What the two outputs are set to, 0 to 65,535 of what they can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Analogue {
    /// The first output, the high word.
    dac1: u16,
    /// The second output, the low word.
    dac2: u16,
}

/// What the vendor's sample sends for Extend, and public programs copied: a value that nobody meant.
const VENDOR_SAMPLE: u32 = 0x5678_abcd;

impl Analogue {
    /// Both off.
    pub const OFF: Self = Self { dac1: 0, dac2: 0 };

    /// The nearest to two levels, each taken into 0 to 1.
    #[must_use]
    pub fn from_levels(levels: [f64; 2]) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 65,535")]
        let [dac1, dac2] = levels.map(|level| (level.clamp(0.0, 1.0) * f64::from(u16::MAX)).round() as u16);
        Self { dac1, dac2 }
    }

    /// As levels, 0 to 1.
    #[must_use]
    pub fn levels(self) -> [f64; 2] {
        [self.dac1, self.dac2].map(|word| f64::from(word) / f64::from(u16::MAX))
    }

    /// As they stand in a frame.
    #[must_use]
    pub const fn extend(self) -> u32 {
        (self.dac1 as u32) << 16 | self.dac2 as u32
    }

    /// What stands in a frame.
    #[must_use]
    pub const fn of_extend(extend: u32) -> Self {
        let [a, b, c, d] = extend.to_be_bytes();
        Self { dac1: u16::from_be_bytes([a, b]), dac2: u16::from_be_bytes([c, d]) }
    }

    /// The same, but off where it is the vendor's sample value, which no frame of ours may say.
    #[must_use]
    pub(super) const fn meant(self) -> Self {
        if self.extend() == VENDOR_SAMPLE { Self::OFF } else { self }
    }

    /// Whether two levels may be sent.
    ///
    /// # Errors
    /// Why not, and what to do, where they make the vendor's sample value.
    pub(crate) fn check(levels: [f64; 2]) -> Result<(), &'static str> {
        if Self::from_levels(levels).extend() == VENDOR_SAMPLE {
            return Err(
                "dac1 and dac2 make 0x5678abcd, the constant of the vendor's sample program, which is never sent; \
                        change one of them by 0.0001",
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_become_words_and_words_levels() {
        let half = Analogue::from_levels([0.5, 1.0]);
        assert_eq!((half, half.extend()), (Analogue { dac1: 0x8000, dac2: 0xffff }, 0x8000_ffff));
        assert_eq!(Analogue::from_levels([-1.0, f64::NAN]), Analogue::OFF);
        for extend in [0, 1, 0x8000_ffff, 0x1234_5678, VENDOR_SAMPLE, u32::MAX] {
            let there = Analogue::of_extend(extend);
            assert_eq!((there.extend(), Analogue::from_levels(there.levels())), (extend, there));
        }
    }

    #[test]
    fn the_vendors_sample_value_is_refused_and_off_in_a_frame() {
        let sample = Analogue::of_extend(0x5678_abcd);
        assert_eq!(
            (sample.meant(), sample.levels().map(|l| (l * 1e4).round())),
            (Analogue::OFF, [3378.0, 6711.0])
        );
        assert!(Analogue::check(sample.levels()).is_err());
        let beside = [sample.levels()[0], sample.levels()[1] + 0.0001];
        assert!(Analogue::check(beside).is_ok(), "what the remedy says helps");
        assert_eq!(Analogue::OFF.meant(), Analogue::OFF);
    }
}
