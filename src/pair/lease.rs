//! What the service and the link to the engine say to each other of the lease, a line of JSON each.

use serde::{Deserialize, Serialize};

use super::{Answer, Ask, Holder, Want};

/// What the link is to ask the engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LeaseAsk {
    /// Its number; the answer has it too.
    pub(crate) ticket: u64,
    /// What to write; `None` to read the key.
    pub(crate) swap: Option<LeaseSwap>,
}

/// A write that counts only where the key is as it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LeaseSwap {
    /// The revision that it replaces; 0 where there is to be no key.
    pub(crate) revision: u64,
    /// What it writes.
    pub(crate) holder: Holder,
}

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LeaseAnswer {
    /// That of the request.
    pub(crate) ticket: u64,
    /// What the engine said; `None` where it said nothing.
    pub(crate) told: Option<LeaseTold>,
}

/// What the engine said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum LeaseTold {
    /// The key.
    Key { holder: Holder, revision: u64 },
    /// There is none.
    NoKey,
    /// It is written.
    Granted { revision: u64 },
    /// It is another one than was thought.
    Refused,
}

impl From<Ask> for LeaseAsk {
    fn from(Ask { ticket, want }: Ask) -> Self {
        let swap = match want {
            Want::Read => None,
            Want::Swap { revision, holder } => Some(LeaseSwap { revision, holder }),
        };
        Self { ticket, swap }
    }
}

impl LeaseAnswer {
    /// What it is to the claim.
    pub(crate) fn told(&self) -> Option<Answer> {
        Some(match self.told? {
            LeaseTold::Key { holder, revision } => Answer::Key { holder, revision },
            LeaseTold::NoKey => Answer::NoKey,
            LeaseTold::Granted { revision } => Answer::Granted { revision },
            LeaseTold::Refused => Answer::Refused,
        })
    }
}
