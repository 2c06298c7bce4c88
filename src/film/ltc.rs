//! Linear timecode: sound into labels, and the instant at which each frame ends. Either way, at any speed from a tenth to the
//! quintuple, and never a label that was not sent: what cannot be made sure of is left out, for an estimate runs through that and
//! not through a wrong place. On a reader's thread; told the samples and the time of each block.

mod cells;
mod decoder;
mod edges;
mod generator;
mod reader;
#[cfg(test)]
mod tests;
mod word;

pub(crate) use decoder::{LtcDecoder, LtcFrame};
pub(crate) use generator::LtcGenerator;
pub(crate) use reader::LtcReader;

use super::timecode::{Label, Timecode};
