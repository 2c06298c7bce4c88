//! `kinocue doctor`.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::{Exit, Failure, load, print};
use crate::config::Config;
use crate::control::model::{InMicros, Percentiles};
use crate::doctor::chart::{buckets, draw};
use crate::doctor::lateness::{LatenessRun, MachineLoad, RATE_HZ};
use crate::doctor::measure::measure;
use crate::doctor::{FindingLine, Hall, Verdict, facts, judge, ports, ready};
use crate::sys::realtime::normal_priority;
use crate::time::Rate;

/// Checks if this machine is fit for real-time use.
///
/// The checks come first, each with its finding, a verdict and the exact fix. Then it measures a bare loop with the clock and
/// scheduling of `play`, at 1,000 ticks per second. It changes nothing, and sends nothing but to itself.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Verdicts:
  ok       as it should be
  warn     a show will run, but with less margin than possible
  bad      ticks or frames will be lost: the machine is not ready
  unknown  cannot be determined by this program

Verdicts of a measured run, by how late the loop woke after the deadline of each tick:
  warn  1 % of the ticks are more than 10 % of a period (100 µs) late, or any tick is missed.
        A frame's Time is a whole period; up to a tenth of it, a seat follows as planned.
  bad   1 % of the ticks are more than 50 % of a period late, or over 0.1 % are missed.
        The work of a tick and the way to the seat need the other half, so frames begin to run
        into the next ones; and ticks missed this often can be felt in a seat.

Exit codes: 0 ready, 1 not ready: something is bad

Examples:
  kinocue doctor                                 checks, and measures for 10 s
  kinocue doctor --load --seconds 60             measures again with every processor busy
  kinocue doctor --config examples/hall.toml --seconds 0  only checks, for the controllers of a hall
  kinocue doctor --json | jq '.lines[] | select(.verdict != \"ok\")'")]
pub(super) struct Args {
    /// Duration of each run in seconds, at most an hour; 0 runs none.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(0..=3600))]
    seconds: u64,

    /// Measure a second time, with a busy thread of ordinary priority on each processor.
    #[arg(long)]
    load: bool,

    /// Number of controllers that shows will play to.
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "config", value_parser = clap::value_parser!(u32).range(1..=65535))]
    controllers: u32,

    /// The configuration with the controllers that shows will play to.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let config = args.config.as_deref().map(load::config).transpose()?;
    let hall = config.as_ref().map_or_else(
        || Hall { controllers: args.controllers, neighbours: args.controllers, rate: Rate::from_hz(RATE_HZ) },
        hall,
    );
    let mut lines = judge(&facts(), hall);
    lines.extend(ports::of(config.as_ref().map_or(&[], |config| &config.links)));
    let loads: &[MachineLoad] = match (args.seconds, args.load) {
        (0, _) => &[],
        (_, false) => &[MachineLoad::Idle],
        (_, true) => &[MachineLoad::Idle, MachineLoad::Loaded],
    };
    let runs: Vec<LatenessRun> =
        loads.iter().map(|&load| watched(load, Duration::from_secs(args.seconds))).collect();
    lines.extend(runs.iter().map(LatenessRun::judge));
    let ready = ready(&lines);
    if args.json {
        print::json(&DoctorReport {
            ready,
            controllers: hall.controllers,
            runs: runs.iter().map(RunReport::of).collect(),
            lines,
        })?;
    } else {
        print::out(&text(&lines, &runs, hall))?;
    }
    Ok(if ready { Exit::Done } else { Exit::CheckFailed })
}

fn hall(config: &Config) -> Hall {
    let addresses = config.stations().into_iter().map(|one| *one.connection.address.ip());
    let elsewhere: HashSet<_> = addresses.filter(|ip| !ip.is_loopback()).collect();
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    Hall {
        controllers: count(config.stations().len()),
        neighbours: count(elsewhere.len()),
        rate: Rate::from_hz(config.show.rate_hz),
    }
}

/// Measures on this thread, while another draws how far it is.
fn watched(load: MachineLoad, span: Duration) -> LatenessRun {
    let (done, over) = (AtomicU64::new(0), AtomicBool::new(false));
    if !std::io::stderr().is_terminal() {
        return measure(load, span, &done);
    }
    thread::scope(|scope| {
        let drawer = scope.spawn(|| progress(load, span, &done, &over));
        let run = measure(load, span, &done);
        over.store(true, Ordering::Relaxed);
        drawer.thread().unpark();
        run
    })
}

fn progress(load: MachineLoad, span: Duration, done: &AtomicU64, over: &AtomicBool) {
    let _ = normal_priority(); // a line drawn at another priority is no reason to fail
    let ticks_per_s = Duration::from_secs(1).as_nanos() / u128::from(crate::doctor::lateness::PERIOD_NS);
    let total = u128::from(span.as_secs()) * ticks_per_s;
    let bar = ProgressBar::new(u64::try_from(total).unwrap_or(u64::MAX));
    let style = ProgressStyle::with_template("measuring, {msg} [{wide_bar}] {pos} of {len} ticks");
    bar.set_style(style.expect("the template is fixed").progress_chars("=> "));
    bar.set_message(load.word());
    while !over.load(Ordering::Relaxed) {
        bar.set_position(done.load(Ordering::Relaxed));
        thread::park_timeout(Duration::from_millis(100));
    }
    bar.finish_and_clear();
}

/// What programs read. Fields may be added, never changed.
#[derive(Debug, Serialize)]
struct DoctorReport {
    ready: bool,
    controllers: u32,
    lines: Vec<FindingLine>,
    runs: Vec<RunReport>,
}

#[derive(Debug, Serialize)]
struct RunReport {
    /// `idle` or `loaded`.
    load: &'static str,
    rate_hz: f64,
    /// `fifo`, `rr` or `other`.
    policy: String,
    /// Wake-ups.
    ticks: u64,
    missed_ticks: u64,
    #[serde(with = "InMicros")]
    lateness_us: Percentiles,
    histogram: Vec<BucketReport>,
}

/// Some of the wake-ups; the last bucket may have no end.
#[derive(Debug, Serialize)]
struct BucketReport {
    from_us: u64,
    to_us: Option<u64>,
    count: u64,
}

impl RunReport {
    fn of(run: &LatenessRun) -> Self {
        let histogram = buckets(&run.lateness).into_iter().map(|bucket| BucketReport {
            from_us: bucket.from_ns / 1_000,
            to_us: (bucket.to_ns < u64::MAX).then_some(bucket.to_ns / 1_000),
            count: bucket.count,
        });
        Self {
            load: run.load.word(),
            rate_hz: RATE_HZ,
            policy: run.policy.to_string(),
            ticks: run.ticks,
            missed_ticks: run.missed,
            lateness_us: Percentiles::of(&run.lateness),
            histogram: histogram.collect(),
        }
    }
}

fn text(lines: &[FindingLine], runs: &[LatenessRun], hall: Hall) -> String {
    let mut text = String::new();
    for line in lines {
        append(&mut text, format_args!("{:<8} {:<22} {}\n", line.verdict.word(), line.id, line.found));
        if let Some(fix) = &line.fix {
            let what = if line.verdict == Verdict::Unknown { "look" } else { "fix" };
            append(&mut text, format_args!("{:<31} {what}: {fix}\n", ""));
        }
    }
    for run in runs {
        append(
            &mut text,
            format_args!(
                "\nlateness at {RATE_HZ:.0} Hz, {}, scheduled as {} (bars grow with each doubling)\n{}",
                run.load.word(),
                run.policy,
                draw(&run.lateness)
            ),
        );
    }
    let number = |verdict| lines.iter().filter(|line| line.verdict == verdict).count();
    append(
        &mut text,
        format_args!(
            "\n{} for {} controller{}: {} bad, {} warn, {} unknown, {} ok\n",
            if ready(lines) { "ready" } else { "not ready" },
            hall.controllers,
            if hall.controllers == 1 { "" } else { "s" },
            number(Verdict::Bad),
            number(Verdict::Warn),
            number(Verdict::Unknown),
            number(Verdict::Ok)
        ),
    );
    text
}

fn append(text: &mut String, what: std::fmt::Arguments<'_>) {
    text.write_fmt(what).expect("a String takes what is written to it");
}
