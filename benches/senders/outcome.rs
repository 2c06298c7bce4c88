//! What one sender came back with.

use std::time::Duration;

use kinocue::harness::tracker::Histogram;
use serde::{Deserialize, Serialize};

/// The figures of one sender in one round.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Outcome {
    /// Instant before a tick's first send, minus its deadline.
    pub(crate) lateness: Quantiles,
    /// The kernel's receive time of an ack, minus the instant before its frame was sent.
    pub(crate) ack: Quantiles,
    /// Ticks that sent.
    pub(crate) ticks: u64,
    /// Ticks slept through.
    pub(crate) missed: u64,
    /// Frames sent.
    pub(crate) sent: u64,
    /// Acks read.
    pub(crate) acked: u64,
    /// Processor time of the sending thread for each frame sent, µs.
    pub(crate) send_us: f64,
    /// Processor time of the receiving thread for each ack read, µs.
    pub(crate) receive_us: f64,
    /// How the sending thread was scheduled.
    pub(crate) policy: String,
    /// Whether its memory was locked.
    pub(crate) locked: bool,
}

/// Percentiles, µs.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Quantiles {
    pub(crate) p50: f64,
    pub(crate) p99: f64,
    pub(crate) p999: f64,
    pub(crate) max: f64,
}

impl Quantiles {
    /// Those of a histogram of nanoseconds.
    pub(crate) fn of(histogram: &Histogram) -> Self {
        let at = |quantile| micros(Duration::from_nanos(histogram.value_at_quantile(quantile)));
        Self { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: at(1.0) }
    }
}

fn micros(span: Duration) -> f64 {
    span.div_duration_f64(Duration::from_micros(1))
}

/// Microseconds of `span` for each of `count`; of none, those of one.
#[expect(clippy::cast_precision_loss, reason = "a few million datagrams")]
pub(crate) fn each(span: Duration, count: u64) -> f64 {
    micros(span) / count.max(1) as f64
}
