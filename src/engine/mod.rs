//! The life of a play, tick by tick: where show time stands, which course the lanes follow, and what each frame says.
//! Tick thread; told the time, never asks; allocates nothing.

mod ahead;
mod beat;
mod between;
mod blind;
mod cue_ahead;
mod directive;
mod events;
mod fader;
mod headroom;
mod hold;
mod lane;
mod lane_plans;
mod lanes;
mod mix;
mod orders;
mod phase;
mod playhead;
mod replan;
mod slew;
mod stamps;
mod trail;

pub(crate) use beat::Beat;
pub use beat::Step;
pub(crate) use directive::Directive;
pub use events::Unplanned;
pub(crate) use events::{EngineEvent, EngineEvents};
pub use headroom::Headroom;
pub(crate) use lanes::LaneOrder;
pub use mix::Mix;
pub(crate) use phase::Rest;
pub(crate) use playhead::Playhead;
pub(crate) use slew::{MAX_SPEED_UP, Slewing};

use std::sync::Arc;
use std::time::Duration;

use crate::motion::Window;
use crate::plan::{Course, Scene};
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;
use crate::wire::Timing;
use cue_ahead::CueAhead;
use lanes::Lanes;
use phase::{Following, Holding, Phase};
use replan::Replanner;
use stamps::Stamps;

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
    /// The kind of Time that the frames carry.
    pub timing: Timing,
    /// Show time of tick 0.
    pub start: ShowTime,
    /// Number of plays; 0 plays until stopped.
    pub plays: u32,
}

/// How far a play is: a level, which nobody can miss.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PlayProgress {
    /// Nobody has let it go.
    Waiting,
    /// The lanes are on their way onto the cue, or somebody waits for them elsewhere.
    Joining,
    /// All lanes that take part follow the cue.
    OnCue,
    /// The lanes rest, or come to rest.
    Resting {
        /// Why.
        why: Rest,
        /// True if they do rest, and have been told so, and no frame goes out.
        told: bool,
    },
    /// The lanes have left the cue for park, at its end, or are there.
    Homeward,
    /// It has ended.
    Over(Ending),
}

/// The engine of one play.
#[derive(Debug)]
pub struct Engine {
    show: Show,
    timeline: Arc<Timeline>,
    headroom: Headroom,
    lanes: Lanes,
    cues: Box<[CueAhead]>,
    phase: Phase,
    ending: Ending,
    planner: Replanner,
    plays_left: Option<u32>,
    /// What the hall wants.
    directive: Directive,
    playhead: Playhead,
    stamps: Stamps,
}

impl Engine {
    /// An engine of which nobody has told where its lanes stand, at the levels of their windows; `course` begins at the show's
    /// start with those that are found at park ([`Engine::found`]).
    #[must_use]
    pub(crate) fn new(
        show: Show,
        timeline: Arc<Timeline>,
        headroom: Headroom,
        windows: Vec<Window>,
        course: Box<Course>,
    ) -> Self {
        Self {
            planner: Replanner::new(&Scene::parked(&windows), course.serial),
            cues: CueAhead::each(&windows),
            lanes: Lanes::unseen(windows, headroom.greatest_level(), show.rate),
            phase: Phase::first(&show, course),
            ending: Ending::Completed,
            plays_left: show.plays.checked_sub(1),
            directive: Directive::Off,
            playhead: Playhead::new(show.rate, show.start, headroom.slewing()),
            stamps: Stamps::new(show.timing),
            show,
            timeline,
            headroom,
        }
    }

    /// True if nothing is sent until the hall asks for the way on: the show has not begun, or lanes rest in a pause and have been
    /// told so.
    #[must_use]
    pub(crate) fn waits(&self) -> bool {
        let goes_on = matches!(self.directive, Directive::Play | Directive::Park);
        let is_paused = matches!(self.phase, Phase::Holding(Holding { why: Rest::Paused, .. }));
        (is_paused && self.sends_nothing() && !goes_on) || matches!(self.phase, Phase::Waiting(_))
    }

    /// Where in the cue the lanes are, and where the film is.
    #[must_use]
    pub const fn playhead(&self) -> &Playhead {
        &self.playhead
    }

    /// Where the film is: whoever seeks has it there already, though the seats come there a moment later.
    #[must_use]
    pub(crate) fn film(&self) -> ShowTime {
        self.planner.sought.map_or_else(|| self.playhead.film(), |cue| self.playhead.film_at(cue))
    }

    /// How far it is.
    #[must_use]
    pub(crate) fn progress(&self) -> PlayProgress {
        match &self.phase {
            Phase::Waiting(_) => PlayProgress::Waiting,
            Phase::Following(Following { course, .. })
                if self.playhead.reached() >= course.settled() && self.planner.sought.is_none() =>
            {
                PlayProgress::OnCue
            }
            Phase::Settling(_) | Phase::Following(_) => PlayProgress::Joining,
            Phase::Braking(why) => PlayProgress::Resting { why: *why, told: false },
            Phase::Holding(Holding { why, .. }) => {
                PlayProgress::Resting { why: *why, told: self.sends_nothing() }
            }
            Phase::Parking(_) | Phase::Closing(..) => PlayProgress::Homeward,
            Phase::Done => PlayProgress::Over(self.ending),
        }
    }

    /// Whether any seat is on the cue.
    pub(crate) fn is_any_on_cue(&self) -> bool {
        let at = self.playhead.reached();
        matches!(&self.phase, Phase::Following(Following { course, .. }) if self.lanes.is_any_on_cue(course, at))
    }

    /// What happened, to be taken every tick.
    pub(crate) fn events(&mut self) -> &mut EngineEvents {
        self.lanes.note_arrivals(self.phase.course(), self.playhead.reached());
        &mut self.lanes.events
    }

    /// Serves one tick after so many that were missed: sets the poses and says what their frames carry. A film that is chased wants
    /// this frame to lead to `target` in the cue, as often as it can be followed.
    pub fn tick(&mut self, missed: u64, target: Option<ShowTime>) -> Step {
        self.count_missed(missed);
        self.lanes.all.iter_mut().for_each(|motion| motion.pass(missed));
        match self.phase {
            Phase::Closing(_, 0) | Phase::Done => {
                self.enter(Phase::Done);
                self.lanes.drop_blind();
                return Step::Over;
            }
            Phase::Waiting(_) => return Step::Quiet,
            _ => {}
        }
        // Counted even where nothing is sent: by their number whole milliseconds keep to the grid.
        let time_ms = self.playhead.next_frame();
        let time = millis(time_ms);
        target.into_iter().for_each(|target| self.chase(target, time));
        let show = self.playhead.at();
        self.move_on(time);
        let is_held = matches!(self.phase, Phase::Holding(_));
        let is_quiet = is_held && self.sends_nothing();
        // Channels and effects act when the frame comes, not when its pose is reached.
        let says = self.phase.is_following().then_some(show);
        self.look_ahead();
        if is_quiet {
            return Step::Quiet;
        }
        if is_held {
            self.count_hold();
        }
        let (timing, stamp_ms) = self.stamps.next(time_ms);
        let still = Beat::still(timing, stamp_ms).lasting(time_ms);
        self.cues.iter_mut().for_each(|cue| cue.fill(&still, &self.timeline, says));
        Step::Send
    }

    /// The beat of this tick as a lane has it: the cue's channels and effects are those of so much later as it is led ahead.
    #[must_use]
    pub(crate) fn beat_of(&self, lane: usize) -> &Beat {
        &CueAhead::of(&self.cues, self.lanes.all[lane].window.lead()).beat
    }

    /// Advances show time by one frame and sets the poses.
    fn move_on(&mut self, time: Duration) {
        match &self.phase {
            Phase::Settling(_) => {
                self.phase.carry(|course| Phase::Following(Following::on(course)));
                return;
            }
            Phase::Closing(..) => return self.close(),
            Phase::Waiting(_) | Phase::Done => return,
            // The film runs on: these lanes join it where it is by then.
            Phase::Holding(Holding { why: Rest::Late | Rest::Film, .. })
                if self.directive != Directive::HoldBriefly =>
            {
                self.playhead.run(time);
            }
            // The film waits from the very request on, and one that has jumped is nowhere yet.
            Phase::Braking(_) | Phase::Holding(_) => {}
            Phase::Following(_) | Phase::Parking(_) => {
                self.fade(time);
                self.pass(time);
            }
        }
        // Before the poses: one past the change of course is the new course's.
        self.take_due(time);
        // After what is due: lanes that have just been led on are not at the end any more.
        self.end_the_cue();
        self.set_poses(time);
        // After the poses: the last one of a brake is sent before frames that hold it are counted.
        self.come_to_rest();
        self.close();
    }

    fn set_poses(&mut self, time: Duration) {
        let at = self.playhead.reach();
        self.cues.iter_mut().for_each(|cue| cue.reach(&self.timeline, at));
        self.lanes.advance((self.playhead.frames() - 1, time), self.phase.course(), at, &self.cues);
    }

    /// Counts a hold frame at the end.
    fn close(&mut self) {
        let Phase::Closing(_, left) = &mut self.phase else { return };
        *left -= 1;
        if *left == 0 {
            self.stamps.break_off(); // whoever plays next starts its sum after a relative frame
        }
    }
}

const fn millis(ms: u32) -> Duration {
    Duration::from_millis(ms as u64)
}
