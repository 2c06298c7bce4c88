//! What the recording says of itself in sums: its samples, its end and the report of the play.

use serde_json::Value;

use super::bench::Bench;
use crate::control::Percentiles;
use crate::record::Contents;
use crate::tracker::{Books, Histogram};

/// Lateness is recorded in whole microseconds.
const LATE_US: f64 = 1.0;
/// Histograms have three digits.
const DIGITS: f64 = 2e-3;

/// Holds what samples say against the books of the last drain.
pub(super) fn of_samples(bench: &mut Bench, books: &Books, contents: &Contents) {
    // Those of a cut are of ticks alone, and its end counts no acks.
    let is_counted = bench.is_whole() && contents.end.contains_key("acked");
    let seats = if is_counted { bench.seats.len() } else { 0 };
    for seat in 0..seats {
        let (counts, sampled) = (books.tracker().counts(seat), bench.sampled[seat]);
        bench.compare_total(Some(seat), "acks in its samples", sampled.acked, counts.acked);
        bench.compare_total(Some(seat), "refusals in its samples", sampled.refused, counts.refused());
        bench.compare_total(Some(seat), "lost frames in its samples", sampled.lost, counts.lost);
    }
}

/// Holds what the end of the file and the report say against the books, which are closed.
pub(super) fn of_report(bench: &mut Bench, books: &Books, contents: &Contents) {
    if !bench.is_whole() {
        return;
    }
    let tracker = books.tracker();
    let all = (0..bench.seats.len()).map(|seat| tracker.counts(seat));
    let (acked, refused) =
        all.fold((0, 0), |(acked, refused), one| (acked + one.acked, refused + one.refused()));
    for (key, what, again) in [("acked", "acks in all", acked), ("refused", "refusals in all", refused)] {
        if let Some(recorded) = contents.end.get(key).and_then(|count| count.parse().ok()) {
            bench.compare_total(None, what, recorded, again);
        }
    }
    let Some(report) = contents.report.as_deref().and_then(|text| serde_json::from_slice(text).ok()) else {
        return;
    };
    let report: Value = report;
    for seat in 0..bench.seats.len() {
        let (counts, told) = (tracker.counts(seat), &report["controllers"][seat]);
        let figures = [
            ("sent", counts.sent),
            ("asked", counts.asked),
            ("acked", counts.acked),
            ("refused", counts.refused()),
            ("lost", counts.lost),
            ("duplicate", counts.duplicate),
            ("stale", counts.stale),
            ("send_failed", counts.send_failed),
        ];
        for (key, again) in figures {
            if let Some(recorded) = told[key].as_u64() {
                bench.compare_total(Some(seat), &format!("{key} in the report"), recorded, again);
            }
        }
        times(bench, Some(seat), "ack latency in the report", &told["ack_us"], tracker.latency(seat), 0.0);
    }
    let lateness = bench.lateness.clone();
    // Frames that bring a seat to park before the show are of no tick that is counted.
    if report["ticks"].as_u64() == Some(lateness.len()) {
        times(bench, None, "lateness in the report", &report["lateness_us"], &lateness, LATE_US);
    }
}

/// Holds percentiles against a histogram.
fn times(bench: &mut Bench, seat: Option<usize>, what: &str, told: &Value, again: &Histogram, apart_us: f64) {
    let Percentiles { p50_us, p99_us, p999_us, max_us } = Percentiles::of(again);
    for (key, again) in [("p50", p50_us), ("p99", p99_us), ("p999", p999_us), ("max", max_us)] {
        let (recorded, again) = (told[key].as_f64(), again);
        let is_same = match (recorded, again) {
            (Some(recorded), Some(again)) => (recorded - again).abs() <= apart_us + DIGITS * recorded,
            (recorded, again) => recorded == again,
        };
        if !is_same {
            let words = |us: Option<f64>| us.map_or_else(|| "none".to_owned(), |us| format!("{us} µs"));
            bench.differs_in_total(seat, format!("{key} of {what}"), (words(recorded), words(again)));
        }
    }
}
