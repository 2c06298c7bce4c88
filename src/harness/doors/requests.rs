//! What is asked of a hall, and what halls and their desks tell each other.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::seen;
use super::served::ServedHall;
use crate::control::{Command, LevelsChange};
use crate::fleet::{BriefStatus, LogRecord};
use crate::{osc, text_port};

pub(super) fn osc(datagram: &[u8]) {
    osc::try_datagram(datagram).iter().for_each(may_be_of_gear);
}

pub(super) fn line(octets: &[u8]) {
    text_port::try_line(octets).iter().for_each(may_be_of_gear);
}

/// No gear arms, homes or clears, and what it sets is within what can be set.
fn may_be_of_gear(ask: &Command) {
    assert!(!Command::OF_PEOPLE.contains(&ask.word()), "{ask:?}");
    match ask {
        Command::Levels(LevelsChange { motion, vibration, rows, .. }) => {
            let levels = [motion, vibration].into_iter().flatten().chain(rows.values());
            assert!(levels.into_iter().all(|level| (0.0..=1.0).contains(level)), "{ask:?}");
        }
        Command::Trim(ms) => assert!((-500..=500).contains(ms), "{ask:?}"),
        Command::Nudge(frames) => assert!((-12..=12).contains(frames), "{ask:?}"),
        _ => {}
    }
}

/// What is sent to a port of the API: whoever shows no token gets nothing done, and the others what their role may.
pub(super) fn http(octets: &[u8]) {
    ServedHall::with(|hall| hall.send(octets));
}

/// A status that a hall tells, or a record of what it played.
pub(super) fn told(octets: &[u8]) {
    if let Some(status) = read_again::<BriefStatus>(octets) {
        assert!(!status.differs(&status));
    }
    if let Some(record) = read_again::<LogRecord>(octets) {
        seen(LogRecord::after(Some(&record), record.part.clone()));
    }
}

/// What is read is the same once it was written and read again.
fn read_again<T: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug>(octets: &[u8]) -> Option<T> {
    let told: T = serde_json::from_slice(octets).ok()?;
    let text = serde_json::to_vec(&told).expect("what was JSON is so again");
    assert_eq!(serde_json::from_slice::<T>(&text).expect("what was written is read"), told);
    Some(told)
}
