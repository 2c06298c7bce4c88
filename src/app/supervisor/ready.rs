//! Preflight of the hall, and whether a show can be armed.

use super::Supervisor;
use super::job::JobResult;
use crate::app::runtime::{DeviceJob, Finding, run_on_devices};
use crate::config::Config;
use crate::control::{Asked, PreflightStatus, Severity, Warning};
use crate::device::survey::Survey;
use crate::net::{Route, route};
use crate::preflight::{self, Check, Subject, Terms, judge};
use crate::rt::Command as TickCommand;
use crate::state::{Event, Readiness};
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
    /// Judges what controllers told, for whatever cue is played.
    fn of(config: &Config, surveys: &[Survey]) -> Self {
        let bind = *config.show.bind.ip();
        let way =
            |address| -> Result<Route, String> { route(bind, address).map_err(|error| error.to_string()) };
        let subjects: Vec<Subject<'_>> = config
            .controllers
            .iter()
            .zip(surveys)
            .map(|(controller, survey)| Subject {
                controller,
                axes: Some(controller.seat.axes),
                route: way(controller.address),
                survey: Some(survey),
            })
            .collect();
        let terms = Terms { frame_port: config.show.bind.port(), rate_hz: config.show.rate_hz, cue: None };
        let found = judge(&subjects, &terms, &config.show.accept_findings);
        let passed = found.iter().map(|found| !found.iter().any(preflight::Finding::fails)).collect();
        let mut findings = Vec::new();
        for (controller, found) in found.into_iter().enumerate() {
            let name = &config.controllers[controller].name;
            findings.extend(found.into_iter().filter_map(|one| Some((controller, told(name, one)?))));
        }
        findings.sort_by_key(|(_, warning)| std::cmp::Reverse(warning.severity));
        let answered = subjects.iter().filter(|subject| subject.answered()).count();
        Self { at: Monotonic.now(), answered, passed, findings }
    }

    /// As surfaces show it, of the controllers that take part.
    pub(super) fn status(&self, now: MonoTime, is_on: impl Fn(usize) -> bool) -> PreflightStatus {
        PreflightStatus {
            passed: self.has_passed(is_on),
            age_s: now.since(self.at).as_secs_f64(),
            answered: self.answered,
            findings: self.findings.iter().map(|(_, warning)| warning.clone()).collect(),
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
    Some(Warning { id: id(finding.check), severity, controller, text: finding.found, remedy })
}

fn id(check: Check) -> String {
    check.to_string()
}

impl Supervisor {
    /// Has all controllers asked; whoever asked for it is answered once they were judged.
    pub(super) fn preflight(&mut self, asked: Asked) {
        // An armed hall may go at any moment, and then frames come between.
        if let Err(problem) = self.may("preflight").and_then(|()| self.is_free()) {
            return self.answer(asked, Err(problem));
        }
        let (config, line) = (self.runtime.config.clone(), self.line.clone());
        self.send("preflight", Some(asked), move || {
            let finding =
                run_on_devices(&mut line.hold(), &config.controllers, DeviceJob::Survey, &mut |_| {});
            let surveys = match finding {
                Finding::Surveyed(surveys) => surveys,
                Finding::Homed(_) => Vec::new(),
            };
            JobResult::Preflighted(Box::new(Preflighted::of(&config, &surveys)))
        });
    }

    /// True if nothing fails at the controllers of a group.
    pub(super) fn is_preflighted(&self, group: &str) -> bool {
        let controllers = &self.runtime.config.controllers;
        let of_group = |lane: usize| controllers[lane].group == group;
        self.preflighted.as_ref().is_some_and(|it| it.has_passed(of_group))
    }

    /// Tells the tick thread whether a show can be armed, where that has changed.
    pub(super) fn tell_readiness(&mut self) {
        let readiness = match (&self.cued, &self.preflighted) {
            (None, _) => Readiness::NoCue,
            (Some(_), Some(preflighted)) if preflighted.has_passed(|lane| self.settings.is_on(lane)) => {
                Readiness::Ready
            }
            (Some(_), _) => Readiness::NotPreflighted,
        };
        if self.readiness != Some(readiness)
            && self.command(TickCommand::Event(Event::Readiness(readiness))).is_ok()
        {
            self.readiness = Some(readiness);
        }
    }
}
