//! Figures of the hall: its state, its show, the ticks, and what the machine grants.

use std::collections::BTreeMap;

use super::{Labels, MetricFamily, MetricValues, flag};
use crate::control::Status;
use crate::state::State;

pub(super) fn families(status: &Status) -> Vec<MetricFamily> {
    let mut all = state(status);
    all.extend(ticks(status));
    all.extend(levels(status));
    all.extend(machine(status));
    all.push(warnings(status));
    all.extend(status.osc.as_ref().map(|counts| MetricFamily {
        name: "osc_messages",
        help: "OSC messages received, by result",
        values: MetricValues::Counters(
            counts.iter().map(|(word, count)| (label("result", word.as_str()), *count)).collect(),
        ),
    }));
    all
}

fn state(status: &Status) -> Vec<MetricFamily> {
    let show = status.show.as_ref();
    let preflight = status.preflight.as_ref();
    let states = State::ALL.map(|state| (label("state", state.word()), flag(status.state == state)));
    vec![
        MetricFamily {
            name: "build",
            help: "Version of the program",
            values: MetricValues::Info(label("version", &*status.version)),
        },
        MetricFamily::gauge("uptime_seconds", "Time since the program started", status.uptime_s),
        MetricFamily {
            name: "state",
            help: "1 for the state of the hall",
            values: MetricValues::Gauges(states.into()),
        },
        MetricFamily::gauge("state_age_seconds", "Time since the hall entered its state", status.since_s),
        MetricFamily::gauge("moving", "1 while motion frames leave", flag(status.moving)),
        MetricFamily::gauge(
            "show_position_seconds",
            "Position in the loaded cue",
            show.map(|show| show.position_s),
        ),
        MetricFamily::gauge(
            "show_length_seconds",
            "The length of the loaded cue",
            show.map(|show| show.length_s),
        ),
        MetricFamily::gauge(
            "trim_seconds",
            "How much later than the film the motion is",
            f64::from(status.trim_ms) / 1e3,
        ),
        MetricFamily::gauge(
            "preflight_passed",
            "1 if the last preflight found nothing that fails",
            preflight.map(|preflight| flag(preflight.passed)),
        ),
        MetricFamily::gauge(
            "preflight_age_seconds",
            "Time since the last preflight",
            preflight.map(|preflight| preflight.age_s),
        ),
    ]
}

fn ticks(status: &Status) -> Vec<MetricFamily> {
    vec![
        MetricFamily::gauge("tick_rate_hertz", "Ticks per second, as configured", status.rate_hz),
        MetricFamily::counter("ticks", "Ticks, in every state", status.ticks),
        MetricFamily::counter("ticks_missed", "Ticks that the thread slept through", status.missed_ticks),
        MetricFamily::histogram(
            "tick_lateness_seconds",
            "Time from the deadline of a tick to its first send, of ticks that sent",
            &status.lateness.histogram,
        ),
        MetricFamily::histogram(
            "ack_latency_seconds",
            "Time from sending a frame to its ack, all controllers on the network",
            &status.ack_latency.histogram,
        ),
    ]
}

fn levels(status: &Status) -> Vec<MetricFamily> {
    let levels = &status.levels;
    let groups = [("motion", levels.motion), ("vibration", levels.vibration)];
    let groups = groups.map(|(group, level)| (label("group", group), level));
    let rows = levels.rows.iter().map(|(row, level)| (label("row", row), *level));
    let effects = levels.effects.iter().map(|(effect, on)| (label("effect", effect), flag(*on)));
    vec![
        MetricFamily {
            name: "level_ratio",
            help: "Level of the hall, 0 to 1",
            values: MetricValues::Gauges(groups.into()),
        },
        MetricFamily {
            name: "row_level_ratio",
            help: "Level of a row, on top of the hall's, 0 to 1",
            values: MetricValues::Gauges(rows.collect()),
        },
        MetricFamily {
            name: "effect_allowed",
            help: "1 if the effect may be on",
            values: MetricValues::Gauges(effects.collect()),
        },
    ]
}

fn machine(status: &Status) -> Vec<MetricFamily> {
    let granted = &status.realtime;
    let memory_locked = if granted.memory_locked { "yes" } else { "no" };
    let info = vec![
        ("policy", granted.policy.clone()),
        ("priority", granted.priority.to_string()),
        ("memlock", memory_locked.to_owned()),
    ];
    let realtime = matches!(granted.policy.as_str(), "fifo" | "rr") && granted.memory_locked;
    vec![
        MetricFamily {
            name: "rt_scheduling",
            help: "What the system granted the tick thread",
            values: MetricValues::Info(info),
        },
        MetricFamily::gauge(
            "realtime",
            "1 if the tick thread is real-time and memory is locked",
            flag(realtime),
        ),
    ]
}

/// How many warnings there are of each kind: one and the same may be about many controllers.
fn warnings(status: &Status) -> MetricFamily {
    let mut counts: BTreeMap<(&str, &str), u32> = BTreeMap::new();
    for warning in &status.warnings {
        *counts.entry((&warning.id, warning.severity.word())).or_default() += 1;
    }
    let labels = |id: &str, severity: &str| vec![("id", id.to_owned()), ("severity", severity.to_owned())];
    let counts = counts.iter().map(|((id, severity), count)| (labels(id, severity), f64::from(*count)));
    MetricFamily {
        name: "warnings",
        help: "Active warnings, by kind",
        values: MetricValues::Gauges(counts.collect()),
    }
}

fn label(name: &'static str, value: impl Into<String>) -> Labels {
    vec![(name, value.into())]
}
