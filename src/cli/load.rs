//! What several commands read: cues and configurations, with the exit codes of their faults.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::anyhow;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};

use super::{Exit, Failure, OrExit as _, names};
use crate::app::staged::{at_any_pace, seat_at_any_pace};
use crate::config::{self, Config, ConfigFaults, HallStroke, Misfit};
use crate::cue::{self, Cue, CueFaults, DeclaredUnit, FaultClass, Place, Source};
use crate::film::follower::PaceLimits;
use crate::motion::{SeatAxis, SeatType};
use crate::plain;
use crate::proof::{Digest, LinksProof, Proof, Terms, prove, prove_in, prove_links};
use crate::time::Rate;
use crate::timeline::Timeline;

/// What stands behind the options in the help of a command that reads cues.
pub(super) fn after_help(examples: &[&str]) -> String {
    format!(
        "Limits of a cue: 8,000,000 rows (two hours at 1 kHz), 12 axes, 64 KiB a line, 2 GiB a file.\n\n\
         Examples:\n  {}",
        examples.join("\n  ")
    )
}

/// What a cue file is, where it is none of kinocue's own formats.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct SourceArgs {
    /// The cue comes from a motion editor, in this format.
    #[arg(long, value_enum, value_name = "FORMAT", requires = "units")]
    from: Option<Import>,

    /// The unit of its positions, which the file does not state.
    #[arg(long, value_name = "UNIT", requires = "from", value_parser = declared_unit())]
    units: Option<DeclaredUnit>,
}

/// The formats of others that a cue can be read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Import {
    /// Rows of line,time_ms,x,y,z,u,v,w; time_ms is the duration of the row.
    Rows,
}

impl SourceArgs {
    /// What the arguments say the file is.
    pub(super) fn source(&self) -> Source {
        match (self.from, self.units) {
            (Some(Import::Rows), Some(unit)) => Source::Rows { unit },
            _ => Source::Native,
        }
    }
}

/// Reads one of the units that a person can declare.
pub(super) fn declared_unit() -> impl clap::builder::TypedValueParser<Value = DeclaredUnit> {
    PossibleValuesParser::new(["mm", "percent", "fraction", "pulse"])
        .try_map(|unit| unit.parse::<DeclaredUnit>())
}

/// The seat and the rate that a cue is judged for.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct SeatArgs {
    /// The configuration with the seat types, effects and controllers.
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,

    /// The seat type to check against [default: for each axis that of its controller; bench3 without a configuration].
    #[arg(long, value_name = "NAME")]
    pub(super) seat: Option<String>,

    /// Frames per second [default: the configuration's, else 100].
    #[arg(long, value_name = "HZ", value_parser = parse_rate)]
    rate: Option<f64>,

    /// The cue follows a film, which may ask for a slightly higher pace than 1: check against what that leaves of the limits.
    #[arg(long)]
    chase: bool,
}

/// What a cue is judged for.
#[derive(Debug)]
pub(super) struct Judge {
    pub(super) hall: Option<Config>,
    /// The seat asked for by name.
    pub(super) seat: Option<Arc<SeatType>>,
    pub(super) rate_hz: f64,
    /// The cue follows a film, whatever the configuration says.
    chases: bool,
}

impl SeatArgs {
    /// What the arguments mean beside `hall`, the configuration they name.
    pub(super) fn judge(&self, hall: Option<Config>) -> Result<Judge, Failure> {
        let seat = self.seat.as_deref().map(|name| seat(name, hall.as_ref())).transpose()?;
        let rate_hz = self.rate.or_else(|| hall.as_ref().map(|hall| hall.show.rate_hz)).unwrap_or(100.0);
        Ok(Judge { hall, seat, rate_hz, chases: self.chase })
    }

    /// True if it says for which hall or rate, or for which film.
    pub(super) const fn is_of_hall(&self) -> bool {
        self.config.is_some() || self.rate.is_some() || self.chase
    }

    /// What is to be given to `fit` so that a cue passes here.
    pub(super) const fn remedy(&self) -> &'static str {
        if self.chase { "kinocue fit CUE -o OUT --chase" } else { "kinocue fit CUE -o OUT" }
    }

    /// These arguments as they were typed, each behind a blank.
    pub(super) fn as_typed(&self) -> String {
        let config = self.config.as_ref().map(|config| format!(" --config {}", plain::shell(config)));
        let seat = self.seat.as_ref().map(|seat| format!(" --seat {}", plain::shell(Path::new(seat))));
        let rate = self.rate.map(|rate| format!(" --rate {rate}"));
        let chase = self.chase.then(|| " --chase".to_owned());
        [config, seat, rate, chase].into_iter().flatten().collect()
    }
}

fn seat(name: &str, hall: Option<&Config>) -> Result<Arc<SeatType>, Failure> {
    let known = match hall {
        Some(hall) => hall.seat(name).cloned(),
        None => (name == "bench3").then(|| Arc::new(SeatType::bench3(3))),
    };
    known.ok_or_else(|| match hall {
        Some(hall) => names::unknown("seat type", name, hall.seats.iter().map(|seat| seat.name.as_str())),
        None => names::unknown("seat type", name, ["bench3", "and those of --config FILE"].into_iter()),
    })
}

/// What each axis of a cue is on: the seat given, else that of the first controller of the hall that takes the axis, else the bench seat.
pub(super) fn seats(hall: Option<&Config>, seat: Option<&Arc<SeatType>>, axes: usize) -> Vec<SeatAxis> {
    all_seats(hall, seat, axes).into_iter().map(|(first, _)| first).collect()
}

/// The same, and behind each the axes of the other controllers that take it.
fn all_seats(
    hall: Option<&Config>,
    seat: Option<&Arc<SeatType>>,
    axes: usize,
) -> Vec<(SeatAxis, Vec<SeatAxis>)> {
    let bench = Arc::new(SeatType::bench3(axes));
    let seats_of = |axis| {
        let controllers = hall.into_iter().flat_map(|hall| &hall.controllers);
        let takers = controllers.filter(|one| seat.is_none() && one.takes(axis));
        let mut seats = takers.map(|one| SeatAxis::new(&one.seat, axis - one.axis_offset));
        let first = seats.next();
        (first.unwrap_or_else(|| SeatAxis::new(seat.unwrap_or(&bench), axis)), seats.collect())
    };
    (0..axes).map(seats_of).collect()
}

impl Judge {
    /// What each axis of a cue is on: the seat asked for, else that of the first controller that takes the axis,
    /// else the bench seat; with what a film leaves of its limits, where one leads.
    pub(super) fn seats(&self, axes: usize) -> Vec<SeatAxis> {
        let hall = self.hall.as_ref().map(|hall| self.led(hall));
        let bench = || hall.is_none().then(|| Arc::new(SeatType::bench3(axes)));
        let seat = self.seat.clone().or_else(bench).map(|seat| self.left_of(&seat));
        seats(hall.as_deref(), seat.as_ref(), axes)
    }

    /// The same, and behind each the axes of the other controllers that take it.
    pub(super) fn all_seats(&self, axes: usize) -> Vec<(SeatAxis, Vec<SeatAxis>)> {
        all_seats(self.hall.as_ref(), self.seat.as_ref(), axes)
    }

    /// What a cue has to be proved for: on the seat asked for, else on all seats of the configuration, else on the bench
    /// seat.
    pub(super) fn terms(&self, timeline: &Timeline, level: f64) -> Terms {
        let (cue, rate) = (Digest::of(timeline.cue()), Rate::from_hz(self.rate_hz));
        let axes = timeline.axes();
        let of_seat = |seat: &Arc<SeatType>| Terms::of_seat(self.left_of(seat), axes, cue, rate, level);
        match (&self.seat, &self.hall) {
            (None, Some(hall)) => Terms::of_hall(&self.led(hall), cue, rate, level),
            (Some(seat), Some(hall)) => {
                Terms { parts: of_seat(seat).parts, ..Terms::of_hall(hall, cue, rate, level) }
            }
            (Some(seat), None) => of_seat(seat),
            (None, None) => of_seat(&Arc::new(SeatType::bench3(axes))),
        }
    }

    /// What the hall cannot do of a cue, with its places in the file.
    pub(super) fn misfits(&self, timeline: &Timeline) -> Vec<(Place, Misfit)> {
        let misfits = self.hall.iter().flat_map(|hall| hall.misfits(timeline));
        misfits.map(|misfit| (timeline.cue().column_place(&misfit.column(), misfit.at()), misfit)).collect()
    }

    /// The hall with what it leaves of its limits for every pace that a film may ask for, where one leads all its shows.
    fn led<'a>(&self, hall: &'a Config) -> Cow<'a, Config> {
        let sync = hall.sync.as_ref().filter(|sync| sync.leads || self.chases);
        let pace = sync.map(|sync| sync.pace).or_else(|| self.chases.then(PaceLimits::default));
        pace.map_or(Cow::Borrowed(hall), |pace| {
            Cow::Owned(at_any_pace(hall, pace, Rate::from_hz(self.rate_hz)))
        })
    }

    /// The same of a seat by itself.
    fn left_of(&self, seat: &Arc<SeatType>) -> Arc<SeatType> {
        if !self.chases {
            return Arc::clone(seat);
        }
        Arc::new(seat_at_any_pace(seat, PaceLimits::default(), Rate::from_hz(self.rate_hz)))
    }

    /// Proves a cue on these terms, and what the links of the configuration make of it, unless another seat is asked for.
    pub(super) fn prove(&self, timeline: &Timeline, terms: Terms) -> Proof {
        match (&self.seat, &self.hall) {
            (None, Some(hall)) => prove_in(&self.led(hall), timeline, terms),
            _ => prove(timeline, terms),
        }
    }

    /// What the links of the configuration make of a cue, unless another seat is asked for.
    pub(super) fn links(&self, timeline: &Timeline, level: f64) -> LinksProof {
        let hall = self.hall.as_ref().filter(|_| self.seat.is_none());
        hall.map(|hall| prove_links(hall, timeline, &self.terms(timeline, level))).unwrap_or_default()
    }

    /// Holds a cue against the stroke of the seat asked for, else of each seat of the configuration, else of the
    /// bench seat.
    pub(super) fn stroke(&self, timeline: &Timeline) -> HallStroke {
        match (&self.seat, &self.hall) {
            (None, Some(hall)) => hall.fits_stroke(timeline),
            (seat, _) => {
                let bench = SeatType::bench3(timeline.axes());
                let fit = timeline.fits_stroke(0..timeline.axes(), Some(seat.as_deref().unwrap_or(&bench)));
                HallStroke { faults: fit.faults.into_iter().collect(), held: fit.held }
            }
        }
    }
}

/// A rate in frames a second.
pub(super) fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| (1.0..=1000.0).contains(rate));
    rate.ok_or_else(|| "a rate is 1 to 1000 Hz".to_owned())
}

/// Reads a configuration; its faults end the program.
pub(super) fn config(path: &Path) -> Result<Config, Failure> {
    config::load(path).map_err(|faults| Failure { exit: config_exit(&faults), error: faults.into() })
}

/// Reads a configuration whose seats are about to be moved; one that nothing can play ends the program.
pub(super) fn without_drives(path: &Path) -> Result<Config, Failure> {
    let config = config(path)?;
    config.without_drives().or_exit(Exit::Config)?;
    Ok(config)
}

/// Reads a configuration that is about to be played in the foreground.
pub(super) fn streamed(path: &Path, silent: bool) -> Result<Config, Failure> {
    let config = config(path)?;
    if silent && let Some(one) = config.on_links().next() {
        let error = anyhow!(
            "{} is on a serial link, whose drives answer everything they are sent; omit --no-acks",
            one.name
        );
        return Err(error).or_exit(Exit::Usage);
    }
    Ok(config)
}

/// Reads a cue; its faults end the program.
pub(super) fn cue(path: &Path, source: &Source) -> Result<Cue, Failure> {
    cue::load(path, source).map_err(|faults| Failure { exit: cue_exit(&faults), error: faults.into() })
}

/// How the program ends where a configuration has these faults.
pub(super) fn config_exit(faults: &ConfigFaults) -> Exit {
    match faults {
        ConfigFaults::Unreadable { source, .. } if source.kind() == io::ErrorKind::PermissionDenied => {
            Exit::NotAllowed
        }
        ConfigFaults::Unreadable { .. } => Exit::NoInput,
        ConfigFaults::Bad(_) => Exit::Config,
    }
}

/// How the program ends where a cue has these faults.
pub(super) fn cue_exit(faults: &CueFaults) -> Exit {
    match faults.class() {
        FaultClass::NoInput => Exit::NoInput,
        FaultClass::Denied => Exit::NotAllowed,
        FaultClass::Io => Exit::Io,
        FaultClass::BadCue => Exit::BadCue,
    }
}
