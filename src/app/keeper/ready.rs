//! Preflight of the hall, and whether a show can be armed.

use super::Keeper;
use super::errand::Done;
use super::show::Cued;
use crate::app::house::{Finding, Inquiry, inquire};
use crate::config::Config;
use crate::device::survey::Survey;
use crate::hall::{Asked, Code, PreflightStatus, Problem, Severity, Warning};
use crate::net::{Route, route};
use crate::preflight::{self, Check, Subject, Terms, judge};
use crate::rt::Command;
use crate::state::{Event, Readiness};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// What preflight came to.
#[derive(Debug)]
pub(super) struct Preflighted {
    at: MonoTime,
    answered: usize,
    /// Whether nothing fails at each controller.
    passed: Vec<bool>,
    findings: Vec<(usize, Warning)>,
}

impl Preflighted {
    /// Judges what controllers told; `cue` says how many axes it has and whether it vibrates.
    fn of(config: &Config, surveys: &[Survey], cue: Option<(usize, bool)>) -> Self {
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
        let terms = Terms { frame_port: config.show.bind.port(), rate_hz: config.show.rate_hz, cue };
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

    /// Whether nothing fails at those that take part.
    pub(super) fn has_passed(&self, is_on: impl Fn(usize) -> bool) -> bool {
        self.passed.iter().enumerate().all(|(controller, passed)| *passed || !is_on(controller))
    }
}

/// A finding as surfaces show it; none where all is well.
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

impl Keeper {
    /// Has all controllers asked; whoever asked for it is answered once they were judged.
    pub(super) fn preflight(&mut self, asked: Asked) {
        if self.known.state.may_send_motion() {
            let detail = format!("cannot preflight while {}: frames go out", self.known.state);
            return self.answer(asked, Err(Problem::new(Code::State, detail, "park first")));
        }
        if let Err(problem) = self.is_free() {
            return self.answer(asked, Err(problem));
        }
        let Some(mut line) = self.line.take() else {
            let problem =
                Problem::new(Code::Busy, "the controllers are being asked", "ask again in a minute");
            return self.answer(asked, Err(problem));
        };
        let config = self.reins.config.clone();
        let cue = self.cued.as_ref().map(Cued::shape);
        self.send("preflight", Some(asked), move || {
            let surveys = match inquire(&mut line, &config.controllers, Inquiry::Survey, &mut |_| {}) {
                Finding::Surveyed(surveys) => surveys,
                Finding::Homed(_) => Vec::new(),
            };
            let preflighted = Preflighted::of(&config, &surveys, cue);
            Done::Preflighted(line, Box::new(preflighted))
        });
    }

    /// Tells the tick thread whether a show can be armed, where that has changed.
    pub(super) fn tell_readiness(&mut self) {
        let readiness = match (&self.cued, &self.preflighted) {
            (None, _) => Readiness::NoCue,
            (Some(_), Some(preflighted)) if preflighted.has_passed(|lane| self.board.is_on(lane)) => {
                Readiness::Ready
            }
            (Some(_), _) => Readiness::NotPreflighted,
        };
        if self.readiness != Some(readiness)
            && self.command(Command::Event(Event::Readiness(readiness))).is_ok()
        {
            self.readiness = Some(readiness);
        }
    }
}
