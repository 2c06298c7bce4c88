//! The figures of a cue as a table and as JSON.

use comfy_table::CellAlignment;
use serde::Serialize;

use super::table;
use crate::motion::{AxisGeometry, AxisUnit, SeatAxis};
use crate::proof::{AxisFigures, AxisProof, Quantity, SLACK, Worst};
use crate::timeline::Figure;

/// An axis in `--json`; positions in `unit` from its zero.
#[derive(Debug, Serialize)]
pub(super) struct AxisReport {
    name: String,
    file: String,
    seat: String,
    unit: &'static str,
    position: Position,
    velocity: GreatestSize,
    /// Change of velocity from frame to frame, mm/s; `check` alone has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    step: Option<GreatestSize>,
    acceleration: GreatestSize,
    jerk: GreatestSize,
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
    /// The length of the stroke, and where its lower end is.
    stroke: f64,
    low: f64,
    /// What is left to the nearer end, as a part of the stroke, vibration on top in `check`.
    margin: f64,
}

/// The greatest size of something, and what the seat allows.
#[derive(Debug, Serialize)]
struct GreatestSize {
    max: f64,
    limit: f64,
    at_s: f64,
    line: u64,
    /// What is left of the limit, as a part of it.
    margin: f64,
}

impl GreatestSize {
    fn new(figure: Figure, limit: f64) -> Self {
        let Figure { value, at, line } = figure;
        Self::proved(Worst { value, limit, at, line })
    }

    fn proved(worst: Worst) -> Self {
        let Worst { value, limit, at, line } = worst;
        Self { max: value, limit, at_s: at.as_secs_f64(), line, margin: worst.margin() }
    }
}

impl Position {
    fn new(lowest: Figure, highest: Figure, axis: &AxisGeometry, margin: f64) -> Self {
        Self {
            min: lowest.value,
            max: highest.value,
            at_s: highest.at.as_secs_f64(),
            line: highest.line,
            min_at_s: lowest.at.as_secs_f64(),
            min_line: lowest.line,
            stroke: axis.stroke(),
            low: axis.low,
            margin,
        }
    }
}

/// The axes of the cue in `file`.
pub(super) fn report(file: &str, figures: &[AxisFigures]) -> Vec<AxisReport> {
    let axis = |(index, figures): (usize, &AxisFigures)| {
        let AxisFigures { on, lowest, highest, velocity, acceleration, jerk } = figures;
        let geometry = on.geometry();
        AxisReport {
            name: format!("a{}", index + 1),
            file: file.to_owned(),
            seat: on.seat.name.clone(),
            unit: geometry.unit.name(),
            position: Position::new(*lowest, *highest, geometry, room(lowest, highest, geometry)),
            velocity: GreatestSize::new(*velocity, geometry.max_velocity),
            step: None,
            acceleration: GreatestSize::new(*acceleration, geometry.max_acceleration),
            jerk: GreatestSize::new(*jerk, geometry.max_jerk),
        }
    };
    figures.iter().enumerate().map(axis).collect()
}

fn room(lowest: &Figure, highest: &Figure, axis: &AxisGeometry) -> f64 {
    axis.room(lowest.value).min(axis.room(highest.value))
}

/// The proved axes of the cue in `file`.
pub(super) fn proved(file: &str, axes: &[AxisProof]) -> Vec<AxisReport> {
    let axis = |proof: &AxisProof| AxisReport {
        name: format!("a{}", proof.axis + 1),
        file: file.to_owned(),
        seat: proof.on.seat.name.clone(),
        unit: proof.on.geometry().unit.name(),
        position: Position::new(proof.lowest, proof.highest, proof.on.geometry(), proof.position_margin()),
        velocity: GreatestSize::proved(proof.velocity),
        step: Some(GreatestSize::proved(proof.step)),
        acceleration: GreatestSize::proved(proof.acceleration),
        jerk: GreatestSize::proved(proof.jerk),
    };
    axes.iter().map(axis).collect()
}

/// One row a limit: what is worst, what is left, and where; `!` marks what is over its limit.
pub(super) fn proof_table(axes: &[AxisProof]) -> String {
    let mut table = table::ruled();
    table.set_header(["axis", "limit", "", "worst", "margin", "at", "row"]);
    for proof in axes {
        let name = format!("a{} {}", proof.axis + 1, proof.on.seat.name);
        table.add_row(position_row(name, proof));
        for (quantity, worst) in proof.worst() {
            let unit = quantity.unit(proof.on.geometry().unit);
            let short = if quantity == Quantity::Step { "frame to frame" } else { quantity.name() };
            table.add_row([
                String::new(),
                short.to_owned(),
                format!("{:.0} {unit}", worst.limit),
                format!("{:.1} {unit}", worst.value),
                margin(worst.margin(), worst.value > SLACK * worst.limit),
                worst.at.to_string(),
                worst.line.to_string(),
            ]);
        }
    }
    table.column_iter_mut().skip(2).for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    format!("{}\n", table.trim_fmt())
}

/// The position that comes nearest to an end of the stroke, vibration on top.
fn position_row(name: String, proof: &AxisProof) -> [String; 7] {
    let axis = proof.on.geometry();
    let unit = axis.unit.name();
    let lowest = proof.lowest_shaken.filter(|shaken| shaken.value < proof.lowest.value);
    let highest = proof.highest_shaken.filter(|shaken| shaken.value > proof.highest.value);
    let (low, high) = (lowest.unwrap_or(proof.lowest), highest.unwrap_or(proof.highest));
    let (left, near) = proof.nearest();
    [
        name,
        "position".to_owned(),
        format!("{:.0} to {:.0} {unit}", axis.low, axis.high),
        format!("{:.1} to {:.1} {unit}", low.value + 0.0, high.value),
        margin(left, left < -1e-6),
        near.at.to_string(),
        near.line.to_string(),
    ]
}

fn margin(part: f64, is_over: bool) -> String {
    format!("{:.1} %{}", 100.0 * part + 0.0, if is_over { " !" } else { "" })
}

/// The names of the seat types that axes were judged for, each once.
pub(super) fn seat_names(seats: &[SeatAxis]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for SeatAxis { seat, .. } in seats {
        if !names.contains(&seat.name.as_str()) {
            names.push(&seat.name);
        }
    }
    names.join(", ")
}

/// One row an axis: the extremes, their part of the limit, and when; `!` marks what is over its limit.
pub(super) fn axes_table(figures: &[AxisFigures]) -> String {
    let mut table = table::ruled();
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
        let unit = match f.on.geometry().unit {
            AxisUnit::Millimetre => "",
            AxisUnit::Degree => ", in deg",
        };
        let mut row = vec![format!("a{}{unit}", index + 1)];
        for figure in [f.lowest, f.highest] {
            // Added to 0, a small value below 0 is not shown as -0.0.
            row.extend([format!("{:.1}", (10.0 * figure.value).round() / 10.0 + 0.0), figure.at.to_string()]);
        }
        let AxisGeometry { max_velocity, max_acceleration, max_jerk, .. } = *f.on.geometry();
        let limits = [max_velocity, max_acceleration, max_jerk];
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
