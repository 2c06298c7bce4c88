//! Sends sequences through a limiter of one axis, and judges what comes out.

use super::chance::Chance;
use super::judge::Judge;
use super::sound::Sound;
use super::wild::Wild;
use crate::belief::{KnownPose, Reading};
use crate::limiter::{Counts, Limiter, Provenance};
use crate::motion::{Limits, MAX_AXES, Pose, SeatType, Slot, Window};
use crate::time::{MonoTime, Rate};

/// What a sequence made of a limiter.
pub struct Trial {
    /// Greatest share of a limit in what was sent; infinite outside the stroke.
    pub share: f64,
    /// Whether all was sent as it was asked for, bit for bit.
    pub unchanged: bool,
    pub counts: Counts,
}

impl Trial {
    /// A sequence of anything.
    pub fn of_wild(wild: &mut Wild) -> Self {
        let mut limiter = standing(&window(wild.limits), wild.rate, first(wild.start));
        let mut judge = Judge::new(wild.limits, wild.rate.hz(), wild.start);
        let (mut share, mut unchanged, mut ms) = (0.0_f64, true, 0);
        for (index, frame) in (0..).zip(0..wild.frames) {
            let time_ms = wild.rate.time_ms(index);
            ms += time_ms;
            let asked = wild.next(frame, f64::from(ms) * 1e-3, time_ms, &mut judge);
            let mut pose = first(asked);
            limiter.admit(&mut pose, index, Provenance::Anyhow);
            unchanged &= pose[0].to_bits() == asked.to_bits();
            share = share.max(judge.push(pose[0], time_ms).share());
        }
        Self { share, unchanged, counts: *limiter.counts() }
    }

    /// A motion that keeps the limits.
    pub fn of_sound(sound: &Sound) -> Self {
        let mut limiter = standing(&window(sound.limits), sound.rate, first(sound.start));
        let mut sent = sound.frames.clone();
        for (index, (position, _)) in (0..).zip(&mut sent) {
            let mut pose = first(*position);
            limiter.admit(&mut pose, index, Provenance::Anyhow);
            *position = pose[0];
        }
        let unchanged =
            sent.iter().zip(&sound.frames).all(|(sent, asked)| sent.0.to_bits() == asked.0.to_bits());
        let share = Judge::worst(sound.limits, sound.rate.hz(), sound.start, &sent).share();
        Self { share, unchanged, counts: *limiter.counts() }
    }

    /// The same, said to be proved, while which something else is asked for now and then, so that it is left and faded back onto.
    pub fn of_returns(sound: &Sound, seed: u64) -> Self {
        let mut chance = Chance::new(seed);
        let mut limiter = standing(&window(sound.limits), sound.rate, first(sound.start));
        let mut sent = sound.frames.clone();
        // Out of the rest that it begins with, so that there is time to fade back, and while it does.
        let elsewhere = [chance.below(sent.len() / 10), sent.len() / 5 + chance.below(sent.len() / 2)];
        for (index, (position, _)) in (0_usize..).zip(&mut sent) {
            let is_apart = elsewhere.iter().any(|from| (*from..from + 3).contains(&index));
            let mut pose = first(if is_apart { chance.between(0.0, 1.0) } else { *position });
            let asked = if is_apart { Provenance::Anyhow } else { Provenance::Proved };
            limiter.admit(&mut pose, index as u64, asked);
            *position = pose[0];
        }
        let share = Judge::worst(sound.limits, sound.rate.hz(), sound.start, &sent).share();
        Self { share, unchanged: sent == sound.frames, counts: *limiter.counts() }
    }

    /// Whether a limit was broken: by more than the thousandth that the measure allows, and what rounding takes.
    pub fn is_broken(&self) -> bool {
        self.share > 1.001 * 1.000_001
    }
}

fn first(position: f64) -> Pose {
    let mut pose = [0.0; MAX_AXES];
    pose[0] = position;
    pose
}

/// A frame of one axis with those limits.
pub fn window(limits: Limits) -> Window {
    let mut slot = Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0);
    slot.limits = limits;
    Window::new(vec![slot])
}

/// What a reading of a seat at rest in that pose makes known.
pub fn read(window: &Window, pose: Pose) -> KnownPose {
    KnownPose::of(&Reading::at_rest(pose, MonoTime::default()), window).expect("it tells of every axis")
}

/// The limiter of a lane that was read at rest in that pose.
pub fn standing(window: &Window, rate: Rate, pose: Pose) -> Limiter {
    let mut limiter = Limiter::new(window, rate);
    limiter.restart(&read(window, pose));
    limiter
}
