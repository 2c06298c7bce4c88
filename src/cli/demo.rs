//! `kinocue demo`: the main job with nothing to set up.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::Path;

use super::play::play;
use super::{Exit, Failure, OrExit as _, print};
use crate::config::{Config, from_to_args};
use crate::cue::{self, Source};
use crate::engine::{Rate, Show};
use crate::fanout::Manner;
use crate::sim::{Farm, Options, Setup, pa};
use crate::time::ShowTime;
use crate::timeline::Timeline;
use crate::wire::Timing;

const CUE_NAME: &str = "cues/bench-ride.csv";
const CUE: &[u8] = include_bytes!("../../cues/bench-ride.csv");

/// The virtual seats: two with all three axes, and a pair that shares one frame, each taking its own window by PA95.
const SEATS: [Seat; 4] = [
    Seat { name: "A1", axes: 3, offset: 0, fan_out: "slice" },
    Seat { name: "A2", axes: 3, offset: 0, fan_out: "slice" },
    Seat { name: "B1", axes: 2, offset: 0, fan_out: "shared" },
    Seat { name: "B2", axes: 1, offset: 2, fan_out: "shared" },
];

struct Seat {
    name: &'static str,
    axes: u16,
    offset: u16,
    fan_out: &'static str,
}

/// Plays the bench ride to four virtual controllers, with nothing to set up, and reports what became of every frame.
///
/// Two of the controllers are a pair that shares one frame (PA95). Everything stays on this machine.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  kinocue demo\n  kinocue demo --rate 1000 --json > report.json")]
pub(super) struct Args {
    /// Ticks per second, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = super::load::parse_rate, default_value = "100")]
    rate: f64,
    /// Print the report as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let cue = cue::read(Path::new(CUE_NAME), CUE, &Source::Native).or_exit(Exit::Internal)?;
    let timeline = Timeline::new(cue);
    let farm =
        Farm::start(Options::loopback(SEATS.iter().map(Seat::setup).collect())).or_exit(Exit::System)?;
    let mut config = hall(&farm.addresses(), timeline.cue().axes())?;
    config.show.bind = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);
    let controllers: Vec<String> =
        config.controllers.iter().map(|one| format!("{} {}", one.name, one.address)).collect();
    let (length, controllers) = (timeline.duration(), controllers.join(", "));
    print::tell(&format!("playing {CUE_NAME} ({length}) to virtual controllers {controllers}"));
    let show =
        Show { rate: Rate::from_hz(args.rate), timing: Timing::Relative, start: ShowTime::ZERO, plays: 1 };
    let played = play(config, timeline, show, Manner { level: 1.0, silent: false }, args.json);
    farm.stop().or_exit(Exit::Io)?;
    played
}

impl Seat {
    fn setup(&self) -> Setup {
        Setup {
            axes: self.axes,
            parameters: vec![(pa::OFFSET, self.offset)],
            host_port: 0,
            ..Setup::default()
        }
    }
}

fn hall(addresses: &[SocketAddrV4], cue_axes: usize) -> Result<Config, Failure> {
    let to = |(seat, address): (&Seat, &SocketAddrV4)| {
        let Seat { name, axes, offset, fan_out } = seat;
        format!("{address},name={name},axes={axes},offset={offset},fan_out={fan_out}")
    };
    let tos: Vec<String> = SEATS.iter().zip(addresses).map(to).collect();
    from_to_args(&tos, &[], cue_axes).or_exit(Exit::Internal)
}
