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
/// The course that follows the end of the cue is asked for this long before it.
const END_LEAD: Duration = Duration::from_secs(1);
/// Hold frames that close a play.
const CLOSING_FRAMES: u8 = 3;

impl Engine {
    /// A few missed ticks leave a lag that is slewed away; after too many the lanes hold, then go on from rest.
    pub(super) fn count_missed(&mut self, missed: u64) {
        let gap = self.show.rate.offset(missed);
        let too_long = gap > LAG_HOLD && gap > self.show.rate.period();
        match self.phase {
            Phase::Stalled => self.playhead += gap,
            Phase::Riding | Phase::Parking if too_long => {
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

    /// Asks for the course that the present state will need, if it needs one.
    pub(super) fn look_ahead(&mut self) {
        let asked = self.switch.as_ref().map(|switch| switch.goal);
        match self.phase {
            Phase::Parking if self.reached >= self.course.settled() => {
                self.phase = Phase::Closing(CLOSING_FRAMES)
            }
            Phase::Riding | Phase::Stalled if self.homeward && asked == Some(Goal::Home) => {}
            Phase::Riding | Phase::Stalled if self.homeward => {
                let at = self.playhead + self.lead();
                self.ask(Goal::Home, at, at);
            }
            Phase::Stalled if asked.is_none() => {
                let at = self.playhead + self.lead();
                self.ask(Goal::Rejoin, at, at);
            }
            Phase::Riding if asked.is_none() => self.look_ahead_riding(),
            _ => {}
        }
    }

    fn look_ahead_riding(&mut self) {
        let soonest = self.playhead + self.lead();
        let lag = self.slew.lag();
        if lag > LAG_HOLD && lag > self.show.rate.period() {
            // Many small gaps: the lanes are moving, so they join from the lagging cue onto the true one.
            self.ask(Goal::Rejoin, soonest, soonest + lag);
            return;
        }
        let end = self.timeline.duration().max(self.course.settled());
        if self.playhead + END_LEAD >= end || soonest >= end {
            let at = end.max(soonest);
            if self.plays_left == Some(0) {
                self.ask(Goal::Home, at, at);
            } else {
                self.ask(Goal::Again, at, ShowTime::ZERO);
            }
        }
    }

    /// Asks for a course that takes over when show time, as it runs now, is `at`, and calls that instant `start`.
    fn ask(&mut self, goal: Goal, at: ShowTime, start: ShowTime) {
        self.drop_switch();
        let serial = self.course.serial;
        let from = match self.phase {
            Phase::Stalled => From::Stalled(serial, self.reached),
            _ => From::Course(serial, at),
        };
        let to = if goal == Goal::Home { To::Park } else { To::Cue };
        self.serial = self.serial.wrapping_add(1);
        let request = Request { from, to, start, serial: self.serial };
        let gained = if goal == Goal::Rejoin { start.as_nanos() - at.as_nanos() } else { 0 };
        let skipped = Duration::from_nanos(gained.unsigned_abs());
        self.switch = Some(Switch { goal, at, skipped, request, unsent: true, course: None });
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
        if switch.goal == Goal::Home {
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
        let Some(switch) =
            self.switch.take_if(|switch| switch.course.is_some() && self.playhead >= switch.at)
        else {
            return;
        };
        let Some(course) = switch.course else { return };
        let over = self.playhead.as_nanos() - switch.at.as_nanos();
        self.playhead = ShowTime::from_nanos(course.start.as_nanos() + over);
        self.slew.skip(switch.skipped);
        self.late_answers = 0;
        if switch.goal == Goal::Again {
            self.plays_left = self.plays_left.map(|left| left.saturating_sub(1));
        }
        self.phase = match switch.goal {
            Goal::Home if course.settled() <= course.start => Phase::Closing(CLOSING_FRAMES),
            Goal::Home => Phase::Parking,
            Goal::Again | Goal::Rejoin => Phase::Riding,
        };
        let old = std::mem::replace(&mut self.course, course);
        self.retired.put(Some(old));
    }

    fn drop_switch(&mut self) {
        let switch = self.switch.take();
        self.retired.put(switch.and_then(|switch| switch.course));
    }

    /// The time a planner is given: at least two ticks and 20 ms, twice as long after each answer that came too late.
    fn lead(&self) -> Duration {
        LEAD.max(2 * self.show.rate.period()) * (1 << self.late_answers.min(6))
    }
}
