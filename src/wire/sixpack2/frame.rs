//! Nine octets, always (manual, page 21).

/// Octets of a frame on a serial line.
pub(crate) const FRAME_LEN: usize = 9;

/// A frame either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SixpackFrame {
    /// To a unit its number; of an answer what its query named for it.
    pub(crate) address: u8,
    /// The command, or that of the query.
    pub(crate) command: u8,
    /// P0 to P6; those that a command does not use are 0.
    pub(crate) parameters: [u8; 7],
}

impl SixpackFrame {
    /// As it goes over a serial line.
    #[must_use]
    pub(crate) const fn octets(self) -> [u8; FRAME_LEN] {
        let [p0, p1, p2, p3, p4, p5, p6] = self.parameters;
        [self.address, self.command, p0, p1, p2, p3, p4, p5, p6]
    }

    /// Of what came over a serial line: any nine octets are a frame.
    #[must_use]
    pub(crate) const fn from_octets(octets: [u8; FRAME_LEN]) -> Self {
        let [address, command, p0, p1, p2, p3, p4, p5, p6] = octets;
        Self { address, command, parameters: [p0, p1, p2, p3, p4, p5, p6] }
    }
}
