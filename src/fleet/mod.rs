//! What halls of a fleet and their desks say to each other, and how it is called there: signed letters, the brief status, records of
//! proof of play, subjects and buckets of the engine (NATS). Pure; who carries it is `cli::fleet`, and what a hall takes of it is decided
//! by the hall: signatures in `api`, words and states in `app::supervisor`.

mod brief;
mod letter;
mod ntp;
mod proof;

pub(crate) use brief::BriefStatus;
pub(crate) use letter::{Letter, Order};
#[cfg(feature = "harness")]
pub(crate) use ntp::try_answer as try_ntp;
pub(crate) use ntp::{ClockSample, LEN as NTP_LEN, answer as ntp_answer, question as ntp_question};
pub(crate) use proof::LogRecord;

/// The JetStream domain that has all streams and buckets.
pub(crate) const DOMAIN: &str = "hub";
/// The stream of proofs of play.
pub(crate) const LOG: &str = "kc_log";
/// The bucket of the last status of each hall.
pub(crate) const SEEN: &str = "kc_seen";
/// What stands for every hall of a site in the subject of a stop.
pub(crate) const ALL: &str = "all";

/// Where a hall tells how it is; `hall` is `SITE.HALL`, and may have wildcards.
pub(crate) fn status_of(hall: &str) -> String {
    format!("kc.status.{hall}")
}

/// Where a hall hears what `who` asks.
pub(crate) fn command_to(hall: &str, who: &str, word: &str) -> String {
    format!("kc.cmd.{hall}.{who}.{word}")
}

/// Where a hall hears a stop of `who`.
pub(crate) fn stop_to(hall: &str, who: &str) -> String {
    format!("kc.stop.{hall}.{who}")
}

/// Where a hall tells what it played.
pub(crate) fn log_of(hall: &str) -> String {
    format!("kc.log.{hall}")
}
