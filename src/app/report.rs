//! The report of a play: the same figures as an object for programs and as a table for people.

use std::fmt::Write as _;
use std::time::Duration;

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use serde::{Deserialize, Serialize};

use crate::config::Controller;
use crate::control::model::{Ending, FrameCounts, InMicros, Percentiles};
use crate::control::{BroadcastStatus, LinkAxisStatus, LinkStatus};
use crate::motion::{AxisGeometry, AxisUnit, Pulses};
use crate::observe::ControllerState;
use crate::rt::Spun;
use crate::sys::realtime::RealTime;
use crate::sys::terminal;
use crate::time::MonoTime;

/// What became of a play. Within one `format` fields are added, never changed.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PlayReport {
    /// The layout of this document ([`crate::control::FORMAT`]).
    pub(crate) format: u32,
    /// The cue file, as it was named.
    pub(crate) cue: String,
    /// `completed`, `stopped` or `fault`.
    pub result: Ending,
    /// Ticks that sent.
    pub(crate) ticks: u64,
    /// Ticks slept through.
    pub(crate) missed_ticks: u64,
    /// Ticks per second.
    pub(crate) rate_hz: f64,
    /// Lateness of the ticks that sent, µs.
    #[serde(with = "InMicros")]
    pub(crate) lateness_us: Percentiles,
    /// What the system granted.
    pub(crate) realtime: RealTimeReport,
    /// Datagrams on the frame port from nobody we sent to.
    pub(crate) strangers: u64,
    /// One entry for each controller.
    pub(crate) controllers: Vec<ControllerReport>,
    /// One entry for each serial link; left out where there is none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub links: Vec<LinkStatus>,
    /// One entry for each network of `[broadcast]`; left out where there is none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) broadcasts: Vec<BroadcastStatus>,
    /// What happened to the controllers, oldest first.
    pub(crate) events: Vec<EventReport>,
    /// Why its recording ended early, in a sentence; left out where it did not, or there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) recording_trouble: Option<String>,
}

/// Something that happened to a controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct EventReport {
    /// The controller's name.
    pub(crate) controller: String,
    /// Seconds from tick 0, below zero before it.
    pub(crate) at_s: f64,
    /// What, in words.
    pub(crate) what: String,
}

/// The last known state of a controller; null if it never told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct StateReport {
    /// Seconds since it was last heard.
    pub(crate) heard_s_ago: Option<f64>,
    /// True if an emergency stop is in effect.
    pub(crate) emergency_stop: bool,
    /// Its error number (chapter 6 of the manuals); 0 for none.
    pub(crate) error: Option<u16>,
    /// Error number of each drive; 0 for none.
    pub(crate) servo_errors: Option<Vec<u16>>,
    /// Inputs, bit 0 = X01.
    pub(crate) inputs: Option<u16>,
    /// Outputs, bit 0 = Y01, as it reports them.
    pub(crate) outputs: Option<u16>,
    /// Measured positions, pulses; an echo of the command is none.
    pub(crate) measured: Option<Vec<i32>>,
    /// The same, each in the unit of its axis.
    pub(crate) places: Option<Vec<Place>>,
    /// Seconds since they were measured.
    pub(crate) measured_s_ago: Option<f64>,
    /// Force of each axis, in the drive's own unit.
    pub(crate) forces: Option<Vec<i16>>,
    /// Reports that it sent unasked.
    pub(crate) reports: u64,
}

/// Where an axis is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Place {
    /// From the zero of its axis.
    pub(crate) at: f64,
    /// `mm` or `deg`.
    pub(crate) unit: AxisUnit,
}

impl StateReport {
    /// The state of a controller as it was known at `now`.
    #[must_use]
    pub(crate) fn of(controller: &Controller, state: &ControllerState, now: MonoTime) -> Self {
        let seconds = |at: MonoTime| now.since(at).as_secs_f64();
        Self {
            heard_s_ago: state.heard_at.map(seconds),
            emergency_stop: state.emergency_stop(),
            error: state.error.map(|heard| heard.value),
            servo_errors: state.servo_errors.map(|heard| heard.value.to_vec()),
            inputs: state.inputs.map(|heard| heard.value),
            outputs: state.outputs.map(|heard| heard.value),
            measured: state.measured.map(|heard| heard.value.iter().map(|pulses| pulses.0).collect()),
            places: state.measured.map(|heard| {
                let place = |(axis, pulses): (&AxisGeometry, &Pulses)| Place {
                    at: (axis.place(axis.fraction(*pulses)) * 1e3).round() / 1e3,
                    unit: axis.unit,
                };
                controller.seat.own().iter().zip(heard.value.iter()).map(place).collect()
            }),
            measured_s_ago: state.measured.map(|heard| seconds(heard.at)),
            forces: state.forces.map(|heard| heard.value.to_vec()),
            reports: state.reports,
        }
    }
}

/// What the system granted, as read back from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RealTimeReport {
    /// Scheduling policy of the tick thread: `fifo`, `other` …
    pub(crate) policy: String,
    /// Its priority; 0 for policies without one.
    pub(crate) priority: u8,
    /// True if memory is locked.
    pub(crate) memory_locked: bool,
    /// How long the tick thread spun before each deadline.
    pub(crate) spin_us: SpinReport,
}

/// How long a play spun before each deadline, µs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SpinReport {
    /// What was asked for.
    pub(crate) asked: f64,
    /// What was in effect, so that spin and work together stay under 90 % of the period: the mean of all ticks.
    pub(crate) in_effect: f64,
}

impl RealTimeReport {
    /// What the system granted, and how long was spun.
    #[must_use]
    pub(crate) fn of(granted: &RealTime, spun: Spun) -> Self {
        let us = |span: Duration| (span.as_secs_f64() * 1e7).round() / 10.0;
        Self {
            policy: granted.policy.to_string(),
            priority: granted.priority,
            memory_locked: granted.memory_locked,
            spin_us: SpinReport { asked: us(spun.asked), in_effect: us(spun.granted) },
        }
    }

    fn text(&self) -> String {
        let Self { policy, priority, memory_locked, spin_us } = self;
        let locked = if *memory_locked { "locked" } else { "not locked" };
        let SpinReport { asked, in_effect } = spin_us;
        let spin = if *asked > 0.0 {
            format!("spin {in_effect} of {asked} µs asked")
        } else {
            "no spin".to_owned()
        };
        format!("policy {policy}, priority {priority}, memory {locked}, {spin}")
    }
}

/// What became of one controller's frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ControllerReport {
    /// Its name.
    pub(crate) name: String,
    /// Where it is reached.
    pub(crate) address: String,
    /// Its frames; in the end asked is always acked + refused + lost + withdrawn.
    #[serde(flatten)]
    pub(crate) frames: FrameCounts,
    /// Slow frames before tick 0, which brought it to its park pose.
    pub(crate) park_frames: u64,
    /// Further replies to an answered frame.
    pub(crate) duplicate: u64,
    /// Replies after 1 s.
    pub(crate) stale: u64,
    /// Datagrams from its address that are no reply to a frame.
    pub(crate) stray: u64,
    /// Frames that the kernel did not take.
    pub(crate) send_failed: u64,
    /// Reports of the kernel that its port is closed.
    pub(crate) port_closed: u64,
    /// Times that the limiter held its motion back.
    pub(crate) clamps: u64,
    /// Frames that were not sent, because from somewhere that its seat might be they would have been too fast.
    pub(crate) withheld: u64,
    /// Times that it was not known any more which frames arrive.
    pub(crate) gaps: u64,
    /// Frames that found it busy with one before, by the sum of their Times, and were late by that.
    pub(crate) late: u64,
    /// Of these, frames that found it with more than two to do, and were hurried for that (PA06).
    pub(crate) hurried: u64,
    /// Ack latency, µs.
    #[serde(with = "InMicros")]
    pub(crate) ack_us: Percentiles,
    /// What it last said of itself.
    pub(crate) state: StateReport,
}

impl PlayReport {
    /// The figures as people read them, with a table of the controllers.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        let late = &self.lateness_us;
        let lines = [
            ("result", format!("{} ({})", self.result, self.cue)),
            ("ticks", format!("{} at {} Hz, {} missed", self.ticks, self.rate_hz, self.missed_ticks)),
            (
                "lateness",
                format!(
                    "p50 {} µs, p99 {} µs, p99.9 {} µs, max {} µs",
                    shown(late.p50_us),
                    shown(late.p99_us),
                    shown(late.p999_us),
                    shown(late.max_us)
                ),
            ),
            ("real time", self.realtime.text()),
            ("strangers", format!("{} datagrams", self.strangers)),
        ];
        for (name, value) in lines {
            writeln!(text, "{name:<10} {value}").expect("a String takes what is written to it");
        }
        text.push('\n');
        text.push_str(&self.table().to_string());
        for link in &self.links {
            write!(text, "\n{}", of_link(link)).expect("a String takes what is written to it");
        }
        for one in &self.broadcasts {
            write!(text, "\n{}", of_broadcast(one)).expect("a String takes what is written to it");
        }
        for event in &self.events {
            let EventReport { controller, at_s, what } = event;
            write!(text, "\n{at_s:>9.3} s  {controller}: {what}")
                .expect("a String takes what is written to it");
        }
        text
    }

    /// The controllers with their counts; what is 0 for all of them is left out.
    fn table(&self) -> Table {
        let rows: Vec<_> = self.controllers.iter().map(ControllerReport::row).collect();
        let shows = |column: &usize| !COLUMNS[*column].1 || rows.iter().any(|row| row[*column] != "0");
        let shown: Vec<usize> = (0..COLUMNS.len()).filter(shows).collect();
        let mut table = Table::new();
        table.load_style(presets::NOTHING);
        if let Some(width) = terminal::width(std::io::stderr()) {
            table.set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
        }
        table.set_header(shown.iter().map(|column| COLUMNS[*column].0));
        for row in &rows {
            table.add_row(shown.iter().map(|column| &row[*column]));
        }
        for column in table.column_iter_mut().skip(2) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table
    }
}

/// How often one datagram was for all of a network, and why it was not the last time that it was not.
fn of_broadcast(one: &BroadcastStatus) -> String {
    let BroadcastStatus { name, controllers, together, apart, last_apart, .. } = one;
    let why = last_apart.as_ref().map(|why| format!(", the last of them because {why}")).unwrap_or_default();
    format!(
        "broadcast {name}: {together} ticks as one datagram for {controllers} controllers, {apart} as one for each{why}"
    )
}

/// A link, and its axes that did not take all that was made for them.
fn of_link(link: &LinkStatus) -> String {
    let beside = link.deviation_mm.map(|most| format!(", at most {most:.2} mm off the cue by the proof"));
    let mut text = format!(
        "link {} ({}): {:.1} Hz, {:.0} ms ahead{}; {} of {} requests answered, {} late, {} stray",
        link.name,
        link.dialect,
        link.rate_hz,
        link.lead_ms,
        beside.unwrap_or_default(),
        link.answered,
        link.asked,
        link.late,
        link.stray
    );
    for axis in &link.axes {
        let LinkAxisStatus { made, acked, unconfirmed, refused, in_doubt, skipped, dry, .. } = axis;
        let taken = if *unconfirmed > 0 { format!("{unconfirmed} sent") } else { format!("{acked} acked") };
        write!(
            text,
            "\n  {} axis {}: {made} made, {taken}, {refused} refused, {in_doubt} in doubt, {skipped} skipped, ran dry {dry} times",
            axis.controller, axis.axis
        )
        .expect("a String takes what is written to it");
    }
    text
}

/// What the table says of each controller, and whether that may be left out where it is 0.
const COLUMNS: [(&str, bool); 17] = [
    ("controller", false),
    ("address", false),
    ("sent", false),
    ("asked", false),
    ("acked", false),
    ("refused", true),
    ("lost", false),
    ("park", true),
    ("dup", true),
    ("stale", true),
    ("stray", true),
    ("failed", true),
    ("closed", true),
    ("ack p50 µs", false),
    ("p99", false),
    ("p99.9", false),
    ("max", false),
];

impl ControllerReport {
    /// Its row, cell by cell in the order of [`COLUMNS`].
    fn row(&self) -> Vec<String> {
        let counts = [
            self.frames.sent,
            self.frames.asked,
            self.frames.acked,
            self.frames.refused,
            self.frames.lost,
            self.park_frames,
            self.duplicate,
            self.stale,
            self.stray,
            self.send_failed,
            self.port_closed,
        ];
        let latencies = [self.ack_us.p50_us, self.ack_us.p99_us, self.ack_us.p999_us, self.ack_us.max_us];
        let mut row = vec![self.name.clone(), self.address.clone()];
        row.extend(counts.iter().map(u64::to_string));
        row.extend(latencies.iter().map(|us| shown(*us)));
        row
    }
}

fn shown(us: Option<f64>) -> String {
    us.map_or_else(|| "-".to_owned(), |us| format!("{us:.1}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_of_a_report_is_read_as_it_was_written_and_written_as_it_ever_was() {
        let json = include_str!("../../tests/data/play-report.json");
        let report: PlayReport = serde_json::from_str(json).unwrap();
        assert_eq!(serde_json::to_string_pretty(&report).unwrap() + "\n", json);
    }
}
