//! What was measured, for programs and for people.

use std::fmt::Write as _;

use serde::Serialize;

use crate::app::{PlayReport, Played};
use crate::cli::Exit;
use crate::device::stand::StandError;
use crate::doctor::chart::draw;
use crate::latency::Percentiles;
use crate::rt::Times;
use crate::tracker::Histogram;

/// A controller that was sent no frame.
#[derive(Debug, Clone, Serialize)]
pub(super) struct RefusedFrames {
    name: String,
    why: String,
    #[serde(skip)]
    answered: bool,
}

impl RefusedFrames {
    pub(super) fn new(name: String, error: &StandError) -> Self {
        Self { name, why: error.to_string(), answered: error.answered() }
    }

    /// How the program ends for their sake: 76 where one could not be used, 69 where one did not answer.
    pub(super) fn exit(all: &[Self]) -> Exit {
        match (all.is_empty(), all.iter().any(|one| one.answered)) {
            (true, _) => Exit::Done,
            (false, true) => Exit::Refused,
            (false, false) => Exit::Unavailable,
        }
    }
}

/// What programs read. Fields may be added, never changed.
#[derive(Debug, Serialize)]
pub(super) struct LatencyReport<'a> {
    /// The rate and the controllers, in words.
    about: &'a str,
    seconds: u32,
    /// True if the controllers were virtual ones of the program's own.
    #[serde(rename = "virtual")]
    of_our_own: bool,
    lateness_us: Percentiles,
    ack_us: Percentiles,
    /// Controllers that were left out.
    refused: &'a [RefusedFrames],
    /// The report of the sending, as `play` has it.
    report: &'a PlayReport,
}

impl<'a> LatencyReport<'a> {
    pub(super) fn new(
        about: &'a str,
        seconds: u32,
        of_our_own: bool,
        times: &Times,
        refused: &'a [RefusedFrames],
        played: &'a Played,
    ) -> Self {
        let [lateness_us, ack_us] = [&times.lateness, &times.acks].map(Percentiles::of);
        Self { about, seconds, of_our_own, lateness_us, ack_us, refused, report: &played.report }
    }

    /// The same for people, with drawings of the times.
    pub(super) fn text(&self, times: &Times) -> String {
        let mut text = format!("{}\n", self.about);
        text.push_str(&charts(times));
        writeln!(text, "\n{}", self.report.text()).expect("a String takes what is written to it");
        text
    }
}

/// Drawings of both kinds of times.
pub(super) fn charts(times: &Times) -> String {
    let chart = |name: &str, times: &Histogram| match draw(times) {
        empty if empty.is_empty() => format!("\n{name}: none\n"),
        drawing => format!("\n{name} (bars grow with each doubling)\n{drawing}"),
    };
    chart("lateness", &times.lateness) + &chart("ack latency", &times.acks)
}
