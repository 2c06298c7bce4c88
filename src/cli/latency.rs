//! `kinocue latency`: how late frames leave and how soon their acks come, over seats that do not move.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context as _, anyhow};

use super::load::parse_rate;
use super::play::{exit_of, judge, leave_on_signals};
use super::stream::StreamArgs;
use super::targets::Targets;
use super::{Exit, Failure, OrExit as _, load, print};
use crate::app::{Play, PlayError, Played};
use crate::config::{Config, from_to_args};
use crate::device::stand::stand;
use crate::engine::Show;
use crate::latency::{cue, held};
use crate::motion::{MAX_AXES, Pulses};
use crate::rt::Times;
use crate::sim::{Farm, Options, Setup};
use crate::time::{Rate, ShowTime};

mod compare;
mod report;
mod watch;

use report::{LatencyReport, RefusedFrames};
use watch::{LatencyWatch, UnfinishedFile};

/// Virtual controllers where no others are named, as many as `demo` has.
const VIRTUAL: u16 = 4;
/// Axes of a controller whose `--to` says nothing of them.
const AXES: &str = "axes=3";

/// Measures how late frames leave and how soon their acks arrive.
///
/// Sends frames as `play` does, from the same loop, and moves nothing: each frame holds its seat where it is, effects off.
/// The position of each seat is read twice first, and again just before the first frame. A controller is left out unless its
/// seat is at rest within its stroke, and nothing about it (axes, PA95, PA55, PA0d, an emergency stop, an error) could make
/// a frame mean another position. Without --to and --config it measures against virtual controllers of its own.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Lateness is the time from a tick's deadline until its first frame is handed to the kernel; ack latency the time from
handing each frame to the kernel until the kernel receives its ack. Lateness measures this machine; ack latency also
measures the network and the controllers, or, with virtual controllers, this machine again.

--out writes an HdrHistogram interval log (format 1.3, nanoseconds), with one line per second for each of the tags
lateness and ack_latency. Any program that reads such logs can plot it.

Exit codes:
  0   measured
  69  a controller did not answer
  75  a seat did not stay where it was, or the frame port is taken
  76  a controller refused frames, or was left out

Examples:
  kinocue latency                                                    to four virtual controllers
  kinocue latency --count 64 --seconds 60 --out before.hlog          to 64 of them, written to a file
  kinocue latency --count 64 --seconds 60 --spin-us 100 --out after.hlog
  kinocue latency --compare before.hlog after.hlog                   the effect of spinning
  kinocue latency --to 127.0.0.1:7408 --rate 250                to a controller of three axes
  kinocue latency --config examples/hall.toml --ack-every 10 --json | jq .lateness_us")]
pub(super) struct Args {
    /// A controller: HOST:PORT, then optionally, after commas, name=A1, axes=3, offset=0, fan_out=slice or shared, dialect=smc or
    /// mbox; repeatable.
    #[arg(long, value_name = "ADDR", conflicts_with = "config")]
    to: Vec<String>,

    /// The configuration, with controllers, seats and show settings.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Number of virtual controllers of three axes, without --to and --config [default: 4]
    #[arg(long, value_name = "N", conflicts_with_all = ["to", "config"], value_parser = clap::value_parser!(u16).range(1..=1000))]
    count: Option<u16>,

    /// Ticks per second, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = parse_rate, default_value = "1000")]
    rate: f64,

    /// Duration in seconds, at most an hour.
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: u32,

    #[command(flatten)]
    stream: StreamArgs,

    /// Write the histograms of each second to a file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Compare two files of --out; measure nothing.
    #[arg(long, num_args = 2, value_names = ["A", "B"], conflicts_with_all = ["to", "config", "count", "out"])]
    compare: Vec<PathBuf>,

    /// Print the report as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    if let [a, b] = &args.compare[..] {
        return compare::run(a, b, args.json);
    }
    if args.config.is_some() || !args.to.is_empty() {
        return measure(args, configuration(args)?, false);
    }
    let setup = Setup { host_port: 0, ..Setup::default() };
    let setups = vec![setup; usize::from(args.count.unwrap_or(VIRTUAL))];
    let farm = Farm::start(Options::loopback(setups)).or_system()?;
    let to: Vec<_> = farm.addresses().iter().map(|address| format!("{address},{AXES}")).collect();
    let mut config = from_to_args(&to, &[], MAX_AXES).or_exit(Exit::Internal)?;
    config.show.bind = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);
    let measured = measure(args, config, true);
    farm.stop().or_exit(Exit::Io)?;
    measured
}

/// The controllers that the arguments name.
fn configuration(args: &Args) -> Result<Config, Failure> {
    if let Some(path) = &args.config {
        return load::without_drives(path);
    }
    let says_axes = |to: &str| to.split(',').any(|part| part.trim_start().starts_with("axes="));
    let with_axes = |to: &String| if says_axes(to) { to.clone() } else { format!("{to},{AXES}") };
    let to: Vec<_> = args.to.iter().map(with_axes).collect();
    from_to_args(&to, &[], MAX_AXES).or_exit(Exit::Usage)
}

/// Measures and reports; `of_our_own` says that the controllers are virtual ones.
fn measure(args: &Args, mut config: Config, of_our_own: bool) -> Result<Exit, Failure> {
    config.show.rate_hz = args.rate;
    args.stream.put_into(&mut config)?;
    let (config, refused) = standing(config)?;
    if config.controllers.is_empty() {
        let why = anyhow!("no seat left to measure; only reads were sent");
        return Err(why).or_exit(RefusedFrames::exit(&refused));
    }
    let about = about(args.rate, config.controllers.len(), of_our_own);
    let (times, played) = send(args, config, &about)?;
    for line in played.refusals.iter().chain(&played.notes) {
        print::tell(&format!("kinocue: {line}"));
    }
    let report = LatencyReport::new(&about, args.seconds, of_our_own, &times, &refused, &played);
    if args.json {
        print::json(&report)?;
    } else {
        print::out(&report.text(&times))?;
    }
    match judge(&played)? {
        Exit::Done => Ok(RefusedFrames::exit(&refused)),
        other => Ok(other),
    }
}

/// What is measured, in words.
fn about(rate_hz: f64, controllers: usize, of_our_own: bool) -> String {
    let kind = if of_our_own { "virtual " } else { "" };
    let noun = if controllers == 1 { "controller" } else { "controllers" };
    format!("{rate_hz} Hz to {controllers} {kind}{noun}")
}

/// Sends the frames that hold the seats, and gives the times of all.
fn send(args: &Args, config: Config, about: &str) -> Result<(Times, Played), Failure> {
    let timeline = cue(&config.controllers, args.seconds);
    let rate = Rate::from_hz(config.show.rate_hz);
    let show = Show { rate, timing: config.show.timing, start: ShowTime::ZERO, plays: 1 };
    let play = Play::holding(config, timeline, show, args.stream.no_acks).map_err(failed)?;
    let control = play.control();
    leave_on_signals(&control.leave).context("signals cannot be handled").or_system()?;
    let live = control.live;
    // Created before anything is measured, so that nobody measures for an hour and then cannot keep it.
    let out = args.out.as_deref().map(UnfinishedFile::create).transpose()?;
    let watch = LatencyWatch::start(Arc::clone(&live), args.seconds, about, out)?;
    let played = play.run(|_| false).map_err(failed);
    watch.finish(played.is_ok())?;
    Ok((live.times(), played?))
}

/// The configuration with only those controllers whose seats can be held, parked where they stand; and the others, which
/// are told of.
fn standing(config: Config) -> Result<(Config, Vec<RefusedFrames>), Failure> {
    let targets = Targets { controllers: config.stations(), show: config.show.clone() };
    let mut talk = targets.open()?;
    let all: Vec<usize> = (0..targets.controllers.len()).collect();
    targets.refuse_company(&mut talk, &all)?;
    let stood = stand(&mut talk, &targets.controllers);
    drop(talk);
    let (mut controllers, mut places, mut refused) = (Vec::new(), Vec::<Vec<Pulses>>::new(), Vec::new());
    for (controller, stood) in config.controllers.into_iter().zip(stood) {
        match stood {
            Ok(stands) => {
                controllers.push(controller);
                places.push(stands);
            }
            Err(error) => {
                print::tell(&format!("kinocue: {}: left out: {error}", controller.name));
                refused.push(RefusedFrames::new(controller.name, &error));
            }
        }
    }
    Ok((held(&Config { controllers, ..config }, &places), refused))
}

/// What a measurement ends with that did not begin: its cue is our own.
fn failed(error: PlayError) -> Failure {
    let exit = match exit_of(&error) {
        Exit::BadCue | Exit::CheckFailed => Exit::Internal,
        exit => exit,
    };
    Failure { exit, error: error.into() }
}
