//! Proof of play on its way to the engine: the journal of the hall is the queue, and each record says where in it the next one is.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::journal::{JournalPart, TOLD_FILES, Told};

/// A record of `kc_log`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct LogRecord {
    /// Which one of this hall it is, from 1, without a gap.
    pub(crate) n: u64,
    /// How much of the journal was told with it and before it.
    pub(crate) told: BTreeMap<String, u64>,
    /// What the journal says.
    #[serde(flatten)]
    pub(crate) part: JournalPart,
}

impl LogRecord {
    /// The record after `before`, or the first one.
    pub(crate) fn after(before: Option<&Self>, part: JournalPart) -> Self {
        let mut told = before.map_or_else(BTreeMap::new, |before| before.told.clone());
        told.insert(part.file.clone(), part.line);
        while told.len() > TOLD_FILES {
            told.pop_first();
        }
        Self { n: before.map_or(0, |before| before.n).saturating_add(1), told, part }
    }

    /// How much of the journal was told by then.
    pub(crate) fn told(&self) -> Told {
        Told { lines: self.told.clone(), last: Some((&self.part).into()) }
    }
}
