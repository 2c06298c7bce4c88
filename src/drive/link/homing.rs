//! What a homing by this program tells, whatever drives it leads.

/// What a homing does, for whoever watches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// An axis, from 0, is disarmed and held where it is.
    Held(usize),
    /// It moves off its switch.
    OffSwitch(usize),
    /// It looks for its zero.
    Searching(usize),
    /// It knows where it is.
    Found(usize),
    /// All go to park.
    Parking,
    /// Its settings are written and read back.
    Set(usize),
}
