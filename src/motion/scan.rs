//! The greatest velocity, acceleration and jerk of a whole motion, as the frames of a rate would carry it. Control
//! thread.

use super::measure::{Measure, Reading, Spacing};
use super::{MAX_AXES, Pose};
use crate::time::ShowTime;

/// A greatest size and the show time in the middle of the poses that gave it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peak {
    /// Size, 0 or more, in the unit of the positions per second, per second squared or per second cubed.
    pub value: f64,
    /// Show time in the middle of the poses that gave it.
    pub at: ShowTime,
}

/// The peaks of one axis; all are 0 where it never moves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peaks {
    /// Of distance over Time, frame by frame.
    pub velocity: Peak,
    /// By the larger of the two distances of [`Measure`].
    pub acceleration: Peak,
    /// By the larger of the two distances of [`Measure`].
    pub jerk: Peak,
}

/// Measures the poses that frames of `rate_hz` (1 to 1,000) carry from show time 0 to `until`: pose k is that of
/// the running sum of whole-millisecond Times, k periods rounded to the millisecond. Each axis past `axes` is left
/// out; the answer has one entry for each axis before.
pub fn scan(
    axes: usize,
    rate_hz: f64,
    until: ShowTime,
    mut pose_at: impl FnMut(ShowTime) -> Pose,
) -> Vec<Peaks> {
    let axes = axes.min(MAX_AXES);
    let mut measures = vec![Measure::new(Spacing::at_rate(rate_hz)); axes];
    let mut peaks = vec![Peaks::default(); axes];
    let times = (0_u32..).map(|k| running_sum(k, rate_hz)).take_while(|&at| at <= until);
    for at in times {
        let pose = pose_at(at);
        for ((measure, peaks), &position) in measures.iter_mut().zip(&mut peaks).zip(&pose) {
            let readings = measure.push(at, position);
            raise(&mut peaks.velocity, readings.velocity);
            raise(&mut peaks.acceleration, readings.acceleration);
            raise(&mut peaks.jerk, readings.jerk);
        }
    }
    peaks
}

fn running_sum(k: u32, rate_hz: f64) -> ShowTime {
    ShowTime::from_secs_f64((f64::from(k) * 1000.0 / rate_hz).round() / 1000.0)
}

fn raise(peak: &mut Peak, reading: Reading) {
    if reading.value.abs() > peak.value {
        *peak = Peak { value: reading.value.abs(), at: reading.at };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first_axis(position: impl Fn(f64) -> f64) -> impl FnMut(ShowTime) -> Pose {
        move |at| {
            let mut pose = [0.0; MAX_AXES];
            pose[0] = position(at.as_secs_f64());
            pose
        }
    }

    #[test]
    fn a_sine_is_measured_at_its_size_where_it_is_steepest() {
        let sine = first_axis(|t| 10.0 * (3.0 * t).sin());
        let peaks = scan(2, 100.0, ShowTime::from_millis(3_000), sine);
        let [moving, still] = peaks[..] else { panic!("two axes") };
        assert!((moving.velocity.value / 30.0 - 1.0).abs() < 1e-3, "{moving:?}");
        assert!((moving.acceleration.value / 90.0 - 1.0).abs() < 2e-3, "{moving:?}");
        assert!((moving.jerk.value / 270.0 - 1.0).abs() < 5e-3, "{moving:?}");
        assert!((3.0 * moving.acceleration.at.as_secs_f64()).sin().abs() > 0.99, "{moving:?}");
        assert_eq!(still, Peaks::default());
    }

    #[test]
    fn poses_lie_on_whole_milliseconds_so_a_steady_move_keeps_its_speed_at_any_rate() {
        for rate in [23.976, 59.94, 60.0, 600.0, 1000.0] {
            let mut seen = Vec::new();
            let peaks = scan(1, rate, ShowTime::from_millis(500), |at| {
                seen.push(at);
                first_axis(|t| 250.0 * t)(at)
            });
            assert!((peaks[0].velocity.value - 250.0).abs() < 1e-6, "{rate} Hz: {peaks:?}");
            assert!(peaks[0].acceleration.value < 1e-6, "{rate} Hz: {peaks:?}");
            assert!(seen.iter().all(|at| at.as_nanos() % 1_000_000 == 0), "{rate} Hz");
            assert!(seen.last() <= Some(&ShowTime::from_millis(500)));
        }
    }
}
