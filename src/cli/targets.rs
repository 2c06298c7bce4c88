//! The controllers a command is for, the frame port to reach them, and what to tell of those that fail.

use std::collections::BTreeSet;
use std::io;
use std::net::SocketAddrV4;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context as _, anyhow};

use super::{Exit, Failure, OrExit as _, exit, load, names, print};
use crate::app::PlayError;
use crate::config::{Config, Controller, Link, Show, Station, from_to_args};
use crate::device::company::company;
use crate::device::{Fault, RegisterAnswer, Request, RequestOutcome, Talk, refusal};
use crate::drive::link::LinkLine;
use crate::drive::rates::LinkLoad;
use crate::motion::MAX_AXES;
use crate::sys;
use crate::sys::serial::{CanError, SerialError};
use crate::wire::ReplyCode;

/// Which controllers are meant.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct TargetArgs {
    /// A controller: HOST:PORT, then optionally, after commas, name=A1, axes=3, offset=0, fan_out=slice or shared, dialect=smc
    /// or mbox, vibration_port_octets=2 or 4; repeatable.
    #[arg(long, value_name = "ADDR", conflicts_with = "config")]
    to: Vec<String>,
    /// The configuration with the controllers: all of them, unless --row or names select some.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The controllers of a row; repeatable.
    #[arg(long, value_name = "ROW", requires = "config")]
    row: Vec<String>,
    /// The frame port [default: 0.0.0.0:8410, or the configuration's]; port 0 takes any.
    #[arg(long, value_name = "ADDR")]
    bind: Option<SocketAddrV4>,
}

/// The controllers that are meant, and from where they are spoken to.
#[derive(Debug)]
pub(super) struct Targets {
    pub(super) controllers: Vec<Controller<Station>>,
    /// How they are played to, and from where.
    pub(super) show: Show,
}

/// The controllers on links that are meant.
#[derive(Debug)]
pub(super) struct DrivenTargets {
    pub(super) controllers: Vec<Controller>,
    /// All links of the hall.
    pub(super) links: Vec<Link>,
    /// From one target of an axis to the next on each of them, by all that is on it.
    pub(super) periods: Vec<Duration>,
    /// What each of them carries; none where nobody is on it.
    pub(super) loads: Vec<Option<LinkLoad>>,
}

struct Meant {
    on_network: Targets,
    on_links: Vec<Controller>,
    loads: Vec<Option<LinkLoad>>,
    /// The hall without its controllers.
    config: Config,
    periods: Vec<Duration>,
}

impl TargetArgs {
    /// The controllers that the arguments and `names` mean.
    pub(super) fn resolve(&self, names: &[String]) -> Result<Targets, Failure> {
        // Without a cue nothing limits the axes but the protocol.
        let meant = self.meant(names, MAX_AXES)?;
        Config { controllers: meant.on_links, ..meant.config }.without_drives().or_exit(Exit::Config)?;
        Ok(meant.on_network)
    }

    /// The same, those on links apart.
    pub(super) fn resolve_all(&self, names: &[String]) -> Result<(Targets, DrivenTargets), Failure> {
        self.resolve_all_for(names, MAX_AXES)
    }

    /// The same, for a cue of `cue_axes` axes.
    pub(super) fn resolve_all_for(
        &self,
        names: &[String],
        cue_axes: usize,
    ) -> Result<(Targets, DrivenTargets), Failure> {
        let Meant { on_network, on_links, loads, config, periods } = self.meant(names, cue_axes)?;
        Ok((on_network, DrivenTargets { controllers: on_links, links: config.links, loads, periods }))
    }

    fn meant(&self, names: &[String], cue_axes: usize) -> Result<Meant, Failure> {
        let mut config = match &self.config {
            Some(path) => load::config(path)?,
            None => from_to_args(&self.to, &[], cue_axes).or_exit(Exit::Usage)?,
        };
        let loads = config.links.iter().map(|link| LinkLoad::of(link, &config)).collect();
        let periods = config.links.iter().map(|link| period(link, &config)).collect();
        let (controllers, absent) =
            (std::mem::take(&mut config.controllers), std::mem::take(&mut config.absent));
        let mut show = config.show.clone();
        show.bind = self.bind.unwrap_or(show.bind);
        // A controller that is disabled in the configuration is meant only if it is named, so that it can be repaired.
        let (named, left): (Vec<Controller>, Vec<_>) =
            absent.into_iter().map(|one| one.controller).partition(|one| names.contains(&one.name));
        if names.is_empty() && self.row.is_empty() {
            left.iter().for_each(tell_absent);
        }
        let chosen = self.choose(controllers.into_iter().chain(named).collect(), names)?;
        let stations = chosen.iter().filter_map(Controller::on_network).collect();
        let on_links = chosen.into_iter().filter(|one| one.drives().is_some()).collect();
        Ok(Meant { on_network: Targets { controllers: stations, show }, on_links, loads, config, periods })
    }

    /// True if anybody is meant: without, `home` and `preflight` ask the daemon for its own.
    pub(super) fn are_named(&self) -> bool {
        self.config.is_some() || !self.to.is_empty()
    }

    /// Wrong use where some are chosen, or a port is, of a hall that is the daemon's: that does all or none, by its own.
    pub(super) fn refuse_choice(&self, names: &[String]) -> Result<(), Failure> {
        if names.is_empty() && self.bind.is_none() {
            return Ok(());
        }
        let why = "the daemon does this for its whole hall, on its own frame port; omit names and --bind, or give \
                   controllers with --to or --config";
        Err(anyhow!(why)).or_exit(Exit::Usage)
    }

    /// True if a configuration names them.
    pub(super) const fn are_configured(&self) -> bool {
        self.config.is_some()
    }

    /// Those of the rows and of the names, in the order of the configuration; all where neither chooses.
    fn choose(&self, all: Vec<Controller>, chosen: &[String]) -> Result<Vec<Controller>, Failure> {
        if self.row.is_empty() && chosen.is_empty() {
            return Ok(all);
        }
        for name in chosen {
            if !all.iter().any(|one| one.name == *name) {
                return Err(names::unknown("controller", name, all.iter().map(|one| one.name.as_str())));
            }
        }
        for row in &self.row {
            if !all.iter().any(|one| one.row.as_ref() == Some(row)) {
                let rows: BTreeSet<_> = all.iter().filter_map(|one| one.row.as_deref()).collect();
                return Err(names::unknown("row", row, rows.iter().copied()));
            }
        }
        let is_meant = |one: &Controller| {
            chosen.contains(&one.name) || one.row.as_ref().is_some_and(|row| self.row.contains(row))
        };
        Ok(all.into_iter().filter(is_meant).collect())
    }
}

/// What `check` says that a link plays at; at the most that fits where more is asked for.
fn period(link: &Link, config: &Config) -> Duration {
    let load = LinkLoad::of(link, config);
    load.map_or(Duration::MAX, |load| load.period_for(link.rate_hz).unwrap_or_else(|_| load.period()))
}

impl Targets {
    /// Takes the frame port; 75 while another program holds it.
    pub(super) fn open(&self) -> Result<Talk, Failure> {
        Talk::open(self.show.bind, &self.controllers).map_err(|error| {
            let exit = exit::of_net(&error);
            let held = "this needs the frame port, to itself; end the program that holds it, such as the service or a play";
            let error = anyhow::Error::new(error);
            Failure { exit, error: if exit == Exit::TryAgain { error.context(held) } else { error } }
        })
    }

    /// Ends with 79 where somebody else sends to one of `lanes`, or one moves: a controller that counts nothing is led by somebody else
    /// all the same.
    pub(super) fn refuse_company(&self, talk: &mut Talk, lanes: &[usize]) -> Result<(), Failure> {
        let found = company(talk, &self.controllers, lanes);
        let others: Vec<_> = (found.iter().filter(|one| one.packets > 0))
            .map(|one| (self.name(one.lane).to_owned(), one.packets))
            .collect();
        let moving: Vec<_> =
            found.iter().filter(|one| one.moves).map(|one| self.name(one.lane).to_owned()).collect();
        let refused = match (others.is_empty(), moving.is_empty()) {
            (true, true) => return Ok(()),
            (true, false) => PlayError::Moving(moving),
            (false, _) => PlayError::OtherMaster(others),
        };
        Err(refused).or_exit(Exit::OtherMaster)
    }

    /// The name of a controller by its place.
    pub(super) fn name(&self, lane: usize) -> &str {
        &self.controllers[lane].name
    }

    /// The same request for each controller.
    pub(super) fn each(&self, requests: &[Request]) -> Vec<(usize, Request)> {
        let lanes = 0..self.controllers.len();
        lanes.flat_map(|lane| requests.iter().map(move |request| (lane, request.clone()))).collect()
    }
}

/// Why a link cannot be had.
pub(super) enum PortRefused {
    /// Another program has it, and may lead what is on it.
    Taken(anyhow::Error),
    Other(String),
}

/// Opens a link, which is ours alone until it is dropped.
pub(super) fn open_link(link: &Link) -> Result<LinkLine, PortRefused> {
    LinkLine::open(link).map_err(|error| match error {
        SerialError::Taken(_) | SerialError::Can(CanError::Taken(_)) => PortRefused::Taken(anyhow!(
            "{error}. If that is the service, stop it first (`systemctl stop kinocue`); `kinocue preflight` without --config reads them \
             through the service, `kinocue home` homes them by it"
        )),
        _ => PortRefused::Other(error.to_string()),
    })
}

/// What went wrong with some controllers, told as it is noted; decides how the program ends.
#[derive(Debug, Default)]
pub(super) struct Troubles {
    refused: bool,
    silent: bool,
}

impl Troubles {
    /// Takes an answer apart; tells of the fault where there is none, and gives the line of it.
    pub(super) fn sort(
        &mut self,
        targets: &Targets,
        outcome: RequestOutcome,
    ) -> Result<(Request, RegisterAnswer), String> {
        let RequestOutcome { lane, request, result } = outcome;
        match result {
            Ok(answer) => Ok((request, answer)),
            Err(fault) => {
                let answered = fault.refused() || fault.is_foreign();
                self.refused |= answered;
                self.silent |= !answered;
                // The silence before it has been told.
                if !matches!(fault, Fault::Unasked { .. }) {
                    print::tell(&format!("kinocue: {}: {fault}", targets.name(lane)));
                }
                Err(fault.to_string())
            }
        }
    }

    /// Tells of something else that a controller did not do as asked.
    pub(super) fn refuse(&mut self, name: &str, line: &str) {
        self.refused = true;
        print::tell(&format!("kinocue: {name}: {line}"));
    }

    /// Tells of a controller that stopped answering.
    pub(super) fn miss(&mut self, name: &str, line: &str) {
        self.silent = true;
        print::tell(&format!("kinocue: {name}: {line}"));
    }

    /// True if there were none.
    pub(super) const fn none(&self) -> bool {
        !self.refused && !self.silent
    }

    /// How the program ends: 76 where a controller refused, 69 where one did not answer.
    pub(super) const fn exit(&self) -> Exit {
        match (self.refused, self.silent) {
            (true, _) => Exit::Refused,
            (false, true) => Exit::Unavailable,
            (false, false) => Exit::Done,
        }
    }
}

/// Tells that a controller has no part in this.
pub(super) fn tell_absent(controller: &Controller) {
    print::tell(&format!("kinocue: {} is disabled (enabled = false), and left out", controller.name));
}

/// What a controller's state is, where it is not the normal one.
pub(super) fn state(controller: &Controller<Station>, answer: &RegisterAnswer) -> Option<String> {
    (answer.code != ReplyCode::Running)
        .then(|| refusal(answer.code, answer.error, controller.connection.dialect))
}

/// The longest text that is read.
const MOST_READ: u64 = 16 << 20;

/// Reads a file whole.
pub(super) fn read_file(path: &std::path::Path) -> Result<String, Failure> {
    sys::file::text(path, MOST_READ).map_err(|error| {
        let exit = if error.kind() == io::ErrorKind::NotFound { Exit::NoInput } else { Exit::Io };
        Failure { exit, error: anyhow::Error::new(error).context(path.display().to_string()) }
    })
}

/// Writes a file whole or not at all.
pub(super) fn write_file(path: &std::path::Path, text: &str) -> Result<(), Failure> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let written = sys::file::write_ours(part.as_ref(), text).and_then(|()| std::fs::rename(&part, path));
    written.with_context(|| format!("cannot write {}", path.display())).or_exit(Exit::Io)
}
