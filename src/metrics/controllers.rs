//! Figures of each controller.

use super::{Labels, MetricFamily, MetricValues, flag};
use crate::control::model::FrameCounts;
use crate::control::{ControllerStatus, Health};

pub(super) fn families(controllers: &[ControllerStatus]) -> Vec<MetricFamily> {
    let mut all = health(controllers);
    all.extend(frames(controllers));
    all
}

fn health(all: &[ControllerStatus]) -> Vec<MetricFamily> {
    vec![
        gauges(all, "controller_up", "1 if the controller answers", |one| answers(one.health)),
        gauges(all, "controller_enabled", "1 if it takes part", |one| Some(flag(one.enabled))),
        MetricFamily {
            name: "controller_health",
            help: "1, with its health as a label",
            values: MetricValues::Gauges(
                all.iter().map(|one| (and(one, "health", one.health.word()), 1.0)).collect(),
            ),
        },
        gauges(all, "controller_emergency_stop", "1 while an emergency stop is in effect", |one| {
            Some(flag(one.emergency_stop))
        }),
        gauges(all, "controller_error", "Its error number, 0 for none", |one| one.error.map(f64::from)),
        gauges(all, "controller_silence_seconds", "Time since its last answer", |one| one.heard_s),
        gauges(all, "controller_ack_ratio", "Share of requested acks that came, in the last second", |one| {
            one.ack_rate
        }),
        torques(all),
        latencies(all),
    ]
}

fn frames(all: &[ControllerStatus]) -> Vec<MetricFamily> {
    let acks = all.iter().flat_map(|one| {
        let FrameCounts { acked, refused, lost, withdrawn, .. } = one.frames;
        let withdrawn = (withdrawn > 0).then_some(("withdrawn", withdrawn));
        let results = [("acked", acked), ("refused", refused), ("lost", lost)].into_iter().chain(withdrawn);
        results.map(|(result, count)| (and(one, "result", result), count))
    });
    vec![
        counters(all, "frames_sent", "Frames handed to the kernel", |one| one.frames.sent),
        counters(all, "frames_failed", "Frames that the kernel did not take", |one| one.send_failed),
        counters(all, "frames_asked", "Frames that requested an ack", |one| one.frames.asked),
        MetricFamily {
            name: "acks",
            help: "Results of the frames that requested an ack; lost: no reply within a second; withdrawn: its drives were told to stop",
            values: MetricValues::Counters(acks.collect()),
        },
        counters(all, "limit_interventions", "How often the limiter held motion back", |one| one.clamps),
    ]
}

/// True if it answers; `None` if nobody listens for its answers, or asks.
const fn answers(health: Health) -> Option<f64> {
    match health {
        Health::Lost | Health::Unknown => Some(0.0),
        Health::Unwatched | Health::Out => None,
        _ => Some(1.0),
    }
}

/// The unit is that of the reports, which no manual says.
fn torques(all: &[ControllerStatus]) -> MetricFamily {
    let values = all.iter().flat_map(|one| {
        let axes = (1..).zip(one.forces.iter().flatten());
        axes.map(|(axis, force): (u32, _)| (and(one, "axis", &axis.to_string()), f64::from(*force)))
    });
    MetricFamily {
        name: "controller_torque",
        help: "Torque of each axis as the controller reports it (0x3101, DP90 to DP95), in its own unit",
        values: MetricValues::Gauges(values.collect()),
    }
}

/// Percentiles, not a histogram for each: those of all on the network together are in `ack_latency_seconds`.
fn latencies(all: &[ControllerStatus]) -> MetricFamily {
    let values = all.iter().flat_map(|one| {
        [("0.5", one.ack_p50_us), ("0.99", one.ack_p99_us)]
            .into_iter()
            .filter_map(|(quantile, us)| Some((and(one, "quantile", quantile), us? / 1e6)))
    });
    MetricFamily {
        name: "controller_ack_latency_seconds",
        help: "Latency of its acks since the program started",
        values: MetricValues::Gauges(values.collect()),
    }
}

fn gauges(
    all: &[ControllerStatus],
    name: &'static str,
    help: &'static str,
    value: impl Fn(&ControllerStatus) -> Option<f64>,
) -> MetricFamily {
    let values = all.iter().filter_map(|one| Some((of(one), value(one)?))).collect();
    MetricFamily { name, help, values: MetricValues::Gauges(values) }
}

fn counters(
    all: &[ControllerStatus],
    name: &'static str,
    help: &'static str,
    count: impl Fn(&ControllerStatus) -> u64,
) -> MetricFamily {
    let values = all.iter().map(|one| (of(one), count(one))).collect();
    MetricFamily { name, help, values: MetricValues::Counters(values) }
}

fn of(one: &ControllerStatus) -> Labels {
    let mut labels = vec![("controller", one.name.clone())];
    labels.extend(one.row.clone().map(|row| ("row", row)));
    labels
}

fn and(one: &ControllerStatus, name: &'static str, value: &str) -> Labels {
    let mut labels = of(one);
    labels.push((name, value.to_owned()));
    labels
}
