//! What the lanes do at present, with what belongs to it.

use std::time::Duration;

use super::replan::Replan;
use super::{Show, millis};
use crate::plan::Course;
use crate::time::{Rate, ShowTime};
use crate::wire::Timing;

/// What a controller takes for its first absolute frame at the most (PA09, IMAX manual 2.3.1).
pub(super) const FIRST_ABSOLUTE_MS: u32 = 100;

/// For how long frames hold a lane that has come to rest, and three at the least: if none of them arrives, that is known by then, and
/// what it has on does not stay on.
const HOLD: Duration = Duration::from_millis(70);

/// Hold frames that end a motion.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "70 of a thousand a second")]
pub(super) fn hold_frames(rate: Rate) -> u8 {
    (HOLD.as_secs_f64() * rate.hz()).round().clamp(3.0, 255.0) as u8
}

/// Why lanes rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rest {
    /// Frames stopped for too long; the film runs on.
    Late,
    /// The film that is chased has jumped, or can be followed and the way onto the cue is not known yet.
    Film,
    /// The cue is over, and the way on from there not known yet.
    Ended,
    /// Somebody, or the hall's policy, asked for a pause; the film waits.
    Paused,
    /// Somebody, or a fault, stopped the show: no frames go out.
    Stopped,
}

/// What the lanes do.
#[derive(Debug)]
pub(super) enum Phase {
    /// Loaded, and nobody has let it go: no frame goes out.
    Waiting(Box<Course>),
    /// Repeats the park pose once, so that no motion hangs on how a controller times its first absolute frame.
    Settling(Box<Course>),
    /// On a course that leads onto the cue.
    Following(Following),
    /// Coming to rest.
    Braking(Rest),
    /// Holds the last poses until a course leads on.
    Holding(Holding),
    Parking(Box<Course>),
    /// At the end of the way to park, with so many frames to go that say so.
    Closing(Box<Course>, u16),
    Done,
}

/// Lanes that follow.
#[derive(Debug)]
pub(super) struct Following {
    pub(super) course: Box<Course>,
    /// What it changes to.
    pub(super) next: Option<Replan>,
    /// What was to follow the end of the cue, while something else is asked for: should the planner be slow, and the cue end before
    /// its answer, the lanes go on so.
    pub(super) after_end: Option<Replan>,
}

impl Following {
    pub(super) const fn on(course: Box<Course>) -> Self {
        Self { course, next: None, after_end: None }
    }

    /// What it changes to, and what it may.
    pub(super) fn replans(&self) -> impl Iterator<Item = &Replan> {
        self.next.iter().chain(&self.after_end)
    }

    /// Changes to something else. Gives back what that leaves nobody waiting for.
    fn set_next(&mut self, replan: Replan) -> [Option<Replan>; 2] {
        let ends = replan.goal.is_after_the_end();
        let before = self.next.replace(replan);
        if ends {
            return [before, self.after_end.take()];
        }
        if self.after_end.is_none() && before.as_ref().is_some_and(|before| before.goal.is_after_the_end()) {
            self.after_end = before;
            return [None, None];
        }
        [before, None]
    }
}

/// Lanes that hold.
#[derive(Debug)]
pub(super) struct Holding {
    pub(super) why: Rest,
    /// What leads on.
    pub(super) next: Option<Replan>,
    /// Hold frames that are yet to be sent. Where the show is to go on soon each tick sends one. Else they end with the rest's first
    /// tenth of a second: one that came later would take a seat back that somebody has moved by hand meanwhile.
    pub(super) frames: u16,
}

impl Phase {
    /// What the first frame does.
    pub(super) fn first(show: &Show, course: Box<Course>) -> Self {
        // A longer first Time would be cut to that, and its way be done faster than the limits allow.
        let settles = show.timing == Timing::Absolute && show.rate.period() > millis(FIRST_ABSOLUTE_MS);
        if settles { Self::Settling(course) } else { Self::Following(Following::on(course)) }
    }

    /// Why the lanes rest, or come to rest; none where they do not.
    pub(super) const fn rest(&self) -> Option<Rest> {
        match self {
            Self::Braking(why) | Self::Holding(Holding { why, .. }) => Some(*why),
            _ => None,
        }
    }

    pub(super) const fn is_following(&self) -> bool {
        matches!(self, Self::Following(_))
    }

    /// The course that lanes are on; none where no lane is on one.
    pub(super) fn course(&mut self) -> Option<&mut Course> {
        match self {
            Self::Waiting(course)
            | Self::Settling(course)
            | Self::Following(Following { course, .. })
            | Self::Parking(course)
            | Self::Closing(course, _) => Some(course),
            Self::Braking(_) | Self::Holding(_) | Self::Done => None,
        }
    }

    /// The place of what leads on from here; none where nothing does.
    pub(super) fn next(&mut self) -> Option<&mut Option<Replan>> {
        match self {
            Self::Following(Following { next, .. }) | Self::Holding(Holding { next, .. }) => Some(next),
            _ => None,
        }
    }

    /// Whether a change of course is under way for which levels have to stand, and show time to run as it does.
    pub(super) fn is_to_change(&self) -> bool {
        match self {
            Self::Following(Following { next, .. }) | Self::Holding(Holding { next, .. }) => {
                next.as_ref().is_some_and(|next| !next.goal.is_after_the_end())
            }
            _ => false,
        }
    }

    /// Changes to something else. Gives back what that leaves nobody waiting for.
    pub(super) fn set_next(&mut self, replan: Replan) -> [Option<Replan>; 2] {
        match self {
            Self::Following(following) => following.set_next(replan),
            Self::Holding(holding) => [holding.next.replace(replan), None],
            _ => [Some(replan), None],
        }
    }

    /// What is due to lead on, show time being `now`.
    pub(super) fn take_due(&mut self, now: ShowTime) -> Option<Replan> {
        let is_due = |replan: &mut Replan| replan.is_due(now);
        match self {
            Self::Following(Following { next, after_end, .. }) => {
                next.take_if(is_due).or_else(|| after_end.take_if(is_due))
            }
            Self::Holding(holding) => holding.next.take_if(is_due),
            _ => None,
        }
    }

    /// What was to lead on, and does no more.
    pub(super) fn take_replans(&mut self) -> [Option<Replan>; 2] {
        match self {
            Self::Following(following) => [following.next.take(), following.after_end.take()],
            Self::Holding(holding) => [holding.next.take(), None],
            _ => [None, None],
        }
    }

    /// Goes on in another phase on the course of this one.
    pub(super) fn carry(&mut self, on: impl FnOnce(Box<Course>) -> Self) {
        let before = std::mem::replace(self, Self::Done);
        *self = before.into_course().map_or(Self::Done, on);
    }

    /// The course that was followed, as the phase is left.
    pub(super) fn into_course(self) -> Option<Box<Course>> {
        let (Self::Following(Following { course, .. })
        | Self::Waiting(course)
        | Self::Settling(course)
        | Self::Parking(course)
        | Self::Closing(course, _)) = self
        else {
            return None;
        };
        Some(course)
    }
}
