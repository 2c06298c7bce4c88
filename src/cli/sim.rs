//! `kinocue sim`.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::net::SocketAddrV4;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use signal_hook::consts::{SIGINT, SIGTERM};

use super::{Exit, Failure, OrExit as _};
use crate::sim::{Farm, LinkFaults, Options, Outcome, Setup};
use crate::wire::Dialect;

mod parse;

/// Runs virtual controllers.
///
/// They behave as the manual says: accept and reply codes, the queue of moves, resets, emergency stop, outputs,
/// registers. They run until Ctrl-C or SIGTERM, which end them with 0.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue sim                                        one controller of three axes at 127.0.0.1:7408
  kinocue sim --count 4 --axes 6 --json              four of six axes at ports 7408 to 7411, counts at the end
  kinocue sim --loss 0.05 --delay 80ms --seed 7      one frame in twenty unanswered, the other answers late
  kinocue sim --axes 6 --pa 95=6 --log frames.csv    takes axes 7 to 12 of a shared frame, and logs it")]
pub(super) struct Args {
    /// Where the first controller listens; with port 0 each gets a free one
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:7408")]
    listen: SocketAddrV4,

    /// How many controllers, at consecutive ports
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1000))]
    count: u16,

    /// Working axes of each (PA02), 1 to 12
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=12))]
    axes: u16,

    /// A parameter: register in hex, value decimal or 0x; may be given again
    #[arg(long = "pa", value_name = "HEX=VALUE", value_parser = parse::parameter)]
    parameters: Vec<(u8, u16)>,

    /// Which family they belong to
    #[arg(long, value_enum, default_value_t = Family::Smc)]
    dialect: Family,

    /// Chance that a datagram goes unanswered, 0..1: half of those never arrive, of the others the answer is lost
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = parse::chance)]
    loss: f64,

    /// Chance that an answer comes twice, 0..1
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = parse::chance)]
    duplicate: f64,

    /// How much later answers leave: 80ms, 1.5s
    #[arg(long, value_name = "SPAN", default_value = "0ms", value_parser = parse::span)]
    delay: Duration,

    /// Obey, but never answer
    #[arg(long)]
    mute: bool,

    /// An emergency stop is in effect from then on, counted from the start: SS[.mmm], MM:SS, HH:MM:SS
    #[arg(long, value_name = "TIME", value_parser = parse::time)]
    estop_at: Option<Duration>,

    /// What chance begins with [default: one that is told]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// The port that frames must come from (PA24); 0 takes any
    #[arg(long, value_name = "PORT", default_value_t = 8410)]
    host_port: u16,

    /// Write a CSV row for each motion frame: what was commanded, and where the motors were
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,

    /// At the end, one JSON object with all counts on the standard output
    #[arg(long)]
    json: bool,

    /// Listen on addresses that other machines reach, too
    #[arg(long)]
    allow_lan: bool,
}

/// A family of controllers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Family {
    Smc,
    Mbox,
}

impl From<Family> for Dialect {
    fn from(family: Family) -> Self {
        match family {
            Family::Smc => Self::Smc,
            Family::Mbox => Self::Mbox,
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    if !args.listen.ip().is_loopback() && !args.allow_lan {
        let address = args.listen;
        let refusal =
            anyhow!("{address} is not of this machine alone; give --allow-lan to listen there all the same");
        return Err(refusal).or_exit(Exit::Usage);
    }
    let signals = Signals::catch().context("cannot wait for Ctrl-C and SIGTERM").or_exit(Exit::System)?;
    let farm = Farm::start(options(args)?).or_exit(Exit::System)?;
    for address in farm.addresses() {
        tell(&format!("ready {address}"));
    }
    signals.wait().context("cannot wait for Ctrl-C and SIGTERM").or_exit(Exit::System)?;
    let outcomes = farm.stop().context("cannot finish the log").or_exit(Exit::Io)?;
    report(&outcomes, args.json).context("cannot write to the standard output").or_exit(Exit::Io)?;
    Ok(Exit::Done)
}

fn options(args: &Args) -> Result<Options, Failure> {
    let setup = Setup {
        axes: args.axes,
        parameters: args.parameters.clone(),
        host_port: args.host_port,
        dialect: args.dialect.into(),
        mute: args.mute,
        estop_at: args.estop_at,
    };
    let log = match &args.log {
        Some(path) => {
            // It is emptied only once the ports are ours: a second sim must not wipe the log of the first.
            let file = File::options().write(true).create(true).truncate(false).open(path);
            let file = file.with_context(|| format!("cannot write the log {}", path.display()));
            Some(file.or_exit(Exit::Io)?)
        }
        None => None,
    };
    Ok(Options {
        listen: args.listen,
        controllers: vec![setup; usize::from(args.count)],
        faults: LinkFaults { loss: args.loss, duplicate: args.duplicate, delay: args.delay },
        seed: seed(args),
        log,
    })
}

/// The seed that was given, or one that is told so that it can be given again.
fn seed(args: &Args) -> u64 {
    args.seed.unwrap_or_else(|| {
        let seed = u64::from(std::process::id());
        if args.loss > 0.0 || args.duplicate > 0.0 {
            tell(&format!("seed {seed}"));
        }
        seed
    })
}

fn report(outcomes: &[Outcome], json: bool) -> std::io::Result<()> {
    if json {
        let all = serde_json::json!({ "controllers": outcomes });
        return writeln!(std::io::stdout(), "{all}");
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

/// Writes a line to the standard error output; that may be closed, which is no reason to stop.
fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Ctrl-C and SIGTERM as an octet on a socket, which a thread can wait for.
struct Signals(UnixStream);

impl Signals {
    fn catch() -> std::io::Result<Self> {
        let (wait, write) = UnixStream::pair()?;
        signal_hook::low_level::pipe::register(SIGINT, write.try_clone()?)?;
        signal_hook::low_level::pipe::register(SIGTERM, write)?;
        Ok(Self(wait))
    }

    fn wait(mut self) -> std::io::Result<()> {
        self.0.read_exact(&mut [0])
    }
}
