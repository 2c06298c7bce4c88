//! `kinocue fleet report`: what all halls played, as each of them told the engine.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use anyhow::Context as _;
use async_nats::Client;
use async_nats::jetstream::consumer::pull::Config;
use async_nats::jetstream::consumer::{AckPolicy, DeliverPolicy};
use futures_util::StreamExt as _;
use jiff::civil::Date;

use super::{DeskArgs, engine, settings};
use crate::cli::report::{Day, parse_day, shows_table};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::fleet::{self, LogRecord};
use crate::journal::{ChainFindings, JournalKeys, JournalReport, check_told, report_of};
use crate::json;
use crate::sys::clock::local_now;

/// Records that are asked for at a time.
const BATCH: usize = 200;
/// How long the engine may take for these.
const PATIENCE: Duration = Duration::from_secs(10);

/// The longest text of a record that is shown, bytes, and the longest list.
const TEXT: usize = 480;
const ITEMS: usize = 256;

/// Of a hall whose key the desk does not know.
const UNPROVED: &str = "the desk knows no key of this hall, so that nothing proves who wrote these lines; add what `kinocue report --keys` \
                        prints in the hall to [journals] in desk.toml";

/// Reports what all halls of a desk played on a day.
///
/// A hall tells each show once, also what it played while it was cut off. Where it is not heard now, later shows may be missing: `kinocue fleet
/// status` says so, and `kinocue report` in the hall has all.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Exit codes: 0 shown, 1 records of a hall are missing, or it is not proved that they are its own, 69 the engine does not answer, or not all of it comes"
)]
pub(super) struct Args {
    #[command(flatten)]
    desk: DeskArgs,
    /// The day: today, yesterday, or a date as 2026-11-21.
    #[arg(long, value_name = "DAY", value_parser = parse_day, default_value = "today")]
    day: Day,
    /// Print JSON: an object with the report of each hall.
    #[arg(long)]
    json: bool,
    /// With --json: the records as the engine has them, for programs that keep their own books.
    #[arg(long, requires = "json")]
    records: bool,
}

/// What a hall told.
#[derive(Default)]
struct ToldByHall {
    /// By the subject of the journal: each machine of a hall has one.
    records: BTreeMap<String, Vec<LogRecord>>,
    /// Lines that these are: of which file, at which place, and what they say. The journals of two machines have files of the same names.
    lines: BTreeSet<(String, u64, String)>,
    /// The last record of each journal, by its subject.
    last: BTreeMap<String, u64>,
    /// Records that are not there, in words.
    missing: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let settings = settings::desk(&args.desk.desk)?;
    let day = args.day.date(local_now().date());
    let mut told = engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        engine::prepare(&engine::kept(&client)).await?;
        read(&client, day).await
    })?;
    for hall in settings.halls {
        told.entry(hall).or_default();
    }
    let reports: BTreeMap<_, _> =
        told.iter().map(|(hall, told)| (hall, told.report(settings.journals.get(hall), day))).collect();
    let is_whole = told.values().all(|hall| hall.missing.is_empty())
        && reports.values().all(|report| report.faults.is_empty());
    if args.records {
        let of_hall = |told: &ToldByHall| told.records.values().flatten().cloned().collect::<Vec<_>>();
        let records: BTreeMap<_, _> = told.iter().map(|(hall, told)| (hall, of_hall(told))).collect();
        print::json(&records)?;
        return Ok(if is_whole { Exit::Done } else { Exit::CheckFailed });
    }
    if args.json {
        print::json(&reports)?;
    } else {
        for (hall, report) in &reports {
            print::out(&format!("{hall}\n{}\n", shows_table(report)))?;
            report.remarks().for_each(|note| print::tell(&format!("{hall}: {note}")));
        }
    }
    Ok(if is_whole { Exit::Done } else { Exit::CheckFailed })
}

/// What halls told from the day before on: a show is told after it was played, and clocks differ.
async fn read(client: &Client, day: Date) -> Result<BTreeMap<String, ToldByHall>, Failure> {
    let from = day.yesterday().unwrap_or(day).at(0, 0, 0, 0).in_tz("UTC").or_exit(Exit::Usage)?.timestamp();
    let start_time = async_nats::datetime::parse_rfc3339(&from.to_string())
        .map_err(anyhow::Error::from_boxed)
        .or_exit(Exit::Internal)?;
    let stream = engine::kept(client).get_stream_no_info(fleet::LOG).await.or_exit(Exit::Unavailable)?;
    let config = Config {
        deliver_policy: DeliverPolicy::ByStartTime { start_time },
        ack_policy: AckPolicy::None,
        filter_subject: fleet::log_of(">"),
        ..Config::default()
    };
    let told = "the engine does not tell what it keeps of shows";
    let consumer = stream.create_consumer(config).await.context(told).or_exit(Exit::Unavailable)?;
    let mut all: BTreeMap<String, ToldByHall> = BTreeMap::new();
    let mut left = consumer.cached_info().num_pending;
    while left > 0 {
        let batch = consumer.fetch().max_messages(BATCH).expires(PATIENCE).messages().await;
        let mut batch = batch.context(told).or_exit(Exit::Unavailable)?;
        let mut count = 0;
        while let Some(message) = batch.next().await {
            let message =
                message.map_err(|error| anyhow::anyhow!(error)).context(told).or_exit(Exit::Unavailable)?;
            count += 1;
            left = message
                .info()
                .map_err(anyhow::Error::from_boxed)
                .context(told)
                .or_exit(Exit::Unavailable)?
                .pending;
            if let Some(hall) = fleet::hall_of_log(&message.subject) {
                all.entry(hall.to_owned()).or_default().take(&message.subject, &message.payload);
            }
        }
        if count == 0 {
            let error =
                anyhow::anyhow!("{left} more records of shows did not come; ask again over a better network");
            return Err(error).or_exit(Exit::Unavailable);
        }
    }
    Ok(all)
}

impl ToldByHall {
    fn take(&mut self, subject: &str, payload: &[u8]) {
        let Ok(record) = serde_json::from_slice::<LogRecord>(payload) else {
            self.missing
                .push("a record is none of ours; the hall has told its journal again behind it".to_owned());
            self.last.remove(subject);
            return;
        };
        let n = record.n;
        if let Some(last) =
            self.last.insert(subject.to_owned(), n).filter(|last| last.checked_add(1) != Some(n))
        {
            self.missing.push(format!("record {n} follows record {last}: what is between is missing"));
        }
        let line = (record.part.file.clone(), record.part.line, record.part.record.to_string());
        if self.lines.insert(line) {
            self.records.entry(subject.to_owned()).or_default().push(record);
        }
    }

    /// What the hall played, by the lines that a key which the desk knows has sealed.
    fn report(&self, keys: Option<&Vec<String>>, day: Date) -> JournalReport {
        let counts = keys.map_or_else(JournalKeys::default, |keys| JournalKeys::only(keys.iter().cloned()));
        let (mut found, mut journals) = (ChainFindings::default(), Vec::new());
        for records in self.records.values() {
            // As the hall itself reads them: what was told again, of days before, is not behind what was told first.
            let parts = records.iter().map(|record| record.part.clone()).collect();
            let (lines, of_journal) = check_told(parts, &counts);
            found.add(of_journal);
            journals.push(lines.into_iter().map(|line| json::clipped(line, TEXT, ITEMS)).collect());
        }
        let unknown = found.keys.iter().filter(|key| keys.is_none_or(|keys| !keys.contains(key))).cloned();
        let unknown: Vec<String> = unknown.collect();
        let is_unproved = keys.is_none() && !self.records.is_empty();
        let mut report = report_of(journals, found, day, day);
        report.faults.extend(is_unproved.then(|| UNPROVED.to_owned()));
        report.notes.extend(unknown.into_iter().map(|key| match keys {
            Some(_) => format!("it seals with a new key, which the one before has signed: add {key} to [journals] in desk.toml"),
            None => format!("its lines are sealed by {key}"),
        }));
        report.notes.extend(self.missing.iter().cloned());
        report
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::journal::ShowResult;

    #[test]
    fn a_start_of_days_ago_that_is_told_again_ends_no_show_of_today() {
        let show = json!({
            "kind": "begin", "start": "2026-11-21T19:00:00.000Z", "hall": "h1", "cue": "storm", "sha256": "", "level": 1.0,
            "vibration": 1.0, "trim_ms": 0, "effects_off": [], "seats_total": 2, "seats_available": 2, "operator": "ann",
            "scheduled": false, "out_of_hours": false,
        });
        let start = |at| json!({ "kind": "start", "at": at, "version": "1" });
        let (old, new) =
            (("10", start("2026-11-10T08:00:00.000Z")), ("21", start("2026-11-21T08:00:00.000Z")));
        let mut told = ToldByHall::default();
        // The first two of today; then what the hall tells from its first line on, behind what was none of its records.
        for (n, line, (file, record)) in [
            (8, 1, new.clone()),
            (9, 2, ("21", show.clone())),
            (1, 1, old),
            (2, 1, new),
            (3, 2, ("21", show)),
        ] {
            if n == 1 {
                told.take("kc.log.berlin.h1", b"none");
            }
            let record = json!({ "n": n, "told": {}, "file": file, "line": line, "record": record });
            told.take("kc.log.berlin.h1", record.to_string().as_bytes());
        }
        let shows = told.report(None, jiff::civil::date(2026, 11, 21)).shows;
        assert_eq!(shows.iter().map(|show| show.result).collect::<Vec<_>>(), [ShowResult::Running]);
    }

    #[test]
    fn whatever_number_a_record_has_is_no_reason_to_end_and_what_is_between_two_is_missing() {
        let mut told = ToldByHall::default();
        for (line, n) in [(1, 6), (2, 7), (3, u64::MAX), (4, 1)] {
            let record =
                json!({ "n": n, "told": {}, "file": "x", "line": line, "record": { "kind": "start" } });
            told.take("kc.log.berlin.h1", record.to_string().as_bytes());
        }
        assert_eq!(told.records["kc.log.berlin.h1"].len(), 4);
        let missing = told.missing.join("\n");
        assert!(missing.contains("record 18446744073709551615 follows record 7"), "{missing}");
        assert!(missing.contains("record 1 follows record 18446744073709551615"), "{missing}");
    }
}
