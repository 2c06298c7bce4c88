//! One axis between two rows: a cubic over 0 to 1, whatever the interpolation.

/// `c[0] + c[1] u + c[2] u² + c[3] u³`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cubic(pub(crate) [f64; 4]);

impl Cubic {
    /// The value at `u`.
    pub(crate) fn at(&self, u: f64) -> f64 {
        let [c0, c1, c2, c3] = self.0;
        ((c3 * u + c2) * u + c1) * u + c0
    }

    /// Where within 0 to 1, ends not included, the curve stands still.
    pub(crate) fn still(&self) -> impl Iterator<Item = f64> {
        let [_, c1, c2, c3] = self.0;
        let (a, half_b, c) = (3.0 * c3, c2, c1);
        let root = (half_b * half_b - a * c).sqrt(); // not a number where it never stands still
        let q = -(half_b + root.copysign(half_b)); // no cancellation
        [q / a, c / q].into_iter().filter(|u| *u > 0.0 && *u < 1.0)
    }

    /// The same curve counted from `from` on.
    pub(crate) fn from(self, from: f64) -> Self {
        let [_, c1, c2, c3] = self.0;
        let (third, bend) = (c3, c2 + 3.0 * c3 * from);
        Self([self.at(from), c1 + from * (c2 + bend), bend, third])
    }

    /// The same curve with its argument counted in units of `unit`.
    pub(crate) fn scaled(self, unit: f64) -> Self {
        let [c0, c1, c2, c3] = self.0;
        Self([c0, c1 * unit, c2 * unit * unit, c3 * unit * unit * unit])
    }

    /// True if the curve may be farther than `size` from 0 somewhere within 0 to 1; where not, it surely is not.
    pub(crate) fn may_leave(self, size: f64) -> bool {
        const THIRD: f64 = 1.0 / 3.0;
        let [c0, c1, c2, c3] = self.0;
        let second = c0 + c1 * THIRD;
        let points = [c0, second, second + (c1 + c2) * THIRD, c0 + c1 + c2 + c3];
        points.iter().fold(false, |leaves, point| leaves | (point.abs() > size))
    }

    /// Bounds that the curve cannot leave within 0 to 1: the least and greatest of its Bezier points.
    pub(crate) fn bounds(self) -> (f64, f64) {
        let [c0, c1, c2, c3] = self.0;
        let points = [c0 + c1 / 3.0, c0 + (2.0 * c1 + c2) / 3.0, c0 + c1 + c2 + c3];
        points.into_iter().fold((c0, c0), |(low, high), point| (low.min(point), high.max(point)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_cubic_is_the_same_curve_within_its_bounds() {
        let whole = Cubic([0.3, -1.0, 2.5, -1.2]);
        let part = whole.from(0.4).scaled(0.5);
        let (low, high) = part.bounds();
        for step in 0..=10 {
            let u = f64::from(step) / 10.0;
            assert!((part.at(u) - whole.at(0.4 + 0.5 * u)).abs() < 1e-12);
            assert!((low..=high).contains(&part.at(u)));
            assert!(
                !part.may_leave(low.abs().max(high.abs()) + 1e-12) && part.may_leave(part.at(u).abs() - 1e-9)
            );
        }
    }

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
