//! Recordings of the service: shows, and the flight recorder with its incidents. A thread of its own behind the taps, alone at the
//! disk; whatever becomes of it, the hall goes on.

mod beginning;
mod disk;
mod kept;
mod leftovers;
mod link;
mod open;
mod worker;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, Builder, JoinHandle};
use std::time::Duration;

use sha2::{Digest as _, Sha256};

pub(crate) use link::{RecordAsk, RecordLink, ShowStart};

use super::recording;
use super::runtime::Runtime;
use crate::config::MAX_FILE_LEN;
use crate::config::RecordMode;
use crate::record::{About, EntryMaker, Intake, Opening, file_octets_a_second, octets_a_second};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::sys::file;
use crate::sys::realtime;
use crate::time::{Clock as _, Rate};
use disk::Disk;
use link::RecordPart;
use worker::Worker;

/// What could not be written is tried again after so long.
const AGAIN: Duration = Duration::from_secs(30);
/// The flight recorder's file in the runtime folder.
const FLIGHT_FILE: &str = "flight.ring";
/// Octets that it may have at the most.
const MOST_FLIGHT: u64 = 128 << 20;
const LEAST_FLIGHT: u64 = 1 << 20;
/// How long a recorder has to write what it has once its hall has closed; all that it waits for is a disk.
const RECORDER_ENDS: Duration = Duration::from_secs(10);

/// Where a recorder has its files.
#[derive(Debug, Clone)]
pub(crate) struct RecordPlaces {
    /// The folder of the flight recorder, in memory.
    pub(crate) runtime: PathBuf,
    /// The folder of recordings.
    pub(crate) recordings: PathBuf,
    /// The configuration.
    pub(crate) config: PathBuf,
}

/// The recorder of one hall.
#[derive(Debug)]
pub(crate) struct HallRecorder {
    link: RecordLink,
    /// Its thread, and what ends as it does.
    thread: Option<(JoinHandle<()>, Receiver<()>)>,
    flight: PathBuf,
}

impl HallRecorder {
    /// Taps a hall that is about to open, and starts the thread behind the taps. Where the system has no thread for it the hall goes on
    /// without, and says so.
    pub(crate) fn start(runtime: &mut Runtime, places: &RecordPlaces) -> Self {
        let config = Arc::clone(runtime.config());
        let rate = Rate::from_hz(config.show.rate_hz);
        let seats = recording::seats(&config, runtime.lanes());
        let clocks = (Monotonic.now(), wall_now_ns());
        let about = About::of_hall(&config.show.name, rate, clocks);
        let text = file::read(&places.config, MAX_FILE_LEN).unwrap_or_default();
        let digest: String = Sha256::digest(&text).iter().map(|octet| format!("{octet:02x}")).collect();
        let opening = Opening::new(&about, &seats)
            .judged(&runtime.judging(true))
            .with("config_sha256", digest)
            .with("sample_hz", config.record.sample_hz.to_string());
        let maker = EntryMaker::new(seats.len(), clocks);
        let octets_a_s = octets_a_second(&seats, rate, config.record.sample_hz);
        let keeps_ticks = config.record.mode == RecordMode::Full;
        let (link, asks) = RecordLink::new();
        if config.record.mode != RecordMode::Off {
            link.takes(file_octets_a_second(&seats, rate, config.record.sample_hz, keeps_ticks));
        }
        let (taps, intake) = Intake::new(seats, rate, config.record.sample_hz);
        let flight = places.runtime.join(FLIGHT_FILE);
        if config.record.mode == RecordMode::Off && config.record.flight_s == 0 {
            link.tell(|figures| figures.mode = RecordMode::Off.word().to_owned());
            return Self { link, thread: None, flight };
        }
        let flight_len = (octets_a_s * u64::from(config.record.flight_s)).clamp(LEAST_FLIGHT, MOST_FLIGHT);
        // Before the new one takes its place.
        let leftover = leftovers::flight(&flight);
        let disk = Disk::new(&config.record, &places.recordings).telling(link.clone());
        let worker = Worker::new(intake, asks, link.clone(), opening, maker, disk, config.record.clone());
        let safe = safe_configuration(&text);
        let told = link.clone();
        link.begins(&places.recordings, clocks.0);
        let (ends, ended) = channel();
        let (live, ring) = (runtime.control().live, flight.clone());
        let thread = Builder::new().name("recorder".to_owned()).spawn(move || {
            realtime::stand_back();
            let _ends: Sender<()> = ends;
            let _told = TellsOfPanic(told);
            let worker = worker.attaching(safe).flying(&ring, flight_len, octets_a_s);
            worker.clear_up(leftover, move || !live.is_moving());
            worker.run(&Monotonic);
        });
        if let Err(error) = &thread {
            link.ends();
            link.trouble(
                RecordPart::Show,
                Some(format!("nothing is recorded: no thread could be started: {error}")),
            );
        } else {
            runtime.record(taps);
        }
        Self { link, thread: thread.ok().map(|thread| (thread, ended)), flight }
    }

    /// The way to it.
    pub(crate) fn link(&self) -> RecordLink {
        self.link.clone()
    }

    /// Waits until what came through its taps is written; these are gone by now. Not for a disk that stands still: what is left is
    /// recovered at the next start, like that of a thread that panicked.
    ///
    /// # Errors
    /// Where it is left.
    pub(crate) fn end(self) -> Result<(), RecorderWaits> {
        self.link.put(RecordAsk::Close);
        let Some((thread, ended)) = self.thread else { return Ok(()) };
        if ended.recv_timeout(RECORDER_ENDS) == Err(RecvTimeoutError::Timeout) {
            return Err(RecorderWaits(self.link.dir()));
        }
        if thread.join().is_ok() {
            // An end in order leaves nothing to be recovered.
            let _ = fs::remove_file(&self.flight);
        }
        Ok(())
    }
}

/// A recorder whose disk answers no write.
#[derive(Debug, thiserror::Error)]
#[error(
    "{}: the disk answers no write, and the last recording is not closed; look at that disk; the next start repairs the file", .0.display()
)]
pub(crate) struct RecorderWaits(PathBuf);

/// Says so where the thread that has it panics: the hall goes on.
struct TellsOfPanic(RecordLink);

impl Drop for TellsOfPanic {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.ends();
            self.0.tell(|status| (status.recording, status.flight_s) = (None, 0.0));
            let text = "recording has stopped: the recorder failed; restart the service between two shows";
            self.0.trouble(RecordPart::Show, Some(text.to_owned()));
        }
    }
}

/// Tables of a configuration that nobody is shown.
const SECRET: [&str; 4] = ["api", "osc", "text", "notify"];
/// Texts of these tables that are shorter are words and addresses, which stand elsewhere, too; a token's hash has 64 characters.
const SECRET_LEN: usize = 16;

/// A configuration without the tables in which there are secrets; none where it cannot be told apart.
fn safe_configuration(text: &[u8]) -> Option<String> {
    let text = str::from_utf8(text).ok()?;
    let is_secret = |name: &str| {
        let first = name.trim().trim_matches(['[', '"', '\'', ' ']);
        let first: &str = first.split(['.', '=', ']', '"', '\'', ' ']).next().unwrap_or_default();
        SECRET.contains(&first)
    };
    let (mut kept, mut skips) = (String::new(), false);
    for line in text.lines() {
        if line.trim_start().starts_with('[') {
            skips = is_secret(line);
        } else if is_secret(line) {
            // As a dotted key, or a table in a line.
            continue;
        }
        if !skips {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    // Whatever its lines look like: no text of these tables may be left.
    let (tree, errors) = toml::de::DeTable::parse_recoverable(text);
    let mut secrets = Vec::new();
    for (name, value) in tree.get_ref() {
        if SECRET.contains(&name.get_ref().as_ref()) {
            texts(value.get_ref(), &mut secrets);
        }
    }
    let is_left = secrets.iter().any(|secret| secret.len() >= SECRET_LEN && kept.contains(secret.as_str()));
    (errors.is_empty() && !is_left).then_some(kept)
}

fn texts(value: &toml::de::DeValue<'_>, out: &mut Vec<String>) {
    use toml::de::DeValue;
    match value {
        DeValue::String(text) => out.push(text.to_string()),
        DeValue::Array(all) => all.iter().for_each(|one| texts(one.get_ref(), out)),
        DeValue::Table(table) => table.iter().for_each(|(_, one)| texts(one.get_ref(), out)),
        _ => {}
    }
}

/// The name of a file without what no file name may have.
pub(super) fn plain_name(text: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_') { c } else { '-' };
    Path::new(text).file_stem().unwrap_or_default().to_string_lossy().chars().take(60).map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_configuration_is_attached_without_what_opens_its_doors() {
        let text = "[show]\nname = \"one\"\n[api]\nlisten = \"127.0.0.1:1\"\n[[api.token]]\nsha256 = \"secret-one\"\n\
            role = \"operate\"\n[osc]\nfrom = [\"10.0.0.1\"]\n[text]\nword = \"secret-two\"\n[notify.webhook]\nurl = \"http://10.0.0.9/secret-three\"\n[log]\nmax_age_days = 3\n";
        let safe = safe_configuration(text.as_bytes()).unwrap();
        assert_eq!(safe, "[show]\nname = \"one\"\n[log]\nmax_age_days = 3\n");
        let safe = safe_configuration(b"api.token = \"secret-one\"\n[show]\nname = \"one\"\n").unwrap();
        assert_eq!(safe, "[show]\nname = \"one\"\n");
    }

    #[test]
    fn one_whose_lines_hide_a_secret_is_not_attached() {
        let hidden = "[api]\nwords = \"\"\"\n[show]\nsecret-word\n\"\"\"\n[show]\nname = \"one\"\n";
        let safe = safe_configuration(hidden.as_bytes());
        assert!(
            safe.is_none_or(|safe| !safe.contains("secret-word")),
            "it is cut out, or nothing is attached"
        );
        assert_eq!(safe_configuration(b"[api\nx"), None, "it cannot be told apart");
    }
}
