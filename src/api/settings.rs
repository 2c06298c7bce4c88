//! Settings (trim, levels, presets), and commands to the hall as a whole.

use serde::Deserialize;
use utoipa::ToSchema;

use super::asker::{Asker, StatusReply};
use super::input::{Json, Name, Nothing};
use super::problem::bad_value;
use crate::config::no_level;
use crate::control::{Command, LevelsChange, Problem, Status};
use crate::time::TRIM_FRAMES;

type Reply = Result<StatusReply, Problem>;

/// How far the motion may be moved against the film, s, either way.
const MAX_TRIM_S: f64 = 0.5;

/// How much later than the film the motion is: one of both.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Trim {
    /// Seconds, -0.5 to 0.5, in whole milliseconds.
    offset_s: Option<f64>,
    /// Later than it is by so many frames of the film, -12 to 12.
    frames: Option<i32>,
}

/// Which seats are tested.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Test {
    /// Their rows; all where none is named.
    #[serde(default)]
    rows: Vec<String>,
}

/// Moves the motion against the film.
#[utoipa::path(
    put, path = "/api/v1/trim", tag = "settings", request_body = Trim, responses((status = 200, body = Status))
)]
pub(super) async fn trim(asker: Asker, Json(trim): Json<Trim>) -> Reply {
    asker.ask(trim.command()?).await
}

impl Trim {
    pub(super) fn command(self) -> Result<Command, Problem> {
        match (self.offset_s, self.frames) {
            (Some(offset_s), None) => Ok(Command::Trim(trim_ms(offset_s)?)),
            (None, Some(frames)) if (-TRIM_FRAMES..=TRIM_FRAMES).contains(&frames) => {
                Ok(Command::Nudge(frames))
            }
            _ => {
                let detail = "a trim is either offset_s, or frames by which it changes".to_owned();
                Err(bad_value(detail, "give one of them; frames are -12 to 12"))
            }
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "500 at the most")]
fn trim_ms(offset_s: f64) -> Result<i32, Problem> {
    if (-MAX_TRIM_S..=MAX_TRIM_S).contains(&offset_s) {
        return Ok((1000.0 * offset_s).round() as i32);
    }
    let detail = format!("offset_s: {offset_s} is outside -{MAX_TRIM_S}..={MAX_TRIM_S}");
    Err(bad_value(detail, "give the seconds by which the motion is later than the film; 80 ms are 0.08"))
}

/// The source by which the film is followed.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Source {
    /// As the status names it; null leaves it to the ranking.
    #[serde(deserialize_with = "Option::deserialize")]
    #[schema(required)]
    source: Option<String>,
}

/// Has the film followed by one source, whatever becomes of it, or by the ranking again.
#[utoipa::path(
    put, path = "/api/v1/sync/source", tag = "settings", request_body = Source,
    responses((status = 200, body = Status))
)]
pub(super) async fn source(asker: Asker, Json(Source { source }): Json<Source>) -> Reply {
    asker.ask(Command::Source(source)).await
}

/// Changes levels and effects; what is not named stays as it is.
#[utoipa::path(
    put, path = "/api/v1/levels", tag = "settings", request_body = LevelsChange, responses((status = 200, body = Status))
)]
pub(super) async fn levels(asker: Asker, Json(change): Json<LevelsChange>) -> Reply {
    check_levels(&change)?;
    asker.ask(Command::Levels(change)).await
}

pub(super) fn check_levels(change: &LevelsChange) -> Result<(), Problem> {
    let LevelsChange { motion, vibration, rows, .. } = change;
    let halls = [("motion", motion), ("vibration", vibration)];
    let halls = halls.into_iter().filter_map(|(name, level)| Some((name.to_owned(), (*level)?)));
    let rows = rows.iter().map(|(row, &level)| (format!("row {row}"), level));
    let outside = halls.chain(rows).filter(|(_, level)| !(0.0..=1.0).contains(level));
    let faults: Vec<_> = outside.map(|(name, level)| format!("{name}: {}", no_level(level))).collect();
    if faults.is_empty() {
        return Ok(());
    }
    Err(bad_value(faults.join(", "), "levels are 0 to 1").with(faults))
}

/// Applies a preset of the configuration: levels and effects.
#[utoipa::path(
    post, path = "/api/v1/presets/{name}", tag = "settings", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = Status))
)]
pub(super) async fn preset(asker: Asker, Name(name): Name, _: Nothing) -> Reply {
    asker.ask(Command::Preset(name)).await
}

/// Asks all controllers for their registers and judges them.
#[utoipa::path(post, path = "/api/v1/preflight", tag = "hall", responses((status = 200, body = Status)))]
pub(super) async fn preflight(asker: Asker, _: Nothing) -> Reply {
    asker.ask(Command::Preflight).await
}

/// Moves each axis and effect of empty, armed seats slowly in turn.
#[utoipa::path(
    post, path = "/api/v1/test", tag = "hall", request_body = Test, responses((status = 200, body = Status))
)]
pub(super) async fn test(asker: Asker, Json(Test { rows }): Json<Test>) -> Reply {
    asker.ask(Command::Test { rows }).await
}

/// Reads the configuration anew, where nothing is armed. The table `[api]` stays as it was until the service starts again.
#[utoipa::path(post, path = "/api/v1/reload", tag = "hall", responses((status = 200, body = Status)))]
pub(super) async fn reload(asker: Asker, _: Nothing) -> Reply {
    asker.ask(Command::Reload).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trim_is_rounded_to_a_millisecond_and_kept_within_half_a_second() {
        assert_eq!(trim_ms(0.0804), Ok(80));
        assert_eq!((trim_ms(-0.5), trim_ms(0.5)), (Ok(-500), Ok(500)));
        assert!(trim_ms(0.5001).is_err() && trim_ms(f64::NAN).is_err());
    }

    #[test]
    fn every_level_outside_its_range_is_named() {
        let rows = [("A".to_owned(), 1.5), ("B".to_owned(), 1.0)].into();
        let change =
            LevelsChange { motion: Some(-0.1), vibration: Some(0.0), rows, ..LevelsChange::default() };
        let problem = check_levels(&change).unwrap_err();
        assert_eq!(problem.faults, ["motion: -0.1 is outside 0..=1", "row A: 1.5 is outside 0..=1"]);
    }
}
