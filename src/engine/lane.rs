//! One lane as it moves: on the course that all follow, on its own way to rest, at rest, or away.

use std::time::Duration;

use super::blind::{self, BlindAxis, Grid, LONGEST_WAY_MS};
use super::fader::Fader;
use super::mix::Mix;
use super::phase::hold_frames;
use super::trail::Trail;
use crate::belief::{KnownPose, Wish};
use crate::limiter::{Admitted, Counts, Limiter, Provenance};
use crate::motion::{AxisState, Brake, MAX_AXES, Pose, Window};
use crate::plan::Course;
use crate::time::{Rate, ShowTime};

/// One that falls out is read at rest after a second or two, if it answers at all.
const AWAITED_FOR: Duration = Duration::from_secs(3);

/// Over how long the speed shows of one that was led elsewhere, seconds: longer than it is looked back.
const LED_S: f64 = 0.5;

// Chosen: gone within a quarter of a second of whoever turns it off, and not at one blow.
/// How quickly the level of vibration changes, per second.
const VIBRATION_RATE: f64 = 4.0;

/// What a lane does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LaneMode {
    /// Follows the course.
    Following,
    /// Comes to rest, for that long by now.
    Braking(Duration),
    /// Nobody knows which frames reach it: it is brought to rest by slow ones ([`blind`]), for so many milliseconds by now, and is away
    /// then.
    Blind(u32),
    /// Rests where it is, until a course leads on from there.
    Still,
    /// Nothing goes to it: nobody has told yet where it stands, or it is out and at park.
    Unseen,
    /// Nothing goes to it, until it is said to be found.
    Away,
}

/// One lane.
#[derive(Debug, Clone)]
pub struct LaneMotion {
    /// Its slots, at its present level.
    pub(super) window: Window,
    pub(super) mode: LaneMode,
    /// What the operator wants of it.
    pub(super) wanted: Mix,
    /// Whether it is out on the course that is followed.
    pub(super) out: bool,
    /// Hold frames that end a motion of it.
    holds: u8,
    /// Hold frames after which it is away; none where it stays.
    pub(super) leaving: Option<u8>,
    /// Ticks for which whoever parks still waits for it to come back.
    pub(super) awaited: u32,
    /// Ticks for which that is so once it has stepped out.
    patience: u32,
    /// Ticks for which its last frame leads it, this one included.
    ahead: u32,
    /// Whether it was away, and is not where the others are yet.
    pub(super) returning: bool,
    /// Whether no way in or out could be planned for it; it stays as it is until something else is wanted.
    pub(super) refused: bool,
    pub(super) fader: Fader,
    /// The level of its vibration; 0 until it is on the cue.
    vibration: f64,
    trail: Trail,
    brake: Brake,
    /// Whatever is asked of it, what is sent keeps the limits.
    limiter: Limiter,
    /// What was asked of it last, before the limiter.
    asked: Pose,
}

impl LaneMotion {
    /// A lane of which nobody has told where it stands; motion at its window's level.
    pub(super) fn unseen(window: Window, rate: Rate) -> Self {
        let level = window.level();
        let nowhere = Trail::at_rest([0.0; MAX_AXES]);
        Self {
            mode: LaneMode::Unseen,
            wanted: Mix { motion: level, vibration: level, ..Mix::FULL },
            out: false,
            holds: hold_frames(rate),
            leaving: None,
            awaited: 0,
            patience: ticks(AWAITED_FOR, rate),
            ahead: 0,
            returning: false,
            refused: false,
            fader: Fader::at(level),
            vibration: level,
            brake: Brake::new(&window, &nowhere.states()),
            trail: nowhere,
            limiter: Limiter::new(&window, rate),
            asked: [0.0; MAX_AXES],
            window,
        }
    }

    /// True if it is led, or would be if it were seen.
    #[must_use]
    pub(crate) const fn takes_part(&self) -> bool {
        self.is_there() || self.is_unseen()
    }

    /// True if it is to take part, and nobody has told where it stands.
    #[must_use]
    pub(crate) const fn is_unseen(&self) -> bool {
        matches!(self.mode, LaneMode::Unseen) && self.wanted.on
    }

    /// Takes what operators want of it; says whether it is put back.
    pub(super) fn want(&mut self, mix: Mix) -> bool {
        self.refused &= self.wanted.on == mix.on;
        let is_put_back = mix.on && !self.wanted.on;
        self.wanted = mix;
        is_put_back
    }

    /// Whether frames go to it.
    pub(super) const fn is_there(&self) -> bool {
        !matches!(self.mode, LaneMode::Unseen | LaneMode::Away)
    }

    /// Whether it follows the cue, as that lane of the course.
    pub(super) fn is_on_cue(&self, course: &Course, lane: usize, at: ShowTime) -> bool {
        self.mode == LaneMode::Following && course.is_on_cue(lane, at)
    }

    /// Another tick begins, after so many that were missed.
    pub(super) fn pass(&mut self, missed: u64) {
        let ticks = u32::try_from(missed + 1).unwrap_or(u32::MAX);
        self.ahead = self.ahead.saturating_sub(ticks);
        self.awaited = self.awaited.saturating_sub(ticks);
    }

    /// Whether a frame goes to it in this tick.
    #[must_use]
    pub(crate) const fn gets_a_frame(&self) -> bool {
        self.is_there() && self.ahead == 0
    }

    /// Its frame takes so many ticks, this one included.
    pub(super) const fn stretch(&mut self, ticks: u32) {
        self.ahead = ticks;
    }

    /// Whether it is wanted, and neither out nor on its way there.
    #[must_use]
    pub(crate) const fn is_in(&self) -> bool {
        self.wanted.on && !self.out
    }

    /// Whether nobody knows which frames reach it.
    #[must_use]
    pub(crate) const fn is_blind(&self) -> bool {
        matches!(self.mode, LaneMode::Blind(_))
    }

    /// The pose sent last.
    #[must_use]
    pub const fn pose(&self) -> &Pose {
        self.trail.pose()
    }

    /// How it is to move from the pose sent last on.
    #[must_use]
    pub(crate) fn wish(&self) -> Wish {
        let states = self.trail.states();
        Wish {
            before: *self.trail.before(),
            pose: *self.pose(),
            velocity: states.map(|state| state.velocity),
            acceleration: states.map(|state| state.acceleration),
        }
    }

    /// Its frames led it there, at that speed, and not where it was asked to be.
    pub(super) fn led_instead(&mut self, pose: &Pose, speed: &Pose) {
        self.trail.rest(std::array::from_fn(|slot| pose[slot] - speed[slot] * LED_S));
        self.trail.push(Duration::from_secs_f64(LED_S), *pose);
    }

    /// The present level of its motion, 0 to 1.
    #[must_use]
    pub(crate) fn level(&self) -> f64 {
        self.window.level()
    }

    /// What was asked of it for its last frame, before the limiter saw it.
    #[must_use]
    pub(crate) const fn asked(&self) -> &Pose {
        &self.asked
    }

    /// Begins to come to rest from however it moves on its course.
    pub(super) fn brake(&mut self, on_course: impl FnOnce(&Window) -> [AxisState; MAX_AXES]) {
        if self.mode != LaneMode::Following {
            return;
        }
        // The course knows best how it moves; while the level changes, it is only seen in what was sent.
        let mut states = if self.fader.is_still() { on_course(&self.window) } else { self.trail.states() };
        // From the pose that was sent: the limiter may hold it elsewhere than the course says.
        for (state, position) in states.iter_mut().zip(self.pose()) {
            state.position = *position;
        }
        self.brake = Brake::new(&self.window, &states);
        // One that was on its way out is told so by whatever course leads on.
        (self.mode, self.leaving) = (LaneMode::Braking(Duration::ZERO), None);
    }

    /// Is away once it rests and has been told so; to be called after [`LaneMotion::brake`].
    pub(super) fn leave(&mut self) {
        if self.is_there() {
            self.leaving.get_or_insert(self.holds);
        }
    }

    /// Nobody knows which frames reach it. One that rests is told so on: it may not have heard of it, and vibrate.
    pub(super) fn go_blind(&mut self) {
        match self.mode {
            LaneMode::Following | LaneMode::Braking(_) | LaneMode::Still => self.mode = LaneMode::Blind(0),
            LaneMode::Blind(_) | LaneMode::Unseen | LaneMode::Away => {}
        }
    }

    /// Slow frames lead it to that pose, about which it vibrates on, and end that. Where it was led before says nothing any more.
    pub(super) fn still(&mut self, pose: &Pose) {
        self.trail.rest(*pose);
        (self.mode, self.leaving, self.ahead) = (LaneMode::Blind(0), None, 0);
    }

    /// Nobody knows any more where its seat is. One that was to leave, or of which nobody knew which frames reach it, falls out: says
    /// whether it does.
    pub(super) const fn lose_sight(&mut self) -> bool {
        match self.mode {
            LaneMode::Following | LaneMode::Braking(_) | LaneMode::Still if self.leaving.is_none() => {
                (self.mode, self.ahead) = (LaneMode::Unseen, 0);
                false
            }
            LaneMode::Unseen | LaneMode::Away => false,
            LaneMode::Following | LaneMode::Braking(_) | LaneMode::Still | LaneMode::Blind(_) => {
                self.step_out();
                true
            }
        }
    }

    /// Nothing goes to it from now on.
    pub(super) const fn cut(&mut self) {
        (self.mode, self.leaving, self.ahead, self.awaited) = (LaneMode::Away, None, 0, 0);
    }

    /// The same, and it is looked at: it may be back soon. One that falls out is looked at before it can come back: what was seen so
    /// far is from before its last frame.
    pub(super) const fn step_out(&mut self) {
        self.cut();
        self.awaited = self.patience;
    }

    /// It is there (again), at rest in that pose.
    pub(super) fn come_back(&mut self, known: &KnownPose) {
        self.trail.rest(*known.pose());
        // Of a seat that was away nothing that was sent before says how it moves, nor where from.
        self.limiter.restart(known);
        (self.mode, self.leaving, self.ahead, self.awaited) = (LaneMode::Still, None, 0, 0);
        (self.refused, self.returning) = (false, true);
    }

    /// It is known to be where the course begins, but for what is noise: it follows that.
    pub(super) fn begin_at_park(&mut self, known: &KnownPose) {
        self.come_back(known);
        self.trail.rest(self.window.park());
        self.limiter.restart_at_park(known, &self.window);
        (self.mode, self.returning) = (LaneMode::Following, false);
    }

    /// Frames stopped: none leads elsewhere than to the last pose, and the way goes on from there. One of which nobody knew which
    /// frames reach it falls out: says whether it does.
    pub(super) fn halt(&mut self) -> bool {
        // The last frame has led there and has ended, or none has left yet.
        self.trail.rest(*self.pose());
        self.limiter.rest();
        let falls_out = self.is_blind();
        if falls_out {
            self.step_out();
        } else if self.is_there() {
            // One that was being told that it is out is told so anew by whatever course leads on.
            self.leaving = self.leaving.filter(|_| self.mode != LaneMode::Following);
            self.mode = LaneMode::Still;
        }
        falls_out
    }

    /// Goes on where another left off: with what the limiter had to do, and away where that was.
    pub(super) fn go_on_from(&mut self, before: &Self) {
        self.limiter.count_on(before.limiter.counts());
        if before.mode == LaneMode::Away {
            self.cut();
            self.awaited = before.awaited;
        }
    }

    /// What the limiter had to do.
    #[must_use]
    pub(crate) const fn clamps(&self) -> &Counts {
        self.limiter.counts()
    }

    /// Whether it moves on its own way to rest.
    pub(super) const fn is_braking(&self) -> bool {
        matches!(self.mode, LaneMode::Braking(_) | LaneMode::Blind(_))
    }

    /// Has it sent where it is to be `time` after the frame before, in frame `index`, counted from 0; `at` on its course, if there is
    /// one, and `cue` there. One whose last hold frame that would be is away instead. False if the limiter has held it back too often.
    pub(super) fn advance(
        &mut self,
        (index, time): (u64, Duration),
        course: Option<(&mut Course, usize)>,
        at: ShowTime,
        cue: &Pose,
    ) -> bool {
        let mut on_cue = false;
        let pose = match (self.mode, course) {
            (LaneMode::Following, Some((course, lane))) => {
                on_cue = course.is_on_cue(lane, at);
                self.count_stowed(course.is_settled(lane, at));
                course.pose(lane, at, &self.window, cue)
            }
            (LaneMode::Braking(since), _) => self.brake_on(since + time),
            (LaneMode::Still, _) => {
                self.count_holds();
                *self.pose()
            }
            // One that follows no course is asked to stay, and where it still moves the limiter brakes it.
            (LaneMode::Following | LaneMode::Blind(_) | LaneMode::Unseen | LaneMode::Away, _) => *self.pose(),
        };
        self.send(index, time, pose, on_cue)
    }

    fn brake_on(&mut self, since: Duration) -> Pose {
        let seconds = since.as_secs_f64();
        self.mode = if seconds >= self.brake.seconds() { LaneMode::Still } else { LaneMode::Braking(since) };
        self.brake.pose(seconds)
    }

    /// One more frame that holds it, or none if there have been enough.
    fn count_holds(&mut self) {
        if let Some(left) = &mut self.leaving {
            *left -= 1;
            if *left == 0 {
                self.step_out();
            }
        }
    }

    /// One that is out, and at park, gets hold frames and then none: whoever works on it is safe from those of the others.
    fn count_stowed(&mut self, is_settled: bool) {
        if !(self.out && self.wants_out() && is_settled) {
            self.leaving = None;
            return;
        }
        let left = self.leaving.get_or_insert(self.holds);
        match left.checked_sub(1) {
            Some(fewer) => *left = fewer,
            None => (self.mode, self.leaving) = (LaneMode::Unseen, None),
        }
    }

    /// Goes on with frame `index`, counted from 0, towards its rest though nobody knows which frames reach it; `farthest` away each
    /// slot may be from its pose, and no frame takes longer than `longest_ms`. Says how long this one takes; none where it has
    /// fallen out, because it rests, or because nothing can be sent to it.
    pub(super) fn slow_down(
        &mut self,
        index: u64,
        rate: Rate,
        longest_ms: u32,
        farthest: &Pose,
    ) -> Option<u32> {
        let LaneMode::Blind(since_ms) = self.mode else { return None };
        let (pose, speed) = (*self.pose(), self.trail.speed(blind::sight_s(rate)));
        let mut axes = [BlindAxis::PADDING; MAX_AXES];
        // Slots that are no axis of the seat move nothing, and must not make its frames longer.
        for (slot, own) in self.window.slots().iter().enumerate().filter(|(_, own)| own.is_own) {
            axes[slot] = BlindAxis::new(pose[slot], speed[slot], farthest[slot], &own.limits, rate);
        }
        let grid = Grid { rate, index, longest_ms, left_ms: LONGEST_WAY_MS.saturating_sub(since_ms) };
        let Some(leg) = blind::next_leg(&axes, grid) else {
            self.step_out();
            return None;
        };
        self.trail.push(Duration::from_millis(u64::from(leg.lasts_ms)), leg.to);
        self.asked = leg.to;
        (self.mode, self.ahead) = (LaneMode::Blind(since_ms + leg.lasts_ms), leg.ticks);
        Some(leg.lasts_ms)
    }

    /// Has `pose` sent in frame `index`, counted from 0, to be reached in `time`, as far as the limiter lets it pass.
    fn send(&mut self, index: u64, time: Duration, mut pose: Pose, on_cue: bool) -> bool {
        // On its course, at a level that stands, its way out is part of the proof: course and cue are
        // within the limits to their ends, and from there to rest. No proof is about a level that changes.
        let proved = self.mode == LaneMode::Following && self.fader.is_still();
        let provenance = if proved { Provenance::Proved } else { Provenance::Anyhow };
        self.asked = pose;
        let is_at_fault = self.limiter.admit(&mut pose, index, provenance) == Admitted::Fault;
        self.trail.push(time, pose);
        let step = VIBRATION_RATE * time.as_secs_f64();
        self.vibration += (self.wanted.vibration - self.vibration).clamp(-step, step);
        if !on_cue {
            self.vibration = 0.0; // its room was proved for the cue's poses alone
        }
        !is_at_fault
    }

    /// What it makes of the cue's vibration and effects; its motion is in the poses.
    #[must_use]
    pub fn mix(&self) -> Mix {
        if self.mode == LaneMode::Following && !self.out {
            Mix { vibration: self.vibration, ..self.wanted }
        } else {
            Mix::STILL
        }
    }

    /// Whether what the cue has of vibration may be on it.
    pub(super) fn may_shake(&self) -> bool {
        self.vibration.max(self.wanted.vibration) > 0.0
    }

    /// Moves its level on by `dt` seconds, towards `target`.
    pub(super) fn fade(&mut self, dt: f64, target: f64, share: f64) {
        self.fader.advance(dt, target, share);
        self.window.set_level(self.fader.level());
    }

    /// Lets its level come to stand where it is, or before `target`.
    pub(super) fn settle(&mut self, dt: f64, target: f64) {
        self.fader.settle(dt, target);
        self.window.set_level(self.fader.level());
    }

    /// Sets its level at once: it rests, and the next course begins there.
    pub(super) fn set_level(&mut self, level: f64) {
        self.fader = Fader::at(level);
        self.window.set_level(level);
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand ticks")]
fn ticks(span: Duration, rate: Rate) -> u32 {
    (span.as_secs_f64() * rate.hz()) as u32
}
