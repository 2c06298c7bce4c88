//! The verdict of the checking process on a cue, and the library's entry for it.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::CueId;

/// What a check of one cue for one hall has shown; a line of JSON from the process that checked it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Verdict {
    /// True if it can be read, fits the hall, and keeps all limits at full level.
    pub(crate) passed: bool,
    /// True if it can be read, and the hall has all that it asks for: only limits stand against it, if anything does.
    #[serde(default)]
    pub(crate) playable: bool,
    /// Every fault, each with its place in the file, the first twenty in words.
    pub(crate) faults: Vec<String>,
    /// How many there are beyond those.
    pub(crate) more: u64,
    /// What it breaks where a film leads it that may ask for any pace that `[sync]` allows; none where the hall has no `[sync]`.
    pub(crate) led_faults: Vec<String>,
    /// SHA-256 of the file, hexadecimal.
    pub(crate) sha256: String,
    /// SHA-256 of what the cue does, hexadecimal ([`crate::proof::Digest`]); `None` if it cannot be read.
    pub(crate) digest: Option<String>,
    /// Its title.
    pub(crate) title: Option<String>,
    /// How long it is, s; `None` if it cannot be read.
    pub(crate) length_s: Option<f64>,
    /// How many axes it has; `None` if it cannot be read.
    pub(crate) axes: Option<usize>,
    /// The effects that it names.
    pub(crate) effects: Vec<String>,
    /// True if it is MCAP; CSV if not.
    pub(crate) mcap: bool,
}

impl Verdict {
    /// Every fault, a line each.
    #[must_use]
    pub(crate) fn lines(&self) -> Vec<String> {
        let more = (self.more > 0).then(|| format!("and {} more", self.more));
        self.faults.iter().cloned().chain(more).collect()
    }
}

/// True if a cue is proved to keep the limits of the hall, as the configuration's file now is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
#[serde(tag = "state", rename_all = "lowercase")]
pub enum Proved {
    /// It is.
    Passed,
    /// It is not.
    Failed {
        /// Every fault.
        faults: Vec<String>,
    },
    /// Nobody has looked, or the file or the configuration has changed since.
    Unknown,
}

/// One cue of the library. What only reading shows is null until it has been checked.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct CueInfo {
    /// Its id.
    pub(crate) id: String,
    /// Its title.
    pub title: Option<String>,
    /// How long it is, s.
    pub length_s: Option<f64>,
    /// How many axes it has.
    pub axes: Option<usize>,
    /// The effects that it names.
    pub effects: Vec<String>,
    /// The size of its file, bytes.
    pub size: u64,
    /// SHA-256 of its file, hexadecimal.
    pub sha256: Option<String>,
    /// True if it keeps the limits of the hall.
    pub proof: Proved,
    /// What it breaks where a film leads it.
    #[serde(skip)]
    pub(crate) led_faults: Vec<String>,
}

impl CueInfo {
    /// Of a file of that size; `known` is what was found of that very content, and whether for the hall as it is now.
    pub(super) fn new(id: &CueId, size: u64, known: Option<(&Verdict, bool)>) -> Self {
        let verdict = known.map(|(verdict, _)| verdict);
        let proof = match known {
            Some((verdict, true)) if verdict.passed => Proved::Passed,
            Some((verdict, true)) => Proved::Failed { faults: verdict.lines() },
            _ => Proved::Unknown,
        };
        Self {
            id: id.to_string(),
            title: verdict.and_then(|verdict| verdict.title.clone()),
            length_s: verdict.and_then(|verdict| verdict.length_s),
            axes: verdict.and_then(|verdict| verdict.axes),
            effects: verdict.map_or_else(Vec::new, |verdict| verdict.effects.clone()),
            size,
            sha256: verdict.map(|verdict| verdict.sha256.clone()),
            proof,
            led_faults: verdict.map_or_else(Vec::new, |verdict| verdict.led_faults.clone()),
        }
    }
}
