//! `kinocue register diff`.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};
use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

use super::drives::{self, DriveFound, DriveRegisters};
use super::read_values;
use crate::cli::targets::{DrivenTargets, TargetArgs, Targets, Troubles, read_file};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::config::{Controller, Station};
use crate::device::settings::{self, Difference, Saved, SavedDrives, SavedHall, differences};
use crate::device::{Address, table};

/// Compares controllers with a file of `kinocue register save`. Exits with 0 if nothing differs, with 1 if something does.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue register diff hall-settings.toml --config examples/hall.toml
  kinocue register diff hall-settings.toml --config examples/hall.toml --name A1
  kinocue register diff A1.toml --to 127.0.0.1:7408
  kinocue register diff hall-settings.toml --as A1 --to 127.0.0.1:7408")]
pub(super) struct Args {
    /// The file of `kinocue register save` to compare with.
    file: PathBuf,
    #[command(flatten)]
    targets: TargetArgs,
    /// The controller of this name; repeatable.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// Compare with this controller of the file [default: the one of the same name].
    #[arg(long = "as", value_name = "NAME")]
    like: Option<String>,
    /// Compare a controller's own address too (PA10 to PA14, PA16 to PA1b).
    #[arg(long)]
    all: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct DiffReport<'a> {
    same: bool,
    controllers: Vec<ControllerDiff<'a>>,
    /// Seats on serial links.
    drives: Vec<DrivesDiff<'a>>,
}

#[derive(Serialize)]
struct DrivesDiff<'a> {
    name: &'a str,
    address: String,
    saved_as: &'a str,
    differences: Vec<DriveDifference>,
    faults: Vec<String>,
}

/// A register of a unit that differs.
#[derive(Serialize)]
struct DriveDifference {
    register: String,
    name: String,
    saved: i64,
    found: i64,
}

#[derive(Serialize)]
struct ControllerDiff<'a> {
    name: &'a str,
    address: String,
    saved_as: &'a str,
    differences: Vec<Difference>,
    faults: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let (targets, driven) = args.targets.resolve_all(&args.name)?;
    let driven = drives::asked(driven, &DriveRegisters::settings());
    let file = load(&args.file)?;
    let place = || args.file.display().to_string();
    let like = args.like.as_deref();
    let saved = matched(&file.controllers, &targets, like).with_context(place).or_exit(Exit::Usage)?;
    let saved_drives =
        matched_drives(&file.drives, &driven, like).with_context(place).or_exit(Exit::Usage)?;
    let mut troubles = Troubles::default();
    let found = if targets.controllers.is_empty() {
        Vec::new()
    } else {
        let wanted: Vec<Vec<Address>> =
            saved.iter().map(|one| one.values.keys().copied().collect()).collect();
        read_values(&mut targets.open()?, &targets, &wanted, &mut troubles)
    };
    let on_links = drives::read(&driven, &DriveRegisters::settings(), &mut troubles)?;
    let reports = targets.controllers.iter().zip(&saved).zip(found).map(|((controller, saved), found)| {
        ControllerDiff {
            name: &controller.name,
            address: controller.connection.address.to_string(),
            saved_as: &saved.name,
            differences: differences(&saved.values, &found.values, args.all),
            faults: found.faults,
        }
    });
    let controllers: Vec<_> = reports.collect();
    let of_drives = driven.controllers.iter().zip(saved_drives).zip(on_links);
    let drives: Vec<_> =
        of_drives.map(|((controller, saved), found)| DrivesDiff::new(controller, saved, found)).collect();
    let same = troubles.none()
        && controllers.iter().all(|one| one.differences.is_empty())
        && drives.iter().all(|one| one.differences.is_empty());
    let report = DiffReport { same, controllers, drives };
    if args.json {
        print::json(&report)?
    } else {
        tell(&report, args.all)?
    }
    Ok(match troubles.exit() {
        Exit::Done if !same => Exit::CheckFailed,
        exit => exit,
    })
}

impl<'a> DrivesDiff<'a> {
    fn new(controller: &'a Controller, saved: &'a SavedDrives, found: DriveFound) -> Self {
        let differs = |value: &drives::DriveValue| {
            let saved = *saved.registers.get(&value.register)?;
            let (register, name) = (value.register.clone(), value.name.clone());
            (saved != value.value).then_some(DriveDifference { register, name, saved, found: value.value })
        };
        let differences = found.values.iter().filter_map(differs).collect();
        let (name, address) = (&*controller.name, controller.address());
        Self { name, address, saved_as: &saved.name, differences, faults: found.faults }
    }
}

/// For each seat on a link what the file has of it.
fn matched_drives<'f>(
    file: &'f [SavedDrives],
    driven: &DrivenTargets,
    like: Option<&str>,
) -> anyhow::Result<Vec<&'f SavedDrives>> {
    let of = |controller: &Controller| {
        let name = like.unwrap_or(&controller.name);
        let saved = file.iter().find(|one| one.name == name);
        saved.ok_or_else(|| anyhow!("has no settings of the drives of {name}; select others with --as NAME"))
    };
    driven.controllers.iter().map(of).collect()
}

/// Reads a settings file.
pub(super) fn load(path: &Path) -> Result<SavedHall, Failure> {
    let text = read_file(path)?;
    settings::parse(&text).with_context(|| path.display().to_string()).or_exit(Exit::Config)
}

/// For each controller what the file has of it: by `like`, by its name, by its address, or the only one there is.
pub(super) fn matched<'f>(
    file: &'f [Saved],
    targets: &Targets,
    like: Option<&str>,
) -> anyhow::Result<Vec<&'f Saved>> {
    let known = || file.iter().map(|one| one.name.as_str()).collect::<Vec<_>>().join(", ");
    let by_name = |name: &str| file.iter().find(|one| one.name == name);
    if let Some(name) = like {
        let one = by_name(name).ok_or_else(|| anyhow!("has no settings of {name}; it has {}", known()))?;
        return Ok(vec![one; targets.controllers.len()]);
    }
    let only = || if let ([one], [_]) = (file, &targets.controllers[..]) { Some(one) } else { None };
    let of = |controller: &Controller<Station>| {
        let by_address = || file.iter().find(|one| one.address == controller.connection.address);
        by_name(&controller.name).or_else(by_address).or_else(only).ok_or_else(|| {
            anyhow!("has no settings of {}; it has {}; --as NAME chooses", controller.name, known())
        })
    };
    targets.controllers.iter().map(of).collect()
}

fn tell(report: &DiffReport<'_>, all: bool) -> Result<(), Failure> {
    let mut table_of = Table::new();
    table_of.load_style(presets::NOTHING);
    table_of.set_header(["controller", "register", "in the file", "in the controller", "name", "meaning"]);
    let mut differing = 0;
    for one in &report.controllers {
        for difference in &one.differences {
            differing += 1;
            let register = table().get(difference.address);
            table_of.add_row([
                one.name.to_owned(),
                difference.address.to_string(),
                difference.saved.to_string(),
                difference.found.to_string(),
                register.map_or("", |register| register.name.as_str()).to_owned(),
                register.and_then(|register| register.says(difference.found)).unwrap_or_default().to_owned(),
            ]);
        }
    }
    for one in &report.drives {
        for DriveDifference { register, name, saved, found } in &one.differences {
            differing += 1;
            let cells = [one.name, register, &saved.to_string(), &found.to_string(), name, ""];
            table_of.add_row(cells);
        }
    }
    for column in table_of.column_iter_mut().skip(2).take(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    if differing > 0 {
        print::out(&format!("{table_of}\n"))?;
    } else if report.same {
        print::tell("nothing differs");
    }
    if !all && !report.controllers.is_empty() {
        print::tell("PA10-14 and PA16-1b, each controller's own, were not compared; --all does");
    }
    Ok(())
}
