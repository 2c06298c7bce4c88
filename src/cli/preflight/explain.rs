//! The table of checks, for a person.

use crate::cli::table;
use crate::preflight::Check;

/// All checks: what they are called, what about, how grave.
pub(super) fn all() -> String {
    let mut table = table::ruled();
    table.set_header(["check", "about", "severity", "can be accepted"]);
    for check in Check::ALL {
        let accepted = if check.can_be_accepted() { "yes" } else { "no" };
        table.add_row([check.id(), check.family().title(), check.severity().word(), accepted]);
    }
    format!("{}\n\n`kinocue preflight --explain CHECK` says why one matters.\n", table.trim_fmt())
}

/// One check, with why it matters.
pub(super) fn one(check: Check) -> String {
    let accepted = if check.can_be_accepted() { "can be accepted by name" } else { "cannot be accepted" };
    let (family, severity) = (check.family().title(), check.severity().word());
    format!("{check} ({family}, {severity}, {accepted})\n{}\n", check.why())
}
