//! What people set and what is to last: seats that are out, levels, effects, trim, and what is loaded. The model and its text
//! ([`Settings::parse`], [`Settings::text`]) are pure; a thread of its own keeps the text in a file ([`SettingsFile`]).
//!
//! Nothing in the file starts or moves anything. What cannot be read is put aside with a word, and the hall begins as one in
//! which nobody has set anything.

mod file;
#[cfg(test)]
mod tests;
mod words;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub(crate) use file::{Kept, SettingsFile, keep};
pub(crate) use words::seats_out;

use crate::control::{Levels, Surface};
use crate::journal::PlaylistPlace;
use crate::time::TRIM_MS;

/// What the text says of itself. One of another number is put aside: nobody guesses what it meant.
const VERSION: u32 = 1;
/// The longest reason, characters.
pub(crate) const LONGEST_WHY: usize = 200;

/// What people have set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Settings {
    /// Levels and effects.
    pub(crate) levels: Levels,
    /// The same as people have set them, where gear or a fleet has set less since.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) ceiling: Option<Levels>,
    /// How much later than the film the motion is, ms.
    pub(crate) trim_ms: i32,
    /// The groups of seats that are out.
    pub(crate) out: BTreeMap<String, Out>,
    /// What is loaded.
    pub(crate) show: Option<LoadedShow>,
}

impl Default for Settings {
    /// All of everything, and nothing loaded.
    fn default() -> Self {
        let levels = Levels { motion: 1.0, vibration: 1.0, effects: BTreeMap::new(), rows: BTreeMap::new() };
        Self { levels, ceiling: None, trim_ms: 0, out: BTreeMap::new(), show: None }
    }
}

/// Who took a group of seats out, when and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Out {
    /// Who, as the journal has it.
    pub(crate) who: String,
    /// Which way they came.
    pub(crate) surface: Surface,
    /// When, RFC 3339.
    pub(crate) at: String,
    /// Why; `None` if nobody said.
    pub(crate) why: Option<String>,
}

/// What is loaded, and where in it people were left.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct LoadedShow {
    /// The id of the cue.
    pub(crate) cue: String,
    /// SHA-256 of its file, hexadecimal: a place in another cue is none in this one.
    pub(crate) sha256: String,
    /// The playlist that is loaded, and its entry.
    pub(crate) playlist: Option<PlaylistPlace>,
    /// Where the film was when its last show ended before the cue did, ms.
    pub(crate) film_ms: Option<i64>,
    /// Where in a film that leads it the cue begins, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) begins_ms: Option<i64>,
    /// The film that is shown with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) movie: Option<String>,
}

/// The whole text, as far as it says what it is.
#[derive(Serialize, Deserialize)]
struct Head {
    version: u32,
}

#[derive(Serialize)]
struct Whole<'s> {
    #[serde(flatten)]
    head: Head,
    #[serde(flatten)]
    settings: &'s Settings,
}

impl Settings {
    /// The text of it.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let whole = Whole { head: Head { version: VERSION }, settings: self };
        serde_json::to_string_pretty(&whole).expect("names and numbers have words") + "\n"
    }

    /// Reads a text.
    ///
    /// # Errors
    /// Why it is none, for a person.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let Head { version } = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if version != VERSION {
            return Err(format!("it is of version {version}, and this program writes version {VERSION}"));
        }
        let settings: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        settings.fault().map_or(Ok(settings), Err)
    }

    /// What nobody can have set.
    fn fault(&self) -> Option<String> {
        let all = [Some(&self.levels), self.ceiling.as_ref()].into_iter().flatten();
        let mut levels = all.flat_map(|Levels { motion, vibration, rows, .. }| {
            [motion, vibration].into_iter().chain(rows.values())
        });
        if let Some(level) = levels.find(|level| !(0.0..=1.0).contains(*level)) {
            return Some(format!("a level of {level} is outside 0..=1"));
        }
        if self.trim_ms.unsigned_abs() > TRIM_MS.unsigned_abs() {
            return Some(format!("a trim of {} ms is outside -{TRIM_MS}..={TRIM_MS}", self.trim_ms));
        }
        let mut words = self.out.values().flat_map(|out| [&out.who, &out.at].into_iter().chain(&out.why));
        let bad = words.find(|text| text.chars().any(char::is_control));
        bad.map(|text| format!("{text:?} has control characters"))
    }
}
