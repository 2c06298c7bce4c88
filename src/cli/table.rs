//! Tables, with a line under their header or none, and no wider than the terminal that they go to.

use std::io;

use comfy_table::{ContentArrangement, LineStyle, Table, TableStyle, presets};

use crate::sys::terminal;

const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// A table with a line under its header, for standard output.
pub(super) fn ruled() -> Table {
    fitted(STYLE)
}

/// A table without any line, for standard output.
pub(super) fn bare() -> Table {
    fitted(presets::NOTHING)
}

/// Into a pipe or a file each row is one line, however long.
fn fitted(style: TableStyle) -> Table {
    let mut table = Table::new();
    table.load_style(style);
    if let Some(width) = terminal::width(io::stdout()) {
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
    }
    table
}

/// A table of these rows, each as long as the header, ending with the end of its last line.
pub(super) fn table<const N: usize>(
    header: [&str; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let mut table = ruled();
    table.set_header(header);
    for row in rows {
        table.add_row(row);
    }
    format!("{}\n", table.trim_fmt())
}
