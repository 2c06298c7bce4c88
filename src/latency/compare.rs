//! Two measurements side by side.

use serde::Serialize;

use super::Percentiles;
use crate::rt::Times;
use crate::tracker::Histogram;

/// Fewer times than these have no 99th percentile to speak of.
pub(crate) const MIN_TIMES: u64 = 1_000;
/// Percentiles that differ by less than this factor are alike: runs of the same program on an idle machine do as much.
const ALIKE: f64 = 1.25;

/// One figure of both measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TimesFigure {
    /// `p50`, `p90`, `p99`, `p99.9` or `max`.
    pub(crate) figure: &'static str,
    /// Of the first, µs.
    pub(crate) a_us: Option<f64>,
    /// Of the second, µs.
    pub(crate) b_us: Option<f64>,
    /// The second over the first; null if that says nothing.
    pub(crate) ratio: Option<f64>,
}

/// One kind of times in both measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TimesRow {
    /// Times of the first.
    pub(crate) a_count: u64,
    /// Times of the second.
    pub(crate) b_count: u64,
    /// The figures, in rising order.
    pub(crate) figures: Vec<TimesFigure>,
    /// What they come to, in a line.
    pub(crate) verdict: String,
}

/// Two measurements side by side; A is the one that the other is held against.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Comparison {
    /// Lateness of ticks.
    pub(crate) lateness: TimesRow,
    /// Latency of acks.
    pub(crate) ack_latency: TimesRow,
}

impl Comparison {
    /// Compares `b` with `a`.
    #[must_use]
    pub(crate) fn of(a: &Times, b: &Times) -> Self {
        Self {
            lateness: row("lateness", &a.lateness, &b.lateness),
            ack_latency: row("ack latency", &a.acks, &b.acks),
        }
    }
}

fn row(name: &str, a: &Histogram, b: &Histogram) -> TimesRow {
    let [a, b] = [a, b].map(Percentiles::of);
    let figure = |((figure, a_us), (_, b_us)): ((&'static str, _), (_, _))| TimesFigure {
        figure,
        a_us,
        b_us,
        ratio: ratio(a_us, b_us),
    };
    let figures = a.named().into_iter().zip(b.named()).map(figure).collect();
    TimesRow { a_count: a.count, b_count: b.count, figures, verdict: format!("{name}: {}", verdict(&a, &b)) }
}

fn ratio(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).filter(|(a, _)| *a > 0.0).map(|(a, b)| b / a)
}

fn verdict(a: &Percentiles, b: &Percentiles) -> String {
    let few = a.count.min(b.count);
    if few < MIN_TIMES {
        return format!("too few times to tell, {few} in the smaller; measure longer");
    }
    match ratio(a.p99, b.p99) {
        None => "A has no times above zero".to_owned(),
        Some(times) if times > ALIKE => format!("B is worse, its p99 is {times:.2} x that of A"),
        Some(times) if times < 1.0 / ALIKE => format!("B is better, its p99 is {times:.2} x that of A"),
        Some(times) => format!("alike, the p99 of B is {times:.2} x that of A"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(late_ns: u64, count: u64) -> Times {
        let mut times = Times::default();
        times.lateness.record_n(late_ns, count).unwrap();
        times
    }

    #[test]
    fn each_figure_has_its_ratio_and_the_99th_percentile_decides() {
        let of = |b_ns| Comparison::of(&times(10_000, 2_000), &times(b_ns, 2_000)).lateness;
        let worse = of(20_000);
        assert!(worse.figures.iter().all(|one| one.ratio.is_some_and(|ratio| (ratio - 2.0).abs() < 0.02)));
        assert_eq!(
            worse.figures.iter().map(|one| one.figure).collect::<Vec<_>>().join(" "),
            "p50 p90 p99 p99.9 max"
        );
        assert_eq!(worse.verdict, "lateness: B is worse, its p99 is 2.00 x that of A");
        assert!(of(5_000).verdict.contains("B is better"));
        assert!(of(11_000).verdict.contains("alike"), "{}", of(11_000).verdict);
    }

    #[test]
    fn of_few_times_or_none_nothing_is_said() {
        let row = Comparison::of(&times(10_000, 2_000), &times(90_000, 900)).lateness;
        assert!(row.verdict.contains("too few times to tell, 900"), "{}", row.verdict);
        let none = Comparison::of(&times(10_000, 2_000), &times(10_000, 2_000)).ack_latency;
        assert!(none.verdict.contains("too few times to tell, 0"), "{}", none.verdict);
        assert!(none.figures.iter().all(|one| one.ratio.is_none() && one.a_us.is_none()));
    }
}
