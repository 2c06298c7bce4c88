//! What the motors of a SIXpack 2 execute: their loop every 2 ms, after the very targets that a play would send.

use super::course::{WantedCourse, signed};
use super::{Driven, MostExecuted, Roughness, below};
use crate::drive::{LOOP, Lag, Motor, TargetMaker};

/// Runs the course.
pub(super) fn execute(driven: &Driven<'_>, course: &WantedCourse, lag: Lag, jump: f64) -> MostExecuted {
    let (slot, axis) = (&driven.subject.slot, driven.subject.geometry());
    let steps = |place: f64| slot.low_pulses + place * slot.stroke_pulses;
    let mut targets = TargetMaker::at_rest(lag, driven.ends(), steps(course.places[0]));
    let mut made = Vec::new();
    driven.middles(course, steps, |middle| made.push(targets.push(middle)));
    let place = axis.place(course.places[0]);
    let mut most = MostExecuted::at_rest(driven, place, axis.max_velocity, Roughness::Jumps(below(jump)));
    run(driven, course, Motor::at_rest(lag, steps(course.places[0])), &made, &mut most);
    most
}

/// Runs the loop over all of the targets.
fn run(
    driven: &Driven<'_>,
    course: &WantedCourse,
    mut motor: Motor,
    targets: &[i32],
    most: &mut MostExecuted,
) {
    let (slot, axis) = (&driven.subject.slot, driven.subject.geometry());
    let per_step = axis.stroke() / slot.stroke_pulses;
    // Nobody knows how the loop falls on the targets: in the middle it meets each half a loop late. Another place moves all
    // of it in time by a millisecond at the most, and makes nothing rougher.
    let (mut at, period) = (course.from + signed(LOOP) / 2, signed(driven.link.period));
    loop {
        let slice = usize::try_from((at - course.from) / period).unwrap_or(usize::MAX);
        let Some(target) = targets.get(slice) else { break };
        let before = motor.velocity();
        motor.run(*target);
        // Not the measure of poses: what a stepper loses, it loses at one jump.
        if let Roughness::Jumps(jump) = &mut most.roughness {
            driven.larger(jump, (motor.velocity() - before).abs() * per_step, at);
        }
        driven.larger(&mut most.velocity, motor.velocity().abs() * per_step, at);
        at += signed(LOOP);
        let place = axis.low + (motor.position() - slot.low_pulses) * per_step;
        let wanted = course.place(at).filter(|_| (0..=course.end).contains(&at));
        most.be_at(driven, at, place, wanted);
    }
}
