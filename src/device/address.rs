//! Which register is meant: a parameter, a monitor register, or one of a servo drive.

use std::fmt;

use serde::{Serialize, Serializer};

/// The monitor register at which the control registers DPF0 to DPFF begin.
pub(super) const CONTROL: u8 = 0xf0;

/// One register of a controller, or of a servo drive behind it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Address {
    /// A parameter, PA00 to PAff.
    Pa(u8),
    /// A monitor register, DP00 to DPef, or a control register, DPF0 to DPFF.
    Dp(u8),
    /// A parameter of a servo drive.
    Servo {
        /// The drive, counted from 1.
        servo: u16,
        /// Its parameter number, as the drive's own manual counts.
        number: u16,
    },
}

impl Address {
    /// The register `steps` further on in the same table; none past its end.
    #[must_use]
    pub(crate) fn after(self, steps: u16) -> Option<Self> {
        let narrow = |number: u8| u8::try_from(u16::from(number).checked_add(steps)?).ok();
        match self {
            Self::Pa(number) => narrow(number).map(Self::Pa),
            Self::Dp(number) => narrow(number).map(Self::Dp),
            Self::Servo { servo, number } => {
                number.checked_add(steps).map(|number| Self::Servo { servo, number })
            }
        }
    }

    /// True if it belongs to a drive.
    #[must_use]
    pub(crate) const fn is_servo(self) -> bool {
        matches!(self, Self::Servo { .. })
    }
}

/// As the manuals write it: `PA0b`, `DP5e`, `DPF0`, `servo 1 508`.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Pa(number) => write!(f, "PA{number:02x}"),
            Self::Dp(number @ CONTROL..) => write!(f, "DP{number:02X}"),
            Self::Dp(number) => write!(f, "DP{number:02x}"),
            Self::Servo { servo, number } => write!(f, "servo {servo} {number}"),
        }
    }
}

impl Serialize for Address {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_are_written_as_the_manuals_write_them() {
        let all = [
            Address::Pa(0x0b),
            Address::Dp(0x5e),
            Address::Dp(0xf0),
            Address::Servo { servo: 1, number: 508 },
        ];
        assert_eq!(all.map(|address| address.to_string()), ["PA0b", "DP5e", "DPF0", "servo 1 508"]);
    }

    #[test]
    fn no_register_follows_the_last_of_its_table() {
        assert_eq!(Address::Pa(0xfe).after(1), Some(Address::Pa(0xff)));
        assert_eq!(Address::Pa(0xfe).after(2), None);
        assert_eq!(Address::Servo { servo: 1, number: 65_535 }.after(1), None);
    }
}
