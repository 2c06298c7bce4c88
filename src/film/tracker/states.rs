//! What becomes of the state of a source by what happens: one table.

use crate::film::point::FilmState;

/// What happens to a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SourceSign {
    /// A position came.
    Sample,
    /// One came that fits the estimate.
    Fit,
    /// The lock rule holds.
    Sure,
    /// The estimate has become too uncertain to follow.
    Doubt,
    /// No lock for too long.
    GiveUp,
    /// Samples are missing.
    Miss,
    /// They have been missing for longer than the cause allows.
    TimeOut,
    /// It was stopped: somebody said so, or its place does not change.
    Stop,
    /// It runs: somebody said so, or its place changes.
    Play,
    /// It is being wound.
    Seek,
    /// The film is over.
    End,
    /// Whoever told is gone.
    Gone,
    /// The samples agree that it is elsewhere.
    Jump,
    /// It runs backwards.
    Backward,
    /// It runs at a speed that seats may not follow.
    OutOfBand,
    /// It has run at one that they may for long enough.
    InBand,
}

impl SourceSign {
    #[cfg(test)]
    pub(super) const ALL: [Self; 16] = [
        Self::Sample,
        Self::Fit,
        Self::Sure,
        Self::Doubt,
        Self::GiveUp,
        Self::Miss,
        Self::TimeOut,
        Self::Stop,
        Self::Play,
        Self::Seek,
        Self::End,
        Self::Gone,
        Self::Jump,
        Self::Backward,
        Self::OutOfBand,
        Self::InBand,
    ];
}

/// The state after a sign. A told stop goes before all but play: what is stopped is not lost, wound or unusable.
#[rustfmt::skip] // A row for a sign, as a table.
pub(super) const fn next(state: FilmState, sign: SourceSign) -> FilmState {
    use FilmState::{
        Absent, Acquiring, Ended, FreeRunning, Freewheeling, Jumped, Locked, Lost, Reverse, Shuttle, Stopped, Unusable,
    };
    match (sign, state) {
        (SourceSign::Sample, Absent | Lost) => Acquiring,
        (SourceSign::Sample, FreeRunning | Acquiring | Locked | Freewheeling | Stopped | Ended | Jumped | Reverse | Shuttle | Unusable) => state,

        (SourceSign::Fit, Freewheeling) => Locked,
        (SourceSign::Fit, FreeRunning | Absent | Acquiring | Locked | Stopped | Ended | Jumped | Reverse | Shuttle | Unusable | Lost) => state,

        (SourceSign::Sure, Acquiring | Jumped | Unusable) => Locked,
        (SourceSign::Sure, FreeRunning | Absent | Locked | Freewheeling | Stopped | Ended | Reverse | Shuttle | Lost) => state,

        // Only what seats follow: what is being found is uncertain by nature, and has its own time to settle.
        (SourceSign::Doubt, Locked | Freewheeling) => Unusable,
        (SourceSign::Doubt, FreeRunning | Absent | Acquiring | Stopped | Ended | Jumped | Reverse | Shuttle | Unusable | Lost) => state,

        (SourceSign::GiveUp, Acquiring | Jumped) => Unusable,
        (SourceSign::GiveUp, FreeRunning | Absent | Locked | Freewheeling | Stopped | Ended | Reverse | Shuttle | Unusable | Lost) => state,

        (SourceSign::Miss, Locked) => Freewheeling,
        (SourceSign::Miss, FreeRunning | Absent | Acquiring | Freewheeling | Stopped | Ended | Jumped | Reverse | Shuttle | Unusable | Lost) => state,

        (SourceSign::TimeOut | SourceSign::Gone, Acquiring | Locked | Freewheeling | Jumped | Reverse | Shuttle | Unusable) => Lost,
        // A film may stand for hours and say nothing. Without whoever told, nobody would say that it goes on.
        (SourceSign::Gone, Stopped) => Lost,
        (SourceSign::TimeOut, Stopped) => state,
        (SourceSign::TimeOut | SourceSign::Gone, FreeRunning | Absent | Ended | Lost) => state,

        (SourceSign::Stop, FreeRunning | Ended) => state,
        (SourceSign::Stop, Absent | Acquiring | Locked | Freewheeling | Stopped | Jumped | Reverse | Shuttle | Unusable | Lost) => Stopped,

        (SourceSign::Play, Absent | Stopped | Ended | Lost) => Acquiring,
        (SourceSign::Play, FreeRunning | Acquiring | Locked | Freewheeling | Jumped | Reverse | Shuttle | Unusable) => state,

        (SourceSign::Seek, FreeRunning) => state,
        // Wound while it stands it stands elsewhere: that it runs nobody has said.
        (SourceSign::Seek, Stopped | Ended) => Stopped,
        (SourceSign::Seek, Absent | Acquiring | Locked | Freewheeling | Jumped | Reverse | Shuttle | Unusable | Lost) => Jumped,

        (SourceSign::End, FreeRunning) => state,
        (SourceSign::End, Absent | Acquiring | Locked | Freewheeling | Stopped | Ended | Jumped | Reverse | Shuttle | Unusable | Lost) => Ended,

        (SourceSign::Jump, Locked | Freewheeling) => Jumped,
        (SourceSign::Jump, FreeRunning | Absent | Acquiring | Stopped | Ended | Jumped | Reverse | Shuttle | Unusable | Lost) => state,

        (SourceSign::Backward, Acquiring | Locked | Freewheeling | Jumped | Reverse | Shuttle | Unusable | Lost) => Reverse,
        (SourceSign::OutOfBand, Acquiring | Locked | Freewheeling | Jumped | Reverse | Shuttle | Unusable | Lost) => Shuttle,
        (SourceSign::Backward | SourceSign::OutOfBand, FreeRunning | Absent | Stopped | Ended) => state,

        (SourceSign::InBand, Reverse | Shuttle) => Acquiring,
        (SourceSign::InBand, FreeRunning | Absent | Acquiring | Locked | Freewheeling | Stopped | Ended | Jumped | Unusable | Lost) => state,
    }
}
