//! The life of a play, tick by tick: where show time stands, which course the lanes follow, and what each frame says.
//! Tick thread; told the time, never asks; allocates nothing.

mod blind;
mod fader;
mod film;
mod headroom;
mod mix;
mod orders;
mod rest;
mod rider;
mod signs;
mod slew;
mod stamps;
mod switch;
mod trail;
mod turn;
mod wait;

pub use headroom::Headroom;
pub use mix::Mix;
pub use signs::Unplanned;
pub use slew::MAX_SPEED_UP;

use std::sync::Arc;
use std::time::Duration;

use crate::belief::Fall;
use crate::channel::Samples;
use crate::motion::{Pose, Window};
use crate::plan::{Course, Scene};
use crate::time::{Rate, ShowTime};
use crate::timeline::{EffectSet, Hint, Timeline};
use crate::wire::Timing;
use rest::Holds;
use rider::{Part, Rider, hold_frames};
use slew::Slew;
use stamps::Stamps;
use switch::{Retired, Scenes, Switch};

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

/// What the hall wants of the engine: told every tick, so that none can be missed, and told again it changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Directive {
    /// Nothing is to begin: the hall is not ready.
    Off,
    /// Nothing is to begin until somebody lets the show go.
    Wait,
    /// The lanes are to follow the cue, from a pause as well.
    Play,
    /// They are to come to rest, and the film waits.
    Hold,
    /// They are to come to rest, and nothing goes on from there.
    Stop,
    /// They are to park, and then the show is over.
    Park,
}

/// What a play is about; fixed before it starts.
#[derive(Debug, Clone)]
pub struct Show {
    /// Ticks per second.
    pub rate: Rate,
    /// The kind of Time that the frames carry.
    pub timing: Timing,
    /// Show time of tick 0.
    pub start: ShowTime,
    /// Number of plays; 0 plays until stopped.
    pub plays: u32,
}

/// What the frames of one tick have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beat {
    /// Which kind of Time they carry.
    pub timing: Timing,
    /// The Time field.
    pub time_ms: u32,
    /// How long the frame takes, ms: what a relative one says, and the difference to the one before of an absolute one.
    pub lasts_ms: u32,
    /// What the cue's channels say, in its unit.
    pub samples: Samples,
    /// The effects that are on.
    pub effects: EffectSet,
}

impl Beat {
    /// Frames with all channels and effects off.
    #[must_use]
    pub fn still(timing: Timing, time_ms: u32) -> Self {
        let (samples, effects) = (Samples::REST, EffectSet::Named(0));
        Self { timing, time_ms, lasts_ms: time_ms, samples, effects }
    }

    /// The same for a frame that takes so many milliseconds, whatever its Time says.
    #[must_use]
    pub const fn lasting(self, lasts_ms: u32) -> Self {
        Self { lasts_ms, ..self }
    }
}

/// What a tick does.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "it is made and used up on one stack, every tick")]
pub enum Step {
    /// Frames go out.
    Send(Beat),
    /// None does: the lanes rest, and have been told so.
    Quiet,
    /// The play has ended.
    Over,
}

/// Why lanes rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rest {
    /// Frames stopped for too long; the film runs on.
    Late,
    /// The film that is chased can be followed, and the way onto the cue is not known yet.
    Film,
    /// The cue is over, and the way on from there not known yet.
    Ended,
    /// Somebody, or the hall's policy, asked for a pause; the film waits.
    Paused,
    /// Somebody, or a fault, stopped the show: no frames go out.
    Stopped,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Loaded, and nobody has let it go: no frame goes out.
    Waiting,
    /// Repeats the park pose once, so that no motion hangs on how a controller times its first absolute frame.
    Settling,
    /// On a course that leads onto the cue.
    Riding,
    /// Coming to rest.
    Braking(Rest),
    /// Holds the last poses until a course leads on.
    Resting(Rest),
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
    /// No level goes beyond it: the cue was proved at no higher one.
    greatest_level: f64,
    riders: Vec<Rider>,
    hint: Hint,
    phase: Phase,
    ending: Ending,
    course: Box<Course>,
    switch: Option<Switch>,
    /// What was to follow the end of the cue, while something else is asked for.
    spare: Option<Switch>,
    scenes: Scenes,
    retired: Retired,
    serial: u32,
    plays_left: Option<u32>,
    /// What the hall wants.
    directive: Directive,
    /// Where in the cue the show is to go on.
    seeking: Option<ShowTime>,
    /// Where in the cue the film that is chased wants the next frame to lead.
    target: Option<ShowTime>,
    /// Whether a seek could not be planned, and nobody was told yet.
    seek_refused: bool,
    /// Whether a move that the show needs could not be planned.
    planless: bool,
    /// How much later than the film the motion is to be, milliseconds.
    trim_ms: i32,
    /// Answers of the planner in a row that came too late.
    late_answers: u32,
    frames: u64,
    holds: Holds,
    /// The show time of the next tick.
    playhead: ShowTime,
    /// The show time of the pose sent last.
    reached: ShowTime,
    slew: Slew,
    stamps: Stamps,
}

impl Engine {
    /// An engine of which nobody has told where its lanes stand, at the levels of their windows; `course` begins at the show's
    /// start with those that are found at park ([`Engine::found`]).
    #[must_use]
    pub fn new(
        show: Show,
        timeline: Arc<Timeline>,
        headroom: Headroom,
        windows: Vec<Window>,
        course: Box<Course>,
    ) -> Self {
        let levels = windows.iter().map(Window::level);
        Self {
            greatest_level: levels.fold(headroom.greatest_level(), f64::max),
            scenes: Scenes::like(&Scene::parked(&windows)),
            riders: windows.into_iter().map(|window| Rider::unseen(window, show.rate)).collect(),
            hint: Hint::default(),
            phase: first_phase(&show),
            ending: Ending::Completed,
            switch: None,
            spare: None,
            retired: Retired::default(),
            serial: course.serial,
            plays_left: show.plays.checked_sub(1),
            directive: Directive::Off,
            seeking: None,
            target: None,
            seek_refused: false,
            planless: false,
            trim_ms: 0,
            late_answers: 0,
            frames: 0,
            holds: Holds::new(show.rate),
            playhead: show.start,
            reached: show.start,
            slew: Slew::new(show.rate),
            stamps: Stamps::new(show.timing),
            show,
            timeline,
            headroom,
            course,
        }
    }

    /// Whether this tick sends a lane a frame, if it sends any.
    #[must_use]
    pub fn gets_a_frame(&self, lane: usize) -> bool {
        self.riders[lane].gets_a_frame()
    }

    /// Where a lane's frame leads, as fractions of each slot's stroke.
    #[must_use]
    pub fn pose(&self, lane: usize) -> &Pose {
        self.riders[lane].pose()
    }

    /// What a lane's frame leaves of vibration and effects.
    #[must_use]
    pub fn mix_of(&self, lane: usize) -> Mix {
        self.riders[lane].mix()
    }

    /// Whether frames lead a lane, be it to rest.
    #[must_use]
    pub fn is_led(&self, lane: usize) -> bool {
        self.riders[lane].is_there() && !self.is_at_rest()
    }

    /// Whether nobody knows which frames reach a lane: its frames come from [`Engine::slow_down`] alone.
    #[must_use]
    pub fn is_blind(&self, lane: usize) -> bool {
        self.riders[lane].is_blind()
    }

    /// Sets the pose of a lane that is blind one step further towards its rest, `farthest` being how far each slot may be from
    /// its present one. Says how long that takes, `longest_ms` at the most; none where nothing goes to the lane any more.
    pub fn slow_down(&mut self, lane: usize, longest_ms: u32, farthest: &Pose) -> Option<u32> {
        self.riders[lane].slow_down(self.frames - 1, self.show.rate, longest_ms, farthest)
    }

    /// A lane that has just fallen out, and is to be looked at, and why; each is said once.
    pub fn take_fallen(&mut self) -> Option<(usize, Fall)> {
        let mut riders = self.riders.iter_mut().enumerate();
        riders.find_map(|(lane, rider)| rider.take_fall().map(|fall| (lane, fall)))
    }

    /// True if a lane is led, or would be if it were seen.
    #[must_use]
    pub fn takes_part(&self, lane: usize) -> bool {
        self.riders[lane].is_there() || self.is_unseen(lane)
    }

    /// True if a lane is to take part that nobody has told of where it stands.
    #[must_use]
    pub fn is_unseen(&self, lane: usize) -> bool {
        let rider = &self.riders[lane];
        rider.part == Part::Unseen && rider.wanted.on
    }

    /// True if nothing is sent until the hall asks for the way on: the show has not begun, or lanes rest in a pause and have been
    /// told so.
    #[must_use]
    pub fn waits(&self) -> bool {
        let goes_on = matches!(self.directive, Directive::Play | Directive::Park);
        let rests = matches!(self.phase, Phase::Resting(Rest::Paused)) && self.sends_nothing() && !goes_on;
        rests || self.phase == Phase::Waiting
    }

    /// Whether no frame has led any lane since all rested.
    fn is_at_rest(&self) -> bool {
        self.sends_nothing() || self.frames == 0
    }

    /// The pose that a lane was sent last, or in which it was found since; none where nothing goes to it.
    #[must_use]
    pub fn rests_at(&self, lane: usize) -> Option<&Pose> {
        let rider = &self.riders[lane];
        (rider.is_there() && self.is_at_rest()).then(|| rider.pose())
    }

    /// The show time of the next tick: where in the cue the lanes are.
    #[must_use]
    pub const fn playhead(&self) -> ShowTime {
        self.playhead
    }

    /// Where the film is: what the playhead will be at once all lag and trim are slewed in, and the trim.
    #[must_use]
    pub fn film(&self) -> ShowTime {
        let ahead = self.slew.owed_s() + f64::from(self.trim_ms) * 1e-3;
        ShowTime::from_nanos(self.playhead.as_nanos() + ShowTime::from_secs_f64(ahead).as_nanos())
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

    /// Whether the lanes have left the cue for park, at its end, or are there.
    #[must_use]
    pub const fn is_homeward(&self) -> bool {
        matches!(self.phase, Phase::Parking | Phase::Closing(_) | Phase::Done)
    }

    /// Whether the lanes are to park, come what may.
    fn is_to_park(&self) -> bool {
        self.directive == Directive::Park
    }

    /// Why the lanes rest, or come to rest; none where they do not.
    #[must_use]
    pub const fn rest(&self) -> Option<Rest> {
        match self.phase {
            Phase::Braking(rest) | Phase::Resting(rest) => Some(rest),
            _ => None,
        }
    }

    /// Whether the lanes were stopped, rest, and have been told so.
    #[must_use]
    pub fn is_told_to_rest(&self) -> bool {
        match self.phase {
            Phase::Resting(Rest::Stopped) => self.is_told(),
            Phase::Done => true,
            _ => false,
        }
    }

    /// Whether all lanes follow the cue that take part, and nobody waits for them elsewhere.
    #[must_use]
    pub fn is_on_cue(&self) -> bool {
        self.phase == Phase::Riding && !self.is_joining() && self.seeking.is_none()
    }

    /// Serves one tick: sets the poses and says what their frames carry.
    pub fn tick(&mut self, missed: u64) -> Step {
        self.count_missed(missed);
        self.riders.iter_mut().for_each(|rider| rider.pass(missed));
        if matches!(self.phase, Phase::Closing(0) | Phase::Done) {
            self.phase = Phase::Done;
            self.riders
                .iter_mut()
                .filter(|rider| rider.is_blind())
                .for_each(|rider| rider.fall_out(Fall::Gap));
            return Step::Over;
        }
        if self.phase == Phase::Waiting {
            return Step::Quiet;
        }
        let time_ms = self.show.rate.time_ms(self.frames);
        self.frames += 1;
        self.take_target(millis(time_ms));
        let show = self.playhead;
        self.move_on(millis(time_ms));
        if let Phase::Resting(rest) = self.phase {
            self.look_ahead();
            return self.hold(rest, time_ms);
        }
        let (timing, stamp_ms) = self.stamps.next(time_ms);
        let mut beat = Beat::still(timing, stamp_ms).lasting(time_ms);
        if self.phase == Phase::Riding {
            // They act when the frame comes, not when its pose is reached.
            beat.samples = self.timeline.samples(show, &mut self.hint);
            beat.effects = self.timeline.effects(show, &mut self.hint);
        }
        self.look_ahead();
        Step::Send(beat)
    }

    /// Advances show time by one frame and sets the poses.
    fn move_on(&mut self, time: Duration) {
        match self.phase {
            Phase::Settling => {
                self.phase = Phase::Riding;
                return;
            }
            Phase::Closing(left) => return self.close(left),
            Phase::Waiting | Phase::Done => return,
            Phase::Resting(Rest::Late | Rest::Film) => self.playhead += time,
            // The film waits from the very request on.
            Phase::Braking(_) | Phase::Resting(_) => {}
            Phase::Riding | Phase::Parking => {
                self.fade(time);
                let passed = self.pass(time);
                self.playhead += passed;
            }
        }
        // Before the poses: one past the change of course is the new course's.
        self.take_switch(time);
        self.end_the_cue();
        self.set_poses(time);
        self.come_to_rest();
        if let Phase::Closing(left) = self.phase {
            self.close(left);
        }
    }

    fn set_poses(&mut self, time: Duration) {
        self.reached = self.playhead;
        let index = self.frames - 1;
        let cue = self.timeline.sample(self.reached, &mut self.hint);
        // The frames of one that is blind are made as they leave, from what is known by then.
        let led = |rider: &Rider| rider.is_there() && !rider.is_blind();
        let riders = self.riders.iter_mut().enumerate().filter(|(_, rider)| led(rider));
        for (lane, rider) in riders {
            let pose = rider.next(lane, time, &mut self.course, self.reached, &cue);
            rider.send(index, time, pose);
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

/// What the first frame does.
fn first_phase(show: &Show) -> Phase {
    let settles = show.timing == Timing::Absolute && show.rate.period() > millis(FIRST_ABSOLUTE_MS);
    if settles { Phase::Settling } else { Phase::Riding }
}

const fn millis(ms: u32) -> Duration {
    Duration::from_millis(ms as u64)
}
