//! `kinocue sim --dialect sixpack2`.

use std::path::Path;

use anyhow::{Context as _, anyhow, bail};
use serde_json::{Value, json};

use super::tty::{self, Drives};
use super::{Args, SignalSocket, parse};
use crate::cli::{Exit, Failure, OrExit as _};
use crate::sim::serial::Deed;
use crate::sim::sixpack2::{
    MOTORS, ShaftSetup, SixpackBus, SixpackFault, SixpackMotor, SixpackSetup, SixpackUnit,
};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Runs units until a signal comes.
pub(super) fn run(args: &Args, path: &Path, signals: SignalSocket) -> Result<Exit, Failure> {
    if args.tty.baud.is_some() {
        let refusal = anyhow!("a SIXpack 2 starts at 19200 baud, and its host changes that; omit --baud");
        return Err(refusal).or_exit(Exit::Usage);
    }
    let shafts = [ShaftSetup::default(); MOTORS];
    let setup = |unit: u8| SixpackSetup {
        unit,
        serial: 1_000 + u16::from(unit),
        shafts,
        is_two_wires: false,
        can_baud: None,
    };
    let units = args.tty.units::<SixpackBus>();
    let bus = SixpackBus::waking(units.into_iter().map(setup), Monotonic.now());
    tty::run(bus, args, path, signals)
}

impl Drives for SixpackBus {
    const BITS: u32 = 10;
    const ALONE: u8 = 1;

    fn deed(unit: Option<u8>, name: &str, value: Option<&str>) -> anyhow::Result<Deed<Self>> {
        let fault = fault(name, value)?;
        Ok(Box::new(move |line, now| line.bus_mut().suffer(unit, fault, now)))
    }

    fn report(&self) -> (Value, Vec<String>) {
        let units: Vec<Value> = self.units().iter().map(unit).collect();
        (json!({ "units": units }), self.units().iter().map(line).collect())
    }
}

fn line(unit: &SixpackUnit) -> String {
    let (books, motors) = (unit.books, &unit.motors);
    let searches: u32 = motors.iter().map(|motor| motor.own_searches).sum();
    let lost = motors.iter().map(|motor| motor.shaft.executed().lost).fold(0.0, f64::max);
    let jump = motors.iter().map(|motor| motor.shaft.executed().jump).fold(0.0, f64::max);
    format!(
        "unit {}  frames {}  unknown {}  stray octets {}  settings while moving {}  searches by itself {}  \
         greatest jump {jump:.0} microsteps/s  most lost {lost:.0} microsteps",
        unit.number(),
        books.frames,
        books.unknown + books.no_motor,
        unit.strays(),
        books.settings_in_motion,
        searches,
    )
}

fn unit(unit: &SixpackUnit) -> Value {
    let books = unit.books;
    let motors: Vec<Value> = unit.motors.iter().map(motor).collect();
    json!({
        "unit": unit.number(),
        "baud": unit.baud(),
        "frames": books.frames,
        "unknown": books.unknown,
        "no_motor": books.no_motor,
        "left_alone": books.left_alone,
        "settings_in_motion": books.settings_in_motion,
        "stray_octets": unit.strays(),
        "motors": motors,
    })
}

fn motor(motor: &SixpackMotor) -> Value {
    let executed = motor.shaft.executed();
    json!({
        "position": motor.position(),
        "action": motor.action(),
        "own_searches": motor.own_searches,
        "place": motor.shaft.place(),
        "executed": {
            "lowest": executed.lowest,
            "highest": executed.highest,
            "velocity_per_s": executed.velocity,
            "jump_per_s": executed.jump,
            "acceleration_per_s2": executed.acceleration,
            "jerk_per_s3": executed.jerk,
            "lost": executed.lost,
        },
    })
}

const COMMANDS: &str = "commands of a unit are reset, dead=1, celsius=80, volts=51, jump=14400, blocked2=1 and broken2=1, \
                        those of the line lost, doubled, flipped, late, answer_lost, lose, noise, held, echo, unplug and break";

fn fault(name: &str, value: Option<&str>) -> anyhow::Result<SixpackFault> {
    let Some(value) = value else {
        return if name == "reset" {
            Ok(SixpackFault::Reset)
        } else {
            bail!("{name:?} is not a command; {COMMANDS}")
        };
    };
    let of_motor = |words: &str| name.strip_prefix(words).map(motor_number).transpose();
    Ok(match name {
        "dead" => SixpackFault::Dead(parse::switch(value)?),
        "celsius" => SixpackFault::Celsius(value.parse().context("not -128 to 127 °C")?),
        "volts" => SixpackFault::Volts(value.parse().context("not 0 to 255 volts")?),
        "jump" => {
            let jump = value.parse().ok().filter(|jump: &f64| *jump >= 0.0);
            SixpackFault::Jump(jump.context("not a number of microsteps a second")?)
        }
        _ => match (of_motor("blocked")?, of_motor("broken")?) {
            (Some(motor), _) => SixpackFault::Block { motor, is_blocked: parse::switch(value)? },
            (_, Some(motor)) => SixpackFault::BreakSwitch { motor, is_broken: parse::switch(value)? },
            _ => bail!("{name:?} is not a command; {COMMANDS}"),
        },
    })
}

fn motor_number(text: &str) -> anyhow::Result<usize> {
    let number = text.parse().ok().filter(|number| *number < MOTORS);
    number.with_context(|| format!("{text:?} is not a motor; they are 0 to {}", MOTORS - 1))
}
