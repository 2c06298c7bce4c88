//! `kinocue record list`.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;

use super::super::{Exit, Failure, OrExit as _, print};
use super::{open, shown, wall_in_zone};
use crate::record::{beginning, closing_of};

/// Lists the recordings in a folder, oldest first.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kinocue record list /var/lib/kinocue/recordings")]
pub(in super::super) struct Args {
    /// The folder.
    #[arg(default_value = ".")]
    dir: PathBuf,
    /// Print one JSON array.
    #[arg(long)]
    json: bool,
}

/// A recording, as its beginning tells.
#[derive(Debug, Serialize)]
struct Listed {
    file: String,
    bytes: u64,
    wall_ns: u64,
    mode: String,
    hall: String,
    cue: String,
    /// Which part of the recording of its show.
    part: u32,
    /// Moments that were marked; 0 where it was not closed.
    marks: u64,
    /// False where it was not closed.
    whole: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let entries =
        fs::read_dir(&args.dir).with_context(|| args.dir.display().to_string()).or_exit(Exit::NoInput)?;
    let paths = entries.flatten().map(|entry| entry.path());
    let paths = paths.filter(|path| path.extension().is_some_and(|end| end == "mcap"));
    // What is no recording, a cue say, is passed over.
    let mut listed: Vec<Listed> = paths.filter_map(|path| listed(&path)).collect();
    listed.sort_by(|one, other| (one.wall_ns, &one.file).cmp(&(other.wall_ns, &other.file)));
    if args.json {
        return print::json(&listed).map(|()| Exit::Done);
    }
    let mut out = String::new();
    for one in &listed {
        let Listed { file, bytes, wall_ns, mode, hall, cue, part, marks, whole } = one;
        let open = if *whole { "" } else { "  not closed: kinocue record recover" };
        let part = if *part > 1 { format!(", part {part}") } else { String::new() };
        let marks = match marks {
            0 => String::new(),
            1 => ", 1 mark".to_owned(),
            _ => format!(", {marks} marks"),
        };
        writeln!(
            out,
            "{}  {:>8.1} MB  {mode:<8}{hall}  {cue}{part}{marks}  {file}{open}",
            wall_in_zone(*wall_ns),
            megabytes(*bytes)
        )
        .expect("a String takes all text");
    }
    if listed.is_empty() {
        out = format!("no recordings in {}\n", args.dir.display());
    }
    print::out(&out).map(|()| Exit::Done)
}

fn listed(path: &Path) -> Option<Listed> {
    let entries = beginning(open(path).ok()?).ok()?;
    let entry = |key: &str| shown(entries.get(key).map_or("", String::as_str));
    let name = path.file_name()?.to_string_lossy().into_owned();
    let end = closing_of(open(path).ok()?).unwrap_or_default().end;
    Some(Listed {
        bytes: fs::metadata(path).ok()?.len(),
        wall_ns: entries.get("wall_ns")?.parse().ok()?,
        mode: entry("mode"),
        hall: entry("hall"),
        cue: entry("cue"),
        part: entry("part").parse().unwrap_or(1),
        marks: end.get("marks").and_then(|marks| marks.parse().ok()).unwrap_or(0),
        whole: !name.ends_with(".part.mcap"),
        file: shown(&name),
    })
}

#[expect(clippy::cast_precision_loss, reason = "to a tenth of a megabyte")]
fn megabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e6
}
