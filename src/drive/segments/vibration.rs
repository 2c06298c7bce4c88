//! Vibration for drives that have none of their own: a swing that is added to the poses, tick by tick.

use std::f64::consts::TAU;
use std::time::Duration;

/// What is left of an amplitude that counts as nothing, in strokes.
const NOTHING: f64 = 1e-6;

/// The swing of one axis. Frequencies change without a jump in place; an amplitude is taken up, or let go of, within about
/// a swing, so that nothing is switched at the top of one.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shaker {
    /// Of a turn, 0 to 1.
    phase: f64,
    hz: f64,
    amplitude: f64,
}

impl Shaker {
    /// How many slices of a link's grid a swing has to have.
    pub(crate) const SLICES: f64 = 8.0;

    /// A `tick` later, told to swing by `amplitude` to either side `hz` times a second: how far it is from the middle.
    pub(crate) fn after(&mut self, tick: Duration, hz: f64, amplitude: f64) -> f64 {
        let wanted = if hz > 0.0 && amplitude.is_finite() { amplitude.max(0.0) } else { 0.0 };
        if wanted > 0.0 {
            self.hz = hz;
        }
        let turned = self.hz * tick.as_secs_f64();
        self.amplitude += (wanted - self.amplitude) * turned.min(1.0);
        if wanted == 0.0 && self.amplitude < NOTHING {
            *self = Self::default();
        }
        self.phase = (self.phase + turned).fract();
        self.amplitude * (TAU * self.phase).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_millis(2);

    #[test]
    fn a_swing_grows_to_its_amplitude_and_ends_in_the_middle_without_a_jump() {
        let mut swing = Shaker::default();
        let told = |tick: u32| if (100..1_025).contains(&tick) { (5.0, 0.1) } else { (0.0, 0.0) };
        let way: Vec<f64> = (0..3_000).map(|tick| swing.after(TICK, told(tick).0, told(tick).1)).collect();
        let most = |of: &[f64]| of.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
        let jump = way.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        assert!(
            (most(&way[800..1_000]) - 0.1).abs() < 0.001 && jump < 0.1 * TAU * 5.0 * 0.002 * 1.1,
            "{jump}"
        );
        assert!(most(&way[..100]) == 0.0 && most(&way[2_990..]) == 0.0);
    }

    #[test]
    fn nonsense_swings_nowhere() {
        for (hz, amplitude) in [(f64::NAN, 0.1), (-1.0, 0.1), (5.0, f64::NAN), (f64::INFINITY, 0.0)] {
            let mut swing = Shaker::default();
            assert!((0..50).all(|_| swing.after(TICK, hz, amplitude) == 0.0), "{hz} {amplitude}");
        }
    }
}
