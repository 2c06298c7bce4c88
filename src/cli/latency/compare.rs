//! `kinocue latency --compare`: two files of histograms side by side.

use std::io::Read as _;
use std::path::Path;

use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::latency::{Comparison, TimesRow, read};
use crate::rt::Times;
use crate::sys;

/// A log of an hour is some megabytes; what is longer than this is none of ours.
const MAX_LEN: u64 = 256 << 20;

#[derive(Debug, Serialize)]
struct CompareReport<'a> {
    a: String,
    b: String,
    #[serde(flatten)]
    comparison: &'a Comparison,
}

pub(super) fn run(a: &Path, b: &Path, json: bool) -> Result<Exit, Failure> {
    let comparison = Comparison::of(&load(a)?, &load(b)?);
    let [a, b] = [a, b].map(|path| path.display().to_string());
    if json {
        print::json(&CompareReport { a, b, comparison: &comparison })?;
    } else {
        print::out(&text(&a, &b, &comparison))?;
    }
    Ok(Exit::Done)
}

fn load(path: &Path) -> Result<Times, Failure> {
    let named =
        |exit, error: anyhow::Error| Failure { exit, error: error.context(path.display().to_string()) };
    let io = |error: std::io::Error| {
        let missing = error.kind() == std::io::ErrorKind::NotFound;
        named(if missing { Exit::NoInput } else { Exit::Io }, error.into())
    };
    let mut text = Vec::new();
    sys::file::open(path).and_then(|file| file.take(MAX_LEN).read_to_end(&mut text)).map_err(io)?;
    read(&text).or_exit(Exit::BadCue).map_err(|failure| named(failure.exit, failure.error))
}

fn text(a: &str, b: &str, comparison: &Comparison) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["µs", "", "A", "B", "B / A"]);
    let Comparison { lateness, ack_latency } = comparison;
    for (name, row) in [("lateness", lateness), ("ack latency", ack_latency)] {
        add(&mut table, name, row);
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    format!("A = {a}\nB = {b}\n\n{table}\n\n{}\n{}\n", lateness.verdict, ack_latency.verdict)
}

fn add(table: &mut Table, name: &str, row: &TimesRow) {
    let shown = |us: Option<f64>| us.map_or_else(|| "-".to_owned(), |us| format!("{us:.1}"));
    for (place, figure) in row.figures.iter().enumerate() {
        let ratio = figure.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.2}"));
        let name = if place == 0 { name } else { "" };
        table.add_row([name, figure.figure, &shown(figure.a_us), &shown(figure.b_us), &ratio]);
    }
    table.add_row(["", "times", &row.a_count.to_string(), &row.b_count.to_string(), ""]);
}
