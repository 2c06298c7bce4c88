//! `kinocue preflight`: every controller asked, judged and shown.

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use anyhow::anyhow;
use indicatif::{ProgressBar, ProgressStyle};

use super::client;
use super::load::{self, SourceArgs, parse_rate};
use super::targets::{TargetArgs, Targets};
use super::{Exit, Failure, OrExit as _, print};
use crate::device::survey::{Survey, survey};
use crate::motion::MAX_AXES;
use crate::net::{Route, route};
use crate::preflight::{Check, ShowTerms, Subject, judge, judge_driven, wanted};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;
use crate::timeline::Timeline;

mod drives;
mod explain;
mod report;

use report::{ControllerChecks, PreflightReport};

/// Checks every controller before anyone sits down.
///
/// Checks which controllers answer, how fast, and if their settings are right and safe.
///
/// Only reads: nothing moves and nothing is changed. Seats on serial links are read over their ports. Controllers are read in
/// parallel: 64 take seconds, even if some are dead. Without --to and --config the daemon checks its own hall.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue preflight                          the daemon's own hall
  kinocue preflight --config examples/hall.toml
  kinocue preflight --config examples/hall.toml --cue cues/coaster.csv --rate 250
  kinocue preflight A1 B1 --config examples/hall.toml
  kinocue preflight --config examples/hall.toml --row B --json
  kinocue preflight --to 127.0.0.1:7408,axes=3
  kinocue preflight --explain estop-and

To accept a finding, name it with the reason in the configuration, under [show] or under one [[controller]]:
  accept_findings = [{ check = \"estop-disabled\", why = \"hard-wired contactor K1, tested 12 May\" }]

Exit codes:
  0   nothing fails
  1   something fails
  69  no controller answers, or no daemon
  75  another program holds the frame port
  78  the configuration is bad
  79  another machine sends to a controller")]
pub(super) struct Args {
    /// The controllers [default: all].
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    #[command(flatten)]
    targets: TargetArgs,
    /// The cue that will be played.
    #[arg(long, value_name = "CUE")]
    cue: Option<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
    /// Frames per second [default: the configuration's, else 100].
    #[arg(long, value_name = "HZ", value_parser = parse_rate)]
    rate: Option<f64>,
    #[command(flatten)]
    server: client::ServerArgs,
    /// Explain all checks, or this one, and why they matter; contacts no controller.
    #[arg(long, value_name = "CHECK", num_args = 0..=1, exclusive = true)]
    explain: Option<Option<String>>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    if let Some(which) = &args.explain {
        return explain(which.as_deref());
    }
    if !args.targets.are_named() {
        args.targets.refuse_choice(&args.names)?;
        if args.cue.is_some() || args.rate.is_some() {
            let why = "the daemon checks for the loaded show, at its own rate; omit --cue and --rate, or give \
                       controllers with --to or --config";
            return Err(anyhow!(why)).or_exit(Exit::Usage);
        }
        return client::preflight(&args.server);
    }
    let cue =
        args.cue.as_ref().map(|path| load::cue(path, &args.source.source())).transpose()?.map(Timeline::new);
    let cue_axes = cue.as_ref().map_or(MAX_AXES, Timeline::axes);
    let (targets, driven) = args.targets.resolve_all_for(&args.names, cue_axes)?;
    let terms = ShowTerms {
        frame_port: targets.show.bind.port(),
        rate_hz: args.rate.unwrap_or(targets.show.rate_hz),
        cue: cue.map(|cue| (cue.axes(), cue.has_vibration())),
    };
    // What --to means where neither it nor a cue gives the axes reaches to the last one there may be.
    let axes_are_open = !args.targets.are_configured() && args.cue.is_none();
    let begun = Monotonic.now();
    let (asked, looked) = thread::scope(|scope| {
        let looked = scope.spawn(|| drives::look_at_all(&driven));
        (ask(&targets), looked.join().expect("whoever looks does not panic"))
    });
    let asked = asked?;
    let subjects: Vec<_> = (targets.controllers.iter().zip(&asked))
        .map(|(controller, asked)| Subject {
            controller,
            axes: Some(controller.seat.axes).filter(|_| !axes_are_open || controller.window().end < MAX_AXES),
            route: asked.route.clone(),
            survey: asked.survey.as_ref(),
        })
        .collect();
    let findings = judge(&subjects, &terms, &targets.show.accept_findings);
    let on_links = drives::subjects(&driven, &looked);
    let found = judge_driven(&on_links, &targets.show.accept_findings);
    let all = ControllerChecks::of_all(&subjects, findings);
    let all = all.chain(ControllerChecks::of_driven(&on_links, found));
    let report = PreflightReport::new(all.collect(), Monotonic.now().since(begun));
    tell(&report, args.server.json)
}

fn explain(which: Option<&str>) -> Result<Exit, Failure> {
    let text = match which {
        None => explain::all(),
        Some(id) => explain::one(
            id.parse::<Check>().map_err(|error| anyhow!("{id}: {error}")).or_exit(Exit::NoInput)?,
        ),
    };
    print::out(&text)?;
    Ok(Exit::Done)
}

/// What asking one controller came to.
struct Asked {
    route: Result<Route, String>,
    /// `None` if there is no way to it.
    survey: Option<Survey>,
}

/// Asks those to whom there is a way.
fn ask(targets: &Targets) -> Result<Vec<Asked>, Failure> {
    let bind = *targets.show.bind.ip();
    let way = |address| route(bind, address).map_err(|error| error.to_string());
    let routes: Vec<_> =
        targets.controllers.iter().map(|controller| way(controller.connection.address)).collect();
    let reached = targets.controllers.iter().zip(&routes).filter(|(_, route)| route.is_ok());
    let reached = Targets {
        controllers: reached.map(|(controller, _)| controller.clone()).collect(),
        show: targets.show.clone(),
    };
    let mut surveys =
        if reached.controllers.is_empty() { Vec::new() } else { survey_all(&reached)? }.into_iter();
    let asked = |route: Result<Route, String>| {
        let survey = route.is_ok().then(|| surveys.next()).flatten();
        Asked { route, survey }
    };
    Ok(routes.into_iter().map(asked).collect())
}

/// Asks all, with a progress line on a terminal.
fn survey_all(targets: &Targets) -> Result<Vec<Survey>, Failure> {
    let mut talk = targets.open()?;
    let bar = std::io::stderr().is_terminal().then(|| {
        let style = ProgressStyle::with_template("{spinner} {elapsed} {msg}").expect("the template is fixed");
        let bar = ProgressBar::new_spinner().with_style(style);
        bar.enable_steady_tick(Duration::from_millis(100));
        bar
    });
    let count = targets.controllers.len();
    let wanted: Vec<_> = targets.controllers.iter().map(wanted).collect();
    let surveys = survey(&mut talk, &targets.controllers, &wanted, &mut |doing| {
        if let Some(bar) = &bar {
            bar.set_message(format!("{count} controllers: {doing}"));
        }
    });
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    Ok(surveys)
}

fn tell(report: &PreflightReport, json: bool) -> Result<Exit, Failure> {
    if json {
        print::json(report)?;
    } else {
        print::out(&report.text())?;
    }
    print::tell(&format!("kinocue: {}", report.summary()));
    Ok(match (report.answered(), report.passed()) {
        (0, _) => Exit::Unavailable,
        (_, false) if report.fails(Check::OtherMaster) => Exit::OtherMaster,
        (_, false) => Exit::CheckFailed,
        (_, true) => Exit::Done,
    })
}
