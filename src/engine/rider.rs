//! One lane as it rides: on the course that all follow, on its own way to rest, at rest, or away.

use std::time::Duration;

use super::fader::Fader;
use super::mix::Mix;
use super::trail::Trail;
use crate::belief::KnownPose;
use crate::gate::{Asked, Counts, Gate, Verdict};
use crate::motion::{AxisState, Brake, MAX_AXES, Pose, Window};
use crate::plan::{Course, LaneScene, Place};
use crate::time::{Rate, ShowTime};

/// Hold frames that end a lane's motion.
pub(super) const HOLD_FRAMES: u8 = 3;

/// How quickly the level of vibration changes, per second.
const VIBRATION_RATE: f64 = 4.0;

/// What a lane does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Part {
    /// Follows the course.
    With,
    /// Comes to rest, for that long by now.
    Braking(Duration),
    /// Rests where it is, until a course leads on from there.
    Still,
    /// Nothing goes to it: nobody has told yet where it stands.
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
    /// Hold frames after which it is away; none where it stays.
    pub(super) leaving: Option<u8>,
    /// Whether nobody knows which frames reach it: it is brought to rest by slow ones, and is away then.
    blind: bool,
    /// Whether it has just come to be away, and is to be looked at before it can come back.
    fallen: bool,
    /// Ticks for which nothing goes to it, as its last frame leads that far ahead.
    ahead: u32,
    /// Whether this tick is one of them.
    skips: bool,
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
    gate: Gate,
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
            leaving: None,
            blind: false,
            fallen: false,
            ahead: 0,
            skips: false,
            returning: false,
            refused: false,
            refusal_untold: false,
            is_at_fault: false,
            fader: Fader::at(level),
            on_cue: true,
            vibration: level,
            brake: Brake::new(&window, &nowhere.states()),
            trail: nowhere,
            gate: Gate::new(&window, rate),
            window,
        }
    }

    /// Whether frames go to it.
    pub(super) const fn is_there(&self) -> bool {
        !matches!(self.part, Part::Unseen | Part::Away)
    }

    /// Whether this tick is one of those that its last frame leads ahead.
    pub(super) const fn take_ahead(&mut self) -> bool {
        self.skips = self.ahead > 0;
        self.ahead = self.ahead.saturating_sub(1);
        self.skips
    }

    /// Whether a frame goes to it in this tick.
    pub(super) const fn gets_a_frame(&self) -> bool {
        self.is_there() && !self.skips
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
        self.part = Part::Braking(Duration::ZERO);
    }

    /// Is away once it rests and has been told so; to be called after [`Rider::brake`].
    pub(super) fn leave(&mut self) {
        if self.is_there() {
            self.leaving.get_or_insert(HOLD_FRAMES);
        }
    }

    /// Nobody knows which frames reach it; to be called after [`Rider::brake`].
    pub(super) const fn go_blind(&mut self) {
        self.blind = self.is_there();
    }

    /// Nothing goes to it from now on.
    pub(super) const fn cut(&mut self) {
        (self.part, self.leaving, self.blind, self.ahead) = (Part::Away, None, false, 0);
        self.skips = false;
    }

    /// The same, and it has to be looked at before it can come back: what was seen so far is from before its last frame.
    pub(super) const fn fall_out(&mut self) {
        self.cut();
        self.fallen = true;
    }

    /// Whether it has just fallen out; said once.
    pub(super) const fn take_fall(&mut self) -> bool {
        std::mem::replace(&mut self.fallen, false)
    }

    /// It is there (again), at rest in that pose.
    pub(super) fn come_back(&mut self, known: &KnownPose) {
        self.trail.rest(*known.pose());
        self.gate.restart(known);
        (self.part, self.leaving, self.blind, self.ahead) = (Part::Still, None, false, 0);
        self.skips = false;
        (self.refused, self.returning) = (false, true);
    }

    /// It is known to be where the course begins, but for what is noise: it follows that.
    pub(super) fn begin_at_park(&mut self, known: &KnownPose) {
        self.come_back(known);
        self.trail.rest(self.window.park());
        self.gate.restart_at_park(known, &self.window);
        (self.part, self.returning) = (Part::With, false);
    }

    /// Frames stopped: none leads elsewhere than to the last pose, and the way goes on from there.
    pub(super) fn halt(&mut self) {
        self.trail.rest(*self.pose());
        self.gate.rest();
        if self.is_there() {
            self.part = Part::Still;
        }
    }

    /// Goes on counting what the gate has to do where another left off.
    pub(super) const fn count_on(&mut self, before: &Self) {
        self.gate.count_on(before.gate.counts());
    }

    /// What the gate had to do.
    pub(super) const fn clamps(&self) -> &Counts {
        self.gate.counts()
    }

    /// Whether the gate has held it back too often; said once.
    pub(super) const fn take_fault(&mut self) -> bool {
        std::mem::replace(&mut self.is_at_fault, false)
    }

    /// Whether it moves on its own way to rest.
    pub(super) const fn is_braking(&self) -> bool {
        matches!(self.part, Part::Braking(_))
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
            Part::With => course.pose(lane, at, &self.window, cue),
            Part::Braking(since) => self.brake_on(since + time),
            Part::Still => {
                self.count_holds();
                *self.pose()
            }
            Part::Unseen | Part::Away => *self.pose(),
        }
    }

    fn brake_on(&mut self, since: Duration) -> Pose {
        let seconds = since.as_secs_f64();
        self.part = if seconds >= self.brake.seconds() { Part::Still } else { Part::Braking(since) };
        self.brake.pose(seconds)
    }

    /// One more frame that holds it, or none if there have been enough.
    fn count_holds(&mut self) {
        if self.blind {
            return self.fall_out(); // it was told where to rest, in a frame that took its time
        }
        if let Some(left) = &mut self.leaving {
            *left -= 1;
            if *left == 0 {
                self.fall_out();
            }
        }
    }

    /// Goes on along its way to rest until `is_enough` of the pose and of the milliseconds that lead there, those of its next
    /// frame included, of which `times` gives the Times that follow it. Says how many milliseconds that makes; none where it is
    /// not on such a way, or it takes longer than `at_most`.
    pub(super) fn stretch(
        &mut self,
        mut index: u64,
        rate: Rate,
        at_most: u32,
        is_enough: impl Fn(&Pose, u32) -> bool,
    ) -> Option<u32> {
        let mut lasts = rate.time_ms(index);
        if !self.blind {
            return None;
        }
        while !is_enough(self.pose(), lasts) {
            index += 1;
            let time_ms = rate.time_ms(index);
            lasts += time_ms;
            if lasts > at_most {
                return None;
            }
            self.ahead += 1;
            if let Part::Braking(since) = self.part {
                let time = Duration::from_millis(u64::from(time_ms));
                let pose = self.brake_on(since + time);
                self.send(index, time, pose);
            }
        }
        Some(lasts)
    }

    /// Has `pose` sent in frame `index`, counted from 0, to be reached in `time`, as far as the gate lets it pass.
    ///
    /// Following its course at a level that stands its way out is part of the proof: course and cue are within the limits to
    /// their ends, and from there to rest.
    pub(super) fn send(&mut self, index: u64, time: Duration, mut pose: Pose) {
        let proved = self.part == Part::With && self.fader.is_still();
        let asked = if proved { Asked::Proved } else { Asked::Anyhow };
        self.is_at_fault |= self.gate.admit(&mut pose, index, asked) == Verdict::Fault;
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
            Part::Unseen | Part::Away => Place::Away,
            Part::Braking(_) | Part::Still if self.leaving.is_some() || self.blind => Place::Away,
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
            Part::Still => self.leaving.is_none() && !self.blind,
            Part::Braking(_) | Part::Unseen | Part::Away => false,
        };
        apart && !self.refused
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
