//! What a hall has of what is wished, as the hall says it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::WishedCue;

/// Faults of a file that are told, and how much of a reason, bytes.
const FAULTS: usize = 32;
const REASON: usize = 1_024;
/// How much of a reason is told where the report would be too long otherwise.
const SHORT: usize = 100;

/// What a hall has of what was wished: its key of `kc_have`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct HaveReport {
    /// When it was so, RFC 3339, by the clock of the hall.
    pub(crate) at: String,
    /// The version of its program.
    pub(crate) version: String,
    /// SHA-256 of the file of its configuration, hexadecimal.
    pub(crate) config: String,
    /// The wish that it keeps; 0 if there is none.
    pub(crate) rev: u64,
    /// Which message of the engine it was shown last as its wish; 0 if none.
    pub(crate) seen: u64,
    /// Why it does not take what the engine has as its wish; null if it does.
    pub(crate) refused: Option<String>,
    /// What it has of its wish, by the ids of cues.
    pub(crate) cues: BTreeMap<String, WishHad>,
    /// The same by the ids of playlists.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) playlists: BTreeMap<String, WishHad>,
    /// How far it is with cues that shall go; `ready` once none is there that was brought.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) dropped_cues: BTreeMap<String, WishHad>,
    /// The same with playlists.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) dropped_playlists: BTreeMap<String, WishHad>,
}

/// What a hall has of one file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct WishHad {
    /// The file that is wished, its SHA-256.
    pub(crate) sha256: String,
    /// How long that is.
    pub(crate) bytes: u64,
    /// How far it is.
    pub(crate) state: HadState,
    /// How much of it was fetched, while it is.
    pub(crate) percent: Option<u8>,
    /// Why it waits, is refused, or comes later.
    pub(crate) why: Option<String>,
    /// Every fault that stands against it, with its place.
    pub(crate) faults: Vec<String>,
}

/// How far a wished file is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum HadState {
    /// It is there, and proved or checked for the seats of the hall.
    Ready,
    /// Nothing stands against it, and it comes at its time.
    Due,
    /// It is to be fetched or taken in, and nothing stands against that.
    Missing,
    /// It is being fetched.
    Fetching,
    /// The hall does not take it.
    Refused,
    /// It has to wait; what is unknown to this program counts as that.
    #[default]
    #[serde(other)]
    Waiting,
}

impl WishHad {
    /// Of that file.
    #[must_use]
    pub(crate) fn new(file: &WishedCue, state: HadState, why: Option<String>) -> Self {
        let WishedCue { sha256, bytes } = file.clone();
        Self { sha256, bytes, state, percent: None, why, faults: Vec::new() }
    }

    /// No more of its reason than so many bytes, and no more than so many faults.
    fn shorten(&mut self, reason: usize, faults: usize) {
        self.why.iter_mut().for_each(|why| cut(why, reason));
        self.faults.truncate(faults);
        self.faults.iter_mut().for_each(|fault| cut(fault, REASON));
    }

    /// True if nothing more comes of it until somebody does something, or its time has come.
    #[must_use]
    pub(crate) fn is_settled(&self) -> bool {
        matches!(self.state, HadState::Ready | HadState::Refused | HadState::Due)
    }

    /// It in words: `ready`, `fetching 61 %`, `waiting: the hall is armed`.
    #[must_use]
    pub(crate) fn said(&self) -> String {
        let why = self.why.as_deref().unwrap_or("it does not say why");
        match self.state {
            HadState::Ready => "ready".to_owned(),
            HadState::Due => format!("checked; {why}"),
            HadState::Missing => "not fetched yet".to_owned(),
            HadState::Fetching if self.percent.is_some_and(|percent| percent >= 100) => {
                "fetched, and being proved".to_owned()
            }
            HadState::Fetching => format!("fetching {} %", self.percent.unwrap_or(0)),
            HadState::Waiting => format!("waiting: {why}"),
            HadState::Refused => format!("refused: {why}"),
        }
    }
}

impl HaveReport {
    fn all_had(&mut self) -> impl Iterator<Item = &mut WishHad> {
        let dropped = self.dropped_cues.values_mut().chain(self.dropped_playlists.values_mut());
        self.cues.values_mut().chain(self.playlists.values_mut()).chain(dropped)
    }

    /// The same with no more of each reason, and no more faults of each file, than people read.
    #[must_use]
    pub(crate) fn bounded(mut self) -> Self {
        for had in self.all_had() {
            let more = had.faults.len().saturating_sub(FAULTS);
            had.shorten(REASON, FAULTS);
            if more > 0 {
                had.faults.push(format!("and {more} more"));
            }
        }
        self
    }

    /// As it is sent, with as many faults of each file, and as much of each reason, as fit into so many bytes.
    #[must_use]
    pub(crate) fn text_within(&self, most: usize) -> String {
        let text = |report: &Self| serde_json::to_string(report).expect("text and numbers are written");
        let (mut report, mut kept) = (self.clone(), FAULTS);
        while text(&report).len() > most && kept > 0 {
            kept /= 2;
            report.all_had().for_each(|had| had.shorten(if kept > 0 { REASON } else { SHORT }, kept));
        }
        text(&report)
    }
}

/// The beginning of a text, of so many bytes at the most.
fn cut(text: &mut String, most: usize) {
    text.truncate(text.floor_char_boundary(most));
}

#[cfg(test)]
mod tests {
    use super::super::wish::{DIGITS, MOST_NAMED};
    use super::*;

    #[test]
    fn a_report_that_is_too_long_loses_faults_and_no_cue() {
        let mut report = HaveReport::default();
        for id in 0..100 {
            let cue = WishedCue { sha256: "0".repeat(DIGITS), bytes: 1 };
            let mut had = WishHad::new(&cue, HadState::Refused, Some("it does not pass".to_owned()));
            had.faults = vec!["a1 moves 260 mm/s, limit 240".to_owned(); 21];
            report.cues.insert(id.to_string(), had);
        }
        assert_eq!(serde_json::from_str::<HaveReport>(&report.text_within(1 << 20)).unwrap(), report);
        let text = report.text_within(30_000);
        let short: HaveReport = serde_json::from_str(&text).unwrap();
        assert!(
            text.len() <= 30_000 && short.cues.len() == 100 && !short.cues["7"].faults.is_empty(),
            "{text}"
        );
    }

    #[test]
    fn of_the_longest_wish_with_the_worst_to_say_of_all_a_report_still_fits_into_a_message() {
        let had = || WishHad {
            why: Some("é".repeat(5_000)),
            faults: vec!["x".repeat(2_000); 200],
            ..WishHad::new(
                &WishedCue { sha256: "0".repeat(DIGITS), bytes: u64::MAX },
                HadState::Refused,
                None,
            )
        };
        let named = (0..MOST_NAMED).map(|n| (format!("{n:064}"), had()));
        let report = HaveReport { playlists: named.collect(), ..HaveReport::default() }.bounded();
        let one = &report.playlists.values().next().unwrap();
        assert_eq!((one.faults.len(), one.faults[32].as_str()), (33, "and 168 more"));
        assert!(one.why.as_ref().unwrap().len() <= REASON && one.faults[0].len() == REASON);
        let text = report.text_within(512 << 10);
        assert!(text.len() <= 512 << 10, "{}", text.len());
        assert_eq!(serde_json::from_str::<HaveReport>(&text).unwrap().playlists.len(), MOST_NAMED);
    }

    #[test]
    fn what_a_newer_hall_says_is_read_as_far_as_it_is_known() {
        let report = r#"{"rev":5,"cues":{"a":{"state":"dreaming","percent":255},"b":{"state":"fetching","percent":61},"c":{"state":"fetching","percent":200}},"x":1}"#;
        let report: HaveReport = serde_json::from_str(report).unwrap();
        assert_eq!(report.cues["a"].said(), "waiting: it does not say why");
        assert_eq!(report.cues["b"].said(), "fetching 61 %");
        assert_eq!(report.cues["c"].said(), "fetched, and being proved");
    }
}
