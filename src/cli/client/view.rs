//! The daemon's status in lines for people.

use crate::control::{ControllerStatus, HallFacts, Health, Levels, Status, Warning};
use crate::state::State;
use crate::time::ShowTime;

impl HallFacts {
    /// State, cause, next action and position in a line; `length` of what is loaded.
    pub(in crate::cli) fn line(&self, length: Option<f64>) -> String {
        let Self { state, cause, next, position_s } = self;
        let mut line = state.to_string();
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
    pub(in crate::cli) fn line(&self) -> String {
        HallFacts::from(self).line(self.show.as_ref().map(|show| show.length_s))
    }

    /// Levels, effects and trim in a line.
    pub(in crate::cli) fn mix(&self) -> String {
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

impl ControllerStatus {
    /// How it stands, and whether it is out.
    pub(in crate::cli) fn stands(&self) -> String {
        let off = if self.enabled || self.is_out_for_good() { "" } else { ", off" };
        format!("{}{off}", self.health)
    }

    /// True if the configuration has it out, so that nobody counts it.
    pub(in crate::cli) fn is_out_for_good(&self) -> bool {
        self.health == Health::Out
    }
}

impl Warning {
    /// What is the matter and what to do, in a line.
    pub(in crate::cli) fn line(&self) -> String {
        let Self { severity, id, remedy, .. } = self;
        let remedy = if remedy.is_empty() { String::new() } else { format!("; {remedy}") };
        format!("{severity} {id}: {}{remedy}", self.said())
    }

    /// What is the matter, and whose it is.
    pub(in crate::cli) fn said(&self) -> String {
        let about = self.controller.as_ref().map_or_else(String::new, |name| format!("{name}: "));
        about + &self.text
    }
}

/// When an entry of the playlist starts by itself next, in how long, and what has to be true for it; none if none does.
pub(super) fn next_start(status: &Status) -> Option<String> {
    let list = status.playlist.as_ref()?;
    let at = list.next_start.as_ref()?.get(..19)?.replace('T', " ");
    let wait = list.entries.iter().filter_map(|entry| entry.starts_in_s).fold(f64::INFINITY, f64::min);
    let only = match status.lapses_s {
        _ if status.state != State::Armed => ", if armed".to_owned(),
        Some(lapses) if lapses < wait => {
            format!("; arming lapses before that, in {}: arm again", lasting(lapses))
        }
        _ => String::new(),
    };
    Some(format!("{at} {}, in {}{only}", status.timezone, lasting(wait)))
}

/// How long, as people say it: `40 s`, `12 min`, `3 h 5 min`.
fn lasting(seconds: f64) -> String {
    let minutes = (seconds / 60.0).floor();
    match seconds {
        s if s < 120.0 => format!("{:.0} s", s.floor()),
        s if s < 7_200.0 => format!("{minutes:.0} min"),
        _ => format!("{:.0} h {:.0} min", (minutes / 60.0).floor(), minutes % 60.0),
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
    fn a_start_has_its_zone_a_countdown_and_what_is_in_its_way() {
        let told = |state: &str, lapses: &str| {
            let json = format!(
                r#"{{"state":"{state}","timezone":"Europe/Berlin","lapses_s":{lapses},"playlist":{{"id":"day",
                    "next_start":"2026-11-21T19:13:00.000+01:00",
                    "entries":[{{"cue":"a"}},{{"cue":"b","starts_in_s":9000.0}},{{"cue":"c","starts_in_s":4000.0}}]}}}}"#
            );
            next_start(&serde_json::from_str(&json).unwrap()).unwrap()
        };
        assert_eq!(told("parked", "null"), "2026-11-21 19:13:00 Europe/Berlin, in 66 min, if armed");
        assert_eq!(told("armed", "4100"), "2026-11-21 19:13:00 Europe/Berlin, in 66 min");
        let lapses =
            "2026-11-21 19:13:00 Europe/Berlin, in 66 min; arming lapses before that, in 90 s: arm again";
        assert_eq!(told("armed", "90.5"), lapses);
        assert_eq!(lasting(9_000.0), "2 h 30 min");
    }

    #[test]
    fn an_empty_status_is_one_too() {
        let status: Status = serde_json::from_str("{}").unwrap();
        assert_eq!(status.line(), "");
    }
}
