//! `kinocue sim`.

use std::fs::File;
use std::io::Read as _;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use signal_hook::consts::{SIGINT, SIGTERM};

use control::{CarryOut, Control};
pub(super) use tty::Drives;

use super::print::{self, tell};
use super::{Exit, Failure, OrExit as _, exit};
use crate::sim::{Farm, FarmError, LinkFaults, Options, Outcome, Setup};
use crate::time::parse_duration;
use crate::wire::Dialect;

mod control;
mod leeway;
mod parse;
mod silvermax;
mod sixpack2;
mod tty;

/// Where a host is that says nothing else.
const HOST_PORT: u16 = 8410;

/// Runs virtual controllers.
///
/// They behave as the manual says: accept and reply codes, registers and their limits, the queue of moves, resets,
/// emergency stop, errors, outputs, status reports. They start with the manual's defaults, which fail preflight; --safe
/// starts them with settings that pass. Ctrl-C or SIGTERM ends them with exit code 0.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue sim                                        one controller of three axes at 127.0.0.1:7408
  kinocue sim --count 4 --axes 6 --json              four of six axes, ports 7408 to 7411
  kinocue sim --loss 0.05 --delay 80ms --seed 7      one in twenty unanswered, the others late
  kinocue sim --axes 6 --pa 95=6 --log frames.csv    takes axes 7 to 12 of a shared frame
  kinocue sim --pa 06=0 --moves moves.csv            never shortens Time (PA06); logs the moves of the motors
  kinocue sim --safe --script \"2:X1=1, 3:X1=0\"      an emergency stop at 2 s, released at 3 s
  kinocue sim --count 8 --script \"5:3@err=12\"        an alarm of axis 3's drive at the third controller
  kinocue sim --dialect silvermax --tty ./stalls --units 16,17,18    three units on a serial line
  kinocue sim --dialect silvermax --tty ./stalls --units 16,17 --faults \"lost=0.001, 17@dead=1\" --script \"9:16@reset\"
  kinocue sim --dialect sixpack2 --tty ./stalls --faults \"jump=14400\"    motors lose steps at speed jumps above 22.5 mm/s

Commands of --script, each with TIME: before it (seconds from the start), and of --control:
  X1=1, X1=0     the switch at input X01 closes (active with PA04 = 1), or opens; X1 to X12
  err=12, err=0  an error occurs (1 to 7, 10 to 15, 17, 20, 21); all errors and their causes go away
  reboot         a power cycle
  estop=1        an emergency stop without an input; estop=0 releases it, but with PA91 = 2, as --safe has it, it holds until a reboot
  mute=1         requests are carried out but not answered; mute=0: answered again
  pa95=3         a parameter is set at the controller's keys: register in hex, value decimal or 0x
  loss=0.1, duplicate=0.1, delay=50ms   network faults from now on
A number or a name with @ before a command selects one controller: 2@err=12, c2@err=12.

Commands for serial drives, also for --faults, there without a time:
  lost=0.1, doubled=0.1, flipped=0.1   bytes lost, doubled or flipped at random
  late=0.1/30ms    bytes arrive this much later, at random
  answer_lost=0.1, lose=2   answers are lost after the request was carried out: at random, or the next N
  noise=20         bytes per second that nobody sent, at random, in both directions
  held=16ms        the adapter holds received bytes back this long; held=0ms ends it
  echo=1           the adapter echoes what is sent; echo=0 ends it
  unplug=1         the adapter is unplugged, and the link is gone; unplug=0: back under the same name
  break            the host sends a break, which a pseudo-terminal does not carry
For a SilverMax, all units, or unit 17 alone with 17@ before it:
  reset            a power cycle
  hot=1, blocked=1, dead=1   overheated; mechanically blocked; no communication at all; 0 ends it
  pushed=0.6       something pushes its axis this many mm off where the motor holds it; pushed=0 lets go
  X2=0, X2=1       an input is low, or high; X1 (the home switch) to X7
  as=16, as=0      answers as another unit, or as itself
  ppm=200          its clock runs fast by this many parts per million
For a SIXpack 2, unit 1 alone with 1@ before it (it starts at 19200 baud; the host changes that):
  reset, dead=1    as above; dead=0: power is back
  celsius=80, volts=51   temperature in °C, supply in V
  jump=14400       motors lose steps if their speed changes by more than this at once, microsteps/s
  blocked2=1, broken2=1   motor 2, of 0 to 5, is blocked; its switch no longer closes; 0 ends it")]
pub(super) struct Args {
    /// Address of the first controller; with port 0 each gets a free port.
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:7408", conflicts_with = "tty")]
    listen: SocketAddrV4,

    /// Number of controllers, at consecutive ports.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=4000), conflicts_with = "tty")]
    count: u16,

    /// Axes of each controller (PA02), 1 to 12.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=12), conflicts_with = "tty")]
    axes: u16,

    /// A parameter: register in hex, value decimal or 0x; repeatable.
    #[arg(long = "pa", value_name = "HEX=VALUE", value_parser = parse::parameter, conflicts_with = "tty")]
    parameters: Vec<(u8, u16)>,

    /// Family to simulate: smc, mbox for MBOX and IMAX, or serial drives, which need --tty.
    #[arg(long, value_enum, default_value_t = SimFamily::Smc)]
    dialect: SimFamily,

    /// Probability that a datagram goes unanswered, 0..1: in half the cases it is lost, in the other half its answer.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = parse::chance, conflicts_with = "tty")]
    loss: f64,

    /// Probability that an answer is sent twice, 0..1.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = parse::chance, conflicts_with = "tty")]
    duplicate: f64,

    /// Delay of answers: 80ms, 1.5s.
    #[arg(long, value_name = "SPAN", default_value = "0ms", value_parser = parse_duration, conflicts_with = "tty")]
    delay: Duration,

    /// Carry out requests, but never answer.
    #[arg(long, conflicts_with = "tty")]
    mute: bool,

    /// Emergency stop from this time on, counted from the start: SS[.mmm], MM:SS, HH:MM:SS.
    #[arg(long, value_name = "TIME", value_parser = parse::time, conflicts_with = "tty")]
    estop_at: Option<Duration>,

    /// Seed of the random faults [default: random, and printed]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// The port that frames must come from (PA24); 0 takes any.
    #[arg(long, value_name = "PORT", default_value_t = HOST_PORT, conflicts_with = "tty")]
    host_port: u16,

    /// Start with settings that are safe for people and pass preflight, with reports to this machine; --pa changes them.
    #[arg(long, conflicts_with = "tty")]
    safe: bool,

    /// Timed commands, as "2.0:X1=1, 3.0:X1=0, 5:err=12, 8:reboot"; see below.
    #[arg(long, value_name = "TIME:COMMAND, …", default_value = "", hide_default_value = true)]
    script: String,

    /// Accept commands on a Unix socket, one per line; each is answered with ok, or error and the reason.
    #[arg(long, value_name = "PATH")]
    control: Option<PathBuf>,

    /// Write a CSV row for each motion frame: commanded and actual positions.
    #[arg(long, value_name = "FILE", conflicts_with = "tty")]
    log: Option<PathBuf>,

    /// Write a CSV row for each move of the motors: start time, duration, start and end position in pulses, without
    /// vibration. A move begins with its frame, or at the end of the move before it.
    #[arg(long, value_name = "FILE", conflicts_with = "tty")]
    moves: Option<PathBuf>,

    /// At the end, print one JSON object with all counts on stdout.
    #[arg(long)]
    json: bool,

    /// Allow addresses that other machines can reach.
    #[arg(long, conflicts_with = "tty")]
    allow_lan: bool,

    #[command(flatten)]
    tty: tty::TtyArgs,

    #[command(flatten)]
    leeway: leeway::Leeway,
}

/// A family of controllers, or of serial drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum SimFamily {
    Smc,
    Mbox,
    Silvermax,
    Sixpack2,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let signals = SignalSocket::catch().context("cannot wait for Ctrl-C and SIGTERM").or_system()?;
    match (args.dialect, &args.tty.tty) {
        (SimFamily::Silvermax, Some(path)) => silvermax::run(args, path, signals),
        (SimFamily::Sixpack2, Some(path)) => sixpack2::run(args, path, signals),
        (SimFamily::Smc, None) => run_farm(args, Dialect::Smc, signals),
        (SimFamily::Mbox, None) => run_farm(args, Dialect::Mbox, signals),
        (SimFamily::Silvermax | SimFamily::Sixpack2, None) => {
            Err(anyhow!("serial drives need a line; give --tty and the link to it, as in --tty ./stalls"))
                .or_exit(Exit::Usage)
        }
        (SimFamily::Smc | SimFamily::Mbox, Some(_)) => {
            Err(anyhow!("--tty is for serial drives; give --dialect silvermax or sixpack2 with it"))
                .or_exit(Exit::Usage)
        }
    }
}

fn run_farm(args: &Args, dialect: Dialect, signals: SignalSocket) -> Result<Exit, Failure> {
    if !args.listen.ip().is_loopback() && !args.allow_lan {
        let address = args.listen;
        let refusal =
            anyhow!("{address} is not of this machine alone; give --allow-lan to listen there all the same");
        return Err(refusal).or_exit(Exit::Usage);
    }
    let farm = Farm::start(options(args, dialect)?).map_err(|error| {
        let exit = if matches!(error, FarmError::Script(_)) { Exit::Usage } else { exit::of_system(&error) };
        Failure { exit, error: error.into() }
    })?;
    let remote = farm.remote();
    // Its file goes when this does.
    let _control = control(args, Arc::new(move |text| Ok(remote.tell(parse::command(text)?)?)))?;
    for address in farm.addresses() {
        tell(&format!("ready {address}"));
    }
    signals.wait()?;
    let outcomes = farm.stop().context("cannot finish the log").or_exit(Exit::Io)?;
    report(&outcomes, args.json)?;
    Ok(Exit::Done)
}

/// The control socket, if one is asked for.
fn control(args: &Args, carry_out: CarryOut) -> Result<Option<Control>, Failure> {
    let open = |path: &PathBuf| {
        let opened = Control::open(path, carry_out);
        opened.with_context(|| format!("cannot listen at {}", path.display())).or_system()
    };
    args.control.as_ref().map(open).transpose()
}

fn options(args: &Args, dialect: Dialect) -> Result<Options, Failure> {
    let setup = Setup {
        axes: args.axes,
        parameters: args.parameters.clone(),
        host_port: args.host_port,
        dialect,
        mute: args.mute,
        estop_at: args.estop_at,
        invented: args.leeway.invented(),
    };
    let host = SocketAddrV4::new(Ipv4Addr::LOCALHOST, args.host_port);
    let setup = if args.safe { setup.safe(host) } else { setup };
    Ok(Options {
        listen: args.listen,
        controllers: vec![setup; usize::from(args.count)],
        faults: LinkFaults { loss: args.loss, duplicate: args.duplicate, delay: args.delay },
        seed: seed(args),
        log: log_file(args.log.as_deref())?,
        moves: log_file(args.moves.as_deref())?,
        script: parse::script(&args.script).context("--script").or_exit(Exit::Usage)?,
    })
}

/// A file to log to. It is emptied only once the ports are ours: a second sim must not wipe the log of the first.
fn log_file(path: Option<&Path>) -> Result<Option<File>, Failure> {
    let open = |path: &Path| {
        let file = File::options().write(true).create(true).truncate(false).open(path);
        file.with_context(|| format!("cannot write the log {}", path.display())).or_exit(Exit::Io)
    };
    path.map(open).transpose()
}

/// The seed that was given, or one that is told so that it can be given again.
fn seed(args: &Args) -> u64 {
    args.seed.unwrap_or_else(|| {
        let seed = u64::from(std::process::id());
        if args.loss > 0.0 || args.duplicate > 0.0 || args.tty.tty.is_some() {
            tell(&format!("seed {seed}"));
        }
        seed
    })
}

fn report(outcomes: &[Outcome], json: bool) -> Result<(), Failure> {
    if json {
        return print::json(&serde_json::json!({ "controllers": outcomes }));
    }
    for outcome in outcomes {
        let (address, counts) = (outcome.address, &outcome.counts);
        let (received, replied, refused) = (counts.received, counts.replied, counts.refused.total());
        let (accepted, executed) = (counts.accepted, counts.executed);
        tell(&format!(
            "{address}  received {received}  accepted {accepted}  refused {refused}  replied {replied}  \
             moves executed {executed}"
        ));
    }
    Ok(())
}

/// Ctrl-C and SIGTERM as a byte on a socket, which a thread can wait for.
struct SignalSocket(UnixStream);

impl SignalSocket {
    fn catch() -> std::io::Result<Self> {
        let (wait, write) = UnixStream::pair()?;
        signal_hook::low_level::pipe::register(SIGINT, write.try_clone()?)?;
        signal_hook::low_level::pipe::register(SIGTERM, write)?;
        Ok(Self(wait))
    }

    fn wait(mut self) -> Result<(), Failure> {
        self.0.read_exact(&mut [0]).context("cannot wait for Ctrl-C and SIGTERM").or_system()
    }
}
