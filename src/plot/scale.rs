//! Where the ticks of an axis are.

/// Steps of a time axis, s: what clocks are divided by.
const TIME_STEPS: [f64; 23] = [
    0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0,
    300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0,
];

/// The least step of a time axis that is no less, s.
#[must_use]
pub(super) fn time_step(least: f64) -> f64 {
    TIME_STEPS.into_iter().find(|step| *step >= least).unwrap_or(14_400.0)
}

/// At most so many ticks of any other axis: 1, 2 or 5 times a power of ten apart.
#[must_use]
pub(super) fn of_values(low: f64, high: f64, most: f64) -> Vec<f64> {
    let least = (high - low) / most;
    let power = 10.0_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|step| step * power >= least).unwrap_or(10.0) * power;
    multiples(low, high, step)
}

/// The multiples of a step from one place to another, both ends included where they are such; a hundred at the most.
#[must_use]
pub(super) fn multiples(from: f64, until: f64, step: f64) -> Vec<f64> {
    let first = (from / step - 1e-9).ceil();
    let at = (0..100_u8).map(|n| (first + f64::from(n)) * step + 0.0);
    at.take_while(|at| *at <= until + 1e-9 * step).collect()
}
