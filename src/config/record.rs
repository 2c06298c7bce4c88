//! `[record]`: recordings of shows, and the flight recorder.

use std::path::{Path, PathBuf};

use super::fault::Faults;
use super::section::{Entry, Section};

/// What is recorded, where, and how much of it is kept.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Record {
    /// How much of shows is kept.
    pub(crate) mode: RecordMode,
    /// Samples a second of each seat, 1 to 100.
    pub(crate) sample_hz: u32,
    /// How far back the flight recorder reaches, s, at most 600; 0 for none.
    pub(crate) flight_s: u32,
    /// The folder of recordings and incidents; none for `recordings` in the folder of what the service keeps.
    pub(crate) dir: Option<PathBuf>,
    /// After how much another part is begun, MiB, 1 to 65,536.
    pub(crate) part_mib: u32,
    /// All shows together, GiB; the oldest go first.
    pub(crate) max_total_gib: f64,
    /// All incidents together, GiB; the oldest go first.
    pub(crate) incidents_gib: f64,
    /// How long files are kept, days, 1 to 36,500.
    pub(crate) max_age_days: u32,
    /// What has to stay free on the disk, GiB.
    pub(crate) min_free_gib: f64,
    /// True if names of operators are recorded; else their roles alone.
    pub(crate) names: bool,
    /// True if a copy of the cue goes with each show.
    pub(crate) attach_cue: bool,
}

/// How much of shows is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RecordMode {
    /// Nothing.
    Off,
    /// Samples, each the worst of its window.
    Sampled,
    /// Samples, and every tick and every reply.
    Full,
}

impl RecordMode {
    const WORDS: [(&'static str, Self); 3] =
        [("off", Self::Off), ("sampled", Self::Sampled), ("full", Self::Full)];

    /// The word for it.
    pub(crate) fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(_, mode)| *mode == self).map_or("", |(word, _)| word)
    }
}

impl Record {
    /// The folder of recordings of a service that keeps what it has there.
    pub(crate) fn folder(&self, state: &Path) -> PathBuf {
        self.dir.clone().unwrap_or_else(|| state.join("recordings"))
    }
}

impl Default for Record {
    fn default() -> Self {
        Self {
            mode: RecordMode::Sampled,
            sample_hz: 20,
            flight_s: 60,
            dir: None,
            part_mib: 512,
            max_total_gib: 20.0,
            incidents_gib: 5.0,
            max_age_days: 60,
            min_free_gib: 2.0,
            names: true,
            attach_cue: false,
        }
    }
}

/// Reads the table.
pub(super) fn record(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Record> {
    let default = Record::default();
    let mut section = Section::new("[record]", entry.at, entry.table(faults)?, faults);
    let mode = section.get("mode").and_then(|mode| mode.choice(&RecordMode::WORDS, section.faults));
    let mut gib = |key: &'static str, default| {
        section.get(key).and_then(|entry| entry.number_in(0.0..=1e6, section.faults)).unwrap_or(default)
    };
    let max_total_gib = gib("max_total_gib", default.max_total_gib);
    let incidents_gib = gib("incidents_gib", default.incidents_gib);
    let min_free_gib = gib("min_free_gib", default.min_free_gib);
    let mut switch = |key: &'static str, default| {
        section.get(key).and_then(|entry| entry.switch(section.faults)).unwrap_or(default)
    };
    let (names, attach_cue) = (switch("names", default.names), switch("attach_cue", default.attach_cue));
    let record = Record {
        mode: mode.unwrap_or(default.mode),
        sample_hz: section.whole_in("sample_hz", 1..=100).unwrap_or(default.sample_hz),
        flight_s: section.whole_in("flight_s", 0..=600).unwrap_or(default.flight_s),
        dir: section.text("dir").map(PathBuf::from),
        part_mib: section.whole_in("part_mib", 1..=65_536).unwrap_or(default.part_mib),
        max_total_gib,
        incidents_gib,
        max_age_days: section.whole_in("max_age_days", 1..=36_500).unwrap_or(default.max_age_days),
        min_free_gib,
        names,
        attach_cue,
    };
    section.finish();
    Some(record)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::{faults_of, hall_with};

    #[test]
    fn recordings_are_kept_as_the_table_says_and_sampled_without_one() {
        assert_eq!(hall_with("").record, Record::default());
        let record = hall_with(
            "[record]\nmode = \"full\"\nflight_s = 0\ndir = \"/srv/rec\"\nmin_free_gib = 0.5\nnames = false\n",
        )
        .record;
        let wanted = Record {
            mode: RecordMode::Full,
            flight_s: 0,
            dir: Some(PathBuf::from("/srv/rec")),
            min_free_gib: 0.5,
            names: false,
            ..Record::default()
        };
        assert_eq!(record, wanted);
    }

    #[test]
    fn what_recordings_cannot_be_told_is_refused() {
        let faults = faults_of("[record]\nmode = \"all\"\nsample_hz = 0\nmax_total_gib = -1\nkeep = true\n");
        for wanted in ["\"all\" is not one of off, sampled, full", "sample_hz", "max_total_gib", "keep"] {
            assert!(faults.iter().any(|fault| fault.contains(wanted)), "{wanted}: {faults:?}");
        }
    }
}
