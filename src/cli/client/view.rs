//! What is read of the daemon's status. Fields that are missing have their default: the daemon may be older, or newer.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::time::ShowTime;

/// The state of the hall in short, as a status and a problem have it.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Hall {
    pub(super) state: String,
    pub(super) cause: String,
    pub(super) next: String,
    /// In problems alone.
    position_s: Option<f64>,
}

/// The status of the hall.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Status {
    #[serde(rename = "hall")]
    pub(super) name: String,
    pub(super) version: String,
    #[serde(flatten)]
    pub(super) hall: Hall,
    pub(super) since_s: f64,
    pub(super) lapses_s: Option<f64>,
    pub(super) show: Option<Show>,
    pub(super) playlist: Option<Playlist>,
    pub(super) trim_ms: i32,
    pub(super) levels: Levels,
    pub(super) presets: Vec<String>,
    pub(super) ticks: u64,
    pub(super) missed_ticks: u64,
    pub(super) rate_hz: f64,
    pub(super) lateness: Percentiles,
    pub(super) ack_latency: Percentiles,
    pub(super) realtime: RealTime,
    pub(super) controllers: Vec<Controller>,
    pub(super) preflight: Option<Preflight>,
    pub(super) test: Option<Test>,
    pub(super) warnings: Vec<Warning>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Show {
    pub(super) cue: String,
    pub(super) title: Option<String>,
    pub(super) length_s: f64,
    pub(super) position_s: f64,
    pub(super) resume_s: Option<f64>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Playlist {
    pub(super) id: String,
    pub(super) title: String,
    pub(super) entries: Vec<Entry>,
    pub(super) current: usize,
    pub(super) next_start: Option<String>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Entry {
    pub(super) cue: String,
    pub(super) title: Option<String>,
    pub(super) length_s: f64,
    pub(super) level: Option<f64>,
    pub(super) trim_ms: Option<i32>,
    pub(super) then: String,
    pub(super) at: Option<String>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Levels {
    pub(super) motion: f64,
    pub(super) vibration: f64,
    pub(super) effects: BTreeMap<String, bool>,
    pub(super) rows: BTreeMap<String, f64>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Percentiles {
    pub(super) p50_us: Option<f64>,
    pub(super) p99_us: Option<f64>,
    pub(super) max_us: Option<f64>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct RealTime {
    pub(super) policy: String,
    pub(super) priority: u8,
    pub(super) memory_locked: bool,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Controller {
    pub(super) name: String,
    pub(super) row: Option<String>,
    pub(super) address: String,
    pub(super) enabled: bool,
    pub(super) health: String,
    pub(super) why: String,
    pub(super) ack_rate: Option<f64>,
    pub(super) ack_p50_us: Option<f64>,
    pub(super) ack_p99_us: Option<f64>,
    pub(super) lost: u64,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Preflight {
    pub(super) passed: bool,
    pub(super) answered: usize,
    pub(super) findings: Vec<Warning>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Test {
    pub(super) running: bool,
    pub(super) step: String,
    pub(super) done: u64,
    pub(super) total: u64,
    pub(super) rows: Vec<TestRow>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct TestRow {
    pub(super) controller: String,
    pub(super) part: String,
    pub(super) asked: u64,
    pub(super) acked: u64,
    pub(super) p50_us: Option<f64>,
    pub(super) p99_us: Option<f64>,
    pub(super) passed: bool,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Warning {
    pub(super) id: String,
    pub(super) severity: String,
    pub(super) controller: Option<String>,
    pub(super) text: String,
    pub(super) remedy: String,
}

impl Hall {
    /// State, cause, next action and position in a line; `length` of what is loaded.
    pub(super) fn line(&self, length: Option<f64>) -> String {
        let Self { state, cause, next, position_s } = self;
        let mut line = state.clone();
        for (before, text) in [(": ", cause), ("; next: ", next)] {
            if !text.is_empty() {
                line.extend([before, text]);
            }
        }
        if let Some(position) = position_s {
            line.extend(["; at ", &time(*position)]);
        }
        if let Some(length) = length {
            line.extend([" of ", &time(length)]);
        }
        line
    }
}

impl Status {
    /// State, cause, next action and position in a line.
    pub(super) fn line(&self) -> String {
        let show = self.show.as_ref();
        let hall = Hall { position_s: show.map(|show| show.position_s), ..self.hall.clone() };
        hall.line(show.map(|show| show.length_s))
    }

    /// Levels, effects and trim in a line.
    pub(super) fn mix(&self) -> String {
        let Levels { motion, vibration, effects, rows } = &self.levels;
        let mut line = format!("motion {}, vibration {}", percent(*motion), percent(*vibration));
        for (row, level) in rows.iter().filter(|(_, level)| **level < 1.0) {
            line.push_str(&format!(", row {row} {}", percent(*level)));
        }
        for name in effects.iter().filter(|(_, on)| !**on).map(|(name, _)| name) {
            line.push_str(&format!(", {name} off"));
        }
        line.push_str(&format!(", trim {:+} ms", self.trim_ms));
        line
    }
}

impl Controller {
    /// How it stands, and whether it is out.
    pub(super) fn stands(&self) -> String {
        let off = if self.enabled || self.is_out_for_good() { "" } else { ", off" };
        format!("{}{off}", self.health)
    }

    /// True if the configuration has it out, so that nobody counts it.
    pub(super) fn is_out_for_good(&self) -> bool {
        self.health == "out"
    }
}

impl Warning {
    /// What is the matter and what to do, in a line.
    pub(super) fn line(&self) -> String {
        let Self { severity, id, remedy, .. } = self;
        let remedy = if remedy.is_empty() { String::new() } else { format!("; {remedy}") };
        format!("{severity} {id}: {}{remedy}", self.said())
    }

    /// What is the matter, and whose it is.
    pub(super) fn said(&self) -> String {
        let about = self.controller.as_ref().map_or_else(String::new, |name| format!("{name}: "));
        about + &self.text
    }
}

/// A position as a person writes it.
pub(super) fn time(seconds: f64) -> String {
    ShowTime::from_secs_f64(seconds).to_string()
}

/// A level as a person writes it.
pub(super) fn percent(level: f64) -> String {
    format!("{:.0} %", level * 100.0)
}

/// µs, `-` where there are none.
pub(super) fn us(us: Option<f64>) -> String {
    us.map_or_else(|| "-".to_owned(), |us| if us < 10.0 { format!("{us:.1}") } else { format!("{us:.0}") })
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATUS: &str = r#"{"hall":"Hall 1","state":"playing","cause":"go by anna","next":"pause or stop",
        "show":{"cue":"coaster","length_s":200.0,"position_s":70.12},"trim_ms":80,
        "levels":{"motion":0.6,"vibration":1.0,"effects":{"air":true,"water":false},"rows":{"A":0.5,"B":1.0}},
        "a_field_of_a_later_version":{}}"#;

    #[test]
    fn a_status_is_told_in_a_line() {
        let status: Status = serde_json::from_str(STATUS).unwrap();
        assert_eq!(status.line(), "playing: go by anna; next: pause or stop; at 01:10.120 of 03:20.000");
        assert_eq!(status.mix(), "motion 60 %, vibration 100 %, row A 50 %, water off, trim +80 ms");
    }

    #[test]
    fn an_empty_status_is_one_too() {
        let status: Status = serde_json::from_str("{}").unwrap();
        assert_eq!(status.line(), "");
    }
}
