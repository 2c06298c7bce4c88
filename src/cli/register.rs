//! `kinocue register`.

use std::collections::BTreeMap;

use super::targets::{Targets, Troubles, state};
use super::{Exit, Failure, print};
use crate::device::{Address, Patience, Request, Talk, reads, settings::Values};

mod diff;
mod drives;
mod list;
mod read;
mod save;
mod write;

const EXAMPLES: &str = "\
Examples:
  kinocue register list PA90..98
  kinocue register read PA95 dp 06..0b --to 127.0.0.1:7408
  kinocue register write PA95=6 --to 127.0.0.1:7408 --keep
  kinocue register save hall-settings.toml --config examples/hall.toml
  kinocue register diff hall-settings.toml --config examples/hall.toml --name A1

Registers are named as the manuals name them (PA95, pa 0x95, dp 06..0b, dpf0, servo 1 508),
as the panel of an integrated controller shows them (CP149, cd 006..011), or by their names in
`kinocue register list`. Numbers of PA and DP are hexadecimal, those of CP and CD decimal;
values are decimal, or hexadecimal with 0x.

Seats on serial drives are read over their port, which the service must not have open at the same time: registers of
SilverMax units as R38 or R0..40, in decimal; queries of a SIXpack 2 as '$20' or '$43'. Drives cannot be written here.";

/// Reads, writes, saves and compares the registers of controllers.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    #[command(subcommand)]
    command: RegisterCommand,
}

#[derive(Debug, clap::Subcommand)]
enum RegisterCommand {
    List(list::Args),
    Read(read::Args),
    Write(write::Args),
    Save(save::Args),
    Diff(diff::Args),
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    match &args.command {
        RegisterCommand::List(args) => list::run(args),
        RegisterCommand::Read(args) => read::run(args),
        RegisterCommand::Write(args) => write::run(args),
        RegisterCommand::Save(args) => save::run(args),
        RegisterCommand::Diff(args) => diff::run(args),
    }
}

/// What one controller's registers hold, as far as it told.
#[derive(Debug, Default, Clone)]
struct Found {
    values: Values,
    /// Its state, where it is not the normal one.
    state: Option<String>,
    faults: Vec<String>,
}

/// Reads `wanted` of each controller, all at once; tells of faults and of controllers in trouble.
fn read_values(
    talk: &mut Talk,
    targets: &Targets,
    wanted: &[Vec<Address>],
    troubles: &mut Troubles,
) -> Vec<Found> {
    let requests: Vec<(usize, Request)> = (wanted.iter().enumerate())
        .flat_map(|(lane, addresses)| reads(addresses).into_iter().map(move |read| (lane, read)))
        .collect();
    let mut found = vec![Found::default(); targets.controllers.len()];
    for outcome in talk.ask(requests, Patience::default()) {
        let lane = outcome.lane;
        match troubles.sort(targets, outcome) {
            Ok((request, answer)) => {
                found[lane].values.extend(values(&request, &answer.words));
                found[lane].state = state(&targets.controllers[lane], &answer);
            }
            Err(line) => found[lane].faults.push(line),
        }
    }
    for (lane, one) in found.iter().enumerate() {
        if let Some(state) = &one.state {
            print::tell(&format!("kinocue: {}: {state}", targets.name(lane)));
        }
    }
    found
}

/// The registers of a read with the words of its answer.
fn values(request: &Request, words: &[u16]) -> BTreeMap<Address, u16> {
    let addresses = (0..).map_while(|step| request.first().after(step));
    addresses.zip(words.iter().copied()).collect()
}
