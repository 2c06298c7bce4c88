//! What preflight came to.

use std::collections::BTreeMap;

use crate::config::{Config, Controller};
use crate::control::{PreflightStatus, Severity, Warning};
use crate::device::survey::Survey;
use crate::drive::rates::LinkLoad;
use crate::net::{Route, route};
use crate::preflight::{self, Check, DriveSubject, LinkSurvey, ShowTerms, Subject, judge, judge_driven};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// What preflight came to.
#[derive(Debug)]
pub(super) struct Preflighted {
    at: MonoTime,
    answered: usize,
    /// True if nothing fails at each controller.
    passed: Vec<bool>,
    findings: Vec<(usize, Warning)>,
}

impl Preflighted {
    /// Judges what controllers and links told, for whatever cue is played.
    pub(super) fn of(config: &Config, surveys: &[Survey], links: &BTreeMap<String, LinkSurvey>) -> Self {
        let bind = *config.show.bind.ip();
        let way =
            |address| -> Result<Route, String> { route(bind, address).map_err(|error| error.to_string()) };
        let stations = config.stations();
        let subjects: Vec<Subject<'_>> = stations
            .iter()
            .zip(surveys)
            .map(|(controller, survey)| Subject {
                controller,
                axes: Some(controller.seat.axes),
                route: way(controller.connection.address),
                survey: Some(survey),
            })
            .collect();
        let terms =
            ShowTerms { frame_port: config.show.bind.port(), rate_hz: config.show.rate_hz, cue: None };
        let mut found = judge(&subjects, &terms, &config.show.accept_findings);
        let on_links: Vec<_> = config.on_links().filter_map(|one| driven(config, one, links)).collect();
        found.extend(judge_driven(&on_links, &config.show.accept_findings));
        let passed = found.iter().map(|found| !found.iter().any(preflight::Finding::fails)).collect();
        let mut findings = Vec::new();
        for (controller, found) in found.into_iter().enumerate() {
            let name = &config.controllers[controller].name;
            findings.extend(found.into_iter().filter_map(|one| Some((controller, told(name, one)?))));
        }
        findings.sort_by_key(|(_, warning)| std::cmp::Reverse(warning.severity));
        let answered = subjects.iter().filter(|subject| subject.answered()).count()
            + on_links.iter().filter(|subject| subject.answered()).count();
        Self { at: Monotonic.now(), answered, passed, findings }
    }

    /// As surfaces show it, of the controllers that take part: what was found at these is first.
    pub(super) fn status(&self, now: MonoTime, is_on: impl Fn(usize) -> bool) -> PreflightStatus {
        let (of_these, of_others): (Vec<_>, Vec<_>) =
            self.findings.iter().partition(|(controller, _)| is_on(*controller));
        PreflightStatus {
            passed: self.has_passed(is_on),
            age_s: now.since(self.at).as_secs_f64(),
            answered: self.answered,
            findings: of_these.into_iter().chain(of_others).map(|(_, warning)| warning.clone()).collect(),
        }
    }

    /// True if nothing fails at those that take part.
    pub(super) fn has_passed(&self, is_on: impl Fn(usize) -> bool) -> bool {
        self.passed.iter().enumerate().all(|(controller, passed)| *passed || !is_on(controller))
    }
}

#[cfg(test)]
impl Preflighted {
    /// One that so many controllers have passed.
    pub(super) fn passing(controllers: usize) -> Self {
        Self { at: Monotonic.now(), answered: controllers, passed: vec![true; controllers], findings: vec![] }
    }

    /// The same, but for one of them.
    pub(super) fn failing_at(controller: usize, controllers: usize) -> Self {
        let mut it = Self::passing(controllers);
        it.passed[controller] = false;
        it
    }
}

/// What is judged of a controller on a link.
fn driven<'a>(
    config: &'a Config,
    controller: &'a Controller,
    links: &'a BTreeMap<String, LinkSurvey>,
) -> Option<DriveSubject<'a>> {
    let name = &controller.drives()?.link;
    let link = config.links.iter().find(|link| link.name == *name)?;
    Some(DriveSubject { controller, link, load: LinkLoad::of(link, config), survey: links.get(name)? })
}

/// A finding as surfaces show it; `None` if all is well.
fn told(controller: &str, finding: preflight::Finding) -> Option<Warning> {
    let severity = match (finding.severity(), &finding.accepted) {
        (preflight::Severity::Fail, None) => Severity::Error,
        (preflight::Severity::Warn, None) => Severity::Warning,
        (_, Some(_)) => Severity::Info,
        _ => return None,
    };
    let remedy = finding.accepted.map_or(finding.remedy, |why| format!("accepted: {why}"));
    let controller = Some(controller.to_owned());
    Some(Warning {
        id: id(finding.check),
        severity,
        controller,
        text: finding.found,
        remedy,
        ..Warning::default()
    })
}

fn id(check: Check) -> String {
    check.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_found_at_a_seat_that_is_out_does_not_hide_why_preflight_fails() {
        let found = |controller: &str| {
            let controller = Some(controller.to_owned());
            Warning { severity: Severity::Error, controller, ..Warning::default() }
        };
        let mut preflighted = Preflighted::failing_at(1, 2);
        preflighted.passed[0] = false;
        preflighted.findings = vec![(0, found("A1")), (1, found("A2"))];
        let status = |out: usize| preflighted.status(preflighted.at, |lane| lane != out);
        assert_eq!(status(0).findings[0].controller.as_deref(), Some("A2"), "A1 is out for a week");
        assert_eq!(status(2).findings[0].controller.as_deref(), Some("A1"));
    }
}
