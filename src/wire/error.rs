//! Why bytes are no message, and what the numbers mean that a controller puts into its replies.

use std::fmt;

/// Why bytes are not a message of the protocol, and at which byte (counted from 0) that shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WireError {
    /// It ends inside its header.
    #[error("byte {len}: ends after {len} bytes, inside the header; {need} are needed")]
    Short {
        /// Bytes there are.
        len: usize,
        /// Bytes the header takes.
        need: usize,
    },
    /// It does not open with the confirm code of its function.
    #[error("byte 0: confirm code {found:04x} where {expected:04x} belongs")]
    Confirm {
        /// What it opens with.
        found: u16,
        /// What its function asks for.
        expected: u16,
    },
    /// The pass code is not zero.
    #[error("byte 2: pass code {found:04x} where 0000 belongs")]
    Pass {
        /// What stands there.
        found: u16,
    },
    /// No function, or not one of those asked for.
    #[error("byte 4: function code {found:04x} does not belong here")]
    Function {
        /// What stands there.
        found: u16,
    },
    /// The object channel, or the count of axes, fits no number of axes from 1 to 12.
    #[error("byte {at}: {found} does not fit 3 to 12 axes")]
    Axes {
        /// Where the channel or count stands.
        at: usize,
        /// What stands there.
        found: u16,
    },
    /// It is shorter than its function, channel and counts say.
    #[error("byte {len}: ends after {len} bytes; this message takes {need}")]
    Length {
        /// Bytes there are.
        len: usize,
        /// Bytes its layout takes.
        need: usize,
    },
    /// It is longer than its layout, where nothing may follow.
    #[error("byte {need}: continues to {len} bytes; this message takes {need}")]
    Surplus {
        /// Bytes there are.
        len: usize,
        /// Bytes its layout takes.
        need: usize,
    },
    /// It counts more registers than the controller has.
    #[error("byte {at}: {found} registers at once; at most {max} are possible")]
    Count {
        /// Where the count stands.
        at: usize,
        /// What stands there.
        found: u16,
        /// The most there can be.
        max: u16,
    },
}

impl WireError {
    /// That a message is shorter or longer than the `need` bytes it takes.
    pub(super) const fn unless_exactly(need: usize, bytes: &[u8]) -> Result<(), Self> {
        let len = bytes.len();
        if len < need {
            return Err(Self::Length { len, need });
        }
        if len > need {
            return Err(Self::Surplus { len, need });
        }
        Ok(())
    }

    /// The byte at which the fault shows, counted from 0.
    #[must_use]
    pub const fn offset(self) -> usize {
        match self {
            Self::Confirm { .. } => 0,
            Self::Pass { .. } => 2,
            Self::Function { .. } => 4,
            Self::Axes { at, .. } | Self::Count { at, .. } => at,
            Self::Short { len, .. } | Self::Length { len, .. } => len,
            Self::Surplus { need, .. } => need,
        }
    }
}

/// An error number of a controller, shown in words (chapter 6 of both manuals).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceError(pub(crate) u16);

impl fmt::Display for DeviceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = self.0;
        match number {
            0 => f.write_str("unspecified"),
            1..=6 => write!(f, "Err{number}: no communication with the servo of axis {number}"),
            7 => f.write_str("Err7: the servo is of another model"),
            10..=15 => write!(f, "Err{number}: alarm of the servo of axis {}", number - 9),
            17 => f.write_str("Err17: the play time is too long at the start"),
            20 => f.write_str("Err20: UDP memory overflow"),
            21 => f.write_str("Err21: UDP data buffer overflow; needs a reset"),
            _ => write!(f, "Err{number}: not in the manual"),
        }
    }
}
