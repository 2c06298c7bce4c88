//! Exit codes (sysexits) and the error that carries one.

use std::error::Error;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;
use std::process::ExitCode;
use std::{fmt, fs, io, iter};

use anyhow::{Context as _, anyhow};

use crate::app::film::FilmError;
use crate::net::NetError;

/// How the program ends; the numbers are those of `sysexits.h`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Exit {
    /// Done, also after a requested stop.
    Done = 0,
    /// A check failed: limits, preflight, doctor, a comparison.
    CheckFailed = 1,
    /// Wrong use of the command line.
    Usage = 64,
    /// A cue that cannot be played, or a film's sound or index that cannot be read.
    BadCue = 65,
    /// A file that is missing, a folder where a file belongs, or a name that is unknown.
    NoInput = 66,
    /// A daemon or controller that does not answer.
    Unavailable = 69,
    /// A fault of our own.
    Internal = 70,
    /// The system refused what was asked of it.
    System = 71,
    /// Reading or writing failed.
    Io = 74,
    /// Not ready, or another program holds a port or socket; try again.
    TryAgain = 75,
    /// A controller refused.
    Refused = 76,
    /// Not allowed.
    NotAllowed = 77,
    /// A bad configuration.
    Config = 78,
    /// Another master drives the seats.
    OtherMaster = 79,
    /// A second Ctrl-C.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// An error together with the code that the program ends with.
#[derive(Debug)]
pub(crate) struct Failure {
    /// How the program ends.
    pub(crate) exit: Exit,
    /// What to tell the person; shown with its chain of causes.
    pub(crate) error: anyhow::Error,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#}", self.error)
    }
}

/// Gives an error its exit code.
pub(crate) trait OrExit<T> {
    /// The value, or the error as a [`Failure`] that ends the program with `exit`.
    ///
    /// # Errors
    /// A [`Failure`] where there was an error.
    fn or_exit(self, exit: Exit) -> Result<T, Failure>;

    /// The same where the system refused something: with 75 where another program holds it, else with 71.
    ///
    /// # Errors
    /// A [`Failure`] where there was an error.
    fn or_system(self) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> OrExit<T> for Result<T, E> {
    fn or_exit(self, exit: Exit) -> Result<T, Failure> {
        self.map_err(|error| Failure { exit, error: error.into() })
    }

    fn or_system(self) -> Result<T, Failure> {
        self.map_err(Into::into).map_err(|error: anyhow::Error| Failure { exit: of_system(&*error), error })
    }
}

/// How the program ends where the system refused something: a port or socket that another program holds is free once that has ended.
pub(super) fn of_system(error: &(dyn Error + 'static)) -> Exit {
    let causes = iter::successors(Some(error), |error| (*error).source());
    let mut refused = causes.filter_map(|cause| cause.downcast_ref::<io::Error>());
    let is_held = refused.any(|cause| cause.kind() == io::ErrorKind::AddrInUse);
    if is_held { Exit::TryAgain } else { Exit::System }
}

/// How the program ends where the frame port does not open.
pub(super) fn of_net(error: &NetError) -> Exit {
    match error {
        NetError::Refused { .. } => of_system(error),
        _ => Exit::Usage,
    }
}

/// What the program ends with where a source of the film cannot be had.
pub(super) fn of_film(error: FilmError) -> Failure {
    let exit = match &error {
        FilmError::NoInput { .. } => Exit::NoInput,
        FilmError::Sound { .. } | FilmError::Index { .. } => Exit::BadCue,
        FilmError::Many(_) | FilmError::Twice(_) | FilmError::NoLine(_) | FilmError::NoSuchTime => {
            Exit::Usage
        }
        FilmError::Open { .. }
        | FilmError::Command { .. }
        | FilmError::Clock { .. }
        | FilmError::Thread(_) => of_system(&error),
    };
    Failure { exit, error: error.into() }
}

/// A file is never written over what it is made of, by whatever name or link.
pub(super) fn refuse_same(input: &Path, output: &Path) -> Result<(), Failure> {
    let known = |path| fs::metadata(path).ok().map(|file| (file.dev(), file.ino()));
    if known(input).is_some_and(|file| known(output) == Some(file)) {
        let error = anyhow!("{} is the file that is read; give another name", output.display());
        return Err(error).or_exit(Exit::Usage);
    }
    Ok(())
}

/// An output that exists is replaced only where that was asked for.
pub(super) fn refuse_to_replace(output: &Path, force: bool) -> Result<(), Failure> {
    let path = || output.display().to_string();
    if !force && output.try_exists().with_context(path).or_exit(Exit::Io)? {
        let error = anyhow!("{} exists; --force replaces it", output.display());
        return Err(error).or_exit(Exit::Usage);
    }
    Ok(())
}
