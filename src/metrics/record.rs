//! Figures of what is recorded.

use super::{Family, Values, flag};
use crate::control::RecordStatus;

/// All of them.
#[expect(clippy::cast_precision_loss, reason = "bytes of a disk")]
pub(super) fn families(record: &RecordStatus) -> Vec<Family> {
    let active = vec![(vec![("mode", record.mode.clone())], flag(record.recording.is_some()))];
    let incidents = record.incidents.iter().map(|(cause, count)| (vec![("cause", cause.clone())], *count));
    vec![
        Family {
            name: "record_active",
            help: "1 while a show is recorded, by how much of it is kept",
            values: Values::Gauges(active),
        },
        Family::counter("record_bytes", "Bytes of recordings that were closed", record.bytes),
        Family::counter("record_dropped_ticks", "Ticks that were not recorded", record.dropped_ticks),
        Family::counter(
            "record_dropped_replies",
            "Records of replies that were not recorded",
            record.dropped_records,
        ),
        Family::counter(
            "record_dropped_notes",
            "Events and commands that were not recorded",
            record.dropped_notes,
        ),
        Family::gauge(
            "record_free_bytes",
            "Bytes that are free on the disk of recordings",
            record.free_bytes as f64,
        ),
        Family::gauge("record_flight_seconds", "How far back the flight recorder reaches", record.flight_s),
        Family {
            name: "record_incidents",
            help: "What was worth an incident, by what it was",
            values: Values::Counters(incidents.collect()),
        },
        Family::counter("record_errors", "How often something could not be written", record.errors),
    ]
}
