//! `[log]`: the journal of commands and shows.

use std::path::{Path, PathBuf};

use jiff::civil::Time;

use super::fault::Faults;
use super::section::{Entry, Section};

/// Where the journal is kept, and how much of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Log {
    /// Its folder.
    pub(crate) dir: PathBuf,
    /// After how much a new file is begun, MiB, 1 to 1,024.
    pub(crate) max_size_mib: u32,
    /// All files together, MiB, at least twice that; the oldest go first.
    pub(crate) max_total_mib: u32,
    /// How long files are kept, days, 1 to 36,500.
    pub(crate) max_age_days: u32,
    /// When the house is open; a show that starts at another time is marked in the report.
    pub(crate) hours: Option<Hours>,
}

impl Default for Log {
    fn default() -> Self {
        Self {
            dir: PathBuf::from("/var/log/kinocue"),
            max_size_mib: 16,
            max_total_mib: 512,
            max_age_days: 400,
            hours: None,
        }
    }
}

/// The journal of a service that keeps what it has in that folder; the package has it elsewhere.
pub(crate) fn journal_in(state: &Path) -> PathBuf {
    if state == Path::new("/var/lib/kinocue") { Log::default().dir } else { state.join("log") }
}

/// The hours of a house, by wall clock; they may reach past midnight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Hours {
    /// When it opens.
    pub(crate) from: Time,
    /// When it closes.
    pub(crate) until: Time,
}

impl Hours {
    /// True if it is open at a time of day.
    #[must_use]
    pub(crate) fn contains(&self, time: Time) -> bool {
        if self.from <= self.until {
            (self.from..self.until).contains(&time)
        } else {
            time >= self.from || time < self.until
        }
    }
}

/// Reads the table.
pub(super) fn log(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Log> {
    let default = Log::default();
    let mut section = Section::new("[log]", entry.at, entry.table(faults)?, faults);
    let log = Log {
        dir: section.text("dir").map_or(default.dir, PathBuf::from),
        max_size_mib: section.whole_in("max_size_mib", 1..=1024).unwrap_or(default.max_size_mib),
        max_total_mib: section.whole_in("max_total_mib", 2..=1_048_576).unwrap_or(default.max_total_mib),
        max_age_days: section.whole_in("max_age_days", 1..=36_500).unwrap_or(default.max_age_days),
        hours: hours(&mut section),
    };
    section.finish();
    if log.max_total_mib < 2 * log.max_size_mib {
        let Log { max_total_mib: total, max_size_mib: size, .. } = log;
        entry.fault(faults, &format!("max_total_mib {total} is under twice max_size_mib {size}"));
    }
    Some(log)
}

/// `hours = ["10:00", "01:30"]`.
fn hours(section: &mut Section<'_, '_, '_>) -> Option<Hours> {
    let entry = section.get("hours")?;
    let times = entry.array(section.faults)?;
    let [from, until] = &times[..] else {
        entry.fault(section.faults, "give two times, such as [\"10:00\", \"01:30\"]");
        return None;
    };
    let (from, until) = (from.time(section.faults), until.time(section.faults));
    Some(Hours { from: from?, until: until? })
}

#[cfg(test)]
mod tests {
    use jiff::civil::time;

    use crate::config::tests::{faults_of, hall_with};

    #[test]
    fn the_hours_of_a_house_may_reach_past_midnight() {
        let hours = |text| hall_with(&format!("[log]\nhours = {text}\n")).log.hours.unwrap();
        let late = hours("[\"10:00\", \"01:30\"]");
        for (at, open) in [(time(9, 59, 59, 0), false), (time(10, 0, 0, 0), true), (time(0, 0, 0, 0), true)] {
            assert_eq!(late.contains(at), open, "{at}");
        }
        assert!(!late.contains(time(1, 30, 0, 0)));
        assert!(!hours("[\"10:00\", \"22:00\"]").contains(time(23, 0, 0, 0)));
    }

    #[test]
    fn what_the_journal_cannot_be_told_is_refused() {
        let faults = faults_of("[log]\nmax_size_mib = 10\nmax_total_mib = 19\nhours = [\"10:00\"]\n");
        assert!(faults[0].ends_with("log: max_total_mib 19 is under twice max_size_mib 10"), "{faults:?}");
        assert!(faults[1].contains("hours: give two times"), "{faults:?}");
        assert!(faults_of("[log]\nhours = [\"10:00\", \"25:00\"]\n")[0].contains("hours: \"25:00\""));
    }
}
