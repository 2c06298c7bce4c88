//! `kinocue register read`.

use anyhow::anyhow;
use comfy_table::{CellAlignment, Table};
use serde::Serialize;

use super::drives::{self, DriveFound, DriveRegisters, DriveValue};
use super::{Found, read_values};
use crate::cli::targets::{DrivenTargets, TargetArgs, Targets, Troubles};
use crate::cli::{Exit, Failure, OrExit as _, print, table};
use crate::config::{Controller, Station};
use crate::device::change::dialect_name;
use crate::device::{Address, Selection, selections, settings::Values, table};
use crate::wire::{DP_POSITIONS, position};

/// Reads registers of controllers: PA, DP, DPF0 to DPFF, and those of the servo drives.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue register read PA95 --to 127.0.0.1:7408
  kinocue register read pa 0x90..98 dp 06..0b dpf0 --config examples/hall.toml --row A
  kinocue register read servo 1 508..511 --config examples/hall.toml --name A1
  kinocue register read R0 R1 R38..40 --config examples/silvermax.toml --name A1      SilverMax units
  kinocue register read '$20' '$43' --config examples/sixpack2.toml --name A1        a SIXpack 2
  kinocue register read --config examples/hall.toml --json")]
pub(super) struct Args {
    /// What to read: PA95, pa 0x95, dp 06..0b, dpf0, axis-offset, servo 1 508, R38, $20 [default: all PA and DP, and all
    /// that can be read of drives].
    #[arg(value_name = "REGISTER")]
    registers: Vec<String>,
    #[command(flatten)]
    targets: TargetArgs,
    /// The controller of this name; repeatable.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let (rest, of_drives) = drives::take(&args.registers).or_exit(Exit::Usage)?;
    let (targets, driven) = args.targets.resolve_all(&args.name)?;
    let of_drives = if args.registers.is_empty() { DriveRegisters::all() } else { of_drives };
    let driven = drives::asked(driven, &of_drives);
    let is_asked = args.registers.is_empty() || !rest.is_empty();
    let targets = Targets { controllers: if is_asked { targets.controllers } else { Vec::new() }, ..targets };
    if targets.controllers.is_empty() && driven.controllers.is_empty() {
        let why = "none of these controllers has such registers: PA and DP are of controllers on the network, R0 to R211 of \
                   SilverMax units, $20, $30 and $43 of a SIXpack 2";
        return Err(anyhow!(why)).or_exit(Exit::Usage);
    }
    let mut troubles = Troubles::default();
    let found = if targets.controllers.is_empty() {
        Vec::new()
    } else {
        let selections = selections(&rest).or_exit(Exit::Usage)?;
        let wanted: Vec<Vec<Address>> = (targets.controllers.iter())
            .map(|controller| wanted(&selections, controller))
            .collect::<Result<_, _>>()
            .or_exit(Exit::Usage)?;
        read_values(&mut targets.open()?, &targets, &wanted, &mut troubles)
    };
    let on_links = drives::read(&driven, &of_drives, &mut troubles)?;
    if args.json {
        print::json(&ReadReport::new((&targets, &found), (&driven, &on_links)))?;
        return Ok(troubles.exit());
    }
    if found.iter().any(|one| !one.values.is_empty()) {
        print::out(&format!("{}\n", text(&targets, &found)))?;
    }
    if on_links.iter().any(|one| !one.values.is_empty()) {
        print::out(&format!("{}\n", text_of_drives(&driven, &on_links)))?;
    }
    Ok(troubles.exit())
}

/// The registers that a controller is asked for: of ranges, those that its dialect has.
fn wanted(selections: &[Selection], controller: &Controller<Station>) -> anyhow::Result<Vec<Address>> {
    let dialect = controller.connection.dialect;
    let has = |address: &Address| table().has(*address, dialect);
    let mut wanted = Vec::new();
    for selection in selections {
        if let Some(first) = selection.addresses.first().filter(|_| !selection.addresses.iter().any(has)) {
            let (name, dialect) = (&controller.name, dialect_name(dialect));
            let what = if selection.single { "is not a register" } else { "and on are no registers" };
            return Err(anyhow!("{first} {what} of {dialect} controllers, as {name} is one"));
        }
        wanted.extend(selection.addresses.iter().copied().filter(has));
    }
    Ok(wanted)
}

#[derive(Serialize)]
struct ReadReport<'a> {
    controllers: Vec<ControllerRegisters<'a>>,
    /// Seats on serial links.
    drives: Vec<SeatRegisters<'a>>,
}

#[derive(Serialize)]
struct SeatRegisters<'a> {
    name: &'a str,
    address: String,
    dialect: &'static str,
    registers: &'a [DriveValue],
    faults: &'a [String],
}

#[derive(Serialize)]
struct ControllerRegisters<'a> {
    name: &'a str,
    address: String,
    dialect: &'static str,
    /// Null where it is the normal one, or the controller did not answer.
    state: Option<&'a str>,
    registers: Vec<RegisterRow>,
    faults: &'a [String],
}

#[derive(Serialize)]
struct RegisterRow {
    register: Address,
    name: &'static str,
    value: u16,
    unit: &'static str,
    says: Option<String>,
}

impl<'a> ReadReport<'a> {
    fn new(
        (targets, found): (&'a Targets, &'a [Found]),
        (driven, on_links): (&'a DrivenTargets, &'a [DriveFound]),
    ) -> Self {
        let one = |(controller, found): (&'a Controller<Station>, &'a Found)| ControllerRegisters {
            name: &controller.name,
            address: controller.connection.address.to_string(),
            dialect: dialect_name(controller.connection.dialect),
            state: found.state.as_deref(),
            registers: registers(controller, &found.values),
            faults: &found.faults,
        };
        let of_drives = |(controller, found): (&'a Controller, &'a DriveFound)| SeatRegisters {
            name: &controller.name,
            address: controller.address(),
            dialect: controller.drives().map_or("", |drives| drives.motors.family().word()),
            registers: &found.values,
            faults: &found.faults,
        };
        Self {
            controllers: targets.controllers.iter().zip(found).map(one).collect(),
            drives: driven.controllers.iter().zip(on_links).map(of_drives).collect(),
        }
    }
}

fn registers(controller: &Controller<Station>, values: &Values) -> Vec<RegisterRow> {
    let one = |(&address, &value)| {
        let register = table().get(address);
        RegisterRow {
            register: address,
            name: register.map_or("", |register| register.name.as_str()),
            value,
            unit: register.map_or("", |register| register.unit),
            says: says(controller, values, address, value),
        }
    };
    values.iter().map(one).collect()
}

/// What a value means in words; for the first word of a position, the position.
fn says(controller: &Controller<Station>, values: &Values, address: Address, value: u16) -> Option<String> {
    if let Address::Dp(number) = address
        && DP_POSITIONS.contains(&u16::from(number))
    {
        let second = values.get(&address.after(1)?)?;
        return Some(format!("position {}", position([value, *second], controller.connection.dialect).0));
    }
    table().get(address)?.says(value).map(str::to_owned)
}

fn text(targets: &Targets, found: &[Found]) -> Table {
    let mut table = table::bare();
    table.set_header(["controller", "register", "value", "unit", "name", "meaning"]);
    for (controller, one) in targets.controllers.iter().zip(found) {
        for register in registers(controller, &one.values) {
            table.add_row([
                controller.name.clone(),
                register.register.to_string(),
                register.value.to_string(),
                register.unit.to_owned(),
                register.name.to_owned(),
                register.says.unwrap_or_default(),
            ]);
        }
    }
    aligned(table)
}

fn text_of_drives(driven: &DrivenTargets, found: &[DriveFound]) -> Table {
    let mut table = table::bare();
    table.set_header(["controller", "register", "value", "name", "meaning"]);
    for (controller, one) in driven.controllers.iter().zip(found) {
        for DriveValue { register, name, value, says } in &one.values {
            let says = says.clone().unwrap_or_default();
            table.add_row([controller.name.clone(), register.clone(), value.to_string(), name.clone(), says]);
        }
    }
    aligned(table)
}

/// With the values at the right of their column.
fn aligned(mut table: Table) -> Table {
    for column in table.column_iter_mut().skip(2).take(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
