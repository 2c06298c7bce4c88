//! How much faster than the film the cue may run, tenth of a second by tenth: what its motion leaves of the limits.

use super::slew::{CHANGE_PER_S, MAX_SPEED_UP};
use crate::engine::Rate;
use crate::motion::{Limits, Measure, Reading, Readings, Slot, Spacing, Window};
use crate::plan::Curve;
use crate::time::ShowTime;

/// Show time of one entry, nanoseconds.
const SPAN: i64 = 100_000_000;
/// Entries looked at from the present on: slowing down from the greatest speed takes a tenth of a second, and the
/// measure reaches 81 ms to either side.
const AHEAD: usize = 4;
/// One unit of an entry.
const UNIT: f64 = MAX_SPEED_UP / 255.0;
/// Over which time the measure sees a change of pace begin or end, seconds: the shorter of its distances, 16 ms and more.
const MEASURED_OVER_S: f64 = 0.016;
/// Two hours are measured in a second at this rate, and what the measure sees hardly depends on it.
const MEASURED_AT: f64 = 100.0;

/// The greatest speed-up by show time; built once, then only read.
#[derive(Debug, Clone)]
pub struct Headroom {
    /// For each tenth of a second, what it leaves, in 255ths of [`MAX_SPEED_UP`].
    entries: Box<[u8]>,
}

impl Headroom {
    /// Measures the cue on every different slot of the windows.
    #[must_use]
    pub fn measure(windows: &[Window], curve: &Curve<'_>, rate: Rate) -> Self {
        let spans = usize::try_from(curve.end.as_nanos().max(0) / SPAN).unwrap_or(0) + 1;
        let mut loads = vec![Load::default(); spans];
        let rate = Rate::from_hz(rate.hz().min(MEASURED_AT));
        let slots = different_slots(windows);
        let mut measures = vec![Measure::new(Spacing::at_rate(rate.hz())); slots.len()];
        for index in 0.. {
            let at = ShowTime::ZERO + rate.offset(index);
            if at > curve.end {
                break;
            }
            let pose = (curve.pose)(at);
            for ((axis, slot), measure) in slots.iter().zip(&mut measures) {
                note(&mut loads, &measure.push(at, slot.place(pose[*axis])), slot.limits);
            }
        }
        Self { entries: loads.iter().map(Load::leaves).collect() }
    }

    /// The greatest speed-up from `at` on. Never allocates.
    #[must_use]
    pub fn at(&self, at: ShowTime) -> f64 {
        let first =
            usize::try_from(at.as_nanos().max(0) / SPAN).unwrap_or(usize::MAX).min(self.entries.len());
        let last = (first + AHEAD).min(self.entries.len());
        let least = self.entries[first.saturating_sub(1)..last].iter().min();
        least.map_or(0.0, |least| f64::from(*least) * UNIT)
    }
}

fn different_slots(windows: &[Window]) -> Vec<(usize, Slot)> {
    let mut slots: Vec<(usize, Slot)> = Vec::new();
    for (_, slot) in windows.iter().flat_map(Window::moving) {
        let axis = slot.axis.expect("a moving slot has an axis");
        if !slots.contains(&(axis, *slot)) {
            slots.push((axis, *slot));
        }
    }
    slots
}

/// The greatest share of each limit in a tenth of a second.
#[derive(Debug, Clone, Copy, Default)]
struct Load {
    velocity: f64,
    acceleration: f64,
    jerk: f64,
    /// What changing the pace adds to acceleration and to jerk at the greatest speed.
    acceleration_added: f64,
    jerk_added: f64,
}

impl Load {
    /// How much faster time may run: speed grows with the pace, acceleration with its square, jerk with its cube.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255 after the clamp")]
    fn leaves(&self) -> u8 {
        let paces = [
            1.0 / self.velocity,
            ((1.0 - self.acceleration_added).max(0.0) / self.acceleration).sqrt(),
            ((1.0 - self.jerk_added).max(0.0) / self.jerk).cbrt(),
        ];
        let pace = paces.into_iter().filter(|pace| pace.is_finite()).fold(1.0 + MAX_SPEED_UP, f64::min);
        ((pace - 1.0) / UNIT).clamp(0.0, 255.0) as u8
    }
}

/// Keeps the loads where each reading was taken.
fn note(loads: &mut [Load], readings: &Readings, limits: Limits) {
    let last = loads.len() - 1;
    let index = |reading: &Reading| usize::try_from(reading.at.as_nanos() / SPAN).unwrap_or(0).min(last);
    let Readings { velocity, acceleration, jerk, .. } = readings;
    let speed = velocity.value.abs();
    let load = &mut loads[index(velocity)];
    load.velocity = load.velocity.max(speed / limits.velocity);
    load.acceleration_added = load.acceleration_added.max(speed * CHANGE_PER_S / limits.acceleration);
    load.jerk_added = load.jerk_added.max(speed * CHANGE_PER_S / MEASURED_OVER_S / limits.jerk);
    let load = &mut loads[index(acceleration)];
    load.acceleration = load.acceleration.max(acceleration.value.abs() / limits.acceleration);
    let load = &mut loads[index(jerk)];
    load.jerk = load.jerk.max(jerk.value.abs() / limits.jerk);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{MAX_AXES, Pose, SeatType};

    /// Ten seconds of rest, then ten at a steady share of the seat's greatest speed, back and forth.
    fn headroom(share: f64) -> Headroom {
        let seat = SeatType { max_acceleration_mm_s2: 1e9, max_jerk_mm_s3: 1e12, ..SeatType::bench3(1) };
        let window = Window::new(vec![Slot::new(&seat, 0, Some(0), 1.0)]);
        let pose = move |at: ShowTime| -> Pose {
            let mut pose = [0.0; MAX_AXES];
            let swing = ((at.as_secs_f64() - 10.0).max(0.0) * 1.6 * share) % 2.0;
            pose[0] = if swing < 1.0 { swing } else { 2.0 - swing };
            pose
        };
        let curve = Curve { pose: &pose, end: ShowTime::from_millis(20_000) };
        Headroom::measure(&[window], &curve, Rate::from_hz(100.0))
    }

    #[test]
    fn a_cue_at_the_limit_leaves_nothing_and_one_at_rest_all() {
        let headroom = headroom(1.0);
        assert_eq!(headroom.at(ShowTime::from_millis(5_000)), MAX_SPEED_UP);
        assert_eq!(headroom.at(ShowTime::from_millis(15_000)), 0.0);
    }

    #[test]
    fn the_limit_is_seen_coming() {
        assert_eq!(headroom(1.0).at(ShowTime::from_millis(9_750)), 0.0);
    }

    #[test]
    fn a_cue_one_per_cent_below_the_limit_leaves_one_per_cent() {
        let left = headroom(1.0 / 1.01).at(ShowTime::from_millis(15_000));
        assert!((left - 0.01).abs() < 2e-4, "{left}");
    }
}
