//! What `check` says of serial drives: what they would execute of a cue, at the rate of a link.

use std::path::Path;
use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::Serialize;

use crate::config::drive::{DriveFamily, MAX_DEVIATION_MM};
use crate::config::parse_level;
use crate::drive::rates::short;
use crate::plain;
use crate::proof::{
    DriveAxisProof, DriveProof, DriveTerms, DrivenBy, LinkPlay, Terms, prove_driven, rate_that_fits,
};
use crate::timeline::Timeline;

/// The divider of the clock of a SIXpack 2 that the fastest bench seat takes.
const CLOCK_DIVIDER: u8 = 3;
/// The highest rate of a link that is advised.
const MOST_HZ: f64 = 500.0;

/// Serial drives that a cue is judged for as well.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct DriveArgs {
    /// Also check how closely serial drives of this family follow a cue; the seat's pulses are their counts or microsteps.
    ///
    /// A SilverMax is judged by segments of its timed queue, a SIXpack 2 by targets on the fly, with clock_divider 3 and the propdiv that
    /// its seat needs.
    #[arg(long, value_name = "FAMILY", requires = "link_rate", value_parser = drive_family())]
    drive: Option<DriveFamily>,

    /// Segments or targets per second that the link carries for each axis: 10 to 500.
    #[arg(long, value_name = "HZ", requires = "drive", value_parser = parse_link_rate)]
    link_rate: Option<f64>,

    /// Level of vibration on drives, on top of --level.
    #[arg(long, value_name = "LEVEL", requires = "drive", value_parser = parse_level, default_value = "100%")]
    drive_vibration: f64,
}

/// One axis on drives, in `--json`.
#[derive(Debug, Serialize)]
pub(super) struct DriveReport {
    file: String,
    axis: String,
    seat: String,
    /// The link of the hall that it is on, and who is there; null and none where no hall was asked about.
    link: Option<String>,
    controllers: Vec<String>,
    unit: &'static str,
    rate_hz: f64,
    /// How long before the seat is there its poses are made; null where that is not known.
    lead_ms: Option<f64>,
    deviation: f64,
    max_deviation: f64,
    at_s: f64,
}

/// What drives would execute of a cue, in numbers and in words.
pub(super) struct DriveVerdict {
    pub(super) proof: DriveProof,
    pub(super) reports: Vec<DriveReport>,
    pub(super) words: String,
}

impl DriveArgs {
    /// Judges a cue for them; none where nobody asks for drives.
    pub(super) fn judge(&self, path: &Path, timeline: &Timeline, terms: &Terms) -> Option<DriveVerdict> {
        let (family, hz) = (self.drive?, self.link_rate?);
        let family = match family {
            DriveFamily::SilverMax => DrivenBy::SilverMax,
            DriveFamily::Sixpack2 => {
                DrivenBy::SixPack { clock_divider: CLOCK_DIVIDER, propdiv: None, jump: None }
            }
        };
        let period = Duration::from_secs_f64(hz.recip());
        let link =
            DriveTerms { family, period, max_deviation: MAX_DEVIATION_MM, shake: self.drive_vibration };
        let proof = prove_driven(timeline, terms, &link);
        let words = if proof.violations.is_empty() {
            passed(path, &proof, hz)
        } else {
            rate_that_fits(&proof, timeline, terms, &link, MOST_HZ).map_or_else(String::new, |fits| {
                format!("{}: drives play it at {fits:.1} Hz or more\n", plain::path(path))
            })
        };
        Some(DriveVerdict { reports: reports(path, &proof, hz), proof, words })
    }
}

impl DriveReport {
    fn new(path: &Path, axis: &DriveAxisProof, rate_hz: f64) -> Self {
        Self {
            file: path.display().to_string(),
            axis: format!("a{}", axis.axis + 1),
            seat: axis.on.seat.name.clone(),
            link: None,
            controllers: Vec::new(),
            unit: axis.on.geometry().unit.name(),
            rate_hz,
            lead_ms: None,
            deviation: axis.deviation.value,
            max_deviation: axis.deviation.limit,
            at_s: axis.deviation.at.as_secs_f64(),
        }
    }
}

fn reports(path: &Path, proof: &DriveProof, rate_hz: f64) -> Vec<DriveReport> {
    proof.axes.iter().map(|axis| DriveReport::new(path, axis, rate_hz)).collect()
}

/// What the links of a hall play of a cue, axis by axis.
pub(super) fn on_links(path: &Path, plays: &[LinkPlay]) -> Vec<DriveReport> {
    let of_play = |play: &LinkPlay| {
        let report = |axis: &DriveAxisProof| DriveReport {
            link: Some(play.link.clone()),
            controllers: play.controllers.clone(),
            lead_ms: play.lead.map(ms),
            ..DriveReport::new(path, axis, play.period.as_secs_f64().recip())
        };
        play.axes.iter().map(report).collect::<Vec<_>>()
    };
    plays.iter().flat_map(of_play).collect()
}

/// What each link plays of a cue, in words.
pub(super) fn links_in_words(plays: &[LinkPlay]) -> Vec<String> {
    let of_link = |plays: &[LinkPlay]| {
        let LinkPlay { link, period, .. } = &plays[0];
        let ahead = plays.iter().filter_map(|play| play.lead).max();
        let ahead = ahead.map_or_else(String::new, |lead| format!(", {:.0} ms ahead", ms(lead)));
        let axes = plays.iter().flat_map(|play| play.axes.iter().map(move |axis| (play, axis)));
        let worst = axes.max_by(|(_, one), (_, other)| part(one).total_cmp(&part(other)));
        let beside = worst.map_or_else(String::new, |(play, axis)| {
            let (at, who) = (axis.deviation.at, play.controllers.join(", "));
            format!(", {} (a{} of {who} at {at})", beside(axis), axis.axis + 1)
        });
        format!("plays at {} Hz on link {link}{ahead}{beside}", short(period.as_secs_f64().recip()))
    };
    plays.chunk_by(|one, other| one.link == other.link).map(of_link).collect()
}

/// What of the deviation that is allowed an axis takes.
fn part(axis: &DriveAxisProof) -> f64 {
    axis.deviation.value / axis.deviation.limit
}

fn beside(axis: &DriveAxisProof) -> String {
    let value = (100.0 * axis.deviation.value).ceil() / 100.0;
    format!("at most {value:.2} {} off the cue", axis.on.geometry().unit.name())
}

fn ms(span: Duration) -> f64 {
    span.as_secs_f64() * 1e3
}

/// At which rate it is played, and how far beside the cue drives are at the most.
fn passed(path: &Path, proof: &DriveProof, hz: f64) -> String {
    let Some(worst) = proof.axes.iter().max_by(|a, b| part(a).total_cmp(&part(b))) else {
        return String::new();
    };
    let (path, axis, at) = (plain::path(path), worst.axis + 1, worst.deviation.at);
    format!("{path}: drives play it at {hz:.1} Hz, {} (a{axis} at {at})\n", beside(worst))
}

/// Reads a family by its word in the configuration.
fn drive_family() -> impl TypedValueParser<Value = DriveFamily> {
    let known = |word: &String| DriveFamily::ALL.into_iter().find(|(known, _)| known == word);
    PossibleValuesParser::new(DriveFamily::ALL.map(|(word, _)| word))
        .try_map(move |word| known(&word).map(|(_, family)| family).ok_or("no family of drives"))
}

fn parse_link_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| (10.0..=500.0).contains(rate));
    rate.ok_or_else(|| "the link rate is 10 to 500 Hz: segments or targets per axis".to_owned())
}
