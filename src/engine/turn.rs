//! Changes of course: when one is needed, what the planner is asked for, and what becomes of its answer.

use std::time::Duration;

use super::switch::{Goal, Switch};
use super::{Ending, Engine, Phase};
use crate::plan::{Course, From, Request, To};
use crate::time::ShowTime;

/// A lag beyond this, and beyond one period, is not slewed away: the lanes hold, then join.
const LAG_HOLD: Duration = Duration::from_millis(50);
/// A course is asked for at least this long before it is to begin, and at least two ticks.
const LEAD: Duration = Duration::from_millis(20);
/// In this time show time surely comes back to the pace of the clock.
const SLOWING: Duration = Duration::from_millis(150);
/// Hold frames that close a play.
const CLOSING_FRAMES: u8 = 3;

impl Engine {
    /// A few missed ticks leave a lag that is slewed away; after too many the lanes hold, then go on from rest.
    pub(super) fn count_missed(&mut self, missed: u64) {
        let gap = self.show.rate.offset(missed);
        match self.phase {
            Phase::Stalled if missed > 0 => {
                // A course that was to begin in the gap would be taken up in its middle.
                self.drop_switch();
                self.playhead += gap;
            }
            Phase::Riding | Phase::Parking if self.is_too_long(gap) => {
                // The controllers reached the last pose and stand there.
                self.homeward |= self.phase == Phase::Parking;
                self.playhead += gap + self.slew.lag();
                self.slew.reset();
                self.stamps.break_off();
                self.drop_switch();
                self.phase = Phase::Stalled;
            }
            Phase::Riding => self.slew.fall_behind(gap),
            _ => {}
        }
    }

    /// Whether a gap or a lag is more than can be slewed away.
    fn is_too_long(&self, span: Duration) -> bool {
        span > LAG_HOLD && span > self.show.rate.period()
    }

    /// How much show time passes in a frame of that Time.
    pub(super) fn pass(&mut self, time: Duration) -> Duration {
        match (self.phase, &self.switch) {
            (Phase::Stalled, _) => time,
            (Phase::Riding, Some(switch)) if switch.pace > 1.0 => self.slew.coast(time),
            (Phase::Riding, Some(switch)) if switch.at <= self.playhead + SLOWING => {
                self.slew.advance(time, 0.0)
            }
            (Phase::Riding, _) => self.slew.advance(time, self.headroom.at(self.playhead)),
            _ => self.slew.advance(time, 0.0),
        }
    }

    /// Asks for the course that the present state will need, if it needs one.
    pub(super) fn look_ahead(&mut self) {
        let asked = self.switch.as_ref().map(|switch| switch.goal);
        let soonest = self.playhead + self.lead();
        match self.phase {
            Phase::Parking if self.reached >= self.course.settled() => {
                self.phase = Phase::Closing(CLOSING_FRAMES)
            }
            Phase::Riding | Phase::Stalled if self.homeward && self.stopping() => {}
            // The old course ends before another can begin on it: what is to come begins on the one that follows.
            Phase::Riding if self.turns_between(self.playhead, soonest) => {}
            Phase::Riding | Phase::Stalled if self.homeward => self.ask(Goal::Stop, soonest, soonest),
            Phase::Stalled if asked.is_none() => self.ask(Goal::Rejoin, soonest, soonest),
            Phase::Riding => self.look_ahead_riding(asked, soonest),
            _ => {}
        }
    }

    /// Whether the way home that was asked for is a stop, not the one that follows the end of the cue.
    fn stopping(&self) -> bool {
        self.switch.as_ref().is_some_and(|switch| switch.goal == Goal::Stop)
    }

    fn turns_between(&self, from: ShowTime, to: ShowTime) -> bool {
        let mut turns = self.switch.iter().chain(&self.spare);
        turns.any(|switch| (from..=to).contains(&switch.at))
    }

    fn look_ahead_riding(&mut self, asked: Option<Goal>, soonest: ShowTime) {
        let lag = self.slew.lag();
        if self.is_too_long(lag) {
            if asked != Some(Goal::Rejoin) {
                // Many small gaps: the lanes are moving, so they join from the lagging cue onto the true one.
                self.ask(Goal::Rejoin, soonest, soonest + lag);
            }
        } else if asked.is_none() {
            // What follows the end is known all along, so that the planner has all the time there is.
            let end = self.timeline.duration().max(self.course.settled()).max(soonest);
            if self.plays_left == Some(0) {
                self.ask(Goal::Home, end, end);
            } else {
                self.ask(Goal::Again, end, ShowTime::ZERO);
            }
        }
    }

    /// Asks for a course that takes over when show time, as it runs now, is `at`, and calls that instant `start`.
    fn ask(&mut self, goal: Goal, at: ShowTime, start: ShowTime) {
        // Should the planner be slow, and the cue end before its answer, the lanes go on as was planned for the end.
        let spare = if matches!(goal, Goal::Stop | Goal::Rejoin) {
            let after_the_end = |switch: &mut Switch| matches!(switch.goal, Goal::Home | Goal::Again);
            self.spare.take().or_else(|| self.switch.take_if(after_the_end))
        } else {
            None
        };
        self.drop_switch();
        self.spare = spare;
        let serial = self.course.serial;
        // Given the time, the pace is brought back to the clock's; at short notice it is kept.
        let pace = if at > self.playhead + SLOWING { 1.0 } else { self.slew.pace() };
        let from = match self.phase {
            Phase::Stalled => From::Stalled { serial, at: self.reached },
            _ => From::Course { serial, at, pace },
        };
        let to = if matches!(goal, Goal::Home | Goal::Stop) { To::Park } else { To::Cue };
        self.serial = self.serial.wrapping_add(1);
        let request = Request { from, to, start, serial: self.serial };
        let gained = if goal == Goal::Rejoin { start.as_nanos() - at.as_nanos() } else { 0 };
        let skipped = Duration::from_nanos(gained.unsigned_abs());
        self.switch = Some(Switch { goal, at, pace, skipped, request, unsent: true, course: None });
    }

    /// The request that the planner has not seen yet.
    pub fn take_request(&mut self) -> Option<Request> {
        let switch = self.switch.as_mut().filter(|switch| switch.unsent)?;
        switch.unsent = false;
        Some(switch.request)
    }

    /// Hands over a course that the planner made. One that nobody waits for any more, or that came after its time, is
    /// not taken up.
    pub fn offer(&mut self, course: Box<Course>) {
        match &mut self.switch {
            Some(switch) if switch.request.serial == course.serial && self.playhead <= switch.at => {
                switch.course = Some(course);
            }
            Some(switch) if switch.request.serial == course.serial => {
                self.retired.put(Some(course));
                self.late_answers += 1;
                self.switch = None; // asked again, with more time, at this tick's end
            }
            _ => self.retired.put(Some(course)),
        }
    }

    /// Hears that the planner found no course for the request of that serial: the lanes park, or close where they are.
    pub fn refuse(&mut self, serial: u32) {
        let Some(switch) = self.switch.as_ref().filter(|switch| switch.request.serial == serial) else {
            return;
        };
        self.ending = Ending::Fault;
        self.homeward = true;
        if switch.goal == Goal::Stop {
            self.phase = Phase::Closing(CLOSING_FRAMES);
        }
        self.switch = None;
    }

    /// A course that is to be freed on another thread.
    pub fn take_retired(&mut self) -> Option<Box<Course>> {
        self.retired.take()
    }

    /// Takes up the new course when its time has come.
    pub(super) fn take_switch(&mut self) {
        let due = |switch: &mut Switch| switch.course.is_some() && self.playhead > switch.at;
        let Some(switch) = self.switch.take_if(due).or_else(|| self.spare.take_if(due)) else { return };
        let Some(course) = switch.course else { return };
        self.drop_switch();
        let over = self.playhead.as_nanos() - switch.at.as_nanos();
        self.playhead = ShowTime::from_nanos(course.start.as_nanos() + over);
        self.slew.skip(switch.skipped);
        self.late_answers = 0;
        if switch.goal == Goal::Again {
            self.plays_left = self.plays_left.map(|left| left.saturating_sub(1));
        }
        self.phase = match switch.goal {
            Goal::Home | Goal::Stop if course.settled() <= course.start => Phase::Closing(CLOSING_FRAMES),
            Goal::Home | Goal::Stop => Phase::Parking,
            Goal::Again | Goal::Rejoin => Phase::Riding,
        };
        let old = std::mem::replace(&mut self.course, course);
        self.retired.put(Some(old));
    }

    fn drop_switch(&mut self) {
        for switch in [self.switch.take(), self.spare.take()] {
            self.retired.put(switch.and_then(|switch| switch.course));
        }
    }

    /// The time a planner is given: at least two ticks and 20 ms, twice as long after each answer that came too late.
    fn lead(&self) -> Duration {
        LEAD.max(2 * self.show.rate.period()) * (1 << self.late_answers.min(6))
    }
}
