//! Changes of course: when one is needed, what the planner is asked for, and what becomes of its answer.

use std::time::Duration;

use super::events::{EngineEvent, Unplanned};
use super::lane::LaneMotion;
use super::phase::{Following, Phase, Rest};
use super::playhead::FramePace;
use super::replan::{Goal, Planned, Replan};
use super::{Directive, Ending, Engine};
use crate::plan::{Course, From, Request, Scene};
use crate::time::ShowTime;

/// A lag beyond this, and beyond one period, is not slewed away: the lanes hold, then join.
const LAG_HOLD: Duration = Duration::from_millis(50);

impl Engine {
    /// A few missed ticks leave a lag that is slewed away; after too many the lanes hold, then go on from rest.
    pub(super) fn count_missed(&mut self, missed: u64) {
        // Of a show that begins with this tick nothing was missed.
        if self.playhead.frames() == 0 {
            return;
        }
        let gap = self.show.rate.offset(missed);
        match (&self.phase, self.phase.rest()) {
            (Phase::Holding(_), Some(Rest::Late | Rest::Film)) if missed > 0 => {
                // A course that was to begin in the gap would be taken up in its middle.
                self.give_up_replans();
                self.playhead.run(gap);
            }
            (Phase::Braking(why), _) if self.is_too_long(gap) => self.halt(*why),
            // The last frame has run out, so seats stand: to go on at speed would be a jump for them.
            (Phase::Following(_) | Phase::Parking(_), _) if self.is_too_long(gap) => {
                self.playhead.catch_up();
                self.playhead.run(gap);
                self.halt(Rest::Late);
            }
            // Others than those that follow have no film to fall behind: what they do is only later.
            (Phase::Following(_), _) => self.playhead.miss(gap),
            _ => {}
        }
    }

    /// Whether a gap or a lag is more than can be slewed away.
    fn is_too_long(&self, span: Duration) -> bool {
        // Below 20 Hz one tick alone is longer than that, and is slewed as any other.
        span > LAG_HOLD && span > self.show.rate.period()
    }

    /// Lets show time pass by a frame.
    pub(super) fn pass(&mut self, time: Duration) {
        let (now, reached) = (self.playhead.at(), self.playhead.reached());
        let is_wanted_elsewhere = self.is_wanted_elsewhere();
        let Self { phase, playhead, headroom, lanes, .. } = self;
        let ends_within = || headroom.slewing().ends_within();
        playhead.pass(time, || match phase {
            // The planner was told that pace: its course begins with what that makes of the motion.
            Phase::Following(Following { next: Some(next), .. }) if next.pace != 1.0 => FramePace::Kept,
            // That course was planned from the clock's pace, which has to be back before it begins.
            Phase::Following(Following { next: Some(next), .. }) if next.is_near(now + ends_within()) => {
                FramePace::Within(0.0)
            }
            // A join may meet a cue that leaves nothing; what the cue leaves later on says nothing of the move before.
            Phase::Following(Following { course, .. })
                if !is_wanted_elsewhere && reached >= course.settled() =>
            {
                // By the highest level: all share one show time, and that lane has the least room.
                FramePace::Within(headroom.pace(now, lanes.level(), lanes.may_shake()))
            }
            _ => FramePace::Within(0.0),
        });
    }

    /// Asks for the course that the present state will need, if it needs one.
    pub(super) fn look_ahead(&mut self) {
        let soonest = self.playhead.at() + self.planner.lead(self.show.rate);
        match &self.phase {
            Phase::Parking(course) if self.playhead.reached() >= course.settled() => self.arrive(),
            Phase::Holding(holding) if holding.next.is_none() => {
                self.look_ahead_at_rest(holding.why, soonest);
            }
            Phase::Following(following) => {
                if let Some((goal, at, start)) = self.need(following, soonest) {
                    self.ask(goal, Some(at), start);
                }
            }
            _ => {}
        }
    }

    /// The lanes on the course are at park. One that fell out on the way is waited for there, and led after them.
    fn arrive(&mut self) {
        if self.lanes.all.iter().any(LaneMotion::is_left_behind) {
            self.come_down(Rest::Ended);
        } else if !self.lanes.all.iter().any(LaneMotion::is_awaited) {
            let frames = self.hold_frames();
            self.phase.carry(|course| Phase::Closing(course, frames));
        }
    }

    /// Whether somebody waits for lanes to leave their course.
    pub(super) fn is_wanted_elsewhere(&self) -> bool {
        self.is_to_park() || self.planner.sought.is_some() || self.lanes_need_a_course()
    }

    /// Once the cue is over the way to park waits for nobody: it leads those as well that are elsewhere.
    fn lanes_need_a_course(&self) -> bool {
        self.playhead.at() < self.timeline.duration() && self.lanes.all.iter().any(LaneMotion::needs_a_course)
    }

    /// The show time at which the lanes have followed the cue to its end.
    pub(super) fn end_of_cue(&self, following: &Following) -> ShowTime {
        self.timeline.duration().max(following.course.settled())
    }

    fn look_ahead_at_rest(&mut self, why: Rest, soonest: ShowTime) {
        let now = self.playhead.at();
        match why {
            Rest::Stopped if self.is_parked_untold() => self.enter(Phase::Done),
            _ if self.is_to_park() => self.ask(Goal::Park, None, now),
            // A film that is chased is joined once it can be followed, and has reached the cue.
            Rest::Film if self.directive == Directive::HoldBriefly || soonest < ShowTime::ZERO => {}
            Rest::Late | Rest::Film => self.ask(Goal::Cue, Some(soonest), soonest),
            Rest::Ended if self.plays_left == Some(0) => self.ask(Goal::Home, None, now),
            Rest::Ended => self.ask(Goal::Again, None, self.playhead.cue_time(ShowTime::ZERO)),
            Rest::Paused if self.directive == Directive::Play => self.ask(Goal::Cue, None, now),
            Rest::Paused | Rest::Stopped => {}
        }
    }

    /// What lanes that follow will need: the goal, when, and where the course begins.
    fn need(&self, following: &Following, soonest: ShowTime) -> Option<(Goal, ShowTime, ShowTime)> {
        let asked = following.next.as_ref().map(|next| next.goal);
        let now = self.playhead.at();
        let turns = |replan: &Replan| replan.at.is_some_and(|at| (now..=soonest).contains(&at));
        if (self.is_to_park() && asked == Some(Goal::Park))
            // The old course ends before another can begin on it: what is to come begins on the one that follows.
            || following.replans().any(turns)
            // A course is planned for levels that stand, and for show time that runs as the clock does.
            || self.lanes.all.iter().any(|motion| !motion.fader.is_still())
            || (self.is_wanted_elsewhere() && !self.playhead.is_calm())
        {
            return None;
        }
        // In this order: who parks leaves all else, a person's seek goes before the machine's
        // lag, and both before single lanes, whose course would have to be made anew.
        let need = if self.is_to_park() {
            (Goal::Park, soonest, soonest)
        } else if let Some(target) = self.planner.sought {
            (Goal::Cue, soonest, target)
        } else if self.is_too_long(self.playhead.lag()) {
            // Many small gaps: the lanes are moving, so they join from the lagging cue onto the true one.
            (Goal::Cue, soonest, soonest + self.playhead.owed())
        } else if asked.is_none_or(Goal::is_after_the_end) && self.lanes_need_a_course() {
            (Goal::Lanes, soonest, soonest)
        } else if asked.is_some() {
            return None;
        } else {
            // What follows the end is known all along, so that the planner has all the time there is.
            let end = self.end_of_cue(following).max(soonest);
            match self.plays_left {
                Some(0) => (Goal::Home, end, end),
                _ => (Goal::Again, end, self.playhead.cue_time(ShowTime::ZERO)),
            }
        };
        // A way onto the cue is asked for once: asked anew each tick it would never be planned to its end.
        (asked != Some(need.0) || need.0 != Goal::Cue).then_some(need)
    }

    /// Asks for a course that takes over when show time, as it runs now, is `at`, and calls that instant `start`.
    fn ask(&mut self, goal: Goal, at: Option<ShowTime>, start: ShowTime) {
        // Without a scene the planner still has all of them: it will be asked once it has answered.
        let Some(mut scene) = self.planner.scenes.take() else { return };
        self.lanes.describe(&mut scene);
        // Given the time, the pace is brought back to the clock's; at short notice it is kept.
        let slowing = self.headroom.slewing().ends_within();
        let far = at.is_none_or(|at| at > self.playhead.at() + slowing);
        let pace = if far { 1.0 } else { self.playhead.pace() };
        let from = match (&self.phase, at) {
            (Phase::Following(Following { course, .. }), Some(at)) => {
                From::Course { serial: course.serial, at, pace }
            }
            _ => From::Rest,
        };
        self.planner.serial = self.planner.serial.wrapping_add(1);
        let serial = self.planner.serial;
        let planned = Planned::Asked(Request { from, to: goal.to(), start, serial, scene });
        let given_up = self.phase.set_next(Replan { goal, at, start, pace, serial, planned });
        given_up.into_iter().flatten().for_each(|replan| self.planner.give_up(replan));
    }

    /// The request that the planner has not seen yet.
    pub(crate) fn take_request(&mut self) -> Option<Request> {
        self.phase.next()?.as_mut()?.take_request()
    }

    /// Hands over a course that the planner made, and the scene it made it for. One that nobody waits for any more, or
    /// that came after its time, is not taken up.
    pub(crate) fn offer(&mut self, course: Box<Course>, scene: Box<Scene>) {
        let now = self.playhead.at();
        if let Some(next) = self.phase.next()
            && let Some(replan) = next.as_mut().filter(|next| next.serial == course.serial)
        {
            if replan.is_open(now) {
                replan.planned = Planned::Ready(course, scene);
                return;
            }
            *next = None; // asked again, with more time, at this tick's end
            self.planner.late_answers += 1;
        }
        self.planner.retired.put(course);
        self.planner.scenes.put(scene);
    }

    /// Hears that the planner found no course for the request of that serial. A seek is not done then, and a lane stays out;
    /// without any other move the show cannot go on.
    pub(crate) fn refuse(&mut self, serial: u32, scene: Box<Scene>) {
        self.planner.scenes.put(scene);
        let next = self.phase.next().and_then(|next| next.take_if(|next| next.serial == serial));
        match next.map(|next| next.goal) {
            None => {}
            Some(Goal::Lanes) => self.lanes.refuse(),
            Some(Goal::Cue) if self.planner.sought.take().is_some() => {
                self.lanes.events.push(EngineEvent::Unplanned(Unplanned::Seek));
            }
            Some(Goal::Cue | Goal::Again | Goal::Park | Goal::Home) => {
                self.ending = Ending::Fault;
                self.lanes.events.push(EngineEvent::NoMove);
            }
        }
    }

    /// A course that is to be freed on another thread.
    pub(crate) fn take_retired(&mut self) -> Option<Box<Course>> {
        self.planner.retired.take()
    }

    /// Takes up the new course when its time has come; `time` is that of this frame.
    pub(super) fn take_due(&mut self, time: Duration) {
        let now = self.playhead.at();
        let Some(replan) = self.phase.take_due(now) else { return };
        let (goal, nearer) = (replan.goal, replan.skips());
        // The frame that passes the change is as far into the new course as it is past it.
        let over = replan.at.map_or(time, |at| Duration::from_nanos(now.as_nanos().abs_diff(at.as_nanos())));
        let to = replan.start + over;
        let Planned::Ready(course, scene) = replan.planned else { return };
        self.lanes.take_up(&scene);
        self.planner.scenes.put(scene);
        self.planner.late_answers = 0;
        match goal {
            Goal::Lanes => self.playhead.set(to),
            // Elsewhere in the film no lag of before is left to be taken back.
            Goal::Cue if self.planner.sought.take().is_some() => self.playhead.restart(to),
            Goal::Cue => self.playhead.skip(to, nearer),
            Goal::Again => {
                self.playhead.skip(to, ShowTime::ZERO);
                self.plays_left = self.plays_left.map(|left| left.saturating_sub(1));
            }
            Goal::Home | Goal::Park => self.playhead.skip(to, ShowTime::ZERO),
        }
        let stays = course.settled() <= course.start && !self.lanes.all.iter().any(LaneMotion::is_missing);
        let holds = self.hold_frames();
        self.enter(match goal {
            Goal::Home | Goal::Park if stays => Phase::Closing(course, holds),
            Goal::Home | Goal::Park => Phase::Parking(course),
            Goal::Again | Goal::Cue | Goal::Lanes => Phase::Following(Following::on(course)),
        });
    }
}
