//! The status report of an SMC controller, 0x3101, sent unasked (SMC manual 2.2.2.15).

use super::bytes::{count, i32_at, put_i32, put_u16, u16_at};
use super::header;
use super::{Code, MAX_LEN, PerAxis, WireError};
use crate::motion::{MAX_AXES, Pulses};

mod field {
    pub(super) const ID: usize = 6; // u16, PA12 and PA13
    pub(super) const AXES: usize = 8; // u16
    pub(super) const POSITIONS: usize = 10; // n x i32
    pub(super) const TAIL_LEN: usize = 6; // after 8 bytes for each axis: error, outputs, inputs, u16 each
}

const FUNCTION: u16 = 0x3101;
/// High byte of the function.
pub(super) const FAMILY: u8 = 0x31;

/// Controller to host: positions, forces and errors of all axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status {
    /// The station that reports (PA12, PA13).
    pub station: Code,
    /// Position of each axis.
    pub positions: PerAxis<Pulses>,
    /// Force of each axis, in the drive's own unit; as many as there are positions, missing ones are sent as 0.
    pub forces: PerAxis<i16>,
    /// Error number of each drive; as many as there are positions, missing ones are sent as 0.
    pub servo_errors: PerAxis<u16>,
    /// Error number of the controller; 0 for none.
    pub error: u16,
    /// Outputs, bit 0 = Y01.
    pub outputs: u16,
    /// Inputs, bit 0 = X01.
    pub inputs: u16,
}

impl Status {
    /// Bytes for `axes` axes: 40 for three, 64 for six, 112 for twelve.
    #[must_use]
    pub(crate) const fn len(axes: usize) -> usize {
        field::POSITIONS + 8 * axes + field::TAIL_LEN
    }

    /// Writes the report to the front of `buf` and returns it.
    pub fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let axes = self.positions.len();
        header::open(buf, FUNCTION);
        put_u16(buf, field::ID, self.station.0);
        put_u16(buf, field::AXES, count(axes));
        let (forces, errors, tail) = places(axes);
        for axis in 0..axes {
            put_i32(buf, field::POSITIONS + 4 * axis, self.positions[axis].0);
            let force = self.forces.get(axis).copied().unwrap_or(0);
            put_u16(buf, forces + 2 * axis, force.cast_unsigned());
            put_u16(buf, errors + 2 * axis, self.servo_errors.get(axis).copied().unwrap_or(0));
        }
        put_u16(buf, tail, self.error);
        put_u16(buf, tail + 2, self.outputs);
        put_u16(buf, tail + 4, self.inputs);
        &buf[..Self::len(axes)]
    }

    /// Reads a report.
    ///
    /// # Errors
    /// [`WireError::Axes`] unless it counts 1 to 12 axes, [`WireError::Length`] or [`WireError::Surplus`] unless its
    /// length fits them exactly (the manual's table can be read in two ways), and those of a broken opening.
    pub fn parse(bytes: &[u8]) -> Result<Self, WireError> {
        if bytes.len() < field::POSITIONS {
            return Err(WireError::Short { len: bytes.len(), need: field::POSITIONS });
        }
        let found = header::function_at(bytes)?;
        if found != FUNCTION {
            return Err(WireError::Function { found });
        }
        let counted = u16_at(bytes, field::AXES);
        let axes = usize::from(counted);
        if axes == 0 || axes > MAX_AXES {
            return Err(WireError::Axes { at: field::AXES, found: counted });
        }
        WireError::unless_exactly(Self::len(axes), bytes)?;
        let (forces, errors, tail) = places(axes);
        Ok(Self {
            station: Code(u16_at(bytes, field::ID)),
            positions: PerAxis::from_fn(axes, |axis| Pulses(i32_at(bytes, field::POSITIONS + 4 * axis))),
            forces: PerAxis::from_fn(axes, |axis| u16_at(bytes, forces + 2 * axis).cast_signed()),
            servo_errors: PerAxis::from_fn(axes, |axis| u16_at(bytes, errors + 2 * axis)),
            error: u16_at(bytes, tail),
            outputs: u16_at(bytes, tail + 2),
            inputs: u16_at(bytes, tail + 4),
        })
    }
}

/// Where forces, drive errors and the rest begin.
const fn places(axes: usize) -> (usize, usize, usize) {
    let forces = field::POSITIONS + 4 * axes;
    (forces, forces + 2 * axes, forces + 4 * axes)
}
