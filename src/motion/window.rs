//! The axes of one controller's frame: which axis of the cue each slot carries, and on what seat.

use std::time::Duration;

use super::{AxisGeometry, AxisUnit, MAX_AXES, Pose, Pulses, SeatType};

/// What an axis may do, in strokes per second, second squared and second cubed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Greatest speed.
    pub(crate) velocity: f64,
    /// Greatest acceleration.
    pub acceleration: f64,
    /// Greatest jerk.
    pub jerk: f64,
}

impl Limits {
    /// The limits of an axis.
    #[must_use]
    pub fn of(axis: &AxisGeometry) -> Self {
        let stroke = axis.stroke();
        Self {
            velocity: axis.max_velocity / stroke,
            acceleration: axis.max_acceleration / stroke,
            jerk: axis.max_jerk / stroke,
        }
    }
}

/// One position of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slot {
    /// The axis of the cue it carries, counted from 0; `None` if the cue has nothing for it: it is led to park then.
    pub(crate) axis: Option<usize>,
    /// True if the lane's own seat has such an axis: what is sent in the slot moves it.
    pub(crate) is_own: bool,
    /// Cue unit to fraction of this slot's stroke.
    pub(crate) to_stroke: f64,
    /// Where the cue's 0 is, fraction of the stroke.
    pub(crate) cue_zero: f64,
    /// Where it rests, fraction of the stroke.
    pub(crate) park: f64,
    /// What levels scale about, fraction of the stroke.
    pub(crate) neutral: f64,
    /// How much of the cue's motion about that it makes, 0 to 1.
    pub(crate) level: f64,
    /// Where the motor is at the lower end of the stroke, pulses.
    pub(crate) low_pulses: f64,
    /// Pulses over the whole stroke.
    pub(crate) stroke_pulses: f64,
    /// Length of the stroke, in `unit`.
    pub(crate) stroke: f64,
    /// What the axis is measured in.
    pub(crate) unit: AxisUnit,
    /// What the axis may do.
    pub(crate) limits: Limits,
    /// The greatest velocity and acceleration of motion and vibration together, strokes per second and second squared.
    pub(crate) most_shaken: [f64; 2],
    /// Between which fractions of the stroke it may be sent, the lower first: the whole stroke, unless it is held.
    reach: (f64, f64),
}

impl Slot {
    /// A slot of a seat that carries `axis` of the cue, `seat_axis` being the seat's own count from 0, at full level.
    #[must_use]
    pub fn new(seat: &SeatType, seat_axis: usize, axis: Option<usize>, to_stroke: f64) -> Self {
        let geometry = &seat.each[seat_axis];
        Self {
            axis,
            is_own: true,
            to_stroke,
            cue_zero: 0.0,
            park: geometry.park,
            neutral: geometry.neutral,
            level: 1.0,
            low_pulses: geometry.pulse_range().low,
            stroke_pulses: geometry.stroke_pulses(),
            stroke: geometry.stroke(),
            unit: geometry.unit,
            limits: Limits::of(geometry),
            most_shaken: geometry.most_shaken().map(|most| most / geometry.stroke()),
            reach: (0.0, 1.0),
        }
    }

    /// The same slot where the cue's 0 is at `fraction` of the stroke.
    #[must_use]
    pub(crate) const fn zero_at(self, fraction: f64) -> Self {
        Self { cue_zero: fraction, ..self }
    }

    /// The same slot of a lane whose seat has no such axis: padding of the frame, or another controller's.
    #[must_use]
    pub(crate) const fn of_others(self) -> Self {
        Self { is_own: false, ..self }
    }

    /// The same slot with motion at `level`, 0 to 1.
    #[must_use]
    pub(crate) const fn at_level(self, level: f64) -> Self {
        Self { level, ..self }
    }

    /// What the cue's unit is at its level, fraction of the stroke, and what is added to that: where the cue's values put
    /// the axis, were it not held inside the stroke.
    #[must_use]
    pub(crate) fn scale(&self) -> (f64, f64) {
        (self.to_stroke * self.level, self.neutral * (1.0 - self.level) + self.cue_zero * self.level)
    }

    /// Where the cue's `value` puts the axis: fraction of the stroke, held inside it.
    #[must_use]
    pub(crate) fn place(&self, value: f64) -> f64 {
        let full = value * self.to_stroke + self.cue_zero;
        // At full level the cue's own value, to the last bit.
        let placed = if self.level == 1.0 { full } else { self.neutral + (full - self.neutral) * self.level };
        placed.clamp(0.0, 1.0)
    }

    /// Where the motor is sent for `fraction` of the stroke, held inside it, or where the slot is held: nearest pulse,
    /// ties away from zero.
    #[inline]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a stroke fits i32, checked with the seat type")]
    pub(crate) fn pulses(&self, fraction: f64) -> Pulses {
        let exact = self.low_pulses + fraction.clamp(self.reach.0, self.reach.1) * self.stroke_pulses;
        // What `round` says, without a call into the mathematical library for each slot of each frame.
        let whole = exact as i32;
        let left = exact - f64::from(whole);
        Pulses(whole.saturating_add(i32::from(left >= 0.5) - i32::from(left <= -0.5)))
    }
}

/// The longest time between a pose and its execution: what is stopped goes on for so long.
pub(crate) const MAX_LEAD: Duration = Duration::from_millis(320);

/// The slots of one frame, in frame order: 3, 6, 10 or 12 of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    slots: Vec<Slot>,
    lead: Duration,
    acked_after: Duration,
}

impl Window {
    /// A window of these slots.
    ///
    /// # Panics
    /// If there are more than [`MAX_AXES`].
    #[must_use]
    pub fn new(slots: Vec<Slot>) -> Self {
        assert!(slots.len() <= MAX_AXES, "a frame has at most {MAX_AXES} slots");
        Self { slots, lead: Duration::ZERO, acked_after: Duration::ZERO }
    }

    /// The same window of a controller that executes poses so long after they are made, [`MAX_LEAD`] at the most.
    #[must_use]
    pub fn led_ahead(self, lead: Duration) -> Self {
        let lead = lead.min(MAX_LEAD);
        Self { lead, acked_after: lead, ..self }
    }

    /// The same window of a controller that is asked only now and then whether it has executed what it got: acks come so much later yet.
    #[must_use]
    pub(crate) fn acked_later(self, by: Duration) -> Self {
        Self { acked_after: self.acked_after + by, ..self }
    }

    /// How long before its controller executes them its poses are made: what it gets now is what the cue says so much later, and a
    /// stop takes so much longer. 0 where frames are executed as they come.
    #[must_use]
    pub(crate) const fn lead(&self) -> Duration {
        self.lead
    }

    /// How much later than those of a controller that executes frames as they come its acks may come.
    #[must_use]
    pub(crate) const fn acked_after(&self) -> Duration {
        self.acked_after
    }

    /// The same window with motion at `level`, 0 to 1.
    #[must_use]
    pub(crate) fn at_level(&self, level: f64) -> Self {
        Self { slots: self.slots.iter().map(|slot| slot.at_level(level)).collect(), ..*self }
    }

    /// The level of its slots; 1 where it has none.
    #[must_use]
    pub(crate) fn level(&self) -> f64 {
        self.slots.first().map_or(1.0, |slot| slot.level)
    }

    /// Sets the level of every slot. Never allocates.
    pub(crate) fn set_level(&mut self, level: f64) {
        self.slots.iter_mut().for_each(|slot| slot.level = level);
    }

    /// The slots, in frame order.
    #[must_use]
    pub(crate) fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The slots that the lane's seat has, a bit each.
    #[must_use]
    pub(crate) fn own(&self) -> u16 {
        self.slots.iter().rev().fold(0, |own, slot| own << 1 | u16::from(slot.is_own))
    }

    /// The slots that are led somewhere, with their place in the frame: those that follow the cue, and those of the seat that have
    /// to be at park while others follow it. What is left rests at park throughout, and moves nothing.
    pub(crate) fn moving(&self) -> impl Iterator<Item = (usize, &Slot)> {
        self.slots.iter().enumerate().filter(|(_, slot)| slot.axis.is_some() || slot.is_own)
    }

    /// A pose as it leaves: each slot inside its stroke, or where it is held.
    #[must_use]
    pub(crate) fn reached(&self, pose: &Pose) -> Pose {
        let mut reached = *pose;
        for (place, slot) in reached.iter_mut().zip(&self.slots) {
            *place = place.clamp(slot.reach.0, slot.reach.1);
        }
        reached
    }

    /// Holds every slot at its park pose: whatever it is asked for from now on, it is sent there and nowhere else.
    pub(crate) fn hold(&mut self) {
        for slot in &mut self.slots {
            let park = slot.park.clamp(0.0, 1.0);
            slot.reach = (park, park);
        }
    }

    /// The cue's pose as fractions of each slot's stroke, held inside it; slots without an axis rest at park.
    #[must_use]
    pub(crate) fn place(&self, cue: &Pose) -> Pose {
        let mut placed = [0.0; MAX_AXES];
        for (place, slot) in placed.iter_mut().zip(&self.slots) {
            *place = match slot.axis {
                Some(axis) => slot.place(cue[axis]),
                None => slot.park,
            };
        }
        placed
    }

    /// The park pose, as fractions of each slot's stroke.
    #[must_use]
    pub(crate) fn park(&self) -> Pose {
        let mut placed = [0.0; MAX_AXES];
        for (place, slot) in placed.iter_mut().zip(&self.slots) {
            *place = slot.park;
        }
        placed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_scales_about_the_neutral_pose() {
        let seat = SeatType::bench3(1).with_each(|axis| axis.neutral = 0.4);
        let slot = Slot::new(&seat, 0, Some(0), 1.0).at_level(0.5);
        assert!((slot.place(0.4) - 0.4).abs() < 1e-12);
        assert!((slot.place(1.0) - 0.7).abs() < 1e-12);
        assert!((slot.place(0.0) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_window_that_is_held_sends_its_park_pose_whatever_it_is_asked_for() {
        let seat = SeatType::bench3(1).with_each(|axis| axis.park = 0.25);
        let mut window = Window::new(vec![Slot::new(&seat, 0, Some(0), 1.0)]);
        assert_eq!(window.slots()[0].pulses(0.5), Pulses(150_000));
        window.hold();
        for asked in [f64::NEG_INFINITY, 0.0, 0.5, 1.0, 7.0] {
            assert_eq!(window.slots()[0].pulses(asked), Pulses(75_000), "{asked}");
        }
    }

    #[test]
    fn a_slot_without_an_axis_rests_at_park_and_the_others_stay_inside_the_stroke() {
        let seat = SeatType::bench3(3).with_each(|axis| axis.park = 0.25);
        let window = Window::new(vec![
            Slot::new(&seat, 0, Some(1), 1.0),
            Slot::new(&seat, 1, Some(0), 2.0),
            Slot::new(&seat, 2, None, 1.0),
        ]);
        let mut cue = [0.0; MAX_AXES];
        cue[..2].copy_from_slice(&[0.75, 0.5]);
        assert_eq!(window.place(&cue)[..4], [0.5, 1.0, 0.25, 0.0]);
        assert_eq!(window.park()[..3], [0.25; 3]);
    }
}
