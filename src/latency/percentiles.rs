//! The figures by which a histogram of times is told.

use serde::Serialize;

use crate::control::model;
use crate::tracker::Histogram;

/// Percentiles of times, µs; all null where there were none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Percentiles {
    /// How many times there were.
    pub count: u64,
    /// Median.
    pub(crate) p50: Option<f64>,
    /// 90th percentile.
    pub(crate) p90: Option<f64>,
    /// 99th percentile.
    pub(crate) p99: Option<f64>,
    /// 99.9th percentile.
    pub(crate) p999: Option<f64>,
    /// The longest.
    pub(crate) max: Option<f64>,
}

impl Percentiles {
    /// Those of a histogram of nanoseconds.
    #[must_use]
    pub fn of(times: &Histogram) -> Self {
        let model::Percentiles { p50_us, p99_us, p999_us, max_us } = model::Percentiles::of(times);
        let p90 = model::quantile_us(times, 0.9);
        Self { count: times.len(), p50: p50_us, p90, p99: p99_us, p999: p999_us, max: max_us }
    }

    /// The figures with their names, in rising order.
    #[must_use]
    pub(crate) const fn named(&self) -> [(&'static str, Option<f64>); 5] {
        let Self { p50, p90, p99, p999, max, .. } = *self;
        [("p50", p50), ("p90", p90), ("p99", p99), ("p99.9", p999), ("max", max)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::histogram;

    #[test]
    fn percentiles_are_in_microseconds_and_none_of_nothing() {
        assert!(Percentiles::of(&histogram()).named().iter().all(|(_, us)| us.is_none()));
        let mut times = histogram();
        times.record_n(10_000, 95).unwrap();
        times.record_n(2_000_000, 5).unwrap();
        let Percentiles { count, p50, p90, p99, max, .. } = Percentiles::of(&times);
        assert_eq!((count, p50, p90), (100, Some(10.0), Some(10.0)));
        assert_eq!(p99, max);
        assert!(max.is_some_and(|us| (us - 2_000.0).abs() < 2.0), "{max:?}");
        let mut at_once = histogram();
        at_once.record(0).unwrap();
        assert!(Percentiles::of(&at_once).named().iter().all(|(_, us)| *us == Some(0.0)), "none is beyond");
    }
}
