//! What is told of single lanes: what operators want of them, and what is seen of their controllers.

use super::lane::{LaneMode, LaneMotion};
use super::lanes::{LaneOrder, is_at};
use super::{Directive, Engine, Mix};
use crate::belief::{Fall, KnownPose};
use crate::motion::Pose;

impl Engine {
    /// One of its lanes.
    #[must_use]
    pub fn lane(&self, lane: usize) -> &LaneMotion {
        &self.lanes.all[lane]
    }

    /// Whether frames lead a lane, be it to rest.
    #[must_use]
    pub(crate) fn is_led(&self, lane: usize) -> bool {
        self.lane(lane).is_there() && !self.is_at_rest()
    }

    /// The pose that a lane was sent last, or in which it was found since; none where nothing goes to it.
    #[must_use]
    pub(crate) fn rests_at(&self, lane: usize) -> Option<&Pose> {
        let motion = self.lane(lane);
        (motion.is_there() && self.is_at_rest()).then(|| motion.pose())
    }

    /// Whether no frame has led any lane since all rested.
    fn is_at_rest(&self) -> bool {
        self.sends_nothing() || self.playhead.frames() == 0
    }

    /// Sets what a lane makes of the cue.
    pub(crate) fn mix(&mut self, lane: usize, mix: Mix) {
        let is_put_back = self.lanes.all[lane].want(mix);
        // While it was out nobody minded where it stands.
        if is_put_back && self.lane(lane).mode == LaneMode::Unseen && !self.sends_nothing() {
            self.lanes.fall_out(lane, Fall::PutBack);
        }
    }

    /// Does to a lane what has to be done whatever the hall wants.
    pub(crate) fn order(&mut self, lane: usize, order: LaneOrder) {
        match order {
            // Nothing goes to one of which nobody knows where it stands: it is out at once, and not led again as soon as it is read.
            LaneOrder::Leave if self.sends_nothing() || self.lane(lane).is_unseen() => {
                if self.lane(lane).takes_part() {
                    self.lanes.all[lane].step_out();
                }
            }
            LaneOrder::Leave => {
                self.brake(lane);
                self.lanes.all[lane].leave();
            }
            LaneOrder::Cut => self.lanes.all[lane].cut(),
            LaneOrder::FallOut(why) => self.lanes.fall_out(lane, why),
            // Of one at rest no frame is missing that it would need: it is read while it rests, and before the next goes to it.
            LaneOrder::GoBlind if self.sends_nothing() => {}
            LaneOrder::GoBlind => self.lanes.all[lane].go_blind(),
            LaneOrder::LoseSight => self.lanes.lose_sight(lane),
        }
    }

    /// Nothing goes to lanes any more that are led ahead: their seats are stopped where they are, by whoever leads them there, and not by
    /// poses that they would reach a while later.
    pub(crate) fn cut_led_ahead(&mut self) {
        let is_led_ahead = |motion: &LaneMotion| motion.is_there() && !motion.window.lead().is_zero();
        for lane in 0..self.lanes.all.len() {
            if !self.sends_nothing() && is_led_ahead(&self.lanes.all[lane]) {
                self.lanes.fall_out(lane, Fall::Stopped);
            }
        }
    }

    /// The seat of that lane, which was cut off, vibrates on about that pose: slow frames lead it there, without vibration. It is looked at
    /// then.
    pub(crate) fn still(&mut self, lane: usize, pose: &Pose) {
        self.lanes.all[lane].still(pose);
        self.stamps.break_off();
    }

    /// A frame left that is none of its own: the sum of Times at that controller is broken off.
    pub(crate) fn break_off(&mut self) {
        self.stamps.break_off();
    }

    /// The Time of so many ticks, this one included, ms.
    pub(crate) fn span_ms(&self, ticks: u32) -> u32 {
        self.show.rate.span_ms(self.playhead.frames() - 1, ticks)
    }

    /// The frame that leaves for a lane takes so many ticks, this one included: until they are over no other leaves.
    pub(crate) fn stretch(&mut self, lane: usize, ticks: u32) {
        self.lanes.all[lane].stretch(ticks);
    }

    /// The frames of a lane led it there, at that speed, strokes a second, and not where its poses are.
    pub(crate) fn led_instead(&mut self, lane: usize, (pose, speed): &(Pose, Pose)) {
        self.lanes.all[lane].led_instead(pose, speed);
    }

    /// Sets the pose of a lane that is blind one step further towards its rest, `farthest` being how far each slot may be from
    /// its present one. Says how long that takes, `longest_ms` at the most; none where nothing goes to the lane any more.
    pub(crate) fn slow_down(&mut self, lane: usize, longest_ms: u32, farthest: &Pose) -> Option<u32> {
        let (index, rate) = (self.playhead.frames() - 1, self.show.rate);
        let lasts_ms = self.lanes.all[lane].slow_down(index, rate, longest_ms, farthest);
        if lasts_ms.is_none() {
            self.lanes.fall_out(lane, Fall::Gap);
        }
        lasts_ms
    }

    /// A lane's seat is known to be at rest in that pose, `near` of which is noise. One that was away is there again, and joins the
    /// others where they follow the cue; one that rests goes on from there; one that is under way goes on.
    pub(crate) fn found(&mut self, lane: usize, known: &KnownPose, near: &Pose) {
        let is_ready = matches!(self.directive, Directive::Wait | Directive::Play);
        let is_fresh = is_ready && self.playhead.frames() == 0 && self.phase.rest().is_none();
        let rests = self.is_at_rest() && self.phase.next().is_none_or(|next| next.is_none());
        let motion = &mut self.lanes.all[lane];
        // As far as readings are noise: exactly at park no encoder ever says that it is.
        let at_park = is_at(&motion.window, known.pose(), &motion.window.park(), near);
        match motion.mode {
            // One that is out is left where it stands.
            LaneMode::Unseen | LaneMode::Away if !motion.wanted.on => motion.mode = LaneMode::Unseen,
            // The course begins at park.
            LaneMode::Unseen | LaneMode::Still if is_fresh && at_park => motion.begin_at_park(known),
            LaneMode::Unseen | LaneMode::Away => {
                motion.come_back(known);
                // Its controller's sum of Times has been broken off.
                self.stamps.break_off();
                // What was to follow the end was planned without it.
                let next = self.phase.next().and_then(|next| next.as_ref());
                if next.is_some_and(|next| next.goal.is_after_the_end()) {
                    self.give_up_replans();
                }
            }
            // Somebody moved it, or it was homed.
            _ if rests && !is_at(&motion.window, known.pose(), motion.pose(), near) => {
                motion.come_back(known);
            }
            _ => {}
        }
    }
}
