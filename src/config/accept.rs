//! `accept_findings`: what preflight finds and the site lives with, each with its reason.

use super::Acceptance;
use super::section::{Entry, Section, did_you_mean};
use crate::checks::{Check, Severity};

/// Reads `accept_findings = [{ check = "…", why = "…" }]`; empty if there is none.
pub(super) fn acceptances(section: &mut Section<'_, '_, '_>) -> Vec<Acceptance> {
    let Some(entries) = section.get("accept_findings").and_then(|entry| entry.array(section.faults)) else {
        return Vec::new();
    };
    let mut accepted: Vec<Acceptance> = Vec::new();
    for entry in entries {
        let Some(acceptance) = acceptance(entry, section) else { continue };
        if accepted.iter().any(|before| before.check == acceptance.check) {
            entry.fault(section.faults, &format!("{} is accepted twice here", acceptance.check));
        }
        accepted.push(acceptance);
    }
    accepted
}

fn acceptance(entry: Entry<'_>, outer: &mut Section<'_, '_, '_>) -> Option<Acceptance> {
    let table = entry.table(outer.faults)?;
    let mut section = Section::new("accept_findings", entry.at, table, outer.faults);
    section.require(&["check", "why"]);
    let check = check(&mut section);
    let why = section.text("why");
    section.finish();
    Some(Acceptance { check: check?, why: why? })
}

fn check(section: &mut Section<'_, '_, '_>) -> Option<Check> {
    let entry = section.get("check")?;
    let id = entry.text(section.faults)?;
    let Ok(check) = id.parse::<Check>() else {
        let hint = did_you_mean(id, Check::ALL.iter().map(|check| check.id()));
        let message = format!("{id:?} is not a check; `kinocue preflight --explain` lists them{hint}");
        entry.fault(section.faults, &message);
        return None;
    };
    if check.can_be_accepted() {
        return Some(check);
    }
    let why = match check.severity() {
        Severity::Info => "is for information, so there is nothing to accept",
        _ if check.is_present() => "cannot be accepted: it is about the present moment, not a setting",
        _ => "cannot be accepted: a setting that is unknown cannot be known to be safe",
    };
    entry.fault(section.faults, &format!("{check} {why}"));
    None
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::checks::Check;
    use crate::config::{Config, ConfigFaults, read};

    fn hall(in_show: &str, in_controller: &str) -> Result<Config, String> {
        let text = format!(
            "[show]\n{in_show}\n[seat.s]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
             max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
             [[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"10.0.0.1:7408\"\n{in_controller}\n"
        );
        read::document(Path::new("hall.toml"), &text).map_err(|faults| match faults {
            ConfigFaults::Bad(faults) => faults[0].to_string(),
            ConfigFaults::Unreadable { .. } => unreachable!("a text is no file"),
        })
    }

    fn fault(entry: &str) -> String {
        hall("", &format!("accept_findings = [{entry}]")).unwrap_err()
    }

    #[test]
    fn a_finding_is_accepted_with_its_reason_for_the_hall_or_for_one_controller() {
        let hall = hall(
            "accept_findings = [{ check = \"fast-forward\", why = \"the queue is watched\" }]",
            "accept_findings = [{ check = \"estop-disabled\", why = \"hard-wired contactor K1\" }]",
        )
        .unwrap();
        assert_eq!(hall.show.accept_findings[0].check, Check::FastForward);
        let [accepted] = hall.controllers[0].accept_findings.as_slice() else { panic!("one") };
        assert_eq!(accepted.check, Check::EstopDisabled);
        assert_eq!(accepted.why, "hard-wired contactor K1");
    }

    #[test]
    fn an_unknown_check_is_refused_with_its_likeness() {
        let fault = fault("{ check = \"estop-disable\", why = \"x\" }");
        assert!(fault.contains("hall.toml:15:"), "{fault}");
        assert!(fault.ends_with("did you mean estop-disabled?"), "{fault}");
    }

    #[test]
    fn an_acceptance_without_a_reason_is_refused() {
        assert!(fault("{ check = \"amplitude\" }").ends_with("accept_findings has no why, which is needed"));
        assert!(fault("{ check = \"amplitude\", why = \" \" }").contains("is empty"));
        assert!(fault("{ check = \"amplitude\", why = \"x\", who = \"me\" }").contains("who: unknown key"));
        assert!(fault("\"amplitude\"").contains("expected a table"));
    }

    #[test]
    fn silence_and_mere_news_cannot_be_accepted_and_nothing_twice() {
        assert!(fault("{ check = \"no-answer\", why = \"x\" }").contains("cannot be accepted"));
        assert!(fault("{ check = \"active-error\", why = \"x\" }").contains("not a setting"));
        assert!(fault("{ check = \"version\", why = \"x\" }").contains("for information"));
        let one = "{ check = \"amplitude\", why = \"x\" }";
        assert!(fault(&format!("{one}, {one}")).ends_with("amplitude is accepted twice here"));
    }
}
