//! Frames on a CAN bus: the address is in the identifier, the other eight octets are the data (manual, page 21).

use super::SixpackFrame;

/// Identifiers of an address, of which it is the first.
const IDS_OF_AN_ADDRESS: u16 = 8;

/// The bits of an identifier that are 0 in all of theirs.
pub(crate) const ID_ZEROS: u16 = IDS_OF_AN_ADDRESS - 1;

/// A frame of a CAN bus with an identifier of eleven bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CanFrame {
    /// Eleven bits.
    pub(crate) id: u16,
    /// The command and P0 to P6.
    pub(crate) octets: [u8; 8],
}

/// Why a CAN frame is none of a SIXpack 2: its identifier is not eight times an address from 1 to 255.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("identifier {id:#05x} is not eight times an address from 1 to 255")]
pub(crate) struct CanFrameError {
    /// The identifier.
    pub(crate) id: u16,
}

impl From<SixpackFrame> for CanFrame {
    /// Address 0, which no unit has, gives an identifier that no unit listens to.
    fn from(frame: SixpackFrame) -> Self {
        let [address, octets @ ..] = frame.octets();
        Self { id: u16::from(address) * IDS_OF_AN_ADDRESS, octets }
    }
}

impl TryFrom<CanFrame> for SixpackFrame {
    type Error = CanFrameError;

    /// # Errors
    /// [`CanFrameError`] where no unit has such an identifier.
    fn try_from(frame: CanFrame) -> Result<Self, CanFrameError> {
        let address = u8::try_from(frame.id / IDS_OF_AN_ADDRESS);
        match address {
            Ok(address @ 1..) if frame.id.is_multiple_of(IDS_OF_AN_ADDRESS) => {
                let [command, parameters @ ..] = frame.octets;
                Ok(Self { address, command, parameters })
            }
            _ => Err(CanFrameError { id: frame.id }),
        }
    }
}
