//! What surfaces may ask of the hall.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Role;
use crate::config::{FleetWord, GearWord, Preset};
use crate::time::ShowTime;

/// One thing asked of the hall. Each is answered with the state that it led to, or with a problem.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Home all controllers, with nobody on the seats.
    Home,
    /// Load a cue of the library.
    Load {
        /// Its id.
        cue: String,
    },
    /// Load a playlist, or drop the one that is loaded.
    Playlist {
        /// Its id.
        id: Option<String>,
    },
    /// Make an entry of the playlist the next to be played, counted from 0.
    Select {
        /// Which.
        entry: usize,
    },
    /// Get ready to go.
    Arm {
        /// Whoever asks says that nobody sits on the seats: where a position is unknown they are homed first. Else arming is
        /// refused then.
        seats_empty: bool,
    },
    /// Get ready for a start of that group of halls by the fleet, once.
    ArmFor(String),
    /// Start what is loaded at an instant, together with other halls: of the fleet alone, and only where a person armed for that.
    StartAt(StartOrder),
    /// That start is to come: all that were asked have it.
    Commit {
        /// Its ticket.
        ticket: String,
    },
    /// Stand down.
    Disarm,
    /// Start what is loaded.
    Go,
    /// Start what is loaded at that time of the film.
    GoFrom(ShowTime),
    /// Hold; the film waits.
    Pause,
    /// Go on.
    Resume,
    /// Go on elsewhere in the cue.
    Seek(ShowTime),
    /// Bring the seats to rest at once. Of all ways to ask, [`super::Handle::stop`] is the quick one.
    Stop,
    /// Bring the seats to their park poses.
    Park,
    /// Leave what is latched.
    Clear,
    /// How much later than the film the motion is, ms, -500 to 500.
    Trim(i32),
    /// Motion later than it is by so many frames of the film, -12 to 12.
    Nudge(i32),
    /// Have the film followed by that source, or by the ranking.
    Source(Option<String>),
    /// Change levels and effects.
    Levels(LevelsChange),
    /// Set levels and effects as the preset of that name says.
    Preset(String),
    /// Take a controller's group in.
    Enable(String),
    /// Take a controller's group out: its seat parks.
    Disable {
        /// Which.
        name: String,
        /// Why, for whoever comes next.
        why: Option<String>,
    },
    /// Ask all controllers for their registers and judge them.
    Preflight,
    /// Move each axis and effect of empty, armed seats slowly in turn, and store a table of acks and latency.
    Test {
        /// The rows whose seats move; none for all.
        rows: Vec<String>,
    },
    /// Read the configuration anew.
    Reload,
    /// Mark this moment in what is recorded, and keep what was before and after it.
    Mark {
        /// What was seen, in words.
        text: Option<String>,
    },
    /// Write out what the flight recorder holds.
    Dump,
}

/// A start of several halls at one instant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartOrder {
    /// Like no other: a start is asked once.
    pub(crate) ticket: String,
    /// The group of halls.
    pub(crate) group: String,
    /// SHA-256 of the cue that is meant, hexadecimal.
    pub(crate) sha256: String,
    /// When the film is at its beginning, Unix milliseconds.
    pub(crate) at_ms: i64,
}

/// How much of a cue the seats make.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct Levels {
    /// Of the motion about the neutral pose, 0 to 1.
    pub(crate) motion: f64,
    /// Of the vibration, 0 to 1.
    pub(crate) vibration: f64,
    /// True if each effect may be on.
    pub(crate) effects: BTreeMap<String, bool>,
    /// Of motion and vibration in each row, 0 to 1, on top of the hall's.
    pub(crate) rows: BTreeMap<String, f64>,
}

/// A change of levels; what is not named stays as it is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelsChange {
    /// Of the motion about the neutral pose, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<f64>,
    /// Of the vibration, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vibration: Option<f64>,
    /// True if an effect may be on, by its name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub effects: BTreeMap<String, bool>,
    /// Of motion and vibration in a row, 0 to 1.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub rows: BTreeMap<String, f64>,
}

impl Command {
    /// What people alone may ask: no gear and no line of text, whose senders are known by address alone.
    pub(crate) const OF_PEOPLE: [&str; 5] = ["arm", "disarm", "home", "clear", "load"];

    /// Its row of the table of commands: its word, the least role, whether it goes stale, and what gear and the fleet have to be
    /// allowed.
    const fn row(&self) -> (&'static str, Role, bool, Option<GearWord>, Option<FleetWord>) {
        use FleetWord as Fleet;
        use Role::{Engineer, Operate, View};
        const STALE: bool = true;
        const LASTS: bool = false;
        match self {
            Self::Home => ("home", Engineer, STALE, None, None),
            Self::Load { .. } => ("load", Operate, LASTS, None, Some(Fleet::Load)),
            Self::Playlist { .. } => ("playlist", Operate, LASTS, None, None),
            Self::Select { .. } => ("select", Operate, LASTS, None, None),
            // Whoever arms sees the seats, or knows who does.
            Self::Arm { .. } | Self::ArmFor(_) => ("arm", Engineer, STALE, None, None),
            Self::StartAt(_) => ("start", Operate, STALE, None, Some(Fleet::Start)),
            Self::Commit { .. } => ("commit", Operate, STALE, None, Some(Fleet::Start)),
            Self::Disarm => ("disarm", Operate, LASTS, None, Some(Fleet::Disarm)),
            Self::Go => ("go", Operate, STALE, Some(GearWord::Go), None),
            Self::GoFrom(_) => ("go", Operate, STALE, None, None),
            Self::Pause => ("pause", Operate, LASTS, Some(GearWord::Pause), Some(Fleet::Pause)),
            Self::Resume => ("resume", Operate, STALE, Some(GearWord::Resume), None),
            Self::Seek(_) => ("seek", Operate, STALE, Some(GearWord::Seek), None),
            // Whoever may look may also stop: an attacker may at worst stop the show.
            Self::Stop => ("stop", View, LASTS, None, None),
            Self::Park => ("park", Operate, STALE, Some(GearWord::Park), Some(Fleet::Park)),
            Self::Clear => ("clear", Engineer, STALE, None, None),
            Self::Trim(_) | Self::Nudge(_) => {
                ("trim", Operate, LASTS, Some(GearWord::Trim), Some(Fleet::Trim))
            }
            Self::Source(_) => ("source", Operate, LASTS, None, None),
            Self::Levels(_) => ("levels", Operate, LASTS, Some(GearWord::Levels), Some(Fleet::Levels)),
            Self::Preset(_) => ("preset", Operate, LASTS, None, None),
            Self::Enable(_) => ("enable", Operate, STALE, Some(GearWord::Seats), None),
            Self::Disable { .. } => ("disable", Operate, LASTS, Some(GearWord::Seats), None),
            Self::Preflight => ("preflight", Operate, LASTS, None, Some(Fleet::Preflight)),
            Self::Test { .. } => ("test", Engineer, STALE, None, None),
            Self::Reload => ("reload", Engineer, LASTS, None, None),
            Self::Mark { .. } => ("mark", Operate, LASTS, None, None),
            Self::Dump => ("dump", Operate, LASTS, None, None),
        }
    }

    /// The word for it on every surface.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        self.row().0
    }

    /// The least role that may ask it.
    #[must_use]
    pub(crate) const fn least_role(&self) -> Role {
        self.row().1
    }

    /// True if it is dropped once it is two seconds old: it begins a motion, or frees the way to one, in a hall that may be
    /// another by then.
    #[must_use]
    pub(crate) const fn goes_stale(&self) -> bool {
        self.row().2
    }

    /// What gear has to be allowed for it; none for what needs no leave, a stop, and for what gear has no way to ask.
    #[must_use]
    pub(crate) const fn gear_word(&self) -> Option<GearWord> {
        self.row().3
    }

    /// What the fleet has to be allowed for it; none for a stop, which needs no leave, and for what is never its to ask.
    #[must_use]
    pub(crate) const fn fleet_word(&self) -> Option<FleetWord> {
        self.row().4
    }
}

impl StartOrder {
    /// When the film is at its beginning, RFC 3339 to the millisecond.
    #[must_use]
    pub(crate) fn at(&self) -> String {
        jiff::Timestamp::from_millisecond(self.at_ms)
            .map_or_else(|_| format!("{} ms", self.at_ms), |at| format!("{at:.3}"))
    }
}

impl From<&Preset> for LevelsChange {
    fn from(preset: &Preset) -> Self {
        let Preset { motion, vibration, effects, .. } = preset;
        Self { motion: *motion, vibration: *vibration, effects: effects.clone(), rows: BTreeMap::new() }
    }
}

impl fmt::Display for Command {
    /// What was asked, as the journal has it: its word, and what it names.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())?;
        match self {
            Self::Load { cue } => write!(f, " {cue}"),
            Self::Playlist { id: Some(id) } => write!(f, " {id}"),
            Self::Playlist { id: None } => f.write_str(" none"),
            Self::Select { entry } => write!(f, " entry {}", entry.saturating_add(1)), // as people count
            Self::Seek(film) => write!(f, " {film}"),
            Self::Trim(ms) => write!(f, " {ms} ms"),
            Self::Nudge(frames) => write!(f, " {frames:+} frames"),
            Self::Source(name) => write!(f, " {}", name.as_deref().unwrap_or("by rank")),
            Self::Levels(change) => change.fmt(f),
            Self::GoFrom(film) => write!(f, " from {film}"),
            Self::Preset(name) | Self::Enable(name) | Self::Disable { name, why: None } => {
                write!(f, " {name}")
            }
            Self::Disable { name, why: Some(why) } => write!(f, " {name}: {}", why.escape_debug()),
            Self::Mark { text: Some(text) } => write!(f, " {}", text.escape_debug()),
            Self::Arm { seats_empty: true } => f.write_str(" with empty seats"),
            Self::ArmFor(group) => write!(f, " for {group}"),
            Self::StartAt(start) => write!(f, " {} at {}, ticket {}", start.group, start.at(), start.ticket),
            Self::Commit { ticket } => write!(f, " ticket {ticket}"),
            Self::Test { rows } if rows.is_empty() => f.write_str(" all rows"),
            Self::Test { rows } => write!(f, " rows {}", rows.join(", ")),
            _ => Ok(()),
        }
    }
}

impl fmt::Display for LevelsChange {
    /// Each change behind a blank.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let levels = [("motion", self.motion), ("vibration", self.vibration)];
        for (name, level) in levels.into_iter().filter_map(|(name, level)| Some((name, level?))) {
            write!(f, " {name} {:.0} %", level * 100.0)?;
        }
        for (row, level) in &self.rows {
            write!(f, " row {row} {:.0} %", level * 100.0)?;
        }
        self.effects.iter().try_for_each(|(name, on)| write!(f, " {name} {}", if *on { "on" } else { "off" }))
    }
}
