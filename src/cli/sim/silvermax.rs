//! `kinocue sim --dialect silvermax`.

use std::path::Path;

use anyhow::{Context as _, bail};
use serde_json::{Value, json};

use super::tty::{self, Drives};
use super::{Args, SignalSocket, parse};
use crate::cli::{Exit, Failure};
use crate::sim::serial::Deed;
use crate::sim::silvermax::{Action, SilverBus, UnitSetup};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Bits a second unless others are named (command reference, page 67).
const WAKING_BAUD: u32 = 57_600;
/// Of an axis of them: 4,000 counts a turn, at a lead of 5 mm.
const COUNTS_A_MM: f64 = 800.0;

/// Runs units until a signal comes.
pub(super) fn run(args: &Args, path: &Path, signals: SignalSocket) -> Result<Exit, Failure> {
    let units = args.tty.units::<SilverBus>();
    let setups: Vec<UnitSetup> = units.into_iter().map(UnitSetup::new).collect();
    let bus = SilverBus::new(&setups, args.tty.baud.unwrap_or(WAKING_BAUD), Monotonic.now());
    tty::run(bus, args, path, signals)
}

impl Drives for SilverBus {
    const BITS: u32 = 11;
    const ALONE: u8 = 16;

    fn deed(unit: Option<u8>, name: &str, value: Option<&str>) -> anyhow::Result<Deed<Self>> {
        let action = action(name, value)?;
        Ok(Box::new(move |line, now| line.bus_mut().act(unit, action, now)))
    }

    fn report(&self) -> (Value, Vec<String>) {
        let units: Vec<Value> = self.units().iter().map(unit).collect();
        let lines = self.units().iter().map(|unit| {
            let (tally, executed) = (unit.tally(), unit.executed());
            format!(
                "unit {}  requests {}  refused {}  segments {}  queue full {}  dry {}  killed {}  position {}  \
                 executed {:.0} to {:.0} counts from the lower stop  jumps {}",
                unit.number(),
                tally.requests,
                tally.refused,
                tally.segments,
                tally.full,
                tally.dry,
                tally.kills,
                unit.position(),
                executed.lowest,
                executed.highest,
                executed.jumps,
            )
        });
        (json!({ "units": units }), lines.collect())
    }
}

fn unit(unit: &crate::sim::silvermax::Unit) -> Value {
    let (tally, executed) = (unit.tally(), unit.executed());
    json!({
        "unit": unit.number(),
        "requests": tally.requests,
        "refused": tally.refused,
        "segments": tally.segments,
        "queue_full": tally.full,
        "dry": tally.dry,
        "kills": tally.kills,
        "resets": tally.resets,
        "forbidden": tally.forbidden,
        "position": unit.position(),
        "target": unit.target(),
        "place": unit.place(),
        "executed": {
            "lowest": executed.lowest,
            "highest": executed.highest,
            "velocity_per_s": executed.velocity,
            "acceleration_per_s2": executed.acceleration,
            "jerk_per_s3": executed.jerk,
            "jumps": executed.jumps,
            "farthest_jump": executed.farthest_jump,
        },
    })
}

const COMMANDS: &str = "commands of a unit are reset, hot=1, blocked=1, pushed=0.6, dead=1, X2=0, as=16 and ppm=200, those of the line \
                        lost, doubled, flipped, late, answer_lost, lose, noise, held, echo, unplug and break";

fn action(name: &str, value: Option<&str>) -> anyhow::Result<Action> {
    let Some(value) = value else {
        return if name == "reset" {
            Ok(Action::Reset)
        } else {
            bail!("{name:?} is not a command; {COMMANDS}")
        };
    };
    Ok(match (name, name.strip_prefix(['X', 'x'])) {
        ("hot", _) => Action::Hot(parse::switch(value)?),
        ("blocked", _) => Action::Blocked(parse::switch(value)?),
        ("pushed", _) => {
            let mm = value.parse().ok().filter(|mm: &f64| mm.abs() <= 50.0).context("not -50 to 50 mm")?;
            #[expect(clippy::cast_possible_truncation, reason = "some thousand counts")]
            Action::Pushed((mm * COUNTS_A_MM).round() as i32)
        }
        ("dead", _) => Action::Dead(parse::switch(value)?),
        ("as", _) => {
            let other: u8 = value.parse().context("not the number of a unit, or 0")?;
            Action::AnswersAs((other > 0).then_some(other))
        }
        ("ppm", _) => {
            let ppm = value.parse().ok().filter(|ppm: &i32| ppm.abs() <= 10_000);
            Action::Crystal(ppm.context("not -10000 to 10000 millionths")?)
        }
        (_, Some(input)) => {
            let input = input.parse().ok().filter(|input| (1..=7).contains(input));
            let input = input.with_context(|| format!("{name:?} is not an input; they are X1 to X7"))?;
            Action::Input { input, is_high: parse::switch(value)? }
        }
        _ => bail!("{name:?} is not a command; {COMMANDS}"),
    })
}
