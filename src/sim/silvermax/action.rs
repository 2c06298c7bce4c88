//! What happens to a unit on purpose.

use super::unit::Unit;
use crate::time::MonoTime;

/// What can happen to a virtual unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Action {
    /// The power goes and comes back.
    Reset,
    /// It is too hot, or has cooled down.
    Hot(bool),
    /// Its axis is held by something, or let go.
    Blocked(bool),
    /// Something pushes its axis so many counts off where its motor holds it, slowly.
    Pushed(i32),
    /// An input is high, or low.
    Input {
        /// 1 to 7.
        input: u8,
        /// Which.
        is_high: bool,
    },
    /// It neither hears nor answers, or does again.
    Dead(bool),
    /// It answers as another unit; as itself where there is none.
    AnswersAs(Option<u8>),
    /// From now on its crystal runs so much faster than ours, millionths.
    Crystal(i32),
}

impl Unit {
    /// It happens now, to which the unit has been advanced.
    pub(crate) fn act(&mut self, action: Action, now: MonoTime) {
        match action {
            Action::Reset => self.reset(),
            Action::Hot(is_hot) => self.world.is_hot = is_hot,
            Action::Blocked(is_blocked) => self.axis.is_blocked = is_blocked,
            Action::Pushed(counts) => self.axis.push(counts),
            Action::Input { input, is_high } => self.axis.set_input(input, is_high),
            Action::Dead(is_dead) => self.world.is_dead = is_dead,
            Action::AnswersAs(other) => self.world.answers_as = other,
            Action::Crystal(ppm) => self.run_at(ppm, now),
        }
    }
}
