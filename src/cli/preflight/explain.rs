//! The table of checks, for a person.

use comfy_table::{LineStyle, Table, TableStyle};

use crate::preflight::Check;

/// A line under the header, and no other lines.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// All checks: what they are called, what about, how grave.
pub(super) fn all() -> String {
    let mut table = Table::new();
    table.load_style(STYLE);
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
