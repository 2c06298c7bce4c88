//! What a serial line does to octets, on purpose.

use std::time::Duration;

/// The faults of a line; chances are 0 to 1 and of each octet, in both directions, unless it says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LineFaults {
    /// That it does not arrive.
    pub(crate) lost: f64,
    /// That it arrives twice.
    pub(crate) doubled: f64,
    /// That one of its bits is another.
    pub(crate) flipped: f64,
    /// That it and all behind it come later, by [`LineFaults::late_by`].
    pub(crate) late: f64,
    /// How much later.
    pub(crate) late_by: Duration,
    /// That a whole answer is lost, after what was asked has been done.
    pub(crate) answer_lost: f64,
    /// How many answers are lost from now on, beside those by chance.
    pub(crate) lose_answers: u32,
    /// How long the adapter holds back what has come, as its latency timer says.
    pub(crate) held: Duration,
    /// The adapter returns what is sent, as on two wires.
    pub(crate) echo: bool,
    /// Octets a second that nobody sent, by chance in time and in what they are.
    pub(crate) noise: u32,
    /// The adapter is unplugged.
    pub(crate) unplugged: bool,
}
