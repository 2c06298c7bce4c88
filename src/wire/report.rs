//! Registers that an IMAX or MBOX controller reports unasked when something is wrong, 0x1001 (IMAX manual 2.2.2.1).

use super::register_request::RegisterWords;

/// High byte of the function.
pub(super) const FAMILY: u8 = 0x10;

/// The monitor register DPFE: which alarm the drives of an IMAX or MBOX controller have, 0 for none. On SMC it is the minor
/// version (2.3.3 of both manuals).
pub(crate) const DPFE: u16 = 0xfe;

/// Controller to host: what stands in these registers; its object channel is 0 for DP, and nobody shall answer.
pub type RegisterReport<'a> = RegisterWords<'a, FAMILY>;
