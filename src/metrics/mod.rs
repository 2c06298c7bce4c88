//! The status of the hall as figures for Prometheus: `OpenMetrics` text, in base units; the tick thread formats none of it.
//! Every label has as many values as the configuration has names. Control plane.

use std::fmt;

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, NoLabelSet, text};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::exemplar::Exemplar;
use prometheus_client::registry::Registry;

use crate::control::{self, Status};

mod controllers;
mod film;
mod format;
pub(crate) mod halls;
mod links;
mod record;
mod shows;
#[cfg(test)]
mod tests;

pub(crate) use format::negotiated;

/// All figures of a status as `OpenMetrics` text.
///
/// # Panics
/// Never: a `String` takes whatever is written to it.
#[must_use]
pub(crate) fn render(status: &Status) -> String {
    encoded(families(status))
}

fn encoded(families: Vec<MetricFamily>) -> String {
    let mut registry = Registry::with_prefix("kinocue");
    registry.register_collector(Box::new(Families(families)));
    let mut page = String::new();
    text::encode(&mut page, &registry).expect("a string takes all that is written to it");
    page
}

fn families(status: &Status) -> Vec<MetricFamily> {
    let mut families = shows::families(status);
    families.extend(controllers::families(&status.controllers));
    families.extend(links::families(&status.links, &status.link_ack_latency.histogram));
    families.extend(record::families(&status.record));
    families.extend(status.film.iter().flat_map(film::families));
    families
}

/// Counters can name one thing that they counted; ours do not.
const NO_EXEMPLAR: Option<&Exemplar<NoLabelSet, u64>> = None;

/// Names of labels, and their values.
type Labels = Vec<(&'static str, String)>;

/// One figure, for each set of labels.
#[derive(Debug)]
struct MetricFamily {
    /// Its name, without `kinocue_` in front, and without `_total` or `_info` behind.
    name: &'static str,
    /// What it is, for a person; no full stop.
    help: &'static str,
    values: MetricValues,
}

#[derive(Debug)]
enum MetricValues {
    /// What goes up and down.
    Gauges(Vec<(Labels, f64)>),
    /// What only grows while the program runs.
    Counters(Vec<(Labels, u64)>),
    /// The same of seconds.
    Seconds(Vec<(Labels, f64)>),
    /// What is said by labels alone.
    Info(Labels),
    /// Counts by size, s.
    Histogram { sum: f64, buckets: Vec<(f64, u64)> },
}

impl MetricFamily {
    fn gauge(name: &'static str, help: &'static str, value: impl Into<Option<f64>>) -> Self {
        let values = value.into().map(|value| (Labels::new(), value)).into_iter().collect();
        Self { name, help, values: MetricValues::Gauges(values) }
    }

    fn counter(name: &'static str, help: &'static str, value: u64) -> Self {
        Self { name, help, values: MetricValues::Counters(vec![(Labels::new(), value)]) }
    }

    fn histogram(name: &'static str, help: &'static str, histogram: &control::Histogram) -> Self {
        let bounds = histogram.bounds_us.iter().map(|us| us / 1e6).chain([f64::INFINITY]);
        let mut buckets: Vec<_> = bounds.zip(histogram.counts.iter().copied()).collect();
        if buckets.is_empty() {
            buckets.push((f64::INFINITY, 0)); // the format asks for this one
        }
        Self { name, help, values: MetricValues::Histogram { sum: histogram.sum_s, buckets } }
    }

    fn encode(&self, encoder: &mut DescriptorEncoder) -> fmt::Result {
        let Self { name, help, values } = self;
        let kind = match values {
            MetricValues::Gauges(_) => MetricType::Gauge,
            MetricValues::Counters(_) | MetricValues::Seconds(_) => MetricType::Counter,
            MetricValues::Info(_) => MetricType::Info,
            MetricValues::Histogram { .. } => MetricType::Histogram,
        };
        let mut metric = encoder.encode_descriptor(name, help, None, kind)?;
        match values {
            MetricValues::Gauges(all) => all.iter().try_for_each(|(labels, value)| match labels.as_slice() {
                [] => metric.encode_gauge(value),
                _ => metric.encode_family(labels)?.encode_gauge(value),
            }),
            MetricValues::Counters(all) => {
                all.iter().try_for_each(|(labels, value)| match labels.as_slice() {
                    [] => metric.encode_counter(value, NO_EXEMPLAR),
                    _ => metric.encode_family(labels)?.encode_counter(value, NO_EXEMPLAR),
                })
            }
            MetricValues::Seconds(all) => all.iter().try_for_each(|(labels, seconds)| {
                metric.encode_family(labels)?.encode_counter(seconds, NO_EXEMPLAR)
            }),
            MetricValues::Info(labels) => metric.encode_info(labels),
            MetricValues::Histogram { sum, buckets } => {
                let count = buckets.iter().map(|(_, count)| count).sum();
                metric.encode_histogram::<NoLabelSet>(*sum, count, buckets, None)
            }
        }
    }
}

/// What a registry asks for its figures.
#[derive(Debug)]
struct Families(Vec<MetricFamily>);

impl Collector for Families {
    fn encode(&self, mut encoder: DescriptorEncoder) -> fmt::Result {
        self.0.iter().try_for_each(|family| family.encode(&mut encoder))
    }
}

/// 1 for yes, 0 for no.
fn flag(yes: bool) -> f64 {
    f64::from(u8::from(yes))
}
