//! What the player shows: does what is asked of it, one after the other, and starts it anew where it ends or hangs. A film is always
//! loaded paused, so that nothing runs by itself.

use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use serde_json::json;

use super::child::{PlayerProcess, Starter};
use super::talk::MpvTalk;
use super::{PlayerAsk, PlayerShared};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime, ShowTime};

/// From one look at the player to the next, where nothing is asked.
const LOOK: Duration = Duration::from_millis(200);
/// One that does not answer for longer hangs, and is ended.
const MUTE: Duration = Duration::from_secs(5);
/// From its end to its next start, at first and at most.
const WAIT: Duration = Duration::from_secs(1);
const LONGEST_WAIT: Duration = Duration::from_secs(30);
/// One that ran for so long ends for another reason than it was started.
const STEADY: Duration = Duration::from_mins(1);
/// The oldest one that is used: before it the end of a film says not of which.
const OLDEST: (u32, u32) = (0, 33);
/// A film that is nearer to where it is wanted is there.
const THERE_S: f64 = 0.001;

/// The film that is loaded.
#[derive(Debug)]
struct Reel {
    path: PathBuf,
    /// Where it was when it was looked at last, seconds.
    at_s: f64,
    /// It was opened, or cannot be; else the player was too busy for it, and is asked again.
    tried: bool,
}

/// The player, over all its processes.
#[derive(Debug)]
pub(super) struct Deck {
    starter: Starter,
    asks: Receiver<PlayerAsk>,
    shared: PlayerShared,
    reel: Option<Reel>,
    /// What follows the film that runs.
    next: Option<Option<PathBuf>>,
    /// Since when it does not answer.
    mute: Option<MonoTime>,
}

impl Deck {
    pub(super) const fn new(starter: Starter, asks: Receiver<PlayerAsk>, shared: PlayerShared) -> Self {
        Self { starter, asks, shared, reel: None, next: None, mute: None }
    }

    /// Keeps a player until nobody needs it any more.
    pub(super) fn run(mut self) {
        let mut wait = WAIT;
        while !self.shared.is_over() {
            let began = Monotonic.now();
            let ended = self.one();
            self.shared.gate.set(None);
            let Err(why) = ended else { return };
            self.shared.note(|state| (state.trouble, state.length_s) = (Some(why), None));
            wait = if Monotonic.now().since(began) >= STEADY { WAIT } else { wait };
            self.rest(wait);
            wait = (wait * 2).min(LONGEST_WAIT);
        }
    }

    /// One player, from its start to its end.
    ///
    /// # Errors
    /// Why it ended, where it was not to.
    fn one(&mut self) -> Result<(), String> {
        let mut running = self.starter.start().map_err(|error| {
            format!("no process could be started for mpv: {error}; check the limits of the service")
        })?;
        let Some(stream) = running.connect(&self.starter, &self.shared)? else { return Ok(()) };
        let ended = MpvTalk::new(stream, self.shared.clone()).and_then(|mut talk| self.keep(&mut talk));
        match ended {
            Ok(Ok(())) => Ok(()),
            Ok(Err(why)) => Err(why),
            Err(_) if self.shared.is_over() => Ok(()),
            Err(error) => {
                let why = how(&mut running, &error);
                self.shared.note(|state| (state.ends, state.ended) = (state.ends + 1, why.clone()));
                Err(format!("{why}; it is restarted, with its film paused where it was"))
            }
        }
    }

    /// Does what is asked, until nobody needs it any more; why it does not do, where it does not.
    fn keep(&mut self, talk: &mut MpvTalk) -> io::Result<Result<(), String>> {
        self.mute = None;
        let version = talk.version()?;
        if let Some(why) = version.as_str().and_then(too_old) {
            return Ok(Err(why));
        }
        self.shared.note(|state| state.trouble = None);
        if let Some(Reel { path, at_s, .. }) = self.reel.take() {
            let loaded = self.load(talk, path, at_s);
            self.bear(loaded)?;
        }
        while !self.shared.is_over() {
            let done = match self.asks.recv_timeout(LOOK) {
                Ok(ask) => self.heed(talk, ask),
                Err(RecvTimeoutError::Timeout) => Ok(()),
                Err(RecvTimeoutError::Disconnected) => return Ok(Ok(())),
            };
            let looked = done.and_then(|()| self.look(talk));
            self.bear(looked)?;
        }
        Ok(Ok(()))
    }

    /// A player that is mute for a moment is waited for.
    fn bear(&mut self, done: io::Result<()>) -> io::Result<()> {
        let now = Monotonic.now();
        match done {
            Ok(()) => self.mute = None,
            Err(error) if error.kind() == io::ErrorKind::TimedOut => {
                if now.since(*self.mute.get_or_insert(now)) >= MUTE {
                    return Err(error);
                }
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn heed(&mut self, talk: &mut MpvTalk, ask: PlayerAsk) -> io::Result<()> {
        match ask {
            PlayerAsk::Load(film) => {
                if !self.runs(talk)? {
                    return self.change(talk, film);
                }
                if film.is_some() && film.as_ref() == self.reel.as_ref().map(|reel| &reel.path) {
                    self.next = None;
                    self.shared.gate.set(film);
                } else {
                    self.next = Some(film);
                }
                Ok(())
            }
            PlayerAsk::Begin { from, until } => self.begin(talk, from, until),
            PlayerAsk::Play => pause(talk, false),
            PlayerAsk::Pause => pause(talk, true),
            PlayerAsk::Seek(at) => seek(talk, at.as_secs_f64()),
        }
    }

    fn begin(&mut self, talk: &mut MpvTalk, from: ShowTime, until: ShowTime) -> io::Result<()> {
        if let Some(next) = self.next.take() {
            self.change(talk, next)?;
        }
        let (from, until) = (from.as_secs_f64(), until.as_secs_f64());
        let at = talk.get("time-pos")?.as_f64().unwrap_or(f64::MAX);
        let is_there = self.runs(talk)? && (from..until).contains(&at);
        if !is_there && (at - from).abs() > THERE_S {
            seek(talk, from)?;
        }
        pause(talk, false)
    }

    fn runs(&self, talk: &mut MpvTalk) -> io::Result<bool> {
        Ok(self.reel.is_some() && talk.get("pause")? == false && talk.get("eof-reached")? == false)
    }

    /// Shows another film, or none.
    fn change(&mut self, talk: &mut MpvTalk, film: Option<PathBuf>) -> io::Result<()> {
        (self.reel, self.next) = (None, None);
        self.shared.note(|state| (state.trouble, state.length_s) = (None, None));
        match film {
            Some(path) => self.load(talk, path, 0.0),
            None => talk.ask(&json!(["stop"])).map(drop),
        }
    }

    fn load(&mut self, talk: &mut MpvTalk, path: PathBuf, at_s: f64) -> io::Result<()> {
        self.shared.gate.set(None);
        pause(talk, true)?;
        let name = path.to_string_lossy().into_owned();
        self.reel = Some(Reel { path: path.clone(), at_s, tried: false });
        let opened = talk.open(&name)?;
        self.reel.iter_mut().for_each(|reel| reel.tried = true);
        if let Err(why) = opened {
            let trouble = format!("the film {name} cannot be shown: {why}; check that `mpv` plays it");
            self.shared.note(|state| state.trouble = Some(trouble));
            return Ok(());
        }
        if at_s > 0.0 {
            seek(talk, at_s)?;
        }
        let length_s = talk.get("duration")?.as_f64();
        self.shared.note(|state| state.length_s = length_s);
        self.shared.gate.set(Some(path));
        Ok(())
    }

    /// Remembers where the film is, and has what follows it loaded once it does not run any more.
    fn look(&mut self, talk: &mut MpvTalk) -> io::Result<()> {
        if let Some(Reel { path, at_s, .. }) = self.reel.take_if(|reel| !reel.tried) {
            return self.load(talk, path, at_s);
        }
        let at = talk.get("time-pos")?.as_f64();
        if let (Some(reel), Some(at_s)) = (&mut self.reel, at) {
            reel.at_s = at_s;
        }
        if self.next.is_some() && !self.runs(talk)? {
            let next = self.next.take().flatten();
            return self.change(talk, next);
        }
        Ok(())
    }

    /// Waits for the next start. What is to be shown then is heard; whatever else is asked meanwhile is asked of nobody.
    fn rest(&mut self, wait: Duration) {
        let until = Monotonic.now() + wait;
        while Monotonic.now() < until && !self.shared.is_over() {
            match self.asks.recv_timeout(LOOK) {
                Ok(PlayerAsk::Load(film)) => {
                    self.reel = film.map(|path| Reel { path, at_s: 0.0, tried: false })
                }
                Ok(PlayerAsk::Seek(at)) => {
                    self.reel.iter_mut().for_each(|reel| reel.at_s = at.as_secs_f64());
                }
                Ok(_) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }
}

fn pause(talk: &mut MpvTalk, yes: bool) -> io::Result<()> {
    talk.ask(&json!(["set_property", "pause", yes])).map(drop)
}

fn seek(talk: &mut MpvTalk, at_s: f64) -> io::Result<()> {
    talk.ask(&json!(["seek", at_s, "absolute+exact"])).map(drop)
}

/// How it ended.
fn how(running: &mut PlayerProcess, error: &io::Error) -> String {
    // Its socket is closed a moment before it is gone.
    Monotonic.sleep_until(Monotonic.now() + LOOK);
    match running.ended() {
        Some(status) => format!("mpv has ended ({status})"),
        None if error.kind() == io::ErrorKind::TimedOut => "mpv hung, and was ended".to_owned(),
        None => "mpv has closed its socket".to_owned(),
    }
}

/// Why a player of that version is not used.
fn too_old(version: &str) -> Option<String> {
    let numbers = version.split_once(' ').map_or(version, |(_, number)| number).trim_start_matches('v');
    let mut parts = numbers.split(['.', '-']).map_while(|part| part.parse::<u32>().ok());
    let (major, minor) = (parts.next()?, parts.next()?);
    let (oldest_major, oldest_minor) = OLDEST;
    ((major, minor) < OLDEST)
        .then(|| format!("{version} is too old; install mpv {oldest_major}.{oldest_minor} or a newer one"))
}

#[cfg(test)]
mod tests {
    use super::too_old;

    #[test]
    fn a_player_that_is_too_old_is_named_with_what_to_install_and_an_unknown_one_is_tried() {
        for version in ["mpv 0.33.0", "mpv 0.35.1", "mpv v0.40.0", "mpv 1.0", "mpv git-2f0c3e1", ""] {
            assert_eq!(too_old(version), None, "{version}");
        }
        for version in ["mpv 0.32.0", "mpv 0.29.1", "mpv v0.30.0-12-gabc"] {
            assert!(too_old(version).is_some_and(|why| why.contains("install mpv 0.33")), "{version}");
        }
    }
}
