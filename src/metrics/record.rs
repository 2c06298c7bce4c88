//! Figures of what is recorded.

use super::{MetricFamily, MetricValues, flag};
use crate::control::RecordStatus;

/// All of them.
#[expect(clippy::cast_precision_loss, reason = "bytes of a disk")]
pub(super) fn families(record: &RecordStatus) -> Vec<MetricFamily> {
    let active = vec![(vec![("mode", record.mode.clone())], flag(record.recording.is_some()))];
    let incidents = record.incidents.iter().map(|(cause, count)| (vec![("cause", cause.clone())], *count));
    vec![
        MetricFamily {
            name: "record_active",
            help: "1 while a show is recorded, by recording mode",
            values: MetricValues::Gauges(active),
        },
        MetricFamily::counter("record_bytes", "Bytes of recordings that were closed", record.bytes),
        MetricFamily::counter("record_dropped_ticks", "Ticks that were not recorded", record.dropped_ticks),
        MetricFamily::counter(
            "record_dropped_replies",
            "Records of replies that were not recorded",
            record.dropped_records,
        ),
        MetricFamily::counter(
            "record_dropped_notes",
            "Events and commands that were not recorded",
            record.dropped_notes,
        ),
        MetricFamily::gauge(
            "record_free_bytes",
            "Bytes that are free on the disk of recordings",
            record.free_bytes as f64,
        ),
        MetricFamily::gauge(
            "record_flight_seconds",
            "How far back the flight recorder reaches",
            record.flight_s,
        ),
        MetricFamily {
            name: "record_incidents",
            help: "Incidents, by cause",
            values: MetricValues::Counters(incidents.collect()),
        },
        MetricFamily::counter("record_marks_left_out", "Marks that were one too many", record.more_marks),
        MetricFamily::counter("record_errors", "Failed writes", record.errors),
    ]
}
