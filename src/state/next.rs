//! What a person does next.

use super::{Cause, Latch, Machine, PlayMode, Readiness, State, Trouble};
use crate::film::chase::HoldCause;

/// What a person does next; worded by its `Display`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Next {
    /// Wait until every controller has answered.
    AwaitAnswers,
    /// Wait until the positions are read, then park.
    AwaitPositions,
    /// Wait until the seats are home.
    AwaitHome,
    /// Wait until the seats are at rest.
    AwaitRest,
    /// Park, or home.
    ParkOrHome,
    /// Park, or start a show: a seat is not at park.
    ParkOrStart,
    /// Home: a position is unknown.
    Home,
    /// Load a cue.
    Load,
    /// Prove the cue for these seats.
    Prove,
    /// Run preflight.
    Preflight,
    /// Arm.
    Arm,
    /// Arm, with nobody on the seats: they home first.
    ArmAndHome,
    /// Go, or disarm.
    Go,
    /// Nothing has to be done.
    Watch,
    /// Nothing: the seats join again by themselves.
    AwaitJoin,
    /// See to the film: the seats join it by themselves.
    AwaitFilm,
    /// Resume: the film could be joined, and a person is to say so. Or park.
    LetJoin,
    /// Resume, or park.
    Resume,
    /// Release the emergency stop, then clear.
    Release,
    /// Put the error right at the controller, then clear.
    PutRight,
    /// Wait until the seats stand still by themselves, then clear.
    AwaitStandstill,
    /// Check the cue against the seats, then clear.
    CheckCue,
    /// Look at the seat, then clear and home again.
    LookAtSeat,
    /// Stop the other master, then clear.
    StopOtherMaster,
    /// Clear, then park or home.
    Clear,
    /// Clear; where that does not help, start the service anew.
    Restart,
}

impl Next {
    /// All there are.
    #[cfg(test)]
    pub(crate) const ALL: [Self; 26] = [
        Self::AwaitAnswers,
        Self::AwaitPositions,
        Self::AwaitHome,
        Self::AwaitRest,
        Self::ParkOrHome,
        Self::ParkOrStart,
        Self::Home,
        Self::Load,
        Self::Prove,
        Self::Preflight,
        Self::Arm,
        Self::ArmAndHome,
        Self::Go,
        Self::Watch,
        Self::AwaitJoin,
        Self::AwaitFilm,
        Self::LetJoin,
        Self::Resume,
        Self::Release,
        Self::PutRight,
        Self::AwaitStandstill,
        Self::CheckCue,
        Self::LookAtSeat,
        Self::StopOtherMaster,
        Self::Clear,
        Self::Restart,
    ];
}

impl Machine {
    /// What a person does next.
    #[must_use]
    pub(crate) const fn next(&self) -> Next {
        match self.state {
            State::Boot => Next::AwaitAnswers,
            State::Recovering => self.next_recovering(),
            State::Parked => self.next_parked(),
            State::Homing => Next::AwaitHome,
            State::Armed => Next::Go,
            State::Playing(PlayMode::Holding) => Next::AwaitJoin,
            State::Playing(PlayMode::Waiting) => match self.cause {
                Cause::FilmAwaited(HoldCause::Unstable | HoldCause::Asks) => Next::LetJoin,
                Cause::FilmAwaited(HoldCause::Behind) => Next::AwaitJoin,
                _ => Next::AwaitFilm,
            },
            State::Playing(_) => Next::Watch,
            State::Paused => Next::Resume,
            State::Stopping | State::Parking => Next::AwaitRest,
            State::Stopped | State::Fault => self.next_latched(),
        }
    }

    const fn next_recovering(&self) -> Next {
        if !self.facts.identified {
            Next::AwaitAnswers
        } else if !self.facts.homed {
            Next::Home
        } else if !self.facts.measured {
            Next::AwaitPositions
        } else if matches!(self.facts.latch, Latch::Over) {
            Next::Clear
        } else if matches!((self.cause, self.facts.readiness), (Cause::TookOver, Readiness::Ready)) {
            Next::Resume
        } else {
            Next::ParkOrHome
        }
    }

    const fn next_parked(&self) -> Next {
        match self.facts.readiness {
            _ if matches!(self.facts.latch, Latch::Over) => Next::Clear,
            _ if matches!(self.facts.latch, Latch::Held) => Next::PutRight,
            Readiness::Ready if !self.facts.homed => Next::ArmAndHome,
            _ if self.facts.astray => Next::ParkOrStart,
            Readiness::NoCue => Next::Load,
            Readiness::NotProved => Next::Prove,
            Readiness::NotPreflighted => Next::Preflight,
            Readiness::Ready => Next::Arm,
        }
    }

    const fn next_latched(&self) -> Next {
        if self.facts.pressed {
            return Next::Release;
        }
        if !self.facts.identified {
            return Next::AwaitAnswers;
        }
        match self.cause {
            Cause::StoppedHoming => Next::AwaitStandstill,
            Cause::Trouble(Trouble::Limiter) => Next::CheckCue,
            Cause::Trouble(Trouble::Homing(_) | Trouble::HomingTime) => Next::LookAtSeat,
            Cause::Trouble(Trouble::OtherMaster(_)) => Next::StopOtherMaster,
            Cause::Trouble(Trouble::Deaf) => Next::Restart,
            _ => Next::Clear,
        }
    }
}
