//! The figures of a cue as a table and as JSON.

use std::sync::Arc;

use comfy_table::{CellAlignment, LineStyle, Table, TableStyle};
use serde::Serialize;

use crate::motion::SeatType;
use crate::timeline::{AxisFigures, Figure};

/// An axis in `--json`; positions in mm from the stroke's lower end.
#[derive(Debug, Serialize)]
pub(super) struct AxisReport {
    name: String,
    file: String,
    seat: String,
    unit: &'static str,
    position: Position,
    velocity: Most,
    acceleration: Most,
    jerk: Most,
}

/// The ends of what an axis does; `at_s` and `line` are those of `max`.
#[derive(Debug, Serialize)]
struct Position {
    min: f64,
    max: f64,
    at_s: f64,
    line: u64,
    min_at_s: f64,
    min_line: u64,
    stroke: f64,
}

/// The greatest size of something, and what the seat allows.
#[derive(Debug, Serialize)]
struct Most {
    max: f64,
    limit: f64,
    at_s: f64,
    line: u64,
}

impl Most {
    fn new(figure: Figure, limit: f64) -> Self {
        Self { max: figure.value, limit, at_s: figure.at.as_secs_f64(), line: figure.line }
    }
}

/// The axes of the cue in `file`.
pub(super) fn report(file: &str, figures: &[AxisFigures]) -> Vec<AxisReport> {
    let axis = |(index, figures): (usize, &AxisFigures)| {
        let AxisFigures { seat, lowest, highest, velocity, acceleration, jerk } = figures;
        AxisReport {
            name: format!("a{}", index + 1),
            file: file.to_owned(),
            seat: seat.name.clone(),
            unit: "mm",
            position: Position {
                min: lowest.value,
                max: highest.value,
                at_s: highest.at.as_secs_f64(),
                line: highest.line,
                min_at_s: lowest.at.as_secs_f64(),
                min_line: lowest.line,
                stroke: seat.stroke_mm,
            },
            velocity: Most::new(*velocity, seat.max_velocity_mm_s),
            acceleration: Most::new(*acceleration, seat.max_acceleration_mm_s2),
            jerk: Most::new(*jerk, seat.max_jerk_mm_s3),
        }
    };
    figures.iter().enumerate().map(axis).collect()
}

/// The names of the seat types that axes were judged for, each once.
pub(super) fn seat_names(seats: &[Arc<SeatType>]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for seat in seats {
        if !names.contains(&seat.name.as_str()) {
            names.push(&seat.name);
        }
    }
    names.join(", ")
}

/// A line under the header, and no other lines.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// One row an axis: the extremes, their part of the limit, and when; `!` marks what is over its limit.
pub(super) fn table(figures: &[AxisFigures]) -> String {
    let mut table = Table::new();
    table.load_style(STYLE);
    table.set_header([
        "axis",
        "lowest mm",
        "at",
        "highest mm",
        "at",
        "mm/s",
        "",
        "at",
        "mm/s²",
        "",
        "at",
        "mm/s³",
        "",
        "at",
    ]);
    for (index, f) in figures.iter().enumerate() {
        let mut row = vec![format!("a{}", index + 1)];
        for figure in [f.lowest, f.highest] {
            // Added to 0, a small value below 0 is not shown as -0.0.
            row.extend([format!("{:.1}", (10.0 * figure.value).round() / 10.0 + 0.0), figure.at.to_string()]);
        }
        let limits = [f.seat.max_velocity_mm_s, f.seat.max_acceleration_mm_s2, f.seat.max_jerk_mm_s3];
        for (figure, limit) in [f.velocity, f.acceleration, f.jerk].into_iter().zip(limits) {
            let mark = if figure.value > limit { " !" } else { "" };
            let percent = format!("{:.0} %{mark}", 100.0 * figure.value / limit);
            row.extend([format!("{:.0}", figure.value), percent, figure.at.to_string()]);
        }
        table.add_row(row);
    }
    table.column_iter_mut().for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    format!("{}\n", table.trim_fmt())
}
