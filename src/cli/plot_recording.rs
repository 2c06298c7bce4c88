//! `kinocue plot` of a recording.

use std::cmp::Reverse;
use std::fs::{self, File};
use std::io::{BufReader, Seek as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, anyhow};

use super::record::{open, seat_in, unread};
use super::{Exit, Failure, OrExit as _};
use crate::plot::{self, FilmAxis, Gathered, Look, Picture};
use crate::record::{Contents, ReadError, Summary, Wanted, WantedFull, beginning, read_ahead, summarize};
use crate::sys::file;
use crate::time::ShowTime;

/// What is drawn of a recording.
pub(super) struct Asked<'a> {
    /// The file.
    pub(super) file: &'a OpenRecording<'a>,
    /// Another, whose sent positions are laid over it.
    pub(super) other: Option<&'a OpenRecording<'a>>,
    /// The seat; by itself one that a mark names, that fell out, or that was held back farthest.
    pub(super) seat: Option<&'a str>,
    /// The stretch of show time.
    pub(super) from: Option<ShowTime>,
    /// Its end.
    pub(super) until: Option<ShowTime>,
    /// Columns at the most.
    pub(super) columns: usize,
    /// For a file, not a terminal.
    pub(super) is_detailed: bool,
}

/// A recording that is open, to be read more than once.
pub(super) struct OpenRecording<'a> {
    path: &'a Path,
    file: File,
}

impl<'a> OpenRecording<'a> {
    pub(super) fn open(path: &'a Path) -> Result<Self, Failure> {
        Ok(Self { path, file: open(path)?.into_inner() })
    }

    /// The same of a file in the folder of a service: no link leads out of it.
    pub(super) fn open_ours(path: &'a Path) -> Result<Self, Failure> {
        let file =
            file::open_ours(path).with_context(|| path.display().to_string()).or_exit(Exit::NoInput)?;
        Ok(Self { path, file })
    }

    /// All of it, from its beginning; a pipe has none to go back to, and nothing more is in it the second time.
    fn input(&self) -> BufReader<&File> {
        let _ = (&self.file).rewind();
        BufReader::new(&self.file)
    }

    fn summarized(&self) -> Result<(Contents, Summary), Failure> {
        summarize(self.input()).map_err(|error| unread(error, self.path))
    }
}

/// The recording that a path means: `last` is the newest of the folder here. `None` where it is something else.
pub(super) fn meant(path: &Path) -> Result<Option<PathBuf>, Failure> {
    if path == Path::new("last") && !path.exists() {
        return newest(Path::new(".")).map(Some);
    }
    let is_one = path.is_file() && matches!(beginning(open(path)?), Ok(_) | Err(ReadError::Order(_)));
    Ok(is_one.then(|| path.to_owned()))
}

fn newest(dir: &Path) -> Result<PathBuf, Failure> {
    let entries = fs::read_dir(dir).or_exit(Exit::NoInput)?.flatten().map(|entry| entry.path());
    let recordings =
        entries.filter(|path| path.extension().is_some_and(|end| end == "mcap")).filter_map(|path| {
            let begun = beginning(open(&path).ok()?).ok()?.get("wall_ns")?.parse::<u64>().ok()?;
            Some((begun, path))
        });
    let newest = recordings.max().map(|(_, path)| path);
    newest
        .ok_or_else(|| anyhow!("no recording in this folder; kinocue plot FILE names one"))
        .or_exit(Exit::NoInput)
}

/// The picture, the seat that is drawn, and all that there are.
pub(super) fn picture(asked: &Asked<'_>) -> Result<(Picture, String, Vec<String>), Failure> {
    let (contents, summary) = asked.file.summarized()?;
    let lane = lane(asked, &contents, &summary)?;
    let seats: Vec<String> = contents.seats.iter().map(|seat| seat.name.clone()).collect();
    let axis = axis(asked, &summary)?;
    let other_axis = axis.plain();
    let look = Look { lane, axis, is_detailed: asked.is_detailed };
    let gathered = gathered(asked.file, look, &contents)?;
    let mut flaws = Vec::new();
    let other = match asked.other {
        Some(other) => {
            let (contents, _) = other.summarized()?;
            flaws = contents.flaws();
            let name = &summary.seats[lane].name;
            let lane = seat_in(&contents, name)?;
            let look = Look { lane, axis: other_axis, is_detailed: asked.is_detailed };
            Some(self::gathered(other, look, &contents)?)
        }
        None => None,
    };
    let mut picture = plot::of_recording(&contents, &summary, gathered, other);
    picture.facts.extend(flaws.iter().map(|flaw| format!("The recording laid over it: {flaw}.")));
    Ok((picture, seats[lane].clone(), seats))
}

fn gathered(file: &OpenRecording<'_>, look: Look, contents: &Contents) -> Result<Gathered, Failure> {
    let seat = contents.seats[look.lane].name.as_str();
    let is_whole = contents.messages.contains_key("/full/sent");
    let mut gathered = Gathered::new(contents, look, is_whole);
    let wanted = Wanted { seat: Some(seat), full: WantedFull::Ticks, ..Wanted::ALL };
    read_ahead(file.input(), wanted, &mut |contents, at, told| gathered.take(contents, at, told))
        .map_err(|error| unread(error, file.path))?;
    Ok(gathered)
}

fn lane(asked: &Asked<'_>, contents: &Contents, summary: &Summary) -> Result<usize, Failure> {
    if let Some(name) = asked.seat {
        return seat_in(contents, name);
    }
    // One that a mark names, else that fell out nearest to what the file is of, else that was held back farthest.
    let caused_at = contents.caused_at().unwrap_or_default();
    let gravest = summary.seats.iter().enumerate().max_by(|(one_lane, one), (other_lane, other)| {
        let named = (summary.marked == Some(*one_lane)).cmp(&(summary.marked == Some(*other_lane)));
        let [one_near, other_near] =
            [one, other].map(|seat| Reverse(seat.falls.distance(caused_at).unwrap_or(Duration::MAX)));
        named
            .then(one_near.cmp(&other_near))
            .then(one.apart.total_cmp(&other.apart))
            .then(other_lane.cmp(one_lane))
    });
    gravest
        .map(|(lane, _)| lane)
        .ok_or_else(|| anyhow!("{}: it has no samples", asked.file.path.display()))
        .or_exit(Exit::BadCue)
}

fn axis(asked: &Asked<'_>, summary: &Summary) -> Result<FilmAxis, Failure> {
    let Some((first, last)) = summary.film else {
        return Ok(FilmAxis::of_film(0.0, 1.0, asked.columns));
    };
    let from_s = asked.from.map_or(f64::NEG_INFINITY, ShowTime::as_secs_f64);
    let until_s = asked.until.map_or(f64::INFINITY, ShowTime::as_secs_f64);
    FilmAxis::over(&summary.passes, (from_s, until_s), asked.columns)
        .ok_or_else(|| {
            let [first, last] = [first, last].map(ShowTime::from_secs_f64);
            anyhow!("nothing to show there; the film ran from {first} to {last}")
        })
        .or_exit(Exit::Usage)
}
