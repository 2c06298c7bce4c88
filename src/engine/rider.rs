//! One lane as it rides: on the course that all follow, on its own way to rest, at rest, or away.

use std::time::Duration;

use super::blind::{self, Axis, Grid, LONGEST_WAY_MS};
use super::fader::Fader;
use super::mix::Mix;
use super::trail::Trail;
use crate::belief::{Fall, KnownPose};
use crate::limiter::{Admitted, Counts, Limiter, Provenance};
use crate::motion::{AxisState, Brake, MAX_AXES, Pose, Window};
use crate::plan::{Course, LaneScene, Place};
use crate::time::{Rate, ShowTime};

/// For how long frames hold a lane that has come to rest, and three at the least: if none of them arrives, that is known by then, and
/// what it has on does not stay on.
const HOLD: Duration = Duration::from_millis(70);

/// Hold frames that end a motion.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "70 of a thousand a second")]
pub(super) fn hold_frames(rate: Rate) -> u8 {
    (HOLD.as_secs_f64() * rate.hz()).round().clamp(3.0, 255.0) as u8
}

/// One that falls out is read at rest after a second or two, if it answers at all.
const AWAITED_FOR: Duration = Duration::from_secs(3);

/// How quickly the level of vibration changes, per second.
const VIBRATION_RATE: f64 = 4.0;

/// What a lane does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Part {
    /// Follows the course.
    With,
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
pub(super) struct Rider {
    /// Its slots, at its present level.
    pub(super) window: Window,
    pub(super) part: Part,
    /// What the operator wants of it.
    pub(super) wanted: Mix,
    /// Whether it is out on the course that is followed.
    pub(super) out: bool,
    /// Hold frames that end a motion of it.
    holds: u8,
    /// Hold frames after which it is away; none where it stays.
    pub(super) leaving: Option<u8>,
    /// Whether it has just come to be away, and is to be looked at before it can come back.
    fallen: Option<Fall>,
    /// Ticks for which whoever parks still waits for it to come back.
    awaited: u32,
    /// Ticks for which that is so once it has stepped out.
    patience: u32,
    /// Ticks for which its last frame leads it, this one included.
    ahead: u32,
    /// Whether it was away, and is not where the others are yet.
    returning: bool,
    /// Whether no way in or out could be planned for it; it stays as it is until something else is wanted.
    pub(super) refused: bool,
    /// The same, as long as nobody was told.
    refusal_untold: bool,
    is_at_fault: bool,
    pub(super) fader: Fader,
    /// Whether its pose is the cue's.
    on_cue: bool,
    /// The level of its vibration; 0 until it is on the cue.
    vibration: f64,
    trail: Trail,
    brake: Brake,
    /// Whatever is asked of it, what is sent keeps the limits.
    limiter: Limiter,
}

impl Rider {
    /// A lane of which nobody has told where it stands; motion at its window's level.
    pub(super) fn unseen(window: Window, rate: Rate) -> Self {
        let level = window.level();
        let nowhere = Trail::at_rest([0.0; MAX_AXES]);
        Self {
            part: Part::Unseen,
            wanted: Mix { motion: level, vibration: level, ..Mix::FULL },
            out: false,
            holds: hold_frames(rate),
            leaving: None,
            fallen: None,
            awaited: 0,
            patience: ticks(AWAITED_FOR, rate),
            ahead: 0,
            returning: false,
            refused: false,
            refusal_untold: false,
            is_at_fault: false,
            fader: Fader::at(level),
            on_cue: true,
            vibration: level,
            brake: Brake::new(&window, &nowhere.states()),
            trail: nowhere,
            limiter: Limiter::new(&window, rate),
            window,
        }
    }

    /// Whether frames go to it.
    pub(super) const fn is_there(&self) -> bool {
        !matches!(self.part, Part::Unseen | Part::Away)
    }

    /// Another tick begins, after so many that were missed.
    pub(super) fn pass(&mut self, missed: u64) {
        let ticks = u32::try_from(missed + 1).unwrap_or(u32::MAX);
        self.ahead = self.ahead.saturating_sub(ticks);
        self.awaited = self.awaited.saturating_sub(ticks);
    }

    /// Whether a frame goes to it in this tick.
    pub(super) const fn gets_a_frame(&self) -> bool {
        self.is_there() && self.ahead == 0
    }

    /// Whether nobody knows which frames reach it.
    pub(super) const fn is_blind(&self) -> bool {
        matches!(self.part, Part::Blind(_))
    }

    /// The pose sent last.
    pub(super) const fn pose(&self) -> &Pose {
        self.trail.pose()
    }

    /// Begins to come to rest from however it moves on its course.
    ///
    /// The course knows that best; while the level changes, it is only seen in what was sent.
    pub(super) fn brake(&mut self, on_course: impl FnOnce(&Window) -> [AxisState; MAX_AXES]) {
        if self.part != Part::With {
            return;
        }
        let mut states = if self.fader.is_still() { on_course(&self.window) } else { self.trail.states() };
        for (state, position) in states.iter_mut().zip(self.pose()) {
            state.position = *position;
        }
        self.brake = Brake::new(&self.window, &states);
        // One that was on its way out is told so by whatever course leads on.
        (self.part, self.leaving) = (Part::Braking(Duration::ZERO), None);
    }

    /// Is away once it rests and has been told so; to be called after [`Rider::brake`].
    pub(super) fn leave(&mut self) {
        if self.is_there() {
            self.leaving.get_or_insert(self.holds);
        }
    }

    /// Nobody knows which frames reach it. One that rests is told so on: it may not have heard of it, and vibrate.
    pub(super) fn go_blind(&mut self) {
        match self.part {
            Part::With | Part::Braking(_) | Part::Still => self.part = Part::Blind(0),
            Part::Blind(_) | Part::Unseen | Part::Away => {}
        }
    }

    /// Slow frames lead it to that pose, about which it vibrates on, and end that. Where it was led before says nothing any more.
    pub(super) fn still(&mut self, pose: &Pose) {
        self.trail.rest(*pose);
        (self.part, self.leaving, self.ahead) = (Part::Blind(0), None, 0);
    }

    /// Nobody knows any more where its seat is. One that was to leave, or of which nobody knew which frames reach it, is away.
    pub(super) const fn lose_sight(&mut self) {
        match self.part {
            Part::With | Part::Braking(_) | Part::Still if self.leaving.is_none() => {
                (self.part, self.ahead) = (Part::Unseen, 0);
            }
            Part::Unseen | Part::Away => {}
            Part::With | Part::Braking(_) | Part::Still | Part::Blind(_) => self.fall_out(Fall::Gap),
        }
    }

    /// Nothing goes to it from now on.
    pub(super) const fn cut(&mut self) {
        (self.part, self.leaving, self.ahead, self.awaited) = (Part::Away, None, 0, 0);
    }

    /// The same, and it is looked at: it may be back soon.
    pub(super) const fn step_out(&mut self) {
        self.cut();
        self.awaited = self.patience;
    }

    /// The same, and it has to be looked at before it can come back: what was seen so far is from before its last frame.
    pub(super) const fn fall_out(&mut self, why: Fall) {
        self.step_out();
        self.fallen = Some(why);
    }

    /// Why it has just fallen out; said once.
    pub(super) const fn take_fall(&mut self) -> Option<Fall> {
        self.fallen.take()
    }

    /// It is there (again), at rest in that pose.
    pub(super) fn come_back(&mut self, known: &KnownPose) {
        self.trail.rest(*known.pose());
        self.limiter.restart(known);
        (self.part, self.leaving, self.ahead, self.awaited) = (Part::Still, None, 0, 0);
        (self.refused, self.returning) = (false, true);
    }

    /// It is known to be where the course begins, but for what is noise: it follows that.
    pub(super) fn begin_at_park(&mut self, known: &KnownPose) {
        self.come_back(known);
        self.trail.rest(self.window.park());
        self.limiter.restart_at_park(known, &self.window);
        (self.part, self.returning) = (Part::With, false);
    }

    /// Frames stopped: none leads elsewhere than to the last pose, and the way goes on from there.
    pub(super) fn halt(&mut self) {
        self.trail.rest(*self.pose());
        self.limiter.rest();
        if self.is_blind() {
            self.fall_out(Fall::Gap);
        } else if self.is_there() {
            // One that was being told that it is out is told so anew by whatever course leads on.
            self.leaving = self.leaving.filter(|_| self.part != Part::With);
            self.part = Part::Still;
        }
    }

    /// Goes on where another left off: with what the limiter had to do, and away where that was.
    pub(super) fn go_on_from(&mut self, before: &Self) {
        self.limiter.count_on(before.limiter.counts());
        if before.part == Part::Away {
            self.cut();
            self.awaited = before.awaited;
        }
    }

    /// What the limiter had to do.
    pub(super) const fn clamps(&self) -> &Counts {
        self.limiter.counts()
    }

    /// Whether the limiter has held it back too often; said once.
    pub(super) const fn take_fault(&mut self) -> bool {
        std::mem::replace(&mut self.is_at_fault, false)
    }

    /// Whether it moves on its own way to rest.
    pub(super) const fn is_braking(&self) -> bool {
        matches!(self.part, Part::Braking(_) | Part::Blind(_))
    }

    /// Where it is to be `time` after the frame before; `at` on its course, and `cue` there.
    pub(super) fn next(
        &mut self,
        lane: usize,
        time: Duration,
        course: &mut Course,
        at: ShowTime,
        cue: &Pose,
    ) -> Pose {
        self.on_cue = self.part == Part::With && course.is_on_cue(lane, at);
        match self.part {
            Part::With => {
                self.count_stowed(course.is_settled(lane, at));
                course.pose(lane, at, &self.window, cue)
            }
            Part::Braking(since) => self.brake_on(since + time),
            Part::Still => {
                self.count_holds();
                *self.pose()
            }
            Part::Blind(_) | Part::Unseen | Part::Away => *self.pose(),
        }
    }

    fn brake_on(&mut self, since: Duration) -> Pose {
        let seconds = since.as_secs_f64();
        self.part = if seconds >= self.brake.seconds() { Part::Still } else { Part::Braking(since) };
        self.brake.pose(seconds)
    }

    /// One more frame that holds it, or none if there have been enough.
    fn count_holds(&mut self) {
        if let Some(left) = &mut self.leaving {
            *left -= 1;
            if *left == 0 {
                self.fall_out(Fall::Gap);
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
            None => (self.part, self.leaving) = (Part::Unseen, None),
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
        let Part::Blind(since_ms) = self.part else { return None };
        let (pose, speed) = (*self.pose(), self.trail.speed(blind::sight_s(rate)));
        let mut axes = [Axis::PADDING; MAX_AXES];
        for (slot, own) in self.window.slots().iter().enumerate().filter(|(_, own)| own.is_own) {
            axes[slot] = Axis::new(pose[slot], speed[slot], farthest[slot], &own.limits, rate);
        }
        let grid = Grid { rate, index, longest_ms, left_ms: LONGEST_WAY_MS.saturating_sub(since_ms) };
        let Some(leg) = blind::next_leg(&axes, grid) else {
            self.fall_out(Fall::Gap);
            return None;
        };
        self.trail.push(Duration::from_millis(u64::from(leg.lasts_ms)), leg.to);
        (self.part, self.ahead) = (Part::Blind(since_ms + leg.lasts_ms), leg.ticks);
        Some(leg.lasts_ms)
    }

    /// Has `pose` sent in frame `index`, counted from 0, to be reached in `time`, as far as the limiter lets it pass.
    ///
    /// Following its course at a level that stands its way out is part of the proof: course and cue are within the limits to
    /// their ends, and from there to rest.
    pub(super) fn send(&mut self, index: u64, time: Duration, mut pose: Pose) {
        let proved = self.part == Part::With && self.fader.is_still();
        let asked = if proved { Provenance::Proved } else { Provenance::Anyhow };
        self.is_at_fault |= self.limiter.admit(&mut pose, index, asked) == Admitted::Fault;
        self.trail.push(time, pose);
        let step = VIBRATION_RATE * time.as_secs_f64();
        self.vibration += (self.wanted.vibration - self.vibration).clamp(-step, step);
        if !self.on_cue {
            self.vibration = 0.0; // its room was proved for the cue's poses alone
        }
    }

    /// How it is as a course is asked for.
    pub(super) fn scene(&self) -> LaneScene {
        let place = match self.part {
            Part::With => Place::OnCourse,
            Part::Blind(_) | Part::Unseen | Part::Away => Place::Away,
            Part::Braking(_) | Part::Still if self.leaving.is_some() => Place::Away,
            Part::Braking(_) | Part::Still => Place::Still(*self.pose()),
        };
        LaneScene { place, level: self.fader.level(), out: self.wants_out() }
    }

    /// Whether it is to be out on the next course.
    pub(super) const fn wants_out(&self) -> bool {
        !self.wanted.on
    }

    /// Whether it is not where it is to be, and only a new course can bring it there.
    pub(super) fn needs_a_course(&self) -> bool {
        let apart = match self.part {
            Part::With => self.out != self.wants_out(),
            Part::Still => self.leaving.is_none(),
            Part::Braking(_) | Part::Blind(_) | Part::Unseen | Part::Away => false,
        };
        apart && !self.refused
    }

    /// Whether it may still come to park: it has just stepped out and is looked at, or is about to.
    pub(super) const fn is_awaited(&self) -> bool {
        self.wanted.on && (self.awaited > 0 || self.is_blind())
    }

    /// Whether it is there again, and the others left for park without it.
    pub(super) fn is_left_behind(&self) -> bool {
        self.part == Part::Still && self.needs_a_course()
    }

    /// Whether a park is not over without it.
    pub(super) fn is_missing(&self) -> bool {
        self.is_awaited() || self.is_left_behind()
    }

    /// Hears that no such course could be planned.
    pub(super) fn refuse(&mut self) {
        self.refused = self.needs_a_course();
        self.refusal_untold |= self.refused;
    }

    /// Whether no way in or out could be planned for it; said once.
    pub(super) const fn take_refusal(&mut self) -> bool {
        std::mem::replace(&mut self.refusal_untold, false)
    }

    /// Takes up the course that was asked for with `scene`.
    pub(super) fn take_up(&mut self, scene: &LaneScene) {
        let as_planned = match (self.part, scene.place) {
            (Part::With, Place::OnCourse) => true,
            (Part::Still, Place::Still(pose)) => self.leaving.is_none() && pose == *self.pose(),
            _ => false,
        };
        if as_planned {
            (self.part, self.out) = (Part::With, scene.out);
        }
    }

    /// Whether it has just arrived where the others are; said once.
    pub(super) fn take_arrival(&mut self, is_settled: bool) -> bool {
        let arrives = self.returning && self.part == Part::With && is_settled;
        self.returning &= !arrives;
        arrives
    }

    /// What it makes of the cue's vibration and effects; its motion is in the poses.
    pub(super) fn mix(&self) -> Mix {
        if self.part == Part::With && !self.out {
            Mix { vibration: self.vibration, ..self.wanted }
        } else {
            Mix::STILL
        }
    }

    /// Moves its level on by `dt` seconds, towards `target`.
    pub(super) fn fade(&mut self, dt: f64, target: f64, share: f64) {
        self.fader.advance(dt, target, share);
        self.window.set_level(self.fader.level());
    }

    /// Lets its level come to stand where it is.
    pub(super) fn settle(&mut self, dt: f64) {
        self.fader.settle(dt);
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
