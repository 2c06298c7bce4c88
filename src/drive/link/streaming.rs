//! What a play on a link is given, and what it tells: poses tick by tick; events for whoever keeps health and belief, and figures that can
//! be copied. The same for all families.

use std::time::Duration;

use super::TalkCounts;
use crate::motion::Pose;
use crate::time::MonoTime;
use crate::wire::FrameNo;
use crate::wire::silvermax::NakReason;

/// How a link plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StreamTerms {
    /// From one segment of an axis to the next.
    pub(crate) period: Duration,
    /// From one pose to the next.
    pub(crate) tick: Duration,
}

/// How long before a seat is there its poses have to come: so many periods of its link, and so many ticks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lead {
    /// Periods.
    pub(crate) periods: u32,
    /// Ticks.
    pub(crate) ticks: u32,
}

impl Lead {
    /// On a link that plays so.
    pub(crate) fn over(self, terms: StreamTerms) -> Duration {
        self.periods * terms.period + self.ticks * terms.tick
    }
}

/// What a lane does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    /// Brakes if it has to, and is looked at until it stands and its drives wait for poses.
    Readying,
    /// Stands, and waits for poses.
    Ready,
    /// Poses come.
    Runs,
    /// Goes to rest, where poses ended or by a brake.
    Ends,
    /// A unit does not answer.
    Lost,
    /// It has to be homed, or at least looked at, by a person.
    Out,
}

/// What happened to a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StreamEvent {
    /// All axes have taken the segments of these frames, or stand where they lead; of drives that confirm nothing one was read where the
    /// last of them leads.
    Confirmed {
        /// The lane.
        lane: u16,
        /// The first that was not told before.
        first: FrameNo,
        /// The last that is covered.
        last: FrameNo,
    },
    /// Frames that it does not follow, since it was told to stop.
    Withdrawn {
        /// The lane.
        lane: u16,
        /// The first.
        first: FrameNo,
        /// The last.
        last: FrameNo,
    },
    /// An axis of a seat that is home was read.
    Read {
        /// The lane.
        lane: u16,
        /// The axis, from 0.
        axis: u8,
        /// Where it is, in strokes.
        position: f64,
        /// Where its drive holds it, in strokes, while it stands; none while it does not, and of one that cannot tell.
        held: Option<f64>,
        /// When.
        at: MonoTime,
    },
    /// All units were asked whether they are home, and have been since.
    Homed {
        /// The lane.
        lane: u16,
        /// They are.
        homed: bool,
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

impl StreamEvent {
    /// The lane that it is about.
    pub(crate) const fn lane(&self) -> u16 {
        match *self {
            Self::Confirmed { lane, .. }
            | Self::Withdrawn { lane, .. }
            | Self::Read { lane, .. }
            | Self::Homed { lane, .. }
            | Self::Rests { lane, .. }
            | Self::Moves { lane, .. }
            | Self::Braked { lane, .. }
            | Self::Lost { lane, .. }
            | Self::Back { lane }
            | Self::Restarted { lane, .. }
            | Self::Killed { lane, .. }
            | Self::Elsewhere { lane, .. }
            | Self::OffCourse { lane, .. }
            | Self::Doubt { lane, .. } => lane,
        }
    }
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

/// A lane as events name it.
pub(crate) fn lane_number(lane: usize) -> u16 {
    u16::try_from(lane).unwrap_or(u16::MAX)
}

/// An axis as events name it.
pub(crate) fn axis_number(axis: usize) -> u8 {
    u8::try_from(axis).unwrap_or(u8::MAX)
}
