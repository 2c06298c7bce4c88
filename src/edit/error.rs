//! Why an edit makes no cue, in words.

use crate::cue::Problem;
use crate::time::ShowTime;

/// Why cues cannot be laid one after the other.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EditError {
    /// One is made of other things than the first.
    #[error("{0} differs from the first cue in {1}; convert or edit it first, so that they are alike")]
    Unlike(String, &'static str),
    /// There is no such stretch.
    #[error("nothing lies from {0} to {1}")]
    Nothing(ShowTime, ShowTime),
    /// More than the cue has room for.
    #[error("that is longer than the cue, or than the stretch, has room for; the cue is {0} long")]
    TooLong(ShowTime),
    /// An axis that is not there.
    #[error("there is no axis {0}; the cue has {1}")]
    NoAxis(usize, usize),
    /// Seats of two types stand elsewhere, and a cue can lead to one place.
    #[error(
        "a{axis}: {what} of seat type {} is {}{unit}, of {} {}{unit}; --seat NAME edits the cue for one of them", .one.0, .one.1, .other.0, .other.1
    )]
    SeatsDiffer {
        /// The axis, from 1.
        axis: usize,
        /// Which place.
        what: &'static str,
        /// The name of one type, and where it is.
        one: (String, f64),
        /// Those of the other.
        other: (String, f64),
        /// What stands behind the places.
        unit: &'static str,
    },
    /// The new cue is none.
    #[error("the new cue: {0}")]
    Cue(Problem),
}
