//! The player of a hall: mpv, started and kept by a thread of its own. The supervisor leaves word for it and waits for nothing; what
//! leads seats is what the player tells of its film, over a connection of its own (`app::film`), and only of the film that is loaded.

mod child;
mod deck;
mod talk;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};

pub(crate) use child::film_length_s;

use crate::config::FilmPlayer;
use crate::sys::lock::lock;
use crate::sys::own_folder::OwnFolder;
use crate::sys::realtime;
use crate::time::ShowTime;
use child::Starter;
use deck::Deck;

/// What the player is to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PlayerAsk {
    /// Have that film ready, paused at its beginning; none for no film. One that runs is left to its end, or to the next begin.
    Load(Option<PathBuf>),
    /// Run from there; a film that runs already, before that end, runs on as it is.
    Begin { from: ShowTime, until: ShowTime },
    /// Run on from where it is.
    Play,
    /// Stand.
    Pause,
    /// Be there, running or not.
    Seek(ShowTime),
}

/// The film that positions are heard of; none for none. Whatever else a player has open leads nobody.
#[derive(Debug, Clone, Default)]
pub(crate) struct FilmGate(Arc<Mutex<Option<PathBuf>>>);

impl FilmGate {
    fn set(&self, film: Option<PathBuf>) {
        *lock(&self.0) = film;
    }

    /// True if that is the film.
    pub(crate) fn lets(&self, film: Option<&str>) -> bool {
        lock(&self.0).as_deref().is_some_and(|wanted| film.map(Path::new) == Some(wanted))
    }
}

/// How the player stands.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PlayerState {
    /// Why there is none, or not that film, with what to do.
    pub(crate) trouble: Option<String>,
    /// How long the film is that is loaded, where the player knows, seconds.
    pub(crate) length_s: Option<f64>,
    /// How often it ended by itself, and how it did the last time.
    pub(crate) ends: u64,
    pub(crate) ended: String,
}

/// What player and supervisor share.
#[derive(Debug, Clone, Default)]
struct PlayerShared {
    gate: FilmGate,
    state: Arc<Mutex<PlayerState>>,
    /// Nobody needs a player any more.
    over: Arc<AtomicBool>,
}

impl PlayerShared {
    fn note(&self, what: impl FnOnce(&mut PlayerState)) {
        what(&mut lock(&self.state));
    }

    fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }
}

/// The way to the player.
#[derive(Debug, Clone)]
pub(crate) struct PlayerLink {
    asks: Sender<PlayerAsk>,
    shared: PlayerShared,
}

impl PlayerLink {
    /// Leaves word, and waits for nothing.
    pub(crate) fn ask(&self, ask: PlayerAsk) {
        if let PlayerAsk::Load(_) = ask {
            // From now on, and not only once the player has heard: the film before leads nobody any more.
            self.shared.gate.set(None);
        }
        let _ = self.asks.send(ask); // a player that could not be started hears nothing
    }

    /// How it stands.
    pub(crate) fn state(&self) -> PlayerState {
        lock(&self.shared.state).clone()
    }
}

/// The player, for as long as this is kept.
#[derive(Debug)]
pub(crate) struct Player {
    link: PlayerLink,
    socket: PathBuf,
    thread: Option<JoinHandle<()>>,
    /// Where its socket is; removed once the player has gone.
    _folder: OwnFolder,
}

impl Player {
    /// Begins to start it, which takes a moment. Where there is none its state says why.
    ///
    /// # Errors
    /// The system starts no thread, or has no place for its socket.
    pub(crate) fn start(config: &FilmPlayer) -> io::Result<Self> {
        let folder = own_folder()?;
        let socket = folder.path("mpv.sock");
        let (asks, heard) = channel();
        let shared = PlayerShared::default();
        let deck = Deck::new(Starter::new(config, &socket)?, heard, shared.clone());
        let thread = Builder::new().name("player".to_owned()).spawn(move || {
            let _ = realtime::normal_priority();
            deck.run();
        })?;
        Ok(Self { link: PlayerLink { asks, shared }, socket, thread: Some(thread), _folder: folder })
    }

    /// The way to it.
    pub(crate) fn link(&self) -> PlayerLink {
        self.link.clone()
    }

    /// Where it tells of its film.
    pub(crate) fn socket(&self) -> &Path {
        &self.socket
    }

    /// Which of its films counts.
    pub(crate) fn gate(&self) -> FilmGate {
        self.link.shared.gate.clone()
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        self.link.shared.over.store(true, Ordering::Relaxed);
        // It ends the player first, whatever that does.
        self.thread.take().map(JoinHandle::join);
    }
}

/// In the folder that the service manager gave, else among those that are temporary.
fn own_folder() -> io::Result<OwnFolder> {
    let given = std::env::var_os("RUNTIME_DIRECTORY").map(PathBuf::from);
    given
        .map_or_else(|| Err(io::ErrorKind::NotFound.into()), |given| OwnFolder::make(&given))
        .or_else(|_| OwnFolder::make(&std::env::temp_dir()))
}
