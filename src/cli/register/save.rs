//! `kinocue register save`.

use std::path::{Path, PathBuf};

use anyhow::anyhow;

use super::drives::{self, DriveRegisters};
use super::read_values;
use crate::cli::targets::{DrivenTargets, TargetArgs, Targets, Troubles, write_file};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::device::Address;
use crate::device::settings::{Saved, SavedDrives, parameters, text};

/// Saves the parameters of controllers, and the settings of SilverMax units, to a file, to compare with or write back later.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue register save A1.toml --to 127.0.0.1:7408,name=A1
  kinocue register save hall-settings.toml --config examples/hall.toml
  kinocue register save - --config examples/hall.toml --row A")]
pub(super) struct Args {
    /// The file to write, or `-` for stdout. An existing file is replaced.
    file: PathBuf,
    #[command(flatten)]
    targets: TargetArgs,
    /// The controller of this name; repeatable.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let (targets, driven) = args.targets.resolve_all(&args.name)?;
    let none = drives::unreadable(&driven);
    if !none.is_empty() {
        print::tell(&format!(
            "kinocue: {}: left out, as the settings of a SIXpack 2 cannot be read; `kinocue home` writes all of them",
            none.join(", ")
        ));
    }
    let driven = drives::asked(driven, &DriveRegisters::settings());
    let mut troubles = Troubles::default();
    let saved = of_controllers(&targets, &mut troubles)?;
    let of_drives = of_drives(&driven, &mut troubles)?;
    if !troubles.none() {
        return Err(anyhow!("nothing saved: some controllers did not return all registers"))
            .or_exit(troubles.exit());
    }
    let names: Vec<_> =
        saved.iter().map(|one| &*one.name).chain(of_drives.iter().map(|one| &*one.name)).collect();
    if names.is_empty() {
        return Err(anyhow!("nothing saved: none of these has settings that can be read"))
            .or_exit(Exit::Usage);
    }
    if args.file == Path::new("-") {
        print::out(&text(&saved, &of_drives))?;
    } else {
        write_file(&args.file, &text(&saved, &of_drives))?;
        print::tell(&format!("saved the parameters of {} to {}", names.join(", "), args.file.display()));
    }
    Ok(Exit::Done)
}

/// The parameters of the controllers on the network.
fn of_controllers(targets: &Targets, troubles: &mut Troubles) -> Result<Vec<Saved>, Failure> {
    if targets.controllers.is_empty() {
        return Ok(Vec::new());
    }
    let wanted: Vec<Vec<Address>> = (targets.controllers.iter())
        .map(|one| parameters(one.connection.dialect).map(|register| register.address).collect())
        .collect();
    let found = read_values(&mut targets.open()?, targets, &wanted, troubles);
    let saved = targets.controllers.iter().zip(found).map(|(controller, found)| Saved {
        name: controller.name.clone(),
        address: controller.connection.address,
        dialect: controller.connection.dialect,
        values: found.values,
    });
    Ok(saved.collect())
}

/// The settings of the units on links.
fn of_drives(driven: &DrivenTargets, troubles: &mut Troubles) -> Result<Vec<SavedDrives>, Failure> {
    let found = drives::read(driven, &DriveRegisters::settings(), troubles)?;
    let saved = driven.controllers.iter().zip(&found).map(|(controller, found)| SavedDrives {
        name: controller.name.clone(),
        address: controller.address(),
        registers: drives::kept(found),
    });
    Ok(saved.collect())
}
