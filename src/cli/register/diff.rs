//! `kinocue register diff`.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};
use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

use super::read_values;
use crate::cli::targets::{TargetArgs, Targets, Troubles, read_file};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::config::{Controller, Station};
use crate::device::settings::{self, Difference, Saved, differences};
use crate::device::{Address, table};

/// Compares controllers with a file that `kinocue register save` wrote. Ends with 0 where nothing differs, with 1 where
/// something does.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue register diff hall-settings.toml --config hall.toml
  kinocue register diff hall-settings.toml --config hall.toml --name A7
  kinocue register diff A7.toml --to 192.168.15.207:7408
  kinocue register diff hall-settings.toml --as A7 --to 192.168.15.207:7408")]
pub(super) struct Args {
    /// The settings to compare with.
    file: PathBuf,
    #[command(flatten)]
    targets: TargetArgs,
    /// The controller of this name; repeatable.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// Compare with what the file has of this controller [default: the one of the same name].
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
    let targets = args.targets.resolve(&args.name)?;
    let file = load(&args.file)?;
    let saved =
        matched(&file, &targets, args.like.as_deref()).with_context(|| args.file.display().to_string());
    let saved = saved.or_exit(Exit::Usage)?;
    let wanted: Vec<Vec<Address>> = saved.iter().map(|one| one.values.keys().copied().collect()).collect();
    let mut talk = targets.open()?;
    let mut troubles = Troubles::default();
    let found = read_values(&mut talk, &targets, &wanted, &mut troubles);
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
    let same = troubles.none() && controllers.iter().all(|one| one.differences.is_empty());
    let report = DiffReport { same, controllers };
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

/// Reads a settings file.
pub(super) fn load(path: &Path) -> Result<Vec<Saved>, Failure> {
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
    for column in table_of.column_iter_mut().skip(2).take(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    if differing > 0 {
        print::out(&format!("{table_of}\n"))?;
    } else if report.same {
        print::tell("nothing differs");
    }
    if !all {
        print::tell("PA10-14 and PA16-1b, which are each controller's own, were not compared; --all does");
    }
    Ok(())
}
