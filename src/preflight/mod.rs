//! What was read of the controllers, held against the configuration, into findings: which seat nobody should sit on yet,
//! why, and what to do. Control thread; pure but for what it is given.
//!
//! ```text
//!  device::survey --+
//!  net::route ------+--> Subject --> answers, identity, network, motion, speed, estop, status --> Finding
//!  configuration ---+                                      `checks`: the one table of what there is to find
//! ```
//!
//! Seats on serial links have a survey and a judge of their own (`drives`); the table of checks, and what a site accepts, is the same.
//! One file for each family of checks; of motion four. A finding has a name that never changes, so that a configuration can accept it for
//! good, with its reason.

mod answers;
mod drives;
mod estop;
mod geometry;
mod identity;
mod motion;
mod network;
mod outputs;
mod place;
mod speed;
mod status;
mod subject;
#[cfg(test)]
mod testing;

use serde::Serialize;

use crate::config::Acceptance;

pub use crate::checks::Check;
pub(crate) use crate::checks::{Family, Severity};
pub(crate) use answers::round_trip;
pub(crate) use drives::{DriveSubject, LinkSurvey};
pub(crate) use subject::{ShowTerms, Subject, wanted};

/// One thing that was found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Finding {
    /// What was looked for.
    pub(crate) check: Check,
    /// What was found, with the register and its value.
    pub(crate) found: String,
    /// What to do; empty if nothing is to be done.
    pub(crate) remedy: String,
    /// Why the site lives with it, where it does.
    pub(crate) accepted: Option<String>,
}

impl Finding {
    /// How grave it is, its acceptance left aside.
    #[must_use]
    pub(crate) const fn severity(&self) -> Severity {
        self.check.severity()
    }

    /// True if preflight fails for it.
    #[must_use]
    pub(crate) fn fails(&self) -> bool {
        self.severity() == Severity::Fail && self.accepted.is_none()
    }
}

/// What is found about one controller, as it is noted.
#[derive(Debug, Default)]
struct Notes(Vec<Finding>);

impl Notes {
    fn add(&mut self, check: Check, found: impl Into<String>, remedy: impl Into<String>) {
        self.0.push(Finding { check, found: found.into(), remedy: remedy.into(), accepted: None });
    }
}

/// Judges all controllers: what was found of each, in the order of `subjects`, the gravest first. `accepted` is what the
/// hall accepts of any of them.
#[must_use]
pub(crate) fn judge(
    subjects: &[Subject<'_>],
    terms: &ShowTerms,
    accepted: &[Acceptance],
) -> Vec<Vec<Finding>> {
    let mut all: Vec<Notes> = subjects.iter().map(|subject| one(subject, terms)).collect();
    identity::judge_together(subjects, &mut all);
    geometry::judge_together(subjects, &mut all);
    let accept = |(notes, subject): (Notes, &Subject<'_>)| {
        sorted(notes, &subject.controller.accept_findings, accepted)
    };
    all.into_iter().zip(subjects).map(accept).collect()
}

/// The same for controllers on serial links.
#[must_use]
pub(crate) fn judge_driven(subjects: &[DriveSubject<'_>], accepted: &[Acceptance]) -> Vec<Vec<Finding>> {
    let one = |subject: &DriveSubject<'_>| {
        sorted(drives::one(subject), &subject.controller.accept_findings, accepted)
    };
    subjects.iter().map(one).collect()
}

/// The gravest first, with why the site lives with what it accepts.
fn sorted(Notes(mut findings): Notes, own: &[Acceptance], hall: &[Acceptance]) -> Vec<Finding> {
    for finding in &mut findings {
        let why = own.iter().chain(hall).find(|one| one.check == finding.check);
        finding.accepted = why.filter(|_| finding.check.can_be_accepted()).map(|one| one.why.clone());
    }
    findings.sort_by_key(|finding| (std::cmp::Reverse(finding.severity()), finding.check));
    findings
}

fn one(subject: &Subject<'_>, terms: &ShowTerms) -> Notes {
    let mut notes = Notes::default();
    network::judge_way(subject, terms, &mut notes);
    answers::judge(subject, &mut notes);
    if subject.answered() {
        identity::judge(subject, &mut notes);
        network::judge_replies(subject, terms, &mut notes);
        motion::judge(subject, terms, &mut notes);
        geometry::judge(subject, &mut notes);
        place::judge(subject, &mut notes);
        outputs::judge(subject, &mut notes);
        speed::judge(subject, &mut notes);
        estop::judge(subject, &mut notes);
        status::judge(subject, terms, &mut notes);
    }
    notes
}

#[cfg(test)]
mod tests;
