//! Slow work, on a thread of its own, one job at a time.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use super::list::List;
use super::preflighted::Preflighted;
use super::seat_test::SeatTest;
use super::shared_link::SharedLink;
use super::show::{ProvedShow, no_cue, read};
use crate::app::runtime::{DeviceJob, Devices, Finding};
use crate::config::Config;
use crate::control::{Asked, Code, Problem};
use crate::library::{CueId, Library};
use crate::playlist::{EntryFilm, PlaylistId, Shelf};
use crate::rt::{LinkEnd, Live};
use crate::settings::{LoadedShow, SettingsFile};

/// What is to be done.
#[derive(Debug)]
pub(super) enum Job {
    /// Read a cue of the library and prove it.
    Load(CueId),
    /// Check a playlist, and prove the cue of its first entry.
    List(PlaylistId),
    /// Prove the cue of an entry.
    Entry(usize, CueId, EntryFilm),
    /// Load what was loaded before.
    Again(LoadedShow),
    /// Make a test of the seats of these rows; none for all.
    Test(Option<BTreeSet<String>>),
    /// Ask the controllers for all that preflight judges.
    Preflight,
    /// Home these controllers; called off, none of them is told any more.
    Home(Vec<usize>, Arc<AtomicBool>),
    /// Wait until a test lets it end.
    #[cfg(test)]
    Held(Receiver<()>),
}

/// What was loaded before: the playlist, where there was one, and the cue; each as it is now, or why it is not.
pub(super) type Again = (Option<Result<Box<List>, Problem>>, Result<Box<ProvedShow>, Problem>);

/// What came of a job.
#[derive(Debug)]
pub(super) enum JobResult {
    /// A cue is read and proved, or why not.
    Loaded(Result<Box<ProvedShow>, Problem>),
    /// A playlist is checked, and the cue of its first entry proved, or why not.
    Listed(Result<(Box<List>, Box<ProvedShow>), Problem>),
    /// The cue of an entry is proved, or why not.
    Entry(usize, Result<Box<ProvedShow>, Problem>),
    /// What was loaded before was read and proved again.
    Again(Again),
    /// No job of ours: the film has come to that entry of the playlist.
    Reached(usize),
    /// A test of the seats of these rows is made, or why not.
    Tested(Result<(Box<SeatTest>, Box<ProvedShow>), Problem>, Option<BTreeSet<String>>),
    /// The controllers were asked for all that preflight judges.
    Preflighted(Box<Preflighted>),
    /// Controllers were homed.
    Homed(Finding),
}

/// What jobs work with.
#[derive(Debug, Clone)]
pub(super) struct Tools {
    pub(super) config: Arc<Config>,
    pub(super) library: Library,
    pub(super) line: SharedLink,
    /// The serial links that have seats.
    pub(super) links: Vec<LinkEnd>,
    pub(super) live: Arc<Live>,
    /// Where what is set is kept.
    pub(super) settings: PathBuf,
}

impl Job {
    /// The word for it.
    pub(super) const fn word(&self) -> &'static str {
        match self {
            Self::Load(_) | Self::Entry(..) | Self::Again(_) => "loading",
            Self::List(_) => "playlist",
            Self::Test(_) => "test",
            Self::Preflight => "preflight",
            Self::Home(..) => "homing",
            #[cfg(test)]
            Self::Held(_) => "preflight",
        }
    }

    /// Does it.
    pub(super) fn run(self, tools: &Tools) -> JobResult {
        let Tools { config, library, line, links, live, settings } = tools;
        let on_devices = |job| Devices { line: &mut line.hold(), links, config, live }.run(job);
        // What a fleet was about to change when this was told as under way is changed by then.
        drop(library.changing());
        match self {
            Self::Load(id) => JobResult::Loaded(read(library, config, &id, &EntryFilm::default())),
            Self::List(id) => {
                let list = List::read(&Shelf::new(&config.playlists()), library, config, &id);
                JobResult::Listed(list.and_then(|list| {
                    let cued = read(library, config, &list.entry().cue, &list.entry().film)?;
                    Ok((Box::new(list), cued))
                }))
            }
            Self::Entry(entry, id, film) => JobResult::Entry(entry, read(library, config, &id, &film)),
            Self::Again(loaded) => {
                let _loading = SettingsFile::loading(settings);
                let id = loaded.cue.parse().map_err(|error| no_cue(&loaded.cue, &error));
                let shelf = Shelf::new(&config.playlists());
                let again = |place| List::again(&shelf, library, config, &place, &loaded.cue).map(Box::new);
                let list = loaded.playlist.clone().map(again);
                let entry = list.as_ref().and_then(|list| list.as_ref().ok()).map(|list| list.entry());
                let entry = entry.filter(|entry| entry.cue.to_string() == loaded.cue);
                let film = entry.map(|entry| entry.film.clone()).unwrap_or_default();
                let cued = id.and_then(|id| read(library, config, &id, &film));
                JobResult::Again((list, cued))
            }
            Self::Test(only) => JobResult::Tested(SeatTest::make(config), only),
            Self::Preflight => {
                let (surveys, links) = match on_devices(DeviceJob::Survey) {
                    Finding::Surveyed(surveys, links) => (surveys, links),
                    Finding::Homed(_) => Default::default(),
                };
                JobResult::Preflighted(Box::new(Preflighted::of(config, &surveys, &links)))
            }
            Self::Home(lanes, called_off) => {
                JobResult::Homed(on_devices(DeviceJob::Home { lanes, called_off }))
            }
            #[cfg(test)]
            Self::Held(held) => {
                let _ = held.recv();
                JobResult::Homed(Finding::Homed(Vec::new()))
            }
        }
    }
}

/// The thread for jobs.
#[derive(Debug)]
pub(super) struct Jobs {
    tools: Tools,
    running: Option<(Receiver<JobResult>, Option<Asked>)>,
}

impl Jobs {
    pub(super) const fn new(tools: Tools) -> Self {
        Self { tools, running: None }
    }

    /// Begins it, for what `asked` gives then; the thread that calls this is woken once it is done.
    ///
    /// # Errors
    /// Where no thread can be had for it.
    pub(super) fn start(&mut self, job: Job, asked: impl FnOnce() -> Option<Asked>) -> Result<(), Problem> {
        let (tell, done) = channel();
        let supervisor = thread::current();
        let tools = self.tools.clone();
        let thread = thread::Builder::new().name(job.word().to_owned());
        let spawned = thread.spawn(move || {
            let _ = crate::sys::realtime::normal_priority();
            drop(tell.send(job.run(&tools))); // a supervisor that is gone wants no answer
            supervisor.unpark();
        });
        spawned.map_err(|cause| no_thread(&cause))?;
        self.running = Some((done, asked()));
        Ok(())
    }

    /// What the job has come to, and for whom; `None` while it runs.
    pub(super) fn take_done(&mut self) -> Option<(Result<JobResult, Problem>, Option<Asked>)> {
        let result = match self.running.as_ref()?.0.try_recv() {
            Ok(result) => Ok(result),
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => {
                Err(Problem::new(Code::Check, "it ended before it was done", "see the log of the service"))
            }
        };
        let (_, asked) = self.running.take()?;
        Some((result, asked))
    }
}

fn no_thread(cause: &std::io::Error) -> Problem {
    Problem::new(
        Code::Busy,
        format!("no thread could be started: {cause}"),
        "allow more with TasksMax= in the unit, or `ulimit -u`",
    )
}

/// Has every cue of the library checked that nobody has checked for this hall, one after the other, by processes of the lowest
/// priority.
pub(super) fn examine(library: Library) {
    let thread = thread::Builder::new().name("library".to_owned());
    // Where there is no thread for it, each cue is checked when it is asked for.
    let _ = thread.spawn(move || {
        let _ = crate::sys::realtime::normal_priority();
        library.examine_all();
    });
}
