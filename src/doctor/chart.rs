//! A histogram of times as a person reads it on a terminal: buckets and bars both grow by factors, so that one late tick of
//! ten thousand shows beside all the others.

use std::fmt::Write as _;

use super::lateness::us;
use crate::tracker::Histogram;

/// The most marks of a bar.
const WIDTH: u32 = 40;

/// Upper ends of the buckets, ns: 1, 2 and 5 of each decade from 1 µs to 10 s.
fn ends() -> impl Iterator<Item = u64> {
    let decades = (3..10).map(|power| 10_u64.pow(power));
    decades.flat_map(|one| [one, 2 * one, 5 * one]).chain([10_000_000_000])
}

/// Some of the times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ChartBucket {
    /// From here, ns.
    pub(crate) from_ns: u64,
    /// To here, ns; not in it. That of the last bucket has no end: `u64::MAX`.
    pub(crate) to_ns: u64,
    /// How many.
    pub(crate) count: u64,
}

impl ChartBucket {
    fn range(&self) -> String {
        let range = match self.to_ns {
            u64::MAX => format!("over {}", us(self.from_ns)),
            to_ns => format!("{} to {}", us(self.from_ns), us(to_ns)),
        };
        range.replace(".0 ", " ")
    }
}

/// Sorts a histogram of nanoseconds into buckets, from the first that holds a time to the last.
#[must_use]
pub(crate) fn buckets(times: &Histogram) -> Vec<ChartBucket> {
    let mut from_ns = 0;
    let mut all: Vec<ChartBucket> = ends()
        .map(|to_ns| {
            let bucket = ChartBucket { from_ns, to_ns, count: 0 };
            from_ns = to_ns;
            bucket
        })
        .collect();
    all.push(ChartBucket { from_ns, to_ns: u64::MAX, count: 0 });
    for recorded in times.iter_recorded() {
        // The middle of what the histogram holds together: its ends may lie in two buckets.
        let ns = times.median_equivalent(recorded.value_iterated_to());
        let place = all.partition_point(|bucket| bucket.to_ns <= ns);
        all[place].count += recorded.count_since_last_iteration();
    }
    let first = all.iter().position(|bucket| bucket.count > 0);
    let last = all.iter().rposition(|bucket| bucket.count > 0);
    first.zip(last).map(|(first, last)| all[first..=last].to_vec()).unwrap_or_default()
}

/// Draws it: a row for each bucket with its bar, its count and the percentiles that lie in it; below them the percentiles.
/// Empty where nothing was recorded.
#[must_use]
pub(crate) fn draw(times: &Histogram) -> String {
    let mut text = String::new();
    let buckets = buckets(times);
    let most = buckets.iter().map(|bucket| bucket.count).max().unwrap_or(0);
    let marks = percentiles(times);
    for bucket in &buckets {
        let within = |(_, ns): &&(&str, u64)| (bucket.from_ns..bucket.to_ns).contains(ns);
        let here: Vec<&str> = marks.iter().filter(within).map(|(name, _)| *name).collect();
        let bar = "#".repeat(bar_len(bucket.count, most));
        let row = format!("  {:>18} |{bar:<40} {:>7}  {}", bucket.range(), bucket.count, here.join(" "));
        append(&mut text, format_args!("{}\n", row.trim_end()));
    }
    if !buckets.is_empty() {
        let figures: Vec<String> = marks.iter().map(|(name, ns)| format!("{name} {}", us(*ns))).collect();
        append(&mut text, format_args!("  {}\n", figures.join(", ")));
    }
    text
}

fn percentiles(times: &Histogram) -> [(&'static str, u64); 4] {
    [
        ("p50", times.value_at_quantile(0.5)),
        ("p99", times.value_at_quantile(0.99)),
        ("p99.9", times.value_at_quantile(0.999)),
        ("max", times.max()),
    ]
}

/// Marks of a bar: as many for each doubling of the count; at least one where there is anything.
fn bar_len(count: u64, most: u64) -> usize {
    #[expect(clippy::cast_precision_loss, reason = "a bar of forty marks needs two digits")]
    let part = ((count + 1) as f64).log2() / ((most + 1) as f64).log2().max(1.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 40")]
    let len = (part * f64::from(WIDTH)).round() as usize;
    if count == 0 { 0 } else { len.max(1) }
}

fn append(text: &mut String, what: std::fmt::Arguments<'_>) {
    text.write_fmt(what).expect("a String takes what is written to it");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::histogram;

    #[test]
    fn every_time_is_in_the_bucket_that_holds_it() {
        let mut times = histogram();
        times.record_n(3_000, 990).unwrap();
        times.record_n(40_000, 9).unwrap();
        times.saturating_record(1_500_000);
        let buckets = buckets(&times);
        assert_eq!(buckets.iter().map(|bucket| bucket.count).sum::<u64>(), 1_000);
        let ends = |bucket: &ChartBucket| (bucket.from_ns, bucket.to_ns, bucket.count);
        assert_eq!(ends(&buckets[0]), (2_000, 5_000, 990));
        assert_eq!(ends(&buckets[3]), (20_000, 50_000, 9));
        assert_eq!(ends(buckets.last().unwrap()), (1_000_000, 2_000_000, 1));
    }

    #[test]
    fn a_drawing_shows_even_one_of_a_thousand_and_names_the_percentiles() {
        let mut times = histogram();
        times.record_n(3_000, 990).unwrap();
        times.record_n(40_000, 9).unwrap();
        times.saturating_record(1_500_000);
        let text = draw(&times);
        let rows: Vec<&str> = text.lines().collect();
        assert!(rows[0].contains("2 µs to 5 µs |####") && rows[0].ends_with("990  p50 p99"), "{text}");
        assert!(rows[8].contains("1 ms to 2 ms |####  ") && rows[8].ends_with("1  max"), "{text}");
        assert!(rows[9].starts_with("  p50 3.0 µs, p99 "), "{text}");
        assert_eq!(draw(&histogram()), "");
    }

    #[test]
    fn no_bar_is_longer_than_its_place_and_none_is_lost() {
        assert_eq!((bar_len(0, 10), bar_len(1, u64::MAX - 1), bar_len(1, 1)), (0, 1, 40));
        assert_eq!(bar_len(3_600_000, 3_600_000), 40);
    }

    #[test]
    fn times_past_the_last_bucket_are_not_lost() {
        let mut times = histogram();
        times.saturating_record(u64::MAX);
        assert_eq!(buckets(&times).iter().map(|bucket| bucket.count).sum::<u64>(), 1);
        assert!(draw(&times).contains("over 10 s |"));
    }
}
