//! What halls of a fleet and their desks say to each other, and how it is called there: signed letters, the brief status, records of
//! proof of play, wishes of what libraries shall have, subjects and buckets of the engine (NATS). Pure; who carries it is `cli::fleet`, and what a hall takes of it is decided
//! by the hall: signatures in `api`, words and states in `app::supervisor`.

mod brief;
mod have;
mod letter;
mod ntp;
mod proof;
mod wish;

pub(crate) use brief::BriefStatus;
#[cfg(test)]
pub(crate) use brief::SeatCounts;
pub(crate) use have::{HadState, HaveReport, WishHad};
pub(crate) use letter::{Letter, Order, new_letter_key};
#[cfg(feature = "harness")]
pub(crate) use ntp::try_answer as try_ntp;
pub(crate) use ntp::{ClockSample, LEN as NTP_LEN, answer as ntp_answer, question as ntp_question};
pub(crate) use proof::LogRecord;
pub(crate) use wish::{AHEAD, CHUNK, CuePiece, Drops, LONGEST_WISH, Wish, WishedCue, WishedPlaylist};

/// The JetStream domain that has all streams and buckets.
pub(crate) const DOMAIN: &str = "hub";
/// The stream of proofs of play.
pub(crate) const LOG: &str = "kc_log";
/// The bucket of the last status of each hall.
pub(crate) const SEEN: &str = "kc_seen";
/// The stream of the files of cues, each in messages of [`CHUNK`] bytes that are never overwritten.
pub(crate) const CUES: &str = "kc_cues";
/// The bucket of what each hall shall have.
pub(crate) const WANT: &str = "kc_want";
/// The bucket of what each hall has.
pub(crate) const HAVE: &str = "kc_have";
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

/// The same of one of its two show machines, each of which has a journal of its own.
pub(crate) fn log_of_machine(hall: &str, machine: &str) -> String {
    log_of(&format!("{hall}.{machine}"))
}

/// Whose log a subject is, `SITE.HALL`; `None` if it is none.
pub(crate) fn hall_of_log(subject: &str) -> Option<&str> {
    let hall = subject.strip_prefix("kc.log.")?;
    let end = hall.match_indices('.').nth(1).map_or(hall.len(), |(end, _)| end);
    Some(&hall[..end])
}

/// Where the lease of a hall with two show machines is kept.
pub(crate) fn lease_of(hall: &str) -> String {
    format!("kc.lease.{hall}")
}

/// The stream of that, one for each hall: its name may have no point, and no site or hall has the sign that stands for it.
pub(crate) fn lease_stream(hall: &str) -> String {
    format!("kc_lease_{}", hall.replace('.', "="))
}

/// Where a part of a file is kept; `sha256` is that of the whole file, `n` counts from 0; both may be wildcards.
pub(crate) fn chunk_of(sha256: &str, n: &str) -> String {
    format!("kc.cue.{sha256}.{n}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_halls_never_have_the_lease_of_one() {
        assert_ne!(lease_stream("north.a_b"), lease_stream("north_a.b"));
    }

    #[test]
    fn the_logs_of_both_machines_of_a_hall_are_told_to_be_that_halls() {
        let own = [log_of("berlin.h1"), log_of_machine("berlin.h1", "A"), log_of_machine("berlin.h1", "B")];
        assert_eq!(own.each_ref().map(|subject| hall_of_log(subject)), [Some("berlin.h1"); 3]);
        assert_eq!([hall_of_log("kc.status.berlin.h1"), hall_of_log("kc.log")], [None; 2]);
    }
}
