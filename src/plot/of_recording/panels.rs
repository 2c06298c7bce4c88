//! The panels of a picture of a recording.

use super::film_axis::Moment;
use super::gather::{APART, Gathered, SeatCounts, Traces};
use super::words::places;
use crate::plot::{Band, Mark, Panel, Scale};
use crate::record::RecordedSeat;

/// All of them, those of what is there alone.
pub(super) fn panels(seat: &RecordedSeat, gathered: Gathered, other: Option<Gathered>) -> Vec<Panel> {
    let Gathered { look, asked, sent, measured, apart, parts, most, late, acks, counts, .. } = gathered;
    let unit = seat.axes().first().map_or("mm", |axis| axis.unit.name());
    let ends = range(seat, &asked, &sent);
    let over = if let Some(other) = other {
        let (plain, axis) = (&other.look.axis.time, &look.axis.time);
        let sent = if plain == axis { other.sent } else { other.sent.on(plain, axis) };
        Some(("dashed: the other recording", sent))
    } else {
        (look.is_detailed && counts.apart > APART).then_some(("dashed: where it was asked to be", asked))
    };
    let mut panels = vec![sent_panel(unit, ends, sent, over)];
    if counts.apart > APART {
        panels.push(apart_panel(unit, apart, &counts));
    }
    if look.is_detailed && measured.ends().is_some() {
        panels.push(panel("Measured", unit, ends, measured.bands(named("m"), 0)));
    }
    if parts.ends().is_some() {
        panels.extend(limits(parts, &most));
    }
    panels.extend(lateness_panel(&late, look.is_detailed, &counts));
    if let Some((_, high)) = acks.ends() {
        let bands = acks.bands(|_| "ack".to_owned(), 3);
        let note = format!("{:.3} ms at most", counts.ack_us / 1e3);
        panels.push(Panel { note, ..panel("Ack latency", "ms", (0.0, high.max(0.001)), bands) });
    }
    panels
}

/// The name of an axis' curve.
fn named(suffix: &'static str) -> impl Fn(usize) -> String {
    move |axis| format!("a{}{suffix}", axis + 1)
}

/// What was sent, and over it, dashed in the colour of the axis whose name stands at the end of what was sent, something else.
fn sent_panel(
    unit: &'static str,
    ends: (f64, f64),
    sent: Traces,
    over: Option<(&'static str, Traces)>,
) -> Panel {
    let mut bands = sent.bands(named(""), 0);
    let mut note = String::new();
    if let Some((words, traces)) = over {
        note = words.to_owned();
        bands.extend(traces.bands(|_| String::new(), 6));
    }
    Panel { note, ..panel("Sent", unit, ends, bands) }
}

fn apart_panel(unit: &'static str, apart: Traces, counts: &SeatCounts) -> Panel {
    let ends = apart.ends().unwrap_or((0.0, 1.0));
    Panel {
        note: format!("{} {unit} apart at most", places(counts.apart)),
        place: counts.apart_at.to_string(),
        ..panel("Asked less sent", unit, (ends.0.min(0.0), ends.1.max(0.0)), apart.bands(named("Δ"), 0))
    }
}

/// The stroke of all axes, and what lies outside of it.
fn range(seat: &RecordedSeat, asked: &Traces, sent: &Traces) -> (f64, f64) {
    let axes = seat.axes().iter().map(|axis| (axis.low, axis.low + axis.stroke));
    let all = axes.chain(asked.ends()).chain(sent.ends());
    let (low, high) =
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |ends, one| (ends.0.min(one.0), ends.1.max(one.1)));
    if low < high { (low, high) } else { (0.0, 1.0) }
}

fn panel(name: &str, unit: &'static str, (low, high): (f64, f64), bands: Vec<Band>) -> Panel {
    let high = if high > low { high } else { low + 1.0 };
    Panel {
        name: name.to_owned(),
        note: String::new(),
        place: String::new(),
        unit,
        scale: Scale::Range,
        low,
        high,
        bands,
        marks: Vec::new(),
    }
}

/// Speed, acceleration and jerk as parts of their limits, the most of all axes.
fn limits(parts: Traces, most: &[[(f64, Moment); 3]]) -> Vec<Panel> {
    let of = |(order, columns): (usize, Vec<Option<[f32; 2]>>)| {
        let of_axis = |(axis, most): (usize, &[(f64, Moment); 3])| (axis, most[order]);
        let worst = most.iter().enumerate().map(of_axis).max_by(|one, other| one.1.0.total_cmp(&other.1.0));
        let (axis, (part, at)) = worst.unwrap_or_default();
        let value = 100.0 * part;
        let columns = columns.into_iter().map(|column| column.map(|[_, most]| [0.0, most])).collect();
        let words = format!("a{}: {value:.0} % at {at}", axis + 1);
        Panel {
            note: format!("{value:.0} % of its limit"),
            place: format!("a{} {at}", axis + 1),
            scale: Scale::Limit,
            high: if part > 1.0 { (108.0 * part).ceil() } else { 108.0 },
            marks: vec![Mark { at_s: at.at_s, value, style: order, words }],
            ..panel(
                ["Speed", "Acceleration", "Jerk"][order],
                "%",
                (0.0, 108.0),
                vec![Band { name: "most".to_owned(), style: order, columns }],
            )
        }
    };
    parts.0.into_iter().enumerate().map(of).collect()
}

fn lateness_panel(late: &[Vec<f32>], is_detailed: bool, counts: &SeatCounts) -> Option<Panel> {
    let sorted: Vec<Vec<f32>> = late
        .iter()
        .map(|column| {
            let mut column = column.clone();
            column.sort_by(f32::total_cmp);
            column
        })
        .collect();
    let at = |percent: usize| {
        let of = |column: &Vec<f32>| {
            column.get((column.len().saturating_sub(1) * percent).div_ceil(100)).map(|ms| [*ms, *ms])
        };
        sorted.iter().map(of).collect::<Vec<_>>()
    };
    let band = |name: &str, style, percent| Band { name: name.to_owned(), style, columns: at(percent) };
    let mut bands = vec![band("late", 4, 100)];
    if is_detailed {
        bands.extend([band("p99", 1, 99), band("p50", 0, 50)]);
    }
    bands[0].last()?;
    let mut panel = panel("Lateness", "ms", (0.0, (counts.late_us / 1e3).max(0.001)), bands);
    panel.note = format!("{:.3} ms at most", counts.late_us / 1e3);
    panel.place = counts.late_at.to_string();
    Some(panel)
}
