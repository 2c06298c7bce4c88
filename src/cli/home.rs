//! `kinocue home`.

use std::io::IsTerminal as _;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use serde::Serialize;

use super::ask::{agreed, somebody};
use super::client;
use super::targets::{DrivenTargets, TargetArgs, Targets, Troubles, state};
use super::{Exit, Failure, print};
use crate::config::Controller;
use crate::device::home::{HomeError, PA0E, Progress, UNTURN, hindrance, home, turns};
use crate::device::{Patience, Request, RequestOutcome, Talk, table};

mod drives;

use drives::HomingResult;

/// Homes empty seats.
///
/// Starts the reference search (DPF0) of their controllers, and waits until each has found its home position.
///
/// Without --to and --config the daemon homes all seats of its hall; `kinocue watch` shows their progress.
///
/// The seats move by themselves, over their whole stroke, at a speed set in the controllers. Ctrl-C ends the command, not the
/// movement: only the hard-wired emergency stop ends that. Seats on serial drives are moved by this command, at the speed and
/// within the travel of [seat.NAME.drive]; there Ctrl-C brakes the axes.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue home --seats-empty                            the daemon's own hall
  kinocue home --config examples/hall.toml
  kinocue home A1 B1 --config examples/hall.toml
  kinocue home --config examples/hall.toml --row A --seats-empty
  kinocue home --to 127.0.0.1:7408 --timeout 120

PA0e decides what a controller does: 0 searches for zero; 1 goes to zero without a search,
which is right only if it has found zero since power-on.")]
pub(super) struct Args {
    /// The controllers [default: all].
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    #[command(flatten)]
    targets: TargetArgs,
    /// Confirm that nobody sits on the seats and nothing lies on or under them; do not ask.
    #[arg(long)]
    seats_empty: bool,
    /// Timeout for each controller in seconds, 1 to 3600. The daemon has its own; for serial drives it follows from their travel.
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=3600))]
    timeout: u64,
    #[command(flatten)]
    server: client::ServerArgs,
}

#[derive(Serialize)]
struct HomingReport<'a> {
    controllers: Vec<ControllerHoming<'a>>,
}

#[derive(Serialize)]
struct ControllerHoming<'a> {
    name: &'a str,
    address: String,
    home: bool,
    /// From the order to the end of homing; null if that was not reached.
    seconds: Option<f64>,
    fault: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    if !args.targets.are_named() {
        args.targets.refuse_choice(&args.names)?;
        return client::home(&args.server, args.seats_empty);
    }
    let (targets, driven) = args.targets.resolve_all(&args.names)?;
    if !args.seats_empty {
        somebody("Are the seats empty?", "--seats-empty")?;
    }
    let mut troubles = Troubles::default();
    let mut talk = if targets.controllers.is_empty() { None } else { Some(targets.open()?) };
    let mut results = talk.as_mut().map_or_else(Vec::new, |talk| explain(talk, &targets, &mut troubles));
    let mut on_links = drives::explain(&driven, &mut troubles);
    // Before anything moves: a hall whose links another program has is led by that.
    let lines = drives::open_all(&driven, &mut on_links, &mut troubles)?;
    let ready: Vec<usize> = (0..results.len()).filter(|lane| results[*lane].is_ok()).collect();
    let names: Vec<&str> = ready_names(&targets.controllers, &results)
        .chain(ready_names(&driven.controllers, &on_links))
        .collect();
    let mut is_ended = false;
    if !names.is_empty() {
        refuse_company(talk.as_mut(), &targets, &ready)?;
        if !agreed(&question(&names), args.seats_empty, "--seats-empty")? {
            print::tell("nothing was moved");
            return Ok(Exit::Done);
        }
        // Whoever was asked may have taken a while to answer.
        if !args.seats_empty {
            refuse_company(talk.as_mut(), &targets, &ready)?;
        }
        let timeout = Duration::from_secs(args.timeout);
        let moved = talk.as_mut().map(|talk| move_home(talk, &targets, &ready, timeout));
        for (lane, result) in ready.iter().zip(moved.into_iter().flatten()) {
            if let Err(error) = &result {
                tell(error, targets.name(*lane), &mut troubles);
            }
            results[*lane] = result.map_err(|error| error.to_string());
        }
        is_ended = drives::home_all((&driven, lines), &mut on_links, &mut troubles)?;
    }
    if args.server.json {
        print::json(&HomingReport::new((&targets, &results), (&driven, &on_links)))?;
    }
    Ok(if is_ended { Exit::Interrupted } else { troubles.exit() })
}

/// Ends with 79 where somebody else leads one of those that would home.
fn refuse_company(talk: Option<&mut Talk>, targets: &Targets, ready: &[usize]) -> Result<(), Failure> {
    match talk {
        Some(talk) if !ready.is_empty() => targets.refuse_company(talk, ready),
        _ => Ok(()),
    }
}

/// The names of those that can be homed.
fn ready_names<'c, C>(
    controllers: &'c [Controller<C>],
    results: &[HomingResult],
) -> impl Iterator<Item = &'c str> {
    controllers.iter().zip(results).filter(|(_, result)| result.is_ok()).map(|(one, _)| one.name.as_str())
}

fn question(names: &[&str]) -> String {
    format!(
        "{} will move over their whole stroke. Are these seats empty, and is nobody near them?",
        names.join(", ")
    )
}

/// Asks each controller what its reset does, and says so; an error for each that cannot home, of which it has told.
fn explain(talk: &mut Talk, targets: &Targets, troubles: &mut Troubles) -> Vec<HomingResult> {
    let turns = turns(talk, &targets.controllers);
    let one = |outcome: RequestOutcome| {
        let (lane, name) = (outcome.lane, targets.name(outcome.lane));
        let (_, answer) = troubles.sort(targets, outcome)?;
        let controller = &targets.controllers[lane];
        let value = answer.words.first().copied().unwrap_or(0);
        let meaning =
            table().get(PA0E).and_then(|register| register.says(value)).unwrap_or("not in the manuals");
        let state = state(controller, &answer).map_or_else(String::new, |state| format!("; now {state}"));
        print::tell(&format!("{name}: PA0e = {value}: {meaning}{state}"));
        let turn = turns.iter().find(|turn| turn.lane == lane);
        if let Some(turn) = turn.filter(|turn| turn.winds_up()) {
            let why = format!(
                "axis {} is read at {:.1} deg; this would become its 0: {UNTURN}",
                turn.axis + 1,
                turn.at
            );
            troubles.refuse(name, &why);
            return Err(why);
        }
        if let Some(axis) = controller.seat.rotary_axis() {
            let read = turn.map_or_else(String::new, |turn| format!(", read at {:.1} deg,", turn.at));
            print::tell(&format!(
                "{name}: axis {} has no search for its zero: its position now{read} becomes 0",
                axis + 1
            ));
        }
        match hindrance(&answer, controller.connection.dialect) {
            None => Ok(Duration::ZERO),
            Some(error) => {
                troubles.refuse(name, &error.to_string());
                Err(error.to_string())
            }
        }
    };
    talk.ask(targets.each(&[Request::read(PA0E)]), Patience::default()).into_iter().map(one).collect()
}

fn move_home(
    talk: &mut Talk,
    targets: &Targets,
    ready: &[usize],
    timeout: Duration,
) -> Vec<Result<Duration, HomeError>> {
    let lanes: Vec<_> =
        ready.iter().map(|&lane| (lane, targets.controllers[lane].connection.dialect)).collect();
    let mut display = Display::new(targets, ready);
    home(talk, &lanes, timeout, &mut |lane, progress| display.show(lane, progress))
}

impl<'a> HomingReport<'a> {
    fn new(
        (targets, results): (&'a Targets, &[HomingResult]),
        (driven, on_links): (&'a DrivenTargets, &[HomingResult]),
    ) -> Self {
        let one = |(name, address, result): (&'a str, String, &HomingResult)| ControllerHoming {
            name,
            address,
            home: result.is_ok(),
            seconds: result.as_ref().ok().map(Duration::as_secs_f64),
            fault: result.as_ref().err().cloned(),
        };
        let stations = targets.controllers.iter().zip(results);
        let stations =
            stations.map(|(it, result)| (it.name.as_str(), it.connection.address.to_string(), result));
        let seats = driven.controllers.iter().zip(on_links);
        let seats = seats.map(|(it, result)| (it.name.as_str(), it.address(), result));
        Self { controllers: stations.chain(seats).map(one).collect() }
    }
}

fn tell(error: &HomeError, name: &str, troubles: &mut Troubles) {
    let silent = match error {
        HomeError::Order(fault) => !fault.refused() && !fault.is_foreign(),
        HomeError::Timeout { dpf0, .. } => dpf0.is_none(),
        _ => false,
    };
    if silent { troubles.miss(name, &error.to_string()) } else { troubles.refuse(name, &error.to_string()) }
}

/// Progress: on a terminal a line for each controller on its way, kept up to date; elsewhere a line for each step.
struct Display {
    bars: Option<MultiProgress>,
    lines: Vec<ProgressLine>,
}

struct ProgressLine {
    lane: usize,
    name: String,
    bar: Option<ProgressBar>,
    homing: bool,
}

impl Display {
    fn new(targets: &Targets, lanes: &[usize]) -> Self {
        let bars = std::io::stderr().is_terminal().then(MultiProgress::new);
        let line = |&lane: &usize| {
            let name = targets.name(lane).to_owned();
            let bar = bars.as_ref().map(|bars| bars.add(ProgressBar::new_spinner()));
            if let Some(bar) = &bar {
                let style = ProgressStyle::with_template("{spinner} {prefix}: {msg}");
                bar.set_style(style.expect("the template is fixed"));
                bar.set_prefix(name.clone());
            }
            ProgressLine { lane, name, bar, homing: false }
        };
        Self { lines: lanes.iter().map(line).collect(), bars }
    }

    fn show(&mut self, lane: usize, progress: &Progress) {
        let Some(line) = self.lines.iter_mut().find(|line| line.lane == lane) else { return };
        let (words, ended) =
            (words(progress), matches!(progress, Progress::Home { .. } | Progress::Failed(_)));
        // In a pipe, a step once: looks at DPF0 come five times a second.
        let again = line.homing && matches!(progress, Progress::Homing { .. });
        line.homing = matches!(progress, Progress::Homing { .. });
        match (&self.bars, &line.bar) {
            (Some(bars), Some(bar)) if ended => {
                bar.finish_and_clear();
                let _ = bars.println(format!("{}: {words}", line.name)); // a closed terminal stops nothing
            }
            (Some(_), Some(bar)) => {
                bar.set_message(words);
                bar.tick();
            }
            _ if again => {}
            _ => print::tell(&format!("{}: {words}", line.name)),
        }
    }
}

fn words(progress: &Progress) -> String {
    match progress {
        Progress::Started => "has begun".to_owned(),
        Progress::Homing { since, dpf0: Some(value) } => {
            format!("homing, {:.1} s, DPF0 reads {value}", since.as_secs_f64())
        }
        Progress::Homing { since, dpf0: None } => format!("no answer, {:.1} s", since.as_secs_f64()),
        Progress::Home { after } => format!("home after {:.1} s", after.as_secs_f64()),
        Progress::Failed(_) => "not home".to_owned(),
    }
}
