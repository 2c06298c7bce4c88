//! The file of what is set. Written by a thread of its own, so that no disk, full or slow, holds up anybody: into another file,
//! which is on the disk before it takes the place of the last, so that whatever crashes leaves one of the two.

use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::Settings;
use crate::sys::file::{create_ours, want_of_files};
use crate::sys::folder::Folder;
use crate::sys::realtime;

const FILE: &str = "settings.json";
const UNFINISHED: &str = "settings.json.new";
/// Where one goes that cannot be read; only the last is kept.
const ASIDE: &str = "settings.json.bad";
/// There while what was loaded before is being loaded again.
const LOADING: &str = "loading";
/// The longest file that is read, bytes.
const LONGEST: u64 = 16 << 20;
/// How often it is tried again where the disk takes nothing.
const AGAIN: Duration = Duration::from_secs(10);

/// What was found at the start.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Kept {
    /// What was set; `None` if nobody has set anything, or it cannot be read.
    pub(crate) settings: Option<Settings>,
    /// What a person should know of it.
    pub(crate) said: Vec<String>,
}

/// Where settings go. Dropped, it writes what still waits.
#[derive(Debug)]
pub(crate) struct SettingsFile {
    folder: PathBuf,
    given: Option<Settings>,
    exchange: Arc<SettingsExchange>,
    thread: Option<JoinHandle<()>>,
}

/// Between whoever sets and whoever writes.
#[derive(Debug, Default)]
struct SettingsExchange {
    tray: Mutex<Tray>,
    come: Condvar,
}

#[derive(Debug, Default)]
struct Tray {
    /// The newest text that is not on the disk.
    due: Option<String>,
    over: bool,
    trouble: Option<String>,
    /// What became better, until it is said.
    news: Option<&'static str>,
}

/// That something is being loaded because it was before the start. Where the program ends meanwhile other than in order, it is
/// not loaded at the next start: what ends a service must not end it each time. Dropped, it is over.
#[derive(Debug)]
pub(crate) struct Loading(PathBuf);

impl Drop for Loading {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

impl SettingsFile {
    /// Opens that of a folder, and reads what is there. Cannot fail: what is wrong is said.
    #[must_use]
    pub(crate) fn open(folder: &Path) -> (Self, Kept) {
        let mut kept = read(folder);
        let loading = folder.join(LOADING);
        let show = kept.settings.as_mut().and_then(|settings| settings.show.take_if(|_| loading.exists()));
        if let Some(show) = show {
            let why = "the program ended while it was being loaded the last time";
            kept.said.push(format!("{} is not loaded: {why}; load it again", show.cue));
        }
        drop(Loading(loading));
        let exchange = Arc::<SettingsExchange>::default();
        let (of_thread, to) = (Arc::clone(&exchange), folder.to_owned());
        let thread = thread::Builder::new().name("settings".to_owned()).spawn(move || {
            let _ = realtime::normal_priority();
            of_thread.serve(&to);
        });
        let thread = thread.map_err(|error| exchange.lock().fail(&error, folder)).ok();
        (Self { folder: folder.to_owned(), given: None, exchange, thread }, kept)
    }

    /// Has it kept, where it is another than before; gives the text of it then. Waits for nothing.
    pub(crate) fn put(&mut self, settings: Settings) -> Option<String> {
        if self.given.as_ref() == Some(&settings) {
            return None;
        }
        let text = settings.text();
        self.exchange.lock().due = Some(text.clone());
        self.exchange.come.notify_one();
        self.given = Some(settings);
        Some(text)
    }

    /// Marks that what was loaded before the start is being loaded; to be called on a thread that may wait for the disk.
    pub(crate) fn loading(folder: &Path) -> Loading {
        let path = folder.join(LOADING);
        let _ = create_ours(&path); // without it, nothing warns the next start
        Loading(path)
    }

    /// The folder.
    #[must_use]
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Why it cannot be kept at present, and what to do; `None` if it can.
    #[must_use]
    pub(crate) fn trouble(&self) -> Option<String> {
        self.exchange.lock().trouble.clone()
    }

    /// What has become better since the last time.
    pub(crate) fn news(&mut self) -> Option<&'static str> {
        self.exchange.lock().news.take()
    }
}

impl Drop for SettingsFile {
    fn drop(&mut self) {
        self.exchange.lock().over = true;
        self.exchange.come.notify_one();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // what it could not write was said
        }
        // An end in order says nothing against what is being loaded.
        drop(Loading(self.folder.join(LOADING)));
    }
}

impl SettingsExchange {
    /// What is behind the lock is whole at any time, also where a thread that held it panicked.
    fn lock(&self) -> MutexGuard<'_, Tray> {
        self.tray.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes what comes, the newest alone, until it is over.
    fn serve(&self, folder: &Path) {
        let mut tray = self.lock();
        loop {
            if let Some(text) = tray.due.take() {
                drop(tray);
                let written = write(folder, &text);
                tray = self.lock();
                match written {
                    Ok(()) => tray.mend(),
                    Err(error) => {
                        tray.fail(&error, folder);
                        // Unless something newer has come meanwhile.
                        tray.due.get_or_insert(text);
                        if tray.over {
                            return;
                        }
                        tray = self.come.wait_timeout(tray, AGAIN).unwrap_or_else(PoisonError::into_inner).0;
                    }
                }
            } else if tray.over {
                return;
            } else {
                tray = self.come.wait(tray).unwrap_or_else(PoisonError::into_inner);
            }
        }
    }
}

impl Tray {
    /// Notes trouble, once until it is over.
    fn fail(&mut self, why: &io::Error, folder: &Path) {
        if self.trouble.is_none() {
            let room = || format!("make room in {}, or name another folder with --state", folder.display());
            let remedy = want_of_files(why).map_or_else(room, str::to_owned);
            self.trouble = Some(format!("what people set cannot be kept over a restart: {why}; {remedy}"));
        }
    }

    fn mend(&mut self) {
        if self.trouble.take().is_some() {
            self.news = Some("what people set is kept again");
        }
    }
}

/// Puts a text in the place of the last.
fn write(folder: &Path, text: &str) -> io::Result<()> {
    let folder = Folder::open(folder)?;
    folder.remove(UNFINISHED)?;
    folder.replace(FILE, UNFINISHED, text.as_bytes())?;
    folder.sync()
}

fn read(folder: &Path) -> Kept {
    let settings = text(folder).and_then(|text| text.as_deref().map(Settings::parse).transpose());
    match settings {
        Ok(settings) => Kept { settings, said: Vec::new() },
        Err(why) => {
            let aside = Folder::open(folder).and_then(|folder| folder.rename(FILE, ASIDE));
            let path = folder.join(FILE);
            let path = path.display();
            let put = match aside {
                Ok(()) => format!("it is now {ASIDE}"),
                Err(error) => format!("it cannot be put aside: {error}"),
            };
            let said = format!(
                "{path} cannot be read: {why}; {put}. Look which seats have to be out, and set levels, effects and trim anew"
            );
            Kept { settings: None, said: vec![said] }
        }
    }
}

/// Keeps what is set in the file of a folder, where nobody else does.
///
/// # Errors
/// Those of the disk.
pub(crate) fn keep(folder: &Path, settings: &Settings) -> io::Result<()> {
    write(folder, &settings.text())
}

/// The text of the file; `None` if there is none.
///
/// # Errors
/// Why it cannot be read.
fn text(folder: &Path) -> Result<Option<String>, String> {
    let read = || -> io::Result<Option<String>> {
        let folder = Folder::open(folder)?;
        let Some((file, _)) = folder.file(FILE)? else {
            let something_else = folder.names()?.iter().any(|name| name == FILE);
            return if something_else { Err(io::Error::other("it is no regular file")) } else { Ok(None) };
        };
        let mut text = String::new();
        file.take(LONGEST + 1).read_to_string(&mut text)?;
        if text.len() as u64 > LONGEST {
            return Err(io::Error::other(format!("it is longer than {LONGEST} bytes")));
        }
        Ok(Some(text))
    };
    read().map_err(|error| error.to_string())
}
