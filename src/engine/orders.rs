//! What the engine is told to do. None of it waits: each is taken up by the tick it is told before.

use super::wait::is_at;
use super::{Directive, Ending, Engine, Mix, Part, Phase, Rest, first_phase};
use crate::belief::{Fall, KnownPose};
use crate::motion::Pose;
use crate::time::{ShowTime, TRIM_MS};

impl Engine {
    /// Takes what the hall wants, as often as it is told. One that waits goes on waiting through a stop.
    pub fn obey(&mut self, directive: Directive) {
        let before = std::mem::replace(&mut self.directive, directive);
        match directive {
            Directive::Off | Directive::Wait => {}
            Directive::Play => {
                if self.phase == Phase::Waiting {
                    self.phase = first_phase(&self.show);
                }
            }
            Directive::Hold => self.pause(),
            Directive::Stop => self.stop(),
            Directive::Park if before == Directive::Park => {}
            Directive::Park => self.park(),
        }
    }

    /// Parks, hold frames, and the end.
    ///
    /// Before the first frame, and after the last, only lanes that are astray are brought there. Where none is, it is the end, and no
    /// frame goes out; between shows once that was read. One that was let go ends at once: nothing has been set in motion, and the
    /// lanes may still be on a slow way to park, or where nobody knows.
    fn park(&mut self) {
        let is_fresh = self.frames == 0 && self.rest().is_none();
        match self.phase {
            Phase::Parking | Phase::Closing(_) => return,
            Phase::Done | Phase::Waiting => self.rest_untold(),
            _ if is_fresh && self.is_astray() => self.rest_untold(),
            _ if is_fresh => self.phase = Phase::Done,
            Phase::Settling | Phase::Riding | Phase::Braking(_) | Phase::Resting(_) => {}
        }
        self.ending = Ending::Stopped;
    }

    /// Brings lanes that are to park to rest without the planner, where it has not told the way: from there it is asked anew.
    pub fn rest_to_park(&mut self) {
        if self.is_to_park() && self.phase == Phase::Riding {
            self.come_down(Rest::Ended);
        }
    }

    /// Ends the play where the lanes are.
    pub fn end(&mut self) {
        self.phase = Phase::Done;
    }

    /// Brings the lanes to rest at once, without the planner; then hold frames, and no more.
    fn stop(&mut self) {
        if matches!(self.phase, Phase::Waiting | Phase::Done) {
            return;
        }
        (self.seeking, self.ending) = (None, Ending::Stopped);
        match self.phase {
            // Of a course that was asked for to park from there nothing may begin any more.
            _ if self.rest() == Some(Rest::Stopped) => self.drop_switch(),
            _ => self.come_down(Rest::Stopped),
        }
    }

    /// Brings the lanes to rest at once, without the planner, and holds them there; the film waits.
    fn pause(&mut self) {
        match self.phase {
            Phase::Settling
            | Phase::Riding
            | Phase::Braking(Rest::Ended)
            | Phase::Resting(Rest::Late | Rest::Film | Rest::Ended) => self.come_down(Rest::Paused),
            Phase::Resting(Rest::Paused) => self.drop_switch(),
            _ => {}
        }
    }

    /// Goes on elsewhere in the film, from a pause once it is resumed. A time after the end is the end.
    pub fn seek(&mut self, film: ShowTime) {
        let target = self.cue_time(film.min(self.timeline.duration()));
        match self.phase {
            Phase::Braking(Rest::Paused) | Phase::Resting(Rest::Paused) => {
                self.drop_switch();
                self.playhead = target;
            }
            Phase::Settling | Phase::Riding | Phase::Resting(Rest::Late) if !self.is_to_park() => {
                self.seeking = Some(target);
            }
            _ => {}
        }
    }

    /// Sets how much later than the film the motion is, ±[`TRIM_MS`]; it is slewed in.
    pub fn trim(&mut self, ms: i32) {
        let ms = ms.clamp(-TRIM_MS, TRIM_MS);
        let sooner_s = f64::from(self.trim_ms - ms) * 1e-3;
        if sooner_s == 0.0 {
            return;
        }
        self.trim_ms = ms;
        self.slew.owe(sooner_s);
        if self.rest() == Some(Rest::Paused) && self.switch.is_none() {
            self.catch_up();
        }
    }

    /// Sets what a lane makes of the cue.
    pub fn mix(&mut self, lane: usize, mix: Mix) {
        let sends_nothing = self.sends_nothing();
        let rider = &mut self.riders[lane];
        rider.refused &= rider.wanted.on == mix.on;
        let is_put_back = mix.on && !rider.wanted.on;
        rider.wanted = mix;
        // While it was out nobody minded where it stands.
        if is_put_back && rider.part == Part::Unseen && !sends_nothing {
            rider.fall_out(Fall::PutBack);
        }
    }

    /// Brings one lane to rest; after its hold frames nothing goes to it.
    pub fn leave(&mut self, lane: usize) {
        if !self.sends_nothing() {
            self.brake(lane);
            self.riders[lane].leave();
        } else if self.takes_part(lane) {
            self.riders[lane].step_out();
        }
    }

    /// Nobody knows which frames reach a lane: it is brought to rest by frames that are slow enough from wherever it may be
    /// ([`Engine::slow_down`]), and then it is away, until it is found.
    pub fn go_blind(&mut self, lane: usize) {
        if self.sends_nothing() {
            return self.fall_out(lane, Fall::Gap);
        }
        self.riders[lane].go_blind();
    }

    /// The seat of that lane, which was cut off, vibrates on about that pose: slow frames lead it there, without vibration. It is looked at
    /// then.
    pub fn still(&mut self, lane: usize, pose: &Pose) {
        if self.sends_nothing() {
            return self.fall_out(lane, Fall::Gap);
        }
        self.riders[lane].still(pose);
        self.stamps.break_off();
    }

    /// Nobody knows any more where the seat of that lane is: nothing goes to it until it is found.
    pub fn lose_sight(&mut self, lane: usize) {
        self.riders[lane].lose_sight();
    }

    /// Nothing goes to that lane from now on.
    pub fn cut(&mut self, lane: usize) {
        self.riders[lane].cut();
    }

    /// The same, and it is to be looked at.
    pub fn fall_out(&mut self, lane: usize, why: Fall) {
        self.riders[lane].fall_out(why);
    }

    /// A lane's seat is known to be at rest in that pose, `near` of which is noise. One that was away is there again, and joins the
    /// others where they follow the cue; one that rests goes on from there; one that is under way goes on.
    pub fn found(&mut self, lane: usize, known: &KnownPose, near: &Pose) {
        let is_ready = matches!(self.directive, Directive::Wait | Directive::Play);
        let is_fresh = is_ready && self.frames == 0 && self.rest().is_none();
        let rests = self.is_at_rest() && self.switch.is_none();
        let rider = &mut self.riders[lane];
        let at_park = is_at(&rider.window, known.pose(), &rider.window.park(), near);
        match rider.part {
            // One that is out is left where it stands.
            Part::Unseen | Part::Away if !rider.wanted.on => rider.part = Part::Unseen,
            // The course begins at park.
            Part::Unseen | Part::Still if is_fresh && at_park => rider.begin_at_park(known),
            Part::Unseen | Part::Away => {
                rider.come_back(known);
                // Its controller's sum of Times has been broken off.
                self.stamps.break_off();
                // What was to follow the end was planned without it.
                if self.switch.as_ref().is_some_and(|switch| switch.goal.is_after_the_end()) {
                    self.drop_switch();
                }
            }
            // Somebody moved it, or it was homed.
            _ if rests && !is_at(&rider.window, known.pose(), rider.pose(), near) => rider.come_back(known),
            _ => {}
        }
    }

    /// Where in the cue the lanes are to be at a time of the film.
    pub(super) fn cue_time(&self, film: ShowTime) -> ShowTime {
        ShowTime::from_nanos(film.as_nanos() - i64::from(self.trim_ms) * 1_000_000)
    }
}
