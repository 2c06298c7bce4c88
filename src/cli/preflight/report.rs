//! What preflight found, as a table with a list, and as JSON.

use std::collections::BTreeMap;
use std::time::Duration;

use comfy_table::{LineStyle, Table, TableStyle};
use serde::Serialize;

use crate::drive::silvermax::UnitFacts;
use crate::drive::sixpack2;
use crate::preflight::{Check, DriveSubject, Family, Finding, Severity, Subject, round_trip};

/// A line under the header, and no other lines.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// Of more controllers that have the same mere news, only the number is told.
const FEW: usize = 8;

/// The report, as `--json` prints it.
#[derive(Debug, Serialize)]
pub(super) struct PreflightReport {
    passed: bool,
    /// No controller answered where this is 0.
    answered: usize,
    took_s: f64,
    /// Findings that fail, those that warn, and those of both that are accepted.
    failed: usize,
    warned: usize,
    accepted: usize,
    controllers: Vec<ControllerChecks>,
}

/// What was found of one controller.
#[derive(Debug, Serialize)]
pub(super) struct ControllerChecks {
    name: String,
    row: Option<String>,
    address: String,
    #[serde(skip)]
    is_on_link: bool,
    answered: bool,
    /// Of reads; null if none was answered.
    round_trip_us: Option<RoundTrip>,
    /// What was read, by the manuals' names.
    registers: BTreeMap<String, i32>,
    findings: Vec<FindingReport>,
}

#[derive(Debug, Serialize)]
struct RoundTrip {
    p50: f64,
    max: f64,
    reads: usize,
    answered: usize,
}

#[derive(Debug, Serialize)]
struct FindingReport {
    family: Family,
    severity: Severity,
    #[serde(flatten)]
    finding: Finding,
}

impl PreflightReport {
    pub(super) fn new(controllers: Vec<ControllerChecks>, took: Duration) -> Self {
        let all = || controllers.iter().flat_map(|one| &one.findings).map(|one| &one.finding);
        let failed = all().filter(|finding| finding.fails()).count();
        let warned = all().filter(|one| one.severity() == Severity::Warn && one.accepted.is_none()).count();
        Self {
            passed: failed == 0,
            answered: controllers.iter().filter(|one| one.answered).count(),
            took_s: took.as_secs_f64(),
            failed,
            warned,
            accepted: all().filter(|finding| finding.accepted.is_some()).count(),
            controllers,
        }
    }

    pub(super) const fn passed(&self) -> bool {
        self.passed
    }

    /// True if that fails.
    pub(super) fn fails(&self, check: Check) -> bool {
        let mut findings = self.controllers.iter().flat_map(|one| &one.findings);
        findings.any(|one| one.finding.check == check && one.finding.fails())
    }

    /// How many controllers answered.
    pub(super) const fn answered(&self) -> usize {
        self.answered
    }

    /// A line of what came out.
    pub(super) fn summary(&self) -> String {
        let Self { answered, failed, warned, accepted, took_s, .. } = self;
        let verdict = match (answered, self.passed) {
            (0, _) => "no controller answers",
            (_, true) => "preflight passed",
            (_, false) => "preflight failed",
        };
        let count = self.controllers.len();
        format!(
            "{verdict}: {answered} of {count} controllers answered in {took_s:.1} s; findings: {failed} fail, {warned} \
             warn, {accepted} accepted"
        )
    }

    /// The table of controllers, then the findings.
    pub(super) fn text(&self) -> String {
        let mut table = Table::new();
        table.load_style(STYLE);
        let titles = Family::ALL.iter().map(|family| family.title());
        table.set_header(
            ["controller", "row", "address"].into_iter().chain(titles).chain(["p50 ms", "max ms"]),
        );
        for controller in &self.controllers {
            table.add_row(controller.row());
        }
        let list: String = self.groups().iter().map(|group| group.text(self.controllers.len())).collect();
        let set = if self.controllers.iter().any(|one| !one.is_on_link && one.finds()) {
            "\nSet registers with `kinocue register write PA93=20 --keep` and the same --to or --config, while no service runs."
        } else {
            ""
        };
        let why = if self.failed + self.warned > 0 {
            "\n`kinocue preflight --explain CHECK` says why each matters.\n"
        } else {
            ""
        };
        format!("{}\n\n{list}{set}{why}", table.trim_fmt())
    }

    /// Findings that are alike, with all whom they are about; the gravest first, what is accepted behind all.
    fn groups(&self) -> Vec<Group<'_>> {
        let mut groups: Vec<Group<'_>> = Vec::new();
        for controller in &self.controllers {
            for FindingReport { finding, .. } in &controller.findings {
                match groups.iter_mut().find(|group| group.finding == finding) {
                    Some(group) => group.names.push(&controller.name),
                    None => groups.push(Group { finding, names: vec![&controller.name] }),
                }
            }
        }
        groups.sort_by_key(|group| group.rank());
        groups
    }
}

impl ControllerChecks {
    fn new(subject: &Subject<'_>, findings: Vec<Finding>) -> Self {
        let controller = subject.controller;
        let registers = subject.survey.iter().flat_map(|survey| &survey.values);
        Self {
            name: controller.name.clone(),
            row: controller.row.clone(),
            address: controller.connection.address.to_string(),
            is_on_link: false,
            answered: subject.answered(),
            round_trip_us: subject.survey.and_then(|survey| {
                let (p50, max) = round_trip(&survey.round_trips)?;
                let us = |took: Duration| took.as_secs_f64() * 1e6;
                let (reads, answered) = (survey.rounds, survey.round_trips.len());
                Some(RoundTrip { p50: us(p50), max: us(max), reads, answered })
            }),
            registers: registers.map(|(address, value)| (address.to_string(), i32::from(*value))).collect(),
            findings: findings.into_iter().map(FindingReport::new).collect(),
        }
    }

    /// On a serial link: its units have no clock of ours, and answer one after the other.
    fn on_link(subject: &DriveSubject<'_>, findings: Vec<Finding>) -> Self {
        let controller = subject.controller;
        Self {
            name: controller.name.clone(),
            row: controller.row.clone(),
            address: controller.address(),
            is_on_link: true,
            answered: subject.answered(),
            round_trip_us: None,
            registers: subject
                .facts()
                .flat_map(registers)
                .chain(subject.sixpack().into_iter().flat_map(positions))
                .collect(),
            findings: findings.into_iter().map(FindingReport::new).collect(),
        }
    }

    /// Those on the network.
    pub(super) fn of_all(
        subjects: &[Subject<'_>],
        findings: Vec<Vec<Finding>>,
    ) -> impl Iterator<Item = Self> {
        subjects.iter().zip(findings).map(|(subject, found)| Self::new(subject, found))
    }

    /// Those on serial links.
    pub(super) fn of_driven(
        subjects: &[DriveSubject<'_>],
        findings: Vec<Vec<Finding>>,
    ) -> impl Iterator<Item = Self> {
        subjects.iter().zip(findings).map(|(subject, found)| Self::on_link(subject, found))
    }

    /// True if something was found that nobody accepted.
    fn finds(&self) -> bool {
        self.findings.iter().any(|one| one.severity > Severity::Info && one.finding.accepted.is_none())
    }

    /// Its line of the table.
    fn row(&self) -> Vec<String> {
        let seat_row = self.row.clone().unwrap_or_else(|| "-".to_owned());
        let mut row = vec![self.name.clone(), seat_row, self.address.to_string()];
        row.extend(Family::ALL.iter().map(|family| self.mark(*family).to_owned()));
        let ms = |us: f64| format!("{:.2}", us / 1e3);
        match &self.round_trip_us {
            Some(RoundTrip { p50, max, .. }) => row.extend([ms(*p50), ms(*max)]),
            None => row.extend(["-".to_owned(), "-".to_owned()]),
        }
        row
    }

    /// The worst of a family.
    fn mark(&self, family: Family) -> &'static str {
        let of_family = || self.findings.iter().filter(|one| one.family == family).map(|one| &one.finding);
        if of_family().any(Finding::fails) {
            "FAIL"
        } else if !self.answered && family != Family::Network {
            "-"
        } else if of_family().any(|one| one.severity() == Severity::Warn && one.accepted.is_none()) {
            "warn"
        } else if of_family().any(|one| one.accepted.is_some()) {
            "accepted"
        } else {
            "ok"
        }
    }
}

impl FindingReport {
    fn new(finding: Finding) -> Self {
        Self { family: finding.check.family(), severity: finding.severity(), finding }
    }
}

/// What was read of a SilverMax, by unit and register.
fn registers(facts: &UnitFacts) -> [(String, i32); 10] {
    let [low, high] = facts.soft_limits;
    let [closed, open] = facts.torque;
    [
        (0, facts.target),
        (1, facts.position),
        (19, facts.dry_brake),
        (38, low),
        (39, high),
        (40, facts.canary),
        (206, closed),
        (207, open),
        (208, facts.error_limits),
        (211, facts.kill_cause),
    ]
    .map(|(register, value)| (format!("{}.{register}", facts.unit), value))
}

/// Where the motors of a SIXpack 2 are, by unit and motor: of its settings none can be read.
fn positions(facts: &sixpack2::UnitFacts) -> impl Iterator<Item = (String, i32)> {
    facts.motors.iter().map(|told| (format!("{}.motor{}", facts.unit, told.motor), told.position))
}

/// One finding and all controllers that have it.
struct Group<'r> {
    finding: &'r Finding,
    names: Vec<&'r str>,
}

impl Group<'_> {
    /// Its place in the list.
    fn rank(&self) -> (bool, std::cmp::Reverse<Severity>, Check) {
        let finding = self.finding;
        let accepted = finding.accepted.is_some() && finding.severity() > Severity::Info;
        (accepted, std::cmp::Reverse(finding.severity()), finding.check)
    }

    fn text(&self, controllers: usize) -> String {
        let Finding { check, found, remedy, accepted } = self.finding;
        let word = match (accepted, check.severity()) {
            (Some(_), _) => "accepted",
            (None, Severity::Fail) => "FAIL",
            (None, severity) => severity.word(),
        };
        let names = match self.names.len() {
            count if count == controllers && count > 1 => format!("all {count}"),
            count if count > FEW && check.severity() == Severity::Info => format!("{count} controllers"),
            _ => self.names.join(", "),
        };
        let next = match accepted {
            Some(why) => format!("    accepted: {why}\n"),
            None if remedy.is_empty() => String::new(),
            None => format!("    {remedy}\n"),
        };
        format!("{word} {check}: {names}: {found}\n{next}")
    }
}
