//! The life of a play, tick by tick: where show time stands, which course the lanes follow, and what each frame says.
//! Tick thread; told the time, never asks; allocates nothing.

mod grid;
mod headroom;
mod slew;
mod stamps;
mod switch;
mod turn;

pub use grid::{Rate, Tick, TickGrid};
pub use headroom::Headroom;
pub use slew::MAX_SPEED_UP;

use std::sync::Arc;
use std::time::Duration;

use crate::cue::Vibration;
use crate::motion::{MAX_AXES, Pose, Window};
use crate::plan::Course;
use crate::time::ShowTime;
use crate::timeline::{EffectSet, Hint, Timeline};
use crate::wire::Timing;
use slew::Slew;
use stamps::Stamps;
use switch::{Retired, Switch};

/// What a controller takes for its first absolute frame at the most (PA09, IMAX manual 2.3.1).
const FIRST_ABSOLUTE_MS: u32 = 100;

/// How a play ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The cue was played to its end.
    Completed,
    /// Somebody asked for it.
    Stopped,
    /// A move could not be planned; the lanes were stopped where they could be.
    Fault,
}

/// What a play is about; fixed before it starts.
#[derive(Debug, Clone)]
pub struct Show {
    /// Ticks per second.
    pub rate: Rate,
    /// Which Time the frames carry.
    pub timing: Timing,
    /// Show time of tick 0.
    pub start: ShowTime,
    /// Plays in all; 0 plays until stopped.
    pub plays: u32,
}

/// What the frames of one tick have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beat {
    /// Which kind of Time they carry.
    pub timing: Timing,
    /// The Time field.
    pub time_ms: u32,
    /// The vibration of each of the cue's axes, in its unit.
    pub vibration: [Vibration; MAX_AXES],
    /// The effects that are on.
    pub effects: EffectSet,
}

impl Beat {
    /// Frames without vibration and effects.
    #[must_use]
    pub fn still(timing: Timing, time_ms: u32) -> Self {
        Self { timing, time_ms, vibration: [Vibration::default(); MAX_AXES], effects: EffectSet::Named(0) }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Repeats the park pose once, so that no motion hangs on how a controller times its first absolute frame.
    Settling,
    Riding,
    /// Frames stopped for too long: holds the last pose until a course leads on.
    Stalled,
    Parking,
    Closing(u8),
    Done,
}

/// The engine of one play.
#[derive(Debug)]
pub struct Engine {
    show: Show,
    timeline: Arc<Timeline>,
    headroom: Headroom,
    windows: Vec<Window>,
    poses: Vec<Pose>,
    hint: Hint,
    phase: Phase,
    ending: Ending,
    course: Box<Course>,
    switch: Option<Switch>,
    /// What was to follow the end of the cue, while a stop is asked for.
    spare: Option<Switch>,
    retired: Retired,
    serial: u32,
    plays_left: Option<u32>,
    /// Whether the lanes are to park, come what may.
    homeward: bool,
    /// Answers of the planner in a row that came too late.
    late_answers: u32,
    frames: u64,
    /// The show time of the next tick.
    playhead: ShowTime,
    /// The show time of the pose sent last.
    reached: ShowTime,
    slew: Slew,
    stamps: Stamps,
}

impl Engine {
    /// An engine whose lanes are in their park poses; `course` begins at the show's start.
    #[must_use]
    pub fn new(
        show: Show,
        timeline: Arc<Timeline>,
        headroom: Headroom,
        windows: Vec<Window>,
        course: Box<Course>,
    ) -> Self {
        let settles = show.timing == Timing::Absolute && show.rate.period() > millis(FIRST_ABSOLUTE_MS);
        Self {
            poses: windows.iter().map(Window::park).collect(),
            hint: Hint::default(),
            phase: if settles { Phase::Settling } else { Phase::Riding },
            ending: Ending::Completed,
            switch: None,
            spare: None,
            retired: Retired::default(),
            serial: course.serial,
            plays_left: show.plays.checked_sub(1),
            homeward: false,
            late_answers: 0,
            frames: 0,
            playhead: show.start,
            reached: show.start,
            slew: Slew::default(),
            stamps: Stamps::new(show.timing),
            show,
            timeline,
            headroom,
            windows,
            course,
        }
    }

    /// Asks for the end: park, three hold frames, done. Asking again changes nothing.
    ///
    /// Before the first frame it is the end at once: nothing has been set in motion, and the lanes may still be on a
    /// slow way to park, or where nobody knows.
    pub fn stop(&mut self) {
        if self.frames == 0 {
            self.phase = Phase::Done;
            self.ending = Ending::Stopped;
        } else if !self.homeward && matches!(self.phase, Phase::Settling | Phase::Riding | Phase::Stalled) {
            self.homeward = true;
            self.ending = Ending::Stopped;
        }
    }

    /// The poses of the frames of this tick, lane by lane, as fractions of each slot's stroke.
    #[must_use]
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// The show time of the next tick.
    #[must_use]
    pub fn playhead(&self) -> ShowTime {
        self.playhead
    }

    /// Whether the lanes are on their way onto the cue.
    #[must_use]
    pub fn is_joining(&self) -> bool {
        match self.phase {
            Phase::Settling => true,
            Phase::Riding => self.reached < self.course.settled(),
            _ => false,
        }
    }

    /// Whether the lanes are to park, be it that they still follow the cue, or are there.
    #[must_use]
    pub const fn is_homeward(&self) -> bool {
        self.homeward || matches!(self.phase, Phase::Parking | Phase::Closing(_) | Phase::Done)
    }

    /// How far the show is behind its grid.
    #[must_use]
    pub fn lag(&self) -> Duration {
        self.slew.lag()
    }

    /// How the play ended; none while it lasts.
    #[must_use]
    pub fn ending(&self) -> Option<Ending> {
        (self.phase == Phase::Done).then_some(self.ending)
    }

    /// Serves one tick: sets the poses and says what their frames carry. None once the play has ended.
    pub fn tick(&mut self, missed: u64) -> Option<Beat> {
        self.count_missed(missed);
        if matches!(self.phase, Phase::Closing(0) | Phase::Done) {
            self.phase = Phase::Done;
            return None;
        }
        let time_ms = self.show.rate.time_ms(self.frames);
        self.frames += 1;
        let show = self.playhead;
        self.move_on(millis(time_ms));
        let (timing, time_ms) = self.stamps.next(time_ms);
        let mut beat = Beat::still(timing, time_ms);
        if matches!(self.phase, Phase::Riding | Phase::Stalled) {
            // They act when the frame comes, not when its pose is reached.
            beat.vibration = self.timeline.vibration(show, &mut self.hint);
            beat.effects = self.timeline.effects(show, &mut self.hint);
        }
        self.look_ahead();
        Some(beat)
    }

    /// Advances show time by one frame and sets the poses.
    fn move_on(&mut self, time: Duration) {
        match self.phase {
            Phase::Settling => {
                self.phase = Phase::Riding;
                return;
            }
            Phase::Closing(left) => return self.close(left),
            Phase::Done => return,
            Phase::Stalled | Phase::Riding | Phase::Parking => {
                let passed = self.pass(time);
                self.playhead += passed;
            }
        }
        // Before the poses: one past the change of course is the new course's.
        self.take_switch();
        if self.phase == Phase::Stalled {
            return;
        }
        self.reached = self.playhead;
        let cue = self.timeline.sample(self.reached, &mut self.hint);
        for (lane, (pose, window)) in self.poses.iter_mut().zip(&self.windows).enumerate() {
            *pose = self.course.pose(lane, self.reached, window, &cue);
        }
        if let Phase::Closing(left) = self.phase {
            self.close(left);
        }
    }

    /// Counts a hold frame.
    fn close(&mut self, left: u8) {
        self.phase = Phase::Closing(left - 1);
        if left == 1 {
            self.stamps.break_off(); // whoever plays next starts its sum after a relative frame
        }
    }
}

fn millis(ms: u32) -> Duration {
    Duration::from_millis(u64::from(ms))
}
