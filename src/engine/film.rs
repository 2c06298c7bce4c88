//! A show that chases a film: show time is where that is, by a pace of its own, and where it is elsewhere the lanes join.

use std::time::Duration;

use super::{Directive, Engine, Phase, Rest};
use crate::time::ShowTime;

impl Engine {
    /// Where in the cue the frame of the next tick is to lead: told before each tick of a show that chases a film, as often as that
    /// can be followed.
    pub const fn chase(&mut self, target: ShowTime) {
        self.target = Some(target);
    }

    /// How long the frame of the next tick takes.
    #[must_use]
    pub fn frame_time(&self) -> Duration {
        Duration::from_millis(u64::from(self.show.rate.time_ms(self.frames)))
    }

    /// Takes up where the film is, before a frame that takes so long.
    pub(super) fn take_target(&mut self, time: Duration) {
        let Some(target) = self.target.take() else { return };
        if self.directive != Directive::Play {
            return;
        }
        let before = ShowTime::from_nanos(target.as_nanos() - (ShowTime::ZERO + time).as_nanos());
        match self.phase {
            // At the first frame, and out of a rest, the lanes join the film wherever it is.
            Phase::Settling | Phase::Riding if self.frames > 1 => {
                self.slew.set_owed_s(seconds_from(self.playhead, before));
            }
            Phase::Settling | Phase::Riding | Phase::Resting(Rest::Paused) => {
                self.halt(Rest::Film);
                self.slew.reset();
                self.playhead = before;
            }
            // Once a course is asked for, show time runs on to where that begins.
            Phase::Resting(Rest::Late | Rest::Film) if self.switch.is_none() => self.playhead = before,
            _ => {}
        }
    }
}

fn seconds_from(from: ShowTime, to: ShowTime) -> f64 {
    ShowTime::from_nanos(to.as_nanos() - from.as_nanos()).as_secs_f64()
}
