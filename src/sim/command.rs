//! What can happen to virtual controllers while they run: somebody throws a switch, a drive fails, the network worsens.

use std::time::Duration;

use super::errors::Errors;
use super::inputs::INPUTS;

/// What happens, and to whom.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// The controller, counted from 0 in the order of the setups; all of them where there is none.
    pub controller: Option<usize>,
    /// What happens to it.
    pub action: Action,
}

/// What can happen to a virtual controller.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Action {
    /// The switch at an input closes, which pulls it low, or opens. With PA04 = 1 a closed switch is an active input.
    Switch {
        /// The input, 1 to 12 for X01 to X12.
        input: u8,
        /// True if it closes.
        closed: bool,
    },
    /// An error comes (Err1 to 7, 10 to 15, 17, 20, 21), or with 0 all go and so do their causes.
    Error(u16),
    /// The power goes and comes back.
    Reboot,
    /// An emergency stop comes that no input asks for, or goes.
    EmergencyStop(bool),
    /// It falls silent, though it obeys, or speaks again.
    Mute(bool),
    /// Somebody sets a parameter at its keys; not checked, as little as those of a setup.
    Parameter(u8, u16),
    /// From now on datagrams go unanswered with this chance.
    Loss(f64),
    /// From now on answers come twice with this chance.
    Duplicate(f64),
    /// From now on answers leave so much later.
    Delay(Duration),
}

/// Why a command was not carried out.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CommandError {
    /// There is no such controller.
    #[error("there is no controller {}; there are {count}", index + 1)]
    Controller {
        /// The one that was named, counted from 0.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// There is no such input.
    #[error("there is no input X{0:02}; inputs are X01 to X{INPUTS:02}")]
    Input(u8),
    /// Controllers have no such error.
    #[error("there is no Err{0}; errors are 1 to 7, 10 to 15, 17, 20 and 21, and 0 clears them")]
    Error(u16),
    /// A chance lies from 0 to 1.
    #[error("a probability is 0 to 1")]
    Chance,
    /// The controllers have ended.
    #[error("the virtual controllers have ended")]
    Ended,
}

impl Action {
    /// True if this can happen to any controller.
    ///
    /// # Errors
    /// What there is not: an input, an error, a chance.
    pub(crate) fn check(&self) -> Result<(), CommandError> {
        match *self {
            Self::Switch { input, .. } if !(1..=INPUTS).contains(&usize::from(input)) => {
                Err(CommandError::Input(input))
            }
            Self::Error(number) if number != 0 && !Errors::is_one(number) => Err(CommandError::Error(number)),
            Self::Loss(chance) | Self::Duplicate(chance) if !(0.0..=1.0).contains(&chance) => {
                Err(CommandError::Chance)
            }
            _ => Ok(()),
        }
    }
}
