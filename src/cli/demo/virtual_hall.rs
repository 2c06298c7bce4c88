//! What moves the seats of the demo, all of it virtual: controllers on the network, or drives at the far ends of lines.

use std::net::SocketAddrV4;

use anyhow::Context as _;

use super::seats::{DRIVEN, SEATS, SILVERMAX, SIXPACK2, driven, port};
use crate::cli::sim::{Drives, SimFamily};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::sim::serial::{LineFaults, PtyError, PtyLoop, SerialLine};
use crate::sim::silvermax::{SilverBus, UnitSetup};
use crate::sim::sixpack2::{MOTORS, ShaftSetup, SixpackBus, SixpackSetup};
use crate::sim::{Farm, Options};
use crate::sys::clock::Monotonic;
use crate::sys::own_folder::OwnFolder;
use crate::time::Clock as _;
use crate::wire::Dialect;

/// Bits a second of a SilverMax; a SIXpack 2 is switched by its host.
const SILVERMAX_BAUD: u32 = 115_200;
/// Microsteps a millimetre of the shafts.
const MICROSTEPS: f64 = 640.0;
/// The speed that motors of a SIXpack 2 take at once, mm/s: steps are lost above it. Their seat is led by less than half of that, since
/// a target that this machine sends late makes a greater jump than was proved.
const JUMP_MM_S: f64 = 150.0;

/// What runs; it ends where this is dropped.
pub(super) enum VirtualHall {
    /// Controllers.
    Stations(Dialect, Farm),
    /// Lines with three units each.
    SilverMax(Vec<PtyLoop<SilverBus>>),
    /// Lines with a unit of six motors each.
    Sixpack2(Vec<PtyLoop<SixpackBus>>),
}

impl VirtualHall {
    /// Starts what this family has: controllers that answer to `host`, or drives on lines in `folder`.
    pub(super) fn start(family: SimFamily, host: SocketAddrV4, folder: &OwnFolder) -> Result<Self, Failure> {
        let farm = |dialect| {
            let setups = SEATS.iter().map(|seat| seat.setup(host, dialect)).collect();
            Farm::start(Options::loopback(setups)).map(|farm| Self::Stations(dialect, farm)).or_system()
        };
        let now = Monotonic.now();
        match family {
            SimFamily::Smc => farm(Dialect::Smc),
            SimFamily::Mbox => farm(Dialect::Mbox),
            SimFamily::Silvermax => {
                let units = [16, 17, 18].map(UnitSetup::new);
                lines(folder, || SilverBus::new(&units, SILVERMAX_BAUD, now)).map(Self::SilverMax)
            }
            SimFamily::Sixpack2 => {
                let shaft = ShaftSetup { jump: JUMP_MM_S * MICROSTEPS, ..ShaftSetup::default() };
                let setup = SixpackSetup {
                    unit: 1,
                    serial: 1_001,
                    shafts: [shaft; MOTORS],
                    is_two_wires: false,
                    can_baud: None,
                };
                lines(folder, || SixpackBus::waking([setup], now)).map(Self::Sixpack2)
            }
        }
    }

    /// The seats as the configuration has them.
    pub(super) fn tables(&self, folder: &OwnFolder) -> String {
        let stations = |dialect: &str, farm: &Farm| {
            let all = SEATS.iter().zip(farm.addresses());
            all.map(|(seat, address)| seat.tables(address, dialect)).collect()
        };
        match self {
            Self::Stations(Dialect::Smc, farm) => stations("smc", farm),
            Self::Stations(Dialect::Mbox, farm) => stations("mbox", farm),
            Self::SilverMax(_) => driven(folder, SILVERMAX),
            Self::Sixpack2(_) => driven(folder, SIXPACK2),
        }
    }

    /// Who is played to, in words.
    pub(super) fn who(&self) -> String {
        let stations = |farm: &Farm| {
            let all = SEATS.iter().zip(farm.addresses());
            all.map(|(seat, address)| format!("{} {address}", seat.name)).collect::<Vec<_>>().join(", ")
        };
        match self {
            Self::Stations(_, farm) => format!("virtual controllers {}", stations(farm)),
            Self::SilverMax(_) => format!("virtual SilverMax units of seats {}", DRIVEN.join(", ")),
            Self::Sixpack2(_) => format!("one virtual SIXpack 2 for each of seats {}", DRIVEN.join(", ")),
        }
    }

    /// Seats on drives know their places only once a person had them homed.
    pub(super) const fn needs_home(&self) -> bool {
        !matches!(self, Self::Stations(..))
    }

    /// True if a cue may vibrate on it.
    pub(super) const fn vibrates(&self) -> bool {
        matches!(self, Self::Stations(Dialect::Smc, _))
    }

    /// Ends it, and tells what virtual drives were made to do.
    pub(super) fn stop(self) -> Result<(), Failure> {
        match self {
            Self::Stations(_, farm) => farm.stop().map(drop).or_exit(Exit::Io)?,
            Self::SilverMax(lines) => tell_executed(lines),
            Self::Sixpack2(lines) => tell_executed(lines),
        }
        Ok(())
    }
}

/// A line for each seat, with a link to it in the folder.
fn lines<B: Drives>(folder: &OwnFolder, bus: impl Fn() -> B) -> Result<Vec<PtyLoop<B>>, Failure> {
    let line = |name: &&str| -> Result<_, PtyError> {
        let line = SerialLine::new(bus(), B::BITS, LineFaults::default(), 0);
        PtyLoop::start(line, &port(folder, name), Vec::new())
    };
    let lines: Result<_, _> = DRIVEN.iter().map(line).collect();
    lines.context("no lines for the virtual drives").or_system()
}

fn tell_executed<B: Drives>(lines: Vec<PtyLoop<B>>) {
    for (seat, line) in DRIVEN.iter().zip(lines) {
        let (_, words) = line.stop().bus().report();
        words.iter().for_each(|words| print::tell(&format!("{seat}: {words}")));
    }
}
