//! Vibration of an axis, the "shark data" of 0x1801 and 0x1901 (SMC manual 2.2.2.9 to 2.2.2.12).

use super::bytes::{put_u16, u16_at};

/// Bytes of one axis.
pub(super) const LEN: usize = 4;
/// Steps of a period in one second: 0.125 ms each.
const STEPS_PER_SECOND: f64 = 8_000.0;

/// How many bytes Port Out takes in a frame with vibration, and the inputs in the answer to it. The SMC manual prints 4
/// (2.2.2.9), but so it does for other messages, in which everybody sends and answers 2. Nobody is known to have seen one with
/// vibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum VibrationPort {
    /// As in frames without vibration.
    #[default]
    Two,
    /// As printed: bit 0 = Y01 in the last byte, the first two mean nothing.
    Four,
}

impl VibrationPort {
    /// The one of so many bytes; `None` if that is neither 2 nor 4.
    #[must_use]
    pub(crate) const fn of_bytes(bytes: u8) -> Option<Self> {
        match bytes {
            2 => Some(Self::Two),
            4 => Some(Self::Four),
            _ => None,
        }
    }

    pub(super) const fn len(self) -> usize {
        match self {
            Self::Two => 2,
            Self::Four => 4,
        }
    }
}

/// What shakes an axis about its position; `None` if either number is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Vibration {
    /// Length of one swing to and fro, in steps of 0.125 ms.
    pub period: u16,
    /// How far it swings, pulses.
    pub amplitude: u16,
}

impl Vibration {
    /// No vibration.
    pub const NONE: Self = Self { period: 0, amplitude: 0 };
    /// The farthest swing that a frame can ask for, pulses.
    pub(crate) const MAX_AMPLITUDE: u16 = u16::MAX;

    /// The vibration of `hz` and `amplitude_pulses`, both rounded to what the wire can say: 0.122 to 8,000 Hz, at most
    /// 65,535 pulses. None where either is not above 0.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the range of u16 before"
    )]
    pub(crate) fn from_hz(hz: f64, amplitude_pulses: f64) -> Self {
        let amplitude = amplitude_pulses.round().clamp(0.0, f64::from(Self::MAX_AMPLITUDE)) as u16;
        if hz.is_nan() || hz <= 0.0 || amplitude == 0 {
            return Self::NONE;
        }
        let period = (STEPS_PER_SECOND / hz).round().clamp(1.0, f64::from(u16::MAX)) as u16;
        Self { period, amplitude }
    }

    /// Swings per second; `None` if the axis does not vibrate.
    #[must_use]
    pub fn hz(self) -> Option<f64> {
        (self.period != 0 && self.amplitude != 0).then(|| STEPS_PER_SECOND / f64::from(self.period))
    }

    /// Writes the four bytes of one axis.
    pub(super) fn put(self, bytes: &mut [u8], at: usize) {
        put_u16(bytes, at, self.period);
        put_u16(bytes, at + 2, self.amplitude);
    }

    /// Reads the four bytes of one axis.
    pub(super) fn at(bytes: &[u8], at: usize) -> Self {
        Self { period: u16_at(bytes, at), amplitude: u16_at(bytes, at + 2) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_hertz_are_400_steps() {
        let shake = Vibration::from_hz(20.0, 500.4);
        assert_eq!(shake, Vibration { period: 400, amplitude: 500 });
        assert_eq!(shake.hz(), Some(20.0));
    }

    #[test]
    fn what_the_wire_cannot_say_is_its_nearest_end() {
        assert_eq!(Vibration::from_hz(0.001, 1e9), Vibration { period: 65_535, amplitude: 65_535 });
        assert_eq!(Vibration::from_hz(1e9, 1.0), Vibration { period: 1, amplitude: 1 });
    }

    #[test]
    fn no_speed_or_no_size_is_no_vibration() {
        for (hz, pulses) in
            [(0.0, 5.0), (-1.0, 5.0), (f64::NAN, 5.0), (20.0, 0.4), (20.0, -3.0), (20.0, f64::NAN)]
        {
            assert_eq!(Vibration::from_hz(hz, pulses), Vibration::NONE, "{hz} Hz, {pulses} pulses");
        }
    }
}
