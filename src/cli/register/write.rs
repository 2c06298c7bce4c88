//! `kinocue register write`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context as _, anyhow};
use comfy_table::{CellAlignment, Table};
use serde::Serialize;

use super::{diff, read_values};
use crate::cli::ask::agreed;
use crate::cli::targets::{TargetArgs, Targets, Troubles};
use crate::cli::{Exit, Failure, OrExit as _, print, table};
use crate::config::{Controller, Station};
use crate::device::change::{check, keeps, moves};
use crate::device::settings::is_own;
use crate::device::{Address, Assignment, Patience, Request, Talk, assignments, table};
use crate::wire::Dialect;

/// The parameter command that keeps the settings over a power cycle.
const KEEP: (Address, u16) = (Address::Pa(0x0f), 2);

/// Writes registers of controllers: shows what changes, asks, writes, and reads back.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue register write PA95=6 --to 127.0.0.1:7409
  kinocue register write PA90=1 PA91=2 PA92=1 PA93=50 --config examples/hall.toml --keep
  kinocue register write pa 80..85 = 3000 --config examples/hall.toml --row A --yes
  kinocue register write servo 1 508=7 --config examples/hall.toml --name A1
  kinocue register write --file hall-settings.toml --config examples/hall.toml --name A1 --keep

Without --keep, a power cycle undoes what is written. To home seats, use `kinocue home`.")]
pub(super) struct Args {
    /// What to write: PA95=6, pa 80..85 = 3000, dpf1=0, servo 1 508=7.
    #[arg(value_name = "REGISTER=VALUE", required_unless_present = "file", conflicts_with = "file")]
    values: Vec<String>,
    /// Write the settings in a file of `kinocue register save`, except addresses and network settings.
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    targets: TargetArgs,
    /// The controller of this name; repeatable.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// Have the controllers save them, to keep them over a power cycle (PA0f = 2; mbox: object channel 1).
    #[arg(long)]
    keep: bool,
    /// Write without asking.
    #[arg(long)]
    yes: bool,
    /// Allow network settings (PA10-1b, PA20-29) and the factory reset (PA0f = 1) to be written.
    #[arg(long)]
    force: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// One register that changes.
#[derive(Debug, Serialize)]
struct RegisterChange {
    #[serde(skip)]
    lane: usize,
    register: Address,
    old: u16,
    new: u16,
    /// True if the controller took it.
    written: bool,
    /// What it read afterwards; null if it was not written, not read back, or keeps no value.
    reads: Option<u16>,
}

#[derive(Serialize)]
struct WriteReport<'a> {
    written: bool,
    kept: bool,
    controllers: Vec<ControllerChanges<'a>>,
}

#[derive(Serialize)]
struct ControllerChanges<'a> {
    name: &'a str,
    address: String,
    changes: Vec<&'a RegisterChange>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let targets = args.targets.resolve(&args.name)?;
    let wanted = wanted(args, &targets)?;
    let mut talk = targets.open()?;
    let mut changes = changes(&mut talk, &targets, &wanted)?;
    if changes.is_empty() {
        print::tell("nothing to change: all registers already have these values");
        if !args.keep {
            return finish(args, &targets, &changes, false).map(|()| Exit::Done);
        }
    } else {
        print::tell(&format!("{}", text(&targets, &changes)));
    }
    warn_of_moves(&changes);
    let question = if changes.is_empty() { "Keep the settings?" } else { "Write this?" };
    if !agreed(question, args.yes, "--yes")? {
        print::tell("nothing was written");
        return finish(args, &targets, &[], false).map(|()| Exit::Done);
    }
    // Only now: whoever was asked may have taken a while to answer.
    let all: Vec<usize> = (0..targets.controllers.len()).collect();
    targets.refuse_company(&mut talk, &all)?;
    let mut troubles = Troubles::default();
    write(&mut talk, &targets, &mut changes, args.keep, &mut troubles);
    read_back(&mut talk, &targets, &mut changes, &mut troubles);
    if args.keep && troubles.none() {
        keep(&mut talk, &targets, &mut troubles);
    }
    finish(args, &targets, &changes, troubles.none() && args.keep)?;
    if troubles.none() {
        print::tell(&format!("written{}", outlook(&changes, args.keep)));
    }
    Ok(troubles.exit())
}

/// What each controller shall hold; everything is checked here, before anything is sent.
fn wanted(args: &Args, targets: &Targets) -> Result<Vec<Vec<Assignment>>, Failure> {
    let wanted = match &args.file {
        Some(path) => from_file(args, path, targets)?,
        None => {
            let given = assignments(&args.values).or_exit(Exit::Usage)?;
            vec![given; targets.controllers.len()]
        }
    };
    let mut objections: Vec<String> = Vec::new();
    if let Some(own) = wanted.iter().flatten().find(|one| wanted.len() > 1 && is_own(one.address)) {
        let address = own.address;
        objections.push(format!("{address} is each controller's own; write it to one controller at a time"));
    }
    for (controller, assignments) in targets.controllers.iter().zip(&wanted) {
        for assignment in assignments {
            if let Err(objection) = check(*assignment, controller.connection.dialect, args.force) {
                objections.push(objection.to_string());
            }
        }
    }
    objections.dedup();
    if objections.is_empty() {
        return Ok(wanted);
    }
    Err(anyhow!("{}", objections.join("\nkinocue: "))).or_exit(Exit::Usage)
}

/// What a settings file has of each controller, without what makes a controller that one, and without what is never
/// written.
fn from_file(
    args: &Args,
    path: &std::path::Path,
    targets: &Targets,
) -> Result<Vec<Vec<Assignment>>, Failure> {
    let file = diff::load(path)?;
    let saved = diff::matched(&file.controllers, targets, None).with_context(|| path.display().to_string());
    let saved = saved.or_exit(Exit::Usage)?;
    let writable = |address: Address, dialect: Dialect| {
        let register = table().get(address);
        register.is_some_and(|register| {
            let flags = register.flags;
            let network = flags.network && !args.force;
            register.dialect.has(dialect) && !flags.never && !flags.command && !network && !is_own(address)
        })
    };
    let of = |(saved, dialect): (&crate::device::settings::Saved, Dialect)| {
        let values = saved.values.iter().map(|(&address, &value)| Assignment { address, value });
        values.filter(|one| writable(one.address, dialect)).collect()
    };
    let dialects = targets.controllers.iter().map(|one| one.connection.dialect);
    Ok(saved.into_iter().zip(dialects).map(of).collect())
}

/// What would change. Every controller has to tell what it holds now, else nothing is written to any.
fn changes(
    talk: &mut Talk,
    targets: &Targets,
    wanted: &[Vec<Assignment>],
) -> Result<Vec<RegisterChange>, Failure> {
    let addresses: Vec<Vec<Address>> =
        wanted.iter().map(|all| all.iter().map(|one| one.address).collect()).collect();
    let mut troubles = Troubles::default();
    let found = read_values(talk, targets, &addresses, &mut troubles);
    if !troubles.none() {
        return Err(anyhow!("nothing written: not all registers could be read")).or_exit(troubles.exit());
    }
    let mut changes = Vec::new();
    for (lane, (assignments, found)) in wanted.iter().zip(found).enumerate() {
        for &Assignment { address, value } in assignments {
            let old = found.values.get(&address).copied().unwrap_or(0);
            if old != value || !keeps(address) {
                changes.push(RegisterChange {
                    lane,
                    register: address,
                    old,
                    new: value,
                    written: false,
                    reads: None,
                });
            }
        }
    }
    Ok(changes)
}

fn warn_of_moves(changes: &[RegisterChange]) {
    if let Some(change) = changes.iter().find(|change| moves(change.register)) {
        print::tell(&format!(
            "warning: {} moves the seat, which must be empty; `kinocue home` is the safer way",
            change.register
        ));
    }
}

/// Writes one register after the other, to all controllers side by side; a controller that fails gets no more.
fn write(
    talk: &mut Talk,
    targets: &Targets,
    changes: &mut [RegisterChange],
    keep: bool,
    troubles: &mut Troubles,
) {
    let mut queues: BTreeMap<usize, Vec<&mut RegisterChange>> = BTreeMap::new();
    for change in changes {
        queues.entry(change.lane).or_default().push(change);
    }
    for step in 0.. {
        let next = queues.iter().filter_map(|(lane, queue)| Some((*lane, queue.get(step)?)));
        let requests: Vec<_> = next
            .map(|(lane, change)| {
                (lane, Request::Write { address: change.register, value: change.new, keep })
            })
            .collect();
        if requests.is_empty() {
            return;
        }
        for outcome in talk.ask(requests, Patience::default()) {
            let lane = outcome.lane;
            match (troubles.sort(targets, outcome), queues.get_mut(&lane)) {
                (Ok(_), Some(queue)) => queue[step].written = true,
                _ => drop(queues.remove(&lane)),
            }
        }
    }
}

/// Reads what was written, and tells where it is not what it should be.
fn read_back(talk: &mut Talk, targets: &Targets, changes: &mut [RegisterChange], troubles: &mut Troubles) {
    let mut wanted = vec![Vec::new(); targets.controllers.len()];
    let proved = |change: &RegisterChange| change.written && keeps(change.register);
    for change in changes.iter().filter(|change| proved(change)) {
        wanted[change.lane].push(change.register);
    }
    let found = read_values(talk, targets, &wanted, troubles);
    for change in changes.iter_mut().filter(|change| proved(change)) {
        change.reads = found[change.lane].values.get(&change.register).copied();
        if let Some(reads) = change.reads.filter(|reads| *reads != change.new) {
            let line = format!("{} reads {reads} after {} was written to it", change.register, change.new);
            troubles.refuse(targets.name(change.lane), &line);
        }
    }
}

/// Has the SMC controllers keep their settings; MBOX ones have done so with the write.
fn keep(talk: &mut Talk, targets: &Targets, troubles: &mut Troubles) {
    let smc =
        targets.controllers.iter().enumerate().filter(|(_, one)| one.connection.dialect == Dialect::Smc);
    let requests = smc.map(|(lane, _)| (lane, Request::write(KEEP.0, KEEP.1))).collect();
    for outcome in talk.ask(requests, Patience::default()) {
        let _ = troubles.sort(targets, outcome); // it has told of it
    }
}

/// What a power cycle makes of the changes.
fn outlook(changes: &[RegisterChange], keep: bool) -> &'static str {
    let lasting =
        |change: &RegisterChange| table().get(change.register).is_none_or(|register| register.saved);
    match (keep, changes.iter().any(lasting)) {
        (true, _) => " and read back; kept over a power cycle",
        (false, true) => " and read back; a power cycle undoes it; --keep keeps it",
        (false, false) => "",
    }
}

fn finish(args: &Args, targets: &Targets, changes: &[RegisterChange], kept: bool) -> Result<(), Failure> {
    if !args.json {
        return Ok(());
    }
    let one = |(lane, controller): (usize, &Controller<Station>)| ControllerChanges {
        name: targets.name(lane),
        address: controller.connection.address.to_string(),
        changes: changes.iter().filter(|change| change.lane == lane).collect(),
    };
    let controllers = targets.controllers.iter().enumerate().map(one).collect();
    print::json(&WriteReport { written: changes.iter().any(|change| change.written), kept, controllers })
}

/// The diff: old and new.
fn text(targets: &Targets, changes: &[RegisterChange]) -> Table {
    let mut lines = table::bare();
    lines.set_header(["controller", "register", "old", "", "new", "name", "meaning"]);
    for change in changes {
        let register = table().get(change.register);
        lines.add_row([
            targets.name(change.lane).to_owned(),
            change.register.to_string(),
            change.old.to_string(),
            "->".to_owned(),
            change.new.to_string(),
            register.map_or("", |register| register.name.as_str()).to_owned(),
            register.and_then(|register| register.says(change.new)).unwrap_or_default().to_owned(),
        ]);
    }
    for column in lines.column_iter_mut().skip(2).take(3) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    lines
}
