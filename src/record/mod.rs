//! What was played, on its way into a file: from the tick thread's taps to what viewers open.
//!
//! The tick thread copies what it asked for and what left, octet by octet, into a ring, one chunk a tick, all of it or nothing
//! ([`Tap`]). A thread behind the ring takes chunks apart ([`Chunk`]), folds them into samples ([`Sampled`]) and writes these as MCAP
//! ([`Recording`], `mcap.dev/spec`). It is told no time but that of the ticks.

mod acks;
mod chunk;
mod cursor;
mod intake;
mod recorder;
mod recording;
mod sampled;
mod seat;
mod tap;
#[cfg(test)]
mod tests;

pub(crate) use acks::{AckChunk, AckRecord, AckStanding, latency_ns};
pub use acks::{AckTap, ack_tap};
pub(crate) use chunk::Chunk;
pub use chunk::{Asked, TickHead};
pub(crate) use intake::{Intake, Taps};

pub(crate) use recorder::Recorder;
pub(crate) use recording::{About, Recording, SAMPLE_HZ};
pub(crate) use sampled::{Message, Sampled};
pub use seat::{FrameKind, RecordedSeat};
pub use tap::{Tap, tap};
