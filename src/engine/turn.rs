//! Changes of course: when one is needed, what the planner is asked for, and what becomes of its answer.

use std::time::Duration;

use super::switch::{Goal, Switch};
use super::{Directive, Ending, Engine, Phase, Rest, Rider, hold_frames};
use crate::plan::{Course, From, Request, Scene, To};
use crate::time::ShowTime;

/// A lag beyond this, and beyond one period, is not slewed away: the lanes hold, then join.
const LAG_HOLD: Duration = Duration::from_millis(50);
/// A course is asked for at least this long before it is to begin, and at least two ticks.
const LEAD: Duration = Duration::from_millis(20);
/// In this time show time surely comes back to the pace of the clock.
const SLOWING: Duration = Duration::from_millis(150);

impl Engine {
    /// A few missed ticks leave a lag that is slewed away; after too many the lanes hold, then go on from rest.
    pub(super) fn count_missed(&mut self, missed: u64) {
        let gap = self.show.rate.offset(missed);
        match self.phase {
            Phase::Resting(Rest::Late | Rest::Film) if missed > 0 => {
                // A course that was to begin in the gap would be taken up in its middle.
                self.drop_switch();
                self.playhead += gap;
            }
            Phase::Braking(rest) if self.is_too_long(gap) => self.halt(rest),
            Phase::Riding | Phase::Parking if self.is_too_long(gap) => {
                self.catch_up();
                self.playhead += gap;
                self.halt(Rest::Late);
            }
            Phase::Riding => self.slew.fall_behind(gap),
            _ => {}
        }
    }

    /// The controllers reached the last poses and stand there.
    pub(super) fn halt(&mut self, rest: Rest) {
        self.stamps.break_off();
        self.drop_switch();
        self.riders.iter_mut().for_each(Rider::halt);
        self.holds.begin();
        self.phase = Phase::Resting(rest);
    }

    /// Whether a gap or a lag is more than can be slewed away.
    fn is_too_long(&self, span: Duration) -> bool {
        span > LAG_HOLD && span > self.show.rate.period()
    }

    /// How much show time passes in a frame of that Time.
    pub(super) fn pass(&mut self, time: Duration) -> Duration {
        if self.slew.is_done() && self.slew.is_calm() {
            return time;
        }
        match (self.phase, &self.switch) {
            (Phase::Riding, Some(switch)) if switch.pace != 1.0 => self.slew.coast(time),
            (Phase::Riding, Some(switch)) if switch.is_near(self.playhead + SLOWING) => {
                self.slew.advance(time, 0.0)
            }
            // A join may meet a cue that leaves nothing; what the cue leaves later on says nothing of the move before.
            (Phase::Riding, _) if self.is_wanted_elsewhere() || self.reached < self.course.settled() => {
                self.slew.advance(time, 0.0)
            }
            (Phase::Riding, _) => {
                let level = self.riders.iter().map(|rider| rider.fader.level()).fold(0.0, f64::max);
                self.slew.advance(time, self.headroom.pace(self.playhead, level))
            }
            _ => self.slew.advance(time, 0.0),
        }
    }

    /// Asks for the course that the present state will need, if it needs one.
    pub(super) fn look_ahead(&mut self) {
        let asked = self.switch.as_ref().map(|switch| switch.goal);
        let soonest = self.playhead + self.lead();
        match self.phase {
            Phase::Parking if self.reached >= self.course.settled() => self.arrive(),
            Phase::Resting(rest) if asked.is_none() => self.look_ahead_at_rest(rest, soonest),
            Phase::Riding if self.is_to_park() && asked == Some(Goal::Park) => {}
            // The old course ends before another can begin on it: what is to come begins on the one that follows.
            Phase::Riding if self.turns_between(self.playhead, soonest) => {}
            // A course is planned for levels that stand, and for show time that runs as the clock does.
            Phase::Riding if !self.faders_are_still() => {}
            Phase::Riding if self.is_wanted_elsewhere() && !self.slew.is_calm() => {}
            Phase::Riding if self.is_to_park() => self.ask(Goal::Park, Some(soonest), soonest),
            Phase::Riding => self.look_ahead_riding(asked, soonest),
            _ => {}
        }
    }

    /// The lanes on the course are at park. One that fell out on the way is waited for there, and led after them.
    fn arrive(&mut self) {
        if self.riders.iter().any(Rider::is_left_behind) {
            self.come_down(Rest::Ended);
        } else if !self.riders.iter().any(Rider::is_awaited) {
            self.phase = Phase::Closing(hold_frames(self.show.rate));
        }
    }

    /// Whether somebody waits for lanes to leave their course.
    pub(super) fn is_wanted_elsewhere(&self) -> bool {
        self.is_to_park() || self.seeking.is_some() || self.lanes_need_a_course()
    }

    fn look_ahead_at_rest(&mut self, rest: Rest, soonest: ShowTime) {
        let now = self.playhead;
        match rest {
            Rest::Stopped if self.is_parked_untold() => self.phase = Phase::Done,
            _ if self.is_to_park() => self.ask(Goal::Park, None, now),
            // A film that is chased is joined once it has reached the cue.
            Rest::Film if soonest < ShowTime::ZERO => {}
            Rest::Late | Rest::Film => self.ask(Goal::Cue, Some(soonest), soonest),
            Rest::Ended if self.plays_left == Some(0) => self.ask(Goal::Home, None, now),
            Rest::Ended => self.ask(Goal::Again, None, self.cue_time(ShowTime::ZERO)),
            Rest::Paused if self.directive == Directive::Play => self.ask(Goal::Cue, None, now),
            Rest::Paused | Rest::Stopped => {}
        }
    }

    fn turns_between(&self, from: ShowTime, to: ShowTime) -> bool {
        let mut turns = self.switch.iter().chain(&self.spare).filter_map(|switch| switch.at);
        turns.any(|at| (from..=to).contains(&at))
    }

    fn look_ahead_riding(&mut self, asked: Option<Goal>, soonest: ShowTime) {
        let owed = Duration::from_secs_f64(self.slew.owed_s().max(0.0));
        if let Some(target) = self.seeking {
            if asked != Some(Goal::Cue) {
                self.ask(Goal::Cue, Some(soonest), target);
            }
        } else if self.is_too_long(self.slew.lag()) {
            if asked != Some(Goal::Cue) {
                // Many small gaps: the lanes are moving, so they join from the lagging cue onto the true one.
                self.ask(Goal::Cue, Some(soonest), soonest + owed);
            }
        } else if asked.is_none_or(Goal::is_after_the_end) && self.lanes_need_a_course() {
            self.ask(Goal::Lanes, Some(soonest), soonest);
        } else if asked.is_none() {
            // What follows the end is known all along, so that the planner has all the time there is.
            let end = self.end_of_cue().max(soonest);
            if self.plays_left == Some(0) {
                self.ask(Goal::Home, Some(end), end);
            } else {
                self.ask(Goal::Again, Some(end), self.cue_time(ShowTime::ZERO));
            }
        }
    }

    /// The show time at which the lanes have followed the cue to its end.
    pub(super) fn end_of_cue(&self) -> ShowTime {
        self.timeline.duration().max(self.course.settled())
    }

    /// Asks for a course that takes over when show time, as it runs now, is `at`, and calls that instant `start`.
    fn ask(&mut self, goal: Goal, at: Option<ShowTime>, start: ShowTime) {
        // Without a scene the planner still has all of them: it will be asked once it has answered.
        let Some(mut scene) = self.scenes.take() else { return };
        self.describe(&mut scene);
        // Should the planner be slow, and the cue end before its answer, the lanes go on as was planned for the end.
        let spare = if goal.is_after_the_end() {
            None
        } else {
            let after_the_end = |switch: &mut Switch| switch.goal.is_after_the_end();
            self.spare.take().or_else(|| self.switch.take_if(after_the_end))
        };
        self.drop_switch();
        self.spare = spare;
        // Given the time, the pace is brought back to the clock's; at short notice it is kept.
        let far = at.is_none_or(|at| at > self.playhead + SLOWING);
        let pace = if far { 1.0 } else { self.slew.pace() };
        let from = match (self.phase, at) {
            (Phase::Riding, Some(at)) => From::Course { serial: self.course.serial, at, pace },
            _ => From::Rest,
        };
        let to = match goal {
            Goal::Home | Goal::Park => To::Park,
            Goal::Cue | Goal::Again => To::Cue,
            Goal::Lanes => To::Same,
        };
        self.serial = self.serial.wrapping_add(1);
        let serial = self.serial;
        let request = Some(Request { from, to, start, serial, scene });
        let gained = at.filter(|_| goal == Goal::Cue).map_or(0, |at| start.as_nanos() - at.as_nanos());
        let skipped_s = ShowTime::from_nanos(gained).as_secs_f64();
        self.switch = Some(Switch { goal, at, start, pace, skipped_s, serial, request, course: None });
    }

    /// The request that the planner has not seen yet.
    pub fn take_request(&mut self) -> Option<Request> {
        self.switch.as_mut()?.request.take()
    }

    /// Hands over a course that the planner made, and the scene it made it for. One that nobody waits for any more, or
    /// that came after its time, is not taken up.
    pub fn offer(&mut self, course: Box<Course>, scene: Box<Scene>) {
        match &mut self.switch {
            Some(switch) if switch.serial == course.serial && switch.is_open(self.playhead) => {
                switch.course = Some((course, scene));
                return;
            }
            Some(switch) if switch.serial == course.serial => {
                self.late_answers += 1;
                self.switch = None; // asked again, with more time, at this tick's end
            }
            _ => {}
        }
        self.retired.put(Some(course));
        self.scenes.put(scene);
    }

    /// Hears that the planner found no course for the request of that serial. A seek is not done then, and a lane stays out;
    /// without any other move the show cannot go on.
    pub fn refuse(&mut self, serial: u32, scene: Box<Scene>) {
        self.scenes.put(scene);
        let Some(switch) = self.switch.take_if(|switch| switch.serial == serial) else { return };
        match switch.goal {
            Goal::Lanes => self.riders.iter_mut().for_each(Rider::refuse),
            Goal::Cue if self.seeking.take().is_some() => self.seek_refused = true,
            Goal::Cue | Goal::Again | Goal::Park | Goal::Home => {
                (self.ending, self.planless) = (Ending::Fault, true);
            }
        }
    }

    /// A course that is to be freed on another thread.
    pub fn take_retired(&mut self) -> Option<Box<Course>> {
        self.retired.take()
    }

    /// Takes up the new course when its time has come; `time` is that of this frame.
    pub(super) fn take_switch(&mut self, time: Duration) {
        let due =
            |switch: &mut Switch| switch.course.is_some() && switch.at.is_none_or(|at| self.playhead > at);
        let Some(mut switch) = self.switch.take_if(due).or_else(|| self.spare.take_if(due)) else { return };
        let Some((course, scene)) = switch.course.take() else { return };
        self.drop_switch();
        let over = switch
            .at
            .map_or(time, |at| Duration::from_nanos(self.playhead.as_nanos().abs_diff(at.as_nanos())));
        self.playhead = switch.start + over;
        for (rider, scene) in self.riders.iter_mut().zip(&scene.lanes) {
            rider.take_up(scene);
        }
        self.scenes.put(scene);
        self.late_answers = 0;
        match switch.goal {
            Goal::Lanes => {}
            Goal::Cue if self.seeking.take().is_some() => self.slew.reset(),
            Goal::Cue => self.slew.skip(switch.skipped_s),
            Goal::Again => {
                self.slew.skip(0.0);
                self.plays_left = self.plays_left.map(|left| left.saturating_sub(1));
            }
            Goal::Home | Goal::Park => self.slew.skip(0.0),
        }
        self.phase = match switch.goal {
            Goal::Home | Goal::Park
                if course.settled() <= course.start && !self.riders.iter().any(Rider::is_missing) =>
            {
                Phase::Closing(hold_frames(self.show.rate))
            }
            Goal::Home | Goal::Park => Phase::Parking,
            Goal::Again | Goal::Cue | Goal::Lanes => Phase::Riding,
        };
        let old = std::mem::replace(&mut self.course, course);
        self.retired.put(Some(old));
    }

    pub(super) fn drop_switch(&mut self) {
        for switch in [self.switch.take(), self.spare.take()].into_iter().flatten() {
            if let Some(request) = switch.request {
                self.scenes.put(request.scene);
            }
            if let Some((course, scene)) = switch.course {
                self.retired.put(Some(course));
                self.scenes.put(scene);
            }
        }
    }

    /// The time a planner is given: at least two ticks and 20 ms, twice as long after each answer that came too late.
    fn lead(&self) -> Duration {
        LEAD.max(2 * self.show.rate.period()) * (1 << self.late_answers.min(6))
    }
}
