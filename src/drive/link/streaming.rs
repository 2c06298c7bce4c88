//! What a play on a link is given, and what it tells: poses tick by tick; events for whoever keeps health and belief, and figures that can
//! be copied. The same for all families.

use std::time::Duration;

use super::TalkCounts;
use crate::motion::{MAX_AXES, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;
use crate::wire::silvermax::NakReason;

/// A pose of a lane, as it comes tick by tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinkPose {
    /// The lane, from 0.
    pub(crate) lane: u16,
    /// The frame that it is.
    pub(crate) frame: FrameNo,
    /// When the seat is to be there: the lead of its family after the tick.
    pub(crate) at: MonoTime,
    /// Until the next, ms.
    pub(crate) lasts_ms: u32,
    /// In strokes.
    pub(crate) axes: Pose,
    /// Hz, and amplitude in strokes.
    pub(crate) vibration: [(f64, f64); MAX_AXES],
}

/// How a link plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StreamTerms {
    /// From one segment of an axis to the next.
    pub(crate) period: Duration,
    /// From one pose to the next.
    pub(crate) tick: Duration,
}

/// What happened to a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StreamEvent {
    /// All axes have taken the segments up to that frame.
    Confirmed {
        /// The lane.
        lane: u16,
        /// The last frame that is covered.
        frame: FrameNo,
    },
    /// What leads it up to that frame was sent to drives that confirm nothing.
    Sent {
        /// The lane.
        lane: u16,
        /// The last frame that is covered.
        frame: FrameNo,
    },
    /// It is at rest, or will be then.
    Rests {
        /// The lane.
        lane: u16,
        /// Where, in strokes.
        axes: Pose,
        /// From when on.
        at: MonoTime,
    },
    /// It moves.
    Moves {
        /// The lane.
        lane: u16,
        /// From when on.
        at: MonoTime,
    },
    /// It brakes, for a reason that is none of the poses.
    Braked {
        /// The lane.
        lane: u16,
        /// Why.
        why: BrakeReason,
    },
    /// A unit does not answer any more.
    Lost {
        /// The lane.
        lane: u16,
        /// The axis, from 0; the first where the port is gone.
        axis: u8,
    },
    /// All units answer again, and none was restarted: it stands where it stands.
    Back {
        /// The lane.
        lane: u16,
    },
    /// A unit was restarted: it does not know its zero.
    Restarted {
        /// The lane.
        lane: u16,
        /// The axis, from 0.
        axis: u8,
    },
    /// A unit let go of its motor.
    Killed {
        /// The lane.
        lane: u16,
        /// The axis, from 0.
        axis: u8,
        /// What killed, as in register 211: the bits in the upper word.
        cause: i32,
    },
    /// The first pose is not where an axis stands: it is not followed.
    Elsewhere {
        /// The lane.
        lane: u16,
        /// The axis, from 0.
        axis: u8,
        /// How far, mm.
        by_mm: f64,
    },
    /// An axis is not where its segments lead.
    OffCourse {
        /// The lane.
        lane: u16,
        /// The axis, from 0.
        axis: u8,
        /// How far, mm.
        by_mm: f64,
    },
    /// It is not known whether an axis has taken a segment.
    Doubt {
        /// The lane.
        lane: u16,
        /// The axis, from 0.
        axis: u8,
    },
}

/// Why a lane brakes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BrakeReason {
    /// Somebody asked for it.
    Stopped,
    /// Poses ended while it moved.
    PosesEnded,
    /// Its queue ran dry.
    Dry,
    /// A segment was refused.
    Refused(NakReason),
    /// What was in doubt stayed so.
    InDoubt,
    /// Poses came faster than segments went.
    Behind,
}

/// What became of the segments of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Account {
    /// Segments that were made.
    pub(crate) made: u64,
    /// Times one was sent.
    pub(crate) sent: u64,
    /// Taken.
    pub(crate) acked: u64,
    /// The queue was full: sent again, no fault.
    pub(crate) again: u64,
    /// Not taken.
    pub(crate) refused: u64,
    /// Why the last of these was not.
    pub(crate) reason: Option<NakReason>,
    /// Not answered.
    pub(crate) in_doubt: u64,
    /// Of those, the ones that were not taken, and sent again.
    pub(crate) lost: u64,
    /// Made and not sent any more: it braked.
    pub(crate) skipped: u64,
    /// Two ticks each, put in to count what is in a queue.
    pub(crate) fillers: u64,
}

/// How an axis stands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct AxisFigures {
    /// Its segments.
    pub(crate) account: Account,
    /// Where it was last read, in strokes.
    pub(crate) position: f64,
    /// How far the motor was beside its target when both were read last, mm.
    pub(crate) error_mm: f64,
    /// The farthest that it was beside its segments, mm.
    pub(crate) off_course_mm: f64,
    /// Segments that wait, and the one that runs.
    pub(crate) queued: usize,
    /// How often its queue ran dry in motion.
    pub(crate) dry: u64,
    /// Of its ticks to ours.
    pub(crate) clock: f64,
    /// Its last status of events (POL).
    pub(crate) poll: u16,
    /// It is too hot.
    pub(crate) is_hot: bool,
}

/// How a link stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct LinkFigures {
    /// Its exchanges.
    pub(crate) talk: TalkCounts,
    /// What 99 of 100 answers take to begin.
    pub(crate) delay_p99: Duration,
    /// Events that nobody took.
    pub(crate) events_lost: u64,
    /// Poses for lanes that could not take them.
    pub(crate) poses_skipped: u64,
}
