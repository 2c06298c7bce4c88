//! How much of the cue the seats make: trim, levels, effects, presets, seats in and out.

use std::collections::BTreeMap;

use anyhow::anyhow;
use serde_json::json;

use super::rows::parse_rows;
use super::server::{ServerArgs, in_path};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::config::parse_level;
use crate::control::{LevelsChange, Status};
use crate::time::{TrimChange, parse_trim_change};

/// The commands that set what lasts.
#[derive(Debug, clap::Subcommand)]
pub(in crate::cli) enum LevelsCommand {
    /// Trims the motion against the film: later or earlier.
    #[command(
        after_help = "Examples:\n  kinocue trim +80ms\n  kinocue trim -120\n  kinocue trim 0\n  kinocue trim +2f"
    )]
    Trim(TrimArgs),
    /// Sets the level of motion and vibration.
    #[command(
        override_usage = "kinocue level [motion|vibration] <LEVEL> [OPTIONS]",
        after_help = "\
Examples:
  kinocue level 60%                     motion and vibration
  kinocue level motion 60%
  kinocue level vibration 40%
  kinocue level 50% --row A             motion and vibration of row A, on top of the hall's
  kinocue level -6dB --row A-B

A row has one level for its motion and its vibration together."
    )]
    Level(LevelArgs),
    /// Enables or disables effects.
    #[command(after_help = "\
Examples:
  kinocue effects off water
  kinocue effects on water air
  kinocue effects off")]
    Effects(EffectsArgs),
    /// Applies a preset of the configuration: levels and effects.
    #[command(after_help = "Example:\n  kinocue preset kids")]
    Preset(NameArgs),
    /// Puts a seat back into the show.
    ///
    /// The seat joins by a move within its limits, with all controllers that share it.
    #[command(after_help = "Example:\n  kinocue enable B2")]
    Enable(NameArgs),
    /// Takes a seat out of the show.
    ///
    /// It parks, with all controllers that share it; the others play on.
    #[command(after_help = "\
Examples:
  kinocue disable B2
  kinocue disable B2 --why \"broken leg\"

It stays out until it is enabled again, even after a restart of the service; `kinocue arm` lists it. To take a controller
out permanently, set enabled = false in the configuration.")]
    Disable(DisableArgs),
}

/// A trim.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct TrimArgs {
    /// -500ms to 500ms: positive makes the motion later than the film, negative earlier. Or a change in film frames: +2f is two
    /// frames later than now, -1f one earlier.
    #[arg(value_name = "TRIM", value_parser = parse_trim_change, allow_hyphen_values = true)]
    trim: TrimChange,
    #[command(flatten)]
    server: ServerArgs,
}

/// A level, of what and whose.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct LevelArgs {
    /// `motion` or `vibration` [default: both].
    #[arg(value_name = "WHAT", allow_hyphen_values = true)]
    first: String,
    /// 0% to 100%, 0 to 1, or 0dB and below.
    #[arg(value_name = "LEVEL", allow_hyphen_values = true)]
    second: Option<String>,
    /// Only these rows: A, or A,C, or A-C [default: the whole hall].
    #[arg(long, value_name = "ROWS")]
    row: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Effects.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct EffectsArgs {
    /// on lets the cue switch them, off keeps them off.
    #[arg(value_name = "on|off", value_parser = ["on", "off"])]
    switch: String,
    /// The effects [default: all].
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Something by its name.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct NameArgs {
    /// The name, as `kinocue status` shows it.
    #[arg(value_name = "NAME")]
    name: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// A controller, and why its seat is disabled.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct DisableArgs {
    /// The controller, as `kinocue status` shows it.
    #[arg(value_name = "NAME")]
    name: String,
    /// The reason, for the next operator.
    #[arg(long, value_name = "REASON")]
    why: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
}

pub(super) fn run(command: &LevelsCommand) -> Result<Exit, Failure> {
    match command {
        LevelsCommand::Trim(TrimArgs { trim, server }) => {
            let asked = match trim {
                TrimChange::To(ms) => json!({ "offset_s": f64::from(*ms) / 1e3 }),
                TrimChange::ByFrames(frames) => json!({ "frames": frames }),
            };
            let status = server.put("/api/v1/trim", &asked)?;
            Ok(told(server, &status))
        }
        LevelsCommand::Level(args) => {
            let row = args.row.as_deref();
            set(
                &args.server,
                &level(&args.first, args.second.as_deref(), row)
                    .map_err(anyhow::Error::msg)
                    .or_exit(Exit::Usage)?,
            )
        }
        LevelsCommand::Effects(args) => effects(args),
        LevelsCommand::Preset(NameArgs { name, server }) => {
            let status = server.post(&format!("/api/v1/presets/{}", in_path(name)), &json!({}))?;
            Ok(told(server, &status))
        }
        LevelsCommand::Enable(NameArgs { name, server }) => {
            let status = server.post(&format!("/api/v1/controllers/{}/enable", in_path(name)), &json!({}))?;
            Ok(told_of_seat(server, &status, name))
        }
        LevelsCommand::Disable(DisableArgs { name, why, server }) => {
            let body = why.as_ref().map_or_else(|| json!({}), |why| json!({ "why": why }));
            let status = server.post(&format!("/api/v1/controllers/{}/disable", in_path(name)), &body)?;
            Ok(told_of_seat(server, &status, name))
        }
    }
}

/// The change that the words of `kinocue level` mean.
fn level(first: &str, second: Option<&str>, rows: Option<&str>) -> Result<LevelsChange, String> {
    let none = LevelsChange::default();
    match (first, second, rows) {
        ("motion", Some(level), None) => Ok(LevelsChange { motion: Some(parse_level(level)?), ..none }),
        ("vibration", Some(level), None) => Ok(LevelsChange { vibration: Some(parse_level(level)?), ..none }),
        ("motion" | "vibration", Some(level), Some(rows)) => Err(format!(
            "a row has one level for its motion and its vibration; write kinocue level {level} --row {rows}"
        )),
        ("motion" | "vibration", None, _) => {
            Err(format!("the level is missing; write for example kinocue level {first} 60%"))
        }
        (level, None, None) => {
            let level = Some(parse_level(level)?);
            Ok(LevelsChange { motion: level, vibration: level, ..none })
        }
        (level, None, Some(rows)) => {
            let level = parse_level(level)?;
            let rows = parse_rows(rows)?.into_iter().map(|row| (row, level)).collect();
            Ok(LevelsChange { rows, ..none })
        }
        (what, Some(_), _) => Err(format!("{what:?} has no level; only motion and vibration have one")),
    }
}

fn effects(args: &EffectsArgs) -> Result<Exit, Failure> {
    let EffectsArgs { switch, names, server } = args;
    let names =
        if names.is_empty() { server.status()?.levels.effects.into_keys().collect() } else { names.clone() };
    if names.is_empty() {
        return Err(anyhow!("the hall has no effects; name them in [effects] of its configuration"))
            .or_exit(Exit::NoInput);
    }
    let effects: BTreeMap<String, bool> = names.into_iter().map(|name| (name, switch == "on")).collect();
    set(server, &LevelsChange { effects, ..LevelsChange::default() })
}

fn set(server: &ServerArgs, change: &LevelsChange) -> Result<Exit, Failure> {
    let change = serde_json::to_value(change).or_exit(Exit::Internal)?;
    let status = server.put("/api/v1/levels", &change)?;
    Ok(told(server, &status))
}

/// Says whether the seat of a controller takes part by now, and the state as ever.
fn told_of_seat(server: &ServerArgs, status: &Status, name: &str) -> Exit {
    seat(status, name).iter().for_each(|text| print::tell(&format!("kinocue: {text}")));
    server.tell(status)
}

/// Whether the seat of a controller takes part, with all controllers that share it.
fn seat(status: &Status, name: &str) -> Option<String> {
    let one = status.controllers.iter().find(|one| one.name == name)?;
    let group = status.controllers.iter().filter(|other| other.group == one.group);
    let (names, why) = (group.map(|other| other.name.as_str()).collect::<Vec<_>>().join(", "), &one.why);
    Some(match one.enabled {
        true => format!("{names} takes part again ({}: {why})", one.health),
        false => format!("{names} is out of the show until it is enabled: {why}"),
    })
}

/// Says what the levels are by now, and the state as ever.
fn told(server: &ServerArgs, status: &Status) -> Exit {
    print::tell(&format!("kinocue: {}", status.mix()));
    server.tell(status)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::ControllerStatus;

    #[test]
    fn a_level_is_for_both_for_one_or_for_rows() {
        let none = LevelsChange::default;
        let both = LevelsChange { motion: Some(0.6), vibration: Some(0.6), ..none() };
        assert_eq!(level("60%", None, None), Ok(both));
        assert_eq!(level("motion", Some("60%"), None), Ok(LevelsChange { motion: Some(0.6), ..none() }));
        assert_eq!(level("vibration", Some("0%"), None), Ok(LevelsChange { vibration: Some(0.0), ..none() }));
        let rows = [("A".to_owned(), 0.5), ("B".to_owned(), 0.5)].into();
        assert_eq!(level("50%", None, Some("A-B")), Ok(LevelsChange { rows, ..none() }));
    }

    #[test]
    fn a_seat_that_is_taken_out_or_in_is_named_with_all_that_share_it() {
        let one = |name: &str, group: &str, enabled| ControllerStatus {
            name: name.to_owned(),
            group: group.to_owned(),
            enabled,
            why: "disabled by anna: broken leg".to_owned(),
            ..ControllerStatus::default()
        };
        let status = Status {
            controllers: vec![one("A1", "one", false), one("A2", "one", false), one("B1", "two", true)],
            ..Status::default()
        };
        let out = seat(&status, "A2").unwrap();
        assert_eq!(out, "A1, A2 is out of the show until it is enabled: disabled by anna: broken leg");
        assert!(seat(&status, "B1").unwrap().starts_with("B1 takes part again ("));
    }

    #[test]
    fn a_row_has_no_level_of_motion_alone() {
        let refused = level("motion", Some("60%"), Some("A")).unwrap_err();
        assert!(refused.ends_with("write kinocue level 60% --row A"), "{refused}");
        for (first, second) in
            [("motion", None), ("60", None), ("heave", Some("60%")), ("motion", Some("fast"))]
        {
            assert!(level(first, second, None).is_err(), "{first} {second:?}");
        }
    }
}
