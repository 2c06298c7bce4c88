//! Figures of each serial link, and of each axis on it.

use super::{Labels, MetricFamily, MetricValues, flag};
use crate::control::{Histogram, LinkAxisStatus, LinkStatus};

pub(super) fn families(links: &[LinkStatus], ack_latency: &Histogram) -> Vec<MetricFamily> {
    if links.is_empty() {
        return Vec::new();
    }
    let up = links.iter().map(|link| (of(link), flag(link.fault.is_none())));
    let delay = links.iter().map(|link| (of(link), link.delay_p99_us / 1e6));
    vec![
        MetricFamily {
            name: "link_up",
            help: "1 if its port is open",
            values: MetricValues::Gauges(up.collect()),
        },
        MetricFamily {
            name: "link_answer_delay_seconds",
            help: "99th percentile of the time from a request to the start of its answer",
            values: MetricValues::Gauges(delay.collect()),
        },
        MetricFamily::histogram(
            "link_ack_latency_seconds",
            "Time from handing a frame to a link to when drives had it, all seats on links",
            ack_latency,
        ),
        MetricFamily {
            name: "link_exchanges",
            help: "Requests to drives, by result; stray: answers without a request",
            values: MetricValues::Counters(links.iter().flat_map(exchanges).collect()),
        },
        MetricFamily {
            name: "axis_segments",
            help: "Segments of motion made for an axis, by result",
            values: MetricValues::Counters(axes(links).flat_map(segments).collect()),
        },
        MetricFamily {
            name: "axis_queue_dry",
            help: "How often the queue of an axis ran dry in motion",
            values: MetricValues::Counters(
                axes(links).map(|(link, axis)| (at(link, axis), axis.dry)).collect(),
            ),
        },
        MetricFamily {
            name: "axis_error_meters",
            help: "Distance of the motor from its target when both were last read",
            values: MetricValues::Gauges(
                axes(links).map(|(link, axis)| (at(link, axis), axis.error_mm / 1e3)).collect(),
            ),
        },
    ]
}

fn axes(links: &[LinkStatus]) -> impl Iterator<Item = (&LinkStatus, &LinkAxisStatus)> {
    links.iter().flat_map(|link| link.axes.iter().map(move |axis| (link, axis)))
}

fn exchanges(link: &LinkStatus) -> Vec<(Labels, u64)> {
    let counts =
        [("asked", link.asked), ("answered", link.answered), ("late", link.late), ("stray", link.stray)];
    counts.map(|(result, count)| (and(of(link), result), count)).into()
}

fn segments((link, axis): (&LinkStatus, &LinkAxisStatus)) -> Vec<(Labels, u64)> {
    let counts = [
        ("made", axis.made),
        ("acked", axis.acked),
        ("refused", axis.refused),
        ("in_doubt", axis.in_doubt),
        ("skipped", axis.skipped),
    ];
    counts.map(|(result, count)| (and(at(link, axis), result), count)).into()
}

fn of(link: &LinkStatus) -> Labels {
    vec![("link", link.name.clone())]
}

fn at(link: &LinkStatus, axis: &LinkAxisStatus) -> Labels {
    let mut labels = of(link);
    labels.extend([("controller", axis.controller.clone()), ("axis", format!("a{}", axis.axis))]);
    labels
}

fn and(mut labels: Labels, result: &str) -> Labels {
    labels.push(("result", result.to_owned()));
    labels
}
