//! One axis between two rows: a cubic over 0 to 1, whatever the interpolation.

/// `c[0] + c[1] u + c[2] u² + c[3] u³`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cubic(pub(super) [f64; 4]);

impl Cubic {
    /// The value at `u`.
    pub(super) fn at(&self, u: f64) -> f64 {
        let [c0, c1, c2, c3] = self.0;
        ((c3 * u + c2) * u + c1) * u + c0
    }

    /// Where within 0 to 1, ends not included, the curve stands still.
    pub(super) fn still(&self) -> impl Iterator<Item = f64> {
        let [_, c1, c2, c3] = self.0;
        let (a, half_b, c) = (3.0 * c3, c2, c1);
        let root = (half_b * half_b - a * c).sqrt(); // not a number where it never stands still
        let q = -(half_b + root.copysign(half_b)); // no cancellation
        [q / a, c / q].into_iter().filter(|u| *u > 0.0 && *u < 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_stands_still_at_its_extremes() {
        let still = |c| Cubic(c).still().collect::<Vec<_>>();
        // (u - 0.25)(u - 0.75) integrated
        let mut both = still([1.0, 0.1875, -0.5, 1.0 / 3.0]);
        both.sort_by(f64::total_cmp);
        assert!((both[0] - 0.25).abs() < 1e-12 && (both[1] - 0.75).abs() < 1e-12, "{both:?}");
        assert_eq!(still([0.0, 1.0, -1.0, 0.0]), [0.5]);
        assert_eq!(still([0.0, 0.0, 1.0, 0.0]), [] as [f64; 0]);
        assert_eq!(still([3.0, 1.0, 0.0, 0.0]), [] as [f64; 0]);
        assert_eq!(still([3.0, 0.0, 0.0, 0.0]), [] as [f64; 0]);
        assert_eq!(still([0.0, 1.0, 0.0, 1.0]), [] as [f64; 0]);
    }
}
