//! The status of the hall. The supervisor publishes one ten times a second and after every change; every surface shows
//! this and nothing else.

use std::collections::BTreeMap;

use serde::Serialize;
use utoipa::ToSchema;

use super::Levels;
use crate::state::{Cause, Next, State};

/// The layout of [`Status`] and of the report of a play: the number goes up when a field changes its name or its meaning. 1 was that
/// of 0.1.
pub const FORMAT: u32 = 2;

/// The whole status of the hall.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Status {
    /// The layout of this document, 2 since kinocue 0.2: the number goes up when a field changes its name or its meaning.
    pub format: u32,
    /// The name of the hall.
    pub hall: String,
    /// The version of the program.
    pub version: &'static str,
    /// Seconds since the program started.
    pub uptime_s: f64,
    /// One word: `boot`, `recovering`, `parked`, `homing`, `armed`, `joining`, `playing`, `holding`, `paused`, `parking`,
    /// `stopping`, `stopped` or `fault`.
    pub state: &'static str,
    /// Why it is in that state.
    pub cause: String,
    /// What a person does next.
    pub next: String,
    /// True if arming homes the seats first, which is for empty seats alone.
    pub arm_homes: bool,
    /// True if there is something to clear: the hall, or controllers that wait for it.
    pub may_clear: bool,
    /// Seconds since it is in that state.
    pub since_s: f64,
    /// Seconds until that state ends by itself; null if it does not.
    pub lapses_s: Option<f64>,
    /// True if motion frames leave.
    pub moving: bool,
    /// What is loaded.
    pub show: Option<ShowStatus>,
    /// The playlist that is loaded.
    pub playlist: Option<PlaylistStatus>,
    /// How much later than the film the motion is, ms.
    pub trim_ms: i32,
    /// Levels and effects as they are set.
    pub levels: Levels,
    /// The names of the presets.
    pub presets: Vec<String>,
    /// Ticks since the program started.
    pub ticks: u64,
    /// Ticks slept through.
    pub missed_ticks: u64,
    /// Ticks per second.
    pub rate_hz: f64,
    /// Lateness of the ticks that sent, since the program started.
    pub lateness: Percentiles,
    /// Latency of all acks, since the program started.
    pub ack_latency: Percentiles,
    /// What the system granted the tick thread.
    pub realtime: RealTimeStatus,
    /// Every controller, in the order of the configuration.
    pub controllers: Vec<ControllerStatus>,
    /// The last preflight.
    pub preflight: Option<PreflightStatus>,
    /// The test of axes and effects that runs, or the last one.
    pub test: Option<TestStatus>,
    /// What a person should know, gravest first.
    pub warnings: Vec<Warning>,
    /// The newest lines of the journal, newest first, at most 20.
    pub journal: Vec<JournalLine>,
}

impl Status {
    /// That of a hall of which nothing is known yet.
    #[must_use]
    pub fn starting(hall: &str) -> Self {
        Self {
            hall: hall.to_owned(),
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            uptime_s: 0.0,
            state: State::Boot.word(),
            cause: Cause::Started.to_string(),
            next: Next::AwaitAnswers.to_string(),
            arm_homes: false,
            may_clear: false,
            since_s: 0.0,
            lapses_s: None,
            moving: false,
            show: None,
            playlist: None,
            trim_ms: 0,
            levels: Levels { motion: 1.0, vibration: 1.0, effects: BTreeMap::new(), rows: BTreeMap::new() },
            presets: Vec::new(),
            ticks: 0,
            missed_ticks: 0,
            rate_hz: 0.0,
            lateness: Percentiles::default(),
            ack_latency: Percentiles::default(),
            realtime: RealTimeStatus::default(),
            controllers: Vec::new(),
            preflight: None,
            warnings: Vec::new(),
            test: None,
            journal: Vec::new(),
        }
    }
}

/// What is loaded, and where in it the hall is.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ShowStatus {
    /// The id of the cue.
    pub cue: String,
    /// Its title.
    pub title: Option<String>,
    /// SHA-256 of its file, hexadecimal.
    pub sha256: String,
    /// How long it is, s.
    pub length_s: f64,
    /// Where the film is in it, s.
    pub position_s: f64,
    /// How long the first move onto it takes, s.
    pub join_s: f64,
    /// Where the film was when its last show ended before the cue did, s: a go may go on from there (`from_s`); null where
    /// there is nothing to go on from.
    pub resume_s: Option<f64>,
    /// How many axes it has.
    pub axes: usize,
    /// The effects that it uses.
    pub effects: Vec<String>,
}

/// A playlist, and where in it the hall is.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PlaylistStatus {
    /// Its id.
    pub id: String,
    /// Its title.
    pub title: String,
    /// Its entries.
    pub entries: Vec<EntryStatus>,
    /// Which entry is loaded, counted from 0.
    pub current: usize,
    /// When the next one starts by itself, RFC 3339; null if none does.
    pub next_start: Option<String>,
}

/// One entry of a playlist.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct EntryStatus {
    /// The id of the cue.
    pub cue: String,
    /// Its title.
    pub title: Option<String>,
    /// How long it is, s.
    pub length_s: f64,
    /// The preset that is set before its own levels; null if there is none.
    pub preset: Option<String>,
    /// The level of its motion, 0 to 1; null if the preset's or the hall's stays.
    pub level: Option<f64>,
    /// Its trim, ms; null if the hall's stays.
    pub trim_ms: Option<i32>,
    /// What follows its end: `hold` (a person goes on) or `go`.
    pub then: &'static str,
    /// The time of day at which it starts, HH:MM or HH:MM:SS; null if a person starts it.
    pub at: Option<String>,
}

/// Percentiles in µs; null if nothing was counted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct Percentiles {
    /// Half of them are no longer.
    pub p50_us: Option<f64>,
    /// 99 of 100.
    pub p99_us: Option<f64>,
    /// 999 of 1,000.
    pub p999_us: Option<f64>,
    /// The longest.
    pub max_us: Option<f64>,
    /// How many there are.
    pub histogram: Histogram,
}

/// Counts by size.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct Histogram {
    /// The upper bounds, µs, each twice the one before or less; the last bucket has none.
    pub bounds_us: Vec<f64>,
    /// How many are in each bucket, one more than bounds.
    pub counts: Vec<u64>,
    /// The sum of all, s.
    pub sum_s: f64,
}

/// What the system granted the tick thread.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, ToSchema)]
pub struct RealTimeStatus {
    /// Scheduling policy: `fifo`, `other` …
    pub policy: String,
    /// Its priority; 0 for policies without one.
    pub priority: u8,
    /// True if memory is locked.
    pub memory_locked: bool,
    /// What was refused, each with what to do.
    pub refusals: Vec<String>,
}

/// One controller.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct ControllerStatus {
    /// Its name.
    pub name: String,
    /// The row its seat stands in.
    pub row: Option<String>,
    /// Its seat type.
    pub seat: String,
    /// Its address and port.
    pub address: String,
    /// Whom it shares a rigid seat with.
    pub group: String,
    /// True if it is to take part.
    pub enabled: bool,
    /// `ok`, `degraded`, `lost`, `rejoining`, `stopped`, `error`, `excluded`, `unwatched`, `unknown`, or
    /// `out` where the configuration has it out for good.
    pub health: &'static str,
    /// Why it stands so, and what to do.
    pub why: String,
    /// Seconds since it was last heard; null if it never was.
    pub heard_s: Option<f64>,
    /// Acks over frames that asked, in the last second; null if none asked.
    pub ack_rate: Option<f64>,
    /// Latency of its acks since the program started.
    pub ack_p50_us: Option<f64>,
    /// 99 of 100 of them are no longer.
    pub ack_p99_us: Option<f64>,
    /// Frames since the program started: handed to the kernel.
    pub sent: u64,
    /// Of these: asked for a reply.
    pub asked: u64,
    /// Of these: acked.
    pub acked: u64,
    /// Refused, x = 3, 4, 5.
    pub refused: u64,
    /// Not answered within a second.
    pub lost: u64,
    /// Not taken by the kernel.
    pub send_failed: u64,
    /// How often the limiter held its motion back.
    pub clamps: u64,
    /// True if it knows its position; null if it never told.
    pub homed: Option<bool>,
    /// True if an emergency stop is in effect.
    pub emergency_stop: bool,
    /// Its error number; null if it never told.
    pub error: Option<u16>,
    /// Error number of each drive; null if it never told.
    pub servo_errors: Option<Vec<u16>>,
    /// Inputs, bit 0 = X01; null if it never told.
    pub inputs: Option<u16>,
    /// Inputs of belts that are open, from 1 for X01; null if it has no belts, or has not told lately.
    pub belts_open: Option<Vec<u8>>,
    /// Outputs, bit 0 = Y01; null if it never told.
    pub outputs: Option<u16>,
    /// Where its axes are, mm: measured where it measures, else as it was commanded; null if nobody knows.
    pub positions_mm: Option<Vec<f64>>,
}

/// What the last preflight found.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PreflightStatus {
    /// True if nothing fails.
    pub passed: bool,
    /// Seconds since then.
    pub age_s: f64,
    /// How many controllers answered.
    pub answered: usize,
    /// The findings that are no `ok`, gravest first.
    pub findings: Vec<Warning>,
}

/// A test that moves each axis and switches each effect in turn.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct TestStatus {
    /// True if it runs; if not, the rows are its result.
    pub running: bool,
    /// What it does at present, or how it ended, in a few words.
    pub step: String,
    /// How many axes and effects have been through it.
    pub done: usize,
    /// How many it has to go through.
    pub total: usize,
    /// What has been through it so far, in the order of the test.
    pub rows: Vec<TestRow>,
}

/// What a test found of one axis or effect of one controller.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct TestRow {
    /// The controller.
    pub controller: String,
    /// The axis, `a1` and on, or the name of the effect.
    pub part: String,
    /// Frames that asked for a reply meanwhile.
    pub asked: u64,
    /// Of these: acked.
    pub acked: u64,
    /// Ack latency meanwhile, µs: half of them are no longer; null if none was acked.
    pub p50_us: Option<f64>,
    /// 99 of 100 of them are no longer, µs.
    pub p99_us: Option<f64>,
    /// True if the controller took part as it should.
    pub passed: bool,
}

/// How grave something is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Good to know.
    Info,
    /// Worth a look.
    Warning,
    /// The show suffers.
    Error,
}

/// Something that a person should know.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct Warning {
    /// Stable, for programs: `not-real-time`, `controller-lost` …
    pub id: String,
    /// How grave it is.
    pub severity: Severity,
    /// The controller it is about; null if it is the hall.
    pub controller: Option<String>,
    /// What is the matter.
    pub text: String,
    /// What to do.
    pub remedy: String,
}

/// One thing that somebody asked.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct JournalLine {
    /// When, RFC 3339.
    pub at: String,
    /// Who.
    pub who: String,
    /// What, in the words of the surface.
    pub what: String,
    /// What came of it: `done`, or why not.
    pub result: String,
    /// How often the same was asked in a row.
    pub times: u32,
}
