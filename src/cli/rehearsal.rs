//! A rehearsal: a hall whose every controller is simulated in this program, on 127.0.0.1 alone.

use std::fs;
use std::net::SocketAddrV4;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};

use super::token::Token;
use super::{Exit, Failure, OrExit as _, load};
use crate::config::MAX_FILE_LEN;
use crate::config::{Config, Controller, Station};
use crate::control::Role;
use crate::sim::{Farm, Options, Setup, pa};
use crate::sys;

/// The hall of a rehearsal that names none.
const HALL: &str = include_str!("../../systemd/simulated.toml");
/// What its library has at first.
const FILES: [(&str, &str); 3] = [
    ("cues/bench-ride.csv", include_str!("../../cues/bench-ride.csv")),
    ("cues/seat-demo.csv", include_str!("../../cues/seat-demo.csv")),
    ("playlists/today.toml", include_str!("../../examples/today.toml")),
];

/// The controllers of a rehearsal; they end where this is dropped.
pub(super) struct Rehearsal {
    /// A copy of the configuration: what is done to the file itself leads no reload to real seats.
    pub(super) config: PathBuf,
    /// What whoever started it may do everything with, until it ends.
    pub(super) token: String,
    _farms: Vec<Farm>,
}

impl Rehearsal {
    /// Starts the controllers of a configuration, at their own addresses.
    ///
    /// # Errors
    /// Where one of these is not of this machine alone, or taken.
    pub(super) fn begin(config: Option<&Path>, state: &Path) -> Result<Self, Failure> {
        let text = match config {
            Some(path) => sys::file::text(path, MAX_FILE_LEN)
                .with_context(|| path.display().to_string())
                .or_exit(Exit::NoInput)?,
            None => HALL.to_owned(),
        };
        let (copy, token) =
            (state.join("rehearsal.toml"), Token::new("rehearsal", Role::Engineer).or_system()?);
        write(&copy, &format!("{text}\n{}\n", token.config))?;
        let hall = load::config(config.unwrap_or(&copy))?;
        let host = refuse_others(&hall)?;
        let farms = hall.stations().iter().map(|one| simulate(one, host)).collect::<Result<_, _>>()?;
        if config.is_none() {
            // What somebody has changed since stays so.
            let missing =
                FILES.iter().map(|(name, text)| (state.join(name), text)).filter(|(path, _)| !path.exists());
            missing.into_iter().try_for_each(|(path, text)| write(&path, text))?;
        }
        Ok(Self { config: copy, token: token.token, _farms: farms })
    }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let written = fs::create_dir_all(folder).and_then(|()| sys::file::write_ours(path, text));
    written.with_context(|| path.display().to_string()).or_system()
}

/// From where the hall sends, where that is this machine, and all its controllers are, too.
fn refuse_others(hall: &Config) -> Result<SocketAddrV4, Failure> {
    let elsewhere =
        |one: &&Controller| !one.station().is_some_and(|station| station.address.ip().is_loopback());
    if let Some(one) = hall.named().find(elsewhere) {
        let error = anyhow!(
            "{} is at {}; a rehearsal simulates controllers on this machine alone: give it an address such as 127.0.0.1:7408 in a copy of \
             the configuration",
            one.name,
            one.address()
        );
        return Err(error).or_exit(Exit::Config);
    }
    let bind = hall.show.bind;
    if !bind.ip().is_loopback() || bind.port() == 0 {
        let error = anyhow!(
            "[show] bind is {bind}; a rehearsal sends from this machine alone: write bind = \"127.0.0.1:8410\""
        );
        return Err(error).or_exit(Exit::Config);
    }
    Ok(bind)
}

/// A controller that passes preflight, with the axes of its seat.
fn simulate(one: &Controller<Station>, host: SocketAddrV4) -> Result<Farm, Failure> {
    let axes = u16::try_from(one.seat.axes).unwrap_or(u16::MAX);
    let offset = u16::try_from(one.axis_offset).unwrap_or(u16::MAX);
    let parameters = vec![(pa::OFFSET, offset)];
    let setup = Setup { axes, parameters, dialect: one.connection.dialect, ..Setup::default() }.safe(host);
    let options = Options { listen: one.connection.address, ..Options::loopback(vec![setup]) };
    Farm::start(options).with_context(|| one.name.clone()).or_system()
}
