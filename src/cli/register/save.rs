//! `kinocue register save`.

use std::path::{Path, PathBuf};

use anyhow::anyhow;

use super::read_values;
use crate::cli::targets::{TargetArgs, Troubles, write_file};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::device::Address;
use crate::device::settings::{Saved, parameters, text};

/// Keeps the parameters of controllers as a file, to compare others with or to write back.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue register save A7.toml --to 192.168.15.207:7408,name=A7
  kinocue register save hall-settings.toml --config hall.toml
  kinocue register save - --config hall.toml --row A")]
pub(super) struct Args {
    /// Where to; `-` for standard output. A file that is there is replaced.
    file: PathBuf,
    #[command(flatten)]
    targets: TargetArgs,
    /// The controller of this name; repeatable.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let targets = args.targets.resolve(&args.name)?;
    let wanted: Vec<Vec<Address>> = (targets.controllers.iter())
        .map(|one| parameters(one.connection.dialect).map(|register| register.address).collect())
        .collect();
    let mut talk = targets.open()?;
    let mut troubles = Troubles::default();
    let found = read_values(&mut talk, &targets, &wanted, &mut troubles);
    if !troubles.none() {
        return Err(anyhow!("nothing saved: some controllers did not return all registers"))
            .or_exit(troubles.exit());
    }
    let saved: Vec<Saved> = (targets.controllers.iter().zip(found))
        .map(|(controller, found)| Saved {
            name: controller.name.clone(),
            address: controller.connection.address,
            dialect: controller.connection.dialect,
            values: found.values,
        })
        .collect();
    if args.file == Path::new("-") {
        print::out(&text(&saved))?;
    } else {
        write_file(&args.file, &text(&saved))?;
        let names: Vec<_> = saved.iter().map(|one| one.name.as_str()).collect();
        print::tell(&format!("saved the parameters of {} to {}", names.join(", "), args.file.display()));
    }
    Ok(Exit::Done)
}
