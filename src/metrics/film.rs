//! Figures of the film that a hall follows; of a hall that follows none there are none.

use super::{Labels, MetricFamily, MetricValues, flag};
use crate::control::{FilmSourceStatus, FilmStatus};

pub(super) fn families(film: &FilmStatus) -> Vec<MetricFamily> {
    let mut all = whole(film);
    all.extend(sources(film));
    all.extend(counts(&film.sources));
    all
}

fn whole(film: &FilmStatus) -> Vec<MetricFamily> {
    let apart = film.disagrees.as_ref().map(|two| two.ahead_s);
    vec![
        MetricFamily {
            name: "sync_state",
            help: "1, with the state of the film as a label",
            values: MetricValues::Gauges(vec![(vec![("state", film.state.clone())], 1.0)]),
        },
        MetricFamily::gauge("sync_follows", "1 if the loaded show follows the film", flag(film.leads)),
        MetricFamily::gauge("sync_position_seconds", "Position of the film in the cue", film.position_s),
        MetricFamily::gauge(
            "sync_error_seconds",
            "How far ahead of the film, less the trim, the seats are while they follow it",
            film.error_ms.map(|ms| ms / 1e3),
        ),
        MetricFamily::gauge(
            "sync_disagreement_seconds",
            "How far a source that ranks higher, or was passed over by hand, is ahead of the one that leads",
            apart,
        ),
        MetricFamily::counter("sync_switches", "How often another source took over", film.switches),
        MetricFamily::counter("sync_joins", "How often seats have joined the film", film.joins),
    ]
}

fn sources(film: &FilmStatus) -> Vec<MetricFamily> {
    let all = &film.sources;
    let is = |name: &Option<String>, one: &FilmSourceStatus| Some(flag(name.as_ref() == Some(&one.source)));
    let states = all.iter().map(|one| {
        let labels = vec![("source", one.source.clone()), ("state", one.state.clone())];
        (labels, 1.0)
    });
    vec![
        MetricFamily {
            name: "sync_source_state",
            help: "1, with the state of the source as a label",
            values: MetricValues::Gauges(states.collect()),
        },
        gauges(all, "sync_leads", "1 for the source that leads", |one| is(&film.source, one)),
        gauges(all, "sync_chosen", "1 for the source that a person selected", |one| is(&film.chosen, one)),
        gauges(all, "sync_rate_ppm", "Rate of the film against the clock, ppm", |one| one.rate_ppm),
        gauges(all, "sync_sigma_seconds", "Standard deviation of its position", |one| {
            one.sigma_ms.map(|ms| ms / 1e3)
        }),
        gauges(all, "sync_level_dbfs", "Level of the line, dBFS", |one| one.level_dbfs),
    ]
}

fn counts(all: &[FilmSourceStatus]) -> Vec<MetricFamily> {
    vec![
        counters(all, "sync_dropouts", "How often nothing was received from the source", |one| one.dropouts),
        counters(all, "sync_rejected", "Samples too far off to be used", |one| one.rejected),
        counters(all, "sync_jumps", "How often the film jumped according to the source", |one| one.jumps),
        counters(all, "sync_foreign", "Messages from other senders than the source", |one| one.foreign),
        counters(all, "sync_garbage", "Messages of the source that do not concern a film", |one| one.garbage),
        MetricFamily {
            name: "sync_freewheel_seconds",
            help: "How long the position of the film was estimated while nothing was received from the source",
            values: MetricValues::Seconds(all.iter().map(|one| (of(one), one.freewheel_s)).collect()),
        },
    ]
}

fn gauges(
    all: &[FilmSourceStatus],
    name: &'static str,
    help: &'static str,
    figure: impl Fn(&FilmSourceStatus) -> Option<f64>,
) -> MetricFamily {
    let values = all.iter().filter_map(|one| Some((of(one), figure(one)?)));
    MetricFamily { name, help, values: MetricValues::Gauges(values.collect()) }
}

fn counters(
    all: &[FilmSourceStatus],
    name: &'static str,
    help: &'static str,
    figure: impl Fn(&FilmSourceStatus) -> u64,
) -> MetricFamily {
    let values = all.iter().map(|one| (of(one), figure(one)));
    MetricFamily { name, help, values: MetricValues::Counters(values.collect()) }
}

fn of(one: &FilmSourceStatus) -> Labels {
    vec![("source", one.source.clone())]
}
