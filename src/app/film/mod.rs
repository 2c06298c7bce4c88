//! The film that a show chases: its sources are read on threads of their own, and where the film is by the best of them is published
//! for the tick thread. A source that fails leads nobody; the threads end with the program, or with what they read.

mod clock;
mod datagrams;
#[cfg(feature = "harness")]
pub(crate) mod doors;
mod hall;
mod heard;
mod indexed;
mod left;
mod line;
mod mpv;
mod mtc;
mod network;
mod relay;
mod relayed;
mod riff;
mod sent;
mod sound;
mod sound_line;
mod table;
#[cfg(test)]
mod tests;
mod told;

use std::fs::FileType;
use std::io;
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

pub(crate) use hall::HallFilm;
pub(crate) use indexed::{Indexed, index_film};
pub(crate) use sent::TimecodeSent;
pub(crate) use sound::{LtcFound, LtcSound, SAMPLES_PER_S, look_for_ltc, wav_header};
pub(crate) use table::{FilmTable, SharedTable, SourceRow};

use super::player::FilmGate;
use crate::film::chooser::MOST_SOURCES;
use crate::film::follower::PaceLimits;
use crate::film::point::PublishedPoint;
use crate::film::sound::IndexFault;
use crate::film::source::{FilmArgs, FilmSource};
use heard::Listening;
use left::LeftRead;
use relay::Listeners;
use riff::RiffFault;
use table::Ranking;
use told::{Notes, SourceNotes, WordSink};

/// Observations that wait at the most: seconds of a source that tells a hundred a second.
const WAITING: usize = 512;

/// Why a source is not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum FilmError {
    /// A file, a FIFO or a socket does not open.
    #[error("{what} cannot be opened")]
    Open {
        /// Which, as it was named.
        what: String,
        /// Why.
        source: io::Error,
    },
    /// A file of that name is not there, or is something else.
    #[error("{} cannot be opened: {why}; {remedy}", path.display())]
    NoInput {
        /// Which.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A file is none that can be read as sound.
    #[error("{what} cannot be read")]
    Sound {
        /// Which, as it was named.
        what: String,
        /// Why.
        source: RiffFault,
    },
    /// A file is no index of a film's sound.
    #[error("{} cannot be used", path.display())]
    Index {
        /// Which.
        path: PathBuf,
        /// Why.
        source: IndexFault,
    },
    /// A command does not start.
    #[error("`{command}` cannot be started; install it (`arecord` is in alsa-utils)")]
    Command {
        /// Which.
        command: String,
        /// Why.
        source: io::Error,
    },
    /// The clock of the day may be too far off.
    #[error(
        "by its own account the system's clock may be off by {most:?} (likely {likely:?}), and {allowed:?} is allowed; have chrony or \
         ntpd steer it, or allow more with clock:TIME,max_error={}ms",
        (most.as_secs_f64() * 1e3).ceil()
    )]
    Clock {
        /// At the most.
        most: Duration,
        /// As is estimated.
        likely: Duration,
        /// What is allowed.
        allowed: Duration,
    },
    /// The day has no such time, as where clocks are set forward.
    #[error(
        "there is no such time in this machine's time zone; write it with its offset, such as 2026-11-21T19:00:00+01:00"
    )]
    NoSuchTime,
    /// There are too many of them.
    #[error("{0} sources are too many; {MOST_SOURCES} can be ranked")]
    Many(usize),
    /// Two of them are one.
    #[error("{0} is named twice; name each source once, the best first")]
    Twice(String),
    /// There is no line that could be relayed.
    #[error(
        "{0} is not a line that a relay reads; take ltc:alsa:DEVICE, ltc:pipe:COMMAND, ltc:fifo:PATH, ltc:- or mtc:DEVICE"
    )]
    NoLine(String),
    /// The system starts no further thread.
    #[error("no thread could be started; allow more with `ulimit -u`")]
    Thread(#[from] io::Error),
}

/// What a path of a source has to be.
struct WantedFile {
    is_one: fn(&FileType) -> bool,
    /// What one is that is not.
    other: &'static str,
    remedy: &'static str,
}

impl WantedFile {
    /// A socket at which somebody may listen later.
    const fn socket(remedy: &'static str) -> Self {
        Self { is_one: FileType::is_socket, other: "it is not a socket", remedy }
    }

    /// That path, if it is one: said before anything waits for what it brings.
    fn check(&self, path: &Path) -> Result<PathBuf, FilmError> {
        let (path, remedy) = (path.to_path_buf(), self.remedy);
        let why = match path.metadata() {
            Ok(found) if (self.is_one)(&found.file_type()) => return Ok(path),
            Ok(_) => self.other.to_owned(),
            Err(error) => error.to_string(),
        };
        Err(FilmError::NoInput { path, why, remedy })
    }

    /// The same of what may come later.
    fn check_if_there(&self, path: &Path) -> Result<PathBuf, FilmError> {
        if path.exists() { self.check(path) } else { Ok(path.to_path_buf()) }
    }
}

/// What bytes come from that are read as they come.
fn is_line(kind: &FileType) -> bool {
    kind.is_fifo() || kind.is_char_device()
}

/// What holds for all sources of a show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SourceRules {
    /// True if those may lead as well that have not proved themselves.
    pub(crate) allows_coarse: bool,
    /// How far from 1 a film's rate is followed.
    pub(crate) band: f64,
    /// For how long a source that falls silent is taken to run on, as a multiple of what its kind and the cause allow.
    pub(crate) freewheel: f64,
}

impl Default for SourceRules {
    fn default() -> Self {
        Self { allows_coarse: false, band: PaceLimits::default().band, freewheel: 1.0 }
    }
}

/// The command that gives the sound of a source, if it has one.
type ChildSlot = Arc<Mutex<Option<Child>>>;

/// Sources that are being read.
#[derive(Debug)]
pub(crate) struct FilmReader {
    point: Arc<PublishedPoint>,
    table: SharedTable,
    children: Vec<ChildSlot>,
    over: Arc<AtomicBool>,
}

impl FilmReader {
    /// Begins to read sources, the first of which leads while it can. Coarse ones lead only if that is allowed.
    ///
    /// # Errors
    /// [`FilmError`] where one cannot be had at all. One that ends later is looked for again.
    pub(crate) fn start(sources: &[FilmArgs], rules: SourceRules) -> Result<Self, FilmError> {
        Self::each(sources, rules, None, read)
    }

    /// The same in a hall, which opens whatever its sources are: what is wrong with one is noted beside it, and it is tried again.
    /// The first of them is the hall's own player, where it has one, and heard while it shows the film that it is to.
    ///
    /// # Errors
    /// [`FilmError::Thread`].
    pub(crate) fn open(
        sources: &[FilmArgs],
        rules: SourceRules,
        player: Option<FilmGate>,
    ) -> Result<Self, FilmError> {
        Self::each(sources, rules, player, |args, told, child| try_until_read(args, told, child, read))
    }

    /// Passes on what is read of sources, each at its socket in a folder: nobody here follows them.
    ///
    /// # Errors
    /// [`FilmError`] where a socket cannot be served. A device that is not there is tried again.
    pub(crate) fn relay(sources: &[FilmArgs], folder: &Path) -> Result<Self, FilmError> {
        let rules = SourceRules { band: 0.0, ..SourceRules::default() };
        Self::each(sources, rules, None, |args, told, child| {
            let listeners = Listeners::serve(&args.source, folder)?;
            let read = move |args: &FilmArgs, told, child| listeners.read(&args.source, told, child);
            try_until_read(args, told, child, read)
        })
    }

    fn each(
        sources: &[FilmArgs],
        rules: SourceRules,
        mut player: Option<FilmGate>,
        read: impl Fn(&FilmArgs, WordSink, ChildSlot) -> Result<(), FilmError>,
    ) -> Result<Self, FilmError> {
        if sources.len() > MOST_SOURCES {
            return Err(FilmError::Many(sources.len()));
        }
        let is_named = |place: usize| sources[..place].iter().any(|one| one.source == sources[place].source);
        if let Some(twice) = (1..sources.len()).find(|place| is_named(*place)) {
            return Err(FilmError::Twice(sources[twice].source.to_string()));
        }
        let (to, heard) = sync_channel(WAITING);
        let notes: Vec<Notes> = sources.iter().map(SourceNotes::shared).collect();
        let ranking = Ranking::new(sources, &notes, rules);
        let (point, table) = (Arc::clone(&ranking.point), ranking.table.clone());
        let mut reader = Self { point, table, children: Vec::new(), over: Arc::default() };
        start("film", move || ranking.run(&heard))?;
        for (place, (args, notes)) in sources.iter().zip(notes).enumerate() {
            let told = WordSink {
                place,
                to: to.clone(),
                notes,
                over: Arc::clone(&reader.over),
                gate: player.take(),
            };
            let child = ChildSlot::default();
            reader.children.push(Arc::clone(&child));
            read(args, told, child)?;
        }
        Ok(reader)
    }

    /// Where the film is, for whoever follows it.
    #[must_use]
    pub(crate) fn point(&self) -> Arc<PublishedPoint> {
        Arc::clone(&self.point)
    }

    /// What is heard of it, for people.
    pub(crate) fn table(&self) -> SharedTable {
        self.table.clone()
    }
}

impl Drop for FilmReader {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        self.children.iter().for_each(|child| sound_line::kill(child));
    }
}

/// Begins to read a source; a command that is started for it is put there.
fn read(args: &FilmArgs, told: WordSink, child: ChildSlot) -> Result<(), FilmError> {
    match &args.source {
        FilmSource::Ltc(input) => sound_line::start_reading(input, Listening::Ltc, args, told, &child),
        FilmSource::Sound(sound) => {
            let films = Listening::Sound(indexed::read_all(&sound.indexes)?);
            sound_line::start_reading(&sound.line, films, args, told, &child)
        }
        FilmSource::Mpv(socket) => mpv::start_reading(socket, args, told),
        FilmSource::Mtc(device) => mtc::start_reading(device, args, told),
        FilmSource::ArtNet(sender) => network::hear_artnet(sender, args, told),
        FilmSource::Osc(sender) => network::hear_osc(sender, args, told),
        FilmSource::Http(sender) => network::hear_http(sender, args, told),
        FilmSource::Clock(from) => clock::start_reading(from, told),
    }
}

/// Has a source read; one that cannot be had is tried again and again, and why is noted beside it for as long as that is so.
fn try_until_read(
    args: &FilmArgs,
    told: WordSink,
    child: ChildSlot,
    read: impl Fn(&FilmArgs, WordSink, ChildSlot) -> Result<(), FilmError> + Send + 'static,
) -> Result<(), FilmError> {
    let args = args.clone();
    let is_read = move |told: &WordSink| {
        let begun = read(&args, told.clone(), Arc::clone(&child));
        let why = begun.err().map(|error| {
            let why = std::error::Error::source(&error).map(|why| format!(": {why}")).unwrap_or_default();
            format!("{error}{why}")
        });
        let is_read = why.is_none();
        told.note(|notes| notes.trouble = why);
        is_read
    };
    if !is_read(&told) {
        start("source", move || while told.waits() && !is_read(&told) {})?;
    }
    Ok(())
}

fn start(name: &str, run: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name(name.to_owned()).spawn(run).map(drop)
}
