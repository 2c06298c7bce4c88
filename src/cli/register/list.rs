//! `kinocue register list`: the one table of registers, printed.

use comfy_table::{CellAlignment, Table};
use serde::Serialize;

use super::drives::{self, DriveRegister, DriveRegisters};
use crate::cli::{Exit, Failure, OrExit as _, print, table};
use crate::device::{Family, Flags, Register, selections, table};

/// Lists the registers that the manuals document: unit, range, default, dialect, whether they are saved, and the meaning of
/// their values.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kinocue register list\n  kinocue register list PA90..98 dpf0\n  kinocue \
                        register list R0..40 R200..211\n  kinocue register list --json"
)]
pub(super) struct Args {
    /// Registers, or ranges of them [default: all].
    #[arg(value_name = "REGISTER")]
    registers: Vec<String>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Listing {
    registers: Vec<&'static Register>,
    /// Of serial drives.
    drives: Vec<DriveRegister>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let (rest, of_drives) = drives::take(&args.registers).or_exit(Exit::Usage)?;
    let (registers, of_drives) = if rest.is_empty() && !of_drives.is_empty() {
        (Vec::new(), of_drives)
    } else {
        let selections = selections(&rest).or_exit(Exit::Usage)?;
        let addresses = selections.iter().flat_map(|selection| &selection.addresses);
        let registers = addresses.filter_map(|address| table().get(*address)).collect();
        (registers, if args.registers.is_empty() { DriveRegisters::all() } else { of_drives })
    };
    let drives = of_drives.rows();
    if args.json {
        print::json(&Listing { registers, drives })?;
        return Ok(Exit::Done);
    }
    if !registers.is_empty() {
        print::out(&format!("{}\n", text(&registers)))?;
    }
    if !drives.is_empty() {
        print::out(&format!("{}\n", text_of_drives(&drives)))?;
    }
    Ok(Exit::Done)
}

fn text(registers: &[&Register]) -> Table {
    let mut table = table::bare();
    table.set_header([
        "register", "name", "unit", "range", "IMAX", "SMC", "dialect", "saved", "notes", "manual", "meaning",
    ]);
    for register in registers {
        let default = |value: Option<u16>| value.map_or_else(|| "-".to_owned(), |value| value.to_string());
        table.add_row([
            register.address.to_string(),
            register.name.clone(),
            register.unit.to_owned(),
            format!("{}..={}", register.min, register.max),
            default(register.default_imax),
            default(register.default_smc),
            dialect(register.dialect).to_owned(),
            if register.saved { "yes" } else { "no" }.to_owned(),
            notes(register.flags),
            register.source.to_owned(),
            register.meaning.to_owned(),
        ]);
    }
    for column in table.column_iter_mut().skip(4).take(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn text_of_drives(drives: &[DriveRegister]) -> Table {
    let mut table = table::bare();
    table.set_header(["register", "dialect", "name"]);
    for one in drives {
        table.add_row([&one.register, one.dialect, one.name]);
    }
    table
}

const fn dialect(family: Family) -> &'static str {
    match family {
        Family::Both => "both",
        Family::Smc => "smc",
        Family::Mbox => "mbox",
    }
}

fn notes(flags: Flags) -> String {
    let Flags { network, identity: _, factory, moves, command: _, never } = flags;
    let notes = [
        (network, "network: --force"),
        (factory, "factory reset: --force"),
        (moves, "moves the seat"),
        (never, "read only"),
    ];
    notes.iter().filter(|(is, _)| *is).map(|(_, note)| *note).collect::<Vec<_>>().join(", ")
}
