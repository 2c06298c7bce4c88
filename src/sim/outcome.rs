//! What became of a virtual controller.

use std::net::SocketAddrV4;

use serde::Serialize;

use super::Counts;

/// What became of one virtual controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// Where it listened.
    pub(crate) address: SocketAddrV4,
    /// What became of its datagrams and moves.
    #[serde(flatten)]
    pub counts: Counts,
    /// Where its working axes ended, pulses.
    pub(crate) positions: Vec<i32>,
    /// Its outputs at the end, bit 0 = Y01.
    pub(crate) outputs: u16,
    /// Its analogue outputs at the end, as the last frame without vibration had them in Extend.
    pub(crate) extend: u32,
}
