//! Histograms of short times that never resize.

/// A histogram of nanoseconds, see [`histogram()`].
pub type Histogram = hdrhistogram::Histogram<u64>;

/// An empty histogram of times up to 10 s, in nanoseconds, resolved to 64 ns or to three digits, whichever is coarser.
///
/// Its memory is taken here and never grows; longer times are to be recorded as the longest, with `saturating_record`.
#[must_use]
pub fn histogram() -> Histogram {
    Histogram::new_with_bounds(100, 10_000_000_000, 3)
        .expect("the bounds are in order, the digits at most five")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_keep_three_digits_and_too_long_ones_count_as_the_longest() {
        let mut times = histogram();
        times.saturating_record(40_000);
        assert!(times.max().abs_diff(40_000) <= 64, "{}", times.max());
        times.saturating_record(123_456_789);
        assert!(times.max().abs_diff(123_456_789) < 123_456, "{}", times.max());
        times.saturating_record(u64::MAX);
        assert!(!times.is_auto_resize() && times.len() == 3);
        assert!(times.max() >= 10_000_000_000);
    }
}
