//! What is known of a seat, and what is told about it.

use super::Source;
use crate::motion::Pose;
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// What is known of where the axes of a seat are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Known {
    /// Nothing: they may be anywhere in their strokes.
    Nothing,
    /// They were read, at that instant and from there.
    Measured(MonoTime, Source),
    /// The newest frame was acked; that was seen at this instant.
    Confirmed(MonoTime),
    /// The newest frames are not confirmed, the oldest of them since this instant. Where no acks are asked for this is all
    /// there ever is.
    Commanded(MonoTime),
    /// They were found elsewhere than the frames that were confirmed had led them, and are not at rest.
    Contradicted(MonoTime),
}

/// What the check before the kernel has done for one lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Tally {
    /// Frames that were not sent, because from somewhere that the seat may be they would have been too fast.
    pub(crate) withheld: u64,
    /// Frames that fell short of their pose, or took longer than a tick, as those before them might not have arrived.
    pub(crate) held_back: u64,
    /// Gaps in which it was not known which frames arrive.
    pub(crate) gaps: u64,
    /// Frames that reached a controller which was still busy with the one before, by the sum of their Times.
    pub(crate) late: u64,
    /// Frames that reached one with more than two still to do: it plays them faster than they say (PA06).
    pub(crate) hurried: u64,
}

/// What a look at the evidence has brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Found {
    /// Nothing that keeps frames from leading the seat on.
    Nothing,
    /// From now on nobody knows which frames arrive.
    Gap,
    /// The seat is elsewhere than its frames have led it, though they are acked.
    Astray,
}

/// Why nobody knows where a seat is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fall {
    /// Nobody knows which frames reached it.
    Gap,
    /// It was found elsewhere than acked frames led it.
    Astray,
    /// It was out, and is to take part again.
    PutBack,
    /// It was found, but what was read of it is not of now.
    Stale,
    /// Its drives were told to stop, ahead of where poses have led it.
    Stopped,
}

/// A frame that the kernel took.
#[derive(Debug, Clone, Copy)]
pub struct Taken<'a> {
    /// Its number.
    pub frame: FrameNo,
    /// Whether it asks for an ack.
    pub asked: bool,
    /// Where it leads, as fractions of each slot's stroke.
    pub pose: &'a Pose,
    /// How long it takes, ms.
    pub lasts_ms: u32,
    /// How long it takes where the network has let a later one overtake it, ms.
    pub at_most_ms: u32,
    /// The greatest amplitude of vibration that it asks of any slot, strokes.
    pub shakes: f64,
    /// When it was sent.
    pub at: MonoTime,
}
