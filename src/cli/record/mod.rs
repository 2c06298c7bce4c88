//! `kinocue record`: recordings looked at, cut and mended.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};

use super::client::{ServerArgs, dump_record as dump};
use super::{Exit, Failure, OrExit as _, names, print};
use crate::plain;
use crate::record::{Contents, ReadError};
use crate::sys;

mod compare;
mod cut;
mod info;
mod layout;
mod list;
mod recover;

/// Lists, cuts, compares and repairs recordings of plays and shows.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    List(list::Args),
    Cut(cut::Args),
    Compare(compare::Args),
    Info(info::Args),
    Recover(recover::Args),
    Layout(layout::Args),
    /// Has the running service write the contents of its flight recorder to an incident file.
    #[command(after_help = "Example:\n  kinocue record dump")]
    Dump(ServerArgs),
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    match &args.command {
        Command::List(args) => list::run(args),
        Command::Cut(args) => cut::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Info(args) => info::run(args),
        Command::Recover(args) => recover::run(args),
        Command::Layout(args) => layout::run(args),
        Command::Dump(server) => dump(server),
    }
}

/// A recording to be read.
pub(super) fn open(path: &Path) -> Result<BufReader<File>, Failure> {
    let file = sys::file::open(path).with_context(|| path.display().to_string()).or_exit(Exit::NoInput)?;
    Ok(BufReader::new(file))
}

/// The place of a seat in a recording.
pub(super) fn seat_in(contents: &Contents, name: &str) -> Result<usize, Failure> {
    let known = || contents.seats.iter().map(|seat| seat.name.as_str());
    contents.seat(name).ok_or_else(|| names::unknown("seat", name, known()))
}

/// Why a file is not read, with what ends the program.
pub(super) fn unread(error: ReadError, path: &Path) -> Failure {
    Failure { exit: Exit::BadCue, error: anyhow::Error::new(error).context(path.display().to_string()) }
}

/// Says what is missing in a recording of which something was made; gives what ends the program.
pub(super) fn tell_flaws(path: &Path, flaws: &[String]) -> Exit {
    for flaw in flaws {
        print::tell(&format!("{}: {flaw}", path.display()));
    }
    if flaws.is_empty() { Exit::Done } else { Exit::CheckFailed }
}

/// A wall time as people here read it.
pub(super) fn wall(ns: u64) -> String {
    here(ns).strftime("%F %T").to_string()
}

/// The same with its zone.
pub(super) fn wall_in_zone(ns: u64) -> String {
    here(ns).strftime("%F %T %:z").to_string()
}

fn here(ns: u64) -> Zoned {
    Timestamp::from_nanosecond(ns.into()).unwrap_or_default().to_zoned(TimeZone::system())
}

/// The text of a file's entry, as it can be shown.
pub(super) fn shown(text: &str) -> String {
    plain::escaped(text, 200).into_owned()
}

/// The default of a name that is written beside a file: its own, with another end.
pub(super) fn beside(path: &Path, end: &str) -> PathBuf {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.strip_suffix(".mcap").unwrap_or(&name);
    path.with_file_name(format!("{}{end}", stem.strip_suffix(".part").unwrap_or(stem)))
}
