//! The status of the hall. The supervisor publishes one ten times a second and after every change; every surface shows
//! this and nothing else.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

mod facts;
mod film;
mod fleet;
mod margin;

pub(crate) use facts::HallFacts;
pub(crate) use film::{FilmDisagreement, FilmSourceStatus, FilmStatus};
pub(crate) use fleet::{ArmedForStatus, ClockStatus, FleetStatus, StartPhase, StartStatus};
pub(crate) use margin::{MarginOf, MarginStatus};

use super::Levels;
use super::broadcasts::BroadcastStatus;
use super::links::LinkStatus;
use super::model::{Coded, FrameCounts, Health, Severity, Then, Times, Word};
use crate::state::{Cause, Next, State};

/// The layout of [`Status`] and of the report of a play: the number goes up when a field changes its name or its meaning. 1 was that
/// of 0.1.
pub(crate) const FORMAT: u32 = 2;

/// The whole status of the hall.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct Status {
    /// The layout of this document, 2 since kinocue 0.2: the number goes up when a field changes its name or its meaning.
    pub format: u32,
    /// The name of the hall.
    pub hall: String,
    /// The zone in which people read the times of the hall: that of its playlist, else that of the server. A name of the IANA database, or an
    /// offset as `+01:00` where it has none.
    pub timezone: String,
    /// The version of the program.
    pub version: String,
    /// Seconds since the program started.
    pub uptime_s: f64,
    /// One word: `boot`, `recovering`, `parked`, `homing`, `armed`, `joining`, `playing`, `holding`, `paused`, `parking`,
    /// `stopping`, `stopped` or `fault`.
    #[schema(value_type = String)]
    pub state: Word<State>,
    /// Why it is in that state.
    pub cause: String,
    /// The code of the cause; it names whose doing that is.
    pub cause_coded: Coded,
    /// What a person does next.
    pub next: String,
    /// The code of that.
    pub next_coded: Coded,
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
    /// What takes long and is under way: `loading`, `playlist`, `test`, `preflight` or `homing`; null if nothing is. While something is
    /// loaded, or seats are tested, `show` and `playlist` say nothing of what is loaded afterwards.
    pub job: Option<String>,
    /// What is loaded.
    pub show: Option<ShowStatus>,
    /// The playlist that is loaded.
    pub playlist: Option<PlaylistStatus>,
    /// The film that leads shows; null where each show is its own film.
    pub film: Option<FilmStatus>,
    /// What came to the port for OSC since the program started, by what became of it: datagrams `received`, of these `foreign` (from
    /// no source) and `malformed`; messages `refused`, `forbidden`, `early`, `repeated`, `done` and `not_done`; feedback `unsent`.
    /// Left out where there is no such port.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub osc: Option<BTreeMap<String, u64>>,
    /// The pads of `[buttons]`; left out where there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub buttons: Vec<ButtonsStatus>,
    /// The ways of `[notify]`; left out where there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notify: Vec<NotifyStatus>,
    /// What the fleet may start here; left out in a hall of no fleet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fleet: Option<FleetStatus>,
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
    pub lateness: Times,
    /// Latency of the acks of controllers on the network, since the program started.
    pub ack_latency: Times,
    /// The same of seats on links, whose drives have a frame long before they execute it; left out where there were none.
    #[serde(skip_serializing_if = "Times::is_none")]
    pub link_ack_latency: Times,
    /// What the system granted the tick thread.
    pub realtime: RealTimeStatus,
    /// Every controller, in the order of the configuration.
    pub controllers: Vec<ControllerStatus>,
    /// Every serial link that has seats; left out where there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub links: Vec<LinkStatus>,
    /// Every network of `[broadcast]`; left out where there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub broadcasts: Vec<BroadcastStatus>,
    /// The last preflight.
    pub preflight: Option<PreflightStatus>,
    /// The test of axes and effects that runs, or the last one.
    pub test: Option<TestStatus>,
    /// What a person should know, gravest first.
    pub warnings: Vec<Warning>,
    /// What is recorded; left out where nothing is.
    #[serde(skip_serializing_if = "RecordStatus::is_nothing")]
    pub record: RecordStatus,
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
            version: env!("CARGO_PKG_VERSION").to_owned(),
            state: State::Boot.into(),
            cause: Cause::Started.to_string(),
            cause_coded: Coded::new(Cause::Started.code(), []),
            next: Next::AwaitAnswers.to_string(),
            next_coded: Coded::new(Next::AwaitAnswers.code(), []),
            levels: Levels { motion: 1.0, vibration: 1.0, ..Levels::default() },
            ..Self::default()
        }
    }
}

/// A pad whose buttons ask something of the hall.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct ButtonsStatus {
    /// Its name in the configuration.
    pub name: String,
    /// Its device, or the relay that has it.
    pub device: String,
    /// True while its buttons are heard.
    pub works: bool,
    /// Why they are not, and what to do.
    pub trouble: Option<String>,
    /// Presses that asked something since the program started.
    pub presses: u64,
    /// What the last one asked.
    pub last: Option<String>,
}

/// A way by which alarms are told to people who are elsewhere.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct NotifyStatus {
    /// `webhook` or `mail`.
    pub way: String,
    /// Messages that were sent since the program started.
    pub sent: u64,
    /// Messages that were given up.
    pub lost: u64,
    /// Why the last one was not sent, and what to do.
    pub trouble: Option<String>,
}

/// What is recorded, since the hall was opened with its configuration.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct RecordStatus {
    /// How much of shows is kept: `off`, `sampled` or `full`.
    pub(crate) mode: String,
    /// The file that is being written of a show; null if there is none.
    pub(crate) recording: Option<String>,
    /// The file that was whole last; null if there is none yet.
    pub(crate) last: Option<String>,
    /// How far back the flight recorder reaches, s; 0 if there is none.
    pub(crate) flight_s: f64,
    /// Bytes of all files that were closed.
    pub(crate) bytes: u64,
    /// Bytes that are free on the disk of recordings.
    pub(crate) free_bytes: u64,
    /// Ticks that were not recorded.
    pub(crate) dropped_ticks: u64,
    /// Records of replies that were not recorded.
    pub(crate) dropped_records: u64,
    /// Events and commands that were not recorded.
    pub(crate) dropped_notes: u64,
    /// Incidents by what they are of; what joined one that was under way is counted, too.
    pub(crate) incidents: BTreeMap<String, u64>,
    /// Moments that were marked.
    pub(crate) marks: u64,
    /// Marks that were not kept: within a second of another, or more than 60 and one a minute.
    pub(crate) more_marks: u64,
    /// How often something could not be written.
    pub(crate) errors: u64,
    /// What is wrong, and what to do, by what it is of: `show`, `incident`, `flight`, `earlier`, `room`; empty if all is well.
    pub(crate) troubles: BTreeMap<String, String>,
}

impl RecordStatus {
    fn is_nothing(&self) -> bool {
        *self == Self::default()
    }
}

/// What is loaded, and where in it the hall is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct ShowStatus {
    /// The id of the cue.
    pub(crate) cue: String,
    /// Its title.
    pub(crate) title: Option<String>,
    /// SHA-256 of its file, hexadecimal.
    pub(crate) sha256: String,
    /// How long it is, s.
    pub(crate) length_s: f64,
    /// Where the film is in it, s.
    pub(crate) position_s: f64,
    /// How long the first move onto it takes, s.
    pub(crate) join_s: f64,
    /// Where the film was when its last show ended before the cue did, s: a go may go on from there (`from_s`); null where
    /// there is nothing to go on from.
    pub(crate) resume_s: Option<f64>,
    /// How many axes it has.
    pub(crate) axes: usize,
    /// The effects and outputs that it uses, by the names of their switches.
    pub(crate) effects: Vec<String>,
    /// What it leaves of each limit at full level, where it leaves least.
    pub(crate) margins: Vec<MarginStatus>,
}

/// A playlist, and where in it the hall is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct PlaylistStatus {
    /// Its id.
    pub(crate) id: String,
    /// Its title.
    pub(crate) title: String,
    /// Its entries.
    pub(crate) entries: Vec<EntryStatus>,
    /// Which entry is loaded, counted from 0.
    pub(crate) current: usize,
    /// When the next one starts by itself, RFC 3339 with the offset of the hall's zone; null if none does.
    pub(crate) next_start: Option<String>,
}

/// One entry of a playlist.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct EntryStatus {
    /// The id of the cue.
    pub(crate) cue: String,
    /// Its title.
    pub(crate) title: Option<String>,
    /// How long it is, s.
    pub(crate) length_s: f64,
    /// The preset that is set before its own levels; null if there is none.
    pub(crate) preset: Option<String>,
    /// The level of its motion, 0 to 1; null if the preset's or the hall's stays.
    pub(crate) level: Option<f64>,
    /// Its trim, ms; null if the hall's stays.
    pub(crate) trim_ms: Option<i32>,
    /// The film that the player shows for it, as the playlist names it; null if it names none.
    pub(crate) movie: Option<String>,
    /// What follows its end: `hold` (a person goes on) or `go`.
    pub(crate) then: Then,
    /// The time of day at which it starts, HH:MM or HH:MM:SS, in the zone of the hall; null if a person starts it.
    pub(crate) at: Option<String>,
    /// Seconds until that is next; null if a person starts it.
    pub(crate) starts_in_s: Option<f64>,
    /// What whoever runs the show is told of it; null if the playlist says nothing.
    pub(crate) note: Option<String>,
}

/// What the system granted the tick thread.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct RealTimeStatus {
    /// Scheduling policy: `fifo`, `other` …
    pub(crate) policy: String,
    /// Its priority; 0 for policies without one.
    pub(crate) priority: u8,
    /// True if memory is locked.
    pub(crate) memory_locked: bool,
    /// What was refused, each with what to do.
    pub(crate) refusals: Vec<String>,
}

/// One controller.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
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
    pub health: Health,
    /// Why it stands so, and what to do.
    pub why: String,
    /// The code of why it stands so.
    pub why_coded: Coded,
    /// Seconds since it was last heard; null if it never was.
    pub heard_s: Option<f64>,
    /// Acks over frames that asked, in the last second; null if none asked.
    pub ack_rate: Option<f64>,
    /// Latency of its acks since the program started.
    pub ack_p50_us: Option<f64>,
    /// 99 of 100 of them are no longer.
    pub ack_p99_us: Option<f64>,
    /// Its frames since the program started.
    #[serde(flatten)]
    pub frames: FrameCounts,
    /// Not taken by the kernel.
    pub send_failed: u64,
    /// How often the limiter held its motion back.
    pub clamps: u64,
    /// True if it knows its position; null if it has not told, as while it is homed.
    pub homed: Option<bool>,
    /// True if an emergency stop is in effect.
    pub emergency_stop: bool,
    /// Its error number; null if it never told.
    pub error: Option<u16>,
    /// Error number of each drive; null if it never told.
    pub servo_errors: Option<Vec<u16>>,
    /// Torque of each axis as its status reports have it, in their own unit; null if none came within the last seconds.
    pub forces: Option<Vec<i16>>,
    /// Inputs, bit 0 = X01; null if it never told.
    pub inputs: Option<u16>,
    /// Inputs of belts that are open, from 1 for X01; null if it has no belts, or has not told lately.
    pub belts_open: Option<Vec<u8>>,
    /// Outputs, bit 0 = Y01; null if it never told.
    pub outputs: Option<u16>,
    /// True if something may be on that nobody asks for: outputs, or vibration. Unknown counts as on.
    pub left_on: bool,
    /// Where its axes are, mm, and degrees of its rotary axis: as measured, unless it acked a frame more than a second later, then as
    /// that commanded; null if nobody knows.
    pub positions_mm: Option<Vec<f64>>,
    /// Where it was told to go by the last frame that it acked, parts of each axis's range, 0 to 1; null before the first.
    pub commanded: Option<Vec<f64>>,
    /// Where it measured its axes, parts of each axis's range; null if it never did, or acked a frame more than a second later.
    pub measured: Option<Vec<f64>>,
    /// How many axes of a cue come before its own.
    pub axis_offset: usize,
    /// Its rotary axis, from 1; left out if it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotary_axis: Option<usize>,
}

/// What the last preflight found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct PreflightStatus {
    /// True if nothing fails.
    pub(crate) passed: bool,
    /// Seconds since then.
    pub(crate) age_s: f64,
    /// How many controllers answered.
    pub(crate) answered: usize,
    /// The findings that are no `ok`, gravest first.
    pub(crate) findings: Vec<Warning>,
}

/// A test that moves each axis and switches each effect in turn.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct TestStatus {
    /// True if it runs; if not, the rows are its result.
    pub(crate) running: bool,
    /// What it does at present, or how it ended, in a few words.
    pub(crate) step: String,
    /// How many axes and effects have been through it.
    pub(crate) done: usize,
    /// How many it has to go through.
    pub(crate) total: usize,
    /// What has been through it so far, in the order of the test.
    pub(crate) rows: Vec<TestRow>,
}

/// What a test found of one axis or effect of one controller.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct TestRow {
    /// The controller.
    pub(crate) controller: String,
    /// The axis, `a1` and on, or the name of the effect.
    pub(crate) part: String,
    /// Frames that asked for a reply meanwhile.
    pub(crate) asked: u64,
    /// Of these: acked.
    pub(crate) acked: u64,
    /// Ack latency meanwhile, µs: half of them are no longer; null if none was acked.
    pub(crate) p50_us: Option<f64>,
    /// 99 of 100 of them are no longer, µs.
    pub(crate) p99_us: Option<f64>,
    /// True if the controller took part as it should.
    pub(crate) passed: bool,
}

/// Something that a person should know.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct Warning {
    /// Stable, for programs: `not-real-time`, `controller-lost` …
    pub(crate) id: String,
    /// How grave it is.
    pub(crate) severity: Severity,
    /// The controller it is about; null if it is the hall.
    pub(crate) controller: Option<String>,
    /// What is the matter.
    pub(crate) text: String,
    /// The code of that; of `controller-…` that of why the controller stands so. Left out where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) coded: Option<Coded>,
    /// What to do.
    pub(crate) remedy: String,
    /// The stable code of that; left out where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) remedy_code: Option<String>,
}

/// One thing that somebody asked.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
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
