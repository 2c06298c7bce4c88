//! What the links of a hall play of a cue: for each type of seat on a link what its drives execute, at the rate that the octets of
//! that link allow, and what would mend what they must not do. Control thread; pure.

use std::sync::Arc;
use std::time::Duration;

use super::drives::in_motion;
use super::terms::Part;
use super::violation::{Breach, DriveBreach, LinkBreach};
use super::{DriveAxisProof, DriveProof, DriveTerms, DrivenBy, Proof, Terms, Violation, prove, prove_driven};
use crate::config::drive::sixpack2::{PropDiv, Sixpack2Drive};
use crate::config::drive::{DriveFamily, SeatDrive};
use crate::config::{Config, Controller, Drives, Link};
use crate::cue::{FAULTS_TOLD, Place};
use crate::drive::link::StreamTerms;
use crate::drive::rates::LinkLoad;
use crate::timeline::Timeline;

/// What the drives of a type of seat on a link execute of a cue.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LinkPlay {
    /// The link.
    pub(crate) link: String,
    /// The controllers that do it alike, in the order of the file.
    pub(crate) controllers: Vec<String>,
    /// From one segment or target of an axis to the next.
    pub(crate) period: Duration,
    /// How long before a seat is there its poses are made; `None` for drives that nothing streams to yet.
    pub(crate) lead: Option<Duration>,
    /// One entry for each axis of the cue that is on them.
    pub(crate) axes: Vec<DriveAxisProof>,
}

/// What all links execute of a cue, and what of it may not be.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct LinksProof {
    /// By links, in the order of their names.
    pub(crate) plays: Vec<LinkPlay>,
    /// What is broken; the first [`FAULTS_TOLD`].
    pub(crate) violations: Vec<Violation>,
    /// How many there are beyond those.
    pub(crate) more: u64,
}

/// Proves a cue for a hall as [`prove`] does, and if it passes what the links make of it.
#[must_use]
pub(crate) fn prove_in(config: &Config, timeline: &Timeline, terms: Terms) -> Proof {
    let proof = prove(timeline, terms);
    if !proof.passed() {
        // The motion comes first: what is mended there may mend this.
        return proof;
    }
    let links = prove_links(config, timeline, &proof.terms);
    Proof { violations: links.violations, more: links.more, links: links.plays, ..proof }
}

/// Proves what the links of a hall execute of a cue at the rate and the level of `terms`; and so at each lower level.
#[must_use]
pub(crate) fn prove_links(config: &Config, timeline: &Timeline, terms: &Terms) -> LinksProof {
    let mut all = LinksProof::default();
    for link in &config.links {
        let on_it = config.on_links().filter(|one| one.drives().is_some_and(|it| it.link == link.name));
        let seats = alike(on_it);
        let Some(load) = LinkLoad::of(link, config).filter(|_| !seats.is_empty()) else { continue };
        match StreamTerms::of(link, config) {
            Ok(None) => {}
            Ok(Some(StreamTerms { period, .. })) => {
                let line = Line { link, load, period, timeline, terms };
                seats.iter().for_each(|seats| line.prove(seats, &mut all));
            }
            Err(why) => all.violations.push(too_slow(why)),
        }
    }
    all.more += all.violations.len().saturating_sub(FAULTS_TOLD) as u64;
    all.violations.truncate(FAULTS_TOLD);
    all
}

/// Controllers that play the same axes on the same type of seat.
fn alike<'a>(controllers: impl Iterator<Item = &'a Controller>) -> Vec<Vec<&'a Controller>> {
    let mut groups: Vec<Vec<&Controller>> = Vec::new();
    for one in controllers {
        let is_as = |other: &Controller| other.seat == one.seat && other.window() == one.window();
        match groups.iter_mut().find(|group| is_as(group[0])) {
            Some(group) => group.push(one),
            None => groups.push(vec![one]),
        }
    }
    groups
}

fn too_slow(why: String) -> Violation {
    Violation { place: Place::File, column: String::new(), breach: Breach::TooSlow { why } }
}

/// A link that plays a cue.
struct Line<'a> {
    link: &'a Link,
    load: LinkLoad,
    period: Duration,
    timeline: &'a Timeline,
    terms: &'a Terms,
}

impl Line<'_> {
    /// Proves what seats of one type on it do.
    fn prove(&self, seats: &[&Controller], all: &mut LinksProof) {
        let Some(Drives { drive, .. }) = seats[0].drives() else { return };
        let Some(driven) = self.driven(drive) else { return };
        // One stands for all: they are of the same type, on the same axes.
        let part = Part { seat: Arc::clone(&seats[0].seat), axes: seats[0].window() };
        let terms = Terms { parts: vec![part], effects: Vec::new(), ..self.terms.clone() };
        let proof = prove_driven(self.timeline, &terms, &driven);
        let controllers: Vec<String> = seats.iter().map(|one| one.name.clone()).collect();
        let remedy = self.remedy(&proof, &terms, &driven);
        let violations = proof.violations.into_iter().chain(in_motion(self.timeline, &terms, self.period));
        all.violations.extend(violations.map(|one| self.named(one, &controllers, &remedy)));
        all.more += proof.more;
        let stream = StreamTerms { period: self.period, tick: self.terms.rate.period() };
        let lead = Some(stream.lead(self.load.family));
        let (link, period) = (self.link.name.clone(), self.period);
        all.plays.push(LinkPlay { link, controllers, period, lead, axes: proof.axes });
    }

    /// How its drives play; `None` where the seat has no settings for their family, which no sound configuration leaves out.
    fn driven(&self, drive: &SeatDrive) -> Option<DriveTerms> {
        let sixpack = |it: &Sixpack2Drive| DrivenBy::SixPack {
            clock_divider: it.clock_divider,
            propdiv: match it.propdiv {
                PropDiv::Auto => None,
                PropDiv::Fixed(by) => Some(by),
            },
            jump: it.jump_mm_s,
        };
        let silvermax = drive.silvermax.as_ref().map(|_| DrivenBy::SilverMax);
        let family = match self.load.family {
            DriveFamily::SilverMax => silvermax?,
            DriveFamily::Sixpack2 => drive.sixpack2.as_ref().map(sixpack)?,
        };
        let (max_deviation, shake) = (drive.max_deviation_mm, drive.vibration);
        Some(DriveTerms { family, period: self.period, max_deviation, shake })
    }

    /// What would mend it, with the numbers that were proved to; nothing where nothing is broken or nothing helps.
    fn remedy(&self, proof: &DriveProof, terms: &Terms, driven: &DriveTerms) -> String {
        if proof.violations.is_empty() {
            return String::new();
        }
        // A deviation says its level itself.
        let is_said = |one: &Violation| matches!(&one.breach, Breach::Drive(DriveBreach::Deviates { .. }));
        let is_said = proof.violations.iter().all(is_said);
        let level = if is_said { None } else { self.level_that_fits(proof, terms, driven) };
        let level = level.map(|level| format!("it fits at level {:.0}%", 100.0 * level));
        let faster = self.faster_that_fits(proof, terms, driven);
        let faster = faster.map(|(hz, change)| format!("it fits at {hz:.1} Hz: {change}"));
        level.into_iter().chain(faster).map(|words| format!("; {words}")).collect()
    }

    fn level_that_fits(&self, proof: &DriveProof, terms: &Terms, driven: &DriveTerms) -> Option<f64> {
        let mut part = 1.0_f64;
        for violation in &proof.violations {
            let Breach::Drive(breach) = &violation.breach else { return None };
            part = part.min(breach.part_that_fits()?);
        }
        // In whole percent, as people set levels.
        let percent = (100.0 * terms.level * part).floor();
        // What is rounded to counts does not shrink with the level.
        let levels = [percent, percent - 1.0, percent - 3.0].into_iter().filter(|level| *level > 0.0);
        levels.map(|percent| percent / 100.0).find(|level| {
            let lower = Terms { level: *level, ..terms.clone() };
            prove_driven(self.timeline, &lower, driven).violations.is_empty()
        })
    }

    /// The least change of the link that lets it pass, and the rate that it gives.
    fn faster_that_fits(
        &self,
        proof: &DriveProof,
        terms: &Terms,
        driven: &DriveTerms,
    ) -> Option<(f64, String)> {
        let is_of_rate = |one: &Violation| matches!(&one.breach, Breach::Drive(drive) if drive.is_of_rate());
        if !proof.violations.iter().all(is_of_rate) {
            return None;
        }
        let mut changes = self.load.changes();
        // At the rate that it has it was refused.
        changes.retain(|(hz, _)| hz * self.period.as_secs_f64() > 1.0);
        // Proofs of a long film take a while: the least is looked for by halves.
        let passes = |(hz, _): &(f64, String)| {
            let faster = DriveTerms { period: Duration::from_secs_f64(hz.recip()), ..*driven };
            prove_driven(self.timeline, terms, &faster).violations.is_empty()
        };
        let least = changes.partition_point(|change| !passes(change));
        changes.into_iter().nth(least)
    }

    fn named(&self, violation: Violation, controllers: &[String], remedy: &str) -> Violation {
        let Breach::Drive(breach) = violation.breach else { return violation };
        // A way to rest is the cue's own matter.
        let remedy = if matches!(breach, DriveBreach::InMotion { .. }) { "" } else { remedy };
        let (link, controllers) = (self.link.name.clone(), controllers.join(", "));
        let breach = LinkBreach { link, controllers, breach, remedy: remedy.to_owned() };
        Violation { breach: Breach::OnLink(Box::new(breach)), ..violation }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::Digest;
    use super::*;
    use crate::config;
    use crate::cue::{Source, read};
    use crate::time::Rate;

    /// The hall of the test data with its SilverMax seat alone, vibration off on it, with something of the text replaced.
    fn hall(changes: &[(&str, &str)]) -> Config {
        let text = std::fs::read_to_string("tests/data/config/drives.toml").unwrap();
        let (text, _) = text.rsplit_once("[[controller]]").unwrap();
        let text = text.replace("max_error_mm = 3.0", "max_error_mm = 3.0\nvibration = 0.0");
        let text = changes.iter().fold(text, |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        });
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hall.toml");
        std::fs::write(&path, text).unwrap();
        config::load(&path).unwrap()
    }

    fn bench_ride() -> Timeline {
        Timeline::new(crate::cue::load(Path::new("cues/bench-ride.csv"), &Source::Native).unwrap())
    }

    fn prove_at(config: &Config, timeline: &Timeline, level: f64) -> Proof {
        let terms = Terms::of_hall(config, Digest::of(timeline.cue()), Rate::from_hz(100.0), level);
        prove_in(config, timeline, terms)
    }

    fn said(config: &Config, timeline: &Timeline) -> Vec<String> {
        prove_at(config, timeline, 1.0).violations.iter().map(ToString::to_string).collect()
    }

    const QUICK: (&str, &str) = ("baud = 57600", "baud = 115200");
    const SECOND: (&str, &str) = (
        "units = [16, 17, 18]\n",
        "units = [16, 17, 18]\n[[controller]]\nname = \"D3\"\nseat = \"silver3\"\naddress = \"link:stalls\"\n\
         dialect = \"silvermax\"\nunits = [19, 20, 21]\n",
    );

    #[test]
    fn a_link_plays_at_the_rate_of_its_octets_and_as_far_ahead_as_its_stream() {
        let config = hall(&[]);
        let proof = prove_at(&config, &bench_ride(), 1.0);
        let [play] = &proof.links[..] else { panic!("one link: {proof:?}") };
        let period = LinkLoad::of(&config.links[1], &config).unwrap().period();
        assert_eq!(
            (play.link.as_str(), &play.controllers[..], play.period),
            ("stalls", &["D1".to_owned()][..], period)
        );
        assert_eq!(play.lead, Some(period * 6 + Duration::from_millis(20)));
        assert!(proof.passed() && play.axes.len() == 3, "{proof:?}");
        assert!(play.axes.iter().all(|axis| (0.01..0.05).contains(&axis.deviation.value)), "{play:?}");
        let told = prove_at(&hall(&[("baud = 57600", "baud = 57600\nrate_hz = 20")]), &bench_ride(), 1.0);
        assert_eq!(told.links[0].period, Duration::from_millis(50));
    }

    #[test]
    fn seats_of_one_type_on_a_link_are_proved_once_and_share_its_rate() {
        let proof = prove_at(&hall(&[SECOND, QUICK]), &bench_ride(), 1.0);
        let [play] = &proof.links[..] else { panic!("{proof:?}") };
        assert_eq!(play.controllers, ["D1", "D3"]);
        assert!(play.period > Duration::from_millis(34) && play.axes.len() == 3);
    }

    #[test]
    fn too_far_beside_the_cue_is_refused_with_link_seats_place_and_what_fits() {
        let allowed = ("max_error_mm = 3.0", "max_error_mm = 3.0\nmax_deviation_mm = 0.03");
        let said = said(&hall(&[SECOND, QUICK, allowed]), &bench_ride());
        let named = "a2: link stalls, D1, D3: a drive of seat silver3 at 29.0 Hz would be 0.0";
        let fits = "it fits at 54.5 Hz: baud = 230400";
        let all = |one: &String| {
            one.contains("mm off the cue at 00:0") && one.contains("0.03 are allowed") && one.ends_with(fits)
        };
        assert!(said.iter().any(|one| one.contains(named)) && said.iter().all(all), "{said:?}");
        let faster = hall(&[SECOND, allowed, ("baud = 57600", "baud = 230400")]);
        assert!(prove_at(&faster, &bench_ride(), 1.0).passed(), "and so it does");
    }

    #[test]
    fn a_limit_that_the_fit_breaks_is_refused_with_the_level_that_fits() {
        let jerky = ("max_jerk_mm_s3 = 60000", "max_jerk_mm_s3 = 60000\nmax_acceleration_mm_s2 = 1955");
        let config = hall(&[
            ("max_acceleration_mm_s2 = 3000\n", ""),
            jerky,
            ("baud = 57600", "baud = 57600\nrate_hz = 20"),
        ]);
        let said = said(&config, &bench_ride());
        let level = said[0]
            .split("it fits at level ")
            .nth(1)
            .and_then(|it| it.split('%').next()?.parse::<f64>().ok());
        let level = level.unwrap_or_else(|| panic!("{said:?}")) / 100.0;
        assert!(prove_at(&config, &bench_ride(), level).passed(), "{said:?}");
    }

    #[test]
    fn a_vibration_that_its_link_is_too_slow_for_is_refused_by_name_unless_the_seat_has_none() {
        let said = said(&hall(&[("vibration = 0.0", "vibration = 0.5")]), &bench_ride());
        let named = "v1_hz: link stalls, D1: vibration at 20.0 Hz at";
        assert!(said.iter().any(|one| one.contains(named)), "{said:?}");
        assert!(prove_at(&hall(&[]), &bench_ride(), 1.0).passed());
    }

    #[test]
    fn a_cue_that_begins_or_ends_in_motion_is_refused_on_drives_and_taken_on_the_network() {
        let rows: String =
            (0..=100).map(|row| format!("{},{:.6}\n", row * 20, 0.2 + 0.005 * f64::from(row))).collect();
        let text = format!("# units: fraction\ntime_ms,a1\n{rows}");
        let ramp = Timeline::new(read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap());
        let said = said(&hall(&[]), &ramp);
        let begins = "a1: link stalls, D1: the cue begins at 00:00.000 in motion, 37.5 mm/s";
        let ends = "a1: link stalls, D1: the cue ends at 00:02.000 in motion, 37.5 mm/s";
        assert!(said.len() == 2 && said[0].contains(begins) && said[1].contains(ends), "{said:?}");
        let udp = hall(&[(
            "address = \"link:stalls\"\ndialect = \"silvermax\"\nunits = [16, 17, 18]",
            "address = \"127.0.0.1:7408\"",
        )]);
        let proof = prove_at(&udp, &ramp, 1.0);
        assert!(proof.passed() && proof.links.is_empty(), "{proof:?}");
    }

    #[test]
    fn a_link_that_is_to_play_more_often_than_it_can_is_refused_and_a_cue_that_breaks_limits_is_mended_first()
    {
        let said = said(&hall(&[("baud = 57600", "baud = 57600\nrate_hz = 50")]), &bench_ride());
        assert!(
            said.len() == 1 && said[0].trim_start().starts_with("[link.stalls]: 3 axes play at"),
            "{said:?}"
        );
        let slow = hall(&[("max_velocity_mm_s = 240", "max_velocity_mm_s = 100")]);
        let proof = prove_at(&slow, &bench_ride(), 1.0);
        assert!(
            !proof.passed() && proof.links.is_empty() && !proof.violations.iter().any(Violation::is_of_links)
        );
    }
}
