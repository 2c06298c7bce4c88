//! What became of the lanes and of what was asked, until whoever leads the hall takes it. What lasts is no event: that is
//! [`super::Engine::progress`].

use crate::belief::Fall;
use crate::plain;

/// What the planner found no move for, while the show goes on without it. In words by its `Display`, without the name of the seat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unplanned {
    /// The seek that was asked for.
    Seek,
    /// The way of this lane into the show, or out of it.
    Lane(usize),
}

plain::displayed!(Unplanned {
    Self::Seek =>
        "the seek was not done: no move within the limits gets there; seek a little earlier or later",
    Self::Lane(_) =>
        "it stays where it is: no move within the limits takes it to its place in the cue; seek elsewhere in the \
         cue, or park",
});

/// Something that happened once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EngineEvent {
    /// Something could not be planned, without ending the show.
    Unplanned(Unplanned),
    /// A move that the show needs could not be planned.
    NoMove,
    /// The limiter has held a lane back three times within a second.
    LimiterFault,
    /// A lane that was away is where the others are again.
    Joined(usize),
    /// A lane has fallen out, and is to be looked at.
    FellOut(usize, Fall),
}

impl EngineEvent {
    /// Whether the later of two takes the place of the other.
    fn replaces(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::FellOut(lane, _), Self::FellOut(other, _)) => lane == other,
            _ => self == other,
        }
    }
}

/// What has happened and was not taken yet, in room that was made before the show. Each lane has each of its events once at the most.
#[derive(Debug)]
pub(crate) struct EngineEvents(Vec<EngineEvent>);

/// EngineEvents that a lane can have at once, and that concern none.
const OF_A_LANE: usize = 3;
const OF_NONE: usize = 3;

impl EngineEvents {
    pub(super) fn of(lanes: usize) -> Self {
        Self(Vec::with_capacity(OF_A_LANE * lanes + OF_NONE))
    }

    pub(super) fn push(&mut self, event: EngineEvent) {
        match self.0.iter().position(|before| event.replaces(before)) {
            Some(place) => self.0[place] = event,
            None if self.0.len() < self.0.capacity() => self.0.push(event),
            // Each has its place: there is room.
            None => {}
        }
    }

    /// Hands over what happened; what `take` says no to is kept for the next time.
    pub(crate) fn take(&mut self, mut take: impl FnMut(EngineEvent) -> bool) {
        self.0.retain(|event| !take(*event));
    }
}
