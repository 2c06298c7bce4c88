//! `kinocue sim --tty`: drives of any dialect on a serial line.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context as _, anyhow, bail};
use serde_json::Value;

use super::{Args, SignalSocket, control, parse, seed};
use crate::cli::print::{self, tell};
use crate::cli::{Exit, Failure, OrExit as _, exit};
use crate::sim::serial::{Bus, Deed, LineFaults, PtyError, PtyLoop, SerialLine};
use crate::time::parse_duration;

/// Serial drives on a pseudo-terminal.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Serial drives")]
pub(super) struct TtyArgs {
    /// Simulate drives on a serial line: a pseudo-terminal, with a symbolic link to it at this path.
    #[arg(long, value_name = "LINK", conflicts_with = "Leeway")]
    pub(super) tty: Option<PathBuf>,

    /// The numbers of the units on the line [default: 16 for a SilverMax, 1 for a SIXpack 2].
    #[arg(long, value_name = "N,…", value_delimiter = ',', requires = "tty")]
    #[arg(value_parser = clap::value_parser!(u8).range(1..=254))]
    units: Vec<u8>,

    /// Baud rate of a SilverMax line, at which the simulator paces bytes [default: 57600].
    #[arg(long, value_name = "BAUD", requires = "tty")]
    #[arg(value_parser = clap::value_parser!(u32).range(300..=1_000_000))]
    pub(super) baud: Option<u32>,

    /// Faults present from the start, as "lost=0.001, 17@dead=1"; see below.
    #[arg(long, value_name = "COMMAND, …", default_value = "", hide_default_value = true, requires = "tty")]
    faults: String,
}

impl TtyArgs {
    /// The units on the line: one where none is named.
    pub(super) fn units<B: Drives>(&self) -> Vec<u8> {
        if self.units.is_empty() { vec![B::ALONE] } else { self.units.clone() }
    }
}

/// Drives that can be run on a line: what happens to them in words, and what became of them.
pub(in crate::cli) trait Drives: Bus + Send + Sized + 'static {
    /// Bits of an octet with start and stop.
    const BITS: u32;
    /// The number of a unit that nobody gave one.
    const ALONE: u8;

    /// Something that happens to a unit, or to all; refused in words.
    fn deed(unit: Option<u8>, name: &str, value: Option<&str>) -> anyhow::Result<Deed<Self>>;

    /// What became of the units: for programs, and a line each for a person.
    fn report(&self) -> (Value, Vec<String>);
}

/// Runs drives on the line until a signal comes.
pub(super) fn run<B: Drives>(
    bus: B,
    args: &Args,
    path: &Path,
    signals: SignalSocket,
) -> Result<Exit, Failure> {
    let deed = {
        let units = args.tty.units::<B>();
        move |text: &str| deed::<B>(text, &units)
    };
    let faults = parse::list(&args.tty.faults, &deed).context("--faults").or_exit(Exit::Usage)?;
    let mut script: Vec<_> = faults.into_iter().map(|deed| (Duration::ZERO, deed)).collect();
    script.extend(parse::timed(&args.script, &deed).context("--script").or_exit(Exit::Usage)?);
    let line = SerialLine::new(bus, B::BITS, LineFaults::default(), seed(args));
    let running = PtyLoop::start(line, path, script).map_err(|error| Failure {
        exit: if matches!(error, PtyError::Taken(_)) { Exit::Usage } else { exit::of_system(&error) },
        error: error.into(),
    })?;
    let remote = running.remote();
    let carry_out = move |text: &str| {
        let is_done = remote.tell(deed(text)?);
        if is_done { Ok(()) } else { Err(anyhow!("the virtual drives have ended")) }
    };
    let _control = control(args, Arc::new(carry_out))?; // its file goes when this does
    tell(&format!("ready {}", path.display()));
    signals.wait()?;
    let (object, lines) = running.stop().bus().report();
    if args.json {
        print::json(&object)?;
    } else {
        lines.iter().for_each(|line| tell(line));
    }
    Ok(Exit::Done)
}

/// `[UNIT@]NAME[=VALUE]`: what happens to the line, to one unit or to all.
fn deed<B: Drives>(text: &str, units: &[u8]) -> anyhow::Result<Deed<B>> {
    let (unit, rest) = match text.split_once('@') {
        Some((unit, rest)) => (Some(named(unit.trim(), units)?), rest),
        None => (None, text),
    };
    let (name, value) = match rest.split_once('=') {
        Some((name, value)) => (name.trim(), Some(value.trim())),
        None => (rest.trim(), None),
    };
    if let (None, Some(value)) = (unit, value)
        && let Some(change) = fault(name, value)?
    {
        return Ok(Box::new(move |line, _| change(&mut line.faults)));
    }
    if (unit, name, value) == (None, "break", None) {
        return Ok(Box::new(SerialLine::send_break));
    }
    B::deed(unit, name, value)
}

fn named(unit: &str, units: &[u8]) -> anyhow::Result<u8> {
    let number = unit.parse().ok().filter(|number| units.contains(number));
    number.with_context(|| format!("there is no unit {unit}; the line has {units:?}"))
}

/// A change of what a line does to octets.
type LineChange = Box<dyn FnOnce(&mut LineFaults) + Send>;

/// What a word does to a line; nothing where it is a word of its drives.
fn fault(name: &str, value: &str) -> anyhow::Result<Option<LineChange>> {
    let chance = || parse::chance(value);
    let span = |text: &str| parse_duration(text).map_err(|why| anyhow!(why));
    Ok(Some(match name {
        "lost" => set(chance()?, |faults, lost| faults.lost = lost),
        "doubled" => set(chance()?, |faults, doubled| faults.doubled = doubled),
        "flipped" => set(chance()?, |faults, flipped| faults.flipped = flipped),
        "answer_lost" => set(chance()?, |faults, lost| faults.answer_lost = lost),
        "late" => {
            let Some((chance, by)) = value.split_once('/') else { bail!("not CHANCE/SPAN, as in 0.1/30ms") };
            let late = (parse::chance(chance.trim())?, span(by.trim())?);
            set(late, |faults, late| (faults.late, faults.late_by) = late)
        }
        "lose" => {
            let count = value.parse().context("not a number of answers")?;
            set(count, |faults, count| faults.lose_answers = count)
        }
        "noise" => {
            let hz = value.parse().ok().filter(|hz: &u32| *hz <= 10_000);
            set(hz.context("not 0 to 10000 bytes a second")?, |faults, hz| faults.noise = hz)
        }
        "held" => set(span(value)?, |faults, held| faults.held = held),
        "echo" => set(parse::switch(value)?, |faults, echo| faults.echo = echo),
        "unplug" => set(parse::switch(value)?, |faults, unplugged| faults.unplugged = unplugged),
        _ => return Ok(None),
    }))
}

fn set<T: Send + 'static>(value: T, change: fn(&mut LineFaults, T)) -> LineChange {
    Box::new(move |faults| change(faults, value))
}
