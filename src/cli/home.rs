//! `kinocue home`.

use std::fmt::Write as _;
use std::io::IsTerminal as _;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use super::ask::{agreed, somebody};
use super::targets::{TargetArgs, Targets, Troubles, state};
use super::{Exit, Failure};
use crate::device::home::{HomeError, PA0E, Progress, home};
use crate::device::{Patience, Request, Talk, table};

/// Homes seats: has their controllers find zero (DPF0) and waits until each is there.
///
/// The seats move by themselves, over their whole stroke, at a speed that the controllers set. Ctrl-C ends the command,
/// not the movement: to stop that is the emergency stop's, which is hard-wired.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue home --config hall.toml
  kinocue home A1 A2 --config hall.toml
  kinocue home --config hall.toml --row A --seats-empty
  kinocue home --to 192.168.15.201:7408 --timeout 120

PA0e decides what a controller does: 0 searches zero, 1 goes to zero without a search, which is only right where the
controller has found it before since it was switched on.")]
pub(super) struct Args {
    /// The controllers [default: all].
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    #[command(flatten)]
    targets: TargetArgs,
    /// Nobody sits on the seats and nothing lies on or under them: do not ask.
    #[arg(long)]
    seats_empty: bool,
    /// How long each may take, seconds, 1 to 3600.
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=3600))]
    timeout: u64,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let targets = args.targets.resolve(&args.names)?;
    if !args.seats_empty {
        somebody("Are the seats empty?", "--seats-empty")?;
    }
    let mut talk = targets.open()?;
    let mut troubles = Troubles::default();
    let ready = explain(&mut talk, &targets, &mut troubles);
    if ready.is_empty() {
        return Ok(troubles.exit());
    }
    let names: Vec<_> = ready.iter().map(|lane| targets.name(*lane)).collect();
    let question = format!(
        "{} will move over the whole stroke. Are these seats empty, and is nobody near them?",
        names.join(", ")
    );
    if !agreed(&question, args.seats_empty, "--seats-empty")? {
        eprintln!("nothing was moved");
        return Ok(Exit::Done);
    }
    let lanes: Vec<_> = ready.iter().map(|&lane| (lane, targets.controllers[lane].dialect)).collect();
    let mut display = Display::new(&targets, &ready);
    let timeout = Duration::from_secs(args.timeout);
    let results = home(&mut talk, &lanes, timeout, &mut |lane, progress| display.show(lane, progress));
    display.close();
    for (lane, result) in ready.iter().zip(results) {
        if let Err(error) = result {
            tell(&error, targets.name(*lane), &mut troubles);
        }
    }
    Ok(troubles.exit())
}

/// Asks each controller what its reset does, says so, and gives those that answered.
fn explain(talk: &mut Talk, targets: &Targets, troubles: &mut Troubles) -> Vec<usize> {
    let mut ready = Vec::new();
    for outcome in talk.ask(targets.each(&[Request::read(PA0E)]), Patience::default()) {
        let lane = outcome.lane;
        let Ok((_, answer)) = troubles.sort(targets, outcome) else { continue };
        let value = answer.words.first().copied().unwrap_or(0);
        let mut line = format!("{}: PA0e = {value}", targets.name(lane));
        if let Some(meaning) = table().get(PA0E).and_then(|register| register.says(value)) {
            write!(line, ": {meaning}").expect("a String takes what is written to it");
        }
        if let Some(state) = state(&targets.controllers[lane], &answer) {
            write!(line, "; now {state}").expect("a String takes what is written to it");
        }
        eprintln!("{line}");
        ready.push(lane);
    }
    ready
}

fn tell(error: &HomeError, name: &str, troubles: &mut Troubles) {
    let silent = match error {
        HomeError::Order(fault) => !fault.refused(),
        HomeError::Timeout { dpf0, .. } => dpf0.is_none(),
        _ => false,
    };
    if silent { troubles.miss(name, &error.to_string()) } else { troubles.refuse(name, &error.to_string()) }
}

/// Progress: a line for each controller on a terminal, kept up to date; elsewhere a line for each step.
struct Display {
    lines: Vec<Line>,
}

struct Line {
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
            Line { lane, name, bar, homing: false }
        };
        Self { lines: lanes.iter().map(line).collect() }
    }

    fn show(&mut self, lane: usize, progress: &Progress) {
        let Some(line) = self.lines.iter_mut().find(|line| line.lane == lane) else { return };
        let words = words(progress);
        // In a pipe, a step once: looks at DPF0 come five times a second.
        let again = line.homing && matches!(progress, Progress::Homing { .. });
        line.homing = matches!(progress, Progress::Homing { .. });
        match &line.bar {
            Some(bar) if matches!(progress, Progress::Home { .. } | Progress::Failed(_)) => {
                bar.finish_with_message(words);
            }
            Some(bar) => {
                bar.set_message(words);
                bar.tick();
            }
            None if again => {}
            None => eprintln!("{}: {words}", line.name),
        }
    }

    fn close(self) {
        for bar in self.lines.into_iter().filter_map(|line| line.bar) {
            bar.abandon();
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
